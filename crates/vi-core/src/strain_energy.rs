//! Elastic energies of strains with their stresses apart.
//!
//! ```text
//! V = ½ Σ w ε·C ε,    ∇V = Σ w σ·∇ε,    ∇²V = Σ w (∇ε C ∇εᵀ + σ·∇²ε),    σ = C ε          w: length or weight
//! ```
//! Newton's method of the mixed equations `∇V = Σ w ν·∇ε`, `ν = C ε` (Hellinger, Reissner) takes
//! its tangent with the stresses `ν` that follow the linearized strains, `ν ← C (ε + ∇ε·δq)`: a
//! slender beam that a correction has bent is then not held by the tension of its stretched chord.

use crate::sparse::Entries;

/// The elastic energy of strains, some stresses `σ` for each of them.
pub trait StrainEnergy: Send + Sync {
    /// How many stresses there are.
    fn stress_count(&self) -> usize;
    /// `σ ← C ε(q)`, shape [`StrainEnergy::stress_count`].
    fn stresses(&self, q: &[f64], sigma: &mut [f64]);
    /// `σ ← C ∇ε(q)·v`.
    fn stress_rates(&self, q: &[f64], v: &[f64], sigma: &mut [f64]);
    /// `out ← out + scale Σ w σ·∇ε(q)`, shape `n`.
    fn add_stress_force(&self, q: &[f64], sigma: &[f64], scale: f64, out: &mut [f64]);
    /// Emits `scale Σ w (∇ε C ∇εᵀ + σ·∇²ε)`; the same places in the same order as the Hessian.
    fn add_stressed_hessian(&self, q: &[f64], sigma: &[f64], scale: f64, out: &mut dyn Entries);
    /// Emits `scale Σ w σ·∇²ε` alone; the same places in the same order.
    fn add_geometric_stiffness(&self, q: &[f64], sigma: &[f64], scale: f64, out: &mut dyn Entries);
}
