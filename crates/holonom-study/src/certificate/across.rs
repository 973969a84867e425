//! What holds across events: order, constraints, the balance with what events take out, what each
//! kind of event keeps. All else is measured on the mechanism before the first of them.
//!
//! | event | keeps |
//! |---|---|
//! | `when` with a root | its condition is zero to rounding where it acts |
//! | `release`, `set`, `enable`, `disable` | velocities, momentum maps |
//! | `lock` | loses `½ Δvᵀ M Δv ≥ 0`, no more: a plastic impact in the norm of the mass |
//! | all | wheels do not slip over any step, before and after |

use holonom_model::{Constraint, Model, Override, Sensor, SensorKind};
use holonom_sim::EventRecord;
use holonom_sim::sample::Sample;
use holonom_sim::simulation::Simulation;
use vi_core::linear::norm_inf;
use vi_verify::certificate::{Criterion, Finding, Verdict};
use vi_verify::subject::Method;

/// Steps of the coarsest run, at most.
const MOST: u64 = 20_000;
/// By how much an observed order may miss.
const SLACK: f64 = 0.4;
/// Relative differences of runs below this are round-off.
const ROUND_OFF: f64 = 1e-11;
/// Largest residual of a constraint at position level that is rounding, relative to the largest
/// coordinate.
const RESIDUAL: f64 = 1e-10;

/// Part of a step to which the root of a condition is known, with the rounding of the step.
const LOCATED: f64 = 1e-9;

/// A run with one step.
struct Run {
    q: Vec<f64>,
    events: Vec<EventRecord>,
    slip: Option<f64>, // m/s or rad/s  largest, of what rolls
    speed: f64,        // largest velocity of a coordinate
    residual: f64,
    balance: f64,   // J  at the end
    exchanged: f64, // J  largest energy
}

fn run(model: &Model, step: f64) -> Result<Run, String> {
    let set = [
        Override { key: "simulation.step".into(), value: format!("{step:?}") },
        Override { key: "simulation.every".into(), value: "1".into() },
    ];
    let model = model.with_overrides(&set).map_err(|error| error.to_string())?;
    let model = with_slips(&model);
    let mut simulation = Simulation::new(&model).map_err(|error| error.to_string())?;
    let columns = simulation.sensors().columns().iter().enumerate();
    let slips: Vec<usize> =
        columns.filter(|(_, own)| own.sensor.starts_with(SLIP)).map(|(k, _)| k).collect();
    let mut found = Run {
        q: Vec::new(),
        events: Vec::new(),
        slip: (!slips.is_empty()).then_some(0.0),
        speed: 0.0,
        residual: 0.0,
        balance: 0.0,
        exchanged: 0.0,
    };
    for sample in simulation.samples() {
        let sample: Sample = sample.map_err(|failure| failure.message)?;
        found.events.extend(sample.events.iter().cloned());
        let own: Vec<f64> = slips.iter().map(|k| sample.sensors[*k]).collect();
        found.slip = found.slip.map(|slip| slip.max(norm_inf(&own)));
        let gone: Vec<f64> = found.q.iter().zip(&sample.q).map(|(a, b)| (b - a) / step).collect();
        found.speed = found.speed.max(norm_inf(&gone));
        found.residual = found.residual.max(sample.residuals.position);
        found.balance = sample.energies.last().copied().unwrap_or_default();
        found.exchanged = found.exchanged.max(sample.hamiltonian.abs());
        found.q = sample.q;
    }
    Ok(found)
}

/// What the sensors of slips are called.
const SLIP: &str = "slip of ";

/// The model with a sensor of the slip of all that rolls.
fn with_slips(model: &Model) -> Model {
    let mut model = model.clone();
    let rolls =
        |c: &&Constraint| matches!(c, Constraint::Rolling { .. } | Constraint::Blade { .. });
    let slips = model.constraints.iter().filter(rolls).map(|constraint| {
        let name = constraint.name().to_owned();
        Sensor::new(format!("{SLIP}{name}"), SensorKind::Slip, name)
    });
    // those that are there may be read by events
    let slips: Vec<Sensor> = slips.collect();
    model.sensors.extend(slips);
    model
}

/// The findings of a model with events.
pub(super) fn findings(model: &Model, method: Method) -> Vec<Finding> {
    let order = model.settings.order;
    let finding = |criterion, quantity: &str, expected: &str| Finding {
        criterion,
        method: Some(method),
        order,
        quantity: format!("{quantity}, across events"),
        expected: expected.to_owned(),
        measured: String::new(),
        value: None,
        verdict: Verdict::NotApplicable,
        reason: String::new(),
    };
    let names: Vec<String> = model.events.iter().map(|event| format!("`{}`", event.name)).collect();
    let reason = format!("not applicable across {}", names.join(", "));
    let no_map = |criterion, quantity| Finding {
        reason: reason.clone(),
        ..finding(criterion, quantity, "of the phases between events alone")
    };
    let mut all = vec![
        no_map(Criterion::Reversal, "reversal"),
        no_map(Criterion::Symplecticity, "symplectic form"),
    ];
    let of_order = finding(Criterion::Order, "q", &format!("order {order}"));
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
    all.push(judged_order(of_order, order, &runs));
    let size = norm_inf(&runs[0].q);
    let residual = runs[0].residual;
    let holds = residual <= RESIDUAL * size.max(1.0);
    all.push(Finding {
        measured: format!("{residual:.1e}"),
        value: Some(residual),
        verdict: if holds { Verdict::Pass } else { Verdict::Fail },
        ..finding(Criterion::Residual, "constraints in force", "round-off")
    });
    let [coarse, fine] = [&runs[0], &runs[1]].map(|run| run.balance.abs());
    let rounding = ROUND_OFF * runs[0].exchanged;
    let falls = fine <= rounding || fine < 0.5 * coarse;
    all.push(Finding {
        measured: format!("{coarse:.1e} J, with half the step {fine:.1e} J"),
        value: Some(coarse),
        verdict: if falls { Verdict::Pass } else { Verdict::Inconclusive },
        reason: if falls { String::new() } else { "it does not fall with the step".to_owned() },
        ..finding(Criterion::Energy, "balance with the losses of events", "falls with the step")
    });
    let small = |criterion, quantity: &str, value: f64, bound: f64, measured: String| Finding {
        measured,
        value: Some(value),
        verdict: if value <= bound { Verdict::Pass } else { Verdict::Fail },
        ..finding(criterion, quantity, "round-off")
    };
    let (run, largest) = (&runs[0], |values: &mut dyn Iterator<Item = f64>| {
        values.reduce(|a, b| if a >= b { a } else { b }) // NaN if the last is
    });
    if let Some(slip) = run.slip {
        let bound = ROUND_OFF * run.speed.max(1.0);
        let measured = format!("{slip:.1e} m/s");
        all.push(small(Criterion::Residual, "slip of what rolls", slip, bound, measured));
    }
    if let Some(off) = largest(&mut run.events.iter().filter_map(|event| event.jump.condition)) {
        let measured = format!("{off:.1e} of its change over the step");
        all.push(small(Criterion::Residual, "conditions where events act", off, LOCATED, measured));
    }
    // those at one time share a jump
    let locks = |event: &&EventRecord| {
        let same = |other: &&EventRecord| other.t.to_bits() == event.t.to_bits();
        run.events.iter().filter(same).any(|other| other.action.starts_with("lock "))
    };
    let (impacts, others): (Vec<_>, Vec<_>) =
        run.events.iter().filter(|event| event.action != "end").partition(locks);
    for (kind, words) in
        [("release", "releases"), ("set", "set numbers"), ("able", "switched parts")]
    {
        let own = others
            .iter()
            .filter(|event| event.action.split(' ').next().is_some_and(|a| a.ends_with(kind)));
        let jumps = own.map(|event| event.jump.velocity.max(event.jump.momentum));
        if let Some(jump) = largest(&mut jumps.into_iter()) {
            let quantity = format!("velocities and momentum maps at {words}");
            let measured = format!("{jump:.1e} of them");
            all.push(small(Criterion::Momentum, &quantity, jump, ROUND_OFF, measured));
        }
    }
    let misses = impacts.iter().map(|event| {
        let jump = event.jump;
        let off = (jump.kinetic - jump.plastic).abs() / jump.size.max(f64::MIN_POSITIVE);
        off.max(-jump.plastic / jump.size.max(f64::MIN_POSITIVE))
    });
    if let Some(miss) = largest(&mut misses.into_iter()) {
        let lost = impacts.iter().map(|event| event.jump.plastic).fold(0.0, f64::max);
        let measured = format!("{lost:.3e} J lost at most, {miss:.1e} of the kinetic energy apart");
        let quantity = "loss of locks less ½ Δvᵀ M Δv";
        all.push(small(Criterion::Energy, quantity, miss, ROUND_OFF, measured));
    }
    all
}

fn judged_order(finding: Finding, order: u32, runs: &[Run]) -> Finding {
    let unclear = |reason: &str| (Verdict::Inconclusive, reason.to_owned());
    let names =
        |run: &Run| -> Vec<String> { run.events.iter().map(|own| own.event.clone()).collect() };
    if runs.iter().any(|run| names(run) != names(&runs[0])) {
        let (verdict, reason) = unclear("other events act with another step");
        return Finding { verdict, reason, ..finding };
    }
    let apart = |pair: &[Run]| {
        let difference: Vec<f64> = pair[0].q.iter().zip(&pair[1].q).map(|(a, b)| a - b).collect();
        norm_inf(&difference) / norm_inf(&pair[1].q).max(f64::MIN_POSITIVE)
    };
    let errors: Vec<f64> = runs.windows(2).map(apart).collect();
    let observed = (errors[0] / errors[1]).log2();
    let (verdict, reason) = if errors[1] <= ROUND_OFF || observed > f64::from(order) - SLACK {
        (Verdict::Pass, String::new())
    } else {
        unclear("the step is too long to show it, or an event is met at a grazing angle")
    };
    let measured = format!("{observed:.2} ({:.1e}, {:.1e})", errors[0], errors[1]);
    Finding { measured, value: Some(observed), verdict, reason, ..finding }
}
