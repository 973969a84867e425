//! From a validated model to numbers: mechanism, system, members.

use crate::beams::{self, BeamParts, Beams};
use crate::drive;
use crate::dynamics::Dynamics;
use crate::model::{self, Constraint, Frame, JointKind, Model, ModelError, StartPoints};
use crate::sample::{Member, MemberKind};
use crate::sensor::Sensors;
use crate::start_rates;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::sync::Arc;
use vi_beam::BeamModel;
use vi_multibody::form::Form;
use vi_multibody::joint::{FrameId, GROUND, Joint, Side, complete_axis};
use vi_multibody::mechanism::{
    Attachment, Bar, BarEnd, BodySpec, Description, Mechanism, ParticleSpec,
};
use vi_multibody::pair::PairKind;
use vi_multibody::scalar_constraint::ScalarConstraint;
use vi_multibody::spring::{Damper, Spring, SpringLaw};
use vi_rigid::body::RigidBody;
use vi_rigid::directors;
use vi_rigid::inertia::{InertiaError, PrincipalInertia};
use vi_rigid::load::{Load, LoadError, LoadKind};

/// The numbers of a model.
pub struct System {
    /// The beams, with all parts of the mechanism.
    pub beams: Beams,
    /// Constraints, masses, spanning tree.
    pub mechanism: Mechanism,
    /// What acts on it.
    pub dynamics: Dynamics,
    /// The loads on bodies, nodes and beams; they are part of the dynamics.
    pub loads: Vec<Load>,
    /// Members in the order of their coordinates.
    pub members: Vec<Member>,
    /// What is measured along a run.
    pub sensors: Sensors,
}

/// Where the names of a model are among its members.
struct Names<'a> {
    model: &'a Model,
    bodies: BTreeMap<&'a str, usize>,
    particles: BTreeMap<&'a str, usize>,
    principal: Vec<Matrix3<f64>>, // of all frames: body components → principal components: its transpose
}

impl Names<'_> {
    /// A body, or a node of a beam.
    fn index(&self, name: &str) -> Option<usize> {
        self.bodies.get(name).copied().or_else(|| self.model.frame(name))
    }

    fn frame(&self, name: &str) -> FrameId {
        self.index(name).map_or(FrameId::Ground, FrameId::Frame)
    }

    fn attachment(&self, name: &str) -> Attachment {
        match (self.index(name), self.particles.get(name)) {
            (Some(k), _) => Attachment::Body(k),
            (_, Some(&k)) => Attachment::Particle(k),
            _ => Attachment::Ground,
        }
    }

    /// Components along the directors of a vector given in the body's own frame.
    fn along_directors(&self, name: &str, components: &Vector3<f64>) -> Vector3<f64> {
        match self.index(name) {
            Some(k) => self.principal[k].transpose() * components,
            None => *components,
        }
    }
}

/// Builds the system of a model.
///
/// # Errors
/// [`ModelError`] for what only shows when numbers meet: inertias, loads.
pub fn build(model: &Model) -> Result<System, ModelError> {
    let mut names = Names {
        model,
        bodies: model.bodies.iter().enumerate().map(|(k, b)| (b.name.as_str(), k)).collect(),
        particles: model.particles.iter().enumerate().map(|(k, p)| (p.name.as_str(), k)).collect(),
        principal: Vec::new(),
    };
    let mut parts = BeamModel::new(Vector3::from(model.gravity()));
    for body in &model.bodies {
        let (spec, axes) = rigid_body(body)?;
        parts.add_frame(spec);
        names.principal.push(axes);
    }
    let list = beams::add(model, &mut parts)?;
    let supports = std::mem::take(&mut parts.description.joints);
    let bodies = &parts.description.bodies;
    names.principal.resize(bodies.len(), Matrix3::identity());
    let point = |x: &[f64]| Vector3::from(model::spatial(x));
    let particles = model.particles.iter().map(|particle| ParticleSpec {
        name: particle.name.clone(),
        mass: particle.mass,
        position: point(&particle.position),
        velocity: point(&particle.velocity),
    });
    let start = StartPoints::new(model);
    let mut joints: Vec<Joint> =
        model.joints.iter().map(|j| joint(j, &start, bodies, &names)).collect();
    joints.extend(model.bodies.iter().enumerate().filter(|(_, b)| b.fixed).map(|(k, body)| {
        let sides = [FrameId::Ground, FrameId::Frame(k)];
        let point = bodies[k].center;
        make_joint(&body.name, PairKind::Fixed, sides, [point; 2], &Matrix3::identity(), bodies)
    }));
    joints.extend(supports);
    let cuts = (0..model.joints.len()).filter(|&k| model.joints[k].cut).collect();
    let scalars = scalar_constraints(model, &joints, bodies, &names)?;
    let mut description = Description {
        dimension: model.header.dimension,
        gravity: parts.description.gravity,
        particles: particles.collect(),
        bars: model.bars.iter().map(|b| bar(b, &start, &names)).collect(),
        bodies: bodies.clone(),
        joints,
        scalars,
        cuts,
    };
    start_rates::apply(model, &mut description)?;
    parts.description = description;
    let mut mechanism = parts.mechanism();
    let settings = &model.settings;
    let mut dynamics =
        Dynamics::new(&parts, &mechanism, settings.strain.into(), settings.quadrature.into());
    for spring in &model.springs {
        dynamics = add_spring(dynamics, spring, &mechanism, &names);
    }
    for (k, joint) in model.joints.iter().enumerate() {
        dynamics = drive::add_joint_forces(dynamics, joint, (&mut mechanism, k))?;
    }
    let mut all = Vec::new();
    for load in &model.loads {
        all.extend(loads(load, &names, &parts, &list)?);
    }
    for load in &all {
        dynamics = dynamics.load(load.clone());
    }
    let members = members(model, &parts);
    let beams = Beams { parts: Arc::new(parts), list };
    let sensors = Sensors::new(model, &mechanism, &names.principal, &beams);
    Ok(System { beams, mechanism, dynamics, loads: all, members, sensors })
}

fn members(model: &Model, parts: &BeamModel) -> Vec<Member> {
    let particle =
        if model.header.dimension == 2 { MemberKind::Particle2 } else { MemberKind::Particle3 };
    let bodies = parts.description.bodies.iter().map(|b| (&b.name, MemberKind::Frame));
    let particles = model.particles.iter().map(|p| (&p.name, particle));
    bodies.chain(particles).map(|(name, kind)| Member { name: name.clone(), kind }).collect()
}

/// A body with its directors along the principal axes; also returns these axes in its own frame.
fn rigid_body(body: &model::Body) -> Result<(BodySpec, Matrix3<f64>), ModelError> {
    let refuse = |error: InertiaError| {
        let key = format!("body.{}.inertia", body.name);
        let help = "check the unit (kg·m²) and that the moments are about the centre of mass";
        ModelError::Assembly(vec![model::Problem::new(key, error.to_string()).help(help)])
    };
    let massless = body.fixed && body.mass() <= 0.0;
    let (rigid, axes) = if massless {
        (None, Matrix3::identity())
    } else {
        let (inertia, axes) =
            PrincipalInertia::from_tensor(&body.inertia_tensor()).map_err(refuse)?;
        (Some(RigidBody::from_inertia(body.mass(), &inertia).map_err(refuse)?), axes)
    };
    let moving = |v: Vector3<f64>| if body.fixed { Vector3::zeros() } else { v };
    let spec = BodySpec {
        name: body.name.clone(),
        body: rigid,
        center: Vector3::from(body.position),
        triad: body.rotation() * axes,
        velocity: moving(Vector3::from(body.velocity)),
        omega: moving(body.spatial_angular_velocity()),
    };
    Ok((spec, axes))
}

/// The kinematic pair of a type of joint; `pitch` in m per turn.
pub(crate) fn pair_kind(kind: JointKind, pitch: Option<f64>) -> PairKind {
    match kind {
        JointKind::Spherical => PairKind::Spherical,
        JointKind::Revolute => PairKind::Revolute,
        JointKind::Cylindrical => PairKind::Cylindrical,
        JointKind::Prismatic => PairKind::Prismatic,
        JointKind::Planar => PairKind::Planar,
        JointKind::Fixed => PairKind::Fixed,
        JointKind::Universal => PairKind::Universal,
        JointKind::Screw => {
            let per_turn = pitch.unwrap_or_default();
            PairKind::Screw((per_turn / std::f64::consts::TAU).into())
        }
    }
}

fn joint(
    joint: &model::Joint,
    start: &StartPoints<'_>,
    bodies: &[BodySpec],
    names: &Names<'_>,
) -> Joint {
    let kind = pair_kind(joint.kind, joint.pitch);
    let axes = match (joint.axis, joint.axis2) {
        (Some(axis), Some(second)) => crossing_axes(&axis, &second),
        (Some(axis), None) => complete_axis(&Vector3::from(axis).normalize()),
        (None, _) => Matrix3::identity(),
    };
    let sides = [names.frame(&joint.parent), names.frame(&joint.child)];
    make_joint(&joint.name, kind, sides, start.joint(joint), &axes, bodies)
}

/// `(m_1, m_2, n)` with `n` along the first axis and `m_1` along the second.
fn crossing_axes(first: &[f64; 3], second: &[f64; 3]) -> Matrix3<f64> {
    let n = Vector3::from(*first).normalize();
    let second = Vector3::from(*second);
    let m1 = (second - n * n.dot(&second)).normalize();
    Matrix3::from_columns(&[m1, n.cross(&m1), n])
}

/// The `[[constraint]]`s in their order.
fn scalar_constraints(
    model: &Model,
    joints: &[Joint],
    bodies: &[BodySpec],
    names: &Names<'_>,
) -> Result<Vec<ScalarConstraint>, ModelError> {
    let mut q = vec![0.0; 12 * bodies.len()];
    for (k, body) in bodies.iter().enumerate() {
        directors::set_frame(&mut q[12 * k..12 * k + 12], &body.center, &body.triad);
    }
    let guide = |name: &str, [parent, child]: [&String; 2], position: &[f64; 3], axis| {
        let axes = complete_axis(&drive::vector(axis).normalize());
        let sides = [names.frame(parent), names.frame(child)];
        make_joint(name, PairKind::Free, sides, [drive::vector(position); 2], &axes, bodies)
    };
    let point = |member: &str, components: &[f64; 3]| {
        let along = names.along_directors(member, &drive::vector(components));
        match names.index(member) {
            Some(k) => Form::point(12 * k, &along),
            None => Form::constant(along),
        }
    };
    let mut scalars = Vec::new();
    for constraint in &model.constraints {
        let made = match constraint {
            Constraint::Distance { name, from, to, point_from, point_to, length } => {
                let between = point(to, point_to).minus(&point(from, point_from));
                let length = length.unwrap_or_else(|| between.at(&q).norm());
                Some(ScalarConstraint::distance(name, &between, length))
            }
            Constraint::PointOnLine { name, parent, child, position, axis } => {
                Some(ScalarConstraint::point_on_line(&guide(name, [parent, child], position, axis)))
            }
            Constraint::PointOnPlane { name, parent, child, position, axis } => Some(
                ScalarConstraint::point_on_plane(&guide(name, [parent, child], position, axis)),
            ),
            _ => drive::coordinate_constraint(constraint, joints, &q)?,
        };
        scalars.extend(made);
    }
    Ok(scalars)
}

fn make_joint(
    name: &str,
    kind: PairKind,
    [parent, child]: [FrameId; 2],
    points: [Vector3<f64>; 2],
    axes: &Matrix3<f64>,
    bodies: &[BodySpec],
) -> Joint {
    let side = |frame: FrameId, point: &Vector3<f64>| match frame {
        FrameId::Ground => Side::at(frame, &GROUND, point, axes),
        FrameId::Frame(k) => {
            let mut q = [0.0; 12];
            directors::set_frame(&mut q, &bodies[k].center, &bodies[k].triad);
            Side::at(frame, &q, point, axes)
        }
    };
    let (parent, child) = (side(parent, &points[0]), side(child, &points[1]));
    Joint { name: name.to_owned(), kind, parent, child }
}

fn bar(bar: &model::Bar, start: &StartPoints<'_>, names: &Names<'_>) -> Bar {
    let [from, to] = start.bar(bar);
    let length = bar.length.unwrap_or_else(|| (to - from).norm());
    let end = |name: &str, point| match names.particles.get(name) {
        Some(&k) => BarEnd::Particle(k),
        None => BarEnd::Ground(point),
    };
    let (from, to) = match (end(&bar.from, from), end(&bar.to, to)) {
        (from, BarEnd::Particle(to)) => (from, to),
        (BarEnd::Particle(to), ground) => (ground, to),
        (ground, _) => (ground, 0), // refused by the checks of the model: no particle at either end
    };
    Bar { name: bar.name.clone(), from, to, length }
}

fn add_spring(
    dynamics: Dynamics,
    spring: &model::Spring,
    mechanism: &Mechanism,
    names: &Names<'_>,
) -> Dynamics {
    let end = |name: &str, point: &Option<Vec<f64>>| {
        let own = Vector3::from(model::spatial(point.as_deref().unwrap_or_default()));
        mechanism.point_of(names.attachment(name), &names.along_directors(name, &own))
    };
    let between = end(&spring.to, &spring.point_to).minus(&end(&spring.from, &spring.point_from));
    let law = match spring.law {
        model::SpringLaw::Linear => SpringLaw::Linear,
        model::SpringLaw::QuadraticStretch => SpringLaw::QuadraticStretch,
    };
    let natural_length = spring.natural_length.unwrap_or_default();
    let damper = Damper { between: between.clone(), damping: spring.damping };
    let dynamics =
        dynamics.spring(Spring { between, stiffness: spring.stiffness, natural_length, law });
    if spring.damping == 0.0 {
        return dynamics;
    }
    dynamics.damper(damper)
}

/// The loads of a `[[load]]`: one, or one for each node of a beam.
fn loads(
    load: &model::Load,
    names: &Names<'_>,
    parts: &BeamModel,
    beams: &[BeamParts],
) -> Result<Vec<Load>, ModelError> {
    let refuse = |error: LoadError| {
        let key = format!("load.{}", load.name);
        ModelError::Assembly(vec![model::Problem::new(key, error.to_string())])
    };
    let (force, torque) = (Vector3::from(load.force), Vector3::from(load.torque));
    let kind = match load.frame {
        Frame::Space => LoadKind::Dead,
        Frame::Body => LoadKind::Follower,
    };
    let history = load.history.time_history();
    if let Some(beam) = &load.beam {
        let legs = beams.iter().filter(|b| b.name == *beam).flat_map(|b| &b.legs);
        let along = legs.map(|leg| parts.line_load(leg, kind, force, torque, &history));
        let along: Result<Vec<_>, _> = along.collect();
        return Ok(along.map_err(refuse)?.concat());
    }
    let body = load.body.as_deref().unwrap_or_default();
    let turned = |v: Vector3<f64>| match load.frame {
        Frame::Space => v,
        Frame::Body => names.along_directors(body, &v),
    };
    let frame = names.index(body).unwrap_or_default();
    let point = names.along_directors(body, &Vector3::from(load.point.unwrap_or_default()));
    let made = Load::new(12 * frame, kind, turned(force), turned(torque), history);
    Ok(vec![made.and_then(|load| load.at(point)).map_err(refuse)?])
}
