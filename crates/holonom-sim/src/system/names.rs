//! Where the members of a model are among those of the mechanism.

use super::joint_drive::{JointDrive, joint_elements};
use super::outside::ExternalActions;
use super::time_function::TimeFunctions;
use holonom_model::{Joint, Model};
use nalgebra::Matrix3;
use std::collections::BTreeMap;
use vi_multibody::builder::{BodyId, JointId, ParticleId, PointOn};
use vi_multibody::joint::FrameId;

/// Where the names of a model are among its members.
pub(crate) struct Names<'a> {
    pub(crate) model: &'a Model,
    pub(crate) bodies: BTreeMap<&'a str, usize>,
    pub(crate) particles: BTreeMap<&'a str, ParticleId>,
    pub(crate) frames: Vec<BodyId>, // bodies, then nodes
    // of all frames: body components → principal components: its transpose
    pub(crate) principal: Vec<Matrix3<f64>>,
    pub(crate) joints: BTreeMap<&'a str, (&'a Joint, JointId)>,
    pub(crate) outside: &'a ExternalActions,
}

impl Names<'_> {
    /// A body, or a node of a beam.
    pub(crate) fn index(&self, name: &str) -> Option<usize> {
        let node = || name.contains('.').then(|| self.model.frame(name)).flatten();
        self.bodies.get(name).copied().or_else(node)
    }

    /// A body, a node of a beam, or the ground.
    pub(crate) fn frame(&self, name: &str) -> FrameId {
        self.index(name).map_or(FrameId::Ground, |k| self.frames[k].into())
    }

    /// A body, or a node of a beam.
    pub(crate) fn body(&self, name: &str) -> Option<BodyId> {
        self.index(name).map(|k| self.frames[k])
    }

    /// A point of a member by its own components; of the ground in space.
    pub(crate) fn point(&self, name: &str, components: [f64; 3]) -> PointOn {
        match (self.index(name), self.particles.get(name)) {
            (Some(k), _) => self.frames[k].point(components),
            (_, Some(&particle)) => particle.into(),
            _ => components.into(),
        }
    }

    /// What acts on the coordinates of a joint beside laws and inputs.
    pub(crate) fn elements(&self, joint: &Joint, times: &mut TimeFunctions<'_>) -> Vec<JointDrive> {
        joint_elements(joint, self.outside.setpoint(joint), times)
    }

    /// A joint of the model.
    pub(crate) fn joint(&self, name: &str) -> Option<(&Joint, JointId)> {
        self.joints.get(name).copied()
    }
}
