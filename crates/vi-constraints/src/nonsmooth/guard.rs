//! Newton's law of restitution gains energy at some impacts with friction, or with several
//! coefficients: these are then reduced.
//!
//! ```text
//! w = ½ Λ·(U⁺ + U⁻) ≤ max(0, w_0),     w_0: of the same node with all e = 0
//! ```
//! All coefficients of an island are multiplied by the largest `η < 1` for which this holds: `w`
//! depends on `η` continuously, and `w(0) = w_0`. An island: contacts that `W` couples.

use super::impulses::NodeImpulses;
use super::node_law::{Contact, Kind};
use crate::scheme::StepError;
use vi_core::bracket::Bracket;

/// Work of rounding errors, in parts of the terms of its sum.
const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// Entries of `W` that couple, in parts of the diagonal.
const COUPLED: f64 = 1e-13;
/// To which the factor `η` is known.
const FACTOR: f64 = 1e-13;
/// Most solutions of a node for it.
const SOLUTIONS: usize = 40;

/// Which island each contact belongs to.
#[derive(Debug, Default)]
pub(super) struct Islands {
    of: Vec<usize>,
}

impl Islands {
    /// From the pattern of `W`.
    pub(super) fn find(&mut self, contacts: &[Contact], W: &[f64]) {
        let Self { of } = self;
        let k = W.len().isqrt();
        of.clear();
        of.extend(0..contacts.len());
        let rows = |contact: &Contact| contact.row..contact.row + contact.law.rows();
        for a in 0..contacts.len() {
            for b in 0..a {
                let coupled = rows(&contacts[a]).any(|i| {
                    rows(&contacts[b]).any(|j| {
                        let size = W[i * k + i] * W[j * k + j];
                        W[i * k + j] * W[i * k + j] > COUPLED * COUPLED * size
                    })
                });
                let (old, new) = (of[a].max(of[b]), of[a].min(of[b]));
                if coupled && old != new {
                    of.iter_mut().filter(|own| **own == old).for_each(|own| *own = new);
                }
            }
        }
    }

    /// How many numbers of islands there are; some may have no contact.
    pub(super) fn count(&self) -> usize {
        self.of.len()
    }

    /// Reduces the restitution of an island where it would gain energy.
    pub(super) fn reduce(
        &self,
        island: usize,
        node: &mut NodeImpulses,
        settle: &mut dyn FnMut(&mut NodeImpulses) -> Result<(), StepError>,
    ) -> Result<(), StepError> {
        let own = |place: usize| self.of[place] == island;
        let impact =
            |(place, contact): (usize, &Contact)| own(place) && contact.kind == Kind::Impact;
        let any = node.contacts.iter().enumerate().any(impact);
        let (plain, rounding) = (node.work(own), ROUNDING * node.work_size());
        if !any || plain <= rounding {
            return Ok(());
        }
        let mut with = |node: &mut NodeImpulses, factor: f64| {
            for (_, contact) in node.contacts.iter_mut().enumerate().filter(|(k, _)| own(*k)) {
                contact.reduction = factor;
            }
            settle(node)?;
            Ok::<f64, StepError>(node.work(own))
        };
        let without = with(node, 0.0)?;
        let allowed = without.max(0.0);
        if plain <= allowed + rounding {
            with(node, 1.0)?;
            return Ok(());
        }
        let mut bracket = Bracket::new([0.0, without - allowed], [1.0, plain - allowed]);
        let mut at = 0.0;
        for _ in 0..SOLUTIONS {
            let Some(factor) = bracket.next(FACTOR) else { break };
            let excess = with(node, factor)? - allowed;
            at = factor;
            bracket.take(factor, if excess.abs() <= rounding { 0.0 } else { excess });
            if excess.abs() <= rounding {
                break;
            }
        }
        if at.to_bits() != bracket.low().to_bits() {
            with(node, bracket.low())?;
        }
        Ok(())
    }
}
