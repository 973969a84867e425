//! A body of the model, before it is written.

use nalgebra::{Isometry3, Vector3};

use crate::mass::ImportedMass;
use crate::robot::RobotJoint;
use crate::solid::PlacedSolid;
use crate::source::FilePlace;
use crate::surface::TouchingSolid;

/// A body of the model.
#[derive(Clone, Debug)]
pub(crate) struct TreeBody {
    pub(crate) name: String,
    /// `None`: the ground.
    pub(crate) parent: Option<usize>,
    pub(crate) connection: Connection,
    /// Pose of its frame in space, initially.
    pub(crate) pose: Isometry3<f64>,
    /// In its frame.
    pub(crate) mass: ImportedMass,
    /// In its frame.
    pub(crate) solids: Vec<PlacedSolid>,
    /// In its frame.
    pub(crate) touching: Vec<TouchingSolid>,
    /// Links welded to it.
    pub(crate) welded: Vec<String>,
    /// Where its mass comes from, if not from the description.
    pub(crate) note: Option<String>,
    pub(crate) place: FilePlace,
    /// It is left out: nothing has mass there.
    pub(crate) absent: bool,
}

/// How a body hangs on the one before it.
#[derive(Clone, Debug)]
pub(crate) enum Connection {
    /// It moves freely.
    Free,
    /// By a joint whose axis and point are given in space, initially.
    Joint { joint: Box<RobotJoint>, axis: Vector3<f64>, point: Vector3<f64> },
}
