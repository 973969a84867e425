//! What holds of a mechanism with rigid stops or dry friction: the order of `q`, constraints,
//! limits, what impacts and friction take out, the balance. Impulses act at nodes, so what speaks
//! of smooth motions does not apply.

use holonom_model::{Joint, Model, Override, Sensor, SensorKind};
use holonom_sim::simulation::Simulation;
use vi_core::linear::norm_inf;
use vi_verify::certificate::{Criterion, Finding, Verdict};
use vi_verify::subject::Method;

/// Steps of the coarsest run, at most.
const MOST: u64 = 20_000;
/// By how much an observed order may miss.
const SLACK: f64 = 0.4;
/// Parts of a size below which a difference is rounding.
const ROUND_OFF: f64 = 1e-11;
/// Largest residual of a constraint, and largest excess over a limit, that is rounding, relative to
/// the largest coordinate.
const RESIDUAL: f64 = 1e-10;

/// Whether impulses act at the nodes of a joint.
fn acts(joint: &Joint) -> bool {
    joint.friction.is_some() || (joint.limits.is_some() && joint.bumper.is_none())
}

/// Whether impulses act at the nodes of a model.
pub(super) fn has(model: &Model) -> bool {
    model.joints.iter().any(acts)
}

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

fn run(model: &Model, step: f64) -> Result<Run, String> {
    let set = [
        Override { key: "simulation.step".into(), value: format!("{step:?}") },
        Override { key: "simulation.every".into(), value: "1".into() },
    ];
    let mut model = model.with_overrides(&set).map_err(|error| error.to_string())?;
    let limited = |joint: &Joint| joint.limits.filter(|_| joint.bumper.is_none());
    let bounds: Vec<_> = (model.joints.iter())
        .filter_map(|joint| Some((joint.name.clone(), limited(joint)?.table())))
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
    let order = model.settings.order;
    let finding = |criterion, quantity: &str, expected: &str| Finding {
        criterion,
        method: Some(method),
        order,
        quantity: format!("{quantity}, with stops and friction"),
        expected: expected.to_owned(),
        measured: String::new(),
        value: None,
        verdict: Verdict::NotApplicable,
        reason: String::new(),
    };
    let names = model.joints.iter().filter(|joint| acts(joint));
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
    let step = model.settings.step;
    let runs: Result<Vec<Run>, String> = match model.settings.steps() > MOST {
        true => Err(format!("more than {MOST} steps")),
        false => [1.0, 0.5, 0.25].into_iter().map(|part| run(model, part * step)).collect(),
    };
    let runs = match runs {
        Ok(runs) => runs,
        Err(reason) => {
            all.push(Finding { verdict: Verdict::Inconclusive, reason, ..of_order });
            return all;
        }
    };
    let apart = |pair: &[Run]| {
        let off = pair[0].q.iter().zip(&pair[1].q).map(|(a, b)| a - b);
        norm_inf(&off.collect::<Vec<f64>>()) / norm_inf(&pair[1].q).max(f64::MIN_POSITIVE)
    };
    let errors: Vec<f64> = runs.windows(2).map(apart).collect();
    let observed = (errors[0] / errors[1]).log2();
    let meets = errors[1] <= ROUND_OFF || observed > 2.0 - SLACK;
    let unclear =
        "impacts at nodes (`stepping`), a stop that is grazed, or a step that is too long";
    all.push(Finding {
        measured: format!("{observed:.2} ({:.1e}, {:.1e})", errors[0], errors[1]),
        value: Some(observed),
        verdict: if meets { Verdict::Pass } else { Verdict::Inconclusive },
        reason: if meets { String::new() } else { unclear.to_owned() },
        ..of_order
    });
    let small = |criterion, quantity: &str, expected: &str, value: f64, bound: f64| Finding {
        measured: format!("{value:.1e}"),
        value: Some(value),
        verdict: if value <= bound { Verdict::Pass } else { Verdict::Fail },
        ..finding(criterion, quantity, expected)
    };
    let (coarse, fine) = (&runs[0], &runs[1]);
    let size = RESIDUAL * norm_inf(&coarse.q).max(1.0);
    let residual = |quantity, value| small(Criterion::Residual, quantity, "round-off", value, size);
    all.push(residual("constraints", coarse.residual));
    all.push(residual("excess over limits", coarse.beyond));
    let rounding = ROUND_OFF * coarse.exchanged;
    let words = "not above round-off";
    all.push(small(Criterion::Energy, "work of stops and friction", words, coarse.taken, rounding));
    let [before, after] = [coarse, fine].map(|run| run.balance.abs());
    let falls = after <= rounding || after < 0.5 * before;
    all.push(Finding {
        measured: format!("{before:.1e} J, with half the step {after:.1e} J"),
        value: Some(before),
        verdict: if falls { Verdict::Pass } else { Verdict::Inconclusive },
        reason: if falls { String::new() } else { "it does not fall with the step".to_owned() },
        ..finding(Criterion::Energy, "balance with all works", "falls with the step")
    });
    all
}
