//! The nodal scheme on deep trees whose members are coupled by potentials, and on trees of point
//! masses: descriptor form.
//!
//! The matrix `A = P_exᵀ B P'_ex`, `B = P_inᵀ K P_in'`, is dense where members have many ancestors.
//! With the twists `t` and the wrenches `f` of all members as unknowns beside `x`, `A x = r` is
//! sparse:
//! ```text
//! t_α − X'_α t_parent − S'_α x_α           = 0
//! f_α − Σ_β B_αβ t_β − Σ_children X_βᵀ f_β = 0
//! S_αᵀ f_α                                 = r_α
//! ```
//! The wrenches of many children are added one after the other, `g_k = g_{k−1} + X_kᵀ f_k`, and the
//! twist of their parent is passed on, `t'_k = t'_{k−1}`, so that no row and no column grows with
//! the number of bodies on a hub. Rows and columns are scaled by powers of two near
//! `|B_αα,ii|^{−1/2}` and by those of the columns of `S'`. One symbolic LU for ever; time and
//! memory are linear in the number of members where each is coupled to few. Pivoting may enlarge
//! the fill, and then allocates.
//!
//! Letters: `X`, `S` velocity map of a joint at `q_n`; `X'`, `S'` tangent at `q_{n+1}`; `K` the
//! mixed derivative.
//!
//! Source: theory §5; sparse systems over the coordinates of all bodies after D. Negrut, R. Serban,
//! F. A. Potra, Mech. Struct. Mach. 25 (1997).
#![allow(non_snake_case)] // B, K, S, X

use crate::mechanism::Mechanism;
use crate::pair::{FrameMotion, Twist, TwistTransfer, VelocityMap};
use crate::solver::member_blocks::{MemberBlocks, Span};
use crate::solver::screws::{self, Flight};
use crate::solver::sparse_nodal::{extent, with_floors};
use crate::tree::Tree;
use crate::tree::particle::{Carrier, ParticleTree};
use nalgebra::Vector6;
use vi_constraints::node_solvers::RateOperators;
use vi_constraints::reparametrization::{Emission, LastStep};
use vi_constraints::{Constraints, NodalOperators};
use vi_core::block_lu::inverse_root;
use vi_core::interval::Interval;
use vi_core::linear::SparseLu;
use vi_core::newton::{Fault, Precision, UnknownBlock};
use vi_core::sparse::{Entries, SparseMatrix};
use vi_core::state::Memory;
use vi_rigid::null_space;

crate::opaque_debug!(TreeDescriptor);

/// Children beyond which twist and wrench of a member are passed from one child to the next.
const FEW: usize = 4;

/// A frame or a point mass of the tree.
#[derive(Clone, Copy, Debug)]
struct DescriptorMember {
    parent: Option<usize>,
    width: usize,          // 6 of a frame, 2 or 3 of a point mass: size of its twist
    unknown: usize,        // first of its joint
    start: usize, // of its t and f, then g and t', among the unknowns of the descriptor form
    before: Option<usize>, // the child of the same parent before it
    chained: bool, // whether its parent has many
    last: Option<usize>, // its last child, where it has many
}

impl DescriptorMember {
    fn twist(&self, i: usize) -> usize {
        self.start + i
    }

    fn wrench(&self, i: usize) -> usize {
        self.start + self.width + i
    }

    /// `g`: the sum of wrenches of its parent's children up to this one.
    fn sum(&self, i: usize) -> usize {
        self.start + 2 * self.width + i
    }

    /// `t'`: the twist of its parent, once more.
    fn copy(&self, i: usize) -> usize {
        self.start + 3 * self.width + i
    }
}

/// [`NodalOperators`] of a tree of frames and point masses, coupled or not, in descriptor form.
pub struct TreeDescriptor {
    tree: Tree,
    particles: ParticleTree,
    members: Vec<DescriptorMember>, // links in the order of the tree, then particles
    spans: Vec<Span>,
    blocks: Vec<UnknownBlock>,
    dof: usize,                // d
    size: usize,               // of the descriptor form
    left: Vec<VelocityMap>,    // X, S at q_n, or the tangent of the last step
    right: Vec<VelocityMap>,   // X', S'
    q: Vec<f64>,               // n  where P_in of `left` is taken
    twists: Vec<Twist>,        // scratch, one for each member
    motions: Vec<FrameMotion>, // scratch, one for each link
    screws: bool,              // the unknowns of free roots
    flight: Flight,
    u: Vec<f64>, // d  increments of the unknowns
    matrix: Descriptor,
}

/// The matrix with its factorization.
#[derive(Default)]
struct Descriptor {
    couplings: MemberBlocks,
    scale: Vec<Vector6<f64>>, // of the wrenches of each member, powers of two
    unit: Vec<f64>,           // d  of the unknowns
    factors: Option<(SparseMatrix, SparseLu)>,
    x: Vec<f64>,
}

/// Members of a spanning tree, and the number of unknowns in descriptor form without those of
/// joints.
fn members(tree: &Tree, particles: &ParticleTree) -> (Vec<DescriptorMember>, usize) {
    let links = tree.links().iter().map(|link| (link.parent, 6, link.offset));
    let first = tree.links().len();
    let beads = particles.beads().iter().map(|bead| {
        let parent = match bead.carrier {
            Carrier::Particle(k) => Some(first + k),
            Carrier::Free | Carrier::Ground(_) => None,
        };
        (parent, particles.dimension(), bead.unknown)
    });
    let all: Vec<(Option<usize>, usize, usize)> = links.chain(beads).collect();
    let mut children = vec![0; all.len()];
    all.iter().filter_map(|member| member.0).for_each(|parent| children[parent] += 1);
    let mut members: Vec<DescriptorMember> = Vec::new();
    let mut start = 0;
    for (k, (parent, width, unknown)) in all.into_iter().enumerate() {
        let carrier = parent.filter(|&p| children[p] > FEW);
        let before = carrier.and_then(|p| members[p].last.replace(k));
        let chained = carrier.is_some();
        members.push(DescriptorMember {
            parent,
            width,
            unknown,
            start,
            before,
            chained,
            last: None,
        });
        start += if chained { 4 * width } else { 2 * width };
    }
    (members, start)
}

impl TreeDescriptor {
    /// Operators for the spanning tree of a mechanism.
    #[must_use]
    pub fn new(mechanism: &Mechanism) -> Self {
        let (tree, particles) = (mechanism.tree().clone(), mechanism.particle_tree().clone());
        let (members, size) = members(&tree, &particles);
        let frames = tree.links().iter().map(|link| Span { first: 12 * link.frame, size: 12 });
        let point = |first| Span { first, size: particles.dimension() };
        let points = particles.beads().iter().map(|bead| point(bead.offset));
        let spans = frames.chain(points).collect();
        let mut blocks = tree.blocks();
        blocks.extend(particles.blocks());
        let (dof, count) = (tree.dof() + particles.dof(), members.len());
        let maps = || vec![VelocityMap::new(TwistTransfer::None, &[]); count];
        Self {
            motions: vec![FrameMotion::rest(); tree.links().len()],
            tree,
            particles,
            members,
            spans,
            blocks,
            dof,
            size: size + dof,
            left: maps(),
            right: maps(),
            q: vec![0.0; mechanism.dim()],
            twists: vec![Twist::zero(); count],
            screws: false,
            flight: Flight::default(),
            u: vec![0.0; dof],
            matrix: Descriptor::default(),
        }
    }

    /// For stiff couplings between frames at `q`, elements above all: see
    /// [`for_elements`](crate::sparse_nodal::SparseNodal::for_elements).
    #[must_use]
    pub fn for_elements(mut self, q: &[f64]) -> Self {
        let length = 1e-5 * extent(&q[..12 * self.tree.links().len()]).max(1e-5);
        with_floors(&mut self.blocks, length, 1e-5);
        self.screws = true;
        self
    }

    /// See [`in_flight`](crate::sparse_nodal::SparseNodal::in_flight).
    #[must_use]
    pub fn in_flight(mut self, mechanism: &Mechanism, mass: &SparseMatrix) -> Self {
        self.flight = Flight::new(mechanism, mass);
        self
    }

    /// `self.u ←` the increments that belong to the unknowns.
    fn increments(&mut self, unknowns: &[f64], q_n: &[f64]) {
        self.u.copy_from_slice(unknowns);
        if self.screws {
            screws::to_increments(&self.tree, &self.flight, q_n, &mut self.u);
        }
    }

    /// `self.right ← ∂F_d/∂u` at the unknowns `u`.
    fn take_tangent(&mut self, u: &[f64], s: &Interval) {
        self.increments(u, &s.q0);
        let (frames, points) = self.right.split_at_mut(self.motions.len());
        self.tree.tangents(&self.u, &s.q1, &mut *frames);
        self.particles.tangents(&self.u, s, points);
        if self.screws {
            chain_screws(&self.tree, &s.q0, Some(u), frames);
        }
    }

    /// `B` of each member with itself and with those that it is coupled to, and the scales.
    fn take_couplings(&mut self, emit: &Emission<'_>, q_next: &[f64]) {
        let Descriptor { couplings, scale, unit, .. } = &mut self.matrix;
        if couplings.is_empty() {
            couplings.analyse(self.q.len(), &self.spans, emit);
            *scale = vec![Vector6::repeat(1.0); self.members.len()];
            *unit = vec![1.0; self.dof];
        }
        couplings.fill(emit, (&self.q, q_next));
        for (coupling, own) in couplings.reduced().filter(|(c, _)| c.row == c.column) {
            scale[coupling.row] = own.diagonal().map(inverse_root);
        }
        for ((member, map), scale) in self.members.iter().zip(&self.right).zip(&*scale) {
            for (k, column) in map.columns().iter().enumerate() {
                let size = column.to_vector().component_div(scale).amax();
                unit[member.unknown + k] = inverse_root(size * size);
            }
        }
    }

    /// Emits the matrix: always the same places in the same order.
    fn emit(&self, out: &mut dyn Entries) {
        let Descriptor { couplings, scale, unit, .. } = &self.matrix;
        let first = self.size - self.dof; // of x
        for (k, member) in self.members.iter().enumerate() {
            let (right, left, own) = (&self.right[k], &self.left[k], &scale[k]);
            for i in 0..member.width {
                out.add(member.twist(i), member.twist(i), 1.0);
                out.add(member.wrench(i), member.wrench(i), 1.0);
            }
            for (j, (r, l)) in right.columns().iter().zip(left.columns()).enumerate() {
                let unknown = member.unknown + j;
                let (r, l) = (r.to_vector(), l.to_vector());
                for i in 0..member.width {
                    let unit = unit[unknown] / own[i];
                    out.add(member.twist(i), first + unknown, -unit * r[i]);
                    out.add(first + unknown, member.wrench(i), unit * l[i]);
                }
            }
            if let Some(parent) = member.parent {
                self.emit_joint(k, parent, out);
            }
            if let Some(child) = member.last {
                let child = &self.members[child];
                (0..member.width).for_each(|i| out.add(member.wrench(i), child.sum(i), -1.0));
            }
        }
        for (coupling, B) in couplings.reduced() {
            let (row, column) = (coupling.row, coupling.column);
            let (a, b) = (&self.members[row], &self.members[column]);
            for j in 0..b.width {
                for i in 0..a.width {
                    let value = scale[row][i] * B[(i, j)] * scale[column][j];
                    out.add(a.wrench(i), b.twist(j), -value);
                }
            }
        }
    }

    /// What a member has of its parent's twist, and its parent of its wrench.
    fn emit_joint(&self, k: usize, parent: usize, out: &mut dyn Entries) {
        let scale = &self.matrix.scale;
        let (member, carrier) = (&self.members[k], &self.members[parent]);
        let chained = member.chained;
        let twist = |j| if chained { member.copy(j) } else { carrier.twist(j) };
        let wrench = |j| if chained { member.sum(j) } else { carrier.wrench(j) };
        for i in (0..carrier.width).filter(|_| chained) {
            let before = member.before.map(|before| &self.members[before]);
            out.add(member.sum(i), member.sum(i), 1.0);
            out.add(member.copy(i), member.copy(i), 1.0);
            out.add(member.copy(i), before.map_or(carrier.twist(i), |m| m.copy(i)), -1.0);
            if let Some(before) = before {
                out.add(member.sum(i), before.sum(i), -1.0);
            }
        }
        for_each_entry(&self.right[k].transfer, member.width, |i, j, x| {
            out.add(member.twist(i), twist(j), -x * scale[parent][j] / scale[k][i]);
        });
        for_each_entry(&self.left[k].transfer, member.width, |i, j, x| {
            out.add(wrench(j), member.wrench(i), -x * scale[parent][j] / scale[k][i]);
        });
    }
}

/// Takes screws as the unknowns of free roots in their velocity maps.
fn chain_screws(tree: &Tree, q: &[f64], y: Option<&[f64]>, maps: &mut [VelocityMap]) {
    for (link, map) in tree.links().iter().zip(maps) {
        if link.joint.kind.is_free() {
            let mut columns = map.s.map(|twist| twist.to_vector());
            screws::chain(link, q, y, &mut columns);
            map.s = columns.map(|column| Twist::from_vector(&column));
        }
    }
}

/// The entries `X_ij` of a transfer between twists of the given size, zeros of its pattern
/// included.
fn for_each_entry(
    transfer: &TwistTransfer,
    width: usize,
    mut visit: impl FnMut(usize, usize, f64),
) {
    let (a, angular) = match transfer {
        TwistTransfer::Rigid(a) => (a, 6),
        TwistTransfer::Point(a) => (a, 3),
        TwistTransfer::None => return,
    };
    (0..angular.min(width)).for_each(|i| visit(i, i, 1.0));
    if width == 6 {
        // ω × a
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            visit(i, 3 + j, a[k]);
            visit(i, 3 + k, -a[j]);
        }
    }
}

impl NodalOperators for TreeDescriptor {
    fn dof(&self) -> usize {
        self.dof
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn take_momentum(&mut self, p: &[f64], h: f64) {
        self.flight.open(self.tree.links().len(), p, h);
    }

    fn begin(&mut self, s: &Interval, _memory: &Memory, last: Option<LastStep<'_>>) {
        self.q.copy_from_slice(&s.q0);
        if let Some(last) = last {
            self.take_tangent(last.u, last.s);
            std::mem::swap(&mut self.left, &mut self.right);
            return;
        }
        let (frames, points) = self.left.split_at_mut(self.motions.len());
        self.tree.velocity_maps(&s.q0, &mut *frames);
        self.particles.velocity_maps(&s.q0, points);
        if self.screws {
            chain_screws(&self.tree, &s.q0, None, frames);
        }
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.increments(u, &s.q0);
        self.tree.reparametrize(&self.u, s, &mut self.motions)?;
        self.particles.reparametrize(&self.u, s)?;
        s.close();
        Ok(())
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        let Self { twists: wrenches, members, spans, left, q, .. } = self;
        wrenches.fill(Twist::zero());
        for (k, member) in members.iter().enumerate().rev() {
            let span = &spans[k];
            let own = span.shrink(q, |i| w[span.first + i]);
            wrenches[k].add_scaled(1.0, &Twist::from_vector(&own));
            let (wrench, map) = (wrenches[k], &left[k]);
            for (column, r) in map.columns().iter().zip(&mut out[member.unknown..]) {
                *r = column.dot(&wrench);
            }
            if let Some(parent) = member.parent {
                wrenches[parent].add_scaled(1.0, &map.transfer.apply_transposed(&wrench));
            }
        }
    }

    fn solve(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        self.take_tangent(u, s);
        self.take_couplings(mixed, &s.q1);
        let (first, size) = (self.size - self.dof, self.size);
        let mut factors = self.matrix.factors.take();
        let emit = |out: &mut dyn Entries| self.emit(out);
        match &mut factors {
            Some((matrix, _)) => matrix.refill(emit),
            None => {
                let matrix = SparseMatrix::assemble(size, size, emit);
                let lu = SparseLu::new(&matrix)?;
                factors = Some((matrix, lu));
            }
        }
        self.matrix.factors = factors;
        let Descriptor { unit, factors, x: all, .. } = &mut self.matrix;
        let (matrix, lu) = factors.as_mut().expect("just written");
        all.resize(size, 0.0);
        all[..first].fill(0.0);
        let scaled = all[first..].iter_mut().zip(x.iter().zip(&*unit));
        scaled.for_each(|(all, (x, unit))| *all = x * unit);
        lu.solve(matrix, all)?;
        let scaled = x.iter_mut().zip(all[first..].iter().zip(&*unit));
        scaled.for_each(|(x, (all, unit))| *x = all * unit);
        Ok(())
    }

    /// Screws are components along the directors of `q_n`.
    fn carry_balance(&self, r: &mut [f64]) {
        if self.screws {
            r.fill(0.0);
        }
    }

    fn precision(&self) -> Precision {
        Precision::of_balances_if(!self.screws)
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.tree.clean(q);
        self.particles.clean(q);
    }
}

impl RateOperators for TreeDescriptor {
    fn push_forward(&mut self, nu: &[f64], v: &mut [f64]) {
        let Self { twists, members, spans, left, q, .. } = self;
        for (k, (member, span)) in members.iter().zip(spans).enumerate() {
            let map = &left[k];
            let mut twist = member.parent.map_or(Twist::zero(), |p| map.transfer.apply(&twists[p]));
            for (column, rate) in map.columns().iter().zip(&nu[member.unknown..]) {
                twist.add_scaled(*rate, column);
            }
            twists[k] = twist;
            let own = span.first..span.first + span.size;
            match span.size {
                12 => null_space::push_forward(&q[own.clone()], &twist.to_vector(), &mut v[own]),
                size => v[own].copy_from_slice(&twist.linear.as_slice()[..size]),
            }
        }
    }
}
