//! Files that somebody else wrote are neither removed nor replaced, and links are not followed.

#![allow(clippy::unwrap_used)] // a test

use crate::program::command::{PENDULUM, code, pendulum_folder};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

fn folder(case: &str) -> PathBuf {
    pendulum_folder("foreign", case)
}

const RUN: [&str; 6] = ["run", "pendulum.toml", "--set", "simulation.end=0.1", "-q", "-o"];

#[test]
fn foreign_pictures_stay_and_own_ones_are_replaced() {
    let folder = folder("pictures");
    let plots = folder.join("out/plots");
    fs::create_dir_all(&plots).unwrap();
    fs::write(plots.join("photo.svg"), "<svg>mine</svg>").unwrap();
    fs::write(plots.join("notes.txt"), "mine").unwrap();
    assert_eq!(code(&folder, &[&RUN[..], &["out"]].concat()), 0);
    assert!(plots.join("energy.svg").exists() && plots.join("position_bob.svg").exists());
    // another model draws other pictures: those of the first run go, foreign ones stay
    let other = PENDULUM.replace("bob", "ball");
    fs::write(folder.join("pendulum.toml"), other).unwrap();
    assert_eq!(code(&folder, &[&RUN[..], &["out", "--force"]].concat()), 0);
    assert!(!plots.join("position_bob.svg").exists() && plots.join("position_ball.svg").exists());
    assert_eq!(fs::read_to_string(plots.join("photo.svg")).unwrap(), "<svg>mine</svg>");
    assert_eq!(fs::read_to_string(plots.join("notes.txt")).unwrap(), "mine");
}

#[test]
fn a_foreign_picture_in_the_way_is_refused_before_anything_is_removed() {
    let folder = folder("in_the_way");
    assert_eq!(code(&folder, &[&RUN[..], &["out"]].concat()), 0);
    let energy = folder.join("out/plots/energy.svg");
    fs::write(&energy, "<svg>mine</svg>").unwrap();
    for more in [&["out"][..], &["out", "--force"]] {
        assert_eq!(code(&folder, &[&RUN[..], more].concat()), 2);
        assert_eq!(fs::read_to_string(&energy).unwrap(), "<svg>mine</svg>");
        assert!(folder.join("out/trajectory.csv").exists());
    }
    assert_eq!(code(&folder, &["plot", "out"]), 2);
    assert_eq!(fs::read_to_string(&energy).unwrap(), "<svg>mine</svg>");
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_not_followed() {
    use std::os::unix::fs::symlink;
    let folder = folder("links");
    let elsewhere = folder.join("elsewhere");
    fs::create_dir_all(&elsewhere).unwrap();
    fs::create_dir_all(folder.join("out")).unwrap();
    symlink(&elsewhere, folder.join("out/plots")).unwrap();
    symlink(&elsewhere, folder.join("out/modes")).unwrap();
    fs::write(elsewhere.join("energy.svg"), "<svg>mine</svg>").unwrap();
    for more in [&["out"][..], &["out", "--force"]] {
        assert_eq!(code(&folder, &[&RUN[..], more].concat()), 2);
    }
    let left: Vec<_> = fs::read_dir(&elsewhere).unwrap().flatten().map(|e| e.file_name()).collect();
    assert_eq!(left, ["energy.svg"]);
    // a link in the place of a file of the run is a file that is there: it is not written through
    let target = folder.join("precious.csv");
    fs::create_dir_all(folder.join("other")).unwrap();
    symlink(&target, folder.join("other/trajectory.csv")).unwrap();
    assert_eq!(code(&folder, &[&RUN[..], &["other"]].concat()), 2);
    assert_eq!(code(&folder, &[&RUN[..], &["other", "--force"]].concat()), 0);
    assert!(!target.exists(), "written through a link");
}

#[test]
fn compare_removes_nothing_before_it_has_something_to_write() {
    let folder = folder("compare");
    let arguments =
        ["compare", "pendulum.toml", "-o", "out", "--end", "0.1", "-q", "--schemes", "nodal"];
    assert_eq!(code(&folder, &arguments), 0);
    let before = fs::read_to_string(folder.join("out/compare.json")).unwrap();
    assert_eq!(code(&folder, &arguments), 2);
    let wrong = [&arguments[..], &["--force", "--order", "3"]].concat();
    assert_ne!(code(&folder, &wrong), 0);
    assert_eq!(fs::read_to_string(folder.join("out/compare.json")).unwrap(), before);
}

#[cfg(unix)]
#[test]
fn a_named_pipe_is_no_model() {
    let folder = folder("pipe");
    assert!(Command::new("mkfifo").arg(folder.join("pipe.toml")).status().unwrap().success());
    assert_eq!(code(&folder, &["check", "pipe.toml"]), 3);
}
