//! Stability of an equilibrium: the negative eigenvalues of its stiffness.
//!
//! ```text
//! n₋(ZᵀKZ),    B Z = 0        K of all frames and point masses, B the independent rows of joints     (Lagrange, Dirichlet)
//! ```
//! They are counted by the signs of the pivots of the bordered matrix ([`vi_core::inertia`]),
//! linear in the size of the system. What the rounding of the entries of `K` may hide counts as no
//! stiffness: `K + E` with the diagonal `E_ii = c ε Σ_j |K_ij| a_j/a_i` is counted, `a` the size of
//! an increment. Where `K` is not symmetric (followers, torques with fixed directions, control) a
//! positive definite symmetric part still excludes divergence. An indefinite one decides nothing:
//! the motions that grow are counted then ([`mod@crate::vibrations`]), dense. Flutter of an
//! equilibrium whose symmetric part is definite shows in its vibrations alone.
//!
//! Source: theory §6.9; W. T. Koiter, On the stability of elastic equilibrium (1945), ch. 1.
#![allow(non_snake_case)] // K, B

use crate::modes::StaticLinearization;
use crate::problem::StaticProblem;
use crate::vibrations::MotionKind;
use vi_core::inertia::negative_on_null_space;
use vi_core::sparse::SparseMatrix;

/// Rounding errors of an entry of the stiffness, with those of the configuration.
const ROUNDING: f64 = 1e3 * f64::EPSILON;
/// Degrees of freedom up to which an unsymmetric stiffness is judged.
const DENSE: usize = 150;

/// Part of `|λ|` from which an imaginary part is that of a vibration.
const VIBRATES: f64 = 1e-6;

/// The stiffness at an equilibrium.
pub(crate) struct TangentStiffness {
    K: SparseMatrix,
    B: SparseMatrix,
    noise: Vec<f64>,  // E
    metric: Vec<f64>, // S
}

impl TangentStiffness {
    pub(crate) fn new(K: SparseMatrix, B: SparseMatrix, metric: &[f64]) -> Self {
        let mut noise = vec![0.0; metric.len()];
        K.for_each(|i, j, value| {
            noise[i] += ROUNDING * value.abs() * (metric[i] / metric[j]).sqrt();
        });
        Self { K, B, noise, metric: metric.to_vec() }
    }

    fn dof(&self) -> usize {
        self.K.shape().0.saturating_sub(self.B.shape().0)
    }

    /// Whether entries across the diagonal differ by no more than rounding.
    pub(crate) fn is_symmetric(&self) -> bool {
        let (rows, columns) = self.K.shape();
        let difference = SparseMatrix::assemble(rows, columns, |out| {
            self.K.for_each(|i, j, value| {
                out.add(i, j, value);
                out.add(j, i, -value);
            });
        });
        let mut symmetric = true;
        difference.for_each(|i, j, value| {
            symmetric &= value.abs() <= (self.noise[i] * self.noise[j]).sqrt();
        });
        symmetric
    }

    /// Negative eigenvalues of `K + σS` that are no round-off.
    pub(crate) fn negative(&self, sigma: f64) -> Option<usize> {
        let (rows, columns) = self.K.shape();
        let shifted = SparseMatrix::assemble(rows, columns, |out| {
            self.K.emit(out);
            for (i, (noise, metric)) in self.noise.iter().zip(&self.metric).enumerate() {
                out.add(i, i, noise + sigma * metric);
            }
        });
        negative_on_null_space(&shifted, &self.B)
    }
}

impl StaticProblem {
    /// How many independent motions leave the last equilibrium by themselves: the negative
    /// eigenvalues of its stiffness; where that is neither symmetric nor definite the motions that
    /// grow. `None` where that is not known: in a steady rotation, where gyroscopic forces may hold
    /// what the stiffness does not ([`crate::vibrations()`] knows), and for a large system whose
    /// stiffness is not symmetric.
    pub fn unstable_directions(&mut self) -> Option<usize> {
        let stiffness = self.stiffness()?;
        let negative = stiffness.negative(0.0);
        if negative == Some(0) || stiffness.is_symmetric() {
            return negative;
        }
        if stiffness.dof() > DENSE {
            return None;
        }
        let motions = StaticLinearization::all(self).ok()?.vibrations().ok()?;
        Some(motions.count(MotionKind::Growth))
    }

    /// Whether what grows from the last equilibrium vibrates: flutter, by forces without a
    /// potential. Where a motion grows without a vibration, too, it is divergence: a stiffness has
    /// vanished. Of a large system as of one whose stiffness is symmetric.
    pub fn flutters(&mut self) -> bool {
        let Some(stiffness) = self.stiffness() else { return false };
        if stiffness.is_symmetric() || stiffness.dof() > DENSE {
            return false;
        }
        let motions =
            StaticLinearization::all(self).ok().and_then(|linear| linear.vibrations().ok());
        motions.is_some_and(|motions| {
            let growing = motions.count(MotionKind::Growth);
            let vibrates = |k| {
                let value = motions.get(MotionKind::Growth, k).map(|own| own.value);
                value.is_some_and(|value| value.im.abs() > VIBRATES * value.norm())
            };
            growing > 0 && (0..growing).all(vibrates)
        })
    }

    /// At the last equilibrium; `None` in a steady rotation.
    pub(crate) fn stiffness(&mut self) -> Option<TangentStiffness> {
        if self.work.is_rotating() {
            return None;
        }
        let d = self.work.unknowns();
        self.x[..d].fill(0.0);
        self.x[d..].copy_from_slice(&self.mu);
        let mut r = vec![0.0; self.x.len()];
        self.work.evaluate(&self.x, &mut r).ok()?;
        let (K, B) = self.work.frame_stiffness();
        Some(TangentStiffness::new(K, B, self.work.metric()))
    }
}
