//! Nodal Galerkin scheme: [2.28], solved by sweeps with one factorization for each control point
//! and step.
//!
//! ```text
//! r_i = P(q_i)ᵀ w_i = 0,   i = 0 … s−1,        q_j = F_d(u_j, q_n),  j = 1 … s                      [2.28]
//! u_j ← u_j − h A_j⁻¹ Σ_i (K̂⁻¹)_ji r_i,         A_j = P(q_j)ᵀ M ∂F_d/∂u (u_j, q_n)                    [2.30]
//! ```
//! `(1/h) K̂ ⊗ A` is the Jacobian but for the variation of `P` from one control point to the next
//! and for `∇²V`, so the corrections contract by a ratio of `O(h)`; the residual is exact, and with
//! it the root. The factors are computed at the initial guess, and again while the corrections are
//! large.
//!
//! # Initial guesses
//! 1. the polynomial of the last step continued: `u_j ← Σ_i ℓ_i(1 + c̃_j) u_i` less `u_s`, and by
//!    how much such polynomials missed, extrapolated from the last steps,
//! 2. `u = 0`, from where the first correction leads to `c̃_j h ν`,
//! 3. the motion in four smaller steps.
//!
//! With large steps there are mirrored solutions, on other branches of the motion. A solution is
//! refused that is farther than 0.5 rad from what the first correction led to.

use crate::constraints::Constraints;
use crate::galerkin::GaussPoint;
use crate::galerkin::control_points::ControlPoints;
use crate::galerkin::sweeps::Sweeps;
use crate::scheme::{Guess, Scheme, StepError, SubStep};
use crate::unknowns::Increments;
use vi_core::galerkin::Stages;
use vi_core::interpolation::StepPolynomial;
use vi_core::interval::Interval;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::newton::{
    BlockKind, Fault, Newton, NewtonProblem, NewtonSettings, Precision, UnknownBlock,
};
use vi_core::predictor::Degree;
use vi_core::state::State;

/// Corrections larger than this, in rad or relative to the increments, are followed by new factors.
const LARGE: f64 = 1e-2;
/// Distance from the first correction to the solution, rad.
const FAR: f64 = 0.5;
/// Smaller steps of the last initial guess.
const SMALLER: usize = 4;

/// The nodal scheme of order `2s`.
#[derive(Debug)]
pub struct GalerkinNodal<O> {
    sweeps: O,
    points: ControlPoints,
    increments: Increments,
    first: Vec<f64>,     // s d  unknowns after the first correction
    last: Vec<f64>,      // s d  those of the last step, while they are continued
    continued: Vec<f64>, // s d  the polynomial of the last step; empty: another initial guess
    corrections: usize,  // since the initial guess
    outdated: bool,      // the factors
}

impl<O: Sweeps> GalerkinNodal<O> {
    /// For `n` coordinates.
    #[must_use]
    pub fn new(n: usize, stages: Stages, sweeps: O) -> Self {
        let (s, d) = (stages.count(), sweeps.dof());
        let shifted = |j: usize| {
            let block = move |block: &UnknownBlock| {
                let range = block.range.start + j * d..block.range.end + j * d;
                UnknownBlock { range, ..block.clone() }
            };
            sweeps.blocks().iter().map(block).collect::<Vec<_>>()
        };
        let blocks = (0..s).flat_map(shifted).collect();
        Self {
            sweeps,
            points: ControlPoints::new(n, stages),
            increments: Increments::new(blocks),
            first: vec![0.0; s * d],
            last: vec![0.0; s * d],
            continued: Vec::with_capacity(s * d),
            corrections: 0,
            outdated: true,
        }
    }

    /// `r_i = P(q_i)ᵀ w_i` [2.28].
    fn evaluate(
        &mut self,
        system: &impl MechanicalSystem,
        u: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        if self.sweeps.dof() == 0 {
            return Ok(());
        }
        self.sweeps.residual(system, &mut self.points, u, r, self.outdated)
    }

    fn precision_of_sweeps(&self) -> Precision {
        Precision { noise: self.sweeps.noise(), is_simplified: true, ..Precision::default() }
    }

    /// Moves the control points to `u`.
    fn settle_at(&mut self, system: &impl MechanicalSystem, u: &[f64]) -> Result<(), Fault> {
        if self.sweeps.dof() == 0 {
            return Ok(());
        }
        self.sweeps.settle(system, &mut self.points, u)
    }

    /// `du_j ← h A_j⁻¹ Σ_i (K̂⁻¹)_ji r_i` [2.30].
    fn correct(&mut self, u: &[f64], du: &mut [f64]) -> Result<(), Fault> {
        let Self { sweeps, points, first, corrections, outdated, increments, .. } = self;
        if sweeps.dof() == 0 {
            return Ok(());
        }
        sweeps.correction(points, u, du)?;
        if *corrections == 0 {
            for ((first, u), du) in first.iter_mut().zip(u).zip(&*du) {
                *first = u - du;
            }
        }
        *corrections += 1;
        let is_large = |block: &UnknownBlock| {
            let size = match block.kind {
                BlockKind::Rotation => 1.0,
                _ => u[block.range.clone()].iter().fold(block.floor, |size, u| size.max(u.abs())),
            };
            du[block.range.clone()].iter().any(|du| du.abs() > LARGE * size)
        };
        *outdated = *outdated && increments.blocks().iter().any(is_large);
        Ok(())
    }

    /// Begins anew with another initial guess.
    fn restart(&mut self) {
        (self.corrections, self.outdated) = (0, true);
    }

    /// Continues the polynomial of the last step, whose increments are in `x`.
    fn extrapolate(&mut self, x: &mut [f64]) {
        let Self { sweeps, points, last, .. } = self;
        let (d, constants) = (sweeps.dof(), points.constants());
        last.copy_from_slice(x);
        let end = last.len() - d;
        for (j, u) in x.chunks_exact_mut(d).enumerate() {
            u.fill(0.0);
            for (i, last) in last.chunks_exact(d).enumerate() {
                let weight = constants.extrapolation[(j, i + 1)]; // ℓ_i(1 + c̃_j), u_0 = 0
                u.iter_mut().zip(last).for_each(|(u, last)| *u += weight * last);
            }
        }
        last[end..].iter_mut().for_each(|u| *u = -*u);
        x.chunks_exact_mut(d).for_each(|u| sweeps.compose(&last[end..], u));
    }

    /// Increments of the control points from smaller steps; whether these could be taken.
    /// Allocates.
    fn approach(
        &mut self,
        system: &impl MechanicalSystem,
        step: SubStep,
        from: &State,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        let (d, s) = (self.sweeps.dof(), self.points.stages());
        let (mut state, h) = (from.clone(), step.h / SMALLER as f64);
        let mut newton = Newton::new(x.len(), NewtonSettings::default());
        let (mut local, mut reached) = (vec![0.0; x.len()], vec![0.0; d]);
        let mut solved = Ok(());
        for k in 0..SMALLER {
            self.sweeps.open(system, &mut self.points, SubStep::single(state.t, h), &state);
            self.restart();
            local.fill(0.0);
            let mut problem = SmallerStep { scheme: self, system };
            if newton.solve(&mut problem, &mut local).is_err() {
                solved = Err(Fault::NotFinite);
                break;
            }
            for (j, u) in x.chunks_exact_mut(d).enumerate() {
                let tau = SMALLER as f64 * self.points.constants().nodes[j + 1] - k as f64;
                if tau > 0.0 {
                    u.fill(0.0);
                    for (i, local) in local.chunks_exact(d).enumerate() {
                        let weight = self.points.constants().lagrange(i + 1, tau.min(1.0));
                        u.iter_mut().zip(local).for_each(|(u, local)| *u += weight * local);
                    }
                    self.sweeps.compose(&reached, u);
                }
            }
            reached.copy_from_slice(&x[(s - 1) * d..]);
            self.sweeps.close(system, &mut self.points, &mut state.p);
            self.points.write_internal(&mut state.internal);
            state.t += h;
            state.q.copy_from_slice(self.points.q(s));
        }
        self.sweeps.open(system, &mut self.points, step, from);
        self.restart();
        solved
    }
}

/// The equations of a smaller step.
struct SmallerStep<'a, O, S> {
    scheme: &'a mut GalerkinNodal<O>,
    system: &'a S,
}

impl<O: Sweeps, S: MechanicalSystem> NewtonProblem for SmallerStep<'_, O, S> {
    fn blocks(&self) -> &[UnknownBlock] {
        self.scheme.increments.blocks()
    }

    fn residual(&mut self, x: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.scheme.evaluate(self.system, x, r)
    }

    fn correction(&mut self, x: &[f64], dx: &mut [f64]) -> Result<(), Fault> {
        self.scheme.correct(x, dx)
    }

    fn settle(&mut self, x: &[f64], _: &mut [f64]) -> Result<(), Fault> {
        self.scheme.settle_at(self.system, x)
    }

    fn precision(&self) -> Precision {
        self.scheme.precision_of_sweeps()
    }
}

impl<S: MechanicalSystem, C: Constraints, O: Sweeps> Scheme<S, C> for GalerkinNodal<O> {
    fn blocks(&self) -> &[UnknownBlock] {
        self.increments.blocks()
    }

    fn begin(&mut self, system: &S, constraints: &C, step: SubStep, state: &mut State) {
        self.increments.open(constraints, &state.q);
        self.sweeps.open(system, &mut self.points, step, state);
    }

    fn guess(
        &mut self,
        system: &S,
        attempt: usize,
        step: SubStep,
        state: &State,
        x: &mut [f64],
    ) -> Option<Guess> {
        self.restart();
        self.continued.clear();
        let continued = state.history.predict(step.index, step.h, Degree::Zero, x);
        match attempt + usize::from(!continued) {
            0 if !x.is_empty() => {
                self.extrapolate(x);
                self.continued.extend_from_slice(x);
                let (misses, miss) = (&state.memory.misses, &mut self.last);
                if misses.predict(step.index, step.h, Degree::Correcting, miss) {
                    x.iter_mut().zip(miss).for_each(|(x, miss)| *x += *miss);
                }
            }
            0 | 1 => x.fill(0.0),
            2 => self.approach(system, step, state, x).ok()?,
            _ => return None,
        }
        Some(Guess::Plain)
    }

    fn residual(&mut self, system: &S, _: &C, u: &[f64], r: &mut [f64]) -> Result<(), Fault> {
        self.evaluate(system, u, r)
    }

    fn correction(&mut self, _: &S, _: &C, u: &[f64], du: &mut [f64]) -> Result<(), Fault> {
        self.correct(u, du)
    }

    fn settle(&mut self, system: &S, _: &C, u: &[f64], _: &mut [f64]) -> Result<(), Fault> {
        self.settle_at(system, u)
    }

    fn precision(&self) -> Precision {
        self.precision_of_sweeps()
    }

    fn accept(&self, u: &[f64]) -> Result<(), Fault> {
        let rotations =
            self.increments.blocks().iter().filter(|block| block.kind == BlockKind::Rotation);
        for unknown in rotations.flat_map(|block| block.range.clone()) {
            let distance = (u[unknown] - self.first[unknown]).abs();
            if self.corrections > 0 && distance > FAR {
                let unknown = unknown % self.sweeps.dof();
                return Err(Fault::FarFromGuess { unknown, distance });
            }
        }
        Ok(())
    }

    fn end(
        &mut self,
        system: &S,
        _constraints: &C,
        _newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError> {
        let Self { sweeps, points, continued, .. } = self;
        if sweeps.dof() == 0 {
            points.evaluate(system); // nothing moves but what is beside the motion
        }
        sweeps.close(system, points, &mut state.p); // p̄_{n+1}  [2.29]
        points.write_internal(&mut state.internal);
        sweeps.remember(&mut state.memory);
        let (u, misses) = (state.history.increment(0, 0), &mut state.memory.misses);
        misses.fit(u.len(), 1, 0..0);
        if continued.is_empty() {
            misses.clear();
        } else {
            continued.iter_mut().zip(u).for_each(|(miss, u)| *miss = u - *miss);
            misses.remember(0, points.step().h, false, continued);
        }
        state.move_to_configuration(points.step(), |t, q| sweeps.clean(t, q));
        Ok(())
    }

    fn interpolate(&mut self) {
        self.sweeps.write_increments(&mut self.points);
        self.points.interpolate();
    }

    fn gauss(&self) -> &[GaussPoint] {
        self.points.gauss()
    }

    fn polynomial(&self) -> Option<StepPolynomial<'_>> {
        Some(self.points.polynomial())
    }

    fn interval(&self) -> &Interval {
        self.points.step()
    }

    fn interval_mut(&mut self) -> &mut Interval {
        self.points.step_mut()
    }
}
