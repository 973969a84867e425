//! Spheres and capsules: the distance of two segments, less the radii.
//!
//! ```text
//! x_A(s) = a + s e_A,  x_B(t) = b + t e_B,  s, t ∈ [0, 1],   g = |x_B − x_A| − R_A − R_B
//! ```
//! The closest pair, feature 0, is the interior solution or one of the four of an end and a segment
//! (C. Ericson, Real-Time Collision Detection, 2005, §5.1.9); of equal distances the first in the
//! order of A's and B's ends; of parallel segments the middle of their overlap. Features 1 to 4 are
//! those four: they count where the capsules are nearly parallel, `|e_A × e_B| < 0.1`, and the end
//! lies beside the other segment. Where `|e_A × e_B| < 0.03` the closest pair may jump along them
//! within a step: a point that is fixed on A takes its place, of those that divide A into equal
//! parts, where it is closer than the ends.

use super::ContactShape;
use super::contact_point::{ContactPoint, in_space};
use nalgebra::Vector3;
use vi_core::{Embed, Number};

/// Of a pair of capsules.
pub(super) const FEATURES: u32 = FIRST_PART + PARTS + 1;
/// The first point that is fixed on A.
const FIRST_PART: u32 = 5;
const PARTS: u32 = 1024;
/// `sin²` of the angle between axes that count as parallel.
const PARALLEL: f64 = 1e-12;
/// Sine of the angle between axes below which the ends count.
const NEARLY: f64 = 0.1;
/// The same below which the closest point is one that is fixed on A.
const FIXED: f64 = 0.03;
/// Distances that are the same, in parts of the radii.
const SAME: f64 = 1e-11;

/// A segment in space with its radius.
#[derive(Clone, Copy, Debug)]
struct Segment<T> {
    start: Vector3<T>,
    along: Vector3<T>,
    radius: T,
}

impl<T: Number> Segment<T> {
    fn new<S: Embed<T>>((shape, frame): (&ContactShape<S>, &[T])) -> Self {
        let ContactShape::Capsule { ends, radius } = shape else {
            unreachable!("a pair of capsules")
        };
        let [start, end] = ends.map(|end| in_space(frame, &end));
        Self { start, along: end - start, radius: radius.embed() }
    }

    fn at(&self, s: T) -> Vector3<T> {
        self.start + self.along * s
    }

    /// The parameter of the foot of the perpendicular from `x` to its line; 0 of a point.
    fn foot(&self, x: &Vector3<T>) -> T {
        let square = self.along.norm_squared();
        if square > T::of(0.0) { (x - self.start).dot(&self.along) / square } else { T::of(0.0) }
    }

    /// The parameter of the point next to `x`.
    fn nearest(&self, x: &Vector3<T>) -> T {
        self.foot(x).clamp(T::of(0.0), T::of(1.0))
    }
}

/// The features that count, in ascending order, in the frames of A and B.
pub(super) fn active(
    a: (&ContactShape, &[f64]),
    b: (&ContactShape, &[f64]),
) -> impl Iterator<Item = u32> {
    let (a, b): (Segment<f64>, Segment<f64>) = (Segment::new(a), Segment::new(b));
    let lengths = a.along.norm() * b.along.norm();
    let angle = a.along.cross(&b.along).norm() / lengths; // NaN of a ball
    let mut found = [None; 1 + FIRST_PART as usize];
    found[0] = (angle.is_nan() || angle >= FIXED).then_some(0);
    if angle < NEARLY {
        let beside = feet(&a, &b).map(|foot| (0.0..=1.0).contains(&foot));
        for (k, own) in (1..).zip(&mut found[1..]).take(beside.len()) {
            *own = beside[k as usize - 1].then_some(k);
        }
        if angle < FIXED {
            let apart = |(s, t): (f64, f64)| (b.at(t) - a.at(s)).norm();
            let known = ends(&a, &b).into_iter().zip(beside).filter(|(_, beside)| *beside);
            let known = known.map(|(end, _)| apart(end)).fold(f64::INFINITY, f64::min);
            let (s, t) = closest(&a, &b);
            let is_closer = apart((s, t)) < known - SAME * (a.radius + b.radius);
            let part = FIRST_PART + (s * f64::from(PARTS)).round() as u32;
            found[FIRST_PART as usize] = is_closer.then_some(part);
        }
    }
    found.into_iter().flatten()
}

/// The contact of a feature of two capsules, in the frames of A and B.
#[must_use]
pub(super) fn contact<S: Embed<T>, T: Number>(
    feature: u32,
    a: (&ContactShape<S>, &[T]),
    b: (&ContactShape<S>, &[T]),
) -> ContactPoint<T> {
    let (a, b) = (Segment::new(a), Segment::new(b));
    let (s, t) = match feature {
        0 => closest(&a, &b),
        FIRST_PART.. => {
            let s = T::of(f64::from(feature - FIRST_PART) / f64::from(PARTS));
            (s, b.nearest(&a.at(s)))
        }
        end => ends(&a, &b)[end as usize - 1],
    };
    let apart = b.at(t) - a.at(s);
    let r = a.radius + b.radius;
    let distance = apart.norm();
    // centres in one point have no normal: the gap is that of a full overlap along the first axis
    let normal = if distance > T::of(0.0) { apart / distance } else { Vector3::x() };
    let (x_a, x_b) = (a.at(s) + normal * a.radius, b.at(t) - normal * b.radius);
    ContactPoint { gap: distance - r, normal, point: (x_a + x_b) * T::of(0.5) }
}

/// Feet of the perpendiculars from the ends of A on B, then from those of B on A.
fn feet<T: Number>(a: &Segment<T>, b: &Segment<T>) -> [T; 4] {
    let one = T::of(1.0);
    [b.foot(&a.start), b.foot(&a.at(one)), a.foot(&b.start), a.foot(&b.at(one))]
}

/// The pairs of an end and the point next to it on the other segment.
fn ends<T: Number>(a: &Segment<T>, b: &Segment<T>) -> [(T, T); 4] {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let [first, last, start, end] = feet(a, b).map(|foot| foot.clamp(zero, one));
    [(zero, first), (one, last), (start, zero), (end, one)]
}

/// The parameters of the closest points.
fn closest<T: Number>(a: &Segment<T>, b: &Segment<T>) -> (T, T) {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let d = b.start - a.start;
    let (aa, bb, ab) = (a.along.norm_squared(), b.along.norm_squared(), a.along.dot(&b.along));
    let determinant = aa * bb - ab * ab;
    let ends = ends(a, b);
    let between = |(s, t): (T, T)| b.at(t) - a.at(s);
    if aa > zero && bb > zero && determinant <= T::of(PARALLEL) * aa * bb {
        return overlap(&ends, &between);
    }
    let (da, db) = (d.dot(&a.along), d.dot(&b.along));
    let inside = ((da * bb - db * ab) / determinant, (da * ab - db * aa) / determinant);
    let interior =
        determinant > zero && (zero..=one).contains(&inside.0) && (zero..=one).contains(&inside.1);
    let closest = ends.into_iter().fold(ends[0], |best, end| {
        if between(end).norm_squared() < between(best).norm_squared() { end } else { best }
    });
    if interior { inside } else { closest }
}

/// The middle of the overlap of parallel segments, or their ends that are next to each other.
fn overlap<T: Number>(ends: &[(T, T); 4], between: &impl Fn((T, T)) -> Vector3<T>) -> (T, T) {
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
    let half = T::of(0.5);
    ((first.0 + other.0) * half, (first.1 + other.1) * half)
}
