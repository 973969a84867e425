//! Units as the program writes them, loaded by FMPy: valid, equal to a run bit for bit; the page of
//! the guide.
//!
//! `HOLONOM_PYTHON` names the interpreter; without one that has FMPy there is a notice. The library
//! is that of this build, which stands beside the executable of the test.
#![allow(clippy::unwrap_used)] // tests

use holonom_cli::Call;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const ARMS: &str = r#"
model = { name = "arms", gravity = [0.0, 0.0, -9.81] }
parameters = { mass = 1.5 }
simulation = { step = 1e-3, end = 1.0 }
body = [
    { name = "upper", shape = { type = "box", dimensions = [1.0, 0.1, 0.1], density = 300.0 }, position = [0.5, 0.0, 0.0] },
    { name = "lower", mass = "= mass", inertia = [0.01, 0.1, 0.1], position = [1.5, 0.0, 0.0] },
]
joint = [
    { name = "shoulder", type = "revolute", parent = "ground", child = "upper", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0] },
    { name = "elbow", type = "revolute", parent = "upper", child = "lower", position = [1.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0], motor = { effort = 2.0 } },
]
sensor = [
    { name = "end point", type = "position", of = "lower", point = [0.5, 0.0, 0.0] },
    { name = "angle", type = "joint_coordinate", of = "elbow" },
    { name = "elbow_rate", type = "joint_rate", of = "elbow" },
    { name = "bearing", type = "reaction", of = "shoulder" },
]
"#;

fn interpreter() -> Option<PathBuf> {
    let named = std::env::var_os("HOLONOM_PYTHON").map(PathBuf::from);
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/python/bin/python");
    let tried = named.into_iter().chain([built, "python3".into()]);
    tried.into_iter().find(|python| {
        let asked = Command::new(python).args(["-c", "import fmpy, numpy"]).output();
        asked.is_ok_and(|answer| answer.status.success())
    })
}

/// The library of this build.
fn library() -> PathBuf {
    let name =
        format!("{}holonom_fmi{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    std::env::current_exe().unwrap().with_file_name(name)
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fmpy").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The answer of the program: exit code, standard output, standard error.
fn holonom(arguments: &[&str]) -> (u8, String, String) {
    let words = std::iter::once("holonom").chain(arguments.iter().copied()).map(OsString::from);
    let called = Call::new(words).map_or_else(|called| called, |call| call.answer(1_000_000));
    let words = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (called.code, words(called.output), words(called.error))
}

fn path(folder: &Path, name: &str) -> String {
    folder.join(name).display().to_string()
}

/// Runs Python; what it prints.
fn python(interpreter: &Path, folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(interpreter);
    command.args(arguments).current_dir(folder).env("PYTHONDONTWRITEBYTECODE", "1");
    command.env("TMPDIR", folder); // where units are unpacked
    let answer = command.output().unwrap();
    let said = String::from_utf8_lossy(&answer.stderr).into_owned();
    println!("{}{said}", String::from_utf8_lossy(&answer.stdout));
    assert!(answer.status.success(), "{}", answer.status);
    answer
}

#[test]
fn units_are_valid_and_equal_to_the_program_in_fmpy() {
    let Some(interpreter) = interpreter() else {
        println!("no Python with FMPy: units are not loaded by another tool");
        return;
    };
    let folder = folder("arms");
    let model = path(&folder, "arms.toml");
    std::fs::write(&model, ARMS).unwrap();
    for (name, set) in [("run", "parameters.mass=1.5"), ("heavy", "parameters.mass=2.5")] {
        let out = path(&folder, name);
        let (code, _, said) = holonom(&["run", &model, "-o", &out, "--set", set, "--quiet"]);
        assert_eq!(code, 0, "{said}");
    }
    // version, name, what is an input
    let units = [("2", "arms", "elbow"), ("3", "arms", "elbow"), ("3", "pushed", "lower")];
    for (version, name, input) in units {
        let out = path(&folder, &format!("{name}{version}.fmu"));
        let library = library().display().to_string();
        let export = ["export-fmu", &model, "-o", &out, "--fmi", version, "--library", &library];
        let asked = ["--input", input, "--parameter", "body.lower.inertia.1"];
        let (code, _, said) = holonom(&[&export[..], &asked].concat());
        assert_eq!(code, 0, "{said}");
        println!("{said}");
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/check.py");
    python(&interpreter, &folder, &[&script.display().to_string(), &folder.display().to_string()]);
}

#[test]
fn bad_calls_of_the_verb_are_refused_by_name() {
    let folder = folder("refused");
    let model = path(&folder, "arms.toml");
    std::fs::write(&model, ARMS).unwrap();
    let library = library().display().to_string();
    let out = path(&folder, "arms.fmu");
    let export = |more: &[&str]| {
        holonom(&[&["export-fmu", &model, "-o", &out, "--library", &library], more].concat())
    };
    let refused = |code: u8, words: &str, more: &[&str]| {
        let (found, _, said) = export(more);
        let said = said.replace("\n  │ ", " "); // where lines break is a matter of the folder
        assert!(found == code && said.contains(words), "{more:?}: {found}\n{said}");
        assert!(!Path::new(&out).exists(), "{more:?} left a file");
    };
    refused(2, "did you mean `elbow`?", &["--input", "elbo"]);
    refused(2, "a revolute joint has no coordinate 1", &["--input", "elbow.1"]);
    refused(2, "there is no body named `wrist`", &["--input", "wrist.force"]);
    refused(2, "the model has no number at this key", &["--parameter", "body.lower.name"]);
    refused(3, "computes equilibria, no motion", &["--set", "simulation.scheme=static"]);
    refused(2, "invalid value '1'", &["--fmi", "1"]);
    let other = path(&folder, "arms.toml");
    let (code, _, said) = holonom(&["export-fmu", &model, "-o", &out, "--library", &other]);
    assert!(code == 1 && said.contains("no library for Linux, Windows or macOS"), "{said}");
    assert!(said.contains("cargo build --profile unwinding -p holonom-fmi"), "{said}");
    let (code, _, said) = holonom(&["export-fmu", &model, "-o", &out, "--library", "nowhere.so"]);
    assert!(code == 1 && said.contains("nowhere.so"), "{said}");
    // as JSON; nothing is replaced without --force
    let (code, json, _) = export(&["--json"]);
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &found["inputs"][0]["name"]), (0, &"elbow.effort".into()));
    assert_eq!(found["parameters"][0]["start"], 1.5);
    let (code, _, said) = export(&[]);
    assert!(code == 2 && said.contains("already exists"), "{said}");
    assert_eq!(export(&["--force"]).0, 0);
}

/// Blocks of a page: language and content.
fn blocks(text: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some((_, from)) = rest.split_once("\n```") {
        let (language, from) = from.split_once('\n').unwrap();
        let (content, after) = from.split_once("```").unwrap();
        found.push((language.to_owned(), content.to_owned()));
        rest = after;
    }
    found
}

/// The page of the guide: its commands and its Python run, and print what it shows.
/// `HOLONOM_GUIDE=write` replaces what is out of date.
#[test]
fn the_page_of_the_guide_runs() {
    let Some(interpreter) = interpreter() else {
        println!("no Python with FMPy: the page on units is not run");
        return;
    };
    let folder = folder("page");
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/guide/src/fmu.md");
    let text = std::fs::read_to_string(&page).unwrap();
    let (mut printed, mut shown, mut renewed) = (String::new(), 0, text.clone());
    for (language, content) in blocks(&text) {
        match language.as_str() {
            "toml" => std::fs::write(folder.join("crane.toml"), content).unwrap(),
            "bash" => {
                for command in content.lines().filter_map(|line| line.strip_prefix("holonom ")) {
                    let (model, out) = (path(&folder, "crane.toml"), path(&folder, "crane.fmu"));
                    assert_eq!(command, "export-fmu crane.toml");
                    let library = library().display().to_string();
                    let call = ["export-fmu", &model, "-o", &out, "--library", &library];
                    assert_eq!(holonom(&call).0, 0);
                }
            }
            "python" => {
                let answer = python(&interpreter, &folder, &["-c", &content]);
                printed = String::from_utf8(answer.stdout).unwrap();
            }
            "output" => {
                shown += 1;
                let (old, new) =
                    (format!("```output\n{content}```"), format!("```output\n{printed}```"));
                renewed = renewed.replacen(&old, &new, 1);
            }
            _ => {}
        }
    }
    if std::env::var("HOLONOM_GUIDE").is_ok_and(|value| value == "write") {
        std::fs::write(&page, &renewed).unwrap();
    }
    assert!(shown == 1 && (renewed == text || !page.exists()), "the page shows other numbers");
}
