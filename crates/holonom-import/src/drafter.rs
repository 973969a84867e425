//! A model that grows, part by part.

use std::collections::BTreeMap;

use holonom_model::Model;
use nalgebra::Isometry3;

use crate::names::TakenNames;
use crate::surface::{BodyPairs, GroundPlane};
use crate::tree::BodyTree;

/// A model with the comments of its text.
#[derive(Debug)]
pub(crate) struct Draft {
    pub(crate) model: Model,
    /// Above each body.
    pub(crate) on_bodies: Vec<String>,
    /// Above each joint.
    pub(crate) on_joints: Vec<String>,
}

/// A model that grows.
pub(crate) struct Drafter<'a> {
    pub(crate) tree: &'a BodyTree,
    pub(crate) names: TakenNames,
    /// Of each node the name of its body.
    pub(crate) bodies: Vec<String>,
    /// Of each node the frame of its body in space, initially.
    pub(crate) frames: Vec<Isometry3<f64>>,
    /// Names of joints, in the description and in the model.
    pub(crate) joints: BTreeMap<String, String>,
    /// Of each joint, by its name in the description, the coordinate there where it is 0 here.
    pub(crate) starts: BTreeMap<String, f64>,
    /// Of each tendon expressions of its length and of the rate of that.
    pub(crate) lengths: BTreeMap<String, [String; 2]>,
    /// Meshes with more triangles are drawn as the box around them.
    pub(crate) finest: usize,
    /// Planes of the ground that bodies touch.
    pub(crate) planes: Vec<GroundPlane>,
    /// Bodies that touch one another.
    pub(crate) body_pairs: BodyPairs,
    pub(crate) draft: Draft,
}
