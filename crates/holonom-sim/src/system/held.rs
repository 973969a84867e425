//! What acts from outside: efforts of joints, forces and torques, held over a step.
//!
//! ```text
//! joint     f_d^± = (h/2) u ∇θ                     as a motor of the effort u
//! force     f_d^± = (h/2) (u, 0, 0, 0)             at the centre of mass, components in space
//! torque    f_d^± = (h/2) (0, ½ u×d̄_I)             directors of the midpoint, of second order
//! ```

pub use super::input::{Input, InputPlace};

use super::coordinate::coordinate;
use super::input::nothing;
use super::names::Names;
use super::outside::{ExternalActions, OutsideLaw};
use holonom_model::{Load, Model, ModelError};
use nalgebra::Vector3;
use std::sync::Arc;
use vi_core::Motion;
use vi_core::force::{Force, NoTimeSlope};
use vi_core::sparse::Entries;
use vi_multibody::builder::{ElementForce, MechanismBuilder, NamedForce};
use vi_multibody::mechanism::Mechanism;
use vi_rigid::load::{Wrench, add_lever_slopes, add_wrench};
use vi_rigid::time_history::{TimeFunction, TimeHistory};

/// The key of inputs in what is said of them.
const KEY: &str = "inputs";
/// Coordinates of a body.
const FRAME: usize = 12;

/// Adds an input of a joint.
pub(super) fn add_joint_input(
    builder: &mut MechanismBuilder,
    input: &Input,
    names: &Names<'_>,
) -> Result<(), ModelError> {
    let InputPlace::Joint { name, freedom } = input.place() else { return Ok(()) };
    let Some((joint, id)) = names.joint(name) else {
        return Err(nothing(KEY, name, "joint", names.joints.keys().copied()));
    };
    let coordinate = coordinate(joint, id, *freedom, KEY.into())?;
    builder.joint_force(coordinate, input.first()).named(&input.source());
    Ok(())
}

/// The wrenches of controls, each times the value that its input holds.
pub(super) fn control_loads<'a>(
    model: &'a Model,
    inputs: &'a [Input],
) -> impl Iterator<Item = (Load, TimeHistory)> + 'a {
    inputs.iter().filter_map(|input| {
        let InputPlace::Control(name) = input.place() else { return None };
        let own = model.controls.iter().find(|own| own.name == *name)?;
        let (load, value) = (Load { name: input.source(), ..own.load()? }, input.first());
        Some((load, TimeHistory::Function(TimeFunction::new(move |_| value.get()))))
    })
}

/// That the values of controls are zero where nothing from outside sets them.
pub(crate) fn idle_controls(model: &Model, outside: &ExternalActions) -> Option<String> {
    let names: Vec<String> = model.controls.iter().map(|own| format!("`{}`", own.name)).collect();
    let idle = !names.is_empty() && outside.inputs.is_empty();
    idle.then(|| format!("the values of controls are zero in a run: {}", names.join(", ")))
}

/// Adds laws along joint coordinates.
pub(super) fn add_laws(
    builder: &mut MechanismBuilder,
    laws: &[OutsideLaw],
    names: &Names<'_>,
) -> Result<(), ModelError> {
    for OutsideLaw { joint: name, freedom, law } in laws {
        let Some((joint, id)) = names.joint(name) else { continue };
        let at = coordinate(joint, id, *freedom, "laws".into())?;
        let source = if *freedom == 0 { name.clone() } else { format!("{name}.{freedom}") };
        builder.joint_force(at, law.clone()).named(&format!("{source}.law"));
    }
    Ok(())
}

/// The inputs of bodies and point masses.
pub(super) fn wrenches(
    inputs: &[Input],
    names: &Names<'_>,
    mechanism: &Mechanism,
) -> Result<Vec<NamedForce>, ModelError> {
    let mut forces = Vec::new();
    for input in inputs {
        let (name, torque) = match input.place() {
            InputPlace::Joint { .. } | InputPlace::Control(_) | InputPlace::Setpoint(_) => continue,
            InputPlace::Force(name) => (name.as_str(), false),
            InputPlace::Torque(name) => (name.as_str(), true),
        };
        let particle = names.particles.get(name).filter(|_| !torque);
        let (offset, size) = match (names.index(name), particle) {
            (Some(k), _) => (FRAME * names.frames[k].index(), FRAME),
            (_, Some(particle)) => {
                let dimension = mechanism.description().dimension;
                (mechanism.particle_offset(particle.index()), dimension)
            }
            _ => {
                let particles = names.particles.keys().copied().filter(|_| !torque);
                let known = names.bodies.keys().copied().chain(particles);
                return Err(nothing(KEY, name, "body", known));
            }
        };
        let force = HeldWrench { input: input.clone(), torque, offset, size };
        let force = ElementForce::Coordinates(Arc::new(force));
        forces.push(NamedForce { name: input.source(), force });
    }
    Ok(forces)
}

/// The force or torque of an input on the coordinates of a body or point mass.
struct HeldWrench {
    input: Input,
    torque: bool,
    offset: usize,
    size: usize, // coordinates
}

impl Force for HeldWrench {
    fn add(&self, Motion { q, .. }: Motion<'_>, scale: f64, out: &mut [f64]) {
        let values = self.input.values();
        let place = self.offset..self.offset + self.size;
        if !self.torque {
            let own = out[place].iter_mut().take(3);
            own.zip(values).for_each(|(out, value)| *out += scale * value);
            return;
        }
        let wrench = Wrench { force: Vector3::zeros(), torque: values.into() };
        add_wrench(scale, wrench, &q[place.clone()], &mut out[place]);
    }

    fn add_position_derivative(&self, _at: Motion<'_>, scale: f64, out: &mut dyn Entries) {
        if !self.torque {
            return;
        }
        add_lever_slopes(scale, &self.input.values().into(), self.offset, out);
    }

    fn add_velocity_derivative(&self, _at: Motion<'_>, _scale: f64, _out: &mut dyn Entries) {}

    fn add_time_derivative(
        &self,
        _at: Motion<'_>,
        _scale: f64,
        _out: &mut [f64],
    ) -> Result<(), NoTimeSlope> {
        Ok(())
    }

    fn is_dissipative(&self) -> bool {
        false
    }
}
