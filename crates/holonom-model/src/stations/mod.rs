//! Stations of beams from files: tables with commas, files of BeamDyn and HAWC2.

mod beamdyn;
mod csv;
mod hawc2;

use std::path::Path;
use std::sync::Arc;

use crate::Model;
use crate::mesh::Meshes;
use crate::text::problem::{Problem, fault};
use crate::types::beam::Beam;
use crate::types::station::{Station, Stations};

/// The greatest size of a table of stations, bytes.
const MAX_BYTES: u64 = 16 * 1024 * 1024;

/// Reads the files of stations of all beams; problems have the number of the beam and a key below
/// it.
pub(crate) fn resolve(model: &mut Model) -> Vec<(usize, Problem)> {
    let mut problems = Vec::new();
    let Model { beams, meshes, .. } = model;
    for (k, beam) in beams.iter_mut().enumerate() {
        let Some(Stations::File(name)) = &beam.stations else { continue };
        let (file, set) = hawc2::selected(name);
        let read = meshes.path(file).map_err(|error| error.to_string());
        let rows = match read {
            Ok(path) => rows(&path, meshes, set, beam),
            Err(error) => Err(format!("the table cannot be read: {error}")),
        };
        match rows {
            Ok(rows) => beam.stations = Some(Stations::Rows(rows)),
            Err(message) => {
                let name = name.escape_debug();
                let help = "name a table with commas, the blade file or the primary file of BeamDyn, \
                            or an st file of HAWC2, with #SET$SUBSET after its name";
                problems.push((k, fault("stations", format!("`{name}`: {message}"), help)));
            }
        }
    }
    problems
}

fn text(path: &Path, meshes: &mut Meshes) -> Result<Arc<str>, String> {
    meshes.text(path, MAX_BYTES).map_err(|error| format!("the table cannot be read: {error}"))
}

fn rows(
    path: &Path,
    meshes: &mut Meshes,
    set: [usize; 2],
    beam: &Beam,
) -> Result<Vec<Station>, String> {
    let text = text(path, meshes)?;
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
        return csv::rows(&text);
    }
    if hawc2::is_own(&text) {
        return hawc2::rows(&text, set);
    }
    // a beam without a centre line is refused by itself
    let length =
        beam.plain_meshes().map(|meshes| meshes.iter().flat_map(|mesh| &mesh.lengths).sum());
    let length = length.unwrap_or(1.0);
    beamdyn::rows(&text, path, meshes, length)
}
