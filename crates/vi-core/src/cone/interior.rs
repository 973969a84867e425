//! Convex problems in a sequence, each by a primal–dual interior point method.
//!
//! With `s = μ|y_T|` held, the laws are the conditions of
//! ```text
//! min ½ΛᵀWΛ + (w + s e_N)ᵀΛ,   Λ_N ≥ 0, |Λ_T| ≤ μΛ_N, |Λ_B| ≤ b
//! ```
//! a convex program; its solution gives the next `s`. Source: V. Acary, F. Cadoux, C. Lemaréchal,
//! J. Malick, ZAMM 91 (2011) 155–175. With `Λ = Tx`, `A = TᵀWT`, `c = Tᵀ(w + s e_N)` each cone is
//! its own dual, and steps of Newton's method in the scaling of Nesterov and Todd solve
//! ```text
//! A x + c = y,   x ∘ y = σμ e,   x, y in the cones;       (A + V⁻²) δx = V⁻¹ d − r,   δy = A δx + r
//! ```
//! `V`: the scaling, `V y = V⁻¹ x`; `d` holds the predictor and its correction (S. Mehrotra, SIAM
//! J. Optim. 2 (1992) 575–601; L. Vandenberghe, The CVXOPT linear and quadratic cone program
//! solvers, 2010). Neither masses of any ratio nor impulses that are not unique slow it down; of
//! these it finds the analytic centre, with all contacts closed that can be.
#![allow(non_snake_case)] // A, T

use super::operator::Operator;
use super::problem::{Cone, Placed, Problem};
use super::residual::norm;
use crate::linear::{dot, norm_inf};
use nalgebra::Vector3;

/// Steps of Newton's method for each `s`.
const STEPS: usize = 60;
/// Complementarity and residual it ends with, of a problem whose largest `|c|` is one.
const TARGET: f64 = 1e-14;
/// The part of the way to the boundary of the cones that is taken.
const INSIDE: f64 = 0.995;
/// Steps shorter than this lead nowhere.
const SHORTEST: f64 = 1e-6;
/// Impulses of the size of one that change velocities less change none.
const STILL: f64 = 1e-9;

/// A cone that is its own dual, or an interval, with its first place in `x`.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Own {
    /// `x ≥ 0`.
    Ray,
    /// `|(x_1, x_2)| ≤ x_0`.
    Disc,
    /// `|x| ≤ b`.
    Interval(f64),
}

/// No place in `x`.
const NONE: usize = usize::MAX;

#[derive(Clone, Copy, Debug)]
struct Part {
    own: Own,
    place: usize,      // in x
    row: usize,        // in Λ
    map: Vector3<f64>, // T: of a ray its column, of a disc its diagonal
}

impl Part {
    fn size(&self) -> usize {
        if self.own == Own::Disc { 3 } else { 1 }
    }
}

/// The scaling of a disc: `V = η (2 v vᵀ − J)` on the way from `y` to `x`.
#[derive(Clone, Copy, Debug)]
struct Scaling {
    eta: f64,
    w: Vector3<f64>, // of V² = η² (2 w wᵀ − J)
}

fn flip(x: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(x[0], -x[1], -x[2])
}

/// `√(x_0² − |x_T|²)`.
fn depth(x: &Vector3<f64>) -> f64 {
    let tangent = norm([x[1], x[2]]);
    ((x[0] - tangent) * (x[0] + tangent)).max(0.0).sqrt()
}

impl Scaling {
    fn of(x: &Vector3<f64>, y: &Vector3<f64>) -> Self {
        let (a, b) = (depth(x), depth(y));
        let (x, y) = (x / a, y / b);
        let gamma = (0.5 * (1.0 + x.dot(&y))).sqrt();
        Self { eta: (a / b).sqrt(), w: (x + flip(&y)) / (2.0 * gamma) }
    }

    /// `V x`; with `flip(w)` in the place of `w` and `1/η` of `η` it is `V⁻¹`.
    fn apply(eta: f64, w: &Vector3<f64>, x: &Vector3<f64>) -> Vector3<f64> {
        let along = w[1] * x[1] + w[2] * x[2];
        let first = w[0] * x[0] + along;
        let part = x[0] + along / (1.0 + w[0]);
        Vector3::new(first, x[1] + part * w[1], x[2] + part * w[2]) * eta
    }

    fn scale(&self, x: &Vector3<f64>) -> Vector3<f64> {
        Self::apply(self.eta, &self.w, x)
    }

    fn unscale(&self, x: &Vector3<f64>) -> Vector3<f64> {
        Self::apply(1.0 / self.eta, &flip(&self.w), x)
    }
}

/// `a ∘ b` of a disc.
fn product(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(a.dot(b), a[0] * b[1] + b[0] * a[1], a[0] * b[2] + b[0] * a[2])
}

/// `a \ b`: the `x` with `a ∘ x = b`.
fn quotient(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let depth = depth(a);
    let first = (a[0] * b[0] - a[1] * b[1] - a[2] * b[2]) / (depth * depth);
    Vector3::new(first, (b[1] - first * a[1]) / a[0], (b[2] - first * a[2]) / a[0])
}

/// The largest step along `dx` within a disc.
fn reach(x: &Vector3<f64>, dx: &Vector3<f64>) -> f64 {
    let (a, b) = (dx.dot(&flip(dx)), x.dot(&flip(dx)));
    let c = depth(x) * depth(x);
    let root = b * b - a * c;
    if root < 0.0 || dx[0] >= norm([dx[1], dx[2]]) {
        return f64::INFINITY;
    }
    // the least positive root of a α² + 2b α + c
    let q = -b - root.sqrt().copysign(b);
    let roots = [q / a, c / q];
    let positive = roots.into_iter().filter(|root| *root > 0.0);
    positive.fold(f64::INFINITY, f64::min)
}

#[derive(Clone, Debug, Default)]
pub(super) struct Interior {
    parts: Vec<Part>,
    places: Vec<(usize, f64)>, // k  place in x, and T there; of a place that is not, `NONE`
    A: Operator,               // m × m
    c: Vec<f64>,               // m  without s
    size: f64,                 // of the largest c
    x: Vec<f64>,               // m
    y: Vec<f64>,               // m
    walls: Vec<[f64; 2]>,      // m  multipliers of both ends of an interval
    r: Vec<f64>,               // m
    scalings: Vec<Scaling>,    // parts
    step: [Vec<f64>; 2],       // m  δx, δy
    wall_step: Vec<[f64; 2]>,  // m
    rhs: Vec<f64>,             // m
    shift: Vec<f64>,           // parts  s
    impulse: Vec<f64>,         // k
}

impl Interior {
    /// Begins with `s = 0`.
    pub(super) fn begin(&mut self, problem: &Problem) {
        let k = problem.w.len();
        self.parts.clear();
        self.places.clear();
        self.places.resize(k, (NONE, 0.0));
        let mut m = 0;
        for &Placed { cone, row } in &problem.cones {
            let one = Vector3::new(1.0, 0.0, 0.0);
            let (own, map) = match cone {
                Cone::Normal => (Own::Ray, one),
                // solved by proximal steps
                Cone::Convex { .. } => continue,
                Cone::Friction { coefficient } if coefficient > 0.0 => {
                    (Own::Disc, Vector3::new(1.0, coefficient, coefficient))
                }
                Cone::Friction { .. } => (Own::Ray, one),
                Cone::Sliding { direction: [a, b], .. } => (Own::Ray, Vector3::new(1.0, -a, -b)),
                Cone::Bounded { bound } if bound > 0.0 => (Own::Interval(bound), one),
                Cone::Bounded { .. } => continue,
            };
            for i in (0..3).filter(|i| map[*i] != 0.0) {
                self.places[row + i] = (m + if own == Own::Disc { i } else { 0 }, map[i]);
            }
            let part = Part { own, place: m, row, map };
            m += part.size();
            self.parts.push(part);
        }
        self.shift.clear();
        self.shift.resize(self.parts.len(), 0.0);
        self.impulse.clear();
        self.impulse.resize(k, 0.0);
        let Self { c, x, y, r, rhs, step: [dx, dy], .. } = self;
        for vector in [c, x, y, r, rhs, dx, dy] {
            vector.clear();
            vector.resize(m, 0.0);
        }
        for vector in [&mut self.walls, &mut self.wall_step] {
            vector.clear();
            vector.resize(m, [0.0; 2]);
        }
        let Self { places, c, .. } = self;
        for ((place, t), w) in places.iter().zip(&problem.w).filter(|own| own.0.0 != NONE) {
            c[*place] += t * w;
        }
        let parts = &self.parts;
        self.A.assemble(m, &mut |add: &mut dyn FnMut(usize, usize, f64)| {
            problem.for_each_entry(&mut |l, n, value| {
                let ((i, s), (j, t)) = (places[l], places[n]);
                if i != NONE && j != NONE {
                    add(i, j, s * t * value);
                }
            });
            for part in parts {
                for i in 0..part.size() {
                    (0..part.size()).for_each(|j| add(part.place + i, part.place + j, 0.0));
                }
            }
        });
        self.size = norm_inf(&self.c).max(f64::MIN_POSITIVE);
    }

    /// Solves the program with the present `s`, then takes `part` of the way to the next `s`.
    pub(super) fn advance(&mut self, problem: &Problem, part: f64) -> &[f64] {
        self.solve();
        self.spread(self.size);
        for (own, shift) in self.parts.iter().zip(&mut self.shift) {
            let row = own.row;
            let next = match own.own {
                Own::Interval(_) => 0.0,
                Own::Disc => {
                    own.map[1] * norm([1, 2].map(|i| problem.velocity(row + i, &self.impulse)))
                }
                Own::Ray if own.map[1] == 0.0 && own.map[2] == 0.0 => 0.0,
                Own::Ray => {
                    let y = [1, 2].map(|i| problem.velocity(row + i, &self.impulse));
                    -own.map[1] * y[0] - own.map[2] * y[1]
                }
            };
            *shift += part * (next - *shift);
        }
        &self.impulse
    }

    fn rows(&self) -> usize {
        self.c.len()
    }

    /// `Λ ← T x`, times a factor.
    fn spread(&mut self, factor: f64) {
        let Self { places, impulse, x, .. } = self;
        for (own, &(place, t)) in impulse.iter_mut().zip(&*places) {
            *own = if place == NONE { 0.0 } else { t * x[place] * factor };
        }
    }

    /// The multipliers of an interval are those of its ends, `y = z_l − z_u`.
    fn solve(&mut self) {
        let m = self.rows();
        let scale = self.size;
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
        for _ in 0..STEPS {
            // r = A x + c − y
            self.A.multiply(&self.x, &mut self.r);
            (0..m).for_each(|i| self.r[i] += self.c[i] / scale);
            let (mut sum, mut count) = (0.0, 0.0);
            self.scalings.clear();
            for (part, shift) in self.parts.iter().zip(&self.shift) {
                let place = part.place;
                self.r[place] += shift / scale;
                let mut scaling = Scaling { eta: 1.0, w: Vector3::zeros() };
                match part.own {
                    Own::Ray => {
                        self.r[place] -= self.y[place];
                        sum += self.x[place] * self.y[place];
                        count += 1.0;
                        scaling.eta = (self.x[place] / self.y[place]).sqrt();
                    }
                    Own::Disc => {
                        let [x, y] = [&self.x, &self.y].map(|of| three(of, place));
                        (0..3).for_each(|i| self.r[place + i] -= y[i]);
                        sum += x.dot(&y);
                        count += 1.0;
                        scaling = Scaling::of(&x, &y);
                    }
                    Own::Interval(bound) => {
                        let [u, l] = self.walls[place];
                        self.r[place] += u - l;
                        let (bound, x) = (bound / scale, self.x[place]);
                        sum += u * (bound - x) + l * (bound + x);
                        count += 2.0;
                    }
                }
                self.scalings.push(scaling);
            }
            let mu = sum / count;
            let residual = norm_inf(&self.r);
            if !(mu.is_finite() && residual.is_finite()) || mu <= TARGET && residual <= TARGET {
                return;
            }
            self.factorize();
            self.direction(0.0, false);
            let alone = self.longest().min(1.0);
            let sigma = (1.0 - alone) * (1.0 - alone) * (1.0 - alone);
            self.direction(sigma * mu, true);
            let part = (INSIDE * self.longest()).min(1.0);
            if part < SHORTEST || !self.step[0].iter().all(|dx| dx.is_finite()) {
                return;
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
    }

    /// `A + V⁻²`.
    fn factorize(&mut self) {
        let Self { A, parts, scalings, x, y, walls, size: scale, .. } = self;
        let scale = *scale;
        A.begin();
        for (part, scaling) in parts.iter().zip(&*scalings) {
            let place = part.place;
            match part.own {
                Own::Ray => A.add(place, place, y[place] / x[place]),
                Own::Disc => {
                    let w = flip(&scaling.w);
                    let by = 1.0 / (scaling.eta * scaling.eta);
                    for i in 0..3 {
                        for j in 0..3 {
                            let minus = if i != j {
                                0.0
                            } else if i == 0 {
                                1.0
                            } else {
                                -1.0
                            };
                            A.add(place + i, place + j, by * (2.0 * w[i] * w[j] - minus));
                        }
                    }
                }
                Own::Interval(bound) => {
                    let ([u, l], x) = (walls[place], x[place]);
                    let bound = bound / scale;
                    A.add(place, place, u / (bound - x) + l / (bound + x));
                }
            }
        }
        A.factorize();
    }

    /// `δx`, `δy` toward the complementarity `to`, with the correction by the last direction.
    fn direction(&mut self, to: f64, corrected: bool) {
        let m = self.rows();
        let scale = self.size;
        let Self { parts, scalings, x, y, walls, r, rhs, step: [dx, dy], wall_step, .. } = self;
        for (part, scaling) in parts.iter().zip(&*scalings) {
            let place = part.place;
            match part.own {
                Own::Ray => {
                    let correction = if corrected { dx[place] * dy[place] } else { 0.0 };
                    rhs[place] = (to - correction) / x[place] - y[place] - r[place];
                }
                Own::Disc => {
                    let [y, own_dx, own_dy] = [&*y, &*dx, &*dy].map(|of| three(of, place));
                    let lambda = scaling.scale(&y);
                    let mut d = Vector3::new(to, 0.0, 0.0) - product(&lambda, &lambda);
                    if corrected {
                        d -= product(&scaling.unscale(&own_dx), &scaling.scale(&own_dy));
                    }
                    let d = scaling.unscale(&quotient(&lambda, &d));
                    (0..3).for_each(|i| rhs[place + i] = d[i] - r[place + i]);
                }
                Own::Interval(bound) => {
                    let (bound, x, [u, l]) = (bound / scale, x[place], walls[place]);
                    let [by_u, by_l] = match corrected {
                        true => [-dx[place] * wall_step[place][0], dx[place] * wall_step[place][1]],
                        false => [0.0; 2],
                    };
                    let own = [(to - by_u) / (bound - x) - u, (to - by_l) / (bound + x) - l];
                    rhs[place] = -r[place] - own[0] + own[1];
                    wall_step[place] = own;
                }
            }
        }
        dx.copy_from_slice(rhs);
        self.A.solve(dx);
        self.A.multiply(dx, dy);
        (0..m).for_each(|i| dy[i] += r[i]);
        for part in &*parts {
            let place = part.place;
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

    /// Impulses that grow without bound change no velocity and oppose the approach: the cone with
    /// the largest of them, and their direction, the largest one 1.
    pub(super) fn wedged(&mut self, problem: &Problem) -> Option<(usize, &[f64])> {
        self.A.begin();
        (0..self.rows()).for_each(|i| self.A.add(i, i, STILL));
        self.A.factorize();
        for part in self.parts.iter().filter(|part| matches!(part.own, Own::Interval(_))) {
            self.x[part.place] = 0.0;
        }
        self.A.solve(&mut self.x); // what A changes is gone beside the rest
        self.spread(1.0);
        let Self { impulse, .. } = self;
        let normal = |placed: &&Placed| !matches!(placed.cone, Cone::Bounded { .. });
        let size = |cone: &Placed| impulse[cone.row];
        let largest = problem.cones.iter().filter(normal).map(size).fold(0.0, f64::max);
        let cone = problem.cones.iter().position(|cone| normal(&cone) && size(cone) >= largest)?;
        impulse.iter_mut().for_each(|own| *own /= largest);
        let approach = dot(&problem.w, impulse);
        let speeds = problem.w.iter().enumerate().map(|(i, w)| problem.velocity(i, impulse) - w);
        let moved = speeds.fold(0.0, |moved: f64, speed| moved.max(speed.abs()));
        let size = problem.w.iter().map(|w| w.abs()).sum::<f64>();
        // friction that holds a jam opens with `s`: normal impulses alone wedge
        let across = |own: &Placed| {
            own.cone.rows() == 3 && norm([impulse[own.row + 1], impulse[own.row + 2]]) > STILL
        };
        let jams = problem.cones.iter().any(across);
        (largest > 0.0 && approach < -STILL * size && moved < STILL && !jams)
            .then_some((cone, &self.impulse[..]))
    }
}

fn three(of: &[f64], place: usize) -> Vector3<f64> {
    Vector3::new(of[place], of[place + 1], of[place + 2])
}
