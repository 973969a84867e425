//! Nodes along a curve: centres, triads, element lengths.
//!
//! ```text
//! d_3 = r'/|r'| at the nodes,   ℓ = ∫ |r'| over the element (arc length, not the chord)
//! normal given:         d_1 = the part of the normal across d_3, normalized
//! rotation-minimizing:  d_1 transported without rotation about d_3 (double reflection)
//! d_2 = d_3 × d_1
//! ```
//! A corner is not a curve: each leg of a polyline is a mesh of its own, joined by a fixed joint
//! between two coincident nodes ([`crate::model::BeamModel::add_frame_work`]).
//!
//! Source: double reflection after Wang, Jüttler, Zheng & Liu, ACM Trans. Graph. 27 (2008) no. 2.

use crate::small::{re, times};
use nalgebra::{Matrix3, Vector3};
use vi_core::Number;
use vi_multibody::mechanism::BodySpec;

/// How the triads rotate about the centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrameRule<T = f64> {
    /// `d_1` lies in the plane of the tangent and this vector.
    Normal(
        /// A vector that is nowhere parallel to the curve.
        Vector3<T>,
    ),
    /// As [`FrameRule::Normal`] at the first node, then without rotation about the tangent.
    RotationMinimizing(
        /// A vector that is not parallel to the curve at its start.
        Vector3<T>,
    ),
}

/// A curve no mesh can follow.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CurveError {
    /// No elements, or too few points.
    #[error("a beam needs at least one element")]
    NoElements,
    /// A point or length is not finite, or an element has no length.
    #[error("element {element} of the beam has no length, or a point that is not finite")]
    Degenerate {
        /// Which element of the mesh.
        element: usize,
    },
    /// The normal is parallel to the tangent.
    #[error("the normal of the beam's frames is parallel to the centre line at node {node}")]
    NormalAlongTangent {
        /// Which node of the mesh.
        node: usize,
    },
}

/// Nodes and element lengths along one smooth beam; of numbers with tangents as they change with a
/// parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamMesh<T = f64> {
    /// `φ` at the nodes, m.
    pub centers: Vec<Vector3<T>>,
    /// Columns `d_1, d_2, d_3` at the nodes.
    pub triads: Vec<Matrix3<T>>,
    /// `ℓ` of the elements, m; one less than nodes.
    pub lengths: Vec<T>,
}

impl BeamMesh {
    /// Its nodes `NAME.0`, `NAME.1`, …, at rest and without mass of their own.
    #[must_use]
    pub fn nodes(&self, name: &str) -> Vec<BodySpec> {
        let node = |(k, (center, triad)): (usize, (&Vector3<f64>, &Matrix3<f64>))| BodySpec {
            name: format!("{name}.{k}"),
            body: None,
            center: *center,
            triad: *triad,
            velocity: Vector3::zeros(),
            omega: Vector3::zeros(),
        };
        self.centers.iter().zip(&self.triads).enumerate().map(node).collect()
    }

    /// The curve `r(t)`, `t` = `from … to`, nodes at equal steps of `t`; its tangent by
    /// differences.
    ///
    /// # Errors
    /// [`CurveError`].
    pub fn parametric(
        curve: &dyn Fn(f64) -> Vector3<f64>,
        from: f64,
        to: f64,
        elements: usize,
        rule: FrameRule,
    ) -> Result<Self, CurveError> {
        let step = 1e-3 * (to - from) / elements.max(1) as f64;
        let tangent = |t: f64| {
            let centered = |k: f64| (curve(t + k * step) - curve(t - k * step)) / (2.0 * k * step);
            (4.0 * centered(1.0) - centered(2.0)) / 3.0
        };
        Self::along(curve, &tangent, from, to, elements, rule)
    }
}

/// The sum of numbers, from the first on.
fn sum<T: Number>(all: impl Iterator<Item = T>) -> T {
    all.fold(T::of(0.0), |sum, own| sum + own)
}

impl<T: Number> BeamMesh<T> {
    /// A straight beam.
    ///
    /// # Errors
    /// [`CurveError`].
    pub fn straight(
        from: Vector3<T>,
        to: Vector3<T>,
        elements: usize,
        rule: FrameRule<T>,
    ) -> Result<Self, CurveError> {
        let tangent = to - from;
        let ends = [0.0, 1.0].map(T::of);
        Self::along(&|t| from + tangent * t, &|_| tangent, ends[0], ends[1], elements, rule)
    }

    /// Straight legs between the corners, each with its own number of elements.
    ///
    /// # Errors
    /// [`CurveError`]; [`CurveError::NoElements`] when the numbers do not fit.
    pub fn polyline(
        corners: &[Vector3<T>],
        elements: &[usize],
        rule: FrameRule<T>,
    ) -> Result<Vec<Self>, CurveError> {
        if corners.len() < 2 || corners.len() != elements.len() + 1 {
            return Err(CurveError::NoElements);
        }
        let legs = corners.windows(2).zip(elements);
        legs.map(|(ends, &count)| Self::straight(ends[0], ends[1], count, rule)).collect()
    }

    /// A circular arc `center + R(cos ψ e_1 + sin ψ e_2)` for `ψ` from 0 to `angle` (rad), with
    /// `radius_vector = R e_1` and the unit `axis = e_1 × e_2`.
    ///
    /// # Errors
    /// [`CurveError`].
    pub fn arc(
        center: Vector3<T>,
        radius_vector: Vector3<T>,
        axis: Vector3<T>,
        angle: T,
        elements: usize,
        rule: FrameRule<T>,
    ) -> Result<Self, CurveError> {
        Self::helix(center, radius_vector, axis, angle, T::of(0.0), elements, rule)
    }

    /// A helix: the arc with the rise `pitch` (m) along the unit `axis` for each revolution.
    ///
    /// # Errors
    /// [`CurveError`].
    pub fn helix(
        center: Vector3<T>,
        radius_vector: Vector3<T>,
        axis: Vector3<T>,
        angle: T,
        pitch: T,
        elements: usize,
        rule: FrameRule<T>,
    ) -> Result<Self, CurveError> {
        let (a, b) = (radius_vector, axis.cross(&radius_vector));
        let rise = axis * (pitch / T::of(std::f64::consts::TAU));
        let sign = re(angle).signum();
        let point = |t: T| {
            let [sin, cos] = t.sine_cosine();
            center + a * cos + b * sin + rise * t
        };
        let slope = |t: T| {
            let [sin, cos] = t.sine_cosine();
            times(sign, &(b * cos - a * sin + rise))
        };
        let mut mesh = Self::along(&point, &slope, T::of(0.0), angle, elements, rule)?;
        let speed = (a.norm_squared() + rise.norm_squared()).sqrt();
        // constant speed: exact
        mesh.lengths.fill(speed * (T::of(sign) * angle) / T::of(elements as f64));
        Ok(mesh)
    }

    /// The curve `r(t)` with its derivative `r'(t)`, `t` = `from … to`, nodes at equal steps of
    /// `t`.
    ///
    /// # Errors
    /// [`CurveError`].
    pub fn along(
        curve: &dyn Fn(T) -> Vector3<T>,
        derivative: &dyn Fn(T) -> Vector3<T>,
        from: T,
        to: T,
        elements: usize,
        rule: FrameRule<T>,
    ) -> Result<Self, CurveError> {
        let step = (to - from) / T::of(elements as f64);
        let at = |k: usize| from + T::of(k as f64) * step;
        let centers = (0..=elements).map(|k| curve(at(k))).collect();
        let tangents: Vec<_> = (0..=elements).map(|k| derivative(at(k))).collect();
        let lengths = (0..elements).map(|k| arc_length(derivative, at(k), at(k + 1))).collect();
        Self::new(centers, &tangents, lengths, rule)
    }

    /// A smooth curve through given points: cubics between them with the tangents of
    /// [`BeamMesh::through`], nodes at equal steps of the sum of the chords.
    ///
    /// # Errors
    /// [`CurveError`].
    pub fn spline(
        points: &[Vector3<T>],
        elements: usize,
        rule: FrameRule<T>,
    ) -> Result<Self, CurveError> {
        let (lengths, tangents) = chords(points)?;
        let mut stations = vec![T::of(0.0)]; // sum of the chords at the points
        lengths.iter().for_each(|length| stations.push(stations[stations.len() - 1] + *length));
        let interval = |s: T| {
            let before = stations.partition_point(|at| re(*at) <= re(s));
            let k = before.clamp(1, lengths.len()) - 1;
            (k, (s - stations[k]) / lengths[k])
        };
        let [one, two, three, six] = [1.0, 2.0, 3.0, 6.0].map(T::of);
        // Hermite's polynomials on the interval, and their slopes
        let curve = |s: T| {
            let (k, t) = interval(s);
            let (a, b, l) = (points[k], points[k + 1], lengths[k]);
            let r = one - t;
            a * (r * r * (one + two * t))
                + b * (t * t * (three - two * t))
                + (tangents[k] * r - tangents[k + 1] * t) * (l * t * r)
        };
        let slope = |s: T| {
            let (k, t) = interval(s);
            (points[k + 1] - points[k]) * (six * t * (one - t) / lengths[k])
                + tangents[k] * ((one - t) * (one - three * t))
                + tangents[k + 1] * (t * (three * t - two))
        };
        Self::along(&curve, &slope, T::of(0.0), stations[lengths.len()], elements, rule)
    }

    /// Nodes at given points; chords as lengths, tangents from the parabola through three points.
    ///
    /// # Errors
    /// [`CurveError`].
    pub fn through(points: &[Vector3<T>], rule: FrameRule<T>) -> Result<Self, CurveError> {
        let (lengths, tangents) = chords(points)?;
        Self::new(points.to_vec(), &tangents, lengths, rule)
    }

    /// From nodes, tangents (any length) and element lengths.
    ///
    /// # Errors
    /// [`CurveError`].
    pub fn new(
        centers: Vec<Vector3<T>>,
        tangents: &[Vector3<T>],
        lengths: Vec<T>,
        rule: FrameRule<T>,
    ) -> Result<Self, CurveError> {
        if lengths.is_empty() {
            return Err(CurveError::NoElements);
        }
        for (element, length) in lengths.iter().enumerate() {
            let chord = re((centers[element + 1] - centers[element]).norm());
            let length = re(*length);
            let regular = chord > 0.0 && chord.is_finite() && length > 0.0 && length.is_finite();
            if !regular {
                return Err(CurveError::Degenerate { element });
            }
        }
        let tangents: Vec<_> = tangents.iter().map(|t| t.normalize()).collect();
        let across = |node: usize, normal: &Vector3<T>| {
            let d3 = tangents[node];
            let part = normal - d3 * d3.dot(normal);
            let size = part.norm();
            if re(size) > 1e-8 * re(normal.norm()) {
                Ok(part / size)
            } else {
                Err(CurveError::NormalAlongTangent { node })
            }
        };
        let (FrameRule::Normal(normal) | FrameRule::RotationMinimizing(normal)) = rule;
        let mut d1 = across(0, &normal)?;
        let mut triads = Vec::with_capacity(centers.len());
        for node in 0..centers.len() {
            if node > 0 {
                let transmitted = match rule {
                    FrameRule::Normal(normal) => normal,
                    FrameRule::RotationMinimizing(_) => {
                        let chord = centers[node] - centers[node - 1];
                        double_reflection(&d1, &chord, &tangents[node - 1], &tangents[node])
                    }
                };
                d1 = across(node, &transmitted)?;
            }
            let d3 = tangents[node];
            triads.push(Matrix3::from_columns(&[d1, d3.cross(&d1), d3]));
        }
        Ok(Self { centers, triads, lengths })
    }

    /// Number of elements.
    #[must_use]
    pub fn elements(&self) -> usize {
        self.lengths.len()
    }

    /// The sum of the lengths of its elements, m.
    #[must_use]
    pub fn length(&self) -> T {
        sum(self.lengths.iter().copied())
    }
}

/// Lengths of the chords between points, and the tangents of the parabolas through three of them.
fn chords<T: Number>(points: &[Vector3<T>]) -> Result<(Vec<T>, Vec<Vector3<T>>), CurveError> {
    if points.len() < 2 {
        return Err(CurveError::NoElements);
    }
    let chords: Vec<_> = points.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let lengths: Vec<T> = chords.iter().map(Vector3::norm).collect();
    let wrong = |l: &T| !(re(*l) > 0.0 && re(*l).is_finite());
    if let Some(element) = lengths.iter().position(wrong) {
        return Err(CurveError::Degenerate { element });
    }
    let slope = |k: usize| chords[k] / lengths[k];
    let last = chords.len() - 1;
    let inner = |k: usize| {
        let (a, b) = (lengths[k - 1], lengths[k]);
        (slope(k - 1) * b + slope(k) * a) / (a + b)
    };
    let tangent = |k: usize| match k {
        _ if last == 0 => slope(0),
        0 => times(2.0, &slope(0)) - inner(1),
        k if k == last + 1 => times(2.0, &slope(last)) - inner(last),
        k => inner(k),
    };
    let tangents = (0..points.len()).map(tangent).collect();
    Ok((lengths, tangents))
}

/// Transports `d` from the tangent `t` to the tangent `next` over a chord.
fn double_reflection<T: Number>(
    d: &Vector3<T>,
    chord: &Vector3<T>,
    t: &Vector3<T>,
    next: &Vector3<T>,
) -> Vector3<T> {
    let reflect = |x: &Vector3<T>, v: &Vector3<T>| {
        let square = v.norm_squared();
        if re(square) > 0.0 { x - v * (T::of(2.0) * v.dot(x) / square) } else { *x }
    };
    let (d, t) = (reflect(d, chord), reflect(t, chord));
    reflect(&d, &(next - t))
}

/// `∫ |r'| dt` by Gauss's rule with five points on four parts.
fn arc_length<T: Number>(derivative: &dyn Fn(T) -> Vector3<T>, from: T, to: T) -> T {
    const NODES: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let half = (to - from) / T::of(8.0);
    let part = |k: usize| {
        let middle = from + T::of((2 * k + 1) as f64) * half;
        let term = |(x, w): (f64, f64)| T::of(w) * derivative(middle + half * T::of(x)).norm();
        sum(NODES.into_iter().map(term)) * half.abs()
    };
    sum((0..4).map(part))
}

#[cfg(test)]
mod tests;
