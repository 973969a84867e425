//! The outer iteration: impulses by the laws at the last step, the step with those, and again.
//!
//! ```text
//! y(Λ') = ξ(Λ) + W (Λ' − Λ)          with the exact step u(Λ), solved by Newton's method
//! ```
//! is solved for `Λ'` within the sets of the laws, until `W(Λ' − Λ)` is of the size of rounding
//! errors. The residual `ξ` is that of the step itself: `W` affects the speed alone. The iteration
//! contracts by `O(hω)`.
#![allow(non_snake_case)] // W

use super::ContactFault;
use super::active_rows::{EARLY, FROZEN, Present};
use super::impulses::NodeImpulses;
use super::node_law::{Contact, SlipSpeed};
use super::stepping::Stepping;
use super::unilateral::{ContactLaw, Elements};
use crate::constraints::Constraints;
use crate::discretization::{Discretization, ObserveNode};
use crate::scheme::{StepError, SubStep};
use vi_core::contact_state::ContactId;
use vi_core::state::State;

/// Solutions of a step for one set of laws.
const ITERATIONS: usize = 60;
/// Solutions after which rates that are still reversed, or not, are taken by the usual law, and
/// contacts that are an impact in one of them and none in the next by their positions.
const UNSETTLED: usize = 30;
/// So often impulses are halved, or their change, where the step has no solution with them.
const HALVINGS: usize = 20;
/// A change of velocities that may stagnate, relative to velocities,
const STAGNATION: f64 = 1e-9;
/// and to what rounding leaves of it.
const STAGNATION_ROUNDING: f64 = 32.0;

impl NodeImpulses {
    /// The outer iteration, from the present impulses; by proximal steps alone, where it ends
    /// without a solution and those are allowed.
    pub(super) fn iterate<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        self.begun.clone_from(&self.lambda);
        let outcome = self.iterate_laws(elements, run, step, state);
        let turns = self.contacts.iter().any(|contact| contact.turns);
        match &outcome {
            Err(error) if self.may_relax && !turns && error.may_end() => {
                self.problems.iter_mut().for_each(|problem| problem.by_proximal_steps = true);
                self.lambda.clone_from(&self.begun);
                self.iterate_laws(elements, run, step, state)
            }
            _ => outcome,
        }
    }

    /// The same without.
    fn iterate_laws<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        self.begin_laws(false);
        let (mut last, mut was_exact, mut responds) = (f64::INFINITY, false, false);
        let (mut passes, mut stands, mut settled) = (0, false, false);
        for pass in 0..ITERATIONS {
            if !settled && (stands || pass == UNSETTLED) {
                self.contacts.iter_mut().for_each(Contact::settle);
                settled = true;
            }
            let is_exact = self.next_impulses(elements, run, step, state, pass)?;
            if self.contacts.is_empty() {
                return Ok(());
            }
            let speeds = self.speeds();
            let (change, rounding, _) = self.largest_change(step.h);
            let may_stagnate = (STAGNATION * speeds).max(STAGNATION_ROUNDING * rounding);
            let stagnates = was_exact && last <= may_stagnate && change >= last;
            if is_exact && (change <= rounding || stagnates) {
                self.change = change;
                return Ok(());
            }
            passes = pass + 1;
            stands = change == 0.0 && passes > EARLY;
            let mut complies = false;
            if stands && settled {
                let own = self.problems.iter_mut().take(self.islands.count());
                own.for_each(|problem| complies |= problem.comply(speeds));
                if !complies {
                    break; // the same problem would be stated again
                }
            }
            if !responds && Self::is_slow(pass, change, last) {
                responds = true;
                self.respond(run, step, state)?;
            }
            (last, was_exact) = (if complies { f64::INFINITY } else { change }, is_exact);
            std::mem::swap(&mut self.lambda, &mut self.next);
        }
        let worst = self.largest_change(step.h).2;
        self.refused = self.islands.of(worst);
        let element = self.contacts[worst].id.element;
        let fault = ContactFault::NoConvergence {
            element: elements[element as usize].name().to_owned(),
            contacts: self.contacts.len(),
            iterations: passes,
            change: last,
        };
        Err(fault.into())
    }

    /// An iteration begins, or one that ends `roughly`.
    pub(super) fn begin_laws(&mut self, roughly: bool) {
        let Self { problems, contacts, W, islands, lambda, solved_with, .. } = self;
        for (k, problem) in problems.iter_mut().enumerate().take(islands.count()) {
            problem.begin(roughly, contacts, W, islands, k);
        }
        for contact in contacts {
            (contact.changes, contact.slip_speed) = (0, SlipSpeed::Own);
        }
        solved_with.clear();
        solved_with.resize(lambda.len(), 0.0);
    }

    /// Takes the step with the present impulses; `next`: those by the laws at its end; whether all
    /// islands obey them.
    pub(super) fn next_impulses<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
        pass: usize,
    ) -> Result<bool, StepError> {
        self.try_step_near(run, step, state)?;
        if self.contacts.is_empty() {
            return Ok(true);
        }
        self.measure(elements, run, step, state);
        if pass == FROZEN {
            self.keep_slip_speeds();
        }
        let (speeds, h) = (self.speeds(), step.h);
        let Self { contacts, W, islands, minus, plus, lambda, next, problems, .. } = self;
        let mut is_exact = true;
        for (k, problem) in problems.iter_mut().enumerate().take(islands.count()) {
            let present = Present { contacts, W, islands, minus, plus, lambda, next, speeds, h };
            self.refused = k;
            problem.next_impulses(k, present, elements)?;
            is_exact &= problem.is_exact();
        }
        Ok(is_exact)
    }

    /// From now on the least speed of slip counts in laws with a compliance.
    fn keep_slip_speeds(&mut self) {
        let Self { problems, contacts, islands, .. } = self;
        for island in (0..islands.count()).filter(|island| problems[*island].is_compliant()) {
            islands.contacts(island).iter().for_each(|place| contacts[*place].keep_slip_speed());
        }
    }

    /// By how much a contact moves beside Coulomb's law at most, m/s; `None` without convex laws.
    pub(super) fn deviation(&self) -> Option<f64> {
        let problems = self.problems.iter().take(self.islands.count());
        problems.filter_map(|own| own.deviation(self.change)).reduce(f64::max)
    }

    /// Takes the step with the present impulses, or where it has no solution with those, with
    /// impulses between them and the last ones.
    pub(super) fn try_step_near<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        let mut halvings = 0;
        while let Err(error) = self.try_step(run, step, state) {
            if halvings == HALVINGS || self.lambda == self.solved_with {
                return Err(error);
            }
            halvings += 1;
            self.length = f64::NAN; // what failed is no guess
            let both = self.lambda.iter_mut().zip(&self.solved_with);
            both.for_each(|(lambda, last)| *lambda = last + 0.5 * (*lambda - last));
        }
        self.solved_with.copy_from_slice(&self.lambda);
        Ok(())
    }

    /// Takes the step with the present impulses.
    pub(super) fn try_step<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        let Self { rows, lambda, impacts, contacts, .. } = self;
        if !run.is_at_start {
            run.end.copy_from(state);
        }
        run.is_at_start = false;
        let jumps = impacts.iter().any(|impact| *impact != 0.0);
        if jumps || contacts.iter().any(|contact| contact.is_hit) {
            run.end.history.clear(); // velocities jump
        }
        let all = lambda.iter().zip(impacts).map(|(own, impact)| own + *impact);
        for (i, lambda) in all.enumerate().filter(|(_, lambda)| *lambda != 0.0) {
            rows.add_to(i, lambda, &mut run.end.p); // p̄_n + BᵀΛ
        }
        let again = self.solved > 0 && self.length.to_bits() == step.h.to_bits();
        (self.solved, self.length) = (self.solved + 1, step.h);
        run.take(step, again)
    }

    /// `γ`, `σ`, `b` and `U⁺` of the last step.
    fn measure<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) {
        let Self { contacts, rows, W, minus, plus, lambda, impacts, p, transverse, .. } = self;
        let whole = &self.whole;
        let end = run.end.configuration();
        let s = run.scheme.interval();
        let mut is_known = false; // the constraint impulse
        for contact in contacts {
            let ContactId { element: id, feature } = contact.id;
            let element = &elements[id as usize];
            contact.sigma = element.slip(feature, s).map(|slip| slip / step.h);
            match contact.law {
                ContactLaw::Dry { effort, lever, .. } => {
                    contact.halves = [state.contacts.step, step.h].map(|h| 0.5 * h * effort);
                    contact.bound = 0.5 * (state.contacts.step + step.h) * effort;
                    if lever != 0.0 {
                        if !is_known {
                            p.copy_from_slice(&state.p);
                            let all = lambda.iter().zip(&*impacts).enumerate();
                            all.for_each(|(i, (own, impact))| rows.add_to(i, own + impact, p));
                            run.observer.constraint_impulse(run.system, s, p);
                            if let Some(own) = transverse {
                                own.find(state.configuration(), p);
                            }
                            is_known = true;
                        }
                        let across = transverse.as_ref().map_or(0.0, |own| own.across(id));
                        contact.bound += lever * across; // [N5]
                    }
                    contact.bound *= contact.ratio();
                }
                _ => {
                    let least = contact.least_gap(step.h / *whole);
                    contact.gamma = (element.gap(feature, end) - least) / step.h; // [N2]
                }
            }
        }
        for (i, plus) in plus.iter_mut().enumerate() {
            *plus = minus[i] + W.product(i, |j| lambda[j]);
        }
    }

    /// The largest velocity of a row before and after the impulses.
    pub(super) fn speeds(&self) -> f64 {
        self.minus.iter().chain(&self.plus).fold(0.0, |most: f64, u| most.max(u.abs()))
    }

    /// The change `W(Λ' − Λ)` that is largest beside rounding, the velocity that rounding leaves
    /// of it, and the place of the contact.
    pub(super) fn largest_change(&self, h: f64) -> (f64, f64, usize) {
        let Self { contacts, W, islands, problems, lambda, next, .. } = self;
        let speeds = self.speeds();
        let (mut worst, mut found) = (-1.0, (0.0, 0.0, 0));
        for island in 0..islands.count() {
            let part = problems[island].least_change();
            for place in islands.contacts(island) {
                let contact = &contacts[*place];
                let rounding = (part * speeds).max(contact.rounding(speeds, h));
                for i in contact.row..contact.row + contact.law.rows() {
                    let change = W.product(i, |j| next[j] - lambda[j]).abs();
                    if change / rounding > worst {
                        worst = change / rounding;
                        found = (change, rounding, *place);
                    }
                }
            }
        }
        found
    }
}
