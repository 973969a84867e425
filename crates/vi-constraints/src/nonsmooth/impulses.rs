//! The impulses of the contacts of a node, to rounding errors.
//!
//! ```text
//! y(Λ') = ξ(Λ) + W (Λ' − Λ)          with the exact step u(Λ), solved by Newton's method
//! ```
//! is solved for `Λ'` within the sets of the laws, until `W(Λ' − Λ)` is of the size of rounding
//! errors. The residual `ξ` is that of the step itself: `W` affects the speed alone. The iteration
//! contracts by `O(hω)`.

use super::ContactFault;
use super::active_rows::{ActiveRows, Present};
use super::islands::Islands;
use super::node_law::{Contact, Course, Kind, Rows};
use super::stepping::Stepping;
use super::unilateral::{ContactLaw, ContactRows, Elements, TransverseImpulses};
use crate::constraints::Constraints;
use crate::discretization::{Discretization, ObserveNode};
use crate::scheme::{StepError, SubStep};
use vi_core::Configuration;
use vi_core::contact_state::ContactId;
use vi_core::state::State;

/// Solutions of a step for one set of laws.
const ITERATIONS: usize = 60;
/// A gap that is closed, in parts of its size.
pub(super) const CLOSED: f64 = 1e-11;
/// A change of velocities that may stagnate, relative to velocities.
const STAGNATION: f64 = 1e-9;

/// The contacts of a node and their impulses.
#[derive(Debug, Default)]
pub(super) struct NodeImpulses {
    pub(super) contacts: Vec<Contact>,
    pub(super) rows: ContactRows,
    columns: Vec<f64>,          // k × n  v̂ of each row
    v: Vec<f64>,                // n      v̂ of p̄_n
    at_rest: Vec<f64>,          // n      v̂ of no momentum
    p: Vec<f64>,                // n
    pub(super) W: Vec<f64>,     // k × k
    pub(super) minus: Vec<f64>, // k  U⁻
    pub(super) plus: Vec<f64>,  // k  U⁺
    pub(super) lambda: Vec<f64>,
    pub(super) next: Vec<f64>, // k
    pub(super) problem: ActiveRows,
    pub(super) transverse: Option<Box<dyn TransverseImpulses>>,
    pub(super) islands: Islands,
    pub(super) trial: State, // at the end of the last step that was solved
    pub(super) solved: u64,  // steps for this node
    pub(super) is_guarded: bool,
}

impl NodeImpulses {
    /// Opens a node with contacts, in ascending order.
    pub(super) fn open<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (state, h): (&State, f64),
        set: &[ContactId],
    ) -> Result<(), StepError> {
        let at = state.configuration();
        let Self { contacts, rows, columns, v, at_rest, p, W, minus, lambda, .. } = self;
        contacts.clear();
        rows.clear();
        lambda.clear();
        for &id in set {
            let element = &elements[id.element as usize];
            let (row, law) = (rows.len(), element.law());
            let known = state.contacts.find(id);
            element.rows(id.feature, at, rows);
            lambda.extend_from_slice(&known.map_or([0.0; 3], |known| known.impulse)[..law.rows()]);
            let gap = element.gap(id.feature, at);
            contacts.push(Contact {
                id,
                law,
                row,
                size: element.size(),
                place: element.place(id.feature, at),
                gap,
                before: known.map_or(0.0, |known| known.rate),
                is_new: known.is_none() && gap <= CLOSED * element.size(),
                was_closed: known.is_some_and(|known| known.impulse[0] > 0.0),
                is_hit: false,
                reduction: 1.0,
                slides: false,
                kept: false,
                kind: Kind::Position,
                course: Course::Usual,
                gamma: 0.0,
                sigma: [0.0; 2],
                bound: 0.0,
            });
        }
        let (n, k) = (state.q.len(), rows.len());
        for (vector, size) in
            [(&mut *columns, n * k), (&mut *v, n), (&mut *p, n), (&mut *W, k * k), (&mut *minus, k)]
        {
            vector.clear();
            vector.resize(size, 0.0);
        }
        self.plus.resize(k, 0.0);
        self.next.resize(k, 0.0);
        (self.solved, self.is_guarded) = (0, false);
        if k == 0 {
            return Ok(());
        }
        run.velocity(state, h, &state.p, v)?;
        let moves = run.constraints.is_rheonomic();
        at_rest.clear();
        if moves {
            at_rest.resize(n, 0.0);
            run.velocity(state, h, p, at_rest)?;
        }
        for (i, column) in columns.chunks_exact_mut(n).enumerate() {
            p.fill(0.0);
            rows.add_to(i, 1.0, p);
            run.velocity(state, h, p, column)?;
            column.iter_mut().zip(&*at_rest).for_each(|(v, own)| *v -= own);
            minus[i] = rows.dot(i, v); // U⁻
        }
        for i in 0..k {
            for j in 0..=i {
                let [a, b] =
                    [(i, j), (j, i)].map(|(i, j)| rows.dot(i, &columns[j * n..(j + 1) * n]));
                (W[i * k + j], W[j * k + i]) = (0.5 * (a + b), 0.5 * (a + b));
            }
        }
        Ok(())
    }

    /// `v̂` after the impulses, shape `n`.
    pub(super) fn velocity_after<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        (state, h): (&State, f64),
        out: &mut [f64],
    ) -> Result<(), StepError> {
        if self.lambda.is_empty() {
            return run.velocity(state, h, &state.p, out);
        }
        out.copy_from_slice(&self.v);
        for (column, lambda) in self.columns.chunks_exact(out.len()).zip(&self.lambda) {
            out.iter_mut().zip(column).for_each(|(v, own)| *v += lambda * own);
        }
        Ok(())
    }

    /// Solves the step for the impulses of the node; the state after it is `trial`.
    pub(super) fn solve<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
    ) -> Result<(), StepError> {
        for contact in &mut self.contacts {
            (contact.slides, contact.kept, contact.reduction) = (false, false, 1.0);
            contact.is_hit = false;
        }
        // what was closed before and stays so is settled by positions: a look at velocities tells
        if self.may_be_hit(|contact| !contact.was_closed) {
            self.find_hits(elements, run, (step, state))?;
            self.settle(elements, run, (step, state))?;
        } else {
            self.settle(elements, run, (step, state))?;
            if self.would_bounce() {
                self.find_hits(elements, run, (step, state))?;
                self.settle(elements, run, (step, state))?;
            }
        }
        self.guard(elements, run, (step, state))
    }

    /// Whether a contact of these approaches and may bounce.
    fn may_be_hit(&self, of: impl Fn(&Contact) -> bool) -> bool {
        let approaches = |own: &Contact| self.minus[own.row] < 0.0 && own.may_bounce();
        self.contacts.iter().any(|own| of(own) && approaches(own))
    }

    /// Whether a contact that approaches leaves the node more slowly than its restitution says.
    fn would_bounce(&self) -> bool {
        self.may_be_hit(|own| {
            let restitution = own.law.restitution().unwrap_or(0.0);
            self.plus[own.row] + restitution * self.minus[own.row] < own.gamma
        })
    }

    /// Which contacts are hit: a step without impulses of contacts is taken where that matters.
    fn find_hits<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
    ) -> Result<(), StepError> {
        let Self { contacts, minus, .. } = self;
        let mut any = false;
        for contact in contacts {
            contact.is_hit = contact.may_bounce() && minus[contact.row] < 0.0;
            any |= contact.is_hit;
        }
        if any {
            self.next.copy_from_slice(&self.lambda);
            self.lambda.fill(0.0);
            let taken = self.try_step(run, (step, state));
            self.lambda.copy_from_slice(&self.next);
            taken?;
            let Self { contacts, trial, .. } = self;
            let end = Configuration { angles: &state.angles, ..trial.configuration() };
            for contact in contacts.iter_mut().filter(|contact| contact.is_hit) {
                let ContactId { element, feature } = contact.id;
                let is_passed = elements[element as usize].gap(feature, end) < 0.0;
                let bounces = contact.law.restitution().is_some_and(|e| e > 0.0);
                contact.is_hit = if is_passed { bounces } else { contact.is_new };
            }
        }
        Ok(())
    }

    /// Iterates; then rows that slide steadily take the mean velocity, and go back where they stick
    /// after all.
    pub(super) fn settle<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        at: (SubStep, &State),
    ) -> Result<(), StepError> {
        self.contacts.iter_mut().for_each(|contact| contact.course = Course::Usual);
        self.iterate(elements, run, at)?;
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
            self.iterate(elements, run, at)?;
        }
    }

    /// The outer iteration, from the present impulses.
    fn iterate<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
    ) -> Result<(), StepError> {
        self.problem.begin(&self.W);
        let mut last = f64::INFINITY;
        for _ in 0..ITERATIONS {
            self.try_step(run, (step, state))?;
            if self.contacts.is_empty() {
                return Ok(());
            }
            self.measure(elements, run, (step, state));
            let Self { contacts, W, minus, plus, lambda, next, problem, .. } = self;
            let present = Present { contacts, W, minus, plus, lambda, next };
            problem.next_impulses(present, elements)?;
            let (change, rounding, _) = self.largest_change(step.h);
            let speeds = self.minus.iter().chain(&self.plus).fold(0.0, |a: f64, u| a.max(u.abs()));
            let is_exact = self.problem.is_exact;
            let stagnates = last <= STAGNATION * speeds && change >= last;
            if is_exact && (change <= rounding || stagnates) {
                return Ok(());
            }
            last = change;
            std::mem::swap(&mut self.lambda, &mut self.next);
        }
        let element = self.largest_change(step.h).2;
        let fault = ContactFault::NoConvergence {
            element: elements[element as usize].name().to_owned(),
            contacts: self.contacts.len(),
            iterations: ITERATIONS,
            change: last,
        };
        Err(fault.into())
    }

    /// Takes the step with the present impulses: `trial`.
    fn try_step<S: Discretization<C>, C: Constraints>(
        &mut self,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
    ) -> Result<(), StepError> {
        let Self { trial, rows, lambda, contacts, .. } = self;
        trial.copy_from(state);
        if contacts.iter().any(|contact| contact.is_hit) {
            trial.history.clear(); // velocities jump
        }
        for (i, lambda) in lambda.iter().enumerate().filter(|(_, lambda)| **lambda != 0.0) {
            rows.add_to(i, *lambda, &mut trial.p); // p̄_n + BᵀΛ
        }
        self.solved += 1;
        run.take(step, trial)
    }

    /// `γ`, `σ`, `b` and `U⁺` of the last step.
    fn measure<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        (step, state): (SubStep, &State),
    ) {
        let Self { contacts, rows, trial, W, minus, plus, lambda, p, transverse, .. } = self;
        let end = Configuration { angles: &state.angles, ..trial.configuration() };
        let s = run.scheme.interval();
        let mut is_known = false; // the constraint impulse
        for contact in contacts {
            let ContactId { element: id, feature } = contact.id;
            let element = &elements[id as usize];
            contact.sigma = element.slip(feature, s).map(|slip| slip / step.h);
            match contact.law {
                ContactLaw::Dry { effort, lever } => {
                    contact.bound = 0.5 * (state.contacts.step + step.h) * effort;
                    if lever != 0.0 {
                        if !is_known {
                            p.copy_from_slice(&state.p);
                            lambda.iter().enumerate().for_each(|(i, own)| rows.add_to(i, *own, p));
                            run.observer.constraint_impulse(run.system, s, p);
                            if let Some(own) = transverse {
                                own.find(state.configuration(), p);
                            }
                            is_known = true;
                        }
                        let across = transverse.as_ref().map_or(0.0, |own| own.across(id));
                        contact.bound += lever * across; // [N5]
                    }
                }
                _ => contact.gamma = element.gap(feature, end) / step.h, // [N2]
            }
        }
        let k = minus.len();
        for i in 0..k {
            let row = W[i * k..(i + 1) * k].iter().zip(&*lambda);
            plus[i] = minus[i] + row.map(|(w, lambda)| w * lambda).sum::<f64>();
        }
    }

    /// The change `W(Λ' − Λ)` that is largest beside rounding, the velocity that rounding leaves
    /// of it, and the element.
    fn largest_change(&self, h: f64) -> (f64, f64, u32) {
        let Self { contacts, W, minus, plus, lambda, next, .. } = self;
        let k = minus.len();
        let speeds = minus.iter().chain(plus).fold(0.0, |a: f64, u| a.max(u.abs()));
        let (mut worst, mut found) = (-1.0, (0.0, 0.0, 0));
        for contact in contacts {
            let rounding = 4.0 * f64::EPSILON * (speeds + contact.size / h);
            for i in contact.row..contact.row + contact.law.rows() {
                let row = W[i * k..(i + 1) * k].iter();
                let terms = row.zip(next.iter().zip(lambda)).map(|(w, (a, b))| w * (a - b));
                let change = terms.sum::<f64>().abs();
                if change / rounding > worst {
                    worst = change / rounding;
                    found = (change, rounding, contact.id.element);
                }
            }
        }
        found
    }

    /// `½ Λ·(U⁺ + U⁻)` of the contacts that `counts`, J.
    pub(super) fn work(&self, counts: impl Fn(usize) -> bool) -> f64 {
        let Self { contacts, minus, plus, lambda, .. } = self;
        let of = |contact: &Contact| {
            let own = contact.row..contact.row + contact.law.rows();
            own.map(|i| 0.5 * lambda[i] * (plus[i] + minus[i])).sum::<f64>()
        };
        let counted = contacts.iter().enumerate().filter(|(place, _)| counts(*place));
        counted.map(|(_, contact)| of(contact)).sum()
    }

    /// The size of the terms of the work of a node, J.
    pub(super) fn work_size(&self) -> f64 {
        let Self { minus, plus, lambda, .. } = self;
        let speeds = minus.iter().zip(plus).map(|(a, b)| a.abs() + b.abs());
        lambda.iter().zip(speeds).map(|(lambda, u)| 0.5 * lambda.abs() * u).sum()
    }
}
