//! Shapes of bodies and the gaps between them.

use super::contact_origin::ShapeElement;
use super::names::Names;
use holonom_model::Body;
use nalgebra::Matrix3;
use std::collections::BTreeMap;
use std::sync::Arc;
use vi_constraints::nonsmooth::ContactLaw;
use vi_multibody::contact::shape_contact::ShapeContact;
use vi_multibody::joint::FrameId;
use vi_rigid::gap::{ContactShape, ShapePair};

/// The gaps between all shapes of two bodies, which do not touch by that; `None` where there is
/// none.
pub(crate) fn clearance(bodies: [&str; 2], names: &Names<'_>) -> Option<Vec<ShapeElement>> {
    let mut known = BTreeMap::new();
    let [a, b] = bodies.map(|name| names.model.body(name));
    let [on_a, on_b] = [a?, b?].map(|body| shapes_of_body(body, names, &mut known));
    let frames = bodies.map(|name| names.frame(name));
    let both = on_a.iter().flat_map(|a| on_b.iter().map(move |b| [a.clone(), b.clone()]));
    let element = |[a, b]: [ContactShape; 2]| {
        let pair = ShapePair::new(a, b).ok()?;
        let law = ContactLaw::Frictionless { restitution: 0.0 };
        Some(ShapeElement::Rigid(Arc::new(rigid(bodies, frames, pair, "", law))))
    };
    both.map(element).collect()
}

/// Two shapes on frames of bodies; with the source and the law of their contact.
pub(super) fn rigid(
    bodies: [&str; 2],
    frames: [FrameId; 2],
    pair: ShapePair,
    source: &str,
    law: ContactLaw,
) -> ShapeContact {
    let (name, source) = (bodies.join("–"), source.to_owned());
    let size = pair.extent().max(f64::MIN_POSITIVE);
    ShapeContact { name, source, size, pair, frames, law }
}

/// The shapes of bodies that were asked for.
pub(super) type KnownShapes = BTreeMap<String, Vec<ContactShape>>;

/// The shapes with which a body touches.
pub(super) fn shapes_of_body(
    body: &Body,
    names: &Names<'_>,
    known: &mut KnownShapes,
) -> Vec<ContactShape> {
    let shapes = || names.model.contact_shapes(body, &axes(names, &body.name));
    known.entry(body.name.clone()).or_insert_with(shapes).clone()
}

/// The axes along which shapes of a body stand.
pub(super) fn axes(names: &Names<'_>, body: &str) -> Matrix3<f64> {
    names.index(body).map_or_else(Matrix3::identity, |k| names.principal[k])
}
