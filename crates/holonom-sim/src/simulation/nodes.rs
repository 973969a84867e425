//! The nodes of a run, one after the other.

use super::failure::bent_too_far;
use super::{DIVISIONS, RunFailure, RunOutcome, Simulation};
use crate::method::{Method, Reading};
use crate::sample::Sample;
use crate::sensor::View;
use holonom_model::OnFailure;
use std::time::Instant;
use vi_constraints::integrator::StepReport;
use vi_constraints::scheme::StepError;
use vi_core::linear::Singular;

/// How far an iteration over the nodes is.
#[derive(Debug, Default)]
struct Course {
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
        let mut course = Course::default();
        self.sensors.follow(self.method.place().2);
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
        let mut course = Course::default();
        self.sensors.follow(self.method.place().2);
        while let Some(found) = self.next_node(&mut course, &mut proceed) {
            match found {
                Ok(()) => {
                    let begin = Instant::now();
                    observe(&self.sample)?;
                    self.recording += begin.elapsed();
                }
                Err(failure) => return Ok(Some(RunOutcome::Failed(failure))),
            }
        }
        Ok((!paused).then_some(RunOutcome::Done))
    }

    /// Goes on to the next recorded node; `proceed(step, of)` is asked before every step, and
    /// `false` ends the iteration there. Another one continues.
    fn next_node(
        &mut self,
        course: &mut Course,
        proceed: &mut dyn FnMut(u64, u64) -> bool,
    ) -> Option<Result<(), RunFailure>> {
        let steps = self.settings.steps();
        while !course.done && course.failure.is_none() {
            let n = self.method.place().0;
            let paused = !proceed(n, steps);
            if n >= steps {
                course.done = true;
                let wanted = self.sensors.wanted();
                return Some(self.read(|method, found| method.last(wanted, found)));
            }
            if paused {
                break;
            }
            let (found, taken) = self.advance(n.is_multiple_of(self.settings.every));
            course.failure = taken.err();
            if found {
                return Some(Ok(()));
            }
        }
        course.done = true;
        course.failure.take().map(Err)
    }

    /// Takes one step; whether the node it started from was found, where it is to be recorded.
    fn advance(&mut self, recorded: bool) -> (bool, Result<(), RunFailure>) {
        let (first, wanted) = (self.method.reads_first(), self.sensors.wanted());
        let here = |method: &mut dyn Method, found: &mut Reading| method.here(wanted, found);
        let mut found = false;
        if recorded && first {
            match self.read(here) {
                Ok(()) => found = true,
                Err(failure) => return (false, Err(failure)),
            }
        }
        // at the start the multipliers of the step are of first order and no step ends: sensors
        // take the acceleration level
        let at_start = recorded && !first && wanted.any() && self.method.place().0 == 0;
        let mut start = Reading::default();
        let known = at_start && self.method.here(wanted, &mut start).is_ok();
        let whole = self.method.step(1);
        // no whole step starts at this node: it is read by itself
        let alone = (whole.is_err() && recorded && !first).then(|| self.read(here));
        match whole.or_else(|refused| self.step_in_parts(refused)) {
            Err(error) => (found || matches!(alone, Some(Ok(()))), Err(self.failure(&error))),
            Ok(report) => {
                if recorded && !first {
                    let left = |method: &mut dyn Method, found: &mut Reading| {
                        method.left(found)?;
                        if known {
                            found.force.clone_from(&start.force);
                            found.acceleration.clone_from(&start.acceleration);
                        }
                        Ok(())
                    };
                    match alone.unwrap_or_else(|| self.read(left)) {
                        Ok(()) => found = true,
                        Err(failure) => return (false, Err(failure)),
                    }
                }
                let (step, t, q) = self.method.place();
                self.sensors.follow(q);
                if let Err(fault) = self.limits.follow(t, q) {
                    let (message, remedy) = bent_too_far(fault);
                    return (found, Err(RunFailure { step, t, message, remedy }));
                }
                self.iterations = report.iterations as f64 / report.sub_steps.max(1) as f64;
                (found, Ok(()))
            }
        }
    }

    /// A step that was refused as a whole, in ever smaller parts, where the model asks for that.
    fn step_in_parts(&mut self, refused: StepError) -> Result<StepReport, StepError> {
        if self.settings.on_failure == OnFailure::Stop {
            return Err(refused);
        }
        let (_, start, _) = self.method.place();
        let asked = self.divided.count == 0;
        let resolving = asked.then(|| self.remedy_of_step()).flatten().map(|(_, step)| step);
        let halvings = (1..=DIVISIONS).map(|k| 1 << k);
        for parts in halvings {
            if let Ok(report) = self.method.step(parts) {
                self.divided.add(start, parts, resolving);
                return Ok(report);
            }
        }
        Err(refused)
    }

    /// Reads a node into the sample.
    fn read(
        &mut self,
        read: impl FnOnce(&mut dyn Method, &mut Reading) -> Result<(), Singular>,
    ) -> Result<(), RunFailure> {
        let begin = Instant::now();
        let found = self.fill(read);
        self.recording += begin.elapsed();
        found
    }

    /// The vectors of the sample change places with those of the reading.
    fn fill(
        &mut self,
        read: impl FnOnce(&mut dyn Method, &mut Reading) -> Result<(), Singular>,
    ) -> Result<(), RunFailure> {
        if let Err(error) = read(&mut *self.method, &mut self.reading) {
            return Err(self.lost(&error.to_string()));
        }
        let Self {
            method,
            reading: at,
            sample,
            sensors,
            energies,
            watch,
            rotation,
            loops,
            iterations,
            ..
        } = self;
        let view = View { t: at.t, q: &at.q, v: &at.v, a: &at.acceleration, force: &at.force };
        loops.follow(method.mechanism(), &at.q);
        sensors.read(method.mechanism(), method.rows(), view, &mut sample.sensors);
        energies.read(at, &mut sample.energies);
        rotation.follow(at.t, &at.v);
        sample.notice = watch.follow(at, energies, &sample.energies);
        (sample.step, sample.t) = (at.step, at.t);
        std::mem::swap(&mut sample.q, &mut at.q);
        (sample.energy, sample.hamiltonian, sample.shadow) = (at.energy, at.hamiltonian, at.shadow);
        sample.work = at.work.iter().sum();
        (sample.momentum, sample.residuals) = (at.momentum, at.residuals);
        sample.newton_iterations = *iterations;
        std::mem::swap(&mut sample.momenta, &mut at.momenta);
        if sample.is_finite() { Ok(()) } else { Err(self.lost("a value that is not finite")) }
    }
}
