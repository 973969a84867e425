//! Closest points of a rim with a line, a point and another rim.
//!
//! A rim is the circle `x(φ) = c + R e(φ)` about the axis `a`; its tangent is `t = a × e`. Seen
//! along a line with the unit vector `ℓ`, it is an ellipse and the line is a point `z`:
//! ```text
//! v ∝ ℓ − (ℓ·a) a,  u = a × v,  w = ℓ × u,  k = v·w,    x − c = R (cos φ, k sin φ) along u, w
//! f(φ) = −R (1 − k²) sin φ cos φ + z_u sin φ − k z_w cos φ = 0                     closest points
//! ```
//! Each half of the rim, `sin φ ≥ 0` and `sin φ ≤ 0`, has at most one point at which the distance
//! is least within the half; it is in the quadrant of the sign of `z_u`, between two numbers where
//! `f` has opposite signs (D. Eberly, Distance from a point to an ellipse, 2013). Two rims: the
//! distance of a point of the first one from the second is a function of one angle,
//! ```text
//! D'(φ) = R_1 (x_1 − x_2)·t_1,   D''(φ) = F_11 − F_12²/F_22                x_2 next to x_1(φ)
//! F_11 = R_1² − R_1 (x_1 − x_2)·e_1,  F_22 = R_2² − R_2 (x_2 − x_1)·e_2,  F_12 = −R_1 R_2 t_1·t_2
//! ```
//! with several minima: each between two places with opposite signs of `D'`. Such places are some
//! around the rim, and those where the cubic through `D'` and `D''` at two of them is largest or
//! smallest. Newton's method between bounds ends at rounding errors.

use super::solids::perpendicular;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A circle in space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rim {
    pub(super) center: Vector3<f64>,
    /// The outward unit axis.
    pub(super) axis: Vector3<f64>,
    pub(super) radius: f64,
}

/// A line in space with its unit vector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) point: Vector3<f64>,
    pub(super) along: Vector3<f64>,
}

impl Line {
    /// The point next to another one.
    pub(super) fn nearest(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.point + self.along * self.along.dot(&(x - self.point))
    }
}

/// A point of a rim, and the closest one of a line or of another rim.
#[derive(Clone, Copy, Debug)]
pub(super) struct Closest {
    pub(super) on_rim: Vector3<f64>,
    pub(super) on_other: Vector3<f64>,
    /// Whether the distance is least there.
    pub(super) is_least: bool,
}

impl Closest {
    fn exchanged(self) -> Self {
        Self { on_rim: self.on_other, on_other: self.on_rim, ..self }
    }

    pub(super) fn distance(&self) -> f64 {
        (self.on_other - self.on_rim).norm()
    }
}

/// Sine of the angle between a vector and the axis of a rim below which it is along the axis.
const ALONG_AXIS: f64 = 1e-14;
/// Places of the smaller rim between which minima are looked for.
const PLACES: u32 = 24;
/// Most minima of two rims.
const MINIMA: usize = 8;

impl Rim {
    /// A distance that none of its points is nearer to a part of a line than.
    pub(super) fn at_least(&self, line: &Line, half: f64) -> f64 {
        let place = line.along.dot(&(self.center - line.point)).clamp(-half, half);
        (line.point + line.along * place - self.center).norm() - self.radius
    }

    /// The unit vector from the axis to a point; any one across it on the axis.
    pub(super) fn outward(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.across(&(x - self.center)).0
    }

    /// The direction of a vector across the axis, and its length; any direction along the axis.
    fn across(&self, v: &Vector3<f64>) -> (Vector3<f64>, f64) {
        let Self { axis, .. } = self;
        let across = v - axis * v.dot(axis);
        let size = across.norm();
        if size <= ALONG_AXIS * v.norm() {
            return (perpendicular(axis), size);
        }
        let along = across / size; // has a part along the axis by rounding where it is short
        ((along - axis * along.dot(axis)).normalize(), size)
    }

    /// The point next to another one.
    pub(super) fn nearest(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.center + self.outward(x) * self.radius
    }

    /// `k`: the cosine of the angle between a line and the axis, but for its sign.
    pub(super) fn steepness(&self, line: &Line) -> f64 {
        self.axis.dot(&line.along).abs()
    }

    /// The closest points with a line of both halves of the rim, that of `sin φ ≥ 0` first.
    pub(super) fn on_line(&self, line: &Line) -> [Closest; 2] {
        let Self { axis, radius, .. } = self;
        let (v, sine) = self.across(&line.along);
        let u = axis.cross(&v);
        let w = line.along.cross(&u);
        let (k, z) = (v.dot(&w), line.point - self.center);
        let (z_u, z_w) = (z.dot(&u), z.dot(&w));
        [1.0, -1.0].map(|side| {
            let found = in_quadrant(*radius, sine * sine, z_u.abs(), side * k * z_w);
            let (sin, cos) = found.map_or((0.0, 1.0), libm::sincos);
            let on_rim = self.center + (u * cos.copysign(z_u) + v * (side * sin)) * *radius;
            Closest { on_rim, on_other: line.nearest(&on_rim), is_least: found.is_some() }
        })
    }

    /// The minima of the distance to another rim, at most 8.
    pub(super) fn on_rim(&self, other: &Self) -> ([Closest; MINIMA], usize) {
        if self.radius > other.radius {
            let (found, count) = other.on_rim(self);
            return (found.map(Closest::exchanged), count);
        }
        let first = perpendicular(&self.axis);
        let second = self.axis.cross(&first);
        let at = |angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            let (e, t) = (first * cos + second * sin, second * cos - first * sin);
            let x = self.center + e * self.radius;
            let others = other.outward(&x);
            (x, other.center + others * other.radius, [e, t, others])
        };
        let slope = |angle: f64| {
            let (x, y, [e, t, others]) = at(angle);
            let (d, r, s) = (x - y, self.radius, other.radius);
            let both = r * s * t.dot(&other.axis.cross(&others));
            let second = r * r - r * d.dot(&e) - both * both / (s * s + s * d.dot(&others));
            (r * d.dot(&t), second)
        };
        let none = Closest { on_rim: at(0.0).0, on_other: at(0.0).1, is_least: false };
        let (mut found, mut count) = ([none; MINIMA], 0);
        let mut take = |from: f64, to: f64| {
            if count < MINIMA {
                let (on_rim, on_other, ..) = at(root(slope, [from, to], 0.5 * (from + to)));
                found[count] = Closest { on_rim, on_other, is_least: true };
                count += 1;
            }
        };
        let width = TAU / f64::from(PLACES);
        let mut before = slope(0.0);
        for k in 0..PLACES {
            let from = width * f64::from(k);
            let after = slope(from + width);
            let (mut last, mut value) = (from, before.0);
            for part in extremes([before.0, after.0], [before.1, after.1].map(|s| s * width)) {
                let to = from + part * width;
                let next = if part < 1.0 { slope(to).0 } else { after.0 };
                if value < 0.0 && next >= 0.0 {
                    take(last, to);
                }
                (last, value) = (to, next);
            }
            before = after;
        }
        (found, count)
    }
}

/// Where in `(0, 1)` the cubic with these values and slopes at both ends is largest and smallest,
/// in ascending order, then 1.
fn extremes([a, b]: [f64; 2], [da, db]: [f64; 2]) -> impl Iterator<Item = f64> {
    // a + da x + c x² + d x³
    let (c, d) = (3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db);
    let root = (c * c - 3.0 * d * da).sqrt(); // NaN of a cubic that rises or falls
    let sum = -(c + root.copysign(c));
    let [one, other] = [sum / (3.0 * d), da / sum];
    let both = if one < other { [one, other] } else { [other, one] };
    both.into_iter().filter(|x| *x > 0.0 && *x < 1.0).chain([1.0])
}

/// The angle in `[0, π/2]` at which the distance is least within a half of the rim; `None` where
/// that is at an end of the half. `z_u ≥ 0`; `square`: `1 − k²`; `turned`: `k z_w`, of the half.
fn in_quadrant(radius: f64, square: f64, z_u: f64, turned: f64) -> Option<f64> {
    let size = radius * square;
    if turned > 0.0 {
        let f = |angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            let value = (z_u - size * cos) * sin - turned * cos;
            (value, z_u * cos - size * (cos * cos - sin * sin) + turned * sin)
        };
        return Some(root(f, [0.0, FRAC_PI_2], libm::atan2(turned, z_u)));
    }
    // f/sin φ, least at sin³ φ = −k z_w/(R (1 − k²))
    let f = |angle: f64| {
        let (sin, cos) = libm::sincos(angle);
        let steep = if turned < 0.0 { turned / sin } else { 0.0 };
        let slope = if turned < 0.0 { steep / sin } else { 0.0 };
        (z_u - size * cos - steep * cos, size * sin + slope)
    };
    let least = libm::cbrt(-turned / size);
    if size <= 0.0 || least >= 1.0 {
        return None;
    }
    let least = libm::asin(least);
    (f(least).0 < 0.0).then(|| root(f, [least, FRAC_PI_2], 0.5 * (least + FRAC_PI_2)))
}

/// The root of a function that is negative at the first bound and not negative at the second one;
/// `f`: its value and its slope.
fn root(f: impl Fn(f64) -> (f64, f64), [mut low, mut high]: [f64; 2], start: f64) -> f64 {
    const MOST: usize = 100;
    const SMALL: f64 = 1e-6;
    let (mut x, mut last) = (start, f64::INFINITY);
    for _ in 0..MOST {
        let (value, slope) = f(x);
        if value < 0.0 {
            low = x;
        } else if value > 0.0 {
            high = x;
        } else {
            return x;
        }
        let to = x - value / slope;
        let is_newton = slope > 0.0 && to > low && to < high;
        let next = if is_newton { to } else { 0.5 * (low + high) };
        let step = (next - x).abs();
        let is_rounding = is_newton && step < SMALL && step >= 0.5 * last;
        if is_rounding || step <= 4.0 * f64::EPSILON * x.abs() {
            return next; // steps that do not shrink any more are rounding
        }
        (x, last) = (next, if is_newton { step } else { f64::INFINITY });
    }
    x
}
