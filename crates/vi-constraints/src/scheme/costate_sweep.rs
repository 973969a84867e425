//! Costates pulled back over the steps of a motion, by whatever solves with the transposed matrix.
//!
//! ```text
//! a_n = dJ/dq_n,   b_n = dJ/dp̄_n           from those of n + 1, step by step [2.38], [2.50]
//! ```
//! [`Linearization`] solves with the saddle-point matrix of any constraints. What knows the
//! structure of a mechanism may hold another momentum `p̃_n` than `p̄_n` while `q_n` is varied: one
//! without what acts along unknowns of a step, as long as it is held at every node but the first,
//! where the two are one.

use crate::constraints::Constraints;
use crate::design::{Costates, Place};
use crate::galerkin::GalerkinLinearization;
use crate::integrator::OrderMethod;
use crate::linearization::{Costate, LinearizationError, Sources, StepLinearization, Tangent};
use crate::saddle_point::IndependentRows;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::Singular;

/// Pulls costates back. `points`: the step alone, or `(q_n, q_j)`, `j = 1 … s`, of a Galerkin step,
/// of which the last is the step.
pub trait CostateSweep<S, C> {
    /// `out ←` the momentum `p̃_{n+1}` that is held at the end of a step of order 2 from `p̃_n` in
    /// `out`, shape `n`. By Galerkin steps it is `p̄_{n+1}` of the state.
    fn momentum(&mut self, system: &S, s: &Interval, out: &mut [f64]);

    /// Makes `a`, the derivative by `q_N` with `p̄_N` held, one with `p̃_N` held, after the last
    /// step.
    fn hold(&mut self, system: &S, points: &[Interval], costate: &mut Costate);

    /// Replaces the costate at the end of the step, derivatives by `q_{n+1}` included that only
    /// this step has, by that at its start; `p`: `p̃_n`. `a` along [`CostateTangents`].
    ///
    /// # Errors
    /// [`Singular`].
    fn pull(
        &mut self,
        system: &S,
        constraints: &C,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular>;

    /// The same with multipliers of all rows between bodies: `a` then counts along all motions of
    /// rigid bodies, whatever [`CostateTangents`] were chosen.
    ///
    /// # Errors
    /// [`Singular`].
    fn pull_by_rows(
        &mut self,
        system: &S,
        constraints: &C,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        self.pull(system, constraints, points, p, costate)
    }

    /// Whether it takes what impulses of constraints cost ([`CostateSweep::pull_with`]).
    fn takes_impulses(&self) -> bool {
        false
    }

    /// The same where `h λ` costs: `G μ = −∂J/∂(h λ)` then [2.38].
    ///
    /// # Errors
    /// [`LinearizationError`], also where the number is not determined.
    fn pull_with(
        &mut self,
        _system: &S,
        _constraints: &C,
        _points: &[Interval],
        _p: &[f64],
        _costate: &mut Costate,
        _cost: &mut ImpulseCost<'_>,
    ) -> Result<(), LinearizationError> {
        Err(Singular.into())
    }

    /// Visits the parts of the equations of the last step with `h λ`, shape `m`, and costates; both
    /// of rows count with [`CostateTangents::OfBodies`], and where they were asked for.
    fn for_each_part(&self, points: &[Interval], visit: &mut PartVisitor<'_>);
}

/// Takes a part of the equations of a step, impulses of its constraints, and costates.
pub type PartVisitor<'a> = dyn FnMut(Place<'_>, &[f64], Costates<'_>) + 'a;

/// Takes the impulses `h λ` of constraints and gives `∂J/∂(h λ)`, both of shape `m`, and adds
/// `∂J/∂q_{n+1}` of the same cost, shape `n`; the impulses of the internal constraints of bodies do
/// not cost.
pub type ImpulseCost<'a> = dyn FnMut(&[f64], [&mut [f64]; 2]) + 'a;

/// Makes the sweep of a mechanism with these independent constraints over the steps of a method;
/// `None` where its structure offers none that is faster.
pub type CostateChoice<S, C> = fn(
    &S,
    &C,
    &IndependentRows,
    (OrderMethod, CostateTangents),
) -> Option<Box<dyn CostateSweep<S, C>>>;

/// Along which changes of a configuration costates count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CostateTangents {
    /// `G δq = 0`.
    OfMechanism,
    /// `G δq = −g_θ δθ`, where a parameter moves constraints: `a·δq` then counts together with what
    /// [`Costates::moved`] gives, in the place of multipliers, wherever that is given.
    OfMovedMechanism,
    /// Any of rigid bodies: `a` is then a derivative along all of them, and the multipliers and
    /// costates of all rows between bodies are found.
    OfBodies,
}

/// The linearized steps of a method: forward with sources, and backward.
#[derive(Debug)]
pub enum Linearization {
    /// Of the four schemes of order 2 and their compositions, with the sources of a step.
    Step(Box<StepLinearization>, Sources),
    /// Of Galerkin schemes.
    Galerkin(Box<GalerkinLinearization>),
}

impl Linearization {
    /// For `n` coordinates and an independent set of `m` constraints.
    #[must_use]
    pub fn new(method: OrderMethod, n: usize, m: usize, rows: &IndependentRows) -> Self {
        match method.stages() {
            None => {
                let step = StepLinearization::new(n, m, rows);
                Self::Step(Box::new(step), Sources::zero(n, m))
            }
            Some(stages) => {
                Self::Galerkin(Box::new(GalerkinLinearization::new(n, m, rows, stages)))
            }
        }
    }

    /// Factorizes the matrix of a step from the momentum `p̄`.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn linearize(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        points: &[Interval],
        p: &[f64],
    ) -> Result<(), Singular> {
        match self {
            Self::Step(step, _) => step.linearize(system, constraints, last(points), p),
            Self::Galerkin(step) => step.linearize(system, constraints, points, p),
        }
    }

    /// `p ← p̄_{n+1}` of the step that was linearized.
    pub fn momentum_at_end(
        &mut self,
        system: &impl DiscreteLagrangian,
        points: &[Interval],
        p: &mut [f64],
    ) {
        match self {
            Self::Step(..) => system.forced_d2(last(points), p),
            Self::Galerkin(step) => step.momentum(system, p),
        }
    }

    /// How many parts its equations have.
    #[must_use]
    pub fn parts(&self) -> usize {
        match self {
            Self::Step(..) => 1,
            Self::Galerkin(step) => step.parts(),
        }
    }

    /// A part with the impulses of its constraints.
    #[must_use]
    pub fn part<'a>(&'a self, points: &'a [Interval], k: usize) -> (Place<'a>, &'a [f64]) {
        match self {
            Self::Step(step, _) => (Place::Step(last(points)), step.impulse()),
            Self::Galerkin(step) => step.part(k),
        }
    }

    /// No sources from now on.
    pub fn clear_sources(&mut self) {
        match self {
            Self::Step(_, sources) => sources.clear(),
            Self::Galerkin(step) => step.clear_sources(),
        }
    }

    /// Adds the sources of a part.
    pub fn add_sources(&mut self, k: usize, of: &Sources) {
        match self {
            Self::Step(_, sources) => sources.add(of),
            Self::Galerkin(step) => step.add_sources(k, of),
        }
    }

    /// Adds sources of the rates of continuous states of signals at a part, shape of all internal
    /// variables; those of Gauss nodes count.
    pub fn add_rate_sources(&mut self, k: usize, rates: &[f64]) {
        if let Self::Galerkin(step) = self {
            step.add_rate_sources(k, rates);
        }
    }

    /// Replaces a tangent at the start of the step by its image at the end, with these sources
    /// [2.37], [2.49].
    ///
    /// # Errors
    /// [`LinearizationError`].
    pub fn push(
        &mut self,
        system: &impl DiscreteLagrangian,
        constraints: &impl Constraints,
        points: &[Interval],
        d: &mut Tangent,
    ) -> Result<(), LinearizationError> {
        match self {
            Self::Step(step, sources) => step.push(system, constraints, last(points), sources, d),
            Self::Galerkin(step) => step.push(system, constraints, d),
        }
    }

    /// Visits the parts of the equations of the last step, with impulses and the costates of the
    /// last pull.
    pub fn for_each_part(&self, points: &[Interval], visit: &mut PartVisitor<'_>) {
        match self {
            Self::Step(step, _) => {
                visit(Place::Step(last(points)), step.impulse(), step.costates());
            }
            Self::Galerkin(step) => {
                for k in 0..step.parts() {
                    let (place, impulse) = step.part(k);
                    visit(place, impulse, step.costates(k));
                }
            }
        }
    }
}

/// The step of control points.
fn last(points: &[Interval]) -> &Interval {
    points.last().expect("a step has an end")
}

impl<S: DiscreteLagrangian, C: Constraints> CostateSweep<S, C> for Linearization {
    fn momentum(&mut self, system: &S, s: &Interval, out: &mut [f64]) {
        system.forced_d2(s, out);
    }

    fn hold(&mut self, _: &S, _: &[Interval], _: &mut Costate) {}

    fn pull(
        &mut self,
        system: &S,
        constraints: &C,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
    ) -> Result<(), Singular> {
        self.linearize(system, constraints, points, p)?;
        match self {
            Self::Step(step, _) => step.pull(system, constraints, last(points), costate),
            Self::Galerkin(step) => step.pull(system, constraints, costate),
        }
    }

    fn takes_impulses(&self) -> bool {
        matches!(self, Self::Step(..))
    }

    fn pull_with(
        &mut self,
        system: &S,
        constraints: &C,
        points: &[Interval],
        p: &[f64],
        costate: &mut Costate,
        cost: &mut ImpulseCost<'_>,
    ) -> Result<(), LinearizationError> {
        let (Self::Step(step, sources), s) = (self, last(points)) else {
            return Err(Singular.into());
        };
        step.linearize(system, constraints, s, p)?;
        let by_impulse = &mut sources.rows; // its sources are of tangents
        by_impulse.fill(0.0);
        cost(step.impulse(), [by_impulse, &mut costate.q]);
        step.pull_with(system, constraints, s, by_impulse, costate)
    }

    fn for_each_part(&self, points: &[Interval], visit: &mut PartVisitor<'_>) {
        self.for_each_part(points, visit);
    }
}
