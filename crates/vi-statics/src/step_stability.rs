//! Linear stability of a time step about a steady rotation.
//!
//! ```text
//! S(q) = L_d(q, R q),   ∇S(q) = D_1 L_d(q, Rq) + D_2 L_d(R⁻¹q, q) = G(q)ᵀ λ,   g(q) = 0        [6.31]
//! R⁻¹ DΦ x = z x,       growth = max |z| − 1                                                    [6.32]
//! ```
//! `R` turns the system by `hΩ` about the axis and leaves `L_d` as it is, so a critical point of
//! `S` on the constraints is a motion that a step `Φ` only turns. Its tangent `DΦ` is exact
//! ([`vi_constraints::tangent_map`]). A stable step has all eigenvalues on the unit circle.
//!
//! The eigenvalues are those in canonical coordinates of the vibrations at rest, `√(mω) x_iᵀMδq`
//! and `x_iᵀδp/√(mω)`, in which a vibration turns by its angle of a step: in others round-off in
//! the stiff modes moves them off the circle.
//!
//! Source: theory §6.14; J. E. Marsden, M. West, Acta Numerica 10 (2001) 357–514, §1.3 (symmetry of
//! `L_d`).
#![allow(non_snake_case)] // P, R, K, M, A, J

use crate::field::AxisRotation;
use crate::rotation::SteadyRotation;
use nalgebra::{Complex, DMatrix, DVector};
use vi_constraints::Constraints;
use vi_constraints::InitialValues;
use vi_constraints::initialization::start;
use vi_constraints::null_space::null_space_at;
use vi_constraints::projection::Projections;
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::tangent_map::{TangentError, TangentMap, Tangents};
use vi_core::eigen::generalized_eigen;
use vi_core::linear::norm_inf;
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::{
    Configuration, DiscreteLagrangian, Interval, MechanicalSystem, Motion, SeparableSystem,
};
use vi_multibody::mechanism::Mechanism;

/// Iterations of Newton's method for the steady rotation.
const ITERATIONS: usize = 30;
/// A change of the coordinates, relative to the largest, at which round-off may end the iteration.
const CLOSE: f64 = 1e-6;
/// Eigenvalues of the Hessian of `S` below this part of the largest belong to turns and shifts of
/// the system.
const FREE: f64 = 1e-14;

/// Why the stability of a step is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StepStabilityError {
    /// No motion was found that a step only turns.
    #[error("no steady rotation of the discrete system was found near the given configuration")]
    NotFound,
    /// The step has no tangent, or it is not that of a conservative system.
    #[error(transparent)]
    Tangent(#[from] TangentError),
}

/// A motion that each step turns about an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyStep {
    /// `q` at one node, shape `n`.
    pub q: Vec<f64>,
    /// `max |z| − 1` [6.32].
    pub growth: f64,
}

impl SteadyStep {
    /// About the steady rotation in steps `h` (s) near the configuration `q`; dense, `O(d³)`.
    ///
    /// # Errors
    /// [`StepStabilityError`].
    pub fn find(
        system: &SeparableSystem,
        mechanism: &Mechanism,
        rotation: &SteadyRotation,
        h: f64,
        q: &[f64],
    ) -> Result<Self, StepStabilityError> {
        let angle = h * rotation.velocity.norm();
        let [forth, back] =
            [angle, -angle].map(|angle| rotation.turn(mechanism.description(), angle));
        let step = TurningStep { system, mechanism, h, forth, back };
        let q = step.steady(q).ok_or(StepStabilityError::NotFound)?;
        let growth = step.growth(&q)?;
        Ok(Self { q, growth })
    }
}

/// A step of a system that turns it.
struct TurningStep<'a> {
    system: &'a SeparableSystem,
    mechanism: &'a Mechanism,
    h: f64,
    forth: AxisRotation,
    back: AxisRotation,
}

impl TurningStep<'_> {
    /// `(R⁻¹q, q)` and `(q, Rq)`.
    fn intervals(&self, q: &[f64]) -> [Interval; 2] {
        let (before, after) = (self.back.of_configuration(q), self.forth.of_configuration(q));
        let ends = [(-self.h, &before[..], q), (0.0, q, &after[..])];
        ends.map(|(t, from, to)| {
            let mut s = Interval::between(t, self.h, from, to);
            s.internal = self.internal(q);
            s
        })
    }

    /// The internal variables of a motion that starts at `q`.
    fn internal(&self, q: &[f64]) -> Vec<f64> {
        let mut internal = vec![0.0; self.system.internal_variables()];
        self.system.begin_internal(Motion::new(0.0, q, &vec![0.0; q.len()]), &mut internal);
        internal
    }

    /// The critical point of `S` near `q` [6.31] by Newton's method; directions in which `S` does
    /// not change are left out.
    fn steady(&self, q: &[f64]) -> Option<Vec<f64>> {
        let mut q = q.to_vec();
        let rows = IndependentRows::find(self.mechanism, 0.0, &q);
        let rest = vec![0.0; q.len()];
        let mut last = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let P = null_space_at(self.mechanism, Configuration::new(0.0, &q), rows.len());
            let change = &P * self.newton(&rows, &q, &P)?;
            let size = norm_inf(change.as_slice()) / norm_inf(&q);
            if size >= last && last < CLOSE {
                return Some(q);
            }
            let moved: Vec<f64> = q.iter().zip(&change).map(|(q, dq)| q + dq).collect();
            let at = InitialValues::new(0.0, &moved, &rest);
            q = start(self.system, self.mechanism, &rows, at).ok()?.state.q;
            last = size;
        }
        (last < CLOSE).then_some(q)
    }

    /// `−(Pᵀ ∇²S P)⁻¹ Pᵀ∇S`, shape `d`, by the eigenvectors of `∇²S` beside the mass.
    fn newton(&self, rows: &IndependentRows, q: &[f64], P: &DMatrix<f64>) -> Option<DVector<f64>> {
        let (n, m) = (q.len(), self.mechanism.len());
        let [before, after] = self.intervals(q);
        let (mut slope, mut part) = (vec![0.0; n], vec![0.0; n]);
        self.system.d1(&after, &mut slope);
        self.system.d2(&before, &mut part);
        slope.iter_mut().zip(&part).for_each(|(slope, part)| *slope += part);
        // [6.31]
        let (mut lambda, mut force) = (vec![0.0; m], vec![0.0; n]);
        let at = Configuration::new(0.0, q);
        Projections::new(self.system, m, rows)
            .multiplier(self.mechanism, at, &slope, 1.0, &mut lambda, &mut force)
            .ok()?;
        let own = square(n, &|out| {
            self.system.d1_d1(&after, out);
            self.system.d2_d2(&before, out);
            self.mechanism.weighted_hessian(0.0, q, &lambda, -1.0, out);
        });
        let ahead = square(n, &|out| self.system.d2_d1(&after, out));
        let behind = square(n, &|out| self.system.d2_d1(&before, out)).transpose();
        let hessian = own * P + ahead * turned(&self.forth, P) + behind * turned(&self.back, P);
        let mass = square(n, &|out| self.system.mass().emit(out));
        let J = -P.tr_mul(&hessian);
        let eigen = generalized_eigen(&J, &P.tr_mul(&(mass * P))).ok()?;
        let slope = P.tr_mul(&DVector::from_vec(slope));
        let largest = norm_inf(&eigen.squared);
        let mut change = DVector::zeros(P.ncols());
        for (k, x) in eigen.vectors.column_iter().enumerate() {
            if eigen.squared[k].abs() > FREE * largest {
                change.axpy(x.dot(&slope) / eigen.squared[k], &x, 1.0);
            }
        }
        Some(change)
    }

    /// `max |z| − 1` at the steady rotation `q` [6.32].
    fn growth(&self, q: &[f64]) -> Result<f64, TangentError> {
        let [before, after] = self.intervals(q);
        let mut p = vec![0.0; q.len()];
        self.system.d2(&before, &mut p); // p̄_n; that of the next node is it turned
        let rows = IndependentRows::find(self.mechanism, 0.0, q);
        let mut tangents = Tangents::canonical(self.mechanism, &rows, Configuration::new(0.0, q));
        let d = tangents.dq.ncols() / 2;
        let P = tangents.dq.columns(0, d).into_owned();
        let mut map = TangentMap::new(self.mechanism.len(), &rows, &p);
        map.push(self.system, self.mechanism, &after, &mut tangents)?;
        let mut A = DMatrix::zeros(2 * d, 2 * d);
        for (first, columns) in [(0, &tangents.dq), (d, &tangents.dp)] {
            let back = P.tr_mul(&turned(&self.back, columns));
            A.view_mut((first, 0), (d, 2 * d)).copy_from(&back);
        }
        if let Some([there, back]) = self.vibrations(q, &P) {
            A = there * A * back;
        }
        // [6.32]
        let size = |z: &Complex<f64>| libm::hypot(z.re, z.im) - 1.0;
        Ok(A.complex_eigenvalues().iter().map(size).fold(f64::NEG_INFINITY, f64::max))
    }

    /// Canonical coordinates of the vibrations at rest, and the way back; `m` is 1 and what the
    /// discrete potential adds.
    fn vibrations(&self, q: &[f64], P: &DMatrix<f64>) -> Option<[DMatrix<f64>; 2]> {
        let (n, d) = P.shape();
        let at = Configuration::new(0.0, q);
        let reduced = |emit: &dyn Fn(&mut dyn Entries)| P.tr_mul(&(square(n, emit) * P));
        let K = reduced(&|out| self.system.stiffness(at.moving(&vec![0.0; n]), out));
        let M = reduced(&|out| self.system.mass().emit(out));
        let internal = self.internal(q);
        let at = Configuration { internal: &internal, ..at };
        let added = reduced(&|out| self.system.add_mass_of_step(at, self.h, out));
        let modes = generalized_eigen(&K, &M).ok()?;
        // the rotation, or what the last step of the angle resolves
        let least = (self.forth.angle / self.h).powi(2).max(f64::EPSILON / self.h.powi(2));
        let mut maps = [DMatrix::zeros(2 * d, 2 * d), DMatrix::zeros(2 * d, 2 * d)];
        let [there, back] = &mut maps;
        for (i, x) in modes.vectors.column_iter().enumerate() {
            let mass = 1.0 + x.dot(&(&added * x));
            let scale = (modes.squared[i].max(least) * mass).sqrt().sqrt(); // m ω', ω' = ω/√m
            there.view_mut((i, 0), (1, d)).copy_from(&(scale * (&M * x).transpose()));
            there.view_mut((d + i, d), (1, d)).copy_from(&(x.transpose() / scale));
            back.view_mut((0, i), (d, 1)).copy_from(&(x / scale));
            back.view_mut((d, d + i), (d, 1)).copy_from(&(scale * (&M * x)));
        }
        Some(maps)
    }
}

fn square(n: usize, emit: &dyn Fn(&mut dyn Entries)) -> DMatrix<f64> {
    SparseMatrix::assemble(n, n, |out| emit(out)).to_dense()
}

/// Each column turned.
fn turned(turn: &AxisRotation, columns: &DMatrix<f64>) -> DMatrix<f64> {
    let mut columns = columns.clone();
    for mut column in columns.column_iter_mut() {
        let turned = turn.of_vectors(column.as_slice());
        column.copy_from(&DVector::from_vec(turned));
    }
    columns
}
