//! Steps of a simulation with events.

use super::{RunFailure, Simulation, stepper};
use crate::event::conditions::is_located;
use crate::event::phase::in_force;
use crate::event::switches::{EventJump, EventRecord, PhaseStart, Switches};
use crate::event::{Events, MOST};
use crate::sensor::View;
use crate::stepper::{NodeOf, NodeView};
use crate::system::{self, System};
use holonom_model::{ModelError, coordinate_of};
use vi_constraints::integrator::{ResumeError, StepReport};
use vi_constraints::scheme::StepError;
use vi_constraints::{Constraints, InitialValues};
use vi_core::Configuration;
use vi_core::bracket::Bracket;
use vi_core::linear::{dot, norm_inf};
use vi_core::momentum_map::Momentum;
use vi_multibody::mechanism::Mechanism;

/// Parts of a step that are not taken by themselves, and to which a root is known.
const REST: f64 = 1e-9;
const ROOT: f64 = 1e-14;

/// Why a step towards an event was not taken.
enum Stopped {
    Step(StepError),
    Failure(RunFailure),
}

impl From<StepError> for Stopped {
    fn from(error: StepError) -> Self {
        Self::Step(error)
    }
}

impl From<RunFailure> for Stopped {
    fn from(failure: RunFailure) -> Self {
        Self::Failure(failure)
    }
}

impl Simulation {
    /// Whether an event has ended the run.
    pub(crate) fn was_ended(&self) -> bool {
        self.events.as_ref().is_some_and(|events| events.switches.ended)
    }

    /// Reads the conditions at the start.
    pub(crate) fn begin_events(&mut self) -> Result<(), RunFailure> {
        self.read_conditions()?;
        let Some(events) = &mut self.events else { return Ok(()) };
        let Events { switches, sides, conditions, .. } = &mut **events;
        switches.sides.clone_from(sides);
        for (k, ready) in switches.ready.iter_mut().enumerate() {
            *ready = conditions.time(k).is_some() || sides[k] <= 0.0;
        }
        // hysteresis is two events, one of which is true at the start
        let told = events.list.iter().zip(&events.switches.ready).filter(|(own, _)| own.once);
        let told = told.filter(|(_, ready)| !**ready).map(|(event, _)| {
            format!(
                "event `{}` is true at the start: it acts when it becomes true again, after it was false",
                event.name
            )
        });
        self.assembly.warnings.extend(told.collect::<Vec<_>>());
        Ok(())
    }

    /// Continues from the state of events: with the mechanism that was in force.
    pub(crate) fn resume_events(&mut self, switches: Option<Switches>) -> Result<(), ResumeError> {
        let (Some(events), Some(found)) = (&mut self.events, switches) else { return Ok(()) };
        let expected = events.list.len();
        crate::run::run_state::same_length("the list of events", found.ready.len(), expected)?;
        events.conditions.sensors().check(&found.readings)?;
        events.conditions.sensors().resume(&found.readings);
        let rebuilt = events.switches.phase != found.phase;
        events.switches = found;
        if rebuilt {
            let begun = events.switches.phase.as_ref().map_or(0.0, |phase| phase.t);
            self.begin_phase()
                .map_err(|error| ResumeError::Phase { t: begun, message: error.to_string() })?;
        }
        Ok(())
    }

    /// Takes one step of a model with events, in parts where some act within it; whether the node
    /// it started from was found, where it is to be recorded.
    pub(crate) fn advance_by_events(&mut self, recorded: bool) -> (bool, Result<(), RunFailure>) {
        let mut read = !recorded;
        let n = self.stepper.place().0;
        let mut acted = 0;
        loop {
            if let Err(failure) = self.act_when_due(&mut acted) {
                return (read && recorded, Err(failure));
            }
            if self.was_ended() {
                break;
            }
            let divided = self.divided.count;
            let taken = self.step_to_event(acted);
            // of a step that is refused as a whole nothing belongs to the node where it starts
            let whole = taken.is_ok() && self.divided.count == divided;
            let mut lost = None;
            if !read && !matches!(taken, Ok(None)) {
                match self.read(NodeOf::Start { whole }) {
                    Ok(()) => read = true,
                    Err(failure) => lost = Some(failure),
                }
            }
            let report = match taken {
                Ok(report) => report,
                Err(Stopped::Failure(failure)) => return (read && recorded, Err(failure)),
                Err(Stopped::Step(error)) => {
                    return (read && recorded, Err(self.failure(&error)));
                }
            };
            if let Some(failure) = lost {
                return (false, Err(failure));
            }
            if let Some(report) = report
                && let Err(failure) = self.follow_step(report)
            {
                return (read && recorded, Err(failure));
            }
            let acting = self.events.as_mut().map(|events| std::mem::take(&mut events.acting));
            let acting = acting.unwrap_or_default();
            acted += acting.len();
            if let Err(failure) = self.act(acting) {
                return (read && recorded, Err(failure));
            }
            if self.was_ended() || self.stepper.place().0 > n {
                break;
            }
        }
        // the node where nothing moved on: the run ends here
        (read && recorded, Ok(()))
    }

    /// Acts by the events whose time has come.
    fn act_when_due(&mut self, acted: &mut usize) -> Result<(), RunFailure> {
        let (_, t, _) = self.stepper.place();
        let rest = REST * self.settings.step;
        let Some(events) = &self.events else { return Ok(()) };
        let due = |k: &usize| {
            let time = events.conditions.time(*k);
            events.switches.ready[*k] && time.is_some_and(|at| at <= t + rest)
        };
        let due: Vec<usize> = (0..events.list.len()).filter(due).collect();
        *acted += due.len();
        self.act(due)
    }

    /// The next part of a step: to the end of it, to a time or to a root. The events that act
    /// there are left in `acting`; `None`: they act at once, at the node where the part would
    /// begin.
    fn step_to_event(&mut self, acted: usize) -> Result<Option<StepReport>, Stopped> {
        let (n, t, _) = self.stepper.place();
        let (h, end) = (self.settings.step, self.stepper.time_of(n + 1));
        let rest = REST * h;
        let Some(events) = &self.events else { return Ok(None) };
        let times = (0..events.list.len()).filter(|k| events.switches.ready[*k]);
        let times = times.filter_map(|k| events.conditions.time(k));
        let inside = times.filter(|at| *at > t + rest && *at < end - rest);
        let stop = inside.fold(end, f64::min);
        let ends = stop >= end;
        let whole = ends && t.to_bits() == self.stepper.time_of(n).to_bits();
        let length = if whole { h } else { stop - t };
        let report = match whole {
            true => self.stepper.step(1).or_else(|refused| self.step_in_parts(refused))?,
            false => self.stepper.step_of(length, stop, ends)?,
        };
        let before = self.follow_conditions()?;
        let crossing = self.crossing(true);
        if crossing.is_empty() || acted >= MOST {
            return Ok(Some(self.keep(report, acted)));
        }
        let largest =
            |sides: &[f64]| crossing.iter().map(|k| sides[*k]).fold(f64::NEG_INFINITY, f64::max);
        let Some(events) = &self.events else { return Ok(None) };
        let ends_of = [&events.switches.sides, &events.sides].map(|sides| largest(sides));
        let mut bracket = Bracket::new([0.0, ends_of[0]], [length, ends_of[1]]);
        if let Some(Events { swings, sides, switches, .. }) = self.events.as_deref_mut() {
            swings.clear();
            swings.extend(switches.sides.iter().zip(&*sides).map(|(a, b)| (b - a).abs()));
        }
        let (mut at, mut report) = (length, report); // of the last trial
        while let Some(trial) = bracket.next(ROOT * h) {
            report = self.try_again(&before, trial, t + trial, false)?;
            at = trial;
            bracket.take(trial, self.events.as_ref().map_or(0.0, |events| largest(&events.sides)));
        }
        let found = bracket.high();
        if length - found <= rest {
            if at.to_bits() != length.to_bits() {
                report = self.try_again(&before, length, stop, ends)?;
            }
            return Ok(Some(self.keep(report, acted)));
        }
        if at.to_bits() != found.to_bits() {
            report = self.try_again(&before, found, t + found, false)?;
        }
        if found > rest {
            return Ok(Some(self.keep(report, acted)));
        }
        let acting = self.crossing(true);
        self.back_to(&before);
        if let Some(events) = &mut self.events {
            events.acting = acting;
        }
        Ok(None)
    }

    /// Takes a step of another length in the place of the last one.
    fn try_again(
        &mut self,
        before: &Followed,
        h: f64,
        t_end: f64,
        ends: bool,
    ) -> Result<StepReport, Stopped> {
        self.back_to(before);
        let report = self.stepper.step_of(h, t_end, ends)?;
        self.follow_conditions()?;
        Ok(report)
    }

    fn back_to(&mut self, before: &Followed) {
        self.stepper.take_back();
        if let Some(events) = &mut self.events {
            events.conditions.sensors().resume(&before.readings);
            events.switches.turns.clone_from(&before.turns);
        }
    }

    /// Follows what conditions read to the present node, and reads them.
    fn follow_conditions(&mut self) -> Result<Followed, Stopped> {
        let Some(events) = &mut self.events else { return Ok(Followed::default()) };
        let before = Followed {
            readings: events.conditions.sensors().state(),
            turns: events.switches.turns.clone(),
        };
        events.follow(self.stepper.place().2);
        self.read_conditions()?;
        Ok(before)
    }

    /// `sides ←` those of the present node.
    fn read_conditions(&mut self) -> Result<(), RunFailure> {
        // a velocity with contacts is that of a step on a copy
        let still = self.events.as_ref().is_none_or(|own| own.conditions.are_of_configurations());
        let which = if still { NodeOf::State } else { NodeOf::Arrival };
        if let Err(error) = self.stepper.observe(which) {
            return Err(self.lost(which, &error.to_string()));
        }
        let Self { events, stepper, .. } = self;
        let Some(events) = events else { return Ok(()) };
        let Events { conditions, sides, .. } = &mut **events;
        let (node, mechanism) = (stepper.node(), stepper.mechanism());
        let Configuration { t, q, .. } = node.configuration();
        let (angles, signals) = (&node.state.angles[..], stepper.signals(node.state));
        let v = &node.node.v;
        let view = View {
            t,
            q,
            angles,
            signals,
            v,
            a: &[],
            force: &[],
            works: None,
            slips: &[],
            contacts: None,
        };
        let step = node.state.step;
        conditions.read(mechanism, stepper.rows(), view, sides).map_err(|message| RunFailure {
            step,
            t,
            message: format!("{message} at t = {t:.6} s"),
            remedy: "let its arguments stay where it is defined, by max or clamp".into(),
        })
    }

    /// The events whose condition has become true; those alone that are `located`, or the others as
    /// well, which act at the nodes of the grid.
    fn crossing(&self, located: bool) -> Vec<usize> {
        let Some(events) = &self.events else { return Vec::new() };
        let Events { list, conditions, switches, sides, .. } = &**events;
        let (n, t, _) = self.stepper.place();
        let all = !located && t.to_bits() == self.stepper.time_of(n).to_bits();
        let becomes = |k: &usize| {
            let wanted = all || is_located(&list[*k]);
            wanted && switches.ready[*k] && conditions.time(*k).is_none() && sides[*k] > 0.0
        };
        (0..list.len()).filter(becomes).collect()
    }

    /// Keeps the last part of a step, and all events whose condition is true at its end.
    fn keep(&mut self, report: StepReport, acted: usize) -> StepReport {
        let acting = self.crossing(false);
        if let Some(events) = &mut self.events {
            let Events { switches, sides, list, .. } = &mut **events;
            switches.crowded += u64::from(acted >= MOST && !acting.is_empty());
            for (k, event) in list.iter().enumerate() {
                let done = event.once && switches.counts[k] > 0;
                switches.ready[k] |= sides[k] < 0.0 && !done;
            }
            switches.sides.clone_from(sides);
            events.acting = acting;
        }
        report
    }

    /// Lets events act at the present node, and those whose condition becomes true by that.
    fn act(&mut self, mut acting: Vec<usize>) -> Result<(), RunFailure> {
        let mut rounds = 0;
        while !acting.is_empty() {
            self.act_once(&acting)?;
            self.read_conditions()?;
            let Some(events) = &mut self.events else { break };
            let Events { switches, sides, list, conditions, .. } = &mut **events;
            switches.sides.clone_from(sides);
            for k in 0..list.len() {
                let again = !acting.contains(&k) && sides[k] < 0.0 && conditions.time(k).is_none();
                switches.ready[k] |= again && !(list[k].once && switches.counts[k] > 0);
            }
            rounds += 1;
            acting = if rounds < MOST { self.crossing(false) } else { Vec::new() };
        }
        Ok(())
    }

    /// Lets some events act together: one projection.
    fn act_once(&mut self, acting: &[usize]) -> Result<(), RunFailure> {
        let (step, t, _) = self.stepper.place();
        if let Err(error) = self.stepper.observe(NodeOf::Arrival) {
            return Err(self.lost(NodeOf::Arrival, &error.to_string()));
        }
        let node = self.stepper.node();
        let (energy, work) = (node.hamiltonian(), node.work.to_vec());
        let stored = self.energies.stored(&node);
        let before = MotionAtEvent::of(self.stepper.mechanism(), &node);
        let contacts = self.stepper.named_contacts();
        let mut start = PhaseStart::new(node.state, &node.node.v, contacts);
        let held = self.stepper.places_of_signals().start;
        let Some(events) = &mut self.events else { return Ok(()) };
        let mut records = Vec::new();
        let mut locked = Vec::new(); // records of locks, and the constraint of each
        let mut changed = false;
        for k in acting {
            events.switches.ready[*k] = false;
            events.switches.counts[*k] += 1;
            let event = events.list[*k].clone();
            for (action, part) in event.actions() {
                changed |= action != "end";
                if action == "lock" {
                    let (joint, freedom) = coordinate_of(part);
                    if let Some(lock) = events.lock(joint, freedom, &start) {
                        locked.push((records.len(), lock));
                    }
                }
                if action == "set" {
                    let mut numbers = self.sensors.numbers().iter();
                    let place = numbers.find(|(name, _)| name == part).map(|(_, k)| held + k);
                    let number = place.and_then(|place| start.internal.get_mut(place));
                    number.into_iter().for_each(|number| *number = event.set[part]);
                }
                events.switch(action, part);
                let action = format!("{action} {part}").trim_end().to_owned();
                let event = event.name.clone();
                let condition = events.located(*k);
                let jump = EventJump { condition, ..EventJump::default() };
                records.push(EventRecord {
                    t,
                    event,
                    action,
                    energy_lost: 0.0,
                    impulse: None,
                    before: None,
                    after: None,
                    jump,
                });
            }
        }
        let name = events.list[acting[0]].name.clone();
        if changed {
            self.energies.carry(&work);
            let v = start.v.clone();
            let carried = self.energies.carried().to_vec(); // which the next phase takes up
            if let Some(events) = &mut self.events {
                events.switches.phase = Some(Box::new(start));
                events.switches.works = carried;
            }
            self.begin_phase().map_err(|error| refused(&name, step, t, &error))?;
            if let Err(error) = self.stepper.observe(NodeOf::State) {
                return Err(self.lost(NodeOf::State, &error.to_string()));
            }
            let node = self.stepper.node();
            let lost = energy - node.hamiltonian();
            let of_laws = stored - self.energies.stored(&node);
            let jump = before.jump(&MotionAtEvent::of(self.stepper.mechanism(), &node));
            for EventRecord { jump: own, .. } in &mut records {
                *own = EventJump { condition: own.condition, ..jump };
            }
            let mut rest = lost + of_laws;
            for (place, constraint) in locked {
                let Some((impulse, rate)) = self.stepper.impulse(&constraint, &v) else { continue };
                let loss = -0.5 * impulse * rate;
                records[place].impulse = Some(impulse);
                records[place].energy_lost = loss;
                rest -= loss;
            }
            // what round-off leaves of a kinetic energy is no loss
            let size = energy.abs().max(stored.abs()).max(self.stepper.node().kinetic());
            if rest.abs() > 1e-12 * size {
                records[0].energy_lost += rest;
            }
            self.energies.lose(lost, of_laws);
            let carried = self.energies.carried().to_vec();
            if let Some(events) = &mut self.events {
                events.switches.works = carried;
            }
        }
        if let Some(events) = &mut self.events {
            events.switches.pending.extend(records);
            if events.switches.ended && self.stepper.time_of(step).to_bits() != t.to_bits() {
                self.stepper.end_here();
            }
        }
        Ok(())
    }

    /// Begins the phase that the switches state: another mechanism at the same configuration.
    fn begin_phase(&mut self) -> Result<(), ModelError> {
        let Some(events) = &self.events else { return Ok(()) };
        let switches = &events.switches;
        let model = in_force(&events.model, switches);
        let outside = events.outside.without(|joint| switches.released.contains(joint));
        let System { mechanism, dynamics, laws, sensors: signals, contacts, .. } =
            system::build_sensing(&model, &outside, &switches.locks, &[])?;
        let start = switches.phase.as_deref().unwrap_or(&events.first);
        let PhaseStart { step, t, q, v, internal, contacts: remembered } = start;
        let angles = match &switches.phase {
            Some(_) => events.angles_of(&mechanism, q),
            None => mechanism.principal_angles(q),
        };
        let at = InitialValues::new(*t, q, v).with_angles(&angles);
        let rolling = self.rolling.continued(&mechanism);
        let mut wanted = self.sensors.wanted();
        wanted.forces |= rolling.needs_forces();
        let mut next = stepper(mechanism, &dynamics, &model, at, events.solver, wanted)?;
        next.continue_from(*step, [events.first.t, *t], internal, remembered);
        self.energies.act_by(next.sources(), &dynamics.forces);
        self.energies.take_up(&switches.works);
        let released = switches.released.clone();
        let disabled = switches.disabled.clone();
        let idle = |name: &str, part: &str| {
            released.contains(name)
                || disabled.contains(name) && (part.is_empty() || part == "motor")
        };
        self.sensors.act_by(next.mechanism(), &dynamics.forces, &idle);
        self.sensors.read_signals_as(&signals);
        if let Some(events) = &mut self.events {
            events.conditions.sensors().act_by(next.mechanism(), &dynamics.forces, &idle);
            events.conditions.sensors().read_signals_as(&signals);
        }
        self.contacts.act_by(&contacts);
        (self.laws, self.stepper, self.rolling) = (laws, next, rolling);
        Ok(())
    }
}

/// The motion at a node beside an event.
struct MotionAtEvent {
    v: Vec<f64>,
    p: Vec<f64>, // of the projection
    momentum: Momentum,
    kinetic: f64, // J
}

impl MotionAtEvent {
    fn of(mechanism: &Mechanism, node: &NodeView<'_>) -> Self {
        let (v, p) = (node.node.v.clone(), node.node.p_projected.clone());
        let momentum = mechanism.momentum(&node.state.q, &p);
        Self { v, p, momentum, kinetic: node.kinetic() }
    }

    /// What has changed from here to `after`: `½ Δvᵀ M Δv = ½ Δv·Δp`.
    fn jump(&self, after: &Self) -> EventJump {
        let change =
            |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| b - a).collect() };
        let (dv, dp) = (change(&self.v, &after.v), change(&self.p, &after.p));
        let maps = |of: &Momentum| [of.linear, of.angular].concat();
        let (first, last) = (maps(&self.momentum), maps(&after.momentum));
        let relative = |change: f64, size: f64| if change > 0.0 { change / size } else { 0.0 };
        EventJump {
            velocity: relative(norm_inf(&dv), norm_inf(&self.v)),
            momentum: relative(norm_inf(&change(&first, &last)), norm_inf(&self.p)),
            kinetic: self.kinetic - after.kinetic,
            plastic: 0.5 * dot(&dv, &dp),
            size: self.kinetic,
            condition: None,
        }
    }
}

/// What is followed up to a node.
#[derive(Default)]
struct Followed {
    readings: Vec<Vec<f64>>,
    turns: Vec<f64>,
}

/// A phase that cannot begin.
fn refused(event: &str, step: u64, t: f64, error: &ModelError) -> RunFailure {
    let message = format!("the mechanism after event `{event}` cannot move on: {error}");
    let remedy = "release or lock other parts, or let the event act elsewhere".into();
    RunFailure { step, t, message, remedy }
}
