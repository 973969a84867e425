//! The nodal scheme (28) on trees of bodies, a few sweeps for each iteration.
//!
//! Its formulas stand in `crate::sweep`, as those of all trees of bodies.
//!
//! Springs, dampers and motors on joint coordinates act on their unknown alone
//! (`solver/efforts.rs`); what depends on coordinates otherwise (springs between points, loads) is
//! added to balances and blocks as it is emitted.
//!
//! So do laws on them that read other coordinates, members or signals; what they read adds a
//! product of few columns and rows to the matrix (`solver/quantity_efforts.rs`).
//!
//! Trees whose other potentials couple no two bodies, each of which has a mass matrix of multiples
//! of `I_3`. All others, and the reduced scheme, are solved by [`crate::tree_nodal`], on the same
//! sweeps, and the operators of [`crate::run`].
#![allow(non_snake_case)] // A, D, E, K, S

pub(in crate::solver) mod body_forces;
pub(in crate::solver) mod emitted;
pub(in crate::solver) mod part;
pub(in crate::solver) mod space;
pub(in crate::solver) mod velocity;
pub(in crate::solver) mod workspace;

use crate::geometry::matrix::Spatial;
use crate::geometry::one_tree::HeldVector;
use crate::mechanism::Mechanism;
use crate::solver::efforts::{Efforts, StepTimes};
use crate::solver::enforced::Enforced;
use crate::solver::quantity_efforts::QuantityEfforts;
use crate::sweep::link;
use crate::tree::{self, Tree};
use body_forces::{BodyForces, initial_interval};
use part::Links;
use space::SPACE;
use vi_constraints::Constraints;
use vi_constraints::nodal::NodalEquations;
use vi_constraints::scheme::SubStep;
use vi_constraints::unknowns::Increments;
use vi_core::interval::Interval;
use vi_core::newton::{Fault, Newton, Precision, UnknownBlock};
use vi_core::state::State;
use vi_core::{DiscreteLagrangian, SeparableSystem};
use workspace::Workspace;

/// The nodal scheme on a tree of bodies.
#[derive(Debug)]
pub struct TreeStep {
    tree: Tree,
    increments: Increments,
    at: Workspace,
    weight: Vec<f64>,  // n  constant forces
    impulse: Vec<f64>, // n  of them in half a step
    efforts: Efforts,
    laws: Option<Box<QuantityEfforts>>,
    variable: Option<BodyForces>,
    s: Interval,
    turn: f64,      // rad  largest rotation of a body by the last correction
    is_all: bool,   // the joints of the tree are all constraints
    is_clean: bool, // no link was off its place after the last step
}

/// Whether a mechanism has no other constraints than those of its bodies and of the joints of its
/// tree.
fn is_all(mechanism: &Mechanism) -> bool {
    let of_link = |link: &tree::TreeLink| 6 + (6 - link.dof());
    mechanism.len() == mechanism.tree().links().iter().map(of_link).sum::<usize>()
}

impl TreeStep {
    /// For a mechanism whose potentials and forces couple no two bodies, but for those along joint
    /// coordinates of the tree; `None` where it does not apply.
    #[must_use]
    pub fn new(mechanism: &Mechanism, system: &SeparableSystem) -> Option<Self> {
        if BodyForces::apply(mechanism, system, &[]) {
            return Self::with_laws(mechanism, system, None);
        }
        let s = initial_interval(mechanism);
        let is_apart = |force| BodyForces::couples(system, &s, force);
        let laws = QuantityEfforts::new(mechanism.tree(), system, &s, is_apart)?;
        let apply = BodyForces::apply(mechanism, system, laws.forces());
        apply.then(|| Self::with_laws(mechanism, system, Some(Box::new(laws)))).flatten()
    }

    /// The same where closed loops are added: no law reads another coordinate or member.
    pub(in crate::solver) fn beneath_loops(
        mechanism: &Mechanism,
        system: &SeparableSystem,
    ) -> Option<Self> {
        let apply = BodyForces::apply(mechanism, system, &[]);
        apply.then(|| Self::with_laws(mechanism, system, None)).flatten()
    }

    fn with_laws(
        mechanism: &Mechanism,
        system: &SeparableSystem,
        laws: Option<Box<QuantityEfforts>>,
    ) -> Option<Self> {
        let mut at = Workspace::new(mechanism, system)?;
        let (tree, weight) = (mechanism.tree().clone(), system.constant_force());
        let (n, apart) = (weight.len(), laws.as_ref().map_or(&[][..], |laws| laws.forces()));
        let variable = BodyForces::new(mechanism, system, apart);
        if laws.is_some() {
            let turns = tree.links().iter().any(|link| link.joint.kind.rotation_vector().is_some());
            at.carry_loops(std::iter::empty(), turns);
        }
        Some(Self {
            increments: Increments::new(tree.blocks()),
            efforts: Efforts::new(&at.links, system),
            at,
            impulse: vec![0.0; n],
            laws,
            s: Interval::new(n),
            turn: f64::INFINITY,
            is_all: is_all(mechanism),
            is_clean: false,
            tree,
            weight,
            variable,
        })
    }

    /// Whether the interval is closed at every trial.
    fn closes(&self) -> bool {
        self.variable.is_some() || self.laws.as_ref().is_some_and(|laws| laws.needs_interval())
    }

    /// The links, what is added to their blocks, and the end of the step.
    pub(in crate::solver) fn system(
        &mut self,
    ) -> (&mut Workspace, &[Spatial<HeldVector>], Enforced<'_>) {
        let added = self.variable.as_ref().map_or(&[][..], BodyForces::blocks);
        (&mut self.at, added, Enforced::Step(&self.s))
    }

    /// The links as the last sweeps have left them.
    pub(in crate::solver) fn at_links(&self) -> Links<'_> {
        self.at.at_links()
    }

    /// Writes `q_{n+1}` and `Δq` of the last residual, where it has not needed them.
    pub(in crate::solver) fn close_interval(&mut self) {
        if !self.closes() {
            self.close();
        }
    }

    /// Before the sweeps of a linear system: blocks of what depends on coordinates, and nothing on
    /// any link.
    pub(in crate::solver) fn assemble(&mut self, system: &SeparableSystem) {
        let Self { at, tree, efforts, laws, variable, s, .. } = self;
        if let Some(variable) = variable {
            variable.assemble(system, s, tree, &at.links);
        }
        if let Some(laws) = laws {
            laws.places().for_each(|(link, unknown)| at.column_mut(link, unknown).slope = 0.0);
        }
        efforts.slopes(system, StepTimes::of(s), |link, unknown, slope| {
            at.column_mut(link, unknown).slope = slope;
        });
        if let Some(laws) = laws {
            laws.slopes(system, s, |link, unknown, slope| {
                at.column_mut(link, unknown).slope += slope;
            });
        }
        at.release_links();
    }

    /// Writes `q_{n+1}` and `Δq` of the motion at hand, and closes the interval.
    fn close(&mut self) {
        let Self { at, s, .. } = self;
        at.close(s);
    }
}

impl NodalEquations<SeparableSystem, Mechanism> for TreeStep {
    fn blocks(&self) -> &[UnknownBlock] {
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
        if self.closes() {
            self.increments.reach(mechanism, &state.q);
        }
        let distance = step.h.abs() * link::fastest(&self.at.links, &state.p);
        mechanism.raise_floors_by(distance, self.increments.blocks_mut());
        let Self { at, weight, impulse, efforts, laws, s, .. } = self;
        state.open_start(s, step.h);
        s.end_at(step.t_end);
        efforts.begin(system, state.configuration());
        if let Some(laws) = laws {
            laws.begin(system, state.configuration(), s);
        }
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
        if self.closes() {
            self.at.close(&mut self.s);
            self.increments.reach(mechanism, &self.s.q1);
        }
        Ok(())
    }

    fn balance(&mut self, system: &SeparableSystem, u: &[f64], r: &mut [f64]) {
        let Self { at, efforts, laws, variable, s, .. } = self;
        if let Some(variable) = variable {
            let works = &mut at.works;
            variable.wrenches(system, s, &at.links, |k, own| {
                works[k].wrench = works[k].wrench.take(SPACE).plus(own).held();
            });
        }
        at.pull_back(r); // P(q_n)ᵀ
        efforts.evaluate(system, StepTimes::of(s), u);
        efforts.add_balance(r);
        if let Some(laws) = laws {
            laws.evaluate(system, s, u);
            laws.add_balance(r);
        }
    }

    fn solve(&mut self, system: &SeparableSystem, u: &[f64], x: &mut [f64]) -> Result<(), Fault> {
        self.assemble(system);
        x.iter_mut().for_each(|x| *x *= -self.s.h);
        let (at, added, _) = self.system();
        let links = 0..at.links.len();
        at.eliminate(links.clone(), added, x)?;
        let Self { at, laws, s, .. } = self;
        if let Some(laws) = laws {
            laws.correct(system, s, at.at_links(), x)?;
        }
        self.turn = at.substitute(links, u, x);
        if x.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    /// Only the motion: the balance is evaluated with the momenta at the end of the step.
    fn settle(&mut self, system: &SeparableSystem, u: &[f64]) -> Result<bool, Fault> {
        let Self { at, efforts, laws, s, .. } = self;
        efforts.evaluate(system, StepTimes::of(s), u);
        if let Some(laws) = laws {
            laws.evaluate(system, s, u);
        }
        at.advance(u, None).map(|()| true)
    }

    fn finish(&mut self, system: &SeparableSystem, _: &Newton, state: &mut State, carried: &[f64]) {
        let Self { tree, at, impulse, efforts, laws, variable, s, .. } = self;
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
            if let Some(laws) = laws {
                laws.add_balance(&mut state.compensation.balance);
                laws.add_momentum(system, &s.q1, &mut state.p);
            }
            if !state.internal.is_empty() {
                system.advance_internal(s, &mut state.internal);
            }
        }
        let rest = state.compensation.balance.iter_mut().zip(carried);
        rest.for_each(|(rest, error)| *rest += *error);
    }

    /// Bodies are rotated, not solved for. Springs between points and loads may be nonlinear in any
    /// way.
    fn precision(&self) -> Precision {
        let laws = self.laws.as_ref().is_none_or(|laws| laws.are_affine());
        let is_affine = self.variable.is_none() && self.efforts.are_affine() && laws;
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
