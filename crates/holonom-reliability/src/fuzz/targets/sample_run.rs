//! The run of a small model that files, states and checkpoints to mutate come from.

use holonom::output::{Checkpoint, SummaryBuilder, Written};
use holonom::{Model, RunFolder, RunState, Simulation, run};
use std::convert::Infallible;
use std::path::Path;

/// The model: bodies, a beam, a point mass, sensors, a prescribed motion.
pub(super) const MODEL: &str = include_str!("../../../../../tests/corpus/model/all_sections.toml");

/// The model of states: as many kinds of parts in fewer coordinates.
const SMALL: &str = include_str!("../../../../../tests/corpus/state/small.toml");

/// The model, resolved.
pub(super) fn model() -> Result<Model, String> {
    let mut model = Model::from_toml(MODEL).map_err(|error| error.to_string())?;
    model.settings.end = 6.0 * model.settings.step;
    Ok(model)
}

/// The small one, resolved.
pub(super) fn small_model() -> Result<Model, String> {
    Model::from_toml(SMALL).map_err(|error| error.to_string())
}

/// The state after a few steps.
pub(super) fn state(model: &Model, steps: u64) -> Result<RunState, String> {
    let mut simulation = Simulation::new(model).map_err(|error| error.to_string())?;
    let mut observe = |_: &holonom::Sample| Ok::<(), Infallible>(());
    let Ok(_) = simulation.run_while(&mut observe, &mut |step, _| step < steps);
    Ok(simulation.state())
}

/// The bytes of a checkpoint.
pub(super) fn checkpoint(model: &Model, run: RunState) -> Result<Vec<u8>, String> {
    let checkpoint = Checkpoint {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        every: Some(2),
        wall_seconds: 0.5,
        run,
        summary: SummaryBuilder::default(),
        files: vec![("trajectory.csv".to_owned(), Written { bytes: 10, hash: 0 })],
    };
    checkpoint.encode(&model.to_toml()).map_err(|error| error.to_string())
}

/// Runs a model into a folder.
pub(super) fn run_into(folder: &Path, model: &Model) -> Result<(), String> {
    let words = |error: &dyn std::error::Error| error.to_string();
    let mut experiment = run::prepare(model).map_err(|error| words(&error))?;
    let folder = RunFolder::create(folder, true).map_err(|error| words(&error))?;
    let control = run::RunControl {
        progress: &mut |_, _| {},
        notice: &mut |_| {},
        interrupted: &mut || false,
        checkpoint_every: Some(3),
        report: false,
        command: None,
    };
    let finished = run::run_with(model, &mut *experiment, &folder, control);
    finished.map(drop).map_err(|error| words(&error))
}
