//! Convergence studies over growing horizons, and the one in which a quantity is read best.
//!
//! Over a short time the errors of a high order reach round-off before four halvings are over; over
//! twice the time they are larger.

use super::certificate::Study;
use super::convergence::{ErrorSequence, HIGH, Horizon, ReferenceMotion, StudiedQuantity, study};
use super::judge::order_tolerance;
use super::order::{HALVINGS, NoOrder, ObservedOrder, QuantityScale, longest_observed_order};
use super::subject::{SteppingMethod, Subject};

/// Halvings that an order is read over at least, and those that no longer horizon is tried for:
/// little lies between the coarse end of high orders and round-off.
fn halvings(order: u32) -> (u32, u32) {
    match order {
        0..6 => (HALVINGS, HALVINGS),
        6..8 => (2, HALVINGS - 1),
        8 => (1, 2),
        _ => (1, 1),
    }
}

/// Horizons are doubled this often where errors reach round-off too early.
fn extensions(order: u32) -> usize {
    if order > HIGH { 5 } else { 3 }
}

/// A horizon with its doublings; their references are found once.
pub(super) struct Horizons<'a> {
    subject: &'a dyn Subject,
    first: Horizon,
    references: Vec<Result<ReferenceMotion, String>>,
}

impl<'a> Horizons<'a> {
    /// From the first horizon.
    pub(super) fn new(subject: &'a dyn Subject, first: Horizon) -> Self {
        Self { subject, first, references: Vec::new() }
    }

    /// The horizon doubled `extension` times, with its reference.
    fn reference(&mut self, extension: usize) -> (Horizon, &Result<ReferenceMotion, String>) {
        let Horizon { end, coarsest, finest } = self.first;
        let horizon = |k: usize| Horizon { end: end * (1_u32 << k) as f64, coarsest, finest };
        while self.references.len() <= extension {
            let next = ReferenceMotion::find(self.subject, horizon(self.references.len()));
            self.references.push(next);
        }
        (horizon(extension), &self.references[extension])
    }

    /// Studies of a method, over longer and longer times until every quantity could be read that
    /// can. At least one, or why there is none.
    pub(super) fn studies(
        &mut self,
        method: SteppingMethod,
        order: u32,
    ) -> Result<Vec<Study>, String> {
        let mut found: Vec<Study> = Vec::new();
        for extension in 0..=extensions(order) {
            let subject = self.subject;
            let (horizon, reference) = self.reference(extension);
            let studied = reference.as_ref().map_err(String::clone).and_then(|reference| {
                let curves = study(subject, method, order, horizon, reference)?;
                Ok((curves, reference.origin.clone()))
            });
            let (mut curves, reference) = match studied {
                Ok(studied) => studied,
                Err(error) if extension == 0 => return Err(error),
                Err(_) => break,
            };
            curves.iter_mut().for_each(|curve| fewer_halvings(curve, halvings(order).0));
            found.push(Study { method, order, end: horizon.end, reference, curves });
            if !a_longer_horizon_helps(&found) {
                break;
            }
        }
        Ok(found)
    }
}

/// The study in which the order of a quantity is read best: over enough halvings and straight, then
/// the straightest; else the first.
pub(super) fn clearest(
    found: &[Study],
    quantity: StudiedQuantity,
) -> Option<(&Study, &ErrorSequence)> {
    let with_curve = |s| -> Option<(&Study, &ErrorSequence)> { Some((s, curve_of(s, quantity)?)) };
    let rank = |(study, curve): &(&Study, &ErrorSequence)| {
        let observed = curve.observed.as_ref().ok()?;
        let clear = long_enough(observed, curve, study) && observed.is_straight();
        Some((!clear, observed.spread))
    };
    let readable = found.iter().filter_map(with_curve).filter_map(|c| Some((rank(&c)?, c)));
    let best = readable.min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    best.map(|(_, curve)| curve).or_else(|| found.first().and_then(with_curve))
}

/// The error of a quantity that is as large as the quantity at the finest step of a study in which
/// `q` has its order, and for multipliers, which need smaller steps, `p`.
pub(super) fn saturated(found: &[Study], quantity: StudiedQuantity) -> Option<f64> {
    let resolved: &[StudiedQuantity] = match quantity {
        StudiedQuantity::Multiplier | StudiedQuantity::OtherMultiplier => {
            &[StudiedQuantity::Position, StudiedQuantity::Momentum]
        }
        _ => &[StudiedQuantity::Position],
    };
    let has_order = |study: &Study, quantity| {
        let observed = curve_of(study, quantity).and_then(|curve| curve.observed.as_ref().ok());
        observed.is_some_and(|o| {
            (o.order - f64::from(study.order)).abs() <= order_tolerance(study.order)
        })
    };
    let at_finest = |study: &Study| {
        let error = curve_of(study, quantity)?.errors.last()?.error;
        let resolved = resolved.iter().all(|quantity| has_order(study, *quantity));
        (resolved && error >= 0.5).then_some(error)
    };
    found.iter().find_map(at_finest)
}

fn curve_of(study: &Study, quantity: StudiedQuantity) -> Option<&ErrorSequence> {
    study.curves.iter().find(|c| c.quantity == quantity)
}

/// Whether a quantity was read in no study so far, and larger errors would help in the last one.
fn a_longer_horizon_helps(found: &[Study]) -> bool {
    let short = |study: &Study, curve: &ErrorSequence| match &curve.observed {
        Ok(observed) => !long_enough(observed, curve, study),
        Err(refused) => !matches!(
            refused,
            NoOrder::Saturated { .. }
                | NoOrder::NoConvergence { .. }
                | NoOrder::NotNumbers
                | NoOrder::RoundOff { .. }
                | NoOrder::Uncertain { .. }
        ),
    };
    let read = |quantity: StudiedQuantity| {
        let mut curves = found.iter().filter_map(|s| Some((s, curve_of(s, quantity)?)));
        curves.any(|(s, c)| c.observed.is_ok() && !short(s, c))
    };
    found.last().is_some_and(|s| s.curves.iter().any(|c| short(s, c) && !read(c.quantity)))
}

/// Whether an order was read over as many halvings as are wanted.
fn long_enough(observed: &ObservedOrder, curve: &ErrorSequence, study: &Study) -> bool {
    let (_, wanted) = halvings(study.order);
    let points = &curve.errors[observed.points.clone()];
    let found = (points[0].step / points[points.len() - 1].step).log2();
    found >= f64::from(wanted) - 0.1
}

/// High orders are read over the longest straight stretch of four, three … `least` halvings.
fn fewer_halvings(curve: &mut ErrorSequence, least: u32) {
    let scale = QuantityScale { size: 1.0, floor: curve.floor };
    if let Ok(observed) = longest_observed_order(&curve.errors, scale, least) {
        curve.observed = Ok(observed);
    }
}
