//! Convex laws with a compliance about the impulses that are given: proximal steps.
//!
//! ```text
//! Λ = Π(x),   x = Λ_0 − ρ (y + s e_N),   y = WΛ + w,   W = L Lᵀ       Π: onto the sets of the laws
//! φ(Λ) = ½ ΛᵀWΛ + ψ(x)/ρ,   ψ = ½|x|² − ½|x − Π(x)|²,   ∇φ = W (Λ − Π(x))
//! (I + ρ DΠ W) δΛ = F,   F = Π(x) − Λ                                 Newton's step of φ
//! δΛ = F − ρ DΠ L u,     (I + ρ Lᵀ DΠ L) u = Lᵀ F
//! ```
//! The laws hold for `y + (Λ − Λ_0)/ρ`, in units in which the largest diagonal of a contact is one.
//! `φ` is convex and has a derivative: steps to its least value along `δΛ` lead to the solution
//! from everywhere. That always exists, and is unique. The matrix of a step is as sparse as the
//! contacts between bodies. Sources: R. T. Rockafellar, SIAM J. Control Optim. 14 (1976) 877–898;
//! A. M. Castro, F. N. Permenter, X. Han, IEEE Trans. Robot. 39 (2023) 1301–1320.
#![allow(non_snake_case)] // W, L, F

use super::large::SparseRows;
use super::problem::{Cone, Placed};
use super::residual::{LawSlope, violation};
use super::{ConeFault, ConeReport};
use crate::bracket::Bracket;
use crate::linear::{dot, norm_inf};
use crate::sparse::SparseMatrix;
use crate::sparse_cholesky::SparseCholesky;

/// `F` relative to the largest impulse to end with, and what is accepted.
const TARGET: f64 = 1e-13;
const ACCEPTED: f64 = 1e-9;
/// Steps of Newton's method.
const STEPS: usize = 60;
/// Steps in a row that do not halve an accepted residual: rounding errors alone are left.
const STALLED: usize = 3;
/// To which the least value along a step is known.
const ALONG: f64 = 1e-3;

/// The solver with its memory, which grows to the largest problem; then nothing is allocated but
/// the factors of another pattern.
#[derive(Debug, Default)]
pub struct ConvexSolver {
    cones: Vec<Placed>,
    units: Vec<f64>,                        // k
    columns: Vec<(usize, [f64; 3])>, // of each cone: places of L, with its entries in each row
    column_ends: Vec<usize>,         // cones
    columns_before: Vec<(usize, [f64; 3])>, // of the last problem
    column_ends_before: Vec<usize>,
    w: Vec<f64>,                  // k
    given: Vec<f64>,              // k  Λ_0
    impulse: Vec<f64>,            // k
    best: Vec<f64>,               // k
    y: Vec<f64>,                  // k
    nearest: Vec<f64>,            // k  Π(x)
    F: Vec<f64>,                  // k
    step: Vec<f64>,               // k  δΛ
    y_step: Vec<f64>,             // k  W δΛ
    moved: Vec<f64>,              // k  y along it
    u: Vec<f64>,                  // r
    slopes: Vec<[[f64; 3]; 3]>,   // cones  ρ DΠ
    matrix: Option<SparseMatrix>, // r × r, its lower triangle
    factors: Option<SparseCholesky>,
}

impl ConvexSolver {
    /// Solves the laws of `y + (Λ − Λ_0)/ρ` for `y = WΛ + w`, `W = L Lᵀ`; repeated steps come
    /// nearer to those of `y`, faster with a larger `ρ`.
    ///
    /// `cones`: without [`Cone::Friction`] and [`Cone::Sliding`], whose laws are not convex. `L`:
    /// shape `k × r`, `r` one more than its largest column. `w`: `k`. `rho`: `ρ`, in units in which
    /// the largest diagonal of `W` of a contact is one. `lambda`: `k`, `Λ_0`, then the solution.
    ///
    /// # Errors
    /// [`ConeFault::NotFinite`], [`ConeFault::NoConvergence`] with the nearest impulses.
    ///
    /// # Panics
    /// Where the sizes differ from the number of rows of the cones.
    pub fn step(
        &mut self,
        cones: &[Cone],
        L: SparseRows<'_>,
        (w, rho): (&[f64], f64),
        lambda: &mut [f64],
    ) -> Result<ConeReport, ConeFault> {
        let k = cones.iter().map(Cone::rows).sum::<usize>();
        assert!(L.ends.len() == k && w.len() == k && lambda.len() == k, "{k} rows");
        let mut numbers = L.values.iter().chain(w).chain(&*lambda).copied();
        if !(numbers.all(f64::is_finite) && cones.iter().all(Cone::is_finite) && rho.is_finite()) {
            return Err(ConeFault::NotFinite);
        }
        self.load(cones, L, w, lambda);
        let (residual, rounds) = self.descend(rho);
        for ((lambda, own), unit) in lambda.iter_mut().zip(&self.best).zip(&self.units) {
            *lambda = own * unit;
        }
        match residual <= ACCEPTED {
            true => Ok(ConeReport { residual, rounds }),
            false => Err(ConeFault::NoConvergence { residual, cones: cones.len() }),
        }
    }

    /// Takes the problem over into units in which the largest diagonal of a contact is one.
    fn load(&mut self, cones: &[Cone], L: SparseRows<'_>, w: &[f64], lambda: &[f64]) {
        std::mem::swap(&mut self.columns, &mut self.columns_before);
        std::mem::swap(&mut self.column_ends, &mut self.column_ends_before);
        self.column_ends.clear();
        let Self { columns, columns_before, column_ends_before, .. } = self;
        columns.clear();
        self.cones.clear();
        self.units.clear();
        let (mut size, mut first) = (0, 0);
        for &cone in cones {
            let row = self.units.len();
            let rows = row..row + cone.rows();
            for (l, i) in rows.clone().enumerate() {
                let own = L.range(i);
                for (place, value) in L.places[own.clone()].iter().zip(&L.values[own]) {
                    let place = *place as usize;
                    size = size.max(place + 1);
                    match columns[first..].iter_mut().find(|own: &&mut (usize, _)| own.0 == place) {
                        Some((_, entries)) => entries[l] = *value,
                        None => {
                            let mut entries = [0.0; 3];
                            entries[l] = *value;
                            columns.push((place, entries));
                        }
                    }
                }
            }
            let of = &mut columns[first..];
            let diagonal = |l: usize| of.iter().map(|own| own.1[l] * own.1[l]).sum::<f64>();
            let largest = (0..cone.rows()).map(diagonal).fold(0.0, f64::max);
            let unit = if largest > 0.0 { 1.0 / largest.sqrt() } else { 1.0 };
            of.iter_mut().for_each(|own| own.1 = own.1.map(|entry| entry * unit));
            self.units.resize(rows.end, unit);
            self.cones.push(Placed { cone: cone.in_units(unit), row });
            self.column_ends.push(columns.len());
            first = columns.len();
        }
        let same = self.column_ends == *column_ends_before
            && columns.iter().map(|own| own.0).eq(columns_before.iter().map(|own| own.0));
        if !same {
            (self.matrix, self.factors) = (None, None);
        }
        let k = w.len();
        let Self { impulse, best, y, nearest, F, step, y_step, moved, .. } = self;
        for vector in [impulse, best, y, nearest, F, step, y_step, moved] {
            vector.clear();
            vector.resize(k, 0.0);
        }
        self.u.clear();
        self.u.resize(size, 0.0);
        self.w.clear();
        self.w.extend(w.iter().zip(&self.units).map(|(w, unit)| w * unit));
        self.given.clear();
        self.given.extend(lambda.iter().zip(&self.units).map(|(lambda, unit)| lambda / unit));
        self.impulse.copy_from_slice(&self.given);
    }

    /// Newton's method on `φ`; the residual at the best point, and the steps.
    fn descend(&mut self, rho: f64) -> (f64, usize) {
        let k = self.w.len();
        self.best.copy_from_slice(&self.impulse);
        let (mut least, mut stalled, mut steps) = (f64::INFINITY, 0, 0);
        loop {
            let [mut u, mut y] = [&mut self.u, &mut self.y].map(std::mem::take);
            self.apply(&self.impulse, &mut u, &mut y);
            y.iter_mut().zip(&self.w).for_each(|(y, w)| *y += w);
            project((&self.cones, &self.given), (&y, rho), &mut self.nearest);
            (self.u, self.y) = (u, y);
            (0..k).for_each(|i| self.F[i] = self.nearest[i] - self.impulse[i]);
            let impulses = norm_inf(&self.nearest).max(norm_inf(&self.impulse));
            let size = impulses.max(rho * norm_inf(&self.w));
            let fault = norm_inf(&self.F);
            let residual = if fault == 0.0 { 0.0 } else { fault / size };
            stalled = if residual <= 0.5 * least { 0 } else { stalled + 1 };
            if residual < least {
                least = residual;
                self.best.copy_from_slice(&self.impulse);
            }
            let is_done = least <= TARGET || least <= ACCEPTED && stalled >= STALLED;
            if is_done || steps == STEPS || residual.is_nan() || !self.find_step(rho) {
                return (least, steps);
            }
            steps += 1;
            let part = self.least_along(rho);
            (0..k).for_each(|i| self.impulse[i] += part * self.step[i]);
        }
    }

    /// `step ← δΛ` and `y_step ← W δΛ` at the last projection, where there are.
    fn find_step(&mut self, rho: f64) -> bool {
        self.slopes.clear();
        for &Placed { cone, row } in &self.cones {
            let own = row..row + cone.rows();
            let slope = LawSlope::at(cone, (&self.y[own.clone()], &self.given[own.clone()]), rho);
            let mut block = [[0.0; 3]; 3];
            for l in 0..own.len() {
                let unit = std::array::from_fn(|i| f64::from(u8::from(i == l)));
                let change = slope.change(unit, [0.0; 3]);
                (0..own.len()).for_each(|i| block[i][l] = change[i]);
            }
            self.slopes.push(block);
        }
        let mut matrix = self.matrix.take();
        let r = self.u.len();
        let lower = SparseMatrix::update(&mut matrix, (r, r), |out| {
            (0..r).for_each(|i| out.add(i, i, 1.0));
            for (k, block) in self.slopes.iter().enumerate() {
                for (p, a) in self.of_cone(k) {
                    let scaled: [f64; 3] =
                        std::array::from_fn(|j| (0..3).map(|i| a[i] * block[i][j]).sum());
                    for (q, b) in self.of_cone(k).iter().filter(|own| own.0 <= *p) {
                        out.add(*p, *q, (0..3).map(|j| scaled[j] * b[j]).sum());
                    }
                }
            }
        });
        if self.factors.is_none() {
            self.factors = SparseCholesky::new(lower).ok();
        }
        let mut u = std::mem::take(&mut self.u);
        self.gather(&self.F, &mut u);
        let solved = self.factors.as_mut().is_some_and(|factors| {
            factors.factorize(lower).and_then(|()| factors.solve(&mut u)).is_ok()
        });
        let mut step = std::mem::take(&mut self.step);
        for (k, (placed, block)) in self.cones.iter().zip(&self.slopes).enumerate() {
            let rows = self.spread(k, &u);
            for i in 0..placed.cone.rows() {
                let change: f64 = (0..3).map(|j| block[i][j] * rows[j]).sum();
                step[placed.row + i] = self.F[placed.row + i] - change;
            }
        }
        let mut y_step = std::mem::take(&mut self.y_step);
        self.apply(&step, &mut u, &mut y_step);
        (self.u, self.step, self.y_step, self.matrix) = (u, step, y_step, matrix);
        solved
    }

    /// The part of a step after which `φ` is least, at most all of it.
    fn least_along(&mut self, rho: f64) -> f64 {
        let Self { cones, given, y, y_step, impulse, step, moved, nearest, F, .. } = self;
        let k = y.len();
        let mut slope = |part: f64| {
            (0..k).for_each(|i| moved[i] = y[i] + part * y_step[i]);
            project((cones, given), (moved, rho), nearest);
            let error = |i: usize| impulse[i] + part * step[i] - nearest[i];
            (0..k).map(|i| y_step[i] * error(i)).sum::<f64>()
        };
        let at_end = slope(1.0);
        if at_end <= 0.0 {
            return 1.0;
        }
        let mut bracket = Bracket::new([0.0, -dot(y_step, F)], [1.0, at_end]);
        while let Some(part) = bracket.next(ALONG) {
            bracket.take(part, slope(part));
        }
        bracket.low().max(ALONG)
    }

    /// Columns of `L` in the rows of a cone.
    fn of_cone(&self, k: usize) -> &[(usize, [f64; 3])] {
        let from = k.checked_sub(1).map_or(0, |before| self.column_ends[before]);
        &self.columns[from..self.column_ends[k]]
    }

    /// `out ← Lᵀ Λ`.
    fn gather(&self, impulse: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (k, &Placed { cone, row }) in self.cones.iter().enumerate() {
            let own = &impulse[row..row + cone.rows()];
            for (place, entries) in self.of_cone(k) {
                out[*place] += entries.iter().zip(own).map(|(entry, own)| entry * own).sum::<f64>();
            }
        }
    }

    /// `L u` of the rows of a cone.
    fn spread(&self, k: usize, u: &[f64]) -> [f64; 3] {
        let mut rows = [0.0; 3];
        for (place, entries) in self.of_cone(k) {
            (0..3).for_each(|i| rows[i] += entries[i] * u[*place]);
        }
        rows
    }

    /// `out ← WΛ`, `u ← Lᵀ Λ`.
    fn apply(&self, impulse: &[f64], u: &mut [f64], out: &mut [f64]) {
        self.gather(impulse, u);
        for (k, placed) in self.cones.iter().enumerate() {
            let rows = self.spread(k, u);
            out[placed.row..][..placed.cone.rows()].copy_from_slice(&rows[..placed.cone.rows()]);
        }
    }
}

/// `Π(x)` at these velocities.
fn project((cones, given): (&[Placed], &[f64]), (y, rho): (&[f64], f64), out: &mut [f64]) {
    for &Placed { cone, row } in cones {
        let own = row..row + cone.rows();
        let (given, out) = (&given[own.clone()], &mut out[own.clone()]);
        violation(cone, (&y[own], given), rho, out);
        out.iter_mut().zip(given).for_each(|(out, given)| *out = given - *out);
    }
}
