//! What an impact is: the law of restitution, and how several at once are solved.
//!
//! ```text
//! Newton      ξ = U⁺ + e U⁻, all contacts of the node at once, in the law of the node     [N4]
//! Moreau      Λ = (1 + e) Λ⁰,    Λ⁰ of the same node with e = 0, e_T = e
//! sequential  Newton's law of one contact after the other, that of the fastest approach first
//! ```
//! The impulses of the last two are found before the step of the node; what then still approaches,
//! or would be passed, is solved as a contact without restitution. Moreau's law gains no energy:
//! ```text
//! T⁺ − T⁻ = (1 + e) Λ⁰·U⁰ − ½ (1 − e²) Λ⁰ᵀWΛ⁰ ≤ 0
//! ```
//! An island has one `e`, the smallest of what is hit. What sticks is thrown back across the
//! normal, too. Sources: Moreau 1988; Glocker, Multibody Syst. Dyn. 29 (2013) 77.

use super::guard::reduced;
use super::impulses::NodeImpulses;
use super::node_law::{CLOSED, Contact};
use super::stepping::Stepping;
use super::unilateral::{ContactLaw, Elements};
use super::{ContactFault, delassus::Delassus};
use crate::constraints::Constraints;
use crate::discretization::Discretization;
use crate::scheme::{StepError, SubStep};
use serde::{Deserialize, Serialize};
use vi_core::cone::{Cone, ConeSolver};
use vi_core::state::State;

/// Most impacts of a node that are solved one after the other.
const SEQUENCE: usize = 1000;

/// What an impact is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImpactLaw {
    /// After Newton, of all contacts of a node at once.
    #[default]
    Newton,
    /// After Moreau, of all contacts of a node at once.
    Moreau,
    /// After Newton, one after the other.
    Sequential,
}

/// The velocity problem of contacts: `y = WΛ + w`.
#[derive(Debug, Default)]
pub(super) struct VelocityProblem {
    solver: ConeSolver,
    cones: Vec<Cone>,
    rows: Vec<usize>, // m  of the node
    W: Vec<f64>,      // m × m
    w: Vec<f64>,      // m
    lambda: Vec<f64>, // m
}

impl VelocityProblem {
    /// Of these contacts, with `w` of each row.
    fn open<'a>(
        &mut self,
        contacts: impl Iterator<Item = &'a Contact>,
        W: &Delassus,
        w: impl Fn(usize) -> f64,
    ) {
        self.cones.clear();
        self.rows.clear();
        for contact in contacts {
            self.cones.push(contact.cone());
            self.rows.extend(contact.row..contact.row + contact.law.rows());
        }
        self.W.clear();
        for i in &self.rows {
            self.W.extend(self.rows.iter().map(|j| W.at(*i, *j)));
        }
        self.w.clear();
        self.w.extend(self.rows.iter().map(|i| w(*i)));
        self.lambda.clear();
        self.lambda.resize(self.rows.len(), 0.0);
    }

    fn solve(&mut self, name: &str) -> Result<(), StepError> {
        let Self { solver, cones, W, w, lambda, .. } = self;
        match solver.solve(cones, W, w, lambda) {
            Ok(_) => Ok(()),
            Err(fault) => Err(ContactFault::Laws { element: name.to_owned(), fault }.into()),
        }
    }
}

impl NodeImpulses {
    /// Solves the step after the impacts of the node.
    pub(super) fn solve_after_impacts<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        at: (SubStep, &State),
    ) -> Result<(), StepError> {
        self.minus.copy_from_slice(&self.arrival);
        self.impacts.fill(0.0);
        self.is_guarded = false;
        if !self.may_be_hit(|contact| !contact.was_closed) {
            self.settle(elements, run, at)?;
            if !self.would_bounce() {
                return Ok(());
            }
        }
        self.find_hits(elements, run, at)?;
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
                ImpactLaw::Sequential => self.collide_in_sequence(elements, &own, at.0.h),
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
        self.settle(elements, run, at)
    }

    /// `Λ = (1 + e) Λ⁰` of the contacts of an island.
    fn collide_at_once(&mut self, elements: &Elements, own: &[usize]) -> Result<(), StepError> {
        let Self { contacts, W, arrival, impacts, collision: problem, .. } = self;
        let of = || own.iter().map(|place| &contacts[*place]);
        let hit = of().filter(|contact| contact.is_hit);
        let e = hit.filter_map(|contact| contact.law.restitution()).fold(1.0, f64::min);
        problem.open(of(), W, |i| arrival[i]);
        problem.solve(name(elements, &contacts[own[0]]))?;
        for (row, lambda) in problem.rows.iter().zip(&problem.lambda) {
            impacts[*row] = (1.0 + e) * lambda;
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
        let Self { contacts, W, arrival, impacts, plus, is_guarded, .. } = self;
        let problem = &mut self.collision;
        plus.copy_from_slice(arrival); // U
        let speeds = arrival.iter().fold(0.0, |size: f64, u| size.max(u.abs()));
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
            let [work, size] = with(1.0)?;
            reduced(work, size, &mut |factor| Ok(with(factor)?[0]))?;
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

impl VelocityProblem {
    /// `½ Λ·(U⁺ + U⁻)` and the size of its terms, J; `before`: `U⁻` of the node.
    fn work(&self, before: &[f64]) -> [f64; 2] {
        let m = self.rows.len();
        let mut sums = [0.0; 2];
        for (i, row) in self.rows.iter().enumerate() {
            let entries = self.W[i * m..(i + 1) * m].iter().zip(&self.lambda);
            let change: f64 = entries.map(|(entry, lambda)| entry * lambda).sum();
            let (u, lambda) = (before[*row], self.lambda[i]);
            sums[0] += 0.5 * lambda * (2.0 * u + change);
            sums[1] += 0.5 * lambda.abs() * (2.0 * u.abs() + change.abs());
        }
        sums
    }
}

impl Contact {
    /// Whether it takes part in an impact.
    fn may_collide(&self) -> bool {
        !matches!(self.law, ContactLaw::Dry { .. })
            && (self.is_hit || self.gap <= CLOSED * self.size)
    }

    fn cone(&self) -> Cone {
        match self.law {
            ContactLaw::Coulomb { .. } => Cone::Friction { coefficient: self.coefficient() },
            _ => Cone::Normal,
        }
    }

    /// `e` of its normal row, `e_T` of the others.
    fn restitution_of(&self, row: usize) -> f64 {
        match self.law {
            ContactLaw::Coulomb { tangential_restitution, .. } if row > 0 => tangential_restitution,
            law => law.restitution().unwrap_or(0.0),
        }
    }
}

fn name<'a>(elements: &'a Elements, contact: &Contact) -> &'a str {
    elements[contact.id.element as usize].name()
}
