//! `holonom compare` and `holonom verify`: their files, what they print, what they refuse.
#![allow(clippy::unwrap_used)] // a test

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use crate::program::command::{code, files, holonom, pendulum_folder, words};
use serde_json::Value;

fn folder(case: &str) -> PathBuf {
    pendulum_folder("studies", case)
}

#[test]
fn a_comparison_writes_its_files_and_replaces_none() {
    let folder = folder("compare");
    let arguments = ["compare", "pendulum.toml", "--end", "0.5", "--step", "0.01", "--order", "2"];
    let output = holonom(&folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert!(output.stdout.is_empty() && words(&output).contains("em-nodal"));
    let told = words(&output);
    assert!(told.contains("pendulum: 1 degree of freedom,") && told.contains("  about "), "{told}");
    assert!(told.contains("t = 0.5 s\n"), "an end that was asked for is not shortened: {told}");
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

/// Without an end, what is left out is named.
#[test]
fn a_comparison_names_the_part_of_the_model_that_it_shows() {
    let folder = folder("shortened");
    let arguments = ["compare", "pendulum.toml", "--schemes", "nodal,em-nodal", "--order", "2"];
    let long = ["--set", "simulation.end=40", "--set", "simulation.step=0.01", "--effort", "1"];
    let output = holonom(&folder, &[&arguments[..], &long].concat());
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert!(words(&output).contains(" s of 40 s (--end 40 takes all)"), "{}", words(&output));
    let page = fs::read_to_string(folder.join("pendulum-compare/compare.html")).unwrap();
    assert!(!page.contains("Change of the momentum maps"), "a chart of zeros is left out");
    let usage = |effort: &str| code(&folder, &["compare", "pendulum.toml", "--effort", effort]);
    assert_eq!((usage("0"), usage("much")), (2, 2));
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
    // the verdict and the steps, in lines that fit a terminal; the tables where they are asked for
    let told = words(&output);
    let report = &told[told.find("pendulum: no property fails").unwrap()..];
    assert!(
        report.contains("order 2: a step of") && !report.contains("Observed orders"),
        "{report}"
    );
    assert!(report.lines().all(|line| line.chars().count() <= 100), "{report}");
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
    assert!(page.contains("ZAMM 88 (2008)") && page.contains("<dt>(46)</dt>"), "cited equations");
    let tables = holonom(&folder, &["verify", "pendulum.toml", "--force", "--tables"]);
    assert!(words(&tables).contains("Observed orders"), "{}", words(&tables));
    // nothing is replaced unasked
    let again = holonom(&folder, &["verify", "pendulum.toml"]);
    assert_eq!(again.status.code(), Some(2), "{}", words(&again));
    assert!(words(&again).contains("--force"), "{}", words(&again));
}

#[test]
fn verify_says_so_where_it_cannot_tell() {
    let folder = folder("verify-chaos");
    // a step far too coarse for what the springs do
    let particles = include_str!("../../examples/models/four_particles.toml");
    fs::write(folder.join("particles.toml"), particles).unwrap();
    let arguments = ["verify", "particles.toml", "--set", "simulation.step=0.2", "--json"];
    let output = holonom(&folder, &arguments);
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let steps = printed["steps"].as_array().unwrap();
    assert!(steps.iter().any(|s| s["step"].is_null() && s["reason"] != ""), "{steps:?}");
    assert!(words(&output).contains("no step can be recommended"), "{}", words(&output));
    // statics, and accuracies that cannot be reached
    let roll_up = include_str!("../../examples/models/roll_up.toml");
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
