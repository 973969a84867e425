//! What holds across events: order, constraints, the balance with what events take out, what each
//! kind of event keeps. All else is measured on the mechanism before the first of them.
//!
//! | event | keeps |
//! |---|---|
//! | `when` with a root | its condition is zero to rounding where it acts |
//! | `release`, `set`, `enable`, `disable` | velocities, momentum maps |
//! | `lock` | loses `½ Δvᵀ M Δv ≥ 0`, no more: a plastic impact in the norm of the mass |
//! | all | wheels do not slip over any step, before and after |

use super::halved::{self, RESIDUAL, ROUND_OFF, bounded, halved, judged_balance, judged_order};
use holonom_model::{Constraint, Model, Sensor, SensorKind};
use holonom_sim::EventRecord;
use holonom_sim::sample::Sample;
use holonom_sim::simulation::Simulation;
use vi_core::linear::norm_inf;
use vi_verify::certificate::{Criterion, Finding, Verdict};
use vi_verify::subject::SteppingMethod;

/// Part of a step to which the root of a condition is known, with the rounding of the step.
const LOCATED: f64 = 1e-9;

/// A run with one step.
struct StepRun {
    q: Vec<f64>,
    events: Vec<EventRecord>,
    slip: Option<f64>, // m/s or rad/s  largest, of what rolls
    speed: f64,        // largest velocity of a coordinate
    residual: f64,
    balance: f64,   // J  at the end
    exchanged: f64, // J  largest energy
}

fn run(model: &Model, step: f64) -> Result<StepRun, String> {
    let model = with_slips(model);
    let mut simulation = Simulation::new(&model).map_err(|error| error.to_string())?;
    let columns = simulation.sensors().columns().iter().enumerate();
    let slips: Vec<usize> =
        columns.filter(|(_, own)| own.sensor.starts_with(SLIP)).map(|(k, _)| k).collect();
    let mut found = StepRun {
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
pub(super) fn findings(model: &Model, method: SteppingMethod) -> Vec<Finding> {
    let finding = |criterion, quantity: &str, expected: &str| {
        let quantity = format!("{quantity}, across events");
        halved::finding(model, method, criterion, [&quantity, expected])
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
    let order = model.settings.order;
    let of_order = finding(Criterion::Order, "q", &format!("order {order}"));
    let runs = match halved(model, 3, |model, step| run(&model, step)) {
        Ok(runs) => runs,
        Err(reason) => {
            all.push(Finding { verdict: Verdict::Inconclusive, reason, ..of_order });
            return all;
        }
    };
    all.push(order_across(of_order, order, &runs));
    let (coarse, fine) = (&runs[0], &runs[1]);
    let residual = coarse.residual;
    let bound = RESIDUAL * norm_inf(&coarse.q).max(1.0);
    let constraints = finding(Criterion::Residual, "constraints in force", "round-off");
    all.push(bounded(constraints, residual, bound, format!("{residual:.1e}")));
    let balance =
        finding(Criterion::Energy, "balance with the losses of events", "falls with the step");
    all.push(judged_balance(balance, [coarse.balance, fine.balance], coarse.exchanged));
    let small = |criterion, quantity: &str, value, bound, measured| {
        bounded(finding(criterion, quantity, "round-off"), value, bound, measured)
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

/// The order where the same events act with all steps.
fn order_across(finding: Finding, order: u32, runs: &[StepRun]) -> Finding {
    let names = |run: &StepRun| run.events.iter().map(|own| own.event.clone()).collect::<Vec<_>>();
    if runs.iter().any(|run| names(run) != names(&runs[0])) {
        let reason = "other events act with another step".to_owned();
        return Finding { verdict: Verdict::Inconclusive, reason, ..finding };
    }
    let q = [0, 1, 2].map(|k: usize| &runs[k].q[..]);
    let unclear = "the step is too long to show it, or an event is met at a grazing angle";
    judged_order(finding, order, q, unclear)
}
