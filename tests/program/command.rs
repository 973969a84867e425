//! The program, and folders to run it in.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Mutex;
use std::thread::{self, ThreadId};

pub(crate) const PENDULUM: &str = include_str!("../../examples/models/pendulum.toml");

/// Whose each folder is: tests run side by side, each in a thread, and two of them in one folder
/// empty it for each other.
static FOLDERS: Mutex<BTreeMap<PathBuf, ThreadId>> = Mutex::new(BTreeMap::new());

/// An empty folder for a case of a group of tests. No two tests have the same.
pub(crate) fn folder(group: &str, case: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(group).join(case);
    let test = thread::current().id();
    let owner = FOLDERS.lock().unwrap().insert(folder.clone(), test);
    assert!(owner.is_none_or(|owner| owner == test), "{} is another test's", folder.display());
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The same with the model `pendulum.toml`.
pub(crate) fn pendulum_folder(group: &str, case: &str) -> PathBuf {
    let folder = folder(group, case);
    fs::write(folder.join("pendulum.toml"), PENDULUM).unwrap();
    folder
}

/// The program with some arguments, in a folder.
pub(crate) fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_holonom"));
    command.args(arguments).current_dir(folder).env("NO_COLOR", "1").env("COLUMNS", "100");
    command
}

/// What it prints, and its exit code.
pub(crate) fn holonom(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().unwrap()
}

/// Its exit code; what it said is printed.
pub(crate) fn code(folder: &Path, arguments: &[&str]) -> i32 {
    let output = holonom(folder, arguments);
    println!("{arguments:?}: {}", words(&output));
    output.status.code().unwrap()
}

/// What it says on standard error.
pub(crate) fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The names in a folder.
pub(crate) fn files(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}
