//! What acts on a run from outside its model, by the names of joints, bodies and constraints.

use super::input::{Input, InputPlace, nothing};
use crate::system::time_function::TimeFunctions;
use holonom_model::{Constraint, Formula, Joint, Model, ModelError, Problem};
use std::sync::Arc;
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint_force::JointLaw;

/// Value, rate and acceleration at a time.
pub type PrescribedPath = Arc<dyn Fn(f64) -> [f64; 3] + Send + Sync>;

/// What acts from outside. Clones share their inputs, laws and paths.
#[derive(Clone, Debug, Default)]
pub struct ExternalActions {
    /// What is held over a step.
    pub inputs: Vec<Input>,
    /// What is evaluated within Newton's method.
    pub laws: Vec<OutsideLaw>,
    /// Paths in the place of those of the model.
    pub motions: Vec<OutsideMotion>,
    /// Where joints begin.
    pub start: JointStart,
    /// Coordinates of joints, by name and number, of which revolutions count beside those that the
    /// model needs.
    pub counted: Vec<(String, usize)>,
    /// Forces whose works are internal variables of the run, by name.
    pub works: Vec<String>,
    /// What signals evaluate beside their own: efforts of their law, in this order; `None` is zero.
    pub watched: Vec<Option<Formula>>,
    /// Angles of a state of the same model, rad: revolutions of those at the start count from
    /// there; modulo a revolution where this is empty.
    pub angles: Vec<f64>,
    /// The equilibrium in which a run begins in the place of the start of its model.
    pub still: Option<Still>,
}

/// A configuration at rest, with what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Still {
    /// Coordinates, shape `n`.
    pub q: Vec<f64>,
    /// Angles with their revolutions, rad.
    pub angles: Vec<f64>,
    /// Directions in which it is unstable.
    pub unstable: usize,
    /// Whether some direction has no stiffness.
    pub neutral: bool,
}

/// A force or torque along a coordinate of a joint.
#[derive(Clone, Debug)]
pub struct OutsideLaw {
    /// The joint.
    pub joint: String,
    /// Which of its coordinates.
    pub freedom: usize,
    /// `τ(t, θ, θ̇)`, N or N·m.
    pub law: Arc<dyn JointLaw>,
}

/// The path of a `[[constraint]]` of type `motion`, m or rad.
#[derive(Clone)]
pub struct OutsideMotion {
    /// The constraint.
    pub constraint: String,
    /// Value, rate, acceleration.
    pub path: PrescribedPath,
}

impl std::fmt::Debug for OutsideMotion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OutsideMotion")
            .field("constraint", &self.constraint)
            .finish_non_exhaustive()
    }
}

/// Coordinates (m, rad) and rates (m/s, rad/s) of joints at the start: joint, which of its
/// coordinates, value. Those of other joints are those of the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointStart {
    /// Coordinates.
    pub coordinates: Vec<(String, usize, f64)>,
    /// Rates.
    pub rates: Vec<(String, usize, f64)>,
}

impl ExternalActions {
    /// Inputs alone.
    #[must_use]
    pub fn of_inputs(inputs: &[Input]) -> Self {
        Self { inputs: inputs.to_vec(), ..Self::default() }
    }

    /// Checks the names that nothing else looks up; set points hold what paths begin with.
    pub(crate) fn prepare(&self, model: &Model) -> Result<(), ModelError> {
        let joints = || model.joints.iter().map(|joint| joint.name.as_str());
        for law in &self.laws {
            if model.joint(&law.joint).is_none() {
                return Err(nothing("laws", &law.joint, "joint", joints()));
            }
        }
        for motion in &self.motions {
            let paths =
                || model.constraints.iter().filter(|own| matches!(own, Constraint::Motion { .. }));
            if !paths().any(|own| own.name() == motion.constraint) {
                let known = paths().map(Constraint::name);
                return Err(nothing("motions", &motion.constraint, "prescribed motion", known));
            }
        }
        for input in &self.inputs {
            let InputPlace::Setpoint(name) = input.place() else { continue };
            let Some(joint) = model.joint(name) else {
                return Err(nothing("inputs", name, "joint", joints()));
            };
            let controlled = |motor: &&holonom_model::JointMotor| {
                motor.proportional != 0.0 || motor.derivative != 0.0
            };
            let Some(motor) = joint.motor.as_ref().filter(controlled) else {
                let message = format!("the joint `{name}` has no motor that follows a path");
                let help = "write `motor = { proportional = …, derivative = … }` there";
                return Err(ModelError::Assembly(vec![Problem::new("inputs", message).help(help)]));
            };
            let path = TimeFunctions::new(model).path("", &motor.path);
            input.set(&[path(0.0)[0]]);
        }
        Ok(())
    }

    /// What acts on a phase in which these joints are released.
    pub(crate) fn without(&self, is_released: impl Fn(&str) -> bool) -> Self {
        let mut left = self.clone();
        left.inputs.retain(|input| match input.place() {
            InputPlace::Joint { name, .. } | InputPlace::Setpoint(name) => !is_released(name),
            InputPlace::Force(_) | InputPlace::Torque(_) | InputPlace::Control(_) => true,
        });
        left.laws.retain(|law| !is_released(&law.joint));
        left
    }

    /// The set point of the motor of a joint.
    pub(crate) fn setpoint(&self, joint: &Joint) -> Option<HeldEffort> {
        let own = |input: &&Input| *input.place() == InputPlace::Setpoint(joint.name.clone());
        self.inputs.iter().find(own).map(Input::first)
    }

    /// The path of a prescribed motion.
    pub(crate) fn path(&self, constraint: &str) -> Option<PrescribedPath> {
        let own = self.motions.iter().find(|motion| motion.constraint == constraint);
        own.map(|motion| motion.path.clone())
    }
}
