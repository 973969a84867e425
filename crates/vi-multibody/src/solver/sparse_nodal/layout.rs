//! The velocity map of a tree, column by column, with the configuration at which it is taken.
//!
//! ```text
//! t_α = Σ_k J_αk ν_k,     J_child = (X J_parent, S)
//! ```
//! Where the twists of free roots are separated, they stand in the place of the unknowns of the
//! roots, `t = R ν`: the columns of a root are then those of the identity, and those of its
//! descendants do not depend on the unknowns chosen.
//!
//! Letters: `J_αk` twist of member `α` by the unit rate of the unknown `k`; `R` map of a free root.
//! Source: theory §5.
#![allow(non_snake_case)] // J, R

use crate::mechanism::Mechanism;
use crate::pair::{FrameMotion, Twist, TwistTransfer, VelocityMap};
use crate::solver::member_blocks::Span;
use crate::solver::screws::{Flight, RootMap, RootScrew};
use crate::tree::particle::{Carrier, ParticleTree};
use crate::tree::{Tree, TreeLink};
use nalgebra::{Vector3, Vector6};
use std::ops::Range;
use vi_constraints::Constraints;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, UnknownBlock};
use vi_rigid::{null_space, rotation};

/// A frame or a particle: which coordinates it has and which unknowns move it.
#[derive(Clone, Debug)]
pub(super) struct LayoutMember {
    pub(super) span: Span,
    pub(super) columns: Range<usize>,
}

/// The velocity map of all members at one configuration, column by column.
#[derive(Clone, Debug)]
pub struct MapColumns {
    pub(super) q: Vec<f64>,               // n  where P_in is taken
    pub(super) twists: Vec<Vector6<f64>>, // one for each member and each unknown that moves it
    pub(super) roots: Vec<RootMap>,       // of free roots, where their twists are separated
}

/// A tree of frames and particles as a sparse velocity map.
#[derive(Debug)]
pub struct VelocityLayout {
    tree: Tree,
    particles: ParticleTree,
    pub(super) members: Vec<LayoutMember>, // links in the order of the tree, then particles
    parents: Vec<Option<usize>>,           // of members
    free: Vec<usize>,                      // links that are free roots
    roots: Vec<Option<usize>>,             // of links: their place among these
    pub(super) unknowns: Vec<usize>,       // unknown of each column
    dim: usize,                            // n
    dof: usize,                            // d
    maps: Vec<VelocityMap>,                // scratch, one for each member
    motions: Vec<FrameMotion>,             // scratch, one for each link
}

fn is_free_root(link: &TreeLink) -> bool {
    link.parent.is_none() && link.joint.kind.is_free()
}

impl VelocityLayout {
    /// The layout of a mechanism's spanning tree.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Self {
        let (tree, particles) = (mechanism.tree().clone(), mechanism.particle_tree().clone());
        let (n, d) = (Constraints::dim(mechanism), tree.dof() + particles.dof());
        let (mut members, mut unknowns) = (Vec::<LayoutMember>::new(), Vec::new());
        let (mut free, mut roots) = (Vec::new(), Vec::<Option<usize>>::new());
        for (k, link) in tree.links().iter().enumerate() {
            let is_free = is_free_root(link);
            roots.push(link.parent.map_or(is_free.then_some(free.len()), |parent| roots[parent]));
            free.extend(is_free.then_some(k));
            let start = unknowns.len();
            if let Some(parent) = link.parent {
                unknowns.extend_from_within(members[parent].columns.clone());
            }
            unknowns.extend(link.offset..link.offset + link.dof());
            let columns = start..unknowns.len();
            members.push(LayoutMember { span: Span { first: 12 * link.frame, size: 12 }, columns });
        }
        let links = tree.links().len();
        let mut parents: Vec<_> = tree.links().iter().map(|link| link.parent).collect();
        for bead in particles.beads() {
            let carrier = match bead.carrier {
                Carrier::Particle(k) => Some(links + k),
                Carrier::Free | Carrier::Ground(_) => None,
            };
            let start = unknowns.len();
            if let Some(carrier) = carrier {
                unknowns.extend_from_within(members[carrier].columns.clone());
            }
            unknowns.extend(bead.unknown..bead.unknown + particles.dof_of(bead));
            parents.push(carrier);
            let span = Span { first: bead.offset, size: particles.dimension() };
            members.push(LayoutMember { span, columns: start..unknowns.len() });
        }
        Self {
            free,
            roots,
            parents,
            maps: vec![VelocityMap::new(TwistTransfer::None, &[]); members.len()],
            motions: vec![FrameMotion::rest(); links],
            dim: n,
            dof: d,
            tree,
            particles,
            members,
            unknowns,
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
    pub fn blocks(&self) -> Vec<UnknownBlock> {
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
    pub fn columns(&self) -> MapColumns {
        let (q, twists) = (vec![0.0; self.dim], vec![Vector6::zeros(); self.unknowns.len()]);
        MapColumns { q, twists, roots: Vec::new() }
    }

    /// The same, with the twists of free roots separated.
    pub(super) fn separated_columns(&self) -> MapColumns {
        MapColumns { roots: vec![RootMap::identity(); self.free.len()], ..self.columns() }
    }

    /// Whether a member is a free root.
    pub(super) fn is_root(&self, member: usize) -> bool {
        self.free.binary_search(&member).is_ok()
    }

    /// The free roots, each with its first unknown.
    pub(super) fn free_roots(&self) -> impl Iterator<Item = &TreeLink> {
        self.free.iter().map(|&k| &self.tree.links()[k])
    }

    /// `X, S` of all members at `q`.
    fn take_velocity_maps(&mut self, q: &[f64]) {
        let (of_links, of_points) = self.maps.split_at_mut(self.motions.len());
        self.tree.velocity_maps(q, of_links);
        self.particles.velocity_maps(q, of_points);
    }

    /// `out ← P(q)`.
    pub fn null_space(&mut self, q: &[f64], out: &mut MapColumns) {
        self.take_velocity_maps(q);
        self.write_with_roots(q, out);
    }

    /// `out ← P_in(q) P_ex` with `P_ex` of the given velocity maps, one for each link: discrete
    /// null spaces from averaged vectors.
    pub fn with_maps(&mut self, q: &[f64], maps: &[VelocityMap], out: &mut MapColumns) {
        let (of_links, of_points) = self.maps.split_at_mut(self.motions.len());
        of_links.copy_from_slice(maps);
        self.particles.velocity_maps(q, of_points);
        self.write_with_roots(q, out);
    }

    /// `out ← ∂F_d/∂u (u, q_n)` for a reparametrized interval.
    pub fn tangent(&mut self, u: &[f64], s: &Interval, out: &mut MapColumns) {
        let (of_links, of_points) = self.maps.split_at_mut(self.motions.len());
        self.tree.tangents(u, &s.q1, of_links);
        self.particles.tangents(u, s, of_points);
        self.write_with_roots(&s.q1, out);
    }

    /// `out ← P(q)` with screws as the unknowns of free roots.
    pub(super) fn null_space_by_screws(&mut self, q: &[f64], out: &mut MapColumns) {
        self.take_velocity_maps(q);
        self.write(q, out);
        for (root, &k) in out.roots.iter_mut().zip(&self.free) {
            *root = RootMap::at_rest(&q[12 * self.tree.links()[k].frame..]);
        }
    }

    /// `out ← ∂F_d/∂y` with the `screws` of free roots, which belong to the increments `u`.
    pub(super) fn tangent_by_screws(
        &mut self,
        u: &[f64],
        screws: &[RootScrew],
        s: &Interval,
        out: &mut MapColumns,
    ) {
        let links = self.tree.links().iter().zip(&mut self.maps);
        for (link, map) in links.filter(|(link, _)| !is_free_root(link)) {
            let own = &u[link.offset..link.offset + link.dof()];
            let at = self.tree.configuration(link, &s.q1);
            link.joint.kind.write_tangent(own, &at, map);
        }
        self.particles.tangents(u, s, &mut self.maps[self.motions.len()..]);
        self.write(&s.q1, out);
        let maps = screws.iter().map(RootScrew::root_map);
        out.roots.iter_mut().zip(maps).for_each(|(root, map)| *root = map);
    }

    /// The columns of all members, and the maps of the roots that are separated.
    fn write_with_roots(&self, q: &[f64], out: &mut MapColumns) {
        self.write(q, out);
        for (root, &k) in out.roots.iter_mut().zip(&self.free) {
            *root = RootMap::of(self.maps[k].columns());
        }
    }

    fn write(&self, q: &[f64], out: &mut MapColumns) {
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
            if !out.roots.is_empty() && self.is_root(k) {
                (0..6).for_each(|i| out.twists[at + i] = Vector6::ith(i, 1.0));
                continue;
            }
            for column in map.columns() {
                out.twists[at] = column.to_vector();
                at += 1;
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
    pub fn pull_back(&self, at: &MapColumns, w: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for member in &self.members {
            let wrench = member.span.shrink(&at.q, |i| w[member.span.first + i]);
            for c in member.columns.clone() {
                out[self.unknowns[c]] += at.twists[c].dot(&wrench);
            }
        }
        self.apply_roots_transposed(at, out);
    }

    /// The map of the free root that carries a member, with the first unknown of the root.
    fn root_of(&self, at: &MapColumns, member: usize) -> Option<(RootMap, usize)> {
        let root = self.roots.get(member).copied().flatten()?;
        let map = at.roots.get(root)?;
        Some((*map, self.tree.links()[self.free[root]].offset))
    }

    /// The unknowns that move a link, and the twists they give it; without those that move the link
    /// `apex`, which must be its ancestor (or itself).
    pub(super) fn for_each_column(
        &self,
        at: &MapColumns,
        link: usize,
        apex: Option<usize>,
        mut visit: impl FnMut(usize, Twist),
    ) {
        // what moves the carrier comes first, and what moves the root before all
        let mut shared = apex.map_or(0, |apex| self.members[apex].columns.len());
        let columns = self.members[link].columns.clone();
        if let Some((map, unknown)) = self.root_of(at, link).filter(|_| shared == 0) {
            let (R, J) = (map.matrix(), &at.twists[columns.start..]);
            for k in 0..6 {
                let twist: Vector6<f64> = (0..6).map(|l| J[l] * R[(l, k)]).sum();
                visit(unknown + k, Twist::from_vector(&twist));
            }
            shared = 6;
        }
        for c in columns.skip(shared) {
            visit(self.unknowns[c], Twist::from_vector(&at.twists[c]));
        }
    }

    /// `x ← R x` of free roots: twists from components along the directors.
    pub(super) fn apply_roots(&self, at: &MapColumns, x: &mut [f64]) {
        for (root, map) in self.free_roots().zip(&at.roots) {
            let own = &mut x[root.offset..root.offset + 6];
            let twist = map.apply(own);
            own.copy_from_slice(twist.as_slice());
        }
    }

    /// `x ← Rᵀ x` of free roots, the inverse where no increment is taken.
    pub(super) fn apply_roots_transposed(&self, at: &MapColumns, x: &mut [f64]) {
        for (root, map) in self.free_roots().zip(&at.roots) {
            map.apply_transposed(&mut x[root.offset..root.offset + 6]);
        }
    }

    /// `x ←` the change of the increments `u` that lead to `q`, from rates at `q`, those of free
    /// roots along their directors: `T(θ)⁻¹` of rotation vectors.
    pub(super) fn material_rates_to_increments(&self, q: &[f64], u: &[f64], x: &mut [f64]) {
        for (k, link) in self.tree.links().iter().enumerate() {
            let Some(turning) = link.joint.kind.rotation_vector() else { continue };
            let at = link.offset + turning;
            if self.is_root(k) {
                let twist = RootMap::at_rest(&q[12 * link.frame..]).apply(&x[at - 3..at + 3]);
                x[at - 3..at + 3].copy_from_slice(twist.as_slice());
            }
            let read = |x: &[f64]| Vector3::new(x[at], x[at + 1], x[at + 2]);
            let rate = rotation::untangent(&read(u), &read(x));
            x[at..at + 3].copy_from_slice(rate.as_slice());
        }
    }

    /// `u ←` the increment of `first` and then `u`.
    pub(super) fn compose(&self, first: &[f64], u: &mut [f64]) {
        self.tree.compose(first, u);
        let points = self.tree.dof()..self.dof;
        u[points.clone()].iter_mut().zip(&first[points]).for_each(|(u, first)| *u += first);
    }

    /// `out ← P ν`, shape `n`.
    pub fn velocity(&self, at: &MapColumns, nu: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (k, member) in self.members.iter().enumerate() {
            let (mut twist, mut columns) = (Vector6::zeros(), member.columns.clone());
            if let Some((map, unknown)) = self.root_of(at, k) {
                let rates = map.apply(&nu[unknown..unknown + 6]);
                let of_root = columns.by_ref().take(6).zip(rates.iter());
                of_root.for_each(|(c, rate)| twist += *rate * at.twists[c]);
            }
            for c in columns {
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

    /// Number of frames.
    pub(super) fn frames(&self) -> usize {
        self.tree.links().len()
    }

    /// The screws `y` of free roots at `q`, and the increments in their place.
    pub(super) fn screws_to_increments(
        &self,
        flight: &Flight,
        q: &[f64],
        y: &mut [f64],
        screws: &mut [RootScrew],
    ) {
        for (root, screw) in self.free_roots().zip(screws) {
            let own = &mut y[root.offset..root.offset + 6];
            *screw = RootScrew::new(&q[12 * root.frame..], own);
            screw.write_increment(flight, own);
        }
    }

    /// See [`vi_constraints::Reparametrization::clean`].
    pub fn clean(&self, q: &mut [f64]) {
        self.tree.clean(q);
        self.particles.clean(q);
    }
}
