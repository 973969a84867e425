//! The Python package: its tests, its stubs and its types, by an interpreter with NumPy and pytest.
//!
//! `HOLONOM_PYTHON` names the interpreter; without one that has NumPy and pytest there is a notice.
//! The compiled part is the library of this build, which stands beside the executable of the test.

#![allow(clippy::unwrap_used)] // tests

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Interpreters that are tried.
fn interpreter() -> Option<PathBuf> {
    let named = std::env::var_os("HOLONOM_PYTHON").map(PathBuf::from);
    let built = folder().join("../../target/python/bin/python");
    let tried = named.into_iter().chain([built, "python3".into()]);
    let words = "import sys, numpy, pytest; assert sys.version_info >= (3, 11)";
    tried.into_iter().find(|python| {
        let asked = Command::new(python).args(["-c", words]).output();
        asked.is_ok_and(|answer| answer.status.success())
    })
}

fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target);
        } else {
            std::fs::copy(&path, &target).unwrap();
        }
    }
}

/// The package with the libraries of this build.
fn staged() -> PathBuf {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("package");
    let _ = std::fs::remove_dir_all(&place);
    copy(&folder().join("python"), &place);
    let test = std::env::current_exe().unwrap();
    let name = |of: &str| format!("{DLL_PREFIX}{of}{DLL_SUFFIX}");
    let module = if cfg!(windows) { "_core.pyd" } else { "_core.abi3.so" };
    let (units, package) = (name("holonom_fmi"), place.join("holonom"));
    for (from, to) in [(name("_core"), module), (units.clone(), &units)] {
        std::fs::copy(test.with_file_name(from), package.join(to)).unwrap();
    }
    place
}

/// Files whose tests wait for other processes and programs for the most part: they run beside the
/// others.
const BESIDE: [&str; 5] =
    ["test_types.py", "test_unit.py", "test_sweep.py", "test_shards.py", "test_lanes.py"];

/// pytest with more words, begun.
fn begun(python: &Path, place: &Path, words: &[PathBuf]) -> Child {
    let mut pytest = Command::new(python);
    pytest.args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "--durations=8"]);
    pytest.args(words).current_dir(place);
    pytest.env("PYTHONPATH", place).env("PYTHONDONTWRITEBYTECODE", "1").env("RUST_BACKTRACE", "0");
    pytest.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

#[test]
fn the_package_passes_its_tests() {
    let Some(python) = interpreter() else {
        println!("no Python 3.11 with NumPy and pytest: the package is not tested");
        return;
    };
    let (place, tests) = (staged(), folder().join("tests"));
    let beside = BESIDE.map(|name| tests.join(name));
    assert!(beside.iter().all(|file| file.exists()));
    let ignored = BESIDE.map(|name| format!("--ignore={}", tests.join(name).display()).into());
    let others = [&[tests.clone()][..], &ignored].concat();
    let both = [&beside[..], &others].map(|words| begun(&python, &place, words));
    let both = both.map(|pytest| std::thread::spawn(|| pytest.wait_with_output().unwrap()));
    for answer in both.map(|pytest| pytest.join().unwrap()) {
        let said = String::from_utf8_lossy(&answer.stdout).into_owned();
        println!("{said}{}", String::from_utf8_lossy(&answer.stderr));
        assert!(answer.status.success(), "pytest: {}", answer.status);
    }
}
