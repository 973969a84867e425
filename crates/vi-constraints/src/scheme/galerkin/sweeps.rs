//! One sweep of the nodal Galerkin scheme over all control points of a step.
//!
//! [`Sweeps`] is what the scheme asks for: residuals [2.28] and corrections [2.30] of all control
//! points at once. [`Pointwise`] gives it from [`ControlPointOperators`], one control point after
//! the other.

use crate::galerkin::control_points::ControlPoints;
use crate::galerkin::operators::ControlPointOperators;
use crate::reparametrization::LastStep;
use crate::scheme::SubStep;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::newton::{Fault, UnknownBlock};
use vi_core::sparse::Entries;
use vi_core::state::{Memory, State};

/// Residuals and corrections of a step. Unknowns `u` and residuals `r`: shape `s × d`, control
/// point by control point.
pub trait Sweeps: Send {
    /// Degrees of freedom `d`.
    fn dof(&self) -> usize;
    /// Units and scales of the increments of one control point.
    fn blocks(&self) -> &[UnknownBlock];
    /// See [`vi_core::newton::Precision::noise`].
    fn noise(&self) -> f64 {
        1e-9
    }
    /// Opens a step at a state.
    fn open(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        step: SubStep,
        state: &State,
    );
    /// `r_i ← P(q_i)ᵀ w_i` with `q_j = F_d(u_j, q_n)` [2.28]; `anew`: factors for the next
    /// corrections, too.
    ///
    /// # Errors
    /// [`Fault`] when `u` is outside the domain of the map; [`Fault::SingularTangent`].
    fn residual(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
        r: &mut [f64],
        anew: bool,
    ) -> Result<(), Fault>;
    /// Moves the control points to `u`, with what [`Sweeps::close`] needs there.
    ///
    /// # Errors
    /// [`Fault`] when `u` is outside the domain of the map.
    fn settle(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
    ) -> Result<(), Fault>;
    /// `du_j ← h A_j⁻¹ Σ_i (K̂⁻¹)_ji r_i` [2.30] of the last residual, which is in `du`, at `u`.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    fn correction(
        &mut self,
        points: &ControlPoints,
        u: &[f64],
        du: &mut [f64],
    ) -> Result<(), Fault>;
    /// Writes `q_{n+1}` with its increment into the interval of the step and `p ← p̄_{n+1} = w_s`
    /// [2.29], at the control points of the last residual, or where they were moved since.
    fn close(&mut self, system: &impl MechanicalSystem, points: &mut ControlPoints, p: &mut [f64]) {
        points.balance(system, points.stages(), p);
    }
    /// See [`crate::reparametrization::NodalOperators::remember`].
    fn remember(&self, _memory: &mut Memory) {}
    /// Writes the increments `Δ_j` of all control points of the last residual.
    fn write_increments(&self, _points: &mut ControlPoints) {} // those of most are there
    /// `u ←` the increment of `first` and then `u`; of use for initial guesses.
    fn compose(&self, first: &[f64], u: &mut [f64]);
    /// See [`crate::reparametrization::Reparametrization::clean`].
    fn clean(&mut self, t: f64, q: &mut [f64]);
}

/// `out ← Σ_k weight_k x_k` of vectors that follow one another in `x`.
pub fn mix(weight: impl Fn(usize) -> f64, x: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for (k, x) in x.chunks_exact(out.len()).enumerate() {
        let weight = weight(k);
        out.iter_mut().zip(x).for_each(|(out, x)| *out += weight * x);
    }
}

/// [`Sweeps`] from operators of single control points.
#[derive(Debug)]
pub struct Pointwise<O> {
    operators: O,
    w: Vec<f64>, // n  balance of a control point
    r: Vec<f64>, // s d  residual, while corrections are made of it
}

impl<O: ControlPointOperators> Pointwise<O> {
    /// For `n` coordinates and `stages` control points.
    #[must_use]
    pub fn new(n: usize, stages: usize, operators: O) -> Self {
        Self { w: vec![0.0; n], r: vec![0.0; stages * operators.dof()], operators }
    }
}

impl<O: ControlPointOperators> Sweeps for Pointwise<O> {
    fn dof(&self) -> usize {
        self.operators.dof()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        self.operators.blocks()
    }

    fn open(
        &mut self,
        _: &impl MechanicalSystem,
        points: &mut ControlPoints,
        step: SubStep,
        state: &State,
    ) {
        points.open(step, state);
    }

    fn residual(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
        r: &mut [f64],
        anew: bool,
    ) -> Result<(), Fault> {
        self.settle(system, points, u)?;
        let Self { operators, w, .. } = self;
        let d = operators.dof();
        for (i, r) in r.chunks_exact_mut(d).enumerate() {
            points.balance(system, i, w);
            let reached = i.checked_sub(1).map(|j| {
                let (u, s) = (&u[j * d..i * d], points.point(i));
                LastStep { u, s }
            });
            operators.pull_back(points.q(i), reached, w, r);
        }
        if anew {
            let mass = |out: &mut dyn Entries| system.mass().emit(out);
            for (j, u) in u.chunks_exact(d).enumerate() {
                operators.factorize(j, &mass, u, points.point(j + 1))?;
            }
        }
        Ok(())
    }

    fn settle(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
    ) -> Result<(), Fault> {
        for (j, u) in u.chunks_exact(self.operators.dof()).enumerate() {
            self.operators.reparametrize(u, points.point_mut(j + 1))?; // q_j = F_d(u_j, q_n)
        }
        points.evaluate(system);
        Ok(())
    }

    fn correction(
        &mut self,
        points: &ControlPoints,
        _u: &[f64],
        du: &mut [f64],
    ) -> Result<(), Fault> {
        let Self { operators, r, .. } = self;
        let (d, h) = (operators.dof(), points.h());
        r.copy_from_slice(du);
        for (j, du) in du.chunks_exact_mut(d).enumerate() {
            mix(|i| h * points.constants().K_hat_inverse[(j, i)], r, du);
            operators.solve(j, du)?;
        }
        Ok(())
    }

    fn compose(&self, first: &[f64], u: &mut [f64]) {
        self.operators.compose(first, u);
    }

    fn clean(&mut self, t: f64, q: &mut [f64]) {
        self.operators.clean(t, q);
    }
}
