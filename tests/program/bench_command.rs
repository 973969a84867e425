//! `holonom bench`: the parts of a step, as a table and as JSON.

#![allow(clippy::unwrap_used)] // a test

use crate::program::command::{code, command, pendulum_folder, words};
use serde_json::Value;

#[test]
fn every_time_is_finite_and_positive() {
    let folder = pendulum_folder("bench", "json");
    let schemes = ["nodal", "constrained", "em-nodal"];
    let arguments = ["bench", "pendulum.toml", "--steps", "50", "--json", "--schemes"];
    let schemes_of = schemes.join(",");
    let arguments = [&arguments[..], &[schemes_of.as_str()]].concat();
    let output = command(&folder, &arguments).output().unwrap();
    assert!(output.status.success(), "{}", words(&output));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((found["steps"].as_u64(), found["dof"].as_u64()), (Some(50), Some(1)));
    let listed = found["schemes"].as_array().unwrap();
    assert_eq!(listed.len(), schemes.len());
    for (entry, scheme) in listed.iter().zip(schemes) {
        assert_eq!(entry["scheme"], scheme);
        for part in ["step", "iteration", "iterations", "residual", "solve", "recording"] {
            let value = entry["cost"][part].as_f64();
            println!("{scheme}, {part}: {value:?}");
            assert!(value.is_some_and(|v| v.is_finite() && v > 0.0), "{scheme}, {part}: {value:?}");
        }
        let matrix = entry["cost"]["matrix"].as_f64();
        assert_eq!(
            matrix.is_some_and(|v| v > 0.0),
            !scheme.starts_with("em"),
            "{scheme}: {matrix:?}"
        );
    }
}

/// A correction is measured by calling it again and again after one residual.
#[test]
fn parts_of_galerkin_steps_can_be_repeated() {
    let folder = pendulum_folder("bench", "galerkin");
    for model in ["heavy_top", "bricard", "flying_beam"] {
        let model_file =
            format!("{}/../../examples/models/{model}.toml", env!("CARGO_MANIFEST_DIR"));
        let settings = ["--set", "simulation.order=6", "--set", "simulation.method=\"galerkin\""];
        let arguments = ["bench", &model_file, "--steps", "5", "--json"];
        let output = command(&folder, &[&arguments[..], &settings[..]].concat()).output().unwrap();
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        let cost = &found["schemes"][0];
        println!("{model}: {cost}");
        assert!(cost["cost"]["solve"].as_f64().is_some_and(|solve| solve > 0.0), "{model}: {cost}");
    }
}

#[test]
fn a_table_for_people_names_what_is_missing() {
    let folder = pendulum_folder("bench", "table");
    let arguments = ["bench", "pendulum.toml", "--steps", "5", "--schemes", "nodal,reduced"];
    let output = command(&folder, &arguments).output().unwrap();
    assert!(output.status.success() && output.stdout.is_empty());
    let table = String::from_utf8_lossy(&output.stderr).into_owned();
    let rows: Vec<&str> =
        table.lines().filter(|line| line.contains("educed") || line.starts_with("nodal")).collect();
    assert_eq!(rows.len(), 2, "{table}");
    assert!(rows.iter().all(|row| row.split_whitespace().count() == 8), "{table}");
    assert_eq!(code(&folder, &["bench", "pendulum.toml", "--schemes", "static"]), 2);
    assert_eq!(code(&folder, &["bench", "pendulum.toml", "--set", "simulation.step=-1"]), 3);
}
