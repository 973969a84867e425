//! From bodies to the sections of a model file.

use std::collections::BTreeMap;

use holonom_model::{
    Body, Header, History, Inertia, Joint, JointDamper, JointFriction, JointKind, JointLimits,
    JointMotor, JointSpring, Limits, Model, MotionPath, Settings,
};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

use crate::ImportOptions;
use crate::contact::{planes, shapes};
use crate::drafter::{Draft, Drafter};
use crate::loops::between;
use crate::mass::{ImportedMass, ROUNDED};
use crate::massless::{nothing_moves, some};
use crate::names::TakenNames;
use crate::numbers::{plain, quaternion, vector};
use crate::picture::{finest, is_about, part, shape};
use crate::remark::{FAR, Remarks};
use crate::robot::{Mobility, Robot, Servo, ServoElasticity};
use crate::self_contact::body_pairs;
use crate::solid::PlacedSolid;
use crate::source::{Refusal, Result};
use crate::surface::BodyPairs;
use crate::tree::BodyTree;
use crate::tree_body::{Connection, TreeBody};

/// The model of a robot.
pub(crate) fn draft(
    robot: &Robot,
    tree: &BodyTree,
    options: &ImportOptions,
    remarks: &mut Remarks,
) -> std::result::Result<Draft, Vec<Refusal>> {
    let mut names = TakenNames::default();
    let bodies = tree.nodes.iter().map(|n| names.unique(&n.name, "body")).collect();
    let draft =
        Draft { model: empty(robot, options), on_bodies: Vec::new(), on_joints: Vec::new() };
    let mut drafter = Drafter {
        tree,
        names,
        bodies,
        frames: vec![Isometry3::identity(); tree.nodes.len()],
        joints: BTreeMap::new(),
        starts: BTreeMap::new(),
        lengths: BTreeMap::new(),
        finest: finest(tree, remarks),
        planes: match options.contacts {
            true => planes(robot, &tree.nodes, remarks),
            false => Vec::new(),
        },
        body_pairs: match options.contacts {
            true => body_pairs(robot, tree, remarks),
            false => BodyPairs::new(),
        },
        draft,
    };
    let masses: Vec<_> = tree.nodes.iter().map(|node| possible(node, remarks)).collect();
    let faults: Vec<Refusal> = masses.iter().filter_map(|m| m.clone().err()).collect();
    if !faults.is_empty() {
        return Err(faults);
    }
    let masses: Vec<ImportedMass> = masses.into_iter().filter_map(Result::ok).collect();
    for (k, mass) in masses.iter().enumerate().filter(|(k, _)| !tree.nodes[*k].absent) {
        drafter.body(k, mass);
    }
    if drafter.draft.model.bodies.is_empty() {
        return Err(vec![nothing_moves(robot, options)]);
    }
    (0..tree.nodes.len()).for_each(|k| drafter.joint(k, remarks));
    robot.loops.iter().for_each(|l| drafter.closure(l, remarks));
    robot.gears.iter().for_each(|gear| drafter.gear(gear, remarks));
    robot.tendons.iter().for_each(|tendon| drafter.tendon(tendon, remarks));
    robot.gauges.iter().for_each(|gauge| drafter.sensor(gauge, remarks));
    drafter.contacts(remarks);
    drafter.self_contacts(remarks);
    drafter.contact_remarks(remarks);
    (0..tree.nodes.len()).for_each(|k| drafter.armature(k, options.armature, remarks));
    if !robot.shapes_without_mass.is_empty() {
        remarks.of_all(format!(
            "geometry of links without <inertial>: no mass ({}); `--density RHO` gives it one",
            some(&robot.shapes_without_mass)
        ));
    }
    Ok(drafter.draft)
}

fn empty(robot: &Robot, options: &ImportOptions) -> Model {
    let header = Header {
        name: if robot.name.trim().is_empty() { "robot".into() } else { robot.name.clone() },
        description: None,
        dimension: 3,
        gravity: robot.gravity.iter().copied().map(plain).collect(),
    };
    Model::without_parts(header, Settings::new(options.step.unwrap_or(robot.step), options.end))
}

/// The mass properties of a body, if there can be such a body.
fn possible(node: &TreeBody, remarks: &mut Remarks) -> Result<ImportedMass> {
    let least = if node.absent { 0.0 } else { node.mass.least_euler_moment() };
    if least >= -1e-10 {
        return Ok(node.mass);
    }
    if least >= -ROUNDED {
        let message = "moments of inertia that violate I1 + I2 >= I3 by at most 2 %, as rounded numbers do: raised to the nearest possible ones";
        remarks.mention(message, format!("link \"{}\"", node.name), &node.place);
        return Ok(node.mass.nearest_body());
    }
    let [a, b, c] = node.mass.moments();
    let message = format!(
        "no body has the moments of inertia of link `{}`: {c:?} > {a:?} + {b:?}",
        node.name.escape_debug()
    );
    let help = "correct its inertia: it is about the centre of mass, in kg·m², and satisfies I1 + I2 >= I3; or let `--repair-inertia` replace it by a possible one";
    Err(Refusal::at(&node.place, message, help))
}

impl Drafter<'_> {
    fn body(&mut self, k: usize, mass: &ImportedMass) {
        let node = &self.tree.nodes[k];
        let coarse = |placed: &PlacedSolid| PlacedSolid {
            mesh: placed.mesh.clone().filter(|mesh| mesh.count <= self.finest),
            ..placed.clone()
        };
        let solids: Vec<PlacedSolid> = node.solids.iter().map(coarse).collect();
        let shown: Vec<&PlacedSolid> = solids.iter().filter(|p| p.is_shown()).collect();
        let largest = shown.iter().max_by(|a, b| a.solid.volume().total_cmp(&b.solid.volume()));
        let axes = largest.filter(|p| p.mesh.is_none());
        let axes = axes.map_or(UnitQuaternion::identity(), |p| p.pose.rotation);
        let to_axes = Isometry3::from_parts(Vector3::zeros().into(), axes.inverse());
        let to_body =
            to_axes * Isometry3::translation(-mass.center.x, -mass.center.y, -mass.center.z);
        let alone = match shown[..] {
            [placed] if placed.mesh.is_some() || is_about(placed, &mass.center) => Some(placed),
            _ => None,
        };
        let pose = node.pose;
        let position = pose.transform_point(&mass.center.into()).coords;
        self.frames[k] = Isometry3::from_parts(position.into(), pose.rotation * axes);
        let quaternion = quaternion(&(pose.rotation * axes));
        self.draft.model.bodies.push(Body {
            name: self.bodies[k].clone(),
            mass: Some(mass.mass),
            inertia: Some(inertia(&mass.moved(&to_axes).inertia())),
            position: vector(&position),
            quaternion: quaternion[1..].iter().any(|c| *c != 0.0).then_some(quaternion),
            shape: alone.map(|placed| shape(placed, &to_body)),
            picture: match alone {
                Some(_) => Vec::new(),
                None => shown.iter().map(|placed| part(placed, &to_body)).collect(),
            },
            collision: shapes(self.touching(k), &to_body),
            ..Body::default()
        });
        self.draft.on_bodies.push(comment(node, &self.bodies[k]));
    }

    fn joint(&mut self, k: usize, remarks: &mut Remarks) {
        let node = &self.tree.nodes[k];
        let Connection::Joint { joint, axis, point } = &node.connection else { return };
        if node.absent {
            return;
        }
        let name = self.names.unique(&joint.name, "joint");
        let rest = joint.rest - joint.reference - joint.value;
        let (kind, freedom) = match joint.kind {
            Mobility::Hinge => (JointKind::Revolute, 0),
            Mobility::Slide => (JointKind::Prismatic, 0),
            Mobility::Ball => (JointKind::Spherical, 0),
            Mobility::Planar => (JointKind::Planar, 2),
        };
        let label = || format!("joint \"{}\"", joint.name);
        let ball = joint.kind == Mobility::Ball;
        let elastic = ServoElasticity {
            stiffness: joint.stiffness,
            damping: joint.damping,
            rest: [plain(rest); 2],
        };
        let acts = |amounts: [f64; 3]| amounts[0] > 0.0 && !ball;
        let start = joint.reference + joint.value;
        let limits = joint.limits.map(|own| own.map(|limit| plain(limit - start)));
        let holds = limits[0].is_none_or(|x| x <= 0.0) && limits[1].is_none_or(|x| x >= 0.0);
        if !holds {
            remarks.mention(crate::remark::LIMITS_AT_START, label(), &joint.place);
        }
        let limits = match limits {
            [None, None] => None,
            [Some(lower), Some(upper)] => Some(Limits::Both([lower, upper])),
            [lower, upper] => {
                Some(Limits::Table(JointLimits { lower, upper, ..JointLimits::default() }))
            }
        };
        let single = joint.kind.is_single();
        let effort = Some(joint.friction).filter(|_| single && joint.friction > 0.0);
        let [torque, force] = match joint.kind {
            Mobility::Slide => [None, effort],
            _ => [effort, None],
        };
        let friction = JointFriction { torque, force, ..JointFriction::default() };
        let parent = node.parent.map_or_else(|| "ground".to_owned(), |p| self.bodies[p].clone());
        let child = self.bodies[k].clone();
        self.draft.model.joints.push(Joint {
            axis: kind.has_axis().then(|| vector(axis)),
            spring: acts(joint.stiffness).then_some(JointSpring {
                table: None,
                freedom,
                stiffness: joint.stiffness[0],
                rest: plain(rest),
            }),
            damper: acts(joint.damping)
                .then_some(JointDamper { freedom, damping: joint.damping[0] }),
            motor: motor(joint),
            limits: limits.filter(|_| holds),
            friction: effort.map(|_| friction),
            ..between(name.clone(), kind, parent, child, *point)
        });
        let mut comment = renamed(&joint.name, &name);
        if start != 0.0 {
            comment += &format!("0 here is {start} in the description. ");
        }
        self.draft.on_joints.push(comment);
        match ball {
            true if elastic.is_bent() => {
                let message =
                    "nonlinear springs and dampers of ball joints: their linear parts only";
                remarks.mention(message, label(), &joint.place);
                self.around_ball(&name, &elastic);
            }
            true => self.around_ball(&name, &elastic),
            false => self.beyond_linear(&name, freedom, &elastic),
        }
        self.starts.entry(joint.name.clone()).or_insert(start);
        self.joints.entry(joint.name.clone()).or_insert(name);
    }
}

/// The servo of a joint of one coordinate.
fn motor(joint: &crate::robot::RobotJoint) -> Option<JointMotor> {
    let Servo { effort, proportional, derivative } = joint.servo;
    let start = joint.reference + joint.value;
    // an effort beside a gain is another set point
    let set_point = effort / proportional;
    let [effort, offset] = match proportional > 0.0 {
        true if set_point.abs() < FAR => [0.0, set_point - start],
        true => [effort, -start],
        false => [effort, 0.0],
    };
    (joint.servo != Servo::default()).then(|| JointMotor {
        freedom: 0,
        effort: plain(effort),
        history: History::default(),
        proportional,
        derivative,
        path: MotionPath { offset: plain(offset), ..MotionPath::default() },
    })
}

fn comment(node: &TreeBody, name: &str) -> String {
    let mut text = renamed(&node.name, name);
    if !node.welded.is_empty() {
        text += &format!("With the links welded to it: {}. ", node.welded.join(", "));
    }
    if let Some(note) = &node.note {
        text += note;
    }
    text
}

fn renamed(description: &str, model: &str) -> String {
    if description == model {
        String::new()
    } else {
        format!("\"{description}\" in the description. ")
    }
}

/// Principal moments where the tensor is diagonal to round-off.
fn inertia(tensor: &Matrix3<f64>) -> Inertia {
    let size = tensor.amax();
    let diagonal = (0..3).all(|i| (0..i).all(|j| tensor[(i, j)].abs() <= 1e-15 * size));
    let entry = |i: usize, j: usize| {
        let value = tensor[(i, j)];
        if i != j && value.abs() <= 1e-17 * size { 0.0 } else { plain(value) }
    };
    if diagonal {
        let floor = |x: f64| if x.abs() <= 1e-14 * size { 0.0 } else { x };
        return Inertia::Principal([0, 1, 2].map(|i| floor(tensor[(i, i)])));
    }
    Inertia::Tensor([0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j))))
}
