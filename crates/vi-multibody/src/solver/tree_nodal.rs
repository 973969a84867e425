//! [`NodalOperators`] of a tree of bodies by the articulated recursion.

use crate::solver::articulated::Articulated;
use crate::tree::Tree;
use vi_constraints::NodalOperators;
use vi_constraints::node_solvers::RateOperators;
use vi_constraints::reparametrization::{Emission, LastStep};
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault, Precision};
use vi_core::state::Memory;

/// [`NodalOperators`] of a tree of bodies, `O(N)`.
#[derive(Debug)]
pub struct TreeNodal {
    articulated: Articulated,
    q_n: Vec<f64>,
    stands: bool, // q_{n+1} = q_n
}

impl TreeNodal {
    /// For a tree of frames.
    #[must_use]
    pub fn new(tree: Tree) -> Self {
        let n = 12 * tree.links().len();
        Self { articulated: Articulated::new(tree), q_n: vec![0.0; n], stands: false }
    }

    /// Whether a matrix over the coordinates couples no two bodies.
    #[must_use]
    pub fn is_uncoupled(&mut self, matrix: &Emission<'_>, s: &Interval) -> bool {
        !self.articulated.assemble(matrix, s)
    }

    /// Whether the recursion applies to `system`.
    #[must_use]
    pub fn applies(&mut self, system: &impl DiscreteLagrangian, s: &Interval) -> bool {
        self.articulated.applies(system, s)
    }

    /// Whether it applies where bodies may be coupled with their parents; it is prepared for that
    /// from now on, where it does.
    #[must_use]
    pub fn applies_near(&mut self, matrix: &Emission<'_>, s: &Interval) -> bool {
        self.articulated.applies_near(matrix, s)
    }
}

impl NodalOperators for TreeNodal {
    fn dof(&self) -> usize {
        self.articulated.tree().dof()
    }

    fn blocks(&self) -> &[Block] {
        self.articulated.blocks()
    }

    fn begin(&mut self, s: &Interval, _memory: &Memory, last: Option<LastStep<'_>>) {
        self.q_n.copy_from_slice(&s.q0);
        self.articulated.begin_at(&s.q0, last);
        self.stands = false;
    }

    fn reparametrize(&mut self, u: &[f64], s: &mut Interval) -> Result<(), Fault> {
        self.articulated.move_to(u, s)
    }

    fn pull_back(&mut self, w: &[f64], out: &mut [f64]) {
        self.articulated.pull_back_at(&self.q_n, w, out);
    }

    fn solve(
        &mut self,
        mixed: &Emission<'_>,
        u: &[f64],
        s: &Interval,
        x: &mut [f64],
    ) -> Result<(), Fault> {
        match self.stands {
            true => self.articulated.factorize_between(mixed, s)?,
            false => self.articulated.factorize(mixed, u, s)?,
        }
        self.articulated.solve_in_place(x);
        if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.articulated.tree().clean(q);
    }

    fn precision(&self) -> Precision {
        Precision::of_balances()
    }
}

impl RateOperators for TreeNodal {
    fn stand(&mut self, s: &mut Interval, memory: &Memory, _rest: &[f64]) -> Result<(), Fault> {
        self.begin(s, memory, None);
        self.articulated.stand();
        self.stands = true;
        Ok(())
    }

    fn push_forward(&mut self, nu: &[f64], v: &mut [f64]) {
        self.articulated.push_forward_at(&self.q_n, nu, v);
    }
}
