//! The velocity map of a tree, column by column, with the configuration at which it is taken.
//!
//! ```text
//! t_α = Σ_k J_αk ν_k,     J_child = (X J_parent, S)
//! ```
//! Letters: `J_αk` twist of member `α` by the unit rate of the unknown `k`. Source: theory §5.

use crate::mechanism::Mechanism;
use crate::pair::{Motion, PairKind, Transfer, Twist, VelocityMap};
use crate::solver::member_blocks::Span;
use crate::solver::screws;
use crate::tree::Tree;
use crate::tree::particle::ParticleTree;
use nalgebra::{DMatrix, Vector6};
use std::ops::Range;
use vi_constraints::Constraints;
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault};
use vi_rigid::null_space;

/// A frame or a particle: which coordinates it has and which unknowns move it.
#[derive(Clone, Debug)]
pub(super) struct Member {
    pub(super) span: Span,
    pub(super) columns: Range<usize>,
}

/// The velocity map of all members at one configuration, column by column.
#[derive(Clone, Debug)]
pub struct Columns {
    pub(super) q: Vec<f64>,               // n  where P_in is taken
    pub(super) twists: Vec<Vector6<f64>>, // one for each member and each unknown that moves it
}

/// A tree of frames and particles as a sparse velocity map.
#[derive(Debug)]
pub struct VelocityLayout {
    tree: Tree,
    particles: ParticleTree,
    pub(super) members: Vec<Member>, // links in the order of the tree, then particles
    parents: Vec<Option<usize>>,     // of links
    roots: Vec<Option<usize>>,       // of links: their free root
    pub(super) unknowns: Vec<usize>, // unknown of each column
    dim: usize,                      // n
    dof: usize,                      // d
    maps: Vec<VelocityMap>,          // scratch, one for each link
    motions: Vec<Motion>,            // scratch
    particle_rows: Option<DMatrix<f64>>, // n × d scratch, where there are particles
}

impl VelocityLayout {
    /// The layout of a mechanism's spanning tree.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Self {
        let (tree, particles) = (mechanism.tree().clone(), mechanism.particle_tree().clone());
        let (n, d) = (Constraints::dim(mechanism), tree.dof() + particles.dof());
        let (mut members, mut unknowns) = (Vec::<Member>::new(), Vec::new());
        let mut roots: Vec<Option<usize>> = Vec::new();
        for link in tree.links() {
            roots.push(match link.parent {
                Some(parent) => roots[parent],
                None => (link.joint.kind == PairKind::Free).then_some(roots.len()),
            });
            let start = unknowns.len();
            if let Some(parent) = link.parent {
                unknowns.extend_from_within(members[parent].columns.clone());
            }
            unknowns.extend(link.offset..link.offset + link.dof());
            let columns = start..unknowns.len();
            members.push(Member { span: Span { first: 12 * link.frame, size: 12 }, columns });
        }
        let description = mechanism.description();
        let count = description.particles.len();
        let mut particle_rows = None;
        if count > 0 {
            // which unknowns move a particle, from a configuration without symmetry
            let mut probe = DMatrix::zeros(n, d);
            let scattered: Vec<f64> = (0..n).map(|i| (1.0 + i as f64).sqrt().fract()).collect();
            particles.null_space(&scattered, &mut probe);
            for k in 0..count {
                let (first, size) = (mechanism.particle_offset(k), description.dimension);
                let start = unknowns.len();
                unknowns.extend((0..d).filter(|&j| probe.view((first, j), (size, 1)).amax() > 0.0));
                let columns = start..unknowns.len();
                members.push(Member { span: Span { first, size }, columns });
            }
            particle_rows = Some(probe);
        }
        let links = tree.links().len();
        Self {
            roots,
            parents: tree.links().iter().map(|link| link.parent).collect(),
            maps: vec![VelocityMap::new(Transfer::None, &[]); links],
            motions: vec![Motion::rest(); links],
            dim: n,
            dof: d,
            tree,
            particles,
            members,
            unknowns,
            particle_rows,
        }
    }

    /// Number of coordinates, `n`.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.dim
    }

    /// Number of unknowns, `d`.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Units and scales of the unknowns.
    #[must_use]
    pub fn blocks(&self) -> Vec<Block> {
        let mut blocks = self.tree.blocks();
        blocks.extend(self.particles.blocks());
        blocks
    }

    /// The unknowns of each joint, then of the point masses one by one.
    pub(super) fn groups(&self) -> Vec<Range<usize>> {
        let joints = self.tree.links().iter().map(|link| link.offset..link.offset + link.dof());
        let points = (self.tree.dof()..self.dof).map(|unknown| unknown..unknown + 1);
        joints.filter(|group| !group.is_empty()).chain(points).collect()
    }

    /// Storage for the columns at one configuration.
    #[must_use]
    pub fn columns(&self) -> Columns {
        Columns { q: vec![0.0; self.dim], twists: vec![Vector6::zeros(); self.unknowns.len()] }
    }

    /// `out ← P(q)`.
    pub fn null_space(&mut self, q: &[f64], out: &mut Columns) {
        self.tree.velocity_maps(q, &mut self.maps);
        if let Some(rows) = &mut self.particle_rows {
            rows.fill(0.0);
            self.particles.null_space(q, rows);
        }
        self.write(q, out);
    }

    /// `out ← P_in(q) P_ex` with `P_ex` of the given velocity maps, one for each link: discrete null spaces
    /// from averaged vectors.
    pub fn with_maps(&mut self, q: &[f64], maps: &[VelocityMap], out: &mut Columns) {
        self.maps.copy_from_slice(maps);
        if let Some(rows) = &mut self.particle_rows {
            rows.fill(0.0);
            self.particles.null_space(q, rows);
        }
        self.write(q, out);
    }

    /// `out ← ∂F_d/∂u (u, q_n)` for a reparametrized interval.
    pub fn tangent(&mut self, u: &[f64], s: &Interval, out: &mut Columns) {
        self.tree.tangents(u, &s.q1, &mut self.maps);
        if let Some(rows) = &mut self.particle_rows {
            rows.fill(0.0);
            self.particles.tangent(u, s, rows);
        }
        self.write(&s.q1, out);
    }

    fn write(&self, q: &[f64], out: &mut Columns) {
        out.q.copy_from_slice(q);
        for (k, map) in self.maps.iter().enumerate() {
            let mut at = self.members[k].columns.start;
            if let Some(parent) = self.parents[k] {
                for c in self.members[parent].columns.clone() {
                    out.twists[at] =
                        map.transfer.apply(&Twist::from_vector(&out.twists[c])).to_vector();
                    at += 1;
                }
            }
            for column in map.columns() {
                out.twists[at] = column.to_vector();
                at += 1;
            }
        }
        let Some(rows) = &self.particle_rows else { return };
        for member in &self.members[self.maps.len()..] {
            for c in member.columns.clone() {
                let row = |i: usize| rows[(member.span.first + i, self.unknowns[c])];
                out.twists[c] = Vector6::zeros();
                (0..member.span.size).for_each(|i| out.twists[c][i] = row(i));
            }
        }
    }

    /// `F_d(u, q_n)`: writes and closes the interval.
    ///
    /// # Errors
    /// [`Fault`] when `u` is outside the domain of the map.
    pub fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.tree.reparametrize(u, s, &mut self.motions)?;
        self.particles.reparametrize(u, s)?;
        s.close();
        Ok(())
    }

    /// `out ← Pᵀ w`, shape `d`.
    pub fn pull_back(&self, at: &Columns, w: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for member in &self.members {
            let wrench = member.span.shrink(&at.q, |i| w[member.span.first + i]);
            for c in member.columns.clone() {
                out[self.unknowns[c]] += at.twists[c].dot(&wrench);
            }
        }
    }

    /// The unknowns that move a link, and the twists they give it; without those that move the link `apex`,
    /// which must be its ancestor (or itself).
    pub(super) fn for_each_column(
        &self,
        at: &Columns,
        (link, apex): (usize, Option<usize>),
        mut visit: impl FnMut(usize, Twist),
    ) {
        // what moves the carrier comes first
        let shared = apex.map_or(0, |apex| self.members[apex].columns.len());
        for c in self.members[link].columns.clone().skip(shared) {
            visit(self.unknowns[c], Twist::from_vector(&at.twists[c]));
        }
    }

    /// `out ← P ν`, shape `n`.
    pub fn velocity(&self, at: &Columns, nu: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for member in &self.members {
            let mut twist = Vector6::zeros();
            for c in member.columns.clone() {
                twist += nu[self.unknowns[c]] * at.twists[c];
            }
            let own = member.span.first..member.span.first + member.span.size;
            if member.span.size == 12 {
                null_space::push_forward(&at.q[own.clone()], &twist, &mut out[own]);
            } else {
                out[own].copy_from_slice(&twist.as_slice()[..member.span.size]);
            }
        }
    }

    /// Screws of free roots into increments, see [`screws::to_increments`].
    pub(super) fn screws_to_increments(&self, q: &[f64], y: &mut [f64]) {
        screws::to_increments(&self.tree, q, y);
    }

    /// `J ← J ∂(u_φ, θ)/∂(y_φ, y_θ)` in the columns of free roots, at the screws `y` and the triads of
    /// `q`, see [`screws::chain`].
    pub(super) fn chain_screws(&self, q: &[f64], y: Option<&[f64]>, at: &mut Columns) {
        for (member, root) in self.members.iter().zip(&self.roots) {
            let Some(root) = root else { continue };
            // the unknowns of the root come first
            let own = &mut at.twists[member.columns.start..member.columns.start + 6];
            screws::chain(&self.tree.links()[*root], (q, y), own);
        }
    }

    /// See [`vi_constraints::Reparametrization::clean`].
    pub fn clean(&self, q: &mut [f64]) {
        self.tree.clean(q);
        self.particles.clean(q);
    }
}
