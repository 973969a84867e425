//! Equilibria that cannot be reached by small steps of the load: the start, and directions without stiffness.
//!
//! ```text
//! r(q_{k+1}, μ) + σ S u_k = 0,   q_{k+1} = F_d(u_k, q_k),   σ → 0         S: lengths and angles in one metric
//! ```
//! Steps of the implicit Euler method for a motion so slow that it is damped throughout,
//! `S u̇ = −r`: the energy falls with every step, and a stable equilibrium is where it ends. The
//! constraints hold all the way. `σ` starts large enough for small steps, falls after each good one, and is
//! the ratio of Levenberg and Marquardt. A direction without stiffness (the spin of a hanging body about the
//! vertical) stays where it is.
//!
//! Source: C. T. Kelley, D. E. Keyes, SIAM J. Numer. Anal. 35 (1998) 508–523, pseudo-transient
//! continuation.

use crate::static_path::{Equilibrium, StaticError, StepBounds};
use crate::statics::{Refused, StaticProblem};
use vi_core::linear::norm_inf;
use vi_core::newton::{Fault, NewtonError, NewtonReport};

/// Steps of one relaxation.
const STEPS: usize = 500;
/// Motion of the first step, as a part of the size of the system.
const FIRST: f64 = 0.02;
/// Force left over, as a part of the largest one, at which a relaxation is at rest.
const REST: f64 = 1e-12;
/// The same at a start that is an equilibrium already.
const AT_REST: f64 = 1e-9;

impl StaticProblem {
    /// Brings the start to rest at the present load parameter; a start that is an equilibrium stays as it
    /// is.
    ///
    /// # Errors
    /// [`StaticError::NoStart`].
    pub fn settle(&mut self) -> Result<Equilibrium, StaticError> {
        let found = self.try_settle();
        let factor = self.work.t;
        found.map_err(|refused| StaticError::NoStart { factor, cause: refused.to_string() })
    }

    fn try_settle(&mut self) -> Result<Equilibrium, Refused> {
        let left = self.work.balance(&mut self.x).map_err(refused)?;
        let d = self.work.unknowns();
        self.mu.copy_from_slice(&self.x[d..]);
        let scale = self.work.force_scale();
        let closed = self.here(0, left).position_residual <= AT_REST;
        let point = if left <= (AT_REST * scale).max(self.work.round_off()) && closed {
            self.here(0, left)
        } else {
            self.relax(&StepBounds::NONE)?
        };
        self.x[..d].fill(0.0);
        self.x[d..].copy_from_slice(&self.mu);
        self.neutral = self.work.is_neutral(&self.x);
        Ok(point)
    }

    /// Relaxes from the last equilibrium at the present load parameter. On failure everything is as
    /// before; a motion beyond the `bounds` is one.
    pub(crate) fn relax(&mut self, bounds: &StepBounds) -> Result<Equilibrium, Refused> {
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
    ) -> Result<Equilibrium, Refused> {
        let d = self.work.unknowns();
        let left = self.work.balance(&mut self.x).map_err(refused)?;
        self.mu.copy_from_slice(&self.x[d..]);
        let size = self.work.size();
        let mut sigma = left.max(REST * self.work.force_scale()) / (FIRST * size);
        sigma = sigma.max(f64::MIN_POSITIVE);
        let (mut report, mut last) = (NewtonReport::default(), None);
        for _ in 0..STEPS {
            self.work.sigma = sigma;
            match self.relaxation_step() {
                Ok(step) => {
                    report.iterations += step.iterations;
                    report.residual = self.left_over();
                    let end = self.work.s.q1.clone();
                    self.mu.copy_from_slice(&self.x[d..]);
                    self.move_on();
                    self.refuse_way(start, &end, bounds)?;
                    let rest = (REST * self.work.force_scale()).max(self.work.round_off());
                    if report.residual <= rest || sigma <= 1e-280 {
                        return Ok(self.here(report.iterations, report.residual));
                    }
                    sigma *= if step.iterations <= 6 { 0.1 } else { 0.5 };
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
            let left = report.residual / scale;
            Refused::Jump(format!(
                "after {STEPS} relaxation steps {left:.1e} of the forces is left"
            ))
        }))
    }

    fn relaxation_step(&mut self) -> Result<NewtonReport, Refused> {
        let report = self.correct()?;
        self.check_limit()?;
        Ok(report)
    }

    /// `|r_u|_∞` without the damping, at the point last evaluated: that is `|σ S u|`.
    fn left_over(&self) -> f64 {
        let damping = self.work.metric().iter().zip(&self.x).map(|(s, u)| self.work.sigma * s * u);
        norm_inf(&damping.collect::<Vec<f64>>())
    }

    /// Refuses an end too far from the start of the relaxation.
    fn refuse_way(
        &mut self,
        start: &[f64],
        end: &[f64],
        bounds: &StepBounds,
    ) -> Result<(), Refused> {
        let here = self.work.s.q0.clone();
        self.work.s.q0.copy_from_slice(start);
        self.work.s.q1.copy_from_slice(end);
        let outcome = self.refuse_jump(bounds);
        let angles = self.work.s.angles.clone();
        self.work.stand_at(&here, angles);
        outcome
    }
}

fn refused(fault: Fault) -> Refused {
    Refused::Newton(NewtonError::Refused { fault, iteration: 0 })
}
