//! Loops that move but for the digits of a file.
//!
//! The constraints of such a loop are independent, with singular values as small as the last digits
//! are wrong. It is not told from a loop that is locked, or from one in a singular configuration,
//! by its singular values: it is moved.
//! ```text
//! J = G_c P_tree, rows and unknowns in rad and parts of ℓ      ℓ the largest distance of joints within the loop
//! r = rank J with pivots above τ                               τ the tolerance of loops
//! z ← z − J_r⁺ J z,  |z| = δ,  q ← F_d(z, q),  u ← −J_r⁺ g  until g_r = 0           a few times over
//! |g_d(q)| ≤ τ  everywhere on the way:  the loop moves within τ
//! ```
//! On the way a singular configuration leaves residuals of `δ²` in the rows that are not enforced,
//! and its small pivots grow; a loop that is locked by its shape leaves `δ` times its singular
//! values. Where the walk succeeds, the largest rank met, with pivots above `τ`, is that of the
//! motion. Prescribed motions stand still on the way.
use super::cluster::Cluster;
use super::loops::Loops;
use super::path::{Maps, RowPlace};
use super::random::RandomNumbers;
use crate::mechanism::{Mechanism, NearlyRedundant};
use crate::pair::joint::FrameId;
use std::collections::BTreeMap;
use vi_constraints::null_space::RANK_TOLERANCE;
use vi_core::interval::Interval;

/// Length of a stride, rad or parts of the size of the loop: a chain that is stretched must become
/// clearly shorter.
const STRIDE: f64 = 0.05;
/// Strides of a walk.
const COUNT: usize = 8;
/// Corrections up to which a stride counts, as a part of it: what is led back further does not
/// move.
const LED_BACK: f64 = 0.5;
/// Corrections up to which an initial configuration is closed, rad or parts of the size of the
/// loop.
const FAR: f64 = 2.0;
/// Walks in different directions, all of which must succeed.
const WALKS: usize = 2;

/// The rows of a cluster that are enforced where the others nearly follow from them.
pub(super) struct Nearly {
    /// Along the motion, as numbered in the cluster.
    pub(super) rows: Vec<usize>,
    /// Initially.
    pub(super) rows_at_start: Vec<usize>,
}

/// What was found.
pub(super) struct NearlyClosed {
    /// For each cluster; `None` where nothing is new.
    pub(super) clusters: Vec<Option<Nearly>>,
    /// The same for all constraints.
    pub(super) constraints: NearlyRedundant,
}

/// Loops with the measure of [`nearly`](self).
pub(super) struct Walk<'a> {
    pub(super) mechanism: &'a Mechanism,
    pub(super) loops: Loops,
    pub(super) moving: Vec<Vec<usize>>, // rows of each cluster that are no prescribed motion
    all: Vec<Vec<usize>>,               // all rows of each cluster
    pub(super) weights: Vec<f64>,       // what one is for each unknown: 1 rad, or ℓ
    scales: Vec<f64>, // row of g_c → one over what one is for it; 0: a prescribed motion
    pub(super) sizes: Vec<f64>, // ℓ of each cluster
    pub(super) places: JointPlaces,
    tolerance: f64,
    t: f64,
}

/// Constraints of the loops that nearly follow from others at `(t, q)`; `compared`: whether the
/// rank of the loops was compared with that of configurations nearby.
pub(super) fn find(
    mechanism: &Mechanism,
    t: f64,
    q: &[f64],
    compared: bool,
) -> Option<NearlyClosed> {
    let tolerance = mechanism.loop_tolerance();
    if tolerance.is_nan() || tolerance <= RANK_TOLERANCE {
        return None;
    }
    let mut walk = Walk::new(mechanism, t, q, tolerance);
    let (strict, here) = (walk.moving_ranks(q, RANK_TOLERANCE), walk.moving_ranks(q, tolerance));
    if compared && here == strict {
        return None;
    }
    let q = walk.close(q, &vec![0.0; walk.loops.dof()], FAR)?;
    let mut moving = walk.moving_ranks(&q, tolerance);
    let mut most = walk.ranks(&q);
    let rows_at_start = walk.loops.pivots();
    let mut rows = rows_at_start.clone();
    let misfit = walk.misfits(&q);
    let mut take = |walk: &mut Walk<'_>, q: &[f64]| {
        let there = walk.moving_ranks(q, tolerance);
        moving.iter_mut().zip(there).for_each(|(most, there)| *most = there.max(*most));
        let found = walk.ranks(q);
        for (k, own) in walk.loops.pivots().into_iter().enumerate() {
            if found[k] > most[k] {
                (most[k], rows[k]) = (found[k], own);
            }
        }
    };
    let mut random = RandomNumbers::FIRST;
    let mut moved = vec![f64::INFINITY; strict.len()];
    for _ in 0..WALKS {
        let own = walk.walk(&q, &mut random, &mut take)?;
        moved.iter_mut().zip(own).for_each(|(least, own)| *least = own.min(*least));
    }
    let nearly = |k: &usize| moved[*k] >= STRIDE && (moving[*k] < strict[*k] || misfit[*k]);
    let nearly: Vec<bool> = (0..strict.len()).map(|k| nearly(&k)).collect();
    if !nearly.contains(&true) {
        return None;
    }
    let constraints = walk.constraints(&nearly, &most, &q);
    let clusters = rows.into_iter().zip(rows_at_start).zip(&nearly);
    let clusters = clusters
        .map(|((rows, rows_at_start), nearly)| nearly.then_some(Nearly { rows, rows_at_start }));
    Some(NearlyClosed { clusters: clusters.collect(), constraints })
}

/// Which joint of the description a link of the tree has, and which joint a row of `g_c` belongs
/// to.
pub(super) struct JointPlaces {
    of_links: Vec<Option<usize>>,
    of_rows: Vec<Option<usize>>,
}

impl JointPlaces {
    fn new(mechanism: &Mechanism) -> Self {
        let joints = mechanism.description().joints.iter().enumerate();
        let known: BTreeMap<&str, usize> = joints.map(|(k, joint)| (&*joint.name, k)).collect();
        let links = mechanism.tree().links().iter();
        let cut = mechanism.cut_joints().iter();
        let mut of_rows: Vec<Option<usize>> =
            cut.flat_map(|&k| vec![Some(k); mechanism.joint_rows(k).len()]).collect();
        of_rows.resize(mechanism.loop_rows().len(), None);
        Self {
            of_links: links.map(|link| known.get(&*link.joint.name).copied()).collect(),
            of_rows,
        }
    }

    /// The joints of a cluster, as numbered in the description: those of the tree, then those that
    /// are cut.
    pub(super) fn joints(&self, cluster: &Cluster) -> Vec<usize> {
        let links = cluster.paths.links.iter().filter_map(|link| self.of_links[link.link]);
        let rows = cluster.paths.rows.iter().filter_map(|row| self.of_rows[row.number]);
        let mut joints: Vec<usize> = links.chain(rows).collect();
        joints.dedup();
        joints
    }
}

/// The largest distance between the points of the joints of a cluster, m: its longest lever arm
/// where all are in one place.
fn size_of(mechanism: &Mechanism, joints: &[usize], q: &[f64]) -> f64 {
    const ONE_PLACE: f64 = 1e-6;
    let (mut points, mut arm) = (Vec::new(), 0.0_f64);
    for joint in joints.iter().map(|&k| &mechanism.description().joints[k]) {
        points.push(joint.child.point().at(q));
        let at = joint.configuration(q);
        for (side, arm_of_side) in
            [(&joint.parent, at.rho_parent()), (&joint.child, at.rho_child())]
        {
            if side.frame != FrameId::Ground {
                arm = arm.max(arm_of_side.norm());
            }
        }
    }
    let first = points.first().copied().unwrap_or_default();
    // between the farthest from the first and all others: half of it at least is reached
    let mut distance = 0.0_f64;
    let far =
        points.iter().copied().max_by(|a, b| (a - first).norm().total_cmp(&(b - first).norm()));
    for point in &points {
        distance = distance.max((point - far.unwrap_or_default()).norm());
    }
    if distance > ONE_PLACE * arm { distance } else { arm }
}

impl<'a> Walk<'a> {
    pub(super) fn new(mechanism: &'a Mechanism, t: f64, q: &[f64], tolerance: f64) -> Self {
        let loops = Loops::new(mechanism);
        let all: Vec<Vec<usize>> =
            loops.clusters.iter().map(|c| (0..c.paths.rows.len()).collect()).collect();
        let mut walk = Self {
            moving: Vec::new(),
            weights: loops.weights().to_vec(),
            scales: vec![0.0; mechanism.loop_rows().len()],
            all,
            mechanism,
            tolerance,
            t,
            sizes: Vec::new(),
            places: JointPlaces::new(mechanism),
            loops,
        };
        walk.measure(q);
        walk
    }

    /// Measures rows and unknowns at `q`.
    fn measure(&mut self, q: &[f64]) {
        let links = self.mechanism.tree().links();
        for cluster in &mut self.loops.clusters {
            let count = cluster.paths.rows.len();
            let is_angle = |cluster: &Cluster, column: usize| {
                let link = &cluster.paths.links[cluster.paths.owner[column]];
                links[link.link].joint.kind.is_angle(column - link.first)
            };
            // force and moment of each row: what is a length has a force
            let sizes: Vec<(f64, f64)> =
                cluster.paths.rows.iter().map(|row| row.row.largest_wrench(q)).collect();
            let arm = match size_of(self.mechanism, &self.places.joints(cluster), q) {
                size if size > 0.0 => size,
                _ => cluster.paths.columns.iter().map(|&k| self.weights[k]).fold(0.0, f64::max),
            };
            self.sizes.push(arm);
            let mut scales = Vec::with_capacity(count);
            for (row, (force, moment)) in cluster.paths.rows.iter().zip(sizes) {
                let unit = if force > 0.0 { force * arm } else { moment };
                let scale = if unit > 0.0 { 1.0 / unit } else { 1.0 };
                self.scales[row.number] =
                    if row.row.is_rheonomic() || row.row.is_of_velocities() { 0.0 } else { scale };
                scales.push(scale);
            }
            let columns = &cluster.paths.columns;
            for (column, &unknown) in columns.iter().enumerate() {
                self.weights[unknown] = if is_angle(cluster, column) { 1.0 } else { arm };
            }
            let weights: Vec<f64> = columns.iter().map(|&unknown| self.weights[unknown]).collect();
            cluster.measure(&scales, &weights);
            let own = cluster.paths.rows.iter().enumerate();
            let moving = own
                .filter(|(_, row)| !(row.row.is_rheonomic() || row.row.is_of_velocities()))
                .map(|(i, _)| i);
            self.moving.push(moving.collect());
        }
    }

    /// The rank of each cluster at `q`.
    fn ranks(&mut self, q: &[f64]) -> Vec<usize> {
        self.loops.tree.begin(q, None);
        let rows = std::mem::take(&mut self.all);
        let ranks = self.eliminate(q, &rows, &[]);
        self.all = rows;
        ranks
    }

    /// The rank of each cluster at `q` without prescribed motions.
    fn moving_ranks(&mut self, q: &[f64], tolerance: f64) -> Vec<usize> {
        self.loops.tree.begin(q, None);
        let rows = std::mem::take(&mut self.moving);
        let ranks = self.eliminate_to(q, &rows, &[], tolerance);
        self.moving = rows;
        ranks
    }

    /// The rank of each cluster in some of its rows at `q`, at which the tree stands.
    pub(super) fn eliminate(&mut self, q: &[f64], rows: &[Vec<usize>], side: &[f64]) -> Vec<usize> {
        self.eliminate_to(q, rows, side, self.tolerance)
    }

    fn eliminate_to(
        &mut self,
        q: &[f64],
        rows: &[Vec<usize>],
        side: &[f64],
        tolerance: f64,
    ) -> Vec<usize> {
        let Loops { tree, clusters, home, column_of, .. } = &mut self.loops;
        let at = RowPlace { tree, maps: Maps::Pairs, home, column_of, q, next: false, step: None };
        let own = clusters.iter_mut().zip(rows);
        own.map(|(cluster, rows)| cluster.rank_within(rows, at, side, tolerance)).collect()
    }

    /// The shortest `u` with `J_r u` equal to `side`, where the tree stands at `q`.
    fn shortest(&mut self, q: &[f64], side: &[f64]) -> Vec<f64> {
        let rows = std::mem::take(&mut self.moving);
        self.eliminate(q, &rows, side);
        self.moving = rows;
        let mut u = vec![0.0; self.loops.dof()];
        self.loops.clusters.iter().for_each(|cluster| cluster.add_shortest(&self.weights, &mut u));
        u
    }

    /// `F_d(u, q)` with the enforced rows closed, by corrections of the size `most` in all; `None`
    /// where that fails or another row is left with more than it may be.
    fn close(&mut self, q: &[f64], u: &[f64], most: f64) -> Option<Vec<f64>> {
        const MAX_ITERATIONS: usize = 30;
        let mut s = Interval::new(q.len());
        let (mut u, mut q, mut corrected) = (u.to_vec(), q.to_vec(), 0.0_f64);
        let floors = self.loops.floors(self.mechanism, self.t, &q);
        for iteration in 0..MAX_ITERATIONS {
            s.open(0.0, 1.0, &q);
            self.loops.tree.move_to(&u, &mut s).ok()?;
            q.copy_from_slice(&s.q1);
            self.mechanism.tree().clean(&mut q);
            let values = self.loops.raw_values(self.t, &q);
            let side: Vec<f64> = values.iter().map(|g| -g).collect();
            self.loops.tree.begin(&q, None);
            u = self.shortest(&q, &side);
            let factor = if iteration + 1 < MAX_ITERATIONS { 1.0 } else { 10.0 };
            if self.is_closed(&values, &floors, factor) {
                return Some(q);
            }
            let largest = u.iter().zip(&self.weights).map(|(u, w)| (u / w).abs());
            corrected += largest.fold(0.0, f64::max);
            if corrected > most || u.iter().any(|u| u.is_nan()) {
                return None;
            }
        }
        None
    }

    /// Whether the rows of the last elimination that are pivots are closed, and the others within
    /// the tolerance.
    fn is_closed(&self, values: &[f64], floors: &[f64], factor: f64) -> bool {
        self.loops.clusters.iter().zip(&self.moving).all(|(cluster, moving)| {
            let mut enforced = vec![false; moving.len()];
            cluster.pivots().iter().for_each(|&place| enforced[place] = true);
            moving.iter().zip(enforced).all(|(&i, enforced)| {
                let row = cluster.paths.rows[i].number;
                let g = values[row].abs();
                match enforced {
                    true => g <= factor * floors[row],
                    false => self.scales[row] * g <= self.tolerance,
                }
            })
        })
    }

    /// Whether a row of each cluster is left with more than rounding at `q`.
    fn misfits(&self, q: &[f64]) -> Vec<bool> {
        let floors = self.loops.floors(self.mechanism, self.t, q);
        let values = self.loops.raw_values(self.t, q);
        let own = self.loops.clusters.iter().zip(&self.moving);
        let open = |(cluster, moving): (&Cluster, &Vec<usize>)| {
            let mut rows = moving.iter().map(|&i| cluster.paths.rows[i].number);
            rows.any(|row| values[row].abs() > 10.0 * floors[row])
        };
        own.map(open).collect()
    }

    /// Goes off from `q` in a random direction; how far each cluster has moved in its last stride,
    /// or `None` where it cannot.
    fn walk(
        &mut self,
        q: &[f64],
        random: &mut RandomNumbers,
        take: &mut impl FnMut(&mut Self, &[f64]),
    ) -> Option<Vec<f64>> {
        let mut q = q.to_vec();
        let mut z: Vec<f64> = self.weights.iter().map(|weight| weight * random.next()).collect();
        let mut moved = vec![f64::INFINITY; self.loops.clusters.len()];
        for _ in 0..COUNT {
            self.loops.tree.begin(&q, None);
            let side = self.rates(&q, &z);
            let along = self.shortest(&q, &side);
            z.iter_mut().zip(&along).for_each(|(z, along)| *z -= along);
            let sizes = self.stretch(&mut z);
            moved.iter_mut().zip(&sizes).for_each(|(moved, size)| *moved = moved.min(*size));
            q = self.close(&q, &z, LED_BACK * STRIDE)?;
            take(self, &q);
        }
        Some(moved)
    }

    /// `J z` over the rows of `g_c`, where the tree stands at `q`.
    fn rates(&mut self, q: &[f64], z: &[f64]) -> Vec<f64> {
        let mut rates = vec![0.0; self.scales.len()];
        let Loops { tree, clusters, home, column_of, .. } = &mut self.loops;
        let at = RowPlace { tree, maps: Maps::Pairs, home, column_of, q, next: false, step: None };
        for cluster in clusters {
            let columns = cluster.paths.columns.clone();
            for i in 0..cluster.paths.rows.len() {
                let sum = cluster.plain_row(i, at).iter().map(|e| e.1 * z[columns[e.0]]).sum();
                rates[cluster.paths.rows[i].number] = sum;
            }
        }
        rates
    }

    /// Gives the part of each cluster in `z` the size of a stride, and takes what belongs to none
    /// out; the sizes.
    fn stretch(&self, z: &mut [f64]) -> Vec<f64> {
        const LOCKED: f64 = 1e-9;
        let mut out = vec![0.0; z.len()];
        let mut stretch = |cluster: &Cluster| {
            let columns = || cluster.paths.columns.iter();
            let sizes = columns().map(|&k| (z[k] / self.weights[k]).abs());
            let size = sizes.fold(0.0, f64::max);
            if size <= LOCKED {
                return 0.0;
            }
            columns().for_each(|&k| out[k] = STRIDE / size * z[k]);
            STRIDE
        };
        let sizes = self.loops.clusters.iter().map(&mut stretch).collect();
        z.copy_from_slice(&out);
        sizes
    }

    /// A relative size between the pivots of the rows that are enforced and those of the others.
    fn gap(&mut self, ranks: &[Option<usize>], q: &[f64]) -> f64 {
        const SMALLEST: f64 = 1e-9;
        self.loops.tree.begin(q, None);
        let Loops { tree, clusters, home, column_of, .. } = &mut self.loops;
        let at = RowPlace { tree, maps: Maps::Pairs, home, column_of, q, next: false, step: None };
        let (mut clear, mut near) = (1.0_f64, SMALLEST);
        let own = clusters.iter_mut().zip(&self.all).zip(ranks);
        for ((cluster, rows), rank) in own.filter_map(|(own, rank)| Some((own, (*rank)?))) {
            let [with, next] = cluster.pivots_about(rows, at, rank);
            (clear, near) = (clear.min(with), near.max(next));
        }
        (clear * near).sqrt().clamp(SMALLEST, self.tolerance)
    }

    /// What clusters allow their constraints; `most`: their ranks.
    fn constraints(&mut self, nearly: &[bool], most: &[usize], q: &[f64]) -> NearlyRedundant {
        let mut allowances = vec![0.0; vi_constraints::Constraints::len(self.mechanism)];
        let numbers = self.mechanism.loop_rows();
        let own = self.loops.clusters.iter().zip(nearly).filter(|(_, nearly)| **nearly);
        for row in own.flat_map(|(cluster, _)| &cluster.paths.rows) {
            let scale = self.scales[row.number];
            allowances[numbers[row.number]] =
                if scale > 0.0 { self.tolerance / scale } else { 0.0 };
        }
        let ranks = nearly.iter().zip(most).map(|(nearly, rank)| nearly.then_some(*rank));
        let ranks: Vec<Option<usize>> = ranks.collect();
        let rank_tolerance = self.gap(&ranks, q);
        NearlyRedundant { allowances, rank_tolerance, ranks, loop_rank: 0 }
    }
}
