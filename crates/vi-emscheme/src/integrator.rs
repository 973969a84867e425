//! A system, its constraints and a form of the scheme: ready to step.
//!
//! ```
//! use vi_constraints::ConstraintFn;
//! use vi_core::{SeparableSystem, potential::LinearPotential};
//! use vi_emscheme::{EmForm, EmIntegrator, EmOptions, EmSystem};
//!
//! // a planar pendulum: M = I, V = −(0, −9.81)·q, g = ½(|q|² − 1), G = qᵀ
//! let free = SeparableSystem::with_diagonal_mass(&[1.0, 1.0])
//!     .potential(LinearPotential { force: vec![0.0, -9.81] });
//! let rod = ConstraintFn::new(2, 1,
//!     |q, g| g[0] = 0.5 * (q[0] * q[0] + q[1] * q[1] - 1.0),
//!     |q, G| { G[(0, 0)] = q[0]; G[(0, 1)] = q[1]; });
//! let options = EmOptions::new(EmForm::Dalembert, 0.01);
//! let at = (0.0, &[1.0, 0.0][..], &[0.0, 0.0][..]);
//! let mut run = EmIntegrator::new(EmSystem::of_linear(&free), rod, options, at)?;
//! for _ in 0..100 {
//!     run.step()?;
//! }
//! let node = run.observe()?;
//! assert!(node.energy.abs() < 1e-12 && node.position_residual < 1e-14);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::constrained::EmConstrained;
use crate::constraint::DiscreteConstraints;
use crate::dalembert::EmDalembert;
use crate::em_system::EmSystem;
use crate::loop_nodal::{EmLoopNodal, LoopRows};
use crate::nodal::EmNodal;
use crate::node::{Before, EmNode, EmObserver};
use crate::null_space::{AveragedTree, DiscreteNullSpace, DiscreteQr, TreeComplement};
use crate::scheme::{EmForm, EmScheme, EmState};
use vi_constraints::agreement::{Contradiction, contradiction};
use vi_constraints::closure::ClosureWatch;
use vi_constraints::initialization::{StartError, StartReport, start};
use vi_constraints::integrator::{SetupError, SingularStart, Start, StepReport};
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError, SubStep};
use vi_constraints::{Constraints, Reparametrization};
use vi_core::SeparableSystem;
use vi_core::interval::Interval;
use vi_core::newton::NewtonSettings;
use vi_multibody::closed_loop::{longest_arm, with_floors};
use vi_multibody::map::TreeMap;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::run::Loops;

/// What to integrate with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmOptions {
    /// One of the three forms.
    pub form: EmForm,
    /// Time step `h`, s; negative to run backwards in time.
    pub step: f64,
    /// Newton's method.
    pub newton: NewtonSettings,
}

impl EmOptions {
    /// Step `h` (s) and Newton's method to the round-off floor.
    #[must_use]
    pub fn new(form: EmForm, step: f64) -> Self {
        Self { form, step, newton: NewtonSettings::default() }
    }
}

/// Why an integrator could not be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EmSetupError {
    /// The step is zero or not finite.
    #[error("the time step is {0}: it must be a finite number other than zero")]
    Step(f64),
    /// No consistent start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// Dependent constraints contradict each other at the start.
    #[error(transparent)]
    Contradiction(#[from] Contradiction),
    /// The form needs `F_d`.
    #[error(
        "the scheme `{}` needs a map F_d(u, q_n): give a reparametrization, or use the scheme \
         `em-constrained` or `em-dalembert`",
        .0.name()
    )]
    NeedsReparametrization(EmForm),
    /// The start is a singular placement that the motion cannot leave.
    #[error(transparent)]
    Singular(SetupError),
    /// Shapes do not match.
    #[error("{what} has {found} entries where {expected} are needed")]
    Shape {
        /// Which input.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The right length.
        expected: usize,
    },
}

/// A running integration.
pub struct EmIntegrator<C> {
    system: EmSystem,
    constraints: C,
    scheme: Box<dyn EmScheme<C>>,
    observer: EmObserver,
    rows: IndependentRows,
    step: f64,
    t0: f64,
    steps: u64,
    state: EmState,
    before: EmState,     // the node the last step started from
    step_before: Before, // the step that ended there
    carry: bool,         // the scheme's interval is the last step
    start: StartReport,
    watch: ClosureWatch,
}

impl<C: DiscreteConstraints + 'static> EmIntegrator<C> {
    /// The constrained and the d'Alembert form, `P̄` from a pivoted QR of `Ḡᵀ`.
    ///
    /// Energy is exact for constraints that are at most quadratic; others get `Ḡ = G(q_{n+1/2})` too.
    ///
    /// # Errors
    /// [`EmSetupError`].
    pub fn new(
        system: EmSystem,
        constraints: C,
        options: EmOptions,
        at: Start<'_>,
    ) -> Result<Self, EmSetupError> {
        check(&system, &constraints, options, at)?;
        let (n, m) = (constraints.dim(), constraints.len());
        let rows = IndependentRows::find(&constraints, at.0, at.1);
        let chosen = (rows.clone(), m);
        let scheme: Box<dyn EmScheme<C>> = match options.form {
            EmForm::Constrained => Box::new(EmConstrained::new(n, chosen, options.newton)),
            EmForm::Dalembert => {
                let source = DiscreteQr::new(n, m, rows.len());
                Box::new(EmDalembert::new(n, chosen, source, options.newton))
            }
            EmForm::Nodal => return Err(EmSetupError::NeedsReparametrization(options.form)),
        };
        Self::with_scheme(system, constraints, (scheme, rows), options, at)
    }

    /// All three forms, with the user's `P̄` and `F_d`.
    ///
    /// # Errors
    /// [`EmSetupError`].
    pub fn with_null_space<N, R>(
        system: EmSystem,
        constraints: C,
        (source, map): (N, R),
        options: EmOptions,
        at: Start<'_>,
    ) -> Result<Self, EmSetupError>
    where
        N: DiscreteNullSpace<C> + 'static,
        R: Reparametrization + 'static,
    {
        check(&system, &constraints, options, at)?;
        let (n, m) = (constraints.dim(), constraints.len());
        let rows = IndependentRows::find(&constraints, at.0, at.1);
        if map.dof() != n - rows.len() {
            let what = "the increment u of the reparametrization";
            return Err(EmSetupError::Shape { what, found: map.dof(), expected: n - rows.len() });
        }
        let chosen = (rows.clone(), m);
        let newton = options.newton;
        let scheme: Box<dyn EmScheme<C>> = match options.form {
            EmForm::Constrained => Box::new(EmConstrained::new(n, chosen, newton)),
            EmForm::Dalembert => Box::new(EmDalembert::new(n, chosen, source, newton)),
            EmForm::Nodal => Box::new(EmNodal::new(n, chosen, (source, map), newton)),
        };
        Self::with_scheme(system, constraints, (scheme, rows), options, at)
    }

    /// All three forms, with the user's `F_d` and `P̄` from a pivoted QR.
    ///
    /// # Errors
    /// [`EmSetupError`].
    pub fn with_reparametrization<R: Reparametrization + 'static>(
        system: EmSystem,
        constraints: C,
        map: R,
        options: EmOptions,
        at: Start<'_>,
    ) -> Result<Self, EmSetupError> {
        let (n, m, d) = (constraints.dim(), constraints.len(), map.dof());
        let source = DiscreteQr::new(n, m, n.saturating_sub(d));
        Self::with_null_space(system, constraints, (source, map), options, at)
    }

    fn with_scheme(
        system: EmSystem,
        constraints: C,
        (scheme, rows): (Box<dyn EmScheme<C>>, IndependentRows),
        options: EmOptions,
        at: Start<'_>,
    ) -> Result<Self, EmSetupError> {
        let masses = SeparableSystem::new(system.mass().clone());
        let (found, v, start) = start(&masses, &constraints, &rows, at.0, (at.1, at.2))?;
        let state = EmState::new(at.0, found.q, v);
        system.accept(&state.q);
        constraints.accept(&state.q);
        let (n, m) = (system.dim(), constraints.len());
        let at = (state.t, &state.q[..], &state.v[..]);
        if let Some(found) = contradiction(&constraints, &rows, at) {
            return Err(found.into());
        }
        let watch = ClosureWatch::new(&constraints, (at.0, at.1), options.newton.tolerance);
        Ok(Self {
            system,
            constraints,
            scheme,
            observer: EmObserver::new(n, m),
            rows,
            step: options.step,
            t0: at.0,
            steps: 0,
            before: state.clone(),
            state,
            step_before: Before::new(n, m),
            carry: false,
            start,
            watch,
        })
    }

    /// One step.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was.
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        let Self { scheme, system, constraints, state, before, .. } = self;
        before.copy_from(state);
        if self.carry {
            self.step_before.take(scheme.interval(), scheme.scaled_multiplier());
        }
        self.carry = false; // until the step has gone well
        let t_end = self.t0 + (self.steps + 1) as f64 * self.step; // no sum of round-offs
        let step = SubStep { lane: 0, h: self.step, t_end };
        let report = scheme.advance(system, constraints, step, state)?;
        system.accept(&state.q);
        constraints.accept(&state.q);
        if let Err(error) = self.watch.check(constraints, state.t, &state.q) {
            state.copy_from(before);
            system.accept(&state.q);
            constraints.accept(&state.q);
            scheme.reset();
            return Err(error);
        }
        self.carry = true;
        self.steps += 1;
        state.step = self.steps;
        let (iterations, residual) = (report.iterations, report.residual);
        Ok(StepReport { iterations, sub_steps: 1, residual })
    }

    /// The quantities of the node that the last step has left, with the multipliers of that step.
    pub fn node_before(&mut self) -> &EmNode {
        let Self { observer, system, rows, constraints, before, scheme, step_before, .. } = self;
        let step = (scheme.interval(), scheme.scaled_multiplier());
        observer.observe((system, rows), constraints, before, step, step_before);
        self.observer.node()
    }

    /// The quantities of the current node. The multipliers belong to the step that starts here: it is
    /// taken, and taken back.
    ///
    /// # Errors
    /// [`StepError`] when that step fails.
    pub fn observe(&mut self) -> Result<&EmNode, StepError> {
        let kept = (self.before.clone(), self.steps);
        self.step()?;
        self.node_before();
        self.state.copy_from(&self.before);
        self.system.accept(&self.state.q);
        self.constraints.accept(&self.state.q);
        (self.before, self.steps) = kept;
        self.carry = false; // `step_before` holds the last step already
        self.scheme.reset();
        Ok(self.observer.node())
    }

    /// What can be said of the current node without a step from there: energy, momentum, residuals. The
    /// multipliers are those of an earlier call.
    pub fn observe_state(&mut self) -> &EmNode {
        self.observer.observe_state(&self.system, &self.constraints, &self.state);
        self.observer.node()
    }

    /// Reverses the direction of time; the next step retraces the last one.
    pub fn reverse(&mut self) {
        self.step = -self.step;
        self.t0 = self.state.t;
        self.steps = 0;
        (self.carry, self.step_before.known) = (false, false);
        self.scheme.reset();
    }

    /// The current state.
    #[must_use]
    pub fn state(&self) -> &EmState {
        &self.state
    }

    /// The state that the last step started from.
    #[must_use]
    pub fn before(&self) -> &EmState {
        &self.before
    }

    /// `H_n` of the current state, J.
    #[must_use]
    pub fn energy(&self) -> f64 {
        self.system.energy(&self.state.q, &self.state.v)
    }

    /// The interval of the last step.
    #[must_use]
    pub fn interval(&self) -> &Interval {
        self.scheme.interval()
    }

    /// `μ = h²λ` of the last step over all constraints, zero where redundant; shape `m`.
    #[must_use]
    pub fn scaled_multiplier(&self) -> &[f64] {
        self.scheme.scaled_multiplier()
    }

    /// How consistent the start was.
    #[must_use]
    pub fn start_report(&self) -> &StartReport {
        &self.start
    }

    /// The system.
    #[must_use]
    pub fn system(&self) -> &EmSystem {
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
    #[must_use]
    pub fn condition(&self) -> Option<Condition> {
        self.scheme.condition()
    }
}

impl EmIntegrator<Mechanism> {
    /// A mechanism from its start; loops and single constraints on a spanning tree.
    ///
    /// | | `em-nodal` | `em-dalembert` | `em-constrained` |
    /// |---|---|---|---|
    /// | trees | averaged velocity maps | the same | sparse |
    /// | loops | the same and a small complement, `u` of the tree | QR of `Ḡᵀ` | sparse |
    /// | screws in the tree | QR of `Ḡᵀ` | the same | sparse |
    ///
    /// # Errors
    /// [`EmSetupError`]; `em-constrained` and `em-dalembert` refuse to start in a singular placement.
    pub fn of_mechanism(
        system: EmSystem,
        mechanism: Mechanism,
        options: EmOptions,
    ) -> Result<Self, EmSetupError> {
        let (q, v) = mechanism.start();
        Self::of_mechanism_at(system, mechanism, options, (0.0, &q, &v))
    }

    /// The same from another start.
    ///
    /// # Errors
    /// As [`EmIntegrator::of_mechanism`].
    pub fn of_mechanism_at(
        system: EmSystem,
        mechanism: Mechanism,
        options: EmOptions,
        at: Start<'_>,
    ) -> Result<Self, EmSetupError> {
        check(&system, &mechanism, options, at)?;
        let loops = Loops::find(&mechanism, at.0, at.1).map_err(EmSetupError::Singular)?;
        if loops.rows_at_start.is_some() && options.form != EmForm::Nodal {
            return Err(EmSetupError::Singular(loops.refusal(SingularStart::Scheme)));
        }
        let (n, m, rows) = (mechanism.dim(), mechanism.len(), loops.rows.clone());
        let (chosen, newton) = ((rows.clone(), m), options.newton);
        let qr = || DiscreteQr::new(n, m, rows.len());
        let map = TreeMap::new(&mechanism);
        let averaged = || AveragedTree::new(&mechanism).filter(|_| !mechanism.has_loops());
        let scheme: Box<dyn EmScheme<Mechanism>> = match options.form {
            EmForm::Constrained => Box::new(EmConstrained::new(n, chosen, newton)),
            EmForm::Dalembert => match averaged() {
                Some(source) => Box::new(EmDalembert::new(n, chosen, source, newton)),
                None => Box::new(EmDalembert::new(n, chosen, qr(), newton)),
            },
            EmForm::Nodal if mechanism.has_loops() => {
                nodal_on_loops(&mechanism, &loops, newton, at)?
            }
            EmForm::Nodal => match averaged() {
                Some(source) => Box::new(EmNodal::new(n, chosen, (source, map), newton)),
                None => Box::new(EmNodal::new(n, chosen, (qr(), map), newton)),
            },
        };
        let at_start = loops.rows_at_start.unwrap_or_else(|| rows.clone());
        let mut run = Self::with_scheme(system, mechanism, (scheme, at_start), options, at)?;
        run.rows = rows;
        Ok(run)
    }
}

/// `em-nodal` with the unknowns of the spanning tree.
fn nodal_on_loops(
    mechanism: &Mechanism,
    loops: &Loops,
    newton: NewtonSettings,
    at: Start<'_>,
) -> Result<Box<dyn EmScheme<Mechanism>>, EmSetupError> {
    let (n, m, map) = (mechanism.dim(), mechanism.len(), TreeMap::new(mechanism));
    let blocks = with_floors(mechanism, map.blocks());
    let rows = loop_rows(mechanism, &loops.rows, at);
    let mut rates = None;
    if let Some(rank) = loops.rank.as_ref().filter(|_| loops.rows_at_start.is_some()) {
        rates = Some(rank.departure(mechanism, at).map_err(EmSetupError::Singular)?.rates);
    }
    fn boxed<N: DiscreteNullSpace<Mechanism> + 'static>(
        scheme: EmLoopNodal<N, TreeMap>,
        rates: Option<Vec<f64>>,
    ) -> Box<dyn EmScheme<Mechanism>> {
        match rates {
            Some(rates) => Box::new(scheme.starting_with(rates)),
            None => Box::new(scheme),
        }
    }
    Ok(match TreeComplement::new(mechanism, rows.clone()) {
        Some(source) => boxed(EmLoopNodal::new((n, m), rows, (source, map), blocks, newton), rates),
        None => {
            let source = DiscreteQr::new(n, m, loops.rows.len());
            boxed(EmLoopNodal::new((n, m), rows, (source, map), blocks, newton), rates)
        }
    })
}

/// The constraints that the spanning tree leaves out; lengths weighed by the longest lever arm.
fn loop_rows(
    mechanism: &Mechanism,
    independent: &IndependentRows,
    (t, q, _): Start<'_>,
) -> LoopRows {
    let mut rows = mechanism.loop_rows();
    rows.extend(mechanism.cut_bars().iter().flat_map(|&k| mechanism.bar_rows(k)));
    rows.sort_unstable();
    let arm = longest_arm(mechanism);
    let frames = 12 * mechanism.description().bodies.len();
    let mut jacobian = nalgebra::DMatrix::zeros(mechanism.len(), mechanism.dim());
    mechanism.jacobian(t, q, &mut jacobian);
    let is_length = |j: usize| j >= frames || j % 12 < 3;
    let size = |row: &usize| {
        let entries = jacobian.row(*row);
        let weighed =
            entries.iter().enumerate().map(|(j, g)| if is_length(j) { arm * g } else { *g });
        let size = weighed.map(|g| g * g).sum::<f64>().sqrt();
        if size > 0.0 { 1.0 / size } else { 1.0 }
    };
    let scale = rows.iter().map(size).collect();
    let rank = rows.len() - (mechanism.len() - independent.len());
    LoopRows { rows, scale, rank }
}

fn check(
    system: &EmSystem,
    constraints: &impl Constraints,
    options: EmOptions,
    (_, q, v): Start<'_>,
) -> Result<(), EmSetupError> {
    if !(options.step.is_finite() && options.step != 0.0) {
        return Err(EmSetupError::Step(options.step));
    }
    let expected = system.dim();
    for (what, found) in [
        ("q(0)", q.len()),
        ("v(0)", v.len()),
        ("the argument of the constraints", constraints.dim()),
    ] {
        if found != expected {
            return Err(EmSetupError::Shape { what, found, expected });
        }
    }
    Ok(())
}
