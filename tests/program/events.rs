//! Runs with events by the program: continued from checkpoints before, between and after events,
//! and swept, with the numbers of runs that are neither.
#![allow(clippy::unwrap_used)] // a test

use crate::program::command::{self, holonom, words};
use crate::program::interrupted::{assert_same, begin};
use holonom::{Model, Override};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// A model with events, some settings, a parameter with values, and steps before, between and after
/// its events.
struct Case {
    name: &'static str,
    text: String,
    set: [&'static str; 2],
    vary: &'static str,
    actions: usize,
    stops: [u64; 3],
}

fn cases() -> [Case; 3] {
    [
        Case {
            name: "trebuchet",
            text: include_str!("../../examples/models/trebuchet.toml").to_owned(),
            set: ["simulation.end=1.0", "simulation.every=3"],
            vary: "parameters.tilt=0.55,0.6",
            actions: 1,
            stops: [40, 152, 180],
        },
        Case {
            name: "clock",
            text: include_str!("../../examples/models/clock.toml").to_owned(),
            set: ["simulation.end=2.5", "simulation.every=4"],
            vary: "parameters.friction=0.02,0.04",
            actions: 7,
            stops: [1, 52, 160],
        },
        Case {
            name: "latch",
            text: include_str!("../models/latch.toml").to_owned(),
            set: ["simulation.end=0.6", "simulation.every=1"],
            vary: "parameters.spin=-2.0,-3.0",
            actions: 1,
            stops: [5, 30, 100],
        },
    ]
}

impl Case {
    fn folder(&self, what: &str) -> PathBuf {
        let folder = command::folder("events", &format!("{}_{what}", self.name));
        fs::write(folder.join("model.toml"), &self.text).unwrap();
        folder
    }

    fn run(&self, folder: &Path, out: &str, more: &[&str]) {
        let [a, b] = self.set;
        let own = ["run", "model.toml", "-o", out, "--set", a, "--set", b];
        let output = holonom(folder, &[&own, more].concat());
        assert!(output.status.success(), "{}", words(&output));
    }
}

#[test]
fn runs_with_events_continue_from_checkpoints_to_the_byte() {
    for case in cases() {
        let folder = case.folder("continued");
        case.run(&folder, "whole", &[]);
        let events = fs::read_to_string(folder.join("whole/events.csv")).unwrap();
        println!("{}: {} actions", case.name, events.lines().count() - 1);
        assert!(events.lines().count() > case.actions, "{events}");
        let set = case.set.map(|text| {
            let (key, value) = text.split_once('=').unwrap();
            Override::new(key, value)
        });
        let model = Model::from_toml_with(&case.text, &set).unwrap();
        for stop in case.stops {
            let out = format!("parted_{stop}");
            begin(&model, &folder.join(&out), (stop, None));
            let output = holonom(&folder, &["resume", &out]);
            assert!(output.status.success(), "{}", words(&output));
            let named = format!("{}, stopped at step {stop}", case.name);
            assert_same(&folder.join(&out), &folder.join("whole"), &named);
        }
    }
}

#[test]
fn a_sweep_across_events_has_the_numbers_of_its_runs() {
    for case in cases() {
        let folder = case.folder("swept");
        let [a, b] = case.set;
        for (out, threads) in [("one", "1"), ("two", "2")] {
            let own = ["sweep", "model.toml", "-o", out, "--vary", case.vary, "-j", threads];
            let output = holonom(&folder, &[&own[..], &["--set", a, "--set", b]].concat());
            assert!(output.status.success(), "{}", words(&output));
        }
        let table = |out: &str| fs::read_to_string(folder.join(out).join("sweep.csv")).unwrap();
        assert_eq!(table("one"), table("two"), "{}: threads", case.name);
        let (key, values) = case.vary.split_once('=').unwrap();
        let counts: Vec<Value> = values
            .split(',')
            .enumerate()
            .map(|(k, value)| {
                let alone = format!("alone_{k}");
                case.run(&folder, &alone, &["--set", &format!("{key}={value}")]);
                let read = |path: String| -> Value {
                    let text = fs::read_to_string(folder.join(path)).unwrap();
                    serde_json::from_str(&text).unwrap()
                };
                let point = read(format!("one/{k:05}/summary.json"));
                let own = read(format!("{alone}/summary.json"));
                for key in
                    ["energy", "momentum", "steps", "end_time", "events", "newton_iterations"]
                {
                    assert!(!own[key].is_null(), "{key}");
                    assert_eq!(point[key], own[key], "{}, {value}: {key}", case.name);
                }
                own["energy"].clone()
            })
            .collect();
        assert_ne!(counts[0], counts[1], "{}: the parameter counts", case.name);
    }
}
