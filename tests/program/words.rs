//! Snapshots of what the program says: its help, its reports.
#![allow(clippy::unwrap_used)] // a test

use crate::program::command::{folder, holonom};
use std::fs;
use std::path::Path;

/// What the program prints with these arguments: standard output, then standard error.
fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = holonom(folder, arguments);
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    text.concat().lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// The verbs as the help lists them.
fn verbs(help: &str) -> Vec<String> {
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let listed = commands.take_while(|line| !line.is_empty());
    let names = listed.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names.map(|line| line.split_whitespace().next().unwrap().to_owned()).collect()
}

#[test]
fn help() {
    let folder = folder("words", "help");
    let help = said(&folder, &["--help"]);
    insta::assert_snapshot!("help", help);
    let verbs = verbs(&help);
    assert!(verbs.contains(&"run".to_owned()), "{verbs:?}");
    for verb in verbs {
        insta::assert_snapshot!(format!("help_{verb}"), said(&folder, &[&verb, "--help"]), &verb);
    }
}

/// Their mean over the parts of a composition is a fraction: two decimals are enough.
#[test]
fn iterations_of_a_composition_are_rounded() {
    let folder = folder("words", "iterations");
    said(&folder, &["examples", "pendulum", "-o", "pendulum.toml"]);
    let report =
        said(&folder, &["run", "pendulum.toml", "--order", "8", "--step", "0.05", "--end", "1"]);
    let line = report.lines().find(|line| line.contains("Newton iterations")).unwrap();
    println!("{line}");
    let most = line.split(", ").nth(1).unwrap().split(' ').next().unwrap();
    assert!(most.parse::<f64>().is_ok_and(|most| most.fract() != 0.0), "{line}");
    assert!(most.split('.').nth(1).is_some_and(|decimals| decimals.len() <= 2), "{line}");
}

/// Everything a run of a model says and writes in words, measured times and round-off removed.
#[test]
fn reports_of_a_run() {
    let folder = folder("words", "run");
    said(&folder, &["examples", "pendulum", "-o", "pendulum.toml"]);
    insta::assert_snapshot!("check_pendulum", said(&folder, &["check", "pendulum.toml"]));
    said(&folder, &["examples", "bricard", "-o", "bricard.toml"]);
    insta::assert_snapshot!("check_bricard", said(&folder, &["check", "bricard.toml"]));
    said(&folder, &["run", "pendulum.toml", "--end", "1"]);
    let summary = fs::read_to_string(folder.join("pendulum-out/summary.json")).unwrap();
    let mut summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    for key in ["wall_seconds", "seconds_per_step", "step_seconds", "version"] {
        summary[key] = "measured".into();
    }
    round(&mut summary);
    insta::assert_snapshot!("summary_pendulum", serde_json::to_string_pretty(&summary).unwrap());
}

/// Numbers to eight digits, round-off to `0`.
fn round(value: &mut serde_json::Value) {
    use serde_json::Value;
    match value {
        Value::Object(map) => map.values_mut().for_each(round),
        Value::Array(items) => items.iter_mut().for_each(round),
        Value::Number(number) if number.is_f64() => {
            let rounded = number.as_f64().unwrap();
            let text = if rounded.abs() < 1e-12 { "0".into() } else { format!("{rounded:.8e}") };
            *value = text.into();
        }
        _ => {}
    }
}
