//! What holds of a mechanism with rigid stops or dry friction: the order of `q`, constraints,
//! limits, what impacts and friction take out, the balance. Impulses act at nodes, so what speaks
//! of smooth motions does not apply.

use super::halved::{self, RESIDUAL, ROUND_OFF, bounded, halved, judged_balance, judged_order};
use holonom_model::{Model, Sensor, SensorKind};
use holonom_sim::simulation::Simulation;
use vi_core::linear::norm_inf;
use vi_verify::certificate::{Criterion, Finding, Verdict};
use vi_verify::subject::Method;

/// A run with one step.
struct Run {
    q: Vec<f64>,
    residual: f64,
    beyond: f64,    // m or rad  the largest excess over a limit
    taken: f64,     // J  work of stops and friction
    balance: f64,   // J  at the end
    exchanged: f64, // J  largest energy
}

/// What the sensors of limited joints are called.
const OF_LIMITS: &str = "limits of ";

fn run(mut model: Model) -> Result<Run, String> {
    let bounds: Vec<_> = (model.joints.iter())
        .filter_map(|joint| Some((joint.name.clone(), joint.stops()?)))
        .collect();
    for (joint, _) in &bounds {
        let name = format!("{OF_LIMITS}{joint}");
        model.sensors.push(Sensor::new(name, SensorKind::JointCoordinate, joint.clone()));
    }
    let mut simulation = Simulation::new(&model).map_err(|error| error.to_string())?;
    let columns = simulation.sensors().columns();
    let first = |joint: &str| {
        columns.iter().position(|column| column.sensor.strip_prefix(OF_LIMITS) == Some(joint))
    };
    let bounds: Vec<_> = bounds
        .iter()
        .filter_map(|(joint, limits)| Some((first(joint)? + limits.freedom, *limits)))
        .collect();
    let works = simulation.energy_columns().iter().enumerate();
    let ends = [".stop", ".friction"];
    let works: Vec<usize> = works
        .filter(|(_, name)| name.starts_with("work.") && ends.iter().any(|end| name.ends_with(end)))
        .map(|(k, _)| k)
        .collect();
    let mut found =
        Run { q: Vec::new(), residual: 0.0, beyond: 0.0, taken: 0.0, balance: 0.0, exchanged: 0.0 };
    for sample in simulation.samples() {
        let sample = sample.map_err(|failure| failure.message)?;
        for (k, limits) in &bounds {
            let at = sample.sensors[*k];
            let over = [limits.lower.map(|own| own - at), limits.upper.map(|own| at - own)];
            found.beyond = over.into_iter().flatten().fold(found.beyond, f64::max);
        }
        found.residual = found.residual.max(sample.residuals.position);
        found.taken = works.iter().map(|k| sample.energies[*k]).sum();
        found.balance = sample.energies.last().copied().unwrap_or_default();
        found.exchanged = found.exchanged.max(sample.hamiltonian.abs());
        found.q = sample.q;
    }
    Ok(found)
}

/// The findings of a model with rigid stops or dry friction.
pub(super) fn findings(model: &Model, method: Method) -> Vec<Finding> {
    let finding = |criterion, quantity: &str, expected| {
        let quantity = format!("{quantity}, with stops and friction");
        halved::finding(model, method, criterion, [&quantity, expected])
    };
    let names = model.joints.iter().filter(|joint| joint.is_nonsmooth());
    let names: Vec<String> = names.map(|joint| format!("`{}`", joint.name)).collect();
    let reason = format!("impulses of {} act at nodes", names.join(", "));
    let smooth = |criterion, quantity| Finding {
        reason: reason.clone(),
        ..finding(criterion, quantity, "of smooth motions alone")
    };
    let mut all = vec![
        smooth(Criterion::Output, "residual of the equations of motion"),
        smooth(Criterion::Momentum, "linear and angular momentum"),
        smooth(Criterion::Reversal, "reversal"),
        smooth(Criterion::Symplecticity, "symplectic form"),
    ];
    let of_order = finding(Criterion::Order, "q", "order 2");
    let runs = match halved(model, 3, |model, _| run(model)) {
        Ok(runs) => runs,
        Err(reason) => {
            all.push(Finding { verdict: Verdict::Inconclusive, reason, ..of_order });
            return all;
        }
    };
    let unclear =
        "impacts at nodes (`stepping`), a stop that is grazed, or a step that is too long";
    let q = [0, 1, 2].map(|k: usize| &runs[k].q[..]);
    all.push(judged_order(of_order, 2, q, unclear));
    let (coarse, fine) = (&runs[0], &runs[1]);
    let small = |criterion, quantity, expected, value: f64, bound| {
        bounded(finding(criterion, quantity, expected), value, bound, format!("{value:.1e}"))
    };
    let size = RESIDUAL * norm_inf(&coarse.q).max(1.0);
    let residual = |quantity, value| small(Criterion::Residual, quantity, "round-off", value, size);
    all.push(residual("constraints", coarse.residual));
    all.push(residual("excess over limits", coarse.beyond));
    let rounding = ROUND_OFF * coarse.exchanged;
    let words = "not above round-off";
    all.push(small(Criterion::Energy, "work of stops and friction", words, coarse.taken, rounding));
    let balance = finding(Criterion::Energy, "balance with all works", "falls with the step");
    all.push(judged_balance(balance, [coarse.balance, fine.balance], coarse.exchanged));
    all
}
