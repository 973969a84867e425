//! Spanning forests: which joints and bars belong to the tree, and which close loops.
//!
//! Breadth first, from the ground on; a component without a joint to the ground hangs on its first
//! body. Joints that the user cuts never belong to the tree. Breadth first the loops of a ladder,
//! or of scissors, all reach back to its first rung: where loops overlap so, bodies come in the
//! order in which they close loops.

use crate::mechanism::description::{BarEnd, Description};
use crate::pair::PairKind;
use crate::pair::joint::{FrameId, Joint, Side};
use crate::tree::particle::{Bead, Carrier, ParticleTree};
use crate::tree::{Tree, TreeLink};
use nalgebra::{Matrix3, Vector3};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

/// Spanning forest of the bodies; returns the joints outside it. Breadth first, unless loops become
/// less than half as long where bodies with most joints to the forest come first.
pub(crate) fn span_bodies(description: &Description) -> (Tree, Vec<usize>) {
    let graph = BodyGraph::new(description);
    let mut forest = graph.breadth_first();
    let mut is_used = forest.used(description.joints.len());
    if is_used.contains(&false) {
        let other = graph.most_joints_first();
        let twice = 2 * graph.length_of_loops(&other, usize::MAX);
        if graph.length_of_loops(&forest, twice) > twice {
            is_used = other.used(description.joints.len());
            forest = other;
        }
    }
    let cut = (0..is_used.len()).filter(|k| !is_used[*k]).collect();
    let links = forest.0.iter().map(|branch| {
        let ForestNode { body, joint, parent } = *branch;
        let joint = match joint {
            None => free_joint(&description.bodies[body].name, body),
            Some(k) if description.joints[k].child.frame == FrameId::Frame(body) => {
                description.joints[k].clone()
            }
            Some(k) => description.joints[k].reversed(),
        };
        TreeLink { frame: body, parent, joint, offset: 0 }
    });
    (Tree::new(links.collect()), cut)
}

/// Bodies and the ground with the joints between them.
struct BodyGraph {
    sides: Vec<[usize; 2]>, // of each joint; the ground comes after the bodies
    joints_of: Incidence,   // those that may belong to the tree
    bodies: usize,
}

/// A body of a spanning forest.
struct ForestNode {
    body: usize,
    joint: Option<usize>,  // that it hangs on; None: a free one
    parent: Option<usize>, // its number in the forest
}

/// Branches, each after its parent.
struct Forest(Vec<ForestNode>);

impl Forest {
    /// Whether each of some joints belongs to the forest.
    fn used(&self, joints: usize) -> Vec<bool> {
        let mut used = vec![false; joints];
        self.0.iter().filter_map(|branch| branch.joint).for_each(|k| used[k] = true);
        used
    }
}

impl BodyGraph {
    fn new(description: &Description) -> Self {
        let bodies = description.bodies.len();
        let at = |frame| match frame {
            FrameId::Ground => bodies,
            FrameId::Frame(k) => k,
        };
        let sides = description.joints.iter().map(|j| [at(j.parent.frame), at(j.child.frame)]);
        Self::of(bodies, sides.collect(), &description.cuts)
    }

    /// From the sides of the joints; `cuts` never belong to the tree.
    fn of(bodies: usize, sides: Vec<[usize; 2]>, cuts: &[usize]) -> Self {
        let mut may_carry = vec![true; sides.len()];
        cuts.iter().for_each(|&k| may_carry[k] = false);
        let edges = sides.iter().enumerate().filter(|(k, _)| may_carry[*k]);
        let joints_of = Incidence::new(bodies + 1, edges.map(|(k, ends)| (k, *ends)));
        Self { sides, joints_of, bodies }
    }

    /// Joints at a body or the ground, with the other side of each.
    fn neighbours(&self, at: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.joints_of.edges(at).iter().map(move |&k| {
            let [one, other] = self.sides[k];
            (k, if one == at { other } else { one })
        })
    }

    fn breadth_first(&self) -> Forest {
        let mut number = vec![None; self.bodies];
        let (mut branches, mut next_root) = (Vec::new(), 0);
        let mut queue = VecDeque::from([self.bodies]);
        loop {
            while let Some(at) = queue.pop_front() {
                for (k, body) in self.neighbours(at) {
                    if body == self.bodies || number[body].is_some() {
                        continue;
                    }
                    let parent = number.get(at).copied().flatten();
                    number[body] = Some(branches.len());
                    branches.push(ForestNode { body, joint: Some(k), parent });
                    queue.push_back(body);
                }
            }
            let Some(root) = (next_root..self.bodies).find(|&b| number[b].is_none()) else { break };
            next_root = root + 1;
            number[root] = Some(branches.len());
            branches.push(ForestNode { body: root, joint: None, parent: None });
            queue.push_back(root);
        }
        Forest(branches)
    }

    /// Next is the body with most joints to the forest, of those the one met first; it hangs on the
    /// latest of its neighbours. Chains of loops are closed loop by loop so.
    fn most_joints_first(&self) -> Forest {
        let mut number = vec![None; self.bodies];
        let mut met: Vec<Option<WaitingBody>> = vec![None; self.bodies];
        let (mut branches, mut next_root, mut count) = (Vec::new(), 0, 0);
        let mut waiting = BinaryHeap::new(); // joints to the forest, the earlier first, the body
        let mut at = self.bodies;
        loop {
            for (k, body) in self.neighbours(at) {
                if body == self.bodies || number[body].is_some() {
                    continue;
                }
                let parent = number.get(at).copied().flatten();
                let own = met[body].get_or_insert(WaitingBody {
                    joints: 0,
                    order: count,
                    joint: k,
                    parent,
                });
                (own.joints, own.joint, own.parent) = (own.joints + 1, k, parent);
                waiting.push((own.joints, Reverse(own.order), body));
                count += 1;
            }
            let mut ordered = std::iter::from_fn(|| waiting.pop()).map(|(_, _, body)| body);
            let next = ordered.find(|&body| number[body].is_none());
            let free = || (next_root..self.bodies).find(|&b| number[b].is_none());
            let Some(body) = next.or_else(free) else { break };
            let own = met[body];
            if own.is_none() {
                next_root = body + 1;
            }
            number[body] = Some(branches.len());
            let (joint, parent) = (own.map(|own| own.joint), own.and_then(|own| own.parent));
            branches.push(ForestNode { body, joint, parent });
            at = body;
        }
        Forest(branches)
    }

    /// Bodies on the paths between the sides of all joints that the forest leaves out; more than
    /// `limit` are not counted.
    fn length_of_loops(&self, forest: &Forest, limit: usize) -> usize {
        let mut number = vec![None; self.bodies + 1];
        forest.0.iter().enumerate().for_each(|(k, branch)| number[branch.body] = Some(k));
        let used = forest.used(self.sides.len());
        let mut length = 0;
        for (sides, _) in self.sides.iter().zip(used).filter(|(_, used)| !used) {
            let [mut one, mut other] = sides.map(|body| number[body]);
            while one != other && length <= limit {
                // the later one is not above the other
                let latest = if one > other { &mut one } else { &mut other };
                *latest = latest.and_then(|k| forest.0[k].parent);
                length += 1;
            }
        }
        length
    }
}

/// A body that waits at the forest.
#[derive(Clone, Copy)]
struct WaitingBody {
    joints: usize, // to the forest
    order: usize,  // when it was met first
    joint: usize,  // to the latest neighbour
    parent: Option<usize>,
}

/// The edges of a graph at each of its nodes, ascending.
struct Incidence {
    start: Vec<usize>, // of each node, into `edges`; one more at the end
    edges: Vec<usize>,
}

impl Incidence {
    /// From the two nodes of each edge and its number, ascending.
    fn new(nodes: usize, ends: impl Iterator<Item = (usize, [usize; 2])> + Clone) -> Self {
        let mut start = vec![0; nodes + 1];
        ends.clone().flat_map(|(_, ends)| ends).for_each(|node| start[node + 1] += 1);
        (0..nodes).for_each(|node| start[node + 1] += start[node]);
        let (mut next, mut edges) = (start.clone(), vec![0; start[nodes]]);
        for (edge, ends) in ends {
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
    let bars_of = Incidence::new(count + 1, ends.enumerate());
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

#[cfg(test)]
mod tests {
    use super::*;

    fn lengths(bodies: usize, sides: Vec<[usize; 2]>) -> [usize; 2] {
        let graph = BodyGraph::of(bodies, sides, &[]);
        let forests = [graph.breadth_first(), graph.most_joints_first()];
        for forest in &forests {
            let mut bodies_of: Vec<usize> = forest.0.iter().map(|branch| branch.body).collect();
            bodies_of.sort_unstable();
            assert!(bodies_of.iter().copied().eq(0..bodies), "each body once: {bodies_of:?}");
            let is_above = |(k, branch): (usize, &ForestNode)| branch.parent.is_none_or(|p| p < k);
            assert!(forest.0.iter().enumerate().all(is_above), "parents first");
        }
        forests.map(|forest| graph.length_of_loops(&forest, usize::MAX))
    }

    /// Pairs of crossing bars, joined at their middle and at their ends, on one foot.
    #[test]
    fn loops_of_scissors_become_short() {
        let count = 50;
        let bars = |i: usize| [2 * i, 2 * i + 1];
        let mut sides = vec![[2 * count, 0]];
        for i in 0..count {
            sides.push(bars(i));
            if i + 1 < count {
                let ([a, b], [c, d]) = (bars(i), bars(i + 1));
                sides.extend([[a, d], [b, c]]);
            }
        }
        let [broad, other] = lengths(2 * count, sides);
        println!("links on the loops of 49 cells: {broad} breadth first, {other} by most joints");
        assert!(broad > 2000 && other == 49 * 3, "{broad}, {other}");
    }

    /// Cranks on the ground, couplers between neighbours.
    #[test]
    fn loops_of_windows_are_short_breadth_first() {
        let count = 50;
        let mut sides: Vec<[usize; 2]> = (0..=count).map(|i| [2 * count + 1, i]).collect();
        sides.extend((0..count).flat_map(|i| [[i, count + 1 + i], [count + 1 + i, i + 1]]));
        let [broad, other] = lengths(2 * count + 1, sides);
        println!("links on the loops of 50 windows: {broad} breadth first, {other} by most joints");
        assert_eq!((broad, other), (150, 150));
    }
}
