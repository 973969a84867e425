//! Discrete Legendre transforms with constraints, as functions of given configurations.
//!
//! ```text
//! R_d   = G_dᵀ (G_d G_dᵀ)⁻¹,  G_d = h G(q_n)                                              (37), (38)
//! λ_n   = R_dᵀ [D_1 L_d(q_n, q_{n+1}) + f_d^- + D_2 L_d(q_{n-1}, q_n) + f_d^+]                  (36)
//! λ_0   = 2 R_dᵀ [p(0) + D_1 L_d(q_0, q_1) + f_d^-]                                             (47)
//! p_n^- = −D_1 L_d(q_n, q_{n+1}) − f_d^- + ½ G_dᵀ λ_n                                           (34)
//! p_n^+ =  D_2 L_d(q_{n-1}, q_n) + f_d^+ − ½ G_dᵀ λ_n                                           (35)
//! Q     = I − Gᵀ (G M⁻¹ Gᵀ)⁻¹ G M⁻¹ = M P (PᵀMP)⁻¹ Pᵀ                                           (16)
//! ᵠp_n  = Q (−D_1 L_d − f_d^-) = Q (D_2 L_d + f_d^+)                                      (39), (40)
//! ᴾp_n  = Pᵀ(−D_1 L_d − f_d^-) = Pᵀ(D_2 L_d + f_d^+)                                      (41), (42)
//! E_d   = ½ (Δq/h)ᵀ M (Δq/h) + U_d(q_n, q_{n+1})                                                (52)
//! H_d   = ½ pᵀ M⁻¹ p + V(q_n),  or ½ v̂ᵀ M v̂ + V(q_n) with M v̂ = Q p                             (53)
//! ```
//! No integrator is needed. [`vi_core::legendre`] has the part without constraints and (52).
//!
//! *Which equations hold for what.* `p_n^- = p_n^+`, (39) = (40) and (41) = (42) along a discrete
//! solution only, where they are the step equations; each function can be evaluated at any
//! configurations. With discrete forces `f_d^∓` these are the forced transforms (Marsden & West
//! 2001, part 3).
//!
//! *Singular `M`.* `Q` is given by its second form. `p_n` is not in the range of `M`, so (53) with
//! `p_n` does not exist. *Redundant constraints.* The force `Gᵀλ` is unique, `λ` is that of minimum
//! norm. *Rheonomic constraints.* The projected momentum is `M v̂` with `G v̂ + ∂g/∂t = 0`.
//!
//! Source: LMO08 §2, §3.

mod error;

pub use error::LegendreError;

use crate::constraints::Constraints;
use crate::null_space::null_space_at;
use crate::projection::{Projections, hamiltonian};
use crate::reparametrization::pull_back;
use crate::saddle_point::IndependentRows;
use error::{finite, meet, shape, step};
use nalgebra::DMatrix;
use vi_core::Configuration;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::legendre::{Energies, p_minus, p_plus};

/// The discrete Legendre transforms of a system with constraints.
///
/// Vectors have shape `n` and the unit of momentum (kg·m/s for lengths) unless said otherwise; `λ`
/// and `R_dᵀ` have shape `m`. An interval `before` is `(q_{n-1}, q_n)`, `after` is
/// `(q_n, q_{n+1})`.
///
/// The pendulum of LMO08 §3.1 without gravity, `q_n = (cos nΔ, sin nΔ)` with `sin Δ = h`:
/// ```
/// use vi_constraints::{ConstraintFn, LegendreTransforms};
/// use vi_core::{Configuration, Interval, SeparableSystem};
///
/// let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0]);
/// let rod = ConstraintFn::new(2, 1,
///     |q, g| g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0),
///     |q, G| { G[(0, 0)] = q[0]; G[(0, 1)] = q[1]; });
/// let h = 0.8_f64;
/// let q = |n: i32| [(f64::from(n) * h.asin()).cos(), (f64::from(n) * h.asin()).sin()];
/// let (before, after) = (Interval::between(0.0, h, &q(0), &q(1)), Interval::between(h, h, &q(1), &q(2)));
///
/// let mut legendre = LegendreTransforms::new(&system, &rod, Configuration::new(h, &q(1)))?;
/// let lambda = legendre.multiplier(&before, &after)?;                                  // (36)
/// assert!((lambda[0] - 2.0 * (1.0 - (1.0 - h * h).sqrt()) / (h * h)).abs() < 1e-14);
/// let (minus, plus) =
///     (legendre.momentum_minus(&after, &lambda)?, legendre.momentum_plus(&before, &lambda)?);
/// for i in 0..2 {
///     assert!((minus[i] - plus[i]).abs() < 1e-14);                                     // (34) = (35)
/// }
/// let energy = legendre.hamiltonian(Configuration::new(h, &q(1)), &minus)?.expect("M is regular");            // (53)
/// assert!((energy.kinetic - 0.5).abs() < 1e-14 && energy.potential == 0.0);
/// # Ok::<(), vi_constraints::legendre::LegendreError>(())
/// ```
#[derive(Debug)]
pub struct LegendreTransforms<'a, S, C> {
    system: &'a S,
    constraints: &'a C,
    rank: usize,
    step: f64, // s  of the added mass
    projections: Projections,
}

impl<'a, S: DiscreteLagrangian, C: Constraints> LegendreTransforms<'a, S, C> {
    /// With the independent constraints found at `(t, q)` by pivoted QR. They serve every
    /// configuration with the same rank.
    ///
    /// # Errors
    /// [`LegendreError::Shape`], [`LegendreError::NotFinite`].
    pub fn new(
        system: &'a S,
        constraints: &'a C,
        at: Configuration<'_>,
    ) -> Result<Self, LegendreError> {
        shape("q", at.q.len(), system.dim())?;
        shape("the argument of the constraints", constraints.dim(), system.dim())?;
        finite("the configuration", at.q)?;
        Self::with_rows(system, constraints, &IndependentRows::find(constraints, at.t, at.q))
    }

    /// With an independent set of constraints that the caller knows.
    ///
    /// # Errors
    /// [`LegendreError::Shape`].
    pub fn with_rows(
        system: &'a S,
        constraints: &'a C,
        rows: &IndependentRows,
    ) -> Result<Self, LegendreError> {
        shape("the argument of the constraints", constraints.dim(), system.dim())?;
        let projections = Projections::new(system, constraints.len(), rows);
        Ok(Self { system, constraints, rank: rows.len(), step: 0.0, projections })
    }

    /// Of steps `h`, for systems whose discrete potentials add a mass to `M` (selective mass
    /// scaling); else and unless said otherwise `M` is meant.
    #[must_use]
    pub fn of_steps(mut self, h: f64) -> Self {
        self.step = h;
        self
    }

    /// `λ_n` (36), N, shape `m`. With unequal steps `h` is their mean, the weight of `g(q_n)` in
    /// the discrete action.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn multiplier(
        &mut self,
        before: &Interval,
        after: &Interval,
    ) -> Result<Vec<f64>, LegendreError> {
        self.check(before)?;
        meet(before, after)?;
        self.multiplier_after(&self.p_plus(before)?, after, 0.5 * (before.h + after.h))
    }

    /// `λ_0` (47) from `p(0) = M v(0)` and the first interval, N, shape `m`.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn start_multiplier(
        &mut self,
        p0: &[f64],
        first: &Interval,
    ) -> Result<Vec<f64>, LegendreError> {
        shape("p(0)", p0.len(), self.system.dim())?;
        self.multiplier_after(p0, first, 0.5 * first.h) // g(q_0) has half the weight: the factor 2
    }

    /// `R_dᵀ [p + D_1 L_d + f_d^-]` with `G_d = weight G`.
    fn multiplier_after(
        &mut self,
        p: &[f64],
        after: &Interval,
        weight: f64,
    ) -> Result<Vec<f64>, LegendreError> {
        let minus = self.p_minus(after)?;
        let w: Vec<f64> = p.iter().zip(&minus).map(|(p, minus)| p - minus).collect();
        self.r_d_transposed(after.start(), weight, &w) // (36), (47)
    }

    /// `R_dᵀ w` (37), (38) with `G_d = h G(q)`, shape `m`; of minimum norm where constraints are
    /// redundant.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn r_d_transposed(
        &mut self,
        at: Configuration<'_>,
        h: f64,
        w: &[f64],
    ) -> Result<Vec<f64>, LegendreError> {
        step(h)?;
        self.check_vectors(at.q, w)?;
        let (mut lambda, mut force) = (vec![0.0; self.constraints.len()], vec![0.0; w.len()]);
        self.projections.multiplier(self.constraints, at, w, h, &mut lambda, &mut force)?;
        finite("the multiplier", &lambda)?;
        Ok(lambda)
    }

    /// `G(q)ᵀ λ`, N, shape `n`: acts on the system with a minus sign.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn constraint_force(
        &mut self,
        at: Configuration<'_>,
        lambda: &[f64],
    ) -> Result<Vec<f64>, LegendreError> {
        shape("λ", lambda.len(), self.constraints.len())?;
        shape("q", at.q.len(), self.system.dim())?;
        let mut force = vec![0.0; at.q.len()];
        self.projections.jacobian(self.constraints, at).tr_mul_add(1.0, lambda, &mut force);
        finite("the constraint force", &force)?;
        Ok(force)
    }

    /// `p_n^- = −D_1 L_d(q_n, q_{n+1}) − f_d^- + ½ G_dᵀ λ_n` (34).
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn momentum_minus(
        &mut self,
        after: &Interval,
        lambda: &[f64],
    ) -> Result<Vec<f64>, LegendreError> {
        let mut p = self.p_minus(after)?;
        let force = self.constraint_force(after.start(), lambda)?;
        add_constraint_impulse(0.5 * after.h, &force, &mut p); // (34)
        finite("the momentum", &p)?;
        Ok(p)
    }

    /// `p_n^+ = D_2 L_d(q_{n-1}, q_n) + f_d^+ − ½ G_dᵀ λ_n` (35).
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn momentum_plus(
        &mut self,
        before: &Interval,
        lambda: &[f64],
    ) -> Result<Vec<f64>, LegendreError> {
        let mut p = self.p_plus(before)?;
        let force = self.constraint_force(before.end(), lambda)?;
        add_constraint_impulse(-0.5 * before.h, &force, &mut p); // (35)
        finite("the momentum", &p)?;
        Ok(p)
    }

    /// `Q(q) p` (16): the part of a momentum in the cotangent space, `G M⁻¹ Q p = 0`.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn project(&mut self, at: Configuration<'_>, p: &[f64]) -> Result<Vec<f64>, LegendreError> {
        self.check_vectors(at.q, p)?;
        let mut out = vec![0.0; p.len()];
        self.projections.project(self.system, self.constraints, at, self.step, p, &mut out)?;
        finite("the projected momentum", &out)?;
        Ok(out)
    }

    /// `Q(q)` (16), shape `n × n`, by `n` projections.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn projection(&mut self, at: Configuration<'_>) -> Result<DMatrix<f64>, LegendreError> {
        let n = self.system.dim();
        let (mut matrix, mut unit) = (DMatrix::zeros(n, n), vec![0.0; n]);
        for j in 0..n {
            unit[j] = 1.0;
            matrix.column_mut(j).copy_from_slice(&self.project(at, &unit)?);
            unit[j] = 0.0;
        }
        Ok(matrix)
    }

    /// `v̂`, m/s: `G v̂ + ∂g/∂t = 0` and `M v̂ = p − Gᵀμ`, so `M v̂ = Q p` for scleronomic
    /// constraints.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn velocity(
        &mut self,
        at: Configuration<'_>,
        p: &[f64],
    ) -> Result<Vec<f64>, LegendreError> {
        self.check_vectors(at.q, p)?;
        let mut v = vec![0.0; p.len()];
        self.projections.velocity(self.system, self.constraints, at, self.step, p, &mut v)?;
        finite("the velocity", &v)?;
        Ok(v)
    }

    /// `v̂` and `M v̂` of a momentum.
    fn tangential(
        &mut self,
        at: Configuration<'_>,
        p: &[f64],
    ) -> Result<(Vec<f64>, Vec<f64>), LegendreError> {
        let v = self.velocity(at, p)?;
        let mut projected = vec![0.0; v.len()];
        self.system.add_momentum_of_step(at, self.step, &v, &mut projected);
        Ok((v, projected))
    }

    /// `ᵠp_n = −Q (D_1 L_d(q_n, q_{n+1}) + f_d^-)` (39).
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn projected_momentum_minus(
        &mut self,
        after: &Interval,
    ) -> Result<Vec<f64>, LegendreError> {
        let p = self.p_minus(after)?;
        Ok(self.tangential(after.start(), &p)?.1) // (39)
    }

    /// `ᵠp_n = Q (D_2 L_d(q_{n-1}, q_n) + f_d^+)` (40).
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn projected_momentum_plus(
        &mut self,
        before: &Interval,
    ) -> Result<Vec<f64>, LegendreError> {
        let p = self.p_plus(before)?;
        Ok(self.tangential(before.end(), &p)?.1) // (40)
    }

    /// A null space matrix `P(q)` by QR, orthonormal columns, shape `n × d`. Its columns may change
    /// abruptly from one configuration to the next; `P` from a velocity analysis does not.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn null_space(&self, at: Configuration<'_>) -> Result<DMatrix<f64>, LegendreError> {
        self.check_vectors(at.q, at.q)?;
        Ok(null_space_at(self.constraints, at, self.rank))
    }

    /// `ᴾp_n = −Pᵀ (D_1 L_d(q_n, q_{n+1}) + f_d^-)` (41), shape `d`, with `P = P(q_n)`, shape
    /// `n × d`.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn reduced_momentum_minus(
        &self,
        after: &Interval,
        p: &DMatrix<f64>,
    ) -> Result<Vec<f64>, LegendreError> {
        self.reduced(&self.p_minus(after)?, p) // (41)
    }

    /// `ᴾp_n = Pᵀ (D_2 L_d(q_{n-1}, q_n) + f_d^+)` (42), shape `d`, with `P = P(q_n)`, shape
    /// `n × d`.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn reduced_momentum_plus(
        &self,
        before: &Interval,
        p: &DMatrix<f64>,
    ) -> Result<Vec<f64>, LegendreError> {
        self.reduced(&self.p_plus(before)?, p) // (42)
    }

    fn reduced(
        &self,
        momentum: &[f64],
        null_space: &DMatrix<f64>,
    ) -> Result<Vec<f64>, LegendreError> {
        shape("a column of P", null_space.nrows(), self.system.dim())?;
        shape("a row of P", null_space.ncols(), self.system.dim() - self.rank)?;
        let mut out = vec![0.0; null_space.ncols()];
        pull_back(null_space, momentum, &mut out);
        finite("the reduced momentum", &out)?;
        Ok(out)
    }

    /// `E_d(q_n, q_{n+1})` (52), J.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn discrete_energy(&self, s: &Interval) -> Result<Energies, LegendreError> {
        self.check(s)?;
        let found = vi_core::legendre::discrete_energy(self.system, s); // (52)
        finite("the energy", &[found.kinetic, found.potential])?;
        Ok(found)
    }

    /// `H_d(q_n, p)` (53), J; `None` when `M` is singular or a discrete potential adds to it.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn hamiltonian(
        &mut self,
        at: Configuration<'_>,
        p: &[f64],
    ) -> Result<Option<Energies>, LegendreError> {
        self.check_vectors(at.q, p)?;
        let mut v = vec![0.0; p.len()];
        let has_velocity = self.projections.free_velocity(self.system, p, &mut v)?;
        let found = has_velocity.then(|| hamiltonian(self.system, at.moving(&v), p)); // (53)
        found.iter().try_for_each(|e| finite("the energy", &[e.kinetic, e.potential]))?;
        Ok(found)
    }

    /// `H_d(q_n, ᵠp)` (53) with the projection of a momentum, J: `½ v̂ᵀ M v̂ + V(q_n)`; for
    /// scleronomic constraints the same as `½ ᴾpᵀ (PᵀMP)⁻¹ ᴾp + V(q_n)`.
    ///
    /// # Errors
    /// [`LegendreError`].
    pub fn projected_hamiltonian(
        &mut self,
        at: Configuration<'_>,
        p: &[f64],
    ) -> Result<Energies, LegendreError> {
        let (v, projected) = self.tangential(at, p)?;
        let found = hamiltonian(self.system, at.moving(&v), &projected); // (53)
        finite("the energy", &[found.kinetic, found.potential])?;
        Ok(found)
    }

    /// `−D_1 L_d − f_d^-`.
    fn p_minus(&self, s: &Interval) -> Result<Vec<f64>, LegendreError> {
        self.check(s)?;
        let mut p = vec![0.0; s.dim()];
        p_minus(self.system, s, &mut p);
        finite("D_1 L_d + f_d^-", &p)?;
        Ok(p)
    }

    /// `D_2 L_d + f_d^+`.
    fn p_plus(&self, s: &Interval) -> Result<Vec<f64>, LegendreError> {
        self.check(s)?;
        let mut p = vec![0.0; s.dim()];
        p_plus(self.system, s, &mut p);
        finite("D_2 L_d + f_d^+", &p)?;
        Ok(p)
    }

    fn check(&self, s: &Interval) -> Result<(), LegendreError> {
        shape("the interval", s.dim(), self.system.dim())?;
        step(s.h)
    }

    fn check_vectors(&self, q: &[f64], p: &[f64]) -> Result<(), LegendreError> {
        shape("q", q.len(), self.system.dim())?;
        shape("the vector", p.len(), self.system.dim())?;
        finite("the configuration", q)?;
        finite("the vector", p)
    }
}

/// `p ← p + half_step Gᵀλ`: (34) with `½ h`, (35) with `−½ h`.
pub fn add_constraint_impulse(half_step: f64, force: &[f64], p: &mut [f64]) {
    p.iter_mut().zip(force).for_each(|(p, force)| *p += half_step * force);
}
