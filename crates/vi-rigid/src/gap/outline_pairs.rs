//! Features of two shapes with faces, rims, lines and points, and their contacts.
//!
//! | feature | gap |
//! |---|---|
//! | face – rim | that of a point of the rim ([`cylinder_plane`](super::cylinder_plane)) |
//! | face – point | `n·(x − o) − R` |
//! | line – line | `n·(x_B − x_A) − R_A − R_B`, `n = ±ℓ_A × ℓ_B/\|ℓ_A × ℓ_B\|` |
//! | line – point, rim – point, point – point | `\|x_B − x_A\| − R_A − R_B` |
//! | rim – line, rim – rim | `n·(x_B − x_A) − R_B` of the closest points ([`rim`](super::rim)), `n` along `x_B − x_A` or `±t_A × t_B` |
//!
//! Lines go on beyond their ends, and faces beyond their edges: a gap is smooth as long as the
//! feature is named. The axis of A ends beside an axis: beyond its ends the circle there counts,
//! whose gap goes on smoothly. A line of steepness `k` above a half crosses a rim at most once. A
//! flat one crosses it twice, a feature for each half of the rim. Where two axes are nearly
//! parallel their closest points may jump along them within a step: a part of the axis of A takes
//! the place of the line, with the point of that part next to the axis of B.
//!
//! Features are numbered kind by kind, of each kind first those whose first part is of A, then
//! those whose first part is of B.

use super::contact_point::ContactPoint;
use super::cylinder_plane::ON_FACE;
use super::outline::{OutlineLine, OutlineShape, ShapeOutline, cone_of_rim};
use super::rim::{Closest, Rim};
use nalgebra::Vector3;

/// Lengths that are the same, in parts of those of a face or a line.
const TIE: f64 = 1e-9;
/// Sine of the angle below which a rim and an edge, or two rims, count as tangent.
const TANGENT: f64 = 1e-3;
/// `sin²` of the angle below which lines count as parallel.
const PARALLEL: f64 = 1e-18;
/// Into how many parts an axis is divided; there is one more, half of it at each end.
const AXIS_PARTS: u32 = 64;
/// Half of the length of a part, in that of the axis.
const PART: f64 = 1.0 / AXIS_PARTS as f64;
/// Of two lines: that of A as a whole, then parts of it.
const OF_LINES: u32 = 2 + AXIS_PARTS;
/// How far the line of an axis goes on where an edge crosses it, in its half length.
const BEYOND: f64 = 2.0;
/// Steepness from which the closest point of a whole rim counts.
const STEEP: f64 = 0.5;

/// Which parts of two shapes a feature is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FeatureParts {
    FaceRim,
    FacePoint,
    LineLine,
    LinePoint,
    RimPoint,
    PointPoint,
    RimLine,
    RimRim,
}

const KINDS: [FeatureParts; 8] = [
    FeatureParts::FaceRim,
    FeatureParts::FacePoint,
    FeatureParts::LineLine,
    FeatureParts::LinePoint,
    FeatureParts::RimPoint,
    FeatureParts::PointPoint,
    FeatureParts::RimLine,
    FeatureParts::RimRim,
];

/// A feature: part `i` of the first shape with part `j` of the other one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Feature {
    pub(super) parts: FeatureParts,
    /// The first part is of B.
    pub(super) exchanged: bool,
    pub(super) i: u32,
    pub(super) j: u32,
    /// Which of several.
    pub(super) own: u32,
}

impl FeatureParts {
    fn is_symmetric(self) -> bool {
        matches!(self, Self::LineLine | Self::RimRim | Self::PointPoint)
    }

    /// How many first parts, second parts, and features of each two there are.
    fn counts(self, first: OutlineShape, second: OutlineShape) -> [u32; 3] {
        let (a, b) = (first.counts(), second.counts());
        match self {
            Self::FaceRim => [a.faces, b.rims, ON_FACE],
            Self::FacePoint => [a.faces, b.points, 1],
            Self::LineLine => [a.lines, b.lines, OF_LINES],
            Self::LinePoint => [a.lines, b.points, 1],
            Self::RimLine => [a.rims, b.lines, 3],
            Self::RimPoint => [a.rims, b.points, 1],
            Self::RimRim => [a.rims, b.rims, 2],
            Self::PointPoint => [a.points, b.points, 1],
        }
    }
}

/// The blocks in which features are numbered, each with its counts.
fn blocks(
    a: OutlineShape,
    b: OutlineShape,
) -> impl Iterator<Item = (FeatureParts, bool, [u32; 3])> {
    let both = KINDS.into_iter().flat_map(|parts| [(parts, false), (parts, true)]);
    both.filter(|(parts, exchanged)| !(*exchanged && parts.is_symmetric())).map(
        move |(parts, exchanged)| {
            let counts = if exchanged { parts.counts(b, a) } else { parts.counts(a, b) };
            (parts, exchanged, counts)
        },
    )
}

/// How many features two shapes have.
pub(super) fn count(a: OutlineShape, b: OutlineShape) -> u32 {
    blocks(a, b).map(|(.., [first, second, each])| first * second * each).sum()
}

impl Feature {
    /// Of a number.
    pub(super) fn numbered(mut number: u32, a: OutlineShape, b: OutlineShape) -> Option<Self> {
        for (parts, exchanged, [first, second, each]) in blocks(a, b) {
            let count = first * second * each;
            if number < count {
                let (of, own) = (number / each, number % each);
                return Some(Self { parts, exchanged, i: of / second, j: of % second, own });
            }
            number -= count;
        }
        None
    }

    /// Its number.
    pub(super) fn number(&self, a: OutlineShape, b: OutlineShape) -> u32 {
        let mut start = 0;
        for (parts, exchanged, [first, second, each]) in blocks(a, b) {
            if (parts, exchanged) == (self.parts, self.exchanged) {
                return start + (self.i * second + self.j) * each + self.own;
            }
            start += first * second * each;
        }
        start
    }
}

/// All pairs of parts of two shapes, with the first of the features of each.
pub(super) fn pairs_of_parts(a: OutlineShape, b: OutlineShape) -> impl Iterator<Item = Feature> {
    blocks(a, b).flat_map(|(parts, exchanged, [first, second, _])| {
        let places = (0..first).flat_map(move |i| (0..second).map(move |j| (i, j)));
        places.map(move |(i, j)| Feature { parts, exchanged, i, j, own: 0 })
    })
}

/// The contact of a feature, by its number.
pub(super) fn contact(number: u32, a: &ShapeOutline, b: &ShapeOutline) -> Option<ContactPoint> {
    let feature = Feature::numbered(number, a.kind, b.kind)?;
    Some(feature.touch(a, b).contact)
}

/// A contact, and whether it is one of the parts that are named.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    pub(super) contact: ContactPoint,
    /// Whether the closest points are on both parts.
    pub(super) is_inside: bool,
    /// How far the normal is inside the cones of both.
    pub(super) cone: f64,
}

impl Touch {
    /// The same with A and B exchanged.
    pub(super) fn exchanged(self) -> Self {
        Self { contact: self.contact.exchanged(), ..self }
    }
}

/// Points of two shapes with the radii about them, and a direction from the first to the other one.
struct Ends {
    x: [Vector3<f64>; 2],
    radii: [f64; 2],
    out: Vector3<f64>,
}

impl Ends {
    /// The contact along a normal.
    fn along(&self, normal: Vector3<f64>) -> ContactPoint {
        let [x, y] = self.x;
        let middle = 0.5 * (x + normal * self.radii[0] + y - normal * self.radii[1]);
        let gap = normal.dot(&(y - x)) - self.radii[0] - self.radii[1];
        ContactPoint { gap, normal, point: middle }
    }

    /// The normal from one to the other, to the side of `out`.
    fn between(&self) -> Vector3<f64> {
        let way = self.x[1] - self.x[0];
        let distance = way.norm();
        // points in one place have no normal of their own
        self.outwards(if distance > 0.0 { way / distance } else { self.out.normalize() })
    }

    /// The normal across two tangents, or where these are nearly parallel, from one point to the
    /// other; with the sine of the angle between the tangents.
    fn across(&self, [t, s]: [Vector3<f64>; 2], size: f64) -> (Vector3<f64>, f64) {
        let product = t.cross(&s);
        let (sine, distance) = (product.norm(), (self.x[1] - self.x[0]).norm());
        let is_apart = distance > sine * size;
        (if is_apart { self.between() } else { self.outwards(product / sine) }, sine)
    }

    fn outwards(&self, normal: Vector3<f64>) -> Vector3<f64> {
        if normal.dot(&self.out) < 0.0 { -normal } else { normal }
    }
}

impl Feature {
    /// Its contact in a configuration.
    pub(super) fn touch(&self, a: &ShapeOutline, b: &ShapeOutline) -> Touch {
        if self.exchanged { self.of([b, a]).exchanged() } else { self.of([a, b]) }
    }

    /// The same, from the shape of the first part to the other one.
    fn of(&self, shapes: [&ShapeOutline; 2]) -> Touch {
        match self.parts {
            FeatureParts::FaceRim => self.face_rim(shapes),
            FeatureParts::FacePoint => self.face_point(shapes),
            FeatureParts::LineLine => self.line_line(shapes),
            FeatureParts::LinePoint => self.line_point(shapes),
            FeatureParts::RimLine => self.rim_line(shapes),
            FeatureParts::RimPoint => self.rim_point(shapes),
            FeatureParts::RimRim => self.rim_rim(shapes),
            FeatureParts::PointPoint => self.point_point(shapes),
        }
    }

    fn face_rim(&self, [first, second]: [&ShapeOutline; 2]) -> Touch {
        let (plane, rim) = (first.face(self.i), second.rim(self.j));
        let e = second.rims().on_face(self.own, &plane.normal);
        let contact = plane.contact_with(&(rim.center + e * rim.radius));
        // where points of both rims meet, that of B counts
        let margin =
            if self.exchanged && first.kind == OutlineShape::Cylinder { -TIE } else { TIE };
        let is_inside = first.is_above(self.i, &contact.point, margin);
        let cone = (-plane.normal.dot(&rim.axis)).min(-plane.normal.dot(&e));
        Touch { contact, is_inside, cone }
    }

    fn face_point(&self, [first, second]: [&ShapeOutline; 2]) -> Touch {
        let (plane, point) = (first.face(self.i), second.point(self.j));
        let contact = plane.contact_with(&(point - plane.normal * second.radius_of_points()));
        let is_inside = first.is_above(self.i, &contact.point, TIE);
        Touch { contact, is_inside, cone: second.cone_of_point(self.j, &-plane.normal) }
    }

    fn line_line(&self, [first, second]: [&ShapeOutline; 2]) -> Touch {
        let (p, q) = (first.bar(self.i), second.bar(self.j));
        let (product, cosine) = (p.along.cross(&q.along), p.along.dot(&q.along));
        let square = product.norm_squared();
        let d = q.middle - p.middle;
        let (on_p, on_q) = (d.dot(&p.along), d.dot(&q.along));
        let is_crossing = square > PARALLEL;
        let s = if is_crossing { (on_p - on_q * cosine) / square } else { 0.0 };
        let place = s / p.half;
        // the middle of the part of the axis, and half of its length
        let (middle, reach) = match self.own.checked_sub(1) {
            Some(part) => (2.0 * f64::from(part) / f64::from(AXIS_PARTS) - 1.0, PART),
            None => (0.0, 1.0),
        };
        let off = (place - middle) / reach;
        // the gap of an edge with the circle at an end is another one
        let goes_on = self.own == 0 && q.radius == 0.0 && off.abs() <= BEYOND;
        if first.kind != OutlineShape::Box && (!is_crossing || off.abs() > 1.0 && !goes_on) {
            let end = if is_crossing { reach.copysign(off) } else { 0.0 };
            let touch = self.section(middle + end, [first, second]);
            return Touch { is_inside: false, ..touch };
        }
        let x = p.middle + p.along * s;
        let ends = Ends {
            x: [x, q.line().nearest(&x)],
            radii: [p.radius, q.radius],
            out: first.out_of_line(self.i) - second.out_of_line(self.j),
        };
        let normal = if is_crossing { product / square.sqrt() } else { ends.between() };
        let towards = if ends.out == Vector3::zeros() { d } else { ends.out };
        let normal = if normal.dot(&towards) < 0.0 { -normal } else { normal };
        let within = |place: f64| place.abs() < 1.0 - TIE;
        let is_inside = is_crossing && within(place) && within(q.place(&ends.x[1]));
        let cone = first.cone_of_line(self.i, &normal).min(second.cone_of_line(self.j, &-normal));
        Touch { contact: ends.along(normal), is_inside, cone }
    }

    /// The circle across the axis of the first shape at a place, or the ball of a capsule there,
    /// with the line of the other one.
    fn section(&self, place: f64, [first, second]: [&ShapeOutline; 2]) -> Touch {
        let (p, q) = (first.bar(self.i), second.bar(self.j));
        if first.kind == OutlineShape::Cylinder {
            let rim = first.section(place);
            return self.closest_of_rim(&rim, &q, second);
        }
        let x = p.middle + p.along * (place * p.half);
        let y = q.line().nearest(&x);
        let out = -second.out_of_line(self.j);
        let ends = Ends { x: [x, y], radii: [p.radius, q.radius], out };
        let contact = ends.along(ends.between());
        Touch { contact, is_inside: false, cone: 0.0 }
    }

    fn line_point(&self, [first, second]: [&ShapeOutline; 2]) -> Touch {
        let (bar, point) = (first.bar(self.i), second.point(self.j));
        let foot = bar.line().nearest(&point);
        let radii = [bar.radius, second.radius_of_points()];
        let ends = Ends { x: [foot, point], radii, out: first.out_of_line(self.i) };
        let contact = ends.along(ends.between());
        let cone = first
            .cone_of_line(self.i, &contact.normal)
            .min(second.cone_of_point(self.j, &-contact.normal));
        Touch { contact, is_inside: bar.place(&point).abs() < 1.0 - TIE, cone }
    }

    fn rim_line(&self, [first, second]: [&ShapeOutline; 2]) -> Touch {
        match self.own {
            0 => self.closest_of_rim(&first.rim(self.i), &second.bar(self.j), second),
            half => self.halves([first, second])[half as usize - 1],
        }
    }

    /// The contacts of both halves of a rim with a line, from the shape of the rim to the other
    /// one.
    pub(super) fn halves(&self, [first, second]: [&ShapeOutline; 2]) -> [Touch; 2] {
        let (rim, bar) = (first.rim(self.i), second.bar(self.j));
        rim.on_line(&bar.line())
            .map(|closest| self.rim_with_line(&rim, &bar, second, &closest, &rim.axis))
    }

    /// The closest point of a whole rim with a line.
    fn closest_of_rim(&self, rim: &Rim, bar: &OutlineLine, second: &ShapeOutline) -> Touch {
        let [one, other] = rim.on_line(&bar.line());
        let is_other = (!one.is_least && other.is_least)
            || (one.is_least == other.is_least && other.distance() < one.distance());
        let closest = Closest { is_least: true, ..if is_other { other } else { one } };
        self.rim_with_line(rim, bar, second, &closest, &Vector3::zeros())
    }

    fn rim_with_line(
        &self,
        rim: &Rim,
        bar: &OutlineLine,
        second: &ShapeOutline,
        closest: &Closest,
        end: &Vector3<f64>,
    ) -> Touch {
        let outward = rim.outward(&closest.on_rim);
        let ends = Ends {
            x: [closest.on_rim, closest.on_other],
            radii: [0.0, bar.radius],
            out: outward + end - second.out_of_line(self.j),
        };
        let (normal, sine) = ends.across([rim.axis.cross(&outward), bar.along], rim.radius);
        // where ends of both meet, the rim of A counts
        let margin = if self.exchanged { -TIE } else { TIE };
        let is_inside = closest.is_least
            && bar.place(&closest.on_other).abs() <= 1.0 + margin
            && (bar.radius > 0.0 || sine > TANGENT);
        let cone =
            cone_of_rim(rim, &closest.on_rim, &normal).min(second.cone_of_line(self.j, &-normal));
        Touch { contact: ends.along(normal), is_inside, cone }
    }

    fn rim_point(&self, [first, second]: [&ShapeOutline; 2]) -> Touch {
        let (rim, point) = (first.rim(self.i), second.point(self.j));
        let x = rim.nearest(&point);
        let radii = [0.0, second.radius_of_points()];
        let ends = Ends { x: [x, point], radii, out: rim.axis + rim.outward(&x) };
        Touch { contact: ends.along(ends.between()), is_inside: false, cone: 0.0 }
    }

    fn rim_rim(&self, [first, second]: [&ShapeOutline; 2]) -> Touch {
        let rims = [first.rim(self.i), second.rim(self.j)];
        let (minima, count) = rims[0].on_rim(&rims[1]);
        let of = |closest: &Closest| rim_with_rim(&rims, closest);
        let found = minima[..count].iter().filter(|own| side_of_rims(&rims, own) == self.own);
        let bears = |touch: &Touch| touch.cone >= -TANGENT;
        let nearer = |a: &Touch, b: &Touch| {
            let order = bears(b).cmp(&bears(a));
            order.then(a.contact.gap.abs().total_cmp(&b.contact.gap.abs()))
        };
        let nearest = found.map(of).min_by(nearer);
        let elsewhere = || {
            let others = minima[..count].iter().map(of).min_by(nearer);
            Touch { is_inside: false, ..others.unwrap_or_else(|| of(&minima[0])) }
        };
        nearest.unwrap_or_else(elsewhere)
    }

    fn point_point(&self, [first, second]: [&ShapeOutline; 2]) -> Touch {
        let x = [first.point(self.i), second.point(self.j)];
        let radii = [first.radius_of_points(), second.radius_of_points()];
        let ends = Ends { x, radii, out: second.center - first.center };
        Touch { contact: ends.along(ends.between()), is_inside: false, cone: 0.0 }
    }
}

/// The contact of two rims at a minimum of their distance.
pub(super) fn rim_with_rim(rims: &[Rim; 2], closest: &Closest) -> Touch {
    let x = [closest.on_rim, closest.on_other];
    let outward = [0, 1].map(|k| rims[k].outward(&x[k]));
    let out = outward[0] + rims[0].axis - outward[1] - rims[1].axis;
    let ends = Ends { x, radii: [0.0; 2], out };
    let tangents = [0, 1].map(|k| rims[k].axis.cross(&outward[k]));
    let (normal, sine) = ends.across(tangents, rims[0].radius.min(rims[1].radius));
    let cone = cone_of_rim(&rims[0], &x[0], &normal).min(cone_of_rim(&rims[1], &x[1], &-normal));
    Touch { contact: ends.along(normal), is_inside: closest.is_least && sine > TANGENT, cone }
}

/// On which side of the plane through the centres of two rims, and between their axes, they meet.
pub(super) fn side_of_rims([first, second]: &[Rim; 2], closest: &Closest) -> u32 {
    let across = (first.axis - second.axis).cross(&(second.center - first.center));
    let both = (closest.on_rim - first.center) + (closest.on_other - second.center);
    u32::from(both.dot(&across) < 0.0)
}

/// Which of the features of a rim and a line count.
pub(super) fn halves_of_rim(rim: &Rim, bar: &OutlineLine) -> std::ops::Range<u32> {
    if rim.steepness(&bar.line()) > STEEP { 0..1 } else { 1..3 }
}

/// The part of the axis of A that holds a place between −1 and 1, as a feature of two lines.
pub(super) fn part_of_axis(place: f64) -> u32 {
    1 + (0.5 * (place + 1.0) * f64::from(AXIS_PARTS)).round().clamp(0.0, f64::from(AXIS_PARTS))
        as u32
}
