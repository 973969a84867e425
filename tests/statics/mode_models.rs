//! Natural frequencies of model files against closed forms.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::model;
use holonom::modes::{About, ModalAnalysis, ModeKind, Report};
use std::f64::consts::{PI, TAU};

fn modes(text: &str, changes: &[(&str, &str)], about: About, count: usize) -> Report {
    ModalAnalysis::new(&model(text, changes), about).unwrap().modes(count).unwrap()
}

fn vibrations(report: &Report) -> Vec<f64> {
    let of = |kind: ModeKind| report.modes.iter().filter(move |mode| mode.kind == kind);
    of(ModeKind::Vibration).map(|mode| mode.omega).collect()
}

const BEAM: &str = include_str!("../models/slender_cantilever.toml");

#[test]
fn slender_beams_have_the_frequencies_of_euler_and_bernoulli() {
    // roots of 1 + cos cosh = 0 and of 1 − cos cosh = 0
    let roots = [
        ("\"clamped\"", 0, [1.8751040687119611, 4.694091132974174, 7.854757438237613]),
        ("\"free\"", 6, [4.730040744862704, 7.853204624095838, 10.995607838001671]),
    ];
    let kinds =
        [("mean_directors", 2.0, ["16", "32", "64"]), ("helicoidal", 4.0, ["4", "8", "16"])];
    for ((start, zero, roots), (kind, expected, counts)) in
        roots.into_iter().flat_map(|own| kinds.map(|kind| (own, kind)))
    {
        let kind = format!("\"{kind}\"");
        let found: Vec<Vec<f64>> = counts
            .into_iter()
            .map(|n| {
                let changes = [
                    ("beam.beam.start", start),
                    ("beam.beam.elements", n),
                    ("beam.beam.element", &kind),
                ];
                let report = modes(BEAM, &changes, About::Start, 6);
                assert_eq!((report.zero, report.unstable), (zero, 0), "{start} {n}");
                vibrations(&report)
            })
            .collect();
        for (k, root) in roots.into_iter().enumerate() {
            let exact: f64 = root * root; // bending about both axes: pairs
            let errors: Vec<f64> = found.iter().map(|omega| omega[2 * k] / exact - 1.0).collect();
            let order = ((errors[0] - errors[1]) / (errors[1] - errors[2])).log2();
            let rate = f64::powf(2.0, expected) - 1.0;
            let limit = found[2][2 * k] + (found[2][2 * k] - found[1][2 * k]) / rate;
            let left = limit / exact - 1.0;
            println!(
                "{kind}, start {start}, pair {k}: relative errors {errors:?}, order {order:.3}, \
                 extrapolated {left:.1e} (shear and rotary inertia: O(1e-6 root²))"
            );
            assert!((order - expected).abs() < 0.05 * expected, "{errors:?}");
            assert!(left.abs() < 2e-6 * root * root + 3e-5, "{left:e}");
            let pair = found[2][2 * k + 1] / found[2][2 * k] - 1.0;
            assert!(pair.abs() < 1e-7, "the section is the same about both axes: {pair:e}");
        }
    }
}

#[test]
fn a_compressed_column_softens_and_then_is_unstable() {
    // clamped and free: ω² falls to zero at π²EI/4L² = 2.467 N
    let loaded = |force: f64| {
        let load = format!(
            "{BEAM}\n[[load]]\nname = \"push\"\nbody = \"beam.end\"\nforce = [{}, 0, 0]\n",
            -force
        );
        modes(&load, &[("simulation.scheme", "\"static\"")], About::Static, 2)
    };
    let critical = PI * PI / 4.0;
    let squares: Vec<f64> = [0.2, 0.6, 0.99]
        .iter()
        .map(|part| loaded(part * critical).modes[0].omega_squared)
        .collect();
    println!("ω² at 0.2, 0.6, 0.99 of the Euler load: {squares:.4?}");
    assert!(squares[0] > squares[1] && squares[1] > squares[2] && squares[2] > 0.0);
    let rest = 1.8751040687119611_f64.powi(4);
    assert!(squares[2] < 0.03 * rest, "nearly no stiffness left");
    let beyond = loaded(1.05 * critical);
    let growth = beyond.modes[0].growth;
    println!("at 1.05 of it: {} unstable, growth {growth:.4} 1/s", beyond.unstable);
    assert!(beyond.unstable == 2 && growth > 0.0);
    assert_eq!(beyond.unstable_by_inertia, Some(2));
}

/// ω² = k/m with and without them, and a warning with them alone.
#[test]
fn stops_and_dry_friction_take_no_part_and_modes_say_so() {
    use vi_testkit::model::{head, slider};
    let spring = "stiffness = 8.0\n";
    for (keys, said) in
        [("", false), ("limits = [-0.1, 0.1]\n", true), ("friction = { force = 1.0 }\n", true)]
    {
        let text = head("cart", "step = 0.01, end = 0.1")
            + &slider("cart", "slide", 2.0)
            + keys
            + "spring = { "
            + spring.trim()
            + " }\n";
        let report = modes(&text, &[], About::Start, 1);
        println!("{keys:?}: ω² = {}, {:?}", report.modes[0].omega_squared, report.warnings);
        assert!((report.modes[0].omega_squared - 4.0).abs() < 1e-12);
        assert_eq!(report.warnings.iter().any(|words| words.contains("dry friction")), said);
    }
}

#[test]
fn a_pendulum_and_a_chain_swing_as_they_must() {
    let shipped = |name: &str| {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/models");
        std::fs::read_to_string(format!("{folder}/{name}.toml")).unwrap()
    };
    let report = modes(&shipped("pendulum"), &[], About::Static, 5);
    let error = report.modes[0].omega / 9.81_f64.sqrt() - 1.0;
    println!("pendulum of 1 m: {:.9} Hz, relative error {error:.1e}", report.modes[0].frequency);
    assert!(report.dof == 1 && error.abs() < 1e-12);
    assert!((report.modes[0].frequency * TAU - report.modes[0].omega).abs() < 1e-15);
    let start = modes(&shipped("pendulum"), &[], About::Start, 5);
    assert!(start.warnings[0].contains("no equilibrium"), "{:?}", start.warnings);
    assert_eq!((start.zero, start.unstable), (1, 0), "level with its pivot nothing resists");

    // two masses on three springs between walls: ω² = k/m, 3 k/m along the line
    let chain = include_str!("../models/two_masses.toml");
    let report = modes(chain, &[], About::Start, 5);
    println!("two masses: {:?}", vibrations(&report));
    for (mode, exact) in report.modes.iter().zip([15.0, 45.0]) {
        assert!((mode.omega_squared / exact - 1.0).abs() < 1e-13);
        let ends = [mode.shape[0].translation[0], mode.shape[1].translation[0]];
        assert!((ends[0].abs() - 1.0).abs() < 1e-12 && (ends[1].abs() - 1.0).abs() < 1e-12);
        assert_eq!(ends[0] * ends[1] > 0.0, exact < 20.0, "in phase, then against each other");
    }
}

#[test]
fn round_off_is_not_taken_for_an_imbalance() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/models");
    let text = std::fs::read_to_string(format!("{folder}/flexible_four_bar.toml")).unwrap();
    let report = modes(&text, &[], About::Static, 1);
    println!("flexible four-bar: {} without stiffness, {:?}", report.zero, report.warnings);
    assert!(report.warnings.is_empty(), "{:?}", report.warnings);
}

/// A wire of `L/h = 10⁶`: bending is `10⁻¹²` of extension, its slowest modes are near the last bits
/// of the stiffness. Sections twice as thick and free beams are told from it.
#[test]
fn what_rounding_hides_is_no_mode_without_stiffness() {
    let wire = |thick: f64, element: &str, load: f64| {
        format!(
            "[model]\nname = \"wire\"\n[simulation]\nstep = 1.0\nend = 1.0\nscheme = \"static\"\n[[beam]]\nname = \"b\"\n\
             points = [[0, 0, 0], [1, 0, 0]]\nelements = 10\nelement = \"{element}\"\nnormal = [0, 0, 1]\nstart = \"clamped\"\n\
             section = {{ shape = {{ type = \"rectangle\", dimensions = [{thick:e}, {thick:e}] }}, \
             material = {{ E = 2.1e11, nu = 0.3, density = 7850.0 }} }}\n[[load]]\nname = \"tip\"\nbody = \"b.end\"\n\
             force = [0, 0, {load:e}]\n"
        )
    };
    let bent = 2.1e11 / 12.0 * 1e-24;
    for (element, load, about) in [
        ("mean_directors", 0.0, About::Start),
        ("second_order", 0.0, About::Start),
        ("helicoidal", bent, About::Static),
    ] {
        let text = wire(1e-6, element, load);
        let report = modes(&text, &[], about, 4);
        let slowest = 1.8751040687_f64.powi(2) / TAU * (2.1e11 / 12.0 / 7850.0_f64).sqrt() * 1e-6;
        println!(
            "{element}: {} hidden below {:e} Hz, {:?}",
            report.zero, report.round_off, report.warnings
        );
        assert!(report.zero > 0 && report.round_off > slowest, "{element}: {slowest} Hz");
        assert!(report.warnings.iter().any(|text| text.contains("are not told from")));
    }
    for (thick, start, zero) in [(1e-3, "\"clamped\"", 0), (1e-2, "\"free\"", 6)] {
        let changes = [("beam.b.start", start)];
        let report = modes(&wire(thick, "helicoidal", 0.0), &changes, About::Start, 4);
        assert_eq!((report.zero, report.round_off), (zero, 0.0), "{:?}", report.warnings);
        assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    }
}
