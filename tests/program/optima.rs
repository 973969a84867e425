//! `optimize` from outside: files, exit codes, the run of the result.

use std::fs;
use std::path::Path;

use crate::program::command::{code, files, folder, holonom, words};
use serde_json::Value;

const PENDULUM: &str = r#"
parameters = { length = 0.7 }
model = { name = "clock", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 1.0 }
body = [{ name = "bob", mass = 1.0, inertia = [1e-3, 1e-3, 1e-3], position = ["= length", 0.0, 0.0] }]
joint = [{ name = "hinge", type = "revolute", parent = "ground", child = "bob", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0] }]
sensor = [{ name = "place", type = "position", of = "bob" }, { name = "angle", type = "joint_coordinate", of = "hinge" }]
"#;
const DESIGN: &str = r#"
condition = [{ name = "down", sensor = "place.x", at = 0.5, equals = 0.0 }]
optimize = { parameters = { length = { min = 0.2, max = 2.0 } } }
"#;
const CONTROL: &str = r#"
control = [{ name = "torque", joint = "hinge" }]
objective = [{ name = "cheap", type = "effort" }]
condition = [{ name = "up", sensor = "angle", equals = -1.0 }, { name = "stop", type = "rest" }]
"#;

fn written(case: &str, more: &str) -> std::path::PathBuf {
    let folder = folder("optima", case);
    fs::write(folder.join("clock.toml"), format!("{PENDULUM}{more}")).unwrap();
    folder
}

fn optimum(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("clock-optimum/optimum.json")).unwrap()).unwrap()
}

/// The run of `model.toml` is the one in the folder, byte for byte.
fn is_repeated(folder: &Path) {
    assert_eq!(code(folder, &["run", "clock-optimum/model.toml", "-o", "again", "-q"]), 0);
    for file in ["trajectory.csv", "sensors.csv", "energy.csv", "residuals.csv"] {
        let [own, again] =
            ["clock-optimum", "again"].map(|name| fs::read(folder.join(name).join(file)).unwrap());
        assert!(own == again, "{file} differs");
    }
}

#[test]
fn a_design_is_written_as_the_run_of_its_model() {
    let folder = written("design", DESIGN);
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 0);
    let found = optimum(&folder);
    assert_eq!(found["status"], "optimal");
    let names = files(&folder.join("clock-optimum"));
    for name in ["optimum.json", "iterations.csv", "model.toml", "summary.json", "report.html"] {
        assert!(names.contains(name), "{name} in {names:?}");
    }
    assert!(!names.contains("controls.csv"));
    is_repeated(&folder);
    let length = found["parameters"][0]["value"].as_f64().unwrap();
    let sensors = fs::read_to_string(folder.join("clock-optimum/sensors.csv")).unwrap();
    let row: Vec<&str> = sensors.lines().nth(51).unwrap().split(',').collect();
    let x: f64 = row[2].parse().unwrap();
    assert_eq!(row[1], "0.5");
    assert!(x.abs() < 1e-9 && length > 0.2 && length < 2.0, "{x} {length}");
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 2, "nothing is overwritten");
    let json = holonom(&folder, &["optimize", "clock.toml", "--force", "--json"]);
    assert_eq!(serde_json::from_slice::<Value>(&json.stdout).unwrap(), found);
    assert_eq!(code(&folder, &["run", "clock.toml", "-q"]), 0, "a run does without the sections");
}

#[test]
fn what_is_no_optimum_ends_with_1_and_says_so() {
    let folder = written("infeasible", &DESIGN.replace("equals = 0.0", "equals = 5.0"));
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 1);
    assert_eq!(optimum(&folder)["status"], "infeasible");
    let few = DESIGN.replace("optimize = {", "optimize = { max_iterations = 1,");
    let folder = written("few", &few);
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 1);
    assert_eq!(optimum(&folder)["status"], "unfinished");
    let idle = DESIGN.replace("length = {", "width = {");
    assert_eq!(code(&written("idle", &idle), &["optimize", "clock.toml"]), 3);
    assert_eq!(code(&written("nothing", ""), &["optimize", "clock.toml"]), 3);
}

#[cfg(not(feature = "optimize"))]
#[test]
fn controls_need_a_method_that_is_named() {
    let folder = written("no_method", CONTROL);
    let output = holonom(&folder, &["optimize", "clock.toml"]);
    assert_eq!(output.status.code(), Some(3));
    let text = words(&output);
    assert!(text.contains("control") && text.contains("--features optimize"), "{text}");
}

#[cfg(feature = "optimize")]
#[test]
fn optimal_efforts_are_repeated_bit_for_bit() {
    let folder = written("control", CONTROL);
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 0);
    let found = optimum(&folder);
    assert_eq!((&found["status"], &found["sufficient"]), (&"optimal".into(), &true.into()));
    let controls = fs::read_to_string(folder.join("clock-optimum/controls.csv")).unwrap();
    assert_eq!((controls.lines().next(), controls.lines().count()), (Some("t_mid,torque"), 101));
    is_repeated(&folder);
    // from there again: at once
    let more = format!("{CONTROL}optimize = {{ guess = \"clock-optimum\", refine = 0 }}");
    fs::write(folder.join("again.toml"), format!("{PENDULUM}{more}")).unwrap();
    let again = holonom(&folder, &["optimize", "again.toml", "--json"]);
    let again: Value = serde_json::from_slice(&again.stdout).unwrap();
    let [a, b] = [&found, &again].map(|own| own["cost"].as_f64().unwrap());
    assert!((a - b).abs() < 1e-8 * a, "{a} {b}");
}
