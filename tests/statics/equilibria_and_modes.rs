//! The program on a rod: equilibria under a load, small vibrations.
#![allow(clippy::unwrap_used)] // a test

use std::fs;
use std::path::PathBuf;

use crate::program::command::{code, files, holonom, pendulum_folder, words};
use serde_json::Value;

fn folder(case: &str) -> PathBuf {
    pendulum_folder("equilibria_and_modes", case)
}

const ROD: &str = include_str!("../models/soft_rod.toml");

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
    // a moment that bends each element by more than 150°
    let torque = ["--set", "load.pull.torque=[0, 0, 25]", "--set", "load.pull.force=[0, 0, 0]"];
    let output = holonom(&folder, &[&["run", "rod.toml"][..], &torque].concat());
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    let text = words(&output);
    assert!(text.contains("load factor 0.") && text.contains("help:"), "{text}");
    let text = fs::read_to_string(folder.join("rod-out/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&text).unwrap();
    let t = summary["failure"]["t"].as_f64().unwrap();
    let expected = 150_f64.to_radians() * 8.0 / 25.0; // EI/l = 8 N m
    assert!((t - expected).abs() < 1e-3, "150° EI/l = {t} of 25 N m, not {expected}");
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
    let torque = ["--set", "load.pull.torque=[0, 0, 25]", "--at", "static"];
    let output = holonom(&folder, &[&["modes", "rod.toml"][..], &torque].concat());
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    assert!(words(&output).contains("load factor") && output.stdout.is_empty());
    let massless = ["modes", "rod.toml", "--set", "beam.rod.section.rhoI1=0"];
    let output =
        holonom(&folder, &[&massless[..], &["--set", "beam.rod.section.rhoI2=0"]].concat());
    println!("{}", words(&output));
}

/// Rows of modes in a table on the terminal.
fn mode_rows(output: &std::process::Output) -> usize {
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    let number = |line: &&str| {
        let first = line.split_whitespace().next();
        first.is_some_and(|word| word.parse::<u32>().is_ok()) && !line.contains(" mode")
    };
    table.lines().filter(number).count()
}

#[test]
fn as_many_modes_are_printed_as_asked_for() {
    let folder = folder("number_of_modes");
    fs::write(folder.join("rod.toml"), ROD).unwrap();
    let free = ["modes", "rod.toml", "-n", "4", "--set", "beam.rod.start=\"free\""];
    let output = holonom(&folder, &free);
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(table.contains("6 modes without stiffness") && mode_rows(&output) == 4, "{table}");
    let damped = [&free[..], &["--set", "beam.rod.section.damping=0.01"]].concat();
    assert_eq!(mode_rows(&holonom(&folder, &damped)), 4, "without decays");
    let locked = "[model]\nname = \"locked\"\n[simulation]\nstep = 0.01\nend = 1.0\n[[body]]\nname = \"a\"\nmass = 1.0\n\
                  inertia = [1, 1, 1]\n[[joint]]\nname = \"weld\"\ntype = \"fixed\"\nparent = \"ground\"\nchild = \"a\"\n\
                  position = [0, 0, 0]\n";
    fs::write(folder.join("locked.toml"), locked).unwrap();
    let output = holonom(&folder, &["modes", "locked.toml"]);
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    assert_eq!((output.status.code(), mode_rows(&output)), (Some(0), 0), "{table}");
    assert!(words(&output).contains("nothing can move") && table.contains("0 degrees of freedom"));
}

#[test]
fn a_campbell_diagram_has_its_speeds_its_names_and_its_page() {
    let folder = folder("campbell");
    fs::write(
        folder.join("shaft.toml"),
        include_str!("../hostile/shaft_between_critical_speeds.toml"),
    )
    .unwrap();
    let output =
        holonom(&folder, &["modes", "shaft.toml", "--speeds", "0:5:3", "-n", "2", "-o", "d"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let table = String::from_utf8(output.stdout).unwrap();
    assert_eq!(table.lines().count(), 2 + 3, "three speeds: {table}");
    let expected = ["campbell.csv", "campbell.json", "campbell.svg", "modes.html"];
    assert_eq!(files(&folder.join("d")), expected.map(str::to_owned).into());
    for file in ["d/campbell.svg", "d/modes.html"] {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        for name in ["mode 1", "mode 2", "1 × speed", "2 × speed", "3 × speed"] {
            assert!(text.contains(name), "{name} in {file}");
        }
    }
    assert_eq!(code(&folder, &["modes", "shaft.toml", "--speeds", "0:5:1"]), 2);
}
