//! The model that is in force in a phase, and its start.

use super::Events;
use super::switches::{PhaseStart, Switches};
use crate::simulation::{Simulation, stepper};
use crate::system::held::{Input, InputPlace};
use crate::system::{self, System};
use holonom_model::{Constraint, Model, ModelError};
use vi_constraints::{Constraints, InitialValues};
use vi_core::Configuration;
use vi_multibody::mechanism::Mechanism;

/// The model without what is released or does not act.
fn in_force(model: &Model, switches: &Switches) -> Model {
    let mut model = model.clone();
    let gone = |name: &str| switches.released.contains(name);
    let idle = |name: &str| gone(name) || switches.disabled.contains(name);
    model.joints.retain(|joint| !gone(&joint.name));
    for joint in &mut model.joints {
        joint.rate = None; // of the start
        joint.motor = joint.motor.take().filter(|_| !switches.disabled.contains(&joint.name));
    }
    model.bars.retain(|bar| !gone(&bar.name));
    let along = |constraint: &Constraint| match constraint {
        Constraint::Gear { joints, .. } => joints.iter().any(|joint| gone(joint)),
        Constraint::Motion { joint, .. } => gone(joint),
        _ => false,
    };
    model.constraints.retain(|own| !gone(own.name()) && !along(own));
    model.springs.retain(|spring| !gone(&spring.name));
    model.laws.retain(|law| {
        let joint = law.joint.as_deref();
        !idle(&law.name) && !joint.is_some_and(gone)
    });
    model.loads.retain(|load| !idle(&load.name));
    model.sensors.clear();
    model
}

impl Events {
    /// The angles of a mechanism with the revolutions that were counted.
    fn angles_of(&self, mechanism: &Mechanism, q: &[f64]) -> Vec<f64> {
        let turns = &self.switches.turns;
        let known = |angle: &vi_multibody::joint_coordinate::JointCoordinate| {
            let at = Configuration { t: 0.0, q, angles: turns, internal: &[] };
            let own = self.angles.iter().find(|own| own.value() == angle.value());
            own.map_or_else(|| angle.at(Configuration::new(0.0, q)), |own| own.at(at))
        };
        mechanism.angles().iter().map(known).collect()
    }
}

impl Simulation {
    /// Begins the phase that the switches state: another mechanism at the same configuration.
    pub(super) fn begin_phase(&mut self) -> Result<(), ModelError> {
        let Some(events) = &self.events else { return Ok(()) };
        let switches = &events.switches;
        let model = in_force(&events.model, switches);
        let exists = |input: &&Input| match input.place() {
            InputPlace::Joint { name, .. } => !switches.released.contains(name),
            _ => true,
        };
        let inputs: Vec<Input> = events.inputs.iter().filter(exists).cloned().collect();
        let System { mechanism, dynamics, laws, sensors: signals, .. } =
            system::build_with_locks(&model, &inputs, &switches.locks)?;
        let start = switches.phase.as_deref().unwrap_or(&events.first);
        let PhaseStart { step, t, q, v, internal } = start;
        let at = InitialValues::new(*t, q, v);
        let angles = match &switches.phase {
            Some(_) => events.angles_of(&mechanism, q),
            None => mechanism.principal_angles(q),
        };
        let rolling = self.rolling.continued(&mechanism);
        let mut wanted = self.sensors.wanted();
        wanted.forces |= rolling.needs_forces();
        let mut next = stepper(mechanism, &dynamics, &model, at, events.solver, wanted)?;
        next.continue_from(*step, *t, &angles, internal);
        self.energies.act_by(next.sources(), &dynamics.forces);
        self.energies.take_up(&switches.works);
        let released = switches.released.clone();
        let disabled = switches.disabled.clone();
        let idle = |name: &str, part: &str| {
            released.contains(name)
                || disabled.contains(name) && (part.is_empty() || part == "motor")
        };
        self.sensors.act_by(next.mechanism(), &idle);
        self.sensors.read_signals_as(&signals);
        if let Some(events) = &mut self.events {
            events.conditions.sensors().act_by(next.mechanism(), &idle);
            events.conditions.sensors().read_signals_as(&signals);
        }
        (self.laws, self.stepper, self.rolling) = (laws, next, rolling);
        Ok(())
    }
}
