//! Cylinders against boxes, capsules and one another in model files: free pairs keep their momenta
//! and gain no energy, a drum rolls and slides down a box, a roller leaves an edge.

use super::shape_runs::{rule, samples, solid, tumble};
use holonom::Sample;
use vi_testkit::model::{heavy, part};

const G: f64 = 9.81;

const CYLINDER: &str = "type = \"cylinder\", dimensions = [0.12, 0.3]";
const SHAPES: [[&str; 2]; 4] = [
    [CYLINDER, "type = \"box\", dimensions = [0.2, 0.3, 0.25]"],
    [CYLINDER, "type = \"cylinder\", dimensions = [0.15, 0.1]"],
    [CYLINDER, "type = \"capsule\", dimensions = [0.1, 0.25]"],
    [
        "type = \"capsule\", dimensions = [0.1, 0.25]",
        "type = \"box\", dimensions = [0.2, 0.3, 0.25]",
    ],
];

/// Free bodies that tumble into each other: momenta to rounding errors, no energy from contact.
#[test]
fn tumbling_cylinders_keep_their_momenta() {
    for [first, second] in SHAPES {
        tumble(first, second);
    }
}

/// A drum on a box that leans: on its side it rolls with `⅔ g sin α`, as a can it slides with
/// `g (sin α − μ cos α)`, or friction holds it.
#[test]
fn a_drum_on_a_slope_rolls_slides_or_stays() {
    let ramp = "type = \"box\", dimensions = [4.0, 2.0, 1.0]";
    let drum = "type = \"cylinder\", dimensions = [0.1, 0.4]";
    let quarter = std::f64::consts::FRAC_PI_2;
    let t = 0.4;
    for (slope, friction, turned, height, a) in [
        (0.2_f64, 0.3, [quarter, 0.0, 0.0], 0.1, 2.0 / 3.0 * G * 0.2_f64.sin()),
        (0.4, 0.3, [0.0; 3], 0.2, G * (0.4_f64.sin() - 0.3 * 0.4_f64.cos())),
        (0.2, 0.3, [0.0; 3], 0.2, 0.0),
    ] {
        for method in ["events", "stepping"] {
            let gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
            let times = format!("step = 0.005, end = {t}, contact = \"{method}\"");
            let keys = format!(
                "position = [0.1, 0.05, {:?}]\nrotation_vector = {turned:?}\n",
                0.5 + height
            );
            let text = [
                heavy("slope", gravity, &times),
                solid("ramp", 1.0, ramp, "fixed = true\n"),
                solid("drum", 1.5, drum, &keys),
                rule("slope", &format!("a = \"ramp\"\nb = \"drum\"\nfriction = {friction}\n")),
            ];
            let all = samples(&text.concat());
            let place = |own: &Sample| own.q[own.q.len() - 12];
            let way = place(&all[all.len() - 1]) - place(&all[0]);
            let exact = 0.5 * a * t * t;
            println!("slope {slope}, {turned:?}, {method}: {way} m, exact {exact} m");
            assert!((way - exact).abs() < 1e-11, "{method}: {way} for {exact}");
        }
    }
}

/// Below `√(gR)`, so that a roller turns about the edge before it leaves it, m/s.
const SPEED: f64 = 0.4;

/// A roller that rolls off the edge of a box without slip, its axis turned from the edge.
fn roller(step: f64, method: &str, askew: f64) -> Vec<Sample> {
    let times = format!("step = {step:?}, end = 0.6, contact = \"{method}\"");
    let (sin, cos) = askew.sin_cos();
    let (half_sin, half_cos) = (0.5 * askew).sin_cos();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // a quarter turn about x, then that about z
    let quaternion = [half_cos, half_cos, half_sin, half_sin].map(|x| half * x);
    let (velocity, spin) =
        ([SPEED * cos, SPEED * sin, 0.0], [-sin, cos, 0.0].map(|x| 10.0 * SPEED * x));
    let keys = format!(
        "position = [-0.1, 0.0, 0.6]\nquaternion = {quaternion:?}\nvelocity = {velocity:?}\nangular_velocity = {spin:?}\n"
    );
    let table = "type = \"box\", dimensions = [1.0, 2.0, 1.0]";
    let text = [
        heavy("roller", [0.0, 0.0, -G], &times),
        solid("table", 1.0, table, "position = [-0.5, 0.0, 0.0]\nfixed = true\n"),
        solid("roller", 1.0, "type = \"cylinder\", dimensions = [0.1, 0.4]", &keys),
        rule("edge", "a = \"table\"\nb = \"roller\"\nfriction = 0.6\n"),
        part("sensor", "gap") + "type = \"clearance\"\nof = \"table\"\nto = \"roller\"\n",
    ];
    samples(&text.concat())
}

/// A roller that leaves an edge gains energy of the second order of the step at most.
#[test]
fn a_roller_leaves_an_edge() {
    for method in ["events", "stepping"] {
        let gains = [4e-3, 2e-3, 1e-3].map(|step| {
            let all = roller(step, method, 0.0);
            let gains = all.iter().map(|own| own.energy - all[0].energy);
            let gap = all.iter().map(|own| own.sensors[0]).fold(f64::MAX, f64::min);
            let fallen = all[all.len() - 1].q[14] < 0.4;
            let lost = all[0].energy - all[all.len() - 1].energy;
            println!("{method} {step}: smallest gap {gap:.1e}, lost {lost:.3e}, {fallen}");
            gains.fold(f64::MIN, f64::max)
        });
        println!("{method}: gains {gains:?} J");
        let most = if method == "events" { 4e-4 } else { 1e-12 };
        assert!(gains[0] <= most && gains[2] <= (most / 16.0).max(1e-12), "{method}: {gains:?}");
    }
}

/// A roller whose axis is turned from the edge that it leaves does not overlap the box.
#[test]
fn an_askew_roller_does_not_overlap() {
    for (askew, method) in
        [0.02, 0.05, 0.1, 0.3].into_iter().flat_map(|x| [(x, "events"), (x, "stepping")])
    {
        let overlaps = [4e-3, 2e-3, 1e-3].map(|step| {
            let all = roller(step, method, askew);
            all.iter().map(|own| -own.sensors[0]).fold(f64::MIN, f64::max)
        });
        println!("{askew} rad, {method}: overlaps {overlaps:?} m");
        assert!(overlaps.iter().all(|own| *own < 1e-13), "{overlaps:?}");
    }
}
