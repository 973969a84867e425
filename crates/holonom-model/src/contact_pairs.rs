//! The pairs of bodies that may touch one another, and the shapes with which they do.
//!
//! Of a `[[contact]]` these are all pairs of a body of `a`, or its plane, with a body of `b`, each
//! once, without those of which neither moves, and without bodies that share a joint.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Vector3};
use vi_rigid::gap::ContactShape;

use crate::types::contact::{BodyNames, Contact, ContactPlane, ContactSide};
use crate::types::orientation::rotation_of;
use crate::types::shape::{Shape, ShapeKind};
use crate::{Body, BodySurface, GROUND, Model};

/// A body that touches a plane, or another body.
#[derive(Clone, Copy, Debug)]
pub struct ContactPair<'a> {
    /// The section that states it.
    pub contact: &'a Contact,
    /// One side.
    pub a: SideOfPair<'a>,
    /// The other side.
    pub b: &'a Body,
}

/// A side of a pair.
#[derive(Clone, Copy, Debug)]
pub enum SideOfPair<'a> {
    /// A plane.
    Plane(&'a ContactPlane),
    /// A body.
    Body(&'a Body),
}

impl<'a> SideOfPair<'a> {
    /// The body that it is, or that carries the plane; or the ground.
    #[must_use]
    pub fn name(&self) -> &'a str {
        match self {
            Self::Plane(plane) => &plane.on,
            Self::Body(body) => &body.name,
        }
    }
}

impl ContactPlane {
    /// The half-space behind it, in axes that stand as the columns of `axes` in its own.
    #[must_use]
    pub fn contact_shape(&self, axes: &Matrix3<f64>) -> ContactShape {
        let [point, normal] = [self.position, self.normal].map(Vector3::from);
        let inwards = axes.transpose();
        ContactShape::Plane { point: inwards * point, normal: inwards * normal.normalize() }
    }
}

impl Model {
    /// All pairs of bodies that may touch, section by section; those that share a joint are given
    /// to `joined`.
    pub(crate) fn pairs_of<'a>(
        &'a self,
        contact: &'a Contact,
        joined: &mut dyn FnMut(ContactPair<'a>),
    ) -> Vec<ContactPair<'a>> {
        let shared = self.shared_joints();
        let share = |a: &'a str, b: &'a str| shared.contains(&[a.min(b), a.max(b)]);
        let (sides, others) = self.sides_of(contact);
        let mut pairs = Vec::new();
        let mut known = BTreeSet::new();
        for a in sides {
            let rests = match a {
                SideOfPair::Body(body) => body.fixed,
                SideOfPair::Plane(plane) => {
                    plane.on == GROUND || self.body(&plane.on).is_some_and(|body| body.fixed)
                }
            };
            for &b in &others {
                let (pair, names) = (ContactPair { contact, a, b }, [a.name(), b.name.as_str()]);
                let new = known.insert([names[0].min(names[1]), names[0].max(names[1])]);
                if !new || names[0] == names[1] || (rests && b.fixed) {
                    continue;
                }
                match share(a.name(), &b.name) && a.name() != GROUND {
                    true => joined(pair),
                    false => pairs.push(pair),
                }
            }
        }
        pairs
    }

    /// What the names of both sides of a contact stand for.
    pub(crate) fn sides_of<'a>(
        &'a self,
        contact: &'a Contact,
    ) -> (Vec<SideOfPair<'a>>, Vec<&'a Body>) {
        let bodies = |names: &BodyNames| -> Vec<&'a Body> {
            self.bodies.iter().filter(|body| names.contain(&body.name)).collect()
        };
        let a = match &contact.a {
            ContactSide::Plane(side) => vec![SideOfPair::Plane(&side.plane)],
            ContactSide::Bodies(names) => bodies(names).into_iter().map(SideOfPair::Body).collect(),
        };
        (a, bodies(&contact.b))
    }

    /// All pairs of bodies that may touch.
    #[must_use]
    pub fn contact_pairs(&self) -> Vec<ContactPair<'_>> {
        self.contacts.iter().flat_map(|contact| self.pairs_of(contact, &mut |_| {})).collect()
    }

    /// What is worth knowing of the pairs: those that are named and share a joint.
    #[must_use]
    pub fn contact_remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        for contact in &self.contacts {
            let named = |name: &str| {
                let of_a = match &contact.a {
                    ContactSide::Plane(_) => true,
                    ContactSide::Bodies(names) => names.list().iter().any(|own| own == name),
                };
                of_a || contact.b.list().iter().any(|own| own == name)
            };
            self.pairs_of(contact, &mut |pair| {
                let (a, b) = (pair.a.name(), pair.b.name.as_str());
                let joint = self.joints.iter().find(|joint| {
                    let ends = [joint.parent.as_str(), joint.child.as_str()];
                    ends == [a, b] || ends == [b, a]
                });
                if let Some(joint) = joint.filter(|_| named(a) && named(b)) {
                    remarks.push(format!(
                        "`{a}` and `{b}` share the joint `{}`: contact `{}` leaves them out",
                        joint.name, contact.name
                    ));
                }
            });
            if contact.friction > STRANGE {
                remarks.push(format!(
                    "the friction of contact `{}` is {}: coefficients of dry friction are seldom above 1",
                    contact.name, contact.friction
                ));
            }
        }
        remarks
    }

    fn shared_joints(&self) -> BTreeSet<[&str; 2]> {
        let joints = self.joints.iter().map(|joint| [joint.parent.as_str(), joint.child.as_str()]);
        let released = self.released.iter().map(|[a, b]| [a.as_str(), b.as_str()]);
        joints.chain(released).map(|[a, b]| [a.min(b), a.max(b)]).collect()
    }

    /// The shapes with which a body touches others, in axes that stand as the columns of `axes` in
    /// those of the body.
    #[must_use]
    pub fn contact_shapes(&self, body: &Body, axes: &Matrix3<f64>) -> Vec<ContactShape> {
        let own = |shape: &Shape| {
            let mesh = shape.file.as_deref().and_then(|file| self.meshes.get(file));
            let corners = mesh.map(|mesh| BodySurface::new(mesh, shape).corners);
            shape.contact_shape(axes, corners.unwrap_or_default())
        };
        body.contact_shapes().iter().filter_map(own).collect()
    }
}

/// Coefficients of friction above this are worth a remark.
const STRANGE: f64 = 10.0;

impl Shape {
    /// What touches others, in axes that stand as the columns of `axes` in those of the body, with
    /// the corners of a mesh along those; `None` where the contact of such shapes is not available.
    pub(crate) fn contact_shape(
        &self,
        axes: &Matrix3<f64>,
        corners: Vec<Vector3<f64>>,
    ) -> Option<ContactShape> {
        let at = |k: usize| self.dimensions.get(k).copied().unwrap_or_default();
        let inwards = axes.transpose();
        let turn = inwards * self.quaternion.map_or_else(Matrix3::identity, rotation_of);
        let center = inwards * Vector3::from(self.position.unwrap_or_default());
        let along = |length: f64| turn * Vector3::z() * (0.5 * length);
        let cylinder = |radius: f64, length: f64| {
            let half = along(length);
            ContactShape::Cylinder { ends: [center - half, center + half], radius }
        };
        match self.kind {
            ShapeKind::Sphere => Some(ContactShape::sphere(center, at(0))),
            ShapeKind::Box => {
                let half_lengths = 0.5 * Vector3::new(at(0), at(1), at(2));
                Some(ContactShape::Box { center, axes: turn, half_lengths })
            }
            ShapeKind::Mesh => {
                let points = corners.iter().map(|x| inwards * x).collect();
                Some(ContactShape::Points { points, radius: 0.0 })
            }
            ShapeKind::Capsule => {
                let half = along(at(1));
                Some(ContactShape::Capsule { ends: [center - half, center + half], radius: at(0) })
            }
            ShapeKind::Ellipsoid => {
                let half_axes = Vector3::new(at(0), at(1), at(2));
                Some(ContactShape::Ellipsoid { center, axes: turn, half_axes })
            }
            ShapeKind::Cylinder => Some(cylinder(at(0), at(1))),
            ShapeKind::Rod => Some(cylinder(at(1), at(0))),
            ShapeKind::Cone => None,
        }
    }
}
