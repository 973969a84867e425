//! Strains in Galerkin steps, interpolated between the control points.
//!
//! ```text
//! U_d      = Σ_e ½ ℓ Σ_jl S_jl ε(q_j)ᵀC ε(q_l),       S = Eᵀ diag(b) E                   [6.33]
//! ∂U_d/∂q_j = ℓ Σ_i [C Σ_l S_jl ε(q_l)]_i ∇ε_i(q_j)
//! f_j      = −Σ_e ℓ Σ_i [V Σ_l N_jl ε(q_l)]_i ∇ε_i(q_j),      N = Eᵀ diag(b) D                   [6.34]
//! work     = −(1/h) Σ_e ℓ Σ_jl K_jl ε(q_j)ᵀV ε(q_l)
//! ```
//! `s = 1` is the averaged strain of [`crate::averaged`] and the damping of [`crate::damping`] with
//! `θ = 0`. The order is `2s`, as with `V(Q_k)`: the node polynomial of the control points is
//! orthogonal to all of degree `s − 2`, so that exchanging interpolation and strain costs
//! `O(h^{2s+1})` of the action. Rigid motions of the control points are free of strain, so linear
//! and angular momentum are exact. The linear vibration is the diagonal Padé approximation: stable
//! for every step. With even `s` a mode far beyond the step, `hω ≫ 1`, does not alternate but turns
//! slowly, and smooth loads can excite it: odd `s` for stiff beams.
//!
//! Letters: `C_i` stiffnesses, `τ_i` relaxation times (s), `ℓ` length,
//! `𝔹_i q` strain gradients.
#![allow(non_snake_case)] // C, S, N, K

use crate::averaged::AveragedStrains;
use crate::damping::StrainDamping;
use crate::small::times;
use crate::strain::Strain;
use crate::strained::Strained;
use nalgebra::{DMatrix, Matrix6, Vector6};
use vi_core::Number;
use vi_core::galerkin::Stages;
use vi_core::interpolation::{StepPolynomial, StrainInterpolation};
use vi_core::sparse::Entries;

/// `ε(q_j)`, `j = 0 … s`.
fn strains(own: &Strained<'_>, step: &StepPolynomial<'_>) -> [Strain; Stages::MAX + 1] {
    let at = |j: usize| if j <= step.stages() { own.strain(step.q(j)) } else { Strain::zeros() };
    std::array::from_fn(at)
}

/// `Σ_l A_jl ε(q_l)`.
pub(crate) fn row<T: Number>(A: &DMatrix<f64>, j: usize, strains: &[Vector6<T>]) -> Vector6<T> {
    let weights = A.row(j);
    let parts = strains.iter().zip(weights.iter());
    parts.fold(Vector6::zeros(), |sum, (strain, weight)| sum + times(*weight, strain))
}

/// `Σ c_i Σ_jl A_jl ε_i(q_j) ε_i(q_l)`.
fn form(A: &DMatrix<f64>, c: &Matrix6<f64>, strains: &[Strain]) -> f64 {
    (0..A.nrows()).map(|j| (c * row(A, j, strains)).dot(&strains[j])).sum()
}

/// `out_j ← out_j + Σ_e Σ_i c_i Σ_l A_jl ε_i(q_l) 𝔹_i q_j`.
fn add_impulses<'a>(
    all: impl Iterator<Item = Strained<'a>>,
    A: &DMatrix<f64>,
    step: &StepPolynomial<'_>,
    c: impl Fn(&Strained<'_>) -> Matrix6<f64>,
    out: &mut [Vec<f64>],
) {
    for own in all {
        let (c, strains) = (c(&own), strains(&own, step));
        for (j, out) in out.iter_mut().enumerate() {
            own.add(step.q(j), &(c * row(A, j, &strains)), out);
        }
    }
}

/// Emits the derivative of the impulse `j` of [`add_impulses`] by `q_l`.
fn add_derivative<'a>(
    all: impl Iterator<Item = Strained<'a>>,
    A: &DMatrix<f64>,
    step: &StepPolynomial<'_>,
    c: impl Fn(&Strained<'_>) -> Matrix6<f64>,
    at: (usize, usize),
    out: &mut dyn Entries,
) {
    let (j, l) = at;
    for own in all {
        let (c, q) = (c(&own), (step.q(j), step.q(l)));
        if j == l {
            let n = c * row(A, j, &strains(&own, step));
            own.emit(q.0, &(A[(j, l)] * c), &n, out);
        } else {
            own.emit_outer(q.0, q.1, &(A[(j, l)] * c), out);
        }
    }
}

/// `U_d` [6.33].
impl StrainInterpolation for AveragedStrains {
    fn energy(&self, step: &StepPolynomial<'_>) -> f64 {
        let mut energy = 0.0;
        for own in self.elements.strained() {
            energy += 0.5 * form(&step.constants.S, &own.stiffness(), &strains(&own, step));
        }
        energy
    }

    fn add_step_slope(&self, step: &StepPolynomial<'_>, i: usize, dh: f64, out: &mut [f64]) {
        for own in self.elements.strained() {
            let n = own.stiffness() * row(&step.constants.S, i, &strains(&own, step));
            own.add(step.q(i), &(-dh * n), out);
        }
    }

    fn add_impulses(&self, step: &StepPolynomial<'_>, out: &mut [Vec<f64>]) {
        let h = step.h();
        add_impulses(
            self.elements.strained(),
            &step.constants.S,
            step,
            |own| -h * own.stiffness(),
            out,
        );
    }

    fn add_derivative(
        &self,
        step: &StepPolynomial<'_>,
        at: (usize, usize),
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let c = |own: &Strained<'_>| -scale * step.h() * own.stiffness();
        add_derivative(self.elements.strained(), &step.constants.S, step, c, at, out);
    }
}

impl StrainInterpolation for StrainDamping {
    fn work(&self, step: &StepPolynomial<'_>) -> f64 {
        let mut work = 0.0;
        for own in self.all_damped() {
            work -= form(&step.constants.K, &own.viscosity(), &strains(&own, step)) / step.h();
        }
        work
    }

    /// `N` knows no step.
    fn add_step_slope(&self, _: &StepPolynomial<'_>, _: usize, _: f64, _: &mut [f64]) {}

    fn add_impulses(&self, step: &StepPolynomial<'_>, out: &mut [Vec<f64>]) {
        let c = |own: &Strained<'_>| -own.viscosity();
        add_impulses(self.all_damped(), &step.constants.N, step, c, out); // [6.34]
    }

    fn add_derivative(
        &self,
        step: &StepPolynomial<'_>,
        at: (usize, usize),
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let c = |own: &Strained<'_>| -scale * own.viscosity();
        add_derivative(self.all_damped(), &step.constants.N, step, c, at, out);
    }
}
