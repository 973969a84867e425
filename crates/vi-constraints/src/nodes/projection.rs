//! The projections at a node `(t_n, q_n)`, all memory sized once.
//!
//! ```text
//! R_dᵀ w = μ/h  :  GᵀG y = w,  μ = G y               R_d = G_dᵀ (G_d G_dᵀ)⁻¹,  G_d = h G        (37), (38)
//! Q w    = M v̂  :  [M Gᵀ; G 0](v̂, μ) = (w, 0),      Q = I − Gᵀ (G M⁻¹ Gᵀ)⁻¹ G M⁻¹              (16)
//! v̂             :  [M Gᵀ; G 0](v̂, μ) = (p, −∂g/∂t)
//! λ(a)          :  [M Gᵀ; G 0](a, λ) = (f − ∇V, −d²g/dt² + G a)                acceleration level
//! ```
//! No `M⁻¹` is formed: where `M` is singular, `M v̂` is `M P (PᵀMP)⁻¹ Pᵀ w`, the same projection.
//! Redundant constraints: the force `Gᵀλ` is unique, the multipliers are given in their
//! minimum-norm form ([`crate::least_norm`]). Where `G` is about to lose rank,
//! `[I Gᵀ; G 0](x, μ) = (w, 0)` over independent rows takes the place of `GᵀG`.
//!
//! Letters: `M`, `G`, `P` as in LMO08 §2 and §3; `v̂` velocity of a projected momentum.

use super::inverse_mass::InverseMass;
use crate::constraints::Constraints;
use crate::least_norm::LeastNorm;
use crate::node_solvers::NodeSolvers;
use crate::null_space::RANK_TOLERANCE;
use crate::redundancy::minimum_norm;
use crate::saddle_point::{IndependentRows, SaddlePoint};
use crate::unit_rows::UnitRows;
use vi_core::MechanicalSystem;
use vi_core::legendre::Energies;
use vi_core::linear::{Singular, dot};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::Memory;
use vi_core::{Configuration, Motion};

/// A node as it moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeMotion<'a> {
    pub(crate) at: Configuration<'a>,
    pub(crate) v: &'a [f64],
    pub(crate) memory: &'a Memory, // of its state
}

/// Applies `R_dᵀ`, `Q` and `M⁻¹`.
#[derive(Debug)]
pub struct Projections {
    n: usize,
    mass_system: SaddlePoint,     // [M Gᵀ; G 0]
    identity_system: SaddlePoint, // [I Gᵀ; G 0]
    // found when first asked for; Some(None): M singular or not constant
    inverse: Option<Option<InverseMass>>,
    jacobian: Option<SparseMatrix>, // m × n
    least_norm: LeastNorm,
    unit_rows: Option<UnitRows>, // made when first asked for
    x: Vec<f64>,                 // n + r
    m_work: Vec<f64>,            // m
    n_work: Vec<f64>,            // n
    acceleration: Vec<f64>,      // n
}

impl Projections {
    /// For a system and an independent set of its `m` constraints.
    #[must_use]
    pub fn new(system: &impl MechanicalSystem, m: usize, rows: &IndependentRows) -> Self {
        let n = system.dim();
        Self {
            n,
            mass_system: SaddlePoint::new(n, rows.clone()),
            identity_system: SaddlePoint::new(n, rows.clone()),
            inverse: None,
            jacobian: None,
            least_norm: LeastNorm::default(),
            unit_rows: None,
            x: vec![0.0; n + rows.len()],
            m_work: vec![0.0; m],
            n_work: vec![0.0; n],
            acceleration: vec![0.0; n],
        }
    }

    /// `a` of the acceleration level, found last with its multiplier or its force; shape `n`.
    #[must_use]
    pub fn acceleration(&self) -> &[f64] {
        &self.acceleration
    }

    /// `G(q)`, shape `m × n`.
    pub fn jacobian(
        &mut self,
        constraints: &impl Constraints,
        at: Configuration<'_>,
    ) -> &SparseMatrix {
        jacobian(&mut self.jacobian, constraints, at, self.n)
    }

    /// `λ ← R_dᵀ w` with `G_d = weight G`, shape `m`, and `force ← Gᵀ λ`, N, shape `n`; (36)–(38)
    /// and (47) differ by `w` and `weight` only.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn multiplier(
        &mut self,
        constraints: &impl Constraints,
        at: Configuration<'_>,
        w: &[f64],
        weight: f64,
        lambda: &mut [f64],
        force: &mut [f64],
    ) -> Result<(), Singular> {
        let n = self.n;
        self.least_norm.decline(constraints.rank_tolerance() > RANK_TOLERANCE);
        let found = jacobian(&mut self.jacobian, constraints, at, n);
        if self.least_norm.solve(found, w, lambda).is_ok() {
            scale_and_apply(found, weight, lambda, force); // (37), (38)
            return Ok(());
        }
        self.m_work.fill(0.0);
        let identity = |out: &mut dyn Entries| (0..n).for_each(|i| out.add(i, i, 1.0));
        let (zero, x) = (&self.m_work, &mut self.x);
        self.identity_system.solve_at(constraints, &identity, at, w, zero, x)?;
        let rows = self.identity_system.rows();
        rows.scatter(&self.x[n..], lambda);
        scale_and_apply(found, weight, lambda, force);
        minimum_norm(&mut self.least_norm, found, rows, force, lambda);
        Ok(())
    }

    /// `v̂` of a momentum: `M v̂ + Gᵀμ = p`, `G v̂ + ∂g/∂t = 0`; shape `n`. `M` with what is added
    /// to it in steps `h`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank, or a direction they leave free has no
    /// mass.
    pub fn velocity(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        at: Configuration<'_>,
        h: f64,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<(), Singular> {
        constraints.time_derivative(at.t, at.q, &mut self.m_work);
        self.m_work.iter_mut().for_each(|b| *b = -*b);
        self.solve_mass(system, constraints, at, h, p)?;
        v.copy_from_slice(&self.x[..self.n]);
        Ok(())
    }

    /// `out ← Q w` (16), shape `n`.
    ///
    /// # Errors
    /// As [`Projections::velocity`].
    pub fn project(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        at: Configuration<'_>,
        h: f64,
        w: &[f64],
        out: &mut [f64],
    ) -> Result<(), Singular> {
        self.m_work.fill(0.0);
        self.solve_mass(system, constraints, at, h, w)?;
        out.fill(0.0);
        system.add_momentum_of_step(at, h, &self.x[..self.n], out); // (16)
        Ok(())
    }

    /// `x` of `[M Gᵀ; G 0] x = (a, m_work)`.
    fn solve_mass(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        at: Configuration<'_>,
        h: f64,
        a: &[f64],
    ) -> Result<(), Singular> {
        let mass = |out: &mut dyn Entries| system.emit_mass_of_step(at, h, out);
        self.mass_system.solve_at(constraints, &mass, at, a, &self.m_work, &mut self.x)
    }

    /// `v ← M⁻¹ p`; `false` when `M` is singular or a discrete potential adds to it.
    ///
    /// # Errors
    /// [`Singular`] when `p` holds a number that is not finite.
    pub fn free_velocity(
        &mut self,
        system: &impl MechanicalSystem,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<bool, Singular> {
        let find = || if system.adds_mass() { None } else { InverseMass::new(system.mass()) };
        let Some(inverse) = self.inverse.get_or_insert_with(find) else { return Ok(false) };
        inverse.apply(system.mass(), p, v).map(|()| true)
    }

    /// `m_work ← −d²g/dt² + G a` and `n_work ← f − ∇V` at `at` with the velocity `v`.
    fn acceleration_sides(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        at: Motion<'_>,
    ) {
        constraints.acceleration_terms(at.t, at.q, at.v, &mut self.m_work);
        self.m_work.iter_mut().for_each(|b| *b = -*b);
        self.n_work.fill(0.0);
        system.add_potential_gradient(at.configuration(), -1.0, &mut self.n_work);
        system.add_force(at, &mut self.n_work);
    }

    /// `force ← Gᵀλ` of the acceleration level by what a mechanism offers, and `λ` where it is
    /// asked for:
    /// ```text
    /// G a_0 = b,   w_0 = f − ∇V − M a_0,   Gᵀλ = w_0 − M P (PᵀMP)⁻¹ Pᵀ w_0                          [5.27]
    /// a = a_0 + P (PᵀMP)⁻¹ Pᵀ w_0
    /// ```
    ///
    /// # Errors
    /// [`Singular`], also where the mechanism offers no velocity of a momentum.
    pub(crate) fn acceleration_sweeps(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        node: NodeMotion<'_>,
        solvers: &mut NodeSolvers,
        force: &mut [f64],
        lambda: Option<&mut [f64]>,
    ) -> Result<(), Singular> {
        let NodeMotion { at, v, memory } = node;
        let NodeSolvers { velocity, multipliers } = solvers;
        let velocity = velocity.as_mut().ok_or(Singular)?;
        if constraints.rank_tolerance() > RANK_TOLERANCE {
            // no acceleration satisfies rows that nearly follow from others, too
            return Err(Singular);
        }
        self.acceleration_sides(system, constraints, at.moving(v));
        let Self {
            n,
            jacobian: known,
            least_norm,
            unit_rows,
            acceleration: a,
            n_work: w,
            m_work: b,
            x,
            ..
        } = self;
        let found = jacobian(known, constraints, at, *n);
        match multipliers {
            Some(sweep) => sweep.particular(found, b, a)?,
            None => {
                let unit_rows = unit_rows.get_or_insert_with(|| UnitRows::of(constraints));
                unit_rows.particular(found, b, a)?;
            }
        }
        let change = &mut x[..*n];
        let mass = |out: &mut dyn Entries| system.emit_mass_of_step(at, 0.0, out);
        a.iter_mut().for_each(|a| *a = -*a);
        system.add_momentum_of_step(at, 0.0, a, w);
        velocity.velocity(&mass, at, memory, w, change)?;
        a.iter_mut().zip(&*change).for_each(|(a, change)| *a = change - *a);
        change.iter_mut().for_each(|a| *a = -*a);
        system.add_momentum_of_step(at, 0.0, change, w);
        if constraints.is_rheonomic() {
            force.fill(0.0); // less the velocity of no momentum
            velocity.velocity(&mass, at, memory, force, change)?;
            system.add_momentum_of_step(at, 0.0, change, w);
            a.iter_mut().zip(&*change).for_each(|(a, change)| *a -= change);
        }
        force.copy_from_slice(w);
        match (lambda, multipliers) {
            (None, _) => Ok(()),
            (Some(lambda), Some(sweep)) => sweep.multipliers(found, w, lambda),
            (Some(lambda), None) => least_norm.solve(found, w, lambda),
        }
    }

    /// The multiplier of the acceleration level at `at` with the velocity `v` on independent
    /// constraints, zero on the others: in the memory of a sparse factorization.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub(crate) fn independent_multiplier(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        at: Motion<'_>,
        lambda: &mut [f64],
    ) -> Result<(), Singular> {
        self.acceleration_sides(system, constraints, at);
        let force = std::mem::take(&mut self.n_work);
        let solved = self.solve_mass(system, constraints, at.configuration(), 0.0, &force);
        self.n_work = force;
        solved?;
        self.mass_system.rows().scatter(&self.x[self.n..], lambda);
        Ok(())
    }

    /// The multiplier of the acceleration level at `at` with the velocity `v`; it has the order of
    /// `v`, also at the macro nodes of a composition.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn acceleration_multiplier(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        at: Motion<'_>,
        lambda: &mut [f64],
    ) -> Result<(), Singular> {
        self.independent_multiplier(system, constraints, at, lambda)?;
        let mut force = std::mem::take(&mut self.n_work);
        self.finish(constraints, at.configuration(), &mut force, lambda);
        self.n_work = force;
        Ok(())
    }

    /// After the independent multipliers were found: the acceleration, `force ← Gᵀλ`, and `λ` of
    /// the least norm with this force.
    fn finish(
        &mut self,
        constraints: &impl Constraints,
        at: Configuration<'_>,
        force: &mut [f64],
        lambda: &mut [f64],
    ) {
        let Self { n, x, acceleration, mass_system, jacobian: known, least_norm, .. } = self;
        acceleration.copy_from_slice(&x[..*n]);
        let jacobian = jacobian(known, constraints, at, *n);
        force.fill(0.0);
        jacobian.tr_mul_add(1.0, lambda, force);
        least_norm.decline(constraints.rank_tolerance() > RANK_TOLERANCE);
        minimum_norm(least_norm, jacobian, mass_system.rows(), force, lambda);
    }

    /// The same with its force: `force ← Gᵀλ`, shape `n`, of independent multipliers: those of the
    /// least norm may leave a part of it that is small beside moments.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn acceleration_force(
        &mut self,
        system: &impl MechanicalSystem,
        constraints: &impl Constraints,
        at: Motion<'_>,
        force: &mut [f64],
        lambda: &mut [f64],
    ) -> Result<(), Singular> {
        self.independent_multiplier(system, constraints, at, lambda)?;
        self.finish(constraints, at.configuration(), force, lambda);
        Ok(())
    }
}

/// `G(q)`, shape `m × n`, in the pattern that `known` holds.
fn jacobian<'a>(
    known: &'a mut Option<SparseMatrix>,
    constraints: &impl Constraints,
    at: Configuration<'_>,
    n: usize,
) -> &'a SparseMatrix {
    let emit = |out: &mut dyn Entries| constraints.jacobian(at.t, at.q, out);
    SparseMatrix::update(known, (constraints.len(), n), emit)
}

/// `λ ← λ/weight`, `force ← Gᵀ λ`.
fn scale_and_apply(jacobian: &SparseMatrix, weight: f64, lambda: &mut [f64], force: &mut [f64]) {
    let scale = 1.0 / weight;
    lambda.iter_mut().for_each(|l| *l *= scale);
    force.fill(0.0);
    jacobian.tr_mul_add(1.0, lambda, force);
}

/// `½ vᵀ p`, J, of a momentum with its velocity.
pub fn kinetic_energy(v: &[f64], p: &[f64]) -> f64 {
    0.5 * dot(v, p)
}

/// `½ vᵀ p + V(q)`, J: `H_d` (53) of a momentum with its velocity.
pub fn hamiltonian(system: &impl MechanicalSystem, at: Motion<'_>, p: &[f64]) -> Energies {
    Energies {
        kinetic: kinetic_energy(at.v, p),
        potential: system.potential_energy(at.configuration()),
    }
}
