//! What holds across events: order, constraints, the balance with what events take out. All else is
//! measured on the mechanism before the first of them.

use holonom_model::{Model, Override};
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

/// A run with one step.
struct Run {
    q: Vec<f64>,
    events: Vec<String>,
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
    let mut simulation = Simulation::new(&model).map_err(|error| error.to_string())?;
    let mut found =
        Run { q: Vec::new(), events: Vec::new(), residual: 0.0, balance: 0.0, exchanged: 0.0 };
    for sample in simulation.samples() {
        let sample: Sample = sample.map_err(|failure| failure.message)?;
        found.events.extend(sample.events.iter().map(|event| event.event.clone()));
        found.residual = found.residual.max(sample.residuals.position);
        found.balance = sample.energies.last().copied().unwrap_or_default();
        found.exchanged = found.exchanged.max(sample.hamiltonian.abs());
        found.q = sample.q;
    }
    Ok(found)
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
    all
}

fn judged_order(finding: Finding, order: u32, runs: &[Run]) -> Finding {
    let unclear = |reason: &str| (Verdict::Inconclusive, reason.to_owned());
    if runs.iter().any(|run| run.events != runs[0].events) {
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
