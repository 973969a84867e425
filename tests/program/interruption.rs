//! A run that was interrupted or killed and is continued leaves the bytes of one that was not, and
//! can be drawn meanwhile.
#![allow(clippy::unwrap_used)] // a test

use std::cell::Cell;
use std::fs;
use std::path::Path;

use crate::program::command::{code, holonom, words};
use crate::program::interrupted::{
    assert_same, begin, control, folder, go_on, interrupted_chain, models, shipped,
};
use holonom::output::Status;
use holonom::run::{prepare, run, run_with};
use holonom::{Model, RunFolder};

/// Copies the files of a folder as a program that is killed now would leave them.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().flatten().filter(|entry| entry.path().is_file()) {
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

#[test]
fn an_interrupted_run_continues_to_the_same_bytes() {
    let mut points = 0;
    for (name, model) in models() {
        let whole = folder("whole").join(name);
        let mut simulation = prepare(&model).unwrap();
        let reference = RunFolder::create(&whole, true).unwrap();
        run(&model, &mut *simulation, &reference, &mut |_, _| {}).unwrap();
        for (first, later) in [(0, &[1, 2][..]), (7, &[1, 13]), (18, &[]), (39, &[])] {
            let path = folder("parts").join(name);
            let summary = begin(&model, &path, (first, None)).summary;
            assert_eq!((summary.status, summary.steps), (Status::Interrupted, first), "{name}");
            let at = summary.interruption.unwrap();
            assert!(at.step == first && at.resume.unwrap().starts_with("holonom resume "));
            for steps in later {
                assert_eq!(go_on(&path, *steps).summary.status, Status::Interrupted, "{name}");
            }
            assert_eq!(go_on(&path, u64::MAX).summary.status, Status::Done, "{name}");
            assert_same(&path, &whole, &format!("{name}, interrupted at step {first}, {later:?}"));
            points += 1 + later.len();
        }
    }
    println!("{points} interruptions");
}

#[test]
fn a_killed_run_continues_to_the_same_bytes_and_can_be_drawn() {
    let (mut points, mut drawn) = (0, 0);
    for (name, model) in models() {
        let whole = folder("unharmed").join(name);
        let left = folder("killed").join(name);
        let mut simulation = prepare(&model).unwrap();
        let target = RunFolder::create(&whole, true).unwrap();
        let step = Cell::new(0_u64);
        // what a program that is killed before this step leaves
        let mut interrupted = || {
            if [0, 1, 5, 6, 23, 39].contains(&step.get()) {
                copy(&whole, &left.join(step.get().to_string()));
            }
            step.set(step.get() + 1);
            false
        };
        let mut progress = |_, _| {};
        let control = control(Some(5), &mut interrupted, &mut progress);
        run_with(&model, &mut *simulation, &target, control).unwrap();
        for entry in fs::read_dir(&left).unwrap().flatten() {
            let path = entry.path();
            let case = format!("{name}, killed at {}", path.display());
            let folder = RunFolder::open(&path).readable().unwrap().folder;
            holonom::report::write(&folder).unwrap_or_else(|error| panic!("{case}: {error}"));
            drawn += 1;
            // rows that were not whole when the power failed
            let rows = path.join("residuals.csv");
            let text = fs::read_to_string(&rows).unwrap();
            fs::write(&rows, format!("{text}40,0.")).unwrap();
            assert_eq!(go_on(&path, u64::MAX).summary.status, Status::Done, "{case}");
            assert_same(&path, &whole, &case);
            points += 1;
        }
    }
    println!("{points} runs killed and continued, {drawn} drawn");
    assert!(points >= 60);
}

#[test]
fn equilibria_have_no_checkpoints() {
    let folder = folder("statics");
    fs::write(folder.join("model.toml"), shipped("examples/models/bend_45")).unwrap();
    let run = ["run", "model.toml", "-o", "out", "--checkpoint-every", "3"];
    let output = holonom(&folder, &run);
    assert_eq!(output.status.code(), Some(2));
    assert!(words(&output).contains("equilibria has no checkpoints"), "{}", words(&output));
    assert_eq!(code(&folder, &["run", "model.toml", "--checkpoint-every", "0"]), 2);
    let model = Model::from_toml(&shipped("examples/models/bend_45")).unwrap();
    let summary = begin(&model, &folder.join("out"), (2, Some(1))).summary;
    assert_eq!(summary.status, Status::Interrupted);
    assert_eq!(summary.interruption.unwrap().resume, None);
    assert_eq!(code(&folder, &["plot", "out"]), 0);
    assert_eq!(code(&folder, &["resume", "out"]), 1);
}

#[test]
fn whole_rows_are_drawn_and_exported_and_the_rest_is_named() {
    let (path, _) = interrupted_chain("torn");
    let parent = path.parent().unwrap();
    let rows = path.join("trajectory.csv");
    let text = fs::read_to_string(&rows).unwrap();
    fs::write(&rows, format!("{text}15,0.0")).unwrap();
    for verb in [&["plot", "out"][..], &["export", "out", "--force"]] {
        let output = holonom(parent, verb);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        let note = "note: trajectory.csv: a last row that is not whole left out";
        assert!(words(&output).contains(note), "{}", words(&output));
    }
    assert!(fs::read_to_string(&rows).unwrap().ends_with("15,0.0"), "the file is what it was");
}
