//! Runs of a model with its step and with parts of it, for findings that fall with the step.

use holonom_model::{Model, Override};
use vi_core::linear::norm_inf;
use vi_verify::certificate::{Criterion, Finding, Verdict};
use vi_verify::subject::SteppingMethod;

/// Steps of the coarsest run, at most.
const MOST: u64 = 20_000;
/// By how much an observed order may miss.
const SLACK: f64 = 0.4;
/// Parts of a size below which a difference is rounding.
pub(super) const ROUND_OFF: f64 = 1e-11;
/// Parts of the energies that were exchanged, above which a balance that does not fall is wrong.
const WRONG: f64 = 1e-2;
/// Largest residual of a constraint at position level that is rounding, relative to the largest
/// coordinate.
pub(super) const RESIDUAL: f64 = 1e-10;
/// Why a balance that does not fall is not judged.
pub(super) const DOES_NOT_FALL: &str = "it does not fall with the step";

/// What is found with the step of a model, with a half and a quarter of it, or so many of these.
///
/// # Errors
/// Why a run fails, or that it is too long.
pub(super) fn halved<R>(
    model: &Model,
    count: usize,
    run: impl Fn(Model, f64) -> Result<R, String>,
) -> Result<Vec<R>, String> {
    if model.settings.steps() > MOST {
        return Err(format!("more than {MOST} steps"));
    }
    let steps = [1.0, 0.5, 0.25].map(|part| part * model.settings.step);
    steps.into_iter().take(count).map(|step| run(with_step(model, step)?, step)).collect()
}

/// The model with another step, and with every node recorded.
fn with_step(model: &Model, step: f64) -> Result<Model, String> {
    let set = [
        Override { key: "simulation.step".into(), value: format!("{step:?}") },
        Override { key: "simulation.every".into(), value: "1".into() },
    ];
    model.with_overrides(&set).map_err(|error| error.to_string())
}

/// A finding that does not apply as yet, of the method of a model.
pub(super) fn finding(
    model: &Model,
    method: SteppingMethod,
    criterion: Criterion,
    [quantity, expected]: [&str; 2],
) -> Finding {
    Finding {
        expected: expected.to_owned(),
        verdict: Verdict::NotApplicable,
        ..Finding::new(criterion, method, model.settings.order, quantity)
    }
}

/// Whether the order of `q` at the end, by runs with three steps, is the nominal one; else the
/// `unclear` reason.
pub(super) fn judged_order(
    finding: Finding,
    nominal: u32,
    q: [&[f64]; 3],
    unclear: &str,
) -> Finding {
    let apart = |pair: &[&[f64]]| {
        let difference: Vec<f64> = pair[0].iter().zip(pair[1]).map(|(a, b)| a - b).collect();
        norm_inf(&difference) / norm_inf(pair[1]).max(f64::MIN_POSITIVE)
    };
    let errors: Vec<f64> = q.windows(2).map(apart).collect();
    let observed = (errors[0] / errors[1]).log2();
    let meets = errors[1] <= ROUND_OFF || observed > f64::from(nominal) - SLACK;
    Finding {
        measured: format!("{observed:.2} ({:.1e}, {:.1e})", errors[0], errors[1]),
        value: Some(observed),
        ..passed_or(meets, unclear, finding)
    }
}

/// Whether what a balance misses, J, falls with the step, or is rounding of the energies that were
/// `exchanged`. What does not fall, and is a part of those, fails.
pub(super) fn judged_balance(finding: Finding, balance: [f64; 2], exchanged: f64) -> Finding {
    let [coarse, fine] = balance.map(f64::abs);
    let falls = fine <= ROUND_OFF * exchanged || fine < 0.5 * coarse;
    let judged = passed_or(falls, DOES_NOT_FALL, finding);
    let is_wrong = !falls && fine > WRONG * exchanged;
    Finding {
        measured: format!("{coarse:.1e} J, with half the step {fine:.1e} J"),
        value: Some(coarse),
        verdict: if is_wrong { Verdict::Fail } else { judged.verdict },
        ..judged
    }
}

/// Whether a number is not above its bound.
pub(super) fn bounded(finding: Finding, value: f64, bound: f64, measured: String) -> Finding {
    let verdict = if value <= bound { Verdict::Pass } else { Verdict::Fail };
    Finding { measured, value: Some(value), verdict, ..finding }
}

fn passed_or(holds: bool, unclear: &str, finding: Finding) -> Finding {
    let (verdict, reason) = match holds {
        true => (Verdict::Pass, String::new()),
        false => (Verdict::Inconclusive, unclear.to_owned()),
    };
    Finding { verdict, reason, ..finding }
}
