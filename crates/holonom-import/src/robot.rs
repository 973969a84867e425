//! What both formats describe: a tree of links, each with its joints to the link before it.

use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

use holonom_model::{SensorKind, nearest};

use crate::Close;
use crate::mass::ImportedMass;
use crate::solid::PlacedSolid;
use crate::source::{FilePlace, Refusal, Result, SourceText};
use crate::surface::{Exclusion, GeomPair, GroundPlane, TouchingSolid};

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
    pub(crate) links: Vec<RobotLink>,
    pub(crate) loops: Vec<LoopJoint>,
    pub(crate) gears: Vec<Gear>,
    pub(crate) gauges: Vec<RobotSensor>,
    pub(crate) tendons: Vec<Tendon>,
    /// Places that have a name.
    pub(crate) frames: Vec<NamedFrame>,
    /// Files of geometries that could not be read.
    pub(crate) unread: Vec<Unread>,
    /// Planes of the ground that bodies may touch.
    pub(crate) planes: Vec<GroundPlane>,
    /// Links that do not touch.
    pub(crate) exclusions: Vec<Exclusion>,
    /// Geometry that touches.
    pub(crate) geom_pairs: Vec<GeomPair>,
    /// Links with geometry and without mass.
    pub(crate) shapes_without_mass: Vec<String>,
}

/// A place that the description names.
#[derive(Clone, Debug)]
pub(crate) struct NamedFrame {
    pub(crate) name: String,
    /// Its link; `None`: the ground.
    pub(crate) link: Option<usize>,
    /// In the frame of the link.
    pub(crate) pose: Isometry3<f64>,
}

impl NamedFrame {
    /// The frame of a link.
    pub(crate) fn of_link(number: usize, link: &RobotLink) -> Self {
        Self { name: link.name.clone(), link: Some(number), pose: Isometry3::identity() }
    }
}

/// The pose in space of what has `pose` in a link, each link `placed` in the one before it.
pub(crate) fn in_space(
    links: &[RobotLink],
    link: Option<usize>,
    pose: Isometry3<f64>,
    placed: impl Fn(&RobotLink) -> Isometry3<f64>,
) -> Isometry3<f64> {
    let (mut pose, mut at) = (pose, link);
    while let Some(link) = at.map(|link| &links[link]) {
        pose = placed(link) * pose;
        at = link.parent;
    }
    pose
}

/// A file that could not be read, and why.
#[derive(Clone, Debug)]
pub(crate) struct Unread {
    pub(crate) file: String,
    pub(crate) reason: String,
}

/// A link.
#[derive(Clone, Debug)]
pub(crate) struct RobotLink {
    pub(crate) name: String,
    /// `None`: the ground.
    pub(crate) parent: Option<usize>,
    /// Pose of its frame in that of the parent, all joints at zero.
    pub(crate) frame: Isometry3<f64>,
    /// It moves freely; then it has no joints.
    pub(crate) free: bool,
    /// Joints to the parent, that at the parent first; without any it is welded to the parent.
    pub(crate) joints: Vec<RobotJoint>,
    /// In its frame.
    pub(crate) mass: ImportedMass,
    /// In its frame.
    pub(crate) solids: Vec<PlacedSolid>,
    /// What touches others, in its frame.
    pub(crate) touching: Vec<TouchingSolid>,
    pub(crate) place: FilePlace,
}

/// Kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mobility {
    Hinge,
    Slide,
    Ball,
    Planar,
}

impl Mobility {
    /// Whether it has one coordinate.
    pub(crate) fn is_single(self) -> bool {
        matches!(self, Self::Hinge | Self::Slide)
    }
}

/// A joint of a link.
#[derive(Clone, Debug)]
pub(crate) struct RobotJoint {
    pub(crate) name: String,
    pub(crate) kind: Mobility,
    /// Axis, or normal of the plane, in the frame of the link.
    pub(crate) axis: Unit<Vector3<f64>>,
    /// Its point in the frame of the link, m.
    pub(crate) anchor: Vector3<f64>,
    /// The coordinate in the drawn configuration, m or rad.
    pub(crate) reference: f64,
    /// Displacement from the drawn configuration initially, m or rad.
    pub(crate) value: f64,
    /// Coefficients of [`ServoElasticity`]; N·s/m or N·m·s/rad.
    pub(crate) damping: [f64; 3],
    /// N/m or N·m/rad.
    pub(crate) stiffness: [f64; 3],
    /// The coordinate without spring force, m or rad.
    pub(crate) rest: f64,
    /// Lower and upper limit of its coordinate, m or rad.
    pub(crate) limits: [Option<f64>; 2],
    /// Dry friction, N or N·m.
    pub(crate) friction: f64,
    /// Inertia of each coordinate of its pair beside that of the links, kg or kg·m².
    pub(crate) armature: [f64; 3],
    pub(crate) servo: Servo,
    /// Whether a tendon reads its coordinate.
    pub(crate) in_tendon: bool,
    pub(crate) place: FilePlace,
}

/// A force along a length or an angle `l`: `effort − proportional l − derivative l̇`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Servo {
    /// N or N·m.
    pub(crate) effort: f64,
    /// N/m or N·m/rad.
    pub(crate) proportional: f64,
    /// N·s/m or N·m·s/rad.
    pub(crate) derivative: f64,
}

impl Servo {
    pub(crate) fn plus(self, other: Self) -> Self {
        Self {
            effort: self.effort + other.effort,
            proportional: self.proportional + other.proportional,
            derivative: self.derivative + other.derivative,
        }
    }
}

/// A force along a length beside its servo, with the elongation `e` beyond a rest:
/// `−k_0 e − k_1 e² − k_2 e³ − c_0 l̇ − c_1 l̇ |l̇| − c_2 l̇³`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ServoElasticity {
    pub(crate) stiffness: [f64; 3],
    pub(crate) damping: [f64; 3],
    /// No elongation in between, m or rad.
    pub(crate) rest: [f64; 2],
}

/// A length that forces act along.
#[derive(Clone, Debug)]
pub(crate) struct Tendon {
    pub(crate) name: String,
    pub(crate) path: LengthPath,
    pub(crate) elastic: ServoElasticity,
    pub(crate) servo: Servo,
    /// Whether a sensor reads it.
    pub(crate) is_read: bool,
    /// Kind and name in the description.
    pub(crate) label: String,
    pub(crate) place: FilePlace,
}

/// What a length is of.
#[derive(Clone, Debug)]
pub(crate) enum LengthPath {
    /// A sum of coordinates of joints of one coordinate with their coefficients.
    Joints(Vec<(String, f64)>),
    /// A sum of distances with their coefficients.
    Points(Vec<([NamedFrame; 2], f64)>),
    /// No counterpart.
    Other,
}

/// Two links held together beside the tree.
#[derive(Clone, Debug)]
pub(crate) struct LoopJoint {
    pub(crate) name: String,
    /// Links; `None`: the ground.
    pub(crate) ends: [Option<usize>; 2],
    /// The common place in the frame of either link.
    pub(crate) frames: [Isometry3<f64>; 2],
    /// In the frame of the first link, for kinds that have one.
    pub(crate) axis: Unit<Vector3<f64>>,
    pub(crate) kind: LoopJointKind,
    pub(crate) place: FilePlace,
}

/// What closes a loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LoopJointKind {
    /// A common point.
    #[default]
    Spherical,
    /// A common point and axis.
    Revolute,
    /// Translation along the axis is left.
    Prismatic,
    /// No relative motion is left.
    Fixed,
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
    pub(crate) place: FilePlace,
}

/// A sensor.
#[derive(Clone, Debug)]
pub(crate) struct RobotSensor {
    pub(crate) name: String,
    pub(crate) kind: SensorKind,
    pub(crate) of: GaugeOf,
    /// Kind and name in the description.
    pub(crate) label: String,
    pub(crate) place: FilePlace,
}

/// What a sensor is of.
#[derive(Clone, Debug)]
pub(crate) enum GaugeOf {
    Joint(String),
    Frame(NamedFrame),
    /// Its length, or the rate of that.
    Tendon(String),
}

impl GaugeOf {
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Joint(name) | Self::Tendon(name) => name,
            Self::Frame(frame) => &frame.name,
        }
    }
}

impl Robot {
    /// Adds loops between places that have a name.
    pub(crate) fn close(&mut self, loops: &[Close], file: &SourceText) -> Result<()> {
        for Close { ends, kind } in loops {
            let find = |name: &String| {
                let found = self.frames.iter().find(|frame| frame.name == *name);
                found.ok_or_else(|| {
                    let message =
                        format!("`--close`: there is no link or frame `{}`", name.escape_debug());
                    let known = self.frames.iter().map(|frame| frame.name.as_str());
                    let help = match nearest(name, known) {
                        Some(best) => format!("did you mean `{}`?", best.escape_debug()),
                        None => "name two links, bodies or sites of the description".to_owned(),
                    };
                    Refusal::of_all(message, help)
                })
            };
            let [a, b] = [find(&ends[0])?, find(&ends[1])?];
            self.loops.push(LoopJoint {
                name: format!("{}_{}", ends[0], ends[1]),
                ends: [a.link, b.link],
                frames: [a.pose, b.pose],
                axis: Unit::new_unchecked(a.pose.rotation * Vector3::z()),
                kind: *kind,
                place: FilePlace { file: 0, span: 0..file.text.len().min(1) },
            });
        }
        Ok(())
    }

    /// The joint of this name, to change it.
    pub(crate) fn joint_mut(&mut self, name: &str) -> Option<&mut RobotJoint> {
        self.links.iter_mut().flat_map(|l| &mut l.joints).find(|j| j.name == name)
    }
}

impl RobotJoint {
    /// The pose of the link behind the joint, from that before it.
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        self.moved_by(pose, self.value)
    }

    /// The same at another displacement from the drawn configuration, m or rad.
    pub(crate) fn moved_by(&self, pose: &Isometry3<f64>, value: f64) -> Isometry3<f64> {
        match self.kind {
            Mobility::Hinge if value != 0.0 => {
                let anchor = pose.transform_point(&self.anchor.into()).coords;
                let rotation = pose.rotation * UnitQuaternion::from_axis_angle(&self.axis, value);
                let translation = anchor - rotation * self.anchor;
                Isometry3::from_parts(translation.into(), rotation)
            }
            Mobility::Slide => {
                let shift = pose.rotation * self.axis.into_inner() * value;
                Isometry3::from_parts((pose.translation.vector + shift).into(), pose.rotation)
            }
            Mobility::Hinge | Mobility::Ball | Mobility::Planar => *pose,
        }
    }
}
