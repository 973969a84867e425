//! The laws as projections, and their derivative.
//!
//! ```text
//! normal     F = Λ − max(0, Λ − ρy)
//! friction   F_N as above,  F_T = Λ_T − Π(z),  z = Λ_T − ρy_T,  Π onto the disc |·| ≤ R = μ max(0, Λ_N − ρy_N)
//! convex     F = Λ − Π_K(z),  z = Λ − ρ(y + s e_N),  Π_K onto the cone |·_T| ≤ μ·_N
//! bounded    F = Λ − clip(Λ − ρy, ±b)
//! ```
//! Source: P. Alart, A. Curnier, CMAME 92 (1991) 353–375. Any `ρ > 0` has the same solutions; in
//! the units of [`ConeProblem`](super::problem::ConeProblem) one is the natural value. Where the
//! disc is left, with `ẑ = z/|z|`,
//! ```text
//! δF_T = δΛ_T − (R/|z|)(I − ẑẑᵀ) δz − ẑ δR,   δz = δΛ_T − ρW_T δΛ,   δR = μ (δΛ_N − ρW_N δΛ) or 0
//! ```
#![allow(non_snake_case)] // F, R

use super::problem::{Cone, ConeProblem, PlacedLaw};
use crate::linear::norm_inf;
use nalgebra::DMatrix;

/// Terms beyond this many times the largest of `w` do not count as sizes: the rounding errors of
/// impulses that balance one another would hide `w` itself. A mass ratio of `1e8` stays below.
const BALANCED: f64 = 1e7;

/// `F` of an impulse, with the velocities and the sizes of what was summed.
#[derive(Clone, Debug, Default)]
pub(super) struct Residual {
    pub y: Vec<f64>,    // k
    pub F: Vec<f64>,    // k
    sizes: Vec<f64>,    // k  of the terms of y and Λ
    relative: Vec<f64>, // cones
    excess: f64,        // the largest of them, beside the errors of w
    balances: bool,     // some sizes are beyond `BALANCED`
    rho: f64,
}

impl Residual {
    pub(super) fn set_parameter(&mut self, rho: f64) {
        self.rho = rho;
    }

    pub(super) fn resize(&mut self, problem: &ConeProblem) {
        for vector in [&mut self.y, &mut self.F, &mut self.sizes] {
            vector.clear();
            vector.resize(problem.rows(), 0.0);
        }
        self.relative.clear();
        self.relative.resize(problem.cones.len(), 0.0);
    }

    /// Evaluates `y` and `F`; returns the largest of `|F|`, for each cone relative to the sizes of
    /// the terms of its rows: rounding errors are of the size of `ε`, whatever the masses.
    pub(super) fn evaluate(&mut self, problem: &ConeProblem, impulse: &[f64]) -> f64 {
        for i in 0..problem.rows() {
            self.y[i] = problem.velocity(i, impulse);
            let terms = problem.row(i).iter().zip(impulse).map(|(w, impulse)| (w * impulse).abs());
            self.sizes[i] = problem.w[i].abs() + impulse[i].abs() + terms.sum::<f64>();
        }
        (self.excess, self.balances) = (0.0, false);
        let most = BALANCED * norm_inf(&problem.w);
        for (PlacedLaw { cone, row }, relative) in problem.cones.iter().zip(&mut self.relative) {
            let error = problem.largest_error(*row..row + cone.rows());
            let rows = *row..row + cone.rows();
            let (y, impulse) = (&self.y[rows.clone()], &impulse[rows.clone()]);
            let F = &mut self.F[rows.clone()];
            violation(*cone, y, impulse, self.rho, F);
            let (mut fault, size) = (norm_inf(F), norm_inf(&self.sizes[rows]));
            *relative = if fault == 0.0 { 0.0 } else { fault / size };
            if size > most {
                fault = fault.max(f64::EPSILON * size); // rounding of Λ hides y
                self.balances = true;
            }
            if fault > error {
                let size = size.min(most).max(f64::MIN_POSITIVE);
                self.excess = self.excess.max((fault - error) / size);
            }
        }
        norm_inf(&self.relative)
    }

    /// The same as was returned last, of what the errors of `w` leave, with sizes beyond
    /// [`BALANCED`] left out.
    pub(super) fn excess(&self) -> f64 {
        self.excess
    }

    /// Whether impulses balance one another there: sizes are beyond [`BALANCED`].
    pub(super) fn balances(&self) -> bool {
        self.balances
    }

    /// A generalized derivative `∂F/∂Λ` at the point of the last evaluation.
    pub(super) fn derivative(
        &self,
        problem: &ConeProblem,
        impulse: &[f64],
        out: &mut DMatrix<f64>,
    ) {
        out.fill(0.0);
        for &PlacedLaw { cone, row } in &problem.cones {
            let (own, count) = (row..row + cone.rows(), cone.rows());
            let slope = LawSlope::at(cone, &self.y[own.clone()], &impulse[own], self.rho);
            for column in 0..problem.rows() {
                let (mut of_y, mut of_impulse) = ([0.0; 3], [0.0; 3]);
                for l in 0..count {
                    of_y[l] = problem.row(row + l)[column];
                    of_impulse[l] = f64::from(u8::from(column == row + l));
                }
                let change = slope.change(of_y, of_impulse);
                (0..count).for_each(|l| out[(row + l, column)] = change[l]);
            }
        }
    }
}

/// `F` of one law.
pub(super) fn violation(cone: Cone, y: &[f64], impulse: &[f64], rho: f64, F: &mut [f64]) {
    match cone {
        Cone::Normal => F[0] = impulse[0] - (impulse[0] - rho * y[0]).max(0.0),
        Cone::Bounded { bound } => F[0] = impulse[0] - clip(impulse[0] - rho * y[0], bound),
        Cone::Friction { coefficient } => {
            let [normal, first, second] = [0, 1, 2].map(|i| impulse[i] - rho * y[i]);
            F[0] = impulse[0] - normal.max(0.0);
            let R = coefficient * normal.max(0.0);
            let disc = to_disc([first, second], R);
            F[1] = impulse[1] - disc[0];
            F[2] = impulse[2] - disc[1];
        }
        Cone::Convex { coefficient, speed } => {
            let [normal, first, second] = [0, 1, 2].map(|i| impulse[i] - rho * y[i]);
            let nearest = to_cone([normal - rho * speed, first, second], coefficient);
            (0..3).for_each(|i| F[i] = impulse[i] - nearest[i]);
        }
        Cone::Sliding { direction, slope, at } => {
            F[0] = impulse[0] - (impulse[0] - rho * y[0]).max(0.0);
            let part = sliding(direction, slope, at, [y[1], y[2]]);
            F[1] = impulse[1] + impulse[0] * part[0];
            F[2] = impulse[2] + impulse[0] * part[1];
        }
    }
}

/// The derivative of `F` of one law at a point.
pub(super) struct LawSlope {
    rho: f64,
    closed: bool,
    across: Across,
}

/// Where the nearest point of the cone is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Nearest {
    Itself,
    Apex,
    /// On its rim, in this direction; `|z_T|`, and the normal part of the nearest point.
    Rim([f64; 2], f64, f64),
}

fn nearest([normal, first, second]: [f64; 3], mu: f64) -> Nearest {
    let length = norm([first, second]);
    if length <= mu * normal {
        Nearest::Itself
    } else if mu * length <= -normal {
        Nearest::Apex
    } else {
        let unit = if length > 0.0 { [first / length, second / length] } else { [0.0; 2] };
        Nearest::Rim(unit, length, (normal + mu * length) / (1.0 + mu * mu))
    }
}

/// The nearest point of `|·_T| ≤ μ·_N`.
pub(super) fn to_cone(z: [f64; 3], mu: f64) -> [f64; 3] {
    match nearest(z, mu) {
        Nearest::Itself => z,
        Nearest::Apex => [0.0; 3],
        Nearest::Rim([a, b], _, normal) => [normal, mu * normal * a, mu * normal * b],
    }
}

/// Along the tangents.
enum Across {
    None,
    Sliding {
        impulse: f64,
        slope: [[f64; 2]; 2],
        part: [f64; 2],
    },
    Stick,
    Convex {
        nearest: Nearest,
        mu: f64,
    },
    /// `δF_T` outside of the disc of the radius `R`, `R/|z|`, of which `μ` is the slope over
    /// `Λ_N − y_N`; or where it is open.
    Slip {
        unit: [f64; 2],
        ratio: f64,
        mu: f64,
    },
}

impl LawSlope {
    pub(super) fn at(cone: Cone, y: &[f64], impulse: &[f64], rho: f64) -> Self {
        let z = impulse[0] - rho * y[0];
        let closed = match cone {
            Cone::Bounded { bound } => z.abs() <= bound,
            _ => z > 0.0,
        };
        let across = match cone {
            Cone::Normal | Cone::Bounded { .. } => Across::None,
            Cone::Sliding { direction, slope, at } => {
                let part = sliding(direction, slope, at, [y[1], y[2]]);
                Across::Sliding { impulse: impulse[0], slope, part }
            }
            Cone::Convex { coefficient: mu, speed } => {
                let z_T = [1, 2].map(|i| impulse[i] - rho * y[i]);
                let z = [z - rho * speed, z_T[0], z_T[1]];
                Across::Convex { nearest: nearest(z, mu), mu }
            }
            Cone::Friction { coefficient } => {
                let z_T = [1, 2].map(|i| impulse[i] - rho * y[i]);
                let (length, R) = (norm(z_T), coefficient * z.max(0.0));
                if closed && length <= R && R > 0.0 {
                    Across::Stick
                } else {
                    let unit = if length > 0.0 { z_T.map(|z| z / length) } else { [0.0; 2] };
                    let ratio = if length > 0.0 { R / length } else { 0.0 };
                    Across::Slip { unit, ratio, mu: if closed { coefficient } else { 0.0 } }
                }
            }
        };
        Self { rho, closed, across }
    }

    /// `δF` of `δy` and `δΛ`.
    pub(super) fn change(&self, y: [f64; 3], impulse: [f64; 3]) -> [f64; 3] {
        let rho = self.rho;
        if let Across::Convex { nearest, mu } = self.across {
            let dz = [0, 1, 2].map(|i| impulse[i] - rho * y[i]);
            let of_point = match nearest {
                Nearest::Itself => dz,
                Nearest::Apex => [0.0; 3],
                Nearest::Rim(unit, length, normal) => {
                    let along = unit[0] * dz[1] + unit[1] * dz[2];
                    let rise = (dz[0] + mu * along) / (1.0 + mu * mu);
                    let turn = if length > 0.0 { mu * normal / length } else { 0.0 };
                    let across =
                        |i: usize| mu * rise * unit[i] + turn * (dz[1 + i] - along * unit[i]);
                    [rise, across(0), across(1)]
                }
            };
            return [0, 1, 2].map(|i| impulse[i] - of_point[i]);
        }
        let normal = if self.closed { rho * y[0] } else { impulse[0] };
        let [first, second] = match self.across {
            Across::None | Across::Convex { .. } => [0.0; 2],
            Across::Stick => [rho * y[1], rho * y[2]],
            Across::Sliding { impulse: pressed, slope, part } => [0, 1].map(|i| {
                let turn = slope[i][0] * y[1] + slope[i][1] * y[2];
                pressed * turn + impulse[1 + i] + part[i] * impulse[0]
            }),
            Across::Slip { unit, ratio, mu } => {
                let [normal, a, b] = [0, 1, 2].map(|k| impulse[k] - rho * y[k]);
                let along = unit[0] * a + unit[1] * b;
                [(0, a), (1, b)].map(|(i, tangent)| {
                    let turn = tangent - unit[i] * along;
                    -ratio * turn - unit[i] * mu * normal + impulse[1 + i]
                })
            }
        };
        [normal, first, second]
    }
}

/// `s + S (y_T − v)`.
pub(super) fn sliding(
    direction: [f64; 2],
    slope: [[f64; 2]; 2],
    at: [f64; 2],
    y: [f64; 2],
) -> [f64; 2] {
    let off = [y[0] - at[0], y[1] - at[1]];
    [0, 1].map(|i| direction[i] + slope[i][0] * off[0] + slope[i][1] * off[1])
}

pub(super) fn norm(x: [f64; 2]) -> f64 {
    (x[0] * x[0] + x[1] * x[1]).sqrt()
}

/// The nearest of `|x| ≤ bound`.
pub(super) fn clip(x: f64, bound: f64) -> f64 {
    x.max(-bound).min(bound)
}

/// The nearest point of the disc `|·| ≤ R`.
fn to_disc(x: [f64; 2], R: f64) -> [f64; 2] {
    let length = norm(x);
    if length <= R { x } else { x.map(|x| x * (R / length)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_testkit::Sample;

    /// `∂F/∂Λ` against central differences, at points of every branch.
    #[test]
    fn the_derivative_is_that_of_the_projections() {
        let mut branches = [0; 9];
        for seed in 0..200 {
            let mut sample = Sample::new(seed);
            let cones = [
                Cone::Friction { coefficient: 0.6 },
                Cone::Normal,
                Cone::Friction { coefficient: 1.2 },
                Cone::Bounded { bound: 0.4 },
                Cone::Sliding {
                    direction: [0.3, -0.2],
                    slope: [[0.4, -0.1], [-0.1, 0.7]],
                    at: [0.5, 0.1],
                },
                Cone::Convex { coefficient: 0.8, speed: 0.2 },
            ];
            let k = 14;
            let rows = sample.matrix(k, k);
            let (W, w) = (rows.tr_mul(&rows), sample.matrix(k, 1));
            let mut problem = ConeProblem::default();
            problem.load(&cones, W.as_slice(), w.as_slice(), &[]);
            let (mut residual, mut other) = (Residual::default(), Residual::default());
            for one in [&mut residual, &mut other] {
                one.resize(&problem);
                one.set_parameter(0.7);
            }
            let impulse: Vec<f64> = sample.matrix(k, 1).as_slice().to_vec();
            residual.evaluate(&problem, &impulse);
            let mut derivative = DMatrix::zeros(k, k);
            residual.derivative(&problem, &impulse, &mut derivative);
            for &PlacedLaw { cone, row } in &problem.cones {
                let (own, n) = (row..row + cone.rows(), cone.rows());
                let slope = LawSlope::at(cone, &residual.y[own.clone()], &impulse[own], 0.7);
                let unit = |l: usize| std::array::from_fn(|i| f64::from(u8::from(i == l)));
                let of_y = [0, 1, 2].map(|l| slope.change(unit(l), [0.0; 3]));
                let of_impulse = [0, 1, 2].map(|l| slope.change([0.0; 3], unit(l)));
                for (i, j) in (0..n).flat_map(|i| (0..k).map(move |j| (i, j))) {
                    let through = |l: usize| of_y[l][i] * problem.row(row + l)[j];
                    let beside =
                        if (row..row + n).contains(&j) { of_impulse[j - row][i] } else { 0.0 };
                    let sum = (0..n).map(through).sum::<f64>() + beside;
                    assert!((sum - derivative[(row + i, j)]).abs() < 1e-13, "seed {seed}: {i} {j}");
                }
            }
            let z: Vec<f64> = (0..k).map(|i| impulse[i] - 0.7 * residual.y[i]).collect();
            branches[usize::from(z[0] > 0.0 && norm([z[1], z[2]]) > 0.6 * z[0])] += 1;
            branches[2 + usize::from(z[0] > 0.0 && norm([z[1], z[2]]) < 0.6 * z[0])] += 1;
            branches[4 + usize::from(z[3] > 0.0)] += 1;
            let (normal, tangent) = (z[11] - 0.7 * 0.2, norm([z[12], z[13]]));
            branches[if tangent <= 0.8 * normal {
                6
            } else {
                7 + usize::from(0.8 * tangent <= -normal)
            }] += 1;
            let step = 1e-7;
            for j in 0..k {
                let mut at = |shift: f64| {
                    let mut moved = impulse.clone();
                    moved[j] += shift;
                    other.evaluate(&problem, &moved);
                    other.F.clone()
                };
                let (up, down) = (at(step), at(-step));
                for i in 0..k {
                    let difference = (up[i] - down[i]) / (2.0 * step);
                    let error = (difference - derivative[(i, j)]).abs();
                    assert!(error < 1e-6, "seed {seed}: {i} {j} {error:e}");
                }
            }
        }
        println!("{branches:?}");
        assert!(branches.iter().all(|count| *count > 3), "{branches:?}");
    }
}
