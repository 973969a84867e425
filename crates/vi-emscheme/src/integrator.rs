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

pub use crate::setup::{EmOptions, EmSetupError};

use crate::constrained::EmConstrained;
use crate::constraint::DiscreteConstraints;
use crate::dalembert::EmDalembert;
use crate::em_system::EmSystem;
use crate::nodal::EmNodal;
use crate::node::{EmNode, EmObserver};
use crate::null_space::{DiscreteNullSpace, DiscreteQr};
use crate::scheme::{EmForm, EmScheme, start_state};
use vi_constraints::agreement::contradiction;
use vi_constraints::closure::ClosureWatch;
use vi_constraints::initialization::{StartReport, start};
use vi_constraints::integrator::{Origin, ResumeError, SetupError, Start, StepReport};
use vi_constraints::saddle_point::IndependentRows;
use vi_constraints::scheme::{Condition, StepError, SubStep};
use vi_constraints::{Constraints, Reparametrization};
use vi_core::SeparableSystem;
use vi_core::interval::Interval;
use vi_core::state::State;

/// A running integration.
pub struct EmIntegrator<C> {
    system: EmSystem,
    constraints: C,
    scheme: Box<dyn EmScheme<C>>,
    observer: EmObserver,
    pub(crate) rows: IndependentRows,
    sub_steps: Vec<f64>, // in parts of the macro step
    step: f64,
    origin: Origin,
    state: State,
    before: State, // the node the last macro step started from
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
        let (chosen, sub_steps) = ((rows.clone(), m), options.sub_steps().len());
        let scheme: Box<dyn EmScheme<C>> = match options.form {
            EmForm::Constrained => {
                Box::new(EmConstrained::new(n, chosen, options.newton, sub_steps))
            }
            EmForm::Dalembert => {
                let source = DiscreteQr::new(n, m, rows.len());
                Box::new(EmDalembert::new(n, chosen, source, options.newton, sub_steps))
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
        let (newton, sub_steps) = (options.newton, options.sub_steps().len());
        let scheme: Box<dyn EmScheme<C>> = match options.form {
            EmForm::Constrained => Box::new(EmConstrained::new(n, chosen, newton, sub_steps)),
            EmForm::Dalembert => Box::new(EmDalembert::new(n, chosen, source, newton, sub_steps)),
            EmForm::Nodal => Box::new(EmNodal::new(n, chosen, (source, map), newton, sub_steps)),
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

    pub(crate) fn with_scheme(
        system: EmSystem,
        constraints: C,
        (scheme, rows): (Box<dyn EmScheme<C>>, IndependentRows),
        options: EmOptions,
        at: Start<'_>,
    ) -> Result<Self, EmSetupError> {
        let masses = SeparableSystem::new(system.mass().clone());
        let (found, v, start) = start(&masses, &constraints, &rows, at.0, (at.1, at.2))?;
        let mut state = start_state(&system, at.0, found.q, v);
        state.angles = vec![0.0; constraints.angle_count()];
        constraints.unwrap_angles(&state.q, &mut state.angles);
        let (n, m) = (system.dim(), constraints.len());
        let at = (state.configuration(), &state.v[..]);
        if let Some(found) = contradiction(&constraints, &rows, at) {
            return Err(found.into());
        }
        let tolerance = options.newton.tolerance;
        let watch = ClosureWatch::new(&constraints, state.configuration(), tolerance);
        Ok(Self {
            system,
            constraints,
            scheme,
            observer: EmObserver::new(n, m),
            rows,
            sub_steps: options.sub_steps(),
            step: options.step,
            origin: Origin { t: state.t, step: 0 },
            before: state.clone(),
            state,
            start,
            watch,
        })
    }

    /// One macro step.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was before the macro step.
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        self.step_with(&mut |_, _, _| {})
    }

    /// One macro step; `each` sees the interval of every sub-step with its `μ = h²λ`, as
    /// [`EmIntegrator::scaled_multiplier`].
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was before the macro step.
    pub fn step_with(
        &mut self,
        each: &mut dyn FnMut((&EmSystem, &C), &Interval, &[f64]),
    ) -> Result<StepReport, StepError> {
        self.before.copy_from(&self.state);
        let taken = self.take_sub_steps(each);
        if taken.is_err() {
            self.state.copy_from(&self.before);
        }
        taken
    }

    fn take_sub_steps(
        &mut self,
        each: &mut dyn FnMut((&EmSystem, &C), &Interval, &[f64]),
    ) -> Result<StepReport, StepError> {
        let count = self.sub_steps.len();
        let mut total = StepReport { sub_steps: count, ..StepReport::default() };
        let (step, next) = (self.state.step + 1, self.origin.next_time(self.state.step, self.step));
        let Self { scheme, system, constraints, state, .. } = self;
        for (index, part) in self.sub_steps.iter().enumerate() {
            let h = part * self.step;
            let t_end = if index + 1 == count { next } else { state.t + h };
            let report = scheme.advance(system, constraints, SubStep { index, h, t_end }, state)?;
            constraints.unwrap_angles(&state.q, &mut state.angles);
            if let Some(s) = &state.memory.last {
                each((system, constraints), s, &state.memory.multipliers);
            }
            total.iterations += report.iterations;
            total.residual = total.residual.max(report.residual);
        }
        self.watch.check(constraints, state.configuration())?;
        state.step = step;
        Ok(total)
    }

    /// Whether a macro step has several sub-steps.
    #[must_use]
    pub fn is_composed(&self) -> bool {
        self.sub_steps.len() > 1
    }

    /// The quantities of the node that the last step has left, with the multipliers of that step; with a
    /// composition without multipliers, as [`EmIntegrator::observe_state`].
    pub fn node_before(&mut self) -> &EmNode {
        if self.is_composed() {
            self.observer.observe_state(&self.system, &self.constraints, &self.before);
            return self.observer.node();
        }
        let Self { observer, system, rows, constraints, before, state, .. } = self;
        if let Some(s) = &state.memory.last {
            let step = (s, &state.memory.multipliers[..]);
            observer.observe((system, rows), constraints, before, step);
        }
        self.observer.node()
    }

    /// The quantities of the current node. The multipliers belong to the step that starts here: it is
    /// taken on a copy of the state. With a composition there are none, as in
    /// [`EmIntegrator::observe_state`].
    ///
    /// # Errors
    /// [`StepError`] when that step fails.
    pub fn observe(&mut self) -> Result<&EmNode, StepError> {
        if self.is_composed() {
            return Ok(self.observe_state());
        }
        let mut next = self.state.clone();
        let t_end = self.origin.next_time(self.state.step, self.step);
        let Self { observer, scheme, system, rows, constraints, state, watch, .. } = self;
        let sub_step = SubStep { index: 0, h: self.step, t_end };
        scheme.advance(system, constraints, sub_step, &mut next)?;
        watch.check(constraints, next.configuration())?;
        if let Some(s) = &next.memory.last {
            let step = (s, &next.memory.multipliers[..]);
            observer.observe((system, rows), constraints, state, step);
        }
        Ok(self.observer.node())
    }

    /// What can be said of the current node without a step from there: energy, momentum, residuals. The
    /// multipliers are those of an earlier call.
    pub fn observe_state(&mut self) -> &EmNode {
        self.observer.observe_state(&self.system, &self.constraints, &self.state);
        self.observer.node()
    }

    /// Continues from a state of this motion, as [`vi_constraints::Integrator::resume`].
    ///
    /// # Errors
    /// [`ResumeError`]; the state is then what it was.
    pub fn resume(&mut self, state: State) -> Result<(), ResumeError> {
        let origin = self.origin.resume(&self.state, &state, self.step)?;
        self.watch.check(&self.constraints, state.configuration())?;
        self.origin = origin;
        self.before.copy_from(&state);
        self.state = state;
        Ok(())
    }

    /// Reverses the direction of time; the next step retraces the last one.
    pub fn reverse(&mut self) {
        self.step = -self.step;
        self.origin = Origin { t: self.state.t, step: self.state.step };
        self.state.history.clear();
        self.state.memory.last = None;
    }

    /// The current state.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The state that the last step started from.
    #[must_use]
    pub fn before(&self) -> &State {
        &self.before
    }

    /// `H_n` of the current state, J.
    #[must_use]
    pub fn energy(&self) -> f64 {
        self.system.energy(self.state.configuration(), &self.state.v)
    }

    /// The interval of the last (sub-)step; `None` before the first.
    #[must_use]
    pub fn interval(&self) -> Option<&Interval> {
        self.state.memory.last.as_ref()
    }

    /// `μ = h²λ` of the last step over all constraints, zero where redundant; shape `m`, empty before the
    /// first step.
    #[must_use]
    pub fn scaled_multiplier(&self) -> &[f64] {
        &self.state.memory.multipliers
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

pub(crate) fn check(
    system: &EmSystem,
    constraints: &impl Constraints,
    options: EmOptions,
    (_, q, v): Start<'_>,
) -> Result<(), EmSetupError> {
    if !(options.step.is_finite() && options.step != 0.0) {
        return Err(EmSetupError::Step(options.step));
    }
    let backward = options.sub_steps().iter().any(|part| *part < 0.0);
    if backward && system.is_dissipative() {
        return Err(EmSetupError::Composition(SetupError::DissipativeComposition));
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
