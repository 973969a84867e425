//! Contacts of many shapes with one law: each of them with each other one.
//!
//! Pairs that may touch are found by boxes about the motion of a step (`broad_phase`); planes are
//! compared with all. A feature is numbered by the two shapes and the feature of the pair, so that
//! it keeps its number from step to step. Shapes on one frame do not touch.

use super::broad_phase::{AxisBox, BroadPhase};
use super::shape_contact::{Touching, frame};
use crate::pair::joint::FrameId;
use nalgebra::Vector3;
use std::collections::BTreeSet;
use std::sync::Mutex;
use vi_constraints::nonsmooth::{ContactLaw, ContactPlace, ContactRows, Unilateral};
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_rigid::directors::{center, director};
use vi_rigid::gap::{ContactShape, NoGap, active, features, smallest_gap};

/// Boxes are wider than the motion by this part of the size.
const MARGIN: f64 = 1e-6;

/// Shapes of which each touches each.
#[derive(Debug)]
pub struct ShapeGroup {
    name: String,
    shapes: Vec<GroupMember>,
    excluded: BTreeSet<(u32, u32)>,
    law: ContactLaw,
    size: f64, // m
    most: u32, // features of a pair
    scratch: Mutex<Scratch>,
}

#[derive(Clone, Debug)]
struct GroupMember {
    frame: FrameId,
    shape: ContactShape,
    ball: Option<(Vector3<f64>, f64)>,
}

#[derive(Debug, Default)]
struct Scratch {
    bounds: Vec<Option<AxisBox>>,
    motions: Vec<f64>, // m  how far points of the shapes move
    pairs: Vec<(u32, u32)>,
    active: Vec<(u32, f64)>,
    broad: BroadPhase,
}

/// A group that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GroupError {
    /// Two of its shapes have no gap.
    #[error(transparent)]
    NoGap(#[from] NoGap),
    /// Features cannot be numbered.
    #[error("{shapes} shapes with up to {features} features in a pair are too many for one group")]
    TooMany {
        /// How many shapes.
        shapes: usize,
        /// Of a pair.
        features: u32,
    },
}

impl ShapeGroup {
    /// Of shapes on frames, but for `excluded` pairs, by their numbers; `law`: of all pairs.
    ///
    /// # Errors
    /// [`GroupError`].
    pub fn new(
        name: &str,
        shapes: Vec<(FrameId, ContactShape)>,
        excluded: &[(usize, usize)],
        law: ContactLaw,
    ) -> Result<Self, GroupError> {
        let excluded: BTreeSet<(u32, u32)> =
            excluded.iter().map(|&(a, b)| (a.min(b) as u32, a.max(b) as u32)).collect();
        let members = shapes.into_iter().map(|(frame, shape)| {
            let ball = shape.ball();
            GroupMember { frame, shape, ball }
        });
        let shapes: Vec<GroupMember> = members.collect();
        let mut kinds: Vec<usize> = Vec::new(); // one shape of each kind
        for (k, own) in shapes.iter().enumerate() {
            let same = |other: &usize| features_alike(&shapes[*other].shape, &own.shape);
            if !kinds.iter().any(same) {
                kinds.push(k);
            }
        }
        let mut most = 1;
        for (k, a) in kinds.iter().enumerate() {
            for b in &kinds[k..] {
                let [a, b] = [a, b].map(|own| &shapes[*own].shape);
                let is_plane = |own: &ContactShape| own.ball().is_none();
                match features(a, b) {
                    0 if is_plane(a) && is_plane(b) => {}
                    0 if std::ptr::eq(a, b) && alone(&shapes, a) => {}
                    0 => return Err(NoGap { a: a.name(), b: b.name() }.into()),
                    count => most = most.max(count),
                }
            }
        }
        let count = shapes.len() as u64;
        if count * count * u64::from(most) > u64::from(u32::MAX) {
            return Err(GroupError::TooMany { shapes: shapes.len(), features: most });
        }
        let size = shapes.iter().fold(0.0, |size: f64, own| size.max(own.shape.extent()));
        let (name, scratch) = (name.to_owned(), Mutex::default());
        Ok(Self { name, shapes, excluded, law, size, most, scratch })
    }

    /// The numbers of the two shapes of a feature.
    #[must_use]
    pub fn pair(&self, feature: u32) -> (usize, usize) {
        let (pair, count) = ((feature / self.most) as usize, self.shapes.len());
        (pair / count, pair % count)
    }

    /// A feature as one of its pair.
    #[must_use]
    pub fn feature_of_pair(&self, feature: u32) -> u32 {
        feature % self.most
    }

    /// How many features two of its shapes have.
    #[must_use]
    pub fn features_of(&self, a: usize, b: usize) -> u32 {
        features(&self.shapes[a].shape, &self.shapes[b].shape)
    }

    /// The smallest of all gaps, m; `None` where no shapes may touch.
    #[must_use]
    pub fn smallest_gap(&self, at: Configuration<'_>) -> Option<f64> {
        let count = self.shapes.len() as u32;
        let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b)));
        let gaps = pairs.filter(|pair| self.may_touch(*pair)).filter_map(|(a, b)| {
            let [a, b] = [a, b].map(|k| {
                let own = &self.shapes[k as usize];
                (&own.shape, frame(own.frame, at.q))
            });
            smallest_gap(a, b)
        });
        gaps.min_by(f64::total_cmp)
    }

    fn touching(&self, feature: u32) -> Touching<'_> {
        let (a, b) = self.pair(feature);
        let [a, b] = [a, b].map(|k| &self.shapes[k]);
        Touching {
            shapes: [&a.shape, &b.shape],
            frames: [a.frame, b.frame],
            feature: feature % self.most,
        }
    }

    fn may_touch(&self, (a, b): (u32, u32)) -> bool {
        self.shapes[a as usize].frame != self.shapes[b as usize].frame
            && !self.excluded.contains(&(a, b))
    }
}

fn features_alike(a: &ContactShape, b: &ContactShape) -> bool {
    let count = |own: &ContactShape| match own {
        ContactShape::Points { points, radius } => (points.len(), *radius > 0.0),
        _ => (0, true),
    };
    a.name() == b.name() && count(a) == count(b)
}

/// Whether a shape is the only one of its kind.
fn alone(shapes: &[GroupMember], of: &ContactShape) -> bool {
    shapes.iter().filter(|own| features_alike(&own.shape, of)).count() == 1
}

impl GroupMember {
    /// The box about the motion of a step, and how far points of the shape move at most.
    fn bounds(&self, s: &Interval, margin: f64) -> (Option<AxisBox>, f64) {
        let ends = [&s.q0, &s.q1].map(|q| frame(self.frame, q));
        let far = self.shape.extent();
        let turn: f64 = (0..3).map(|i| (director(ends[1], i) - director(ends[0], i)).norm()).sum();
        let moved = (center(ends[1]) - center(ends[0])).norm() + turn * far;
        let bounds = self.ball.map(|(point, radius)| {
            let [a, b] = ends.map(|q| {
                let turned = |i: usize| director(q, i) * point[i];
                center(q) + turned(0) + turned(1) + turned(2)
            });
            let reach = Vector3::repeat(radius + margin);
            AxisBox { low: a.inf(&b) - reach, high: a.sup(&b) + reach }
        });
        (bounds, moved)
    }
}

impl Unilateral for ShapeGroup {
    fn name(&self) -> &str {
        &self.name
    }

    fn law(&self) -> ContactLaw {
        self.law
    }

    fn size(&self) -> f64 {
        self.size
    }

    fn near(&self, s: &Interval, at: Configuration<'_>, out: &mut Vec<(u32, f64)>) {
        let mut scratch = self.scratch.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let Scratch { bounds, motions, pairs, active: found, broad } = &mut *scratch;
        let margin = MARGIN * self.size;
        bounds.clear();
        motions.clear();
        for own in &self.shapes {
            let (own, moved) = own.bounds(s, margin);
            bounds.push(own);
            motions.push(moved);
        }
        broad.find(bounds, pairs);
        let count = self.shapes.len() as u32;
        for &(a, b) in pairs.iter().filter(|pair| self.may_touch(**pair)) {
            let reach = motions[a as usize] + motions[b as usize] + margin;
            let [first, second] = [a, b].map(|k| &self.shapes[k as usize]);
            found.clear();
            let [first, second] = [first, second]
                .map(|own| (&own.shape, [frame(own.frame, &s.q0), frame(own.frame, at.q)]));
            active(first, second, reach, found);
            let start = (a * count + b) * self.most;
            out.extend(found.iter().map(|(feature, gap)| (start + feature, *gap)));
        }
    }

    fn gap(&self, feature: u32, at: Configuration<'_>) -> f64 {
        self.touching(feature).at(at.q).gap
    }

    fn rows(&self, feature: u32, at: Configuration<'_>, out: &mut ContactRows) {
        self.touching(feature).rows(at.q, self.law.rows(), out);
    }

    fn slip(&self, feature: u32, s: &Interval) -> [f64; 2] {
        if self.law.rows() == 1 { [0.0; 2] } else { self.touching(feature).slip(s) }
    }

    fn place(&self, feature: u32, at: Configuration<'_>) -> Option<ContactPlace> {
        Some(self.touching(feature).place(at.q))
    }
}
