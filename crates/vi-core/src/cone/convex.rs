//! Convex problems in a sequence, where Newton's method fails.
//!
//! With `s = μ|y_T|` held, the laws are the conditions of
//! ```text
//! min ½ΛᵀWΛ + (w + s e_N)ᵀΛ,   Λ_N ≥ 0, |Λ_T| ≤ μΛ_N, |Λ_B| ≤ b
//! ```
//! a convex program; its solution gives the next `s`. Source: V. Acary, F. Cadoux, C. Lemaréchal,
//! J. Malick, ZAMM 91 (2011) 155–175. The program is solved by accelerated projected gradients with
//! restarts, as in H. Mazhar, T. Heyn, D. Negrut, A. Tasora, ACM TOG 34 (2015) 32.

use super::problem::{Cone, Placed, Problem};
use super::residual::{clip, norm};
use crate::linear::dot;

/// Impulses of the size of one that move less change no velocity.
const STILL: f64 = 1e-9;

/// Projected steps for each `s`.
const STEPS: usize = 300;

#[derive(Clone, Debug, Default)]
pub(super) struct Convex {
    impulse: Vec<f64>,  // k
    shift: Vec<f64>,    // cones  s
    drift: Vec<f64>,    // k      what the last program changed
    ahead: Vec<f64>,    // k      the point of the gradient
    next: Vec<f64>,     // k
    gradient: Vec<f64>, // k
}

impl Convex {
    /// Begins with the given impulses and the `s` of their velocities.
    pub(super) fn begin(&mut self, problem: &Problem, impulse: &[f64], y: &[f64]) {
        self.impulse.clear();
        self.impulse.extend_from_slice(impulse);
        self.drift.clear();
        self.drift.resize(problem.rows(), 0.0);
        self.shift.clear();
        self.shift.resize(problem.cones.len(), 0.0);
        for vector in [&mut self.ahead, &mut self.next, &mut self.gradient] {
            vector.clear();
            vector.resize(problem.rows(), 0.0);
        }
        self.set_shift(problem, y, 1.0);
    }

    /// `s ← s + part (μ|y_T| − s)`.
    fn set_shift(&mut self, problem: &Problem, y: &[f64], part: f64) {
        for (Placed { cone, row }, shift) in problem.cones.iter().zip(&mut self.shift) {
            if let Cone::Friction { coefficient } = cone {
                *shift += part * (coefficient * norm([y[row + 1], y[row + 2]]) - *shift);
            }
        }
    }

    /// Solves the program with the present `s`, then takes `part` of the way to the next `s`.
    pub(super) fn advance(&mut self, problem: &Problem, part: f64) -> &[f64] {
        let k = problem.rows();
        let sums = (0..k).map(|i| problem.row(i).iter().map(|entry| entry.abs()).sum::<f64>());
        let step = 1.0 / sums.fold(f64::MIN_POSITIVE, f64::max);
        self.ahead.copy_from_slice(&self.impulse);
        self.drift.copy_from_slice(&self.impulse);
        let mut pace = 1.0_f64;
        for _ in 0..STEPS {
            for i in 0..k {
                self.gradient[i] = problem.velocity(i, &self.ahead);
            }
            for (Placed { cone, row }, shift) in problem.cones.iter().zip(&self.shift) {
                if matches!(cone, Cone::Friction { .. }) {
                    self.gradient[*row] += shift;
                }
            }
            for i in 0..k {
                self.next[i] = self.ahead[i] - step * self.gradient[i];
            }
            project(problem, &mut self.next);
            let change = |i: usize| self.next[i] - self.impulse[i];
            let uphill: f64 = (0..k).map(|i| self.gradient[i] * change(i)).sum();
            let next_pace = 0.5 * (1.0 + (1.0 + 4.0 * pace * pace).sqrt());
            let onward = if uphill > 0.0 { 0.0 } else { (pace - 1.0) / next_pace };
            pace = if uphill > 0.0 { 1.0 } else { next_pace };
            for i in 0..k {
                self.ahead[i] = self.next[i] + onward * (self.next[i] - self.impulse[i]);
            }
            self.impulse.copy_from_slice(&self.next);
        }
        for i in 0..k {
            self.gradient[i] = problem.velocity(i, &self.impulse);
        }
        let y = std::mem::take(&mut self.gradient);
        self.set_shift(problem, &y, part);
        self.gradient = y;
        self.drift.iter_mut().zip(&self.impulse).for_each(|(drift, now)| *drift = now - *drift);
        &self.impulse
    }

    /// Impulses that grow without bound change no velocity and oppose the approach: the cone with
    /// the largest of them, and their direction, the largest one 1.
    pub(super) fn wedged(&mut self, problem: &Problem) -> Option<(usize, &[f64])> {
        let normal = |placed: &&Placed| !matches!(placed.cone, Cone::Bounded { .. });
        let size = |cone: &Placed| self.drift[cone.row];
        let largest = problem.cones.iter().filter(normal).map(size).fold(0.0, f64::max);
        let cone = problem.cones.iter().position(|cone| normal(&cone) && size(cone) >= largest)?;
        self.drift.iter_mut().for_each(|drift| *drift /= largest);
        let approach = dot(&problem.w, &self.drift);
        let speeds = (0..problem.rows()).map(|i| problem.velocity(i, &self.drift) - problem.w[i]);
        let moved = speeds.fold(0.0, |moved: f64, speed| moved.max(speed.abs()));
        let size = problem.w.iter().map(|w| w.abs()).sum::<f64>();
        (largest > 0.0 && approach < -STILL * size && moved < STILL)
            .then_some((cone, &self.drift[..]))
    }
}

/// The nearest impulses in the cones.
fn project(problem: &Problem, impulse: &mut [f64]) {
    for &Placed { cone, row } in &problem.cones {
        match cone {
            Cone::Normal => impulse[row] = impulse[row].max(0.0),
            Cone::Bounded { bound } => impulse[row] = clip(impulse[row], bound),
            Cone::Sliding { direction, .. } => {
                let normal = impulse[row].max(0.0);
                let tangents = direction.map(|s| -normal * s);
                impulse[row..row + 3].copy_from_slice(&[normal, tangents[0], tangents[1]]);
            }
            Cone::Friction { coefficient } => {
                let (normal, tangent) = (impulse[row], norm([impulse[row + 1], impulse[row + 2]]));
                if tangent <= coefficient * normal {
                    continue;
                }
                let along = (normal + coefficient * tangent) / (1.0 + coefficient * coefficient);
                let along = along.max(0.0);
                let part = if tangent > 0.0 { coefficient * along / tangent } else { 0.0 };
                impulse[row] = along;
                impulse[row + 1] *= part;
                impulse[row + 2] *= part;
            }
        }
    }
}
