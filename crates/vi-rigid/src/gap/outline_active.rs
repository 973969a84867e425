//! How far two shapes with faces, rims, lines and points are apart, and which features may touch.
//!
//! The normals of faces, and those of the closest points of all other parts, are the directions in
//! which `s(n)` may be largest. The largest one, `n*`, is the distance, or the least way by which
//! shapes that overlap part. A feature counts where its closest points are on its parts, its normal
//! leans from `n*` by `n·n* ≥ 0.99` at least, and the cones of both parts hold it up to 0.14: so
//! that a log rests on two points, a can on several of its rim, or where its rim crosses an edge.
//! What lies nearly parallel along a line, at a sine of 0.003 or less, touches at its ends, and at
//! a part of an axis where that is closer.

use super::outline::{OutlineShape, ShapeOutline, apart};
use super::outline_pairs::{
    Feature, FeatureParts, Touch, halves_of_rim, pairs_of_parts, part_of_axis, rim_with_rim,
    side_of_rims,
};
use nalgebra::Vector3;

/// Cosine of the angle between a normal and the best one, at least.
const ALONG: f64 = 0.99;
/// Sine of the same angle: how far a cone may miss a normal.
const LEANS: f64 = 0.141;
/// The same of the best normal, before the contact of the feature is known.
const MAY_LEAN: f64 = 0.3;
/// Directions that separate equally well up to this part of the sizes: the first of them counts.
const TIE: f64 = 1e-11;
/// Gaps that are the same, in parts of the sizes.
const SAME: f64 = 1e-11;
/// A product of two unit vectors that is more than rounding.
const AWAY: f64 = 1e-9;
/// Separations that are the same but for rounding, in parts of the sizes.
const ROUNDING: f64 = 1e-14;
/// A gap that is larger than the separation by more than this part of the sizes is another one.
const MISSED: f64 = 1e-13;
/// Sine of the angle between axes below which a part of one of them takes the place of the line.
const PARALLEL: f64 = 0.003;
/// By which part of an overlap a feature may overlap more.
const DEEPER: f64 = 0.02;

/// What separates along a direction.
#[derive(Clone, Copy, Debug)]
enum Separator {
    /// A face, of B where that is said.
    Face(u32, bool),
    Feature(Feature),
}

/// The best directions.
struct Search<'a> {
    shapes: [&'a ShapeOutline; 2],
    tie: f64,
    /// The largest separation, and what has it.
    most: (f64, Option<Separator>),
    /// How far the gap of that is from it.
    off: f64,
    /// A direction that separates as well up to ties, the first of such.
    normal: (f64, Vector3<f64>),
    /// The smallest distance of points of both shapes.
    distance: f64,
}

impl<'a> Search<'a> {
    /// All directions, up to the first that separates by more than `enough`.
    fn new(a: &'a ShapeOutline, b: &'a ShapeOutline, enough: f64) -> Self {
        let none = f64::NEG_INFINITY;
        let (tie, normal) = (TIE * (a.size() + b.size()), (none, Vector3::zeros()));
        let (shapes, off) = ([a, b], f64::INFINITY);
        let (most, distance) = ((none, None), f64::INFINITY);
        let mut search = Self { shapes, tie, most, off, normal, distance };
        for (of, shape) in [(false, a), (true, b)] {
            for k in 0..shape.kind.counts().faces {
                let out = shape.face(k).normal;
                search.take(if of { -out } else { out }, None, Separator::Face(k, of));
            }
        }
        for feature in pairs_of_parts(a.kind, b.kind) {
            if search.most.0 > enough {
                break;
            }
            search.look_at(feature);
        }
        search
    }

    /// Looks at a direction; of those that separate equally well but for rounding the one counts
    /// whose own gap is next to that.
    fn take(&mut self, normal: Vector3<f64>, gap: Option<f64>, by: Separator) {
        let [a, b] = self.shapes;
        let apart = apart(a, b, &normal);
        let off = gap.map_or(0.0, |gap| (gap - apart).abs());
        let rounding = ROUNDING * (a.size() + b.size());
        if apart > self.most.0 + rounding || (apart > self.most.0 - rounding && off < self.off) {
            (self.most.1, self.off) = (Some(by), off);
        }
        self.most.0 = self.most.0.max(apart);
        if apart > self.normal.0 + self.tie {
            self.normal = (apart, normal);
        }
    }

    /// The normals of two parts.
    fn look_at(&mut self, feature: Feature) {
        let [a, b] = self.shapes;
        match feature.parts {
            FeatureParts::FaceRim | FeatureParts::FacePoint => {}
            FeatureParts::RimLine => {
                let [first, second] = if feature.exchanged { [b, a] } else { [a, b] };
                let (rim, bar) = (first.rim(feature.i), second.bar(feature.j));
                let is_turned_away = second.beside(feature.j).is_some_and(|beside| {
                    beside.iter().all(|out| out.dot(&rim.axis) > AWAY) // no cone holds both
                });
                if is_turned_away
                    || self.is_farther(rim.at_least(&bar.line(), bar.half) - bar.radius)
                {
                    return;
                }
                let named = halves_of_rim(&rim, &bar);
                for (half, touch) in (1..).zip(feature.halves([first, second])) {
                    let own = if named.contains(&half) { half } else { 0 };
                    self.see(
                        if feature.exchanged { touch.exchanged() } else { touch },
                        own,
                        feature,
                    );
                }
            }
            FeatureParts::RimRim => {
                let rims = [a.rim(feature.i), b.rim(feature.j)];
                let [one, other] = rims;
                let apart = (other.center - one.center).norm() - one.radius - other.radius;
                if self.is_farther(apart) {
                    return;
                }
                let (minima, count) = rims[0].on_rim(&rims[1]);
                for closest in &minima[..count] {
                    let own = side_of_rims(&rims, closest);
                    self.see(rim_with_rim(&rims, closest), own, feature);
                }
            }
            _ => self.see(feature.touch(a, b), feature.own, feature),
        }
    }

    /// Whether parts at this distance at least cannot be the nearest ones: the points of a feature
    /// are as far apart as the shapes are, or as far as these overlap.
    fn is_farther(&self, distance: f64) -> bool {
        distance > self.distance.max(-self.most.0) + self.tie
    }

    fn see(&mut self, touch: Touch, own: u32, feature: Feature) {
        let of_point = matches!(feature.parts, FeatureParts::RimPoint | FeatureParts::PointPoint);
        if touch.is_inside || of_point {
            self.distance = self.distance.min(touch.contact.gap.abs());
        }
        let by = Separator::Feature(Feature { own, ..feature });
        self.take(touch.contact.normal, Some(touch.contact.gap), by);
    }

    /// The feature of what separates best.
    fn nearest(&self) -> Option<Feature> {
        let [a, b] = self.shapes;
        match self.most.1? {
            Separator::Feature(feature) => Some(feature),
            Separator::Face(face, exchanged) => {
                let [first, second] = if exchanged { [b, a] } else { [a, b] };
                let all = pairs_of_parts(a.kind, b.kind).filter(|own| {
                    let of_face =
                        matches!(own.parts, FeatureParts::FaceRim | FeatureParts::FacePoint);
                    of_face && own.exchanged == exchanged && own.i == face
                });
                let normal = first.face(face).normal;
                let with_gap = all.map(|own| {
                    let of_rim = own.parts == FeatureParts::FaceRim;
                    let point = second.rims().points_on_face(&normal).next().filter(|_| of_rim);
                    let own = Feature { own: point.unwrap_or(0), ..own };
                    (own, own.touch(a, b).contact.gap)
                });
                with_gap.min_by(|one, other| one.1.total_cmp(&other.1)).map(|(own, _)| own)
            }
        }
    }
}

/// How far two shapes are apart; of shapes that overlap, the least way to part them, negative.
pub(super) fn separation(a: &ShapeOutline, b: &ShapeOutline) -> f64 {
    Search::new(a, b, f64::INFINITY).most.0
}

/// The features that may touch, with gaps up to `reach`, in ascending order.
pub(super) fn active(a: &ShapeOutline, b: &ShapeOutline, reach: f64, out: &mut Vec<(u32, f64)>) {
    let search = Search::new(a, b, reach);
    let (most, normal) = (search.most.0, search.normal.1);
    if most > reach {
        return;
    }
    let start = out.len();
    let lowest = most - search.tie + DEEPER * most.min(0.0);
    let take = |feature: Feature, touch: &Touch, out: &mut Vec<(u32, f64)>| {
        let along = touch.contact.normal.dot(&normal);
        let gap = touch.contact.gap;
        if touch.is_inside
            && touch.cone >= -LEANS
            && along >= ALONG
            && gap >= lowest
            && gap <= reach
        {
            out.push((feature.number(a.kind, b.kind), gap));
        }
    };
    for feature in pairs_of_parts(a.kind, b.kind).filter(|own| own.may_bear([a, b], &normal)) {
        let owns = match feature.parts {
            FeatureParts::FaceRim => {
                let [first, second] = if feature.exchanged { [b, a] } else { [a, b] };
                let plane = first.face(feature.i);
                for own in second.rims().points_on_face(&plane.normal) {
                    let feature = Feature { own, ..feature };
                    take(feature, &feature.touch(a, b), out);
                }
                continue;
            }
            FeatureParts::RimLine => {
                let [first, second] = if feature.exchanged { [b, a] } else { [a, b] };
                halves_of_rim(&first.rim(feature.i), &second.bar(feature.j))
            }
            FeatureParts::RimRim => 0..2,
            FeatureParts::FacePoint | FeatureParts::LinePoint => 0..1,
            FeatureParts::LineLine | FeatureParts::RimPoint | FeatureParts::PointPoint => continue,
        };
        for own in owns {
            let feature = Feature { own, ..feature };
            take(feature, &feature.touch(a, b), out);
        }
    }
    let least = out[start..].iter().map(|(_, gap)| *gap).fold(f64::INFINITY, f64::min);
    let same = SAME * (a.size() + b.size());
    for feature in pairs_of_parts(a.kind, b.kind).filter(|own| own.parts == FeatureParts::LineLine)
    {
        if !feature.may_bear([a, b], &normal) {
            continue;
        }
        let touch = feature.touch(a, b);
        let (p, q) = (a.bar(feature.i), b.bar(feature.j));
        if p.along.cross(&q.along).norm() >= PARALLEL || a.kind == OutlineShape::Box {
            take(feature, &touch, out);
        } else if touch.contact.gap < least - same {
            let own = part_of_axis(p.place(&touch.contact.point));
            take(Feature { own, ..feature }, &touch, out);
        }
    }
    let least = out[start..].iter().map(|(_, gap)| *gap).fold(f64::INFINITY, f64::min);
    if least > most + MISSED * (a.size() + b.size())
        && let Some(feature) = search.nearest()
    {
        let number = feature.number(a.kind, b.kind);
        if out[start..].iter().all(|own| own.0 != number) {
            out.push((number, feature.touch(a, b).contact.gap));
        }
    }
    out[start..].sort_unstable_by_key(|(feature, _)| *feature);
}

impl Feature {
    /// Whether both parts may bear along a normal from A to B.
    fn may_bear(&self, [a, b]: [&ShapeOutline; 2], normal: &Vector3<f64>) -> bool {
        let ([first, second], n) =
            if self.exchanged { ([b, a], -normal) } else { ([a, b], *normal) };
        let rim = |of: &ShapeOutline, k: u32, n: &Vector3<f64>| of.face(k).normal.dot(n);
        let least = match self.parts {
            FeatureParts::FaceRim | FeatureParts::FacePoint => {
                return first.face(self.i).normal.dot(&n) >= ALONG;
            }
            FeatureParts::LineLine => {
                first.cone_of_line(self.i, &n).min(second.cone_of_line(self.j, &-n))
            }
            FeatureParts::LinePoint => {
                first.cone_of_line(self.i, &n).min(second.cone_of_point(self.j, &-n))
            }
            FeatureParts::RimLine => rim(first, self.i, &n).min(second.cone_of_line(self.j, &-n)),
            FeatureParts::RimRim => rim(first, self.i, &n).min(rim(second, self.j, &-n)),
            FeatureParts::RimPoint | FeatureParts::PointPoint => return false,
        };
        least >= -MAY_LEAN
    }
}
