//! The acceleration of a joint coordinate at a node, with its derivatives.
//!
//! ```text
//! ṡ = ∇s·v,   s̈ = D²s[v, v] + ∇s·a         of s and of c, the products of forms that it is made of
//! ü = s̈                                     of a length
//! θ̇ = (c ṡ − s ċ)/r²,   θ̈ = ((c s̈ − s c̈) − 2 (s ṡ + c ċ) θ̇)/r²,   r² = s² + c²       of an angle
//! ∂ÿ/∂q = y_s ∇s + y_ṡ D²s v + y_s̈ D²s a,   ∂ÿ/∂v = y_ṡ ∇s + 2 y_s̈ D²s v,   ∂ÿ/∂a = y_s̈ ∇s,   and of c
//! ```
//! `y_s`, …: the derivatives by the six numbers, by dual numbers of the one formula.

use super::MovedCoordinate;
use crate::constraint::joint_coordinate::{JointCoordinate, Value};
use crate::geometry::form::BilinearRow;
use vi_core::Number;
use vi_core::num_dual::Dual64;

/// The acceleration of a joint coordinate, m/s² or rad/s².
#[derive(Clone, Debug)]
pub struct CoordinateAcceleration {
    value: Value,
}

/// `θ̈` of `(s, ṡ, s̈)` and `(c, ċ, c̈)`.
fn of_angle<T: Number>([s, s1, s2]: [T; 3], [c, c1, c2]: [T; 3]) -> T {
    let square = s * s + c * c;
    let rate = (c * s1 - s * c1) / square;
    (c * s2 - s * c2 - T::of(2.0) * (s * s1 + c * c1) * rate) / square
}

/// `(s, ṡ, s̈)` of a product of forms.
fn motion<T: Number>(row: &BilinearRow<T>, [q, v, a]: [&[f64]; 3]) -> [T; 3] {
    let (mut rate, mut second) = (T::of(0.0), row.second(v, v));
    row.for_each_slope(q, |i, slope| {
        rate += slope * T::of(v[i]);
        second += slope * T::of(a[i]);
    });
    [row.value(q), rate, second]
}

impl CoordinateAcceleration {
    /// Of a coordinate.
    #[must_use]
    pub fn of(coordinate: &JointCoordinate) -> Self {
        Self { value: coordinate.value().clone() }
    }

    /// The rows it is made of, with the derivatives by the numbers of each.
    fn parts(&self, at: [&[f64]; 3]) -> Vec<(&BilinearRow, [f64; 3])> {
        match &self.value {
            Value::Length(row) => vec![(row, [0.0, 0.0, 1.0])],
            Value::Angle { sine, cosine } => {
                let own = [motion(sine, at), motion(cosine, at)];
                let by = |part: usize, k: usize| {
                    let mut dual = own.map(|own| own.map(Dual64::from_re));
                    dual[part][k].eps = 1.0;
                    of_angle(dual[0], dual[1]).eps
                };
                let by = |part: usize| [0, 1, 2].map(|k| by(part, k));
                vec![(sine, by(0)), (cosine, by(1))]
            }
        }
    }

    /// The acceleration; `at`: `q`, `v`, `a`, shape `n` each.
    #[must_use]
    pub fn value(&self, at: [&[f64]; 3]) -> f64 {
        match &self.value {
            Value::Length(row) => motion(row, at)[2],
            Value::Angle { sine, cosine } => of_angle(motion(sine, at), motion(cosine, at)),
        }
    }

    /// Adds `scale` times its derivatives by `q`, `v`, `a`, shape `n` each.
    pub fn add_slopes(&self, at: [&[f64]; 3], scale: f64, [of_q, of_v, of_a]: [&mut [f64]; 3]) {
        let [q, v, a] = at;
        for (row, [value, rate, second]) in self.parts(at) {
            row.for_each_slope(q, |i, slope| {
                of_q[i] += scale * value * slope;
                of_v[i] += scale * rate * slope;
                of_a[i] += scale * second * slope;
            });
            row.for_each_bend(v, |i, bend| {
                of_q[i] += scale * rate * bend;
                of_v[i] += scale * 2.0 * second * bend;
            });
            row.for_each_bend(a, |i, bend| of_q[i] += scale * second * bend);
        }
    }

    /// How it changes with a parameter that changes the joint so.
    #[must_use]
    pub fn by_parameter(&self, moved: &MovedCoordinate, at: [&[f64]; 3]) -> f64 {
        match &moved.value {
            Value::Length(row) => motion(row, at)[2].eps,
            Value::Angle { sine, cosine } => of_angle(motion(sine, at), motion(cosine, at)).eps,
        }
    }
}
