//! The start configuration against bars and joints.

use nalgebra::Vector3;

use super::problem::{Inconsistency, Level};
use super::{Bar, GROUND, Joint, JointKind, Model, Spring, spatial};

impl Model {
    /// The body of this name.
    #[must_use]
    pub fn body(&self, name: &str) -> Option<&super::Body> {
        self.bodies.iter().find(|b| b.name == name)
    }

    /// The particle of this name.
    #[must_use]
    pub fn particle(&self, name: &str) -> Option<&super::Particle> {
        self.particles.iter().find(|p| p.name == name)
    }

    /// A point at the start, m: of a body by components, of the ground, or a particle.
    #[must_use]
    pub fn start_point(&self, member: &str, components: Option<&[f64]>) -> Vector3<f64> {
        let components = spatial(components.unwrap_or_default());
        if let Some(body) = self.body(member) {
            return body.point(components);
        }
        match self.particle(member) {
            Some(particle) => Vector3::from(spatial(&particle.position)),
            None => Vector3::from(components),
        }
    }

    /// Distance of the ends of a bar at the start, m.
    pub(crate) fn bar_start(&self, index: usize) -> f64 {
        let Bar { from, to, point, .. } = &self.bars[index];
        (self.start_point(from, point.as_deref()) - self.start_point(to, point.as_deref())).norm()
    }

    /// Distance of the ends of a spring at the start, m.
    pub(crate) fn spring_start(&self, index: usize) -> f64 {
        let Spring { from, to, point_from, point_to, .. } = &self.springs[index];
        (self.start_point(from, point_from.as_deref()) - self.start_point(to, point_to.as_deref()))
            .norm()
    }

    /// Where a joint sits on its parent and on its child at the start, in space, m.
    #[must_use]
    pub fn joint_points(&self, joint: &Joint) -> [Vector3<f64>; 2] {
        if let Some(position) = joint.position {
            return [Vector3::from(position); 2];
        }
        let point = |member: &str, anchor: Option<[f64; 3]>| {
            self.start_point(member, anchor.as_ref().map(<[f64; 3]>::as_slice))
        };
        [point(&joint.parent, joint.anchor_parent), point(&joint.child, joint.anchor_child)]
    }
}

/// Bars and joints whose positions at the start miss by more than the tolerance.
pub(super) fn inconsistencies(model: &Model) -> Vec<Inconsistency> {
    let tolerance = model.settings.start_tolerance;
    let bars = model.bars.iter().enumerate().filter_map(|(i, bar)| {
        let (start, length) = (model.bar_start(i), bar.length?);
        let detail = format!("its length is {length} m, its ends start {start} m apart");
        missed(format!("bar.{}.length", bar.name), (start - length).abs(), tolerance, detail)
    });
    let joints = model.joints.iter().filter_map(|joint| {
        let [parent, child] = model.joint_points(joint);
        let distance = gap(joint, child - parent);
        let detail = format!(
            "anchor_parent is at {} m, anchor_child at {} m",
            triple(parent),
            triple(child)
        );
        missed(format!("joint.{}.anchor_child", joint.name), distance, tolerance, detail)
    });
    bars.chain(joints).collect()
}

fn missed(key: String, distance: f64, tolerance: f64, detail: String) -> Option<Inconsistency> {
    let level = Level::Position;
    (distance > tolerance).then_some(Inconsistency { key, level, distance, detail })
}

/// The part of the gap that a joint does not allow, m.
fn gap(joint: &Joint, gap: Vector3<f64>) -> f64 {
    let axis = joint.axis.map(|a| Vector3::from(a).normalize()).unwrap_or_default();
    let along = gap.dot(&axis);
    match joint.kind {
        JointKind::Spherical | JointKind::Revolute | JointKind::Fixed => gap.norm(),
        JointKind::Cylindrical | JointKind::Prismatic => (gap - axis * along).norm(),
        JointKind::Planar => along.abs(),
    }
}

fn triple(v: Vector3<f64>) -> String {
    format!("({}, {}, {})", v.x, v.y, v.z)
}

/// Whether a name means the inertial frame.
pub(super) fn is_ground(name: &str) -> bool {
    name == GROUND
}
