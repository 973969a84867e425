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
use vi_core::cone::{Cone, ConeFault, ConeSolver, LargeConeSolver, SparseRows};

/// A step far from its solution moves the points of a body apart by its rotation squared: no
/// impulses obey the laws then, and the nearest ones up to this part lead on.
const NEARBY: f64 = 1e-3;
/// In so many solutions of a step the nearest ones are not looked for any further.
pub(super) const EARLY: usize = 4;
/// What the node before leaves of the laws of a large island, relative to the largest velocity:
/// rows that `W` does not tell apart contradict one another by several times `LARGE`.
const LEFT: f64 = 4e-10;
/// Where all methods fail for more rows than this, a shorter step costs less than another solution.
const MANY: usize = 60;
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
    model: Vec<f64>,    // m × m  W; empty of a large island
    response: Vec<f64>, // m × m  W_s, where it is not W
    by_step: Vec<bool>, // m  whether the step drives a row, or the velocity at the node
    lambda: Vec<f64>,   // m  Λ of the last step
    is_exact: bool,
    passes: usize,
}

/// The impulse of a row is known.
const KNOWN: usize = usize::MAX;

/// The contacts of a node at the last step.
pub(super) struct Present<'a> {
    pub(super) contacts: &'a mut [Contact],
    pub(super) W: &'a Delassus,
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
        self.passes = 0;
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
        self.state(W, islands, island);
        self.passes += 1;
        let Self { cones, W, sparse, w, errors, found, solver, large, .. } = self;
        let solved = if self.all.len() > DENSE {
            let (ends, places, values) = &*sparse;
            large.end_early(self.passes <= EARLY);
            large.solve_within(cones, SparseRows { ends, places, values }, (w, errors), found)
        } else {
            solver.end_early(self.passes <= EARLY);
            solver.solve_within(cones, W, (w, errors), found)
        };
        self.is_exact = solved.is_ok();
        let leads_on = self.w.len() <= MANY || self.passes <= EARLY;
        match solved {
            Ok(_) => {}
            Err(ConeFault::NoConvergence { residual, .. }) if residual < NEARBY && leads_on => {}
            Err(fault) => {
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
        }
        for (row, active) in self.all.iter().zip(&self.active) {
            if *active != KNOWN {
                next[*row] = self.found[*active];
            }
        }
        Ok(())
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
