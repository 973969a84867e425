//! A family of schemes as the integrator sees it: systems, and how their nodes are read.
//!
//! The variational schemes are one family: every [`DiscreteLagrangian`] belongs to it. Another
//! family, with another discretization of forces and other quantities at its nodes, implements
//! [`Discretization`] for its own systems and [`crate::scheme::Scheme`] for its schemes; the
//! integrator is the same.

use crate::constraints::Constraints;
use crate::galerkin::GaussPoint;
use crate::node::{Node, NodeObserver};
use crate::nonsmooth::ContactImpulse;
use crate::saddle_point::IndependentRows;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interpolation::StepPolynomial;
use vi_core::interval::Interval;
use vi_core::legendre;
use vi_core::linear::Singular;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::state::State;
use vi_core::{Composition, Configuration};

/// A step that has been taken.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Its interval.
    pub s: &'a Interval,
    /// Its Gauss nodes, of Galerkin schemes; else empty.
    pub gauss: &'a [GaussPoint],
    /// Its polynomial, of Galerkin schemes.
    pub polynomial: Option<StepPolynomial<'a>>,
    /// `h²λ` over all constraints, shape `m`, of schemes that find the multiplier of the step; else
    /// empty.
    pub multipliers: &'a [f64],
    /// `BᵀΛ` of contacts at its start, N·s, shape `n`; empty without contacts.
    pub impulse: &'a [f64],
}

impl<'a> Step<'a> {
    /// Without control points.
    #[must_use]
    pub fn single(s: &'a Interval, multipliers: &'a [f64], impulse: &'a [f64]) -> Self {
        Self { s, gauss: &[], polynomial: None, multipliers, impulse }
    }

    /// The step alone, or `(q_n, q_j)`, `j = 1 … s`, of a Galerkin step: the last is the step, of
    /// the others increments count.
    #[must_use]
    pub fn points(&self) -> &'a [Interval] {
        self.polynomial.map_or(std::slice::from_ref(self.s), |polynomial| polynomial.points)
    }

    /// `E_d = −∂L_d/∂h` (52), J: of Galerkin schemes `Σ_k b_k [½ V_kᵀ M V_k + V(Q_k)]` [2.32], and
    /// `U_d` of interpolated strains.
    #[must_use]
    pub fn discrete_energy(&self, system: &impl DiscreteLagrangian) -> f64 {
        if self.gauss.is_empty() {
            return legendre::discrete_energy(system, self.s).total();
        }
        let energy = |node: &GaussPoint| {
            let potential = system.gauss_energy(node.place(self.s));
            node.weight * (system.kinetic_energy(&node.v) + potential)
        };
        let strains = system.interpolation().zip(self.polynomial);
        let strains = strains.map_or(0.0, |(strains, polynomial)| strains.energy(&polynomial));
        strains + self.gauss.iter().map(energy).sum::<f64>()
    }
}

/// A macro step of a motion: the node where it starts, its last (sub-)step, the node where it ends.
///
/// At order 2 the step leads from one to the other, and most quantities of the node `before` follow
/// from it.
#[derive(Clone, Copy, Debug)]
pub struct Transition<'a> {
    /// The state where it starts.
    pub before: &'a State,
    /// The step.
    pub step: Step<'a>,
    /// The state where it ends.
    pub after: &'a State,
    /// The impulse of contacts at the node where it starts.
    pub impulse: ContactImpulse<'a>,
}

impl<'a> Transition<'a> {
    /// Of a step without control points.
    #[must_use]
    pub fn single(before: &'a State, s: &'a Interval, after: &'a State) -> Self {
        let step = Step::single(s, &after.memory.multipliers, &[]);
        Self { before, step, after, impulse: ContactImpulse::default() }
    }

    /// With an impulse of contacts at the node where it starts.
    #[must_use]
    pub fn with_impulse(mut self, impulse: ContactImpulse<'a>) -> Self {
        self.impulse = impulse;
        self
    }
}

/// A system that an integrator can step.
pub trait Discretization<C>: MechanicalSystem + Sized {
    /// Reads nodes.
    type Observer: ObserveNode<Self, C>;
    /// For an independent set of the `m` constraints.
    fn observer(&self, m: usize, rows: &IndependentRows) -> Self::Observer;
    /// Adds to the state of a start what the schemes of this family need beside `(t, q_0, p_0)`;
    /// `v`: the consistent velocity, shape `n`.
    fn begin(&self, _state: &mut State, _v: &[f64]) {}
    /// Whether values that are held over steps change at a node, before the step from there.
    fn samples(&self, _state: &State) -> bool {
        false
    }
    /// Changes them; `v`: the velocity of `ᵠp_n`.
    fn sample(&self, _state: &mut State, _v: &[f64]) {}
    /// `E_d` of a (sub-)step, J; `None` where a family has no discrete Lagrangian.
    fn discrete_energy(&self, _step: Step<'_>) -> Option<f64> {
        None
    }
    /// The sub-steps of a macro step, in parts of `h`.
    fn sub_steps(&self, composition: Composition) -> Vec<f64> {
        composition.gammas()
    }
}

/// Computes the quantities of a node.
pub trait ObserveNode<S, C>: Send {
    /// Whether `λ` is found, beginning with the next node; where it is not, it is empty.
    fn record_multipliers(&mut self, wanted: bool);
    /// The node observed last.
    fn node(&self) -> &Node;
    /// Everything at the node where a step starts.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    fn observe(
        &mut self,
        system: &S,
        constraints: &C,
        taken: Transition<'_>,
    ) -> Result<&Node, Singular>;
    /// What a node says without a step from there; its multipliers are those of an earlier call.
    /// `impulse`: what contacts add to the momentum of the state, shape `n` or empty; `h`: the
    /// step, 0 in compositions.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    fn observe_state(
        &mut self,
        system: &S,
        constraints: &C,
        state: &State,
        impulse: &[f64],
        h: f64,
    ) -> Result<&Node, Singular>;
    /// `force ← Gᵀλ` of the acceleration level with the velocity of the node, shape `n`, and `λ`,
    /// shape `m`, where it is asked for.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    fn acceleration_force(
        &mut self,
        system: &S,
        constraints: &C,
        state: &State,
        force: &mut [f64],
        lambda: Option<&mut [f64]>,
    ) -> Result<(), Singular>;
    /// `v ← v̂` of a momentum `p` at the node of a state, before a step `h`; of variational
    /// schemes. Shape `n`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    fn velocity(
        &mut self,
        _system: &S,
        _constraints: &C,
        _state: &State,
        _h: f64,
        _p: &[f64],
        _v: &mut [f64],
    ) -> Result<(), Singular> {
        Err(Singular)
    }
    /// `p ← p + D_1 L_d + f_d^- = h Gᵀλ_n` of a step from the momentum `p`; of variational schemes.
    /// Shape `n`.
    fn constraint_impulse(&mut self, _system: &S, _s: &Interval, _p: &mut [f64]) {}
    /// Replaces changes `δp̄_n` of the momentum from which a step was taken, `p`, by the changes
    /// `δq_{n+1}` of its end; of variational schemes. `changes`: one of shape `n` after the other.
    ///
    /// # Errors
    /// [`Singular`] where the step has no derivative.
    fn step_response(
        &mut self,
        _system: &S,
        _constraints: &C,
        _s: &Interval,
        _p: &[f64],
        _changes: &mut [f64],
    ) -> Result<(), Singular> {
        Err(Singular)
    }
}

impl<S: DiscreteLagrangian, C: Constraints> Discretization<C> for S {
    type Observer = NodeObserver;

    fn observer(&self, m: usize, rows: &IndependentRows) -> NodeObserver {
        NodeObserver::new(self, m, rows)
    }

    fn begin(&self, state: &mut State, v: &[f64]) {
        let mut internal = vec![0.0; self.internal_variables()];
        self.begin_internal(state.configuration().moving(v), &mut internal);
        state.internal = internal;
    }

    fn samples(&self, state: &State) -> bool {
        DiscreteLagrangian::samples(self, state.step)
    }

    fn sample(&self, state: &mut State, v: &[f64]) {
        let State { step, t, q, angles, internal, .. } = state;
        let at = Configuration { t: *t, q, angles, internal: &[] };
        DiscreteLagrangian::sample(self, *step, at.moving(v), internal);
    }

    fn discrete_energy(&self, step: Step<'_>) -> Option<f64> {
        Some(step.discrete_energy(self))
    }
}

impl<S: DiscreteLagrangian, C: Constraints> ObserveNode<S, C> for NodeObserver {
    fn record_multipliers(&mut self, wanted: bool) {
        Self::record_multipliers(self, wanted);
    }

    fn node(&self) -> &Node {
        Self::node(self)
    }

    fn observe(
        &mut self,
        system: &S,
        constraints: &C,
        Transition { before, step, impulse, .. }: Transition<'_>,
    ) -> Result<&Node, Singular> {
        Self::observe(self, system, constraints, before, impulse, step.s)
    }

    fn velocity(
        &mut self,
        system: &S,
        constraints: &C,
        state: &State,
        h: f64,
        p: &[f64],
        v: &mut [f64],
    ) -> Result<(), Singular> {
        Self::velocity(self, system, constraints, state, h, p, v)
    }

    fn constraint_impulse(&mut self, system: &S, s: &Interval, p: &mut [f64]) {
        Self::constraint_impulse(self, system, s, p);
    }

    fn step_response(
        &mut self,
        system: &S,
        constraints: &C,
        s: &Interval,
        p: &[f64],
        changes: &mut [f64],
    ) -> Result<(), Singular> {
        Self::step_response(self, system, constraints, s, p, changes)
    }

    fn observe_state(
        &mut self,
        system: &S,
        constraints: &C,
        state: &State,
        impulse: &[f64],
        h: f64,
    ) -> Result<&Node, Singular> {
        Self::observe_state(self, system, constraints, state, impulse, h)
    }

    fn acceleration_force(
        &mut self,
        system: &S,
        constraints: &C,
        state: &State,
        force: &mut [f64],
        lambda: Option<&mut [f64]>,
    ) -> Result<(), Singular> {
        Self::acceleration_force(self, system, constraints, state, force, lambda)
    }
}
