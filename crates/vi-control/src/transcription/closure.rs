//! Constraints on the tree that a program has as rows, each with an impulse.
//!
//! ```text
//! g_c(q) = 0              a product of linear forms [5.2]; w_n ∋ −hλ_n ∇g_c(q_n)
//! Σ f_j x_j = c(t)        gears, threads, prescribed motions of unknowns x of the tree that add up;
//!                         r_n ∋ −hλ_n f_j e_j, no second derivative
//! ```

use super::problem::{ProblemError, Uncovered};
use vi_multibody::Mechanism;
use vi_multibody::form::BilinearRow;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::scalar_constraint::{Reference, ScalarRow};

/// A constraint on the tree.
#[derive(Debug)]
pub(super) enum TreeClosure {
    /// A product of linear forms.
    Product(BilinearRow),
    /// A sum of unknowns.
    Along(LinearClosure),
}

/// `Σ f_j x_j = c(t)`.
pub(super) struct LinearClosure {
    /// Unknowns with their factors.
    factors: Vec<(usize, f64)>,
    /// `c(t)`, where it changes.
    reference: Option<(Reference, f64)>, // with the time of the start
}

impl std::fmt::Debug for LinearClosure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Along").field("factors", &self.factors).finish_non_exhaustive()
    }
}

impl TreeClosure {
    /// Of a row of a mechanism that is met at the start, at the time `t`, s.
    ///
    /// # Errors
    /// [`ProblemError::NotCovered`] of constraints of velocities, and of joint coordinates that are
    /// no unknowns of the tree.
    pub(super) fn of(row: ScalarRow, mechanism: &Mechanism, t: f64) -> Result<Self, ProblemError> {
        let of_unknown = |own: &JointCoordinate, factor: f64| {
            let joints = &mechanism.description().joints;
            let of = own.place().and_then(|(joint, freedom)| {
                mechanism.tree().unknown_of(joints.get(joint)?, freedom)
            });
            let unknown = of.ok_or(ProblemError::NotCovered(Uncovered::Constraints))?;
            Ok::<_, ProblemError>((unknown.index, unknown.sign * factor))
        };
        Ok(match row {
            ScalarRow::Product(row) => Self::Product(row),
            ScalarRow::Gear { a, b, ratio, .. } => {
                let factors = vec![of_unknown(&a, 1.0)?, of_unknown(&b, ratio)?];
                Self::Along(LinearClosure { factors, reference: None })
            }
            ScalarRow::Motion { coordinate, reference } => {
                let factors = vec![of_unknown(&coordinate, 1.0)?];
                Self::Along(LinearClosure { factors, reference: Some((reference, t)) })
            }
            ScalarRow::Height(_) | ScalarRow::Velocity(_) => {
                return Err(ProblemError::NotCovered(Uncovered::Constraints));
            }
        })
    }

    /// Its product of linear forms, if it is one.
    pub(super) fn product(&self) -> Option<&BilinearRow> {
        match self {
            Self::Product(row) => Some(row),
            Self::Along(_) => None,
        }
    }

    /// Whether it changes with the time by itself.
    pub(super) fn is_of_time(&self) -> bool {
        matches!(self, Self::Along(LinearClosure { reference: Some(_), .. }))
    }
}

impl LinearClosure {
    /// `Σ f_j x_j − c(t)` where the unknowns have changed by so much since the start, at which it
    /// is zero.
    pub(super) fn value(&self, t: f64, traveled: impl Fn(usize) -> f64) -> f64 {
        let moved: f64 = self.factors.iter().map(|(j, factor)| factor * traveled(*j)).sum();
        let followed = self.reference.as_ref().map_or(0.0, |(own, from)| own(t)[0] - own(*from)[0]);
        moved - followed
    }

    /// `f`, shape `d`.
    pub(super) fn slope(&self, d: usize) -> Vec<f64> {
        let mut slope = vec![0.0; d];
        self.factors.iter().for_each(|(j, factor)| slope[*j] += factor);
        slope
    }
}
