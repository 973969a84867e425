//! The balance of each law and bushing, and that of all: the work of the steps against the integral
//! of the power at the nodes, which is found in another way.
//!
//! ```text
//! off_k   |Σ_n W_k,n+1 − W_k,n − ½ (P_k,n + P_k,n+1) (t_n+1 − t_n)|     over steps without an event
//! off     |total(end) − total(0) − Σ W|
//! ```
//! Both are of second order in the step, of first where a law jumps.

use super::halved::{DOES_NOT_FALL, halved};
use holonom_model::{Model, Sensor, SensorKind};
use holonom_sim::sample::Sample;
use holonom_sim::simulation::Simulation;
use vi_verify::certificate::{Criterion, Finding, Verdict};
use vi_verify::subject::SteppingMethod;

/// What half the step may leave of an error.
const FALLS: f64 = 0.7;
/// Errors below this part of what is done are rounding.
const ROUND_OFF: f64 = 1e-10;
/// Errors above this part of what is done that do not fall are no errors of the step.
const WRONG: f64 = 1e-2;

/// A run: of each element how far its work is off, and what it has done, J; then the same of all.
fn run(mut model: Model, names: &[String]) -> Result<Vec<[f64; 2]>, String> {
    for name in names {
        for kind in [SensorKind::Power, SensorKind::Work] {
            model.sensors.push(Sensor::new(format!("{kind:?} of {name}"), kind, name.clone()));
        }
    }
    let mut simulation = Simulation::new(&model).map_err(|error| error.to_string())?;
    let first = simulation.sensors().columns().len() - 2 * names.len();
    let mut found = vec![[0.0; 2]; names.len() + 1];
    let mut off = vec![0.0; names.len()];
    let mut last: Option<(f64, Vec<f64>, bool)> = None;
    let mut largest = 0.0_f64;
    for sample in simulation.samples() {
        let sample: Sample = sample.map_err(|failure| failure.message)?;
        let own = sample.sensors[first..].to_vec();
        let jumps = !sample.events.is_empty();
        if let Some((t, before, jumped)) = &last {
            for (k, off) in off.iter_mut().enumerate() {
                if !jumps && !jumped {
                    let done = own[2 * k + 1] - before[2 * k + 1];
                    *off += done - 0.5 * (sample.t - t) * (before[2 * k] + own[2 * k]);
                }
                found[k] = [off.abs(), found[k][1].max(own[2 * k + 1].abs())];
            }
        }
        largest = largest.max(sample.hamiltonian.abs());
        let balance = sample.energies.last().copied().unwrap_or_default();
        found[names.len()] = [balance.abs(), largest];
        last = Some((sample.t, own, jumps));
    }
    Ok(found)
}

/// The findings of a model with laws or bushings.
pub(super) fn findings(model: &Model, method: SteppingMethod) -> Vec<Finding> {
    let laws = model.laws.iter().map(|law| law.name.clone());
    let names: Vec<String> =
        laws.chain(model.bushings.iter().map(|own| own.name.clone())).collect();
    if names.is_empty() {
        return Vec::new();
    }
    let finding = |quantity: &str| Finding {
        expected: "falls with the step".to_owned(),
        ..Finding::new(Criterion::Energy, method, model.settings.order, quantity)
    };
    let runs = match halved(model, 2, |model, _| run(model, &names)) {
        Ok(runs) => runs,
        Err(reason) => {
            return vec![Finding { reason, ..finding("works of laws") }];
        }
    };
    let quantities = names.iter().map(|name| format!("work of `{name}` less ∫ P dt"));
    let quantities = quantities.chain(["balance with all works".to_owned()]);
    let judged = quantities.zip(runs[0].iter().zip(&runs[1])).map(|(quantity, (coarse, fine))| {
        let ([coarse, size], [fine, _]) = (*coarse, *fine);
        let falls = fine <= FALLS * coarse || fine <= ROUND_OFF * size;
        let (verdict, reason) = match () {
            () if falls => (Verdict::Pass, ""),
            () if fine > WRONG * size => (Verdict::Fail, ""),
            () => (Verdict::Inconclusive, DOES_NOT_FALL),
        };
        Finding {
            measured: format!("{coarse:.1e} J of {size:.1e} J, with half the step {fine:.1e} J"),
            value: Some(coarse),
            verdict,
            reason: reason.to_owned(),
            ..finding(&quantity)
        }
    });
    judged.collect()
}
