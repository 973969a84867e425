//! The Newton step of the nodal scheme on trees in linear time.
//!
//! When the potential couples no two bodies, but along joint coordinates of the tree,
//! `D_2(D_1 L_d + f_d^-)` is block diagonal and the Newton matrix is
//! `Dr = P_ex(q_n)ᵀ blockdiag(A_α) P'_ex`, with the 6×6 blocks
//! ```text
//! A_α  = P_in(q_n)ᵀ [D_2(D_1 L_d + f_d^-)]_αα P_in(q_{n+1})
//! Â_α  = A_α + Σ_c X_cᵀ [Â_c − Â_c S'_c D_c⁻¹ S_cᵀ Â_c] X'_c,   D_c = S_cᵀ Â_c S'_c      leaf → root
//! u_c  = r_c − S_cᵀ p_c,   p_parent += X_cᵀ (p_c + Â_c S'_c D_c⁻¹ u_c)                   leaf → root
//! δτ_c = D_c⁻¹ (u_c − S_cᵀ Â_c X'_c δt'_parent),   δt'_c = X'_c δt'_parent + S'_c δτ_c    root → leaf
//! ```
//! `X, S` belong to `q_n`, `X', S'` to `q_{n+1}` with the tangent maps of the increments; the
//! matrix is not symmetric. Work and memory are linear in the number of bodies, nothing is
//! allocated.
//!
//! Springs and dampers between points may couple a body with its parent by the blocks
//! `B_c = A_{c,parent}` and `C_c = A_{parent,c}`. Then
//! ```text
//! y_c = X_cᵀ Â_c S'_c + C_c S'_c,   z_cᵀ = S_cᵀ Â_c X'_c + S_cᵀ B_c
//! Â_parent += X_cᵀ Â_c X'_c + X_cᵀ B_c + C_c X'_c − y_c D_c⁻¹ z_cᵀ                        leaf → root
//! p_parent += X_cᵀ p_c + y_c D_c⁻¹ u_c,   δτ_c = D_c⁻¹ (u_c − z_cᵀ δt'_parent)           [5.31]
//! ```
//!
//! Source: LMO08 §5 for the matrix; the elimination is the articulated-body recursion of
//! Featherstone, Rigid Body Dynamics Algorithms, §7, without symmetry.
#![allow(non_snake_case)] // A, B, C, D, X, S

use crate::geometry::spatial::SpatialMatrix;
use crate::pair::{MAX_DOF, Motion, Transfer, Twist, VelocityMap};
use crate::solver::body_blocks::{BodyBlocks, NearBlocks};
use crate::tree::Tree;
use vi_constraints::reparametrization::{Emission, LastStep};
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault};
use vi_core::sparse::Entries;
use vi_rigid::null_space;

/// What a link needs during a step, side by side in memory.
#[derive(Clone, Copy, Debug)]
struct LinkWork {
    at: VelocityMap,              // X, S at q_n
    next: VelocityMap,            // X', S' at q_{n+1}
    AS: [Twist; MAX_DOF],         // columns of Â S'
    SA: [Twist; MAX_DOF],         // rows of Sᵀ Â
    D: [[f64; MAX_DOF]; MAX_DOF], // D⁻¹
}

/// Columns and rows of a joint that is eliminated, with what couples its link with the parent.
#[derive(Clone, Copy, Debug)]
struct NearLink {
    y: [Twist; MAX_DOF], // Xᵀ Â S' + C S'
    z: [Twist; MAX_DOF], // rows of Sᵀ Â X' + Sᵀ B
}

/// What couples bodies with their parents.
#[derive(Debug)]
struct Near {
    B: Vec<SpatialMatrix>, // rows of each link, columns of its parent
    C: Vec<SpatialMatrix>, // rows of its parent, columns of each link
    links: Vec<NearLink>,
}

/// Factorization `P_ex(q_n)ᵀ blockdiag(A_α) P'_ex` of a tree.
#[derive(Debug)]
pub struct Articulated {
    tree: Tree,
    blocks: Vec<Block>,
    links: Vec<LinkWork>,
    A: Vec<SpatialMatrix>, // A_α, then Â_α
    along: Vec<f64>,       // on the diagonal of each unknown, beside A
    near: Option<Near>,    // where bodies are coupled with their parents
    motions: Vec<Motion>,  // scratch
    wrenches: Vec<Twist>,  // p_c, then δt'
}

impl Articulated {
    /// For a tree of frames.
    #[must_use]
    pub fn new(tree: Tree) -> Self {
        let count = tree.links().len();
        let map = VelocityMap::new(Transfer::None, &[]);
        let zero = [Twist::zero(); MAX_DOF];
        let work =
            LinkWork { at: map, next: map, AS: zero, SA: zero, D: [[0.0; MAX_DOF]; MAX_DOF] };
        Self {
            blocks: tree.blocks(),
            along: vec![0.0; tree.dof()],
            tree,
            links: vec![work; count],
            A: vec![SpatialMatrix::zero(); count],
            near: None,
            motions: vec![Motion::rest(); count],
            wrenches: vec![Twist::zero(); count],
        }
    }

    /// Whether the Newton matrix of `system` is block diagonal, so that the recursion applies.
    #[must_use]
    pub fn applies(&mut self, system: &impl DiscreteLagrangian, s: &Interval) -> bool {
        !self.assemble(&|out: &mut dyn Entries| system.forced_d2_d1(s, out), s)
    }

    /// Whether it applies with blocks between bodies and their parents, which it has from now on,
    /// where it does.
    #[must_use]
    pub fn applies_near(&mut self, mixed: &Emission<'_>, s: &Interval) -> bool {
        let zeros = || vec![SpatialMatrix::zero(); self.links.len()];
        let none = [Twist::zero(); MAX_DOF];
        let links = vec![NearLink { y: none, z: none }; self.links.len()];
        self.near = Some(Near { B: zeros(), C: zeros(), links });
        let applies = !self.assemble(mixed, s);
        self.near = self.near.take().filter(|_| applies);
        applies
    }

    /// Units and scales of the increments.
    #[must_use]
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The tree.
    #[must_use]
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// `X, S` of one link at `q_n`.
    #[must_use]
    pub fn map_at(&self, link: usize) -> &VelocityMap {
        &self.links[link].at
    }

    /// `X', S'` of one link at `q_{n+1}`.
    #[must_use]
    pub fn map_next(&self, link: usize) -> &VelocityMap {
        &self.links[link].next
    }

    /// The link of a frame.
    #[must_use]
    pub fn link_of(&self, frame: usize) -> usize {
        self.tree.link_of()[frame]
    }

    /// `A_α`, to be written.
    #[cfg(test)]
    pub(crate) fn blocks_mut(&mut self) -> impl Iterator<Item = &mut SpatialMatrix> {
        self.A.iter_mut()
    }

    /// Computes `X, S` at `q_n`; with a `last` step those of its `∂F_d/∂u`.
    pub fn begin_at(&mut self, q: &[f64], last: Option<LastStep<'_>>) {
        match last {
            Some(last) => {
                let maps = self.links.iter_mut().map(|link| &mut link.at);
                self.tree.tangents(last.u, &last.s.q1, maps);
            }
            None => self.tree.velocity_maps(q, self.links.iter_mut().map(|link| &mut link.at)),
        }
    }

    /// `X', S'` of `q_{n+1} = q_n`: those of `q_n`.
    pub(crate) fn stand(&mut self) {
        self.links.iter_mut().for_each(|link| link.next = link.at);
    }

    /// Computes `X', S'` at `q_{n+1}`.
    pub fn tangent(&mut self, u: &[f64], q1: &[f64]) {
        self.tree.tangents(u, q1, self.links.iter_mut().map(|link| &mut link.next));
    }

    /// The pair maps, root first.
    ///
    /// # Errors
    /// [`Fault`].
    pub fn move_to(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.tree.reparametrize(u, s, &mut self.motions)?;
        s.close();
        Ok(())
    }

    /// `out ← P(q_n)ᵀ w`.
    pub fn pull_back_at(&mut self, q: &[f64], w: &[f64], out: &mut [f64]) {
        self.tree.pull_back(|k| &self.links[k].at, q, w, &mut self.wrenches, out);
    }

    /// `v ← P(q_n) ν`.
    pub fn push_forward_at(&mut self, q: &[f64], nu: &[f64], v: &mut [f64]) {
        for (k, link) in self.tree.links().iter().enumerate() {
            let map = &self.links[k].at;
            let mut twist =
                // (71)
                link.parent.map_or(Twist::zero(), |p| map.transfer.apply(&self.wrenches[p]));
            for (column, rate) in map.columns().iter().zip(&nu[link.offset..]) {
                twist.add_scaled(*rate, column);
            }
            self.wrenches[k] = twist;
            let own = 12 * link.frame..12 * link.frame + 12;
            null_space::push_forward(&q[own.clone()], &twist.to_vector(), &mut v[own]);
        }
    }

    /// `A_α` of the last [`Articulated::move_to`]d interval; whether bodies are coupled.
    pub(crate) fn assemble(&mut self, mixed: &Emission<'_>, s: &Interval) -> bool {
        self.assemble_between(mixed, &s.q0, &s.q1)
    }

    /// `A_α` between configurations.
    pub(crate) fn assemble_between(
        &mut self,
        mixed: &Emission<'_>,
        q0: &[f64],
        q1: &[f64],
    ) -> bool {
        self.A.fill(SpatialMatrix::zero());
        self.along.fill(0.0);
        let Self { tree, A, along, near, .. } = self;
        let near = near.as_mut().map(|Near { B, C, .. }| {
            B.fill(SpatialMatrix::zero());
            C.fill(SpatialMatrix::zero());
            NearBlocks { tree, of_link: B, of_parent: C }
        });
        let link_of = tree.link_of();
        let mut blocks = BodyBlocks { A, link_of, along, q0, q1, near, coupled: false };
        mixed(&mut blocks);
        blocks.coupled
    }

    /// Assembles and eliminates, leaf to root.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    pub fn factorize(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
    ) -> Result<(), Fault> {
        self.tangent(u, &s.q1);
        self.factorize_between(mixed, s)
    }

    /// `P(q_{n+1})ᵀ M ∂F_d/∂u (u, q_n)`: `X, S` are those at `q_{n+1}`, too.
    ///
    /// # Errors
    /// [`Fault::SingularTangent`].
    pub(crate) fn factorize_at_end(
        &mut self,
        mass: &Emission<'_>,
        u: &[f64],
        s: &Interval,
    ) -> Result<(), Fault> {
        self.begin_at(&s.q1, None);
        self.tangent(u, &s.q1);
        self.assemble_between(mass, &s.q1, &s.q1);
        (0..self.links.len()).rev().try_for_each(|k| self.eliminate(k))
    }

    /// The same with the `X', S'` at hand.
    pub(crate) fn factorize_between(
        &mut self,
        mixed: &Emission<'_>,
        s: &Interval,
    ) -> Result<(), Fault> {
        let coupled = self.assemble(mixed, s);
        debug_assert!(!coupled, "the recursion needs a potential that couples no two bodies");
        (0..self.links.len()).rev().try_for_each(|k| self.eliminate(k))
    }

    /// Eliminates the joint of link `k`: its `Â` is complete, that of its parent grows.
    pub(crate) fn eliminate(&mut self, k: usize) -> Result<(), Fault> {
        let (work, A, link) = (&mut self.links[k], &self.A[k], &self.tree.links()[k]);
        let f = work.at.dof;
        for j in 0..f {
            work.AS[j] = A.mul(&work.next.s[j]);
            work.SA[j] = A.tr_mul(&work.at.s[j]);
        }
        for i in 0..f {
            for j in 0..f {
                work.D[i][j] = work.at.s[i].dot(&work.AS[j]);
            }
            work.D[i][i] += self.along[link.offset + i];
        }
        invert(&mut work.D, f).ok_or(Fault::SingularTangent)?;
        let Some(parent) = link.parent else { return Ok(()) };
        if let Some(Near { B, C, links }) = &mut self.near {
            let LinkWork { at, next, AS, SA, D } = work;
            let (B, C, NearLink { y, z }) = (&B[k], &C[k], &mut links[k]);
            let mut transmitted = A.congruence(&at.transfer, &next.transfer);
            transmitted.add(&B.transmitted(&at.transfer));
            transmitted.add(&C.times(&next.transfer));
            for i in 0..f {
                y[i] = at.transfer.apply_transposed(&AS[i]);
                y[i].add_scaled(1.0, &C.mul(&next.s[i]));
                z[i] = next.transfer.apply_transposed(&SA[i]);
                z[i].add_scaled(1.0, &B.tr_mul(&at.s[i]));
            }
            take_out(&mut transmitted, (y, D, z), f);
            self.A[parent].add(&transmitted);
            return Ok(());
        }
        let mut reduced = *A; // Â − Â S' D⁻¹ Sᵀ Â
        take_out(&mut reduced, (&work.AS, &work.D, &work.SA), f);
        let transmitted = reduced.congruence(&work.at.transfer, &work.next.transfer);
        self.A[parent].add(&transmitted);
        Ok(())
    }

    /// `Â_k ← Â_k − x yᵀ`: what hangs on link `k` beside its children.
    pub(crate) fn relieve(&mut self, k: usize, x: &Twist, y: &Twist) {
        self.A[k].sub_outer(x, y);
    }

    /// `p` of link `k`: the wrench transmitted by its children; after [`Articulated::backward`] its
    /// `δt'`.
    pub(crate) fn wrench(&mut self, k: usize) -> &mut Twist {
        &mut self.wrenches[k]
    }

    /// Starts a solve: no wrench transmitted yet.
    pub(crate) fn rest(&mut self) {
        self.wrenches.fill(Twist::zero());
    }

    /// Leaf → root at link `k` with the wrench `p` of its children: `own ← u_k = own − S_kᵀ p`;
    /// returns what is transmitted to the parent.
    pub(crate) fn transmit(&self, k: usize, p: &Twist, own: &mut [f64]) -> Twist {
        let work = &self.links[k];
        let f = work.at.dof;
        let mut transmitted = *p;
        for (u, column) in own.iter_mut().zip(work.at.columns()) {
            *u -= column.dot(p);
        }
        let mut columns = &work.AS;
        if let Some(near) = &self.near {
            (transmitted, columns) = (work.at.transfer.apply_transposed(p), &near.links[k].y);
        }
        for i in 0..f {
            let rate: f64 = (0..f).map(|j| work.D[i][j] * own[j]).sum();
            transmitted.add_scaled(rate, &columns[i]);
        }
        if self.near.is_some() {
            return transmitted;
        }
        work.at.transfer.apply_transposed(&transmitted)
    }

    /// The transpose of [`Articulated::backward`] at link `k`: of a linear function
    /// `c·δτ_k + p·δt'_k`, `own = c ← D_k⁻ᵀ (c + S'_kᵀ p)`, its factors of `u_k`; returns its
    /// factors of `δt'_parent`.
    pub(crate) fn transmit_transposed(&self, k: usize, p: &Twist, own: &mut [f64]) -> Twist {
        let work = &self.links[k];
        let f = work.at.dof;
        let mut e = [0.0; MAX_DOF];
        for i in 0..f {
            e[i] = own[i] + work.next.s[i].dot(p);
        }
        let mut transmitted = *p;
        for j in 0..f {
            own[j] = (0..f).map(|i| work.D[i][j] * e[i]).sum();
            transmitted.add_scaled(-own[j], &work.SA[j]);
        }
        work.next.transfer.apply_transposed(&transmitted)
    }

    /// Leaf → root at link `k` for the right-hand side `x`.
    pub(crate) fn forward(&mut self, k: usize, x: &mut [f64]) {
        let link = &self.tree.links()[k];
        let own = &mut x[link.offset..link.offset + self.links[k].at.dof];
        let transmitted = self.transmit(k, &self.wrenches[k], own);
        if let Some(parent) = link.parent {
            self.wrenches[parent].add_scaled(1.0, &transmitted);
        }
    }

    /// Root → leaf at link `k`.
    pub(crate) fn backward(&mut self, k: usize, x: &mut [f64]) {
        let (link, work) = (&self.tree.links()[k], &self.links[k]);
        let f = work.at.dof;
        let own = &mut x[link.offset..link.offset + f];
        let of_parent = link.parent.map_or(Twist::zero(), |p| self.wrenches[p]);
        let inherited = work.next.transfer.apply(&of_parent);
        let (rows, known) = match &self.near {
            Some(near) => (&near.links[k].z, &of_parent),
            None => (&work.SA, &inherited),
        };
        for (u, row) in own.iter_mut().zip(rows) {
            *u -= row.dot(known);
        }
        let mut twist = inherited;
        let mut rate = [0.0; MAX_DOF];
        for i in 0..f {
            rate[i] = (0..f).map(|j| work.D[i][j] * own[j]).sum();
            twist.add_scaled(rate[i], &work.next.s[i]);
        }
        own.copy_from_slice(&rate[..f]);
        self.wrenches[k] = twist;
    }

    /// `x ← Dr⁻¹ x` with the last factorization.
    pub fn solve_in_place(&mut self, x: &mut [f64]) {
        self.rest();
        (0..self.links.len()).rev().for_each(|k| self.forward(k, x));
        (0..self.links.len()).for_each(|k| self.backward(k, x));
    }
}

/// Columns, inverse and rows of a joint.
type JointParts<'a> = (&'a [Twist; MAX_DOF], &'a [[f64; MAX_DOF]; MAX_DOF], &'a [Twist; MAX_DOF]);

/// `A ← A − y D⁻¹ zᵀ` of a joint of `f` degrees of freedom.
#[inline]
fn take_out(A: &mut SpatialMatrix, (y, D, z): JointParts<'_>, f: usize) {
    for i in 0..f {
        let mut row = Twist::zero();
        (0..f).for_each(|j| row.add_scaled(D[i][j], &z[j]));
        A.sub_outer(&y[i], &row);
    }
}

/// Inverts the leading `f × f` block by Gauss–Jordan with row pivoting.
fn invert(matrix: &mut [[f64; MAX_DOF]; MAX_DOF], f: usize) -> Option<()> {
    if f == 1 {
        matrix[0][0] = 1.0 / matrix[0][0];
        return matrix[0][0].is_finite().then_some(());
    }
    let (mut a, mut inverse) = (*matrix, [[0.0; MAX_DOF]; MAX_DOF]);
    for (i, row) in inverse.iter_mut().enumerate().take(f) {
        row[i] = 1.0;
    }
    for k in 0..f {
        let pivot = (k..f).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs()))?;
        a.swap(k, pivot);
        inverse.swap(k, pivot);
        let scale = 1.0 / a[k][k];
        if !scale.is_finite() {
            return None;
        }
        for j in 0..f {
            a[k][j] *= scale;
            inverse[k][j] *= scale;
        }
        for i in (0..f).filter(|&i| i != k) {
            let factor = a[i][k];
            for j in 0..f {
                a[i][j] -= factor * a[k][j];
                inverse[i][j] -= factor * inverse[k][j];
            }
        }
    }
    *matrix = inverse;
    Some(())
}
