//! A system, its constraints, a scheme and an order: ready to step.
//!
//! ```
//! use vi_constraints::{ConstraintFn, InitialValues, Integrator, Options, SchemeKind};
//! use vi_core::{SeparableSystem, potential::LinearPotential};
//!
//! // a planar pendulum: M = I, V = −(0, −9.81)·q, g = ½(|q|² − 1), G = qᵀ
//! let system = SeparableSystem::with_diagonal_mass(&[1.0, 1.0])
//!     .potential(LinearPotential { force: vec![0.0, -9.81] });
//! let rod = ConstraintFn::new(2, 1,
//!     |q, g| g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0),
//!     |q, G| { G[(0, 0)] = q[0]; G[(0, 1)] = q[1]; });
//! let options = Options::new(SchemeKind::Nodal, 0.01); // or any other of the four
//! let at = InitialValues::new(0.0, &[1.0, 0.0], &[0.0, 0.0]);
//! let mut run = Integrator::new(system, rod, options, at)?;
//! for _ in 0..100 {
//!     run.step()?;
//! }
//! let node = run.observe()?;
//! assert!(node.position_residual < 1e-14);
//! assert!((run.state().q[0] - -0.98629).abs() < 2e-3); // exact: −0.986291751132
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod kernels;

pub use crate::setup::{Method, Options, SetupError, SingularStart, check_dense};

use crate::agreement::contradiction;
use crate::closure::ClosureWatch;
use crate::constrained::Constrained;
use crate::constraints::Constraints;
use crate::dalembert::{Dalembert, MapSource, QrSource};
use crate::discretization::{Discretization, ObserveNode, Step};
use crate::galerkin::{DenseControlPoints, GalerkinConstrained, GalerkinNodal, Pointwise};
use crate::initialization::{ConsistentStart, InitialValues, StartReport, start};
use crate::nodal::Nodal;
use crate::node::{Node, NodeObserver};
use crate::node_solvers::NodeSolvers;
use crate::reparametrization::{DenseNodal, Reparametrization};
use crate::saddle_point::IndependentRows;
use crate::scheme::{Condition, Scheme, SchemeKind, StepError, StepSolver, SubStep};
use crate::tangent_space::TangentSpace;
use std::sync::Arc;
use vi_core::discrete_lagrangian::DiscreteLagrangian;
use vi_core::interval::Interval;
use vi_core::linear::Singular;
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::state::State;

/// A running integration: macro steps of one scheme at one order.
///
/// The bits of every later step are a function of what it was made from and of its [`State`]:
/// [`Integrator::resume`] continues a motion from a state that was stored.
pub struct Integrator<S: Discretization<C>, C> {
    system: S,
    constraints: Arc<C>,
    scheme: Box<dyn Scheme<S, C>>,
    solver: StepSolver,
    observer: S::Observer,
    start_observer: Option<S::Observer>, // where the start has fewer independent constraints
    rows: IndependentRows,
    gammas: Vec<f64>,
    method: Method,
    step: f64,
    origin: Origin,
    state: State,
    before: State, // the node the last macro step started from
    start: StartReport,
    initial_velocity: Vec<f64>,
    watch: ClosureWatch,
}

impl<S: Discretization<C>, C> std::fmt::Debug for Integrator<S, C> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Integrator")
            .field("step", &self.step)
            .field("gammas", &self.gammas)
            .field("state", &self.state)
            .finish_non_exhaustive()
    }
}

/// The node from which time is counted: `t_n = t + (n − step) h`, not the sum of rounded steps.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Origin {
    t: f64, // s
    step: u64,
}

impl Origin {
    /// `t_n`, s.
    fn time(self, n: u64, h: f64) -> f64 {
        self.t + (n - self.step) as f64 * h
    }

    /// The origin after a motion continues from `next` instead of `present`.
    fn resume(self, present: &State, next: &State, h: f64) -> Result<Self, ResumeError> {
        for (what, found, expected) in [
            ("q", next.q.len(), present.q.len()),
            ("p", next.p.len(), present.p.len()),
            ("v", next.v.len(), present.v.len()),
            ("the angles", next.angles.len(), present.angles.len()),
            ("the internal variables", next.internal.len(), present.internal.len()),
            ("the compensation of q", next.compensation.q.len(), present.compensation.q.len()),
            ("the compensation of v", next.compensation.v.len(), present.compensation.v.len()),
        ] {
            if found != expected {
                return Err(ResumeError::Shape { what, found, expected });
            }
        }
        let vectors = [&next.q, &next.p, &next.v, &next.angles, &next.internal];
        if !(next.t.is_finite() && vectors.iter().all(|x| x.iter().all(|x| x.is_finite()))) {
            return Err(ResumeError::NotFinite);
        }
        let counts =
            next.step >= self.step && self.time(next.step, h).to_bits() == next.t.to_bits();
        Ok(if counts { self } else { Self { t: next.t, step: next.step } })
    }
}

/// Newton's work in one macro step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Iterations, summed over sub-steps.
    pub iterations: usize,
    /// Sub-steps.
    pub sub_steps: usize,
    /// Largest `|r|_∞` of the last evaluations ([`NewtonReport::residual`](vi_core::NewtonReport)).
    pub residual: f64,
    /// Initial guesses that failed.
    pub restarts: usize,
}

impl<S: DiscreteLagrangian + 'static, C: Constraints + 'static> Integrator<S, C> {
    /// All four schemes from `g` alone: `P` of scheme 2 from a pivoted QR of `Gᵀ`, `P` and `F_d` of
    /// schemes 3 and 4 from the [`TangentSpace`].
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn new(
        system: S,
        constraints: C,
        options: Options,
        at: InitialValues<'_>,
    ) -> Result<Self, SetupError> {
        let constraints = Arc::new(constraints);
        let (n, m) = (constraints.dim(), constraints.len());
        check_shapes(&system, &*constraints, at)?;
        let rows = IndependentRows::find_generic(&*constraints, at.t, at.q)?;
        let scheme: Box<dyn Scheme<S, C>> = match (options.scheme, options.method.stages()) {
            (SchemeKind::Constrained, Some(stages)) => {
                Box::new(GalerkinConstrained::new(n, m, rows.clone(), stages))
            }
            (_, Some(_)) => {
                return Err(SetupError::no_galerkin("constraints without a null space"));
            }
            (SchemeKind::Constrained, None) => Box::new(Constrained::new(n, m, rows.clone())),
            (SchemeKind::Dalembert, None) => {
                check_dense(n, "this scheme", "write the scheme `constrained`")?;
                let source = QrSource::new(n, m, rows.len());
                Box::new(Dalembert::new(n, m, rows.clone(), source))
            }
            (SchemeKind::Nodal | SchemeKind::Reduced, None) => {
                check_dense(n, "this scheme", "write the scheme `constrained`")?;
                let operators = TangentSpace::new(constraints.clone(), &rows);
                Box::new(Nodal::new(n, operators, options.scheme == SchemeKind::Reduced))
            }
        };
        Self::with_scheme(system, constraints, scheme, rows, options, at)?.consistent()
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
        at: InitialValues<'_>,
    ) -> Result<Self, SetupError> {
        let (n, m, d) = (constraints.dim(), constraints.len(), map.dof());
        check_shapes(&system, &constraints, at)?;
        let rows = IndependentRows::find(&constraints, at.t, at.q);
        if d != n - rows.len() {
            let what = "the increment u of the reparametrization";
            return Err(SetupError::Shape { what, found: d, expected: n - rows.len() });
        }
        let scheme: Box<dyn Scheme<S, C>> = match (options.scheme, options.method.stages()) {
            (SchemeKind::Constrained, Some(stages)) => {
                Box::new(GalerkinConstrained::new(n, m, rows.clone(), stages))
            }
            (SchemeKind::Nodal, Some(stages)) => {
                let operators = DenseControlPoints::new(n, stages.count(), map);
                let sweeps = Pointwise::new(n, stages.count(), operators);
                Box::new(GalerkinNodal::new(n, stages, sweeps))
            }
            (SchemeKind::Dalembert | SchemeKind::Reduced, Some(_)) => {
                return Err(SetupError::no_galerkin("in this form"));
            }
            (SchemeKind::Constrained, None) => Box::new(Constrained::new(n, m, rows.clone())),
            (SchemeKind::Dalembert, None) => {
                Box::new(Dalembert::new(n, m, rows.clone(), MapSource(map)))
            }
            (SchemeKind::Nodal | SchemeKind::Reduced, None) => {
                let reduced = options.scheme == SchemeKind::Reduced;
                Box::new(Nodal::new(n, DenseNodal::new(n, map), reduced))
            }
        };
        Self::with_scheme(system, constraints, scheme, rows, options, at)?.consistent()
    }
}

impl<S: Discretization<C, Observer = NodeObserver>, C: Constraints> Integrator<S, C> {
    /// Reads nodes with what the mechanism offers in the place of the saddle-point matrix.
    #[must_use]
    pub fn reading_with(mut self, solvers: NodeSolvers) -> Self {
        self.observer.solve_with(solvers);
        self
    }
}

impl<S: Discretization<C>, C: Constraints> Integrator<S, C> {
    /// Any scheme of any family, with an independent set of constraints that the caller knows.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn with_scheme<K>(
        system: S,
        constraints: impl Into<Arc<C>>,
        scheme: Box<dyn Scheme<S, C>>,
        rows: IndependentRows,
        options: Options<K>,
        at: InitialValues<'_>,
    ) -> Result<Self, SetupError> {
        let constraints: Arc<C> = constraints.into();
        if !(options.step.is_finite() && options.step != 0.0) {
            return Err(SetupError::Step(options.step));
        }
        let gammas = system.sub_steps(options.method.composition());
        check_composition(&system, &gammas)?;
        if options.method.stages().is_some() {
            check_galerkin(&system)?;
        }
        check_shapes(&system, &*constraints, at)?;
        let ConsistentStart { mut state, v: initial_velocity, report } =
            start(&system, &*constraints, &rows, at)?;
        system.begin(&mut state, &initial_velocity);
        state.angles = constraints.principal_angles(&state.q);
        let observer = system.observer(constraints.len(), &rows);
        let watch =
            ClosureWatch::new(&*constraints, state.configuration(), options.newton.tolerance);
        Ok(Self {
            system,
            constraints,
            solver: StepSolver::new(&*scheme, options.newton),
            scheme,
            observer,
            start_observer: None,
            rows,
            gammas,
            method: options.method,
            step: options.step,
            origin: Origin { t: at.t, step: 0 },
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
        let (at, v) = (self.state.configuration(), &self.initial_velocity);
        match contradiction(&*self.constraints, &self.rows, at, v) {
            Some(found) => Err(found.into()),
            None => Ok(self),
        }
    }

    /// The start is a singular configuration in which only `rows` are independent; `report` is of the
    /// projection that was made with them.
    #[must_use]
    pub fn starting_singular(mut self, rows: &IndependentRows, report: StartReport) -> Self {
        self.start_observer = Some(self.system.observer(self.constraints.len(), rows));
        self.start = report;
        self
    }

    /// Whether nodes have multipliers; they do unless said otherwise. Without them a node costs less than a step.
    /// A singular start has them always.
    pub fn record_multipliers(&mut self, wanted: bool) {
        self.observer.record_multipliers(wanted);
    }

    /// With other coefficients `γ` of the sub-steps than those of a [`vi_core::Composition`].
    ///
    /// # Errors
    /// [`SetupError::DissipativeComposition`].
    pub fn with_coefficients(mut self, gammas: Vec<f64>) -> Result<Self, SetupError> {
        check_composition(&self.system, &gammas)?;
        self.gammas = gammas;
        Ok(self)
    }

    /// One macro step.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was before the macro step.
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        self.take(1, None)
    }

    /// One macro step; `each` sees every sub-step.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was before the macro step.
    pub fn step_with(
        &mut self,
        each: &mut dyn FnMut(&S, &C, Step<'_>),
    ) -> Result<StepReport, StepError> {
        self.step_in_parts(1, each)
    }

    /// One macro step as `parts` steps of equal length, where a whole one is refused. A map of another step is another
    /// map: the structure is that of each part. Quantities of the node where it starts are those of
    /// [`Integrator::observe_state`], taken before.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was before the macro step.
    pub fn step_in_parts(
        &mut self,
        parts: u32,
        each: &mut dyn FnMut(&S, &C, Step<'_>),
    ) -> Result<StepReport, StepError> {
        self.take(parts, Some(each))
    }

    fn take(
        &mut self,
        parts: u32,
        each: Option<&mut dyn FnMut(&S, &C, Step<'_>)>,
    ) -> Result<StepReport, StepError> {
        self.before.copy_from(&self.state);
        let taken = self.take_sub_steps(parts, each);
        if taken.is_err() {
            self.state.copy_from(&self.before);
        }
        taken
    }

    fn take_sub_steps(
        &mut self,
        parts: u32,
        mut each: Option<&mut dyn FnMut(&S, &C, Step<'_>)>,
    ) -> Result<StepReport, StepError> {
        let step = self.state.step + 1;
        let next = self.origin.time(step, self.step);
        let Self { system, constraints, scheme, solver, state, gammas, .. } = self;
        let (count, part) = (gammas.len(), self.step / f64::from(parts));
        let sub_steps = parts as usize * count;
        let mut total = StepReport { sub_steps, ..StepReport::default() };
        for taken in 0..sub_steps {
            let (index, last) = (taken % count, taken + 1 == sub_steps);
            let h = gammas[index] * part;
            let t_end = if last { next } else { state.t + h };
            let step = SubStep { index, count, h, t_end };
            let report = solver.advance(&mut **scheme, system, &**constraints, step, state)?;
            constraints.unwrap_angles(&state.q, &mut state.angles);
            if let Some(each) = &mut each {
                scheme.interpolate();
                let (multipliers, gauss) = (&state.memory.multipliers, scheme.gauss());
                let (s, polynomial) = (scheme.interval(), scheme.polynomial());
                each(system, constraints, Step { s, multipliers, gauss, polynomial });
            }
            total.iterations += report.iterations;
            total.restarts += report.restarts;
            total.residual = total.residual.max(report.residual);
        }
        let at = state.configuration();
        match (scheme.meets_constraints(), scheme.keeps_orientation()) {
            (true, _) => {}
            (false, true) => self.watch.check_residuals(&**constraints, at)?,
            (false, false) => self.watch.check(&**constraints, at)?,
        }
        state.step = step;
        Ok(total)
    }

    /// Continues from a state of this motion, for example one that was stored: the next steps are, bit for
    /// bit, those that the integration which it comes from would have taken.
    ///
    /// # Errors
    /// [`ResumeError`]; the state is then what it was.
    pub fn resume(&mut self, state: State) -> Result<(), ResumeError> {
        let origin = self.origin.resume(&self.state, &state, self.step)?;
        self.watch.check(&*self.constraints, state.configuration())?;
        self.origin = origin;
        self.before.copy_from(&state);
        self.state = state;
        Ok(())
    }

    /// The quantities of the node that the last macro step has left (the node before the state's).
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn node_before(&mut self) -> Result<&Node, Singular> {
        let of_state = self.reads_states();
        let Self { observer, start_observer, system, constraints, before, state, scheme, .. } =
            self;
        let observer = observer_at(before, observer, start_observer);
        if of_state {
            return observer.observe_state(system, constraints, before, 0.0);
        }
        let step = Step::single(scheme.interval(), &state.memory.multipliers);
        observer.observe(system, constraints, before, step)
    }

    /// The quantities of the current node. At order 2 most of them belong to the step that starts here: it is
    /// taken on a copy of the state.
    ///
    /// # Errors
    /// [`ObserveError`] when that step fails or the constraints have lost rank.
    pub fn observe(&mut self) -> Result<&Node, ObserveError> {
        if self.reads_states() {
            return Ok(self.observe_state()?);
        }
        let (mut next, last) = (self.state.clone(), self.scheme.interval().clone());
        let t_end = self.origin.time(self.state.step + 1, self.step);
        let Self { observer, start_observer, system, constraints, state, scheme, watch, .. } = self;
        let sub_step = SubStep { index: 0, count: 1, h: self.gammas[0] * self.step, t_end };
        let trial = self
            .solver
            .advance(&mut **scheme, system, &**constraints, sub_step, &mut next)
            .and_then(|_| watch.check(&**constraints, next.configuration()));
        let s = std::mem::replace(scheme.interval_mut(), last);
        trial?;
        let observer = observer_at(state, observer, start_observer);
        let step = Step::single(&s, &next.memory.multipliers);
        Ok(observer.observe(system, constraints, state, step)?)
    }

    /// What can be said of the current node without a step from there: `v̂`, `ᵠp_n`, `H_d(ᵠp_n)`.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn observe_state(&mut self) -> Result<&Node, Singular> {
        let h = if self.reads_states() { 0.0 } else { self.step };
        let Self { observer, start_observer, system, constraints, state, .. } = self;
        let observer = observer_at(state, observer, start_observer);
        observer.observe_state(system, constraints, state, h)
    }

    /// What was last observed at the node of a state: [`Integrator::state`], or [`Integrator::before`] after
    /// [`Integrator::node_before`].
    #[must_use]
    pub fn observed(&self, at: &State) -> &Node {
        match &self.start_observer {
            Some(own) if at.step == 0 => own.node(),
            _ => self.observer.node(),
        }
    }

    /// The acceleration-level multiplier at the current node, with the velocity of the projected
    /// momentum; it has the order of the composition.
    ///
    /// # Errors
    /// [`Singular`] when the constraints have lost rank.
    pub fn acceleration_multiplier(&mut self) -> Result<Vec<f64>, Singular> {
        let mut lambda = Vec::new();
        self.find_acceleration_multiplier(&mut lambda)?;
        Ok(lambda)
    }

    /// The same, written to `lambda`, which gets the shape `m`.
    ///
    /// # Errors
    /// As [`Integrator::acceleration_multiplier`].
    pub fn find_acceleration_multiplier(&mut self, lambda: &mut Vec<f64>) -> Result<(), Singular> {
        let Self { observer, start_observer, system, constraints, state, .. } = self;
        let observer = observer_at(state, observer, start_observer);
        lambda.resize(constraints.len(), 0.0);
        observer.acceleration_multiplier(system, constraints, state, lambda)
    }

    /// Reverses the direction of time; the next step retraces the last one.
    pub fn reverse(&mut self) {
        self.step = -self.step;
        self.origin = Origin { t: self.state.t, step: self.state.step };
        self.state.history.clear();
        self.state.compensation.balance.fill(0.0);
        self.state.memory.last = None;
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

    /// How the order is reached.
    #[must_use]
    pub fn method(&self) -> Method {
        self.method
    }

    /// Whether nodes are read from their states alone: with a composition or a Galerkin scheme no quantity of a node
    /// belongs to the step from there.
    #[must_use]
    pub fn reads_states(&self) -> bool {
        self.gammas.len() > 1 || self.method.stages().is_some()
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
        self.scheme.condition(&self.system, &self.constraints, self.solver.solution())
    }
}

/// The steps of a motion, without end: `run.by_ref().take(100)` are a hundred macro steps. After an error the next
/// item is the attempt of the same step.
impl<S: Discretization<C>, C: Constraints> Iterator for Integrator<S, C> {
    type Item = Result<StepReport, StepError>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.step())
    }
}

/// Why a motion cannot be continued from a state.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// It is the state of another system.
    #[error("{what} of the state has {found} entries where {expected} are needed")]
    Shape {
        /// Which vector.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The right length.
        expected: usize,
    },
    /// It holds a number that is not finite.
    #[error("the state holds a number that is not finite")]
    NotFinite,
    /// It does not satisfy the constraints.
    #[error(transparent)]
    Violated(#[from] StepError),
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
fn observer_at<'a, O>(
    node: &State,
    observer: &'a mut O,
    of_the_start: &'a mut Option<O>,
) -> &'a mut O {
    match of_the_start {
        Some(own) if node.step == 0 => own,
        _ => observer,
    }
}

/// Refuses backward sub-steps of dissipative systems.
fn check_composition(system: &impl MechanicalSystem, gammas: &[f64]) -> Result<(), SetupError> {
    let backward = gammas.iter().any(|gamma| gamma * gammas[0] <= 0.0);
    match system.is_dissipative() && backward {
        true => Err(SetupError::DissipativeComposition),
        false => Ok(()),
    }
}

/// Refuses what the Galerkin schemes have no equations for.
fn check_galerkin(system: &impl MechanicalSystem) -> Result<(), SetupError> {
    if system.adds_mass() {
        return Err(SetupError::no_galerkin("beams with mass scaling"));
    }
    if system.has_memory() {
        return Err(SetupError::no_galerkin("forces with internal variables"));
    }
    Ok(())
}

/// Checks the initial values and the constraints against the number of coordinates.
///
/// # Errors
/// [`SetupError::Shape`].
pub fn check_shapes(
    system: &impl MechanicalSystem,
    constraints: &impl Constraints,
    at: InitialValues<'_>,
) -> Result<(), SetupError> {
    let expected = system.dim();
    for (what, found) in [
        ("q(0)", at.q.len()),
        ("v(0)", at.v.len()),
        ("the argument of the constraints", constraints.dim()),
    ] {
        if found != expected {
            return Err(SetupError::Shape { what, found, expected });
        }
    }
    Ok(())
}
