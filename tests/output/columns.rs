//! What a run records: coordinates, positions, joint coordinates, or none of them.
#![allow(clippy::unwrap_used)] // a test

use crate::program::command::{command, folder};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const MODEL: &str = include_str!("../../examples/models/flexible_slider_crank.toml");

/// The columns of a file of a run, as text.
fn columns(file: &Path) -> BTreeMap<String, Vec<String>> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned));
    let names: Vec<String> = lines.next().unwrap().collect();
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for row in lines {
        names.iter().zip(row).for_each(|(name, field)| {
            found.entry(name.clone()).or_default().push(field);
        });
    }
    found
}

/// Exit code and what is said on standard error.
fn holonom(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let done = command(folder, arguments).output().unwrap();
    (done.status.code(), String::from_utf8_lossy(&done.stderr).into_owned())
}

/// Runs the model for 20 steps.
fn run(folder: &Path, to: &str, options: &[&str]) {
    let all = [&["run", "model.toml", "-o", to, "-q", "--end", "0.02"], options].concat();
    assert_eq!(holonom(folder, &all), (Some(0), String::new()));
}

/// A folder with a slider-crank with a flexible rod.
fn prepared(case: &str) -> PathBuf {
    let folder = folder("columns", case);
    std::fs::write(folder.join("model.toml"), MODEL).unwrap();
    folder
}

#[test]
fn chosen_columns_are_those_of_all_bit_for_bit() {
    let folder = prepared("chosen");
    run(&folder, "all", &[]);
    let all = columns(&folder.join("all/trajectory.csv"));
    for (what, ends) in [("positions", &[".x", ".y", ".z"][..]), ("none", &[]), ("joints", &[])] {
        run(&folder, what, &["--columns", what]);
        let own = columns(&folder.join(what).join("trajectory.csv"));
        // without a point: the head, energies, momentum maps
        let chosen = |name: &str| !name.contains('.') || ends.iter().any(|end| name.ends_with(end));
        let expected: BTreeMap<_, _> = all.clone().into_iter().filter(|(k, _)| chosen(k)).collect();
        println!("{what}: {} of {} columns", own.len(), all.len());
        assert_eq!(own, expected, "{what}");
    }
}

#[test]
fn joints_are_sensors_of_all_joints() {
    let folder = prepared("joints");
    run(&folder, "out", &["--columns", "positions,joints"]);
    let sensors = columns(&folder.join("out/sensors.csv"));
    let joints: Vec<&String> = sensors.keys().filter(|name| name.contains("_coordinate")).collect();
    // `stroke` measures the guide
    assert_eq!(joints, ["crank_pin_coordinate", "piston_pin_coordinate", "shaft_coordinate"]);
    assert!(sensors.contains_key("stroke"), "{:?}", sensors.keys());
    let angle: f64 = sensors["shaft_coordinate"].last().unwrap().parse().unwrap();
    assert!(angle > 0.0, "{angle} rad");
    let again = std::fs::read_to_string(folder.join("out/model.toml")).unwrap();
    assert!(again.contains("columns = [\"positions\"]"), "{again}");
}

#[test]
fn a_run_of_positions_continues_to_the_same_bytes_and_says_what_it_lacks() {
    let folder = prepared("positions");
    run(&folder, "whole", &["--columns", "positions"]);
    run(&folder, "parts", &["--columns", "positions", "--checkpoint-every", "7"]);
    assert_eq!(holonom(&folder, &["resume", "parts", "-q"]).0, Some(0)); // from step 14
    for file in ["trajectory.csv", "sensors.csv"] {
        let read = |run: &str| std::fs::read(folder.join(run).join(file)).unwrap();
        assert!(read("whole") == read("parts"), "{file}");
    }
    let page = std::fs::read_to_string(folder.join("whole/report.html")).unwrap();
    assert!(page.contains("No scene: the run has recorded no coordinates"));
    for format in ["vtk", "gltf", "svg"] {
        let (code, words) = holonom(&folder, &["export", "whole", "--format", format]);
        println!("{words}");
        assert!(code != Some(0) && words.contains("run the model again without `columns`"));
    }
    assert_eq!(holonom(&folder, &["export", "whole", "--format", "npz"]).0, Some(0));
}

#[test]
fn coordinates_and_positions_together_are_refused() {
    let folder = prepared("both");
    let both = "simulation.columns=[\"positions\", \"coordinates\"]";
    let (code, words) = holonom(&folder, &["check", "model.toml", "--set", both]);
    assert_eq!(code, Some(3), "{words}");
    assert!(words.contains("`coordinates` contain the positions"), "{words}");
}
