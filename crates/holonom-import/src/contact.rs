//! Contact of bodies with planes of the ground, and the shapes of all that touches.
//!
//! MJCF lets two geoms touch where `contype` of one has a bit of `conaffinity` of the other, with
//! the larger coefficient of friction. URDF has no ground: it is put under the lowest point of the
//! geometry for contact.

use std::collections::BTreeMap;

use holonom_model::{BodyNames, Contact, ContactPlane, ContactSide, GROUND, PlaneSide, Shape};
use nalgebra::{Isometry3, Vector3};

use crate::drafter::Drafter;
use crate::numbers::vector;
use crate::picture::part;
use crate::remark::Remarks;
use crate::robot::Robot;
use crate::surface::{FRICTION, GroundPlane, TouchingSolid, TouchingSurface};
use crate::tree_body::TreeBody;

/// The planes that a robot stands on.
pub(crate) fn planes(robot: &Robot, nodes: &[TreeBody], remarks: &mut Remarks) -> Vec<GroundPlane> {
    if robot.format != "URDF" {
        return robot.planes.clone();
    }
    let nodes = nodes.iter().filter(|node| !node.absent);
    let lowest = nodes.flat_map(|node| node.touching.iter().map(|own| own.moved(&node.pose)));
    let lowest = lowest.map(|own| own.placed.lowest()).min_by(f64::total_cmp);
    let Some(height) = lowest else { return Vec::new() };
    remarks.of_all(format!(
        "ground: URDF states none, a plane under the lowest point of the geometry for contact was taken, with the friction {FRICTION}"
    ));
    let pose = Isometry3::translation(0.0, 0.0, height);
    vec![GroundPlane { name: "floor".to_owned(), pose, surface: TouchingSurface::default() }]
}

/// The shapes of geometry that touches; `to_body`: from the axes of the link.
pub(crate) fn shapes(touching: Vec<&TouchingSolid>, to_body: &Isometry3<f64>) -> Vec<Shape> {
    touching.into_iter().map(|own| part(&own.placed, to_body)).collect()
}

impl Drafter<'_> {
    /// The geometry of a body that touches a plane, or another body.
    pub(crate) fn touching(&self, k: usize) -> Vec<&TouchingSolid> {
        let others = self.body_pairs.keys().filter(|pair| pair.contains(&k));
        let others: Vec<_> = others
            .flat_map(|[i, j]| &self.tree.nodes[i + j - k].touching)
            .filter(|own| own.placed.is_shown())
            .collect();
        let touches = |own: &&TouchingSolid| {
            let planes = self.planes.iter().map(|plane| &plane.surface);
            let mut surfaces = planes.chain(others.iter().map(|other| &other.surface));
            own.placed.is_shown()
                && (own.surface.is_paired || surfaces.any(|of| of.touches(&own.surface)))
        };
        self.tree.nodes[k].touching.iter().filter(touches).collect()
    }

    /// The contacts of all bodies with planes: one for each plane and coefficient of friction.
    pub(crate) fn contacts(&mut self, remarks: &mut Remarks) {
        for plane in self.planes.clone() {
            let mut bodies: BTreeMap<u64, (f64, Vec<String>)> = BTreeMap::new();
            for (k, node) in self.tree.nodes.iter().enumerate().filter(|(_, own)| !own.absent) {
                let touching = node.touching.iter().filter(|own| own.placed.is_shown());
                let own = touching.filter(|own| plane.surface.touches(&own.surface));
                let frictions: Vec<f64> =
                    own.map(|own| own.surface.friction.max(plane.surface.friction)).collect();
                let Some(largest) = frictions.iter().copied().max_by(f64::total_cmp) else {
                    continue;
                };
                if frictions.iter().any(|own| *own < largest) {
                    let message = "geometry with several coefficients of friction: the largest one was taken for all of the body";
                    remarks.mention(message, format!("link \"{}\"", node.name), &node.place);
                }
                let of = bodies.entry(largest.to_bits()).or_insert((largest, Vec::new()));
                of.1.push(self.bodies[k].clone());
            }
            for (friction, names) in bodies.into_values() {
                let [x, y, z] = (plane.pose.rotation * Vector3::z()).into();
                let normal = [x, y, z].map(|own: f64| own + 0.0);
                let position = vector(&plane.pose.translation.vector);
                let plane_of = ContactPlane { position, normal, on: GROUND.to_owned() };
                let name = self.names.unique(&plane.name, "contact");
                let a = ContactSide::Plane(PlaneSide { plane: plane_of });
                let of = Contact::new(name, a, BodyNames::Several(names));
                self.draft.model.contacts.push(Contact { friction, ..of });
            }
        }
    }

    /// What contacts are here.
    pub(crate) fn contact_remarks(&self, remarks: &mut Remarks) {
        if !self.draft.model.contacts.is_empty() {
            remarks.of_all("contact: rigid, with one coefficient of friction for all of a body");
        }
    }
}
