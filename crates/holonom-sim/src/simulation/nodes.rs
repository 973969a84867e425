//! The nodes of a run, one after the other.

use super::failure::bent_too_far;
use super::taut::of_energy;
use super::{DIVISIONS, RunFailure, RunOutcome, Simulation};
use crate::sample::Sample;
use crate::sensor::{View, Works};
use crate::stepper::NodeOf;
use holonom_model::OnFailure;
use std::time::{Duration, Instant};
use vi_constraints::integrator::{NodeInStep, StepReport};
use vi_constraints::scheme::StepError;
use vi_core::Configuration;
use vi_multibody::rolling::FLATTEST;

/// How far an iteration over the nodes is.
#[derive(Debug, Default)]
struct NodeCourse {
    done: bool,
    failure: Option<RunFailure>, // after the node that is handed out
}

impl Simulation {
    /// The recorded nodes to the end of the run, one after the other; a failure is the last item.
    ///
    /// ```
    /// # use holonom_model::Model;
    /// # use holonom_sim::simulation::Simulation;
    /// # let text = r#"
    /// #     model = { name = "pendulum", dimension = 2, gravity = [0.0, -9.81] }
    /// #     particle = [{ name = "bob", mass = 1.0, position = [1.0, 0.0] }]
    /// #     bar = [{ name = "rod", from = "ground", to = "bob" }]
    /// #     simulation = { step = 0.01, end = 1.0 }
    /// # "#;
    /// let mut simulation = Simulation::new(&Model::from_toml(text)?)?;
    /// let heights: Result<Vec<f64>, _> = simulation.samples().map(|s| Ok(s?.q[1])).collect();
    /// # let heights = heights.map_err(|failure: holonom_sim::simulation::RunFailure| failure.message)?;
    /// assert_eq!(heights.len(), 101);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn samples(&mut self) -> impl Iterator<Item = Result<Sample, RunFailure>> + '_ {
        let mut course = NodeCourse::default();
        self.sensors.follow(self.stepper.place().2);
        std::iter::from_fn(move || {
            let found = self.next_node(&mut course, &mut |_, _| true)?;
            Some(found.map(|()| self.sample.clone()))
        })
    }

    /// Runs to the end; `observe` gets each recorded node and may stop the run by an error;
    /// `progress(step, of)` is called now and then.
    ///
    /// # Errors
    /// Whatever `observe` returns.
    pub fn run<E>(
        &mut self,
        observe: &mut dyn FnMut(&Sample) -> Result<(), E>,
        progress: &mut dyn FnMut(u64, u64),
    ) -> Result<RunOutcome, E> {
        let mut proceed = |step: u64, of| {
            if step.is_multiple_of(256) || step == of {
                progress(step, of);
            }
            true
        };
        let outcome = self.run_while(observe, &mut proceed)?;
        Ok(outcome.unwrap_or(RunOutcome::Done)) // nothing pauses it
    }

    /// Runs on from the present node to the end; `proceed(step, of)` is asked before every step,
    /// and `false` pauses the run at that node: `None`. Another call continues as if nothing had
    /// happened.
    ///
    /// # Errors
    /// Whatever `observe` returns.
    pub fn run_while<E>(
        &mut self,
        observe: &mut dyn FnMut(&Sample) -> Result<(), E>,
        proceed: &mut dyn FnMut(u64, u64) -> bool,
    ) -> Result<Option<RunOutcome>, E> {
        let mut paused = false;
        let steps = self.settings.steps();
        let mut proceed = |step, of| {
            paused = !proceed(step, of) && step < steps;
            !paused
        };
        let mut course = NodeCourse::default();
        self.sensors.follow(self.stepper.place().2);
        while let Some(found) = self.next_node(&mut course, &mut proceed) {
            match found {
                Ok(()) => {
                    let begin = self.clock();
                    observe(&self.sample)?;
                    self.recording += begin.map_or(Duration::ZERO, |begin| begin.elapsed());
                }
                Err(failure) => return Ok(Some(RunOutcome::Failed(failure))),
            }
        }
        Ok((!paused).then_some(RunOutcome::Done))
    }

    /// Takes one step of a run that knows no end, with all that is followed along it: unwrapped
    /// angles, limits, steps that are refused as a whole.
    ///
    /// # Errors
    /// [`RunFailure`]; a step that was not found leaves the state as it was.
    pub fn step_on(&mut self) -> Result<(), RunFailure> {
        let taken = self.advance(false).1;
        self.contacts.take_pending(); // nobody gets them
        taken
    }

    /// Reads the present node, before the step from it; what the run depends on stays as it is.
    ///
    /// # Errors
    /// [`RunFailure`].
    pub fn observe(&mut self) -> Result<&Sample, RunFailure> {
        let rolling = self.rolling.state().clone();
        let followed = (self.watch.clone(), self.rotation.fastest, self.loops);
        // accelerations and constraint forces are those of the step from the node
        let which = if self.sensors.wanted().needs_step() { NodeOf::Last } else { NodeOf::Arrival };
        let found = self.fill(which);
        (self.watch, self.rotation.fastest, self.loops) = followed;
        self.rolling.resume(rolling);
        found.map(|()| &self.sample)
    }

    /// What the sensors measure at the present node, before the step from it, and nothing else of
    /// it; what the run depends on stays as it is.
    ///
    /// # Errors
    /// [`RunFailure`].
    pub fn sense(&mut self) -> Result<&[f64], RunFailure> {
        let wanted = self.sensors.wanted();
        if wanted.is_motion_alone() {
            return self.sense_motion();
        }
        let which = if wanted.needs_step() { NodeOf::Last } else { NodeOf::Arrival };
        if let Err(error) = self.stepper.observe(which) {
            return Err(self.lost(which, &error.to_string()));
        }
        self.read_sensors();
        Ok(&self.sample.sensors)
    }

    /// What sensors of configurations and velocities measure at the present node.
    fn sense_motion(&mut self) -> Result<&[f64], RunFailure> {
        if let Err(error) = self.stepper.velocity(&mut self.velocity) {
            return Err(self.lost(NodeOf::State, &error.to_string()));
        }
        let Self { stepper, sample, sensors, rolling, velocity, .. } = self;
        let state = stepper.at(NodeInStep::After);
        let (signals, slips) = (stepper.signals(state), &rolling.state().slips[..]);
        let view = View { signals, slips, ..View::of_motion(state, velocity) };
        sensors.read(stepper.mechanism(), stepper.rows(), view, &mut sample.sensors);
        Ok(&self.sample.sensors)
    }

    /// What a sensor measures at configurations `q` (one after the other, `n` numbers each) at the
    /// times `t`, row after row. Angles are counted on from one to the next, by the way that is
    /// shorter than half a turn.
    ///
    /// # Errors
    /// Of a sensor that needs more than configurations, and of other shapes: what is wrong.
    pub fn sense_configurations(
        &mut self,
        sensor: &str,
        t: &[f64],
        q: &[f64],
    ) -> Result<Vec<f64>, String> {
        let Some(gauge) = self.sensors.of_configuration(sensor) else {
            let words = "positions alone do not tell it: state it as a sensor before the run";
            return Err(words.into());
        };
        let n = self.stepper.place().2.len();
        if q.len() != n * t.len() {
            return Err(format!(
                "{} times of {n} coordinates are not {} numbers",
                t.len(),
                q.len()
            ));
        }
        let mut found = Vec::new();
        for (k, (&t, q)) in t.iter().zip(q.chunks_exact(n.max(1))).enumerate() {
            match k {
                0 => self.sensors.begin(q),
                _ => self.sensors.follow(q),
            }
            self.sensors.read_configuration(gauge, t, q, &mut found);
        }
        Ok(found)
    }

    /// Goes on to the next recorded node; `proceed(step, of)` is asked before every step, and
    /// `false` ends the iteration there. Another one continues.
    fn next_node(
        &mut self,
        course: &mut NodeCourse,
        proceed: &mut dyn FnMut(u64, u64) -> bool,
    ) -> Option<Result<(), RunFailure>> {
        let steps = self.settings.steps();
        while !course.done && course.failure.is_none() {
            let n = self.stepper.place().0;
            let paused = !proceed(n, steps);
            if n >= steps || self.was_ended() {
                course.done = true;
                let last = self.read(NodeOf::Last);
                self.hand_out_events();
                return Some(last);
            }
            if paused {
                break;
            }
            let (found, taken) = self.advance(n.is_multiple_of(self.settings.every));
            course.failure = taken.err();
            if found {
                self.hand_out_events();
                return Some(Ok(()));
            }
        }
        course.done = true;
        course.failure.take().map(Err)
    }

    /// Takes one step; whether the node it started from was found, where it is to be recorded.
    fn advance(&mut self, recorded: bool) -> (bool, Result<(), RunFailure>) {
        if let Err(failure) = self.measure_at_start().and_then(|()| self.decide()) {
            let read = if recorded { self.read(NodeOf::State) } else { Ok(()) };
            return (recorded && read.is_ok(), Err(failure));
        }
        if self.events.is_some() {
            return self.advance_by_events(recorded);
        }
        let whole = self.stepper.step(1);
        // of a step that is refused as a whole nothing belongs to the node where it starts
        let start = NodeOf::Start { whole: whole.is_ok() };
        let read = if recorded { self.read(start) } else { Ok(()) };
        let report = match (whole.or_else(|refused| self.step_in_parts(refused)), read) {
            (Err(error), read) => return (recorded && read.is_ok(), Err(self.failure(&error))),
            (Ok(_), Err(failure)) => return (false, Err(failure)),
            (Ok(report), Ok(())) => report,
        };
        (recorded, self.follow_step(report))
    }

    /// Follows what is followed to the end of a step.
    pub(crate) fn follow_step(&mut self, report: StepReport) -> Result<(), RunFailure> {
        self.rolling.follow_step(self.stepper.mechanism(), self.stepper.interval());
        let (step, t, q) = self.stepper.place();
        self.contacts.follow_step(self.stepper.contacts(), t, q);
        self.sensors.follow(q);
        if let Err(folded) = self.limits.follow(t, q) {
            let (message, remedy) = bent_too_far(&folded);
            return Err(RunFailure { step, t, message, remedy });
        }
        let flat = self.rolling.flat(self.stepper.mechanism(), q, FLATTEST);
        if let Some((message, remedy)) = flat {
            return Err(RunFailure { step, t, message, remedy });
        }
        self.iterations = report.iterations as f64 / report.sub_steps.max(1) as f64;
        self.measure()
    }

    /// The sample gets what events and contacts did since the last one was handed out.
    fn hand_out_events(&mut self) {
        let all = &mut self.sample.events;
        all.clear();
        if let Some(events) = &mut self.events {
            all.append(&mut events.switches.pending);
        }
        let events = all.len();
        all.append(&mut self.contacts.take_pending());
        if events > 0 {
            all.sort_by(|a, b| a.t.total_cmp(&b.t));
        }
    }

    /// A step that was refused as a whole, in ever smaller parts, where the model asks for that.
    pub(crate) fn step_in_parts(&mut self, refused: StepError) -> Result<StepReport, StepError> {
        if self.settings.on_failure == OnFailure::Stop {
            return Err(refused);
        }
        let (_, start, _) = self.stepper.place();
        let asked = self.divided.count == 0;
        let resolving = asked.then(|| self.remedy_of_step()).flatten().map(|(_, step)| step);
        let halvings = (1..=DIVISIONS).map(|k| 1 << k);
        for parts in halvings {
            if let Ok(report) = self.stepper.step(parts) {
                self.divided.add(start, parts, resolving);
                return Ok(report);
            }
        }
        Err(refused)
    }

    /// When reading begins; nothing where it takes no longer than to read the clock.
    fn clock(&self) -> Option<Instant> {
        self.reading.quantities.then(Instant::now)
    }

    /// Reads a node into the sample.
    pub(crate) fn read(&mut self, which: NodeOf) -> Result<(), RunFailure> {
        let begin = self.clock();
        let found = self.fill(which);
        self.recording += begin.map_or(Duration::ZERO, |begin| begin.elapsed());
        found
    }

    /// Reads the sensors at the node that was read last.
    fn read_sensors(&mut self) {
        let Self { stepper, sample, sensors, rolling, energies, contacts, .. } = self;
        let seen = stepper.node();
        contacts.read(stepper.contact_node(), [&seen.state.q, &seen.node.v]);
        let contacts = contacts.seen();
        let (at, mechanism) = (stepper.node(), stepper.mechanism());
        let (state, node) = (at.state, at.node);
        let Configuration { t, q, .. } = at.configuration();
        let (angles, signals) = (&state.angles[..], stepper.signals(state));
        let (v, a, force) = (&node.v, at.acceleration, at.force);
        let slips = &rolling.state().slips;
        let works = Some(Works { terms: energies, of_forces: at.work });
        let view = View { t, q, angles, signals, v, a, force, works, slips, contacts };
        sensors.read(mechanism, stepper.rows(), view, &mut sample.sensors);
    }

    /// Reads the configuration of a node, and its sensors where they are wanted.
    fn fill_configuration(&mut self, which: NodeOf) -> Result<(), RunFailure> {
        if self.reading.sensors && !self.sensors.columns().is_empty() {
            if let Err(error) = self.stepper.observe(which) {
                return Err(self.lost(which, &error.to_string()));
            }
            self.read_sensors();
        }
        let Self { stepper, sample, iterations, .. } = self;
        let state = stepper.at(which.when());
        (sample.step, sample.t) = (state.step, state.t);
        sample.q.clone_from(&state.q);
        sample.newton_iterations = *iterations;
        match sample.q.iter().all(|q| q.is_finite()) {
            true => Ok(()),
            false => Err(self.lost(which, "a value that is not finite")),
        }
    }

    fn fill(&mut self, which: NodeOf) -> Result<(), RunFailure> {
        if !self.reading.quantities {
            return self.fill_configuration(which);
        }
        if let Err(error) = self.stepper.observe(which) {
            return Err(self.lost(which, &error.to_string()));
        }
        self.read_sensors();
        let Self { stepper, sample, energies, watch, .. } = self;
        let Self { rotation, loops, rolling, iterations, taut, .. } = self;
        let (at, mechanism) = (stepper.node(), stepper.mechanism());
        let (state, node) = (at.state, at.node);
        let Configuration { t, q, .. } = at.configuration();
        loops.follow(mechanism, q);
        let kinetic = node.hamiltonian_projected.kinetic;
        let here = Configuration::new(t, q);
        rolling.follow_node(mechanism, here, at.force, kinetic, stepper.rows());
        energies.read(&at, &mut sample.energies);
        rotation.follow(t, &node.v);
        let notice = watch.follow(&at, energies, &sample.energies);
        sample.notice = notice.map(|own| of_energy(own, taut.as_deref()));
        (sample.step, sample.t) = (state.step, t);
        sample.q.clone_from(&state.q);
        sample.energy = node.discrete_energy.total();
        (sample.hamiltonian, sample.shadow) = (at.hamiltonian(), at.shadow);
        sample.work = energies.total(at.work);
        sample.momentum = mechanism.momentum(q, &node.p_projected);
        sample.residuals = at.residuals();
        sample.newton_iterations = *iterations;
        stepper.read_momenta(&mut sample.momenta);
        sample.contacts.clear();
        if self.settings.contacts {
            sample.contacts.extend_from_slice(self.contacts.seen().unwrap_or_default());
        }
        if sample.is_finite() {
            Ok(())
        } else {
            Err(self.lost(which, "a value that is not finite"))
        }
    }
}
