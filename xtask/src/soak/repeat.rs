//! A mechanism run again: from a stored state, up to a refused step, by an equivalent scheme.

use super::defects::Defect;
use super::fault::{Fault, FaultKind};
use super::invariants::bounds::AGREEMENT;
use super::invariants::{Measured, within};
use super::trace::{Trace, trace};
use holonom::model::Scheme;
use holonom::output::{Checkpoint, SummaryBuilder};
use holonom::vi_core::linear::norm_inf;
use holonom::{Model, RunFailure, RunState, Sample, Simulation};
use std::convert::Infallible;

/// Whether the text of a resolved model gives the same model.
pub(super) fn round_trip(model: &Model, defect: Option<Defect>) -> Result<(), Fault> {
    let again = Model::from_toml(&Defect::text(defect, model.to_toml()));
    if again.as_ref() == Ok(model) {
        return Ok(());
    }
    let words = match again {
        Ok(_) => "the text of the model gives another model".to_owned(),
        Err(error) => format!("the text of the model is refused: {error}"),
    };
    Err(Fault::new(FaultKind::RoundTrip, words))
}

/// A simulation that has taken `steps` steps.
fn paused(model: &Model, steps: u64) -> Option<(Simulation, Vec<Sample>)> {
    let mut simulation = Simulation::new(model).ok()?;
    let mut samples = Vec::new();
    let mut observe = |sample: &Sample| -> Result<(), Infallible> {
        samples.push(sample.clone());
        Ok(())
    };
    let Ok(outcome) = simulation.run_while(&mut observe, &mut |step, _| step < steps);
    outcome.is_none().then_some((simulation, samples))
}

/// A state as a checkpoint stores it and reads it back.
fn stored(state: RunState, model: &Model) -> Result<RunState, String> {
    let text = model.to_toml();
    let checkpoint = Checkpoint {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        every: None,
        wall_seconds: 0.0,
        run: state,
        summary: SummaryBuilder::default(),
        files: Vec::new(),
    };
    let bytes = checkpoint.encode(&text).map_err(|error| error.to_string())?;
    let read = Checkpoint::decode(&bytes, &text).map_err(|error| error.to_string())?;
    Ok(read.run)
}

/// Whether a run from a stored state is, bit for bit, the run that was not stopped.
pub(super) fn restart(model: &Model, found: &Trace, defect: Option<Defect>) -> Result<(), Fault> {
    let wrong = |words: String| Fault::new(FaultKind::Restart, words);
    let half = model.settings.steps() / 2;
    let Some((simulation, mut samples)) = paused(model, half) else {
        return Err(wrong(format!("the run does not pause at step {half}")));
    };
    let state = stored(Defect::state(defect, simulation.state()), model).map_err(wrong)?;
    let mut other = Simulation::new(model).map_err(|error| wrong(error.to_string()))?;
    other.resume(state).map_err(|error| wrong(error.to_string()))?;
    let rest = trace(&mut other);
    samples.extend(rest.samples);
    let bits = |sample: &Sample| -> Vec<u64> {
        let numbers = sample.q.iter().chain(&sample.energies).chain(&sample.momentum.angular);
        numbers
            .chain([&sample.t, &sample.energy, &sample.newton_iterations])
            .map(|x| x.to_bits())
            .collect()
    };
    let differ = |(a, b): (&Sample, &Sample)| bits(a) != bits(b) || a != b;
    let first = found.samples.iter().zip(&samples).find(|pair| differ(*pair));
    if let Some((sample, _)) = first {
        return Err(wrong(format!("continued at step {half}, differs at step {}", sample.step)));
    }
    match samples.len() == found.samples.len() && rest.failure == found.failure {
        true => Ok(()),
        false => Err(wrong(format!("continued at step {half}, ends otherwise"))),
    }
}

/// Whether a refused step leaves the state as it was.
pub(super) fn refused_step(
    model: &Model,
    failure: &RunFailure,
    defect: Option<Defect>,
) -> Result<(), Fault> {
    let Some((mut simulation, _)) = paused(model, failure.step) else { return Ok(()) };
    let before = simulation.state();
    if simulation.step().is_ok() {
        return Ok(()); // taken, and refused for where it led
    }
    let after = Defect::state(defect, simulation.state());
    match before == after {
        true => Ok(()),
        false => {
            let words = format!("step {} was refused and has changed the state", failure.step);
            Err(Fault::new(FaultKind::State, words))
        }
    }
}

/// Another scheme with the same motion.
fn equivalent(scheme: Scheme) -> Scheme {
    match scheme {
        Scheme::Nodal => Scheme::Constrained,
        Scheme::Constrained | Scheme::Dalembert | Scheme::Reduced => Scheme::Nodal,
        Scheme::EmNodal => Scheme::EmConstrained,
        _ => Scheme::EmNodal,
    }
}

/// Whether an equivalent scheme gives the same motion, in steps that resolve it: of a long step the equations may have
/// several solutions. A scheme that does not apply is not judged.
pub(super) fn agreement(
    model: &Model,
    measured: &mut Measured,
    defect: Option<Defect>,
) -> Result<(), Fault> {
    const RESOLVED: f64 = 2e-4; // s
    let mut model = model.clone();
    let settings = &mut model.settings;
    let steps = settings.steps() as f64;
    settings.step = settings.step.min(RESOLVED);
    settings.end = steps * settings.step;
    let run = |model: &Model| Some(trace(&mut Simulation::new(model).ok()?));
    let Some(found) = run(&model) else { return Ok(()) };
    model.settings.scheme = equivalent(model.settings.scheme);
    let Some(mut motion) = run(&model) else { return Ok(()) };
    Defect::other(defect, &mut motion);
    let (Some(a), Some(b)) = (found.samples.last(), motion.samples.last()) else { return Ok(()) };
    if found.failure.is_some() || motion.failure.is_some() {
        return Ok(());
    }
    let apart = a.q.iter().zip(&b.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let apart = apart / norm_inf(&a.q).max(1.0);
    measured.agreement = Some(apart);
    let scheme = model.settings.scheme.name();
    within(FaultKind::Agreement, apart, AGREEMENT, &format!("distance to the motion of `{scheme}`"))
}
