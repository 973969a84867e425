//! Bodies that pass one another within a step, and are not seen.
//!
//! ```text
//! h |v| > 0.8 (t_A + t_B)
//! ```
//! with the thickness `t` of each along the way: from 1 on a step may begin on one side of the
//! other and end on its far side. Up to there it ends within, and its first touch is found. The
//! velocity is that at the start; of a body without joints above a fixed one that with which its
//! fall ends.

use std::borrow::Cow;

use nalgebra::{Matrix3, Vector3};
use vi_rigid::gap::ContactShape;

use crate::contact_pairs::{ContactPair, SideOfPair, thickness, velocity};
use crate::types::contact::Contact;
use crate::{Body, Model};

/// From this part of both thicknesses on it is said: the motion may become faster.
const PART: f64 = 0.8;
/// The part that is recommended.
const SAFE: f64 = 0.5;

/// How thick a shape is along a unit vector, through its centre, m; of planes `None`.
fn thickness_along(shape: &ContactShape, along: &Vector3<f64>) -> Option<f64> {
    let through = |axes: &Matrix3<f64>, halves: &Vector3<f64>| {
        let ways = (axes.transpose() * along).zip_map(halves, |way, half| half / way.abs());
        2.0 * ways.min()
    };
    match shape {
        ContactShape::Box { axes, half_lengths, .. } => Some(through(axes, half_lengths)),
        ContactShape::Points { .. } => shape.ball().map(|(_, radius)| 2.0 * radius),
        ContactShape::Cylinder { ends, radius } => {
            let axis = ends[1] - ends[0];
            let way = axis.normalize().dot(along).abs();
            let across = (1.0 - way * way).max(0.0).sqrt();
            Some((axis.norm() / way).min(2.0 * radius / across))
        }
        _ => thickness(shape),
    }
}

impl Model {
    /// Bodies that pass one another within a step: the first pair of a contact.
    pub(crate) fn unseen<'a>(&'a self, contact: &'a Contact) -> Option<String> {
        let pairs = self.pairs_of(contact, &mut |_| {});
        pairs.into_iter().find_map(|ContactPair { a, b, .. }| {
            let SideOfPair::Body(a) = a else { return None };
            let between = Vector3::from(b.position) - Vector3::from(a.position);
            let start = velocity(&b) - velocity(a);
            let fallen = match &b {
                Cow::Borrowed(body) => self.fallen([a, body], &between),
                Cow::Owned(_) => None, // a node of a beam, which holds it
            };
            [("", Some(start)), ("after the fall ", fallen)].into_iter().find_map(
                |(when, approach)| self.passes(contact, [a, &b], &between, when, approach?),
            )
        })
    }

    /// The same of two bodies with a velocity of the second one relative to the first.
    fn passes(
        &self,
        contact: &Contact,
        [a, b]: [&Body; 2],
        between: &Vector3<f64>,
        when: &str,
        approach: Vector3<f64>,
    ) -> Option<String> {
        let step = self.settings.step;
        let way = step * approach.norm();
        if way.is_nan() || way <= 0.0 || between.dot(&approach) >= 0.0 {
            return None;
        }
        let along = approach.normalize();
        let aside = (between - along * between.dot(&along)).norm();
        let [(reach_a, thick_a), (reach_b, thick_b)] =
            [a, b].map(|body| self.reach_and_thickness(body, &along));
        let thick = thick_a + thick_b;
        (aside < reach_a + reach_b && way > PART * thick).then(|| {
            format!(
                "contact `{}`: in a step `{}` and `{}` {when}approach one another by {way:.2e} m, {:.2} of the {thick:.2e} m that both together are thick: they may pass unseen; take a step of {:.0e} s or less",
                contact.name, a.name, b.name, way / thick, SAFE * step * thick / way
            )
        })
    }

    /// The relative velocity with which the fall of a body without joints onto a fixed one below it
    /// ends; `None` of others.
    fn fallen(&self, [a, b]: [&Body; 2], between: &Vector3<f64>) -> Option<Vector3<f64>> {
        let gravity = Vector3::from(crate::spatial(&self.header.gravity));
        let g = gravity.norm();
        let falls = |body: &Body| {
            let ends = |name: &str| name == body.name;
            !body.fixed && !self.joints.iter().any(|own| ends(&own.parent) || ends(&own.child))
        };
        if g.is_nan() || g <= 0.0 || a.fixed == b.fixed || !falls(if a.fixed { b } else { a }) {
            return None;
        }
        let down = gravity / g;
        let sign = if a.fixed { 1.0 } else { -1.0 }; // of the motion of what falls
        let (height, v) = (-sign * between.dot(&down), sign * (velocity(b) - velocity(a)));
        let across = v - down * v.dot(&down);
        let end = (v.dot(&down).powi(2) + 2.0 * g * height).sqrt();
        (height > 0.0 && across.norm() <= 1e-9 * end).then(|| sign * end * down)
    }

    /// How far the shapes of a body reach from it, and how thick they are along a direction in
    /// space, m.
    fn reach_and_thickness(&self, body: &Body, along: &Vector3<f64>) -> (f64, f64) {
        let along = body.rotation().transpose() * along;
        let shapes = self.contact_shapes(body, &Matrix3::identity());
        let reach = shapes.iter().map(ContactShape::extent).fold(0.0, f64::max);
        let thick = shapes.iter().filter_map(|shape| thickness_along(shape, &along));
        (reach, thick.fold(f64::INFINITY, f64::min))
    }
}
