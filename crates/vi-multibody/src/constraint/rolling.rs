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
use vi_core::interval::Interval;
use vi_core::sparse::Entries;
use vi_core::{Configuration, Motion};
use vi_rigid::directors::{self, FRAME};
use vi_rigid::rotation::kappa;

/// Flattest wheel: largest `|n·a|`.
pub const FLATTEST: f64 = 0.99;

/// A plane of the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// `o`, m.
    pub origin: Vector3<f64>,
    /// `e_1`, `e_2`, `n`, orthonormal.
    pub axes: Matrix3<f64>,
    /// `Ω`, rad/s.
    pub spin: f64,
}

impl Plane {
    /// `n`.
    #[must_use]
    pub fn normal(&self) -> Vector3<f64> {
        self.axes.column(2).into()
    }

    fn direction(&self, i: usize) -> Vector3<f64> {
        self.axes.column(i).into()
    }
}

/// A wheel or a sphere on a plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Rolling {
    /// Its body.
    pub frame: usize,
    /// `a`, components along the directors of the body, a unit vector; `None`: a sphere.
    pub axis: Option<Vector3<f64>>,
    /// `R_c`, m; 0 of a sphere.
    pub circle: f64,
    /// `b`, m; the radius of a sphere.
    pub section: f64,
    /// What it rolls on.
    pub plane: Plane,
}

/// `ρ` and what its derivative is made of.
struct Contact {
    rho: Vector3<f64>,
    axis: Vector3<f64>,   // a; 0 of a sphere
    across: Vector3<f64>, // w = n − (n·a) a
    along: f64,           // n·a
    circle: f64,
    normal: Vector3<f64>,
}

impl Contact {
    /// `Dρ(a) δ` for `|a| = 1`.
    fn change(&self, delta: &Vector3<f64>) -> Vector3<f64> {
        if self.circle == 0.0 {
            return Vector3::zeros();
        }
        let c = self.cosine();
        let part = self.normal.dot(delta);
        let across = -part * self.axis - self.along * delta;
        let cosine = -self.along * part / c;
        -self.circle * (across / c - self.across * (cosine / (c * c)))
    }

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

    fn cosine(&self) -> f64 {
        (1.0 - self.along * self.along).sqrt()
    }
}

impl Rolling {
    /// `a` at `q`, or its rate at `v`; zero of a sphere.
    fn axis_at(&self, q: &[f64]) -> Vector3<f64> {
        let own = frame_of(q, self.frame);
        self.axis.map_or_else(Vector3::zeros, |axis| directors::triad(own) * axis)
    }

    fn center(&self, q: &[f64]) -> Vector3<f64> {
        directors::center(frame_of(q, self.frame))
    }

    fn contact(&self, axis: Vector3<f64>) -> Contact {
        let normal = self.plane.normal();
        let along = normal.dot(&axis);
        let across = normal - along * axis;
        let mut contact = Contact {
            rho: -self.section * normal,
            axis,
            across,
            along,
            circle: if self.axis.is_some() { self.circle } else { 0.0 },
            normal,
        };
        if contact.circle != 0.0 {
            contact.rho -= across * (contact.circle / contact.cosine());
        }
        contact
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

    /// The height of the lowest point above the plane, m.
    #[must_use]
    pub fn height(&self, q: &[f64]) -> f64 {
        let above = self.plane.normal().dot(&(self.center(q) - self.plane.origin)) - self.section;
        match self.axis {
            None => above,
            Some(_) => {
                let along = self.plane.normal().dot(&self.axis_at(q));
                above - self.circle * (1.0 - along * along).sqrt()
            }
        }
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

    /// The velocity of the plane at a point.
    fn carried(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.plane.spin * self.plane.normal().cross(&(point - self.plane.origin))
    }

    /// `s/c` with `s = n·a`, and `n`: of the gradient of the height by the axis, `R_c s/c n`.
    fn slope(&self, q: &[f64]) -> Vector3<f64> {
        let normal = self.plane.normal();
        let along = normal.dot(&self.axis_at(q));
        normal * (self.circle * along / (1.0 - along * along).sqrt())
    }

    /// The gradient of the height, as wrenches.
    pub(crate) fn for_each_wrench_of_height(&self, q: &[f64], mut visit: impl FnMut(usize, Twist)) {
        let torque = self.axis_at(q).cross(&self.slope(q));
        visit(self.frame, Twist::new(self.plane.normal(), torque));
    }

    /// Emits the gradient of the height.
    pub(crate) fn emit_height(&self, q: &[f64], row: usize, out: &mut dyn Entries) {
        let (first, normal, slope) = (FRAME * self.frame, self.plane.normal(), self.slope(q));
        (0..3).for_each(|k| out.add(row, first + k, normal[k]));
        let Some(axis) = self.axis else { return };
        for i in 0..3 {
            (0..3).for_each(|k| out.add(row, first + 3 + 3 * i + k, axis[i] * slope[k]));
        }
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
        let rho = self.rolling.contact(self.rolling.axis_at(q)).rho;
        Twist::new(self.direction(), rho.cross(&self.direction()))
    }
}

/// The mean of the axes at both ends, over its length, and the length.
fn mean_axis(rolling: &Rolling, s: &Interval) -> (Vector3<f64>, f64) {
    let sum = rolling.axis_at(&s.q0) + rolling.axis_at(&s.q1);
    let length = sum.norm();
    if length == 0.0 { (sum, 1.0) } else { (sum / length, length) }
}

impl VelocityConstraint for Slip {
    fn for_each_wrench(&self, q: &[f64], visit: &mut WrenchVisitor<'_>) {
        visit(self.rolling.frame, self.wrench(q));
    }

    fn emit(&self, q: &[f64], row: usize, scale: f64, out: &mut dyn Entries) {
        emit_wrench((q, self.rolling.frame), (row, scale), &self.wrench(q), out);
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
        self.direction().dot(&self.rolling.carried(&self.rolling.contact_point(at.q)))
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
        let rolling = &*self.rolling;
        let rho = rolling.contact(mean_axis(rolling, s).0).rho;
        let moved = rolling.center(&s.dq) + rolling.turned(s).cross(&rho);
        let carried = match self.is_driven() {
            true => {
                s.h * rolling.carried(&(rolling.center(&s.q0) + 0.5 * rolling.center(&s.dq) + rho))
            }
            false => Vector3::zeros(),
        };
        self.direction().dot(&(moved - carried))
    }

    fn for_each_wrench_of_step(&self, s: &Interval, visit: &mut WrenchVisitor<'_>) {
        let (rolling, e) = (&*self.rolling, self.direction());
        let (axis, length) = mean_axis(rolling, s);
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
