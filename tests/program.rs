//! The program from outside: exit codes, files, standard output.
#![allow(clippy::unwrap_used)] // a test

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use crate::command::{PENDULUM, code, command, holonom, pendulum_folder, words};
use serde_json::Value;

fn folder(case: &str) -> PathBuf {
    pendulum_folder("program", case)
}

fn files(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
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
fn a_comparison_writes_its_files_and_replaces_none() {
    let folder = folder("compare");
    let arguments = ["compare", "pendulum.toml", "--end", "0.5", "--step", "0.01", "--order", "2"];
    let output = holonom(&folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert!(output.stdout.is_empty() && words(&output).contains("em-nodal"));
    let out = folder.join("pendulum-compare");
    let expected = ["compare.html", "compare.json", "model.toml"];
    assert_eq!(files(&out), expected.map(str::to_owned).into());
    let found: Value =
        serde_json::from_str(&fs::read_to_string(out.join("compare.json")).unwrap()).unwrap();
    assert_eq!(found["records"].as_array().unwrap().len(), 7);

    let again = holonom(&folder, &arguments);
    assert_eq!(again.status.code(), Some(2));
    assert!(words(&again).contains("add --force"), "{}", words(&again));
    let forced = [&arguments[..], &["--force", "--json", "--quiet", "--schemes", "nodal,em-nodal"]];
    let output = holonom(&folder, &forced.concat());
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["records"][1]["scheme"], "em-nodal");
    assert!(words(&output).is_empty());

    let usage = |more: &[&str]| code(&folder, &[&arguments[..3], &["--force"], more].concat());
    assert_eq!(usage(&["-1"]), 2, "an end before the start");
    assert_eq!(usage(&["1", "--order", "3"]), 2);
    assert_eq!(usage(&["1", "--schemes", "leapfrog"]), 2);
    assert_eq!(usage(&["1", "--schemes", "nodal,static"]), 2);
    fs::write(folder.join("bad.toml"), "[model]\n").unwrap();
    assert_eq!(code(&folder, &["compare", "bad.toml"]), 3);
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
fn nothing_is_overwritten_without_force() {
    let folder = folder("force");
    assert_eq!(code(&folder, &["run", "pendulum.toml", "--every", "1000"]), 0);
    let trajectory = folder.join("pendulum-out/trajectory.csv");
    let before = fs::read(&trajectory).unwrap();
    let refused = holonom(&folder, &["run", "pendulum.toml"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(words(&refused).contains("--force"), "{}", words(&refused));
    assert_eq!(fs::read(&trajectory).unwrap(), before);
    fs::write(folder.join("pendulum-out/notes.txt"), "mine").unwrap();
    assert_eq!(code(&folder, &["run", "pendulum.toml", "--force"]), 0);
    assert_ne!(fs::read(&trajectory).unwrap(), before);
    assert!(folder.join("pendulum-out/notes.txt").exists(), "the user's own file is not deleted");
}

#[test]
fn a_failed_run_keeps_valid_files_and_lists_them() {
    let folder = folder("failed");
    let top = include_str!("../examples/models/heavy_top_fast.toml");
    fs::write(folder.join("top.toml"), top).unwrap();
    // No step of four months rotates a top of 150 rad/s by less than half a revolution.
    let output = holonom(&folder, &["run", "top.toml", "--step", "1e7", "--end", "1e9", "--json"]);
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    assert!(words(&output).contains("trajectory.csv"), "{}", words(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["status"], "failed");
    assert!(summary["failure"]["remedy"].as_str().is_some_and(|r| !r.is_empty()), "{summary}");
    let csv = fs::read_to_string(folder.join("top-out/trajectory.csv")).unwrap();
    assert!(csv.ends_with('\n') && csv.lines().count() >= 2);
    let columns = csv.lines().next().unwrap().split(',').count();
    assert!(csv.lines().all(|row| row.split(',').count() == columns));
    assert_eq!(columns, 2 + 12 + 8);
    assert!(fs::read_to_string(folder.join("top-out/report.html")).unwrap().contains("failed"));
}

#[test]
fn a_run_that_fails_between_recorded_nodes_counts_its_steps() {
    let folder = folder("between");
    let model = r#"
        model = { name = "spin" }
        simulation = { step = 0.05, end = 10.0, every = 10 }
        body = [{ name = "disk", mass = 1.0, inertia = [0.1, 0.1, 0.1] }]
        joint = [{ name = "axle", type = "revolute", parent = "ground", child = "disk", position = [0, 0, 0], axis = [0, 0, 1] }]
        load = [{ name = "drive", body = "disk", torque = [0, 0, 5] }]
    "#;
    fs::write(folder.join("spin.toml"), model).unwrap();
    let output = holonom(&folder, &["run", "spin.toml", "--json"]);
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    println!("{}", words(&output));
    let steps = summary["steps"].as_u64().unwrap();
    assert_eq!(summary["steps"], summary["failure"]["step"]);
    assert_eq!(summary["end_time"], summary["failure"]["t"]);
    assert!(steps > 0 && !steps.is_multiple_of(10), "{steps}");
    assert_eq!(words(&output).matches("trajectory.csv").count(), 1, "files are named once");
}

#[test]
fn first_mistakes_are_answered() {
    let folder = folder("mistakes");
    let output = holonom(&folder, &["run", "nowhere.toml"]);
    assert_eq!(output.status.code(), Some(3), "a model that cannot be read");
    assert!(words(&output).contains("`holonom examples` lists"), "{}", words(&output));
    let answer = |from: &str, to: &str| {
        let text = include_str!("../examples/models/heavy_top_fast.toml").replacen(from, to, 1);
        assert!(text.contains(to), "{from}");
        fs::write(folder.join("wrong.toml"), text).unwrap();
        let output = holonom(&folder, &["check", "wrong.toml"]);
        assert_eq!(output.status.code(), Some(3));
        words(&output)
    };
    assert!(answer("\"spherical\"", "\"ball\"").contains("did you mean `spherical`?"));
    assert!(answer("gravity = [", "gravity = 9.81 # [").contains("write a list such as"));
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error_with_its_name() {
    let folder = folder("unwritable");
    fs::write(folder.join("file"), "").unwrap();
    let output = holonom(&folder, &["run", "pendulum.toml", "-o", "file/below"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(words(&output).contains("file/below"), "{}", words(&output));
}

#[test]
fn json_goes_to_standard_output_alone() {
    let folder = folder("json");
    let output = holonom(&folder, &["run", "pendulum.toml", "--json"]);
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    let written = fs::read(folder.join("pendulum-out/summary.json")).unwrap();
    assert_eq!(summary, serde_json::from_slice::<Value>(&written).unwrap());
    let output = holonom(&folder, &["check", "pendulum.toml", "--json"]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["valid"], true);
    assert_eq!(report["assembly"]["dof"], 1);
    let schema: Value = serde_json::from_slice(&holonom(&folder, &["schema"]).stdout).unwrap();
    assert!(schema["properties"]["body"].is_object(), "{schema}");
    assert!(!schema.to_string().replace("null space", "").contains("null"), "TOML has no null");
}

#[test]
fn the_model_of_the_user_is_never_replaced() {
    let folder = folder("own");
    fs::write(folder.join("model.toml"), PENDULUM).unwrap();
    for force in [&[][..], &["--force"]] {
        let output = holonom(&folder, &[&["run", "model.toml", "-o", "."], force].concat());
        assert_eq!(output.status.code(), Some(2), "{}", words(&output));
        assert_eq!(fs::read_to_string(folder.join("model.toml")).unwrap(), PENDULUM);
    }
}

#[test]
fn a_closed_standard_error_changes_nothing() {
    let folder = folder("deaf");
    for (arguments, code) in [(&["run", "pendulum.toml"][..], 0), (&["check", "none.toml"], 3)] {
        let mut child = command(&folder, arguments).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stderr.take());
        assert_eq!(child.wait().unwrap().code(), Some(code), "{arguments:?}");
    }
}

#[test]
fn check_writes_nothing() {
    let folder = folder("check");
    let output = holonom(&folder, &["check", "pendulum.toml"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(words(&output).contains("degrees of freedom"), "{}", words(&output));
    assert_eq!(files(&folder).len(), 1);
}

#[test]
fn wrong_usage_ends_with_code_2() {
    let folder = folder("usage");
    let cases: [&[&str]; 9] = [
        &[],
        &["simulate"],
        &["run"],
        &["run", "pendulum.toml", "--order", "3"],
        &["run", "pendulum.toml", "--scheme", "euler"],
        &["run", "pendulum.toml", "--set", "x"],
        &["examples", "pendulun"],
        &["plot", "."],
        &["plot", "nowhere"],
    ];
    for arguments in cases {
        let output = holonom(&folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", words(&output));
    }
    assert_eq!(code(&folder, &["--help"]), 0);
    assert_eq!(code(&folder, &["--version"]), 0);
    assert_eq!(files(&folder).len(), 1);
}

#[test]
fn plots_are_drawn_again() {
    let folder = folder("plot");
    assert_eq!(code(&folder, &["run", "pendulum.toml"]), 0);
    let out = folder.join("pendulum-out");
    let report = fs::read_to_string(out.join("report.html")).unwrap();
    fs::remove_file(out.join("report.html")).unwrap();
    fs::remove_dir_all(out.join("plots")).unwrap();
    assert_eq!(code(&folder, &["plot", "pendulum-out"]), 0);
    assert_eq!(fs::read_to_string(out.join("report.html")).unwrap(), report);
    assert!(out.join("plots/energy.svg").exists() && out.join("plots/residuals.svg").exists());
    fs::write(out.join("trajectory.csv"), "a,b\n1,2\n").unwrap();
    assert_eq!(code(&folder, &["plot", "pendulum-out"]), 1);
}

#[test]
fn every_shipped_model_is_valid_and_listed() {
    let folder = folder("examples");
    assert_eq!(code(&folder, &["examples", "--all", "models"]), 0);
    assert_eq!(code(&folder, &["examples", "--all", "models"]), 2, "nothing is replaced");
    let shipped = files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/models"));
    assert_eq!(files(&folder.join("models")), shipped);
    let list = String::from_utf8(holonom(&folder, &["examples"]).stdout).unwrap();
    for file in &shipped {
        let name = file.trim_end_matches(".toml");
        let line = list.lines().find(|l| l.split_whitespace().next() == Some(name)).unwrap();
        assert!(line.len() > name.len() + 10, "no description: {line}");
        let path = format!("models/{file}");
        let output = holonom(&folder, &["check", &path]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        let printed = holonom(&folder, &["examples", name]).stdout;
        assert_eq!(printed, fs::read(folder.join(path)).unwrap());
    }
    assert_eq!(code(&folder, &["examples", "free_body", "-o", "x.toml"]), 0);
    assert_eq!(code(&folder, &["examples", "free_body", "-o", "x.toml"]), 2);
}

#[test]
fn completions_for_every_shell() {
    let folder = folder("completions");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(holonom(&folder, &["completions", shell]).stdout.len() > 500, "{shell}");
    }
}

#[test]
fn a_reader_who_leaves_is_no_error() {
    let folder = folder("pipe");
    for arguments in [&["schema"][..], &["completions", "bash"], &["examples"]] {
        let mut child = command(&folder, arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take()); // closed before anything is read
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", words(&output));
        assert!(output.stderr.is_empty(), "{}", words(&output));
    }
}

const ROD: &str = r#"
[model]
name = "rod"

[[beam]]
name = "rod"
points = [[0, 0, 0], [1, 0, 0]]
elements = 8
normal = [0, 0, 1]
section = { EA = 1e4, GA1 = 1e4, GA2 = 1e4, EI1 = 1, EI2 = 2, GJ = 1, rhoA = 1, rhoI1 = 1e-4, rhoI2 = 2e-4 }
start = "clamped"

[[load]]
name = "pull"
body = "rod.end"
force = [0, 2, 0]

[simulation]
scheme = "static"
step = 0.25
end = 1
"#;

#[test]
fn statics_writes_a_row_for_each_equilibrium() {
    let folder = folder("static");
    fs::write(folder.join("rod.toml"), ROD).unwrap();
    let output = holonom(&folder, &["run", "rod.toml", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&summary["scheme"], &summary["status"]), (&"static".into(), &"done".into()));
    let csv = fs::read_to_string(folder.join("rod-out/trajectory.csv")).unwrap();
    assert_eq!(csv.lines().count() as u64, 1 + summary["statics"]["equilibria"].as_u64().unwrap());
    let times: Vec<&str> = csv.lines().skip(1).map(|l| l.split(',').nth(1).unwrap()).collect();
    assert_eq!((times[0], *times.last().unwrap()), ("0.0", "1.0"));
    assert!(folder.join("rod-out/plots/load_path.svg").exists());
    assert_eq!(code(&folder, &["plot", "rod-out"]), 0);
}

#[test]
fn statics_that_stops_keeps_its_rows_and_says_what_to_do() {
    let folder = folder("static_failure");
    fs::write(folder.join("rod.toml"), ROD).unwrap();
    // a moment beyond the largest one of two-node elements, EI/2l = 4 N m
    let torque = ["--set", "load.pull.torque=[0, 0, 20]", "--set", "load.pull.force=[0, 0, 0]"];
    let output = holonom(&folder, &[&["run", "rod.toml"][..], &torque].concat());
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    let text = words(&output);
    assert!(text.contains("load factor 0.") && text.contains("help:"), "{text}");
    let text = fs::read_to_string(folder.join("rod-out/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&text).unwrap();
    let t = summary["failure"]["t"].as_f64().unwrap();
    assert!((t - 0.2).abs() < 1e-3, "EI/2l = {t} of 20 N m");
    let csv = fs::read_to_string(folder.join("rod-out/trajectory.csv")).unwrap();
    let last: f64 = csv.lines().last().unwrap().split(',').nth(1).unwrap().parse().unwrap();
    assert!((last - t).abs() < 1e-15);
}

#[test]
fn modes_are_printed_and_written() {
    let folder = folder("modes");
    fs::write(folder.join("rod.toml"), ROD).unwrap();
    let output = holonom(&folder, &["modes", "rod.toml", "-n", "3"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let table = String::from_utf8(output.stdout).unwrap();
    let (checks, table): (Vec<&str>, Vec<&str>) =
        table.lines().partition(|line| line.starts_with("  residual "));
    assert_eq!(checks.len(), 1, "{checks:?}"); // round-off: other numbers on other machines
    insta::assert_snapshot!("modes_of_a_rod", table.join("\n"));
    let free = ["modes", "rod.toml", "-n", "2", "--set", "beam.rod.start=\"free\"", "--json"];
    let output = holonom(&folder, &[&free[..], &["-o", "shapes"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((report["zero"].as_u64(), report["unstable"].as_u64()), (Some(6), Some(0)));
    assert_eq!(report["modes"].as_array().unwrap().len(), 8);
    assert_eq!(report["modes"][7]["shape"].as_array().unwrap().len(), 9);
    let expected = ["modes", "modes.csv", "modes.html", "modes.json"].map(str::to_owned).into();
    assert_eq!(files(&folder.join("shapes")), expected);
    let csv = fs::read_to_string(folder.join("shapes/modes.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 8 * 9);
    let again = holonom(&folder, &["modes", "rod.toml", "-o", "shapes"]);
    assert_eq!(again.status.code(), Some(2), "{}", words(&again));
    assert_eq!(code(&folder, &["modes", "rod.toml", "-o", "shapes", "--force"]), 0);
    let bent = holonom(&folder, &["modes", "rod.toml", "-n", "1", "--at", "static"]);
    let table = String::from_utf8(bent.stdout).unwrap();
    assert!(
        table.starts_with("rod: 48 degrees of freedom; modes about the equilibrium at t = 1\n")
    );
}

#[test]
fn modes_that_cannot_be_say_why() {
    let folder = folder("no_modes");
    fs::write(folder.join("rod.toml"), ROD).unwrap();
    assert_eq!(code(&folder, &["modes", "nothing.toml"]), 3);
    assert_eq!(code(&folder, &["modes", "rod.toml", "--at", "somewhere"]), 2);
    assert_eq!(code(&folder, &["modes", "rod.toml", "-n", "-1"]), 2);
    let torque = ["--set", "load.pull.torque=[0, 0, 20]", "--at", "static"];
    let output = holonom(&folder, &[&["modes", "rod.toml"][..], &torque].concat());
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    assert!(words(&output).contains("load factor") && output.stdout.is_empty());
    let massless = ["modes", "rod.toml", "--set", "beam.rod.section.rhoI1=0"];
    let output =
        holonom(&folder, &[&massless[..], &["--set", "beam.rod.section.rhoI2=0"]].concat());
    println!("{}", words(&output));
}

#[test]
fn check_shows_the_initial_configuration_and_replaces_no_file() {
    let folder = folder("check-pictures");
    let check = |file: &str, more: &[&str]| {
        let option = if file.ends_with("html") { "--page" } else { "--picture" };
        holonom(&folder, &[&["check", "pendulum.toml", option, file][..], more].concat())
    };
    for (file, begin) in [
        ("a.svg", &b"<svg"[..]),
        ("a.pdf", b"%PDF"),
        ("a.png", b"\x89PNG"),
        ("a.html", b"<!DOCTYPE html>"),
    ] {
        let output = check(file, &[]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        assert!(words(&output).contains(&format!("written: {file}")), "{}", words(&output));
        let written = fs::read(folder.join(file)).unwrap();
        assert!(written.starts_with(begin), "{file}");
        let again = check(file, &[]);
        assert_eq!(again.status.code(), Some(2), "{}", words(&again));
        assert!(words(&again).contains("--force"), "{}", words(&again));
        assert_eq!(check(file, &["--force"]).status.code(), Some(0));
    }
    let page = fs::read_to_string(folder.join("a.html")).unwrap();
    assert!(page.contains("holonom check pendulum.toml --page a.html") && !page.contains("src="));
    let json = |output: &[u8]| serde_json::from_slice::<Value>(output).unwrap();
    let mut with = json(&check("b.svg", &["--json"]).stdout);
    assert_eq!(with.as_object_mut().unwrap().remove("picture"), Some("b.svg".into()));
    assert_eq!(with, json(&holonom(&folder, &["check", "pendulum.toml", "--json"]).stdout));
    // an invalid model and an unknown format leave nothing behind
    assert_eq!(check("c.gif", &[]).status.code(), Some(2));
    let invalid = check("c.svg", &["--set", "particle.bob.mass=-1"]);
    assert_eq!(invalid.status.code(), Some(3), "{}", words(&invalid));
    assert!(!folder.join("c.svg").exists() && !folder.join("c.gif").exists());
}

#[test]
fn verify_writes_a_certificate() {
    let folder = folder("verify");
    let output = holonom(&folder, &["verify", "pendulum.toml", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let out = folder.join("pendulum-verify");
    assert_eq!(
        files(&out),
        BTreeSet::from(["certificate.json", "certificate.html"].map(String::from))
    );
    let written = fs::read_to_string(out.join("certificate.json")).unwrap();
    assert_eq!(printed, serde_json::from_str::<Value>(&written).unwrap());
    assert_eq!(printed["holds"], true);
    let orders =
        printed["certificate"]["findings"].as_array().unwrap().iter().filter(|f| {
            f["criterion"] == "order" && f["quantity"] == "q" && f["verdict"] == "pass"
        });
    assert_eq!(orders.count(), 5, "nodal of orders 2 and 4, the others of order 2");
    // a step for 1e-6 that the model's own step, with an error of 6e-3, does not reach
    let step = printed["steps"][0]["step"].as_f64().unwrap();
    assert!((1.0e-4..1.7e-4).contains(&step), "{step}");
    let page = fs::read_to_string(out.join("certificate.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("Observed orders") && !page.contains("src="));
    assert!(words(&output).contains("no property fails"));
    // of which model and by which program
    let made = &printed["provenance"];
    let text = |key: &str| made[key].as_str().unwrap_or_default().to_owned();
    assert_eq!(text("command"), "holonom verify pendulum.toml");
    assert_eq!((text("model_sha256").len(), made["overrides"].as_array().unwrap().len()), (64, 0));
    let date = text("date");
    assert!(date.len() == 20 && date.starts_with("20") && date.ends_with('Z'), "{date}");
    for stated in ["model_sha256", "date", "command"] {
        assert!(page.contains(&text(stated)), "{stated} on the page");
    }
    assert!(page.contains("ZAMM 88 (2008)") && page.contains("<dt>(45)</dt>"), "cited equations");
    // nothing is replaced unasked
    let again = holonom(&folder, &["verify", "pendulum.toml"]);
    assert_eq!(again.status.code(), Some(2), "{}", words(&again));
    assert!(words(&again).contains("--force"), "{}", words(&again));
}

#[test]
fn verify_says_so_where_it_cannot_tell() {
    let folder = folder("verify-chaos");
    // a step far too coarse for what the springs do
    let particles = include_str!("../examples/models/four_particles.toml");
    fs::write(folder.join("particles.toml"), particles).unwrap();
    let arguments = ["verify", "particles.toml", "--set", "simulation.step=0.2", "--json"];
    let output = holonom(&folder, &arguments);
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let steps = printed["steps"].as_array().unwrap();
    assert!(steps.iter().any(|s| s["step"].is_null() && s["reason"] != ""), "{steps:?}");
    assert!(words(&output).contains("no step can be recommended"), "{}", words(&output));
    // statics, and accuracies that cannot be reached
    let roll_up = include_str!("../examples/models/roll_up.toml");
    fs::write(folder.join("roll_up.toml"), roll_up).unwrap();
    let output = holonom(&folder, &["verify", "roll_up.toml"]);
    assert_eq!(output.status.code(), Some(2), "{}", words(&output));
    assert!(words(&output).contains("nothing moves"), "{}", words(&output));
    for wrong in ["0", "-1", "2", "nan", "much"] {
        let accuracy = format!("--accuracy={wrong}");
        let output = holonom(&folder, &["verify", "pendulum.toml", &accuracy]);
        assert_eq!(output.status.code(), Some(2), "{wrong}: {}", words(&output));
    }
    let output = holonom(&folder, &["verify", "missing.toml"]);
    assert_eq!(output.status.code(), Some(3), "{}", words(&output));
}

/// The energy of this beam grows without bound: `run` says so once, before it reports, and `--quiet` does not.
#[test]
fn a_warning_of_the_run_is_printed_once() {
    let folder = crate::command::folder("program", "warning");
    let model = include_str!("hostile/energy_explosion_beam.toml");
    fs::write(folder.join("model.toml"), model).unwrap();
    let run = ["run", "model.toml", "--set", "simulation.strain=\"averaged\"", "-o", "out"];
    let output = holonom(&folder, &run);
    let words = words(&output);
    assert_eq!(output.status.code(), Some(0), "{words}");
    let places: Vec<usize> = words.match_indices("warning: the energy left").map(|m| m.0).collect();
    let report = words.find("  Newton iterations").unwrap();
    assert!(places.len() == 1 && places[0] < report, "{words}");
    let summary: Value =
        serde_json::from_slice(&fs::read(folder.join("out/summary.json")).unwrap()).unwrap();
    let warnings = summary["warnings"].as_array().unwrap();
    assert!(warnings.iter().any(|w| w.as_str().unwrap().starts_with("the energy left its band")));
    let quiet = holonom(&folder, &[&run[..], &["--force", "--quiet"]].concat());
    assert!(quiet.status.success() && quiet.stderr.is_empty());
}
