//! The library in a functional mock-up unit: where it is found, what helps where there is none.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};

use holonom_fmu::Unit;

/// How it is built.
const BUILD: &str = "cargo build --profile unwinding -p holonom-fmi";

/// Adds the libraries that were named, or that of the `package`, or the one beside the program.
///
/// # Errors
/// What is wrong with a file, or that there is none.
pub fn add_libraries(
    unit: &mut Unit,
    named: &[PathBuf],
    package: Option<&Path>,
) -> Result<(), String> {
    let said = |path: &Path, error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let mut add = |path: &Path| {
        let bytes = fs::read(path).map_err(|error| said(path, &error))?;
        unit.add_library(bytes).map_err(|error| said(path, &error))
    };
    if !named.is_empty() {
        return named.iter().try_for_each(|path| add(path));
    }
    let mut first = None;
    let packed = package.map(|folder| folder.join(library_name()));
    for path in packed.into_iter().chain(beside_the_program()).filter(|path| path.is_file()) {
        match add(&path) {
            Ok(()) => return Ok(()),
            Err(words) => first = first.or(Some(words)),
        }
    }
    let name = library_name();
    Err(first.unwrap_or_else(|| format!("there is no library `{name}` beside the program")))
}

fn library_name() -> String {
    format!("{DLL_PREFIX}holonom_fmi{DLL_SUFFIX}")
}

/// Where the library may be: where cargo puts it, and where packages do.
fn beside_the_program() -> Vec<PathBuf> {
    let program = std::env::current_exe().and_then(fs::canonicalize);
    let folder = program.ok().and_then(|program| Some(program.parent()?.to_owned()));
    let folders = folder.into_iter().flat_map(|folder| {
        let near = ["", "../unwinding", "../lib"];
        near.map(|near| folder.join(near))
    });
    folders.map(|folder| folder.join(library_name())).collect()
}

/// What helps where there is no library.
#[must_use]
pub fn help_on_libraries() -> String {
    format!("name one by --library; from the sources it is built by `{BUILD}`")
}
