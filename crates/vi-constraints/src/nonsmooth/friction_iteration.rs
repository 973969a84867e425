//! Decisions about friction around the outer iteration: what holds by static friction, what slides
//! steadily, and which slip is turned back by other forces.

use super::active_rows::Present;
use super::impulses::NodeImpulses;
use super::node_law::{Course, Rows};
use super::stepping::Stepping;
use super::unilateral::Elements;
use crate::constraints::Constraints;
use crate::discretization::Discretization;
use crate::scheme::{StepError, SubStep};
use vi_core::state::State;

impl NodeImpulses {
    /// Solves with static friction first; then what breaks loose slides.
    pub(super) fn settle<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        loop {
            self.settle_slip(elements, run, step, state)?;
            let speeds = self.speeds();
            let Self { contacts, lambda, W, .. } = self;
            let mut any = false;
            for contact in contacts.iter_mut().filter(|own| own.law.has_static_friction()) {
                let slides = contact.is_sliding(lambda, W, (speeds, step.h));
                if let Some(holds) = contact.holds_now(slides) {
                    (contact.holds, contact.slides, contact.kept) = (holds, false, false);
                    any = true;
                }
            }
            if !any {
                return Ok(());
            }
        }
    }

    /// Iterates; then rows that slide steadily take the mean velocity, and go back where they stick
    /// after all.
    fn settle_slip<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        step: SubStep,
        state: &State,
    ) -> Result<(), StepError> {
        for contact in &mut self.contacts {
            (contact.turns, contact.parted) = (false, false);
            contact.course = Course::Usual;
        }
        self.iterate(elements, run, step, state)?;
        if self.turning_slip && self.find_turns(elements, step.h)? {
            self.usual.clone_from(&self.lambda);
            if self.iterate(elements, run, step, state).is_err() {
                self.contacts.iter_mut().for_each(|contact| contact.turns = false);
                self.lambda.clone_from(&self.usual);
                self.iterate(elements, run, step, state)?;
            }
        }
        let mut decided = false;
        loop {
            let Self { contacts, minus, plus, lambda, .. } = self;
            let mut changed = false;
            for contact in contacts {
                let own = contact.row..contact.row + contact.law.rows();
                let [minus, plus, lambda] = [&*minus, &*plus, &*lambda].map(|of| &of[own.clone()]);
                if contact.sticks_after_all(lambda) {
                    (contact.slides, contact.kept, changed) = (false, true, true);
                } else if !decided && own.len() == 3 {
                    let change = libm::hypot(plus[1] - minus[1], plus[2] - minus[2]);
                    let rows = Rows { minus, plus, lambda, w: 0.0 };
                    contact.slides = contact.cannot_stop(rows, change);
                    changed |= contact.slides;
                }
            }
            decided = true;
            if !changed {
                return Ok(());
            }
            self.iterate(elements, run, step, state)?;
        }
    }

    /// Which contacts slide in the mean direction of their slip, because other forces turn it back:
    /// those that would not hold their rate if it was zero. Asked of an island as a whole, from the
    /// last step.
    fn find_turns(&mut self, elements: &Elements, h: f64) -> Result<bool, StepError> {
        let speeds = self.speeds();
        let Self { contacts, W, islands, minus, plus, lambda, next, problems, .. } = self;
        let mut any = false;
        for island in 0..islands.count() {
            let own = islands.contacts(island);
            if !own.iter().any(|place| contacts[*place].may_turn()) {
                continue;
            }
            for place in own {
                let contact = &mut contacts[*place];
                contact.shift =
                    contact.slip_before.filter(|_| contact.may_turn()).unwrap_or([0.0; 2]);
            }
            let present = Present { contacts, W, islands, minus, plus, lambda, next, speeds, h };
            problems[island].next_impulses(island, present, elements)?;
            for place in own {
                let contact = &mut contacts[*place];
                contact.shift = [0.0; 2];
                let rows = contact.row..contact.row + contact.law.rows();
                contact.turns = contact.may_turn() && contact.slips(&next[rows]);
                any |= contact.turns;
            }
        }
        Ok(any)
    }
}
