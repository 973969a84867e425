//! The program itself, with signals: it ends so that its run can be continued. Nothing depends on
//! time: every wait is for a file.
#![allow(clippy::unwrap_used)] // a test

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::command::{code, command, holonom, words};
use crate::program::interrupted::{assert_same, chain, folder, models, results};
use holonom::RunFolder;
use holonom::output::CHECKPOINTS;
use serde_json::Value;

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
        let (step, command) = (&found["interruption"]["step"], &found["interruption"]["resume"]);
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
        // elsewhere in the interval
        std::thread::sleep(Duration::from_millis(u64::from(7 * round)));
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
    assert_eq!(RunFolder::open(&out).readable().unwrap().left_out, []);
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
