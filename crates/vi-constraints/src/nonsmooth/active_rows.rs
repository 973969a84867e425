//! The laws at the last step, as one problem for the next impulses.
//!
//! ```text
//! y(Λ') = ξ + W_s (Λ' − Λ)
//! ```
//! `W_s` begins with `W` and learns from the steps of the iteration (BFGS): where `hω` is not small
//! springs and beams answer less than `W` says.

use super::ContactFault;
use super::node_law::{Contact, Course, Drive, Rows};
use super::unilateral::Elements;
use crate::scheme::StepError;
use vi_core::cone::{Cone, ConeFault, ConeSolver};

/// Changes below this part of impulses and velocities say nothing of `W_s` but rounding.
const LEAST: f64 = 1e-7;
/// `W_s` is corrected where it misses a change of velocities by more than this part.
const MISSED: f64 = 0.1;
/// A step far from its solution moves the points of a body apart by its rotation squared: no
/// impulses obey the laws then, and the nearest ones up to this part lead on.
const NEARBY: f64 = 1e-3;
/// In so many solutions of a step the nearest ones are not looked for any further.
const EARLY: usize = 4;

/// The rows whose impulses are not known beforehand.
#[derive(Debug, Default)]
pub(super) struct ActiveRows {
    rows: Vec<usize>,
    drives: Vec<Drive>, // k
    cones: Vec<Cone>,
    owners: Vec<usize>, // contacts of the cones
    W: Vec<f64>,
    w: Vec<f64>,
    lambda: Vec<f64>,
    solver: ConeSolver,
    model: Vec<f64>,       // k × k  W_s
    before: [Vec<f64>; 2], // k  Λ and ξ of the step before
    change: [Vec<f64>; 3], // k  ΔΛ, Δξ, W_s ΔΛ
    kinds: Vec<u8>,        // of the contacts in the step before
    /// Whether the laws hold at the impulses that were found.
    pub(super) is_exact: bool,
    passes: usize,
    is_known: bool, // whether there was a step before
}

/// The contacts of a node at the last step.
pub(super) struct Present<'a> {
    pub(super) contacts: &'a mut [Contact],
    pub(super) W: &'a [f64],
    pub(super) minus: &'a [f64],
    pub(super) plus: &'a [f64],
    pub(super) lambda: &'a [f64],
    pub(super) next: &'a mut [f64],
}

impl ActiveRows {
    /// An iteration begins.
    pub(super) fn begin(&mut self, W: &[f64]) {
        self.model.clear();
        self.model.extend_from_slice(W);
        self.is_known = false;
        self.passes = 0;
    }

    /// Corrects `W_s` by the last two steps, where their laws are the same.
    fn learn(&mut self, lambda: &[f64], kinds_agree: bool) {
        let Self { drives, model, before: [old, old_xi], change: [s, y, ws], .. } = self;
        let k = lambda.len();
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

    /// `next`: the impulses by the laws at the last step.
    pub(super) fn next_impulses(
        &mut self,
        present: Present<'_>,
        elements: &Elements,
    ) -> Result<(), StepError> {
        let (Present { contacts, W, minus, plus, lambda, next }, problem) = (present, self);
        let k = minus.len();
        problem.rows.clear();
        problem.drives.clear();
        problem.cones.clear();
        problem.owners.clear();
        let mut kinds_agree = problem.kinds.len() == contacts.len();
        problem.kinds.resize(contacts.len(), 0);
        for (place, contact) in contacts.iter_mut().enumerate() {
            let first = contact.row;
            let of = first..first + contact.law.rows();
            let [minus, plus, lambda] = [minus, plus, lambda].map(|all| &all[of.clone()]);
            let diagonal = W[first * k + first];
            let (own, cone) = contact.equations(Rows { minus, plus, lambda, w: diagonal });
            problem.drives.extend_from_slice(&own[..of.len()]);
            let kind = contact.kind as u8 + 2 * u8::from(contact.slides);
            let kind = kind + 4 * u8::from(contact.course != Course::Usual);
            kinds_agree &= problem.kinds[place] == kind;
            problem.kinds[place] = kind;
            if let Drive::Known(value) = own[0] {
                next[first] = value;
            } else {
                problem.rows.extend(of);
                problem.cones.push(cone);
                problem.owners.push(place);
            }
        }
        problem.learn(lambda, kinds_agree);
        let Self {
            rows,
            drives,
            cones,
            owners,
            W: own_W,
            w,
            lambda: own,
            solver,
            model,
            is_exact,
            passes,
            ..
        } = problem;
        own_W.clear();
        w.clear();
        own.clear();
        for &i in &*rows {
            let Drive::Zero { xi, compliance } = drives[i] else { continue };
            let mut rest = xi;
            for (j, drive) in drives.iter().enumerate() {
                let entry = model[i * k + j];
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
        *passes += 1;
        solver.end_early(*passes <= EARLY);
        let solved = solver.solve(cones, own_W, w, own);
        *is_exact = solved.is_ok();
        match solved {
            Ok(_) => {}
            Err(ConeFault::NoConvergence { residual, .. }) if residual < NEARBY => {}
            Err(fault) => {
                let cone = match fault {
                    ConeFault::Wedged { cone } => cone,
                    _ => 0,
                };
                let element = contacts[owners[cone]].id.element;
                let element = elements[element as usize].name().to_owned();
                return Err(match fault {
                    ConeFault::Wedged { .. } => ContactFault::Immovable { element }.into(),
                    fault => ContactFault::Laws { element, fault }.into(),
                });
            }
        }
        rows.iter().zip(&*own).for_each(|(&i, value)| next[i] = *value);
        Ok(())
    }
}
