//! Branch switching: from a path that loses its stability at a bifurcation to the branch that it
//! meets there.
//!
//! ```text
//! K φ ≈ 0,  |φ|_S = 1              the direction in which the stiffness vanishes, by inverse iteration
//! r(u, μ, t) = 0,   φ·S u/d = L    the load parameter t is an unknown: of all equilibria at the amplitude L
//! ```
//! The old path has no equilibrium at that amplitude, so that the branch is found whatever its
//! direction. Of its two halves the one is taken on which the largest component of `φ` is positive.
//!
//! Source: H. B. Keller, in: Applications of Bifurcation Theory (1977) 359–384; theory §6.9.

use crate::arc_length::{Bordered, PathTangent};
use crate::path::Equilibrium;
use crate::problem::StaticProblem;
use crate::step_bounds::StepFailure;
use vi_core::newton::Newton;

/// Amplitude of the first equilibrium of a branch, as a part of the size of the system.
const AMPLITUDE: f64 = 0.02;
/// Inverse iterations.
const ITERATIONS: usize = 30;

impl StaticProblem {
    /// The first equilibrium of the branch that leaves the path near the last equilibrium, which
    /// stands before or beyond the bifurcation; on failure everything is as before. Returns the
    /// increment with the change of the load parameter, too.
    pub(crate) fn switch_branch(
        &mut self,
        full: f64,
    ) -> Result<(Equilibrium, Vec<f64>), StepFailure> {
        let (d, rest, last) = (self.work.unknowns(), self.x.len(), self.work.t);
        let phi = self.critical_direction()?;
        let length = AMPLITUDE * self.work.size();
        let metric = self.work.metric();
        let a = phi.iter().zip(metric).map(|(phi, s)| s * phi / d.max(1) as f64).collect();
        let tangent = PathTangent { a, b: 0.0 };
        let blocks = self.arc_blocks(full);
        let mut newton = Newton::new(rest + 1, self.newton.settings);
        let (mut x, mut column) = (vec![0.0; rest + 1], vec![0.0; rest]);
        x[..d].iter_mut().zip(&phi).for_each(|(x, phi)| *x = length * phi);
        x[d..rest].copy_from_slice(&self.mu);
        let work = &mut self.work;
        work.tangent_stresses = None;
        let (blocks, column) = (&blocks[..], &mut column);
        let mut problem = Bordered { blocks, work, tangent: &tangent, length, last, column };
        let solved = newton.solve(&mut problem, &mut x).map_err(StepFailure::Newton);
        self.work.tangent_stresses = None;
        let outcome = solved.and_then(|report| {
            self.refuse_jump(&self.bounds)?;
            self.x.copy_from_slice(&x[..rest]);
            self.accept(&report)
        });
        if outcome.is_err() {
            self.work.t = last;
        }
        outcome.map(|point| (point, x))
    }

    /// `φ`, `φ·Sφ/d = 1`: the eigenvector of the stiffness next to 0 at the last equilibrium.
    fn critical_direction(&mut self) -> Result<Vec<f64>, StepFailure> {
        let d = self.work.unknowns();
        self.x[..d].fill(0.0);
        self.x[d..].copy_from_slice(&self.mu);
        let mut z = vec![0.0; self.x.len()];
        self.work.evaluate(&self.x, &mut z).map_err(StepFailure::fault)?;
        self.work.fill_tangent(&self.x);
        let metric = self.work.metric().to_vec();
        for (k, (z, s)) in z[..d].iter_mut().zip(&metric).enumerate() {
            *z = ((1.0 + k as f64).sqrt().fract() - 0.5) / s.sqrt();
        }
        for _ in 0..ITERATIONS {
            z[..d].iter_mut().zip(&metric).for_each(|(z, s)| *z *= s);
            z[d..].fill(0.0);
            self.work.solve(&mut z).map_err(|fault| StepFailure::fault(fault.into()))?;
            let norm = self.work.product(&z, &z).sqrt();
            z.iter_mut().for_each(|z| *z /= norm);
        }
        let scaled = |k: usize| z[k] * metric[k].sqrt();
        let largest = (0..d).max_by(|&i, &j| scaled(i).abs().total_cmp(&scaled(j).abs()));
        let sign = largest.map_or(1.0, |k| z[k].signum());
        Ok(z[..d].iter().map(|z| sign * z).collect())
    }
}
