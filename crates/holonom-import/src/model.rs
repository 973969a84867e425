//! From bodies to the sections of a model file.

use holonom_model::{
    Body, Constraint, Header, Inertia, Joint, JointDamper, JointKind, JointSpring, Model,
    MotionPath, Scale, Settings, Shape, ShapeKind,
};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

use crate::Options;
use crate::mass::Mass;
use crate::names::Names;
use crate::remark::Remarks;
use crate::robot::{Closure, Gear, Kind, Robot};
use crate::solid::{Placed, Solid};
use crate::source::{Fault, Result};
use crate::tree::{Connection, Node, Tree};

/// A model with the comments of its text.
#[derive(Debug)]
pub(crate) struct Draft {
    pub(crate) model: Model,
    /// Above each body.
    pub(crate) on_bodies: Vec<String>,
    /// Above each joint.
    pub(crate) on_joints: Vec<String>,
}

/// Euler moments may be negative by this part of their sum, and are then raised to zero.
const ROUNDED: f64 = 0.01;

/// A solid is about the centre of mass where their distance is below this part of its size.
const CENTRED: f64 = 1e-9;

/// Largest distance of the ends of a loop initially, m or rad.
const CLOSED: f64 = 1e-8;

struct Drafter<'a> {
    tree: &'a Tree,
    names: Names,
    /// Of each node the name of its body.
    bodies: Vec<String>,
    /// Names of joints, in the description and in the model.
    joints: Vec<(String, String)>,
    draft: Draft,
}

/// The model of a robot.
pub(crate) fn draft(
    robot: &Robot,
    tree: &Tree,
    options: &Options,
    remarks: &mut Remarks,
) -> std::result::Result<Draft, Vec<Fault>> {
    let mut names = Names::default();
    let bodies = tree.nodes.iter().map(|n| names.unique(&n.name, "body")).collect();
    let draft =
        Draft { model: empty(robot, options), on_bodies: Vec::new(), on_joints: Vec::new() };
    let mut drafter = Drafter { tree, names, bodies, joints: Vec::new(), draft };
    let masses: Vec<_> = tree.nodes.iter().map(|node| possible(node, remarks)).collect();
    let faults: Vec<Fault> = masses.iter().filter_map(|m| m.clone().err()).collect();
    if !faults.is_empty() {
        return Err(faults);
    }
    let masses: Vec<Mass> = masses.into_iter().filter_map(Result::ok).collect();
    for (k, mass) in masses.iter().enumerate().filter(|(k, _)| !tree.nodes[*k].absent) {
        drafter.body(k, mass);
    }
    if drafter.draft.model.bodies.is_empty() {
        let message = "nothing with mass moves";
        let help = "state the mass of a link behind a joint; the root link of a URDF robot moves with --free-base";
        return Err(vec![Fault::of_all(message, help)]);
    }
    (0..tree.nodes.len()).for_each(|k| drafter.joint(k, remarks));
    robot.loops.iter().try_for_each(|l| drafter.closure(l, remarks)).map_err(|f| vec![f])?;
    robot.gears.iter().for_each(|gear| drafter.gear(gear, remarks));
    Ok(drafter.draft)
}

fn empty(robot: &Robot, options: &Options) -> Model {
    let header = Header {
        name: if robot.name.trim().is_empty() { "robot".into() } else { robot.name.clone() },
        description: None,
        dimension: 3,
        gravity: robot.gravity.iter().copied().map(plain).collect(),
    };
    Model::without_parts(header, Settings::new(options.step.unwrap_or(robot.step), options.end))
}

/// The mass properties of a body, if there can be such a body.
fn possible(node: &Node, remarks: &mut Remarks) -> Result<Mass> {
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
    let help = "correct its inertia: it is about the centre of mass, in kg·m², and satisfies I1 + I2 >= I3";
    Err(Fault::at(&node.place, message, help))
}

impl Drafter<'_> {
    fn body(&mut self, k: usize, mass: &Mass) {
        let node = &self.tree.nodes[k];
        let shown: Vec<&Placed> = node.solids.iter().filter(|p| p.is_shown()).collect();
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
            Kind::Hinge => (JointKind::Revolute, 0),
            Kind::Slide => (JointKind::Prismatic, 0),
            Kind::Ball => (JointKind::Spherical, 0),
            Kind::Planar => (JointKind::Planar, 2),
        };
        let label = || format!("joint \"{}\"", joint.name);
        let ball = joint.kind == Kind::Ball;
        if ball && (joint.damping != 0.0 || joint.stiffness != 0.0) {
            remarks.mention(
                "spring and damper of a ball joint: not translated",
                label(),
                &joint.place,
            );
        }
        let acts = |amount: f64| amount > 0.0 && !ball;
        let parent = node.parent.map_or_else(|| "ground".to_owned(), |p| self.bodies[p].clone());
        self.draft.model.joints.push(Joint {
            name: name.clone(),
            kind,
            parent,
            child: self.bodies[k].clone(),
            position: Some(vector(point)),
            anchor_parent: None,
            anchor_child: None,
            axis: kind.has_axis().then(|| vector(axis)),
            axis2: None,
            relative_to: None,
            rate: None,
            cut: false,
            pitch: None,
            spring: acts(joint.stiffness).then_some(JointSpring {
                freedom,
                stiffness: joint.stiffness,
                rest: plain(rest),
            }),
            damper: acts(joint.damping).then_some(JointDamper { freedom, damping: joint.damping }),
            motor: None,
        });
        let mut comment = renamed(&joint.name, &name);
        let start = joint.reference + joint.value;
        if start != 0.0 {
            comment += &format!("0 here is {start} in the description. ");
        }
        self.draft.on_joints.push(comment);
        self.joints.push((joint.name.clone(), name));
    }

    /// A joint that closes a loop.
    fn closure(&mut self, closure: &Closure, remarks: &mut Remarks) -> Result<()> {
        let bodies = closure.ends.map(|end| end.and_then(|link| self.tree.body_of[link]));
        let poses = closure.ends.map(|end| self.tree.pose_of(end));
        if bodies[0] == bodies[1] {
            let message = "both sides are one body: the constraint holds anyway";
            remarks.mention(message, closure.name.clone(), &closure.place);
            return Ok(());
        }
        let point = |k: usize| poses[k].transform_point(&closure.points[k].into()).coords;
        let distance = (point(1) - point(0)).norm();
        if distance > CLOSED {
            let message =
                format!("the two points of this constraint are {distance:.3e} m apart initially");
            let help = "state other initial values of the joints";
            return Err(Fault::at(&closure.place, message, help));
        }
        let side = |body: Option<usize>| {
            body.map_or_else(|| "ground".to_owned(), |b| self.bodies[b].clone())
        };
        let (parent, child) = if bodies[1].is_some() {
            (side(bodies[0]), side(bodies[1]))
        } else {
            (side(bodies[1]), side(bodies[0]))
        };
        let name = self.names.unique(&closure.name, "loop");
        self.draft.model.joints.push(Joint {
            name,
            kind: if closure.weld { JointKind::Fixed } else { JointKind::Spherical },
            parent,
            child,
            position: Some(vector(&point(0))),
            anchor_parent: None,
            anchor_child: None,
            axis: None,
            axis2: None,
            relative_to: None,
            rate: None,
            cut: true,
            pitch: None,
            spring: None,
            damper: None,
            motor: None,
        });
        self.draft.on_joints.push("Closes a loop. ".to_owned());
        Ok(())
    }

    fn gear(&mut self, gear: &Gear, remarks: &mut Remarks) {
        let model_name = |name: &str| {
            let found = self.joints.iter().find(|(description, _)| description == name);
            found.map(|(_, model)| model.clone())
        };
        let joint = model_name(&gear.joint);
        let of = gear.of.as_deref().map(model_name);
        let (Some(joint), true) = (joint, of != Some(None)) else {
            let message = "joints that are no joint of the model follow each other: not translated";
            remarks.mention(message, gear.name.clone(), &gear.place);
            return;
        };
        let name = self.names.unique(&gear.name, "gear");
        self.draft.model.constraints.push(match of.flatten() {
            Some(other) => Constraint::Gear {
                name,
                joints: [joint, other],
                freedoms: [0, 0],
                ratio: plain(-gear.factor),
            },
            None => Constraint::Motion { name, joint, freedom: 0, path: MotionPath::default() },
        });
    }
}

/// Whether a solid has its centre where that of the mass is.
fn is_about(placed: &Placed, center: &Vector3<f64>) -> bool {
    let apart = (placed.pose.translation.vector - center).norm();
    apart <= CENTRED * placed.solid.volume().cbrt()
}

/// The shape of a body; `to_body`: from the axes of the link to those of the body.
fn shape(placed: &Placed, to_body: &Isometry3<f64>) -> Shape {
    match &placed.mesh {
        None => placed.solid.shape(),
        Some(_) => part(placed, to_body),
    }
}

/// A shape of the picture of a body, at its place.
fn part(placed: &Placed, to_body: &Isometry3<f64>) -> Shape {
    let pose = to_body * placed.mesh.as_ref().map_or(&placed.pose, |mesh| &mesh.pose);
    let rounded = NOISE * placed.solid.volume().cbrt();
    let position = pose.translation.vector.map(|x| if x.abs() <= rounded { 0.0 } else { x });
    let position = vector(&position);
    let quaternion = quaternion(&pose.rotation);
    let is_ball = placed.mesh.is_none() && matches!(placed.solid, Solid::Sphere(_));
    let turned = !is_ball && quaternion[1..].iter().any(|c| *c != 0.0);
    let own = match &placed.mesh {
        None => placed.solid.shape(),
        Some(mesh) => Shape {
            kind: ShapeKind::Mesh,
            file: Some(mesh.file.clone()),
            scale: scale(&mesh.scale),
            ..Shape::default()
        },
    };
    Shape {
        position: position.iter().any(|x| *x != 0.0).then_some(position),
        quaternion: turned.then_some(quaternion),
        ..own
    }
}

fn scale(factors: &Vector3<f64>) -> Option<Scale> {
    match <[f64; 3]>::from(*factors) {
        [1.0, 1.0, 1.0] => None,
        [x, y, z] if [y, z].iter().all(|s| s.to_bits() == x.to_bits()) => Some(Scale::Uniform(x)),
        factors => Some(Scale::Axes(factors)),
    }
}

fn comment(node: &Node, name: &str) -> String {
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
        let floor = |x: f64| if x.abs() <= 1e-15 * size { 0.0 } else { x };
        return Inertia::Principal([0, 1, 2].map(|i| floor(tensor[(i, i)])));
    }
    Inertia::Tensor([0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j))))
}

/// Components of unit vectors below it are rounding errors.
const NOISE: f64 = 4e-16;

/// `[w, x, y, z]` with w >= 0.
fn quaternion(rotation: &UnitQuaternion<f64>) -> [f64; 4] {
    let q = rotation.quaternion();
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    [q.w, q.i, q.j, q.k].map(|c| if c.abs() <= NOISE { 0.0 } else { plain(sign * c) })
}

/// A vector without components at round-off of the largest one.
fn vector(v: &Vector3<f64>) -> [f64; 3] {
    let size = v.amax();
    [v.x, v.y, v.z].map(|c| if c.abs() <= NOISE * size { 0.0 } else { plain(c) })
}

/// Without the sign of zero.
fn plain(value: f64) -> f64 {
    value + 0.0
}
