//! The loops of a mechanism: paths, clusters, weights.

use super::cluster::Cluster;
use super::cluster_link::ClusterLink;
use super::path::{LoopRow, Maps, Paths, RowPlace};
use crate::constraint::scalar_constraint::ScalarRow;
use crate::mechanism::Mechanism;
use crate::pair::Twist;
use crate::pair::joint::FrameId;
use crate::tree::maps::TreeMaps;
use crate::tree::{Tree, TreeLink};
use nalgebra::{DMatrix, Vector3};
use vi_constraints::Constraints;
use vi_core::Configuration;
use vi_core::interval::Interval;
use vi_core::linear::norm_inf;
use vi_core::newton::{BlockKind, UnknownBlock};
use vi_core::state::Memory;
use vi_rigid::directors;

const NOWHERE: (usize, usize) = (usize::MAX, usize::MAX);

/// The loops of a mechanism on its spanning tree.
pub(crate) struct Loops {
    pub(crate) tree: TreeMaps,
    /// By falling apex, those that hang on the ground last.
    pub(crate) clusters: Vec<Cluster>,
    pub(crate) home: Vec<(usize, usize)>, // link → cluster and place
    pub(crate) column_of: Vec<usize>,     // unknown → column of its cluster
    pub(crate) blocks: Vec<UnknownBlock>,
    count: usize, // rows of g_c
    // what one is for each unknown: 1 rad, or the longest lever arm of its component
    pub(super) weights: Vec<f64>,
    pub(super) initial: Memory, // before the first step
}

impl Loops {
    pub(crate) fn new(mechanism: &Mechanism) -> Self {
        let tree = TreeMaps::new(mechanism.tree().clone());
        let rows = mechanism.loop_constraints();
        let scales = row_scales(mechanism, &rows);
        let blocks = with_floors(mechanism, mechanism.tree().blocks());
        let mut weights = vec![1.0; mechanism.tree().dof()];
        for link in tree.tree().links() {
            let own = link.offset..link.offset + link.dof();
            let lengths = (0..link.dof()).map(|k| !link.joint.kind.is_angle(k));
            for (weight, _) in weights[own].iter_mut().zip(lengths).filter(|(_, length)| *length) {
                *weight = mechanism.arm_of(link.frame);
            }
        }
        let paths = paths(mechanism, &tree, &rows);
        let (clusters, home) = clusters(tree.tree(), &paths);
        let mut links = cluster_links(tree.tree(), &home, clusters.len());
        let build = |(number, group): (usize, &Vec<usize>)| {
            let own = |&i: &usize| LoopRow {
                number: i,
                row: Box::new(rows[i].clone()),
                scale: scales[i],
                path: paths[i].links.iter().map(|&k| home[k].1).collect(),
                apex: paths[i].apex,
                course: 0,
            };
            let own = group.iter().map(own).collect();
            let links = std::mem::take(&mut links[number]);
            let apex = group.iter().map(|&i| paths[i].apex).min().flatten();
            Cluster::new(Paths::new(own, links, apex), &weights)
        };
        let clusters: Vec<Cluster> = clusters.iter().enumerate().map(build).collect();
        let mut column_of = vec![usize::MAX; weights.len()];
        for cluster in &clusters {
            let columns = cluster.paths.columns.iter().enumerate();
            columns.for_each(|(column, &unknown)| column_of[unknown] = column);
        }
        let (count, initial) = (rows.len(), Memory::default());
        Self { tree, clusters, home, column_of, blocks, count, weights, initial }
    }

    /// Where rows are evaluated at `q`, with the maps of the tree there.
    pub(super) fn placed<'a>(&'a self, maps: Maps<'a>, q: &'a [f64]) -> RowPlace<'a> {
        let Self { tree, home, column_of, .. } = self;
        RowPlace { tree, maps, home, column_of, q, next: false, step: None }
    }

    /// Degrees of freedom of the tree.
    pub(crate) fn dof(&self) -> usize {
        self.weights.len()
    }

    /// What one is for each unknown: 1 rad, or the longest lever arm.
    pub(crate) fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// `g_c(t, q)`.
    pub(super) fn raw_values(&self, t: f64, q: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.count];
        for row in self.clusters.iter().flat_map(|cluster| &cluster.paths.rows) {
            values[row.number] = row.row.value(Configuration::new(t, q));
        }
        values
    }

    /// Takes up `q`, and finds the rank of each cluster there.
    pub(crate) fn ranks(&mut self, q: &[f64]) -> Vec<usize> {
        self.tree.begin(q, None);
        let Self { tree, clusters, home, column_of, .. } = self;
        let at = RowPlace { tree, maps: Maps::Pairs, home, column_of, q, next: false, step: None };
        clusters.iter_mut().map(|cluster| cluster.rank_here(at, &[])).collect()
    }

    /// The rows of `g_c` that are independent where the rank was found last, cluster by cluster, as
    /// numbered in the cluster.
    pub(crate) fn pivots(&self) -> Vec<Vec<usize>> {
        self.clusters.iter().map(|cluster| cluster.pivots().to_vec()).collect()
    }

    /// Rows of the clusters as numbered among the rows of `g_c`.
    pub(crate) fn numbers(&self, rows: &[Vec<usize>]) -> Vec<usize> {
        let all = self.clusters.iter().zip(rows);
        let own = |(cluster, rows): (&Cluster, &Vec<usize>)| -> Vec<usize> {
            rows.iter().map(|&i| cluster.paths.rows[i].number).collect()
        };
        all.flat_map(own).collect()
    }

    /// The rank of some rows of `g_c` alone, at the configuration taken up last.
    pub(crate) fn rank_of(&mut self, rows: std::ops::Range<usize>, q: &[f64]) -> usize {
        let Self { tree, clusters, home, column_of, .. } = self;
        let at = RowPlace { tree, maps: Maps::Pairs, home, column_of, q, next: false, step: None };
        let of = |cluster: &mut Cluster| {
            let own = cluster.paths.rows.iter().enumerate();
            let own = own.filter(|(_, row)| rows.contains(&row.number)).map(|(i, _)| i);
            let own: Vec<usize> = own.collect();
            if own.is_empty() { 0 } else { cluster.rank_of(&own, at) }
        };
        clusters.iter_mut().map(of).sum()
    }

    /// The independent rows found last, as a dense matrix.
    pub(crate) fn basis(&self) -> DMatrix<f64> {
        let rank = self.clusters.iter().map(|cluster| cluster.pivots().len()).sum();
        let mut out = DMatrix::zeros(rank, self.dof());
        let mut row = 0;
        for cluster in &self.clusters {
            for k in 0..cluster.pivots().len() {
                cluster.pivot_row(k).for_each(|(column, value)| out[(row, column)] = value);
                row += 1;
            }
        }
        out
    }

    /// A closed configuration next to `F_d(u, q)` by least-norm Newton corrections; `None` when
    /// there is none nearby.
    pub(crate) fn close(
        &mut self,
        mechanism: &Mechanism,
        t: f64,
        q: &[f64],
        u: &[f64],
    ) -> Option<Vec<f64>> {
        const MAX_ITERATIONS: usize = 30;
        let mut s = Interval::new(q.len());
        let mut u = u.to_vec();
        let mut q = q.to_vec();
        let reach = 0.5 + 10.0 * self.largest(&u);
        let floors = self.floors(mechanism, t, &q);
        for iteration in 0..MAX_ITERATIONS {
            s.open(0.0, 1.0, &q);
            self.tree.move_to(&u, &mut s).ok()?;
            q.copy_from_slice(&s.q1);
            mechanism.tree().clean(&mut q);
            if self.is_closed(t, &q, &floors, 1.0) && (iteration > 0 || norm_inf(&u) == 0.0) {
                return Some(q);
            }
            let side: Vec<f64> = self.raw_values(t, &q).iter().map(|g| -g).collect();
            self.tree.begin(&q, None);
            u.fill(0.0);
            let Self { tree, clusters, home, column_of, weights, .. } = self;
            let at = RowPlace {
                tree,
                maps: Maps::Pairs,
                home,
                column_of,
                q: &q,
                next: false,
                step: None,
            };
            let mut rank = 0;
            for cluster in clusters {
                rank += cluster.rank_of_positions(at, &side);
                cluster.add_shortest(weights, &mut u);
            }
            let step = self.largest(&u);
            if rank == 0 || step.is_nan() || step > reach {
                return None;
            }
        }
        self.is_closed(t, &q, &floors, 10.0).then_some(q)
    }

    /// `max |u_i|` in units of its weight.
    pub(super) fn largest(&self, u: &[f64]) -> f64 {
        u.iter().zip(&self.weights).map(|(u, weight)| (u / weight).abs()).fold(0.0, f64::max)
    }

    /// The rounding of each row of `g_c`: `64 ε` of what it sums, with every point as far away as
    /// the farthest of its component, since positions are summed along the path around the loop.
    pub(super) fn floors(&self, mechanism: &Mechanism, t: f64, q: &[f64]) -> Vec<f64> {
        const PARTS: f64 = 64.0 * f64::EPSILON;
        let mut sizes = vec![0.0; mechanism.len()];
        mechanism.row_sizes(Configuration::new(t, q), &mut sizes);
        mechanism.loop_rows().into_iter().map(|row| PARTS * sizes[row]).collect()
    }

    /// Whether all rows of `g_c` are within `factor` times their floors.
    fn is_closed(&self, t: f64, q: &[f64], floors: &[f64], factor: f64) -> bool {
        let values = self.raw_values(t, q);
        values.iter().zip(floors).all(|(g, floor)| g.abs() <= factor * floor)
    }
}

/// The links that feel a row, deepest first, and the one above them.
struct RowPath {
    links: Vec<usize>,
    apex: Option<usize>,
}

/// The path of each row. Its apex is the lowest link that carries all of its sides, where they turn
/// with it: the child of a spherical pair does not, so its loop is felt by the rotation of what
/// carries it. A row with a side on the ground is felt down to the root.
fn paths(mechanism: &Mechanism, tree: &TreeMaps, rows: &[ScalarRow]) -> Vec<RowPath> {
    let links = tree.tree().links();
    let q = mechanism.initial_configuration();
    let cut = mechanism.cut_joints().iter();
    let mut between: Vec<bool> = cut
        .flat_map(|&k| {
            let joint = &mechanism.description().joints[k];
            let frames = [joint.parent.frame, joint.child.frame];
            let bodies = frames.iter().all(|frame| matches!(frame, FrameId::Frame(_)));
            vec![bodies; mechanism.joint_rows(k).len()]
        })
        .collect();
    // those of velocities act from the ground, or by factors that change
    let is_balanced = |row: &ScalarRow| !row.is_of_velocities() && is_balanced(row, &q);
    between.extend(rows[between.len()..].iter().map(is_balanced));
    let path = |(row, between): (&ScalarRow, bool)| {
        let mut ends: Vec<usize> = Vec::new();
        row.for_each_wrench(&q, |frame, _| ends.push(tree.link_of(frame)));
        ends.sort_unstable();
        ends.dedup();
        let carriers = |end: usize| std::iter::successors(Some(end), |&k| links[k].parent);
        let shared = |k: &usize| ends.iter().all(|&end| carriers(end).any(|c| c == *k));
        let apex = ends.first().and_then(|&end| carriers(end).find(shared)).filter(|_| between);
        let below = |apex: Option<usize>| {
            let mut below: Vec<usize> = ends
                .iter()
                .flat_map(|&end| carriers(end).take_while(move |k| Some(*k) != apex))
                .collect();
            below.sort_unstable_by(|a, b| b.cmp(a));
            below.dedup();
            below
        };
        let own = below(apex);
        if own.iter().all(|&k| links[k].joint.kind.rotation_vector().is_none()) {
            return RowPath { links: own, apex };
        }
        RowPath { links: below(None), apex: None }
    };
    rows.iter().zip(between).map(path).collect()
}

/// Whether the wrenches of a row balance each other, so that nothing of it reaches the ground.
fn is_balanced(row: &ScalarRow, q: &[f64]) -> bool {
    let (mut force, mut moment, mut size) = (Vector3::zeros(), Vector3::zeros(), [0.0_f64; 2]);
    row.for_each_wrench(q, |frame, w: Twist| {
        let lever = directors::center(&q[12 * frame..12 * frame + 12]).cross(&w.linear);
        force += w.linear;
        moment += w.angular + lever;
        size[0] += w.linear.norm();
        size[1] += w.angular.norm() + lever.norm();
    });
    let balanced = |rest: f64, size: f64| rest <= 1e-12 * size;
    balanced(force.norm(), size[0]) && balanced(moment.norm(), size[1])
}

/// Rows whose paths share a link, and the cluster and place of each link.
fn clusters(tree: &Tree, paths: &[RowPath]) -> (Vec<Vec<usize>>, Vec<(usize, usize)>) {
    let links = tree.links().len();
    let mut group: Vec<usize> = (0..paths.len()).collect(); // of each row: the first of its cluster
    fn first(group: &mut [usize], mut i: usize) -> usize {
        while group[i] != i {
            group[i] = group[group[i]];
            i = group[i];
        }
        i
    }
    let mut row_of: Vec<Option<usize>> = vec![None; links];
    for (i, path) in paths.iter().enumerate() {
        for &k in &path.links {
            match row_of[k] {
                Some(other) => {
                    let (a, b) = (first(&mut group, i), first(&mut group, other));
                    group[a.max(b)] = a.min(b);
                }
                None => row_of[k] = Some(i),
            }
        }
    }
    let mut clusters: Vec<Vec<usize>> = vec![Vec::new(); paths.len()];
    (0..paths.len()).for_each(|i| clusters[first(&mut group, i)].push(i));
    clusters.retain(|rows| !rows.is_empty());
    clusters.sort_by_key(|rows| std::cmp::Reverse(rows.iter().map(|&i| paths[i].apex).min()));
    let mut home = vec![NOWHERE; links];
    for (number, rows) in clusters.iter().enumerate() {
        let own = rows.iter().flat_map(|&i| paths[i].links.iter().copied());
        own.for_each(|k| home[k].0 = number);
    }
    let mut count = vec![0; clusters.len()];
    for home in home.iter_mut().rev().filter(|home| home.0 != NOWHERE.0) {
        home.1 = count[home.0];
        count[home.0] += 1;
    }
    (clusters, home)
}

fn cluster_links(tree: &Tree, home: &[(usize, usize)], count: usize) -> Vec<Vec<ClusterLink>> {
    let mut out: Vec<Vec<ClusterLink>> = vec![Vec::new(); count];
    for (k, link) in tree.links().iter().enumerate().rev().filter(|(k, _)| home[*k] != NOWHERE) {
        let number = home[k].0;
        let own = &mut out[number];
        let parent = link.parent.map(|p| home[p]).filter(|h| h.0 == number).map(|h| h.1);
        let first = own.last().map_or(0, |last| last.first + last.dof);
        own.push(ClusterLink { link: k, parent, first, offset: link.offset, dof: link.dof() });
    }
    out
}

/// The blocks of a spanning tree's unknowns with floors at which round-off of the loop constraints
/// is no correction.
#[must_use]
pub fn with_floors(mechanism: &Mechanism, mut blocks: Vec<UnknownBlock>) -> Vec<UnknownBlock> {
    const RELATIVE: f64 = 1e-5; // what Newton's method calls small of this is about 50 ε
    let extents = mechanism.point_sizes(&mechanism.initial_configuration());
    let links = mechanism.tree().links();
    let (bodies, dof) = (mechanism.description().bodies.len(), mechanism.tree().dof());
    let of = |kind: BlockKind, extent: f64, arm: f64| match kind {
        BlockKind::Position => extent,
        _ => extent / arm,
    };
    for block in &mut blocks {
        let ends = |link: &TreeLink| link.offset + link.dof();
        let first = links.partition_point(|link| ends(link) <= block.range.start);
        let own = links[first..].iter().take_while(|link| link.offset < block.range.end);
        let floor =
            |link: &TreeLink| of(block.kind, extents[link.frame], mechanism.arm_of(link.frame));
        let mut largest = own.filter(|link| link.dof() > 0).map(floor).fold(0.0, f64::max);
        if block.range.end > dof {
            // point masses follow the bodies
            let points = extents[bodies..].iter().copied().fold(0.0, f64::max);
            largest = largest.max(of(block.kind, points, mechanism.longest_arm()));
        }
        block.floor = RELATIVE * largest;
    }
    blocks
}

/// One over the size of each row's wrench initially, forces weighed by the longest lever arm of its
/// component.
fn row_scales(mechanism: &Mechanism, rows: &[ScalarRow]) -> Vec<f64> {
    let q = mechanism.initial_configuration();
    let scale = |row: &ScalarRow| {
        let mut square = 0.0;
        row.for_each_wrench(&q, |frame, w| {
            let length = mechanism.arm_of(frame);
            square += length * length * w.linear.norm_squared() + w.angular.norm_squared();
        });
        if square > 0.0 { 1.0 / square.sqrt() } else { 1.0 }
    };
    rows.iter().map(scale).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Inertia, MechanismBuilder};
    use crate::pair::PairKind;
    use crate::solver::tree_map::TreeMap;
    use vi_constraints::Reparametrization;

    #[test]
    fn every_block_has_a_floor() {
        let mut builder = MechanismBuilder::new();
        let inertia = Inertia::principal(1.0, [0.1; 3]);
        let arm = builder.body("arm", inertia).at([0.5, 0.0, 0.0]).id();
        builder.body("free", inertia).at([0.0, 7.0, 0.0]);
        builder
            .joint("hinge", PairKind::Revolute, FrameId::Ground, arm)
            .at([0.0; 3])
            .axis([0.0, 1.0, 0.0]);
        let mass = builder.particle("mass", 1.0, [0.0, 0.0, 3.0], [0.0; 3]);
        builder.bar("bar", [0.0, 0.0, 1.0], mass);
        builder.particle("loose", 1.0, [0.0, 0.0, 5.0], [0.0; 3]);
        let mechanism = builder.build().unwrap().mechanism;
        let blocks = with_floors(&mechanism, TreeMap::new(&mechanism).blocks());
        assert!(blocks.len() > 2);
        assert!(blocks.iter().all(|block| block.floor > 0.0), "{blocks:?}");
    }
}
