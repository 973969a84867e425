//! The nodal scheme (28) on trees of bodies, a few sweeps for each iteration.
//!
//! Its formulas stand in `crate::sweep`, as those of all trees of bodies.
//!
//! Springs, dampers and motors on joint coordinates act on their unknown alone
//! (`solver/efforts.rs`); what depends on coordinates otherwise (springs between points, loads) is
//! added to balances and blocks as it is emitted.
//!
//! Trees whose other potentials couple no two bodies, each of which has a mass matrix of multiples
//! of `I_3`. All others, and the reduced scheme, are solved by [`crate::tree_nodal`], on the same
//! sweeps, and the operators of [`crate::run`].
#![allow(non_snake_case)] // A, D, E, K, S

pub(in crate::solver) mod body_forces;
pub(in crate::solver) mod emitted;
pub(in crate::solver) mod part;
pub(in crate::solver) mod velocity;
pub(in crate::solver) mod workspace;

use crate::geometry::matrix::Spatial;
use crate::geometry::one_tree::{Held, Narrow, OneTree};
use crate::mechanism::Mechanism;
use crate::solver::efforts::{Efforts, Times};
use crate::solver::enforced::Enforced;
use crate::sweep::link;
use crate::tree::{self, Tree};
use body_forces::BodyForces;
use part::Links;
use vi_constraints::Constraints;
use vi_constraints::nodal::NodalEquations;
use vi_constraints::scheme::SubStep;
use vi_constraints::unknowns::Increments;
use vi_core::SeparableSystem;
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault, Newton, Precision};
use vi_core::state::State;
use workspace::Workspace;

/// What is added to the sweeps is computed lane by lane.
pub(in crate::solver) const SPACE: OneTree<Narrow> = OneTree(Narrow);

/// The nodal scheme on a tree of bodies.
#[derive(Debug)]
pub struct TreeStep {
    tree: Tree,
    increments: Increments,
    at: Workspace,
    weight: Vec<f64>,  // n  constant forces
    impulse: Vec<f64>, // n  of them in half a step
    efforts: Efforts,
    variable: Option<BodyForces>,
    s: Interval,
    turn: f64,      // rad  largest rotation of a body by the last correction
    is_all: bool,   // the joints of the tree are all constraints
    is_clean: bool, // no link was off its place after the last step
}

/// Whether a mechanism has no other constraints than those of its bodies and of the joints of its
/// tree.
fn is_all(mechanism: &Mechanism) -> bool {
    let of_link = |link: &tree::Link| 6 + (6 - link.dof());
    mechanism.len() == mechanism.tree().links().iter().map(of_link).sum::<usize>()
}

impl TreeStep {
    /// For a mechanism whose potentials couple no two bodies, but for those along joint coordinates
    /// of the tree; `None` where it does not apply.
    #[must_use]
    pub fn new(mechanism: &Mechanism, system: &SeparableSystem) -> Option<Self> {
        let at = Workspace::new(mechanism, system)?;
        let (tree, weight) = (mechanism.tree().clone(), system.constant_force());
        let n = weight.len();
        if !BodyForces::apply(mechanism, system) {
            return None;
        }
        let variable = BodyForces::new(mechanism, system);
        Some(Self {
            increments: Increments::new(tree.blocks()),
            efforts: Efforts::new(&at.links, system),
            at,
            impulse: vec![0.0; n],
            s: Interval::new(n),
            turn: f64::INFINITY,
            is_all: is_all(mechanism),
            is_clean: false,
            tree,
            weight,
            variable,
        })
    }

    /// The links, what is added to their blocks, and the end of the step.
    pub(in crate::solver) fn system(&mut self) -> (&mut Workspace, &[Spatial<Held>], Enforced<'_>) {
        let added = self.variable.as_ref().map_or(&[][..], BodyForces::blocks);
        (&mut self.at, added, Enforced::Step(&self.s))
    }

    /// The links as the last sweeps have left them.
    pub(in crate::solver) fn at_links(&self) -> Links<'_> {
        self.at.at_links()
    }

    /// Writes `q_{n+1}` and `Δq` of the last residual, where it has not needed them.
    pub(in crate::solver) fn close_interval(&mut self) {
        if self.variable.is_none() {
            self.close();
        }
    }

    /// Before the sweeps of a linear system: blocks of what depends on coordinates, and nothing on
    /// any link.
    pub(in crate::solver) fn assemble(&mut self, system: &SeparableSystem) {
        let Self { at, tree, efforts, variable, s, .. } = self;
        if let Some(variable) = variable {
            variable.assemble(system, s, (tree, &at.links));
        }
        efforts.slopes(system, Times::of(s), |link, unknown, slope| {
            at.column_mut(link, unknown).slope = slope;
        });
        at.release_links();
    }

    /// Writes `q_{n+1}` and `Δq` of the motion at hand, and closes the interval.
    fn close(&mut self) {
        let Self { at, s, .. } = self;
        at.close(s);
    }
}

impl NodalEquations<SeparableSystem, Mechanism> for TreeStep {
    fn blocks(&self) -> &[Block] {
        self.increments.blocks()
    }

    fn open(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        step: SubStep,
        state: &mut State,
        _: &mut [f64],
    ) {
        self.increments.reset();
        if self.variable.is_some() {
            self.increments.reach(mechanism, &state.q);
        }
        let distance = step.h.abs() * link::fastest(&self.at.links, &state.p);
        mechanism.raise_floors_by(distance, self.increments.blocks_mut());
        let Self { at, weight, impulse, efforts, s, .. } = self;
        state.open_start(s, step.h);
        s.end_at(step.t_end);
        efforts.begin(system, state.configuration());
        let half = 0.5 * step.h;
        impulse.iter_mut().zip(weight).for_each(|(impulse, w)| *impulse = half * *w);
        at.open([&state.q, &state.p, impulse]);
    }

    fn advance(
        &mut self,
        _: &SeparableSystem,
        mechanism: &Mechanism,
        u: &[f64],
    ) -> Result<(), Fault> {
        self.at.advance(u, Some(self.s.h))?;
        if self.variable.is_some() {
            self.at.close(&mut self.s);
            self.increments.reach(mechanism, &self.s.q1);
        }
        Ok(())
    }

    fn balance(&mut self, system: &SeparableSystem, u: &[f64], r: &mut [f64]) {
        let Self { at, efforts, variable, s, .. } = self;
        if let Some(variable) = variable {
            let works = &mut at.works;
            variable.wrenches(system, s, &at.links, |k, own| {
                works[k].wrench = works[k].wrench.take(SPACE).plus(own).held();
            });
        }
        at.pull_back(r); // P(q_n)ᵀ
        efforts.evaluate(system, Times::of(s), u);
        efforts.add_balance(r);
    }

    fn solve(&mut self, system: &SeparableSystem, u: &[f64], x: &mut [f64]) -> Result<(), Fault> {
        self.assemble(system);
        x.iter_mut().for_each(|x| *x *= -self.s.h);
        let (at, added, _) = self.system();
        let links = 0..at.links.len();
        at.eliminate(links.clone(), added, x)?;
        self.turn = at.substitute(links, u, x);
        if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    /// Only the motion: the balance is evaluated with the momenta at the end of the step.
    fn settle(&mut self, system: &SeparableSystem, u: &[f64]) -> Result<bool, Fault> {
        self.efforts.evaluate(system, Times::of(&self.s), u);
        self.at.advance(u, None).map(|()| true)
    }

    fn finish(&mut self, system: &SeparableSystem, _: &Newton, state: &mut State, carried: &[f64]) {
        let Self { tree, at, impulse, efforts, variable, s, .. } = self;
        (state.t, state.step) = (s.t_end(), state.step + 1);
        let constant = variable.is_none().then_some(&impulse[..]);
        self.is_clean = at.finish(tree, constant, s, state);
        // Sweeps and momenta round constants of a body differently: their own balance is what the
        // next step takes over.
        if let Some(variable) = variable {
            let rest = variable.rest(system, s, &state.p);
            at.pull_back_of(&s.q0, rest, &mut state.compensation.balance);
            state.move_momentum(system, s);
        } else {
            at.pull_back(&mut state.compensation.balance);
            efforts.add_balance(&mut state.compensation.balance);
            efforts.add_momentum(system, &s.q1, &mut state.p);
        }
        let rest = state.compensation.balance.iter_mut().zip(carried);
        rest.for_each(|(rest, error)| *rest += *error);
    }

    /// Bodies are rotated, not solved for. Springs between points and loads may be nonlinear in any
    /// way.
    fn precision(&self) -> Precision {
        let is_affine = self.variable.is_none() && self.efforts.are_affine();
        Precision {
            keeps_orientation: true,
            meets_constraints: self.is_clean && self.is_all,
            turn: if is_affine { self.turn } else { f64::INFINITY },
            ..Precision::of_balances()
        }
    }

    fn interval(&self) -> &Interval {
        &self.s
    }

    fn interval_mut(&mut self) -> &mut Interval {
        &mut self.s
    }
}
