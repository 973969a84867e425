//! Joint coordinates as functions of the configuration, with their revolutions.
//!
//! ```text
//! length   u = a·r                    a: an axis of the parent, r: the gap
//! angle    θ = atan2(s, c),  s = m_1'·m_2,  c = m_1'·m_1        about n, from m_1 to m_1'
//! ∇θ = (c ∇s − s ∇c)/(s² + c²)
//! ```
//! `s`, `c`, `u` are products of linear forms, so every derivative is exact. `atan2` gives an angle up to
//! whole revolutions; these follow from the angles of the last node, [`Configuration::angles`], where the
//! mechanism lists the coordinate ([`crate::Mechanism::coordinate`]).

use crate::geometry::form::Row;
use crate::pair::joint::Joint;
use crate::pair::{DegreeOfFreedom, Twist};
use std::f64::consts::TAU;
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::sparse::Entries;

/// A joint coordinate: a length (m) or an angle (rad).
#[derive(Clone, Debug)]
pub struct JointCoordinate {
    value: Value,
    slot: usize, // among the unwrapped angles
}

/// An angle as a principal value and whole revolutions; a length and zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unwrapped {
    /// `θ − 2πk` in `[−π, π]`, rad.
    pub principal: f64,
    /// `k`.
    pub revolutions: f64,
}

/// A coordinate over an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Mean of both ends.
    pub mean: f64,
    /// End less start.
    pub difference: f64,
}

/// Of an angle that is not listed: its principal value is meant.
const UNLISTED: usize = usize::MAX;

/// What a joint coordinate is a function of: products of linear forms of `q`.
#[derive(Clone, Debug)]
pub enum Value {
    /// `u`.
    Length(Row),
    /// `θ = atan2(s, c)`.
    Angle {
        /// `s`.
        sine: Row,
        /// `c`.
        cosine: Row,
    },
}

impl JointCoordinate {
    /// Coordinate `freedom` of a joint, an angle by its principal value, in `[−π, π]`; `None` for pairs whose
    /// degrees of freedom are no such coordinates (spherical, free) and for degrees of freedom that do not exist.
    #[must_use]
    pub fn principal(joint: &Joint, freedom: usize) -> Option<Self> {
        Self::of(joint, *joint.kind.properties().dof.get(freedom)?)
    }

    /// The coordinate of a degree of freedom that the joint, or a pair with the same axes, has.
    pub(crate) fn of(joint: &Joint, freedom: DegreeOfFreedom) -> Option<Self> {
        // axis of the child times axis of the parent
        let product =
            |[i, j]: [usize; 2]| Row::product(joint.child.axis(i), joint.parent.axis(j), 0.0);
        let value = match freedom {
            DegreeOfFreedom::Length(i) => {
                Value::Length(Row::product(joint.parent.axis(i), joint.gap(), 0.0))
            }
            DegreeOfFreedom::Angle { sine, cosine } => {
                Value::Angle { sine: product(sine), cosine: product(cosine) }
            }
            DegreeOfFreedom::Position | DegreeOfFreedom::Rotation => return None,
        };
        Some(Self { value, slot: UNLISTED })
    }

    /// Lists the angle, if it is one: appended to `angles`.
    pub(crate) fn list(&mut self, angles: &mut Vec<Self>) {
        if self.is_angle() {
            self.slot = angles.len();
            angles.push(self.clone());
        }
    }

    /// What it is made of.
    #[must_use]
    pub fn value(&self) -> &Value {
        &self.value
    }

    /// Whether it is an angle.
    #[must_use]
    pub fn is_angle(&self) -> bool {
        matches!(self.value, Value::Angle { .. })
    }

    /// The coordinate; a listed angle with its revolutions.
    #[must_use]
    pub fn at(&self, at: Configuration<'_>) -> f64 {
        let Unwrapped { principal, revolutions } = self.unwrapped(at);
        principal + TAU * revolutions
    }

    /// `θ − 2πk` in `[−π, π]` and the number `k` of whole revolutions; a length and zero.
    ///
    /// After many revolutions the sum is only accurate to `ε|θ|`; what is compared with `θ` subtracts the
    /// revolutions first.
    #[must_use]
    pub fn unwrapped(&self, at: Configuration<'_>) -> Unwrapped {
        match &self.value {
            Value::Length(row) => Unwrapped { principal: row.value(at.q), revolutions: 0.0 },
            Value::Angle { sine, cosine } => {
                let principal = libm::atan2(sine.value(at.q), cosine.value(at.q));
                Unwrapped { principal, revolutions: at.revolutions(self.slot, principal) }
            }
        }
    }

    /// Mean of both ends of an interval, and their difference; an angle changes by less than `π`.
    #[must_use]
    pub fn change(&self, s: &Interval) -> Change {
        let Unwrapped { principal: start, revolutions } = self.unwrapped(s.start());
        let mut difference = self.unwrapped(s.end()).principal - start;
        if self.is_angle() {
            difference -= TAU * (difference / TAU).round();
        }
        Change { mean: start + TAU * revolutions + 0.5 * difference, difference }
    }

    /// The rows it is made of, with the factors of their gradients at `q`.
    fn parts(&self, q: &[f64]) -> [(f64, Option<&Row>); 2] {
        match &self.value {
            Value::Length(row) => [(1.0, Some(row)), (0.0, None)],
            Value::Angle { sine, cosine } => {
                let (s, c) = (sine.value(q), cosine.value(q));
                let square = s * s + c * c;
                [(c / square, Some(sine)), (-s / square, Some(cosine))]
            }
        }
    }

    /// `out ← out + scale ∇θ(q)`.
    pub fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        self.for_each_slope(q, |i, slope| out[i] += scale * slope);
    }

    /// Emits `scale ∇θ(q)` as row `row`.
    pub fn emit(&self, q: &[f64], row: usize, scale: f64, out: &mut dyn Entries) {
        self.for_each_slope(q, |i, slope| out.add(row, i, scale * slope));
    }

    /// Emits `scale ∇θ(q_0) ∇θ(q_1)ᵀ`.
    pub fn emit_product(&self, q0: &[f64], q1: &[f64], scale: f64, out: &mut dyn Entries) {
        self.for_each_slope(q0, |i, left| {
            self.for_each_slope(q1, |j, right| out.add(i, j, scale * left * right));
        });
    }

    /// The entries of `∇θ(q)`, always in the same order; a coordinate may come several times.
    pub fn for_each_slope(&self, q: &[f64], mut visit: impl FnMut(usize, f64)) {
        for (factor, row) in self.parts(q) {
            if let Some(row) = row {
                row.for_each_slope(q, |i, slope| visit(i, factor * slope));
            }
        }
    }

    /// The gradient as wrenches on the frames.
    pub fn for_each_wrench(&self, q: &[f64], mut visit: impl FnMut(usize, Twist)) {
        for (factor, row) in self.parts(q) {
            if let Some(row) = row {
                row.for_each_wrench(q, |frame, w| {
                    visit(frame, Twist::new(factor * w.linear, factor * w.angular));
                });
            }
        }
    }

    /// `∇θ·v`.
    #[must_use]
    pub fn rate(&self, q: &[f64], v: &[f64]) -> f64 {
        let mut rate = 0.0;
        self.for_each_slope(q, |i, slope| rate += slope * v[i]);
        rate
    }

    /// `D²θ(q)[v, w]`.
    #[must_use]
    pub fn second(&self, q: &[f64], v: &[f64], w: &[f64]) -> f64 {
        match &self.value {
            Value::Length(row) => row.second(v, w),
            Value::Angle { sine, cosine } => {
                let (s, c) = (sine.value(q), cosine.value(q));
                let slope = |row: &Row, v: &[f64]| {
                    let mut sum = 0.0;
                    row.for_each_slope(q, |i, slope| sum += slope * v[i]);
                    sum
                };
                let (sv, sw, cv, cw) =
                    (slope(sine, v), slope(sine, w), slope(cosine, v), slope(cosine, w));
                let square = s * s + c * c;
                let bend =
                    -2.0 * s * c * (sv * sw - cv * cw) + (s * s - c * c) * (sv * cw + cv * sw);
                bend / (square * square)
                    + (c * sine.second(v, w) - s * cosine.second(v, w)) / square
            }
        }
    }

    /// Emits `scale D²θ(q)`; always the same places in the same order.
    pub fn emit_second(&self, q: &[f64], scale: f64, out: &mut dyn Entries) {
        match &self.value {
            Value::Length(row) => row.emit_second(scale, out),
            Value::Angle { sine, cosine } => {
                let (s, c) = (sine.value(q), cosine.value(q));
                let square = s * s + c * c;
                let same = -2.0 * s * c / (square * square);
                let mixed = (s * s - c * c) / (square * square);
                let pairs = [
                    (sine, sine, same),
                    (cosine, cosine, -same),
                    (sine, cosine, mixed),
                    (cosine, sine, mixed),
                ];
                for (left, right, factor) in pairs {
                    left.for_each_slope(q, |i, a| {
                        right.for_each_slope(q, |j, b| out.add(i, j, scale * factor * a * b));
                    });
                }
                sine.emit_second(scale * c / square, out);
                cosine.emit_second(-scale * s / square, out);
            }
        }
    }
}
