//! Two boxes: corners on faces, and edges on edges.
//!
//! ```text
//! corner – face   g = n·(x − o)
//! edge – edge     g = n·(x_B − x_A),   n = ±(e_A × e_B)/|e_A × e_B|
//! ```
//! The direction in which the boxes are farthest apart (S. Gottschalk, M. Lin, D. Manocha, SIGGRAPH
//! 1996: the normals of the faces and the products of the edges) tells which features may touch: of
//! a face its corners and those of the opposite face that stand above one another, and the edges of
//! both that cross; of two edges these. A gap is that of lines and planes: it is smooth also where
//! a corner leaves its face. Where corners of both meet, that of B counts; where an end of an edge
//! is on the other one, the corner there.
//!
//! | number | feature |
//! |---|---|
//! | `6c + f` | corner `c` of B on face `f` of A |
//! | `48 + 6c + f` | corner `c` of A on face `f` of B |
//! | `96 + 12i + j` | edge `i` of A on edge `j` of B |

use super::ContactShape;
use super::contact_point::ContactPoint;
use super::points_plane::Plane;
use super::solids::{FACES, Solid, face};
use nalgebra::{Matrix3, Vector3};
use vi_core::{Embed, Number};

/// A box in space: centre, axes, half lengths.
pub(super) type PlacedBox<T = f64> = (Vector3<T>, Matrix3<T>, Vector3<T>);

impl<S: Number> ContactShape<S> {
    /// A box on a frame; `None` of other shapes.
    pub(super) fn place<T: Number>(&self, frame: &[T]) -> Option<PlacedBox<T>>
    where
        S: Embed<T>,
    {
        match Solid::in_space(self, frame)? {
            Solid::Box(center, axes, half) => Some((center, axes, half)),
            Solid::Cylinder(..) => None,
        }
    }
}

const CORNERS: u32 = 8;
const OF_A: u32 = CORNERS * FACES;
const EDGES: u32 = 2 * OF_A;
/// Of a pair of boxes.
pub(super) const FEATURES: u32 = EDGES + 144;

/// Axes that separate equally well up to this part of the sizes: the first of them counts, faces
/// before edges.
const TIE: f64 = 1e-9;
/// Cosine of the angle between the normal of a face and that of crossing edges, at least.
const ALONG: f64 = 0.99;
/// Sine of the angle below which edges count as parallel.
const PARALLEL: f64 = 1e-6;

pub(super) fn side(bit: u32) -> f64 {
    if bit & 1 == 1 { 1.0 } else { -1.0 }
}

/// Corner `k`: its sides along the three axes are the bits.
pub(super) fn corner<T: Number>((center, axes, half): &PlacedBox<T>, k: u32) -> Vector3<T> {
    center + axes * Vector3::from_fn(|i, _| half[i] * T::of(side(k >> i)))
}

/// Edge `k`: its middle and its half, along the axis `k/4`, at the sides by the two bits.
pub(super) fn edge((center, axes, half): &PlacedBox, k: u32) -> (Vector3<f64>, Vector3<f64>) {
    let axis = (k / 4) as usize;
    let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
    let middle = center
        + axes.column(first) * (side(k) * half[first])
        + axes.column(second) * (side(k >> 1) * half[second]);
    (middle, axes.column(axis) * half[axis])
}

fn plane((center, axes, half): &PlacedBox, k: u32) -> Plane {
    face(center, axes, half, k)
}

/// The contact of a feature.
pub(super) fn contact(feature: u32, a: &PlacedBox, b: &PlacedBox) -> ContactPoint {
    if feature < OF_A {
        return plane(a, feature % FACES).contact_with(&corner(b, feature / FACES));
    }
    if feature < EDGES {
        let own = feature - OF_A;
        return plane(b, own % FACES).contact_with(&corner(a, own / FACES)).exchanged();
    }
    let own = feature - EDGES;
    let ((x_a, e_a), (x_b, e_b)) = (edge(a, own / 12), edge(b, own % 12));
    let product = e_a.cross(&e_b);
    let size = product.norm();
    let between = b.0 - a.0;
    // parallel edges have no direction of their own
    let normal = if size > 0.0 { product / size } else { between.normalize() };
    let apart = outward(a, own / 12) - outward(b, own % 12);
    let normal = if normal.dot(&apart) < 0.0 { -normal } else { normal };
    let d = x_b - x_a;
    let (aa, bb, ab) = (e_a.norm_squared(), e_b.norm_squared(), e_a.dot(&e_b));
    let determinant = aa * bb - ab * ab;
    let (s, t) = match determinant > 0.0 {
        true => (
            (d.dot(&e_a) * bb - d.dot(&e_b) * ab) / determinant,
            (d.dot(&e_a) * ab - d.dot(&e_b) * aa) / determinant,
        ),
        false => (0.0, 0.0),
    };
    let (on_a, on_b) = (x_a + e_a * s, x_b + e_b * t);
    ContactPoint { gap: normal.dot(&d), normal, point: 0.5 * (on_a + on_b) }
}

/// From the centre of a box through the middle of an edge.
fn outward(of: &PlacedBox, k: u32) -> Vector3<f64> {
    edge(of, k).0 - of.0
}

/// How far the boxes are apart along a direction from A to B.
fn apart(a: &PlacedBox, b: &PlacedBox, n: &Vector3<f64>) -> f64 {
    let reach = |(_, axes, half): &PlacedBox| -> f64 {
        (0..3).map(|i| (axes.column(i).dot(n) * half[i]).abs()).sum()
    };
    (b.0 - a.0).dot(n) - reach(a) - reach(b)
}

/// The features that may touch, with gaps up to `reach`, in ascending order.
pub(super) fn active(a: &PlacedBox, b: &PlacedBox, reach: f64, out: &mut Vec<(u32, f64)>) {
    let between = b.0 - a.0;
    let tie = TIE * (a.2.amax() + b.2.amax());
    let toward = |n: Vector3<f64>| if n.dot(&between) < 0.0 { -n } else { n };
    let mut best: Option<(f64, Vector3<f64>, bool)> = None;
    let mut consider = |n: Vector3<f64>, is_face: bool| {
        let gap = apart(a, b, &n);
        if best.is_none_or(|(most, ..)| gap > most + tie) {
            best = Some((gap, n, is_face));
        }
    };
    for i in 0..3 {
        consider(toward(a.1.column(i).into_owned()), true);
    }
    for i in 0..3 {
        consider(toward(b.1.column(i).into_owned()), true);
    }
    for i in 0..3 {
        for j in 0..3 {
            let product = a.1.column(i).cross(&b.1.column(j));
            let size = product.norm();
            if size > PARALLEL {
                consider(toward(product / size), false);
            }
        }
    }
    let Some((gap, normal, is_face)) = best else { return };
    if gap > reach {
        return;
    }
    let start = out.len();
    let mut take = |feature: u32| {
        let gap = contact(feature, a, b).gap;
        if gap <= reach {
            out.push((feature, gap));
        }
    };
    let own = [supporting(a, &normal), supporting(b, &-normal)];
    if is_face {
        for c in 0..CORNERS {
            if is_above(a, own[0], &corner(b, c)) && is_of_face(c, own[1]) {
                take(FACES * c + own[0]);
            }
        }
        for c in 0..CORNERS {
            let x = corner(a, c);
            if is_of_face(c, own[0]) && is_above(b, own[1], &x) && !is_at_corner(b, own[1], &x) {
                take(OF_A + FACES * c + own[1]);
            }
        }
    }
    for i in 0..12 {
        for j in 0..12 {
            let is_extreme = match is_face {
                // of a face that leans, the edges are nearer to one another than the face is
                true => {
                    let product = edge(a, i).1.cross(&edge(b, j).1);
                    let along = product.dot(&normal).abs();
                    is_edge_of(i, own[0]) && is_edge_of(j, own[1]) && along > ALONG * product.norm()
                }
                false => {
                    let ends = [edge(a, i).0 - a.0, edge(b, j).0 - b.0];
                    let most = |of: &PlacedBox, n: &Vector3<f64>| -> f64 {
                        (0..3).map(|k| (of.1.column(k).dot(n) * of.2[k]).abs()).sum()
                    };
                    (ends[0].dot(&normal) - most(a, &normal)).abs() <= tie
                        && (ends[1].dot(&normal) + most(b, &normal)).abs() <= tie
                }
            };
            if is_extreme && crosses(a, i, b, j, &normal) {
                take(EDGES + 12 * i + j);
            }
        }
    }
    out[start..].sort_unstable_by_key(|(feature, _)| *feature);
}

/// The face of a box that is most in a direction.
fn supporting((_, axes, _): &PlacedBox, n: &Vector3<f64>) -> u32 {
    let along = [0, 1, 2].map(|i| axes.column(i).dot(n));
    let axis = (1..3).fold(0, |best, i| match along[i].abs() > along[best].abs() {
        true => i,
        false => best,
    });
    2 * axis as u32 + u32::from(along[axis] < 0.0)
}

/// Whether a corner is one of a face.
fn is_of_face(corner: u32, face: u32) -> bool {
    (corner >> (face / 2) & 1 == 1) == (face.is_multiple_of(2))
}

/// Whether an edge is one of a face.
fn is_edge_of(edge: u32, face: u32) -> bool {
    let (axis, of) = (edge / 4, face / 2);
    let bit = match (of + 3 - axis) % 3 {
        0 => return false,
        1 => edge & 1,
        _ => edge >> 1 & 1,
    };
    (bit == 1) == (face.is_multiple_of(2))
}

/// Whether the foot of a point is on a face.
fn is_above((center, axes, half): &PlacedBox, face: u32, x: &Vector3<f64>) -> bool {
    let arm = x - center;
    let inside = |i: usize| arm.dot(&axes.column(i)).abs() <= half[i] * (1.0 + TIE);
    (0..3).filter(|i| *i != (face / 2) as usize).all(inside)
}

/// Whether the foot of a point on a face is a corner of it, which is a contact already.
fn is_at_corner((center, axes, half): &PlacedBox, face: u32, x: &Vector3<f64>) -> bool {
    let arm = x - center;
    let at_end = |i: usize| arm.dot(&axes.column(i)).abs() >= half[i] * (1.0 - TIE);
    (0..3).filter(|i| *i != (face / 2) as usize).all(at_end)
}

/// Whether two edges cross, seen along the normal, inside of both, and are not parallel.
fn crosses(a: &PlacedBox, i: u32, b: &PlacedBox, j: u32, normal: &Vector3<f64>) -> bool {
    let ((x_a, e_a), (x_b, e_b)) = (edge(a, i), edge(b, j));
    let flat = |v: Vector3<f64>| v - normal * v.dot(normal);
    let (p, q, d) = (flat(e_a), flat(e_b), flat(x_b - x_a));
    let across = p.cross(&q).dot(normal);
    if across.abs() <= 1e-3 * p.norm() * q.norm() {
        return false;
    }
    // d = s p − t q
    let s = d.cross(&q).dot(normal) / across;
    let t = d.cross(&p).dot(normal) / across;
    s.abs() < 1.0 - TIE && t.abs() < 1.0 - TIE // at an end a corner touches
}
