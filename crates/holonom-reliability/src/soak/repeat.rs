//! A mechanism run again: from a stored state, up to a refused step, by an equivalent scheme.

use super::defects::SoakDefect;
use super::fault::{FaultKind, Violation};
use super::invariants::bounds::AGREEMENT;
use super::invariants::{InvariantErrors, within};
use super::trace::{Trace, trace};
use holonom::certificate::certify_model;
use holonom::model::{History, Scheme};
use holonom::output::{Checkpoint, SummaryBuilder};
use holonom::verification::certificate::Verdict;
use holonom::vi_core::linear::norm_inf;
use holonom::{Model, RunFailure, RunState, Sample, Simulation};
use std::convert::Infallible;

/// Whether the text of a resolved model gives the same model.
pub(super) fn round_trip(model: &Model, defect: Option<SoakDefect>) -> Result<(), Violation> {
    let text = SoakDefect::text(defect, model.to_toml());
    let again = Model::from_toml_in(&text, &[], model.meshes.clone());
    if again.as_ref() == Ok(model) {
        return Ok(());
    }
    let words = match again {
        Ok(_) => "the text of the model gives another model".to_owned(),
        Err(error) => format!("the text of the model is refused: {error}"),
    };
    Err(Violation::new(FaultKind::RoundTrip, words))
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
pub(super) fn restart(
    model: &Model,
    found: &Trace,
    defect: Option<SoakDefect>,
) -> Result<(), Violation> {
    let wrong = |words: String| Violation::new(FaultKind::Restart, words);
    let half = model.settings.steps() / 2;
    let Some((simulation, mut samples)) = paused(model, half) else {
        return Err(wrong(format!("the run does not pause at step {half}")));
    };
    let state = stored(SoakDefect::state(defect, simulation.state()), model).map_err(wrong)?;
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
    defect: Option<SoakDefect>,
) -> Result<(), Violation> {
    let Some((mut simulation, _)) = paused(model, failure.step) else { return Ok(()) };
    let before = simulation.state();
    if simulation.step().is_ok() {
        return Ok(()); // taken, and refused for where it led
    }
    let after = SoakDefect::state(defect, simulation.state());
    match before == after {
        true => Ok(()),
        false => {
            let words = format!("step {} was refused and has changed the state", failure.step);
            Err(Violation::new(FaultKind::State, words))
        }
    }
}

/// Whether the certificate of a mechanism has no failure, or is refused because nothing moves; in
/// steps that divide no rounding by a tiny square, and where no force jumps, which lowers orders.
pub(super) fn certificate(model: &Model, defect: Option<SoakDefect>) -> Result<(), Violation> {
    const ACCURACY: f64 = 1e-6;
    const SHORTEST: f64 = 1e-3; // s
    let jumps =
        |history: &History| matches!(history, History::Pulse { .. } | History::Steps { .. });
    let motors = model.joints.iter().filter_map(|joint| joint.motor.as_ref());
    let histories = motors.map(|motor| &motor.history);
    if histories.chain(model.loads.iter().map(|load| &load.history)).any(jumps) {
        return Ok(());
    }
    let mut model = model.clone();
    let settings = &mut model.settings;
    let steps = settings.steps() as f64;
    settings.step = settings.step.max(SHORTEST);
    settings.end = steps * settings.step;
    let wrong = |words: String| Err(Violation::new(FaultKind::Certificate, words));
    let mut certificate = match certify_model(&model, ACCURACY, &mut |_| {}) {
        Ok(found) => found.certificate,
        Err(words) if words.starts_with("nothing ") => return Ok(()),
        Err(words) => return wrong(format!("no certificate: {words}")),
    };
    SoakDefect::certify(defect, &mut certificate);
    match certificate.findings.iter().find(|found| found.verdict == Verdict::Fail) {
        Some(found) => wrong(format!("{found}")),
        None => Ok(()),
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

/// Whether an equivalent scheme gives the same motion, in steps that resolve it: of a long step the
/// equations may have several solutions. A scheme that does not apply is not judged, nor what
/// follows a warning of the program about the energy.
pub(super) fn agreement(
    model: &Model,
    measured: &mut InvariantErrors,
    defect: Option<SoakDefect>,
) -> Result<(), Violation> {
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
    SoakDefect::other(defect, &mut motion);
    if found.failure.is_some() || motion.failure.is_some() {
        return Ok(());
    }
    let last = believed(&found.samples).min(believed(&motion.samples)).checked_sub(1);
    let Some(last) = last else { return Ok(()) };
    let apart = distance(&found.samples[last], &motion.samples[last]);
    let scheme = model.settings.scheme.name();
    let amplified = if apart > AGREEMENT { amplification(&model) } else { None };
    let bound = amplified.map_or(AGREEMENT, |by| AGREEMENT.max(f64::EPSILON * by));
    if bound <= AGREEMENT {
        measured.agreement = Some(apart);
    }
    within(FaultKind::Agreement, apart, bound, &format!("distance to the motion of `{scheme}`"))
}

/// How many nodes there are before the program warns that the energy left its band: an unstable
/// motion of which steps have several solutions.
fn believed(samples: &[Sample]) -> usize {
    samples.iter().position(|sample| sample.notice.is_some()).unwrap_or(samples.len())
}

/// The distance of two nodes, relative to the coordinates.
fn distance(a: &Sample, b: &Sample) -> f64 {
    let apart = a.q.iter().zip(&b.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    apart / norm_inf(&a.q).max(1.0)
}

/// By how much a motion amplifies disturbances over its steps, from their growth in the second
/// half, to the square: two equivalent schemes may differ by so many rounding errors. Little where
/// neither the motion nor the step is unstable. `None` where it cannot be measured.
pub(super) fn amplification(model: &Model) -> Option<f64> {
    // ever smaller disturbances, until they are still small at the end
    let disturbed = [1e-6, 1e-9, 1e-12, 1e-15, 1e-18].map(|size| {
        move |p: f64, k: usize| {
            let sign = if k.is_multiple_of(2) { 1.0 } else { -0.7 };
            p + sign * size * (1.0 + p.abs())
        }
    });
    let undisturbed = nodes_after(model, &|p, _| p)?;
    let last = undisturbed.len().checked_sub(1)?;
    disturbed.iter().find_map(|change| {
        let nodes = nodes_after(model, change)?;
        let apart = |k: usize| Some(distance(undisturbed.get(k)?, nodes.get(k)?));
        let (half, whole) = (apart(last / 2)?, apart(last)?);
        (half > 0.0 && whole < 1e-3).then(|| (whole / half).powi(2))
    })
}

/// The nodes of a motion whose initial momenta and velocities are changed: a scheme begins with the
/// ones or with the others.
fn nodes_after(model: &Model, change: &dyn Fn(f64, usize) -> f64) -> Option<Vec<Sample>> {
    let mut simulation = Simulation::new(model).ok()?;
    let mut state = serde_json::to_value(simulation.state()).ok()?;
    for of_state in ["/motion/state/p", "/motion/state/v"] {
        let numbers = state.pointer_mut(of_state)?.as_array_mut()?;
        for (k, number) in numbers.iter_mut().enumerate() {
            *number = change(number.as_f64()?, k).into();
        }
    }
    simulation.resume(serde_json::from_value(state).ok()?).ok()?;
    Some(trace(&mut simulation))
        .filter(|motion| motion.failure.is_none())
        .map(|motion| motion.samples)
}
