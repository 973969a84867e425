//! A primal–dual interior point method for laws whose sets are their own dual.
//!
//! ```text
//! A x + c + s = y,   x ∘ y = σμ e,   x, y in the cones
//! (A + M V⁻²) δx = M V⁻¹ d − r,   M δy = A δx + r   [2.53]   r = A x + c + s − y,   M = I − ∂s/∂y
//! ```
//! `s` along `e_0` of a cone: a speed that is given, or that of the slip, `|y_T|`; with that the
//! laws are Coulomb's and not the conditions of a convex program. `V`: the scaling of Nesterov and
//! Todd; `d` holds the predictor and its correction. Neither masses of any ratio nor impulses that
//! are not unique slow it down; of these it finds the analytic centre, with all contacts closed
//! that can be.
//!
//! It begins from nowhere, at `x = y = e`, or near impulses that are known:
//! ```text
//! z = x_0 − (A x_0 + c + s),   x = ½ (z + √(z² + 4μe)),   y = x − z
//! ```
//! are on the central path [2.62], `x ∘ y = μe`, and `r` is as small as `x − x_0` and what `x_0`
//! violates the laws by. Sources: S. Mehrotra, SIAM J. Optim. 2 (1992) 575–601; V. Acary, F.
//! Cadoux, C. Lemaréchal, J. Malick, ZAMM 91 (2011) 155–175; M. Fukushima, Z.-Q. Luo, P. Tseng,
//! SIAM J. Optim. 12 (2002) 436–460.
#![allow(non_snake_case)] // A, M, V

use super::disc::{Scaling, central, central_disc, product, quotient, reach};
use super::residual::norm;
use crate::linear::norm_inf;
use nalgebra::{Matrix3, Vector3};

/// Steps of Newton's method.
const STEPS: usize = 60;
/// The part of the way to the boundary of the cones that is taken.
const INSIDE: f64 = 0.995;
/// Steps shorter than this lead nowhere.
const SHORTEST: f64 = 1e-6;

/// A cone that is its own dual, or an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Own {
    /// `x ≥ 0`.
    Ray,
    /// `|(x_1, x_2)| ≤ x_0`.
    Disc,
    /// `|x| ≤ b`.
    Interval(f64),
}

/// A law and its first place in `x`.
#[derive(Clone, Copy, Debug)]
pub(super) struct LawInVector {
    pub own: Own,
    pub place: usize,
    pub follows: bool, // the slip, of a disc
    pub s: f64,        // else
}

impl LawInVector {
    pub(super) fn size(&self) -> usize {
        if self.own == Own::Disc { 3 } else { 1 }
    }
}

/// What the law of a part adds to `A`: `M V⁻²`.
#[derive(Clone, Copy, Debug)]
pub(super) enum Barrier {
    /// Of a ray or an interval.
    Scalar(f64),
    /// Of a disc, with the direction of a slip that is followed, or zero.
    Disc(Scaling, [f64; 2]),
}

impl Barrier {
    /// `M V⁻²`, of a scalar in its first entry.
    pub(super) fn matrix(&self) -> Matrix3<f64> {
        match self {
            Self::Scalar(own) => first(*own),
            Self::Disc(scaling, slip) => {
                let mut own = scaling.inverse_squared();
                for j in 0..3 {
                    own[(0, j)] -= slip[0] * own[(1, j)] + slip[1] * own[(2, j)];
                }
                own
            }
        }
    }

    /// `V² M⁻¹`.
    pub(super) fn inverse(&self) -> Matrix3<f64> {
        match self {
            Self::Scalar(own) => first(1.0 / own),
            Self::Disc(scaling, slip) => {
                let mut own = scaling.squared();
                for i in 0..3 {
                    let along = own[(i, 0)];
                    (0..2).for_each(|j| own[(i, 1 + j)] += along * slip[j]);
                }
                own
            }
        }
    }
}

fn first(own: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(own, 0.0, 0.0))
}

/// `A`, and the factors of it with what the laws add.
pub(super) trait CoupledFactors {
    /// `out ← A x`.
    fn multiply(&mut self, x: &[f64], out: &mut [f64]);
    /// The factors of `A + M V⁻²`.
    fn factorize(&mut self, parts: &[LawInVector], barriers: &[Barrier]);
    /// `b ← (A + M V⁻²)⁻¹ b`, not finite of a singular matrix.
    fn solve(&mut self, b: &mut [f64]);
}

/// The method with its memory.
#[derive(Clone, Debug, Default)]
pub(super) struct PrimalDual {
    pub parts: Vec<LawInVector>,
    pub c: Vec<f64>,          // m
    pub x: Vec<f64>,          // m  over `size`
    pub size: f64,            // of the largest c
    y: Vec<f64>,              // m
    walls: Vec<[f64; 2]>,     // m  multipliers of both ends of an interval
    r: Vec<f64>,              // m
    barriers: Vec<Barrier>,   // parts
    step: [Vec<f64>; 2],      // m  δx, δy
    wall_step: Vec<[f64; 2]>, // m
    rhs: Vec<f64>,            // m
}

impl PrimalDual {
    /// Of a problem with so many unknowns, after its parts; `c` is to be written.
    pub(super) fn begin(&mut self, m: usize) {
        let Self { c, x, y, r, rhs, step: [dx, dy], .. } = self;
        for vector in [c, x, y, r, rhs, dx, dy] {
            vector.clear();
            vector.resize(m, 0.0);
        }
        for vector in [&mut self.walls, &mut self.wall_step] {
            vector.clear();
            vector.resize(m, [0.0; 2]);
        }
    }

    /// Solves the laws until complementarity and residual are below `target`, of a problem whose
    /// largest `|c|` is one, or until `patience` steps in a row do not halve what is left; how many
    /// steps that took, and what is left. The multipliers of an interval are those of its ends,
    /// `y = z_l − z_u`.
    pub(super) fn solve(
        &mut self,
        A: &mut impl CoupledFactors,
        target: f64,
        patience: usize,
    ) -> (usize, f64) {
        self.size = norm_inf(&self.c).max(f64::MIN_POSITIVE);
        for part in &self.parts {
            let place = part.place;
            match part.own {
                Own::Interval(_) => {
                    self.x[place] = 0.0;
                    self.walls[place] = [1.0; 2];
                }
                _ => {
                    for vector in [&mut self.x, &mut self.y] {
                        vector[place..place + part.size()].fill(0.0);
                        vector[place] = 1.0;
                    }
                }
            }
        }
        self.go_on(A, target, patience)
    }

    /// The same from the central path next to `x`, which is given over `size`, at `mu`.
    pub(super) fn solve_near(
        &mut self,
        A: &mut impl CoupledFactors,
        mu: f64,
        target: f64,
        patience: usize,
    ) -> (usize, f64) {
        self.size = norm_inf(&self.c).max(f64::MIN_POSITIVE);
        let Self { parts, c, x, y, walls, size, .. } = self;
        A.multiply(x, y);
        y.iter_mut().zip(&*c).for_each(|(y, c)| *y += c / *size);
        for part in &*parts {
            let place = part.place;
            let slip = if part.follows { norm([y[place + 1], y[place + 2]]) } else { 0.0 };
            y[place] += part.s / *size + slip;
            match part.own {
                Own::Ray => [x[place], y[place]] = central(x[place] - y[place], mu),
                Own::Disc => {
                    let z = three(x, place) - three(y, place);
                    let own = central_disc(&z, mu);
                    for (of, own) in [&mut *x, &mut *y].into_iter().zip(own) {
                        of[place..place + 3].copy_from_slice(own.as_slice());
                    }
                }
                Own::Interval(bound) => {
                    let bound = bound / *size;
                    let inside = bound * (1.0 - (mu / bound).min(0.5));
                    x[place] = x[place].clamp(-inside, inside);
                    let [l, u] = central(y[place], mu / bound);
                    walls[place] = [u, l];
                }
            }
        }
        self.go_on(A, target, patience)
    }

    /// Steps from the present `x` and `y`.
    fn go_on(&mut self, A: &mut impl CoupledFactors, target: f64, patience: usize) -> (usize, f64) {
        let (mut least, mut stalled) = (f64::INFINITY, 0);
        for step in 0..STEPS {
            let (mu, residual) = self.evaluate(A);
            let fault = mu.max(residual);
            stalled = if fault <= 0.5 * least { 0 } else { stalled + 1 };
            least = least.min(fault);
            let is_finite = mu.is_finite() && residual.is_finite();
            if !is_finite || fault <= target || stalled == patience {
                return (step, least);
            }
            A.factorize(&self.parts, &self.barriers);
            self.direction(A, 0.0, false);
            let alone = self.longest().min(1.0);
            let sigma = (1.0 - alone) * (1.0 - alone) * (1.0 - alone);
            self.direction(A, sigma * mu, true);
            let part = (INSIDE * self.longest()).min(1.0);
            if part < SHORTEST || !self.step[0].iter().all(|dx| dx.is_finite()) {
                return (step, least);
            }
            let Self { parts, x, y, walls, wall_step, step: [dx, dy], .. } = self;
            for of in &*parts {
                for i in of.place..of.place + of.size() {
                    x[i] += part * dx[i];
                    y[i] += part * dy[i];
                    (0..2).for_each(|k| walls[i][k] += part * wall_step[i][k]);
                }
            }
        }
        (STEPS, least)
    }

    /// `r`, the scalings, complementarity and the largest residual.
    fn evaluate(&mut self, A: &mut impl CoupledFactors) -> (f64, f64) {
        let Self { parts, c, x, y, walls, r, barriers, size: scale, .. } = self;
        let scale = *scale;
        A.multiply(x, r);
        r.iter_mut().zip(&*c).for_each(|(r, c)| *r += c / scale);
        let (mut sum, mut count) = (0.0, 0.0);
        barriers.clear();
        for part in &*parts {
            let place = part.place;
            let slip = if part.follows { norm([y[place + 1], y[place + 2]]) } else { 0.0 };
            r[place] += part.s / scale + slip;
            match part.own {
                Own::Ray => {
                    r[place] -= y[place];
                    sum += x[place] * y[place];
                    count += 1.0;
                    barriers.push(Barrier::Scalar(y[place] / x[place]));
                }
                Own::Disc => {
                    let [x, y] = [&*x, &*y].map(|of| three(of, place));
                    (0..3).for_each(|i| r[place + i] -= y[i]);
                    sum += x.dot(&y);
                    count += 1.0;
                    let along = if slip > 0.0 { [y[1] / slip, y[2] / slip] } else { [0.0; 2] };
                    barriers.push(Barrier::Disc(Scaling::of(&x, &y), along));
                }
                Own::Interval(bound) => {
                    let [u, l] = walls[place];
                    r[place] += u - l;
                    let (bound, x) = (bound / scale, x[place]);
                    sum += u * (bound - x) + l * (bound + x);
                    count += 2.0;
                    barriers.push(Barrier::Scalar(u / (bound - x) + l / (bound + x)));
                }
            }
        }
        (if count > 0.0 { sum / count } else { 0.0 }, norm_inf(r))
    }

    /// `δx`, `δy` toward the complementarity `to`, with the correction by the last direction.
    fn direction(&mut self, A: &mut impl CoupledFactors, to: f64, corrected: bool) {
        let scale = self.size;
        let Self { parts, barriers, x, y, walls, r, rhs, step: [dx, dy], wall_step, .. } = self;
        for (part, barrier) in parts.iter().zip(&*barriers) {
            let place = part.place;
            match (part.own, barrier) {
                (Own::Interval(bound), _) => {
                    let (bound, x, [u, l]) = (bound / scale, x[place], walls[place]);
                    let [by_u, by_l] = match corrected {
                        true => [-dx[place] * wall_step[place][0], dx[place] * wall_step[place][1]],
                        false => [0.0; 2],
                    };
                    let own = [(to - by_u) / (bound - x) - u, (to - by_l) / (bound + x) - l];
                    rhs[place] = -r[place] - own[0] + own[1];
                    wall_step[place] = own;
                }
                (_, Barrier::Scalar(_)) => {
                    let correction = if corrected { dx[place] * dy[place] } else { 0.0 };
                    rhs[place] = (to - correction) / x[place] - y[place] - r[place];
                }
                (_, Barrier::Disc(scaling, slip)) => {
                    let [y, own_dx, own_dy] = [&*y, &*dx, &*dy].map(|of| three(of, place));
                    let lambda = scaling.scale(&y);
                    let mut d = Vector3::new(to, 0.0, 0.0) - product(&lambda, &lambda);
                    if corrected {
                        d -= product(&scaling.unscale(&own_dx), &scaling.scale(&own_dy));
                    }
                    let mut d = scaling.unscale(&quotient(&lambda, &d));
                    d[0] -= slip[0] * d[1] + slip[1] * d[2]; // M
                    (0..3).for_each(|i| rhs[place + i] = d[i] - r[place + i]);
                }
            }
        }
        dx.copy_from_slice(rhs);
        A.solve(dx);
        A.multiply(dx, dy);
        dy.iter_mut().zip(&*r).for_each(|(dy, r)| *dy += r);
        for (part, barrier) in parts.iter().zip(&*barriers) {
            let place = part.place;
            if let Barrier::Disc(_, slip) = barrier {
                dy[place] += slip[0] * dy[place + 1] + slip[1] * dy[place + 2]; // M⁻¹
            }
            if let Own::Interval(bound) = part.own {
                let (bound, x, [u, l]) = (bound / scale, x[place], walls[place]);
                wall_step[place][0] += u / (bound - x) * dx[place];
                wall_step[place][1] -= l / (bound + x) * dx[place];
            }
        }
    }

    /// The longest step within the cones.
    fn longest(&self) -> f64 {
        let scale = self.size;
        let ray = |x: f64, dx: f64| if dx < 0.0 { -x / dx } else { f64::INFINITY };
        let Self { parts, x, y, walls, wall_step, step: [dx, dy], .. } = self;
        let mut most = f64::INFINITY;
        for part in parts {
            let place = part.place;
            let own = match part.own {
                Own::Ray => ray(x[place], dx[place]).min(ray(y[place], dy[place])),
                Own::Disc => {
                    let [x, y, dx, dy] = [x, y, dx, dy].map(|of| three(of, place));
                    reach(&x, &dx).min(reach(&y, &dy))
                }
                Own::Interval(bound) => {
                    let (bound, x, dx) = (bound / scale, x[place], dx[place]);
                    let ([u, l], [du, dl]) = (walls[place], wall_step[place]);
                    ray(bound - x, -dx).min(ray(bound + x, dx)).min(ray(u, du)).min(ray(l, dl))
                }
            };
            most = most.min(own);
        }
        most
    }
}

fn three(of: &[f64], place: usize) -> Vector3<f64> {
    Vector3::new(of[place], of[place + 1], of[place + 2])
}
