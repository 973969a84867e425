//! Macro steps, each of one or more sub-steps; the motion continued and reversed.

use super::Integrator;
use super::error::ResumeError;
use super::nodes::observer_at;
use super::origin::Origin;
use super::report::StepReport;
use crate::constraints::Constraints;
use crate::discretization::{Discretization, ObserveNode, Step, Transition};
use crate::nonsmooth::{NamedContacts, Stepping};
use crate::scheme::{StepError, SubStep};
use vi_core::interval::Interval;
use vi_core::newton::Precision;
use vi_core::state::State;

impl<S: Discretization<C>, C: Constraints> Integrator<S, C> {
    /// One macro step.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was before the macro step.
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        self.take(1, None)
    }

    /// One macro step, as the node before it, the step and the node after it:
    ///
    /// ```
    /// # use vi_constraints::{InitialValues, Integrator, Unconstrained, Options, SchemeKind};
    /// # use vi_core::SeparableSystem;
    /// # let system = SeparableSystem::with_diagonal_mass(&[1.0]);
    /// # let options = Options::new(SchemeKind::Nodal, 0.1);
    /// # let at = InitialValues::new(0.0, &[1.0], &[0.5]);
    /// # let mut run = Integrator::new(system, Unconstrained(1), options, at)?;
    /// let taken = run.advance()?;
    /// assert_eq!((taken.before.step, taken.after.step), (0, 1));
    /// assert_eq!(taken.step.s.q1, taken.after.q);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was before the macro step.
    pub fn advance(&mut self) -> Result<Transition<'_>, StepError> {
        self.step()?;
        Ok(self.transition())
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

    /// One macro step as `parts` steps of equal length, where a whole one is refused. A map of
    /// another step is another map: the structure is that of each part. Quantities of the node
    /// where it starts are those of [`Integrator::observe_state`], taken before.
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
        let taken = self.take_sub_steps(parts, each).and_then(|report| {
            self.sample()?;
            Ok(report)
        });
        if taken.is_err() {
            self.take_back();
        }
        taken
    }

    /// Changes the values that are held from the present node on, where any are sampled there.
    fn sample(&mut self) -> Result<(), StepError> {
        if !self.system.samples(&self.state) {
            return Ok(());
        }
        self.observe_arrival().map_err(|_| StepError::RankLost)?;
        let Self { observer, start_observer, system, state, .. } = self;
        let node = observer_at(state, observer, start_observer).node();
        system.sample(state, &node.v);
        Ok(())
    }

    fn take_sub_steps(
        &mut self,
        parts: u32,
        each: Option<&mut dyn FnMut(&S, &C, Step<'_>)>,
    ) -> Result<StepReport, StepError> {
        let step = self.state.step + 1;
        let next = self.origin.time(step, self.step);
        self.take_length(self.step, next, step, parts, true, each)
    }

    /// A macro step of the length `length` as `parts` of it, to the time `next` and the node
    /// `step`; where it `is_whole`, `before` is a copy of the state.
    fn take_length(
        &mut self,
        length: f64,
        next: f64,
        step: u64,
        parts: u32,
        is_whole: bool,
        mut each: Option<&mut dyn FnMut(&S, &C, Step<'_>)>,
    ) -> Result<StepReport, StepError> {
        let Self { system, constraints, scheme, solver, state, gammas, nonsmooth, .. } = self;
        let (observer, start_observer) = (&mut self.observer, &mut self.start_observer);
        let (count, part) = (gammas.len(), length / f64::from(parts));
        let sub_steps = parts as usize * count;
        if let Some(contacts) = nonsmooth {
            contacts.begin();
        }
        let mut total = StepReport { sub_steps, ..StepReport::default() };
        for taken in 0..sub_steps {
            let (index, last) = (taken % count, taken + 1 == sub_steps);
            let h = gammas[index] * part;
            let t_end = if last { next } else { state.t + h };
            let step = SubStep { index, count, h, t_end };
            let report = if let Some(contacts) = nonsmooth {
                let observer = observer_at(state, observer, start_observer);
                let parts = (&*system, &**constraints);
                let mut run = Stepping::new(parts, &mut **scheme, solver, observer, state);
                let start = (is_whole && taken == 0).then_some(&self.before);
                contacts.advance(&mut run, step, start, &mut each)?
            } else {
                let report = solver.advance(&mut **scheme, system, &**constraints, step, state)?;
                constraints.unwrap_angles(&state.q, &mut state.angles);
                if let Some(each) = &mut each {
                    scheme.interpolate();
                    let (multipliers, gauss) = (&state.memory.multipliers, scheme.gauss());
                    let (s, polynomial) = (scheme.interval(), scheme.polynomial());
                    let step = Step { s, multipliers, gauss, polynomial, impulse: &[] };
                    each(system, constraints, step);
                }
                report
            };
            total.iterations += report.iterations;
            total.restarts += report.restarts;
            total.residual = total.residual.max(report.residual);
        }
        let at = state.configuration();
        let Precision { meets_constraints, keeps_orientation, .. } = scheme.precision();
        match (meets_constraints, keeps_orientation) {
            (true, _) => {}
            (false, true) => self.watch.check_residuals(&**constraints, at)?,
            (false, false) => self.watch.check(&**constraints, at)?,
        }
        state.step = step;
        Ok(total)
    }

    /// A macro step of the length `h` (s) in the place of the own one, to the time `t_end`; it
    /// counts as a step where `ends` says so. The structure is that of a step `h`.
    ///
    /// # Errors
    /// [`StepError`]; the state is then what it was before.
    pub fn step_of(
        &mut self,
        h: f64,
        t_end: f64,
        ends: bool,
        each: &mut dyn FnMut(&S, &C, Step<'_>),
    ) -> Result<StepReport, StepError> {
        self.before.copy_from(&self.state);
        self.state.history.clear(); // of steps of another length
        let step = self.state.step + u64::from(ends);
        let taken = self.take_length(h, t_end, step, 1, false, Some(each));
        if taken.is_err() {
            self.take_back();
        }
        taken
    }

    /// Goes back to the node where the last macro step started.
    pub fn take_back(&mut self) {
        self.state.copy_from(&self.before);
        self.forget_gaps();
    }

    fn forget_gaps(&mut self) {
        if let Some(contacts) = &mut self.nonsmooth {
            contacts.move_elsewhere();
        }
    }

    /// Time, s, and number of the node from which times are counted.
    #[must_use]
    pub fn counted_from(&self) -> (f64, u64) {
        (self.origin.t, self.origin.step)
    }

    /// The time of node `n`, s.
    #[must_use]
    pub fn time_of(&self, n: u64) -> f64 {
        self.origin.time(n, self.step)
    }

    /// Continues a motion that another mechanism of the same coordinates has brought to here: its
    /// number of steps, whose nodes are counted from `t_0` (s), its internal variables where they
    /// are those of this system, and what its contacts remember where they are also here.
    pub fn continue_from(
        &mut self,
        step: u64,
        t_0: f64,
        internal: &[f64],
        contacts: &NamedContacts,
    ) {
        self.origin = Origin { t: t_0, step: 0 };
        let state = &mut self.state;
        state.step = step;
        if internal.len() == state.internal.len() {
            state.internal.copy_from_slice(internal);
        }
        if let Some(own) = &self.nonsmooth {
            state.contacts = contacts.among(own.elements());
        }
        self.before.copy_from(state);
        self.forget_gaps();
    }

    /// What contacts remember at the present node, by the names of their elements.
    #[must_use]
    pub fn named_contacts(&self) -> NamedContacts {
        let own = self.nonsmooth.as_ref();
        own.map_or_else(NamedContacts::default, |own| {
            NamedContacts::new(&self.state.contacts, own.elements())
        })
    }

    /// The motion ends here, between two nodes: the present one counts as the next.
    pub fn end_here(&mut self) {
        self.state.step += 1;
    }

    /// Continues from a state of this motion, for example one that was stored: the next steps are,
    /// bit for bit, those that the integration which it comes from would have taken.
    ///
    /// # Errors
    /// [`ResumeError`]; the state is then what it was.
    pub fn resume(&mut self, state: State) -> Result<(), ResumeError> {
        let origin = self.origin.resume(&self.state, &state, self.step)?;
        self.watch.check(&*self.constraints, state.configuration())?;
        self.origin = origin;
        self.before.copy_from(&state);
        self.state = state;
        self.forget_gaps();
        Ok(())
    }

    /// Moves to a node of this motion that was computed elsewhere, as that of a member of an
    /// ensemble; allocates nothing.
    pub fn place_at(&mut self, node: &State) {
        self.state.copy_from(node);
        self.forget_gaps();
    }

    /// A macro step of this motion that was computed elsewhere, from the present state to `end`,
    /// with its last (sub-)step `s`, which is exchanged for that of the step before; allocates
    /// nothing. `meets_constraints`: whether the constraints are known to be met at its end.
    ///
    /// # Errors
    /// [`StepError`] as of [`Integrator::step`]; the state is then what it was.
    pub fn take_over(
        &mut self,
        end: &State,
        s: &mut Interval,
        meets_constraints: bool,
    ) -> Result<(), StepError> {
        self.before.copy_from(&self.state);
        self.state.copy_from(end);
        self.forget_gaps();
        std::mem::swap(self.scheme.interval_mut(), s);
        let met = if meets_constraints {
            Ok(())
        } else {
            let Self { watch, constraints, state, .. } = self;
            watch.check_residuals(&**constraints, state.configuration())
        };
        if met.is_err() {
            self.state.copy_from(&self.before);
        }
        met
    }

    /// Reverses the direction of time; the next step retraces the last one.
    pub fn reverse(&mut self) {
        self.step = -self.step;
        self.origin = Origin { t: self.state.t, step: self.state.step };
        self.state.history.clear();
        self.state.compensation.balance.fill(0.0);
        self.state.memory.last = None;
    }
}

/// The steps of a motion, without end: `run.by_ref().take(100)` are a hundred macro steps. After an
/// error the next item is the attempt of the same step. [`Integrator::advance`] also lends the
/// nodes beside each.
impl<S: Discretization<C>, C: Constraints> Iterator for Integrator<S, C> {
    type Item = Result<StepReport, StepError>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.step())
    }
}
