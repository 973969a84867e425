//! The surfaces of the bodies of a model.

use super::BodySurface;
use super::primitive::triangulated;
use crate::types::shape::Shape;
use crate::{Body, Model};

/// A shape that is no mesh, where it is placed.
fn of_solid(shape: &Shape) -> Option<BodySurface> {
    let own = triangulated(shape)?;
    Some(BodySurface::placed(&own.corners, &own.triangles, shape))
}

impl Model {
    /// The surface of a body whose shape is drawn by triangles, or that has a picture: all its
    /// shapes.
    #[must_use]
    pub fn surface(&self, body: &Body) -> Option<BodySurface> {
        let mut parts = self.surfaces(body).into_iter();
        let mut whole = parts.next()?;
        parts.for_each(|part| whole.append(&part));
        Some(whole)
    }

    /// The same, shape by shape.
    #[must_use]
    pub fn surfaces(&self, body: &Body) -> Vec<BodySurface> {
        let part = |shape| of_solid(shape).or_else(|| self.mesh_surface(shape));
        if body.picture.is_empty() {
            let own = body.shape.iter().filter(|shape| shape.kind.is_of_triangles());
            return own.filter_map(part).collect();
        }
        body.picture.iter().filter_map(part).collect()
    }

    fn mesh_surface(&self, shape: &Shape) -> Option<BodySurface> {
        let mesh = self.meshes.get(shape.file.as_deref()?)?;
        Some(BodySurface::new(mesh, shape))
    }

    /// The size of the shape of a body, m: its largest dimension, or the largest edge of the box
    /// around its mesh or picture.
    #[must_use]
    pub fn shape_size(&self, body: &Body) -> Option<f64> {
        if let Some(surface) = self.surface(body) {
            let [low, high] = surface.ends();
            return Some((high - low).amax());
        }
        let dimensions = &body.shape.as_ref()?.dimensions;
        Some(dimensions.iter().fold(0.0, |most: f64, d| most.max(d.abs())))
    }
}
