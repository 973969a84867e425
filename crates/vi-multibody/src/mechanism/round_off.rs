//! How precisely increments of the spanning trees are determined far from the origin.
//!
//! Forces see positions, which are rounded to `ε |φ|`. An increment that is a length is not
//! resolved any further, an angle to `ε |φ|/a` with the lever arm `a`: the radius of gyration of a
//! body, half the distance to the next node of a beam, the length of a bar.

use super::description::{BodySpec, Description};
use crate::tree::particle::{Carrier, ParticleTree};
use crate::tree::{FLOOR, Tree};
use std::ops::Range;
use vi_core::newton::UnknownBlock;

/// Increments below this part of the coordinates are small: Newton's method calls `1e-9` of it
/// round-off, some 50 ε.
const RELATIVE: f64 = 1e-5;

/// What rounding of a point does to an increment.
#[derive(Clone, Debug)]
struct Effect {
    point: Range<usize>, // in q
    share: f64,          // change of the increment with the point: 1, or 1/a in 1/m
}

/// What rounding does to each increment.
#[derive(Clone, Debug)]
pub(super) struct RoundOff {
    increments: Vec<Effect>,
    largest: f64, // share
}

impl RoundOff {
    /// Of the increments of bodies, then of point masses.
    pub(super) fn new(description: &Description, tree: &Tree, points: &ParticleTree) -> Self {
        let mut increments = Vec::with_capacity(tree.dof() + points.dof());
        for link in tree.links() {
            let point = 12 * link.frame..12 * link.frame + 3;
            let turn = 1.0 / arm(&description.bodies, link.frame);
            for k in 0..link.dof() {
                let share = if link.joint.kind.is_angle(k) { turn } else { 1.0 };
                increments.push(Effect { point: point.clone(), share });
            }
        }
        let dimension = description.dimension;
        for bead in points.beads() {
            let (count, share) = match bead.carrier {
                Carrier::Free => (dimension, 1.0),
                _ => (dimension - 1, 1.0 / bead.length),
            };
            let point = bead.offset..bead.offset + dimension;
            increments.extend((0..count).map(|_| Effect { point: point.clone(), share }));
        }
        let largest = increments.iter().map(|effect| effect.share).fold(0.0, f64::max);
        Self { increments, largest }
    }

    /// Raises the floors of the blocks at `q`.
    pub(super) fn raise_floors(&self, q: &[f64], blocks: &mut [UnknownBlock]) {
        let size = |x: &[f64]| x.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        let mut last = (usize::MAX, 0.0); // a point, its size
        self.raise(blocks, |Effect { point, .. }| {
            if point.start != last.0 {
                last = (point.start, size(&q[point.clone()])); // NaN is for the residual to find
            }
            last.1
        });
    }

    /// Raises the floors of the blocks for a step over a distance, m: momenta are rounded to `ε` of
    /// themselves, and do not know increments any better than to `ε` of that.
    pub(super) fn raise_floors_by(&self, distance: f64, blocks: &mut [UnknownBlock]) {
        if self.matters(distance) {
            self.raise(blocks, |_| distance);
        }
    }

    /// Whether a step over a distance, m, raises floors.
    pub(super) fn matters(&self, distance: f64) -> bool {
        let floor = RELATIVE * self.largest * distance;
        floor > FLOOR || floor.is_nan()
    }

    /// Raises the floors of the blocks, of whatever control point, where lengths are rounded as
    /// those of a size (m) are.
    fn raise(&self, blocks: &mut [UnknownBlock], mut size: impl FnMut(&Effect) -> f64) {
        let count = self.increments.len();
        for block in blocks.iter_mut().filter(|block| !block.range.is_empty()) {
            let start = block.range.start;
            let first = if start < count { start } else { start % count };
            let own = &self.increments[first..first + block.range.len()];
            let floors = own.iter().map(|effect| RELATIVE * effect.share * size(effect));
            block.floor = floors.fold(block.floor, f64::max);
        }
    }
}

/// The lever arm of the forces on a frame, m: 1 m where there is none.
fn arm(bodies: &[BodySpec], frame: usize) -> f64 {
    let arm = match &bodies[frame].body {
        Some(body) => (body.euler().iter().sum::<f64>() / body.mass()).sqrt(),
        None => {
            let nodes = |k: &usize| bodies.get(*k).is_some_and(|other| other.body.is_none());
            let neighbours = [frame.wrapping_sub(1), frame + 1].into_iter().filter(nodes);
            let distances = neighbours.map(|k| (bodies[k].center - bodies[frame].center).norm());
            0.5 * distances.filter(|distance| *distance > 0.0).fold(f64::INFINITY, f64::min)
        }
    };
    if arm.is_finite() && arm > 0.0 { arm } else { 1.0 }
}
