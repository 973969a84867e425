//! Forces and torques on a body or a point mass by laws of its own motion.
//!
//! ```text
//! y = (t, X, Ẋ, w)      in a step at t_{n+1/2}: X = X(q_{n+1/2}), Ẋ = X(Δq)/h, w = θ/h
//! θ(s, κ)               rotation vector of the step, see `crate::geometry::rotation_vector`
//!                       s = ½ Σ d_I(q_n) × d_I(q_{n+1}),   κ = ½ (Σ d_I(q_n)·d_I(q_{n+1}) − 1)
//! f_d^∓ = (h/2) (f, ϱ_I f + ½ τ×d_I)    with the directors of q_n | q_{n+1}, as loads
//! (f, τ) = law(y)        along the axes of space, or Σ (B law)_I d̄_I along those of the body
//! ```
//! `X = φ + ϱ_I d_I` the point where the force acts, `w` the angular velocity, in space. The work
//! of a step is exact in the increments, so the energy is a balance to second order.
//!
//! Source: LMO08 §4 for the director form; Marsden & West 2001, part 3, for the discrete forces.
#![allow(non_snake_case)] // B, X: the letters above

pub use super::acts_on::ActsOn;
use crate::force::bends::{LawEvaluation, Pushes};
use crate::force::law::{Input, Target};
use crate::geometry::form::Form;
use crate::geometry::rotation_vector::RotationVector;
use nalgebra::{DMatrix, Matrix3, SMatrix, Vector3};
use std::sync::Arc;
use vi_core::Motion;
use vi_core::force::{DiscreteForce, Force, LengthBends, NoTimeSlope};
use vi_core::interval::{Interval, Slot, StepChange};
use vi_core::sparse::Entries;
use vi_rigid::directors::{self, FRAME, director};

/// Inputs of a law: `t`, `X`, `Ẋ`, `w`.
pub const INPUTS: usize = 10;
/// `∂(f, τ)/∂y`.
pub type WrenchSlopes = SMatrix<f64, 6, INPUTS>;
type WrenchRows = SMatrix<f64, INPUTS, FRAME>;

/// A force (N) and a torque (N·m) by time and motion.
pub trait WrenchLaw: Send + Sync {
    /// `(f, τ)` at `y`.
    fn evaluate(&self, y: &[f64; INPUTS]) -> [f64; 6];
    /// `(f, τ)` and its derivatives by `y`.
    fn gradient(&self, y: &[f64; INPUTS], slopes: &mut WrenchSlopes) -> [f64; 6];
    /// `slopes ← Σ_k w_k` times how the derivatives of effort `k` by `y` change where `y` changes
    /// by `along`; zero, unless said otherwise.
    fn bend(&self, _y: &[f64; INPUTS], _along: &[f64], _w: &[f64], slopes: &mut [f64]) {
        slopes.fill(0.0);
    }
    /// Whether it dissipates energy.
    fn is_dissipative(&self) -> bool;
}

impl<L: WrenchLaw + ?Sized> WrenchLaw for Arc<L> {
    fn bend(&self, y: &[f64; INPUTS], along: &[f64], w: &[f64], slopes: &mut [f64]) {
        (**self).bend(y, along, w, slopes);
    }
    fn evaluate(&self, y: &[f64; INPUTS]) -> [f64; 6] {
        (**self).evaluate(y)
    }
    fn gradient(&self, y: &[f64; INPUTS], slopes: &mut WrenchSlopes) -> [f64; 6] {
        (**self).gradient(y, slopes)
    }
    fn is_dissipative(&self) -> bool {
        (**self).is_dissipative()
    }
}

/// A [`WrenchLaw`] on a member, as a discrete force pair.
#[derive(Clone)]
pub struct WrenchForce {
    /// The member.
    pub on: ActsOn,
    /// The law.
    pub law: Arc<dyn WrenchLaw>,
}

impl std::fmt::Debug for WrenchForce {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("WrenchForce").field("on", &self.on).finish_non_exhaustive()
    }
}

impl WrenchForce {
    /// `y` by `t`, `X`, `Ẋ`, `w`.
    fn inputs(t: f64, x: &Vector3<f64>, v: &Vector3<f64>, w: &Vector3<f64>) -> [f64; INPUTS] {
        [t, x.x, x.y, x.z, v.x, v.y, v.z, w.x, w.y, w.z]
    }

    /// `y` in a step.
    fn in_step(&self, s: &Interval) -> [f64; INPUTS] {
        let (mid, rate) = (self.on.own(&s.q_mid), self.on.own(&s.v_mid));
        let (x, v) = (self.on.point(&mid), self.on.point(&rate));
        let mut w = Vector3::zeros();
        if matches!(self.on, ActsOn::Frame { .. }) {
            w = RotationVector::of_step(&self.on.own(&s.q0), &self.on.own(&s.q1)).theta / s.h;
        }
        Self::inputs(s.t_mid(), &x, &v, &w)
    }

    /// Its derivative by an end.
    fn rows_in_step(&self, s: &Interval, node: Slot) -> WrenchRows {
        let mut rows = WrenchRows::zeros();
        self.on.point_rows(0.5, 1, &mut rows);
        self.on.point_rows(node.sign() / s.h, 4, &mut rows);
        if matches!(self.on, ActsOn::Frame { .. }) {
            let by = RotationVector::by_node(node, &self.on.own(&s.q0), &self.on.own(&s.q1));
            for (i, by) in by.into_iter().enumerate() {
                rows.fixed_view_mut::<3, 3>(7, 3 + 3 * i).copy_from(&(by / s.h));
            }
        }
        rows
    }

    /// `(f, τ)` at a node as the law states them, N and N·m.
    #[must_use]
    pub fn efforts(&self, t: f64, q: &[f64], v: &[f64]) -> [f64; 6] {
        self.law.evaluate(&self.at_node(t, &self.on.own(q), &self.on.own(v)))
    }

    /// `q ← q + scale ∂y_k/∂q`, `of_v ← of_v + scale ∂y_k/∂v` of the efforts `y = (f, τ)` at a
    /// node, both of shape `n`.
    pub fn add_effort_slopes(
        &self,
        t: f64,
        q: &[f64],
        v: &[f64],
        k: usize,
        scale: f64,
        out: [&mut [f64]; 2],
    ) {
        let (own, rate) = (self.on.own(q), self.on.own(v));
        let mut slopes = WrenchSlopes::zeros();
        self.law.gradient(&self.at_node(t, &own, &rate), &mut slopes);
        let row = scale * slopes.row(k);
        let first = self.on.offset();
        for (rows, out) in
            [self.rows_by_position(&rate), self.rows_by_velocity(&own)].iter().zip(out)
        {
            let by = row * rows;
            (0..self.on.size()).for_each(|i| out[first + i] += by[i]);
        }
    }

    /// `∂y/∂q` at a node.
    fn rows_by_position(&self, rate: &[f64; FRAME]) -> WrenchRows {
        let mut rows = WrenchRows::zeros();
        self.on.point_rows(1.0, 1, &mut rows);
        for i in (0..3).filter(|_| matches!(self.on, ActsOn::Frame { .. })) {
            let by = -0.5 * director(rate, i).cross_matrix(); // ½ δd × ḋ
            rows.fixed_view_mut::<3, 3>(7, 3 + 3 * i).copy_from(&by);
        }
        rows
    }

    /// `∂y/∂v` at a node.
    fn rows_by_velocity(&self, own: &[f64; FRAME]) -> WrenchRows {
        let mut rows = WrenchRows::zeros();
        self.on.point_rows(1.0, 4, &mut rows);
        for i in (0..3).filter(|_| matches!(self.on, ActsOn::Frame { .. })) {
            let by = 0.5 * director(own, i).cross_matrix();
            rows.fixed_view_mut::<3, 3>(7, 3 + 3 * i).copy_from(&by);
        }
        rows
    }

    /// `y` at a node.
    fn at_node(&self, t: f64, own: &[f64; FRAME], rate: &[f64; FRAME]) -> [f64; INPUTS] {
        let mut w = Vector3::zeros();
        if matches!(self.on, ActsOn::Frame { .. }) {
            w = directors::angular_velocity(own, rate);
        }
        Self::inputs(t, &self.on.point(own), &self.on.point(rate), &w)
    }

    /// `∂(f, τ)/∂q` where `y` changes by `rows` and the axes with the directors by `share`.
    fn wrench_rows(
        &self,
        y: &[f64; INPUTS],
        own: &[f64; FRAME],
        rows: &WrenchRows,
        share: f64,
    ) -> SMatrix<f64, 6, FRAME> {
        let mut slopes = WrenchSlopes::zeros();
        let wrench = self.law.gradient(y, &mut slopes);
        let by_law = slopes * rows;
        let ActsOn::Frame { axes: Some(axes), .. } = &self.on else { return by_law };
        let directors = Matrix3::from_columns(&[0, 1, 2].map(|i| director(own, i))) * axes;
        let mut all = self.on.turned_axes(&wrench, share);
        for k in [0, 3] {
            let mut turned = all.fixed_rows_mut::<3>(k);
            turned += directors * by_law.fixed_rows::<3>(k);
        }
        all
    }

    /// `y` as what laws of anything read.
    fn reads(&self) -> Vec<Input> {
        let (offset, form) = match &self.on {
            ActsOn::Frame { offset, point, .. } => (Some(*offset), Form::point(*offset, point)),
            ActsOn::Particle { offset, dimension } => (None, Form::particle(*offset, *dimension)),
        };
        let points = (0..3).map(|k| Input::Point(form.clone(), k));
        let rates = (0..3).map(|k| Input::PointRate(form.clone(), k));
        let spins = (0..3).map(|k| offset.map_or(Input::Time, |offset| Input::Spin(offset, k)));
        std::iter::once(Input::Time).chain(points).chain(rates).chain(spins).collect()
    }

    /// With the law and its second derivatives.
    fn with_bends(
        &self,
        y: &[f64; INPUTS],
        then: impl FnOnce((&[Input], &dyn Pushes), &LawEvaluation<'_>),
    ) {
        let mut slopes = WrenchSlopes::zeros();
        let efforts = self.law.gradient(y, &mut slopes);
        let slopes = DMatrix::from_column_slice(6, INPUTS, slopes.as_slice());
        let bend = |along: &[f64], w: &[f64], out: &mut [f64]| self.law.bend(y, along, w, out);
        let (reads, target) = (self.reads(), Target::Member(self.on.clone()));
        then(
            (&reads, &target),
            &LawEvaluation { values: y, efforts: &efforts, slopes: &slopes, bend: &bend },
        );
    }

    /// `q ← q + scale ∂²y_k/∂q∂(q, v)` times `changes` of both, `of_v` likewise, of the efforts at
    /// a node.
    pub fn add_effort_bends(
        &self,
        (t, q, v): (f64, &[f64], &[f64]),
        (effort, scale): (usize, f64),
        changes: [&[f64]; 2],
        out: [&mut [f64]; 2],
    ) {
        let y = self.at_node(t, &self.on.own(q), &self.on.own(v));
        self.with_bends(&y, |(reads, _), law| law.add(reads, [q, v], effort, scale, changes, out));
    }

    /// Half the impulse of a step with the directors of the end `q`.
    fn add_half(&self, s: &Interval, q: &[f64], out: &mut [f64]) {
        let wrench = self.law.evaluate(&self.in_step(s));
        let wrench = self.on.spatial(wrench, &self.on.own(&s.q_mid));
        self.on.add_wrench(0.5 * s.h, wrench, &self.on.own(q), out);
    }
}

/// The continuous force; at averaged directors, as energy–momentum schemes take it, of order 2.
impl Force for WrenchForce {
    fn add(&self, Motion { t, q, v, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        let (own, rate) = (self.on.own(q), self.on.own(v));
        let wrench = self.law.evaluate(&self.at_node(t, &own, &rate));
        self.on.add_wrench(scale, self.on.spatial(wrench, &own), &own, out);
    }

    fn add_position_derivative(
        &self,
        Motion { t, q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let (own, rate) = (self.on.own(q), self.on.own(v));
        let y = self.at_node(t, &own, &rate);
        let rows = self.rows_by_position(&rate);
        let block = self.on.columns(&own) * self.wrench_rows(&y, &own, &rows, 1.0);
        self.on.emit(scale, &block, out);
        let [_, torque] = self.on.spatial(self.law.evaluate(&y), &own);
        self.on.turn_levers(scale, &torque, out);
    }

    fn add_velocity_derivative(
        &self,
        Motion { t, q, v, .. }: Motion<'_>,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let (own, rate) = (self.on.own(q), self.on.own(v));
        let y = self.at_node(t, &own, &rate);
        let rows = self.rows_by_velocity(&own);
        let block = self.on.columns(&own) * self.wrench_rows(&y, &own, &rows, 0.0);
        self.on.emit(scale, &block, out);
    }

    fn acts_from_ground(&self) -> bool {
        true
    }

    fn is_dissipative(&self) -> bool {
        self.law.is_dissipative()
    }
}

impl LengthBends for WrenchForce {
    fn add_slope_by_length(&self, s: &Interval, y: [&[f64]; 2], by: Slot, out: &mut [f64]) {
        self.with_bends(&self.in_step(s), |own, law| {
            law.add_slope_by_length(own, (s, y), by, out);
        });
    }

    fn second_by_length(&self, s: &Interval, y: [&[f64]; 2]) -> f64 {
        let mut second = 0.0;
        self.with_bends(&self.in_step(s), |own, law| second = law.second_by_length(own, (s, y)));
        second
    }
}

impl DiscreteForce for WrenchForce {
    fn add_minus(&self, s: &Interval, out: &mut [f64]) {
        self.add_half(s, &s.q0, out);
    }

    fn add_plus(&self, s: &Interval, out: &mut [f64]) {
        self.add_half(s, &s.q1, out);
    }

    fn add_slope(&self, s: &Interval, of: Slot, by: Slot, out: &mut dyn Entries) {
        let (y, rows) = (self.in_step(s), self.rows_in_step(s, by));
        let (mid, scale) = (self.on.own(&s.q_mid), 0.5 * s.h);
        let slope = self.wrench_rows(&y, &mid, &rows, 0.5);
        self.on.emit(scale, &(self.on.columns(&self.on.own(s.node(of))) * slope), out);
        if of == by {
            let [_, torque] = self.on.spatial(self.law.evaluate(&y), &mid);
            self.on.turn_levers(scale, &torque, out);
        }
    }

    fn add_bend(&self, s: &Interval, y: [&[f64]; 2], slots: [Slot; 2], out: &mut dyn Entries) {
        self.with_bends(&self.in_step(s), |own, law| law.emit_in_step(own, s, y, slots, out));
    }

    fn length_bends(&self) -> Option<&dyn LengthBends> {
        Some(self)
    }

    fn add_gauss_bend(&self, at: Motion<'_>, z: &[f64], by: [f64; 4], out: &mut dyn Entries) {
        let y = self.at_node(at.t, &self.on.own(at.q), &self.on.own(at.v));
        self.with_bends(&y, |own, law| law.emit_at_node(own, [at.q, at.v, z], by, out));
    }

    fn add_step_slope(
        &self,
        s: &Interval,
        of: Slot,
        change: StepChange,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        let (y, mut slopes) = (self.in_step(s), WrenchSlopes::zeros());
        let wrench = SMatrix::<f64, 6, 1>::from(self.law.gradient(&y, &mut slopes));
        let mut by = SMatrix::<f64, INPUTS, 1>::zeros(); // Ẋ and w are divided by h
        by[0] = change.middle;
        (4..INPUTS).for_each(|j| by[j] = -y[j] * change.length / s.h);
        let wrench = 0.5 * change.length * wrench + 0.5 * s.h * slopes * by; // of (h/2) (f, τ)
        let spatial = self.on.spatial(wrench.data.0[0], &self.on.own(&s.q_mid));
        self.on.add_wrench(1.0, spatial, &self.on.own(s.node(of)), out);
        Ok(())
    }

    fn add_time_slope(
        &self,
        at: Motion<'_>,
        scale: f64,
        out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        let own = self.on.own(at.q);
        let (y, mut slopes) = (self.at_node(at.t, &own, &self.on.own(at.v)), WrenchSlopes::zeros());
        self.law.gradient(&y, &mut slopes);
        let by_time: [f64; 6] = slopes.column(0).into_owned().data.0[0];
        self.on.add_wrench(scale, self.on.spatial(by_time, &own), &own, out);
        Ok(())
    }

    fn add_continuous(&self, at: Motion<'_>, out: &mut [f64]) {
        self.add(at, 1.0, out);
    }

    fn add_stiffness(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.add_position_slope(at, scale, out);
    }

    fn acts_from_ground(&self) -> bool {
        true
    }

    fn add_position_slope(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.add_position_derivative(at, scale, out);
    }

    fn add_damping(&self, at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        self.add_velocity_derivative(at, scale, out);
    }

    fn is_dissipative(&self) -> bool {
        self.law.is_dissipative()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;
    use vi_testkit::{bend_error, slope_error};

    /// Of all inputs, with curvature.
    struct CurvedWrench;

    impl WrenchLaw for CurvedWrench {
        fn evaluate(&self, y: &[f64; INPUTS]) -> [f64; 6] {
            std::array::from_fn(|k| {
                (0..INPUTS)
                    .map(|i| (0.3 + 0.1 * (k * i % 7) as f64) * y[i] * y[(i + k) % INPUTS])
                    .sum()
            })
        }
        fn gradient(&self, y: &[f64; INPUTS], slopes: &mut WrenchSlopes) -> [f64; 6] {
            slopes.fill(0.0);
            for k in 0..6 {
                for i in 0..INPUTS {
                    let c = 0.3 + 0.1 * (k * i % 7) as f64;
                    slopes[(k, i)] += c * y[(i + k) % INPUTS];
                    slopes[(k, (i + k) % INPUTS)] += c * y[i];
                }
            }
            self.evaluate(y)
        }
        fn bend(&self, _y: &[f64; INPUTS], along: &[f64], w: &[f64], slopes: &mut [f64]) {
            slopes.fill(0.0);
            for (k, i) in (0..6).flat_map(|k| (0..INPUTS).map(move |i| (k, i))) {
                let (c, j) = (0.3 + 0.1 * (k * i % 7) as f64, (i + k) % INPUTS);
                slopes[i] += w[k] * c * along[j];
                slopes[j] += w[k] * c * along[i];
            }
        }
        fn is_dissipative(&self) -> bool {
            true
        }
    }

    fn frame(at: [f64; 3], turned: [f64; 3]) -> Vec<f64> {
        let rotation = Rotation3::new(Vector3::from(turned)).into_inner();
        at.into_iter().chain(rotation.iter().copied()).collect()
    }

    fn forces() -> [WrenchForce; 3] {
        let point = Vector3::new(0.3, -0.2, 0.1);
        let axes = Some(Rotation3::new(Vector3::new(0.2, 0.4, -0.1)).into_inner());
        [
            ActsOn::Frame { offset: 0, point, axes: None },
            ActsOn::Frame { offset: 0, point, axes },
            ActsOn::Particle { offset: 0, dimension: 3 },
        ]
        .map(|on| WrenchForce { on, law: Arc::new(CurvedWrench) })
    }

    fn differences(n: usize, q: &[f64], f: impl Fn(&[f64]) -> Vec<f64>) -> DMatrix<f64> {
        let e = 1e-6;
        let mut all = DMatrix::zeros(n, n);
        for j in 0..n {
            let moved = |by: f64| {
                let mut q = q.to_vec();
                q[j] += by;
                f(&q)
            };
            let (plus, minus) = (moved(e), moved(-e));
            (0..n).for_each(|i| all[(i, j)] = (plus[i] - minus[i]) / (2.0 * e));
        }
        all
    }

    #[test]
    fn derivatives_against_central_differences() {
        let q0 = frame([0.1, 0.2, -0.3], [0.3, -0.5, 0.2]);
        let v: Vec<f64> = (0..12).map(|i| 0.1 * f64::from(i) - 0.5).collect();
        for (k, force) in forces().into_iter().enumerate() {
            let n = force.on.size();
            for turned in [[0.5, -0.3, 0.4], [0.3, -0.5, 0.2], [0.3, -0.5, 0.2001]] {
                let q1 = frame([0.15, 0.1, -0.2], turned);
                let s = Interval::between(0.4, 0.1, &q0[..n], &q1[..n]);
                let error = slope_error(&force, &s);
                println!("law {k}, slot derivatives: {error:.1e}");
                assert!(error < 1e-7);
                let error = bend_error(&force, &s);
                println!("law {k}, second derivatives: {error:.1e}");
                assert!(error < 1e-8);
            }
            let value = |q: &[f64], v: &[f64]| {
                let mut out = vec![0.0; 12];
                force.add(Motion::new(0.4, q, v), 1.0, &mut out);
                out
            };
            let [mut by_q, mut by_v] = [DMatrix::zeros(n, n), DMatrix::zeros(n, n)];
            force.add_position_derivative(Motion::new(0.4, &q0, &v), 1.0, &mut by_q);
            force.add_velocity_derivative(Motion::new(0.4, &q0, &v), 1.0, &mut by_v);
            let errors = [
                (by_q - differences(n, &q0, |q| value(q, &v))).amax(),
                (by_v - differences(n, &v, |v| value(&q0, v))).amax(),
            ];
            println!("law {k}, slopes: {errors:?}");
            assert!(errors.iter().all(|error| *error < 1e-7));
        }
    }

    #[test]
    fn the_turn_of_a_step_is_its_rotation_vector() {
        let q0 = frame([0.0; 3], [0.3, -0.5, 0.2]);
        for turned in [[0.0, 0.0, 1e-12], [1e-5, 0.0, 2e-5], [0.4, -1.0, 2.0], [0.0, 3.0, 0.0]] {
            let first = Rotation3::new(Vector3::new(0.3, -0.5, 0.2));
            let own = (Rotation3::new(Vector3::from(turned)) * first).into_inner();
            let q1: Vec<f64> = [0.0; 3].into_iter().chain(own.iter().copied()).collect();
            let error = (RotationVector::of_step(&q0, &q1).theta - Vector3::from(turned)).amax();
            assert!(error < 1e-14, "{turned:?}: {error:e}");
        }
    }
}
