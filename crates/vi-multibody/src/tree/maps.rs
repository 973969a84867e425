//! The velocity maps of all pairs of a tree, at a configuration and at the end of a step.

use crate::pair::{FrameMotion, Twist, TwistTransfer, VelocityMap};
use crate::tree::Tree;
use vi_constraints::reparametrization::LastStep;
use vi_core::interval::Interval;
use vi_core::newton::Fault;

/// `X, S` and `X', S'` of the links.
#[derive(Debug)]
pub(crate) struct TreeMaps {
    tree: Tree,
    maps: [Vec<VelocityMap>; 2], // X, S at q_n; X', S' at q_{n+1}
    motions: Vec<FrameMotion>,   // scratch
    wrenches: Vec<Twist>,        // scratch
}

impl TreeMaps {
    /// For a tree of frames.
    pub(crate) fn new(tree: Tree) -> Self {
        let count = tree.links().len();
        let maps = || vec![VelocityMap::new(TwistTransfer::None, &[]); count];
        Self {
            maps: [maps(), maps()],
            motions: vec![FrameMotion::rest(); count],
            wrenches: vec![Twist::zero(); count],
            tree,
        }
    }

    /// The tree.
    pub(crate) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// The link of a frame.
    pub(crate) fn link_of(&self, frame: usize) -> usize {
        self.tree.link_of()[frame]
    }

    /// `X, S` of one link, those of the `next` node where these are meant.
    pub(crate) fn of(&self, link: usize, next: bool) -> &VelocityMap {
        &self.maps[usize::from(next)][link]
    }

    /// Computes `X, S` at `q_n`; with a `last` step those of its `∂F_d/∂u`.
    pub(crate) fn begin(&mut self, q: &[f64], last: Option<LastStep<'_>>) {
        let maps = self.maps[0].iter_mut();
        match last {
            Some(last) => self.tree.tangents(last.u, &last.s.q1, maps),
            None => self.tree.velocity_maps(q, maps),
        }
    }

    /// Computes `X', S'` at `q_{n+1}`.
    pub(crate) fn reach(&mut self, u: &[f64], q1: &[f64]) {
        self.tree.tangents(u, q1, self.maps[1].iter_mut());
    }

    /// The pair maps, root first.
    ///
    /// # Errors
    /// [`Fault`].
    pub(crate) fn move_to(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.tree.reparametrize(u, s, &mut self.motions)?;
        s.close();
        Ok(())
    }

    /// `out ← P(q_n)ᵀ w`.
    pub(crate) fn pull_back(&mut self, q: &[f64], w: &[f64], out: &mut [f64]) {
        let Self { tree, maps, wrenches, .. } = self;
        tree.pull_back(|k| &maps[0][k], q, w, wrenches, out);
    }
}
