//! `holonom identify`: files, exit codes, data that are none, an interruption.

use crate::program::command::{command, files, folder, holonom, words};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const MODEL: &str = include_str!("../../examples/models/friction_pendulum.toml");
const DATA: &str = include_str!("../../examples/models/friction_pendulum.csv");

fn pendulum(case: &str) -> PathBuf {
    let folder = folder("identify", case);
    fs::write(folder.join("m.toml"), MODEL).unwrap();
    fs::write(folder.join("d.csv"), DATA).unwrap();
    folder
}

fn estimate(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("estimate.json")).unwrap()).unwrap()
}

#[test]
fn the_shipped_data_give_their_numbers_within_their_errors() {
    let folder = pendulum("shipped");
    let output = holonom(&folder, &["identify", "m.toml", "d.csv", "--json"]);
    assert!(output.status.success(), "{}", words(&output));
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let out = folder.join("m-estimate");
    assert_eq!(printed, estimate(&out));
    assert_eq!(printed["outcome"], "converged");
    let truth = [("centre", 0.27), ("damping", 0.031)];
    let truth = truth.into_iter().chain([("hinge.coordinate", 0.35), ("hinge.rate", -0.4)]);
    let found = printed["parameters"].as_array().unwrap();
    assert_eq!(found.len(), 4);
    for (own, (name, value)) in found.iter().zip(truth) {
        assert_eq!(own["name"], name);
        let error = own["standard_error"].as_f64().unwrap();
        let off = (own["value"].as_f64().unwrap() - value) / error;
        println!("{name}: off by {off:.2} standard errors of {error:.1e}");
        assert!(off.abs() < 3.0 && error > 0.0, "{own}");
    }
    let chi = printed["chi_square_per_freedom"].as_f64().unwrap();
    assert!((chi - 1.0).abs() < 0.25, "{chi}");
    // the files of a run, with the estimates in its model
    let written = files(&out);
    for name in ["estimate.json", "estimate.csv", "model.toml", "sensors.csv", "summary.json"] {
        assert!(written.contains(name), "{name}: {written:?}");
    }
    let centre = found[0]["value"].as_f64().unwrap();
    let model = fs::read_to_string(out.join("model.toml")).unwrap();
    assert!(model.contains(&format!("position = [{centre:?}, 0.0, 0.0]")), "{model}");
    // computed values at nodes are those of the run
    let rows = fs::read_to_string(out.join("estimate.csv")).unwrap();
    let sensors = fs::read_to_string(out.join("sensors.csv")).unwrap();
    let angle = |step: usize| -> f64 {
        sensors.lines().nth(1 + step).unwrap().split(',').nth(2).unwrap().parse().unwrap()
    };
    let mut compared = 0;
    for row in rows.lines().skip(1).filter(|row| row.starts_with("encoder,")) {
        let cells: Vec<f64> = row.split(',').skip(1).map(|cell| cell.parse().unwrap()).collect();
        let step = (cells[0] / 0.0025).round() as usize;
        assert!((cells[2] - angle(step)).abs() < 1e-12, "{row}: {}", angle(step));
        assert!(((cells[2] - cells[1]) / 0.005 - cells[3]).abs() < 1e-9, "{row}");
        compared += 1;
    }
    assert_eq!(rows.lines().count() - 1, DATA.lines().count() - 1);
    assert!(compared > 100);
    // not twice without being asked
    let again = holonom(&folder, &["identify", "m.toml", "d.csv"]);
    assert_eq!(again.status.code(), Some(2), "{}", words(&again));
    let again = holonom(&folder, &["identify", "m.toml", "d.csv", "--force", "-q"]);
    assert!(again.status.success() && again.stdout.is_empty() && again.stderr.is_empty());
}

#[test]
fn bad_data_and_models_end_with_their_codes() {
    let refused = |case: &str, model: &str, data: &str, more: &[&str], code: i32, what: &str| {
        let folder = pendulum(case);
        fs::write(folder.join("m.toml"), model).unwrap();
        fs::write(folder.join("d.csv"), data).unwrap();
        let output = holonom(&folder, &[&["identify", "m.toml", "d.csv"], more].concat());
        let said = words(&output);
        assert_eq!(output.status.code(), Some(code), "{case}: {said}");
        assert!(said.contains(what), "{case}: {said}");
        if code != 1 {
            assert_eq!(files(&folder).len(), 2, "{case}: nothing is written");
        }
    };
    let nan = DATA.replacen("\n0,", "\n0,nan", 1);
    refused("nan", MODEL, &nan, &[], 3, "row 2 of `d.csv`: `nan");
    let other = DATA.replace("encoder", "encoded");
    refused("column", MODEL, &other, &[], 3, "did you mean `encoded`?");
    refused("late", MODEL, DATA, &["--set", "simulation.end=3.9"], 3, "beyond the end of the run");
    let sigma = MODEL.replace("sigma = 0.03", "sigma = 0.0");
    refused("sigma", &sigma, DATA, &[], 3, "the standard deviation 0 is not positive");
    let none = &MODEL[..MODEL.find("[identify]").unwrap()];
    refused("nothing", none, DATA, &[], 3, "add [identify]");
    let bounds = MODEL.replace("max = 1.0", "max = 0.01");
    refused("bounds", &bounds, DATA, &[], 3, "leave nothing between them");
    let idle = MODEL.replace("damping = \"= damping\"", "damping = 0.02");
    refused("idle", &idle, DATA, &[], 3, "`damping`, on which nothing depends");
    let limited = MODEL.replace("[identify]\n", "[identify]\nmax_iterations = 1\n");
    refused("limited", &limited, DATA, &[], 1, "has not converged");
    // mass, inertia and friction in one ratio
    let scaled = MODEL
        .replace("mass = 0.8", "mass = \"= 0.8*scale\"")
        .replace("[0.001, 0.02, 0.02]", "[0.001, \"= 0.02*scale\", 0.02]")
        .replace("centre = 0.3 ", "scale = 1.0\ncentre = 0.3 ")
        .replace("centre = { min = 0.05, max = 1.0 }", "scale = {}");
    refused("unseen", &scaled, DATA, &[], 1, "0.707 `damping` + 0.707 `scale`");
}

#[cfg(target_os = "linux")]
#[test]
fn an_interruption_keeps_the_last_iterate() {
    let folder = pendulum("interrupted");
    let slow = MODEL.replace("step = 0.0025", "step = 0.00001");
    fs::write(folder.join("m.toml"), slow).unwrap();
    let child = command(&folder, &["identify", "m.toml", "d.csv", "--no-progress"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let id = child.id().to_string();
    // until it watches for the signal: the second bit of what it catches
    let caught = || {
        let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        line.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
    };
    let begin = Instant::now();
    while caught() & 2 == 0 {
        assert!(begin.elapsed() < Duration::from_secs(120), "it does not watch");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", words(&output));
    assert!(words(&output).contains("interrupted"));
    let out = folder.join("m-estimate");
    if out.exists() {
        assert_eq!(estimate(&out)["outcome"], "interrupted");
    }
}

/// Numbers in the expression of a law are found again: the stiffness, the cubic part and the damper
/// of a spring that stiffens, from the angle alone; and by a parameter that two expressions share.
#[test]
fn numbers_of_laws_are_found_again() {
    let folder = folder("identify", "law");
    let model = |stiffness: f64, cubic: f64, damping: f64| {
        format!(
            "[model]\nname = \"law\"\ngravity = [0.0, 0.0, -9.81]\n[simulation]\nstep = 0.005\nend = 3.0\n\
             [parameters]\nk = {stiffness:?}\nb = {cubic:?}\nc = {damping:?}\nhalf = \"= k/2\"\n\
             [[body]]\nname = \"arm\"\nposition = [0.3, 0.0, 0.0]\nmass = 1.2\ninertia = [0.01, 0.04, 0.04]\n\
             [[joint]]\nname = \"pin\"\ntype = \"revolute\"\nparent = \"ground\"\nchild = \"arm\"\n\
             position = [0.0, 0.0, 0.0]\naxis = [0.0, 1.0, 0.0]\nrate = 2.0\n\
             [[signal]]\nname = \"pull\"\nvalue = \"2*half*(pin + 0.2) + b*pin^3\"\n\
             [[law]]\nname = \"spring\"\njoint = \"pin\"\neffort = \"-pull\"\n\
             [[law]]\nname = \"damper\"\njoint = \"pin\"\neffort = \"-c*v*abs(v) - 0.01*k*v\"\n\
             [[sensor]]\nname = \"angle\"\ntype = \"joint_coordinate\"\nof = \"pin\"\n\
             [[measurement]]\nsensor = \"angle\"\nsigma = 0.001\n\
             [identify]\nparameters = {{ k = {{ min = 1.0 }}, b = {{}}, c = {{ min = 0.0 }} }}\n"
        )
    };
    fs::write(folder.join("true.toml"), model(8.0, 5.0, 0.15)).unwrap();
    fs::write(folder.join("guess.toml"), model(11.0, 1.0, 0.02)).unwrap();
    let output = holonom(&folder, &["run", "true.toml", "-q"]);
    assert!(output.status.success(), "{}", words(&output));
    let output = holonom(&folder, &["identify", "guess.toml", "true-out/sensors.csv", "--json"]);
    assert!(output.status.success(), "{}", words(&output));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    for (own, (name, value)) in
        found["parameters"].as_array().unwrap().iter().zip([("b", 5.0), ("c", 0.15), ("k", 8.0)])
    {
        println!("{name}: {} for {value}", own["value"]);
        assert_eq!(own["name"], name);
        assert!((own["value"].as_f64().unwrap() - value).abs() < 1e-9 * value, "{own}");
    }
}
