//! Pictures of a run: replaced and removed only where this program drew them.
//!
//! Every picture ends with a mark. A picture without it is somebody else's file: it is neither
//! removed nor replaced, whatever its name. A folder of pictures that is a symbolic link leads out
//! of the run and is refused.

use std::fs;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use holonom_model::open_regular;

use super::file::{OutputError, at, write_atomically};

/// The last line of every picture.
const MARK: &str = "<!-- drawn by holonom -->\n";

/// Whether a picture bears the mark.
fn is_ours(path: &Path) -> io::Result<bool> {
    let mut file = open_regular(path)?;
    let length = file.metadata()?.len();
    let mark = MARK.len() as u64;
    if length < mark {
        return Ok(false);
    }
    file.seek(SeekFrom::Start(length - mark))?;
    let mut tail = Vec::new();
    file.take(mark).read_to_end(&mut tail)?;
    Ok(tail == MARK.as_bytes())
}

/// Whether something stands at a path, a symbolic link that leads nowhere included.
pub(super) fn is_there(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

/// Whether a path is a symbolic link.
pub(super) fn is_link(path: &Path) -> bool {
    path.symlink_metadata().is_ok_and(|metadata| metadata.is_symlink())
}

/// Refuses a folder of pictures that is a symbolic link, or anything else but a folder.
fn check_folder(folder: &Path) -> Result<(), OutputError> {
    if is_there(folder) && (is_link(folder) || !folder.is_dir()) {
        return Err(OutputError::Foreign { path: folder.to_owned() });
    }
    Ok(())
}

/// Refuses a picture of somebody else.
fn check(path: &Path) -> Result<(), OutputError> {
    if is_there(path) && (is_link(path) || !is_ours(path).map_err(|e| at(path, e))?) {
        return Err(OutputError::Foreign { path: path.to_owned() });
    }
    Ok(())
}

/// Whether the pictures of a run can be drawn in `folder`: looks at the folder and at the picture
/// that every run has, before anything is removed.
pub(super) fn check_before(folder: &Path) -> Result<(), OutputError> {
    check_folder(folder)?;
    check(&folder.join("energy.svg"))
}

/// Removes the pictures that this program drew in `folder`, but for those in `keep`.
pub(super) fn remove(folder: &Path, keep: &[PathBuf]) -> Result<(), OutputError> {
    check_folder(folder)?;
    if !folder.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(folder).map_err(|e| at(folder, e))?.flatten() {
        let path = entry.path();
        let picture = path.extension().is_some_and(|x| x == "svg") && !is_link(&path);
        if picture
            && !keep.contains(&path)
            && path.is_file()
            && is_ours(&path).map_err(|e| at(&path, e))?
        {
            fs::remove_file(&path).map_err(|e| at(&path, e))?;
        }
    }
    Ok(())
}

/// Writes a picture as a whole, in a folder that is created if it does not exist.
pub(super) fn write(path: PathBuf, svg: &str) -> Result<PathBuf, OutputError> {
    if let Some(folder) = path.parent() {
        check_folder(folder)?;
    }
    check(&path)?;
    let text = format!("{}\n{MARK}", svg.trim_end());
    write_atomically(&path, text.as_bytes()).map_err(|e| at(&path, e))?;
    Ok(path)
}
