//! Checkpoints that are damaged, foreign, or do not fit: refused by name, and the one before stands
//! in.
#![allow(clippy::unwrap_used)] // a test

use std::fs;

use crate::program::command::{code, holonom, words};
use crate::program::interrupted::{
    assert_same, begin, folder, go_on, interrupted_chain, models, results,
};
use holonom::RunFolder;
use holonom::output::{CHECKPOINTS, Checkpoint, CheckpointError, Status};
use holonom::run::{prepare, run};

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

/// Rows that were changed, by as little as a digit, do not become part of a continued run.
#[test]
fn rows_that_were_changed_before_the_checkpoint_are_refused() {
    for (case, file) in
        [("trajectory", "trajectory.csv"), ("residuals", "residuals.csv"), ("energy", "energy.csv")]
    {
        let (path, _) = interrupted_chain(&format!("changed_{case}"));
        let parent = path.parent().unwrap();
        let name = path.join(file);
        let good = fs::read(&name).unwrap();
        let place =
            good.iter().enumerate().filter(|(_, byte)| **byte == b'\n').nth(1).unwrap().0 - 1;
        let mut changed = good.clone();
        changed[place] = if changed[place] == b'1' { b'2' } else { b'1' };
        fs::write(&name, &changed).unwrap();
        let output = holonom(parent, &["resume", "out", "--no-progress"]);
        let said = words(&output);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(
            said.contains(file) && said.contains("rows before the checkpoint were changed"),
            "{said}"
        );
        assert!(said.contains("help: run the model again"), "{said}");
        assert_eq!(fs::read(&name).unwrap(), changed, "nothing was written");
        fs::write(&name, &good).unwrap();
        assert_eq!(code(parent, &["resume", "out", "--no-progress"]), 0);
        assert!(
            CHECKPOINTS.iter().all(|name| !path.join(name).exists()),
            "nothing is left to continue"
        );
    }
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
    refused("its format has version 99; this program reads version 8");
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
