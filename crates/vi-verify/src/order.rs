//! The observed order of convergence.
//!
//! ```text
//! e(h) ≈ C h^p               p: slope of log₂ e against log₂ h by least squares
//! e(h) ≈ C h^p (1 + c h²)    where that line is not straight: schemes that reverse have even expansions
//! ```
//! Only a part of a convergence study shows the order. At the coarse end higher terms still count
//! (pre-asymptotic) or the error is as large as the motion; at the fine end it is round-off or the
//! error of the reference (plateau). The estimator takes the finest straight stretch of at least
//! four halvings between the two, and returns an error where there is none. Double precision does
//! not offer four halvings to order 8, a fall by `4·10⁹` between an error that is asymptotic and
//! round-off; there the longest straight stretch of at least two is taken, and of one from order 8
//! on ([`longest_observed_order`]).

use super::fit::{expansion, power_law};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// An error at a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorAt {
    /// `h`, s.
    pub step: f64,
    /// `e(h)`, in the unit of the quantity.
    pub error: f64,
}

/// What is known about the quantity whose error is studied.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct QuantityScale {
    /// Its size: an error of half of it is saturated.
    pub size: f64,
    /// Round-off, or the uncertainty of the reference: errors below are not of the scheme.
    pub floor: f64,
}

/// What a study must offer: `h` over a factor of `2^HALVINGS`.
pub const HALVINGS: u32 = 4;
/// Largest distance of a point from the straight line, in binary digits.
pub const STRAIGHT: f64 = 0.5;
/// A reference that is less certain than this part of the quantity is of no use.
const UNCERTAIN: f64 = 1e-3;
/// Errors above this many floors are of the scheme, even where they stop to fall.
const ABOVE: f64 = 1e3;
/// Round-off of a quantity that divides by `h²` stays below this.
pub(crate) const AMPLIFIED: f64 = 1e-6;
/// A straight line over a single halving has at least as many points.
const LEAST_POINTS: usize = 4;
/// Errors below this many floors are known too badly for a fit.
pub(crate) const CLEAR: f64 = 10.0;
/// A stretch this straight is taken for asymptotic.
const ASYMPTOTIC: f64 = 0.1;
/// A stretch less straight than this is fitted with the next term of the expansion, too.
const CURVED: f64 = 0.05;
/// Shorter stretches have few points: what is fitted to them has to be better.
const SHORT: f64 = 3.0 - 1e-9;
/// A next term larger than this, in binary digits, is no small one; over shorter stretches, half of
/// it.
const SMALL_TERM: f64 = 1.5;
/// Shorter stretches have few points, and must be this straight.
const SHORT_ASYMPTOTIC: f64 = 0.06;

/// An order that could be read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObservedOrder {
    /// The order `p`.
    pub order: f64,
    /// Largest distance of a point from the fit, in binary digits.
    pub spread: f64,
    /// What the next term of the expansion adds at the coarsest of these points, in binary digits;
    /// 0 where it was not needed.
    pub correction: f64,
    /// The points it was read from, counted from the coarsest step.
    pub points: Range<usize>,
}

impl ObservedOrder {
    /// Whether all points lie on the fit to a tenth of a binary digit.
    #[must_use]
    pub fn is_straight(&self) -> bool {
        self.spread <= ASYMPTOTIC
    }
}

/// Why no order can be read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum NoOrder {
    /// An error or a step is not a positive number, or the steps do not decrease.
    #[error("a step or an error is not a number, or the steps do not decrease")]
    NotNumbers,
    /// All errors are at round-off.
    #[error("the error is at round-off at every step (largest {largest:.1e})")]
    Exact {
        /// The largest error.
        largest: f64,
    },
    /// What errors are measured against is not known well enough.
    #[error(
        "the reference solution is uncertain by {floor:.0e} of the quantity: the motion is chaotic or \
         not resolved by these steps"
    )]
    Uncertain {
        /// Its uncertainty, relative.
        floor: f64,
    },
    /// The errors are as large as the quantity.
    #[error(
        "errors are as large as the motion itself at {points} of {of} steps: the motion is chaotic or \
         not resolved by these steps"
    )]
    Saturated {
        /// Steps with such an error.
        points: usize,
        /// Steps in all.
        of: usize,
    },
    /// Fewer halvings than needed are left between the coarse end and the plateau.
    #[error(
        "only {halvings:.1} halvings lie between the coarse end and the plateau at {plateau:.1e}"
    )]
    TooFew {
        /// Halvings that are left.
        halvings: f64,
        /// Where the plateau begins: the smallest error, or the floor.
        plateau: f64,
    },
    /// The errors rise and fall.
    #[error("the error does not decrease from step to step")]
    NotMonotone,
    /// No stretch is asymptotic.
    #[error(
        "the error is not proportional to a power of the step (deviation {spread:.1} binary digits): the \
         motion is not resolved, or the steps are not in the asymptotic range"
    )]
    NotAsymptotic {
        /// Distance of a point from the straightest line.
        spread: f64,
    },
    /// The error is round-off that grows as the step shrinks.
    #[error("the error is round-off, which grows as the step shrinks (largest {largest:.1e})")]
    RoundOff {
        /// The largest error.
        largest: f64,
    },
    /// The error does not go to zero.
    #[error("the error hardly decreases: order {order:.2}")]
    NoConvergence {
        /// The slope found.
        order: f64,
    },
}

/// Reads the order from errors at decreasing steps, over [`HALVINGS`] halvings.
///
/// # Errors
/// [`NoOrder`].
pub fn observed_order(errors: &[ErrorAt], scale: QuantityScale) -> Result<ObservedOrder, NoOrder> {
    observed_order_over(errors, scale, HALVINGS)
}

/// The order over the longest asymptotic stretch of four, three … `least` halvings; where there is
/// none, as [`observed_order`].
///
/// # Errors
/// [`NoOrder`] where nothing can be read.
pub fn longest_observed_order(
    errors: &[ErrorAt],
    scale: QuantityScale,
    least: u32,
) -> Result<ObservedOrder, NoOrder> {
    let best = observed_order(errors, scale);
    if best.as_ref().is_ok_and(ObservedOrder::is_straight) {
        return best;
    }
    let straight = |wanted: u32| {
        let limit = if f64::from(wanted) < SHORT { SHORT_ASYMPTOTIC } else { ASYMPTOTIC };
        // where steps are close, two halvings of four points lie at the coarse end
        let few =
            |found: &ObservedOrder| least < 2 && wanted >= 2 && found.points.len() <= LEAST_POINTS;
        let found = observed_order_over(errors, scale, wanted).ok()?;
        (found.spread <= limit && !few(&found)).then_some(found)
    };
    (least..HALVINGS).rev().find_map(straight).map_or(best, Ok)
}

/// The same as [`observed_order`] over another number of halvings.
///
/// # Errors
/// [`NoOrder`].
pub fn observed_order_over(
    errors: &[ErrorAt],
    scale: QuantityScale,
    wanted: u32,
) -> Result<ObservedOrder, NoOrder> {
    let numbers = errors.iter().all(|e| e.step > 0.0 && e.step.is_finite() && e.error >= 0.0);
    let decreasing = errors.windows(2).all(|e| e[0].step > e[1].step);
    if !(numbers && decreasing) || errors.is_empty() || !errors.iter().all(|e| e.error.is_finite())
    {
        return Err(NoOrder::NotNumbers);
    }
    if scale.floor > UNCERTAIN * scale.size {
        return Err(NoOrder::Uncertain { floor: scale.floor / scale.size });
    }
    let largest = errors.iter().map(|e| e.error).fold(0.0, f64::max);
    let low = |e: &ErrorAt| e.error <= CLEAR * scale.floor;
    // exact at the coarse end, and what grows from there as the step shrinks is round-off
    let law = power_law(errors.iter().map(|e| [e.step, e.error]));
    let grows = largest <= AMPLIFIED && law.is_some_and(|law| law.exponent < -0.5);
    if errors.iter().all(low) || (low(&errors[0]) && grows) {
        return Err(NoOrder::Exact { largest });
    }
    let saturated = |e: &ErrorAt| e.error >= 0.5 * scale.size;
    let start = errors.iter().rposition(saturated).map_or(0, |k| k + 1);
    let end = plateau(errors, start, scale.floor);
    let halvings = |range: Range<usize>| match range.len() {
        0 | 1 => 0.0,
        _ => (errors[range.start].step / errors[range.end - 1].step).log2(),
    };
    let needed = f64::from(wanted) - 1e-9;
    if halvings(start..end) < needed {
        if halvings(start..errors.len()) < needed && halvings(0..errors.len()) >= needed {
            return Err(NoOrder::Saturated { points: start, of: errors.len() });
        }
        let smallest = errors.iter().map(|e| e.error).fold(f64::INFINITY, f64::min);
        let plateau = smallest.max(scale.floor);
        return Err(NoOrder::TooFew { halvings: halvings(start..end), plateau });
    }
    // errors that stay where they are, far above the floor, are no plateau: no convergence
    let finest = (start..end).rfind(|&k| halvings(k..end) >= needed).unwrap_or(start);
    let tail = &errors[finest..end];
    if tail.iter().all(|e| e.error > ABOVE * scale.floor) {
        let law = power_law(tail.iter().map(|e| [e.step, e.error]));
        match law {
            Some(law) if law.exponent < -0.5 && largest <= AMPLIFIED => {
                return Err(NoOrder::RoundOff { largest });
            }
            Some(law) if law.exponent < 0.5 => {
                return Err(NoOrder::NoConvergence { order: law.exponent });
            }
            _ => {}
        }
    }
    // the shortest stretch of enough halvings from every coarse end
    let stretches = (start..end).filter_map(|from| {
        let points = if wanted < 2 { LEAST_POINTS } else { 2 };
        (from + points..=end).find(|&to| halvings(from..to) >= needed).map(|to| from..to)
    });
    let falls =
        |range: &Range<usize>| errors[range.clone()].windows(2).all(|e| e[0].error > e[1].error);
    let fitted: Vec<ObservedOrder> =
        stretches.filter(falls).filter_map(|points| fitted(errors, points, scale.floor)).collect();
    // what counts is what happens at fine steps: the finest straight stretch, else the straightest
    let straight = fitted.iter().rfind(|o| o.is_straight());
    let best = straight.or_else(|| fitted.iter().min_by(|a, b| a.spread.total_cmp(&b.spread)));
    match best.cloned() {
        None => Err(NoOrder::NotMonotone),
        Some(found) if found.spread > STRAIGHT => {
            Err(NoOrder::NotAsymptotic { spread: found.spread })
        }
        Some(found) if found.order < 0.5 => Err(NoOrder::NoConvergence { order: found.order }),
        Some(found) => Ok(found),
    }
}

/// The fit to a stretch, with the next term of the expansion where that makes it straight.
fn fitted(errors: &[ErrorAt], points: Range<usize>, floor: f64) -> Option<ObservedOrder> {
    let stretch: Vec<[f64; 2]> = errors[points.clone()].iter().map(|e| [e.step, e.error]).collect();
    let law = power_law(stretch.iter().copied())?;
    let short = (stretch[0][0] / stretch[stretch.len() - 1][0]).log2() < SHORT;
    let (gain, most) = if short { (0.25, 0.5 * SMALL_TERM) } else { (0.75, SMALL_TERM) };
    let curved = expansion(&stretch, floor).filter(|found| {
        law.spread > CURVED
            && found.spread <= (gain * law.spread).min(ASYMPTOTIC)
            && found.correction.abs() <= most
    });
    Some(match curved {
        Some(found) => ObservedOrder {
            order: found.exponent,
            spread: found.spread,
            correction: found.correction,
            points,
        },
        None => ObservedOrder { order: law.exponent, spread: law.spread, correction: 0.0, points },
    })
}

/// Where the plateau begins: at the first error that is not clearly above the floor, or where the
/// errors stop falling at the fine end although they fell before.
fn plateau(errors: &[ErrorAt], start: usize, floor: f64) -> usize {
    let mut end = errors.iter().position(|e| e.error <= CLEAR * floor).unwrap_or(errors.len());
    let slope = |k: usize| {
        (errors[k - 1].error / errors[k].error).log2()
            / (errors[k - 1].step / errors[k].step).log2()
    };
    let fell = (start + 1..end).any(|k| slope(k) > 1.5);
    let all = end;
    // at the fine end errors stay near the floor, or rise: round-off over a power of h
    let low = |k: usize| {
        errors[k].error <= ABOVE * floor || (slope(k) < -0.5 && errors[k].error <= AMPLIFIED)
    };
    while fell && end > start + 1 && slope(end - 1) < 0.5 && low(end - 1) {
        end -= 1;
    }
    // noise that grows as the step shrinks need not grow from point to point
    if let Some(lowest) = (start..end).min_by(|&a, &b| errors[a].error.total_cmp(&errors[b].error))
    {
        let tail = &errors[lowest..end];
        let law = power_law(tail.iter().map(|e| [e.step, e.error]));
        let grows = law.is_some_and(|law| law.exponent < -0.5);
        if fell && tail.len() > 2 && grows && tail.iter().all(|e| e.error <= AMPLIFIED) {
            end = lowest + 1;
        }
    }
    // the last point above a plateau is half of it
    if end < all && end > start + 2 && slope(end - 1) < 0.75 * slope(end - 2) {
        end -= 1;
    }
    end.max(start)
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: QuantityScale = QuantityScale { size: 1.0, floor: 1e-14 };

    fn study(steps: usize, error: impl Fn(f64) -> f64) -> Vec<ErrorAt> {
        let step = |k: usize| 0.5_f64.powi(i32::try_from(k).unwrap());
        (0..steps).map(|k| ErrorAt { step: step(k), error: error(step(k)) }).collect()
    }

    fn order(steps: usize, error: impl Fn(f64) -> f64) -> Result<ObservedOrder, NoOrder> {
        observed_order(&study(steps, error), UNIT)
    }

    /// Numbers in (−1, 1) without a pattern.
    fn noise(h: f64) -> f64 {
        (h.log2() * 12.9898 + 4.1).sin() * 43_758.545_3 % 1.0
    }

    #[test]
    fn pure_powers_are_found() {
        for p in [1.0, 2.0, 4.0, 6.0, 8.0] {
            let found = order(6, |h| 0.3 * h.powf(p)).unwrap();
            assert!((found.order - p).abs() < 1e-10 && found.spread < 1e-10, "{p}: {found:?}");
        }
    }

    /// The momentum of an energy–momentum scheme of order 4: `v = (2/h)Δq − v_n` amplifies
    /// round-off.
    #[test]
    fn noise_that_grows_as_the_step_shrinks_is_left_out() {
        let measured = [
            1.405e-5, 2.807e-6, 8.915e-7, 1.766e-7, 5.592e-8, 1.105e-8, 3.499e-9, 6.912e-10,
            2.187e-10, 4.319e-11, 7.007e-11, 1.082e-10, 1.012e-10, 1.021e-10, 3.574e-10, 4.810e-10,
            5.375e-10, 7.705e-10,
        ];
        let step = |k: usize| {
            0.00625
                * if k.is_multiple_of(2) { 1.0 } else { 4.0 / 3.0 }
                * 0.5_f64.powi((k as i32 + 1) / 2)
        };
        let errors: Vec<ErrorAt> =
            (0..measured.len()).map(|k| ErrorAt { step: step(k), error: measured[k] }).collect();
        let found = observed_order(&errors, UNIT).unwrap();
        println!("{found:?}");
        assert!((found.order - 4.0).abs() < 0.02 && found.points.end <= 10, "{found:?}");
    }

    #[test]
    fn the_pre_asymptotic_range_and_the_plateau_are_left_out() {
        // order 4 with a large term of order 8 at coarse steps, and round-off of 1e-13 at fine ones
        let error = |h: f64| 0.01 * h.powi(4) + 0.2 * h.powi(8) + 1e-13 * (1.0 + 0.5 * noise(h));
        let found = order(14, error).unwrap();
        println!("{found:?}");
        assert!((found.order - 4.0).abs() < 0.1, "{found:?}");
        assert!(found.points.start >= 1 && found.points.end < 12, "{found:?}");
    }

    #[test]
    fn the_next_term_of_the_expansion_is_fitted_where_it_counts() {
        let found = order(5, |h| 1e-3 * h.powi(8) * (1.0 + 0.7 * h * h)).unwrap();
        println!("{found:?}");
        assert!((found.order - 8.0).abs() < 0.1 && found.correction > 0.4, "{found:?}");
        let found = order(5, |h| 1e-3 * h.powi(4) * (1.0 - 0.3 * h * h)).unwrap();
        assert!((found.order - 4.0).abs() < 0.1 && found.correction < -0.3, "{found:?}");
    }

    #[test]
    fn where_there_are_no_four_halvings_the_longest_straight_stretch_counts() {
        let longest = |errors: &[ErrorAt]| longest_observed_order(errors, UNIT, 2);
        // eight halvings, of which the first is not asymptotic and three are above the plateau
        let errors = study(9, |h| 1e-4 * h.powi(8) * (1.0 + 30.0 * h.powi(8)) + 2e-15);
        let found = longest(&errors).unwrap();
        println!("{found:?}");
        let halvings = found.points.len() - 1;
        assert!((found.order - 8.0).abs() < 0.1 && (2..=3).contains(&halvings), "{found:?}");
        let found = longest(&study(6, |h| 0.3 * h * h)).unwrap();
        assert_eq!(found.points.len(), 5, "{found:?}");
        let refused = longest(&study(9, |h| 1e-10 * h.powi(8) + 3e-14)).unwrap_err();
        assert!(matches!(refused, NoOrder::TooFew { .. }), "{refused}");
    }

    #[test]
    fn a_hidden_first_order_error_is_not_taken_for_a_plateau() {
        // looks like order 2 at coarse steps; what stays is order 1
        let found = order(16, |h| 0.1 * h * h + 1e-4 * h).unwrap();
        assert!(found.order < 1.3, "{found:?}");
        let found = order(7, |h| 0.1 * h * h + 1e-1 * h).unwrap();
        assert!((found.order - 1.0).abs() < 0.2, "{found:?}");
    }

    #[test]
    fn halvings_count_not_points() {
        let by_root_two = |count: i32| -> Vec<ErrorAt> {
            let step = |k: i32| 2.0_f64.powf(-0.5 * f64::from(k));
            (0..count).map(|k| ErrorAt { step: step(k), error: 0.1 * step(k).powi(2) }).collect()
        };
        let refused = observed_order(&by_root_two(8), UNIT).unwrap_err();
        assert!(matches!(refused, NoOrder::TooFew { .. }), "{refused}");
        let found = observed_order(&by_root_two(9), UNIT).unwrap();
        assert!((found.order - 2.0).abs() < 1e-9 && found.points.len() == 9, "{found:?}");
    }

    #[test]
    fn too_few_halvings_are_refused() {
        let refused = order(4, |h| h.powi(2)).unwrap_err();
        assert!(matches!(refused, NoOrder::TooFew { halvings, .. } if halvings < 3.5), "{refused}");
        // eight halvings, but only three above the plateau
        let refused = order(9, |h| 1e-5 * h.powi(8) + 1e-13).unwrap_err();
        assert!(matches!(refused, NoOrder::TooFew { .. }), "{refused}");
        assert!(refused.to_string().contains("halvings"), "{refused}");
    }

    #[test]
    fn round_off_alone_is_refused() {
        let refused = order(8, |h| 3e-15 * (1.0 + 0.9 * noise(h))).unwrap_err();
        assert!(matches!(refused, NoOrder::Exact { .. }), "{refused}");
    }

    #[test]
    fn chaos_is_refused() {
        let refused = order(8, |h| 0.8 + 0.2 * noise(h)).unwrap_err();
        assert!(matches!(refused, NoOrder::Saturated { points: 8, of: 8 }), "{refused}");
        let errors = study(9, |h| 0.2 + 0.15 * noise(h));
        let refused = observed_order(&errors, QuantityScale { size: 1.0, floor: 0.1 }).unwrap_err();
        assert!(matches!(refused, NoOrder::Uncertain { .. }), "{refused}");
        // up and down just above round-off
        let errors = study(9, |h| 2e-12 + 1e-12 * noise(h));
        let refused = observed_order(&errors, UNIT).unwrap_err();
        assert!(matches!(refused, NoOrder::NotMonotone), "{refused}");
    }

    #[test]
    fn roughness_is_refused() {
        // falls in stairs: a force with a jump that steps hit or miss
        let stairs = |h: f64| 0.1 * 8.0_f64.powf((h.log2() / 3.0).floor()) * (1.0 + 0.01 * h);
        let refused = order(9, stairs).unwrap_err();
        assert!(
            matches!(refused, NoOrder::NotAsymptotic { .. } | NoOrder::NotMonotone),
            "{refused}"
        );
    }

    #[test]
    fn an_error_that_stays_is_refused() {
        let refused = order(8, |h| 0.1 + 0.01 * h).unwrap_err();
        assert!(matches!(refused, NoOrder::NoConvergence { .. }), "{refused}");
        // ε/h² of a multiplier whose error vanishes
        let refused = order(8, |h| 1e-12 / h.powi(2)).unwrap_err();
        assert!(matches!(refused, NoOrder::RoundOff { .. }), "{refused}");
        // falls first, then stays: half of a multiplier
        let refused = order(12, |h| (0.3 - h).abs() + 1e-9).unwrap_err();
        assert!(matches!(refused, NoOrder::NoConvergence { .. }), "{refused}");
    }

    #[test]
    fn nan_is_refused() {
        let with_nan = |h: f64| if h < 0.1 { f64::NAN } else { h };
        assert_eq!(order(8, with_nan).unwrap_err(), NoOrder::NotNumbers);
        assert_eq!(observed_order(&[], UNIT).unwrap_err(), NoOrder::NotNumbers);
        let rising: Vec<ErrorAt> = study(8, |h| h).into_iter().rev().collect();
        assert_eq!(observed_order(&rising, UNIT).unwrap_err(), NoOrder::NotNumbers);
    }
}
