//! Works of force elements as internal variables of a run, for what has to be differentiated.
//!
//! ```text
//! W_0 = V(q_0),  W grows by what the force of the element does          W − V(q): the work since the start
//! V_θ at fixed q: ½ k_θ (x − x_0)² + k (x − x_0)(x_θ − x_0θ) of a spring
//! ```
//! The numbers are those of [`crate::sensor`].

use super::joint_drive::{ElementLaw, JointDrive, joint_elements};
use super::time_function::TimeFunctions;
use crate::design::ModelTangent;
use holonom_model::Model;
use std::sync::Arc;
use vi_core::force::Source;
use vi_core::num_dual::Dual64;
use vi_core::potential::DiscretePotential;
use vi_core::{Configuration, Quadrature, Working};
use vi_multibody::builder::ForceElements;
use vi_multibody::bushing::SixSpring;
use vi_multibody::design::{EffortTangent, MovedCoordinate};
use vi_multibody::joint_force::JointSpring;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::spring::Spring;

/// What an element stores.
#[derive(Clone, Debug)]
pub(crate) enum Stored {
    /// A spring of this joint.
    Joint(usize, Box<JointSpring>),
    /// A spring between points, by its number.
    Spring(usize, Spring),
    /// A bushing.
    Bushing(Box<SixSpring>),
}

/// `V_θ` of one parameter.
pub(crate) type StoredTangent = Box<dyn Fn(Configuration<'_>) -> f64 + Send + Sync>;

/// The work of the force of a name, and of what its element stores.
#[derive(Clone, Debug)]
pub(crate) struct ForceWork {
    /// The name of the force.
    pub(crate) force: String,
    /// The energy.
    pub(crate) stored: Option<Stored>,
}

impl ForceWork {
    /// Of a force of a model.
    pub(crate) fn of(
        model: &Model,
        force: &str,
        mechanism: &mut Mechanism,
        forces: &ForceElements,
    ) -> Self {
        let joints = model.joints.iter().enumerate();
        let mut springs = joints.filter(|(_, own)| force_of(&own.name, "spring") == force);
        let of_joint = springs.next().and_then(|(joint, own)| {
            let elements = joint_elements(own, None, &mut TimeFunctions::new(model));
            elements.into_iter().find_map(|JointDrive { freedom, law, .. }| match law {
                ElementLaw::Spring { stiffness, rest } => {
                    let coordinate = mechanism.coordinate(joint, freedom)?;
                    let spring = JointSpring { coordinate, stiffness, rest };
                    Some(Stored::Joint(joint, Box::new(spring)))
                }
                _ => None,
            })
        });
        let spring = || {
            let k = model.springs.iter().position(|own| own.name == force)?;
            Some(Stored::Spring(k, forces.springs.get(k)?.clone()))
        };
        let bushing = || {
            let own = forces.bushings.iter().find(|own| own.name == force)?;
            Some(Stored::Bushing(Box::new(own.spring.clone())))
        };
        Self { force: force.to_owned(), stored: of_joint.or_else(spring).or_else(bushing) }
    }

    /// As a system takes it.
    pub(crate) fn working(&self) -> Working {
        let stored = self.stored.as_ref().map(Stored::energy);
        Working { source: Source::Element(self.force.clone()), stored }
    }
}

impl Stored {
    /// `V`.
    pub(crate) fn energy(&self) -> Arc<dyn DiscretePotential> {
        match self {
            Self::Joint(_, own) => Arc::new((**own).clone()),
            Self::Spring(_, own) => Arc::from(Quadrature::Midpoint.discretize(own.clone())),
            Self::Bushing(own) => Arc::new((**own).clone()),
        }
    }

    /// `V_θ` at a configuration; `None` where a parameter does not change it.
    pub(crate) fn by_parameter(
        &self,
        force: &str,
        mechanism: &Mechanism,
        tangent: &ModelTangent,
    ) -> Option<StoredTangent> {
        match self {
            Self::Joint(joint, spring) => {
                let moved = MovedCoordinate::of(mechanism, &tangent.numbers, &spring.coordinate);
                let mut efforts = tangent.drives.iter();
                let own = efforts.find(|(of, part, _)| (*of, *part) == (*joint, "spring"));
                let by = own.map(|own| own.2.clone());
                if moved.is_none() && by.is_none() {
                    return None;
                }
                let spring = spring.clone();
                Some(Box::new(move |at| {
                    let (rest, x) = (spring.rest, spring.coordinate.at(at));
                    let stretch = x - rest;
                    // V_θ = −∫ τ_θ dx from x_0, of which τ_θ is linear in x
                    let of = |by: &EffortTangent| {
                        -0.5 * (by(at.t, rest, 0.0) + by(at.t, x, 0.0)) * stretch
                    };
                    let along = moved.as_ref().map_or(0.0, |own| own.by(at.q));
                    by.as_ref().map_or(0.0, of) + spring.stiffness * stretch * along
                }))
            }
            Self::Spring(k, spring) => {
                let change = tangent.numbers.springs.get(k)?;
                let dual = Spring {
                    between: spring.between.with_tangent(&change.between),
                    stiffness: Dual64::new(spring.stiffness, change.stiffness),
                    natural_length: Dual64::new(spring.natural_length, change.natural_length),
                    law: spring.law,
                };
                Some(Box::new(move |at| dual.energy(at.q).eps))
            }
            Self::Bushing(_) => {
                let own = tangent.acting.bushings.iter().find(|own| own.name == force)?;
                let own = own.spring.clone(); // linear in its numbers
                Some(Box::new(move |at| DiscretePotential::potential(&own, at)))
            }
        }
    }
}

/// The name of the force of a part of a joint.
pub(crate) fn force_of(joint: &str, part: &str) -> String {
    format!("{joint}.{part}")
}
