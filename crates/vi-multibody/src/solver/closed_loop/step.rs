//! The nodal scheme on closed loops: the sweeps of the spanning tree, loops on top.
//!
//! ```text
//! b = P_treeᵀ [p̄_n + D_1 L_d + f_d^-],   −h A_α                 by the sweeps of the tree
//! r = (b − Uᵀλ, g/h),   [A  −Uᵀ; J'  0] [δ; μ] = (b − Uᵀλ, g)   as on all closed loops
//! ```
//! The sweeps are those of [`crate::solver::tree_step`], and twists and wrenches refer to their
//! reference points; letters and loops are those of [`super`]. The balance is handed on with the
//! momenta of these sweeps, along the null space of `J_n`.
//!
//! [`super::LoopNodal`] solves potentials that couple bodies.

use super::loop_rank::{Departure, LoopRank};
use super::loops::Loops;
use super::path::Maps;
use super::sweep::LoopResolution;
use crate::mechanism::Mechanism;
use crate::solver::tree_step::TreeStep;
use vi_constraints::nodal::NodalEquations;
use vi_constraints::scheme::SubStep;
use vi_constraints::unknowns::Increments;
use vi_core::SeparableSystem;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, Newton, Precision, UnknownBlock, largest_rotation};
use vi_core::state::State;

crate::opaque_debug!(LoopStep);

/// The nodal scheme on a mechanism with closed loops.
pub struct LoopStep {
    tree: TreeStep,
    loops: Loops,
    increments: Increments,
    rates: Option<Vec<f64>>, // d  ν(0), where the first step cannot start from u = 0
    resolution: LoopResolution,
    fresh: bool, // rows not chosen yet in this step
}

impl LoopStep {
    /// For a mechanism whose potentials couple no two bodies; `None` where it does not apply.
    #[must_use]
    pub fn new(mechanism: &Mechanism, system: &SeparableSystem, rank: &LoopRank) -> Option<Self> {
        let mut tree = TreeStep::beneath_loops(mechanism, system)?;
        let mut loops = rank.loops(mechanism);
        loops.carry(tree.system().0);
        let (resolution, fresh) = (LoopResolution::full(), true);
        let increments = Increments::new(loops.blocks.clone());
        Some(Self { tree, loops, increments, rates: None, resolution, fresh })
    }

    /// The first node is a singular configuration.
    #[must_use]
    pub fn leaving(mut self, departure: &Departure) -> Self {
        self.loops.leave_along(&departure.null_space);
        self.rates = Some(departure.rates.clone());
        self
    }

    /// Clusters of loops that are solved together: the number of their independent rows, and the
    /// link where they are eliminated (`None`: the ground).
    pub fn clusters(&self) -> impl Iterator<Item = (usize, Option<usize>)> {
        self.loops.clusters.iter().map(|cluster| (cluster.rank(), cluster.apex()))
    }
}

impl NodalEquations<SeparableSystem, Mechanism> for LoopStep {
    fn blocks(&self) -> &[UnknownBlock] {
        self.increments.blocks()
    }

    fn open(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        step: SubStep,
        state: &mut State,
        carried: &mut [f64],
    ) {
        self.increments.open(mechanism, &state.q);
        self.tree.open(system, mechanism, step, state, carried);
        self.loops.begin(Maps::Sweeps(self.tree.at_links()), &state.q, &state.memory);
        self.fresh = true;
        step.depart(self.rates.as_deref(), state);
    }

    fn advance(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        u: &[f64],
    ) -> Result<(), Fault> {
        self.tree.advance(system, mechanism, u)
    }

    fn balance(&mut self, system: &SeparableSystem, u: &[f64], r: &mut [f64]) {
        self.tree.balance(system, u, r);
    }

    fn close(&mut self, mechanism: &Mechanism, u: &[f64], r: &mut [f64]) {
        self.tree.close_interval();
        if self.fresh {
            let Self { tree, loops, .. } = self;
            let maps = Maps::Sweeps(tree.at_links());
            self.resolution = loops.choose_rows(maps, &tree.interval().q1, u);
            self.fresh = false;
        }
        let s = self.tree.interval();
        self.increments.reach(mechanism, &s.q1);
        for cluster in &mut self.loops.clusters {
            cluster.close_step(s);
            cluster.project(s.h, r);
        }
    }

    fn solve(&mut self, system: &SeparableSystem, u: &[f64], x: &mut [f64]) -> Result<(), Fault> {
        let h = self.tree.interval().h;
        let clusters = &mut self.loops.clusters;
        clusters.iter_mut().try_for_each(|cluster| cluster.split(h, x))?;
        self.tree.assemble(system);
        x.iter_mut().for_each(|x| *x *= -h); // −h A δ − Uᵀμ = −h (b − Uᵀλ)
        self.loops.solve(self.tree.system(), u, x)?;
        if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    fn finish(
        &mut self,
        system: &SeparableSystem,
        newton: &Newton,
        state: &mut State,
        carried: &[f64],
    ) {
        self.loops.remember(&mut state.memory);
        self.tree.finish(system, newton, state, carried);
        let balance = &mut state.compensation.balance;
        let clusters = &self.loops.clusters;
        clusters.iter().for_each(|cluster| cluster.project_balance(balance));
    }

    /// Bodies are rotated, not solved for.
    fn precision(&self) -> Precision {
        let (noise, closing_size) = (self.resolution.noise(), self.resolution.closing_size());
        let of_balances = Precision::of_balances();
        Precision { noise, closing_size, keeps_orientation: true, ..of_balances }
    }

    /// Gaps of loops, and prescribed motions, beside momenta.
    fn rotation(&self, u: &[f64]) -> f64 {
        largest_rotation(self.increments.blocks(), u)
    }

    fn interval(&self) -> &Interval {
        self.tree.interval()
    }

    fn interval_mut(&mut self) -> &mut Interval {
        self.tree.interval_mut()
    }
}
