//! The stresses of the tangent: Newton's method of the mixed equations.
//!
//! ```text
//! r(u) = P_inᵀ(Σ w C ε·∇ε − f + …)        the residual is true
//! K(ν) = Pᵀ(Σ w ∇ε C ∇εᵀ + Σ w ν·∇²ε + …)P + spin of the forces with ν,    ν ← C (ε + ∇ε·δq)
//! ```
//! The first tangent of a solve has the stresses `ν = C ε` of the configuration. A correction `δq`
//! that bends a slender beam stretches its chord by `θ²/2`; with the tension `EA θ²/2` the next
//! tangent would hold it there. The stresses that follow the linearized strains do not know that
//! tension: the steps are those of Newton's method for displacements and stresses, the stresses
//! eliminated in each element, so they converge as squares.
//!
//! Source: theory §6.9; D. Magisano, L. Leonetti, G. Garcea, Comput. Methods Appl. Mech. Eng. 313
//! (2017) 986–1005.

use super::EquilibriumEquations;
use std::borrow::Cow;
use vi_core::newton::Precision;

impl EquilibriumEquations {
    /// `ν ← C (ε + ∇ε·δq)` with the correction `u ← u − du` at the point last evaluated; `du`:
    /// those of all unknowns, `u` first. Premise: the tangent has been filled.
    pub(crate) fn follow_stresses(&mut self, du: &[f64]) {
        if !self.has_strains() {
            return;
        }
        let (d, q) = (self.unknowns(), &self.s.q1);
        let du: Vec<f64> = du[..d].iter().map(|du| -du).collect();
        let mut dq = vec![0.0; q.len()];
        self.layout.velocity(&self.right, &du, &mut dq);
        let mut sigma = self.stresses();
        let rates = self.stress_rates(&dq);
        sigma.iter_mut().zip(&rates).for_each(|(sigma, rate)| *sigma += rate);
        self.tangent_stresses = Some(sigma);
    }

    fn has_strains(&self) -> bool {
        self.system.strain_energies().any(|energy| energy.stress_count() > 0)
    }

    /// `C ε` at the point last evaluated, of all elements.
    pub(crate) fn stresses(&self) -> Vec<f64> {
        let mut sigma = Vec::new();
        for energy in self.system.strain_energies() {
            let start = sigma.len();
            sigma.resize(start + energy.stress_count(), 0.0);
            energy.stresses(&self.s.q1, &mut sigma[start..]);
        }
        sigma
    }

    /// `C ∇ε·v` at the point last evaluated, of all elements.
    pub(crate) fn stress_rates(&self, v: &[f64]) -> Vec<f64> {
        let mut rates = Vec::new();
        for energy in self.system.strain_energies() {
            let start = rates.len();
            rates.resize(start + energy.stress_count(), 0.0);
            energy.stress_rates(&self.s.q1, v, &mut rates[start..]);
        }
        rates
    }

    /// `out ← out + Σ w σ·∇ε` at the point last evaluated, N.
    pub(crate) fn add_stress_force(&self, mut sigma: &[f64], out: &mut [f64]) {
        for energy in self.system.strain_energies() {
            let (own, rest) = sigma.split_at(energy.stress_count());
            energy.add_stress_force(&self.s.q1, own, 1.0, out);
            sigma = rest;
        }
    }

    /// `w` with the stresses of the tangent, N.
    pub(super) fn tangent_force(&self) -> Cow<'_, [f64]> {
        let Some(nu) = &self.tangent_stresses else {
            return Cow::Borrowed(&self.force);
        };
        let change: Vec<f64> = nu.iter().zip(self.stresses()).map(|(nu, own)| nu - own).collect();
        let mut force = self.force.clone();
        self.add_stress_force(&change, &mut force);
        Cow::Owned(force)
    }

    /// Corrections alone are judged where there are strains: those of axial forces rule the
    /// residual of a slender beam.
    pub(crate) fn precision(&self) -> Precision {
        Precision { is_judged_by_corrections: self.has_strains(), ..Precision::default() }
    }
}
