//! The laws of an island at the last step, as one problem for the next impulses.
//!
//! ```text
//! y(Λ') = ξ + W_s (Λ' − Λ)
//! ```
//! `W_s` begins with `W` and learns from the steps of the iteration (BFGS): where `hω` is not small
//! springs and beams answer less than `W` says. An island of more than 300 rows keeps `W`, in
//! sparse rows, and its laws hold to `1e-11`.

use super::ContactFault;
use super::delassus::Delassus;
use super::islands::Islands;
use super::node_law::{Contact, Course, Drive, Rows};
use super::unilateral::Elements;
use crate::scheme::StepError;
use vi_core::cone::{Cone, ConeFault, ConeSolver, LargeConeSolver, SparseRows};

/// Changes below this part of impulses and velocities say nothing of `W_s` but rounding.
const LEAST: f64 = 1e-7;
/// `W_s` is corrected where it misses a change of velocities by more than this part.
const MISSED: f64 = 0.1;
/// A step far from its solution moves the points of a body apart by its rotation squared: no
/// impulses obey the laws then, and the nearest ones up to this part lead on.
const NEARBY: f64 = 1e-3;
/// In so many solutions of a step the nearest ones are not looked for any further.
const EARLY: usize = 4;
/// Most rows of a dense matrix.
const DENSE: usize = 300;

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
    model: Vec<f64>,       // m × m  W_s; empty of a large island
    lambda: Vec<f64>,      // m  Λ of the last step
    before: [Vec<f64>; 2], // m  Λ and ξ of the step before
    change: [Vec<f64>; 3], // m  ΔΛ, Δξ, W_s ΔΛ
    kinds: Vec<u8>,        // of the contacts in the step before
    is_exact: bool,
    passes: usize,
    is_known: bool, // whether there was a step before
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
        self.is_known = false;
        self.passes = 0;
    }

    /// Whether its laws hold to less than rounding.
    pub(super) fn is_large(&self) -> bool {
        self.all.len() > DENSE
    }

    /// Whether the laws hold at the impulses that were found.
    pub(super) fn is_exact(&self) -> bool {
        self.is_exact
    }

    /// Corrects `W_s` by the last two steps, where their laws are the same.
    fn learn(&mut self, kinds_agree: bool) {
        let Self { drives, model, lambda, before: [old, old_xi], change: [s, y, ws], .. } = self;
        let (k, lambda) = (lambda.len(), &lambda[..]);
        let xi = |drive: &Drive| match *drive {
            Drive::Zero { xi, compliance: 0.0 } => Some(xi),
            _ => None,
        };
        if self.is_known && kinds_agree && drives.iter().all(|drive| xi(drive).is_some()) {
            s.clear();
            s.extend(lambda.iter().zip(&*old).map(|(new, old)| new - old));
            y.clear();
            let found = drives.iter().filter_map(xi);
            y.extend(found.zip(&*old_xi).map(|(new, old)| new - old));
            ws.clear();
            let row = |i: usize| model[i * k..(i + 1) * k].iter();
            let product = |i: usize| row(i).zip(&*s).map(|(w, s)| w * s).sum::<f64>();
            ws.extend((0..k).map(product));
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (size, sy, sws) = (dot(lambda, lambda).max(dot(old, old)), dot(s, y), dot(s, ws));
            let trace: f64 = (0..k).map(|i| model[i * k + i]).sum();
            let is_large = dot(s, s) > LEAST * LEAST * size
                && dot(ws, ws) > LEAST * LEAST * trace * trace * dot(s, s);
            let missed: f64 = y.iter().zip(&*ws).map(|(y, ws)| (y - ws) * (y - ws)).sum();
            if is_large && missed > MISSED * MISSED * dot(ws, ws) && sy > 0.0 && sws > 0.0 {
                for i in 0..k {
                    for j in 0..k {
                        model[i * k + j] += y[i] * y[j] / sy - ws[i] * ws[j] / sws;
                    }
                }
            }
        }
        old.clear();
        old.extend_from_slice(lambda);
        old_xi.clear();
        old_xi.extend(drives.iter().map(|drive| xi(drive).unwrap_or(0.0)));
        self.is_known = true;
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
        let places = islands.contacts(island);
        let mut kinds_agree = self.kinds.len() == places.len();
        self.kinds.resize(places.len(), 0);
        let mut count = 0;
        for (kind, place) in self.kinds.iter_mut().zip(places) {
            let contact = &mut contacts[*place];
            let first = contact.row;
            let of = first..first + contact.law.rows();
            let [minus, plus, lambda] = [minus, plus, lambda].map(|all| &all[of.clone()]);
            let diagonal = W.at(first, first);
            let (own, cone) = contact.equations(Rows { minus, plus, lambda, w: diagonal });
            self.drives.extend_from_slice(&own[..of.len()]);
            let now = contact.kind as u8 + 2 * u8::from(contact.slides);
            let is_usual = matches!(contact.course, Course::Usual | Course::Plain);
            let now = now + 4 * u8::from(!is_usual);
            let now = now + 8 * u8::from(contact.turns);
            kinds_agree &= *kind == now;
            *kind = now;
            if let Drive::Known(value) = own[0] {
                next[first] = value;
                self.active.push(KNOWN);
            } else {
                self.active.extend(count..count + of.len());
                count += of.len();
                self.errors.resize(count, contact.error(speeds, h));
                self.cones.push(cone);
                self.owners.push(*place);
            }
        }
        if !self.is_large() {
            self.learn(kinds_agree);
        }
        self.state(W, islands, island);
        self.passes += 1;
        let Self { cones, W, sparse, w, errors, found, solver, large, .. } = self;
        let solved = if self.all.len() > DENSE {
            let (ends, places, values) = &*sparse;
            large.solve(cones, SparseRows { ends, places, values }, w, found)
        } else {
            solver.end_early(self.passes <= EARLY);
            solver.solve_within(cones, W, (w, errors), found)
        };
        self.is_exact = solved.is_ok();
        match solved {
            Ok(_) => {}
            Err(ConeFault::NoConvergence { residual, .. }) if residual < NEARBY => {}
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
                (0..m).for_each(|j| take(j, model[l * m + j]));
            }
            w.push(rest);
            found.push(lambda[l]);
        }
    }
}
