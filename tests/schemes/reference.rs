//! Every reference case found below `HOLONOM_REFERENCE` (default: `tests/reference`), by every
//! scheme that applies.
//!
//! A case holds the trajectory of an independent implementation with the tolerances it vouches for.
//! The discrete trajectory is unique, so each of the four schemes must reproduce it. One line is
//! printed for each case and scheme: the worst deviation of q, p, force, energy and momentum over
//! its tolerance; past the capture of the test harness where the folder is given. A file that
//! cannot be read, or a kind or field that is not known, fails the test and is named. The folder
//! may hold any of the kinds.

#![allow(clippy::unwrap_used)] // a test

use crate::harness;

use harness::case::{Case, Deviation};
use std::io::Write;
use std::path::{Path, PathBuf};

/// A line of the table: to standard output itself where a folder was asked for.
fn say(line: &str) {
    if std::env::var_os("HOLONOM_REFERENCE").is_some() {
        std::io::stdout().write_all(format!("{line}\n").as_bytes()).unwrap();
    } else {
        println!("{line}");
    }
}

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

/// Whether a deviation is within its tolerances; written so that NaN is not.
fn within(deviation: &Deviation) -> bool {
    deviation.worst() <= 1.0
}

/// The public functions of `(q_0, q_1, q_2)` on the nodes of the references themselves, where these
/// hold momenta. Files that cannot be read fail [`every_reference_case_is_met`].
fn legendre_transforms(files: &[PathBuf]) -> (usize, Vec<String>) {
    let (mut held, mut failed) = (0, Vec::new());
    say(&format!("{:<34} {}", "Legendre transforms", Deviation::header()));
    for file in files {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let Some(outcome) = Case::read(file).ok().and_then(|case| case.legendre()) else {
            continue;
        };
        held += 1;
        match outcome {
            Ok(deviation) => {
                say(&format!("{name:<34} {deviation}"));
                if !within(&deviation) {
                    failed.push(format!("{name}: {deviation}"));
                }
            }
            Err(message) => failed.push(format!("{name}: {message}")),
        }
    }
    (held, failed)
}

/// Every case by every scheme: how many runs, and what failed.
fn cases(files: &[PathBuf]) -> (usize, Vec<String>) {
    let (mut made, mut failed) = (0, Vec::new());
    say(&format!("{:<34} {:<14} {}", "case", "scheme", Deviation::header()));
    for file in files {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let case = Case::read(file);
        if let Some(missing) = case.as_ref().ok().and_then(Case::missing) {
            say(&format!("{name:<34} NOT TAKEN: {missing}"));
            continue;
        }
        match case.and_then(|case| case.run()) {
            Ok(runs) => {
                made += runs.len();
                for (scheme, deviation) in runs {
                    let verdict = if within(&deviation) { "" } else { "  EXCEEDED" };
                    say(&format!("{name:<34} {scheme:<14} {deviation}{verdict}"));
                    if !within(&deviation) {
                        failed.push(format!("{name} by {scheme}: {deviation}"));
                    }
                }
            }
            Err(message) => {
                say(&format!("{name:<34} FAILED: {message}"));
                failed.push(format!("{name}: {message}"));
            }
        }
    }
    (made, failed)
}

#[test]
fn legendre_transforms_of_reference_nodes_are_met() {
    let (held, failed) = legendre_transforms(&files());
    println!("{held} cases hold momenta");
    assert!(failed.is_empty(), "{} of {held} failed:\n{}", failed.len(), failed.join("\n"));
}

#[test]
fn every_reference_case_is_met() {
    let (made, failed) = cases(&files());
    println!("{made} runs");
    assert!(
        failed.is_empty(),
        "{} of the reference runs failed:\n{}",
        failed.len(),
        failed.join("\n")
    );
}

/// A folder of one kind, with momenta or without, is read and met; no case is passed over.
#[test]
fn any_kind_alone_is_met() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference");
    for (one, momenta) in [
        ("rigid/02a_pendulum_gravity_h0.1.json", true),
        ("beam/04a_flying_beam_vi.json", false),
        ("galerkin/g01_pendulum_s2.json", false),
        ("beam-strains/11_flying_averaged.json", false),
    ] {
        let files = [root.join(one)];
        let (held, bad) = legendre_transforms(&files);
        assert!(bad.is_empty() && (held > 0) == momenta, "{one}: {held} {bad:?}");
        let (made, failed) = cases(&files);
        assert!(failed.is_empty() && made > 0, "{one}: {made} {failed:?}");
    }
}

/// Models of what the program has are run; those of what it lacks are named, not passed over.
#[test]
fn cases_of_laws_are_taken_or_named() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/laws");
    let mut files = Vec::new();
    case_files(&root, &mut files);
    let (mut taken, mut lacking) = (Vec::new(), 0);
    for file in &files {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        match Case::read(file).unwrap().missing() {
            Some(missing) => {
                println!("{name}: not taken, {missing}");
                assert!(!missing.is_empty(), "{name}");
                lacking += 1;
            }
            None => taken.push(name),
        }
    }
    taken.sort();
    assert_eq!(taken.len() + lacking, files.len());
    for name in TAKEN {
        assert!(taken.iter().any(|own| own == name), "{name} is not taken any more");
    }
}

/// Cases that the program can run.
const TAKEN: [&str; 11] = [
    "p04_bearing_rotor",
    "p06_rolling_disc",
    "p07_bicycle",
    "p08_car_corner",
    "p09_motor_table",
    "p10_measured_torque",
    "p12_sleigh",
    "p13_turntable",
    "p15_tension",
    "p16_two_wheels",
    "p17_steady_disc",
];

/// A field or a kind that is not known is a failure that names it.
#[test]
fn what_is_not_known_is_named() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference");
    let scratch = Path::new(env!("CARGO_TARGET_TMPDIR")).join("reference-unknown");
    std::fs::create_dir_all(&scratch).unwrap();
    for (one, from, to, named) in [
        ("rigid/02a_pendulum_gravity_h0.1.json", "pendulum2d", "pendulum3d", "pendulum3d"),
        ("rigid/05_pair_S.json", "\"bodies\"", "\"friction\": 1, \"bodies\"", "friction"),
        (
            "beam/04a_flying_beam_vi.json",
            "\"gravity\"",
            "\"contacts\": [], \"gravity\"",
            "contacts",
        ),
        ("galerkin/g01_pendulum_s2.json", "\"stages\"", "\"laws\": {}, \"stages\"", "laws"),
        ("galerkin/g01_pendulum_s2.json", "\"H_dQ\"", "\"power\": 0, \"H_dQ\"", "power"),
    ] {
        let text = std::fs::read_to_string(folder.join(one)).unwrap();
        assert!(text.contains(from), "{one}");
        let file = scratch.join("case.json");
        std::fs::write(&file, text.replacen(from, to, 1)).unwrap();
        let (made, failed) = cases(&[file]);
        assert!(made == 0 && failed[0].contains(named), "{one}: {failed:?}");
    }
}

/// Derivatives by lengths of a closed loop see `g_θ`, by a mass at given velocities `M_θ`.
#[test]
fn planted_defects_of_derivatives_by_parameters_are_found() {
    use harness::control::Planted;
    let defects = [
        ("gr03_four_bar", Planted::NoRows),
        ("gr03_four_bar", Planted::MassAtMomentum),
        ("gr01_double_pendulum", Planted::NoRows),
        ("gr02_spatial_tree", Planted::MassAtMomentum),
    ];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/control");
    for (name, planted) in defects {
        let Case::Gradient(case) = Case::read(&folder.join(format!("{name}.json"))).unwrap() else {
            panic!("{name} is of another kind");
        };
        assert!(!case.finds(Planted::Nothing).unwrap(), "{name} as it is");
        assert!(case.finds(planted).unwrap(), "{name}: {planted:?} is not found");
    }
}
