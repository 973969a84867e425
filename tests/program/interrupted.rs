//! Runs that are interrupted, killed and continued, and their files.

use std::fs;
use std::path::{Path, PathBuf};

use crate::program::command::folder as empty_folder;
use holonom::experiment::RunnableModel;
use holonom::run::{Finished, RunControl, prepare, resume, run_with};
use holonom::{Model, Override, RunFolder};
use serde_json::Value;

/// An empty folder for a case.
pub(crate) fn folder(case: &str) -> PathBuf {
    empty_folder("interruption", case)
}

/// The text of a model of the repository.
pub(crate) fn shipped(name: &str) -> String {
    fs::read_to_string(format!("{}/../../{name}.toml", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// The chain of eight bodies with sensors of what is followed along a run.
pub(crate) fn chain() -> String {
    let sensors = "
        sensor = [
            { name = \"angle\", type = \"joint_coordinate\", of = \"hinge8\" },
            { name = \"force\", type = \"reaction\", of = \"hinge1\" },
            { name = \"attitude\", type = \"orientation\", of = \"link8\" },
            { name = \"speed\", type = \"velocity\", of = \"link8\" },
        ]\n";
    let text = shipped("examples/models/chain8");
    let joint = Model::from_toml(&text).unwrap().joints.into_iter().map(|j| j.name);
    let names: Vec<String> = joint.collect();
    let sensors = sensors.replace("hinge8", &names[7]).replace("hinge1", &names[0]);
    format!("{sensors}{text}")
}

/// Models whose runs follow more than the state of the integrator, with 40 steps, each third
/// recorded.
pub(crate) fn models() -> Vec<(&'static str, Model)> {
    let beam = shipped("examples/models/flying_beam");
    let bricard = shipped("examples/models/bricard");
    let gears = include_str!("../models/gears.toml").to_owned();
    let torsion = include_str!("../models/torsion.toml").to_owned();
    let screw = include_str!("../models/screw.toml").to_owned();
    let angle = |joint: &str, text: &str| {
        format!(
            "sensor = [{{ name = \"angle\", type = \"joint_coordinate\", of = \"{joint}\" }}]\n{text}"
        )
    };
    let all = [
        ("chain with sensors", chain(), "nodal", 2),
        ("redundant loop", bricard.clone(), "nodal", 2),
        ("beam", beam, "nodal", 2),
        ("gears", angle("b", &gears), "nodal", 2),
        ("torsion spring", angle("hinge", &torsion), "dalembert", 2),
        (
            "torque of it",
            angle("hinge", &torsion).replace("joint_coordinate", "effort"),
            "nodal",
            2,
        ),
        ("screw", angle("thread", &screw), "constrained", 2),
        ("order 4", chain(), "nodal", 4),
        ("energy-momentum", chain(), "em-nodal", 2),
        ("energy-momentum loop", bricard, "em-constrained", 2),
        ("driven", shipped("xtask/models/rheonomic"), "nodal", 2),
        ("driven, order 4", shipped("xtask/models/rheonomic"), "reduced", 4),
    ];
    let model = |(name, text, scheme, order): (&'static str, String, &str, u32)| {
        let step = Model::from_toml(&text).unwrap().settings.step;
        let set = [
            ("scheme", format!("{scheme:?}")),
            ("order", order.to_string()),
            ("every", "3".into()),
            ("momenta", "true".into()),
            ("end", format!("{:?}", 40.0 * step)),
        ];
        let set = set.map(|(key, value)| Override::new(format!("simulation.{key}"), value));
        (name, Model::from_toml_with(&text, &set).unwrap())
    };
    all.map(model).into()
}

/// The files of rows of a folder, its plots, and its summary without what the clock says.
pub(crate) fn results(folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for plot in fs::read_dir(folder.join("plots")).into_iter().flatten() {
        let path = plot.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy();
        found.push((format!("plots/{name}"), fs::read_to_string(&path).unwrap()));
    }
    for entry in fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if !(name.ends_with(".csv") || name == "summary.json" || name == "model.toml") {
            continue;
        }
        let mut text = fs::read_to_string(folder.join(&name)).unwrap();
        if name == "summary.json" {
            let mut summary: Value = serde_json::from_str(&text).unwrap();
            for time in ["wall_seconds", "seconds_per_step", "step_seconds"] {
                summary[time] = Value::Null;
            }
            summary["command"] = Value::Null; // it names the folder
            text = summary.to_string();
        }
        found.push((name, text));
    }
    found.sort();
    found
}

/// That two folders hold the same results, to the byte.
pub(crate) fn assert_same(found: &Path, expected: &Path, case: &str) {
    let (found, expected) = (results(found), results(expected));
    let names = |files: &[(String, String)]| -> Vec<String> {
        files.iter().map(|(name, _)| name.clone()).collect()
    };
    assert_eq!(names(&found), names(&expected), "{case}");
    for ((name, found), (_, expected)) in found.iter().zip(&expected) {
        let at = found.bytes().zip(expected.bytes()).position(|(a, b)| a != b);
        let lengths = (found.len(), expected.len());
        assert!(found == expected, "{case}: {name} differs at byte {at:?} of {lengths:?}");
    }
}

/// What a run asks.
pub(crate) fn control<'a>(
    every: Option<u64>,
    interrupted: &'a mut dyn FnMut() -> bool,
    progress: &'a mut dyn FnMut(u64, u64),
) -> RunControl<'a> {
    let notice = Box::leak(Box::new(|_: &str| {})); // has no size
    RunControl {
        progress,
        notice,
        interrupted,
        checkpoint_every: every,
        report: true,
        command: None,
    }
}

/// Begins a run of `model`, interrupted before step `stop`.
pub(crate) fn begin(model: &Model, path: &Path, (stop, every): (u64, Option<u64>)) -> Finished {
    let mut simulation = prepare(model).unwrap();
    let folder = RunFolder::create(path, true).unwrap();
    let mut step = 0;
    let mut interrupted = || {
        step += 1;
        step > stop
    };
    let mut progress = |_, _| {};
    let control = control(every, &mut interrupted, &mut progress);
    run_with(model, &mut *simulation, &folder, control).unwrap()
}

/// Continues the run of a folder for `steps` at most.
pub(crate) fn go_on(path: &Path, steps: u64) -> Finished {
    let folder = RunFolder::reopen(path).unwrap();
    let text = folder.model_text();
    let model = Model::from_toml(&text).unwrap();
    let mut simulation: Box<dyn RunnableModel> = prepare(&model).unwrap();
    let found = folder.read_checkpoint(&text).unwrap();
    let mut step = 0;
    let mut interrupted = || {
        step += 1;
        step > steps
    };
    let mut progress = |_, _| {};
    let control = control(None, &mut interrupted, &mut progress);
    resume(&model, &mut *simulation, &folder, found.checkpoint, control).unwrap()
}

/// A folder with two checkpoints, and the text of its model.
pub(crate) fn interrupted_chain(case: &str) -> (PathBuf, String) {
    let path = folder(case).join("out");
    let (_, model) = models().swap_remove(0);
    begin(&model, &path, (13, Some(5)));
    let text = fs::read_to_string(path.join("model.toml")).unwrap();
    (path, text)
}
