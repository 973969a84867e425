//! How a relaxed start in steady rotation changes with parameters: the derivative of a relative
//! equilibrium.
//!
//! ```text
//! v = W (q − q_o),   F(q, v) − M W² (q − q_o) − Gᵀ λ = 0,   g = 0            W x = Ω × x
//! [K  −Gᵀ; G  0] (δq, δλ) = −(F_θ + F_v v_θ − M_θ a − M a_θ − (Gᵀ)_θ λ, g_θ),   a = W² (q − q_o)
//! K = F_q + F_v W − M W² − Σ λ_i D²g_i
//! δv = W δq + v_θ,   v_θ = δΩ × (x − o) − Ω × δo of points, δΩ × d of directors
//! δv_s − Ω × δq_s = δΩ × (x_s − o) − Ω × δo                           from the stated start, for all x_s
//! ```
#![allow(non_snake_case)] // G, K, W

use super::start::StartOf;
use super::{LEAVE_OUT, ModelTangent, refused};
use crate::start::How;
use holonom_model::ModelError;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use vi_constraints::design::{Design, Place};
use vi_constraints::saddle_point::SaddlePoint;
use vi_constraints::{Constraints, InitialValues};
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::{Singular, norm_inf};
use vi_core::sparse::{Block, Entries, Product};
use vi_core::{Configuration, MechanicalSystem};
use vi_multibody::design::start::{self, StartTangent};
use vi_multibody::run::MechanismIntegrator;
use vi_rigid::directors::FRAME;
use vi_statics::SteadyRotation;

/// Part of the largest change of a velocity that no rotation explains.
const RIGID: f64 = 1e-7;

/// A rotation of all vectors of a mechanism in space, or its change.
#[derive(Clone, Copy)]
struct Spin {
    velocity: Vector3<f64>, // Ω
    point: Vector3<f64>,    // Ω × o
    frames: usize,          // coordinates of frames
}

impl Spin {
    /// Whether the vector that begins at a coordinate is a point.
    fn is_point(self, at: usize) -> bool {
        at >= self.frames || at.is_multiple_of(FRAME)
    }

    /// `Ω × x`, of points without `Ω × o` where they are places.
    fn of(self, x: &[f64], places: bool) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        for (k, (x, out)) in x.chunks(3).zip(out.chunks_mut(3)).enumerate() {
            let moved = self.velocity.cross(&Vector3::from_column_slice(x));
            let held = if places && self.is_point(3 * k) { self.point } else { Vector3::zeros() };
            out.copy_from_slice((moved - held).as_slice());
        }
        out
    }
}

/// The columns of a matrix times those of `W`.
struct TurnedColumns<'a> {
    into: &'a mut dyn Entries,
    W: Matrix3<f64>,
}

impl Entries for TurnedColumns<'_> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        for k in 0..3 {
            self.into.add(row, column - column % 3 + k, value * self.W[(column % 3, k)]);
        }
    }
}

/// A relative equilibrium with its equations.
struct Relative {
    rotation: SteadyRotation,
    spin: Spin,
    a: Vec<f64>,
    lambda: Vec<f64>,
    saddle: SaddlePoint,
}

impl StartOf<'_> {
    /// How a relaxed start in steady rotation changes with each of the parameters of `design`.
    ///
    /// # Errors
    /// [`ModelError`] where it has no neighbour that turns steadily, or a redundant loop opens.
    pub(super) fn of_rotation(
        &self,
        run: &MechanismIntegrator,
        design: &dyn Design,
        tangents: &[ModelTangent],
        rotation: SteadyRotation,
    ) -> Result<Vec<StartTangent>, ModelError> {
        let singular = |name: &str| {
            let what = format!("the derivative by `{name}` of a singular relaxed start");
            refused("simulation.start", what, LEAVE_OUT)
        };
        let first = tangents.first().map_or("", |own| &own.name);
        let mut relative =
            Relative::new(self, run, rotation).map_err(|Singular| singular(first))?;
        let change = |(k, own): (usize, &ModelTangent)| {
            if own.numbers.signals.is_some() {
                let what = format!("the derivative by `{}` of states of signals at rest", own.name);
                return Err(refused("simulation.start", what, LEAVE_OUT));
            }
            let spin = self.change_of_rotation(own, rotation)?;
            let found = relative.change(self, run, design, k, own, spin);
            let found = found.map_err(|Singular| singular(&own.name))?;
            let [open, rate] = self.opened(own, [&found.q, &found.v])?;
            for (open, size) in [(open, &found.q), (rate, &found.v)] {
                if let Some(row) = self.largest(&open, size) {
                    return Err(self.opens(self.mechanism.constraint_name(row), &own.name));
                }
            }
            self.stays_mobile(own, &found.q)?;
            Ok(found)
        };
        tangents.iter().enumerate().map(change).collect()
    }

    /// `δΩ` and `Ω × δo + δΩ × o` of the rotation that the initial velocities of the model are.
    fn change_of_rotation(
        &self,
        own: &ModelTangent,
        rotation: SteadyRotation,
    ) -> Result<Spin, ModelError> {
        let (q, v) = (self.mechanism.initial_configuration(), self.mechanism.initial_velocity());
        let at = InitialValues::new(self.at.t, &q, &v);
        let stated = StartOf { at, stated_v: &v, how: How::Stated, ..*self };
        let [dq, dv] = stated.stated_change(own)?;
        let frames = FRAME * self.mechanism.description().bodies.len();
        let mut spin = Spin { velocity: rotation.velocity, point: Vector3::zeros(), frames };
        let carried = spin.of(&dq, false);
        let left: Vec<f64> = dv.iter().zip(&carried).map(|(a, b)| a - b).collect();
        let (mut A, mut b) = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
        let row = |k: usize| {
            let x = Vector3::from_column_slice(&q[3 * k..3 * k + 3]);
            let mut row = SMatrix::<f64, 3, 6>::zeros();
            row.fixed_view_mut::<3, 3>(0, 0).copy_from(&-x.cross_matrix());
            if spin.is_point(3 * k) {
                row.fixed_view_mut::<3, 3>(0, 3).copy_from(&-Matrix3::identity());
            }
            row
        };
        for k in 0..q.len() / 3 {
            A += row(k).tr_mul(&row(k));
            b += row(k).tr_mul(&Vector3::from_column_slice(&left[3 * k..3 * k + 3]));
        }
        let tolerance = (1e-12 * A.norm()).max(f64::MIN_POSITIVE);
        let x = A.pseudo_inverse(tolerance).map_or_else(|_| SVector::zeros(), |own| own * b);
        (spin.velocity, spin.point) = (x.fixed_rows::<3>(0).into(), x.fixed_rows::<3>(3).into());
        let found = spin.of(&q, true);
        let apart = left.iter().zip(&found).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if apart > RIGID * norm_inf(&left).max(norm_inf(&dv)) {
            let what = format!(
                "the derivative by `{}` of a relaxed start: no neighbouring system turns steadily",
                own.name
            );
            let help = "let the initial velocities follow it, by expressions of the parameter";
            return Err(refused("simulation.start", what, help));
        }
        Ok(spin)
    }
}

impl Relative {
    fn new(
        start: &StartOf<'_>,
        run: &MechanismIntegrator,
        rotation: SteadyRotation,
    ) -> Result<Self, Singular> {
        let (system, constraints) = (run.system(), run.constraints());
        let InitialValues { t, q, v, .. } = start.at;
        let frames = FRAME * start.mechanism.description().bodies.len();
        let point = rotation.velocity.cross(&rotation.point);
        let spin = Spin { velocity: rotation.velocity, point, frames };
        let (n, a) = (q.len(), spin.of(v, false));
        let at = Configuration { t, q, angles: &run.state().angles, internal: &[] };
        let mut force = vec![0.0; n];
        system.add_potential_gradient(at, -1.0, &mut force);
        system.add_force(at.moving(v), &mut force);
        start.mass.mul_add(-1.0, &a, &mut force);
        let mut of_mass = SaddlePoint::new(n, start.rows.clone());
        let emit = |out: &mut dyn Entries| start.mass.emit(out);
        let (none, mut found) = (vec![0.0; start.mechanism.len()], vec![0.0; n + start.rows.len()]);
        of_mass.solve_at(start.mechanism, &emit, at, &force, &none, &mut found)?;
        let mut lambda = none;
        start.rows.scatter(&found[n..], &mut lambda);
        let W = rotation.velocity.cross_matrix();
        let emit = |out: &mut dyn Entries| {
            system.level_slopes(at.moving(v), [1.0, 0.0], out);
            system.level_slopes(
                at.moving(v),
                [0.0, 1.0],
                &mut TurnedColumns { into: &mut *out, W },
            );
            let (row, column, scale, transposed) = (0, 0, -1.0, false);
            let turned = &mut TurnedColumns { into: &mut *out, W: W * W };
            start.mass.emit(&mut Block { into: turned, row, column, scale, transposed });
            constraints.weighted_hessian(t, q, &lambda, -1.0, out);
        };
        let G = |out: &mut dyn Entries| constraints.jacobian(t, q, out);
        let mut saddle = SaddlePoint::new(n, start.rows.clone());
        saddle.factorize(&emit, &G, -1.0, &G)?;
        Ok(Self { rotation, spin, a, lambda, saddle })
    }

    /// The change by a parameter with which the rotation changes so.
    fn change(
        &mut self,
        start: &StartOf<'_>,
        run: &MechanismIntegrator,
        design: &dyn Design,
        k: usize,
        own: &ModelTangent,
        by: Spin,
    ) -> Result<StartTangent, Singular> {
        let InitialValues { t, q, v, .. } = start.at;
        let n = q.len();
        let still = Spin { velocity: self.rotation.velocity, ..self.spin };
        let v_by = by.of(q, true);
        // a = Ω × v
        let of_velocity = still.of(&v_by, false);
        let a_by: Vec<f64> = by.of(v, false).iter().zip(&of_velocity).map(|(a, b)| a + b).collect();
        let [mut minus, mut plus] = [vec![0.0; n], vec![0.0; n]];
        let at = Configuration { t, q, angles: &run.state().angles, internal: &[] };
        let mut standing = Interval::new(n);
        standing.gather_at(at, v, 1.0);
        design.add_at_node(k, &standing, [&mut minus, &mut plus]);
        let mut b: Vec<f64> = minus.iter().zip(&plus).map(|(a, b)| a + b).collect();
        let mut opposite = vec![0.0; n];
        start::add_mass_change(start.mechanism, &own.numbers, &self.a, &mut opposite);
        start.mass.mul_add(1.0, &a_by, &mut opposite);
        b.iter_mut().zip(&opposite).for_each(|(b, a)| *b -= a);
        let mut product = Product { v: &v_by, out: &mut b };
        run.system().level_slopes(at.moving(v), [0.0, 1.0], &mut product);
        let mut rows = vec![0.0; start.mechanism.len()];
        let mut of = |s: &Interval, minus: &mut [f64], rows: &mut [f64]| {
            design.add_tangent(k, Place::Points(s), &self.lambda, minus, &mut plus, rows);
        };
        of(&Interval::between(t, 1.0, q, q), &mut b, &mut rows);
        rows.fill(0.0);
        of(&Interval::between(t - 1.0, 1.0, q, q), &mut vec![0.0; n], &mut rows);
        let mut x: Vec<f64> = b.iter().map(|b| -b).collect();
        rows.iter_mut().for_each(|row| *row = -*row);
        x.resize(n + start.rows.len(), 0.0);
        start.rows.gather(&rows, &mut x[n..]);
        self.saddle.solve_factorized(&mut x)?;
        x.truncate(n);
        let mut dv = still.of(&x, false);
        dv.iter_mut().zip(&v_by).for_each(|(dv, by)| *dv += by);
        let mut p = vec![0.0; n];
        start.mass.mul_add(1.0, &dv, &mut p);
        start::add_mass_change(start.mechanism, &own.numbers, v, &mut p);
        Ok(StartTangent { q: x, v: dv, p })
    }
}
