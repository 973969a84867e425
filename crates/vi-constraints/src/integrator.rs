//! A system, its constraints, a scheme and an order: ready to step.
//!
//! ```
//! use vi_constraints::{ConstraintFn, Integrator, Options, SchemeKind};
//! use vi_core::{SeparableSystem, potential::LinearPotential};
//!
//! // a planar pendulum: M = I, V = −(0, −9.81)·q, g = ½(|q|² − 1), G = qᵀ
//! let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0])
//!     .potential(LinearPotential { force: vec![0.0, -9.81] });
//! let rod = ConstraintFn::new(2, 1,
//!     |q, g| g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0),
//!     |q, G| { G[(0, 0)] = q[0]; G[(0, 1)] = q[1]; });
//! let options = Options::new(SchemeKind::Nodal, 0.01); // or any other of the four
//! let mut run = Integrator::new(system, rod, options, (0.0, &[1.0, 0.0], &[0.0, 0.0]))?;
//! for _ in 0..100 {
//!     run.step()?;
//! }
//! let node = run.observe()?;
//! assert!(node.position_residual < 1e-14);
//! assert!((run.state().q[0] - -0.98629).abs() < 2e-3); // exact: −0.986291751132
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use crate::setup::{Options, SetupError, SingularStart};

use crate::agreement::contradiction;
use crate::closure::ClosureWatch;
use crate::constrained::Constrained;
use crate::constraints::Constraints;
use crate::dalembert::{Dalembert, MapSource, QrSource};
use crate::initialization::{StartReport, start};
use crate::nodal::Nodal;
use crate::node::{Node, NodeObserver};
use crate::reparametrization::{DenseNodal, Reparametrization};
use crate::saddle_point::IndependentRows;
use crate::scheme::{Condition, Scheme, SchemeKind, StepError, SubStep};
use crate::tangent_space::TangentSpace;
use std::rc::Rc;
use vi_core::discrete_lagrangian::MechanicalSystem;
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_core::state::State;
use vi_core::trajectory::Sink;

/// A running integration: macro steps of one scheme at one order.
pub struct Integrator<S, C> {
    system: S,
    constraints: Rc<C>,
    scheme: Box<dyn Scheme<S, C>>,
    observer: NodeObserver,
    start_observer: Option<NodeObserver>, // where the start has fewer independent constraints
    rows: IndependentRows,
    gammas: Vec<f64>,
    step: f64,
    t0: f64,
    macro_steps: u64,
    state: State,
    before: State, // the node the last macro step started from
    start: StartReport,
    initial_velocity: Vec<f64>,
    watch: ClosureWatch,
}

/// Newton's work in one macro step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Iterations, summed over sub-steps.
    pub iterations: usize,
    /// Sub-steps.
    pub sub_steps: usize,
    /// Largest `|r|_∞` left over.
    pub residual: f64,
}

/// Time, configuration and velocity of a start.
pub type Start<'a> = (f64, &'a [f64], &'a [f64]);

impl<S: MechanicalSystem + 'static, C: Constraints + 'static> Integrator<S, C> {
    /// All four schemes from `g` alone: `P` of scheme 2 from a pivoted QR of `Gᵀ`, `P` and `F_d` of
    /// schemes 3 and 4 from the [`TangentSpace`].
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn new(
        system: S,
        constraints: C,
        options: Options,
        at: Start<'_>,
    ) -> Result<Self, SetupError> {
        let constraints = Rc::new(constraints);
        let (n, m) = (constraints.dim(), constraints.len());
        check_shapes(&system, &*constraints, at)?;
        let rows = IndependentRows::find_generic(&*constraints, at.0, at.1)?;
        let lanes = options.gammas.len();
        let scheme: Box<dyn Scheme<S, C>> = match options.scheme {
            SchemeKind::Constrained => {
                Box::new(Constrained::new(n, rows.clone(), m, options.newton, lanes))
            }
            SchemeKind::Dalembert => {
                let source = QrSource::new(n, m, rows.len());
                Box::new(Dalembert::new(n, (rows.clone(), m), source, options.newton, lanes))
            }
            SchemeKind::Nodal | SchemeKind::Reduced => {
                let operators = TangentSpace::new(constraints.clone(), &rows);
                let (reduced, d) = (options.scheme == SchemeKind::Reduced, operators.dof());
                Box::new(Nodal::new(operators, (n, d), reduced, options.newton, lanes))
            }
        };
        Self::with_scheme(system, constraints, (scheme, rows), options, at)?.consistent()
    }

    /// All four schemes, with the user's `P` and `F_d`.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn with_reparametrization<R: Reparametrization + 'static>(
        system: S,
        constraints: C,
        map: R,
        options: Options,
        at: Start<'_>,
    ) -> Result<Self, SetupError> {
        let (n, m, d) = (constraints.dim(), constraints.len(), map.dof());
        check_shapes(&system, &constraints, at)?;
        let rows = IndependentRows::find(&constraints, at.0, at.1);
        if d != n - rows.len() {
            let what = "the increment u of the reparametrization";
            return Err(SetupError::Shape { what, found: d, expected: n - rows.len() });
        }
        let (lanes, newton) = (options.gammas.len(), options.newton);
        let scheme: Box<dyn Scheme<S, C>> = match options.scheme {
            SchemeKind::Constrained => {
                Box::new(Constrained::new(n, rows.clone(), m, newton, lanes))
            }
            SchemeKind::Dalembert => {
                Box::new(Dalembert::new(n, (rows.clone(), m), MapSource(map), newton, lanes))
            }
            SchemeKind::Nodal | SchemeKind::Reduced => {
                let reduced = options.scheme == SchemeKind::Reduced;
                Box::new(Nodal::new(DenseNodal::new(n, map), (n, d), reduced, newton, lanes))
            }
        };
        Self::with_scheme(system, constraints, (scheme, rows), options, at)?.consistent()
    }

    /// Any scheme, with an independent set of constraints that the caller knows.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn with_scheme(
        system: S,
        constraints: impl Into<Rc<C>>,
        (scheme, rows): (Box<dyn Scheme<S, C>>, IndependentRows),
        options: Options,
        at: Start<'_>,
    ) -> Result<Self, SetupError> {
        let constraints: Rc<C> = constraints.into();
        if !(options.step.is_finite() && options.step != 0.0) {
            return Err(SetupError::Step(options.step));
        }
        let mut signs = options.gammas.iter().map(|gamma| gamma * options.gammas[0] > 0.0);
        if system.is_dissipative() && signs.any(|same| !same) {
            return Err(SetupError::DissipativeComposition);
        }
        check_shapes(&system, &*constraints, at)?;
        let (state, initial_velocity, report) =
            start(&system, &*constraints, &rows, at.0, (at.1, at.2))?;
        system.accept(&state.q);
        constraints.accept(&state.q);
        let observer = NodeObserver::new(&system, constraints.len(), &rows);
        let start_at = (state.t, &state.q[..]);
        let watch = ClosureWatch::new(&*constraints, start_at, options.newton.tolerance);
        Ok(Self {
            system,
            constraints,
            scheme,
            observer,
            start_observer: None,
            rows,
            gammas: options.gammas,
            step: options.step,
            t0: at.0,
            macro_steps: 0,
            before: state.clone(),
            state,
            start: report,
            initial_velocity,
            watch,
        })
    }

    /// Refuses a start at which dependent constraints contradict each other. Premise: the start is not
    /// singular.
    ///
    /// # Errors
    /// [`SetupError::Contradiction`].
    pub fn consistent(self) -> Result<Self, SetupError> {
        let at = (self.state.t, &self.state.q[..], &self.initial_velocity[..]);
        match contradiction(&*self.constraints, &self.rows, at) {
            Some(found) => Err(found.into()),
            None => Ok(self),
        }
    }

    /// The start is a singular placement in which only `rows` are independent; `report` is of the
    /// projection that was made with them.
    #[must_use]
    pub fn starting_singular(mut self, rows: &IndependentRows, report: StartReport) -> Self {
        self.start_observer = Some(NodeObserver::new(&self.system, self.constraints.len(), rows));
        self.start = report;
        self
    }

    /// One macro step.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was before the macro step.
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        self.step_with(&mut |_, _, _| {})
    }

    /// One macro step; `each` sees the interval of every sub-step.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was before the macro step.
    pub fn step_with(
        &mut self,
        each: &mut dyn FnMut(&S, &C, &Interval),
    ) -> Result<StepReport, StepError> {
        copy(&self.state, &mut self.before);
        let mut total = StepReport { sub_steps: self.gammas.len(), ..StepReport::default() };
        let next = self.t0 + (self.macro_steps + 1) as f64 * self.step; // no sum of round-offs
        for (lane, gamma) in self.gammas.iter().enumerate() {
            let h = gamma * self.step;
            let t_end = if lane + 1 == self.gammas.len() { next } else { self.state.t + h };
            let sub_step = SubStep { lane, h, t_end };
            let advance =
                self.scheme.advance(&self.system, &self.constraints, sub_step, &mut self.state);
            match advance {
                Ok(report) => {
                    each(&self.system, &self.constraints, self.scheme.interval());
                    self.system.accept(&self.state.q);
                    self.constraints.accept(&self.state.q);
                    total.iterations += report.iterations;
                    total.residual = total.residual.max(report.residual);
                }
                Err(error) => {
                    self.take_back();
                    return Err(error);
                }
            }
        }
        if let Err(error) = self.watch.check(&*self.constraints, self.state.t, &self.state.q) {
            self.take_back();
            self.scheme.reset();
            return Err(error);
        }
        self.macro_steps += 1;
        self.state.step = self.macro_steps;
        Ok(total)
    }

    fn take_back(&mut self) {
        copy(&self.before, &mut self.state);
        self.system.accept(&self.state.q);
        self.constraints.accept(&self.state.q);
    }

    /// The quantities of the node that the last macro step has left (the node before the state's).
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn node_before(&mut self) -> Result<&Node, Singular> {
        let Self { observer, start_observer, system, constraints, before, scheme, .. } = self;
        let observer = observer_at(before, observer, start_observer);
        if self.gammas.len() > 1 {
            return observer.observe_state(system, &**constraints, before.t, &before.q, &before.p);
        }
        observer.observe(system, &**constraints, scheme.interval(), &before.p, before.step == 0)
    }

    /// The quantities of the current node. At order 2 most of them belong to the step that starts
    /// here: it is taken, and taken back.
    ///
    /// # Errors
    /// [`ObserveError`] when that step fails or the constraints have lost rank.
    pub fn observe(&mut self) -> Result<&Node, ObserveError> {
        if self.gammas.len() > 1 {
            let Self { observer, start_observer, system, constraints, state, .. } = self;
            let observer = observer_at(state, observer, start_observer);
            let (t, q, p) = (state.t, &state.q, &state.p);
            return Ok(observer.observe_state(system, &**constraints, t, q, p)?);
        }
        let kept = (self.before.clone(), self.macro_steps);
        self.step()?;
        let outcome = self.node_before().map(|_| ());
        self.take_back();
        (self.before, self.macro_steps) = kept;
        self.scheme.reset();
        outcome?;
        Ok(observer_at(&self.state, &mut self.observer, &mut self.start_observer).node())
    }

    /// What can be said of the current node without a step from there: `v̂`, `ᵠp_n`, `H_d(ᵠp_n)`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn observe_state(&mut self) -> Result<&Node, Singular> {
        let Self { observer, start_observer, system, constraints, state, .. } = self;
        let observer = observer_at(state, observer, start_observer);
        observer.observe_state(system, &**constraints, state.t, &state.q, &state.p)
    }

    /// The acceleration-level multiplier at the current node, with the velocity of the projected
    /// momentum; it has the order of the composition.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn acceleration_multiplier(&mut self) -> Result<Vec<f64>, Singular> {
        let Self { observer, start_observer, system, constraints, state, .. } = self;
        let observer = observer_at(state, observer, start_observer);
        let (t, q, p) = (state.t, &state.q[..], &state.p);
        let v = observer.observe_state(system, &**constraints, t, q, p)?.v.clone();
        let mut lambda = vec![0.0; constraints.len()];
        observer.acceleration_multiplier(system, &**constraints, (t, q, &v), &mut lambda)?;
        Ok(lambda)
    }

    /// Takes `steps` macro steps; the states of the start, of every `every`-th step and of the end go
    /// to the sink.
    ///
    /// # Errors
    /// [`RunError`]; the sink then has every state up to the refused step.
    pub fn run<K: Sink<State>>(
        &mut self,
        (steps, every): (u64, u64),
        sink: &mut K,
    ) -> Result<(), RunError<K::Error>> {
        sink.record(&self.state).map_err(RunError::Sink)?;
        for n in 1..=steps {
            self.step()?;
            if n.is_multiple_of(every.max(1)) || n == steps {
                sink.record(&self.state).map_err(RunError::Sink)?;
            }
        }
        Ok(())
    }

    /// Reverses the direction of time; the next step retraces the last one.
    pub fn reverse(&mut self) {
        self.step = -self.step;
        self.t0 = self.state.t;
        self.macro_steps = 0;
        self.scheme.reset();
    }

    /// The current state.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The state that the last macro step started from.
    #[must_use]
    pub fn before(&self) -> &State {
        &self.before
    }

    /// Whether a macro step has several sub-steps.
    #[must_use]
    pub fn is_composed(&self) -> bool {
        self.gammas.len() > 1
    }

    /// The interval of the last (sub-)step.
    #[must_use]
    pub fn interval(&self) -> &Interval {
        self.scheme.interval()
    }

    /// How consistent the start was.
    #[must_use]
    pub fn start_report(&self) -> &StartReport {
        &self.start
    }

    /// The velocity at the start, after projection.
    #[must_use]
    pub fn initial_velocity(&self) -> &[f64] {
        &self.initial_velocity
    }

    /// The system.
    #[must_use]
    pub fn system(&self) -> &S {
        &self.system
    }

    /// The constraints.
    #[must_use]
    pub fn constraints(&self) -> &C {
        &self.constraints
    }

    /// The independent constraints.
    #[must_use]
    pub fn rows(&self) -> &IndependentRows {
        &self.rows
    }

    /// Condition numbers of the Newton matrix of the last step.
    pub fn condition(&mut self) -> Option<Condition> {
        self.scheme.condition(&self.system, &self.constraints)
    }
}

/// Why a run ended early.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RunError<E> {
    /// A step was refused; the integrator stands before it.
    #[error(transparent)]
    Step(#[from] StepError),
    /// The sink refused a state.
    #[error("the sink refused a state")]
    Sink(E),
}

/// Why a node could not be observed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObserveError {
    /// The step from the node failed.
    #[error(transparent)]
    Step(#[from] StepError),
    /// The constraints have lost rank.
    #[error(transparent)]
    Singular(#[from] Singular),
}

/// The observer of a node: the start may have its own.
fn observer_at<'a>(
    node: &State,
    observer: &'a mut NodeObserver,
    of_the_start: &'a mut Option<NodeObserver>,
) -> &'a mut NodeObserver {
    match of_the_start {
        Some(own) if node.step == 0 => own,
        _ => observer,
    }
}

fn copy(from: &State, to: &mut State) {
    (to.step, to.t) = (from.step, from.t);
    to.q.copy_from_slice(&from.q);
    to.p.copy_from_slice(&from.p);
}

fn check_shapes(
    system: &impl MechanicalSystem,
    constraints: &impl Constraints,
    (_, q, v): Start<'_>,
) -> Result<(), SetupError> {
    let expected = system.dim();
    for (what, found) in [
        ("q(0)", q.len()),
        ("v(0)", v.len()),
        ("the argument of the constraints", constraints.dim()),
    ] {
        if found != expected {
            return Err(SetupError::Shape { what, found, expected });
        }
    }
    Ok(())
}
