//! The laws of an island at the last step, as one problem for the next impulses.
//!
//! ```text
//! y(Λ') = ξ + W_s (Λ' − Λ)
//! ```
//! `W_s` is `W`, or where the iteration with that is slow the response of the step, of those rows
//! that a step drives. An island of more than 300 rows keeps `W`, in sparse rows, and its laws hold
//! to `1e-11` beside what the node before leaves of them.

use super::ContactFault;
use super::delassus::Delassus;
use super::islands::Islands;
use super::node_law::{Contact, Drive, Kind, Rows};
use super::unilateral::{ContactRows, Elements};
use crate::scheme::StepError;
use vi_core::cone::{Cone, ConeFault, ConeSolver, ConvexSolver, LargeConeSolver, SparseRows};

/// A step far from its solution moves the points of a body apart by its rotation squared: no
/// impulses obey the laws then, and the nearest ones up to this part lead on.
const NEARBY: f64 = 1e-3;
/// What many rows violate their laws by where a solution is not near, relative to their terms.
const BEYOND: f64 = 1e-5;
/// In so many solutions of a step the nearest ones are not looked for any further,
pub(super) const EARLY: usize = 4;
/// or convex laws of many rows lead on.
const LEADS: usize = 12;
/// What the node before leaves of the laws of a large island, relative to the largest velocity:
/// rows that `W` does not tell apart contradict one another by several times `LARGE`.
const LEFT: f64 = 4e-10;
/// Where all methods fail for more rows than this, or more often than `FAILURES`, the iteration
/// ends; of not more than `FEW` rows it goes on.
const MANY: usize = 60;
const FAILURES: usize = 2;
/// A step whose nodes have not more rows is divided where it has no impulses; others have convex
/// laws then.
pub(super) const FEW: usize = 12;
/// Most rows of a dense matrix.
pub(super) const DENSE: usize = 300;

/// The rows of an island whose impulses are not known beforehand.
#[derive(Debug, Default)]
pub(super) struct ActiveRows {
    all: Vec<usize>,    // m  rows of the island
    active: Vec<usize>, // m  places among those to be found, or `KNOWN`
    drives: Vec<Drive>, // m
    cones: Vec<Cone>,
    owners: Vec<usize>, // contacts of the cones
    W: Vec<f64>,
    sparse: (Vec<usize>, Vec<u32>, Vec<f64>), // of a large island
    w: Vec<f64>,
    errors: Vec<f64>, // of w
    found: Vec<f64>,
    solver: ConeSolver,
    large: LargeConeSolver,
    convex: ConvexSolver,
    columns: Vec<u32>,  // of the factor of W: their places in the island
    u: Vec<f64>,        // Lᵀ Λ
    model: Vec<f64>,    // m × m  W; empty of a large island
    response: Vec<f64>, // m × m  W_s, where it is not W
    by_step: Vec<bool>, // m  whether the step drives a row, or the velocity at the node
    lambda: Vec<f64>,   // m  Λ of the last step
    is_exact: bool,
    pub(super) is_relaxed: bool,
    passes: usize,
    failures: usize, // of all methods
}

/// The impulse of a row is known.
const KNOWN: usize = usize::MAX;

/// The contacts of a node at the last step.
pub(super) struct Present<'a> {
    pub(super) contacts: &'a mut [Contact],
    pub(super) W: &'a mut Delassus,
    pub(super) islands: &'a Islands,
    pub(super) minus: &'a [f64],
    pub(super) plus: &'a [f64],
    pub(super) lambda: &'a [f64],
    pub(super) next: &'a mut [f64],
    pub(super) speeds: f64, // the largest of `minus` and `plus`
    pub(super) h: f64,
}

impl ActiveRows {
    /// An iteration begins.
    pub(super) fn begin(
        &mut self,
        contacts: &[Contact],
        W: &Delassus,
        islands: &Islands,
        k: usize,
    ) {
        let Self { all, model, .. } = self;
        all.clear();
        for contact in islands.contacts(k).iter().map(|place| &contacts[*place]) {
            all.extend(contact.row..contact.row + contact.law.rows());
        }
        let m = all.len();
        model.clear();
        if m <= DENSE {
            model.resize(m * m, 0.0);
            for (place, row) in all.iter().enumerate() {
                for (j, entry) in W.row(*row) {
                    if let Some(j) = islands.local(j, k) {
                        model[place * m + j] = entry;
                    }
                }
            }
        }
        self.response.clear();
        (self.passes, self.failures) = (0, 0);
    }

    /// Takes `W_s` from the changes `dq` of the end of the last step with the impulses of all rows,
    /// as tangents at the node, shape `n × k` by columns.
    pub(super) fn respond(&mut self, rows: &ContactRows, (dq, n): (&[f64], usize), h: f64) {
        let Self { all, response, model, .. } = self;
        response.clear();
        if model.is_empty() {
            return;
        }
        let entry = |i: usize, j: usize| rows.dot(i, &dq[j * n..(j + 1) * n]) / h;
        for i in &*all {
            response.extend(all.iter().map(|j| 0.5 * (entry(*i, *j) + entry(*j, *i))));
        }
    }

    /// Whether its laws hold to less than rounding.
    pub(super) fn is_large(&self) -> bool {
        self.all.len() > DENSE
    }

    /// Whether the laws hold at the impulses that were found.
    pub(super) fn is_exact(&self) -> bool {
        self.is_exact
    }

    /// `next`: the impulses of an island by the laws at the last step.
    pub(super) fn next_impulses(
        &mut self,
        island: usize,
        present: Present<'_>,
        elements: &Elements,
    ) -> Result<(), StepError> {
        let Present { contacts, W, islands, minus, plus, lambda, next, speeds, h } = present;
        self.lambda.clear();
        self.lambda.extend(self.all.iter().map(|row| lambda[*row]));
        self.drives.clear();
        self.cones.clear();
        self.owners.clear();
        self.active.clear();
        self.errors.clear();
        self.by_step.clear();
        let places = islands.contacts(island);
        let left = if self.is_large() { LEFT * speeds } else { 0.0 };
        let mut count = 0;
        part_friction(contacts, W, places);
        for place in places {
            let contact = &mut contacts[*place];
            let first = contact.row;
            let of = first..first + contact.law.rows();
            let [minus, plus, lambda] = [minus, plus, lambda].map(|all| &all[of.clone()]);
            let diagonal = W.at(first, first);
            let (own, cone) = contact.equations(Rows { minus, plus, lambda, w: diagonal });
            self.drives.extend_from_slice(&own[..of.len()]);
            let is_impact = contact.kind == Kind::Impact;
            let by_step = |row: usize| !(is_impact || row > first && contact.slides);
            self.by_step.extend(of.clone().map(by_step));
            if let Drive::Known(value) = own[0] {
                next[first] = value;
                self.active.push(KNOWN);
            } else {
                self.active.extend(count..count + of.len());
                count += of.len();
                self.errors.resize(count, contact.error(speeds, h) + left);
                self.cones.push(cone);
                self.owners.push(*place);
            }
        }
        self.passes += 1;
        if self.is_relaxed {
            self.state_factor(W);
        } else {
            self.state(W, islands, island);
        }
        let solved = self.solve(contacts, W);
        if let Err(fault) = solved {
            let cone = match fault {
                ConeFault::Wedged { cone } => cone,
                _ => 0,
            };
            let element = contacts[self.owners[cone]].id.element;
            let element = elements[element as usize].name().to_owned();
            return Err(match fault {
                ConeFault::Wedged { .. } => ContactFault::Immovable { element }.into(),
                fault => ContactFault::Laws { element, fault }.into(),
            });
        }
        for (row, active) in self.all.iter().zip(&self.active) {
            if *active != KNOWN {
                next[*row] = self.found[*active];
            }
        }
        Ok(())
    }

    /// Solves the problem that is stated: Coulomb's laws, or convex ones.
    fn solve(&mut self, contacts: &[Contact], W: &mut Delassus) -> Result<(), ConeFault> {
        // solutions of few steps first, nearer ones later
        let rho = 10.0_f64.powi((1 + self.passes / 3).min(5) as i32);
        if self.is_relaxed {
            self.is_exact = self.proximal_step(rho);
            return Ok(());
        }
        let are_many = self.w.len() > MANY;
        let leads = self.passes <= if are_many { LEADS } else { EARLY };
        let beyond = if are_many && leads { BEYOND } else { f64::INFINITY };
        let Self { cones, W: own, sparse: (ends, places, values), w, errors, found, .. } = self;
        let solved = if self.all.len() > DENSE {
            self.large.end_early(Some(beyond));
            self.large.solve_within(cones, SparseRows { ends, places, values }, (w, errors), found)
        } else {
            self.solver.end_early((are_many || leads).then_some(beyond));
            self.solver.solve_within(cones, own, (w, errors), found)
        };
        self.is_exact = solved.is_ok();
        match solved {
            Err(ConeFault::NoConvergence { residual, .. }) => {
                self.failures += usize::from(!leads);
                let many = if self.failures <= FAILURES { MANY } else { FEW };
                let leads_on = leads && are_many && self.lead(contacts, W, rho)
                    || residual < NEARBY && (leads || self.w.len() <= many);
                if leads_on { Ok(()) } else { solved.map(|_| ()) }
            }
            solved => solved.map(|_| ()),
        }
    }

    /// Takes a proximal step of the convex laws with the slip of the last step, where all laws have
    /// a convex one.
    fn lead(&mut self, contacts: &[Contact], W: &mut Delassus, rho: f64) -> bool {
        for (cone, owner) in self.cones.iter_mut().zip(&self.owners) {
            match *cone {
                Cone::Sliding { .. } => return false,
                Cone::Friction { coefficient } => {
                    *cone = Cone::Convex { coefficient, speed: contacts[*owner].slip };
                }
                _ => {}
            }
        }
        W.factorize();
        self.state_factor(W);
        self.proximal_step(rho)
    }

    fn proximal_step(&mut self, rho: f64) -> bool {
        let Self { cones, sparse: (ends, places, values), w, found, convex, .. } = self;
        convex.step(cones, SparseRows { ends, places, values }, (w, rho), found).is_ok()
    }

    /// States the problem of the rows to be found: `L` of `W = L Lᵀ` and `w = ξ − W Λ`.
    fn state_factor(&mut self, W: &Delassus) {
        let Self { all, active, drives, sparse, w, found, lambda, columns, u, .. } = self;
        let (ends, places, values) = sparse;
        for vector in [&mut *values, w, found, u] {
            vector.clear();
        }
        ends.clear();
        places.clear();
        columns.clear();
        for ((row, drive), lambda) in all.iter().zip(&*drives).zip(&*lambda) {
            // y(Λ') = ξ + W (Λ' − Λ), where what is known of Λ' is part of ξ
            let less = match drive {
                Drive::Known(value) => lambda - value,
                Drive::Zero { .. } => *lambda,
            };
            for (column, value) in W.factor.row(*row) {
                if column >= columns.len() {
                    columns.resize(column + 1, u32::MAX);
                }
                if columns[column] == u32::MAX {
                    columns[column] = u.len() as u32;
                    u.push(0.0);
                }
                u[columns[column] as usize] += value * less;
            }
        }
        for (l, row) in all.iter().enumerate().filter(|(l, _)| active[*l] != KNOWN) {
            let Drive::Zero { xi, .. } = drives[l] else { continue };
            let mut rest = xi;
            for (column, value) in W.factor.row(*row) {
                places.push(columns[column]);
                values.push(value);
                rest -= value * u[columns[column] as usize];
            }
            ends.push(places.len());
            w.push(rest);
            found.push(lambda[l]);
        }
    }

    /// States the problem of the rows to be found: `W` and `w = ξ − W Λ`.
    fn state(&mut self, W: &Delassus, islands: &Islands, island: usize) {
        let m = self.all.len();
        let is_large = self.is_large();
        let Self { all, active, drives, W: own, sparse, w, found, model, lambda, .. } = self;
        let (response, by_step) = (&self.response, &self.by_step);
        let (ends, places, values) = sparse;
        own.clear();
        values.clear();
        w.clear();
        found.clear();
        ends.clear();
        places.clear();
        for l in (0..m).filter(|l| active[*l] != KNOWN) {
            let Drive::Zero { xi, compliance } = drives[l] else { continue };
            let mut rest = xi;
            let mut take = |j: usize, entry: f64| match drives[j] {
                Drive::Known(value) => rest += entry * (value - lambda[j]),
                Drive::Zero { .. } => {
                    let entry = if l == j { entry + compliance } else { entry };
                    if is_large {
                        places.push(active[j] as u32);
                        values.push(entry);
                    } else {
                        own.push(entry);
                    }
                    rest -= entry * lambda[j];
                }
            };
            if is_large {
                for (j, entry) in W.row(all[l]) {
                    if let Some(j) = islands.local(j, island) {
                        take(j, entry);
                    }
                }
                ends.push(places.len());
            } else {
                let responds = |j: usize| !response.is_empty() && by_step[l] && by_step[j];
                let entries = |j| if responds(j) { response[l * m + j] } else { model[l * m + j] };
                (0..m).for_each(|j| take(j, entries(j)));
            }
            w.push(rest);
            found.push(lambda[l]);
        }
    }
}

/// What dry friction of the steps beside an impact adds to its velocities [N7].
fn part_friction(contacts: &mut [Contact], W: &Delassus, places: &[usize]) {
    let is_hit = places.iter().any(|place| contacts[*place].kind == Kind::Impact);
    for place in places {
        let contact = &mut contacts[*place];
        contact.part(is_hit, W.at(contact.row, contact.row));
        contact.parted_velocity = [0.0; 3];
    }
    for friction in places {
        let Contact { row, .. } = contacts[*friction];
        let Some([first, last]) = contacts[*friction].parts() else { continue };
        for contact in places {
            let contact = &mut contacts[*contact];
            for i in 0..contact.law.rows() {
                let e = contact.reduction * contact.restitution_of(i);
                contact.parted_velocity[i] += W.at(contact.row + i, row) * (e * first - last);
            }
        }
    }
}
