//! How the velocity of the projected momentum of a node changes.
//!
//! ```text
//! [M Gᵀ; G 0](v̂, μ) = (p̄, −g_t)
//! [M Gᵀ; G 0](δv̂, δμ) = (δp̄ − M_θ v̂ − (Σ μ_i D²g_i) δq − (Gᵀ)_θ μ,  −D²g[δq, v̂] − G_θ v̂ − g_tθ)
//! [M Gᵀ; G 0](w, ν) = (∂y/∂v̂, 0)
//! ∂y/∂p̄ = w,   ∂y/∂q = −(Σ μ_i D²g_i) w − (Σ ν_i D²g_i) v̂
//! ∂y/∂θ = −w·(M_θ v̂ + (Gᵀ)_θ μ) − ν·(G_θ v̂ + g_tθ)
//! ∂y/∂v̂·∂²v̂/∂a∂b = −[ w·(Σ δ_aμ_i D²g_i) δ_bq + ν·D²g[δ_bq, δ_av̂] + the same with a, b exchanged
//!                  + Σ μ_i D³g_i[w, δ_aq, δ_bq] + Σ ν_i D³g_i[v̂, δ_aq, δ_bq] ]                     [2.54]
//! ```
//! The second line is the first one differentiated, the others are its transpose along `∂y/∂v̂`;
//! the last one is the second line differentiated again, along the same. Redundant constraints: `μ`
//! and `ν` of independent rows; the others follow. Of constraints on velocities `A v = b` rows `A`
//! stand in `G` and `−b` in `g_t`: their `D²g_i` is `∂A_i/∂q`, which is not symmetric and is taken
//! transposed in `∂y/∂q`, and to the second row comes `+b_q δq`, to `∂y/∂q` `+b_qᵀ ν`; second
//! derivatives are not known then.
//!
//! With `A(q, z)`, the mass that steps `h` add [2.56], `M + A` stands for `M`, to the right side of
//! the second line comes `−(A v̂)_q δq − (A v̂)_z δz − (A v̂)_θ`, and to `∂y/∂q` comes
//! `−(A v̂)_qᵀ w`; second derivatives are not known then.
#![allow(non_snake_case)] // G, M

use super::explicit::Masses;
use super::rows::MovedRows;
use super::{DesignError, MechanismTangent, StepTangent};
use crate::mechanism::Mechanism;
use nalgebra::Vector3;
use std::sync::Arc;
use vi_constraints::Constraints;
use vi_constraints::saddle_point::{IndependentRows, SaddlePoint};
use vi_core::linear::{Singular, dot};
use vi_core::sparse::{Block, Entries, Product, SparseMatrix};
use vi_core::{Configuration, MechanicalSystem, State};

/// What carries the momentum of a node.
#[derive(Clone, Copy)]
pub enum NodeMass<'a> {
    /// `M`.
    Constant(&'a SparseMatrix),
    /// `M` and what the system adds to it in steps of this length, s.
    OfStep(&'a dyn MechanicalSystem, f64),
}

impl<'a> NodeMass<'a> {
    /// Of a system in steps `h`, s; 0 where nodes are read by themselves.
    pub fn of(system: &'a dyn MechanicalSystem, h: f64) -> Self {
        match h != 0.0 && system.adds_mass() {
            true => Self::OfStep(system, h),
            false => Self::Constant(system.mass()),
        }
    }

    fn emit(self, at: Configuration<'_>, out: &mut dyn Entries) {
        match self {
            Self::Constant(mass) => mass.emit(out),
            Self::OfStep(system, h) => system.emit_mass_of_step(at, h, out),
        }
    }
}

impl std::fmt::Debug for NodeMass<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Constant(_) => f.write_str("Constant"),
            Self::OfStep(_, h) => f.debug_tuple("OfStep").field(h).finish(),
        }
    }
}

/// How the momentum of a mass that steps add changes at a node with its velocity.
struct AddedMomentum {
    h: f64,
    by_position: SparseMatrix, // n × n  (A v̂)_q
    by_internal: SparseMatrix, // n × z  (A v̂)_z
}

/// `out ← out − Eᵀ v` of what is emitted.
pub(super) fn emit_minus_transposed(
    v: &[f64],
    out: &mut [f64],
    emit: impl FnOnce(&mut dyn Entries),
) {
    let into = &mut Product { v, out };
    emit(&mut Block { into, row: 0, column: 0, scale: -1.0, transposed: true });
}

/// What a parameter changes of a velocity.
struct MovedVelocity {
    masses: Option<Masses>,
    rows: MovedRows,
    elements: Option<Arc<dyn StepTangent>>,
}

impl MovedVelocity {
    /// `(A v̂)_θ`, shape `n`; `None` where nothing is added, or does not change.
    fn added(&self, at: Configuration<'_>, h: Option<f64>, v: &[f64]) -> Option<Vec<f64>> {
        let mut out = vec![0.0; v.len()];
        self.elements.as_ref()?.add_added_momentum(at, h?, v, &mut out);
        Some(out)
    }
}

/// How a velocity changes along a direction, with what its second change is made of.
#[derive(Clone, Debug)]
pub struct VelocityChange {
    dq: Vec<f64>,     // n
    dv: Vec<f64>,     // n  δv̂
    dmu: Vec<f64>,    // m  δμ
    turned: Vec<f64>, // n  (Σ ν_i D²g_i) δq
    rates: Vec<f64>,  // m  D²g[δq, w]
    bent: Vec<f64>,   // n  (Σ μ_i D³g_i[w] + Σ ν_i D³g_i[v̂]) δq
}

impl VelocityChange {
    /// `δv̂`, shape `n`.
    #[must_use]
    pub fn v(&self) -> &[f64] {
        &self.dv
    }

    /// `∂y/∂v̂·∂²v̂/∂a∂b` of two changes [2.54].
    #[must_use]
    pub fn second(&self, other: &Self) -> f64 {
        let crossed = |a: &Self, b: &Self| dot(&a.rates, &b.dmu) + dot(&a.turned, &b.dv);
        -(crossed(self, other) + crossed(other, self) + dot(&self.bent, &other.dq))
    }
}

/// `v̂` at nodes with its derivatives.
pub struct DifferentiatedVelocity {
    saddle: SaddlePoint,
    moved: Vec<MovedVelocity>,
    added: Option<AddedMomentum>, // at the last node
    x: Vec<f64>,                  // n + r
    v: Vec<f64>,                  // n
    mu: Vec<f64>,                 // m
    w: Vec<f64>,                  // n  of the last pull
    nu: Vec<f64>,                 // m
    a: Vec<f64>,                  // n
    b: Vec<f64>,                  // m
}

impl std::fmt::Debug for DifferentiatedVelocity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("NodeVelocity").field("v", &self.v).finish_non_exhaustive()
    }
}

impl DifferentiatedVelocity {
    /// Of a mechanism with independent `rows`, by parameters along which its numbers change so.
    ///
    /// # Errors
    /// [`DesignError`] where a tangent is of another kind than its element.
    pub fn new(
        mechanism: &Mechanism,
        rows: &IndependentRows,
        tangents: &[MechanismTangent],
    ) -> Result<Self, DesignError> {
        let (n, m) = (mechanism.dim(), mechanism.len());
        let moved = tangents.iter().map(|own| {
            let masses = Masses::of(mechanism, own, Vector3::zeros());
            let (rows, elements) = (MovedRows::of(mechanism, own)?, own.elements.clone());
            Ok(MovedVelocity { masses, rows, elements })
        });
        Ok(Self {
            saddle: SaddlePoint::new(n, rows.clone()),
            moved: moved.collect::<Result<_, DesignError>>()?,
            added: None,
            x: vec![0.0; n + rows.len()],
            v: vec![0.0; n],
            mu: vec![0.0; m],
            w: vec![0.0; n],
            nu: vec![0.0; m],
            a: vec![0.0; n],
            b: vec![0.0; m],
        })
    }

    /// `v̂` at the node of a state, shape `n`. Allocates where steps add to `M`.
    ///
    /// # Errors
    /// [`Singular`] where the constraints have lost rank, or a direction that they leave free has
    /// no mass.
    pub fn find(
        &mut self,
        mechanism: &Mechanism,
        mass: NodeMass<'_>,
        state: &State,
    ) -> Result<&[f64], Singular> {
        let (n, at) = (self.v.len(), state.configuration());
        mechanism.time_derivative(at.t, at.q, &mut self.b);
        self.b.iter_mut().for_each(|b| *b = -*b);
        let emit = |out: &mut dyn Entries| mass.emit(at, out);
        self.saddle.solve_at(mechanism, &emit, at, &state.p, &self.b, &mut self.x)?;
        self.v.copy_from_slice(&self.x[..n]);
        self.mu.fill(0.0);
        self.saddle.rows().scatter(&self.x[n..], &mut self.mu);
        self.added = None;
        if let NodeMass::OfStep(system, h) = mass {
            let (v, z) = (&self.v, at.internal.len());
            let by_position = |out: &mut dyn Entries| system.added_mass_slope(at, h, v, out);
            let by_internal = |out: &mut dyn Entries| system.added_mass_by_internal(at, h, v, out);
            self.added = Some(AddedMomentum {
                h,
                by_position: SparseMatrix::assemble(n, n, by_position),
                by_internal: SparseMatrix::assemble(n, z, by_internal),
            });
        }
        Ok(&self.v)
    }

    /// `δv̂` at the node of the last [`DifferentiatedVelocity::find`], shape `n`, where the
    /// configuration changes by `dq`, the momentum by `dp`, internal variables by `dz`, which is
    /// not read where steps add nothing to `M`, and one of the parameters at the rate 1 if any
    /// does.
    ///
    /// # Errors
    /// As of [`DifferentiatedVelocity::find`].
    pub fn change(
        &mut self,
        mechanism: &Mechanism,
        at: Configuration<'_>,
        parameter: Option<usize>,
        [dq, dp, dz]: [&[f64]; 3],
    ) -> Result<&[f64], Singular> {
        let Self { saddle, moved, added, x, v, mu, a, b, .. } = self;
        let n = v.len();
        a.copy_from_slice(dp);
        let mut product = Product { v: dq, out: a };
        mechanism.weighted_hessian(at.t, at.q, mu, -1.0, &mut product);
        mechanism.second_derivative(at.t, at.q, dq, v, b);
        mechanism.drift_slope(at, &mut Product { v: dq, out: b });
        if let Some(own) = parameter.map(|k| &moved[k]) {
            if let Some(masses) = &own.masses {
                masses.for_each_momentum(v, |i, momentum| a[i] -= momentum);
            }
            own.rows.add_rates(at.moving(v), b);
            own.rows.for_each_force(at.q, mu, |i, force| a[i] -= force);
            if let Some(changed) = own.added(at, added.as_ref().map(|own| own.h), v) {
                a.iter_mut().zip(&changed).for_each(|(a, by)| *a -= by);
            }
        }
        if let Some(added) = added {
            added.by_position.mul_add(-1.0, dq, a);
            if !dz.is_empty() {
                added.by_internal.mul_add(-1.0, dz, a);
            }
        }
        x[..n].copy_from_slice(a);
        b.iter_mut().for_each(|b| *b = -*b);
        saddle.rows().gather(b, &mut x[n..]);
        saddle.solve_factorized(x)?;
        Ok(&x[..n])
    }

    /// The change of `v̂` where the configuration changes by `dq` and the momentum by `dp`, with
    /// its second changes along the `of_v` of the last [`DifferentiatedVelocity::pull`], at the
    /// same node.
    ///
    /// # Errors
    /// As of [`DifferentiatedVelocity::find`].
    pub fn change_with_second(
        &mut self,
        mechanism: &Mechanism,
        at: Configuration<'_>,
        [dq, dp]: [&[f64]; 2],
    ) -> Result<VelocityChange, Singular> {
        let dv = self.change(mechanism, at, None, [dq, dp, &[]])?.to_vec();
        let Self { saddle, x, v, mu, w, nu, .. } = self;
        let (n, m) = (v.len(), mu.len());
        let mut dmu = vec![0.0; m];
        saddle.rows().scatter(&x[n..], &mut dmu);
        let [mut turned, mut bent, mut rates] = [vec![0.0; n], vec![0.0; n], vec![0.0; m]];
        if dq.iter().any(|dq| *dq != 0.0) {
            let out = &mut Product { v: dq, out: &mut turned };
            mechanism.weighted_hessian(at.t, at.q, nu, 1.0, out);
            mechanism.second_derivative(at.t, at.q, dq, w, &mut rates);
            for (weights, along) in [(&*mu, &*w), (&*nu, &*v)] {
                mechanism.add_weighted_thirds(at.q, weights, [along, dq], 1.0, &mut bent);
            }
        }
        Ok(VelocityChange { dq: dq.to_vec(), dv, dmu, turned, rates, bent })
    }

    /// `q ← q + (∂v̂/∂q)ᵀ of_v`, `p ← p + (∂v̂/∂p̄)ᵀ of_v` at the node of the last
    /// [`DifferentiatedVelocity::find`], all of shape `n`.
    ///
    /// # Errors
    /// As of [`DifferentiatedVelocity::find`].
    pub fn pull(
        &mut self,
        mechanism: &Mechanism,
        at: Configuration<'_>,
        of_v: &[f64],
        [q, p]: [&mut [f64]; 2],
    ) -> Result<(), Singular> {
        let Self { saddle, added, x, v, mu, w, nu, .. } = self;
        let n = v.len();
        x[..n].copy_from_slice(of_v);
        x[n..].fill(0.0);
        saddle.solve_factorized(x)?;
        w.copy_from_slice(&x[..n]);
        nu.fill(0.0);
        saddle.rows().scatter(&x[n..], nu);
        p.iter_mut().zip(&*w).for_each(|(p, w)| *p += w);
        for (weights, along) in [(&*mu, &*w), (&*nu, &*v)] {
            let emit = |out: &mut dyn Entries| {
                mechanism.weighted_hessian(at.t, at.q, weights, 1.0, out);
            };
            emit_minus_transposed(along, q, emit);
        }
        emit_minus_transposed(nu, q, |out| mechanism.drift_slope(at, out));
        if let Some(added) = added {
            added.by_position.tr_mul_add(-1.0, w, q);
        }
        Ok(())
    }

    /// `z ← z + (∂v̂/∂z)ᵀ of_v` of the last [`DifferentiatedVelocity::pull`]; shape of the internal
    /// variables.
    pub fn pull_internal(&self, z: &mut [f64]) {
        if let Some(added) = &self.added {
            added.by_internal.tr_mul_add(-1.0, &self.w, z);
        }
    }

    /// The factors of the matrix at the node of the last [`DifferentiatedVelocity::find`].
    pub(super) fn saddle(&mut self) -> &mut SaddlePoint {
        &mut self.saddle
    }

    /// `−w·(M_θ a + (Gᵀ)_θ λ) − ν·(γ_θ + G_θ a)` of a parameter, with `γ = D²g[v, v] + ∂²g/∂t²`.
    pub(super) fn pulled_acceleration(
        &mut self,
        at: Configuration<'_>,
        parameter: usize,
        [w, nu]: [&[f64]; 2],
        [v, a, lambda]: [&[f64]; 3],
    ) -> f64 {
        let Self { moved, b, .. } = self;
        let Some(MovedVelocity { masses, rows, .. }) = moved.get(parameter) else { return 0.0 };
        let mut sum = 0.0;
        if let Some(masses) = masses {
            masses.for_each_momentum(a, |i, momentum| sum -= w[i] * momentum);
        }
        rows.for_each_force(at.q, lambda, |i, force| sum -= w[i] * force);
        b.fill(0.0);
        rows.add_accelerations(at, [v, a], b);
        sum - dot(nu, b)
    }

    /// What a parameter adds at fixed `q` and `p̄` to the number along whose slope the last
    /// [`DifferentiatedVelocity::pull`] was.
    #[must_use]
    pub fn pulled_by_parameter(&mut self, at: Configuration<'_>, parameter: usize) -> f64 {
        let Self { moved, added, v, mu, w, nu, b, .. } = self;
        let Some(own) = moved.get(parameter) else { return 0.0 };
        let MovedVelocity { masses, rows, .. } = own;
        let mut sum = 0.0;
        if let Some(changed) = own.added(at, added.as_ref().map(|own| own.h), v) {
            sum -= dot(&changed, w);
        }
        if let Some(masses) = masses {
            masses.for_each_momentum(v, |i, momentum| sum -= w[i] * momentum);
        }
        rows.for_each_force(at.q, mu, |i, force| sum -= w[i] * force);
        b.fill(0.0);
        rows.add_rates(at.moving(v), b);
        sum - dot(nu, b)
    }
}
