//! `[[contact]]` in model files: what is refused, what is left out, what is said.

use crate::harness::case::distance;
use holonom::model::{ModelText, Problem};
use holonom::run::prepare;
use holonom::{Model, ModelError, RunOutcome, Sample};
use vi_testkit::Sample as Random;
use vi_testkit::model::{changed, heavy, part};

const DOWN: [f64; 3] = [0.0, 0.0, -9.81];

/// Two balls over a plane, one of them on a slide.
const BALLS: &str = include_str!("../models/balls.toml");

fn problems(text: &str) -> Vec<Problem> {
    let error = match Model::from_toml(text) {
        Err(error) => error,
        Ok(model) => prepare(&model).err().unwrap_or_else(|| panic!("{text} is refused")),
    };
    match error {
        ModelError::Invalid(problems) | ModelError::Assembly(problems) => problems,
        other => panic!("{other:?}"),
    }
}

/// The first problem, with its remedy.
fn said(text: &str) -> String {
    let first = problems(text).swap_remove(0);
    let said = format!("{}: {} | {}", first.key, first.message, first.help.unwrap_or_default());
    println!("{said}");
    said
}

/// Many bodies of one contact have a broad phase: the same motion, forces and words as with a
/// contact for each pair.
#[test]
fn many_bodies_move_as_their_pairs() {
    const COUNT: usize = 12;
    let ball = |k: usize| {
        let (x, y, z) = (0.11 * (k % 3) as f64, 0.11 * (k / 3 % 2) as f64, 0.1 * (k / 6) as f64);
        let at = [x, y + 0.02 * z, 0.06 + 1.2 * z];
        let shape = match k {
            5 => {
                "collision = [{ type = \"sphere\", dimensions = [0.04], position = [0.0, 0.0, 0.01] }, { type = \"sphere\", dimensions = [0.03] }]"
            }
            _ => "shape = { type = \"sphere\", dimensions = [0.05] }",
        };
        let velocity = [0.4 - 0.3 * (k % 3) as f64, 0.0, -0.5];
        format!(
            "{}mass = 1.0\ninertia = [0.001, 0.001, 0.001]\nposition = {at:?}\nvelocity = {velocity:?}\n{shape}\n",
            part("body", &format!("ball{k:02}"))
        )
    };
    let head =
        heavy("heap", DOWN, "step = 0.005, end = 0.15, contact = \"stepping\", contacts = true");
    let common = head
        + &(0..COUNT).map(ball).collect::<String>()
        + &part("contact", "floor")
        + "a = { plane = {} }\nb = \"ball*\"\nfriction = 0.3\n"
        + &part("sensor", "force")
        + "type = \"contact_force\"\nof = \"ball04\"\n";
    let one = part("contact", "balls") + "a = \"ball*\"\nb = \"ball*\"\nfriction = 0.3\n";
    let each = |(a, b): (usize, usize)| {
        format!(
            "{}a = \"ball{a:02}\"\nb = \"ball{b:02}\"\nfriction = 0.3\n",
            part("contact", &format!("{a} {b}"))
        )
    };
    let pairs = (0..COUNT).flat_map(|a| (a + 1..COUNT).map(move |b| (a, b))).map(each);
    let of = |rules: &str| {
        let model = Model::from_toml(&(common.clone() + rules)).unwrap();
        let mut simulation = holonom::Simulation::new(&model).unwrap();
        let all: Vec<Sample> = simulation.samples().map(|own| own.unwrap()).collect();
        all
    };
    let (group, pairs) = (of(&one), of(&pairs.collect::<String>()));
    let mut touching = 0;
    for (group, pairs) in group.iter().zip(&pairs) {
        let apart = group.q.iter().zip(&pairs.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-9, "t = {}: {apart:e}", group.t);
        assert_eq!(group.contacts.len(), pairs.contacts.len());
        touching = touching.max(group.contacts.len());
        let words = |sample: &Sample| {
            let mut all: Vec<String> = sample.events.iter().map(|own| own.action.clone()).collect();
            all.sort();
            all
        };
        assert_eq!(words(group), words(pairs), "t = {}", group.t);
        let force = group.sensors.iter().zip(&pairs.sensors);
        assert!(force.into_iter().all(|(a, b)| (a - b).abs() < 1e-5 || a.is_nan() && b.is_nan()));
    }
    println!("up to {touching} points touch");
    assert!(touching > 12, "{touching}");
}

/// Boxes that tumble and fall flat: corners that are hit beside corners that stay, corners that
/// stick while the box turns, with laws that contradict one another.
#[test]
fn boxes_that_fall_come_to_lie_flat() {
    let mut flat = 0;
    for seed in 0..16 {
        let mut sample = Random::new(seed);
        let mut number = || sample.number();
        let size = [0; 3].map(|_| 0.2 * 10.0_f64.powf(number()));
        let turned = [0; 3].map(|_| 3.0 * number());
        let spin = [0; 3].map(|_| 5.0 * number());
        let (friction, restitution) = (0.5 + 0.5 * number(), 0.4 + 0.4 * number());
        let method = ["events", "stepping"][seed as usize % 2];
        let model = [
            heavy(
                "brick",
                DOWN,
                &format!("step = 0.002, end = 1.2, contact = \"{method}\", contacts = true"),
            ),
            part("body", "brick"),
            format!("shape = {{ type = \"box\", dimensions = {size:?}, density = 800.0 }}\n"),
            format!("position = [0.0, 0.0, {:?}]\n", 0.05 + 0.5 * size.iter().sum::<f64>()),
            format!("rotation_vector = {turned:?}\nangular_velocity = {spin:?}\n"),
            part("contact", "floor"),
            format!(
                "a = {{ plane = {{}} }}\nb = \"brick\"\nfriction = {friction:?}\nrestitution = {restitution:?}\n"
            ),
        ];
        let model = Model::from_toml(&model.concat()).unwrap();
        let mut simulation = holonom::Simulation::new(&model).unwrap();
        let mut last = 0;
        for own in simulation.samples() {
            let own = own.unwrap_or_else(|error| panic!("seed {seed}: {error:?}"));
            let gaps = own.contacts.iter().map(|contact| contact.gap);
            assert!(gaps.fold(0.0, f64::min) > -1e-9, "seed {seed}, t = {}", own.t);
            last = own.contacts.len();
        }
        flat += usize::from(last == 4);
    }
    println!("{flat} of 16 stand on four corners in the end");
    assert!(flat > 0);
}

/// A compliant contact on a line of its own.
fn compliant(keys: &str) -> String {
    format!("model = {{ type = \"hunt_crossley\", {keys} }}")
}

#[test]
fn what_a_compliant_contact_may_not_state_is_said() {
    let sliding = "stiffness = 1e5, transition_velocity = 0.01";
    for (friction, keys, words) in [
        ("", "stiffness = 0.0", "the stiffness 0 is not positive"),
        ("", "stiffness = nan", "this is not a number: nan"),
        ("", "exponent = 1.5", "stiffness"),
        ("", "stiffness = 1e5, exponent = 0.5", "the exponent 0.5 is below 1"),
        ("", "stiffness = 1e5, dissipation = -0.1", "-0.1 is negative"),
        ("", "stiffness = 1e5, damping = 0.1", "damping"),
        ("", "stiffness = 1e5, transition_velocity = 0.01", "without friction nothing acts"),
        ("", "stiffness = 1e5, static_ratio = 1.2", "without friction nothing acts"),
        ("restitution = 0.5", "stiffness = 1e5", "has no restitution"),
        ("friction = 0.3", "stiffness = 1e5", "has a velocity of transition"),
        ("friction = 0.3", "stiffness = 1e5, transition_velocity = 0.0", "0 is not positive"),
        ("friction = 0.3", &format!("{sliding}, static_ratio = 0.5"), "is 0.5 of that of sliding"),
        ("friction = 0.3", &format!("{sliding}, static_ratio = 1.5"), "where static friction ends"),
        (
            "friction = 0.3",
            &format!("{sliding}, stribeck_velocity = 0.1"),
            "static friction is that of sliding",
        ),
    ] {
        let text = changed(BALLS, "friction = 0.3", "");
        let text = changed(&text, "restitution = 0.5", &format!("{friction}\n{}", compliant(keys)));
        let found = said(&text);
        assert!(found.contains(words), "{keys}: {found}");
    }
    let rule = compliant("stiffness = 1e5");
    let smooth = changed(&changed(BALLS, "friction = 0.3", ""), "restitution = 0.5", &rule);
    let em = changed(&smooth, "scheme = \"nodal\"", "scheme = \"em-nodal\"");
    assert!(said(&em).contains("the scheme em-nodal has no compliant contacts"));
    let rod = "type = \"cylinder\", dimensions = [0.1, 0.2]";
    let rod = changed(&smooth, "type = \"sphere\", dimensions = [0.1]", rod);
    assert!(said(&rod).contains("a plane (`ground`) with a cylinder"), "a rim that stands");
}

/// Compliant contacts are forces: every variational scheme and order takes them, statics too.
#[test]
fn every_variational_scheme_takes_a_compliant_contact() {
    let rule = compliant("stiffness = 1e5, dissipation = 0.1");
    let text = changed(&changed(BALLS, "friction = 0.3", ""), "restitution = 0.5", &rule);
    for scheme in ["constrained", "dalembert", "reduced", "nodal"] {
        let text = changed(&text, "\"nodal\"", &format!("\"{scheme}\""));
        prepare(&Model::from_toml(&text).unwrap()).unwrap_or_else(|e| panic!("{scheme}: {e}"));
    }
    let galerkin = changed(&text, "scheme = \"nodal\"", "order = 4\nmethod = \"galerkin\"");
    prepare(&Model::from_toml(&galerkin).unwrap()).unwrap();
    let composed = changed(&text, "scheme = \"nodal\"", "order = 4");
    let refused = prepare(&Model::from_toml(&composed).unwrap()).err().unwrap().to_string();
    assert!(refused.contains("order 2 with dissipative forces"), "{refused}");
    let elastic = changed(&composed, ", dissipation = 0.1", "");
    prepare(&Model::from_toml(&elastic).unwrap()).unwrap();
}

/// A stiff contact is not resolved by a long step: that is said, and what helps.
#[test]
fn a_step_that_does_not_resolve_a_compliant_contact_is_said() {
    let rule = |stiffness: &str| compliant(&format!("stiffness = {stiffness}"));
    let text =
        |rule: &str| changed(&changed(BALLS, "friction = 0.3", ""), "restitution = 0.5", rule);
    let remarks =
        |stiffness: &str| Model::from_toml(&text(&rule(stiffness))).unwrap().contact_remarks();
    assert_eq!(remarks("10.0"), Vec::<String>::new());
    let found = remarks("1e12");
    assert!(found[0].contains("the contact `floor` of `ground` and"), "{found:?}");
    assert!(found[0].contains("or remove `model` for a rigid contact"), "{found:?}");
}

#[test]
fn what_a_contact_may_not_state_is_said() {
    for (from, to, words) in [
        (
            "restitution = 0.5",
            "restitution = 1.2",
            "restitution of `floor` is 1.2: between 0 and 1",
        ),
        ("restitution = 0.5", "restitution = -0.1", "between 0 and 1"),
        ("friction = 0.3", "friction = -0.3", "friction of `floor` is -0.3: it is negative"),
        ("friction = 0.3", "friction = nan", "this is not a number: nan"),
        ("friction = 0.3", "tangential_restitution = 0.3", "without friction nothing acts across"),
        (
            "friction = 0.3",
            "friction = 0.3\nmu_s = 0.4",
            "`static_friction` of a rigid [[contact]]",
        ),
        (
            "friction = 0.3",
            "friction = 0.3\ntangential_restitution = 1.1",
            "is 1.1: between 0 and 1",
        ),
        ("normal = [0.0, 0.0, 1.0]", "normal = [0.0, 0.0, 0.0]", "the normal has zero length"),
        ("normal = [0.0, 0.0, 1.0]", "on = \"tabel\"", "there is no body or ground named `tabel`"),
        ("[\"red\", \"blue\"]", "[\"red\", \"blu\"]", "did you mean `blue`?"),
        ("[\"red\", \"blue\"]", "\"grey*\"", "no body has a name like `grey*`"),
        ("[\"red\", \"blue\"]", "[]", "no body is named"),
        ("[\"red\", \"blue\"]", "\"ground\"", "`ground` has no shape"),
        ("a = { plane = {", "a = { plain = {", "`a` is `{ plane = { position"),
        ("scheme = \"nodal\"", "scheme = \"em-nodal\"", "does not integrate contacts"),
        ("scheme = \"nodal\"", "scheme = \"dalembert\"", "does not integrate contacts"),
        ("scheme = \"nodal\"", "scheme = \"static\"", "no equilibria with contacts"),
        ("scheme = \"nodal\"", "order = 4", "order 2, not 4"),
        ("scheme = \"nodal\"", "start = \"relaxed\"", "no relaxed start with contacts"),
        (
            "position = [0.0, 0.0, 1.0]",
            "position = [0.0, 0.0, 0.0968]",
            "`red` and `floor` overlap by 3.2 mm at the start",
        ),
        ("dimensions = [0.1]", "dimensions = [0.1, 0.2]", "dimension(s) for this shape"),
        ("type = \"sphere\"", "type = \"mesh\"", "the mesh has no file"),
    ] {
        let text = changed(BALLS, from, to);
        let found = said(&text);
        assert!(found.contains(words), "{to}: {found}");
    }
    let bare = changed(
        BALLS,
        "shape = { type = \"sphere\", dimensions = [0.1] }",
        "inertia = [1.0, 1.0, 1.0]",
    );
    assert!(said(&bare).contains("`red` has no shape"));
    let drum = changed(
        BALLS,
        "{ type = \"sphere\", dimensions = [0.1] }",
        "{ type = \"cone\", dimensions = [0.1, 0.2] }",
    );
    assert!(
        said(&drum)
            .contains("the contact of a plane (`ground`) with a cone (`red`) is not available")
    );
    let alone = part("contact", "own") + "a = \"red\"\nb = \"red\"\n";
    assert!(said(&format!("{BALLS}{alone}")).contains("nothing touches in contact `own`"));
    let twice = ["one", "two"].map(|name| part("contact", name) + "a = \"red\"\nb = \"blue\"\n");
    assert!(said(&format!("{BALLS}{}", twice.concat())).contains("touch in contact `one` already"));
    let held = part("contact", "own") + "a = \"red\"\nb = \"blue\"\nrelative_to = \"red\"\n";
    assert!(said(&format!("{BALLS}{held}")).contains("bodies have frames of their own"));
}

#[test]
fn the_deepest_corner_of_an_overlap_is_numbered() {
    let text = changed(
        BALLS,
        "position = [0.0, 0.0, 1.0]\nmass = 1.0\nshape = { type = \"sphere\", dimensions = [0.1] }",
        "position = [0.0, 0.0, 0.1]\nrotation_vector = [0.0, 0.1, 0.0]\nmass = 1.0\nshape = { type = \"box\", dimensions = [0.2, 0.2, 0.2] }",
    );
    let found = said(&text);
    assert!(found.contains("`red` and `floor` overlap by 9.48 mm at the start (point"), "{found}");
}

#[test]
fn bodies_that_share_a_joint_are_no_pair() {
    let joined = BALLS.to_owned()
        + &part("joint", "pin")
        + "type = \"spherical\"\nparent = \"red\"\nchild = \"blue\"\nposition = [0.5, 0.0, 1.0]\n";
    let text = joined.clone() + &part("contact", "pair") + "a = \"red\"\nb = \"blue\"\n";
    let model = Model::from_toml(&text).unwrap();
    let run = prepare(&model).unwrap();
    let words = "`red` and `blue` share the joint `pin`: contact `pair` leaves them out";
    assert!(run.warnings().iter().any(|own| own == words), "{:?}", run.warnings());
    assert_eq!(model.contact_pairs().len(), 2, "both with the floor");
    let quiet = joined + &part("contact", "pair") + "a = \"*\"\nb = \"*\"\n";
    let model = Model::from_toml(&quiet).unwrap();
    assert_eq!(prepare(&model).unwrap().warnings(), Vec::<String>::new(), "stated by patterns");
    let rough = Model::from_toml(&changed(BALLS, "friction = 0.3", "friction = 12.0")).unwrap();
    let warnings = prepare(&rough).unwrap().warnings();
    assert!(
        warnings.iter().any(|own| own.contains("friction of contact `floor` is 12")),
        "{warnings:?}"
    );
}

#[test]
fn all_pairs_of_patterns_count_once() {
    let text = BALLS.to_owned()
        + &part("body", "bluish")
        + "mass = 1.0\nposition = [3.0, 0.0, 1.0]\nshape = { type = \"sphere\", dimensions = [0.1] }\n"
        + &part("contact", "balls")
        + "a = \"*\"\nb = [\"blu*\", \"blue\"]\n";
    let model = Model::from_toml(&text).unwrap();
    let pairs: Vec<String> = (model.contact_pairs().iter())
        .map(|pair| format!("{} {}", pair.a.name(), pair.b.name))
        .collect();
    assert_eq!(pairs, ["ground red", "ground blue", "red blue", "red bluish", "blue bluish"]);
}

/// Names, patterns and planes of an included file are those of its own parts.
#[test]
fn contacts_of_included_files_are_of_their_parts() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("contacts");
    std::fs::create_dir_all(&folder).unwrap();
    let balls = BALLS.split("[model]").next().unwrap();
    let parts = balls.to_owned()
        + &part("contact", "pair")
        + "a = \"re*\"\nb = \"blue\"\n"
        + &part("contact", "tray")
        + "a = { plane = { on = \"red\" } }\nb = \"blue\"\n";
    let parts = parts.replace(
        "[[contact]]\nname = \"tray\"\na",
        "[[contact]]\nname = \"tray\"\nrestitution = 0.5\na",
    );
    std::fs::write(folder.join("balls.toml"), parts).unwrap();
    let root = "include = [{ file = \"balls.toml\", prefix = \"left_\", position = [0.0, 0.0, 5.0] }]\n\
                [model]\nname = \"two\"\n[simulation]\nstep = 0.01\nend = 0.1\n";
    let path = folder.join("root.toml");
    std::fs::write(&path, root).unwrap();
    let error = ModelText::read(&path).model(&[]).err();
    let model = match error {
        None => ModelText::read(&path).model(&[]).unwrap(),
        Some(error) => panic!("{error}"),
    };
    let floor = model.contacts.iter().find(|own| own.name == "left_floor").unwrap();
    let height = |own: &holonom::model::Contact| own.plane().unwrap().position[2];
    assert!((height(floor) - 5.0).abs() < 1e-12);
    assert_eq!(floor.b.list(), ["left_red", "left_blue"]);
    let pair = model.contacts.iter().find(|own| own.name == "left_pair").unwrap();
    assert!(format!("{:?}", pair.a).contains("left_re*"), "{pair:?}");
    let tray = model.contacts.iter().find(|own| own.name == "left_tray").unwrap();
    assert_eq!(tray.plane().unwrap().on, "left_red");
    assert!(height(tray).abs() < 1e-12, "along the axes of the body");
}

/// A box holds a ball, and a cylinder stands on its rim: all at rest, for the impulses are those of
/// their weights.
#[test]
fn boxes_and_cylinders_of_model_files_stand() {
    let solid = |name: &str, z: f64, mass: f64, shape: &str| {
        let shape = format!("shape = {{ {shape} }}");
        part("body", name) + &format!("position = [0.0, 0.0, {z}]\nmass = {mass}\n{shape}\n")
    };
    let contact = |name: &str, sides: &str| part("contact", name) + sides + "friction = 0.4\n";
    let floor = "a = { plane = { position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] } }\n";
    let cube = "type = \"box\", dimensions = [0.2, 0.3, 0.4]";
    let pile = heavy("pile", DOWN, "step = 0.005, end = 0.5, contacts = true")
        + &solid("low", 0.2, 1.0, cube)
        + &solid("ball", 0.5, 0.5, "type = \"sphere\", dimensions = [0.1]")
        + &contact("floor", &format!("{floor}b = \"low\"\n"))
        + &contact("top", "a = \"low\"\nb = \"ball\"\n");
    let drum = heavy("drum", DOWN, "step = 0.005, end = 0.5")
        + &solid("drum", 0.25, 2.0, "type = \"cylinder\", dimensions = [0.1, 0.5]")
        + &contact("floor", &format!("{floor}b = \"drum\"\n"));
    for text in [&pile, &drum] {
        let mut rows: Vec<Vec<f64>> = Vec::new();
        let mut observe = |sample: &Sample| {
            rows.push(sample.q.clone());
            Ok(())
        };
        let mut run = prepare(&Model::from_toml(text).unwrap()).unwrap();
        let outcome = run.run(&mut observe, &mut |_, _| {}).unwrap();
        assert!(matches!(outcome, RunOutcome::Done), "{outcome:?}");
        let moved = rows.iter().map(|row| distance(row, &rows[0])).fold(0.0, f64::max);
        println!("moved by {moved:.1e}");
        assert!(rows.len() == 101 && moved < 1e-12, "{moved:e}");
    }
    let egg = "type = \"ellipsoid\", dimensions = [0.1, 0.1, 0.2]";
    let two = changed(&pile, "type = \"sphere\", dimensions = [0.1]", egg);
    let found = said(&changed(&two, "0.0, 0.5]", "0.0, 0.6]"));
    assert!(found.contains("a box (`low`) with a ellipsoid (`ball`) is not available"), "{found}");
}

/// `events.csv` has the touches of a compliant contact, one for each bounce.
#[test]
fn touches_of_compliant_contacts_are_events() {
    let text = heavy("bounce", DOWN, "step = 2e-4, end = 1.2")
        + &part("body", "ball")
        + "mass = 1.0\nposition = [0.0, 0.0, 0.3]\nshape = { type = \"sphere\", dimensions = [0.1] }\n"
        + &part("body", "still")
        + "mass = 1.0\nposition = [2.0, 0.0, 0.09999]\nshape = { type = \"sphere\", dimensions = [0.1] }\n"
        + &part("contact", "floor")
        + &format!("a = {{ plane = {{}} }}\nb = \"*\"\n{}\n", compliant("stiffness = 1e6"));
    let model = Model::from_toml(&text).unwrap();
    let mut simulation = holonom::Simulation::new(&model).unwrap();
    let mut all = Vec::new();
    for sample in simulation.samples() {
        all.extend(sample.unwrap().events.into_iter().map(|own| (own.t, own.event, own.action)));
    }
    let of: Vec<&(f64, String, String)> =
        all.iter().filter(|own| own.2.ends_with("ball")).collect();
    let words: Vec<&str> = of.iter().map(|own| own.2.as_str()).collect();
    println!("{of:?}");
    assert!(words.starts_with(&["touch ball", "separate ball", "touch ball", "separate ball"]));
    assert!(of.iter().all(|own| own.1 == "floor"));
    let fall = (2.0 * 0.2_f64 / 9.81).sqrt();
    assert!((0.0..2e-4).contains(&(of[0].0 - fall)), "at the end of the step of the touch");
    // elastic: it flies for twice the time of the fall
    assert!((of[2].0 - of[1].0 - 2.0 * fall).abs() < 1e-3);
    assert_ne!(all[0].2, "touch still", "it touches from the start");
}

/// A ball that passes a plate within a step, or nearly so, is not seen: that is said, and what
/// helps; also of a fall onto what is fixed; not of one that ends in the plate, misses it, flies
/// away, is carried or falls aside.
#[test]
fn bodies_that_pass_one_another_in_a_step_are_named() {
    let text = |velocity: [f64; 3], position: [f64; 3], thick: f64| {
        heavy("tunnel", [0.0; 3], "step = 0.005, end = 0.1")
            + &part("body", "plate")
            + &format!(
                "mass = 1.0\nshape = {{ type = \"box\", dimensions = [{thick:?}, 1.0, 1.0] }}\n"
            )
            + &part("body", "shot")
            + "mass = 0.01\nshape = { type = \"sphere\", dimensions = [0.005] }\n"
            + &format!("position = {position:?}\nvelocity = {velocity:?}\n")
            + &part("contact", "hit")
            + "a = \"plate\"\nb = \"shot\"\n"
    };
    let remarks = |text: &str| Model::from_toml(text).unwrap().contact_remarks();
    let found = remarks(&text([150.0, 0.0, 0.0], [-0.5, 0.0, 0.0], 0.005));
    println!("{found:?}");
    assert!(
        found[0]
            .contains("in a step `plate` and `shot` approach one another by 7.50e-1 m, 50.00 of")
    );
    assert!(found[0].contains("take a step of 5e-5 s or less"), "{found:?}");
    let nearly = remarks(&text([150.0, 0.0, 0.0], [-0.6, 0.0, 0.0], 0.9));
    assert!(nearly[0].contains("0.82 of the 9.10e-1 m that both together are thick"), "{nearly:?}");
    let falls = |position: [f64; 3], more: &str| {
        let keys = "step = 0.005, end = 0.1";
        heavy("drop", DOWN, keys)
            + &part("body", "sheet")
            + "fixed = true\nshape = { type = \"box\", dimensions = [1.0, 1.0, 0.002] }\n"
            + &part("body", "drop")
            + "mass = 0.01\nshape = { type = \"sphere\", dimensions = [0.005] }\n"
            + &format!("position = {position:?}\n")
            + &part("contact", "hit")
            + "a = \"sheet\"\nb = \"drop\"\n"
            + more
    };
    let fall = remarks(&falls([0.0, 0.0, 2.0], ""));
    println!("{fall:?}");
    assert!(fall[0].contains("after the fall approach one another by 3.1"), "{fall:?}");
    let pin =
        part("joint", "pin") + "type = \"spherical\"\nparent = \"ground\"\nchild = \"drop\"\n";
    for quiet in [
        falls([0.0, 0.0, 0.05], ""),
        falls([0.0, 0.0, -2.0], ""),
        falls([3.0, 0.0, 2.0], ""),
        falls([0.0, 0.0, 2.0], &(pin + "position = [0.0, 0.0, 2.5]\n")),
    ] {
        assert_eq!(remarks(&quiet), Vec::<String>::new(), "{quiet}");
    }
    for quiet in [
        text([2.0, 0.0, 0.0], [-0.5, 0.0, 0.0], 0.005),
        text([150.0, 0.0, 0.0], [-0.5, 0.0, 0.0], 1.0),
        text([150.0, 0.0, 0.0], [0.5, 0.0, 0.0], 0.005),
        text([150.0, 0.0, 0.0], [-0.5, 5.0, 0.0], 0.005),
    ] {
        assert_eq!(remarks(&quiet), Vec::<String>::new(), "{quiet}");
    }
}

/// What a prescribed body presses against a wall is named, with friction as well.
#[test]
fn what_no_motion_opens_is_named_with_friction() {
    let slab = |name: &str, position: [f64; 3]| {
        part("body", name)
            + "mass = 1.0\nshape = { type = \"box\", dimensions = [0.1, 0.2, 0.2] }\n"
            + &format!("position = {position:?}\n")
    };
    for friction in [0.0, 0.3] {
        let text = heavy("jaw", [0.0; 3], "step = 0.005, end = 1.0")
            + &slab("jaw", [-0.2, 0.0, 0.1])
            + &slab("part", [0.0, 0.0, 0.1])
            + &slab("wall", [0.15, 0.0, 0.1])
            + "fixed = true\n"
            + &part("joint", "guide")
            + "type = \"prismatic\"\nparent = \"ground\"\nchild = \"jaw\"\nposition = [-0.2, 0.0, 0.1]\naxis = [1.0, 0.0, 0.0]\nrate = 0.2\n"
            + &part("constraint", "push")
            + "type = \"motion\"\njoint = \"guide\"\npath = { rate = 0.2 }\n"
            + &part("contact", "grip")
            + &format!("a = [\"jaw\", \"wall\"]\nb = \"part\"\nfriction = {friction:?}\n");
        let mut run = prepare(&Model::from_toml(&text).unwrap()).unwrap();
        let outcome = run.run(&mut |_: &Sample| Ok(()), &mut |_, _| {}).unwrap();
        let RunOutcome::Failed(failure) = outcome else { panic!("{outcome:?}") };
        println!("{}", failure.message);
        assert!(failure.message.contains("no motion opens the contact of"), "{}", failure.message);
        // the frictionless laws name one side of the jaw at least
        let named = ["jaw–part", "wall–part"].map(|own| failure.message.contains(own));
        assert!(named.contains(&true), "{}", failure.message);
    }
}
