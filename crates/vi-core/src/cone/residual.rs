//! The laws as projections, and their derivative.
//!
//! ```text
//! normal     F = Λ − max(0, Λ − ρy)
//! friction   F_N as above,  F_T = Λ_T − Π(z),  z = Λ_T − ρy_T,  Π onto the disc |·| ≤ R = μ max(0, Λ_N − ρy_N)
//! bounded    F = Λ − clip(Λ − ρy, ±b)
//! ```
//! Source: P. Alart, A. Curnier, CMAME 92 (1991) 353–375. Any `ρ > 0` has the same solutions; in
//! the units of [`Problem`](super::problem::Problem) one is the natural value. Where the disc is
//! left, with `ẑ = z/|z|`,
//! ```text
//! δF_T = δΛ_T − (R/|z|)(I − ẑẑᵀ) δz − ẑ δR,   δz = δΛ_T − ρW_T δΛ,   δR = μ (δΛ_N − ρW_N δΛ) or 0
//! ```
#![allow(non_snake_case)] // F, R

use super::problem::{Cone, Placed, Problem};
use crate::linear::norm_inf;
use nalgebra::{DMatrix, Matrix3};

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
    rho: f64,
}

impl Residual {
    pub(super) fn set_parameter(&mut self, rho: f64) {
        self.rho = rho;
    }

    pub(super) fn resize(&mut self, problem: &Problem) {
        for vector in [&mut self.y, &mut self.F, &mut self.sizes] {
            vector.clear();
            vector.resize(problem.rows(), 0.0);
        }
        self.relative.clear();
        self.relative.resize(problem.cones.len(), 0.0);
    }

    /// Evaluates `y` and `F`; returns the largest of `|F|`, for each cone relative to the sizes of
    /// the terms of its rows: rounding errors are of the size of `ε`, whatever the masses.
    pub(super) fn evaluate(&mut self, problem: &Problem, impulse: &[f64]) -> f64 {
        for i in 0..problem.rows() {
            self.y[i] = problem.velocity(i, impulse);
            let terms = problem.row(i).iter().zip(impulse).map(|(w, impulse)| (w * impulse).abs());
            self.sizes[i] = problem.w[i].abs() + impulse[i].abs() + terms.sum::<f64>();
        }
        self.excess = 0.0;
        let most = BALANCED * norm_inf(&problem.w);
        for (Placed { cone, row }, relative) in problem.cones.iter().zip(&mut self.relative) {
            let error = (*row..row + cone.rows()).map(|i| problem.error(i)).fold(0.0, f64::max);
            let rows = *row..row + cone.rows();
            let (y, impulse) = (&self.y[rows.clone()], &impulse[rows.clone()]);
            let F = &mut self.F[rows.clone()];
            violation(*cone, (y, impulse), self.rho, F);
            let (fault, size) = (norm_inf(F), norm_inf(&self.sizes[rows]));
            *relative = if fault == 0.0 { 0.0 } else { fault / size };
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

    /// A generalized derivative `∂F/∂Λ` at the point of the last evaluation.
    pub(super) fn derivative(&self, problem: &Problem, impulse: &[f64], out: &mut DMatrix<f64>) {
        out.fill(0.0);
        for &Placed { cone, row } in &problem.cones {
            let z = impulse[row] - self.rho * self.y[row];
            match cone {
                Cone::Normal if z > 0.0 => copy_row(problem, row, self.rho, out),
                Cone::Bounded { bound } if z.abs() <= bound => {
                    copy_row(problem, row, self.rho, out)
                }
                Cone::Sliding { direction, slope, at } => {
                    if z > 0.0 {
                        copy_row(problem, row, self.rho, out);
                    } else {
                        out[(row, row)] = 1.0;
                    }
                    let part = sliding(direction, slope, at, [1, 2].map(|i| self.y[row + i]));
                    for i in 0..2 {
                        for column in 0..problem.rows() {
                            let of = |k: usize| problem.row(row + 1 + k)[column];
                            let turn = slope[i][0] * of(0) + slope[i][1] * of(1);
                            out[(row + 1 + i, column)] = impulse[row] * turn;
                        }
                        out[(row + 1 + i, row + 1 + i)] += 1.0;
                        out[(row + 1 + i, row)] += part[i];
                    }
                }
                Cone::Normal | Cone::Bounded { .. } => out[(row, row)] = 1.0,
                Cone::Friction { coefficient } => {
                    let closed = z > 0.0;
                    if closed {
                        copy_row(problem, row, self.rho, out);
                    } else {
                        out[(row, row)] = 1.0;
                    }
                    let z_T = [1, 2].map(|i| impulse[row + i] - self.rho * self.y[row + i]);
                    let (length, R) = (norm(z_T), coefficient * z.max(0.0));
                    if closed && length <= R && R > 0.0 {
                        copy_row(problem, row + 1, self.rho, out);
                        copy_row(problem, row + 2, self.rho, out);
                    } else {
                        let mu = if closed { coefficient } else { 0.0 };
                        slip_rows(problem, row, (z_T, R, mu), self.rho, out);
                    }
                }
            }
        }
    }
}

/// `F` of one law.
pub(super) fn violation(cone: Cone, (y, impulse): (&[f64], &[f64]), rho: f64, F: &mut [f64]) {
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
        Cone::Sliding { direction, slope, at } => {
            F[0] = impulse[0] - (impulse[0] - rho * y[0]).max(0.0);
            let part = sliding(direction, slope, at, [y[1], y[2]]);
            F[1] = impulse[1] + impulse[0] * part[0];
            F[2] = impulse[2] + impulse[0] * part[1];
        }
    }
}

/// `∂F = C δy + D δΛ` of one law.
pub(super) fn slopes(
    cone: Cone,
    (y, impulse): (&[f64], &[f64]),
    rho: f64,
) -> (Matrix3<f64>, Matrix3<f64>) {
    let (mut of_y, mut own) = (Matrix3::zeros(), Matrix3::zeros());
    let z = impulse[0] - rho * y[0];
    let closed = match cone {
        Cone::Bounded { bound } => z.abs() <= bound,
        _ => z > 0.0,
    };
    if closed {
        of_y[(0, 0)] = rho;
    } else {
        own[(0, 0)] = 1.0;
    }
    match cone {
        Cone::Normal | Cone::Bounded { .. } => {}
        Cone::Sliding { direction, slope, at } => {
            let part = sliding(direction, slope, at, [y[1], y[2]]);
            for i in 0..2 {
                own[(1 + i, 0)] = part[i];
                own[(1 + i, 1 + i)] = 1.0;
                (0..2).for_each(|k| of_y[(1 + i, 1 + k)] = impulse[0] * slope[i][k]);
            }
        }
        Cone::Friction { coefficient } => {
            let z_T = [1, 2].map(|i| impulse[i] - rho * y[i]);
            let (length, R) = (norm(z_T), coefficient * z.max(0.0));
            if closed && length <= R && R > 0.0 {
                (1..3).for_each(|i| of_y[(i, i)] = rho);
                return (of_y, own);
            }
            let unit = if length > 0.0 { z_T.map(|z| z / length) } else { [0.0; 2] };
            let ratio = if length > 0.0 { R / length } else { 0.0 };
            let mu = if closed { coefficient } else { 0.0 };
            for i in 0..2 {
                let mut by_z = [-unit[i] * mu, 0.0, 0.0];
                for k in 0..2 {
                    by_z[1 + k] = ratio * unit[i] * unit[k];
                }
                by_z[1 + i] -= ratio;
                for (k, by) in by_z.into_iter().enumerate() {
                    of_y[(1 + i, k)] = -rho * by;
                    own[(1 + i, k)] = by;
                }
                own[(1 + i, 1 + i)] += 1.0;
            }
        }
    }
    (of_y, own)
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

/// `∂F_T/∂Λ` outside of the disc of the radius `R`, of which `μ` is the slope over `Λ_N − y_N`.
fn slip_rows(
    problem: &Problem,
    row: usize,
    (z, R, mu): ([f64; 2], f64, f64),
    rho: f64,
    out: &mut DMatrix<f64>,
) {
    let length = norm(z);
    let unit = if length > 0.0 { z.map(|z| z / length) } else { [0.0; 2] };
    let ratio = if length > 0.0 { R / length } else { 0.0 };
    for i in 0..2 {
        for column in 0..problem.rows() {
            let of = |k: usize| {
                f64::from(u8::from(column == row + k)) - rho * problem.row(row + k)[column]
            };
            let (normal, tangents) = (of(0), [of(1), of(2)]);
            let along = unit[0] * tangents[0] + unit[1] * tangents[1];
            let turn = tangents[i] - unit[i] * along;
            out[(row + 1 + i, column)] = -ratio * turn - unit[i] * mu * normal;
        }
        out[(row + 1 + i, row + 1 + i)] += 1.0;
    }
}

fn copy_row(problem: &Problem, row: usize, rho: f64, out: &mut DMatrix<f64>) {
    for (column, entry) in problem.row(row).iter().enumerate() {
        out[(row, column)] = rho * *entry;
    }
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
        let mut branches = [0; 6];
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
            ];
            let k = 11;
            let rows = sample.matrix(k, k);
            let (W, w) = (rows.tr_mul(&rows), sample.matrix(k, 1));
            let mut problem = Problem::default();
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
            for &Placed { cone, row } in &problem.cones {
                let (own, n) = (row..row + cone.rows(), cone.rows());
                let (of_y, of_impulse) =
                    slopes(cone, (&residual.y[own.clone()], &impulse[own]), 0.7);
                for (i, j) in (0..n).flat_map(|i| (0..k).map(move |j| (i, j))) {
                    let through = |l: usize| of_y[(i, l)] * problem.row(row + l)[j];
                    let beside =
                        if (row..row + n).contains(&j) { of_impulse[(i, j - row)] } else { 0.0 };
                    let sum = (0..n).map(through).sum::<f64>() + beside;
                    assert!((sum - derivative[(row + i, j)]).abs() < 1e-13, "seed {seed}: {i} {j}");
                }
            }
            let z: Vec<f64> = (0..k).map(|i| impulse[i] - 0.7 * residual.y[i]).collect();
            branches[usize::from(z[0] > 0.0 && norm([z[1], z[2]]) > 0.6 * z[0])] += 1;
            branches[2 + usize::from(z[0] > 0.0 && norm([z[1], z[2]]) < 0.6 * z[0])] += 1;
            branches[4 + usize::from(z[3] > 0.0)] += 1;
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
