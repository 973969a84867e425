//! The program from outside: exit codes, files, standard output.
#![allow(clippy::unwrap_used)] // a test

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use crate::program::command::{PENDULUM, code, command, files, holonom, pendulum_folder, words};
use serde_json::Value;

fn folder(case: &str) -> PathBuf {
    pendulum_folder("program", case)
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
    let top = include_str!("../../examples/models/heavy_top_fast.toml");
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
        let text = include_str!("../../examples/models/heavy_top_fast.toml").replacen(from, to, 1);
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
    for file in shipped.iter().filter(|file| file.ends_with(".toml")) {
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
    assert_eq!(code(&folder, &["examples", "motor", "-o", "own.toml"]), 0);
    assert_eq!(code(&folder, &["check", "own.toml"]), 0, "its table stands beside it");
    fs::remove_file(folder.join("own.toml")).unwrap();
    assert_eq!(code(&folder, &["examples", "motor", "-o", "own.toml"]), 2, "its table is there");
    assert!(!folder.join("own.toml").exists(), "nothing is half-written");
    fs::create_dir(folder.join("others")).unwrap();
    fs::write(folder.join("others/motor.csv"), "mine").unwrap();
    assert_eq!(code(&folder, &["examples", "--all", "others"]), 2, "its table is there");
    assert_eq!(fs::read_to_string(folder.join("others/motor.csv")).unwrap(), "mine");
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

/// The energy of this beam grows without bound: `run` says so once, before it reports, and
/// `--quiet` does not.
#[test]
fn a_warning_of_the_run_is_printed_once() {
    let folder = crate::program::command::folder("program", "warning");
    let model = include_str!("../hostile/energy_explosion_beam.toml");
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

/// A value that would change nothing is refused by every verb that takes one.
#[test]
fn every_verb_refuses_a_parameter_that_nothing_uses() {
    let folder = folder("parameters");
    fs::write(folder.join("m.toml"), include_str!("../hostile/parameter_typo.toml")).unwrap();
    let set = ["--set", "parameters.lenght=2"];
    let vary = ["--vary", "parameters.lenght=1:2:3"];
    for (verb, option) in [
        ("run", set),
        ("check", set),
        ("modes", set),
        ("verify", set),
        ("compare", set),
        ("bench", set),
        ("sweep", vary),
    ] {
        let output = holonom(&folder, &[verb, "m.toml", option[0], option[1]]);
        let said = words(&output);
        assert_eq!(output.status.code(), Some(3), "{verb}: {said}");
        assert!(said.contains("did you mean `parameters.length`?"), "{verb}: {said}");
    }
    assert_eq!(files(&folder).len(), 2, "nothing was written: {:?}", files(&folder));
}
