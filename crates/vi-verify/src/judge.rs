//! Whether a measured number agrees with the expected property.

use super::certificate::{Criterion, Finding, Study, Verdict};
use super::convergence::{ErrorSequence, StudiedQuantity};
use super::frequency::RESOLVED;
use super::growth::{Growth, NoGrowth, growth};
use super::measure::{ConstraintResiduals, LongRun};
use super::order::{NoOrder, ObservedOrder};
use super::output::{Compared, LEAST_ORDER};
use super::round_off::round_off;
use super::subject::SteppingMethod;
use super::trend::{NEGLIGIBLE, Trend, WIDENING, trend};
use vi_core::Composition;

/// Observed orders may miss their nominal value by this.
pub const ORDER_TOLERANCE: f64 = 0.2;
/// The same of orders above 8, as a part of them: one halving is all that double precision has.
/// Schemes that reverse have even orders, so that 14 and 18 are excluded.
pub const HIGH_ORDER_TOLERANCE: f64 = 0.05;
/// Halvings below which a slope that misses the nominal order by less than [`ROUGH`] decides
/// nothing.
const SHORT: f64 = 2.5;
/// Part of the nominal order by which such a slope may miss it: between neighbouring even orders.
const ROUGH: f64 = 0.125;
/// Orders that are known to be 1 are at least this.
pub const FIRST_ORDER: f64 = 1.0 - 2.0 * ORDER_TOLERANCE;
/// Momentum maps stay below this times `ε √N`, however they grow.
pub const MOMENTUM_CAP: f64 = 1e3;
/// The symplectic form may change by this, relative to its terms: what differences of real steps
/// resolve.
pub const FORM_TOLERANCE: f64 = 1e-9;
/// Exponents of condition numbers may be off by this.
pub const EXPONENT_TOLERANCE: f64 = 0.2;
/// Steps below which a secular drift of the energy or of a momentum map cannot be distinguished
/// from the motion itself.
pub const LEAST_TREND_STEPS: u64 = 8000;

/// By how much an observed order may miss its nominal value.
pub(super) fn order_tolerance(order: u32) -> f64 {
    if order > 8 { HIGH_ORDER_TOLERANCE * f64::from(order) } else { ORDER_TOLERANCE }
}

/// A number with a power of ten; `0` for zero.
#[must_use]
pub fn scientific(value: f64, digits: usize) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.digits$e}") }
}

/// Sub-steps of a step; those of a Galerkin scheme are its control points.
pub(super) fn sub_steps(method: SteppingMethod, order: u32) -> u64 {
    match method {
        SteppingMethod::Galerkin(_) => u64::from(order / 2),
        _ => Composition::of_order(order).map_or(1, |c| c.gammas().len() as u64),
    }
}

/// The order of a quantity: nominal, except for multipliers that are known to be of first order.
pub(super) fn judge_order(
    method: SteppingMethod,
    order: u32,
    curve: &ErrorSequence,
    study: &Study,
) -> Finding {
    let mut found = Finding::new(Criterion::Order, method, order, curve.quantity.name(method));
    let variational = method.is_variational();
    let first_order = match curve.quantity {
        StudiedQuantity::StartMultiplier if variational => {
            "(47) has one neighbouring step only: it is of first order"
        }
        StudiedQuantity::StartMultiplier => "there is no preceding step to take the mean with",
        StudiedQuantity::OtherMultiplier if !variational => {
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
                *p >= FIRST_ORDER
            } else {
                (p - nominal).abs() <= order_tolerance(order)
            };
            let halvings = (range[0].step / range[range.len() - 1].step).log2();
            // over few halvings a slope is rough, but tells even orders apart
            let rough = halvings < SHORT && (p - nominal).abs() < ROUGH * nominal;
            found.verdict = match (holds, known) {
                (false, false) if rough => Verdict::Inconclusive,
                (true, false) => Verdict::Pass,
                (true, true) if *p < 2.0 - ORDER_TOLERANCE => Verdict::KnownDeviation,
                (true, true) => Verdict::Pass,
                (false, _) => Verdict::Fail,
            };
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
            found.measured = format!("exact ({})", scientific(*largest, 0));
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
        Err(refused @ NoOrder::TooFew { .. }) if order >= 8 => {
            found.measured = "no order can be read".into();
            found.reason = format!("{refused}: double precision has no room for this order here");
            found.verdict = Verdict::NotApplicable; // one of a lower order has room, and fails
        }
        Err(refused) => {
            found.measured = "no order can be read".into();
            found.reason = refused.to_string();
        }
    }
    found
}

/// What is reported against the equations of motion: differences of second order, or round-off.
pub(super) fn judge_output(method: SteppingMethod, order: u32, compared: &Compared) -> Finding {
    let mut found = Finding::new(Criterion::Output, method, order, compared.output.name());
    let (coarse, fine) = (compared.errors[0], compared.errors[compared.errors.len() - 1]);
    found.expected = compared.expected();
    match compared.order() {
        Err(NoOrder::Exact { largest }) => {
            found.measured = scientific(largest, 0);
            found.verdict = Verdict::Pass;
        }
        Err(refused @ NoOrder::RoundOff { largest }) => {
            found.measured = scientific(largest, 0);
            found.reason = refused.to_string();
        }
        Err(refused) => {
            found.measured = "not a number".into();
            found.reason = refused.to_string();
            found.verdict = Verdict::Fail;
        }
        Ok(slope) => {
            found.measured =
                format!("order {slope:.2} ({:.0e} … {:.0e})", coarse.error, fine.error);
            found.value = Some(slope);
            let least = LEAST_ORDER * f64::from(compared.nominal);
            let holds = slope >= least && compared.output.may_converge();
            found.verdict = if holds { Verdict::Pass } else { Verdict::Fail };
        }
    }
    found
}

/// The energy of a conservative system: a band for variational schemes, round-off for
/// energy–momentum schemes.
pub(super) fn judge_energy(method: SteppingMethod, order: u32, run: &LongRun) -> Finding {
    let mut found = Finding::new(Criterion::Energy, method, order, "H_d");
    if run.nature.nonholonomic {
        found.verdict = Verdict::NotApplicable;
        found.reason =
            "constraints on velocities: no theorem bounds the energy, it is recorded alone".into();
        return found;
    }
    if !run.nature.conservative {
        found.verdict = Verdict::NotApplicable;
        found.reason = "forces or prescribed motions do work".into();
        return found;
    }
    let whole = run;
    let run = &whole.of_last_map();
    let last_map = whole.times.get(whole.since).filter(|_| whole.since > 0).copied();
    let trend = match trend(&run.energies(), &run.shadow_energies()) {
        Ok(trend) => trend,
        Err(refused) => {
            let since = if whole.since > 0 { " since internal variables changed last" } else { "" };
            found.reason = format!("{refused}{since}");
            return found;
        }
    };
    let size = run.energy_size();
    let relative = if size > 0.0 { trend.width() / size } else { 0.0 };
    let round_off = round_off(run.steps * sub_steps(method, order), 10.0);
    let conserved = relative <= round_off;
    let variational = method.is_variational();
    found.expected = match variational {
        true => format!("medians of H or H̃ within {:.0} % of the band", 100.0 * NEGLIGIBLE),
        false => "conserved to round-off".into(),
    };
    found.value = Some(if trend.width() > 0.0 { trend.variation / trend.width() } else { 0.0 });
    if conserved {
        found.value = Some(relative);
        found.measured = format!("conserved to {}", scientific(relative, 0));
        found.verdict = Verdict::Pass;
        return found;
    }
    found.measured = band(&trend, relative, run);
    if let Some(t) = last_map {
        found.measured += &format!(", from t = {t:.3} s on, since internal variables changed last");
    }
    // the random walk of round-off is in the medians, too
    let stays = trend.is_bounded() || trend.variation <= round_off * size;
    found.verdict = if variational && stays { Verdict::Pass } else { Verdict::Fail };
    let resolution = run.resolution().unwrap_or(f64::INFINITY);
    if !variational {
        return found;
    }
    if run.steps < LEAST_TREND_STEPS {
        found.verdict = Verdict::Inconclusive;
        found.reason = format!("fewer than {LEAST_TREND_STEPS} steps");
    } else if resolution > RESOLVED {
        found.verdict = Verdict::NotApplicable;
        found.reason = format!("h ω_max = {resolution:.1} is above {RESOLVED}");
    } else if !stays {
        found.reason = format!(
            "the medians change by {:.1e} J, the second half is {:.2} times as far from the median as the first \
             (at most {WIDENING}){}",
            trend.variation,
            trend.widening,
            at_once(run, trend.variation)
        );
    }
    found
}

/// Where most of what the medians change by comes at once: a force that jumps, for example.
fn at_once(run: &LongRun, variation: f64) -> String {
    let jump = run.largest_jump().filter(|(jump, _)| *jump >= 0.5 * variation);
    jump.map_or(String::new(), |(jump, times)| {
        let (from, to) = (times.start, times.end);
        format!("; {jump:.1e} J of it from t = {from} s to {to} s: does a force jump there?")
    })
}

/// The band of `H_d`, what is judged, and the condition under which it is.
fn band(trend: &Trend, relative: f64, run: &LongRun) -> String {
    let which = if trend.of_shadow { "H̃" } else { "H" };
    let resolution = run.resolution().map_or(String::new(), |r| format!(", h ω = {r:.2}"));
    let medians = 100.0 * trend.variation / trend.width();
    format!(
        "H ± {:.0e}, medians of {which} within {medians:.1} % of it{resolution}",
        0.5 * relative
    )
}

pub(super) fn judge_momentum(
    method: SteppingMethod,
    order: u32,
    name: &str,
    run: &LongRun,
    samples: &[f64],
) -> Finding {
    let mut found = Finding::new(Criterion::Momentum, method, order, name);
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
            let root = f64::EPSILON * ((run.steps * sub_steps(method, order)) as f64).sqrt();
            // below ε√N the exponent is that of single last bits, in few steps it scatters
            let unbiased = growth.is_unbiased() || run.steps < LEAST_TREND_STEPS;
            let holds = drift <= root || (unbiased && drift <= MOMENTUM_CAP * root);
            found.verdict = if holds { Verdict::Pass } else { Verdict::Fail };
        }
    }
    found
}

pub(super) fn judge_residual(method: SteppingMethod, order: u32, run: &LongRun) -> Finding {
    let ConstraintResiduals { position, .. } = run.residuals();
    let limit = 1e-13 * (1.0 + run.size().powi(2));
    let mut found = Finding::new(Criterion::Residual, method, order, "constraints g");
    found.expected = format!("≤ {limit:.0e}");
    found.measured = scientific(position, 0);
    found.value = Some(position);
    found.verdict = if position <= limit { Verdict::Pass } else { Verdict::Fail };
    found
}
