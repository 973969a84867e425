//! Spheres and capsules: the distance of two segments, less the radii.
//!
//! ```text
//! x_A(s) = a + s e_A,  x_B(t) = b + t e_B,  s, t ∈ [0, 1],   g = |x_B − x_A| − R_A − R_B
//! ```
//! The closest pair is the interior solution or one of the four of an end and a segment (C.
//! Ericson, Real-Time Collision Detection, 2005, §5.1.9); of equal distances the first in the
//! order of A's and B's ends. Nearly parallel capsules touch at both ends of their overlap:
//! feature 1 is the other end; elsewhere it is far away.

use super::ContactShape;
use super::contact_point::{ContactPoint, in_space};
use nalgebra::Vector3;
use vi_core::Number;

/// Of a pair of capsules.
pub(super) const FEATURES: u32 = 2;
/// `sin²` of the angle between axes that count as parallel.
const PARALLEL: f64 = 1e-12;

/// A segment in space with its radius.
#[derive(Clone, Copy, Debug)]
struct Segment<T> {
    start: Vector3<T>,
    along: Vector3<T>,
    radius: T,
}

impl<T: Number> Segment<T> {
    fn new((shape, frame): (&ContactShape, &[T])) -> Self {
        let ContactShape::Capsule { ends, radius } = shape else {
            unreachable!("a pair of capsules")
        };
        let [start, end] = ends.map(|end| in_space(frame, &end));
        Self { start, along: end - start, radius: T::of(*radius) }
    }

    fn at(&self, s: T) -> Vector3<T> {
        self.start + self.along * s
    }

    /// The parameter of the point next to `x`.
    fn nearest(&self, x: &Vector3<T>) -> T {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let square = self.along.norm_squared();
        if square > zero {
            ((x - self.start).dot(&self.along) / square).clamp(zero, one)
        } else {
            zero
        }
    }
}

/// The contact of a feature of two capsules, in the frames of A and B.
#[must_use]
pub(super) fn contact<T: Number>(
    feature: u32,
    a: (&ContactShape, &[T]),
    b: (&ContactShape, &[T]),
) -> ContactPoint<T> {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let (a, b) = (Segment::new(a), Segment::new(b));
    let (d, r) = (b.start - a.start, a.radius + b.radius);
    let (aa, bb, ab) = (a.along.norm_squared(), b.along.norm_squared(), a.along.dot(&b.along));
    let determinant = aa * bb - ab * ab;
    let ends = [
        (zero, b.nearest(&a.start)),
        (one, b.nearest(&a.at(one))),
        (a.nearest(&b.start), zero),
        (a.nearest(&b.at(one)), one),
    ];
    let between = |(s, t): (T, T)| b.at(t) - a.at(s);
    let place = if aa > zero && bb > zero && determinant <= T::of(PARALLEL) * aa * bb {
        overlap(&ends, &between)[feature as usize]
    } else if feature > 0 {
        None
    } else {
        let (da, db) = (d.dot(&a.along), d.dot(&b.along));
        let inside = ((da * bb - db * ab) / determinant, (da * ab - db * aa) / determinant);
        let interior = determinant > zero
            && (zero..=one).contains(&inside.0)
            && (zero..=one).contains(&inside.1);
        let closest = ends.into_iter().fold(ends[0], |best, end| {
            if between(end).norm_squared() < between(best).norm_squared() { end } else { best }
        });
        Some(if interior { inside } else { closest })
    };
    let far = place.is_none();
    let (s, t) = place.unwrap_or(ends[0]);
    let apart = between((s, t));
    let distance = apart.norm();
    // centres in one point have no normal: the gap is that of a full overlap along the first axis
    let normal = if distance > zero { apart / distance } else { Vector3::x() };
    let gap = if far { T::of(f64::MAX) } else { distance - r };
    let (x_a, x_b) = (a.at(s) + normal * a.radius, b.at(t) - normal * b.radius);
    ContactPoint { gap, normal, point: (x_a + x_b) * T::of(0.5) }
}

/// The two ends of the overlap of parallel segments, the nearer one first; one where they do not
/// overlap.
fn overlap<T: Number>(
    ends: &[(T, T); 4],
    between: &impl Fn((T, T)) -> Vector3<T>,
) -> [Option<(T, T)>; 2] {
    let size = |place: (T, T)| Number::real(between(place).norm_squared());
    let first =
        ends.iter().fold(ends[0], |best, end| if size(*end) < size(best) { *end } else { best });
    // the other end of the overlap: farthest from the first one, at the same distance
    let same = |place: &&(T, T)| size(**place).sqrt() <= size(first).sqrt() * (1.0 + 1e-6);
    let apart = |a: T, b: T| (Number::real(a) - Number::real(b)).abs();
    let from_first = |place: &(T, T)| apart(place.0, first.0) + apart(place.1, first.1);
    let other = ends
        .iter()
        .filter(same)
        .fold(first, |best, end| if from_first(end) > from_first(&best) { *end } else { best });
    [Some(first), (from_first(&other) > 0.0).then_some(other)]
}
