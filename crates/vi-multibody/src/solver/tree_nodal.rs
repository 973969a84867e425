//! [`NodalOperators`] of a tree of bodies by the sweeps over its links.
//!
//! All of `A_α` is emitted, so the links have no mass of their own: the sweeps eliminate what is
//! added to their blocks. Of a last step `∂F_d/∂u` differs from `P(q_n)` by the tangent maps of the
//! rotation vectors alone,
//! ```text
//! [∂F_d/∂u (u_{n-1}, q_{n-1})]ᵀ w = Tᵀ P(q_n)ᵀ w,   T = diag(I, …, T(θ), …)                     (30)
//! ```

use super::body_blocks::{couples_beyond_parents, couples_bodies};
use super::tree_step::emitted::Emitted;
use super::tree_step::part::Links;
use super::tree_step::workspace::Workspace;
use crate::geometry::matrix::Spatial;
use crate::geometry::one_tree::HeldVector;
use crate::tree::Tree;
use nalgebra::Vector3;
use vi_constraints::NodalOperators;
use vi_constraints::node_solvers::RateOperators;
use vi_constraints::reparametrization::{Emission, LastStep};
use vi_core::interval::Interval;
use vi_core::newton::{Fault, Precision, UnknownBlock};
use vi_core::state::Memory;
use vi_rigid::rotation;

/// [`NodalOperators`] of a tree of bodies, `O(N)`.
#[derive(Debug)]
pub struct TreeNodal {
    tree: Tree,
    blocks: Vec<UnknownBlock>,
    at: Workspace,
    emitted: Emitted,
    q_n: Vec<f64>,
    none: Vec<f64>,            // n  momenta of the links
    rotations: Vec<usize>,     // first unknowns of rotation vectors
    turned: Vec<Vector3<f64>>, // these of the last step, where it is given
}

impl TreeNodal {
    /// For a tree of frames and matrices that couple no two of them; `None` where a pair is of
    /// another kind.
    #[must_use]
    pub fn new(tree: &Tree) -> Option<Self> {
        let (n, links) = (12 * tree.links().len(), tree.links());
        let rotation = |link: &crate::tree::TreeLink| {
            link.joint.kind.rotation_vector().map(|first| link.offset + first)
        };
        let rotations: Vec<usize> = links.iter().filter_map(rotation).collect();
        Some(Self {
            blocks: tree.blocks(),
            at: Workspace::massless(tree)?,
            emitted: Emitted::new(links.len(), tree.dof()),
            q_n: vec![0.0; n],
            none: vec![0.0; n],
            turned: Vec::with_capacity(rotations.len()),
            rotations,
            tree: tree.clone(),
        })
    }

    /// For such a tree and a matrix over its coordinates like this one; `None` where it couples
    /// other bodies than a link with its parent.
    #[must_use]
    pub fn of(tree: &Tree, matrix: &Emission<'_>) -> Option<Self> {
        if !couples_bodies(matrix) {
            return Self::new(tree);
        }
        let mut own = (!couples_beyond_parents(tree, matrix)).then(|| Self::new(tree)).flatten()?;
        own.at.couple_links();
        own.emitted = own.emitted.with_couplings();
        Some(own)
    }

    /// The links as the last sweeps have left them.
    pub(super) fn at_links(&self) -> Links<'_> {
        self.at.at_links()
    }

    /// The sweeps over the links.
    pub(super) fn workspace(&mut self) -> &mut Workspace {
        &mut self.at
    }

    /// Takes the matrix of a step for the sweeps over its links, with what is added to their
    /// blocks.
    pub(super) fn assemble(
        &mut self,
        matrix: &Emission<'_>,
        s: &Interval,
    ) -> (&mut Workspace, &[Spatial<HeldVector>]) {
        let Self { tree, at, emitted, .. } = self;
        let ends = [&s.q0[..], &s.q1];
        emitted.assemble(matrix, tree, &at.links, ends, 1.0);
        at.take(emitted, ends);
        at.release_links();
        (at, &emitted.blocks)
    }

    /// Writes a residual in the basis of this node as one in that of the last step.
    pub(super) fn turn(&self, r: &mut [f64]) {
        self.for_each_rotation(r, |theta, r| rotation::tangent(theta).tr_mul(&r));
    }

    /// The inverse of [`TreeNodal::turn`].
    pub(super) fn turn_back(&self, r: &mut [f64]) {
        self.for_each_rotation(r, |theta, r| rotation::untangent(&-theta, &r)); // T(−θ) = T(θ)ᵀ
    }

    fn for_each_rotation(
        &self,
        r: &mut [f64],
        turned: impl Fn(&Vector3<f64>, Vector3<f64>) -> Vector3<f64>,
    ) {
        for (theta, &first) in self.turned.iter().zip(&self.rotations) {
            let own = &mut r[first..first + 3];
            own.copy_from_slice(turned(theta, Vector3::from_column_slice(own)).as_slice());
        }
    }
}

impl NodalOperators for TreeNodal {
    fn dof(&self) -> usize {
        self.tree.dof()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn begin(&mut self, s: &Interval, _memory: &Memory, last: Option<LastStep<'_>>) {
        let Self { at, q_n, none, rotations, turned, .. } = self;
        q_n.copy_from_slice(&s.q0);
        at.open([q_n, none, none]);
        turned.clear();
        let theta = |u: &[f64], first: usize| Vector3::from_column_slice(&u[first..first + 3]);
        turned.extend(last.iter().flat_map(|last| rotations.iter().map(|&k| theta(last.u, k))));
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.at.advance(u, None)?;
        self.at.close(s);
        Ok(())
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        self.at.pull_back_of(&self.q_n, w, out);
    }

    fn close(&mut self, r: &mut [f64]) {
        self.turn(r);
    }

    fn carry_balance(&self, r: &mut [f64]) {
        self.turn_back(r);
    }

    fn solve(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        self.turn_back(x);
        let (at, added) = self.assemble(mixed, s);
        at.solve(added, u, x)?;
        if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.tree.clean(q);
    }

    fn precision(&self) -> Precision {
        Precision::of_balances()
    }
}

impl RateOperators for TreeNodal {
    fn push_forward(&mut self, _nu: &[f64], v: &mut [f64]) {
        self.at.push_forward(&self.q_n, v); // the twists of ν
    }
}
