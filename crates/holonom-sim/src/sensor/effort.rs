//! Efforts: what springs, dampers, motors and prescribed motions do along their coordinates.
//!
//! ```text
//! spring of a joint     −k (θ − θ_0)            damper  −c θ̇           motor  τ(t, θ, θ̇)
//! spring of two points  dV/dl + c dl/dt         positive when it pulls its ends together
//! prescribed motion     −λ_n                    on θ, from g = θ − θ_ref(t)
//! gear                  −λ_n                    on θ_a, from g = θ_a + ρ θ_b − c; −ρ λ_n on θ_b
//! distance              l λ_n                   from g = ½ (|D|² − l²); positive when it pulls
//! bushing               τ(t, ξ, ξ̇)              six efforts along ξ, on `to`
//! law                   τ, T or (f, τ)          as it states them
//! ```
//! Rates are those of `v̂`. Positive efforts on a joint coordinate act on the child along it, and
//! oppositely on the parent. `λ_n` is that of the node, see [`crate::sensor`].

use super::columns::PARTS;
use super::finder::Finder;
use super::view::View;
use crate::system::joint_drive::JointDrive;
use crate::system::names::Names;
use crate::system::time_function::TimeFunctions;
use vi_multibody::builder::ForceElements;
use vi_multibody::joint_motion::{JointMotion, joint_rates};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::reaction::{BarTension, NodeReactions};
use vi_multibody::scalar_constraint::ScalarRow;
use vi_multibody::spring::{Damper, Spring};

/// What a sensor of an effort reads.
#[derive(Clone, Debug)]
pub(crate) enum EffortSensor {
    /// The force elements of a joint, and its coordinates.
    Joint(Vec<JointDrive>, Box<JointMotion>),
    /// A spring between points with its damper.
    Spring(Box<Spring>, Box<Damper>),
    /// A constraint, and the factor of `−λ`.
    Row(usize, f64),
    /// A bushing.
    Six(String, Box<ForceElements>),
    /// A law, and how many numbers of its efforts are listed.
    Law(Box<ForceElements>, usize),
}

/// The first row of a scalar constraint.
pub(super) fn row_of(name: &str, mechanism: &Mechanism) -> Option<usize> {
    let scalars = &mechanism.description().scalars;
    let k = scalars.iter().position(|scalar| scalar.name == name)?;
    Some(mechanism.scalar_rows(k).start)
}

impl EffortSensor {
    /// That of a joint, spring or constraint of the model; `None` when there is none of this name.
    pub(super) fn of(name: &str, from: &Finder<'_>) -> Option<Self> {
        let Finder { names: Names { model, .. }, mechanism, dynamics, .. } = *from;
        let forces = &dynamics.forces;
        let description = mechanism.description();
        if let Some((joint, _)) = from.names.joint(name) {
            let own = description.joints[from.joint(name)?].clone();
            let motion = JointMotion::new(own, &from.q);
            let elements = from.names.elements(joint, &mut TimeFunctions::new(model));
            return Some(Self::Joint(elements, Box::new(motion)));
        }
        if let Some(k) = model.springs.iter().position(|spring| spring.name == name) {
            let (spring, damping) = (forces.springs.get(k)?.clone(), model.springs[k].damping);
            let damper = Damper { between: spring.between.clone(), damping };
            return Some(Self::Spring(Box::new(spring), Box::new(damper)));
        }
        if model.bushings.iter().any(|bushing| bushing.name == name) {
            return Some(Self::Six(name.to_owned(), Box::new(forces.only(name))));
        }
        if let Some(law) = model.laws.iter().find(|law| law.name == name) {
            let on = law.on.as_deref();
            let particle = on.is_some_and(|on| from.names.particles.contains_key(on));
            let count = match (on, particle) {
                (None, _) => 1,
                (_, true) => model.header.dimension,
                (_, false) => 6,
            };
            return Some(Self::Law(Box::new(forces.only(name)), count));
        }
        let k = description.scalars.iter().position(|scalar| scalar.name == name)?;
        let row = mechanism.scalar_rows(k).start;
        let factor = match description.scalars[k].rows.first()? {
            ScalarRow::Product(distance) => -distance.target.sqrt(), // −l, c = l²
            _ => 1.0,
        };
        Some(Self::Row(row, factor))
    }

    /// Whether a constraint force is needed.
    pub(crate) fn needs_force(&self) -> bool {
        matches!(self, Self::Row(..))
    }

    /// Goes on with the parts of another mechanism, `idle(name, part)` of them without effect;
    /// whether nothing of it acts.
    pub(super) fn act_by(
        &mut self,
        name: &str,
        mechanism: &Mechanism,
        all: &ForceElements,
        idle: &dyn Fn(&str, &str) -> bool,
    ) -> bool {
        match self {
            Self::Joint(elements, _) => {
                elements.iter_mut().for_each(|element| element.idle = idle(name, element.part));
                false
            }
            Self::Spring(..) => idle(name, ""),
            Self::Six(_, forces) | Self::Law(forces, _) => {
                **forces = all.only(name);
                idle(name, "")
            }
            Self::Row(row, _) => row_of(name, mechanism).map(|own| *row = own).is_none(),
        }
    }

    pub(crate) fn begin(&mut self, q: &[f64]) {
        if let Self::Joint(_, motion) = self {
            **motion = JointMotion::new(motion.joint().clone(), q);
        }
    }

    pub(crate) fn follow(&mut self, q: &[f64]) {
        if let Self::Joint(_, motion) = self {
            motion.follow(q);
        }
    }

    /// The unwrapped coordinates of a joint.
    pub(crate) fn followed(&self) -> &[f64] {
        match self {
            Self::Joint(_, motion) => motion.values(),
            _ => &[],
        }
    }

    /// Continues from them.
    pub(crate) fn resume(&mut self, values: &[f64]) {
        if let Self::Joint(_, motion) = self {
            motion.resume(values);
        }
    }

    pub(crate) fn read(
        &self,
        at: &View<'_>,
        reactions: Option<&NodeReactions<'_>>,
        out: &mut Vec<f64>,
    ) {
        match self {
            Self::Joint(elements, motion) => {
                let rates = joint_rates(motion.joint(), at.q, at.v);
                for part in PARTS {
                    let own = elements.iter().filter(|element| element.part == part);
                    let effort = |element: &JointDrive| {
                        let freedom = element.freedom;
                        element.effort(at.t, motion.values()[freedom], rates[freedom])
                    };
                    out.extend(own.map(effort).reduce(|sum, effort| sum + effort));
                }
            }
            Self::Spring(spring, damper) => {
                out.push(spring.tension(at.q) + damper.tension(at.q, at.v));
            }
            Self::Six(name, forces) => {
                let efforts = forces.bushing_efforts(name, at.motion());
                out.extend(efforts.unwrap_or_default().iter());
            }
            Self::Law(forces, count) => {
                let mut own = forces.forces.iter();
                let efforts = own.find_map(|own| own.efforts(at.motion()));
                out.extend(&efforts.unwrap_or_default().0[..*count]);
            }
            Self::Row(row, factor) => {
                let Some(tension) = reactions.map(|all| all.scalar_row(*row)) else { return };
                let BarTension { force, unique } = tension;
                out.push(if unique { factor * force } else { f64::NAN });
                out.push(f64::from(u8::from(unique)));
            }
        }
    }

    /// What the elements of a joint, each part by itself, or a spring with its damper put into the
    /// system, W.
    pub(super) fn powers(&self, at: &View<'_>, out: &mut Vec<f64>) {
        match self {
            Self::Joint(elements, motion) => {
                let rates = joint_rates(motion.joint(), at.q, at.v);
                for part in PARTS {
                    let own = elements.iter().filter(|element| element.part == part);
                    let power = |element: &JointDrive| {
                        let (value, rate) =
                            (motion.values()[element.freedom], rates[element.freedom]);
                        rate * element.effort(at.t, value, rate)
                    };
                    out.extend(own.map(power).reduce(|sum, power| sum + power));
                }
            }
            Self::Spring(spring, damper) => {
                let tension = spring.tension(at.q) + damper.tension(at.q, at.v);
                out.push(-tension * at.length_rate(&spring.between));
            }
            Self::Row(..) | Self::Six(..) | Self::Law(..) => {} // of the last two with their forces
        }
    }
}
