//! What a step answers to impulses, where `W` alone does not tell.
//!
//! ```text
//! W_s e_j = (y(Λ + δ e_j) − y(Λ))/δ,      y: gap at the end over h, slip of the step over h
//! ```
//! `W` is that of free motion: springs, dampers and beams answer less where their time constants
//! are not long beside `h`. Rows that are driven by velocities at the node keep `W`, which is exact
//! for those. Differences do for derivatives, since `W_s` affects the speed of the iteration alone.

use super::impulses::NodeImpulses;
use super::node_law::{Contact, Kind};
use super::stepping::Stepping;
use super::unilateral::{ContactLaw, Elements};
use crate::constraints::Constraints;
use crate::discretization::Discretization;
use crate::scheme::SubStep;
use vi_core::state::State;

/// The change of a velocity that an impulse is varied by: in parts of velocities,
const PART: f64 = 1e-4;
/// and in roundings of it.
const ROUNDINGS: f64 = 1e7;

impl Contact {
    /// `y` of its rows at the last step.
    pub(super) fn motion(&self) -> [f64; 3] {
        match self.law {
            ContactLaw::Dry { .. } => [self.sigma[0], 0.0, 0.0],
            _ => [self.gamma, self.sigma[0], self.sigma[1]],
        }
    }

    /// Whether `ξ` of a row is one of velocities at the node.
    pub(super) fn is_of_velocities(&self, row: usize) -> bool {
        self.kind == Kind::Impact || (self.slides && row > 0)
    }
}

impl NodeImpulses {
    /// Finds `W_s` at the last step, by one row of each island at a time. Of islands without a
    /// dense matrix, and where a step has no solution, `W` is left. The step is to be taken again.
    pub(super) fn differentiate<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
    ) {
        let speeds = self.speeds();
        self.W.begin_step_compliance();
        self.unvaried.clone_from(&self.lambda);
        self.motion.clear();
        self.motion.extend(self.contacts.iter().map(Contact::motion));
        let islands = 0..self.islands.count();
        let rows = islands.clone().map(|k| self.problems[k].dense_rows().len()).max();
        for turn in 0..rows.unwrap_or(0) {
            for k in islands.clone() {
                let Some(&j) = self.problems[k].dense_rows().get(turn) else { continue };
                let place = self.contacts.partition_point(|contact| contact.row <= j) - 1;
                let rounding = self.contacts[place].rounding(speeds, step.h);
                let change = (PART * speeds).max(ROUNDINGS * rounding) / self.W.at(j, j);
                self.lambda[j] += if change.is_finite() { change } else { 0.0 };
            }
            let taken = self.try_step(run, (step, state)).is_ok();
            if taken {
                self.measure(elements, run, (step, state));
                islands.clone().for_each(|k| self.answers_to(k, turn));
            }
            self.lambda.clone_from(&self.unvaried);
            if !taken {
                self.W.forget_step_compliance();
                return;
            }
        }
    }

    pub(super) fn dbg(&self) {
        for i in 0..self.lambda.len() {
            let w: Vec<_> = self.W.row(i).collect(); let s: Vec<_> = self.W.row_in_step(i).collect();
            eprintln!("row {i} W {w:?}\n       S {s:?} kind {:?} lambda {:e}", self.contacts.iter().find(|c| c.row<=i && i < c.row+c.law.rows()).map(|c| (c.law, c.kind, c.slides, c.course, c.sigma, c.gamma, c.bound)), self.lambda[i]);
        }
    }
    /// Takes up what an island answers to the row that was varied.
    fn answers_to(&mut self, island: usize, turn: usize) {
        let Self { contacts, problems, islands, W, lambda, unvaried, motion, .. } = self;
        let Some(&j) = problems[island].dense_rows().get(turn) else { return };
        let change = lambda[j] - unvaried[j];
        if change == 0.0 {
            return;
        }
        for &place in islands.contacts(island) {
            let contact = &contacts[place];
            let (new, old) = (contact.motion(), motion[place]);
            for row in 0..contact.law.rows() {
                W.set_step_compliance((contact.row + row, j), (new[row] - old[row]) / change);
            }
        }
    }
}
