//! How the acceleration and the multipliers of a node change.
//!
//! ```text
//! [M Gᵀ; G 0](a, λ) = (F, −γ)          F = f − ∇V at (t, q, v̂),   γ = D²g[v̂, v̂] + ∂²g/∂t²
//! [M Gᵀ; G 0](δa, δλ) = ( F_q δq + F_v δv̂ + F_θ − M_θ a − (Σ λ_i D²g_i) δq − (Gᵀ)_θ λ,
//!                         −2 D²g[v̂, δv̂] − D²g[a, δq] − γ_θ − G_θ a )
//! [M Gᵀ; G 0](w, ν) = (∂y/∂a, ∂y/∂λ)
//! ∂y/∂q = F_qᵀ w − (Σ λ_i D²g_i) w − (Σ ν_i D²g_i) a − γ_qᵀ ν,   ∂y/∂v̂ = F_vᵀ w − γ_vᵀ ν
//! ∂y/∂θ = w·(F_θ − M_θ a − (Gᵀ)_θ λ) − ν·(γ_θ + G_θ a)
//! ```
//! `v̂` is that of [`DifferentiatedVelocity`], which passes `∂y/∂v̂` on. `γ_q` is zero where the
//! second derivatives of `g` are constant; of constraints along angles, as gears and prescribed
//! motions of hinges, and of sums of rates it is left out, and they are refused. Of constraints on
//! velocities `γ = DA[v̂] v̂ − ḃ`, and `∂A_i/∂q` stands for `D²g_i`, transposed in `∂y/∂q`.
//! Redundant constraints: `λ` and `ν` of independent rows.
#![allow(non_snake_case)] // F, G, M

use super::velocity::{DifferentiatedVelocity, NodeMass, emit_minus_transposed};
use super::{DesignError, MechanismTangent};
use crate::constraint::scalar_constraint::ScalarRow;
use crate::mechanism::Mechanism;
use vi_constraints::Constraints;
use vi_constraints::design::Design;
use vi_constraints::linearization::{DroppedRows, LinearizationError};
use vi_constraints::saddle_point::IndependentRows;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::{Singular, dot};
use vi_core::sparse::{Block, Product};
use vi_core::{Configuration, Motion, State};

/// `a` and `λ` at nodes with their derivatives.
#[derive(Debug)]
pub struct NodeAcceleration {
    velocity: DifferentiatedVelocity,
    v: Vec<f64>,      // n
    a: Vec<f64>,      // n
    lambda: Vec<f64>, // m
    w: Vec<f64>,      // n  of the last pull
    nu: Vec<f64>,     // m
    x: Vec<f64>,      // n + r
    of_v: Vec<f64>,   // n
    rows: Vec<f64>,   // m
    standing: Interval,
    dropped: DroppedRows,
}

impl NodeAcceleration {
    /// Of a mechanism with independent `rows`, by parameters along which its numbers change so.
    ///
    /// # Errors
    /// [`DesignError`], also of constraints whose second derivatives are not constant.
    pub fn new(
        mechanism: &Mechanism,
        rows: &IndependentRows,
        tangents: &[MechanismTangent],
    ) -> Result<Self, DesignError> {
        let description = mechanism.description();
        let q = mechanism.initial_configuration();
        let [still, mut out] = [(); 2].map(|()| vec![0.0; q.len()]);
        let at = Motion::new(0.0, &q, &still);
        let mut unknown = |row: &ScalarRow| !row.add_acceleration_slope(at, 0.0, &mut out);
        let scalar = description.scalars.iter().find(|own| own.rows.iter().any(&mut unknown));
        let screw = description.joints.iter().find(|joint| joint.kind.pitch().is_some());
        if let Some(name) = scalar.map(|own| &own.name).or(screw.map(|own| &own.name)) {
            return Err(DesignError::Angle(name.clone()));
        }
        Self::at_rest(mechanism, rows, tangents)
    }

    /// The same of nodes at which nothing moves or accelerates, `v̂ = 0` and `a = 0`: the second
    /// derivatives of the constraints may change there.
    ///
    /// # Errors
    /// [`DesignError`].
    pub fn at_rest(
        mechanism: &Mechanism,
        rows: &IndependentRows,
        tangents: &[MechanismTangent],
    ) -> Result<Self, DesignError> {
        let (n, m) = (mechanism.dim(), mechanism.len());
        Ok(Self {
            velocity: DifferentiatedVelocity::new(mechanism, rows, tangents)?,
            v: vec![0.0; n],
            a: vec![0.0; n],
            lambda: vec![0.0; m],
            w: vec![0.0; n],
            nu: vec![0.0; m],
            x: vec![0.0; n + rows.len()],
            of_v: vec![0.0; n],
            rows: vec![0.0; m],
            standing: Interval::new(n),
            dropped: DroppedRows::new(n, m),
        })
    }

    /// Finds `v̂`, `a` and `λ` at the node of a state.
    ///
    /// # Errors
    /// [`Singular`] where the constraints have lost rank, or a direction that they leave free has
    /// no mass.
    pub fn find(
        &mut self,
        mechanism: &Mechanism,
        system: &impl DiscreteLagrangian,
        state: &State,
    ) -> Result<(), Singular> {
        let Self { velocity, v, a, lambda, x, rows, standing, .. } = self;
        let (n, at) = (v.len(), state.configuration());
        v.copy_from_slice(velocity.find(mechanism, NodeMass::Constant(system.mass()), state)?);
        mechanism.acceleration_terms(at.t, at.q, v, rows);
        rows.iter_mut().for_each(|b| *b = -*b);
        let saddle = velocity.saddle();
        let (upper, lower) = x.split_at_mut(n);
        upper.fill(0.0);
        system.add_potential_gradient(at, -1.0, upper);
        system.add_force(at.moving(v), upper);
        saddle.rows().gather(rows, lower);
        saddle.solve_factorized(x)?;
        a.copy_from_slice(&x[..n]);
        lambda.fill(0.0);
        saddle.rows().scatter(&x[n..], lambda);
        standing.gather_at(at, v, 1.0);
        Ok(())
    }

    /// `v̂`, shape `n`.
    #[must_use]
    pub fn v(&self) -> &[f64] {
        &self.v
    }

    /// `a`, shape `n`.
    #[must_use]
    pub fn a(&self) -> &[f64] {
        &self.a
    }

    /// `λ` over all constraints, zero of those that are left out; shape `m`.
    #[must_use]
    pub fn lambda(&self) -> &[f64] {
        &self.lambda
    }

    /// Adds the derivatives by `q` and `p̄`, shape `n`, of a number with these by `v̂`, `a`, `λ`.
    ///
    /// # Errors
    /// As of [`NodeAcceleration::find`], and [`LinearizationError::Undetermined`] of a number that
    /// is not the same for all multipliers with the same force.
    pub fn pull(
        &mut self,
        mechanism: &Mechanism,
        system: &impl DiscreteLagrangian,
        at: Configuration<'_>,
        [by_v, by_a, by_lambda]: [&[f64]; 3],
        [q, p]: [&mut [f64]; 2],
    ) -> Result<(), LinearizationError> {
        let Self { velocity, v, a, lambda, w, nu, x, of_v, dropped, .. } = self;
        let n = v.len();
        let saddle = velocity.saddle();
        let (upper, lower) = x.split_at_mut(n);
        upper.copy_from_slice(by_a);
        saddle.rows().gather(by_lambda, lower);
        saddle.solve_factorized(x)?;
        w.copy_from_slice(&x[..n]);
        nu.fill(0.0);
        saddle.rows().scatter(&x[n..], nu);
        dropped.determines(mechanism, saddle.rows(), (at.t, at.q), ([w, by_lambda], 1.0))?;
        of_v.copy_from_slice(by_v);
        for (by, out) in [([1.0, 0.0], &mut *q), ([0.0, 1.0], &mut of_v[..])] {
            let into = &mut Product { v: w, out };
            let mut transposed = Block { into, row: 0, column: 0, scale: 1.0, transposed: true };
            system.level_slopes(at.moving(v), by, &mut transposed);
        }
        let bend = |mu: &[f64], of: &[f64], out: &mut [f64]| {
            emit_minus_transposed(of, out, |out| {
                mechanism.weighted_hessian(at.t, at.q, mu, 1.0, out);
            });
        };
        bend(lambda, w, q);
        bend(nu, a, q);
        bend(nu, v, of_v);
        mechanism.weighted_hessian(at.t, at.q, nu, -1.0, &mut Product { v, out: of_v });
        emit_minus_transposed(nu, of_v, |out| mechanism.drift_slope(at, out));
        mechanism.add_acceleration_slopes(at.moving(v), nu, -1.0, q);
        Ok(velocity.pull(mechanism, at, of_v, [q, p])?)
    }

    /// `w`, the derivative of the number of the last [`NodeAcceleration::pull`] by forces on the
    /// coordinates, shape `n`.
    #[must_use]
    pub fn by_force(&self) -> &[f64] {
        &self.w
    }

    /// What a parameter adds at fixed `q` and `p̄` to the number of the last
    /// [`NodeAcceleration::pull`].
    #[must_use]
    pub fn pulled_by_parameter(
        &mut self,
        at: Configuration<'_>,
        design: &dyn Design,
        parameter: usize,
    ) -> f64 {
        let Self { velocity, v, a, lambda, w, nu, of_v, standing, .. } = self;
        let sum = velocity.pulled_by_parameter(at, parameter);
        let (minus, plus) = (of_v, &mut vec![0.0; v.len()]);
        minus.fill(0.0);
        design.add_at_node(parameter, standing, [minus, plus]);
        let force = dot(minus, w) + dot(plus, w); // F_θ: what inertia adds to both is opposite
        sum + force + velocity.pulled_acceleration(at, parameter, [w, nu], [v, a, lambda])
    }
}
