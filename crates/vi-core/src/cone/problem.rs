//! The laws of the rows, `W` and `w` in the units in which each diagonal of `W` is one.
//!
//! `Λ = D Λ̃`, `W̃ = D W D`, `w̃ = D w` with `D_i = 1/√W_ii`, one unit for the three rows of a
//! contact, that of the largest diagonal: cones stay cones, and masses of any ratio stand side by
//! side. Rows that nothing can move (`W_ii = 0`) keep their unit.
#![allow(non_snake_case)] // W

use crate::linear::dot;

/// The law of one, or of three rows of `y = WΛ + w`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cone {
    /// `0 ≤ Λ ⊥ y ≥ 0`: unilateral, one row.
    Normal,
    /// Coulomb's cone, three rows, the normal one first: `0 ≤ Λ_N ⊥ y_N ≥ 0`, `|Λ_T| ≤ μΛ_N`,
    /// and `Λ_T = −μΛ_N y_T/|y_T|` where `y_T ≠ 0`.
    Friction {
        /// `μ ≥ 0`.
        coefficient: f64,
    },
    /// Coulomb's cone where the speed of slip is known beforehand, three rows, the normal one
    /// first: `Λ` is in the cone `|Λ_T| ≤ μΛ_N`, `(y_N + s, y_T)` in its dual, and both are
    /// orthogonal. With `s = μ|y_T|` these are the laws of [`Cone::Friction`]; with any `s` the
    /// problem is convex.
    Convex {
        /// `μ ≥ 0`.
        coefficient: f64,
        /// `s ≥ 0`, m/s.
        speed: f64,
    },
    /// A contact that slides in a direction that is known to first order, three rows, the normal
    /// one first: `0 ≤ Λ_N ⊥ y_N ≥ 0`, `Λ_T = −Λ_N (s + S (y_T − v))`.
    Sliding {
        /// `s`, `μ` times a mean direction.
        direction: [f64; 2],
        /// `S`, row by row, s/m.
        slope: [[f64; 2]; 2],
        /// `v`, m/s.
        at: [f64; 2],
    },
    /// `|Λ| ≤ b`, and `Λ = −b sgn y` where `y ≠ 0`: dry friction of a joint, one row.
    Bounded {
        /// `b ≥ 0`.
        bound: f64,
    },
}

impl Cone {
    /// The law where impulses are measured in `unit`, velocities in its reciprocal.
    pub(super) fn in_units(self, unit: f64) -> Self {
        match self {
            Self::Bounded { bound } => Self::Bounded { bound: bound / unit },
            Self::Convex { coefficient, speed } => {
                Self::Convex { coefficient, speed: speed * unit }
            }
            Self::Sliding { direction, slope, at } => Self::Sliding {
                direction,
                slope: slope.map(|row| row.map(|entry| entry / unit)),
                at: at.map(|v| v * unit),
            },
            cone => cone,
        }
    }

    /// Whether its numbers are.
    pub(super) fn is_finite(&self) -> bool {
        match *self {
            Self::Normal => true,
            Self::Friction { coefficient } => coefficient.is_finite(),
            Self::Bounded { bound } => bound.is_finite(),
            Self::Convex { coefficient, speed } => coefficient.is_finite() && speed.is_finite(),
            Self::Sliding { direction, slope, at } => {
                let numbers = direction.iter().chain(slope.as_flattened()).chain(&at);
                numbers.copied().all(f64::is_finite)
            }
        }
    }

    /// Rows of `y = WΛ + w` that the law takes.
    #[must_use]
    pub fn rows(&self) -> usize {
        match self {
            Self::Normal | Self::Bounded { .. } => 1,
            Self::Friction { .. } | Self::Convex { .. } | Self::Sliding { .. } => 3,
        }
    }
}

/// A law and its first row.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedLaw {
    pub cone: Cone,
    pub row: usize,
}

/// Laws with `W` and `w`.
#[derive(Clone, Debug, Default)]
pub(super) struct ConeProblem {
    pub cones: Vec<PlacedLaw>,
    pub W: Vec<f64>,      // k × k
    pub w: Vec<f64>,      // k
    pub units: Vec<f64>,  // k  D
    pub errors: Vec<f64>, // k  of w; empty where it is exact
    rigid: Vec<[f64; 2]>, // k  W_ii and w_i without compliance
}

/// A normal velocity of a row that nothing can move is no approach below this part of the largest.
const STILL: f64 = 1e-12;

impl ConeProblem {
    pub(super) fn rows(&self) -> usize {
        self.w.len()
    }

    /// Takes the problem over into its own units.
    pub(super) fn load(&mut self, cones: &[Cone], W: &[f64], w: &[f64], errors: &[f64]) {
        let k = w.len();
        self.cones.clear();
        self.units.clear();
        for &cone in cones {
            let row = self.units.len();
            let diagonal = |i: usize| W[(row + i) * (k + 1)];
            let largest = (0..cone.rows()).map(diagonal).fold(0.0, f64::max);
            let unit = if largest > 0.0 { 1.0 / largest.sqrt() } else { 1.0 };
            self.units.resize(row + cone.rows(), unit);
            self.cones.push(PlacedLaw { cone: cone.in_units(unit), row });
        }
        debug_assert_eq!(self.units.len(), k, "as many rows as the cones have");
        let units = &self.units;
        self.w.clear();
        self.w.extend(w.iter().zip(units).map(|(w, unit)| w * unit));
        self.W.clear();
        for (row, unit) in W.chunks_exact(k.max(1)).zip(units) {
            self.W.extend(row.iter().zip(units).map(|(entry, other)| entry * unit * other));
        }
        self.errors.clear();
        for i in 0..errors.len() {
            // an error of a row that contradicts this one is shared with it by the coupling
            let row = self.W[i * k..(i + 1) * k].iter().zip(errors.iter().zip(units));
            let shared = row.map(|(entry, (error, unit))| entry.abs() * error * unit);
            self.errors.push(shared.fold(errors[i] * units[i], f64::max));
        }
    }

    /// Gives each row a compliance about the present impulses, `y + ε (Λ − Λ_0)`: the impulses are
    /// then unique.
    pub(super) fn soften(&mut self, compliance: f64, impulse: &[f64]) {
        let k = self.rows();
        self.rigid.clear();
        for (i, impulse) in impulse.iter().enumerate() {
            self.rigid.push([self.W[i * (k + 1)], self.w[i]]);
            self.W[i * (k + 1)] += compliance;
            self.w[i] -= compliance * impulse;
        }
    }

    /// Takes the compliance away, to the bit.
    pub(super) fn harden(&mut self) {
        let k = self.rows();
        for (i, [diagonal, w]) in self.rigid.drain(..).enumerate() {
            self.W[i * (k + 1)] = diagonal;
            self.w[i] = w;
        }
    }

    /// The largest error of `w` in these rows.
    pub(super) fn largest_error(&self, rows: std::ops::Range<usize>) -> f64 {
        rows.map(|i| self.error(i)).fold(0.0, f64::max)
    }

    /// To which `w_i` is known.
    pub(super) fn error(&self, i: usize) -> f64 {
        self.errors.get(i).copied().unwrap_or(0.0)
    }

    pub(super) fn row(&self, i: usize) -> &[f64] {
        let k = self.rows();
        &self.W[i * k..(i + 1) * k]
    }

    /// Visits the entries of `W`, row by row.
    pub(super) fn for_each_entry(&self, visit: &mut dyn FnMut(usize, usize, f64)) {
        for i in 0..self.rows() {
            self.row(i).iter().enumerate().for_each(|(j, value)| visit(i, j, *value));
        }
    }

    /// `y_i = (WΛ + w)_i`.
    pub(super) fn velocity(&self, i: usize, impulse: &[f64]) -> f64 {
        self.w[i] + dot(self.row(i), impulse)
    }

    /// The first unilateral row with an approach that no impulse can change; where it is within
    /// rounding, the row is set to rest.
    pub(super) fn unmovable_approach(&mut self) -> Option<usize> {
        let size = self.w.iter().fold(0.0, |size: f64, w| size.max(w.abs()));
        for k in 0..self.cones.len() {
            let PlacedLaw { cone, row } = self.cones[k];
            let moves = self.W[row * (self.rows() + 1)] > 0.0;
            if moves || matches!(cone, Cone::Bounded { .. }) || self.w[row] >= 0.0 {
                continue;
            }
            if self.w[row] < -STILL * size - self.error(row) {
                return Some(k);
            }
            self.w[row] = 0.0;
        }
        None
    }
}
