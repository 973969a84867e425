//! Newton's law of restitution gains energy at some impacts with friction, or with several
//! coefficients: these are then reduced. At others it has no impulses.
//!
//! ```text
//! w = ½ Λ·(U⁺ + U⁻) ≤ max(0, w_0),     w_0: of the same node with all e = 0
//! ```
//! All coefficients of an island are multiplied by the largest `η < 1` for which this holds: `w`
//! depends on `η` continuously, and `w(0) = w_0`.
//!
//! No impulses obey `U⁺ + e U⁻ ≥ 0` where friction grips what would be thrown back, as of a slide
//! in a groove, or where another contact is nearer than the way back in a step, as the second one
//! of two stops. What is hit in such an island is a contact without restitution: all of its gaps,
//! that are closed by one motion, hold then.

use super::ContactFault;
use super::impulses::NodeImpulses;
use super::node_law::{CLOSED, Contact, Kind};
use super::stepping::Stepping;
use super::unilateral::Elements;
use crate::constraints::Constraints;
use crate::discretization::Discretization;
use crate::scheme::{StepError, SubStep};
use vi_core::bracket::Bracket;
use vi_core::state::State;

/// Work of rounding errors, in parts of the terms of its sum.
const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// Work that lifts what takes part in a step of fixed length, likewise: beside what large problems
/// leave.
const LIFTED: f64 = 1e-9;
/// To which the factor `η` is known.
const FACTOR: f64 = 1e-13;
/// Most solutions of a node for it.
const SOLUTIONS: usize = 40;

impl NodeImpulses {
    /// Solves with restitution; where the impacts may yield, those of islands for which no impulses
    /// are found without.
    pub(super) fn settle_impacts<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        loop {
            match self.settle(elements, run, step, state) {
                Err(error) if self.may_yield && error.has_no_impulses() && self.yields() => {}
                outcome => return outcome,
            }
        }
    }

    /// Takes the restitution of what is hit in the island of the last fault away; whether
    /// something is.
    fn yields(&mut self) -> bool {
        let Self { contacts, islands, refused, lambda, begun, is_guarded, .. } = self;
        let mut any = false;
        for place in islands.contacts(*refused) {
            let contact = &mut contacts[*place];
            if contact.is_hit {
                any = true;
                (contact.is_plastic, contact.is_hit, contact.reduction) = (true, false, 0.0);
            }
        }
        lambda.copy_from_slice(begun);
        *is_guarded |= any;
        any
    }

    /// Why no impulses were found for the island of the last fault: that no motion opens some of
    /// its contacts, whatever their friction; `None` where one does.
    pub(super) fn wedged(&mut self, elements: &Elements) -> Option<ContactFault> {
        let Self { contacts, islands, refused, W, arrival, collision, .. } = self;
        let is_pressed = |own: &&Contact| own.law.restitution().is_some();
        let of = || islands.contacts(*refused).iter().map(|place| &contacts[*place]);
        collision.open_normals(of().filter(is_pressed), W, |i| arrival[i]);
        let mut names: Vec<&str> = Vec::new();
        for place in collision.wedged() {
            let element = of().filter(is_pressed).nth(place)?.id.element;
            let name = elements[element as usize].name();
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let element = names.join("`, `");
        (!element.is_empty()).then_some(ContactFault::Immovable { element })
    }

    /// Whether something is hit.
    pub(super) fn is_hit(&self) -> bool {
        self.contacts.iter().any(|contact| contact.is_hit)
    }

    /// Whether impulses lift what takes part though it is not closed at the node: those of an
    /// island gain energy, or a negative gap is left in a part of a step. A pair may name a feature
    /// at the end of the step alone, as of a corner that passes an edge; at the first touch, within
    /// the step, it is another one.
    pub(super) fn lifts(&self, is_part: bool) -> bool {
        let rounding = LIFTED * self.work_size();
        let has_gap = |own: &&Contact| own.law.restitution().is_some();
        let is_inside = |own: &Contact| own.gap < -CLOSED * own.size;
        let is_lifted =
            |own: &Contact| own.gap.abs() > CLOSED * own.size && self.lambda[own.row] > 0.0;
        (0..self.islands.count()).map(|island| self.islands.contacts(island)).any(|places| {
            let mut own = places.iter().map(|place| &self.contacts[*place]).filter(has_gap);
            (is_part && own.clone().any(is_inside))
                || (own.any(is_lifted) && self.work(places) > rounding)
        })
    }

    /// Restitution that would gain energy is reduced, island by island.
    pub(super) fn guard<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        if !self.contacts.iter().any(|contact| contact.kind == Kind::Impact) {
            return Ok(());
        }
        let mut own = std::mem::take(&mut self.guarded);
        let mut outcome = Ok(());
        for island in 0..self.islands.count() {
            own.clear();
            own.extend_from_slice(self.islands.contacts(island));
            if own.iter().any(|place| self.contacts[*place].kind == Kind::Impact) {
                outcome = self.reduce(&own, &mut |node| node.settle(elements, run, step, state));
            }
            if outcome.is_err() {
                break;
            }
        }
        self.is_guarded = self.contacts.iter().any(|contact| contact.reduction < 1.0);
        self.guarded = own;
        outcome
    }

    /// The part of the work of an island that the step from the node takes back, J.
    fn hidden(&self, own: &[usize]) -> f64 {
        let island = own.first().map(|place| self.islands.of(*place));
        island.map_or(0.0, |island| self.problems[island].hidden(&self.plus))
    }

    /// Reduces the restitution of an island, of these contacts, where it would gain energy.
    fn reduce(
        &mut self,
        own: &[usize],
        settle: &mut dyn FnMut(&mut Self) -> Result<(), StepError>,
    ) -> Result<(), StepError> {
        let work = |node: &Self| node.work(own) - node.hidden(own);
        let (plain, rounding) = (work(self), self.work_size());
        reduced(plain, rounding, &mut |factor| {
            own.iter().for_each(|place| self.contacts[*place].reduction = factor);
            settle(self)?;
            Ok(work(self))
        })
    }
}

/// Solves an impact `with` the largest factor `η ≤ 1` of its restitution that gains no energy;
/// `with` returns the work. `plain`: that of `η = 1`, which is solved; `size`: of its terms, J.
pub(super) fn reduced(
    plain: f64,
    size: f64,
    with: &mut dyn FnMut(f64) -> Result<f64, StepError>,
) -> Result<(), StepError> {
    let rounding = ROUNDING * size;
    if plain <= rounding {
        return Ok(());
    }
    let without = with(0.0)?;
    let allowed = without.max(0.0);
    if plain <= allowed + rounding {
        with(1.0)?;
        return Ok(());
    }
    let mut bracket = Bracket::new([0.0, without - allowed], [1.0, plain - allowed]);
    let mut at = 0.0;
    for _ in 0..SOLUTIONS {
        let Some(factor) = bracket.next(FACTOR) else { break };
        let excess = with(factor)? - allowed;
        at = factor;
        bracket.take(factor, if excess.abs() <= rounding { 0.0 } else { excess });
        if excess.abs() <= rounding {
            break;
        }
    }
    if at.to_bits() != bracket.low().to_bits() {
        with(bracket.low())?;
    }
    Ok(())
}
