//! `energy.csv`: parts of the energy, the work of each force, and the balance.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{assert_order, model, orders, samples};
use holonom::{Model, Sample, Simulation};

/// A driven slider on an arm: gravity, springs, a damper, a motor, loads, a damped beam, a
/// prescribed motion.
const MODEL: &str = r#"
model = { name = "mixed", gravity = [0, 0, -9.81] }
simulation = { step = 1e-3, end = 0.2 }
[[body]]
name = "arm"
mass = 2
inertia = [0.01, 0.2, 0.2]
position = [0.5, 0, 0]
[[body]]
name = "bob"
mass = 1
inertia = [0.01, 0.02, 0.02]
position = [1.3, 0, 0]
[[body]]
name = "wheel"
mass = 1.5
inertia = [0.02, 0.03, 0.02]
position = [0, 3, 0]
[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "arm"
position = [0, 0, 0]
axis = [0, 1, 0]
spring = { stiffness = 5, rest = 0.3 }
motor = { effort = -4, history = { type = "harmonic", frequency = 1.5, phase = 0.4 } }
[[joint]]
name = "elbow"
type = "revolute"
parent = "arm"
child = "bob"
position = [1, 0, 0]
axis = [0, 1, 0]
damper = { damping = 0.3 }
motor = { proportional = 3, derivative = 0.1 }
[[joint]]
name = "axle"
type = "revolute"
parent = "ground"
child = "wheel"
position = [0, 3, 0]
axis = [0, 1, 0]
[[constraint]]
type = "motion"
name = "drive"
joint = "axle"
path = { amplitude = 0.5, frequency = 1.2, phase = -1.5707963267948966 }
[[spring]]
name = "coil"
from = "ground"
to = "bob"
point_from = [0.5, 0, 1]
stiffness = 30
damping = 0.7
[[load]]
name = "push"
body = "bob"
force = [0, 0, 2]
frame = "body"
history = { type = "harmonic", frequency = 0.8 }
[[beam]]
name = "strip"
points = [[0, 6, 0], [1, 6, 0]]
elements = 4
normal = [0, 0, 1]
start = "clamped"
section = { EA = 500, GA1 = 500, GA2 = 500, EI1 = 1, EI2 = 1, GJ = 1, rhoA = 0.1, rhoI1 = 1e-3, rhoI2 = 1e-3, damping = 5e-3 }
[[load]]
name = "wind"
beam = "strip"
force = [0, 0, 0.3]
"#;

fn run(model: &Model) -> (Vec<String>, Vec<Sample>) {
    let mut simulation = Simulation::new(model).unwrap();
    let samples = samples(&mut simulation);
    (simulation.energy_columns().to_vec(), samples)
}

#[test]
fn parts_add_up_and_the_balance_closes() {
    for scheme in ["nodal", "em-nodal"] {
        let steps = [2e-3, 1e-3, 5e-4];
        let balances = steps.map(|h| {
            let step = format!("{h:e}");
            let own = [("simulation.step", step.as_str()), ("simulation.scheme", scheme)];
            let (columns, samples) = run(&model(MODEL, &own));
            let expected = [
                "kinetic",
                "gravity",
                "elastic",
                "springs",
                "total",
                "work_of_material_damping",
                "work.coil",
                "work.shoulder.motor",
                "work.elbow.damper",
                "work.elbow.motor",
                "work.push",
                "work.wind",
                "work_of_motions",
                "balance",
            ];
            assert_eq!(columns, expected);
            let mut sum = 0.0_f64;
            for s in &samples {
                let e = &s.energies;
                assert_eq!(e.len(), expected.len());
                sum = sum.max((e[0] + e[1] + e[2] + e[3] - e[4]).abs());
                let works: f64 = e[5..13].iter().sum();
                assert!((works - s.work).abs() < 1e-13);
                assert!((e[4] - samples[0].energies[4] - works - e[13]).abs() < 1e-12);
            }
            assert!(sum < 1e-12, "{scheme}: the parts miss the total by {sum:e} J");
            let last = &samples.last().unwrap().energies;
            println!("{scheme}, h = {h}: parts off by {sum:.1e} J, at the end {last:.3?}");
            // what dissipates takes energy
            assert!(last[5] < -1e-6 && last[6] < 0.0 && last[8] < 0.0);
            assert!(last[5..13].iter().all(|work| work.abs() > 1e-6));
            let largest = |s: &Sample| s.energies[13].abs();
            samples.iter().map(largest).fold(0.0, f64::max)
        });
        if scheme == "em-nodal" {
            println!("balance {balances:?} J");
            // by the prescribed motion
            assert_order(&orders("balance", &steps, &balances), 2.0, 0.3);
        } else {
            assert_order(&orders("balance", &steps, &balances), 2.0, 0.3);
        }
    }
}

/// A pendulum on a driven arm.
const DRIVEN: &str = r#"
model = { name = "driven", gravity = [0, 0, -9.81] }
simulation = { step = 1e-2, end = 0.8 }
[[body]]
name = "arm"
mass = 1.5
inertia = [0.02, 0.03, 0.02]
position = [0.3, 0, 0]
[[body]]
name = "bob"
mass = 1
inertia = [0.01, 0.02, 0.02]
position = [0.9, 0, 0]
[[joint]]
name = "axle"
type = "revolute"
parent = "ground"
child = "arm"
position = [0, 0, 0]
axis = [0, 1, 0]
[[joint]]
name = "elbow"
type = "revolute"
parent = "arm"
child = "bob"
position = [0.6, 0, 0]
axis = [0, 1, 0]
[[constraint]]
type = "motion"
name = "drive"
joint = "axle"
path = { amplitude = 0.5, frequency = 1.2, phase = -1.5707963267948966 }
"#;

/// The sub-steps of a composition have weights of opposite sign; the work of motions keeps its
/// order all the same.
#[test]
fn the_work_of_motions_has_the_order_of_the_composition() {
    for (order, scheme) in [(4, "nodal"), (4, "constrained"), (6, "nodal")] {
        let steps = [8e-2, 4e-2, 2e-2];
        let balances = steps.map(|h| {
            let (step, order) = (format!("{h:e}"), order.to_string());
            let own = [
                ("simulation.step", step.as_str()),
                ("simulation.order", order.as_str()),
                ("simulation.scheme", scheme),
            ];
            let (_, samples) = run(&model(DRIVEN, &own));
            let balance = |s: &Sample| s.energies.last().unwrap().abs();
            let work = samples.iter().map(|s| s.work.abs()).fold(0.0, f64::max);
            assert!(work > 0.1, "the drive works: {work} J");
            samples.iter().map(balance).fold(0.0, f64::max)
        });
        println!("{scheme}, order {order}: balance {balances:?} J");
        assert_order(&orders("balance", &steps, &balances), f64::from(order), 0.5);
    }
}

/// Without prescribed motions an energy–momentum scheme closes the balance to round-off.
#[test]
fn energy_momentum_schemes_close_the_balance_exactly() {
    let drive = MODEL.find("[[constraint]]").unwrap()..MODEL.find("[[spring]]").unwrap();
    let text = MODEL.replace(&MODEL[drive], "");
    let own = [("simulation.scheme", "em-nodal"), ("simulation.step", "2e-3")];
    let (columns, samples) = run(&model(&text, &own));
    assert!(!columns.contains(&"work_of_motions".to_owned()));
    let balance = samples.iter().map(|s| s.energies.last().unwrap().abs()).fold(0.0, f64::max);
    println!("balance {balance:.1e} J");
    assert!(balance < 1e-11);
}

/// The work of a constant torque on a wheel is the torque times the angle.
#[test]
fn the_work_of_a_motor_is_its_effort_times_the_angle() {
    let text = r#"
model = { name = "wheel" }
simulation = { step = 0.001, end = 3 }
[[body]]
name = "wheel"
mass = 1
inertia = [0.3, 0.3, 0.5]
position = [0, 0, 0]
[[joint]]
name = "axle"
type = "revolute"
parent = "ground"
child = "wheel"
position = [0, 0, 0]
axis = [0, 0, 1]
motor = { effort = 2 }
[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "axle"
"#;
    let (columns, samples) = run(&Model::from_toml(text).unwrap());
    assert_eq!(columns, ["kinetic", "total", "work.axle.motor", "balance"]);
    let last = samples.last().unwrap();
    // θ = ½ (τ/I) t²
    let error = (last.energies[2] - 2.0 * last.sensors[0]).abs() / last.energies[2];
    println!("angle {} rad, work {} J, off by {error:.1e}", last.sensors[0], last.energies[2]);
    assert!((last.sensors[0] - 18.0).abs() < 1e-3 && error < 1e-4);
}
