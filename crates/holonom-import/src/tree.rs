//! From links to bodies: each body has one joint, welded links are one body, links without mass get
//! a rod.
//!
//! A link with several joints becomes several bodies, and so some bodies have no mass. Where a
//! neighbour beyond a hinge has mass, a rod on the axis of that hinge is transferred from it
//! ([`ImportedMass::rod`]), which does not change the motion.

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::mass::ImportedMass;
use crate::remark::Remarks;
use crate::repair::{repaired, short};
use crate::robot::{Mobility, Robot, RobotJoint, RobotLink, Servo};
use crate::source::{Refusal, Result};
use crate::tree_body::{Connection, TreeBody};

/// The bodies of a robot.
#[derive(Debug, Default)]
pub(crate) struct BodyTree {
    /// A body stands after its parent.
    pub(crate) nodes: Vec<TreeBody>,
    /// Of each link its body; `None`: the ground.
    pub(crate) body_of: Vec<Option<usize>>,
    /// Of each link the pose of its frame in that of its body; for the ground in space.
    pub(crate) pose_in_body: Vec<Isometry3<f64>>,
}

/// Where the mass of a body is not that of the description.
const RODS: &str = "mass of rods on the axis of a hinge, which moves the same on either side of it, was moved: masses and centres of mass of these bodies are not those of the description";

/// What a body gets of the mass behind it where none can be taken from its neighbours.
const SMALL: f64 = 1e-6;

impl BodyTree {
    /// The bodies of a robot, with masses.
    pub(crate) fn new(robot: &Robot, repair: bool, remarks: &mut Remarks) -> Result<Self> {
        let mut tree = Self::default();
        for link in &robot.links {
            tree.add(link, remarks);
        }
        if repair {
            tree.nodes.iter_mut().for_each(|node| repaired(node, remarks));
        }
        tree.leave_out_massless_ends(robot, remarks);
        tree.transfer_rods(remarks)?;
        Ok(tree)
    }

    /// The pose of the frame of a link in space.
    pub(crate) fn pose_of(&self, link: Option<usize>) -> Isometry3<f64> {
        let Some(link) = link else { return Isometry3::identity() };
        let body = self.body_of[link].map_or(Isometry3::identity(), |b| self.nodes[b].pose);
        body * self.pose_in_body[link]
    }

    fn add(&mut self, link: &RobotLink, remarks: &mut Remarks) {
        let parent = link.parent.and_then(|p| self.body_of[p]);
        if link.joints.is_empty() && !link.free {
            self.weld(link, parent, remarks);
            return;
        }
        let mut pose = self.pose_of(link.parent) * link.frame;
        let joints = self.pairs(link, parent, remarks);
        if joints.is_empty() {
            let moved = link.joints.iter().fold(pose, |pose, joint| joint.moved(&pose));
            self.push(link, None, Connection::Free, moved);
        }
        if joints.iter().any(|joint| joint.kind == Mobility::Planar) {
            pose = link.joints.iter().fold(pose, |pose, joint| joint.moved(&pose));
        }
        let mut before = parent;
        for (k, joint) in joints.iter().enumerate() {
            let axis = pose.rotation * joint.axis.into_inner();
            let point = pose.transform_point(&joint.anchor.into()).coords;
            pose = joint.moved(&pose);
            let connection = Connection::Joint { joint: Box::new(joint.clone()), axis, point };
            self.push(link, before, connection, pose);
            before = Some(self.nodes.len() - 1);
            let node = self.nodes.last_mut().expect("it was pushed");
            if k + 1 < joints.len() {
                node.name = format!("{}_{}", link.name, joint.name);
                node.mass = ImportedMass::default();
                node.solids.clear();
                node.touching.clear();
            }
        }
        self.body_of.push(Some(self.nodes.len() - 1));
        self.pose_in_body.push(Isometry3::identity());
    }

    fn push(
        &mut self,
        link: &RobotLink,
        parent: Option<usize>,
        connection: Connection,
        pose: Isometry3<f64>,
    ) {
        self.nodes.push(TreeBody {
            name: link.name.clone(),
            parent,
            connection,
            pose,
            mass: link.mass,
            solids: link.solids.clone(),
            touching: link.touching.clone(),
            welded: Vec::new(),
            note: None,
            place: link.place.clone(),
            absent: false,
        });
    }

    /// A link without joints belongs to the body of its parent.
    fn weld(&mut self, link: &RobotLink, body: Option<usize>, remarks: &mut Remarks) {
        let before = link.parent.map_or(Isometry3::identity(), |p| self.pose_in_body[p]);
        let pose = before * link.frame;
        match body {
            Some(body) => {
                let node = &mut self.nodes[body];
                node.mass = node.mass.plus(&link.mass.moved(&pose));
                node.solids.extend(link.solids.iter().map(|placed| placed.moved(&pose)));
                node.touching.extend(link.touching.iter().map(|own| own.moved(&pose)));
                node.welded.push(link.name.clone());
            }
            None => {
                let message = "fixed to the ground: no body, its mass plays no part";
                remarks.mention(message, format!("link \"{}\"", link.name), &link.place);
            }
        }
        self.body_of.push(body);
        self.pose_in_body.push(pose);
    }

    /// The joints of a link as pairs of the model file; none where they leave the link free.
    fn pairs(
        &self,
        link: &RobotLink,
        parent: Option<usize>,
        remarks: &mut Remarks,
    ) -> Vec<RobotJoint> {
        let joints = &link.joints;
        let alone = |j: &RobotJoint| j.servo != Servo::default() || j.in_tendon;
        if joints.iter().any(alone) {
            return joints.clone();
        }
        let plain = |j: &RobotJoint| [j.damping, j.stiffness] == [[0.0; 3]; 2];
        let of = |kind: Mobility| joints.iter().filter(move |j| j.kind == kind).collect::<Vec<_>>();
        let (hinges, slides, balls) =
            (of(Mobility::Hinge), of(Mobility::Slide), of(Mobility::Ball));
        let turns = independent(&hinges) && hinges.len() == 3 || balls.len() == 1;
        let count = joints.len() == 3 + hinges.len() + balls.len();
        let all_plain = joints.iter().all(plain);
        if parent.is_none() && turns && count && independent(&slides) && all_plain {
            self.say(link, "all its joints together: a free body", remarks);
            if joints.iter().any(|joint| joint.armature[0] != 0.0) {
                self.say(link, "armature of a free body: not translated", remarks);
            }
            return Vec::new();
        }
        let [a, b] = slides.as_slice() else { return joints.clone() };
        let (a, b) = (a.axis.into_inner(), b.axis.into_inner());
        let ([hinge], 3) = (hinges.as_slice(), joints.len()) else { return joints.clone() };
        let normal = a.cross(&b).norm() > 1e-6
            && a.dot(&hinge.axis).abs() < 1e-12
            && b.dot(&hinge.axis).abs() < 1e-12;
        // displacements along any two normal axes of the plane have the same armature
        let [s, t] = [slides[0].armature[0], slides[1].armature[0]];
        let alike = s == 0.0 && t == 0.0 || s.to_bits() == t.to_bits() && a.dot(&b).abs() < 1e-12;
        if !normal || !alike || !slides.iter().all(|j| plain(j)) {
            return joints.clone();
        }
        self.say(link, "two slides and a hinge normal to them: one planar pair", remarks);
        let name = joints.iter().map(|j| j.name.as_str()).collect::<Vec<_>>().join("_");
        let armature = [s, t, hinge.armature[0]];
        vec![RobotJoint { name, kind: Mobility::Planar, armature, ..(*hinge).clone() }]
    }

    fn say(&self, link: &RobotLink, message: &str, remarks: &mut Remarks) {
        remarks.mention(message, format!("link \"{}\"", link.name), &link.place);
    }

    /// Bodies without mass behind which there is none either take no part in the motion.
    fn leave_out_massless_ends(&mut self, robot: &Robot, remarks: &mut Remarks) {
        let held = robot.loops.iter().flat_map(|l| l.ends).flatten();
        let mut needed = vec![false; self.nodes.len()];
        held.filter_map(|link| self.body_of[link]).for_each(|body| needed[body] = true);
        for k in (0..self.nodes.len()).rev() {
            let node = &mut self.nodes[k];
            if node.mass.mass <= 0.0 && !needed[k] {
                node.absent = true;
                let message =
                    "without mass, and nothing with mass behind it: left out with its joint";
                remarks.mention(message, format!("link \"{}\"", node.name), &node.place);
            } else if let Some(parent) = node.parent {
                needed[parent] = true;
            }
        }
    }

    /// Gives bodies without mass or inertia a rod of a neighbour beyond a hinge.
    fn transfer_rods(&mut self, remarks: &mut Remarks) -> Result<()> {
        let mut children = vec![Vec::new(); self.nodes.len()];
        for (k, node) in self.nodes.iter().enumerate().filter(|(_, node)| !node.absent) {
            node.parent.into_iter().for_each(|parent| children[parent].push(k));
        }
        for k in 0..self.nodes.len() {
            if self.nodes[k].absent || self.nodes[k].mass.is_body() {
                continue;
            }
            let done = children[k].iter().any(|c| self.transfer(*c, k, *c, remarks))
                || self.nodes[k].parent.is_some_and(|p| self.transfer(p, k, k, remarks))
                || self.rod_on_ground(k, remarks);
            if !done {
                self.small_mass(k, remarks)?;
            }
        }
        Ok(())
    }

    /// A rod of body `from` on the hinge of body `hinge` becomes a part of body `to`.
    fn transfer(&mut self, from: usize, to: usize, hinge: usize, remarks: &mut Remarks) -> bool {
        let Some((point, axis)) = self.hinge(hinge) else { return false };
        let donor = &self.nodes[from];
        if donor.absent {
            return false;
        }
        let inverse = donor.pose.inverse();
        let (p, u) = (inverse.transform_point(&point.into()).coords, inverse.rotation * axis);
        let Some(rod) = donor.mass.rod(&p, &u) else { return false };
        let there = self.nodes[to].pose.inverse() * donor.pose;
        let note = format!(
            "A rod on the axis of a hinge was taken from `{}` and added here: this does not change the motion.",
            donor.name
        );
        let label =
            format!("{} kg of \"{}\" to \"{}\"", short(rod.mass), donor.name, self.nodes[to].name);
        remarks.mention(RODS, label, &donor.place);
        self.nodes[from].mass = self.nodes[from].mass.minus(&rod);
        self.receive(to, &rod.moved(&there), note);
        true
    }

    /// Where the parent is the ground, any rod on the axis will do.
    fn rod_on_ground(&mut self, k: usize, remarks: &mut Remarks) -> bool {
        let (None, Some((point, axis))) = (self.nodes[k].parent, self.hinge(k)) else {
            return false;
        };
        let (mass, size) = self.behind(k);
        if mass <= 0.0 || size <= 0.0 {
            return false;
        }
        let inverse = self.nodes[k].pose.inverse();
        let u = inverse.rotation * axis;
        let center = inverse.transform_point(&point.into()).coords;
        let rod = ImportedMass::thin_rod(0.25 * mass, center, &u, 0.25 * size);
        let label = format!("{} kg to \"{}\"", short(rod.mass), self.nodes[k].name);
        remarks.mention(RODS, label, &self.nodes[k].place);
        let note = "A rod on the axis of its hinge was added: it has no inertia about that axis, and does not change the motion.";
        self.receive(k, &rod, note.to_owned());
        true
    }

    /// Last resort: a millionth of what is behind the body, said so.
    fn small_mass(&mut self, k: usize, remarks: &mut Remarks) -> Result<()> {
        let node = &self.nodes[k];
        let (mass, size) = self.behind(k);
        if mass <= 0.0 || size <= 0.0 {
            let message = format!(
                "`{}` moves and has no mass or inertia, and none can be taken from its neighbours",
                node.name
            );
            let help = match node.mass.mass > 0.0 {
                true => "state its inertia, or let `--repair-inertia` take one from its mass",
                false => {
                    "state its mass and inertia; `--density RHO` gives links of URDF the mass of their geometry"
                }
            };
            return Err(Refusal::at(&node.place, message, help));
        }
        let inertia = Matrix3::identity() * (SMALL * size);
        let small = ImportedMass { mass: SMALL * mass, center: node.mass.center, J: inertia };
        let message = "without mass or inertia: a millionth of what is behind it was added";
        remarks.mention(message, format!("link \"{}\"", node.name), &node.place);
        self.receive(k, &small, "A millionth of what is behind it was added.".to_owned());
        Ok(())
    }

    /// Mass, and moment of inertia about the centre of body `k`, of the body and all behind it.
    fn behind(&self, k: usize) -> (f64, f64) {
        let center = self.nodes[k].pose.translation.vector;
        let mut behind = vec![false; self.nodes.len()];
        let (mut mass, mut size) = (0.0, 0.0);
        for (i, node) in self.nodes.iter().enumerate().skip(k).filter(|(_, n)| !n.absent) {
            behind[i] = i == k || node.parent.is_some_and(|p| behind[p]);
            if behind[i] {
                let at = node.pose.transform_point(&node.mass.center.into()).coords;
                mass += node.mass.mass;
                size += 0.5 * node.mass.J.trace() + node.mass.mass * (at - center).norm_squared();
            }
        }
        (mass, size)
    }

    fn receive(&mut self, k: usize, part: &ImportedMass, note: String) {
        let node = &mut self.nodes[k];
        node.mass = node.mass.plus(part);
        node.note = Some(note);
    }

    /// Point and axis in space of the joint of a body, if it is a hinge.
    fn hinge(&self, k: usize) -> Option<(Vector3<f64>, Vector3<f64>)> {
        match &self.nodes[k].connection {
            Connection::Joint { joint, axis, point } if joint.kind == Mobility::Hinge => {
                Some((*point, *axis))
            }
            _ => None,
        }
    }
}

/// Whether no axis is a combination of the others.
fn independent(joints: &[&RobotJoint]) -> bool {
    match joints {
        [a, b, c] => a.axis.cross(&b.axis).dot(&c.axis).abs() > 1e-6,
        _ => false,
    }
}
