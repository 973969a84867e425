//! Meshes of a run: copies of their files, so that the folder needs no other.
//!
//! A copy is named by the hash of its content. So nothing but such copies is removed, and a mesh
//! that was changed is another file, and its model another model. A folder `meshes` that is a
//! symbolic link leads out of the run and is not touched.

use std::fs;
use std::path::Path;

use holonom_model::mesh::{MAX_MESH_BYTES, MESH_FOLDER, is_stored_name};
use holonom_model::{Mesh, Meshes};

use super::file::{OutputError, at, write_atomically};
use super::pictures::{is_link, is_there};

/// Removes the copies in the folder of a run.
pub(super) fn remove(run: &Path) -> Result<(), OutputError> {
    let folder = run.join(MESH_FOLDER);
    if is_link(&folder) || !folder.is_dir() {
        return Ok(());
    }
    let mut removed = false;
    for entry in fs::read_dir(&folder).map_err(|e| at(&folder, e))?.flatten() {
        let path = entry.path();
        if is_copy(&path) {
            fs::remove_file(&path).map_err(|e| at(&path, e))?;
            removed = true;
        }
    }
    if removed {
        let _ = fs::remove_dir(&folder); // it stays where it holds other files
    }
    Ok(())
}

/// Refuses a folder of copies that is a symbolic link, or anything else but a folder, where there
/// are meshes.
pub(super) fn check_before(run: &Path, meshes: &Meshes) -> Result<(), OutputError> {
    let path = run.join(MESH_FOLDER);
    let foreign = is_there(&path) && (is_link(&path) || !path.is_dir());
    if foreign && meshes.iter().next().is_some() {
        return Err(OutputError::Foreign { path });
    }
    Ok(())
}

/// Copies meshes to the folder of a run.
pub(super) fn write(run: &Path, meshes: &Meshes) -> Result<(), OutputError> {
    check_before(run, meshes)?;
    let folder = run.join(MESH_FOLDER);
    meshes.iter().try_for_each(|mesh| write_one(run, &folder, mesh))
}

/// A copy that the folder above has, that of a sweep, is linked.
fn write_one(run: &Path, folder: &Path, mesh: &Mesh) -> Result<(), OutputError> {
    let (path, above) = (folder.join(mesh.stored_name()), run.join("..").join(MESH_FOLDER));
    if is_there(&path) {
        let same = is_copy(&path) && fs::read(&path).is_ok_and(|bytes| bytes == mesh.bytes());
        return if same { Ok(()) } else { Err(OutputError::Foreign { path }) };
    }
    let shared = above.join(mesh.stored_name());
    let linked = is_copy(&shared)
        && fs::create_dir_all(folder).is_ok()
        && fs::hard_link(&shared, &path).is_ok();
    if linked {
        return Ok(());
    }
    write_atomically(&path, mesh.bytes()).map_err(|e| at(&path, e))
}

/// Whether a file is named by the hash of its content.
fn is_copy(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let file = path.symlink_metadata();
    let small = file.is_ok_and(|file| file.is_file() && file.len() <= MAX_MESH_BYTES);
    small && fs::read(path).is_ok_and(|bytes| is_stored_name(&name, &bytes) == Some(true))
}
