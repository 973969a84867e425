//! Strains that a Galerkin step interpolates between its control points.
//!
//! ```text
//! V = W(ε(q)):    U_d(q_0 … q_s) = Σ_k b_k W(Σ_j E_kj ε(q_j))                                   [6.33]
//! ```
//! The control points lie on the constraint manifold, the interpolated configurations `Q_k` do not:
//! there the directors of a rotating frame are shrunk, and a stiff element would be stretched.
//! Interpolated strains do not see rigid motions.

use crate::galerkin::GaussLobatto;
use crate::interval::Interval;
use crate::sparse::Entries;

/// The polynomial of a step: its control points with its constants.
#[derive(Clone, Copy, Debug)]
pub struct StepPolynomial<'a> {
    /// The constants of its degree.
    pub constants: &'a GaussLobatto,
    /// `(q_n, q_j)`, `j = 1 … s`; the last one is the step.
    pub points: &'a [Interval],
}

impl<'a> StepPolynomial<'a> {
    /// `s`.
    #[must_use]
    pub fn stages(&self) -> usize {
        self.points.len()
    }

    /// The step `(q_n, q_{n+1})`.
    #[must_use]
    pub fn step(&self) -> &'a Interval {
        &self.points[self.points.len() - 1]
    }

    /// `h`, s.
    #[must_use]
    pub fn h(&self) -> f64 {
        self.step().h
    }

    /// `q_i`, `i = 0 … s`, shape `n`.
    #[must_use]
    pub fn q(&self, i: usize) -> &'a [f64] {
        if i == 0 { &self.step().q0 } else { &self.points[i - 1].q1 }
    }
}

/// A potential of strains, a force of strain rates, or a system of such, on the polynomial of a
/// step.
pub trait StrainInterpolation {
    /// `U_d`, J; zero for forces.
    fn energy(&self, _step: &StepPolynomial<'_>) -> f64 {
        0.0
    }
    /// The work of a force in the step, J; zero for potentials.
    fn work(&self, _step: &StepPolynomial<'_>) -> f64 {
        0.0
    }
    /// `out ← out +` the change of `−h ∂U_d/∂q_i + f_i` with a step that changes by `dh`, at fixed
    /// control points; shape `n`.
    fn add_step_slope(&self, step: &StepPolynomial<'_>, i: usize, dh: f64, out: &mut [f64]);
    /// `out_i ← out_i − h ∂U_d/∂q_i + f_i`, N·s, `i = 0 … s`, each of shape `n`.
    fn add_impulses(&self, step: &StepPolynomial<'_>, out: &mut [Vec<f64>]);
    /// Emits `scale ∂(−h ∂U_d/∂q_i + f_i)/∂q_j`, `(i, j) = at`; always the same places in the same
    /// order.
    fn add_derivative(
        &self,
        step: &StepPolynomial<'_>,
        at: (usize, usize),
        scale: f64,
        out: &mut dyn Entries,
    );
}
