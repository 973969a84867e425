//! Rolling of wheels and spheres on planes: the height at the nodes, no slip over each step.
//!
//! ```text
//! c(a) = √(1 − (n·a)²),    ρ(a) = −R_c (n − (n·a) a)/c − b n       centre → point of contact
//! height, at nodes         n·(φ − o) − b − R_c c(a) = 0
//! slip, of the step        e_i·[Δφ + θ × ρ(ā)] = h e_i·Ω n × (φ_{n+1/2} + ρ(ā) − o),   i = 1, 2
//! A(q)                     e_i·(φ̇ + ω × ρ(a)),     b(q) = e_i·Ω n × (φ + ρ(a) − o)
//! ```
//! `a` axis of the wheel, `R_c` radius of the circle of centres of the tyre's section, `b` radius
//! of the section (0: an edge), `n` normal of the plane, `o` a point of it, `Ω` its spin about `n`
//! through `o`; `ā = (a_n + a_{n+1})/|a_n + a_{n+1}|`; `θ` the rotation vector of the body in the
//! step. A sphere has no axis, `ρ = −b n`. With the rotation vector straight rolling is exact,
//! `Δx = R Δθ`, where averaged directors would give `R sin Δθ`.

use super::velocity_constraint::{VelocityConstraint, WrenchVisitor, emit_wrench, frame_of};
use crate::geometry::rotation_vector::RotationVector;
use crate::pair::Twist;
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;
use vi_core::interval::{Interval, StepChange};
use vi_core::num_dual::Dual64;
use vi_core::sparse::Entries;
use vi_core::{Configuration, Motion, Number};
use vi_rigid::directors::{self, FRAME};
use vi_rigid::rotation::kappa;

/// Flattest wheel: largest `|n·a|`.
pub const FLATTEST: f64 = 0.99;

/// A plane of the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct RolledPlane<T = f64> {
    /// `o`, m.
    pub origin: Vector3<T>,
    /// `e_1`, `e_2`, `n`, orthonormal.
    pub axes: Matrix3<T>,
    /// `Ω`, rad/s.
    pub spin: T,
}

impl<T: Number> RolledPlane<T> {
    /// `n`.
    #[must_use]
    pub fn normal(&self) -> Vector3<T> {
        self.axes.column(2).into()
    }

    fn direction(&self, i: usize) -> Vector3<T> {
        self.axes.column(i).into()
    }
}

/// A wheel or a sphere on a plane; with dual numbers it has its derivative by a parameter beside
/// it.
#[derive(Clone, Debug, PartialEq)]
pub struct Rolling<T = f64> {
    /// Its body.
    pub frame: usize,
    /// `a`, components along the directors of the body, a unit vector; `None`: a sphere.
    pub axis: Option<Vector3<T>>,
    /// `R_c`, m; 0 of a sphere.
    pub circle: T,
    /// `b`, m; the radius of a sphere.
    pub section: T,
    /// What it rolls on.
    pub plane: RolledPlane<T>,
}

/// `ρ` and what its derivative is made of.
struct RollingContact<T = f64> {
    rho: Vector3<T>,
    axis: Vector3<T>,   // a; 0 of a sphere
    across: Vector3<T>, // w = n − (n·a) a
    along: T,           // n·a
    circle: T,
    normal: Vector3<T>,
}

impl<T: Number> RollingContact<T> {
    /// `Dρ(a) δ` for `|a| = 1`.
    fn change(&self, delta: &Vector3<T>) -> Vector3<T> {
        if self.circle.vanishes() {
            return Vector3::zeros();
        }
        let c = self.cosine();
        let part = self.normal.dot(delta);
        let across = -self.axis * part - delta * self.along;
        let cosine = -self.along * part / c;
        (across / c - self.across * (cosine / (c * c))) * -self.circle
    }

    fn cosine(&self) -> T {
        (T::of(1.0) - self.along * self.along).sqrt()
    }
}

impl RollingContact {
    /// `Dρ(a)ᵀ y`.
    fn transposed(&self, y: &Vector3<f64>) -> Vector3<f64> {
        if self.circle == 0.0 {
            return Vector3::zeros();
        }
        let c = self.cosine();
        let of_across = -self.circle * y / c; // ∂(ρ·y)/∂w
        let of_cosine = self.circle * self.across.dot(y) / (c * c);
        let of_part = -self.axis.dot(&of_across) - of_cosine * self.along / c;
        of_part * self.normal - self.along * of_across
    }
}

impl<T: Number> Rolling<T> {
    /// `a` at `q`, or its rate at `v`; zero of a sphere.
    fn axis_at(&self, q: &[f64]) -> Vector3<T> {
        self.axis_of(&directors::triad(frame_of(q, self.frame)).map(T::of))
    }

    /// The same of the directors, or of their rates.
    fn axis_of(&self, triad: &Matrix3<T>) -> Vector3<T> {
        self.axis.map_or_else(Vector3::zeros, |axis| triad * axis)
    }

    fn center(&self, q: &[f64]) -> Vector3<T> {
        directors::center(frame_of(q, self.frame)).map(T::of)
    }

    fn contact(&self, axis: Vector3<T>) -> RollingContact<T> {
        let normal = self.plane.normal();
        let along = normal.dot(&axis);
        let across = normal - axis * along;
        let mut contact = RollingContact {
            rho: normal * -self.section,
            axis,
            across,
            along,
            circle: if self.axis.is_some() { self.circle } else { T::of(0.0) },
            normal,
        };
        if !contact.circle.vanishes() {
            contact.rho -= across * (contact.circle / contact.cosine());
        }
        contact
    }

    /// The height of the lowest point above the plane, m.
    #[must_use]
    pub fn height(&self, q: &[f64]) -> T {
        let above = self.plane.normal().dot(&(self.center(q) - self.plane.origin)) - self.section;
        match self.axis {
            None => above,
            Some(_) => {
                let along = self.plane.normal().dot(&self.axis_at(q));
                above - self.circle * (T::of(1.0) - along * along).sqrt()
            }
        }
    }

    /// The velocity of the plane at a point.
    fn carried(&self, point: &Vector3<T>) -> Vector3<T> {
        self.plane.normal().cross(&(point - self.plane.origin)) * self.plane.spin
    }

    /// `s/c` with `s = n·a`, and `n`: of the gradient of the height by the axis, `R_c s/c n`.
    fn slope(&self, q: &[f64]) -> Vector3<T> {
        let normal = self.plane.normal();
        let along = normal.dot(&self.axis_at(q));
        normal * (self.circle * along / (T::of(1.0) - along * along).sqrt())
    }

    /// The entries of the gradient of the height.
    pub(crate) fn for_each_slope_of_height(&self, q: &[f64], mut visit: impl FnMut(usize, T)) {
        let (first, normal, slope) = (FRAME * self.frame, self.plane.normal(), self.slope(q));
        (0..3).for_each(|k| visit(first + k, normal[k]));
        let Some(axis) = self.axis else { return };
        for i in 0..3 {
            (0..3).for_each(|k| visit(first + 3 + 3 * i + k, axis[i] * slope[k]));
        }
    }

    /// The row of `A(q)` of the slip along `e_i`: force, and torque about the centre.
    pub(crate) fn row_of_slip(&self, q: &[f64], i: usize) -> [Vector3<T>; 2] {
        let (rho, e) = (self.contact(self.axis_at(q)).rho, self.plane.direction(i));
        [e, rho.cross(&e)]
    }

    /// `b` of the slip along `e_i`, m/s.
    pub(crate) fn rate_of_slip(&self, q: &[f64], i: usize) -> T {
        let point = self.center(q) + self.contact(self.axis_at(q)).rho;
        self.plane.direction(i).dot(&self.carried(&point))
    }

    /// `h A_d` of the slip along `e_i`, m.
    pub(crate) fn slip_of_step(&self, s: &Interval, i: usize) -> T {
        let rho = self.contact(self.mean_axis(s).0).rho;
        let moved = self.center(&s.dq) + self.turned(s).map(T::of).cross(&rho);
        let carried = match self.plane.spin.vanishes() {
            true => Vector3::zeros(),
            false => {
                let middle = self.center(&s.q0) + self.center(&s.dq) * T::of(0.5);
                self.carried(&(middle + rho)) * T::of(s.h)
            }
        };
        self.plane.direction(i).dot(&(moved - carried))
    }

    /// What the second derivative in time of a row holds beside `A a`: of the height (row 0)
    /// `D²g[v, v] = R_c/c³ (n·ȧ)²`, of the slip along `e_i` (row `i + 1`)
    /// `e·(ω × Dρ ȧ) − e·Ω n × (φ̇ + Dρ ȧ)`; of the directors, their rates and the rate of the
    /// centre.
    fn acceleration_of(
        &self,
        row: usize,
        [triad, rates]: [&Matrix3<T>; 2],
        velocity: &Vector3<T>,
    ) -> T {
        let (axis, turning) = (self.axis_of(triad), self.axis_of(rates));
        let contact = self.contact(axis);
        let Some(i) = row.checked_sub(1) else {
            let (c, part) = (contact.cosine(), contact.normal.dot(&turning));
            return contact.circle / (c * c * c) * part * part;
        };
        let spin = |k: usize| triad.column(k).cross(&rates.column(k));
        let omega = (spin(0) + spin(1) + spin(2)) * T::of(0.5);
        let moved = contact.change(&turning);
        let carried = contact.normal.cross(&(velocity + moved)) * self.plane.spin;
        self.plane.direction(i).dot(&(omega.cross(&moved) - carried))
    }

    /// The same at a configuration with a velocity.
    pub(crate) fn acceleration_at(&self, row: usize, [q, v]: [&[f64]; 2]) -> T {
        let triad = |x: &[f64]| directors::triad(frame_of(x, self.frame)).map(T::of);
        self.acceleration_of(row, [&triad(q), &triad(v)], &self.center(v))
    }

    /// The mean of the axes at both ends, over its length, and the length.
    fn mean_axis(&self, s: &Interval) -> (Vector3<T>, T) {
        let sum = self.axis_at(&s.q0) + self.axis_at(&s.q1);
        let length = sum.norm();
        match Number::real(length) == 0.0 {
            true => (sum, T::of(1.0)),
            false => (sum / length, length),
        }
    }

    /// `θ`: the rotation vector of the body in a step; not a number where it is half a turn.
    fn turned(&self, s: &Interval) -> Vector3<f64> {
        let theta = self.rotation_vector(s);
        if theta.norm() > LARGEST_TURN { Vector3::repeat(f64::NAN) } else { theta }
    }

    /// The angle by which the body turns in a step, rad, at most π.
    #[must_use]
    pub fn turn(&self, s: &Interval) -> f64 {
        self.rotation_vector(s).norm()
    }

    fn rotation_vector(&self, s: &Interval) -> Vector3<f64> {
        let (start, end) = (frame_of(&s.q0, self.frame), frame_of(&s.q1, self.frame));
        let sine = directors::angular_velocity(start, frame_of(&s.dq, self.frame));
        RotationVector::of_change(sine, start, end).theta
    }
}

impl Rolling {
    /// Numbers that do not change.
    fn still(&self) -> Rolling<Dual64> {
        let RolledPlane { origin, axes, spin } = &self.plane;
        Rolling {
            frame: self.frame,
            axis: self.axis.map(|axis| axis.map(Dual64::of)),
            circle: Dual64::of(self.circle),
            section: Dual64::of(self.section),
            plane: RolledPlane {
                origin: origin.map(Dual64::of),
                axes: axes.map(Dual64::of),
                spin: Dual64::of(*spin),
            },
        }
    }

    /// `out ← out + scale ∂/∂q` of the same, shape `n`.
    pub(crate) fn add_acceleration_slope(
        &self,
        row: usize,
        [q, v]: [&[f64]; 2],
        scale: f64,
        out: &mut [f64],
    ) {
        let own = self.still();
        let of = |x: &[f64]| directors::triad(frame_of(x, self.frame)).map(Dual64::of);
        let (mut triad, rates, velocity) = (of(q), of(v), own.center(v));
        let first = FRAME * self.frame + 3;
        for k in 0..9 {
            triad[k].eps = 1.0;
            out[first + k] += scale * own.acceleration_of(row, [&triad, &rates], &velocity).eps;
            triad[k].eps = 0.0;
        }
    }

    /// The point of contact at `q`, m.
    #[must_use]
    pub fn contact_point(&self, q: &[f64]) -> Vector3<f64> {
        self.center(q) + self.contact(self.axis_at(q)).rho
    }

    /// `|n·a|` at `q`: 0 of an upright wheel.
    #[must_use]
    pub fn flatness(&self, q: &[f64]) -> f64 {
        self.plane.normal().dot(&self.axis_at(q)).abs()
    }

    /// The velocity of the wheel relative to the plane at their point of contact, along `e_1` and
    /// `e_2`, m/s.
    #[must_use]
    pub fn slip(&self, q: &[f64], v: &[f64]) -> [f64; 2] {
        let (own, rates) = (frame_of(q, self.frame), frame_of(v, self.frame));
        let rho = self.contact(self.axis_at(q)).rho;
        let omega = directors::angular_velocity(own, rates);
        let moved = directors::center(rates) + omega.cross(&rho);
        let carried = self.carried(&(directors::center(own) + rho));
        [0, 1].map(|i| self.plane.direction(i).dot(&(moved - carried)))
    }

    /// The gradient of the height, as wrenches.
    pub(crate) fn for_each_wrench_of_height(&self, q: &[f64], mut visit: impl FnMut(usize, Twist)) {
        let torque = self.axis_at(q).cross(&self.slope(q));
        visit(self.frame, Twist::new(self.plane.normal(), torque));
    }

    /// Emits the gradient of the height.
    pub(crate) fn emit_height(&self, q: &[f64], row: usize, out: &mut dyn Entries) {
        self.for_each_slope_of_height(q, |i, slope| out.add(row, i, slope));
    }

    /// `R_c/c³`, the second derivative of the height by `n·a`.
    fn bend(&self, q: &[f64]) -> f64 {
        let along = self.plane.normal().dot(&self.axis_at(q));
        let square = 1.0 - along * along;
        self.circle / (square * square.sqrt())
    }

    /// `D²g[v, w]` of the height.
    pub(crate) fn second_of_height(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64 {
        let part = |v: &[f64]| self.plane.normal().dot(&self.axis_at(v));
        if self.axis.is_none() { 0.0 } else { self.bend(q) * part(v) * part(w) }
    }

    /// Emits `scale D²g` of the height.
    pub(crate) fn emit_second_of_height(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        let Some(axis) = self.axis else { return };
        let (first, normal) = (FRAME * self.frame + 3, self.plane.normal());
        let square = normal * normal.transpose() * (scale * self.bend(q));
        for i in 0..3 {
            for j in 0..3 {
                out.add_block(first + 3 * i, first + 3 * j, &(axis[i] * axis[j] * square));
            }
        }
    }
}

/// The largest rotation of a rolling body in a step, rad.
pub const LARGEST_TURN: f64 = 3.0;

/// The part of the slip along `e_i`.
#[derive(Clone, Debug)]
pub struct Slip {
    /// What rolls.
    pub rolling: Arc<Rolling>,
    /// `i`: 0 or 1.
    pub direction: usize,
}

impl Slip {
    fn direction(&self) -> Vector3<f64> {
        self.rolling.plane.direction(self.direction)
    }

    /// `e_i × n Ω`: what `e_i·Ω n × x` is linear in.
    fn turning(&self) -> Vector3<f64> {
        let plane = &self.rolling.plane;
        plane.spin * self.direction().cross(&plane.normal())
    }

    fn wrench(&self, q: &[f64]) -> Twist {
        let [force, torque] = self.rolling.row_of_slip(q, self.direction);
        Twist::new(force, torque)
    }
}

impl VelocityConstraint for Slip {
    fn for_each_wrench(&self, q: &[f64], visit: &mut WrenchVisitor<'_>) {
        visit(self.rolling.frame, self.wrench(q));
    }

    fn emit(&self, q: &[f64], row: usize, scale: f64, out: &mut dyn Entries) {
        emit_wrench(q, self.rolling.frame, row, scale, &self.wrench(q), out);
    }

    fn second(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64 {
        let Rolling { frame, .. } = *self.rolling;
        let contact = self.rolling.contact(self.rolling.axis_at(q));
        let change = contact.change(&self.rolling.axis_at(v));
        let [own, rates, others] = [q, v, w].map(|x| frame_of(x, frame));
        let torque = contact.rho.cross(&self.direction());
        change.cross(&self.direction()).dot(&directors::angular_velocity(own, others))
            + torque.dot(&directors::angular_velocity(rates, others))
    }

    fn emit_second(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        let (own, first) = (frame_of(q, self.rolling.frame), FRAME * self.rolling.frame + 3);
        let contact = self.rolling.contact(self.rolling.axis_at(q));
        let (e, torque) = (self.direction(), contact.rho.cross(&self.direction()));
        let axis = self.rolling.axis.unwrap_or_default();
        for i in 0..3 {
            let director = directors::director(own, i);
            for j in 0..3 {
                let block = Matrix3::from_columns(&[0, 1, 2].map(|k| {
                    let unit = Vector3::ith(k, 1.0);
                    let turned = axis[j] * contact.change(&unit).cross(&e);
                    let own = if i == j { torque.cross(&unit) } else { Vector3::zeros() };
                    0.5 * scale * (turned.cross(&director) + own)
                }));
                out.add_block(first + 3 * i, first + 3 * j, &block);
            }
        }
    }

    fn rate(&self, at: Configuration<'_>) -> f64 {
        self.rolling.rate_of_slip(at.q, self.direction)
    }

    fn rate_change(&self, at: Motion<'_>) -> f64 {
        let contact = self.rolling.contact(self.rolling.axis_at(at.q));
        let moved = self.rolling.center(at.v) + contact.change(&self.rolling.axis_at(at.v));
        self.turning().dot(&moved)
    }

    fn emit_rate_slope(
        &self,
        at: Configuration<'_>,
        row: usize,
        scale: f64,
        out: &mut dyn Entries,
    ) {
        let (first, y) = (FRAME * self.rolling.frame, self.turning());
        let contact = self.rolling.contact(self.rolling.axis_at(at.q));
        let of_axis = contact.transposed(&y);
        (0..3).for_each(|k| out.add(row, first + k, scale * y[k]));
        let axis = self.rolling.axis.unwrap_or_default();
        for i in 0..3 {
            (0..3).for_each(|k| out.add(row, first + 3 + 3 * i + k, scale * axis[i] * of_axis[k]));
        }
    }

    fn is_driven(&self) -> bool {
        self.rolling.plane.spin != 0.0
    }

    fn residual(&self, s: &Interval) -> f64 {
        self.rolling.slip_of_step(s, self.direction)
    }

    fn add_acceleration_slope(&self, at: Motion<'_>, scale: f64, out: &mut [f64]) -> bool {
        self.rolling.add_acceleration_slope(self.direction + 1, [at.q, at.v], scale, out);
        true
    }

    /// A plane turns steadily: `−δh e·Ω n × (φ_{n+1/2} + ρ(ā) − o)`.
    fn step_change(&self, s: &Interval, change: StepChange) -> Option<f64> {
        let rolling = &*self.rolling;
        let rho = rolling.contact(rolling.mean_axis(s).0).rho;
        let carried = rolling.carried(&(rolling.center(&s.q_mid) + rho));
        Some(-change.length * self.direction().dot(&carried))
    }

    fn for_each_wrench_of_step(&self, s: &Interval, visit: &mut WrenchVisitor<'_>) {
        let (rolling, e) = (&*self.rolling, self.direction());
        let (axis, length) = rolling.mean_axis(s);
        let contact = rolling.contact(axis);
        let theta = rolling.turned(s);
        let spin = s.h * self.turning();
        // δθ·(ρ × e),  δθ = T⁻¹ δω,  T⁻ᵀ y = y + ½ θ × y + κ θ × (θ × y)
        let y = contact.rho.cross(&e);
        let across = theta.cross(&y);
        let mut torque = y + 0.5 * across + kappa(theta.norm_squared()) * theta.cross(&across);
        // δρ·(e × θ − h Ω e × n),  δā = (1 − ā āᵀ) δω × a_{n+1} / |a_n + a_{n+1}|
        let of_axis = contact.transposed(&(e.cross(&theta) - spin));
        let of_end = (of_axis - axis * axis.dot(&of_axis)) / length;
        torque += rolling.axis_at(&s.q1).cross(&of_end);
        visit(rolling.frame, Twist::new(e - 0.5 * spin, torque));
    }
}

#[cfg(test)]
mod tests;
