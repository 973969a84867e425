//! Relaxation: equilibria from a configuration that is none, and neutral equilibria.
//!
//! ```text
//! r(q_{k+1}, μ) + σ S u_k = 0,   q_{k+1} = F_d(u_k, q_k),   σ → 0         S: lengths and angles in one metric
//! ```
//! Steps of the implicit Euler method for a motion so slow that it is damped throughout,
//! `S u̇ = −r`: the energy falls with every step, and a stable equilibrium is where it ends. The
//! constraints are satisfied after every step. `σ` is at first large enough for small steps, falls
//! after each good one as long as `K + σS` stays positive definite ([`crate::stability`]), and is
//! the ratio of Levenberg and Marquardt. A direction without stiffness (the spin of a hanging body
//! about the vertical) stays where it is.
//!
//! Source: C. T. Kelley, D. E. Keyes, SIAM J. Numer. Anal. 35 (1998) 508–523, pseudo-transient
//! continuation.

use crate::path::{Equilibrium, StaticError};
use crate::problem::StaticProblem;
use crate::stability::TangentStiffness;
use crate::step_bounds::{StepBounds, StepFailure};
use vi_constraints::Constraints;
use vi_core::Configuration;
use vi_core::linear::norm_inf;
use vi_core::newton::NewtonReport;

/// Steps of one relaxation.
const STEPS: usize = 500;
/// Displacement of the first step, as a part of the size of the system.
const FIRST: f64 = 0.02;
/// Displacement that hidden forces may still cause, as a part of the size of the system.
const BENT: f64 = 1e-6;
/// Residual force, as a part of the largest force, at which a relaxation ends.
const REST: f64 = 1e-12;
/// The same for an initial configuration that is an equilibrium already.
const AT_REST: f64 = 1e-9;

impl StaticProblem {
    /// Relaxes the initial configuration to an equilibrium at the present load parameter; one that
    /// is an equilibrium is not changed.
    ///
    /// # Errors
    /// [`StaticError::NoInitialEquilibrium`].
    pub fn equilibrate(&mut self) -> Result<Equilibrium, StaticError> {
        let found = self.try_equilibrate();
        let factor = self.work.t;
        found.map_err(|refused| StaticError::NoInitialEquilibrium {
            factor,
            cause: refused.to_string(),
        })
    }

    fn try_equilibrate(&mut self) -> Result<Equilibrium, StepFailure> {
        let residual = self.work.balance(&mut self.x).map_err(StepFailure::fault)?;
        let d = self.work.unknowns();
        self.mu.copy_from_slice(&self.x[d..]);
        let scale = self.work.force_scale();
        let balanced = residual <= (AT_REST * scale).max(self.work.round_off());
        let at_rest = balanced && self.is_closed() && !self.bends_further();
        let relaxed = if at_rest { None } else { Some(self.relax(&StepBounds::NONE)?) };
        self.neutral = self.is_neutral_here();
        let polished = if at_rest || self.neutral { None } else { self.polish() };
        let point = match polished.or(relaxed) {
            Some(point) => point,
            None => self.here(0, residual),
        };
        self.unstable = point.unstable;
        Ok(point)
    }

    fn is_closed(&self) -> bool {
        let mechanism = &self.work.mechanism;
        let mut g = vec![0.0; mechanism.len()];
        mechanism.value(Configuration { t: self.work.t, ..self.work.s.start() }, &mut g);
        norm_inf(&g) <= AT_REST
    }

    /// Whether some direction has no stiffness at the last equilibrium: as at a limit point, at a
    /// bifurcation point, or where nothing holds it.
    pub fn is_neutral_here(&mut self) -> bool {
        let d = self.work.unknowns();
        self.x[..d].fill(0.0);
        self.x[d..].copy_from_slice(&self.mu);
        let x = self.x.clone();
        self.work.is_neutral(&x)
    }

    /// Whether forces that the round-off of stiff strains (extension, shear) hides still move
    /// something soft: whether `K⁻¹ r` at the last equilibrium is more than rounding, in no neutral
    /// direction.
    fn bends_further(&mut self) -> bool {
        if self.is_neutral_here() {
            return false;
        }
        let sigma = std::mem::replace(&mut self.work.sigma, 0.0);
        let mut step = vec![0.0; self.x.len()];
        let evaluated = self.work.evaluate(&self.x, &mut step);
        self.work.fill_tangent(&self.x);
        let solved = evaluated.is_ok() && self.work.solve(&mut step).is_ok();
        self.work.sigma = sigma;
        solved && self.work.product(&step, &step).sqrt() > BENT * self.work.size()
    }

    /// Newton's method without damping from a place near an equilibrium, to where rounding of stiff
    /// strains hides no displacement; `None` where it does not converge.
    fn polish(&mut self) -> Option<Equilibrium> {
        let mark = self.mark();
        let found = self.correct().and_then(|report| self.accept(&report));
        if found.is_err() {
            self.return_to(mark);
        }
        found.ok()
    }

    /// Relaxes from the last equilibrium at the present load parameter. On failure everything is as
    /// before; a motion beyond the `bounds` is one.
    pub(crate) fn relax(&mut self, bounds: &StepBounds) -> Result<Equilibrium, StepFailure> {
        let (start, mu) = (self.work.s.q0.clone(), self.mu.clone());
        let angles = self.work.s.angles.clone();
        let outcome = self.relax_from_here(&start, bounds);
        self.work.sigma = 0.0;
        if outcome.is_err() {
            self.work.stand_at(&start, angles);
            self.mu = mu;
        }
        outcome
    }

    fn relax_from_here(
        &mut self,
        start: &[f64],
        bounds: &StepBounds,
    ) -> Result<Equilibrium, StepFailure> {
        let d = self.work.unknowns();
        let residual = self.work.balance(&mut self.x).map_err(StepFailure::fault)?;
        self.mu.copy_from_slice(&self.x[d..]);
        let size = self.work.size();
        let mut sigma = residual.max(REST * self.work.force_scale()) / (FIRST * size);
        sigma = sigma.max(f64::MIN_POSITIVE);
        let (mut report, mut last) = (NewtonReport::default(), None);
        for _ in 0..STEPS {
            self.work.sigma = sigma;
            match self.relaxation_step() {
                Ok(step) => {
                    report.iterations += step.iterations;
                    report.residual = self.residual_force();
                    let end = self.work.s.q1.clone();
                    self.mu.copy_from_slice(&self.x[d..]);
                    self.advance();
                    self.refuse_far_end(start, &end, bounds)?;
                    let rest = REST * self.work.force_scale();
                    let hidden = report.residual <= self.work.round_off();
                    let settled = report.residual <= rest || hidden && !self.bends_further();
                    if settled || sigma <= 1e-280 {
                        return Ok(self.here(report.iterations, report.residual));
                    }
                    sigma *= if step.iterations <= 6 { 0.1 } else { 0.5 };
                    sigma = self.descending(sigma);
                    last = None;
                }
                Err(error) => {
                    sigma *= 5.0;
                    last = Some(error);
                }
            }
        }
        Err(last.unwrap_or_else(|| {
            let scale = self.work.force_scale();
            let residual = report.residual / scale;
            StepFailure::Jump(format!(
                "after {STEPS} relaxation steps the residual is {residual:.1e} of the largest force"
            ))
        }))
    }

    /// The damping that is to come, increased until the stiffness with it has no negative
    /// eigenvalue: from an unstable equilibrium the motion then leaves along what disturbs it, and
    /// the energy falls with every step.
    fn descending(&mut self, sigma: f64) -> f64 {
        const DOUBLINGS: usize = 60;
        let Some(stiffness) = self.stiffness().filter(TangentStiffness::is_symmetric) else {
            return sigma;
        };
        let mut damped = sigma;
        for _ in 0..DOUBLINGS {
            match stiffness.negative(damped) {
                Some(0) => return damped,
                Some(_) => damped *= 2.0,
                None => return sigma,
            }
        }
        sigma
    }

    fn relaxation_step(&mut self) -> Result<NewtonReport, StepFailure> {
        let report = self.correct()?;
        self.check_limit()?;
        Ok(report)
    }

    /// `|r_u|_∞` without the damping, at the point last evaluated: that is `|σ S u|`.
    fn residual_force(&self) -> f64 {
        let damping = self.work.metric().iter().zip(&self.x).map(|(s, u)| self.work.sigma * s * u);
        norm_inf(&damping.collect::<Vec<f64>>())
    }

    /// Refuses a configuration too far from the initial one of the relaxation.
    fn refuse_far_end(
        &mut self,
        start: &[f64],
        end: &[f64],
        bounds: &StepBounds,
    ) -> Result<(), StepFailure> {
        let here = self.work.s.q0.clone();
        self.work.s.q0.copy_from_slice(start);
        self.work.s.q1.copy_from_slice(end);
        let outcome = self.refuse_jump(bounds);
        let angles = self.work.s.angles.clone();
        self.work.stand_at(&here, angles);
        outcome
    }
}
