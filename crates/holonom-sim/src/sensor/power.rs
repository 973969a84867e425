//! Powers: what springs, dampers, motors, loads and prescribed motions put into the system in a
//! second.
//!
//! ```text
//! along a joint        τ θ̇                      τ: the effort on the child
//! spring of two points −(dV/dl + c dl/dt) dl/dt
//! load                 f·ẋ + τ·ω                of all bodies and nodes that it acts on
//! law, bushing         f(t, q, v)·v
//! prescribed motion    −λ_n θ̇                   from g = θ − θ_ref(t)
//! ```
//! Rates are those of `v̂`, values those of the node, so the trapezoidal sum over all nodes is the
//! work that the steps have done, to second order in the step.

use super::effort::{EffortSensor, row_of};
use super::finder::Finder;
use super::view::View;
use holonom_model::Constraint;
use std::sync::{Arc, Mutex, PoisonError};
use vi_multibody::builder::ForceElements;
use vi_multibody::joint::Joint;
use vi_multibody::joint_motion::joint_rates;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::reaction::NodeReactions;
use vi_rigid::Load;

/// What a sensor of a power reads.
#[derive(Clone, Debug)]
pub(super) enum Power {
    /// Of the elements of a joint, or of a spring between points.
    Effort(EffortSensor),
    /// Of a load, in all places where it acts.
    Loads(Vec<Load>),
    /// Of a law or a bushing.
    Forces(Box<ForceElements>, Arc<Mutex<Vec<f64>>>),
    /// Of a prescribed motion: its row, the joint and the degree of freedom.
    Motion(usize, Box<Joint>, usize),
}

impl Power {
    /// That of a joint, spring, load or motion of the model; `None` when there is none of this
    /// name.
    pub(super) fn of(name: &str, from: &Finder<'_>) -> Option<Self> {
        let model = from.names.model;
        if model.loads.iter().any(|load| load.name == name) {
            return Some(Self::Loads(from.dynamics.forces.loads(name).cloned().collect()));
        }
        let law = model.laws.iter().any(|law| law.name == name);
        if law || model.bushings.iter().any(|bushing| bushing.name == name) {
            let forces = Box::new(from.dynamics.forces.only(name));
            return Some(Self::Forces(forces, Arc::default()));
        }
        let effort = EffortSensor::of(name, from)?;
        let motion = model.constraints.iter().find(|c| c.name() == name);
        match (effort, motion) {
            (EffortSensor::Row(row, _), Some(Constraint::Motion { joint, freedom, .. })) => {
                let joint = from.mechanism.description().joints[from.joint(joint)?].clone();
                Some(Self::Motion(row, Box::new(joint), *freedom))
            }
            (effort, _) => Some(Self::Effort(effort)),
        }
    }

    /// Whether a constraint force is needed.
    pub(super) fn needs_force(&self) -> bool {
        matches!(self, Self::Motion(..))
    }

    /// Goes on with the parts of another mechanism, as [`EffortSensor::act_by`].
    pub(super) fn act_by(
        &mut self,
        name: &str,
        mechanism: &Mechanism,
        all: &ForceElements,
        idle: &dyn Fn(&str, &str) -> bool,
    ) -> bool {
        match self {
            Self::Effort(effort) => effort.act_by(name, mechanism, all, idle),
            Self::Forces(forces, _) => {
                **forces = all.only(name);
                idle(name, "")
            }
            Self::Loads(_) => idle(name, ""),
            Self::Motion(row, ..) => row_of(name, mechanism).map(|own| *row = own).is_none(),
        }
    }

    /// What follows joint coordinates.
    pub(super) fn effort(&self) -> Option<&EffortSensor> {
        match self {
            Self::Effort(effort) => Some(effort),
            _ => None,
        }
    }

    /// The same, to go on.
    pub(super) fn effort_mut(&mut self) -> Option<&mut EffortSensor> {
        match self {
            Self::Effort(effort) => Some(effort),
            _ => None,
        }
    }

    pub(super) fn read(
        &self,
        at: &View<'_>,
        reactions: Option<&NodeReactions<'_>>,
        out: &mut Vec<f64>,
    ) {
        match self {
            Self::Effort(effort) => effort.powers(at, out),
            Self::Loads(loads) => {
                out.push(loads.iter().map(|load| load.power(at.t, at.q, at.v)).sum());
            }
            Self::Forces(forces, scratch) => {
                let scratch = &mut *scratch.lock().unwrap_or_else(PoisonError::into_inner);
                out.push(forces.power(at.motion(), scratch));
            }
            Self::Motion(row, joint, freedom) => {
                let Some(tension) = reactions.map(|all| all.scalar_row(*row)) else { return };
                let rate = joint_rates(joint, at.q, at.v)[*freedom];
                out.push(if tension.unique { tension.force * rate } else { f64::NAN });
            }
        }
    }
}
