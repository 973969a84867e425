//! Sensors of a model file: what they measure, along a run and in `sensors.csv`.
#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use std::fs;
use std::path::{Path, PathBuf};

use harness::models::{model, nodes};
use holonom::output::Status;
use holonom::{Model, Override, RunFolder, Sample, Simulation};
use nalgebra::{Quaternion, Vector3};
use vi_testkit::model::{AXES, head, hinge, part, sensor};

/// Runs a model into a folder of its own, as the program does.
fn write(case: &str, model: &Model) -> (PathBuf, holonom::run::Finished) {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sensors").join(case);
    let _ = fs::remove_dir_all(&path);
    let folder = RunFolder::create(&path, false).unwrap();
    let mut simulation = Simulation::new(model).unwrap();
    let finished = holonom::run::run(model, &mut simulation, &folder, &mut |_, _| {}).unwrap();
    (path, finished)
}

/// A rotor on the ground, spinning freely; its own axes are not its principal ones.
fn rotor(every: u32, order: u32) -> Model {
    let text = [
        head("rotor", &format!("step = 0.01, end = 2.1, every = {every}, order = {order}")),
        part("body", "disk") + "mass = 1.0\nposition = [0.0, 0.0, 1.0]\n",
        "inertia = [[0.02, 0.005, 0.0], [0.005, 0.03, 0.0], [0.0, 0.0, 0.05]]\n".into(),
        "rotation_vector = [0.0, 0.0, 0.4]\nangular_velocity = [0.0, 0.0, 90.0]\n".into(),
        hinge("bearing", ["ground", "disk"], [0.0; 3], AXES[2]),
        sensor("angle", "joint_coordinate", "bearing"),
        sensor("rate", "joint_rate", "bearing"),
        sensor("attitude", "orientation", "disk"),
        sensor("omega", "angular_velocity", "disk"),
        sensor("rim", "velocity", "disk") + "point = [0.2, 0.0, 0.0]\n",
    ]
    .concat();
    Model::from_toml(&text).unwrap()
}

#[test]
fn angles_count_on_beyond_half_a_turn_whatever_is_recorded() {
    let turn = 0.9_f64.asin(); // of one step: sin Δ = h ω, the discrete rotor
    for every in [1, 7] {
        let samples = nodes(&rotor(every, 2));
        assert_eq!(samples.len() as u32, 210 / every + 1);
        for sample in &samples {
            let exact = sample.step as f64 * turn;
            let error = (sample.sensors[0] - exact).abs();
            assert!(error < 1e-11, "step {}: angle off by {error:e}", sample.step);
        }
        let turns = samples.last().unwrap().sensors[0] / std::f64::consts::TAU;
        assert!(turns > 30.0, "{turns} turns");
    }
    let slow = [Override::new("body.disk.angular_velocity", "[0, 0, 9]")];
    let last = nodes(&rotor(7, 4).with_overrides(&slow).unwrap()).pop().unwrap();
    let error = (last.sensors[0] - 9.0 * last.t).abs();
    println!("order 4: {} rad, off by {error:.1e}", last.sensors[0]);
    assert!(error < 1e-3, "order 4: off by {error:e}");
}

#[test]
fn rates_and_velocities_are_those_of_the_projected_momentum() {
    for order in [2, 4] {
        for sample in nodes(&rotor(3, order)) {
            let s = &sample.sensors;
            assert!((s[1] - 90.0).abs() < 1e-10, "rate {}", s[1]);
            let omega = Vector3::from_column_slice(&s[6..9]);
            assert!((omega - Vector3::new(0.0, 0.0, 90.0)).amax() < 1e-10, "{omega}");
            let quaternion = Quaternion::new(s[2], s[3], s[4], s[5]);
            let own = nalgebra::UnitQuaternion::from_quaternion(quaternion);
            let rim = omega.cross(&(own * Vector3::new(0.2, 0.0, 0.0)));
            let error = (Vector3::from_column_slice(&s[9..12]) - rim).amax();
            assert!(error < 1e-10, "rim off by {error:e} m/s");
        }
    }
}

#[test]
fn orientation_is_that_of_the_body_and_its_sign_does_not_jump() {
    for every in [1, 5] {
        let samples = nodes(&rotor(every, 2));
        let turn = 0.9_f64.asin();
        for sample in samples {
            let half = 0.5 * (0.4 + sample.step as f64 * turn);
            let exact = [half.cos(), 0.0, 0.0, half.sin()]; // goes through both signs
            for (k, exact) in exact.into_iter().enumerate() {
                let error = (sample.sensors[2 + k] - exact).abs();
                assert!(error < 1e-11, "step {}, {k}: off by {error:e}", sample.step);
            }
        }
    }
}

#[test]
fn a_point_is_given_in_the_body_not_in_its_principal_axes() {
    let text = rotor(1, 2).to_toml()
        + "\n[[sensor]]\nname = \"mark\"\ntype = \"position\"\nof = \"disk\"\npoint = [0.1, 0.2, 0.3]\n";
    let model = Model::from_toml(&text).unwrap();
    let samples = nodes(&model);
    let mark = Vector3::from_column_slice(&samples[0].sensors[12..15]);
    let error = (mark - model.body("disk").unwrap().point([0.1, 0.2, 0.3])).amax();
    assert!(error < 1e-15, "{error:e}");
}

const PUSHED: &str = include_str!("../models/pushed_box.toml");

#[test]
fn a_force_at_a_point_gives_its_impulse_and_its_moment() {
    let samples = nodes(&Model::from_toml(PUSHED).unwrap());
    let mut worst = [0.0_f64; 2];
    for pair in samples.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let factor = 0.5 * (a.t + b.t);
        let impulse = 0.01 * factor * Vector3::new(1.0, -2.0, 0.5);
        let corner = |s: &Sample| Vector3::from_column_slice(&s.sensors);
        // half of it at each end
        let moment = (0.5 * (corner(a) + corner(b))).cross(&impulse);
        let gain = |f: fn(&Sample) -> [f64; 3]| Vector3::from(f(b)) - Vector3::from(f(a));
        worst[0] = worst[0].max((gain(|s| s.momentum.linear) - impulse).amax());
        worst[1] = worst[1].max((gain(|s| s.momentum.angular) - moment).amax());
    }
    println!("momentum missed by {worst:?} per step");
    assert!(worst[0] < 1e-14 && worst[1] < 1e-14, "{worst:?}");
}

/// A text table with six digits after the point.
fn rounded(csv: &str) -> String {
    let field = |field: &str| match (field.contains('.'), field.parse::<f64>()) {
        (true, Ok(value)) => format!("{:.6}", (value * 1e6).round() / 1e6 + 0.0),
        _ => field.to_owned(),
    };
    let line = |line: &str| line.split(',').map(field).collect::<Vec<_>>().join(",");
    let mut lines = csv.lines();
    let header = lines.next().unwrap().to_owned();
    std::iter::once(header).chain(lines.map(line)).collect::<Vec<_>>().join("\n")
}

#[test]
fn the_file_has_the_rows_of_the_trajectory() {
    let overrides = [("simulation.end", "0.1".to_owned()), ("simulation.every", "10".to_owned())];
    let (path, finished) = write("steady", &model("heavy_top_steady", &overrides));
    assert!(finished.files.contains(&path.join("sensors.csv")));
    let read = |name: &str| fs::read_to_string(path.join(name)).unwrap();
    let rows = |text: &str| -> Vec<String> {
        let head = |line: &str| line.splitn(3, ',').take(2).collect::<Vec<_>>().join(",");
        text.lines().map(head).collect()
    };
    assert_eq!(rows(&read("sensors.csv")), rows(&read("trajectory.csv")));
    insta::assert_snapshot!(rounded(&read("sensors.csv")));
    let page = read("report.html");
    for words in ["Sensor base: position", "Sensor support: force", "force (N)"] {
        assert!(page.contains(words), "{words}");
    }
    let plots = finished.files.iter().filter_map(|f| f.file_name()?.to_str());
    let plots: Vec<&str> = plots.filter(|name| name.starts_with("sensor_")).collect();
    let expected =
        ["sensor_01_base.svg", "sensor_02_support_force.svg", "sensor_02_support_moment.svg"];
    assert_eq!(plots, expected);
}

#[test]
fn a_run_without_sensors_has_no_such_file() {
    let overrides = [("simulation.end", "0.1".to_owned())];
    let (path, finished) = write("none", &model("pendulum", &overrides));
    assert!(!path.join("sensors.csv").exists());
    assert!(finished.files.iter().all(|f| f.exists() && !f.ends_with("sensors.csv")));
}

#[test]
fn after_a_failed_run_the_file_is_valid() {
    let overrides = [("simulation.newton_max_iterations", "1".to_owned())];
    for order in ["2", "4"] {
        let all = [overrides[0].clone(), ("simulation.order", order.to_owned())];
        let (path, finished) = write(&format!("failed{order}"), &model("heavy_top_steady", &all));
        assert_eq!(finished.summary.status, Status::Failed);
        let text = fs::read_to_string(path.join("sensors.csv")).unwrap();
        assert!(text.ends_with('\n'));
        let widths: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(widths, [12, 12], "a header and the start: {text}");
        // of the start, from the acceleration level: exact
        let row: Vec<f64> =
            text.lines().nth(1).unwrap().split(',').map(|f| f.parse().unwrap()).collect();
        assert!((row[7] - 6.934_280_384_636).abs() < 1e-9, "{row:?}");
        assert!((row[6] - 4.591_179_640_718).abs() < 1e-9, "{row:?}");
    }
}

const DOOR: &str = include_str!("../models/door.toml");

#[test]
fn components_that_are_not_unique_are_marked() {
    let (path, _) = write("door", &Model::from_toml(DOOR).unwrap());
    let csv = fs::read_to_string(path.join("sensors.csv")).unwrap();
    let expected = "step,t,low_hinge.fx,low_hinge.fy,low_hinge.fz,\
                    low_hinge.mx,low_hinge.my,low_hinge.mz,low_hinge.unique";
    assert_eq!(csv.lines().next(), Some(expected));
    for line in csv.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields[2..7], [""; 5], "{line}");
        assert_eq!(fields[8], "0", "{line}");
    }
}

#[test]
fn long_runs_are_drawn_without_components_that_are_not_unique() {
    let mut model = Model::from_toml(DOOR).unwrap();
    model.settings.end = 21.0; // more nodes than a curve has points
    let (path, _) = write("door_long", &model);
    let page = fs::read_to_string(path.join("report.html")).unwrap();
    assert!(
        page.contains("Not unique at any node: mx, my."),
        "the moment has one unique component"
    );
    let plots = path.join("plots");
    assert!(plots.join("sensor_01_low_hinge_moment.svg").exists());
    assert!(!plots.join("sensor_01_low_hinge_force.svg").exists(), "no component of it is unique");
}
