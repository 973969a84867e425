//! What both formats describe: a tree of links, each with its joints to the link before it.

use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

use crate::mass::Mass;
use crate::solid::Placed;
use crate::source::Place;

/// A robot.
#[derive(Debug)]
pub(crate) struct Robot {
    pub(crate) name: String,
    /// Name of the format.
    pub(crate) format: &'static str,
    /// m/s².
    pub(crate) gravity: Vector3<f64>,
    /// Time step, s.
    pub(crate) step: f64,
    /// A link stands after its parent.
    pub(crate) links: Vec<Link>,
    pub(crate) loops: Vec<Closure>,
    pub(crate) gears: Vec<Gear>,
}

/// A link.
#[derive(Clone, Debug)]
pub(crate) struct Link {
    pub(crate) name: String,
    /// `None`: the ground.
    pub(crate) parent: Option<usize>,
    /// Pose of its frame in that of the parent, all joints at zero.
    pub(crate) frame: Isometry3<f64>,
    /// It moves freely; then it has no joints.
    pub(crate) free: bool,
    /// Joints to the parent, that at the parent first; without any it is welded to the parent.
    pub(crate) joints: Vec<Joint>,
    /// In its frame.
    pub(crate) mass: Mass,
    /// In its frame.
    pub(crate) solids: Vec<Placed>,
    pub(crate) place: Place,
}

/// Kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Hinge,
    Slide,
    Ball,
    Planar,
}

/// A joint of a link.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    /// Axis, or normal of the plane, in the frame of the link.
    pub(crate) axis: Unit<Vector3<f64>>,
    /// Its point in the frame of the link, m.
    pub(crate) anchor: Vector3<f64>,
    /// The coordinate in the drawn configuration, m or rad.
    pub(crate) reference: f64,
    /// Displacement from the drawn configuration initially, m or rad.
    pub(crate) value: f64,
    /// N·s/m or N·m·s/rad.
    pub(crate) damping: f64,
    /// N/m or N·m/rad.
    pub(crate) stiffness: f64,
    /// The coordinate without spring force, m or rad.
    pub(crate) rest: f64,
    pub(crate) place: Place,
}

/// Two links held together beside the tree.
#[derive(Clone, Debug)]
pub(crate) struct Closure {
    pub(crate) name: String,
    /// Links; `None`: the ground.
    pub(crate) ends: [Option<usize>; 2],
    /// The common point in the frame of either link, m.
    pub(crate) points: [Vector3<f64>; 2],
    /// Whether all relative motion is held, not the point alone.
    pub(crate) weld: bool,
    pub(crate) place: Place,
}

/// The displacement of a joint is `offset + factor ×` that of another, or constant.
#[derive(Clone, Debug)]
pub(crate) struct Gear {
    pub(crate) name: String,
    pub(crate) joint: String,
    /// `None`: the joint is held.
    pub(crate) of: Option<String>,
    pub(crate) offset: f64,
    pub(crate) factor: f64,
    pub(crate) place: Place,
}

impl Robot {
    /// The joint of this name, to change it.
    pub(crate) fn joint_mut(&mut self, name: &str) -> Option<&mut Joint> {
        self.links.iter_mut().flat_map(|l| &mut l.joints).find(|j| j.name == name)
    }
}

impl Joint {
    /// The pose of the link behind the joint, from that before it.
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let value = self.value;
        match self.kind {
            Kind::Hinge if value != 0.0 => {
                let anchor = pose.transform_point(&self.anchor.into()).coords;
                let rotation = pose.rotation * UnitQuaternion::from_axis_angle(&self.axis, value);
                let translation = anchor - rotation * self.anchor;
                Isometry3::from_parts(translation.into(), rotation)
            }
            Kind::Slide => {
                let shift = pose.rotation * self.axis.into_inner() * value;
                Isometry3::from_parts((pose.translation.vector + shift).into(), pose.rotation)
            }
            Kind::Hinge | Kind::Ball | Kind::Planar => *pose,
        }
    }
}
