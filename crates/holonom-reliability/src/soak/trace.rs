//! A run in memory.

use holonom::experiment::RunnableModel;
use holonom::model::Meshes;
use holonom::simulation::RunOutcome;
use holonom::{Model, ModelError, RunFailure, Sample, Simulation};
use std::convert::Infallible;

/// A run in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// All nodes.
    pub samples: Vec<Sample>,
    /// Why it ended early.
    pub failure: Option<RunFailure>,
    /// The smallest gap of contacts and stops at the ends of steps, m or rad.
    pub gap: Option<f64>,
    /// By which velocity a contact moved beside its law at most, as the run reports, m/s.
    pub deviation: f64,
}

/// Assembles a model from its text and its meshes.
///
/// # Errors
/// [`ModelError`].
pub fn assembled(text: &str, meshes: Meshes) -> Result<(Model, Simulation), ModelError> {
    let model = Model::from_toml_in(text, &[], meshes)?;
    let simulation = Simulation::new(&model)?;
    Ok((model, simulation))
}

/// Runs on to the end.
pub fn trace(simulation: &mut Simulation) -> Trace {
    let mut samples = Vec::new();
    let mut observe = |sample: &Sample| -> Result<(), Infallible> {
        samples.push(sample.clone());
        Ok(())
    };
    let Ok(outcome) = simulation.run(&mut observe, &mut |_, _| {});
    let failure = match outcome {
        RunOutcome::Done => None,
        RunOutcome::Failed(failure) => Some(failure),
    };
    let counts = simulation.contact_counts();
    let gap = counts.and_then(|counts| counts.smallest_gap);
    let deviation = counts.map_or(0.0, |counts| counts.largest_deviation);
    Trace { samples, failure, gap, deviation }
}
