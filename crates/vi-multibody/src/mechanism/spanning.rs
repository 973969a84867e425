//! Spanning forests: which joints and bars belong to the tree, and which close loops.
//!
//! Breadth first, from the ground on; a component without a joint to the ground hangs on its first
//! body. Joints that the user cuts never belong to the tree.

use crate::mechanism::description::{BarEnd, Description};
use crate::pair::PairKind;
use crate::pair::joint::{FrameId, Joint, Side};
use crate::tree::particle::{Bead, Carrier, ParticleTree};
use crate::tree::{Link, Tree};
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;

/// Breadth-first spanning forest of the bodies; returns the joints outside it.
pub(crate) fn span_bodies(description: &Description) -> (Tree, Vec<usize>) {
    let bodies = description.bodies.len();
    let mut link_of: Vec<Option<usize>> = vec![None; bodies];
    let mut used = vec![false; description.joints.len()];
    description.cuts.iter().for_each(|&k| used[k] = true); // never in the tree
    let mut links: Vec<Link> = Vec::new();
    let mut queue = VecDeque::from([FrameId::Ground]);
    let mut next_root = 0;
    let at = |frame| match frame {
        FrameId::Ground => bodies,
        FrameId::Frame(k) => k,
    };
    let sides = description.joints.iter().map(|j| [at(j.parent.frame), at(j.child.frame)]);
    let joints_of = Incidence::new(bodies + 1, sides);
    loop {
        while let Some(frame) = queue.pop_front() {
            for &k in joints_of.edges(at(frame)) {
                let joint = &description.joints[k];
                if used[k] {
                    continue;
                }
                let oriented = if joint.parent.frame == frame {
                    joint.clone()
                } else if joint.child.frame == frame {
                    joint.reversed()
                } else {
                    continue;
                };
                let FrameId::Frame(child) = oriented.child.frame else { continue };
                if link_of[child].is_some() {
                    continue;
                }
                used[k] = true;
                let parent = match frame {
                    FrameId::Ground => None,
                    FrameId::Frame(p) => link_of[p],
                };
                link_of[child] = Some(links.len());
                links.push(Link { frame: child, parent, joint: oriented, offset: 0 });
                queue.push_back(FrameId::Frame(child));
            }
        }
        let Some(root) = (next_root..bodies).find(|&b| link_of[b].is_none()) else { break };
        next_root = root + 1;
        link_of[root] = Some(links.len());
        let joint = free_joint(&description.bodies[root].name, root);
        links.push(Link { frame: root, parent: None, joint, offset: 0 });
        queue.push_back(FrameId::Frame(root));
    }
    let carries = |k: &usize| used[*k] && !description.cuts.contains(k);
    let cut = (0..used.len()).filter(|k| !carries(k)).collect();
    (Tree::new(links), cut)
}

/// The edges of a graph at each of its nodes, ascending.
struct Incidence {
    start: Vec<usize>, // of each node, into `edges`; one more at the end
    edges: Vec<usize>,
}

impl Incidence {
    /// From the two nodes of each edge.
    fn new(nodes: usize, ends: impl Iterator<Item = [usize; 2]> + Clone) -> Self {
        let mut start = vec![0; nodes + 1];
        ends.clone().flatten().for_each(|node| start[node + 1] += 1);
        (0..nodes).for_each(|node| start[node + 1] += start[node]);
        let (mut next, mut edges) = (start.clone(), vec![0; start[nodes]]);
        for (edge, ends) in ends.enumerate() {
            for node in ends {
                edges[next[node]] = edge;
                next[node] += 1;
            }
        }
        Self { start, edges }
    }

    fn edges(&self, node: usize) -> &[usize] {
        &self.edges[self.start[node]..self.start[node + 1]]
    }
}

fn free_joint(name: &str, frame: usize) -> Joint {
    let side = |frame| Side { frame, anchor: Vector3::zeros(), axes: Matrix3::identity() };
    Joint {
        name: name.to_owned(),
        kind: PairKind::Free,
        parent: side(FrameId::Ground),
        child: side(FrameId::Frame(frame)),
    }
}

/// Breadth-first spanning forest of the point masses; returns the bars outside it.
pub(crate) fn span_particles(
    description: &Description,
    first: usize,
) -> (ParticleTree, Vec<usize>) {
    let count = description.particles.len();
    let mut bead_of: Vec<Option<usize>> = vec![None; count];
    let mut used = vec![false; description.bars.len()];
    let mut beads: Vec<Bead> = Vec::new();
    let mut attach = |particle: usize, carrier, length, bead_of: &mut Vec<Option<usize>>| {
        bead_of[particle] = Some(beads.len());
        let offset = description.particle_offset(particle);
        beads.push(Bead { offset, carrier, length, unknown: 0 });
    };
    let mut queue = VecDeque::new();
    for (k, bar) in description.bars.iter().enumerate() {
        if let BarEnd::Ground(point) = bar.from
            && bead_of[bar.to].is_none()
        {
            used[k] = true;
            attach(bar.to, Carrier::Ground(point), bar.length, &mut bead_of);
            queue.push_back(bar.to);
        }
    }
    let ends = description.bars.iter().map(|bar| match bar.from {
        BarEnd::Particle(from) => [from, bar.to],
        BarEnd::Ground(_) => [count, bar.to],
    });
    let bars_of = Incidence::new(count + 1, ends);
    let mut next_root = 0;
    loop {
        while let Some(particle) = queue.pop_front() {
            for &k in bars_of.edges(particle) {
                let bar = &description.bars[k];
                let BarEnd::Particle(from) = bar.from else { continue };
                let other = match (used[k], from == particle, bar.to == particle) {
                    (false, true, _) => bar.to,
                    (false, _, true) => from,
                    _ => continue,
                };
                if bead_of[other].is_none() {
                    used[k] = true;
                    let carrier = Carrier::Particle(bead_of[particle].expect("queued beads exist"));
                    attach(other, carrier, bar.length, &mut bead_of);
                    queue.push_back(other);
                }
            }
        }
        let Some(root) = (next_root..count).find(|&p| bead_of[p].is_none()) else { break };
        next_root = root + 1;
        attach(root, Carrier::Free, 0.0, &mut bead_of);
        queue.push_back(root);
    }
    let cut = used.iter().enumerate().filter(|(_, used)| !**used).map(|(k, _)| k).collect();
    (ParticleTree::new(description.dimension, beads, first), cut)
}
