//! [`ControlPointOperators`] of a tree of bodies by the articulated recursion, `O(N)` for each
//! control point.
//!
//! `P(q_j)ᵀ M ∂F_d/∂u (u_j, q_n)` is the matrix of [`Articulated`] with `X, S` at `q_j`, `X', S'`
//! the tangents there and `M` in the place of `D_2(D_1 L_d + f_d^-)`.

use crate::pair::{Transfer, Twist, VelocityMap};
use crate::solver::articulated::Articulated;
use crate::tree::Tree;
use vi_constraints::galerkin::ControlPointOperators;
use vi_constraints::reparametrization::{Emission, LastStep};
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault};

/// [`ControlPointOperators`] of a tree of bodies.
#[derive(Debug)]
pub struct TreeControlPoints {
    factors: Vec<Articulated>, // s
    maps: Vec<VelocityMap>,    // scratch
    wrenches: Vec<Twist>,      // scratch
}

impl TreeControlPoints {
    /// Of `stages` control points for a tree of frames.
    ///
    /// # Panics
    /// Without control points.
    #[must_use]
    pub fn new(tree: &Tree, stages: usize) -> Self {
        assert!(stages > 0, "a step has control points");
        let links = tree.links();
        Self {
            factors: (0..stages).map(|_| Articulated::new(tree.clone())).collect(),
            maps: vec![VelocityMap::new(Transfer::None, &[]); links.len()],
            wrenches: vec![Twist::zero(); links.len()],
        }
    }

    fn tree(&self) -> &Tree {
        self.factors[0].tree()
    }
}

impl ControlPointOperators for TreeControlPoints {
    fn dof(&self) -> usize {
        self.tree().dof()
    }

    fn blocks(&self) -> &[Block] {
        self.factors[0].blocks()
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.factors[0].move_to(u, s)
    }

    fn pull_back(&mut self, q: &[f64], _: Option<LastStep<'_>>, w: &[f64], out: &mut [f64]) {
        let Self { factors, maps, wrenches, .. } = self;
        let tree = factors[0].tree();
        tree.velocity_maps(q, maps.iter_mut());
        tree.pull_back(|k| &maps[k], q, w, wrenches, out);
    }

    fn factorize(
        &mut self,
        j: usize,
        mass: &Emission<'_>,
        u: &[f64],
        s: &Interval,
    ) -> Result<(), Fault> {
        self.factors[j].factorize_at_end(mass, u, s)
    }

    fn solve(&mut self, j: usize, x: &mut [f64]) -> Result<(), Fault> {
        self.factors[j].solve_in_place(x);
        if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    fn compose(&self, first: &[f64], u: &mut [f64]) {
        self.tree().compose(first, u);
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.tree().clean(q);
    }
}
