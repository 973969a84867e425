//! Discrete derivatives `D̄V(q_n, q_{n+1})` of potentials.
//!
//! ```text
//! directionality   D̄V(q_n, q_{n+1})·Δq = V(q_{n+1}) − V(q_n)
//! consistency      D̄V(q, q) = ∇V(q)
//! symmetry         D̄V(q_n, q_{n+1}) = D̄V(q_{n+1}, q_n)
//! equivariance     ξ_{R^n}(q_{n+1/2})·D̄V = 0 for every symmetry ξ of V
//! ```
//! Directionality makes the scheme conserve energy, symmetry gives order 2, equivariance conserves
//! the momentum map. Linear potentials are their own discrete derivative (here). Functions of
//! quadratic invariants have an exact and equivariant one ([`crate::invariant`]). Everything else is
//! served by the formula of [`crate::gonzalez`], which is equivariant under no more than happens to
//! be so. Beam elements implement the trait where their strains are known:
//! `D̄V = Σ_e ℓ Σ_i C_i ε̄_i 𝔹_i x_{n+1/2}`, theory of Betsch & Leyendecker 2006.
//!
//! Letters: `V` potential (J), `D̄V` discrete derivative, shape `n` (N for positions, N·m for
//! directors). Source: Gonzalez, J. Nonlinear Sci. 6 (1996) 449–467 (G96).

use vi_core::interval::Interval;
use vi_core::potential::{LinearPotential, Potential};
use vi_core::sparse::Entries;

/// A potential with a discrete derivative.
///
/// Open for extension; an implementation may keep scratch behind interior mutability, so a system is
/// `Send` but not shared between threads.
pub trait DiscreteGradient: Send {
    /// `V(q)`, J.
    fn potential(&self, q: &[f64]) -> f64;
    /// `out ← out + scale D̄V(q_n, q_{n+1})`, shape `n`.
    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]);
    /// Emits `scale ∂D̄V/∂q_{n+1}`, shape `n × n`, in general not symmetric; always the same places
    /// in the same order.
    fn add_derivative(&self, s: &Interval, scale: f64, out: &mut dyn Entries);
}

/// `V = −w·q`, gravity for one: `D̄V = −w`.
impl DiscreteGradient for LinearPotential {
    fn potential(&self, q: &[f64]) -> f64 {
        self.value(q)
    }
    fn add(&self, s: &Interval, scale: f64, out: &mut [f64]) {
        self.add_gradient(&s.q_mid, scale, out);
    }
    fn add_derivative(&self, _s: &Interval, _scale: f64, _out: &mut dyn Entries) {}
}
