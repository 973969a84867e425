//! Whether a measured number keeps its promise.

use super::certificate::{Criterion, Finding, Study, Verdict};
use super::convergence::{Convergence, Quantity};
use super::fit::power_law;
use super::growth::{Growth, NoGrowth, growth};
use super::measure::LongRun;
use super::order::{NoOrder, ObservedOrder};
use super::subject::Method;
use super::trend::trend;
use vi_core::Composition;

/// Observed orders may miss their nominal value by this.
pub const ORDER_TOLERANCE: f64 = 0.2;
/// The symplectic form may change by this, relative to its terms.
pub const FORM_TOLERANCE: f64 = 1e-10;
/// Exponents of condition numbers may be off by this.
pub const EXPONENT_TOLERANCE: f64 = 0.2;
/// Steps below which a trend of the energy or the exponent of a drift cannot be told from the wandering
/// of the motion.
const TELLING_STEPS: u64 = 8000;

/// A finding about which nothing is known yet.
pub(super) fn finding(criterion: Criterion, method: Method, order: u32, quantity: &str) -> Finding {
    Finding {
        criterion,
        method: Some(method),
        order,
        quantity: quantity.to_owned(),
        expected: String::new(),
        measured: String::new(),
        value: None,
        verdict: Verdict::Open,
        reason: String::new(),
    }
}

/// Sub-steps of a step.
pub(super) fn sub_steps(order: u32) -> u64 {
    Composition::of_order(order).map_or(1, |c| c.gammas().len() as u64)
}

/// Round-off of `steps` steps that the motion enlarges: `10 ε √N` times the growth.
pub(super) fn round_off(steps: u64, growth: f64) -> f64 {
    10.0 * f64::EPSILON * (steps as f64).sqrt() * growth
}

/// The order of a quantity: nominal, except for multipliers that are known to be of first order.
pub(super) fn judge_order(
    method: Method,
    order: u32,
    curve: &Convergence,
    study: &Study,
) -> Finding {
    let mut found = finding(Criterion::Order, method, order, curve.quantity.name(method));
    let variational = matches!(method, Method::Variational(_));
    let first_order = match curve.quantity {
        Quantity::StartMultiplier if variational => "a start is one-sided: (47) is of first order",
        Quantity::StartMultiplier => "there is no step before the start to take the mean with",
        Quantity::OtherMultiplier if !variational => {
            "the normal part of v_n alternates from step to step; the mean of two steps is of order 2"
        }
        _ => "",
    };
    let known = !first_order.is_empty();
    let nominal = if known { 1.0 } else { f64::from(order) };
    found.expected = if known { "1, not 2".into() } else { order.to_string() };
    match &curve.observed {
        Ok(ObservedOrder { order: p, points, correction, .. }) => {
            let range = &curve.errors[points.clone()];
            let (coarse, fine) = (range[0].error, range[range.len() - 1].error);
            found.measured = format!("{p:.2} ({coarse:.0e} … {fine:.0e})");
            found.value = Some(*p);
            // first-order terms may vanish by symmetry of the start
            let holds = if known {
                *p >= 1.0 - 2.0 * ORDER_TOLERANCE
            } else {
                (p - nominal).abs() <= ORDER_TOLERANCE
            };
            found.verdict = match (holds, known) {
                (true, false) => Verdict::Pass,
                (true, true) if *p < 2.0 - ORDER_TOLERANCE => Verdict::Known,
                (true, true) => Verdict::Pass,
                (false, _) => Verdict::Fail,
            };
            let halvings = (range[0].step / range[range.len() - 1].step).log2();
            found.reason = if known {
                first_order.into()
            } else {
                let term =
                    if *correction == 0.0 { "" } else { " with the next term of the expansion" };
                format!(
                    "over {halvings:.1} halvings{term} against {}, to t = {} s",
                    study.reference, study.end
                )
            };
        }
        Err(NoOrder::Exact { largest }) => {
            found.measured = format!("exact ({largest:.0e})");
            found.verdict = Verdict::Pass;
        }
        Err(refused @ NoOrder::NoConvergence { .. }) if known && !variational => {
            found.measured = "no order can be read".into();
            found.reason = format!("{first_order}; {refused}");
        }
        Err(refused @ NoOrder::NoConvergence { .. }) => {
            found.measured = "does not converge".into();
            found.reason = refused.to_string();
            found.verdict = Verdict::Fail;
        }
        Err(refused) => {
            found.measured = "no order can be read".into();
            found.reason = refused.to_string();
        }
    }
    found
}

/// A residual at velocities that is no round-off is of second order where a constraint is not quadratic.
pub(super) fn not_quadratic(found: &mut Finding, short: &[(f64, [f64; 3])]) {
    let law = power_law(short.iter().map(|(h, r)| (*h, r[1])));
    if let Some(law) = law.filter(|law| law.exponent >= 2.0 - 2.0 * ORDER_TOLERANCE) {
        found.verdict = Verdict::Known;
        found.measured = format!("{}, order {:.2}", found.measured, law.exponent);
        found.reason =
            "a constraint that is not quadratic in q (a thread, a coupling) meets (45) to \
                        second order"
                .into();
    }
}

pub(super) fn judge_energy(method: Method, order: u32, run: &LongRun) -> Finding {
    let mut found = finding(Criterion::Energy, method, order, "H_d");
    let size = run.energy_size();
    if !run.nature.conservative {
        found.reason = "forces or prescribed motion do work: no promise".into();
        return found;
    }
    match trend(&run.energies(), &run.shadow_energies()) {
        Err(refused) => found.reason = refused.to_string(),
        Ok(trend) => {
            let relative = if size > 0.0 { trend.width() / size } else { 0.0 };
            let round_off = round_off(run.steps * sub_steps(order), 10.0);
            let kept = relative <= round_off;
            let variational = matches!(method, Method::Variational(_));
            found.expected = match variational {
                true => "bounded, no trend".into(),
                false => "kept to solver tolerance".into(),
            };
            found.measured = if kept {
                format!("kept to {relative:.0e}")
            } else {
                format!("± {:.0e}, trend {:.1} %", 0.5 * relative, 100.0 * trend.relative())
            };
            found.value = Some(trend.relative());
            // round-off walks in any case
            let stays = trend.is_bounded() || trend.wander <= round_off * size;
            let holds = kept || (variational && stays);
            found.verdict = if holds { Verdict::Pass } else { Verdict::Fail };
            if !kept && run.steps < TELLING_STEPS {
                found.verdict = Verdict::Open;
                found.reason = format!("fewer than {TELLING_STEPS} steps do not tell a trend");
            } else if !holds {
                found.reason = format!(
                    "its means wander by {:.1e} J, its band widens by {:.2}",
                    trend.wander, trend.widening
                );
            }
        }
    }
    found
}

pub(super) fn judge_momentum(
    (method, order): (Method, u32),
    name: &str,
    run: &LongRun,
    samples: &[f64],
) -> Finding {
    let mut found = finding(Criterion::Momentum, method, order, name);
    found.expected = "≤ N^0.6, at round-off".into();
    match growth(samples) {
        Err(NoGrowth::Exact) => {
            found.measured = NoGrowth::Exact.to_string();
            found.verdict = Verdict::Pass;
        }
        Err(refused) => found.reason = refused.to_string(),
        Ok(growth) => {
            let Growth { exponent, drift, .. } = growth;
            found.measured = format!("N^{exponent:.2}, {drift:.0e}");
            found.value = Some(exponent);
            let root = f64::EPSILON * ((run.steps * sub_steps(order)) as f64).sqrt();
            // below ε√N the exponent is that of single last bits, in few steps it scatters
            let walks = growth.is_unbiased() || run.steps < TELLING_STEPS;
            let holds = drift <= root || (walks && drift <= 1e3 * root);
            found.verdict = if holds { Verdict::Pass } else { Verdict::Fail };
        }
    }
    found
}

pub(super) fn judge_residuals(
    (method, order): (Method, u32),
    h: f64,
    run: &LongRun,
) -> [Finding; 2] {
    let [position, velocity, _] = run.residuals();
    let scale = 1.0 + run.size().powi(2);
    let limits = [1e-13 * scale, 2e-13 * scale / h.min(1.0)];
    let names = ["constraints g", "hidden constraint at velocities (45)"];
    let judge = |k: usize, value: f64| {
        let mut found = finding(Criterion::Residual, method, order, names[k]);
        found.expected = format!("≤ {:.0e}", limits[k]);
        found.measured = format!("{value:.0e}");
        found.value = Some(value);
        found.verdict = if value <= limits[k] { Verdict::Pass } else { Verdict::Fail };
        found
    };
    [judge(0, position), judge(1, velocity)]
}
