//! The model that is in force in a phase, and its start.

use super::Events;
use super::switches::Switches;
use holonom_model::{Constraint, Model};
use vi_core::Configuration;
use vi_multibody::mechanism::Mechanism;

/// The model without what is released or does not act.
pub(crate) fn in_force(model: &Model, switches: &Switches) -> Model {
    let mut model = model.clone();
    let gone = |name: &str| switches.released.contains(name);
    let idle = |name: &str| gone(name) || switches.disabled.contains(name);
    let released = model.joints.iter().filter(|joint| gone(&joint.name));
    model.released = released.map(|own| [own.parent.clone(), own.child.clone()]).collect();
    model.joints.retain(|joint| !gone(&joint.name));
    for joint in &mut model.joints {
        joint.rate = None; // of the start
        joint.motor = joint.motor.take().filter(|_| !switches.disabled.contains(&joint.name));
    }
    model.bars.retain(|bar| !gone(&bar.name));
    let along = |constraint: &Constraint| match constraint {
        Constraint::Gear { joints, .. } => joints.iter().any(|joint| gone(joint)),
        Constraint::Motion { joint, .. } => gone(joint),
        Constraint::Velocity { terms, .. } => {
            terms.iter().any(|term| term.joint.as_deref().is_some_and(gone))
        }
        _ => false,
    };
    model.constraints.retain(|own| !gone(own.name()) && !along(own));
    model.springs.retain(|spring| !gone(&spring.name));
    model.bushings.retain(|bushing| !gone(&bushing.name));
    model.laws.retain(|law| {
        let joint = law.joint.as_deref();
        !idle(&law.name) && !joint.is_some_and(gone)
    });
    model.loads.retain(|load| !idle(&load.name));
    model
}

impl Events {
    /// The angles of a mechanism with the revolutions that were counted.
    pub(crate) fn angles_of(&self, mechanism: &Mechanism, q: &[f64]) -> Vec<f64> {
        let turns = &self.switches.turns;
        let known = |angle: &vi_multibody::joint_coordinate::JointCoordinate| {
            let at = Configuration { t: 0.0, q, angles: turns, internal: &[] };
            let own = self.angles.iter().find(|own| own.value() == angle.value());
            own.map_or_else(|| angle.at(Configuration::new(0.0, q)), |own| own.at(at))
        };
        mechanism.angles().iter().map(known).collect()
    }
}
