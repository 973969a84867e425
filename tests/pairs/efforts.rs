//! Efforts of motors, prescribed motions, springs and distances; reactions along stated axes.
#![allow(clippy::unwrap_used, clippy::float_cmp)] // a test; flags are 0 or 1

use crate::benchmark;

use benchmark::{assert_order, model, orders, samples};
use holonom::{Model, Sample, Simulation};
use std::f64::consts::TAU;
use vi_testkit::model::{AXES, between, body_at, heavy, hinge, motion, sensor, to_and_fro};

fn run(model: &Model) -> (Vec<String>, Vec<Sample>) {
    let mut simulation = Simulation::new(model).unwrap();
    let samples = samples(&mut simulation);
    let names = simulation.sensors().columns().iter().map(holonom::sensor::SensorColumn::name);
    (names.collect(), samples)
}

const PENDULUM: &str = include_str!("../models/bar.toml");

fn drive(path: &str) -> String {
    motion("drive", "hinge", path) + &sensor("torque", "effort", "drive")
}

/// By 0.8 rad to each side of it, in 1 s.
fn sine() -> String {
    drive(&to_and_fro(0.8, 1.0))
}

/// `τ = I θ̈ − m g l cos θ` about y, on which gravity acts with `+m g l cos θ`.
#[test]
fn the_effort_of_a_prescribed_motion_is_that_of_inverse_dynamics() {
    for scheme in ["nodal", "dalembert", "constrained", "em-nodal"] {
        let steps = [2e-3, 1e-3];
        let errors = steps.map(|h| {
            let step = format!("{h:e}");
            let own = [("simulation.scheme", scheme), ("simulation.step", step.as_str())];
            let (names, samples) = run(&model(&(PENDULUM.to_owned() + &sine()), &own));
            assert_eq!(names, ["torque.effort", "torque.unique"]);
            let inner = &samples[1..samples.len() - 1];
            let error = |s: &Sample| {
                let phase = TAU * s.t - 0.25 * TAU;
                let (angle, acceleration) =
                    (0.8 * (phase.sin() + 1.0), -0.8 * TAU * TAU * phase.sin());
                let expected = (0.2 + 2.0 * 0.25) * acceleration - 2.0 * 9.81 * 0.5 * angle.cos();
                assert_eq!(s.sensors[1], 1.0);
                (s.sensors[0] - expected).abs()
            };
            inner.iter().map(error).fold(0.0, f64::max)
        });
        println!("{scheme}: off by {errors:?} N·m");
        assert_order(&orders("torque", &steps, &errors), 2.0, 0.2);
        assert!(errors[1] < 2e-3);
    }
}

/// Six hinges in a row about z, y, y, x, y, x, each driven along its own sinusoid.
fn arm(h: f64) -> String {
    let mut text = heavy("arm", [0.0, 0.0, -9.81], &format!("step = {h:e}, end = 1"));
    let axes = [2, 1, 1, 0, 1, 0].map(|k: usize| AXES[k]);
    for (k, axis) in axes.into_iter().enumerate() {
        let x = 0.3 * k as f64;
        let [link, joint, drive] = ["link", "joint", "drive"].map(|name| format!("{name}{k}"));
        let parent = if k == 0 { "ground".to_owned() } else { format!("link{}", k - 1) };
        text += &body_at([x + 0.15, 0.0, 0.0], &link, 3.0 / (1.0 + k as f64), [0.01, 0.03, 0.025]);
        text += &hinge(&joint, [&parent, &link], [x, 0.0, 0.0], axis);
        text += &motion(&drive, &joint, &to_and_fro(0.4, 0.5 + 0.13 * k as f64));
        text += &sensor(&format!("torque{k}"), "effort", &drive);
        text += &sensor(&format!("rate{k}"), "joint_rate", &joint);
    }
    text
}

/// The power `Σ τ θ̇` of the drives, summed over the time, is what the energy changes by.
#[test]
fn drives_of_an_arm_close_the_power_balance() {
    let steps = [4e-3, 2e-3, 1e-3];
    let errors = steps.map(|h| {
        let (names, samples) = run(&Model::from_toml(&arm(h)).unwrap());
        let column = |name: String| names.iter().position(|n| *n == name).unwrap();
        let power = |s: &Sample| -> f64 {
            let of = |k: usize| {
                let [torque, rate] = [format!("torque{k}.effort"), format!("rate{k}")].map(column);
                s.sensors[torque] * s.sensors[rate]
            };
            (0..6).map(of).sum()
        };
        let work: f64 = samples.windows(2).map(|s| 0.5 * h * (power(&s[0]) + power(&s[1]))).sum();
        let (first, last) = (&samples[0], samples.last().unwrap());
        println!("h = {h}: work {work:.6} J, energy {:.6} J", last.hamiltonian - first.hamiltonian);
        (last.hamiltonian - first.hamiltonian - work).abs()
    });
    assert_order(&orders("power balance", &steps, &errors), 2.0, 0.2);
}

/// A hinge with spring, damper and motor, a spring to the ground, a weight on a rod.
#[test]
fn force_elements_show_their_efforts() {
    let elements = [
        PENDULUM,
        "spring = { stiffness = 3, rest = 0.1 }\ndamper = { damping = 0.5 }\n",
        "motor = { effort = -2, history = { type = \"harmonic\", frequency = 0.5, phase = 1 }, derivative = 0.3 }\n",
        &between("spring", "coil", ["ground", "bar"]),
        "point_from = [0, 0, 2]\nstiffness = 40\nnatural_length = 1.9\ndamping = 0.2\n",
        &body_at([5.0, 0.0, -1.0], "weight", 3.0, [0.01; 3]),
        &between("constraint", "rod", ["ground", "weight"]),
        "type = \"distance\"\npoint_from = [5, 0, 0]\n",
        &sensor("hinge_effort", "effort", "hinge"),
        &sensor("coil_force", "effort", "coil"),
        &sensor("rod_force", "effort", "rod"),
        &sensor("angle", "joint_coordinate", "hinge"),
        &sensor("rate", "joint_rate", "hinge"),
    ]
    .concat();
    let (names, samples) = run(&model(&elements, &[]));
    let expected = [
        "hinge_effort.spring",
        "hinge_effort.damper",
        "hinge_effort.motor",
        "coil_force",
        "rod_force.effort",
        "rod_force.unique",
        "angle",
        "rate",
    ];
    assert_eq!(names, expected);
    let mut worst = [0.0_f64; 5];
    for s in &samples {
        let [spring, damper, motor, coil, rod, unique, angle, rate] = s.sensors[..] else {
            panic!()
        };
        let (x, z) = (0.5 * angle.cos(), -0.5 * angle.sin());
        let (vx, vz) = (rate * z, -rate * x);
        let length = x.hypot(2.0 - z);
        let stretching = (x * vx - (2.0 - z) * vz) / length;
        let errors = [
            spring + 3.0 * (angle - 0.1),
            damper + 0.5 * rate,
            motor + 2.0 * (0.5 * TAU * s.t + 1.0).sin() + 0.3 * rate,
            coil - 40.0 * (length - 1.9) - 0.2 * stretching,
            rod - 3.0 * 9.81,
        ];
        assert_eq!(unique, 1.0);
        (0..5).for_each(|k| worst[k] = worst[k].max(errors[k].abs()));
    }
    println!("spring, damper, motor, coil, rod off by {worst:?}");
    assert!(worst.iter().all(|error| *error < 1e-9));
}

/// The motion of a body that two constraints hold: their efforts are not unique, and it is said.
#[test]
fn an_effort_that_is_not_unique_is_an_empty_field() {
    let twice = sine().replace("drive", "second").replace("torque", "other");
    let (_, samples) = run(&model(&[PENDULUM, &sine(), &twice].concat(), &[]));
    for s in &samples {
        assert!(s.sensors[0].is_nan() && s.sensors[1] == 0.0, "{:?}", s.sensors);
    }
}

#[test]
fn reactions_come_along_the_axes_that_are_asked_for() {
    let reaction = |name: &str, frame: &str| sensor(name, "reaction", "hinge") + frame + "\n";
    let text = [
        PENDULUM.to_owned() + &sine(),
        reaction("plain", ""),
        reaction("parent", "frame = \"parent\""),
        reaction("child", "frame = \"child\""),
        reaction("space", "frame = \"space\""),
        sensor("angle", "joint_coordinate", "hinge"),
        sensor("rate", "joint_rate", "hinge"),
    ];
    let (names, samples) = run(&model(&text.concat(), &[]));
    assert_eq!(names[2..5], ["plain.fx", "plain.fy", "plain.fz"]);
    let mut worst = 0.0_f64;
    for s in &samples[1..] {
        let force =
            |k: usize| nalgebra::Vector3::from_column_slice(&s.sensors[2 + 7 * k..5 + 7 * k]);
        let (plain, parent, child, space) = (force(0), force(1), force(2), force(3));
        assert_eq!(plain, parent);
        // the parent is the ground: its axes are the same rotation of space at all times
        assert!((parent.norm() - space.norm()).abs() < 1e-9 && space.y.abs() < 1e-9);
        // m(a − g) of the centre of the bar; along the bar: −m l ω² − m g·e
        let (angle, rate) = (s.sensors[30], s.sensors[31]);
        let along = nalgebra::Vector3::new(angle.cos(), 0.0, -angle.sin());
        let radial = -2.0 * 0.5 * rate * rate - 2.0 * 9.81 * angle.sin();
        worst = worst.max((space.dot(&along) - radial).abs());
        // the axes m_1', m_2' of the child are those of the parent, turned about n
        let (sin, cos) = angle.sin_cos();
        let turned = [cos * parent.x + sin * parent.y, cos * parent.y - sin * parent.x, parent.z];
        assert!((child - nalgebra::Vector3::from(turned)).amax() < 1e-9, "{child} and {turned:?}");
        assert!(parent.z.abs() < 1e-9); // n is the axis: nothing acts along it
    }
    println!("force along the bar off by {worst:.1e} N");
    assert!(worst < 2e-3);
}

/// A torque on a wheel that a rack moves: `θ + ϱ x` constant, `τ + λ = I θ̈`, `ϱ λ = m ẍ`.
#[test]
fn the_effort_of_a_gear_is_that_on_its_first_joint() {
    const TEXT: &str = include_str!("../models/rack.toml");
    let (names, samples) = run(&model(TEXT, &[]));
    println!("{names:?}");
    let acceleration = 5.0 / (0.3 + 2.0 / 16.0);
    let effort = 0.3 * acceleration - 5.0;
    let mut worst = [0.0_f64; 2];
    for s in &samples[1..] {
        let [found, unique, .., angle, way] = s.sensors[..] else { panic!("{names:?}") };
        worst[0] = worst[0].max((found - effort).abs());
        let expected = 0.5 * acceleration * s.t * s.t;
        worst[1] = worst[1].max((angle - expected).abs()).max((angle + 4.0 * way).abs());
        assert_eq!((unique, s.sensors[2]), (1.0, 0.0)); // nothing moves along the shaft
    }
    println!("effort {effort:.3} N·m off by {:.1e}, angle by {:.1e} rad", worst[0], worst[1]);
    assert!(worst[0] < 1e-5 && worst[1] < 1e-6); // of second order in the step
}

#[test]
fn sensors_of_efforts_are_checked() {
    let sensor = |text: &str| format!("{PENDULUM}[[sensor]]\nname = \"s\"\n{text}\n");
    for (text, expected) in [
        (sensor("type = \"effort\"\nof = \"hinge\""), "has no spring, no damper and no motor"),
        (
            sensor("type = \"effort\"\nof = \"bar\""),
            "`bar` is a body, not a joint or spring or constraint",
        ),
        (
            sensor("type = \"position\"\nof = \"bar\"\nframe = \"space\""),
            "only the reaction of a joint has a frame",
        ),
        (sensor("type = \"reaction\"\nof = \"hinge\"\nframe = \"world\""), "world"),
    ] {
        let error = Model::from_toml(&text).unwrap_err().to_string();
        println!("{error}");
        assert!(error.contains(expected), "{error}");
    }
}

/// A hinge along two moves and a table reaches what they prescribe, and its torque is that of
/// inverse dynamics.
#[test]
fn a_motion_follows_moves_and_tables() {
    let path = "{ moves = [{ start = 0.1, end = 0.6, by = 1.2 }, { start = 0.5, end = 0.9, by = -0.3 }], \
                table = { times = [0, 0.4, 1], values = [0, 0.5, 0.2] } }";
    let drive = drive(path);
    let angle = sensor("angle", "joint_coordinate", "hinge");
    let text = format!("{PENDULUM}{drive}{angle}");
    let model = Model::from_toml(&text).unwrap();
    assert_eq!(Model::from_toml(&model.to_toml()).unwrap(), model);
    let holonom::model::Constraint::Motion { path, .. } = &model.constraints[0] else { panic!() };
    let path = path.function();
    let (_, samples) = run(&model);
    let mut worst = [0.0_f64; 2];
    for s in &samples[1..samples.len() - 1] {
        let [value, _, acceleration] = path(s.t);
        let torque = 0.7 * acceleration - 2.0 * 9.81 * 0.5 * value.cos();
        worst[0] = worst[0].max((s.sensors[2] - value).abs());
        // where the third derivative jumps the torque is of first order
        if [0.1, 0.4, 0.5, 0.6, 0.9].iter().all(|knot| (s.t - knot).abs() > 1.5e-3) {
            worst[1] = worst[1].max((s.sensors[0] - torque).abs());
        }
    }
    println!("angle off by {:.1e} rad, torque by {:.1e} N·m", worst[0], worst[1]);
    assert!(worst[0] < 1e-13 && worst[1] < 2e-3);
    let twisted = text.replace("start = 0.1, end = 0.6", "start = 0.6, end = 0.1");
    let error = Model::from_toml(&twisted).unwrap_err().to_string();
    println!("{error}");
    assert!(
        error.contains("constraint.drive.path.moves: a move starts at 0.6 s and ends at 0.1 s")
    );
}
