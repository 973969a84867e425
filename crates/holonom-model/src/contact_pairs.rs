//! The pairs of bodies that may touch one another, and the shapes with which they do.
//!
//! Of a `[[contact]]` these are all pairs of a body of `a`, or its plane, with a body of `b`, each
//! once, without those of which neither moves, and without bodies that share a joint. Nodes of
//! beams in `b` stand for bodies (`contact_nodes`).

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix3, Vector3};
use vi_core::Number;
use vi_rigid::gap::ContactShape;

use crate::types::contact::{BodyNames, Contact, ContactModel, ContactPlane, ContactSide};
use crate::types::orientation::rotation_of;
use crate::types::shape::{Shape, ShapeKind};
use crate::{Body, BodySurface, GROUND, Model};

/// A body that touches a plane, or another body.
#[derive(Clone, Debug)]
pub struct ContactPair<'a> {
    /// The section that states it.
    pub contact: &'a Contact,
    /// One side.
    pub a: SideOfPair<'a>,
    /// The other side; owned where it is a node of a beam.
    pub b: Cow<'a, Body>,
}

/// The name of a side, for as long as that of a body.
fn name_of<'a>(side: &Cow<'a, Body>) -> Cow<'a, str> {
    match side {
        Cow::Borrowed(body) => Cow::Borrowed(&body.name),
        Cow::Owned(node) => Cow::Owned(node.name.clone()),
    }
}

/// Two names in order.
fn ordered<'a>(a: Cow<'a, str>, b: Cow<'a, str>) -> [Cow<'a, str>; 2] {
    if a <= b { [a, b] } else { [b, a] }
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
            for b in &others {
                let names = ordered(a.name().into(), name_of(b));
                let shared = a.name() != GROUND && shared.contains(&names);
                let same = names[0] == names[1];
                if !known.insert(names) || same || (rests && b.fixed) {
                    continue;
                }
                let pair = ContactPair { contact, a, b: b.clone() };
                match shared {
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
    ) -> (Vec<SideOfPair<'a>>, Vec<Cow<'a, Body>>) {
        let bodies = |names: &BodyNames| -> Vec<&'a Body> {
            self.bodies.iter().filter(|body| names.contain(&body.name)).collect()
        };
        let a = match &contact.a {
            ContactSide::Plane(side) => vec![SideOfPair::Plane(&side.plane)],
            ContactSide::Bodies(names) => bodies(names).into_iter().map(SideOfPair::Body).collect(),
        };
        let nodes = self.touching_nodes(&contact.b).into_iter().map(Cow::Owned);
        (a, bodies(&contact.b).into_iter().map(Cow::Borrowed).chain(nodes).collect())
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
            remarks.extend(self.unresolved(contact));
            remarks.extend(self.coarse_mesh(contact));
            remarks.extend(self.unseen(contact));
            remarks.extend(self.unbounded(contact));
            if contact.friction > STRANGE {
                remarks.push(format!(
                    "the friction of contact `{}` is {}: coefficients of dry friction are seldom above 1",
                    contact.name, contact.friction
                ));
            }
        }
        remarks
    }

    /// A compliant contact that steps do not resolve: the shortest of its pairs, by velocities at
    /// the start and in a fall by the size of a body.
    fn unresolved<'a>(&'a self, contact: &'a Contact) -> Option<String> {
        let ContactModel::HuntCrossley { stiffness, exponent, .. } = contact.model?;
        let gravity = Vector3::from(crate::spatial(&self.header.gravity)).norm();
        let rest = Vector3::zeros();
        let last = |pair: ContactPair<'a>| {
            let a = match pair.a {
                SideOfPair::Plane(plane) => self.body(&plane.on),
                SideOfPair::Body(body) => Some(body),
            };
            let b = pair.b.as_ref();
            let moving = a.into_iter().chain([b]).filter(|body| !body.fixed);
            let inverse: f64 = moving.map(|body| 1.0 / body.mass()).sum();
            let shapes = self.contact_shapes(b, &Matrix3::identity());
            let size = shapes.iter().fold(0.0, |size: f64, own| size.max(own.extent()));
            let apart: Vector3<f64> = velocity(b) - a.map_or(rest, velocity);
            let v = apart.norm().max((2.0 * gravity * size).sqrt());
            let v = if v > 0.0 { v } else { 1.0 };
            let time = time_of_contact(1.0 / inverse, [stiffness, exponent], v);
            (time, pair.a.name(), pair.b.name.clone())
        };
        let pairs = self.pairs_of(contact, &mut |_| {});
        let (time, a, b) = pairs.into_iter().map(last).min_by(|x, y| x.0.total_cmp(&y.0))?;
        let step = self.settings.step * self.settings.composition().shortest();
        (step > time * RESOLVED).then(|| {
            format!(
                "the contact `{}` of `{a}` and `{b}` lasts about {:.1e} s, and a step {step:.1e} s: take {:.0e} s or less, or remove `model` for a rigid contact",
                contact.name, time, time * RESOLVED
            )
        })
    }

    /// A mesh whose corners are farther apart than what it touches is thick: the first of its
    /// pairs.
    fn coarse_mesh<'a>(&'a self, contact: &'a Contact) -> Option<String> {
        let axes = Matrix3::identity();
        let mut known = BTreeMap::new();
        let mut sizes = |body: &Body| {
            *known.entry(body.name.clone()).or_insert_with(|| {
                let thick = self
                    .contact_shapes(body, &axes)
                    .iter()
                    .filter_map(thickness)
                    .fold(f64::INFINITY, f64::min);
                (self.widest_triangle(body), thick)
            })
        };
        let pairs = self.pairs_of(contact, &mut |_| {});
        pairs.into_iter().find_map(|ContactPair { a, b, .. }| {
            let (SideOfPair::Body(a), b) = (a, b.as_ref()) else { return None };
            let (of_a, of_b) = (sizes(a), sizes(b));
            let passes = |(wide, _): (f64, f64), (_, thick): (f64, f64)| wide > thick;
            let (mesh, other, wide, thick) = match (passes(of_a, of_b), passes(of_b, of_a)) {
                (true, _) => (a, b, of_a.0, of_b.1),
                (_, true) => (b, a, of_b.0, of_a.1),
                _ => return None,
            };
            Some(format!(
                "corners of the mesh of `{}` are up to {wide:.3} m apart, and `{}` is {thick:.3} m thick: a mesh touches with its corners, and what is between them passes; refine it, or state boxes or capsules as `collision`",
                mesh.name, other.name
            ))
        })
    }

    /// The longest side of a triangle of the meshes with which a body touches, m; 0 without.
    fn widest_triangle(&self, body: &Body) -> f64 {
        let meshes = body.contact_shapes().iter().filter_map(|shape| {
            Some(BodySurface::new(self.meshes.get(shape.file.as_deref()?)?, shape))
        });
        meshes.fold(0.0, |widest, BodySurface { corners, triangles }| {
            let side = |i: u32, j: u32| (corners[i as usize] - corners[j as usize]).norm();
            let of = |[i, j, k]: &[u32; 3]| side(*i, *j).max(side(*j, *k)).max(side(*k, *i));
            triangles.iter().map(of).fold(widest, f64::max)
        })
    }

    fn shared_joints(&self) -> BTreeSet<[Cow<'_, str>; 2]> {
        let joints = self.joints.iter().map(|joint| [joint.parent.as_str(), joint.child.as_str()]);
        let released = self.released.iter().map(|[a, b]| [a.as_str(), b.as_str()]);
        let mut shared = BTreeSet::new();
        for ends in joints.chain(released) {
            let [of_a, of_b] = ends.map(|name| self.touching_names(name));
            for a in of_a {
                shared.extend(of_b.iter().map(|b| ordered(a.clone(), b.clone())));
            }
        }
        shared
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

/// The velocity of a body at the start, m/s.
pub(crate) fn velocity(body: &Body) -> Vector3<f64> {
    if body.fixed { Vector3::zeros() } else { Vector3::from(body.velocity) }
}

/// How thick a shape is where it is thinnest, m; of planes and meshes `None`.
pub(crate) fn thickness(shape: &ContactShape) -> Option<f64> {
    match shape {
        ContactShape::Plane { .. } | ContactShape::Points { .. } => None,
        ContactShape::Capsule { radius, .. } => Some(2.0 * radius),
        ContactShape::Ellipsoid { half_axes, .. } => Some(2.0 * half_axes.min()),
        ContactShape::Box { half_lengths, .. } => Some(2.0 * half_lengths.min()),
        ContactShape::Cylinder { ends, radius } => {
            Some((2.0 * radius).min((ends[1] - ends[0]).norm()))
        }
    }
}

/// How long a mass that hits with the velocity `v` touches a spring `k δ^p`, s.
///
/// ```text
/// δ_m^{p+1} = (p + 1) m v²/(2k),   T = 2√π Γ(1 + 1/(p+1))/Γ(½ + 1/(p+1)) δ_m/v
/// ```
fn time_of_contact(mass: f64, [stiffness, exponent]: [f64; 2], v: f64) -> f64 {
    let part = 1.0 / (exponent + 1.0);
    let deepest = libm::pow(mass * v * v / (2.0 * part * stiffness), part);
    let factor = libm::tgamma(1.0 + part) / libm::tgamma(0.5 + part);
    2.0 * std::f64::consts::PI.sqrt() * factor * deepest / v
}

/// Steps are at most this part of a compliant contact.
const RESOLVED: f64 = 0.05;
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
        let position = Vector3::from(self.position.unwrap_or_default());
        self.contact_shape_of(axes, &at, position, corners)
    }

    /// The same with these dimensions and this place; corners as they are.
    #[must_use]
    pub fn contact_shape_of<S: Number>(
        &self,
        axes: &Matrix3<f64>,
        at: &dyn Fn(usize) -> S,
        position: Vector3<S>,
        corners: Vec<Vector3<f64>>,
    ) -> Option<ContactShape<S>> {
        let inwards = axes.transpose();
        let turn = inwards * self.quaternion.map_or_else(Matrix3::identity, rotation_of);
        let (turn, center) = (turn.map(S::of), inwards.map(S::of) * position);
        let half = S::of(0.5);
        let along = |length: S| turn * Vector3::z() * (half * length);
        let cylinder = |radius: S, length: S| {
            let half = along(length);
            ContactShape::Cylinder { ends: [center - half, center + half], radius }
        };
        match self.kind {
            ShapeKind::Sphere => Some(ContactShape::sphere(center, at(0))),
            ShapeKind::Box => {
                let half_lengths = Vector3::new(at(0), at(1), at(2)) * half;
                Some(ContactShape::Box { center, axes: turn, half_lengths })
            }
            ShapeKind::Mesh => {
                let points = corners.iter().map(|x| (inwards * x).map(S::of)).collect();
                Some(ContactShape::Points { points, radius: S::of(0.0) })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_lasts_half_a_period_of_a_linear_spring_and_as_long_as_hertz_says() {
        let linear = time_of_contact(2.0, [800.0, 1.0], 3.0);
        assert!((linear - std::f64::consts::PI / 20.0).abs() < 1e-14);
        let (m, k, v) = (2.0_f64, 5e4_f64, 2.0_f64);
        let deepest = (5.0 * m * v * v / (4.0 * k)).powf(0.4);
        let hertz = time_of_contact(m, [k, 1.5], v);
        assert!((hertz / (2.943_275 * deepest / v) - 1.0).abs() < 1e-6);
    }
}
