//! A folder that is written whole or not at all.

use std::fs;
use std::io;
use std::path::Path;

use holonom_sim::output::beside;

use crate::ExportError;

/// Lets `write` fill a folder beside `to` and renames it. A folder that is there is replaced if it
/// is an earlier result: `known` knows all its entries, `NAME` and `FOLDER/NAME`.
pub(crate) fn folder<T>(
    to: &Path,
    known: impl Fn(&str) -> bool,
    write: impl FnOnce(&Path) -> Result<T, ExportError>,
) -> Result<T, ExportError> {
    ours(to, known)?;
    let [temporary, old] = ["tmp", "old"].map(|kind| beside(to, kind));
    let failed =
        |error: io::Error| ExportError::Write { path: to.to_owned(), message: error.to_string() };
    let written = write(&temporary).and_then(|written| {
        let there = to.is_dir();
        if there {
            fs::rename(to, &old).map_err(failed)?;
        }
        if let Err(error) = fs::rename(&temporary, to) {
            if there {
                let _ = fs::rename(&old, to); // the first error is the one to report
            }
            return Err(failed(error));
        }
        Ok(written)
    });
    if old.is_dir() && to.is_dir() {
        fs::remove_dir_all(&old).map_err(failed)?;
    }
    if written.is_err() {
        let _ = fs::remove_dir_all(&temporary); // the first error is the one to report
    }
    written
}

/// Whether a folder may be replaced: it is empty or holds nothing but what is written here.
fn ours(to: &Path, known: impl Fn(&str) -> bool) -> Result<(), ExportError> {
    let unread =
        |error: io::Error| ExportError::Write { path: to.to_owned(), message: error.to_string() };
    let Ok(found) = to.symlink_metadata() else { return Ok(()) };
    if !found.is_dir() {
        return Err(ExportError::Write {
            path: to.to_owned(),
            message: "it is not a folder".into(),
        });
    }
    let judge = |entry: String| {
        if known(&entry) {
            Ok(())
        } else {
            Err(ExportError::Foreign { path: to.to_owned(), entry })
        }
    };
    for entry in fs::read_dir(to).map_err(unread)? {
        let entry = entry.map_err(unread)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        judge(name.clone())?;
        if entry.file_type().map_err(unread)?.is_dir() {
            for inner in fs::read_dir(entry.path()).map_err(unread)? {
                let inner = inner.map_err(unread)?.file_name();
                judge(format!("{name}/{}", inner.to_string_lossy()))?;
            }
        }
    }
    Ok(())
}
