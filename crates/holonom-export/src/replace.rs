//! A folder that is written whole or not at all.

use std::fs;
use std::io;
use std::path::Path;

use holonom_sim::output::beside;

use crate::ExportError;
use crate::vtk::{COLLECTION, FRAMES};

/// Lets `write` fill a folder beside `to` and renames it. A folder that is there is replaced if it is an earlier result.
pub(crate) fn folder<T>(
    to: &Path,
    write: impl FnOnce(&Path) -> Result<T, ExportError>,
) -> Result<T, ExportError> {
    ours(to)?;
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
fn ours(to: &Path) -> Result<(), ExportError> {
    let foreign =
        |entry: &str| ExportError::Foreign { path: to.to_owned(), entry: entry.to_owned() };
    let unread =
        |error: io::Error| ExportError::Write { path: to.to_owned(), message: error.to_string() };
    let Ok(found) = to.symlink_metadata() else { return Ok(()) };
    if !found.is_dir() {
        return Err(ExportError::Write {
            path: to.to_owned(),
            message: "it is not a folder".into(),
        });
    }
    for entry in fs::read_dir(to).map_err(unread)? {
        let name = entry.map_err(unread)?.file_name();
        let name = name.to_string_lossy();
        if name != COLLECTION && name != FRAMES {
            return Err(foreign(&name));
        }
    }
    let frames = to.join(FRAMES);
    if !frames.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(frames).map_err(unread)? {
        let name = entry.map_err(unread)?.file_name();
        let name = name.to_string_lossy();
        if !name.trim_end_matches(".vtm").bytes().all(|byte| byte.is_ascii_digit()) {
            return Err(foreign(&format!("{FRAMES}/{name}")));
        }
    }
    Ok(())
}
