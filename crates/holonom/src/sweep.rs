//! A model at many points: see [`holonom_study::sweep`].

use crate::run::{RunControl, prepare, run_with};
use holonom_model::{Mesh, Meshes, Model, ModelError, Override};
use holonom_sim::output::{OutputError, RunFolder, Status};
use std::path::{Path, PathBuf};

pub use holonom_study::sweep::*;

/// Begins or continues the sweep of a model in a folder, which gets its meshes; with `force`
/// another sweep there is replaced.
///
/// # Errors
/// [`SweepError`].
pub fn begin(
    (text, meshes): (&str, &Meshes),
    set: Vec<Override>,
    plan: Plan,
    folder: &Path,
    (shard, force): (Shard, bool),
) -> Result<Sweep, SweepError> {
    let names = meshes.iter().map(Mesh::stored_name).collect();
    let description = SweepDescription { model: text.to_owned(), meshes: names, set, plan };
    RunFolder::takes_meshes(folder, meshes)?;
    let sweep = Sweep::new(description, folder, shard, force)?;
    RunFolder::open(folder).write_meshes(meshes)?;
    Ok(sweep)
}

/// Runs a point of a sweep of the model `text` into its folder, without plots; `None` when it was
/// interrupted. `meshes`: those of the model, or the folder where they are.
pub fn run_point(
    text: &str,
    meshes: &Meshes,
    point: &SweepPoint<'_>,
    interrupted: &mut dyn FnMut() -> bool,
) -> Option<PointEnd> {
    let ended = |status, message: String| Some(PointEnd { status, message: Some(message) });
    let prepared = |overrides| -> Result<_, ModelError> {
        let model = Model::from_toml_in(text, overrides, meshes.clone())?;
        let simulation = prepare(&model)?;
        Ok((model, simulation))
    };
    let (model, mut simulation) = match prepared(point.overrides) {
        Ok(prepared) => prepared,
        Err(error) => return ended(PointStatus::Invalid, error.to_string()),
    };
    let control = RunControl {
        progress: &mut |_, _| {},
        notice: &mut |_| {},
        interrupted,
        checkpoint_every: None,
        report: false,
        command: None,
    };
    let finished = RunFolder::create(point.folder, true)
        .and_then(|folder| run_with(&model, &mut *simulation, &folder, control));
    match finished {
        Ok(finished) => match (finished.summary.status, finished.summary.failure) {
            (Status::Done, _) => Some(PointEnd { status: PointStatus::Done, message: None }),
            (Status::Failed, Some(failure)) => ended(
                PointStatus::Failed,
                format!("step {}, t = {} s: {}", failure.step, failure.t, failure.message),
            ),
            _ => None,
        },
        Err(error) => ended(PointStatus::Failed, error.to_string()),
    }
}

/// The points of a sweep that have ended, written.
#[derive(Clone, Debug)]
pub struct Collected {
    /// All points.
    pub table: SweepTable,
    /// `sweep.csv` and `sweep.html`.
    pub files: [PathBuf; 2],
}

/// Writes `sweep.csv` and `sweep.html` of a sweep, finished or not.
///
/// # Errors
/// [`SweepError`].
pub fn collect(folder: &Path) -> Result<Collected, SweepError> {
    let table = table(folder)?;
    let path = folder.join("sweep.csv");
    let csv = table.csv().map_err(|source| OutputError::Io { path, source })?;
    let html = page(&table, env!("CARGO_PKG_VERSION"));
    let folder = RunFolder::open(folder);
    let files = [folder.write("sweep.csv", &csv)?, folder.write("sweep.html", &html)?];
    Ok(Collected { table, files })
}
