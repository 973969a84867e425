//! Parts of a mechanism that no constraint connects: what one does is no round-off of another.
//!
//! Components are those of the graph of bodies and point masses with the constraints as edges; the
//! ground connects nothing. Frames without mass of their own are nodes of elements: they form one
//! component with all that they are connected to.

use super::Mechanism;
use crate::constraint::scalar_constraint::ScalarRow;
use crate::pair::joint::Joint;
use nalgebra::Vector3;
use vi_core::linear::norm_inf;
use vi_core::sparse::Entries;
use vi_rigid::directors::center;

/// The component of each body and point mass, and its longest lever arm.
#[derive(Clone, Debug)]
pub(crate) struct Components {
    of: Vec<usize>, // body, then point mass → component
    arms: Vec<f64>, // of each component, m; 0 without joints
    joints: bool,   // there are any
}

/// Which member each column of a row belongs to.
struct MembersMet<'a> {
    bodies: usize,
    dimension: usize,
    met: &'a mut Vec<usize>,
}

impl Entries for MembersMet<'_> {
    fn add(&mut self, _row: usize, column: usize, _value: f64) {
        let member = match column.checked_sub(12 * self.bodies) {
            None => column / 12,
            Some(beyond) => self.bodies + beyond / self.dimension,
        };
        if self.met.last() != Some(&member) {
            self.met.push(member);
        }
    }
}

/// The first member of a set.
fn first(set: &mut [usize], mut i: usize) -> usize {
    while set[i] != i {
        set[i] = set[set[i]];
        i = set[i];
    }
    i
}

impl Components {
    /// Whether no component has one of the first members and one of the others.
    pub(super) fn separate(&self, first: usize) -> bool {
        // each has the number of its first member
        self.of[first..].iter().all(|&component| component >= first)
    }

    /// From the rows of the constraints; `q`: the initial configuration.
    pub(super) fn find(description: &super::Description, rows: &[ScalarRow], q: &[f64]) -> Self {
        let (bodies, dimension) = (description.bodies.len(), description.dimension.max(1));
        let mut set: Vec<usize> = (0..bodies + description.particles.len()).collect();
        let mut join = |a: usize, b: usize| {
            let (a, b) = (first(&mut set, a), first(&mut set, b));
            set[a.max(b)] = a.min(b);
        };
        let mut met = Vec::new();
        for row in rows {
            met.clear();
            row.emit(q, 0, &mut MembersMet { bodies, dimension, met: &mut met });
            met.windows(2).for_each(|pair| join(pair[0], pair[1]));
        }
        let nodes = (0..bodies).filter(|&k| description.bodies[k].body.is_none());
        let nodes: Vec<usize> = nodes.collect();
        nodes.windows(2).for_each(|pair| join(pair[0], pair[1]));
        let of: Vec<usize> = (0..set.len()).map(|i| first(&mut set, i)).collect();
        let mut arms = vec![0.0_f64; of.len()];
        for joint in &description.joints {
            let arm = arm(joint, q);
            for frame in [joint.parent.frame, joint.child.frame] {
                if let crate::pair::joint::FrameId::Frame(k) = frame {
                    arms[of[k]] = arms[of[k]].max(arm);
                }
            }
        }
        Self { of, arms, joints: !description.joints.is_empty() }
    }
}

/// The longest lever arm of a joint, m.
fn arm(joint: &Joint, q: &[f64]) -> f64 {
    let at = joint.configuration(q);
    at.rho_parent().norm().max(at.rho_child().norm()).max(at.gap().norm())
}

impl Mechanism {
    /// How far the points of each component are from the origin at `q`, m: entry `k` for the
    /// component of that number.
    fn extents(&self, q: &[f64]) -> Vec<f64> {
        let bodies = self.description.bodies.len();
        let mut extents = vec![0.0_f64; self.components.of.len()];
        for (member, &component) in self.components.of.iter().enumerate() {
            let own = match member.checked_sub(bodies) {
                None => 12 * member..12 * member + 3,
                Some(k) => {
                    let at = self.particle_offset(k);
                    at..at + self.description.dimension
                }
            };
            extents[component] = extents[component].max(norm_inf(&q[own]));
        }
        extents
    }

    /// How much coarser than a rotation the direction from a node to the next is rounded, since it
    /// is a difference of coordinates: `|φ|/ℓ`, from 1, as without nodes, to 1000.
    pub(crate) fn direction_rounding(&self, q: &[f64]) -> f64 {
        let bodies = &self.description.bodies;
        let nodes = (0..bodies.len()).filter(|&k| bodies[k].body.is_none());
        let points: Vec<_> = nodes.map(|k| center(&q[12 * k..12 * k + 12])).collect();
        let part = |pair: &[Vector3<f64>]| match (pair[1] - pair[0]).norm() {
            0.0 => 1.0, // in a corner
            length => pair[0].amax().max(pair[1].amax()) / length,
        };
        points.windows(2).map(part).fold(1.0, f64::max).min(1e3)
    }

    /// The size of the coordinates of points at `q`, m, for each body and then each point mass:
    /// that of the farthest point of its component, no less than its longest lever arm; 1 m where
    /// there is neither.
    pub(crate) fn point_sizes(&self, q: &[f64]) -> Vec<f64> {
        let (extents, Components { of, arms, joints }) = (self.extents(q), &self.components);
        let size = |&c: &usize| match (arms[c], extents[c]) {
            (arm, extent) if arm.max(extent) > 0.0 => extent.max(arm),
            _ if *joints => self.longest_arm(),
            _ => 1.0,
        };
        of.iter().map(size).collect()
    }

    /// The longest lever arm of a joint in the component of a body in the initial configuration;
    /// that of the whole mechanism where the component has none.
    pub(crate) fn arm_of(&self, body: usize) -> f64 {
        match self.components.arms[self.components.of[body]] {
            arm if arm > 0.0 => arm,
            _ => self.longest_arm(),
        }
    }

    /// The longest lever arm of a joint in the initial configuration, 1 m when there is none.
    #[must_use]
    pub fn longest_arm(&self) -> f64 {
        let length = self.components.arms.iter().copied().fold(0.0, f64::max);
        if length > 0.0 { length } else { 1.0 }
    }
}
