//! `holonom sweep`: every point once, whatever the threads, shards and interruptions; failures
//! beside results.

use crate::program::command::{self, holonom, words};
use std::fs;
use std::path::Path;
use std::process::Output;

const PENDULUM: &str = include_str!("../models/sphere_pendulum.toml");

fn sweep(folder: &Path, out: &str, more: &[&str]) -> Output {
    fs::write(folder.join("pendulum.toml"), PENDULUM).unwrap();
    holonom(folder, &[&["sweep", "pendulum.toml", "-o", out], more].concat())
}

fn table(folder: &Path, out: &str) -> String {
    fs::read_to_string(folder.join(out).join("sweep.csv")).unwrap()
}

const GRID: [&str; 4] =
    ["--vary", "body.bob.position.0=0.5:1.5:3", "--vary", "simulation.step=0.01,0.02"];

#[test]
fn the_table_does_not_depend_on_threads_shards_and_interruptions() {
    let folder = command::folder("sweeps", "table");
    let one = sweep(&folder, "one", &[&GRID[..], &["-j", "1"]].concat());
    assert!(one.status.success(), "{}", words(&one));
    let whole = table(&folder, "one");
    println!("{whole}");
    let mut rows = whole.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let head = rows.next().unwrap();
    assert_eq!(head[..4], ["point", "body.bob.position.0", "simulation.step", "status"]);
    let place = head.iter().position(|name| *name == "angle.max").unwrap();
    let rows: Vec<Vec<&str>> = rows.collect();
    assert_eq!(rows.len(), 6);
    // the longer pendulum is slower: less of its first half-swing in a second
    let swing = |row: usize| rows[row][place].parse::<f64>().unwrap();
    assert!(swing(0) > swing(2) && swing(2) > swing(4), "{} {} {}", swing(0), swing(2), swing(4));

    let four = sweep(&folder, "four", &[&GRID[..], &["-j", "4"]].concat());
    assert!(four.status.success());
    assert_eq!(table(&folder, "four"), whole, "threads");

    for shard in ["2/2", "1/2"] {
        let part = sweep(&folder, "shards", &[&GRID[..], &["--shard", shard]].concat());
        assert!(part.status.success(), "{}", words(&part));
    }
    assert_eq!(table(&folder, "shards"), whole, "shards");

    // killed within a line of the manifest, the folder of the point half written
    let manifest = folder.join("one/manifest.jsonl");
    let text = fs::read_to_string(&manifest).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    fs::write(&manifest, format!("{}\n{}\n{}", lines[0], lines[1], &lines[2][..20])).unwrap();
    fs::remove_file(folder.join("one/00002/summary.json")).unwrap();
    let again = sweep(&folder, "one", &[&GRID[..], &["-j", "1"]].concat());
    assert!(again.status.success(), "{}", words(&again));
    assert!(
        words(&again).contains("6 of 6 points, 2 of them before, 0 failed"),
        "{}",
        words(&again)
    );
    assert_eq!(table(&folder, "one"), whole, "continued");
    let page = fs::read_to_string(folder.join("one/sweep.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("angle.last, by simulation.step"));
    assert!(page.contains("angle.last (rad)"), "units");
    assert!(page.contains("<a href=\"00000/summary.json\">0</a>"), "a link to each run");
    assert!(!page.contains("0000000001"), "no digits of rounding");
    assert!(!folder.join("one/00000/report.html").exists());
}

#[test]
fn a_point_that_fails_does_not_stop_the_others() {
    let folder = command::folder("sweeps", "failing");
    let vary =
        ["--vary", "body.bob.shape.density=-1.0,1000.0,2000.0", "--vary", "simulation.end=0.5"];
    let output = sweep(&folder, "out", &vary);
    assert_eq!(output.status.code(), Some(1), "{}", words(&output));
    assert!(words(&output).contains("1 of 3 points failed"), "{}", words(&output));
    let text = table(&folder, "out");
    println!("{text}");
    let status: Vec<&str> =
        text.lines().skip(1).map(|row| row.split(',').nth(3).unwrap()).collect();
    assert_eq!(status, ["invalid", "done", "done"]);
    let manifest = fs::read_to_string(folder.join("out/manifest.jsonl")).unwrap();
    assert!(manifest.contains("\"message\":"), "{manifest}");
}

#[test]
fn samples_depend_on_the_seed_alone() {
    let folder = command::folder("sweeps", "sampled");
    let sampled = |out: &str, more: &[&str]| {
        let vary = ["--vary", "body.bob.position.0=0.5:1.5", "--sample", "latin", "-n", "4"];
        let output = sweep(&folder, out, &[&vary[..], more].concat());
        assert!(output.status.success(), "{}", words(&output));
        table(&folder, out)
    };
    let first = sampled("a", &[]);
    assert_eq!(first, sampled("b", &["-j", "1"]));
    assert_ne!(first, sampled("c", &["--seed", "1"]));
}

#[test]
fn what_is_no_sweep_of_the_folder_is_refused() {
    let folder = command::folder("sweeps", "refused");
    let code = |output: &Output| output.status.code();
    let unknown = sweep(&folder, "out", &["--vary", "body.bob.colour=1:2:2"]);
    assert_eq!(code(&unknown), Some(3), "{}", words(&unknown));
    let ranged = sweep(&folder, "out", &["--vary", "simulation.end=1:2"]);
    assert_eq!(code(&ranged), Some(2), "{}", words(&ranged));
    assert!(!folder.join("out").exists(), "nothing is written");
    assert!(sweep(&folder, "out", &["--vary", "simulation.end=0.1,0.2"]).status.success());
    let other = sweep(&folder, "out", &["--vary", "simulation.end=0.1,0.3"]);
    assert_eq!(code(&other), Some(2), "{}", words(&other));
    assert!(words(&other).contains("holds another sweep"), "{}", words(&other));
    let forced = sweep(&folder, "out", &["--vary", "simulation.end=0.1,0.3", "--force"]);
    assert!(forced.status.success(), "{}", words(&forced));
    assert_eq!(table(&folder, "out").lines().count(), 3);
    let printed = holonom(&folder, &["collect", "out", "--print"]);
    assert_eq!(String::from_utf8(printed.stdout).unwrap(), table(&folder, "out"));
}
