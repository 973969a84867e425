//! Snapshots of certificates: the verdict on each property. Numbers are left out.
#![allow(clippy::unwrap_used)] // a test

use holonom::certificate::page::{sentence, verdict};
use holonom::certificate::{ModelCertificate, certify_model};
use holonom::verification::certificate::{Criterion, Verdict};
use holonom::{Model, Override};
use vi_testkit::model::{between, body_at, head, heavy, part, particle, two_links};

/// Text with every number replaced by `#`.
fn without_numbers(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars().map(|c| if c.is_ascii_digit() { '#' } else { c }) {
        let inside = matches!(c, '#' | '.' | 'e' | '-') && out.ends_with('#');
        if !inside {
            out.push(c);
        }
    }
    out
}

/// A line for each finding: criterion, quantity, method, order, verdict, and the reason of all but
/// a pass.
fn judged(model: &Model) -> String {
    let certificate = certify_model(model, 1e-6, &mut |_| {}).unwrap();
    let mut text = format!("{}\n", without_numbers(&verdict(&certificate)));
    for step in &certificate.steps {
        text += &format!("{}\n", without_numbers(&sentence(step, certificate.accuracy)));
    }
    for f in &certificate.certificate.findings {
        let of = f.method.map_or(String::new(), |m| format!("{} {}: ", m.name(), f.order));
        let verdict = f.verdict.name();
        let (criterion, quantity) = (f.criterion.name(), &f.quantity);
        let reason = if verdict == "pass" { String::new() } else { without_numbers(&f.reason) };
        text += format!("{of}{criterion} of {quantity}: {verdict} {reason}").trim_end();
        text.push('\n');
    }
    text
}

macro_rules! shipped {
    ($name:literal) => {
        include_str!(concat!("../../examples/models/", $name, ".toml"))
    };
}

#[test]
fn certificates_of_shipped_models() {
    let own = |text: &str, key: &str, value: &str| {
        Model::from_toml_with(text, &[Override::new(key, value)]).unwrap()
    };
    let pendulum = Model::from_toml(shipped!("pendulum")).unwrap();
    insta::assert_snapshot!("certificate_pendulum", judged(&pendulum));
    let governor = Model::from_toml(shipped!("flyball_governor")).unwrap();
    insta::assert_snapshot!("certificate_flyball_governor", judged(&governor));
    let coarse = own(shipped!("four_particles"), "simulation.step", "0.2");
    insta::assert_snapshot!("certificate_four_particles_coarse", judged(&coarse));
}

const BOX: &str = include_str!("../models/resting_box.toml");

#[test]
fn a_system_at_rest_has_no_certificate() {
    let model = Model::from_toml(BOX).unwrap();
    let refused = certify_model(&model, 1e-6, &mut |_| {}).unwrap_err();
    println!("{refused}");
    assert!(refused.starts_with("nothing moves: no order"));
}

/// A translation is exact at any step: the step that is recommended is one that was measured.
#[test]
fn no_step_is_recommended_beyond_what_was_measured() {
    let model = Model::from_toml(&BOX.replace("velocity = [0, 0, 0]", "velocity = [1, 0, 0]"));
    let certificate = certify_model(&model.unwrap(), 1e-6, &mut |_| {}).unwrap();
    for found in &certificate.steps {
        println!("{found:?}");
        assert!(found.step.is_none_or(|step| step <= 0.01), "{found:?}");
        assert!(found.reason.contains("larger steps were not measured"), "{found:?}");
    }
}

/// A model of the folder `tests/models`, its certificate by the scheme `scheme`.
fn certified(name: &str, scheme: &str) -> ModelCertificate {
    let file = format!("{}/../../tests/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(file).unwrap();
    let model = Model::from_toml_with(&text, &[Override::new("simulation.scheme", scheme)]);
    certify_model(&model.unwrap(), 1e-6, &mut |_| {}).unwrap()
}

/// Sound models of all kinds pass: nothing free, reactions of zero, forces that begin at zero or
/// late, motions that no step follows after their end, beams held at both ends. What rests at first
/// is measured from where it begins to move; what falls from rest is measured from there.
#[test]
fn sound_models_do_not_fail() {
    for (name, scheme, begins) in [
        ("driven_four_bar", "nodal", Some(0.0)),
        ("driven_wiper", "em-nodal", None),
        ("mass_on_spring", "nodal", None),
        ("mass_on_two_springs", "nodal", None),
        ("ramped_slide", "nodal", None),
        ("ramped_slide", "em-dalembert", None),
        ("translating_body", "nodal", None),
        ("clamped_beam", "nodal", None),
        ("planar_particles", "nodal", None),
        ("resting_crane", "nodal", Some(1.0)),
        ("late_motor", "nodal", Some(3.5)),
        ("rotor_that_speeds_up", "nodal", None),
        ("planar_satellite", "nodal", None),
        ("pulsed_arm", "nodal", None),
    ] {
        let found = certified(name, scheme);
        println!("{name}, {scheme}: {}, from t = {} s on", verdict(&found), found.from);
        let failed = found.certificate.findings.iter().find(|f| f.verdict == Verdict::Fail);
        assert!(failed.is_none(), "{name}, {scheme}: {}", failed.unwrap());
        let passed = found.certificate.count(Verdict::Pass);
        assert!(passed >= 50, "{name}, {scheme}: {passed} pass");
        let late = begins.map_or(0.0, |begins: f64| found.from - begins);
        assert!((0.0..0.1).contains(&late), "{name}: measured from {} s on", found.from);
    }
}

/// A rotor at 1.2 rad in a step: the first step fails, and the certificate says so.
#[test]
fn a_run_whose_first_step_fails_is_not_at_rest() {
    let text = include_str!("../models/rotor_that_speeds_up.toml");
    let model = Model::from_toml_with(text, &[Override::new("joint.shaft.rate", "120.0")]);
    let found = certify_model(&model.unwrap(), 1e-6, &mut |_| {}).unwrap();
    let failed = found.certificate.findings.iter().find(|f| f.verdict == Verdict::Fail).unwrap();
    println!("{failed}");
    assert_eq!((failed.quantity.as_str(), &*failed.measured), ("run", "the run failed"));
}

/// Six driven joints: the motion is prescribed, momenta and multipliers converge, what needs a
/// degree of freedom is not applicable.
#[test]
fn a_mechanism_without_a_degree_of_freedom_has_a_certificate() {
    let found = certified("driven_arm", "nodal").certificate;
    let of = |criterion, quantity: &str| {
        let all = found.findings.iter().filter(move |f| f.criterion == criterion);
        all.filter(|f| f.quantity == quantity).collect::<Vec<_>>()
    };
    assert!(found.holds() && found.count(Verdict::Inconclusive) == 0);
    for quantity in ["p (constrained, 34)", "λ (36)"] {
        for f in of(Criterion::Order, quantity) {
            println!("{f}");
            let order = f.value.unwrap();
            assert!(f.verdict == Verdict::Pass && (order - 2.0).abs() < 0.1, "{f}");
        }
    }
    let form = of(Criterion::Symplecticity, "change of Ω");
    let matrix = of(Criterion::Conditioning, "κ ~ h^a, as written; as factorized");
    assert!(!form.is_empty() && !matrix.is_empty());
    for f in form.into_iter().chain(matrix) {
        assert_eq!(f.verdict, Verdict::NotApplicable, "{f}");
    }
}

/// A double pendulum whose elbow has a stop and friction.
#[test]
fn certificates_of_stops_and_friction_say_what_holds() {
    // until the rate of the elbow turns under more than its friction, which is of order 1
    let door = heavy("door", [0.0, 0.0, -9.81], "step = 0.005, end = 0.25")
        + &two_links([1.0, 0.8], [[0.01, 0.08, 0.08], [0.01, 0.06, 0.06]], ["rate = 1.0\n", ""])
        + "rate = -2.0\nlimits = { lower = -0.3, restitution = 0.6 }\nfriction = { torque = 0.2 }\n";
    let certificate = certify_model(&Model::from_toml(&door).unwrap(), 1e-6, &mut |_| {}).unwrap();
    holds(
        &certificate,
        &[
            "q, with stops and friction",
            "constraints, with stops and friction",
            "excess over limits, with stops and friction",
            "work of stops and friction, with stops and friction",
            "balance with all works, with stops and friction",
        ],
    );
    let not: Vec<&str> = (certificate.certificate.findings.iter())
        .filter(|finding| finding.verdict == Verdict::NotApplicable)
        .map(|finding| finding.quantity.as_str())
        .collect();
    assert_eq!(not.len(), 4, "{not:?}");
}

/// Two balls that meet aside of their centres, and a ball that slides on a floor.
#[test]
fn certificates_of_contact_say_what_holds() {
    let ball = |name: &str, position: [f64; 3], keys: &str| {
        body_at(position, name, 1.0, [0.01; 3])
            + keys
            + "shape = { type = \"sphere\", dimensions = [0.1] }\n"
    };
    let free = head("meet", "step = 0.01, end = 0.6")
        + &ball("a", [0.0; 3], "velocity = [1.0, 0.0, 0.0]\nangular_velocity = [3.0, -2.0, 4.0]\n")
        + &ball("b", [0.5, 0.08, 0.03], "velocity = [-0.2, 0.0, 0.1]\n")
        + &part("contact", "pair")
        + "a = \"a\"\nb = \"b\"\nfriction = 0.3\nrestitution = 0.6\n";
    let floor = heavy("slide", [0.0, 0.0, -9.81], "step = 0.01, end = 0.3")
        + &ball(
            "a",
            [0.0, 0.0, 0.1],
            "velocity = [2.0, 0.0, 0.0]\nangular_velocity = [3.0, 0.0, 0.0]\n",
        )
        + &part("contact", "floor")
        + "a = { plane = {} }\nb = \"a\"\nfriction = 0.2\n";
    let common = [
        "q, with contact",
        "overlap of shapes, with contact",
        "work of contacts, stops and friction, with contact",
        "balance with all works, with contact",
    ];
    let of =
        |text: &str| certify_model(&Model::from_toml(text).unwrap(), 1e-6, &mut |_| {}).unwrap();
    let momentum = "linear and angular momentum, with contact";
    let both = [of(&free), of(&floor)];
    holds(&both[0], &[&common[..], &[momentum]].concat());
    holds(&both[1], &common);
    let own = both[1].certificate.findings.iter().find(|own| own.quantity == momentum).unwrap();
    assert_eq!(
        (own.verdict, own.reason.as_str()),
        (Verdict::NotApplicable, "the ground takes part")
    );
}

/// Two links that a law drives, one locked and both let go, and a disc whose cord is cut: each kind
/// of event has its rows, and each law its balance.
#[test]
fn certificates_across_events_say_what_each_keeps() {
    let links =
        two_links([1.0, 0.8], [[0.01, 0.08, 0.08], [0.01, 0.06, 0.06]], ["rate = 1.0\n", ""]);
    let text = heavy("links", [0.0, 0.0, -9.81], "step = 0.005, end = 0.6")
        + &links
        + "rate = -2.0\n"
        + &part("law", "drive")
        + "joint = \"shoulder\"\neffort = \"-3*x - v\"\n"
        + &part("law", "coil")
        + "joint = \"elbow\"\neffort = \"-2*x - x^3\"\n"
        + &part("event", "latch")
        + "when = \"elbow < -0.2\"\nlock = [\"elbow\"]\n"
        + &part("event", "idle")
        + "at = 0.32\ndisable = [\"drive\"]\n"
        + &part("event", "drop")
        + "at = 0.45\nrelease = [\"shoulder\"]\n";
    let certificate = certify_model(&Model::from_toml(&text).unwrap(), 1e-6, &mut |_| {}).unwrap();
    let rows = [
        "work of `drive` less ∫ P dt",
        "work of `coil` less ∫ P dt",
        "balance with all works",
        "q, across events",
        "constraints in force, across events",
        "conditions where events act, across events",
        "velocities and momentum maps at releases, across events",
        "velocities and momentum maps at switched parts, across events",
        "loss of locks less ½ Δvᵀ M Δv, across events",
    ];
    holds(&certificate, &rows);
    let lock = certificate.certificate.findings.iter().find(|f| f.quantity.starts_with("loss"));
    assert!(!lock.unwrap().measured.starts_with("0.000"), "{lock:?}");

    let disc = include_str!("../../examples/models/rolling_disc.toml").to_owned()
        + &particle("load", 0.1, [0.0, 0.0, 1.0])
        + &between("spring", "cord", ["disc", "load"])
        + "stiffness = 20.0\n"
        + &part("event", "cut")
        + "when = \"disc.x > 0.15\"\nrelease = [\"cord\"]\n";
    let end = [Override::new("simulation.end", "0.4")];
    let model = Model::from_toml_with(&disc, &end).unwrap();
    let certificate = certify_model(&model, 1e-6, &mut |_| {}).unwrap();
    holds(&certificate, &["slip of what rolls, across events"]);
}

/// That these rows are there and pass.
fn holds(certificate: &ModelCertificate, rows: &[&str]) {
    for row in rows {
        let found = certificate.certificate.findings.iter().find(|f| f.quantity == *row);
        let found = found.unwrap_or_else(|| panic!("no row `{row}`"));
        println!("{row}: {} ({})", found.measured, found.verdict.name());
        assert_eq!(found.verdict, Verdict::Pass, "{found:?}");
    }
}
