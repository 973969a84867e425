//! Gaps between shapes on two frames, and the rows of a contact.
//!
//! A shape stands in the components of its frame; that of the ground is [`GROUND`]. A pair of
//! shapes has features, each with one pair of closest points `x_A`, `x_B` and a gap that is smooth
//! as long as the feature is named:
//! ```text
//! g = n·(x_B − x_A),   n from A to B,   x_c = ½ (x_A + x_B)
//! B_d = s (d, ϱ_1 d, ϱ_2 d, ϱ_3 d),   d ∈ {n, t_1, t_2},  ϱ_I = (x_c − φ)·d_I,  s = −1 (A), +1 (B)      [N1]
//! ```
//! `B_n` is the gradient of `g`. Both bodies take the opposite wrenches of a force at one point
//! `x_c`: momentum and angular momentum are conserved also where the gap is open.
//!
//! | pair | file | features |
//! |---|---|---|
//! | points with a radius (sphere, capsule, corners of a box) – plane | [`points_plane`] | a point |
//! | ellipsoid – plane | [`ellipsoid_plane`] | one |
//! | sphere – sphere, sphere – capsule, capsule – capsule | [`segments`] | one; of parallel capsules also their ends |
//! | points with a radius – capsule | [`segments`] | a point |
//! | box – plane | [`points_plane`] | a corner |
//! | cylinder – plane | [`cylinder_plane`] | a point of a rim |
//! | points with a radius, sphere – box, cylinder | `solids` | a point |
//! | points – box, cylinder | `points_solid` | a point and a face |
//! | box – box | `box_box` | a corner and a face, or two edges |
//! | cylinder – box, capsule, cylinder; capsule – box | `outline_pairs` | two of their faces, rims, lines, points |
//!
//! Closed forms without iteration, but for the closest points of rims. [`ShapePair::active`] names
//! the features that may touch. The gap of a pair does not depend on which shape is named first.

pub mod cylinder_plane;
pub mod ellipsoid_plane;
pub mod points_plane;
pub mod segments;

mod box_box;
mod contact_point;
mod deepest;
mod outline;
mod outline_active;
mod outline_pairs;
mod pair;
mod points_solid;
mod rim;
mod shape;
mod solids;

pub use contact_point::{ContactPoint, GROUND, displacement, row, tangents};
pub use pair::{NoGap, ShapePair};
pub use shape::ContactShape;

use contact_point::{in_space, turned};
use nalgebra::Vector3;
use outline::{OutlineShape, ShapeOutline};
use solids::Solid;
use vi_core::{Embed, Number};

/// Whether there is a formula for two shapes; they may have no features yet, as points without any.
#[must_use]
pub fn has_gap(a: &ContactShape, b: &ContactShape) -> bool {
    one_way(a, b).or(one_way(b, a)).is_some()
}

/// Whether every feature of two shapes has a gap that is smooth, and counts as long as it is
/// negative: no edge that could meet an edge, no rim that stands.
#[must_use]
pub fn is_smooth(a: &ContactShape, b: &ContactShape) -> bool {
    use ContactShape::{Box, Cylinder, Plane, Points};
    let edged = outlined(a, b).is_some()
        || match (a, b) {
            (Plane { .. }, Cylinder { .. }) | (Cylinder { .. }, Plane { .. }) => true,
            (Box { .. }, Box { .. }) => true,
            (Box { .. } | Cylinder { .. }, Points { radius, .. })
            | (Points { radius, .. }, Box { .. } | Cylinder { .. }) => *radius == 0.0,
            _ => false,
        };
    has_gap(a, b) && !edged
}

/// How many features two shapes have; 0 where there is no formula for them.
#[must_use]
pub fn features(a: &ContactShape, b: &ContactShape) -> u32 {
    one_way(a, b).or(one_way(b, a)).unwrap_or(0)
}

/// The same in this order of the shapes; `None` where there is no formula.
fn one_way<S: Number>(a: &ContactShape<S>, b: &ContactShape<S>) -> Option<u32> {
    use ContactShape::{Box, Capsule, Cylinder, Ellipsoid, Plane, Points};
    let is_ball = |ends: &[Vector3<S>; 2]| ends[0] == ends[1];
    let count = match (a, b) {
        (Plane { .. } | Capsule { .. }, Points { points, .. }) => points.len() as u32,
        (Plane { .. }, Capsule { ends, .. }) => {
            if is_ball(ends) {
                1
            } else {
                2
            }
        }
        (Plane { .. }, Ellipsoid { .. }) => 1,
        (Plane { .. }, Box { .. }) => 8,
        (Plane { .. }, Cylinder { .. }) => cylinder_plane::FEATURES,
        (Capsule { ends: a, .. }, Capsule { ends: b, .. }) => {
            if is_ball(a) || is_ball(b) {
                1
            } else {
                segments::FEATURES
            }
        }
        (Box { .. } | Cylinder { .. }, Points { points, radius }) => {
            points.len() as u32 * if Number::real(*radius) == 0.0 { faces(a)? } else { 1 }
        }
        (Box { .. } | Cylinder { .. }, Capsule { ends, radius })
            if is_ball(ends) && Number::real(*radius) > 0.0 =>
        {
            1
        }
        (Box { .. }, Box { .. }) => box_box::FEATURES,
        _ => {
            let (kinds, is_exchanged) = outlined(a, b)?;
            return (!is_exchanged).then(|| outline_pairs::count(kinds[0], kinds[1]));
        }
    };
    Some(count)
}

/// How many faces a box or a cylinder has.
fn faces<S>(of: &ContactShape<S>) -> Option<u32> {
    match of {
        ContactShape::Box { .. } => Some(solids::FACES),
        ContactShape::Cylinder { .. } => Some(solids::FACES_OF_CYLINDER),
        _ => None,
    }
}

/// The kinds of two shapes that touch with faces, rims, lines and points, cylinders before capsules
/// before boxes, and whether that is not their order.
fn outlined<S: Number>(
    a: &ContactShape<S>,
    b: &ContactShape<S>,
) -> Option<([OutlineShape; 2], bool)> {
    let (a, b) = (OutlineShape::of(a)?, OutlineShape::of(b)?);
    let is_other = a == b && a != OutlineShape::Cylinder; // two boxes, two capsules
    (!is_other).then(|| if a <= b { ([a, b], false) } else { ([b, a], true) })
}

/// Such shapes in space, in that order.
fn outlines(
    a: &ContactShape,
    frame_a: &[f64],
    b: &ContactShape,
    frame_b: &[f64],
) -> Option<([ShapeOutline; 2], bool)> {
    let (_, is_exchanged) = outlined(a, b)?;
    let (a, b) = (ShapeOutline::in_space(a, frame_a)?, ShapeOutline::in_space(b, frame_b)?);
    Some(if is_exchanged { ([b, a], true) } else { ([a, b], false) })
}

/// The contact of a feature of two shapes, each with its frame.
///
/// # Panics
/// Where they have no [`features`].
#[must_use]
pub fn contact(
    feature: u32,
    (a, frame_a): (&ContactShape, &[f64]),
    (b, frame_b): (&ContactShape, &[f64]),
) -> ContactPoint {
    if let (Some(a), Some(b)) = (a.place(frame_a), b.place(frame_b)) {
        return box_box::contact(feature, &a, &b);
    }
    if let Some(([a, b], is_exchanged)) = outlines(a, frame_a, b, frame_b) {
        let found = outline_pairs::contact(feature, &a, &b).expect("a feature of the pair");
        return if is_exchanged { found.exchanged() } else { found };
    }
    smooth_contact(feature, a, frame_a, b, frame_b)
}

/// How far two shapes in their frames are apart, m: of shapes that overlap the smallest gap of
/// their features, negative; `None` where they have none.
///
/// Of boxes, cylinders and capsules this is the distance, and of those that overlap the least way
/// to part them.
#[must_use]
pub fn smallest_gap(
    (a, frame_a): (&ContactShape, &[f64]),
    (b, frame_b): (&ContactShape, &[f64]),
) -> Option<f64> {
    use ContactShape::{Box, Cylinder, Points};
    let of_points =
        |of: &ContactShape, frame: &[f64], (points, other): (&[Vector3<f64>], &[f64])| {
            let solid = Solid::in_space(of, frame)?;
            let gaps = points.iter().map(|point| solid.contact(&in_space(other, point), 0.0).gap);
            gaps.min_by(f64::total_cmp)
        };
    match (a, b) {
        (Box { .. }, Box { .. }) => {
            let [a, b] =
                [(a, frame_a), (b, frame_b)].map(|(own, at)| ShapeOutline::in_space(own, at));
            Some(outline_active::separation(&a?, &b?))
        }
        (Box { .. } | Cylinder { .. }, Points { points, radius }) if *radius == 0.0 => {
            of_points(a, frame_a, (points, frame_b))
        }
        (Points { points, radius }, Box { .. } | Cylinder { .. }) if *radius == 0.0 => {
            of_points(b, frame_b, (points, frame_a))
        }
        _ => match outlines(a, frame_a, b, frame_b) {
            Some(([a, b], _)) => Some(outline_active::separation(&a, &b)),
            None => {
                let gap = |feature| contact(feature, (a, frame_a), (b, frame_b)).gap;
                lasting(a, b).map(gap).min_by(f64::total_cmp)
            }
        },
    }
}

/// The same for any number type, of all pairs of shapes without edges that meet edges.
///
/// # Panics
/// Where they have no [`features`], and of two boxes, and of cylinders, capsules and boxes.
#[must_use]
pub fn smooth_contact<S: Embed<T>, T: Number>(
    feature: u32,
    a: &ContactShape<S>,
    frame_a: &[T],
    b: &ContactShape<S>,
    frame_b: &[T],
) -> ContactPoint<T> {
    match one_way(a, b) {
        None => between(feature, b, frame_b, a, frame_a).map(ContactPoint::exchanged),
        Some(_) => between(feature, a, frame_a, b, frame_b),
    }
    .expect("a pair of shapes with a gap")
}

fn between<S: Embed<T>, T: Number>(
    feature: u32,
    a: &ContactShape<S>,
    frame_a: &[T],
    b: &ContactShape<S>,
    frame_b: &[T],
) -> Option<ContactPoint<T>> {
    use ContactShape::{Box, Capsule, Cylinder, Ellipsoid, Plane, Points};
    let index = feature as usize;
    match (a, b) {
        (Plane { point, normal }, _) => {
            let plane = points_plane::Plane::in_space(point, normal, frame_a);
            match b {
                Points { points, radius } => {
                    Some(points_plane::contact(&plane, &points[index], *radius, frame_b))
                }
                Capsule { ends, radius } => {
                    Some(points_plane::contact(&plane, &ends[index], *radius, frame_b))
                }
                Ellipsoid { center, axes, half_axes } => {
                    Some(ellipsoid_plane::contact(&plane, (center, axes, half_axes), frame_b))
                }
                Box { .. } => {
                    Some(plane.contact_with(&box_box::corner(&b.place(frame_b)?, feature)))
                }
                Cylinder { ends, radius } => {
                    Some(cylinder_plane::contact(feature, &plane, ends, *radius, frame_b))
                }
                Plane { .. } => None,
            }
        }
        (Capsule { .. }, Points { points, radius }) => {
            let ball = ContactShape::sphere(points[index], *radius);
            Some(segments::contact(0, (a, frame_a), (&ball, frame_b)))
        }
        (Capsule { .. }, Capsule { .. }) => {
            Some(segments::contact(feature, (a, frame_a), (b, frame_b)))
        }
        (_, Points { points, radius }) if Number::real(*radius) == 0.0 => {
            let (solid, faces) = (Solid::in_space(a, frame_a)?, faces(a)?);
            let point = &points[(feature / faces) as usize];
            Some(solid.at_face(feature % faces, &in_space(frame_b, point)))
        }
        (_, Points { points, radius }) => {
            let point = in_space(frame_b, &points[index]);
            Some(Solid::in_space(a, frame_a)?.contact(&point, radius.embed()))
        }
        (_, Capsule { ends, radius }) => {
            let point = in_space(frame_b, &ends[0]);
            Some(Solid::in_space(a, frame_a)?.contact(&point, radius.embed()))
        }
        _ => None,
    }
}

/// The features that count in every configuration, of shapes without edges that meet edges: one of
/// them has the smallest gap, and they are what a compliant contact feels. Not the ends of two
/// capsules, and points of capsules and cylinders that are fixed in them.
pub fn lasting(a: &ContactShape, b: &ContactShape) -> impl Iterator<Item = u32> + use<> {
    use ContactShape::{Capsule, Cylinder, Plane};
    let each = match (a, b) {
        (Plane { .. }, Cylinder { .. }) | (Cylinder { .. }, Plane { .. }) => cylinder_plane::POINTS,
        (Capsule { .. }, Capsule { .. }) => segments::FEATURES,
        _ => 1,
    };
    (0..features(a, b)).step_by(each as usize)
}

/// A shape with its frame at the start of a step, and where its gap is asked for.
pub type Moved<'a> = (&'a ContactShape, [&'a [f64]; 2]);

/// Appends the features of two shapes that may touch, in ascending order, with gaps up to `reach`.
pub fn active((a, of_a): Moved<'_>, (b, of_b): Moved<'_>, reach: f64, out: &mut Vec<(u32, f64)>) {
    use ContactShape::{Box, Capsule, Cylinder, Plane, Points};
    let ([_, frame_a], [_, frame_b], start) = (of_a, of_b, out.len());
    let gap = |feature| contact(feature, (a, frame_a), (b, frame_b)).gap;
    match (a, b) {
        (Plane { normal, .. }, Cylinder { ends, .. }) => {
            points_of_rims(&turned(frame_a, normal), ends, frame_b, &gap, reach, out);
        }
        (Cylinder { ends, .. }, Plane { normal, .. }) => {
            points_of_rims(&turned(frame_b, normal), ends, frame_a, &gap, reach, out);
        }
        (Capsule { .. }, Capsule { .. }) => {
            let found = segments::active((a, frame_a), (b, frame_b));
            out.extend(found.map(|feature| (feature, gap(feature))).filter(|own| own.1 <= reach));
        }
        (Box { .. }, Box { .. }) => {
            if let (Some(a), Some(b)) = (a.place(frame_a), b.place(frame_b)) {
                box_box::active(&a, &b, reach, out);
            }
        }
        (Box { .. } | Cylinder { .. }, Points { points, radius }) if *radius == 0.0 => {
            points_on_solid((a, of_a), points, of_b, reach, out);
        }
        (Points { points, radius }, Box { .. } | Cylinder { .. }) if *radius == 0.0 => {
            points_on_solid((b, of_b), points, of_a, reach, out);
        }
        _ => {
            if let Some(([a, b], _)) = outlines(a, frame_a, b, frame_b) {
                outline_active::active(&a, &b, reach, out);
                return;
            }
            let found = (0..features(a, b)).map(|feature| (feature, gap(feature)));
            out.extend(found.filter(|(_, gap)| *gap <= reach));
        }
    }
    if let (Points { points, .. }, _) | (_, Points { points, .. }) = (a, b) {
        let each = features(a, b) as usize / points.len().max(1);
        let size = |of: &ContactShape| of.ball().map_or(f64::MAX, |(_, radius)| radius);
        let sizes = [size(a), size(b)];
        deepest::keep(out, start, sizes, |feature| &points[feature as usize / each]);
    }
}

fn points_on_solid(
    (of, frames): Moved<'_>,
    points: &[Vector3<f64>],
    own: [&[f64]; 2],
    reach: f64,
    out: &mut Vec<(u32, f64)>,
) {
    if let [Some(before), Some(now)] = frames.map(|frame| Solid::in_space(of, frame)) {
        points_solid::active([before, now], points, own, reach, out);
    }
}

fn points_of_rims(
    normal: &Vector3<f64>,
    ends: &[Vector3<f64>; 2],
    frame: &[f64],
    gap: &impl Fn(u32) -> f64,
    reach: f64,
    out: &mut Vec<(u32, f64)>,
) {
    let points = cylinder_plane::active(normal, ends, frame);
    for first in [0, cylinder_plane::POINTS] {
        let found = points.clone().map(|point| (first + point, gap(first + point)));
        out.extend(found.filter(|(_, gap)| *gap <= reach));
    }
}

#[cfg(test)]
mod cylinder_tests;
#[cfg(test)]
mod points_tests;
#[cfg(test)]
mod tests;
