//! The laws of contacts with `W = L Lᵀ`, in units in which the largest diagonal of a contact is
//! one, and as laws of the interior point method.
#![allow(non_snake_case)] // L, T, F

use super::block_matrix::{BlockMatrix, FactorColumn};
use super::primal_dual::{Barrier, CoupledFactors, LawInVector, Own, PrimalDual};
use super::problem::{Cone, PlacedLaw};
use super::residual::{LawSlope, violation};
use super::sparse_rows::SparseRows;
use crate::block_lu::Order;
use crate::linear::norm_inf;
use nalgebra::{Matrix3, Vector3};

/// With more rows the matrix is that of the laws whose blocks `B` are not negligible, and its
/// pattern is found again where it holds more than `SPARE` times as many laws.
const MANY: usize = 1000;
const SPARE: f64 = 1.1;
/// Entries of `B` that the interior point method leaves out, beside the `I` of the matrix: of open
/// contacts; how often it corrects what they leave, in part of the right side until `ENOUGH`.
const NEGLIGIBLE: f64 = 1e-2;
const CORRECTIONS: usize = 5;
const ENOUGH: f64 = 1e-6;

/// The laws, `L` and `w`.
#[derive(Debug, Default)]
pub(super) struct Factored {
    cones: Vec<PlacedLaw>,
    follows: Vec<bool>, // cones  Coulomb's law: the speed of slip is that of the velocities
    columns: Vec<FactorColumn>, // of each cone
    column_ends: Vec<usize>, // cones
    columns_before: Vec<FactorColumn>, // of the last problem
    column_ends_before: Vec<usize>,
    pub units: Vec<f64>, // k
    pub w: Vec<f64>,     // k
    pub r: usize,        // columns of L
    kept: Vec<bool>,     // cones  whose blocks the pattern of the matrix holds
    needed: Vec<bool>,   // cones  whose blocks are not negligible
    matrix: BlockMatrix, // I + Lᵀ B L
    is_regular: bool,
}

impl Factored {
    /// Takes the problem over.
    pub(super) fn load(&mut self, cones: &[Cone], L: SparseRows<'_>, w: &[f64]) {
        std::mem::swap(&mut self.columns, &mut self.columns_before);
        std::mem::swap(&mut self.column_ends, &mut self.column_ends_before);
        let Self { columns, column_ends, .. } = self;
        columns.clear();
        column_ends.clear();
        self.cones.clear();
        self.follows.clear();
        self.units.clear();
        self.r = L.places.iter().map(|place| *place as usize + 1).max().unwrap_or(0);
        let mut first = 0;
        for &cone in cones {
            let row = self.units.len();
            for l in 0..cone.rows() {
                for (place, value) in L.row(row + l) {
                    let known =
                        columns[first..].iter_mut().find(|own: &&mut FactorColumn| own.0 == place);
                    if let Some((_, entries)) = known {
                        entries[l] = value;
                    } else {
                        let entries = std::array::from_fn(|i| if i == l { value } else { 0.0 });
                        columns.push((place, entries));
                    }
                }
            }
            let of = &mut columns[first..];
            of.sort_unstable_by_key(|own| own.0);
            let diagonal = |l: usize| of.iter().map(|own| own.1[l] * own.1[l]).sum::<f64>();
            let largest = (0..cone.rows()).map(diagonal).fold(0.0, f64::max);
            let unit = if largest > 0.0 { 1.0 / largest.sqrt() } else { 1.0 };
            of.iter_mut().for_each(|own| own.1 = own.1.map(|entry| entry * unit));
            self.units.resize(row + cone.rows(), unit);
            let (cone, follows) = match cone {
                Cone::Friction { coefficient } => (Cone::Convex { coefficient, speed: 0.0 }, true),
                cone => (cone.in_units(unit), false),
            };
            self.cones.push(PlacedLaw { cone, row });
            self.follows.push(follows);
            column_ends.push(columns.len());
            first = columns.len();
        }
        self.w.clear();
        self.w.extend(w.iter().zip(&self.units).map(|(w, unit)| w * unit));
        let places = self.columns.iter().map(|own| own.0);
        let is_known = self.column_ends == self.column_ends_before
            && places.eq(self.columns_before.iter().map(|own| own.0));
        if !is_known {
            let Self { columns, column_ends, matrix, r, .. } = self;
            let laws = (0..column_ends.len()).map(|k| of_cone(columns, column_ends, k));
            matrix.divide(*r, laws.clone());
            self.kept.clear();
            self.kept.resize(column_ends.len(), self.units.len() <= MANY);
            if self.units.len() <= MANY {
                matrix.analyse(laws, Order::LeastDegree);
            }
        }
    }

    /// Finds the pattern again, where it lacks laws whose blocks `B` are not negligible, or has too
    /// many whose blocks are.
    fn keep(&mut self, blocks: &[[[f64; 3]; 3]], negligible: f64) {
        let Self { kept, needed, columns, column_ends, matrix, .. } = self;
        let size =
            |block: &[[f64; 3]; 3]| block.iter().flatten().fold(0.0_f64, |a, b| a.max(b.abs()));
        needed.clear();
        needed.extend(blocks.iter().map(|block| size(block) > negligible));
        let count = |of: &[bool]| of.iter().filter(|own| **own).count() as f64;
        let lacks = needed.iter().zip(&*kept).any(|(needed, kept)| *needed && !kept);
        let most = SPARE * count(needed);
        if matrix.is_analysed() && !lacks && count(kept) <= most {
            return;
        }
        kept.iter_mut().zip(&*needed).for_each(|(kept, needed)| *kept |= needed);
        if count(kept) > most {
            kept.copy_from_slice(needed);
        }
        let laws = (0..kept.len()).filter(|k| kept[*k]);
        let laws = laws.map(|k| of_cone(columns, column_ends, k));
        matrix.analyse(laws, Order::LeastFill);
    }

    /// How many laws there are.
    pub(super) fn count(&self) -> usize {
        self.cones.len()
    }

    /// `out`: impulses in the units of the laws.
    pub(super) fn in_units(&self, lambda: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.extend(lambda.iter().zip(&self.units).map(|(own, unit)| own / unit));
    }

    /// Columns of `L` in the rows of a cone.
    fn of_cone(&self, k: usize) -> &[FactorColumn] {
        of_cone(&self.columns, &self.column_ends, k)
    }

    /// `u ← Lᵀ Λ`.
    pub(super) fn gather(&self, impulse: &[f64], u: &mut [f64]) {
        u.fill(0.0);
        for (k, &PlacedLaw { cone, row }) in self.cones.iter().enumerate() {
            let own = &impulse[row..row + cone.rows()];
            for (place, entries) in self.of_cone(k) {
                u[*place] += entries.iter().zip(own).map(|(entry, own)| entry * own).sum::<f64>();
            }
        }
    }

    /// `L u` in the rows of a cone.
    fn spread(&self, k: usize, u: &[f64]) -> [f64; 3] {
        let mut rows = [0.0; 3];
        for (place, entries) in self.of_cone(k) {
            (0..3).for_each(|i| rows[i] += entries[i] * u[*place]);
        }
        rows
    }

    /// `out ← WΛ`, `u ← Lᵀ Λ`.
    pub(super) fn apply(&self, impulse: &[f64], u: &mut [f64], out: &mut [f64]) {
        self.gather(impulse, u);
        for (k, &PlacedLaw { cone, row }) in self.cones.iter().enumerate() {
            let rows = self.spread(k, u);
            out[row..row + cone.rows()].copy_from_slice(&rows[..cone.rows()]);
        }
    }

    /// `y ← WΛ + w`, `u ← Lᵀ Λ`.
    pub(super) fn velocity(&self, impulse: &[f64], u: &mut [f64], y: &mut [f64]) {
        self.apply(impulse, u, y);
        y.iter_mut().zip(&self.w).for_each(|(y, w)| *y += w);
    }

    /// `s = μ|y_T|` of those laws that are Coulomb's.
    pub(super) fn take_speeds(&mut self, y: &[f64]) {
        for (PlacedLaw { cone, row }, _) in
            self.cones.iter_mut().zip(&self.follows).filter(|own| *own.1)
        {
            if let Cone::Convex { coefficient, speed } = cone {
                *speed = *coefficient * libm::hypot(y[*row + 1], y[*row + 2]);
            }
        }
    }

    /// `Π(x)`, `x = Λ_0 − ρ (y + s e_N)`.
    pub(super) fn project(&self, given: &[f64], y: &[f64], rho: f64, out: &mut [f64]) {
        for &PlacedLaw { cone, row } in &self.cones {
            let own = row..row + cone.rows();
            let (given, out) = (&given[own.clone()], &mut out[own.clone()]);
            violation(cone, &y[own], given, rho, out);
            out.iter_mut().zip(given).for_each(|(out, given)| *out = given - *out);
        }
    }

    /// `ρ DΠ` of each cone, where speeds of slip are `coupled` `ρ DΠ (I + e_N ∂s/∂y)`.
    pub(super) fn slopes(
        &self,
        given: &[f64],
        y: &[f64],
        rho: f64,
        coupled: bool,
        out: &mut Vec<[[f64; 3]; 3]>,
    ) {
        out.clear();
        for (&PlacedLaw { cone, row }, follows) in self.cones.iter().zip(&self.follows) {
            let own = row..row + cone.rows();
            let slope = LawSlope::at(cone, &y[own.clone()], &given[own.clone()], rho);
            let mut block = [[0.0; 3]; 3];
            for l in 0..own.len() {
                let unit = std::array::from_fn(|i| f64::from(u8::from(i == l)));
                let change = slope.change(unit, [0.0; 3]);
                (0..own.len()).for_each(|i| block[i][l] = change[i]);
            }
            if let (Cone::Convex { coefficient, .. }, true) = (cone, coupled && *follows) {
                let slip = [y[row + 1], y[row + 2]];
                let size = libm::hypot(slip[0], slip[1]);
                for row in block.iter_mut().filter(|_| size > 0.0) {
                    let normal = row[0] * coefficient / size;
                    (0..2).for_each(|i| row[1 + i] += normal * slip[i]);
                }
            }
            out.push(block);
        }
    }

    /// The factors of `I + Lᵀ B L` with the blocks `B` of the cones, where it is not singular; of
    /// many rows without those whose entries are all `negligible`.
    pub(super) fn factorize(&mut self, blocks: &[[[f64; 3]; 3]], negligible: f64) {
        if self.units.len() > MANY {
            self.keep(blocks, negligible);
        }
        let Self { matrix, columns, column_ends, is_regular, kept, .. } = self;
        let laws = blocks.iter().enumerate().filter(|own| kept[own.0]);
        let laws = laws.map(|(k, own)| (of_cone(columns, column_ends, k), own));
        *is_regular = matrix.factorize(laws).is_ok();
    }

    /// `u ← (I + Lᵀ B L)⁻¹ u`, not finite of a singular matrix.
    pub(super) fn solve(&mut self, u: &mut [f64]) {
        if !(self.is_regular && self.matrix.solve(u).is_ok()) {
            u.fill(f64::NAN);
        }
    }

    /// The laws as parts of the interior point method, with `T` and `c = Tᵀw`.
    pub(super) fn scale(&self, method: &mut PrimalDual, T: &mut Vec<f64>) {
        method.parts.clear();
        T.clear();
        T.resize(self.w.len(), 0.0);
        for (&PlacedLaw { cone, row }, &follows) in self.cones.iter().zip(&self.follows) {
            T[row] = 1.0;
            let (own, s) = match cone {
                Cone::Convex { coefficient, speed } if coefficient > 0.0 => {
                    T[row + 1..row + 3].fill(coefficient);
                    (Own::Disc, if follows { 0.0 } else { speed })
                }
                Cone::Bounded { bound } if bound > 0.0 => (Own::Interval(bound), 0.0),
                Cone::Bounded { .. } => {
                    T[row] = 0.0;
                    (Own::Ray, 0.0)
                }
                _ => (Own::Ray, 0.0),
            };
            method.parts.push(LawInVector {
                own,
                place: row,
                follows: follows && own == Own::Disc,
                s,
            });
        }
        method.begin(self.w.len());
        let of = self.w.iter().zip(&*T);
        method.c.iter_mut().zip(of).for_each(|(c, (w, t))| *c = t * w);
    }

    /// `step ← F − B L u`.
    pub(super) fn step(&self, F: &[f64], blocks: &[[[f64; 3]; 3]], u: &[f64], step: &mut [f64]) {
        for (k, (&PlacedLaw { cone, row }, block)) in self.cones.iter().zip(blocks).enumerate() {
            let change = self.spread(k, u);
            for i in 0..cone.rows() {
                let change: f64 = block[i].iter().zip(&change).map(|(b, own)| b * own).sum();
                step[row + i] = F[row + i] - change;
            }
        }
    }

    /// By what velocity a law is violated at most, in the units of the velocities: by impulses that
    /// differ by this much from those that are given, and by the speed of slip.
    pub(super) fn left(&self, own: &[f64], given: &[f64], y: &[f64], rho: f64) -> f64 {
        let mut most = 0.0_f64;
        for (&PlacedLaw { cone, row }, follows) in self.cones.iter().zip(&self.follows) {
            let rows = row..row + cone.rows();
            let mut left = rows.map(|i| (own[i] - given[i]).abs() / rho).fold(0.0, f64::max);
            if let (Cone::Convex { coefficient, speed }, true) = (cone, *follows) {
                let slip = libm::hypot(y[row + 1], y[row + 2]);
                left = left.max((speed - coefficient * slip).abs());
            }
            most = most.max(left / self.units[row]);
        }
        most
    }
}

/// `A = T W T` of the interior point method: `Λ = T x` row by row.
pub(super) struct ScaledDelassus<'a> {
    pub laws: &'a mut Factored,
    pub T: &'a [f64],                        // k  zero in rows that no law takes
    pub inverses: &'a mut Vec<Matrix3<f64>>, // cones  V² M⁻¹
    pub matrices: &'a mut Vec<Matrix3<f64>>, // cones  M V⁻²
    pub left: &'a mut [f64],                 // k
    pub refined: &'a mut [f64],              // k
    pub blocks: &'a mut Vec<[[f64; 3]; 3]>,  // cones  T V² M⁻¹ T
    pub F: &'a mut [f64],                    // k
    pub u: &'a mut [f64],                    // r
}

impl CoupledFactors for ScaledDelassus<'_> {
    fn multiply(&mut self, x: &[f64], out: &mut [f64]) {
        let Self { laws, T, F, u, .. } = self;
        F.iter_mut().zip(x).zip(*T).for_each(|((own, x), t)| *own = t * x);
        laws.apply(F, u, out);
        out.iter_mut().zip(*T).for_each(|(out, t)| *out *= t);
    }

    fn factorize(&mut self, _: &[LawInVector], barriers: &[Barrier]) {
        let Self { laws, T, inverses, matrices, blocks, .. } = self;
        inverses.clear();
        inverses.extend(barriers.iter().map(Barrier::inverse));
        matrices.clear();
        matrices.extend(barriers.iter().map(Barrier::matrix));
        blocks.clear();
        for (inverse, own) in inverses.iter().zip(&laws.cones) {
            let t: [f64; 3] =
                std::array::from_fn(|i| if i < own.cone.rows() { T[own.row + i] } else { 0.0 });
            blocks.push(std::array::from_fn(|i| {
                std::array::from_fn(|j| t[i] * inverse[(i, j)] * t[j])
            }));
        }
        laws.factorize(blocks, NEGLIGIBLE);
    }

    /// What rounding leaves of differences of large terms is solved for once more, and what laws
    /// that are left out leave, until it is `ENOUGH`.
    fn solve(&mut self, b: &mut [f64]) {
        self.left.copy_from_slice(b);
        self.solve_once(b);
        let most = if self.laws.kept.contains(&false) { CORRECTIONS } else { 1 };
        let mut last = f64::INFINITY;
        for _ in 0..most {
            let left = self.correct(b);
            if most > 1 && !(left > ENOUGH && left < last) {
                break;
            }
            last = left;
        }
    }
}

impl ScaledDelassus<'_> {
    /// Solves for what `b` leaves of the right side; how large that was, in part of this.
    fn correct(&mut self, b: &mut [f64]) -> f64 {
        let mut refined = std::mem::take(&mut self.refined);
        self.multiply(b, refined);
        for (matrix, own) in self.matrices.iter().zip(&self.laws.cones) {
            let rows = own.row..own.row + own.cone.rows();
            let moved = matrix * of_rows(b, rows.clone());
            rows.zip(&moved).for_each(|(i, moved)| refined[i] += moved);
        }
        refined.iter_mut().zip(&*self.left).for_each(|(own, b)| *own = b - *own);
        let left = norm_inf(refined) / norm_inf(self.left);
        self.solve_once(refined);
        b.iter_mut().zip(&*refined).for_each(|(b, own)| *b += own);
        std::mem::swap(&mut self.refined, &mut refined);
        left
    }

    /// `b ← (A + M V⁻²)⁻¹ b`, to what rounding leaves of `F − B L u`.
    fn solve_once(&mut self, b: &mut [f64]) {
        // (I + Lᵀ B L) u = Lᵀ F,   T δx = F − B L u,   F = T V² M⁻¹ b
        let Self { laws, T, inverses, blocks, F, u, .. } = self;
        for (inverse, own) in inverses.iter().zip(&laws.cones) {
            let rows = own.row..own.row + own.cone.rows();
            let moved = inverse * of_rows(b, rows.clone());
            rows.zip(&moved).for_each(|(i, moved)| F[i] = T[i] * moved);
        }
        laws.gather(F, u);
        laws.solve(u);
        laws.step(F, blocks, u, b);
        b.iter_mut().zip(*T).for_each(|(b, t)| *b = if *t > 0.0 { *b / t } else { 0.0 });
    }
}

/// Entries of up to three rows.
fn of_rows(b: &[f64], rows: std::ops::Range<usize>) -> Vector3<f64> {
    Vector3::from_fn(|i, _| if i < rows.len() { b[rows.start + i] } else { 0.0 })
}

/// Columns in the rows of a cone.
fn of_cone<'a>(columns: &'a [FactorColumn], ends: &[usize], k: usize) -> &'a [FactorColumn] {
    let from = k.checked_sub(1).map_or(0, |before| ends[before]);
    &columns[from..ends[k]]
}

#[cfg(test)]
mod tests;
