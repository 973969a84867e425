//! The impulses of the contacts of a node, to rounding errors.
//!
//! ```text
//! y(Λ') = ξ(Λ) + W (Λ' − Λ)          with the exact step u(Λ), solved by Newton's method
//! ```
//! is solved for `Λ'` within the sets of the laws, until `W(Λ' − Λ)` is of the size of rounding
//! errors. The residual `ξ` is that of the step itself: `W` affects the speed alone. The iteration
//! contracts by `O(hω)`.

use super::ContactFault;
use super::guard::Islands;
use super::node_law::{Contact, Course, Drive, Kind, Rows};
use super::record::{ContactRecord, ContactStatus, NodeRecord, Records};
use super::unilateral::{ContactLaw, ContactRows, Unilateral};
use crate::constraints::Constraints;
use crate::discretization::{Discretization, ObserveNode};
use crate::scheme::{Scheme, StepError, StepSolver, SubStep};
use std::sync::Arc;
use vi_core::Configuration;
use vi_core::cone::{Cone, ConeFault, ConeSolver};
use vi_core::contact_state::{ContactId, Remembered};
use vi_core::newton::NewtonReport;
use vi_core::state::State;

/// Solutions of a step for one set of laws.
const ITERATIONS: usize = 60;
/// A change of velocities that may stagnate, relative to velocities.
const STAGNATION: f64 = 1e-9;

/// The elements of a mechanism.
pub(super) type Elements = [Arc<dyn Unilateral>];

/// What a step is solved with.
pub(crate) struct Stepping<'a, S: Discretization<C>, C> {
    pub(crate) system: &'a S,
    pub(crate) constraints: &'a C,
    pub(crate) scheme: &'a mut dyn Scheme<S, C>,
    pub(crate) solver: &'a mut StepSolver,
    pub(crate) observer: &'a mut S::Observer,
    pub(crate) report: NewtonReport, // sums of iterations
}

impl<'a, S: Discretization<C>, C: Constraints> Stepping<'a, S, C> {
    pub(crate) fn new(
        (system, constraints): (&'a S, &'a C),
        scheme: &'a mut dyn Scheme<S, C>,
        solver: &'a mut StepSolver,
        observer: &'a mut S::Observer,
    ) -> Self {
        Self { system, constraints, scheme, solver, observer, report: NewtonReport::default() }
    }

    fn take(&mut self, step: SubStep, state: &mut State) -> Result<(), StepError> {
        let Self { system, constraints, scheme, solver, .. } = self;
        let report = solver.advance(&mut **scheme, system, constraints, step, state)?;
        self.report.iterations += report.iterations;
        self.report.restarts += report.restarts;
        self.report.residual = self.report.residual.max(report.residual);
        Ok(())
    }

    /// `v ← v̂` of a momentum at the node of a state.
    pub(super) fn velocity(
        &mut self,
        state: &State,
        h: f64,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<(), StepError> {
        let Self { system, constraints, observer, .. } = self;
        let found = observer.velocity(system, constraints, (state, h), p, v);
        found.map_err(|_| ContactFault::RankLost.into())
    }
}

/// The contacts of a node and their impulses.
#[derive(Debug, Default)]
pub(super) struct NodeImpulses {
    pub(super) contacts: Vec<Contact>,
    rows: ContactRows,
    columns: Vec<f64>, // k × n  v̂ of each row
    v: Vec<f64>,       // n      v̂ of p̄_n
    at_rest: Vec<f64>, // n      v̂ of no momentum
    p: Vec<f64>,       // n
    W: Vec<f64>,       // k × k
    minus: Vec<f64>,   // k  U⁻
    plus: Vec<f64>,    // k  U⁺
    pub(super) lambda: Vec<f64>,
    next: Vec<f64>, // k
    problem: ActiveRows,
    islands: Islands,
    pub(super) trial: State, // at the end of the last step that was solved
    solved: u64,             // steps for this node
    is_guarded: bool,
}

/// The rows whose impulses are not known beforehand, as one problem.
#[derive(Debug, Default)]
struct ActiveRows {
    rows: Vec<usize>,
    drives: Vec<Drive>, // k
    cones: Vec<Cone>,
    owners: Vec<usize>, // contacts of the cones
    W: Vec<f64>,
    w: Vec<f64>,
    lambda: Vec<f64>,
    solver: ConeSolver,
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
            contacts.push(Contact {
                id,
                law,
                row,
                size: element.size(),
                gap: element.gap(id.feature, at),
                before: known.map_or(0.0, |known| known.rate),
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
        }
        self.find_hits(elements, run, (step, state))?;
        self.settle(elements, run, (step, state))?;
        self.guard(elements, run, (step, state))
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
            let restitution = contact.law.restitution().unwrap_or(0.0);
            contact.is_hit = restitution > 0.0 && minus[contact.row] < 0.0;
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
                contact.is_hit = elements[element as usize].gap(feature, end) < 0.0;
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
        let mut last = f64::INFINITY;
        for _ in 0..ITERATIONS {
            self.try_step(run, (step, state))?;
            if self.contacts.is_empty() {
                return Ok(());
            }
            self.measure(elements, run, (step, state));
            self.next_impulses(elements)?;
            let (change, rounding, _) = self.largest_change(step.h);
            let speeds = self.minus.iter().chain(&self.plus).fold(0.0, |a: f64, u| a.max(u.abs()));
            if change <= rounding || last <= STAGNATION * speeds && change >= last {
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
        let Self { contacts, rows, trial, W, minus, plus, lambda, p, .. } = self;
        let end = Configuration { angles: &state.angles, ..trial.configuration() };
        let s = run.scheme.interval();
        let mut is_known = false; // the constraint impulse
        for contact in contacts {
            let ContactId { element, feature } = contact.id;
            let element = &elements[element as usize];
            contact.sigma = element.slip(feature, s).map(|slip| slip / step.h);
            match contact.law {
                ContactLaw::Dry { effort, lever } => {
                    contact.bound = 0.5 * (state.contacts.step + step.h) * effort;
                    if lever != 0.0 {
                        if !is_known {
                            p.copy_from_slice(&state.p);
                            lambda.iter().enumerate().for_each(|(i, own)| rows.add_to(i, *own, p));
                            run.observer.constraint_impulse(run.system, s, p);
                            is_known = true;
                        }
                        let across = element.transverse_impulse(state.configuration(), p);
                        contact.bound += lever * across.abs(); // [N5]
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

    /// `next`: the impulses by the laws at the last step.
    fn next_impulses(&mut self, elements: &Elements) -> Result<(), StepError> {
        let Self { contacts, W, minus, plus, lambda, next, problem, .. } = self;
        let k = minus.len();
        let ActiveRows { rows, drives, cones, owners, W: own_W, w, lambda: own, solver } = problem;
        rows.clear();
        drives.clear();
        cones.clear();
        owners.clear();
        for (place, contact) in contacts.iter_mut().enumerate() {
            let first = contact.row;
            let of = first..first + contact.law.rows();
            let [minus, plus, lambda] = [&*minus, &*plus, &*lambda].map(|all| &all[of.clone()]);
            let diagonal = W[first * k + first];
            let (own, cone) = contact.equations(Rows { minus, plus, lambda, w: diagonal });
            drives.extend_from_slice(&own[..of.len()]);
            if let Drive::Known(value) = own[0] {
                next[first] = value;
            } else {
                rows.extend(of);
                cones.push(cone);
                owners.push(place);
            }
        }
        own_W.clear();
        w.clear();
        own.clear();
        for &i in &*rows {
            let Drive::Zero { xi, compliance } = drives[i] else { continue };
            let mut rest = xi;
            for (j, drive) in drives.iter().enumerate() {
                let entry = W[i * k + j];
                match drive {
                    Drive::Known(value) => rest += entry * (value - lambda[j]),
                    Drive::Zero { .. } => {
                        let entry = if i == j { entry + compliance } else { entry };
                        own_W.push(entry);
                        rest -= entry * lambda[j];
                    }
                }
            }
            w.push(rest);
            own.push(lambda[i]);
        }
        solver.solve(cones, own_W, w, own).map_err(|fault| {
            let cone = match fault {
                ConeFault::Wedged { cone } => cone,
                _ => 0,
            };
            let element = contacts[owners[cone]].id.element;
            let element = elements[element as usize].name().to_owned();
            match fault {
                ConeFault::Wedged { .. } => ContactFault::Immovable { element },
                fault => ContactFault::Laws { element, fault },
            }
        })?;
        rows.iter().zip(&*own).for_each(|(&i, value)| next[i] = *value);
        Ok(())
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

    /// Restitution that would gain energy is reduced, island by island.
    fn guard<S: Discretization<C>, C: Constraints>(
        &mut self,
        elements: &Elements,
        run: &mut Stepping<'_, S, C>,
        at: (SubStep, &State),
    ) -> Result<(), StepError> {
        if !self.contacts.iter().any(|contact| contact.kind == Kind::Impact) {
            return Ok(());
        }
        let mut islands = std::mem::take(&mut self.islands);
        islands.find(&self.contacts, &self.W);
        let mut outcome = Ok(());
        for island in 0..islands.count() {
            outcome = islands.reduce(island, self, &mut |own| own.settle(elements, run, at));
            if outcome.is_err() {
                break;
            }
        }
        self.is_guarded = self.contacts.iter().any(|contact| contact.reduction < 1.0);
        self.islands = islands;
        outcome
    }

    /// The size of the terms of the work of a node, J.
    pub(super) fn work_size(&self) -> f64 {
        let Self { minus, plus, lambda, .. } = self;
        let speeds = minus.iter().zip(plus).map(|(a, b)| a.abs() + b.abs());
        lambda.iter().zip(speeds).map(|(lambda, u)| 0.5 * lambda.abs() * u).sum()
    }

    /// Moves a state to the end of the step that was solved last.
    pub(super) fn accept(&mut self, h: f64, state: &mut State, records: &mut Records) {
        let (t, before) = (state.t, state.contacts.step);
        if records.first_impulse.is_empty() {
            records.first_impulse.resize(state.q.len(), 0.0);
            for (i, lambda) in self.lambda.iter().enumerate() {
                self.rows.add_to(i, *lambda, &mut records.first_impulse);
            }
        }
        state.copy_from(&self.trial);
        let first = records.contacts.len();
        let remembered = &mut state.contacts;
        remembered.step = h;
        remembered.contacts.clear();
        for contact in &self.contacts {
            let record = self.record(contact);
            let impulse = match record.status {
                ContactStatus::Impact => [0.0; 3],
                _ => record.impulse,
            };
            let rate = match contact.law {
                ContactLaw::Coulomb { .. } => libm::hypot(contact.sigma[0], contact.sigma[1]),
                _ => contact.sigma[0],
            };
            remembered.contacts.push(Remembered { id: contact.id, impulse, rate });
            records.contacts.push(record);
        }
        let counts = &mut remembered.counts;
        let own = &records.contacts[first..];
        let impacts = own.iter().filter(|record| record.status == ContactStatus::Impact).count();
        let closed = own.iter().filter(|record| record.status != ContactStatus::Open).count();
        let work: f64 = own.iter().map(|record| record.work).sum();
        counts.impacts += impacts as u64;
        counts.dissipated -= work;
        counts.most_contacts = counts.most_contacts.max(closed as u64);
        counts.most_iterations = counts.most_iterations.max(self.solved);
        counts.largest_work = counts.largest_work.max(work);
        counts.guarded += u64::from(self.is_guarded);
        for contact in &self.contacts {
            counts.largest_reduction = counts.largest_reduction.max(1.0 - contact.reduction);
        }
        let contacts = first..records.contacts.len();
        records.nodes.push(NodeRecord { t, before, after: h, contacts });
    }

    fn record(&self, contact: &Contact) -> ContactRecord {
        let own = contact.row..contact.row + contact.law.rows();
        let of = |all: &[f64]| {
            let mut three = [0.0; 3];
            three.iter_mut().zip(&all[own.clone()]).for_each(|(to, from)| *to = *from);
            three
        };
        let [impulse, before, after] = [&self.lambda, &self.minus, &self.plus].map(|all| of(all));
        let work = (0..3).map(|i| 0.5 * impulse[i] * (before[i] + after[i])).sum();
        let status = match contact.law {
            _ if impulse == [0.0; 3] => ContactStatus::Open,
            _ if contact.kind == Kind::Impact => ContactStatus::Impact,
            ContactLaw::Dry { .. } if impulse[0].abs() < contact.bound => ContactStatus::Stick,
            ContactLaw::Dry { .. } => ContactStatus::Slip,
            ContactLaw::Coulomb { friction, .. } if contact.slips(&impulse, friction) => {
                ContactStatus::Slip
            }
            _ => ContactStatus::Stick,
        };
        let (id, gap, slip) = (contact.id, contact.gap, contact.sigma);
        let slip_before = contact.before;
        ContactRecord { id, status, impulse, before, after, gap, slip, slip_before, work }
    }
}
