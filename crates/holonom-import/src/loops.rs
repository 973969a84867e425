//! What connects joints and bodies beside the tree: loops, gears, armatures.

use holonom_model::{Body, Constraint, Inertia, Joint, JointKind, MotionPath};
use nalgebra::{Isometry3, Vector3};

use crate::drafter::Drafter;
use crate::numbers::{plain, vector};
use crate::remark::Remarks;
use crate::robot::{Gear, LoopJoint, LoopJointKind};
use crate::tree_body::Connection;

/// Ends of a loop that are farther apart initially are brought together at the start of a run; m or
/// rad.
const CLOSED: f64 = 1e-8;

/// Radius of gyration of the rotor of an armature, m.
const GYRATION: f64 = 0.1;

impl Drafter<'_> {
    /// The armature of each coordinate of a joint as a rotor that turns about a fixed axis, geared
    /// to it: `½ a q̇²`. Of a slide it turns by 1 rad per m.
    pub(crate) fn armature(&mut self, k: usize, wanted: bool, remarks: &mut Remarks) {
        let Connection::Joint { joint, .. } = &self.tree.nodes[k].connection else { return };
        let Some(of) = self.joints.get(&joint.name).cloned() else { return };
        for (freedom, inertia) in joint.armature.into_iter().enumerate() {
            if inertia == 0.0 || self.tree.nodes[k].absent {
                continue;
            }
            let message = match wanted {
                true => {
                    "armature: a rotor about a fixed axis at the origin for each joint, geared to it, has the same kinetic energy ½ a q̇²"
                }
                false => "armature: left out",
            };
            remarks.mention(message, format!("joint \"{}\"", joint.name), &joint.place);
            if wanted {
                self.rotor(&of, freedom, inertia);
            }
        }
    }

    /// A body that turns with a coordinate of a joint of the model.
    fn rotor(&mut self, joint: &str, freedom: usize, inertia: f64) {
        let rotor = self.names.unique(&format!("{joint}_rotor"), "body");
        let bearing = self.names.unique(&format!("{rotor}_bearing"), "joint");
        let name = self.names.unique(&format!("{joint}_armature"), "gear");
        let draft = &mut self.draft;
        draft.model.bodies.push(Body {
            name: rotor.clone(),
            mass: Some(inertia / (GYRATION * GYRATION)),
            inertia: Some(Inertia::Principal([inertia; 3])),
            visible: Some(false),
            ..Body::default()
        });
        draft.on_bodies.push(format!("The armature of joint `{joint}`."));
        let kind = JointKind::Revolute;
        draft.model.joints.push(Joint {
            axis: Some([0.0, 0.0, 1.0]),
            ..between(bearing.clone(), kind, "ground".to_owned(), rotor, Vector3::zeros())
        });
        draft.on_joints.push(String::new());
        draft.model.constraints.push(Constraint::Gear {
            name,
            joints: [bearing, joint.to_owned()],
            freedoms: [0, freedom],
            ratio: -1.0,
        });
    }

    /// A joint that closes a loop.
    pub(crate) fn closure(&mut self, closure: &LoopJoint, remarks: &mut Remarks) {
        let bodies = closure.ends.map(|end| end.and_then(|link| self.tree.body_of[link]));
        let poses = closure.ends.map(|end| self.tree.pose_of(end));
        if bodies[0] == bodies[1] {
            let message = "both sides are one body: the constraint holds anyway";
            remarks.mention(message, closure.name.clone(), &closure.place);
            return;
        }
        let points = [0, 1].map(|k| (poses[k] * closure.frames[k]).translation.vector);
        let order = if bodies[1].is_some() { [0, 1] } else { [1, 0] };
        let [parent, child] = order
            .map(|k| bodies[k].map_or_else(|| "ground".to_owned(), |b| self.bodies[b].clone()));
        let kind = match closure.kind {
            LoopJointKind::Spherical => JointKind::Spherical,
            LoopJointKind::Revolute => JointKind::Revolute,
            LoopJointKind::Prismatic => JointKind::Prismatic,
            LoopJointKind::Fixed => JointKind::Fixed,
        };
        let name = self.names.unique(&closure.name, "loop");
        let mut joint = Joint {
            axis: kind.has_axis().then(|| vector(&(poses[0] * closure.axis.into_inner()))),
            cut: true,
            ..between(name, kind, parent, child, points[0])
        };
        let distance = (points[1] - points[0]).norm();
        if distance > CLOSED {
            let message = format!(
                "a loop that is open by {distance:.3e} m initially: a run closes it at its start (`project_start`)"
            );
            remarks.mention(message, closure.name.clone(), &closure.place);
            self.draft.model.settings.project_start = true;
            let [of_parent, of_child] = order.map(|k| {
                let frame = bodies[k].map_or_else(Isometry3::identity, |b| self.frames[b]);
                Some(vector(&frame.inverse_transform_point(&points[k].into()).coords))
            });
            (joint.position, joint.anchor_parent, joint.anchor_child) = (None, of_parent, of_child);
        }
        self.draft.model.joints.push(joint);
        self.draft.on_joints.push("Closes a loop. ".to_owned());
    }

    pub(crate) fn gear(&mut self, gear: &Gear, remarks: &mut Remarks) {
        let model_name = |name: &str| self.joints.get(name).cloned();
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

/// A joint without axis, spring and motor.
pub(crate) fn between(
    name: String,
    kind: JointKind,
    parent: String,
    child: String,
    point: Vector3<f64>,
) -> Joint {
    Joint {
        name,
        kind,
        parent,
        child,
        position: Some(vector(&point)),
        anchor_parent: None,
        anchor_child: None,
        axis: None,
        axis2: None,
        first_axis: None,
        relative_to: None,
        rate: None,
        cut: false,
        pitch: None,
        spring: None,
        damper: None,
        motor: None,
        limits: None,
        bumper: None,
        friction: None,
    }
}
