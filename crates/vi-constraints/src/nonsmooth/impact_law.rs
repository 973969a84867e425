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

use super::node_law::Contact;
use super::unilateral::ContactLaw;
use super::{ContactFault, delassus::Delassus};
use crate::scheme::StepError;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use vi_core::cone::{Cone, ConeFault, ConeSolver};

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
    pub(super) rows: Vec<usize>, // m  of the node
    W: Vec<f64>,                 // m × m
    w: Vec<f64>,                 // m
    pub(super) lambda: Vec<f64>, // m
}

impl VelocityProblem {
    /// Of these contacts, with `w` of each row.
    pub(super) fn open<'a>(
        &mut self,
        contacts: impl Iterator<Item = &'a Contact>,
        W: &Delassus,
        w: impl Fn(usize) -> f64,
    ) {
        self.state(contacts.map(|own| (own.cone(), own.row..own.row + own.law.rows())), W, w);
    }

    /// The same of their normals alone.
    pub(super) fn open_normals<'a>(
        &mut self,
        contacts: impl Iterator<Item = &'a Contact>,
        W: &Delassus,
        w: impl Fn(usize) -> f64,
    ) {
        self.state(contacts.map(|own| (Cone::Normal, own.row..own.row + 1)), W, w);
    }

    /// Which of the contacts no motion opens together: places among those that were stated.
    pub(super) fn wedged(&mut self) -> Vec<usize> {
        const PART: f64 = 1e-6; // of the largest of the impulses that balance one another
        let Self { solver, cones, W, w, lambda, .. } = self;
        match solver.solve(cones, W, w, lambda) {
            Err(ConeFault::Wedged { .. }) => {
                (0..lambda.len()).filter(|place| lambda[*place] > PART).collect()
            }
            _ => Vec::new(),
        }
    }

    fn state(
        &mut self,
        laws: impl Iterator<Item = (Cone, Range<usize>)>,
        W: &Delassus,
        w: impl Fn(usize) -> f64,
    ) {
        self.cones.clear();
        self.rows.clear();
        for (cone, rows) in laws {
            self.cones.push(cone);
            self.rows.extend(rows);
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

    pub(super) fn solve(&mut self, name: &str) -> Result<(), StepError> {
        let Self { solver, cones, W, w, lambda, .. } = self;
        match solver.solve(cones, W, w, lambda) {
            Ok(_) => Ok(()),
            Err(fault) => Err(ContactFault::Laws { element: name.to_owned(), fault }.into()),
        }
    }

    /// `½ Λ·(U⁺ + U⁻)` and the size of its terms, J; `before`: `U⁻` of the node.
    pub(super) fn work(&self, before: &[f64]) -> [f64; 2] {
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
    pub(super) fn may_collide(&self) -> bool {
        !matches!(self.law, ContactLaw::Dry { .. }) && (self.is_hit || self.is_closed())
    }

    fn cone(&self) -> Cone {
        match self.law {
            ContactLaw::Coulomb { .. } => Cone::Friction { coefficient: self.coefficient() },
            _ => Cone::Normal,
        }
    }

    /// `e` of its normal row, `e_T` of the others.
    pub(super) fn restitution_of(&self, row: usize) -> f64 {
        match self.law {
            ContactLaw::Coulomb { tangential_restitution, .. } if row > 0 => tangential_restitution,
            law => law.restitution().unwrap_or(0.0),
        }
    }
}
