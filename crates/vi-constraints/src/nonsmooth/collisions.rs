//! The impacts of a node by the laws of Moreau and of one after the other, before its step.

use super::guard::reduced;
use super::impact_law::ImpactLaw;
use super::impulses::NodeImpulses;
use super::node_law::Contact;
use super::stepping::Stepping;
use super::unilateral::Elements;
use crate::constraints::Constraints;
use crate::discretization::Discretization;
use crate::scheme::{StepError, SubStep};
use vi_core::linear::norm_inf;
use vi_core::state::State;

/// Most impacts of a node that are solved one after the other.
const SEQUENCE: usize = 1000;

impl NodeImpulses {
    /// Solves the step after the impacts of the node.
    pub(super) fn solve_after_impacts<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        self.begin_at_rest();
        self.is_guarded = false;
        if !self.may_be_hit() {
            self.settle(elements, run, step, state)?;
            return self.settle_departures(elements, run, step, state);
        }
        self.find_hits(elements, run, step, state)?;
        let mut own = std::mem::take(&mut self.guarded);
        let mut outcome = Ok(());
        for island in 0..self.islands.count() {
            let contacts = self.islands.contacts(island);
            if !contacts.iter().any(|place| self.contacts[*place].is_hit) {
                continue;
            }
            own.clear();
            own.extend(contacts.iter().filter(|place| self.contacts[**place].may_collide()));
            outcome = match self.impact_law {
                ImpactLaw::Sequential => self.collide_in_sequence(elements, &own, step.h),
                _ => self.collide_at_once(elements, &own),
            };
            if outcome.is_err() {
                break;
            }
        }
        self.guarded = own;
        outcome?;
        let Self { impacts, minus, arrival, W, .. } = self;
        for (i, minus) in minus.iter_mut().enumerate() {
            *minus = arrival[i] + W.product(i, |j| impacts[j]);
        }
        self.contacts.iter_mut().for_each(|contact| contact.is_hit = false);
        self.settle(elements, run, step, state)?;
        self.settle_departures(elements, run, step, state)
    }

    /// `Λ = (1 + e) Λ⁰` of the contacts of an island.
    fn collide_at_once(&mut self, elements: &Elements, own: &[usize]) -> Result<(), StepError> {
        let Self { contacts, W, minus, impacts, collision: problem, .. } = self;
        let of = || own.iter().map(|place| &contacts[*place]);
        let hit = of().filter(|contact| contact.is_hit);
        let e = hit.filter_map(|contact| contact.law.restitution()).fold(1.0, f64::min);
        problem.open(of(), W, |i| minus[i]);
        problem.solve(name(elements, &contacts[own[0]]))?;
        for (row, lambda) in problem.rows.iter().zip(&problem.lambda) {
            impacts[*row] += (1.0 + e) * lambda;
        }
        Ok(())
    }

    /// One impact after the other, until nothing approaches.
    fn collide_in_sequence(
        &mut self,
        elements: &Elements,
        own: &[usize],
        h: f64,
    ) -> Result<(), StepError> {
        let Self { contacts, W, minus, impacts, plus, is_guarded, .. } = self;
        let problem = &mut self.collision;
        plus.copy_from_slice(minus); // U
        let speeds = norm_inf(minus);
        for _ in 0..SEQUENCE {
            let approaches = |place: &&usize| {
                plus[contacts[**place].row] < -contacts[**place].rounding(speeds, h)
            };
            let fastest = own.iter().filter(approaches);
            let speed = |place: &usize| plus[contacts[*place].row];
            let Some(place) = fastest.min_by(|a, b| speed(a).total_cmp(&speed(b))) else { break };
            let contact = &contacts[*place];
            let mut least = 1.0;
            let mut with = |factor: f64| {
                problem.open(std::iter::once(&*contact), W, |i| {
                    (1.0 + factor * contact.restitution_of(i - contact.row)) * plus[i]
                });
                problem.solve(name(elements, contact))?;
                least = factor;
                Ok::<[f64; 2], StepError>(problem.work(plus))
            };
            match with(1.0) {
                Err(error) if error.has_no_impulses() => drop(with(0.0)?), // it is plastic
                plain => {
                    let [work, size] = plain?;
                    reduced(work, size, &mut |factor| Ok(with(factor)?[0]))?;
                }
            }
            *is_guarded |= least < 1.0;
            contacts[*place].reduction = contacts[*place].reduction.min(least);
            for (row, lambda) in problem.rows.iter().zip(&problem.lambda) {
                impacts[*row] += lambda;
                W.row(*row).for_each(|(j, entry)| plus[j] += entry * lambda);
            }
        }
        Ok(())
    }
}

fn name<'a>(elements: &'a Elements, contact: &Contact) -> &'a str {
    elements[contact.id.element as usize].name()
}
