//! A run that was interrupted or killed and is continued leaves the bytes of one that was not; what cannot be continued
//! is refused by name; a run that cannot write leaves whole rows and everything that was there.
#![allow(clippy::unwrap_used)] // a test

use std::cell::Cell;
use std::fs;
use std::path::{Path, PathBuf};

use crate::command::{code, command, folder as empty_folder, holonom, words};
use holonom::experiment::Experiment;
use holonom::output::{CHECKPOINTS, Checkpoint, CheckpointError, Status};
use holonom::run::{Control, Finished, prepare, resume, run, run_with};
use holonom::{Model, RunFolder};
use serde_json::Value;

fn folder(case: &str) -> PathBuf {
    empty_folder("interruption", case)
}

fn shipped(name: &str) -> String {
    fs::read_to_string(format!("{}/../../{name}.toml", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// The chain of eight bodies with sensors of what is followed along a run.
fn chain() -> String {
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

/// Models whose runs follow more than the state of the integrator, with 40 steps, each third recorded.
fn models() -> Vec<(&'static str, Model)> {
    let beam = shipped("examples/models/flying_beam");
    let bricard = shipped("examples/models/bricard");
    let gears = include_str!("turning/gears.toml").to_owned();
    let torsion = include_str!("turning/torsion.toml").to_owned();
    let screw = include_str!("turning/screw.toml").to_owned();
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
        let set = set.map(|(key, value)| (format!("simulation.{key}"), value));
        (name, Model::from_toml_with(&text, &set).unwrap())
    };
    all.map(model).into()
}

/// The files of rows of a folder, its plots, and its summary without what the clock says.
fn results(folder: &Path) -> Vec<(String, String)> {
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
            text = summary.to_string();
        }
        found.push((name, text));
    }
    found.sort();
    found
}

fn assert_same(found: &Path, expected: &Path, case: &str) {
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

/// Copies the files of a folder as a program that is killed now would leave them.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().flatten().filter(|entry| entry.path().is_file()) {
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
}

/// What a run asks.
fn control<'a>(
    every: Option<u64>,
    interrupted: &'a mut dyn FnMut() -> bool,
    progress: &'a mut dyn FnMut(u64, u64),
) -> Control<'a> {
    let notice = Box::leak(Box::new(|_: &str| {})); // has no size
    Control { progress, notice, interrupted, checkpoint_every: every, report: true }
}

/// Begins a run of `model`, interrupted before step `stop`.
fn begin(model: &Model, path: &Path, (stop, every): (u64, Option<u64>)) -> Finished {
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
fn go_on(path: &Path, steps: u64) -> Finished {
    let folder = RunFolder::reopen(path).unwrap();
    let text = folder.model_text();
    let model = Model::from_toml(&text).unwrap();
    let mut simulation: Box<dyn Experiment> = prepare(&model).unwrap();
    let found = folder.read_checkpoint(&text).unwrap();
    let mut step = 0;
    let mut interrupted = || {
        step += 1;
        step > steps
    };
    let mut progress = |_, _| {};
    let control = control(None, &mut interrupted, &mut progress);
    resume(&model, &mut *simulation, (&folder, found.checkpoint), control).unwrap()
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
            let (folder, _) = RunFolder::open(&path).readable().unwrap();
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

/// A folder with two checkpoints, and the text of its model.
fn interrupted_chain(case: &str) -> (PathBuf, String) {
    let path = folder(case).join("out");
    let (_, model) = models().swap_remove(0);
    begin(&model, &path, (13, Some(5)));
    let text = fs::read_to_string(path.join("model.toml")).unwrap();
    (path, text)
}

#[test]
fn a_damaged_checkpoint_is_refused_whatever_byte_is_wrong() {
    let (path, text) = interrupted_chain("bytes");
    let good = fs::read(path.join(CHECKPOINTS[0])).unwrap();
    let read = Checkpoint::decode(&good, &text).unwrap();
    assert_eq!(read.run.step(), 13);
    let mut refused = 0;
    for place in 0..good.len() {
        for bits in [0x01, 0x80, 0xff] {
            let mut bad = good.clone();
            bad[place] ^= bits;
            let error = Checkpoint::decode(&bad, &text).expect_err("a flipped byte");
            let expected = match place {
                0..8 => matches!(error, CheckpointError::Foreign),
                8..12 => matches!(error, CheckpointError::Format { .. }),
                _ => matches!(error, CheckpointError::Damaged(_)),
            };
            assert!(expected, "byte {place}: {error}");
            refused += 1;
        }
    }
    for length in 0..good.len() {
        assert!(Checkpoint::decode(&good[..length], &text).is_err(), "cut off at {length}");
        refused += 1;
    }
    let longer = [&good[..], b"x"].concat();
    assert!(matches!(Checkpoint::decode(&longer, &text), Err(CheckpointError::Damaged(_))));
    let other = text.replace("chain", "train");
    assert_eq!(Checkpoint::decode(&good, &other).err(), Some(CheckpointError::Model));
    println!("{refused} damaged checkpoints refused; {} bytes", good.len());
}

#[test]
fn the_checkpoint_before_stands_in_for_a_damaged_one() {
    let (path, _) = interrupted_chain("fall_back");
    let parent = path.parent().unwrap();
    let (_, model) = models().swap_remove(0);
    let whole = parent.join("whole");
    let mut simulation = prepare(&model).unwrap();
    run(&model, &mut *simulation, &RunFolder::create(&whole, true).unwrap(), &mut |_, _| {})
        .unwrap();
    let newest = path.join(CHECKPOINTS[0]);
    let bytes = fs::read(&newest).unwrap();
    fs::write(&newest, &bytes[..bytes.len() - 1]).unwrap();
    let output = holonom(parent, &["resume", "out", "--no-progress"]);
    let said = words(&output);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.contains("checkpoint: it is damaged"), "{said}");
    assert!(said.contains("continuing from the checkpoint before"), "{said}");
    assert!(said.contains("continuing at step 10 of 40"), "{said}");
    assert_same(&path, &whole, "from the checkpoint before");
    assert!(path.join("checkpoint.refused").is_file(), "it is set aside, not removed");
    // a program that was killed between two renamings
    let path = folder("renaming").join("out");
    begin(&model, &path, (13, Some(5)));
    let [newest, previous] = CHECKPOINTS.map(|name| path.join(name));
    fs::rename(&newest, previous).unwrap();
    fs::write(path.join("checkpoint.tmp"), &bytes[..20]).unwrap();
    assert_eq!(go_on(&path, u64::MAX).summary.status, Status::Done);
    assert_same(&path, &whole, "killed between two renamings");
    // a complete run has nothing to continue
    let output = holonom(parent, &["resume", "out"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(words(&output).contains("the run is complete"), "{}", words(&output));

    // rows that are gone: both are refused
    let (path, _) = interrupted_chain("rows_gone");
    let parent = path.parent().unwrap();
    fs::write(path.join("sensors.csv"), "step,t\n").unwrap();
    let output = holonom(parent, &["resume", "out"]);
    assert_eq!(output.status.code(), Some(1));
    let words = words(&output); // the lengths of the rows are those of rounded numbers
    let written = words
        .split("bytes where ")
        .map(|part| part.trim_start_matches(|c: char| c.is_ascii_digit()));
    insta::assert_snapshot!(
        "no_good_checkpoint",
        written.collect::<Vec<_>>().join("bytes where #")
    );
}

#[test]
fn a_foreign_checkpoint_is_refused_and_stays() {
    let (path, text) = interrupted_chain("foreign");
    let parent = path.parent().unwrap();
    let refused = |because: &str| {
        let before = results(&path);
        let output = holonom(parent, &["resume", "out"]);
        let said = words(&output);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(because), "{because}: {said}");
        assert!(said.contains("holonom run MODEL -o DIR --force"), "{said}");
        assert_eq!(results(&path), before, "nothing was changed");
    };
    // of another model
    fs::write(path.join("model.toml"), text.replace("mass = ", "mass = 1")).unwrap();
    refused("it belongs to another model than model.toml");
    fs::write(path.join("model.toml"), &text).unwrap();
    // of another layout
    let bytes = fs::read(path.join(CHECKPOINTS[0])).unwrap();
    let mut other = bytes.clone();
    other[8] = 99;
    CHECKPOINTS.iter().for_each(|name| fs::write(path.join(name), &other).unwrap());
    refused("its format has version 99; this program reads version 3");
    // of somebody else: neither continued from nor replaced nor removed
    CHECKPOINTS.iter().for_each(|name| fs::write(path.join(name), "my notes").unwrap());
    refused("it is not a checkpoint");
    let run = ["run", "chain.toml", "-o", "out", "--force", "--quiet"];
    fs::write(parent.join("chain.toml"), &text).unwrap();
    assert_eq!(code(parent, &run), 2);
    assert_eq!(fs::read_to_string(path.join(CHECKPOINTS[1])).unwrap(), "my notes");
    // checkpoints of an earlier run are removed with it
    CHECKPOINTS.iter().for_each(|name| fs::write(path.join(name), &bytes).unwrap());
    assert_eq!(code(parent, &run), 0);
    assert!(CHECKPOINTS.iter().all(|name| !path.join(name).exists()));
    // folders without a run
    for (dir, because) in [("chain.toml", "not the folder of a run"), ("none", "not the folder")] {
        let output = holonom(parent, &["resume", dir]);
        assert_eq!(output.status.code(), Some(2));
        assert!(words(&output).contains(because), "{}", words(&output));
    }
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

#[cfg(unix)]
mod processes {
    //! The program itself, with signals. Nothing depends on time: every wait is for a file.

    use super::*;
    use std::process::{Child, Command, Stdio};
    use std::time::{Duration, Instant};

    /// A folder with a chain of some seconds' work.
    fn long_chain(case: &str) -> PathBuf {
        let folder = folder(case);
        fs::write(folder.join("chain.toml"), chain()).unwrap();
        folder
    }

    const RUN: [&str; 8] =
        ["run", "chain.toml", "--end", "8", "--every", "2", "--checkpoint-every", "50"];

    fn start(folder: &Path, arguments: &[&str]) -> Child {
        let mut command = command(folder, arguments);
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    }

    /// Waits until `holds`, or the program has ended.
    fn wait_for(child: &mut Child, holds: impl Fn() -> bool) {
        let begin = Instant::now();
        while !holds() && child.try_wait().unwrap().is_none() {
            assert!(begin.elapsed() < Duration::from_secs(120), "nothing happens");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn signal(child: &Child, name: &str) {
        let sent = Command::new("kill").args([name, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
    }

    fn summary(folder: &Path) -> Value {
        serde_json::from_str(&fs::read_to_string(folder.join("summary.json")).unwrap()).unwrap()
    }

    #[test]
    fn signals_end_a_run_so_that_it_can_be_continued() {
        let folder = long_chain("signals");
        assert_eq!(code(&folder, &[&RUN[..], &["-q", "-o", "whole"]].concat()), 0);
        for (name, expected) in [("-TERM", 143), ("-INT", 130)] {
            let out = folder.join(name);
            let arguments = [&RUN[..], &["--no-progress", "-o"], &[out.to_str().unwrap()]].concat();
            let mut child = start(&folder, &arguments);
            wait_for(&mut child, || out.join(CHECKPOINTS[1]).is_file());
            signal(&child, name);
            let output = child.wait_with_output().unwrap();
            let said = words(&output);
            assert_eq!(output.status.code(), Some(expected), "{said}");
            let found = summary(&out);
            assert_eq!(found["status"], "interrupted");
            let (step, command) =
                (&found["interruption"]["step"], &found["interruption"]["resume"]);
            assert!(said.contains(&format!("interrupted after step {step}")), "{said}");
            assert!(said.contains(command.as_str().unwrap()), "{said}");
            let last = |name: &str| {
                let text = fs::read_to_string(out.join(name)).unwrap();
                assert!(text.ends_with('\n'));
                text.lines().last().unwrap().split(',').next().unwrap().to_owned()
            };
            let rows = (step.as_u64().unwrap() - 1) / 2 * 2;
            assert_eq!(last("trajectory.csv"), rows.to_string(), "all rows so far are written");
            assert_eq!(last("sensors.csv"), rows.to_string());
            println!("{name}: at step {step}");
            assert_eq!(code(&folder, &["plot", out.to_str().unwrap()]), 0);
            assert_eq!(code(&folder, &["resume", out.to_str().unwrap(), "-q"]), 0);
            assert_same(&out, &folder.join("whole"), name);
        }
    }

    #[test]
    fn a_program_that_is_killed_loses_the_steps_since_its_last_checkpoint() {
        let folder = long_chain("kill");
        assert_eq!(code(&folder, &[&RUN[..], &["-q", "-o", "whole"]].concat()), 0);
        let out = folder.join("out");
        let begin = [&RUN[..], &["-q", "-o", "out"]].concat();
        let mut killed = 0;
        for round in 0..6_u32 {
            let arguments = if round == 0 { &begin[..] } else { &["resume", "out", "-q"] };
            let before = fs::read(out.join(CHECKPOINTS[1])).unwrap_or_default();
            let mut child = start(&folder, arguments);
            let seen = || fs::read(out.join(CHECKPOINTS[1])).unwrap_or_default();
            wait_for(&mut child, || seen() != before && !seen().is_empty());
            std::thread::sleep(Duration::from_millis(u64::from(7 * round))); // elsewhere in the interval
            child.kill().unwrap();
            let status = child.wait().unwrap();
            killed += u32::from(status.code().is_none());
            assert!(matches!(summary(&out)["status"].as_str(), Some("running" | "done")));
            assert_eq!(code(&folder, &["plot", "out"]), 0);
        }
        assert!(killed > 0, "all rounds ended before they were killed");
        println!("killed {killed} times");
        assert_eq!(code(&folder, &["resume", "out", "-q"]), 0);
        assert_same(&out, &folder.join("whole"), "killed again and again");
    }

    #[test]
    fn every_kind_of_run_survives_a_signal_and_a_kill() {
        let (mut interrupted, mut killed) = (0, 0);
        for (name, mut model) in models() {
            model.settings.end *= 15.0; // 600 steps
            let folder = folder(&format!("kinds/{name}"));
            let text = model.to_toml();
            fs::write(folder.join("model.toml"), text).unwrap();
            assert_eq!(code(&folder, &["run", "model.toml", "-q", "-o", "whole"]), 0);
            let out = folder.join("out");
            let seen = || fs::read(out.join(CHECKPOINTS[1])).unwrap_or_default();
            let begin = ["run", "model.toml", "-q", "-o", "out", "--checkpoint-every", "20"];
            for (arguments, name) in [(&begin[..], "-TERM"), (&["resume", "out", "-q"], "-KILL")] {
                let before = seen();
                let mut child = start(&folder, arguments);
                wait_for(&mut child, || !seen().is_empty() && seen() != before);
                if child.try_wait().unwrap().is_none() {
                    signal(&child, name);
                }
                match child.wait().unwrap().code() {
                    Some(143) => interrupted += 1,
                    None => killed += 1,
                    other => assert_eq!(other, Some(0), "it ended before"),
                }
            }
            assert_eq!(code(&folder, &["resume", "out", "-q"]), 0);
            assert_same(&out, &folder.join("whole"), name);
        }
        println!("{interrupted} programs interrupted, {killed} killed");
        assert!(interrupted > 0 && killed > 0);
    }

    #[test]
    fn a_folder_belongs_to_one_run_at_a_time() {
        let folder = long_chain("lock");
        let out = folder.join("out");
        let endless =
            ["run", "chain.toml", "--end", "1e5", "-q", "-o", "out", "--checkpoint-every", "20"];
        let mut child = start(&folder, &endless);
        wait_for(&mut child, || out.join(CHECKPOINTS[1]).is_file());
        let model = fs::read_to_string(out.join("model.toml")).unwrap();
        for arguments in [
            &["run", "chain.toml", "-o", "out"][..],
            &["run", "chain.toml", "-o", "out", "--force"],
            &["resume", "out"],
        ] {
            let output = holonom(&folder, arguments);
            assert_eq!(output.status.code(), Some(1), "{}", words(&output));
            assert!(words(&output).contains("a run is in progress in out"), "{}", words(&output));
        }
        assert_eq!(code(&folder, &["plot", "out"]), 0, "what is there can be drawn");
        assert_eq!(fs::read_to_string(out.join("model.toml")).unwrap(), model);
        signal(&child, "-TERM");
        assert_eq!(child.wait().unwrap().code(), Some(143), "the first run was not disturbed");
        assert_eq!(summary(&out)["status"], "interrupted");
        let (rows, torn) = (RunFolder::open(&out).readable().unwrap().1, Vec::new());
        assert_eq!(rows, torn);
        // with the first run its lock is gone
        let again = ["run", "chain.toml", "--end", "0.1", "-q", "-o", "out"];
        assert_eq!(code(&folder, &again), 2);
        assert_eq!(code(&folder, &[&again[..], &["--force"]].concat()), 0);
    }

    #[test]
    fn a_run_that_cannot_write_leaves_whole_rows_and_can_be_continued() {
        let folder = long_chain("full");
        let run = ["run", "chain.toml", "--end", "1", "-q", "--checkpoint-every", "50", "-o"];
        assert_eq!(code(&folder, &[&run[..], &["whole"]].concat()), 0);
        let program = env!("CARGO_BIN_EXE_holonom");
        // the limit of the size of a file is one of the ways in which a disk is full
        let limited = |blocks: u32, arguments: &[&str]| {
            let script = format!("ulimit -f {blocks}; exec {program} {}", arguments.join(" "));
            Command::new("sh").args(["-c", &script]).current_dir(&folder).output().unwrap()
        };
        let output = limited(600, &[&run[..], &["out"]].concat());
        let said = words(&output);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(
            said.contains("out: trajectory.csv: ") && said.contains("holonom resume out"),
            "{said}"
        );
        let out = folder.join("out");
        for (name, text) in results(&out) {
            assert!(text.ends_with('\n') || !name.ends_with(".csv"), "{name}");
        }
        assert_eq!(summary(&out)["status"], "running");
        assert_eq!(code(&folder, &["plot", "out"]), 0);
        // still full: nothing is lost
        assert_eq!(limited(600, &["resume", "out", "-q"]).status.code(), Some(1));
        assert_eq!(code(&folder, &["resume", "out", "-q"]), 0);
        assert_same(&out, &folder.join("whole"), "after a full disk");

        // no place at all
        let output = holonom(&folder, &[&run[..], &["chain.toml/out"]].concat());
        assert_eq!(output.status.code(), Some(1));
        assert!(words(&output).contains("chain.toml/out"), "{}", words(&output));
        // nobody reads, or what is read cannot be stored
        let json = [&run[..], &["json", "--json", "--force"]].concat();
        let mut child = command(&folder, &json).stdout(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        assert_eq!(child.wait().unwrap().code(), Some(0));
        assert_eq!(summary(&folder.join("json"))["status"], "done");
        if let Ok(full) = fs::File::options().write(true).open("/dev/full") {
            let output = command(&folder, &json).stdout(full).output().unwrap();
            assert_eq!(output.status.code(), Some(1));
            assert!(words(&output).contains("standard output"), "{}", words(&output));
            assert_eq!(summary(&folder.join("json"))["status"], "done");
        }
    }
}
