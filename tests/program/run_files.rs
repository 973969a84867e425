//! The files of a run: what they are called, what they hold, and what an option changes in them.
#![allow(clippy::unwrap_used)] // a test

use std::fs;

use crate::program::command::{code, files, holonom, pendulum_folder, words};
use serde_json::Value;
use std::path::PathBuf;

fn folder(case: &str) -> PathBuf {
    pendulum_folder("run_files", case)
}

#[test]
fn a_run_writes_the_files_of_the_contract() {
    let folder = folder("run");
    let output = holonom(&folder, &["run", "pendulum.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert!(output.stdout.is_empty());
    let out = folder.join("pendulum-out");
    let expected =
        "energy.csv model.toml plots report.html residuals.csv summary.json trajectory.csv";
    let expected: Vec<&str> = expected.split(' ').collect();
    assert_eq!(files(&out), expected.into_iter().map(str::to_owned).collect());
    let csv = fs::read_to_string(out.join("trajectory.csv")).unwrap();
    assert_eq!(csv.lines().next(), Some("step,t,bob.x,bob.y,E,H,Lx,Ly,Lz,Px,Py,Pz"));
    assert_eq!(csv.lines().count(), 1002);
    assert!(csv.ends_with('\n'));
    let summary: Value =
        serde_json::from_str(&fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
    let numbers = [
        "/order",
        "/step",
        "/end_time",
        "/steps",
        "/bodies",
        "/joints",
        "/coordinates",
        "/constraints",
        "/redundant_constraints",
        "/dof",
        "/newton_iterations/mean",
        "/newton_iterations/max",
        "/wall_seconds",
        "/seconds_per_step",
        "/step_seconds",
        "/energy/initial",
        "/energy/max_abs_error",
        "/energy/final",
        "/energy/work",
        "/energy/balance_error",
        "/energy/drift_per_step",
        "/momentum/linear/max_abs_drift",
        "/momentum/angular/max_abs_drift",
        "/constraint_residual/position/max",
        "/constraint_residual/velocity/max",
        "/constraint_residual/momentum/max",
    ];
    for key in numbers {
        assert!(summary.pointer(key).is_some_and(Value::is_number), "{key}: {summary}");
    }
    for key in ["/model", "/scheme", "/version", "/status"] {
        assert!(summary.pointer(key).is_some_and(Value::is_string), "{key}: {summary}");
    }
    assert_eq!(summary["steps"], 1000);
    assert_eq!(summary["dof"], 1);
}

#[test]
fn sensors_have_a_file_of_their_own() {
    let folder = folder("sensors");
    assert_eq!(code(&folder, &["examples", "heavy_top_steady", "-o", "top.toml"]), 0);
    let output = holonom(&folder, &["run", "top.toml", "--end", "0.1"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert!(
        words(&output).contains("residuals.csv, sensors.csv, energy.csv, summary.json"),
        "{}",
        words(&output)
    );
    let out = folder.join("top-out");
    let csv = fs::read_to_string(out.join("sensors.csv")).unwrap();
    assert!(csv.starts_with("step,t,base.x,base.y,base.z,support.fx,"), "{csv}");
    assert_eq!(csv.lines().count(), 52);
    // a failed run lists it, and what it holds is valid
    let failing = ["run", "top.toml", "--force", "--set", "simulation.newton_max_iterations=1"];
    let output = holonom(&folder, &failing);
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    assert!(words(&output).contains("sensors.csv"), "{}", words(&output));
    assert_eq!(fs::read_to_string(out.join("sensors.csv")).unwrap().lines().count(), 2);
    // drawn again from the files; gone with the next run of another model
    fs::remove_dir_all(out.join("plots")).unwrap();
    assert_eq!(code(&folder, &["plot", "top-out"]), 0);
    assert!(out.join("plots/sensor_01_base.svg").exists());
    assert_eq!(code(&folder, &["run", "pendulum.toml", "-o", "top-out", "--force", "-q"]), 0);
    assert!(!out.join("sensors.csv").exists());
}

#[test]
fn momenta_are_written_where_the_model_asks_for_them() {
    let folder = folder("momenta");
    let set = ["--end", "0.1", "--set", "simulation.momenta=true", "--json"];
    let run = |more: &[&str]| {
        let output = holonom(&folder, &[&["run", "pendulum.toml"][..], &set, more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    };
    let rows = |case: &str| -> Vec<Vec<String>> {
        let text = fs::read_to_string(folder.join(case).join("momenta.csv")).unwrap();
        text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
    };
    run(&["-o", "nodal"]);
    let nodal = rows("nodal");
    let header = "step,t,lambda.rod.1,p.bob.x,p.bob.y,p_projected.bob.x,p_projected.bob.y,p_reduced.bob.1,\
                  E_d.kinetic,E_d.potential,H_d.kinetic,H_d.potential,\
                  H_d_projected.kinetic,H_d_projected.potential";
    assert_eq!(nodal[0].join(","), header);
    let trajectory = fs::read_to_string(folder.join("nodal/trajectory.csv")).unwrap();
    assert_eq!(nodal.len(), trajectory.lines().count());
    for (row, other) in nodal[1..].iter().zip(trajectory.lines().skip(1)) {
        let number = |text: &str| text.parse::<f64>().unwrap();
        let other: Vec<&str> = other.split(',').collect();
        let sum = |k: usize| number(&row[k]) + number(&row[k + 1]);
        assert_eq!(row[..2], other[..2]);
        assert_eq!(sum(8).to_bits(), number(other[4]).to_bits(), "E is the sum of its parts");
        assert_eq!(sum(12).to_bits(), number(other[5]).to_bits(), "H is the sum of its parts");
    }
    run(&["-o", "composed", "--order", "4"]);
    assert!(rows("composed")[1..].iter().all(|row| row[3].is_empty() && row[8].is_empty()));
    assert!(rows("composed")[1..].iter().all(|row| !row[5].is_empty() && !row[12].is_empty()));
    run(&["-o", "em", "--scheme", "em-nodal"]);
    assert!(rows("em")[1..].iter().all(|row| !row[3].is_empty() && row[5].is_empty()));
    // a later run without them leaves none behind, and its model says nothing of them
    assert_eq!(code(&folder, &["run", "pendulum.toml", "-o", "nodal", "--force", "--quiet"]), 0);
    assert!(!folder.join("nodal/momenta.csv").exists());
    assert!(!fs::read_to_string(folder.join("nodal/model.toml")).unwrap().contains("momenta"));

    let refused = ["check", "pendulum.toml", "--set", "simulation.momenta=true"];
    assert_eq!(code(&folder, &refused), 0);
    let refused = [&refused[..], &["--set", "simulation.scheme=\"static\""]].concat();
    let output = holonom(&folder, &refused);
    assert_eq!(output.status.code(), Some(3));
    assert!(words(&output).contains("equilibria have no momenta"), "{}", words(&output));
    let schema = holonom(&folder, &["schema"]);
    assert!(String::from_utf8_lossy(&schema.stdout).contains("\"momenta\""));
}

#[test]
fn options_and_keys_change_the_model_and_the_resolved_model_tells() {
    let folder = folder("options");
    let options = [
        "run",
        "pendulum.toml",
        "-o",
        "deep/out",
        "--scheme",
        "reduced",
        "--order",
        "4",
        "--step",
        "0.05",
        "--end",
        "2",
        "--every",
        "10",
        "--set",
        "particle.bob.mass=2.5",
        "--set",
        "particle.bob.position.0=-1",
        "--set",
        "model.name=renamed",
        "-q",
    ];
    let output = holonom(&folder, &options);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert!(output.stderr.is_empty(), "{}", words(&output));
    let out = folder.join("deep/out");
    let model = fs::read_to_string(out.join("model.toml")).unwrap();
    let lines = [
        "name = \"renamed\"",
        "scheme = \"reduced\"",
        "order = 4",
        "step = 0.05",
        "end = 2.0",
        "every = 10",
        "mass = 2.5",
        "position = [-1.0, 0.0]",
    ];
    for line in lines {
        assert!(model.lines().any(|l| l == line), "{line} is not in\n{model}");
    }
    assert_eq!(fs::read_to_string(out.join("trajectory.csv")).unwrap().lines().count(), 6);
    // The resolved model is a model.
    assert_eq!(code(&folder, &["run", "deep/out/model.toml", "-o", "again"]), 0);
    let read = |path: &str| fs::read_to_string(folder.join(path)).unwrap();
    assert_eq!(read("deep/out/trajectory.csv"), read("again/trajectory.csv"));
    assert_eq!(read("deep/out/model.toml"), read("again/model.toml"));
}

#[test]
fn energy_momentum_schemes_are_schemes_like_others() {
    let folder = folder("em");
    for scheme in ["em-constrained", "em-dalembert", "em-nodal"] {
        let arguments = ["run", "pendulum.toml", "--scheme", scheme, "--json", "-o", scheme];
        let output = holonom(&folder, &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(summary["scheme"], scheme);
        let error = summary["energy"]["max_abs_error"].as_f64().unwrap();
        assert!(error < 1e-12, "{scheme}: energy off by {error:e}");
        assert!(folder.join(scheme).join("report.html").is_file());
    }
    let composed =
        ["run", "pendulum.toml", "--scheme", "em-nodal", "--order", "4", "-o", "order_4"];
    let output = holonom(&folder, &[&composed[..], &["--json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["order"], 4);
    let error = summary["energy"]["max_abs_error"].as_f64().unwrap();
    assert!(error < 1e-12, "order 4: energy off by {error:e}");
}
