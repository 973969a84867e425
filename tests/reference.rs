//! Every reference case found below `HOLONOM_REFERENCE` (default: `tests/reference`), by every scheme
//! that applies.
//!
//! A case holds the trajectory of an independent implementation with the tolerances it vouches for.
//! The discrete trajectory is unique, so each of the four schemes must reproduce it. One line is
//! printed for each case and scheme: the worst deviation of q, p, force, energy and momentum over its
//! tolerance. A file that cannot be read, or a kind or field that is not known, fails the test.

#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::case::{Case, Deviation};
use std::path::{Path, PathBuf};

fn case_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("cannot read the folder {}: {e}", folder.display()));
    for entry in entries {
        let path = entry.unwrap().path();
        if path.is_dir() {
            case_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "json") {
            found.push(path);
        }
    }
}

/// Cargo runs tests in the folder of their package: a relative path is meant from the root.
fn from_root(folder: std::ffi::OsString) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(&folder);
    if root.exists() { root } else { folder.into() }
}

fn files() -> Vec<PathBuf> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/reference");
    let folder = std::env::var_os("HOLONOM_REFERENCE").map_or(PathBuf::from(default), from_root);
    let mut files = Vec::new();
    case_files(&folder, &mut files);
    files.sort();
    assert!(!files.is_empty(), "no case file below {}", folder.display());
    files
}

/// The public functions of `(q_0, q_1, q_2)` on the nodes of the references themselves.
#[test]
fn legendre_transforms_of_reference_nodes_are_met() {
    let (mut held, mut failed) = (0, Vec::new());
    println!("{:<34} {}", "case", Deviation::header());
    for file in files() {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let Some(outcome) = Case::read(&file).unwrap().legendre() else { continue };
        held += 1;
        match outcome {
            Ok(deviation) => {
                println!("{name:<34} {deviation}");
                if deviation.worst().is_nan() || deviation.worst() > 1.0 {
                    failed.push(format!("{name}: {deviation}"));
                }
            }
            Err(message) => failed.push(format!("{name}: {message}")),
        }
    }
    assert!(held > 0, "no reference holds momenta");
    assert!(failed.is_empty(), "{} of {held} failed:\n{}", failed.len(), failed.join("\n"));
}

#[test]
fn every_reference_case_is_met() {
    let files = files();
    let mut failed = Vec::new();
    println!("{:<34} {:<14} {}", "case", "scheme", Deviation::header());
    for file in &files {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let outcome = Case::read(file).and_then(|case| case.run());
        match outcome {
            Ok(runs) => {
                for (scheme, deviation) in runs {
                    let verdict = if deviation.worst() <= 1.0 { "" } else { "  EXCEEDED" };
                    println!("{name:<34} {scheme:<14} {deviation}{verdict}");
                    // the comparison is written so that NaN fails too
                    if deviation.worst().is_nan() || deviation.worst() > 1.0 {
                        failed.push(format!("{name} by {scheme}: {deviation}"));
                    }
                }
            }
            Err(message) => {
                println!("{name:<34} FAILED: {message}");
                failed.push(format!("{name}: {message}"));
            }
        }
    }
    assert!(
        failed.is_empty(),
        "{} of the reference runs failed:\n{}",
        failed.len(),
        failed.join("\n")
    );
}
