//! The six coordinates between two frames.
//!
//! ```text
//! frames   X, a_i of the first, Y, b_i of the second: linear in the coordinates of their bodies, constant on the ground
//! ξ_i      a_i·(Y − X)                          i = 1, 2, 3, m
//! R_ij     a_i·b_j                              relative rotation
//! ξ_{3+i}  rotation vector of R, rad:           s_i = −½ ε_ijk R_jk,   κ = ½ (tr R − 1)
//!          or tilt of b_3:                      s = (−R_23, R_13, 0),  κ = R_33,   ξ_6 ≡ 0
//! ```
//! All products are of two linear forms, so their increments over a step are exact at its midpoint.
//! `ξ` is invariant under rigid motions of both frames: a force `Σ τ_i ∇ξ_i` has no resultant.
//! Source: rotation vector and its derivatives, `rotation_vector.rs`.

use crate::geometry::rotation_vector::RotationVector;
use nalgebra::{Matrix3, Matrix4, SMatrix, SVector, Vector3, Vector4};
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use vi_core::interval::Interval;
use vi_core::sparse::Entries;
use vi_rigid::directors::FRAME;

/// Six coordinates, their rates or efforts.
pub type Vector6 = SVector<f64, 6>;
/// A matrix of six coordinates.
pub type Matrix6 = SMatrix<f64, 6, 6>;
/// A point and three axes: columns.
type PointAndAxes = SMatrix<f64, 3, 4>;
/// A row for each coordinate of a frame, a column for each of the six.
type Gradients = SMatrix<f64, FRAME, 6>;
type Square24 = SMatrix<f64, 24, 24>;

/// The greatest angle between two frames, rad; the rotation vector has no derivative at π.
pub const LARGEST_ANGLE: f64 = 3.0;

/// A frame fixed in a body or in the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct AttachedFrame {
    offset: Option<usize>,
    map: Matrix4<f64>, // (X, a_1, a_2, a_3) = (φ, d_1, d_2, d_3) map
    constant: PointAndAxes,
}

impl AttachedFrame {
    /// On the ground: a point (m) and axes, columns.
    #[must_use]
    pub fn on_ground(point: &Vector3<f64>, axes: &Matrix3<f64>) -> Self {
        let mut constant = PointAndAxes::zeros();
        constant.set_column(0, point);
        constant.fixed_view_mut::<3, 3>(0, 1).copy_from(axes);
        Self { offset: None, map: Matrix4::zeros(), constant }
    }

    /// In the body at coordinate `offset`: point from its centre (m) and axes (columns), components
    /// along the directors.
    #[must_use]
    pub fn in_body(offset: usize, point: &Vector3<f64>, axes: &Matrix3<f64>) -> Self {
        let mut map = Matrix4::zeros();
        map[(0, 0)] = 1.0;
        map.fixed_view_mut::<3, 1>(1, 0).copy_from(point);
        map.fixed_view_mut::<3, 3>(1, 1).copy_from(axes);
        Self { offset: Some(offset), map, constant: PointAndAxes::zeros() }
    }

    /// The first coordinate of its body and the map from there; `None` on the ground.
    pub(crate) fn in_its_body(&self) -> Option<(usize, Matrix4<f64>)> {
        Some((self.offset?, self.map))
    }

    /// Point and axes on the ground.
    pub(crate) fn on_the_ground(&self) -> (Vector3<f64>, Matrix3<f64>) {
        (self.constant.column(0).into_owned(), PlacedFrames::axes(&self.constant))
    }

    fn at(&self, q: &[f64]) -> PointAndAxes {
        self.constant + self.rate(q)
    }

    fn rate(&self, v: &[f64]) -> PointAndAxes {
        self.offset.map_or_else(PointAndAxes::zeros, |offset| {
            PointAndAxes::from_column_slice(&v[offset..offset + FRAME]) * self.map
        })
    }

    /// The coordinates' share of a derivative by point and axes.
    fn pulled(&self, by: &PointAndAxes) -> PointAndAxes {
        by * self.map.transpose()
    }
}

/// How the rotation between two frames is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rotation {
    /// By the rotation vector of the second in the first.
    #[default]
    Vector,
    /// By the tilts of the third axis of the second about the first two of the first, whichever way
    /// the second turns about its own.
    Tilt,
}

impl Rotation {
    /// `s` and `κ` but for its constant, linear in `R`.
    fn sine_cosine(self, r: &Matrix3<f64>) -> (Vector3<f64>, f64) {
        match self {
            Self::Vector => {
                let s = Vector3::new(
                    r[(2, 1)] - r[(1, 2)],
                    r[(0, 2)] - r[(2, 0)],
                    r[(1, 0)] - r[(0, 1)],
                );
                (0.5 * s, 0.5 * r.trace())
            }
            Self::Tilt => (Vector3::new(-r[(1, 2)], r[(0, 2)], 0.0), r[(2, 2)]),
        }
    }

    /// `W`: `c·s + d κ = Σ W_ij R_ij` but for a constant.
    fn weights(self, c: &Vector3<f64>, d: f64) -> Matrix3<f64> {
        match self {
            Self::Vector => 0.5 * (c.cross_matrix() + Matrix3::from_diagonal_element(d)),
            Self::Tilt => {
                let mut w = Matrix3::zeros();
                (w[(1, 2)], w[(0, 2)], w[(2, 2)]) = (-c.x, c.y, d);
                w
            }
        }
    }

    fn turn(self, r: &Matrix3<f64>) -> RotationVector {
        let (s, cosine) = self.sine_cosine(r);
        RotationVector::of(s, cosine - if self == Self::Vector { 0.5 } else { 0.0 })
    }
}

/// `ξ(q)` between two frames.
#[derive(Clone, Debug)]
pub struct SixCoordinates {
    from: AttachedFrame,
    to: AttachedFrame,
    rotation: Rotation,
    beyond: Arc<AtomicU64>, // bits of the last time of an angle out of range; no part of the state
}

/// Both frames in a configuration.
struct PlacedFrames {
    from: PointAndAxes,
    to: PointAndAxes,
    turn: RotationVector,
}

impl PlacedFrames {
    fn axes(frame: &PointAndAxes) -> Matrix3<f64> {
        frame.fixed_view::<3, 3>(0, 1).into_owned()
    }

    fn between(&self) -> Vector3<f64> {
        self.to.column(0) - self.from.column(0)
    }
}

/// The coordinates over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SixChange {
    /// `ξ̄ = ½ (ξ(q_n) + ξ(q_{n+1}))`.
    pub mean: Vector6,
    /// `Δξ/h`.
    pub rate: Vector6,
}

impl SixChange {
    /// A coordinate (0 to 5), or the rate of one (6 to 11).
    pub(crate) fn part(&self, part: usize) -> f64 {
        if part < 6 { self.mean[part] } else { self.rate[part - 6] }
    }
}

/// `∇ξ`, by the coordinates of both bodies.
pub(crate) struct SixGradients([Gradients; 2]);

impl SixCoordinates {
    /// Between two frames.
    #[must_use]
    pub fn new(from: AttachedFrame, to: AttachedFrame, rotation: Rotation) -> Self {
        let beyond = Arc::new(AtomicU64::new(f64::NAN.to_bits()));
        Self { from, to, rotation, beyond }
    }

    /// Both frames.
    pub(crate) fn frames(&self) -> [&AttachedFrame; 2] {
        [&self.from, &self.to]
    }

    /// The last time at which the angle was found beyond [`LARGEST_ANGLE`]; coordinates and forces
    /// are then not a number.
    #[must_use]
    pub fn beyond(&self) -> Option<f64> {
        let t = f64::from_bits(self.beyond.load(Ordering::Relaxed));
        Some(t).filter(|t| !t.is_nan())
    }

    /// Whether one frame is fixed in the ground.
    #[must_use]
    pub fn is_on_ground(&self) -> bool {
        self.from.offset.is_none() || self.to.offset.is_none()
    }

    fn placed(&self, q: &[f64]) -> PlacedFrames {
        let (from, to) = (self.from.at(q), self.to.at(q));
        let turn =
            self.rotation.turn(&(PlacedFrames::axes(&from).transpose() * PlacedFrames::axes(&to)));
        PlacedFrames { from, to, turn }
    }

    fn values(&self, t: f64, at: &PlacedFrames) -> Vector6 {
        let mut x = Vector6::zeros();
        x.fixed_rows_mut::<3>(0)
            .copy_from(&(PlacedFrames::axes(&at.from).transpose() * at.between()));
        x.fixed_rows_mut::<3>(3).copy_from(&at.turn.theta);
        if at.turn.theta.norm() > LARGEST_ANGLE {
            self.refuse(t, &mut x);
        }
        x
    }

    /// Out of range at `t`.
    #[cold]
    fn refuse(&self, t: f64, x: &mut Vector6) {
        self.beyond.store(t.to_bits(), Ordering::Relaxed);
        x.fill(f64::NAN);
    }

    /// `ξ(q)`.
    #[must_use]
    pub fn at(&self, t: f64, q: &[f64]) -> Vector6 {
        self.values(t, &self.placed(q))
    }

    /// Rates of displacement, of `s` and of `κ`, where frames move with these rates.
    fn product_rates(
        &self,
        q: [&PointAndAxes; 2],
        v: [&PointAndAxes; 2],
    ) -> (Vector3<f64>, Vector3<f64>, f64) {
        let [a, b] = q.map(PlacedFrames::axes);
        let [da, db] = v.map(PlacedFrames::axes);
        let (d, rate) = (q[1].column(0) - q[0].column(0), v[1].column(0) - v[0].column(0));
        let (s, cosine) = self.rotation.sine_cosine(&(da.transpose() * b + a.transpose() * db));
        (a.transpose() * rate + da.transpose() * d, s, cosine)
    }

    /// `∇ξ·v`.
    #[must_use]
    pub fn rate(&self, q: &[f64], v: &[f64]) -> Vector6 {
        let at = self.placed(q);
        let rates = [&self.from.rate(v), &self.to.rate(v)];
        let (along, s, cosine) = self.product_rates([&at.from, &at.to], rates);
        let mut x = Vector6::zeros();
        x.fixed_rows_mut::<3>(0).copy_from(&along);
        let by_cosine = SMatrix::<f64, 1, 1>::new(cosine);
        x.fixed_rows_mut::<3>(3).copy_from(&at.turn.change(&s, &by_cosine));
        x
    }

    /// The mean and the rate of a step.
    #[must_use]
    pub fn change(&self, s: &Interval) -> SixChange {
        let (start, end) = (self.placed(&s.q0), self.placed(&s.q1));
        let mid = [&self.from.at(&s.q_mid), &self.to.at(&s.q_mid)];
        let rates = [&self.from.rate(&s.v_mid), &self.to.rate(&s.v_mid)];
        let (along, sine, cosine) = self.product_rates(mid, rates);
        let (ds, dcosine) = (s.h * sine, s.h * cosine);
        let turned = RotationVector::difference(&start.turn, &end.turn, &ds, dcosine);
        let mut rate = Vector6::zeros();
        rate.fixed_rows_mut::<3>(0).copy_from(&along);
        rate.fixed_rows_mut::<3>(3).copy_from(&(turned / s.h));
        let t = s.t_mid();
        let mut mean = 0.5 * (self.values(t, &start) + self.values(t, &end));
        if (end.turn.theta - start.turn.theta).norm() > PI {
            self.refuse(t, &mut mean); // past a half turn within the step, to the other side
        }
        SixChange { mean, rate }
    }

    /// `Σ w_i ∂ξ_i` by point and axes of both frames.
    fn by_frames(&self, at: &PlacedFrames, w: &Vector6) -> [PointAndAxes; 2] {
        let (force, torque) =
            (w.fixed_rows::<3>(0).into_owned(), w.fixed_rows::<3>(3).into_owned());
        let (c, d) = at.turn.transposed(&torque);
        self.by_products(at, &force, &self.rotation.weights(&c, d))
    }

    /// The derivative of `Σ f_i ξ_i + Σ W_ij R_ij`, `i ≤ 3`, by point and axes of both frames.
    fn by_products(
        &self,
        at: &PlacedFrames,
        f: &Vector3<f64>,
        w: &Matrix3<f64>,
    ) -> [PointAndAxes; 2] {
        let [a, b] = [&at.from, &at.to].map(PlacedFrames::axes);
        let in_space = a * f;
        let mut by = [PointAndAxes::zeros(); 2];
        by[0].set_column(0, &-in_space);
        by[1].set_column(0, &in_space);
        let by_a = at.between() * f.transpose() + b * w.transpose();
        by[0].fixed_view_mut::<3, 3>(0, 1).copy_from(&by_a);
        by[1].fixed_view_mut::<3, 3>(0, 1).copy_from(&(a * w));
        by
    }

    /// `out ← out + Σ w_i ∇ξ_i(q)`.
    pub fn add_gradient(&self, q: &[f64], w: &Vector6, out: &mut [f64]) {
        let by = self.by_frames(&self.placed(q), w);
        for (frame, by) in [&self.from, &self.to].into_iter().zip(&by) {
            let Some(offset) = frame.offset else { continue };
            let by = frame.pulled(by);
            for (out, by) in out[offset..offset + FRAME].iter_mut().zip(by.as_slice()) {
                *out += by;
            }
        }
    }

    /// `∇ξ(q)`.
    pub(crate) fn gradients(&self, q: &[f64]) -> SixGradients {
        let at = self.placed(q);
        let mut all = [Gradients::zeros(); 2];
        for i in 0..6 {
            let by = self.by_frames(&at, &Vector6::ith(i, 1.0));
            for ((frame, by), all) in [&self.from, &self.to].into_iter().zip(&by).zip(&mut all) {
                all.column_mut(i).copy_from_slice(frame.pulled(by).as_slice());
            }
        }
        SixGradients(all)
    }

    /// `Σ w_i ∇ξ_i`, with the first coordinate of each body.
    pub(crate) fn along(
        &self,
        gradients: &SixGradients,
        w: &Vector6,
    ) -> [(Option<usize>, SVector<f64, FRAME>); 2] {
        let [a, b] = gradients.0.map(|own| own * w);
        [(self.from.offset, a), (self.to.offset, b)]
    }

    /// Emits `rowsᵀ K columns`; always the same places in the same order.
    pub(crate) fn emit_product(
        &self,
        rows: &SixGradients,
        k: &Matrix6,
        columns: &SixGradients,
        out: &mut dyn Entries,
    ) {
        let frames = [self.from.offset, self.to.offset];
        for (row, by_row) in frames.into_iter().zip(&rows.0) {
            let Some(row) = row else { continue };
            let left = by_row * k;
            for (column, by_column) in frames.into_iter().zip(&columns.0) {
                let Some(column) = column else { continue };
                let block = left * by_column.transpose();
                for i in (0..FRAME).step_by(3) {
                    for j in (0..FRAME).step_by(3) {
                        let part = block.fixed_view::<3, 3>(i, j).into_owned();
                        out.add_block(row + i, column + j, &part);
                    }
                }
            }
        }
    }

    /// `Σ w_i ∇²ξ_i`, rows and columns by the coordinates of both frames.
    fn second(&self, at: &PlacedFrames, w: &Vector6) -> Square24 {
        let (force, torque) =
            (w.fixed_rows::<3>(0).into_owned(), w.fixed_rows::<3>(3).into_owned());
        let mut by = Square24::zeros();
        let mut pair = |i: usize, j: usize, value: f64| {
            for k in 0..3 {
                by[(3 * i + k, 3 * j + k)] += value;
                by[(3 * j + k, 3 * i + k)] += value;
            }
        };
        let (c, d) = at.turn.transposed(&torque);
        let weights = self.rotation.weights(&c, d);
        for i in 0..3 {
            pair(1 + i, 4, force[i]);
            pair(1 + i, 0, -force[i]);
            (0..3).for_each(|j| pair(1 + i, 5 + j, weights[(i, j)]));
        }
        let rows = self.turn_rows([&at.from, &at.to]);
        by += rows * at.turn.second(&torque) * rows.transpose();
        self.mapped(&by)
    }

    /// `Σ w_i D³ξ_i[z]`, the same places; of displacements there is none.
    fn third(&self, q: &[f64], z: &[f64], w: &Vector6) -> Square24 {
        let (at, torque) = (self.placed(q), w.fixed_rows::<3>(3).into_owned());
        let rates = [&self.from.rate(z), &self.to.rate(z)];
        let (_, s, cosine) = self.product_rates([&at.from, &at.to], rates);
        let change = Vector4::new(s.x, s.y, s.z, cosine);
        let second = at.turn.second(&torque);
        let turned = second * change;
        let weights = self.rotation.weights(&turned.xyz(), turned.w);
        let mut by = Square24::zeros();
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            for k in 0..3 {
                let [row, column] = [3 * (1 + i) + k, 3 * (5 + j) + k];
                by[(row, column)] += weights[(i, j)];
                by[(column, row)] += weights[(i, j)];
            }
        }
        let (rows, moved) = (self.turn_rows([&at.from, &at.to]), self.turn_rows(rates));
        let mixed = moved * second * rows.transpose();
        by += mixed + mixed.transpose();
        by += rows * at.turn.third(&torque, &change) * rows.transpose();
        self.mapped(&by)
    }

    /// `∂(s, κ)` by points and axes of both frames, columns; linear in these.
    fn turn_rows(&self, frames: [&PointAndAxes; 2]) -> SMatrix<f64, 24, 4> {
        let [a, b] = frames.map(PlacedFrames::axes);
        let mut rows = SMatrix::<f64, 24, 4>::zeros();
        for k in 0..4 {
            let (c, d) = if k < 3 { (Vector3::ith(k, 1.0), 0.0) } else { (Vector3::zeros(), 1.0) };
            let w = self.rotation.weights(&c, d);
            rows.fixed_view_mut::<9, 1>(3, k).copy_from_slice((b * w.transpose()).as_slice());
            rows.fixed_view_mut::<9, 1>(15, k).copy_from_slice((a * w).as_slice());
        }
        rows
    }

    /// A second derivative by points and axes of both frames as one by the coordinates.
    fn mapped(&self, by: &Square24) -> Square24 {
        let mut map = Square24::zeros();
        for (side, frame) in [&self.from, &self.to].into_iter().enumerate() {
            for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
                for k in 0..3 {
                    map[(12 * side + 3 * i + k, 12 * side + 3 * j + k)] = frame.map[(i, j)];
                }
            }
        }
        map * by * map.transpose()
    }

    /// Emits `Σ w_i ∇²ξ_i(q)`; always the same places in the same order.
    pub(crate) fn emit_second(&self, q: &[f64], w: &Vector6, out: &mut dyn Entries) {
        self.emit(&self.second(&self.placed(q), w), out);
    }

    /// Emits `Σ w_i D³ξ_i(q)[z]`.
    pub(crate) fn emit_third(&self, q: &[f64], z: &[f64], w: &Vector6, out: &mut dyn Entries) {
        self.emit(&self.third(q, z, w), out);
    }

    fn emit(&self, second: &Square24, out: &mut dyn Entries) {
        let frames = [self.from.offset, self.to.offset];
        for (a, row) in frames.into_iter().enumerate() {
            for (b, column) in frames.into_iter().enumerate() {
                let (Some(row), Some(column)) = (row, column) else { continue };
                for i in (0..FRAME).step_by(3) {
                    for j in (0..FRAME).step_by(3) {
                        let part = second.fixed_view::<3, 3>(12 * a + i, 12 * b + j).into_owned();
                        out.add_block(row + i, column + j, &part);
                    }
                }
            }
        }
    }

    /// `∂(∇ξ·v)/∂q` at constant `v`.
    pub(crate) fn rate_slopes(&self, q: &[f64], v: &[f64]) -> SixGradients {
        let at = self.placed(q);
        let mut own = SVector::<f64, 24>::zeros();
        for (side, frame) in [&self.from, &self.to].into_iter().enumerate() {
            let Some(offset) = frame.offset else { continue };
            own.fixed_rows_mut::<12>(12 * side).copy_from_slice(&v[offset..offset + FRAME]);
        }
        let mut all = [Gradients::zeros(); 2];
        for i in 0..6 {
            let slope = self.second(&at, &Vector6::ith(i, 1.0)) * own;
            for (side, all) in all.iter_mut().enumerate() {
                all.column_mut(i).copy_from(&slope.fixed_rows::<12>(12 * side));
            }
        }
        SixGradients(all)
    }
}
