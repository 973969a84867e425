//! What sensors name, in the mechanism.

use super::ends::ends_of;
use super::observer::Observer;
use crate::dynamics::Dynamics;
use crate::system::beams::Beams;
use crate::system::contact_origin::ContactOrigin;
use crate::system::names::Names;
use holonom_model::{GROUND, Sensor, spatial};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use vi_multibody::form::Form;
use vi_multibody::mechanism::{Attachment, Mechanism};

/// Finds what sensors name.
pub(super) struct Finder<'a> {
    pub(super) names: &'a Names<'a>,
    pub(super) mechanism: &'a Mechanism,
    pub(super) dynamics: &'a Dynamics,
    pub(super) beams: &'a Beams,
    pub(super) contacts: &'a [ContactOrigin],
    joints: BTreeMap<&'a str, usize>, // of the description, by name
    pub(super) q: Vec<f64>,           // initial configuration
}

impl<'a> Finder<'a> {
    pub(super) fn new(
        names: &'a Names<'a>,
        mechanism: &'a Mechanism,
        dynamics: &'a Dynamics,
        beams: &'a Beams,
        contacts: &'a [ContactOrigin],
    ) -> Self {
        let joints = mechanism.description().joints.iter();
        let joints = joints.map(|joint| joint.name.as_str()).zip(0..).collect();
        let q = mechanism.initial_configuration();
        Self { names, mechanism, dynamics, beams, contacts, joints, q }
    }

    /// The joint of this name; what holds a fixed body or the end of a beam has the name of that.
    pub(super) fn joint(&self, name: &str) -> Option<usize> {
        self.joints.get(name).copied()
    }

    /// The scalar constraint of this name.
    pub(super) fn scalar(&self, name: &str) -> Option<usize> {
        self.mechanism.description().scalars.iter().position(|own| own.name == name)
    }

    /// A point of a body or node by its own components, of the ground in space, or a particle.
    pub(super) fn end(&self, name: &str, components: &[f64]) -> Option<Form> {
        let own = Vector3::from(spatial(components));
        if let Some(k) = self.names.index(name) {
            let along_directors = self.names.principal[k].tr_mul(&own);
            return Some(self.mechanism.point_of(Attachment::Body(k), &along_directors));
        }
        if name == GROUND {
            return Some(Form::constant(own));
        }
        let k = self.names.particles.get(name)?.index();
        Some(self.mechanism.point_of(Attachment::Particle(k), &Vector3::zeros()))
    }

    /// The point of a position, velocity or acceleration, and how many components it has.
    pub(super) fn point(&self, sensor: &Sensor) -> Option<(Form, usize)> {
        let point = self.end(&sensor.of, &sensor.point.unwrap_or_default())?;
        let planar = self.names.particles.contains_key(sensor.of.as_str());
        Some((point, if planar { self.names.model.header.dimension } else { 3 }))
    }

    /// `D` between the ends of a distance.
    pub(super) fn between(&self, sensor: &Sensor) -> Option<Form> {
        let [(from, a), (to, b)] = ends_of(self.names.model, sensor)?;
        Some(self.end(to, &b)?.minus(&self.end(from, &a)?))
    }

    /// The body that something is seen from.
    pub(super) fn observer(&self, sensor: &Sensor) -> Option<Observer> {
        self.frame_of(sensor.seen_from.as_deref()?)
    }

    /// The frame of a body or node with its own axes.
    pub(super) fn frame_of(&self, name: &str) -> Option<Observer> {
        let k = self.names.index(name)?;
        Some(Observer::new(12 * k, &self.names.principal[k]))
    }
}
