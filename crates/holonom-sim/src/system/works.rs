//! Works of force elements as internal variables of a run, for what has to be differentiated.
//!
//! ```text
//! W_0 = V(q_0),  W grows by what the force of the element does          W − V(q): the work since the start
//! ```
//! The numbers are those of [`crate::sensor`].

use super::joint_drive::{ElementLaw, JointDrive, joint_elements};
use super::time_function::TimeFunctions;
use holonom_model::Model;
use std::sync::Arc;
use vi_core::force::Source;
use vi_core::potential::DiscretePotential;
use vi_core::{Quadrature, Working};
use vi_multibody::builder::ForceElements;
use vi_multibody::bushing::SixSpring;
use vi_multibody::joint_force::JointSpring;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::spring::Spring;

/// What an element stores.
#[derive(Clone, Debug)]
pub(crate) enum ElementStore {
    /// A spring of this joint.
    Joint(usize, Box<JointSpring>),
    /// A spring between points, by its number.
    Spring(usize, Spring),
    /// A bushing.
    Bushing(Box<SixSpring>),
}

/// The work of the force of a name, and of what its element stores.
#[derive(Clone, Debug)]
pub(crate) struct ForceWork {
    /// The name of the force.
    pub(crate) force: String,
    /// The energy.
    pub(crate) stored: Option<ElementStore>,
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
                    Some(ElementStore::Joint(joint, Box::new(spring)))
                }
                _ => None,
            })
        });
        let spring = || {
            let k = model.springs.iter().position(|own| own.name == force)?;
            Some(ElementStore::Spring(k, forces.springs.get(k)?.clone()))
        };
        let bushing = || {
            let own = forces.bushings.iter().find(|own| own.name == force)?;
            Some(ElementStore::Bushing(Box::new(own.spring.clone())))
        };
        Self { force: force.to_owned(), stored: of_joint.or_else(spring).or_else(bushing) }
    }

    /// As a system takes it.
    pub(crate) fn working(&self) -> Working {
        let stored = self.stored.as_ref().map(ElementStore::energy);
        Working { source: Source::Element(self.force.clone()), stored }
    }
}

impl ElementStore {
    /// `V`.
    pub(crate) fn energy(&self) -> Arc<dyn DiscretePotential> {
        match self {
            Self::Joint(_, own) => Arc::new((**own).clone()),
            Self::Spring(_, own) => Arc::from(Quadrature::Midpoint.discretize(own.clone())),
            Self::Bushing(own) => Arc::new((**own).clone()),
        }
    }
}

/// The name of the force of a part of a joint.
pub(crate) fn force_of(joint: &str, part: &str) -> String {
    format!("{joint}.{part}")
}
