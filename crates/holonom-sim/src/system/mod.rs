//! From a validated model to numbers: mechanism, system, members.

pub(crate) mod beams;
pub(crate) mod bushing;
pub(crate) mod contact;
pub(crate) mod contact_gaps;
pub mod contact_origin;
pub(crate) mod coordinate;
pub(crate) mod drive;
pub mod dynamics;
pub(crate) mod expression_law;
pub mod held;
pub(crate) mod input;
pub mod joint_contact;
pub(crate) mod joint_drive;
pub(crate) mod law;
pub(crate) mod law_fault;
pub(crate) mod names;
pub mod outside;
mod rates;
pub(crate) mod signal;
pub(crate) mod time_function;
pub(crate) mod works;

use crate::dynamics::Dynamics;
use crate::event::switches::HeldJoint;
use crate::sample::{Member, MemberKind};
use crate::sensor::Sensors;
use crate::system::names::Names;
use beams::{AddedBeams, BeamParts, Beams};
use contact_origin::ContactOrigin;
use holonom_model::{
    Frame, Model, ModelError, Problem, Quantities, Sensor, Settings, StartPoints, Strain,
};
use nalgebra::Vector3;
use outside::ExternalActions;
use std::collections::BTreeMap;
use std::sync::Arc;
use time_function::TimeFunctions;
use vi_beam::{BeamElements, StrainRule};
use vi_multibody::builder::{BodyId, BuildError, Inertia, JointId, MechanismBuilder};
use vi_multibody::joint::FrameId;
use vi_multibody::mechanism::{BarEnd, Mechanism};
use vi_multibody::pair::PairKind;
use vi_multibody::spring::SpringLaw;
use vi_rigid::load::{Load, LoadKind};
use vi_rigid::time_history::TimeHistory;
use works::ForceWork;

/// The numbers of a model.
#[derive(Debug)]
pub struct System {
    /// The beams.
    pub beams: Beams,
    /// Constraints, masses, spanning tree.
    pub mechanism: Mechanism,
    /// What acts on it.
    pub dynamics: Dynamics,
    /// Members in the order of their coordinates.
    pub members: Vec<Member>,
    /// What is measured along a run.
    pub sensors: Sensors,
    /// What its elements with impulses are in the model, in their order.
    pub contacts: Vec<ContactOrigin>,
    /// The laws of the model, which know why they have no value.
    pub(crate) laws: law::Laws,
    /// Whether it stands in an equilibrium, where multipliers are those of the acceleration level.
    pub(crate) stands: bool,
}

/// Builds the system of a model.
///
/// # Errors
/// [`ModelError`] for what only shows when numbers meet: inertias, loads.
pub fn build(model: &Model) -> Result<System, ModelError> {
    build_with(model, &ExternalActions::default())
}

/// The same with what acts from outside.
///
/// # Errors
/// [`ModelError`]; also for what acts on nothing.
pub fn build_with(model: &Model, outside: &ExternalActions) -> Result<System, ModelError> {
    build_sensing(model, outside, &[], &model.sensors)
}

/// The same with joint coordinates that are held, and with these sensors; expressions read those of
/// the model.
pub(crate) fn build_sensing(
    model: &Model,
    outside: &ExternalActions,
    locks: &[HeldJoint],
    sensors: &[Sensor],
) -> Result<System, ModelError> {
    let planar = model.header.dimension == 2;
    let builder = if planar { MechanismBuilder::planar() } else { MechanismBuilder::new() };
    let mut builder = builder.gravity(model.gravity());
    let mut names = Names {
        model,
        bodies: model.bodies.iter().enumerate().map(|(k, b)| (b.name.as_str(), k)).collect(),
        particles: BTreeMap::new(),
        frames: model.bodies.iter().map(|body| add_body(&mut builder, body)).collect(),
        principal: Vec::new(),
        joints: BTreeMap::new(),
        outside,
    };
    builder.description().map_err(refusal)?; // what is wrong with a body is said first
    let AddedBeams { list, mut elements, supports } = beams::add(model, &mut builder)?;
    names.frames = builder.frames().collect();
    for frame in &names.frames {
        names.principal.push(builder.principal_axes(*frame).map_err(refusal)?);
    }
    for p in &model.particles {
        let (position, velocity) =
            (holonom_model::spatial(&p.position), holonom_model::spatial(&p.velocity));
        let particle = builder.particle(&p.name, p.mass, position, velocity);
        names.particles.insert(&p.name, particle);
    }
    let start = StartPoints::new(model);
    for joint in &model.joints {
        let id = add_joint(&mut builder, joint, &start, &names);
        names.joints.insert(&joint.name, (joint, id));
    }
    for (body, id) in model.bodies.iter().zip(&names.frames).filter(|(body, _)| body.fixed) {
        builder.joint(&body.name, PairKind::Fixed, FrameId::Ground, *id).at(body.position);
    }
    supports.iter().for_each(|support| support.add(&mut builder));
    model.bars.iter().for_each(|bar| add_bar(&mut builder, bar, &start, &names));
    let mut times = TimeFunctions::new(model);
    let quantities = Quantities::new(model);
    let mut rates = Vec::new();
    for constraint in &model.constraints {
        drive::add_constraint(&mut builder, constraint, &names, &mut times)?;
        rates.extend(rates::add_rates(&mut builder, constraint, &names, &quantities)?);
    }
    for lock in locks {
        if let Some((_, id)) = names.joint(&lock.joint) {
            builder.hold(&lock.name(), id.coordinate(lock.freedom), lock.value);
        }
    }
    model.springs.iter().for_each(|spring| add_spring(&mut builder, spring, &names));
    let mut contacts = Vec::new();
    for joint in &model.joints {
        drive::add_joint_forces(&mut builder, joint, &names, &mut times)?;
        joint_contact::add_joint_contacts(&mut builder, joint, &names, &mut contacts)?;
    }
    contact::add_contacts(&mut builder, &names, &mut contacts)?;
    let mut terms = signal::Terms::new(&names, &quantities)?;
    let signals = terms.add_signals(&mut builder)?;
    let mut laws = law::add_laws(&mut builder, model, &names, &quantities, &mut terms)?;
    laws.extend(rates.into_iter().map(law::OwnLaw::Rates));
    let bushings = bushing::add_bushings(&mut builder, &names, &quantities, &mut terms)?;
    laws.extend(bushings.into_iter().map(law::OwnLaw::Network));
    held::add_laws(&mut builder, &outside.laws, &names)?;
    for input in &outside.inputs {
        held::add_joint_input(&mut builder, input, &names)?;
    }
    for load in &model.loads {
        let history = times.history(&history_of(load), &load.history);
        add_load(&mut builder, load, history, &names, &elements, &list)?;
    }
    for (load, value) in held::control_loads(model, &outside.inputs) {
        add_load(&mut builder, &load, value, &names, &elements, &list)?;
    }
    laws.extend(times.expressions.into_iter().map(law::OwnLaw::Time));
    laws.extend(times.springs.into_iter().map(law::OwnLaw::Along));
    let description = builder.description().map_err(refusal)?;
    let mechanism = Mechanism::new(description);
    let mut mechanism = mechanism.with_loop_tolerance(model.settings.loop_tolerance);
    let mut forces = builder.forces(&mut mechanism).map_err(refusal)?;
    for (name, freedom) in &outside.counted {
        if let Some(joint) = model.joints.iter().position(|own| own.name == *name) {
            mechanism.coordinate(joint, *freedom);
        }
    }
    laws.extend(bushing::Range::of(model, &forces).into_iter().map(law::OwnLaw::Range));
    forces.forces.extend(held::wrenches(&outside.inputs, &names, &mechanism)?);
    let settings = &model.settings;
    let members = members(model, &mechanism);
    if model.is_nonsmooth() {
        elements.whole = settings.step; // nodes at first touches divide steps
    }
    let parts = Arc::new(elements);
    let (rule, quadrature) = (strain_rule(settings), settings.quadrature.into());
    let work = |force: &String| ForceWork::of(model, force, &mut mechanism, &forces);
    let works = outside.works.iter().map(work).collect();
    let dynamics = Dynamics { parts: parts.clone(), rule, quadrature, forces, works };
    let beams = Beams { parts, list };
    let sensors =
        Sensors::new((&names, sensors), &mechanism, &dynamics, (&beams, signals), &contacts);
    let stands = outside.still.is_some();
    Ok(System { beams, mechanism, dynamics, members, sensors, contacts, laws, stands })
}

/// Compositions need resolved vibrations, which have no added mass; for others it would not help.
fn strain_rule(settings: &Settings) -> StrainRule {
    match settings.strain {
        Strain::MassScaled if settings.order > 2 => StrainRule::Averaged,
        strain => strain.into(),
    }
}

/// The remedy where numbers that are valid one by one give one that is not.
const CORRECT: &str =
    "correct the numbers of this part: what follows from them must be of ordinary size";

/// A refused part of the mechanism as an error of the model.
fn refusal(error: BuildError) -> ModelError {
    let (key, message, help) = match &error {
        BuildError::Inertia { body, source } => {
            let help = "check the unit (kg·m²) and that the moments are about the centre of mass";
            (format!("body.{body}.inertia"), source.to_string(), help.to_owned())
        }
        BuildError::Rate { joint, source } => {
            (format!("joint.{joint}.rate"), source.to_string(), source.help())
        }
        _ => (String::new(), error.to_string(), CORRECT.to_owned()),
    };
    ModelError::Assembly(vec![Problem::new(key, message).help(help)])
}

fn members(model: &Model, mechanism: &Mechanism) -> Vec<Member> {
    let particle =
        if model.header.dimension == 2 { MemberKind::Particle2 } else { MemberKind::Particle3 };
    let bodies = mechanism.description().bodies.iter().map(|b| (&b.name, MemberKind::Frame));
    let particles = model.particles.iter().map(|p| (&p.name, particle));
    bodies.chain(particles).map(|(name, kind)| Member { name: name.clone(), kind }).collect()
}

/// Adds a body; a fixed one is at rest, and may have no mass.
fn add_body(builder: &mut MechanismBuilder, body: &holonom_model::Body) -> BodyId {
    let inertia = if body.fixed && body.mass() <= 0.0 {
        Inertia::Massless
    } else {
        Inertia::tensor(body.mass(), body.inertia_tensor())
    };
    let entry = builder.body(&body.name, inertia).at(body.position).attitude(body.rotation());
    if body.fixed {
        return entry.id();
    }
    entry.velocity(body.velocity).angular_velocity(body.spatial_angular_velocity()).id()
}

fn add_joint(
    builder: &mut MechanismBuilder,
    joint: &holonom_model::Joint,
    start: &StartPoints<'_>,
    names: &Names<'_>,
) -> JointId {
    let kind = joint.pair();
    let (parent, child) = (names.frame(&joint.parent), names.frame(&joint.child));
    let [on_parent, on_child] = start.joint(joint);
    let mut entry = builder.joint(&joint.name, kind, parent, child).anchors(on_parent, on_child);
    if let Some(axis) = joint.axis {
        entry = entry.axis(axis);
    }
    if let Some(axis) = joint.axis2.or_else(|| start.first_axis(joint)) {
        entry = entry.second_axis(axis);
    }
    if let Some(rate) = &joint.rate {
        entry = entry.rates(rate.values());
    }
    if joint.cut {
        entry = entry.cut();
    }
    entry.id()
}

fn add_bar(
    builder: &mut MechanismBuilder,
    bar: &holonom_model::Bar,
    start: &StartPoints<'_>,
    names: &Names<'_>,
) {
    let [from, to] = start.bar(bar);
    let length = bar.length.unwrap_or_else(|| (to - from).norm());
    let end = |name: &str| names.particles.get(name).copied();
    let (other, particle) = match (end(&bar.from), end(&bar.to)) {
        (Some(from), Some(to)) => (BarEnd::from(from), to),
        (None, Some(to)) => (BarEnd::Ground(from), to),
        (Some(from), None) => (BarEnd::Ground(to), from),
        (None, None) => return, // refused by the checks of the model
    };
    builder.bar_of_length(&bar.name, other, particle, length);
}

fn add_spring(builder: &mut MechanismBuilder, spring: &holonom_model::Spring, names: &Names<'_>) {
    let end = |name: &str, point: &Option<Vec<f64>>| {
        names.point(name, holonom_model::spatial(point.as_deref().unwrap_or_default()))
    };
    let (from, to) = (end(&spring.from, &spring.point_from), end(&spring.to, &spring.point_to));
    let law = match spring.law {
        holonom_model::SpringLaw::Linear => SpringLaw::Linear,
        holonom_model::SpringLaw::QuadraticStretch => SpringLaw::QuadraticStretch,
    };
    let entry = builder.spring(from, to, spring.stiffness).named(&spring.name).law(law);
    entry.damping(spring.damping).natural_length(spring.natural_length.unwrap_or_default());
}

/// Which components of a `[[load]]` stay fixed.
pub(crate) fn load_kind(load: &holonom_model::Load) -> LoadKind {
    if load.frame == Frame::Body { LoadKind::Follower } else { LoadKind::Dead }
}

fn history_of(load: &holonom_model::Load) -> String {
    format!("the history of `{}`", load.name)
}

/// Adds a `[[load]]`: one, or one for each node of a beam.
fn add_load(
    builder: &mut MechanismBuilder,
    load: &holonom_model::Load,
    history: TimeHistory,
    names: &Names<'_>,
    parts: &BeamElements,
    beams: &[BeamParts],
) -> Result<(), ModelError> {
    let (force, torque) = (Vector3::from(load.force), Vector3::from(load.torque));
    let kind = load_kind(load);
    if let Some(k) = load.body.as_deref().and_then(|body| names.index(body)) {
        let entry = builder.load(names.frames[k]).force(force).torque(torque).history(history);
        let entry = entry.named(&load.name).point(load.point.unwrap_or_default());
        if kind == LoadKind::Follower {
            entry.follower();
        }
        return Ok(());
    }
    if let Some(particle) = load.body.as_deref().and_then(|name| names.particles.get(name)) {
        builder.particle_load(*particle, load.force, history).named(&load.name);
        return Ok(());
    }
    let along = loads_along(load, [force, torque], &history, parts, beams)?;
    along.into_iter().for_each(|part| builder.load_of_frame(&load.name, part));
    Ok(())
}

/// The loads on nodes that a force and a torque on a beam are, those of a `[[load]]` or their
/// derivatives.
///
/// # Errors
/// [`ModelError`] where one is no number.
pub(crate) fn loads_along(
    load: &holonom_model::Load,
    by: [Vector3<f64>; 2],
    history: &TimeHistory,
    parts: &BeamElements,
    beams: &[BeamParts],
) -> Result<Vec<Load>, ModelError> {
    let ([force, torque], kind) = (by, load_kind(load));
    let beam = beams.iter().filter(|b| Some(&b.name) == load.beam.as_ref());
    let (mut start, mut all) = (0.0, Vec::new());
    let legs: Vec<&vi_beam::Beam> = beam.flat_map(|b| &b.legs).collect();
    for (k, leg) in legs.iter().enumerate() {
        let length = parts.length(leg);
        let own = load.at.map(|at| at - start);
        start += length;
        let along = match own {
            // at a corner on the leg that begins there
            Some(at) if at < 0.0 || (at >= length && k + 1 < legs.len()) => continue,
            Some(at) => parts.load_at(leg, at, kind, [force, torque], history),
            None => parts.line_load(leg, kind, force, torque, history),
        };
        let along = along.map_err(|error| {
            let key = format!("load.{}", load.name);
            ModelError::Assembly(vec![Problem::new(key, error.to_string()).help(CORRECT)])
        })?;
        all.extend(along);
    }
    Ok(all)
}
