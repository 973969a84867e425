//! Two shapes with the gaps between them.

use super::{ContactPoint, ContactShape, active, contact, features, has_gap, one_way};
use vi_core::Number;

/// There is no gap between two such shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the gap between {a} and {b} is not available: all shapes stand on planes; boxes, cylinders, capsules and spheres touch one another; points touch boxes, cylinders, spheres and capsules"
)]
pub struct NoGap {
    /// One of them.
    pub a: &'static str,
    /// The other one.
    pub b: &'static str,
}

/// Two shapes with the gaps between them.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapePair<S = f64> {
    pub(super) a: ContactShape<S>,
    pub(super) b: ContactShape<S>,
}

impl<S> ShapePair<S> {
    /// The shape on frame A, and the one on frame B.
    #[must_use]
    pub fn shapes(&self) -> [&ContactShape<S>; 2] {
        [&self.a, &self.b]
    }
}

impl<S: Number> ShapePair<S> {
    /// The same shapes with other numbers; `None` of shapes of another kind.
    #[must_use]
    pub fn alike(of: &ShapePair, [a, b]: [ContactShape<S>; 2]) -> Option<Self> {
        let is_alike = one_way(&a, &b) == one_way(&of.a, &of.b);
        is_alike.then_some(Self { a, b })
    }
}

impl ShapePair {
    /// Of a shape on frame A and one on frame B.
    ///
    /// # Errors
    /// [`NoGap`] where no formula is there for the two.
    pub fn new(a: ContactShape, b: ContactShape) -> Result<Self, NoGap> {
        match has_gap(&a, &b) {
            false => Err(NoGap { a: a.name(), b: b.name() }),
            true => Ok(Self { a, b }),
        }
    }

    /// How many features it has; they are numbered from 0.
    #[must_use]
    pub fn features(&self) -> u32 {
        features(&self.a, &self.b)
    }

    /// A length of the size of both, m.
    #[must_use]
    pub fn extent(&self) -> f64 {
        self.a.extent().max(self.b.extent())
    }

    /// The contact of a feature; `frame_a` and `frame_b`: the frames of the shapes, shape 12.
    #[must_use]
    pub fn contact(&self, feature: u32, frame_a: &[f64], frame_b: &[f64]) -> ContactPoint {
        contact(feature, (&self.a, frame_a), (&self.b, frame_b))
    }

    /// Appends the features that may touch, in ascending order, with gaps up to `reach`, m.
    pub fn active(&self, frame_a: &[f64], frame_b: &[f64], reach: f64, out: &mut Vec<(u32, f64)>) {
        self.active_in_step([frame_a; 2], [frame_b; 2], reach, out);
    }

    /// The same after a step; of each frame the start of the step, and where gaps are asked for.
    pub fn active_in_step(
        &self,
        of_a: [&[f64]; 2],
        of_b: [&[f64]; 2],
        reach: f64,
        out: &mut Vec<(u32, f64)>,
    ) {
        active((&self.a, of_a), (&self.b, of_b), reach, out);
    }
}
