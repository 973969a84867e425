//! What acts on the coordinates of a joint: springs, dampers, motors, controls.

use super::time_function::TimeFunctions;
use holonom_model::FrictionCourse;
use std::sync::Arc;
use vi_multibody::bumper::Bumper;
use vi_multibody::held_effort::HeldEffort;
use vi_multibody::joint_force::{
    EffortBends, EffortSlopes, JointLaw, Motor, PdControl, Setpoint, Viscous,
};
use vi_multibody::stribeck::{Stribeck, StribeckFriction};

/// What acts on one coordinate of a joint.
#[derive(Clone, Debug)]
pub(crate) struct JointDrive {
    /// `spring`, `damper`, `bumper`, `friction` or `motor`.
    pub(crate) part: &'static str,
    /// Which degree of freedom of the joint.
    pub(crate) freedom: usize,
    /// Its effort.
    pub(crate) law: ElementLaw,
    /// Whether it does not act.
    pub(crate) idle: bool,
}

impl JointDrive {
    /// `τ` and its derivatives.
    pub(crate) fn effort_and_slopes(
        &self,
        t: f64,
        coordinate: f64,
        rate: f64,
    ) -> (f64, EffortSlopes) {
        if self.idle {
            return (0.0, EffortSlopes::default());
        }
        match &self.law {
            ElementLaw::Spring { stiffness, .. } => {
                let slopes = EffortSlopes { by_coordinate: -stiffness, by_rate: 0.0 };
                (self.law.effort(t, coordinate, rate), slopes)
            }
            ElementLaw::Force(law) => law.effort_and_slopes(t, coordinate, rate),
            ElementLaw::Idle => (0.0, EffortSlopes::default()),
        }
    }

    /// The second derivatives of `τ`.
    pub(crate) fn bends(&self, t: f64, coordinate: f64, rate: f64) -> EffortBends {
        match &self.law {
            ElementLaw::Force(law) if !self.idle => law.bends(t, coordinate, rate),
            _ => EffortBends::default(),
        }
    }

    /// `τ(t, θ, θ̇)`.
    pub(crate) fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        if self.idle { 0.0 } else { self.law.effort(t, coordinate, rate) }
    }
}

/// The effort of a force element along a joint coordinate, N or N·m.
#[derive(Clone, Debug)]
pub(crate) enum ElementLaw {
    /// `−k (θ − θ_0)`.
    Spring { stiffness: f64, rest: f64 },
    /// `τ(t, θ, θ̇)`.
    Force(Arc<dyn JointLaw>),
    /// Of a motor without effort and control.
    Idle,
}

impl ElementLaw {
    /// `τ(t, θ, θ̇)`.
    pub(crate) fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        match self {
            Self::Spring { stiffness, rest } => -stiffness * (coordinate - rest),
            Self::Force(law) => law.effort(t, coordinate, rate),
            Self::Idle => 0.0,
        }
    }
}

/// Which parts act on a joint, and on which freedom, in the order of [`joint_elements`].
pub(crate) fn joint_parts(joint: &holonom_model::Joint) -> Vec<(&'static str, usize)> {
    let spring = joint.spring.as_ref().map(|own| ("spring", own.freedom));
    let damper = joint.damper.as_ref().map(|own| ("damper", own.freedom));
    let motor = joint.motor.as_ref().map(|own| ("motor", own.freedom));
    let bumper = bumper(joint).map(|(freedom, _)| ("bumper", freedom));
    let friction = friction(joint).map(|(freedom, _)| ("friction", freedom));
    [spring, damper, bumper, friction, motor].into_iter().flatten().collect()
}

/// The elastic stops of a joint.
pub(crate) fn bumper(joint: &holonom_model::Joint) -> Option<(usize, Bumper)> {
    let (limits, bumper) = (joint.limits?.table(), joint.bumper?);
    let (lower, upper, stiffness) = (limits.lower, limits.upper, bumper.stiffness);
    let law = Bumper { lower, upper, stiffness, damping: bumper.damping };
    Some((limits.freedom, law))
}

/// The smooth friction of a joint.
pub(crate) fn friction(joint: &holonom_model::Joint) -> Option<(usize, StribeckFriction)> {
    let friction = joint.friction?;
    let course = stribeck(&friction.model?.course());
    Some((friction.freedom, StribeckFriction { effort: friction.effort(), course }))
}

/// The course of smooth friction.
pub(super) fn stribeck(course: &FrictionCourse) -> Stribeck {
    let FrictionCourse { transition_velocity, static_ratio, stribeck_velocity } = *course;
    let stribeck_velocity = stribeck_velocity.unwrap_or(transition_velocity);
    Stribeck { transition_velocity, static_ratio, stribeck_velocity }
}

/// Spring, damper, bumper, friction, motor and control of a joint, in this order; `setpoint`: what
/// the control follows in the place of the path of the motor.
pub(crate) fn joint_elements(
    joint: &holonom_model::Joint,
    setpoint: Option<HeldEffort>,
    times: &mut TimeFunctions<'_>,
) -> Vec<JointDrive> {
    let mut elements = Vec::new();
    let mut add =
        |part, freedom, law| elements.push(JointDrive { part, freedom, law, idle: false });
    if let Some(spring) = &joint.spring {
        let (stiffness, rest) = (spring.stiffness, spring.rest);
        match times.spring(&format!("the spring of `{}`", joint.name), spring) {
            Some(law) => add("spring", spring.freedom, ElementLaw::Force(law)),
            None => add("spring", spring.freedom, ElementLaw::Spring { stiffness, rest }),
        }
    }
    if let Some(damper) = &joint.damper {
        add("damper", damper.freedom, ElementLaw::Force(Arc::new(Viscous(damper.damping))));
    }
    if let Some((freedom, law)) = bumper(joint) {
        add("bumper", freedom, ElementLaw::Force(Arc::new(law)));
    }
    if let Some((freedom, law)) = friction(joint) {
        add("friction", freedom, ElementLaw::Force(Arc::new(law)));
    }
    if let Some(motor) = &joint.motor {
        let controlled = motor.proportional != 0.0 || motor.derivative != 0.0;
        if motor.effort == 0.0 && !controlled {
            add("motor", motor.freedom, ElementLaw::Idle);
        }
        if motor.effort != 0.0 {
            let owner = format!("the history of the motor of `{}`", joint.name);
            let (effort, history) = (motor.effort, times.history(&owner, &motor.history));
            let law = Motor(Arc::new(move |t| effort * history.value(t)));
            add("motor", motor.freedom, ElementLaw::Force(Arc::new(law)));
        }
        if controlled {
            let path =
                times.path(&format!("the path of the motor of `{}`", joint.name), &motor.path);
            let reference = Arc::new(move |t| match &setpoint {
                Some(held) => Setpoint { value: held.get(), rate: 0.0 },
                None => {
                    let [value, rate, _] = path(t);
                    Setpoint { value, rate }
                }
            });
            let (proportional, derivative) = (motor.proportional, motor.derivative);
            let law = PdControl { proportional, derivative, reference };
            add("motor", motor.freedom, ElementLaw::Force(Arc::new(law)));
        }
    }
    elements
}
