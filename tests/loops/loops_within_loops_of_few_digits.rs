//! Loops of few digits in company: within one another, on a body that flies, of rods, beside point
//! masses and springs. They move as the exact ones. Loops of bars have no tolerance, and say so.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::models::overrides;
use holonom::simulation::RunOutcome;
use holonom::{Model, Simulation};
use std::fmt::Write as _;
use vi_testkit::model::{along, body_at, hinge};

/// A model in text.
struct Text(String);

impl Text {
    fn new(gravity: [f64; 3], simulation: &str) -> Self {
        Self(format!(
            "[model]\nname = \"loops\"\ngravity = {gravity:?}\n[simulation]\nstep = 0.002\nend = 1.0\n{simulation}\n"
        ))
    }

    fn body(mut self, name: &str, mass: f64, position: [f64; 3], rest: &str) -> Self {
        self.0 += &(body_at(position, name, mass, [0.05, 0.05, 0.02]) + rest + "\n");
        self
    }

    fn hinge(mut self, name: &str, bodies: [&str; 2], at: [f64; 3], axis: [f64; 3]) -> Self {
        self.0 += &hinge(name, bodies, at, axis);
        self
    }

    fn and(mut self, text: &str) -> Self {
        self.0 += text;
        self
    }
}

const Y: [f64; 3] = [0.0, 1.0, 0.0];
const WEIGHT: [f64; 3] = [0.0, 0.0, -9.81];
const SIZES: [f64; 3] = [1e-9, 1e-6, 1e-4];

/// A four-bar linkage from `base`, the axis of its last joint off by an angle.
fn four_bar(text: Text, base: &str, off: f64) -> Text {
    text.body("crank", 0.6, [0.0, 0.0, 0.1], "")
        .body("coupler", 2.1, [0.32, 0.0, 0.34], "")
        .body("rocker", 1.8, [0.82, 0.0, 0.24], "")
        .hinge("A", [base, "crank"], [0.0; 3], Y)
        .hinge("B", ["crank", "coupler"], [0.0, 0.0, 0.2], Y)
        .hinge("D", [base, "rocker"], [1.0, 0.0, 0.0], Y)
        .hinge("C", ["coupler", "rocker"], [0.64, 0.0, 0.48], [off.sin(), off.cos(), 0.0])
}

/// The end of a run, its degrees of freedom, its warnings.
fn run(text: &str, replaced: &[(&str, &str)]) -> (Vec<f64>, usize, Vec<String>) {
    let model = Model::from_toml_with(text, &overrides(replaced)).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = Simulation::new(&model).unwrap_or_else(|e| panic!("{e}"));
    let mut last = Vec::new();
    let mut observe = |sample: &holonom::Sample| {
        last.clone_from(&sample.q);
        Ok::<(), ()>(())
    };
    let outcome = simulation.run(&mut observe, &mut |_, _| {}).unwrap();
    assert_eq!(outcome, RunOutcome::Done);
    (last, simulation.assembly().counts.dof, simulation.warnings())
}

/// Compares what is off with what is exact, in several schemes. What is off by less than the start
/// tolerance is not worth a word; what is off by more is worth one.
fn moves_as_exact(what: &str, freedom: usize, text: impl Fn(f64) -> String) {
    for scheme in ["nodal", "constrained", "em-nodal"] {
        let replaced = [("simulation.scheme", scheme)];
        let (exact, dof, warnings) = run(&text(0.0), &replaced);
        assert_eq!(dof, freedom, "{what}");
        let loops = |warnings: &[String]| {
            warnings.iter().filter(|w| w.contains("loop")).cloned().collect::<Vec<_>>()
        };
        assert!(loops(&warnings).is_empty(), "no word of what is exact: {warnings:?}");
        for off in SIZES {
            let (near, dof, warnings) = run(&text(off), &replaced);
            let apart = near.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{what}, {scheme}, off by {off:e}: {apart:.1e} from the exact one");
            assert_eq!(dof, freedom, "{what}, {off:e}");
            assert!(apart <= 10.0 * off + 1e-9, "{what}, {scheme}, {off:e}: {apart:e}");
            let said = loops(&warnings);
            assert_eq!(said.len(), usize::from(off > 1e-8), "{what}, {off:e}: {said:?}");
        }
    }
}

#[test]
fn a_loop_within_a_loop() {
    moves_as_exact("nested", 1, |off| {
        four_bar(Text::new(WEIGHT, ""), "ground", off)
            .body("upper", 0.5, [0.32, 0.0, 0.64], "")
            .body("top", 0.7, [0.74, 0.0, 0.68], "")
            .hinge("E", ["coupler", "upper"], [0.32, 0.0, 0.44], Y)
            .hinge("F", ["upper", "top"], [0.4, 0.0, 0.9], Y)
            .hinge("G", ["top", "rocker"], [0.82, 0.0, 0.5], [0.0, off.cos(), -off.sin()])
            .0
    });
}

#[test]
fn a_loop_on_a_body_that_flies() {
    moves_as_exact("flying", 7, |off| {
        let moves = "velocity = [0.1, 0.2, 0.3]\nangular_velocity = [0.1, 0.5, -0.2]";
        let base =
            Text::new([0.0; 3], "project_start = true").body("base", 5.0, [0.5, 0.0, -0.2], moves);
        four_bar(base, "base", off).0
    });
}

const POINT: &str = "[[particle]]\nname = \"point\"\nmass = 0.5\nposition = [0.32, 0.0, -0.5]\n";

#[test]
fn a_loop_beside_a_point_mass_and_on_a_spring_with_it() {
    let spring = "[[spring]]\nname = \"spring\"\nfrom = \"coupler\"\nto = \"point\"\npoint_from = [0.0, 0.0, 0.0]\nstiffness = 50.0\n";
    for (what, rest) in [("beside", ""), ("on a spring", spring)] {
        moves_as_exact(what, 4, |off| {
            four_bar(Text::new(WEIGHT, ""), "ground", off).and(POINT).and(rest).0
        });
    }
}

/// A plate in a plane on three parallel rods of equal length: one of them is redundant.
fn plate(off: f64) -> String {
    let height = -0.91_f64.sqrt();
    let mut text =
        Text::new(WEIGHT, "project_start = true").body("plate", 3.0, [0.3, 0.0, height], "");
    text.0 += &along(Y, "planar", "plane", ["ground", "plate"], [0.3, 0.0, height]);
    for (k, x) in [-0.5, 0.1, 0.5].into_iter().enumerate() {
        let length = 1.0 + if k == 1 { off } else { 0.0 };
        let _ = write!(
            text.0,
            "[[constraint]]\nname = \"rod{k}\"\ntype = \"distance\"\nfrom = \"ground\"\nto = \"plate\"\npoint_from = [{x:?}, 0.0, 0.0]\npoint_to = [{x:?}, 0.0, 0.0]\nlength = {length:?}\n"
        );
    }
    text.0
}

#[test]
fn rods_of_few_digits() {
    moves_as_exact("rods", 1, plate);
    // one rod is 1e-4 m longer than the other two: what is left is that length in one of them, by
    // its lever
    let (_, _, warnings) = run(&plate(1e-4), &[]);
    let said = warnings.iter().find(|w| w.contains("start with a residual of")).unwrap();
    let left = said.rsplit_once("residual of ").unwrap().1.trim_end_matches(" m");
    let left: f64 = left.parse().unwrap();
    println!("left {left} m");
    assert!((1e-4..2e-4).contains(&left), "{said}");
}

/// A triangle of bars on three parallel bars of equal length; `digits`: those of its coordinates.
fn triangle(digits: Option<usize>) -> String {
    let tops = [[-0.5, 0.0], [0.5, 0.0], [0.1, 0.6]];
    let mut text =
        "[model]\nname = \"triangle\"\ndimension = 2\ngravity = [0.0, -9.81]\n[simulation]\nstep = 0.002\nend = 0.1\n"
            .to_owned();
    for (k, [x, y]) in tops.into_iter().enumerate() {
        let at = [x + 0.3, y - 0.91_f64.sqrt()].map(|x: f64| match digits {
            Some(digits) => format!("{x:.digits$}").parse().unwrap(),
            None => x,
        });
        let _ = write!(
            text,
            "[[particle]]\nname = \"p{k}\"\nmass = 1.0\nposition = {at:?}\n[[bar]]\nname = \"hung{k}\"\nfrom = \"ground\"\nto = \"p{k}\"\npoint = [{x:?}, {y:?}]\n"
        );
    }
    for (a, b) in [(0, 1), (1, 2), (0, 2)] {
        let _ = write!(text, "[[bar]]\nname = \"side{a}{b}\"\nfrom = \"p{a}\"\nto = \"p{b}\"\n");
    }
    text
}

#[test]
fn bars_of_few_digits_are_locked_and_named() {
    let (_, dof, warnings) = run(&triangle(None), &[]);
    assert_eq!(dof, 1);
    assert!(warnings.iter().all(|w| !w.contains("bars")), "{warnings:?}");
    // the two rounded coordinates are the same in all three points with so many digits: it moves
    let uneven = triangle(Some(6))
        .replace("position = [0.4, -0.353939]", "position = [0.400001, -0.353939]");
    assert_ne!(uneven, triangle(Some(6)));
    let (_, dof, warnings) = run(&uneven, &[]);
    println!("{warnings:?}");
    assert_eq!(dof, 0);
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].starts_with("nothing can move"), "{warnings:?}");
    assert!(warnings[0].contains("the bars about `") && warnings[0].contains("to the last digit"));
    // beside something that moves they are named, too; bars that are meant to hold are not
    let beside = "[[particle]]\nname = \"free\"\nmass = 1.0\nposition = [3.0, 0.0]\n";
    let (_, dof, warnings) = run(&(uneven.clone() + beside), &[]);
    assert_eq!(dof, 2);
    assert!(warnings.iter().any(|w| w.starts_with("the bars about `")), "{warnings:?}");
    let held = uneven.replace("point = [0.1, 0.6]", "point = [0.9, 0.6]");
    let (_, dof, warnings) = run(&(held + beside), &[]);
    assert_eq!(dof, 2);
    assert!(warnings.iter().all(|w| !w.contains("the bars about")), "{warnings:?}");
}
