//! The initial configuration against bars and joints.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use vi_multibody::joint::complete_axis_in;
use vi_multibody::pair::constraints::PairConstraint;

use crate::text::problem::{Inconsistency, Level};
use crate::{Bar, Beam, Body, Constraint, GROUND, Joint, Model, Particle, Spring, spatial};

/// `φ` and the triad of a node.
type NodeFrame = (Vector3<f64>, Matrix3<f64>);

/// Points of the initial configuration, found by the names of components.
#[derive(Debug)]
pub struct StartPoints<'a> {
    bodies: BTreeMap<&'a str, &'a Body>,
    beams: BTreeMap<&'a str, (&'a Beam, Vec<NodeFrame>)>,
    particles: BTreeMap<&'a str, &'a Particle>,
}

impl<'a> StartPoints<'a> {
    /// The points of a model; of two components of one name the first counts.
    #[must_use]
    pub fn new(model: &'a Model) -> Self {
        let bodies = model.bodies.iter().rev().map(|b| (b.name.as_str(), b)).collect();
        let particles = model.particles.iter().rev().map(|p| (p.name.as_str(), p)).collect();
        let nodes = |beam: &Beam| -> Vec<NodeFrame> {
            let legs = beam.meshes().unwrap_or_default().into_iter();
            legs.flat_map(|leg| leg.centers.into_iter().zip(leg.triads)).collect()
        };
        let beams = model.beams.iter().rev().map(|b| (b.name.as_str(), (b, nodes(b)))).collect();
        Self { bodies, beams, particles }
    }

    /// A point, m: of a body by components from its centre of mass, of the ground, or a particle.
    #[must_use]
    pub fn point(&self, member: &str, components: Option<&[f64]>) -> Vector3<f64> {
        let components = spatial(components.unwrap_or_default());
        if let Some(body) = self.bodies.get(member) {
            return body.point(components);
        }
        if let Some((center, triad)) = self.node(member) {
            return center + triad * Vector3::from(components);
        }
        match self.particles.get(member) {
            Some(particle) => Vector3::from(spatial(&particle.position)),
            None => Vector3::from(components),
        }
    }

    /// The node of a beam called `NAME.place`.
    fn node(&self, member: &str) -> Option<&NodeFrame> {
        let (name, place) = member.split_once('.')?;
        let (beam, nodes) = self.beams.get(name)?;
        nodes.get(beam.node(place)?)
    }

    /// The size of a model: the longest side of a box about its bodies, particles, nodes and
    /// joints, m; 1 where all are one.
    fn size(&self, model: &Model) -> f64 {
        let bodies = model.bodies.iter().map(|body| Vector3::from(body.position));
        let particles = model.particles.iter().map(|p| Vector3::from(spatial(&p.position)));
        let nodes = self.beams.values().flat_map(|(_, nodes)| nodes.iter().map(|node| node.0));
        let joints = model.joints.iter().flat_map(|joint| self.joint(joint));
        let bars = model.bars.iter().flat_map(|bar| self.bar(bar));
        let mut ends = [Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)];
        for point in bodies.chain(particles).chain(nodes).chain(joints).chain(bars) {
            ends = [ends[0].inf(&point), ends[1].sup(&point)];
        }
        let size = (ends[1] - ends[0]).max();
        if size > 0.0 && size.is_finite() { size } else { 1.0 }
    }

    /// Whether this is a body that does not move.
    pub(crate) fn is_fixed(&self, member: &str) -> bool {
        self.bodies.get(member).is_some_and(|b| b.fixed)
    }

    /// Where a bar begins and ends, m.
    #[must_use]
    pub fn bar(&self, bar: &Bar) -> [Vector3<f64>; 2] {
        [&bar.from, &bar.to].map(|end| self.point(end, bar.point.as_deref()))
    }

    /// Where a spring begins and ends, m.
    #[must_use]
    pub fn spring(&self, spring: &Spring) -> [Vector3<f64>; 2] {
        let Spring { from, to, point_from, point_to, .. } = spring;
        [self.point(from, point_from.as_deref()), self.point(to, point_to.as_deref())]
    }

    /// The first axis of the joint frame where it is not left to the joint alone: as stated, or of
    /// a planar joint a direction that is fixed in the frame of its parent, of its child where the
    /// parent is the ground.
    #[must_use]
    pub fn first_axis(&self, joint: &Joint) -> Option<[f64; 3]> {
        if joint.first_axis.is_some() || !joint.kind.turns_first_axis() {
            return joint.first_axis;
        }
        let axis = joint.axis.map(Vector3::from).filter(|axis| axis.amax() >= 1e-100)?;
        let carrier = [&joint.parent, &joint.child].into_iter().find_map(|member| {
            let body = self.bodies.get(member.as_str()).map(|body| body.rotation());
            body.or_else(|| self.node(member).map(|(_, triad)| *triad))
        });
        let axes = complete_axis_in(&carrier.unwrap_or_else(Matrix3::identity), &axis.normalize());
        Some(axes.column(0).into_owned().into())
    }

    /// Where a joint sits on its parent and on its child, m.
    #[must_use]
    pub fn joint(&self, joint: &Joint) -> [Vector3<f64>; 2] {
        if let Some(position) = joint.position {
            return [Vector3::from(position); 2];
        }
        let point = |member: &str, anchor: Option<[f64; 3]>| {
            self.point(member, anchor.as_ref().map(<[f64; 3]>::as_slice))
        };
        [point(&joint.parent, joint.anchor_parent), point(&joint.child, joint.anchor_child)]
    }
}

/// Lengths at least, m: the fourth power of a shorter one is nearly rounded to zero.
pub(crate) const SHORTEST: f64 = 1e-50;

/// Whether two points are one to rounding, or too near for computations.
pub(crate) fn coincide([a, b]: &[Vector3<f64>; 2]) -> bool {
    (b - a).norm() <= (1e-14 * a.amax().max(b.amax())).max(SHORTEST)
}

/// Distance of two points, m.
pub(crate) fn distance([a, b]: [Vector3<f64>; 2]) -> f64 {
    (b - a).norm()
}

/// Bars and joints whose initial position errors exceed the tolerance.
pub(crate) fn inconsistencies(model: &Model) -> Vec<Inconsistency> {
    let points = StartPoints::new(model);
    let tolerance = model.settings.start_tolerance * points.size(model);
    let bars = model.bars.iter().filter_map(|bar| {
        let (start, length) = (distance(points.bar(bar)), bar.length?);
        let detail =
            format!("its length is {} m, its ends start {} m apart", short(length), short(start));
        missed(format!("bar.{}.length", bar.name), (start - length).abs(), tolerance, detail)
    });
    let joints = model.joints.iter().filter_map(|joint| {
        let [parent, child] = points.joint(joint);
        let distance = gap(joint, child - parent);
        let detail = format!(
            "anchor_parent is at {} m, anchor_child at {} m",
            triple(parent),
            triple(child)
        );
        missed(format!("joint.{}.anchor_child", joint.name), distance, tolerance, detail)
    });
    let wheels = model.constraints.iter().filter_map(|constraint| {
        let height = height(constraint, &points)?;
        let side = if height > 0.0 { "above" } else { "below" };
        let detail = format!("it starts {} m {side} the plane", short(height.abs()));
        missed(format!("constraint.{}", constraint.name()), height.abs(), tolerance, detail)
    });
    bars.chain(joints).chain(wheels).collect()
}

/// The height of the lowest point of what rolls above its plane, m.
fn height(constraint: &Constraint, points: &StartPoints<'_>) -> Option<f64> {
    let Constraint::Rolling { body, axis, radius, tube, plane, .. } = constraint else {
        return None;
    };
    let normal = Vector3::from(plane.normal).normalize();
    let center = points.point(body, None);
    let reach = axis.map_or(*radius, |axis| {
        let along = normal.dot(&Vector3::from(axis).normalize());
        tube + (radius - tube) * (1.0 - along * along).max(0.0).sqrt()
    });
    Some(normal.dot(&(center - Vector3::from(plane.position))) - reach)
}

fn missed(key: String, distance: f64, tolerance: f64, detail: String) -> Option<Inconsistency> {
    let level = Level::Position;
    let (unit, instead) = ("m", None);
    let found = Inconsistency { key, level, distance, unit, detail, instead };
    (distance > tolerance).then_some(found)
}

/// The part of the gap that a joint does not allow, m.
fn gap(joint: &Joint, gap: Vector3<f64>) -> f64 {
    let axis = joint.axis.map(|a| Vector3::from(a).normalize()).unwrap_or_default();
    let along = gap.dot(&axis);
    let open = |constraint: &PairConstraint| match constraint {
        PairConstraint::NoGap => gap.norm(),
        PairConstraint::GapAlongAxis => (gap - axis * along).norm(),
        PairConstraint::GapAcrossAxis => along.abs(),
        _ => 0.0,
    };
    joint.kind.pair(None).properties().constraints.iter().map(open).fold(0.0, f64::max)
}

fn triple(v: Vector3<f64>) -> String {
    format!("({}, {}, {})", short(v.x), short(v.y), short(v.z))
}

/// A length with twelve digits: what follows is rounding.
fn short(length: f64) -> f64 {
    format!("{length:.11e}").parse().unwrap_or(length)
}

/// Whether a name means the inertial frame.
pub(crate) fn is_ground(name: &str) -> bool {
    name == GROUND
}
