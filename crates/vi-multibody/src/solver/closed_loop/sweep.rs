//! What a step does to all clusters: their rows at its two ends, the sweeps that pass through their
//! apexes.

use super::cluster::Recall;
use super::loops::Loops;
use super::path::{Maps, Placed};
use vi_core::linear::norm_inf;
use vi_core::newton::{CLOSING_SIZE, Fault};
use vi_core::state::Memory;

/// Increments below which round-off is no correction ([`super::with_floors`]).
const SMALLEST_REACH: f64 = 1e-5;

/// What `g_c` is rounded to, in parts of `ε`.
const PARTS: f64 = 8.0;

/// How precisely the loops determine the increments of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolution {
    sigma: f64, // smallest pivot at q_{n+1}
    reach: f64, // largest increment of the first trial
}

impl Resolution {
    /// Of a step that has not begun.
    pub(super) fn full() -> Self {
        Self { sigma: 1.0, reach: 1.0 }
    }

    /// Takes up another smallest pivot.
    pub(super) fn meet(&mut self, sigma: f64) {
        self.sigma = self.sigma.min(sigma);
    }

    /// Relative size of the corrections that round-off alone may cause.
    pub(super) fn noise(&self) -> f64 {
        1e-9 / self.sigma.clamp(1e-8, 1.0)
    }

    /// The balance is handed on. A correction of the relative size `s` of increments `u` leaves
    /// `s² |u|/σ` in them, and the rounding of `g_c` is a correction of some `ε/σ`.
    pub(super) fn closing_size(&self) -> f64 {
        let Self { sigma, reach } = self;
        let resolved = CLOSING_SIZE * (sigma / reach).min(1.0).sqrt();
        resolved.max(PARTS * f64::EPSILON / (sigma * reach)).min(self.noise())
    }
}

impl Loops {
    /// What the clusters say of the last node.
    pub(super) fn remember(&self, memory: &mut Memory) {
        memory.indices.clear();
        memory.values.clear();
        self.clusters.iter().for_each(|cluster| cluster.remember(memory));
        // which entries are zero changes along the motion
        memory.indices.reserve(memory.indices.len());
        memory.values.reserve(memory.values.len());
    }

    /// `U` at `q_n`, with the maps of the tree at hand.
    pub(super) fn begin(&mut self, maps: Maps<'_>, q: &[f64], memory: &Memory) {
        let mut recall = Recall::new(memory);
        let Self { tree, clusters, home, column_of, .. } = self;
        let at = Placed { tree, maps, home, column_of, q, next: false };
        clusters.iter_mut().for_each(|cluster| cluster.begin(at, &mut recall));
    }

    /// The rows to enforce, from the first trial `u` of the step and its `q_{n+1}`.
    pub(super) fn choose_rows(&mut self, maps: Maps<'_>, q: &[f64], u: &[f64]) -> Resolution {
        let Self { tree, clusters, home, column_of, .. } = self;
        let at = Placed { tree, maps, home, column_of, q, next: true };
        let reach = norm_inf(u).max(SMALLEST_REACH);
        let smallest = clusters.iter_mut().map(|cluster| cluster.choose_rows(at, reach));
        Resolution { sigma: smallest.fold(1.0, f64::min), reach }
    }

    /// One sweep to the root and one back, clusters at their apexes.
    pub(super) fn solve_by_sweeps(&mut self, q1: &[f64], x: &mut [f64]) -> Result<(), Fault> {
        let Self { tree, clusters, home, column_of, .. } = self;
        let links = home.len();
        tree.rest();
        let mut waiting = clusters.iter_mut().peekable();
        for k in (0..links).rev() {
            while let Some(cluster) = waiting.next_if(|cluster| cluster.apex() == Some(k)) {
                cluster.eliminate(tree, (home, column_of, q1), x)?;
            }
            tree.eliminate(k)?;
            tree.forward(k, x);
        }
        waiting.try_for_each(|cluster| cluster.eliminate(tree, (home, column_of, q1), x))?;
        let mut waiting = clusters.iter_mut().rev().peekable();
        while let Some(cluster) = waiting.next_if(|cluster| cluster.apex().is_none()) {
            cluster.release(tree, x);
        }
        for k in 0..links {
            tree.backward(k, x);
            while let Some(cluster) = waiting.next_if(|cluster| cluster.apex() == Some(k)) {
                cluster.release(tree, x);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Inertia, MechanismBuilder};
    use crate::geometry::spatial::SpatialMatrix;
    use crate::mechanism::Mechanism;
    use crate::pair::PairKind;
    use crate::pair::joint::FrameId;
    use crate::solver::closed_loop::loop_rank::LoopRank;
    use nalgebra::{Matrix3, Vector3};
    use std::sync::Arc;
    use vi_testkit::Sample;

    /// A rectangle of hinges on an arm, and another one beside it on the ground.
    fn rectangles() -> Arc<Mechanism> {
        let mut builder = MechanismBuilder::new();
        let inertia = Inertia::principal(1.0, [0.1; 3]);
        let arm = builder.body("arm", inertia).at([0.5, 0.0, 0.0]).id();
        let hinge = builder.joint("arm", PairKind::Revolute, FrameId::Ground, arm);
        hinge.at([0.0; 3]).axis([0.0, 1.0, 0.0]);
        for (carrier, x) in [(arm.into(), 0.5), (FrameId::Ground, 3.0)] {
            let mut bar = |dx: f64, y: f64| builder.body("bar", inertia).at([x + dx, y, 0.0]).id();
            let [left, right, top] = [(-0.2, 0.2), (0.2, 0.2), (0.0, 0.4)].map(|(x, y)| bar(x, y));
            for (parent, child, dx, y) in [
                (carrier, left, -0.2, 0.0),
                (carrier, right, 0.2, 0.0),
                (left.into(), top, -0.2, 0.4),
                (right.into(), top, 0.2, 0.4),
            ] {
                let hinge = builder.joint("hinge", PairKind::Revolute, parent, child);
                hinge.at([x + dx, y, 0.0]).axis([0.0, 0.0, 1.0]);
            }
        }
        Arc::new(builder.build().unwrap().mechanism)
    }

    #[test]
    fn few_and_many_loops_are_solved_alike() {
        let mechanism = rectangles();
        let q = mechanism.initial_configuration();
        let rank = LoopRank::find(&mechanism, 0.0, &q);
        let mut sample = Sample::new(5);
        let side: [f64; 7] = sample.array();
        let mass = |seed: usize| {
            let (m, tilt) = (1.0 + 0.1 * seed as f64, Vector3::new(0.1, -0.2, 0.3));
            let skew = tilt.cross_matrix();
            SpatialMatrix::of([m * Matrix3::identity(), -skew, skew, 0.7 * m * Matrix3::identity()])
        };
        let [few, many] = [false, true].map(|large| {
            let mut loops = rank.loops(&mechanism);
            if large {
                loops.clusters.iter_mut().for_each(|cluster| cluster.eliminate_as_large());
            }
            loops.tree.begin_at(&q, None);
            loops.tree.stand();
            loops.begin(Maps::Recursion, &q, &Memory::default());
            let blocks = loops.tree.blocks_mut().enumerate();
            blocks.for_each(|(k, block)| *block = mass(k));
            let mut x = side.to_vec();
            loops.clusters.iter_mut().for_each(|cluster| cluster.split(1.0, &mut x).unwrap());
            loops.solve_by_sweeps(&q, &mut x).unwrap();
            x
        });
        let apart = few.iter().zip(&many).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{apart:.1e} apart of {:.1e}", norm_inf(&few));
        assert!(apart < 1e-13 * norm_inf(&few) && norm_inf(&few) > 0.1, "{apart:e}");
    }
}
