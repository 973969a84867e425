//! Sensors of reactions, efforts of constraints, tensions of bars, accelerations.
//!
//! ```text
//! reaction, effort of a constraint, tension    of λ: that of the step; at the start, by sub-steps
//!                                              that of the acceleration level
//! accelerations of points, bodies and joints   of a: that of the steps on both sides; at the ends of
//!                                              a run, by sub-steps that of the acceleration level
//!     ẍ of a point,   ω̇ = ½ Σ d_I × a_I,   B·(ẍ − γ) and B·ω along an axis B of the unit
//! ```

use super::configuration::point;
use super::{Asked, OfNode, no_derivative, number_of};
use crate::design::{ModelTangent, mechanism_design, refused};
use crate::system::System;
use holonom_model::{Constraint, Model, ModelError, ReactionFrame, Sensor, SensorKind};
use nalgebra::Vector3;
use std::sync::Arc;
use vi_constraints::design::Design;
use vi_constraints::saddle_point::IndependentRows;
use vi_control::node::{Curved, Node, NodeQuantity, NodeReads, NodeSlopes};
use vi_control::terminal_rate::{AccelerationLevel, AddedMasses};
use vi_core::linear::dot;
use vi_core::{Configuration, MechanicalSystem as _};
use vi_multibody::design::reaction::{Axes, ForceNumber, MovedForce, ReactionRows};
use vi_multibody::design::{CoordinateAcceleration, MovedCoordinate};
use vi_multibody::form::Form;
use vi_multibody::law::Input;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::reaction::ReactionObserver;
use vi_multibody::run::MechanismIntegrator;
use vi_multibody::scalar_constraint::ScalarRow;
use vi_rigid::directors::FRAME;

/// A number that follows from the multipliers of a node.
struct TransmittedNumber {
    mechanism: Arc<Mechanism>,
    number: ForceNumber,
    by: Vec<MovedForce>, // in the order of the parameters
}

impl NodeQuantity for TransmittedNumber {
    fn value(&self, node: Node<'_>) -> f64 {
        self.number.value(&self.mechanism, node.at.q, node.lambda)
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        let slopes = [out.q, out.lambda];
        self.number.add_slopes(&self.mechanism, node.at.q, node.lambda, scale, slopes);
    }
    fn by_parameter(&self, parameter: usize, node: Node<'_>) -> f64 {
        self.by.get(parameter).map_or(0.0, |moved| {
            self.number.by_parameter(&self.mechanism, moved, node.at, node.lambda)
        })
    }
    fn reads(&self) -> NodeReads {
        NodeReads { forces: true, ..NodeReads::default() }
    }
    fn reads_velocity(&self) -> bool {
        false
    }
}

/// `B·(ẍ − γ)`, or a component of `ẍ` where `B` is constant.
struct Felt {
    point: Form,
    along: Form, // B
    gravity: Vector3<f64>,
    by: Vec<(Form, Vector3<f64>)>, // of the point and of γ, in the order of the parameters
}

impl NodeQuantity for Felt {
    fn value(&self, node: Node<'_>) -> f64 {
        self.along.at(node.at.q).dot(&(self.point.rate(node.a) - self.gravity))
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        let felt = self.point.rate(node.a) - self.gravity;
        self.along.add_transposed(&(scale * felt), out.q);
        self.point.add_transposed(&(scale * self.along.at(node.at.q)), out.a);
    }
    fn by_parameter(&self, parameter: usize, node: Node<'_>) -> f64 {
        let own = self.by.get(parameter).map(|(point, gravity)| point.rate(node.a) - gravity);
        own.map_or(0.0, |own| self.along.at(node.at.q).dot(&own))
    }
    fn reads(&self) -> NodeReads {
        NodeReads { accelerations: true, ..NodeReads::default() }
    }
}

/// `B·ω`.
struct Gyro {
    along: Form,
    spins: [Input; 3],
}

impl NodeQuantity for Gyro {
    fn value(&self, node: Node<'_>) -> f64 {
        let along = self.along.at(node.at.q);
        (0..3).map(|k| along[k] * self.spins[k].value(node)).sum()
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, mut out: NodeSlopes<'_>) {
        let along = self.along.at(node.at.q);
        let spin = Vector3::from_fn(|k, _| self.spins[k].value(node));
        self.along.add_transposed(&(scale * spin), out.q);
        for (k, own) in self.spins.iter().enumerate() {
            own.add_slopes(node, scale * along[k], out.again());
        }
    }
    fn curved(&self) -> Option<&dyn Curved> {
        Some(self)
    }
}

/// `B` is linear in `q`.
impl Curved for Gyro {
    fn add_bend(
        &self,
        node: Node<'_>,
        changes: [&[f64]; 2],
        scale: f64,
        [q, of_v]: [&mut [f64]; 2],
    ) {
        let [along, turned] =
            [self.along.at(node.at.q), self.along.rate(changes[0])].map(|b| scale * b);
        let slopes = [0, 1, 2].map(|k| self.spins[k].slopes_at(node));
        let spin = Vector3::from_fn(|k, _| {
            let [by_q, by_v] = &slopes[k];
            scale * (dot(by_q, changes[0]) + dot(by_v, changes[1]))
        });
        self.along.add_transposed(&spin, q);
        for ((own, [by_q, by_v]), (along, turned)) in
            self.spins.iter().zip(&slopes).zip(along.iter().zip(&turned))
        {
            own.add_bend(node, changes, *along, [&mut *q, &mut *of_v]);
            for (out, by) in [(&mut *q, by_q), (&mut *of_v, by_v)] {
                out.iter_mut().zip(by).for_each(|(out, by)| *out += turned * by);
            }
        }
    }
}

/// A component of an angular acceleration: that of an angular velocity with `a` in the place of
/// `v̂`.
struct AngularAcceleration(Input);

impl NodeQuantity for AngularAcceleration {
    fn value(&self, node: Node<'_>) -> f64 {
        self.0.value(Node::moving(node.at.moving(node.a)))
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        let out = NodeSlopes { v: out.a, a: &mut [], ..out };
        self.0.add_slopes(Node::moving(node.at.moving(node.a)), scale, out);
    }
    fn reads(&self) -> NodeReads {
        NodeReads { accelerations: true, ..NodeReads::default() }
    }
}

/// The acceleration of a joint coordinate.
struct JointTurning {
    own: CoordinateAcceleration,
    by: Vec<Option<MovedCoordinate>>, // in the order of the parameters
}

impl NodeQuantity for JointTurning {
    fn value(&self, node: Node<'_>) -> f64 {
        self.own.value([node.at.q, node.v, node.a])
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        self.own.add_slopes([node.at.q, node.v, node.a], scale, [out.q, out.v, out.a]);
    }
    fn by_parameter(&self, parameter: usize, node: Node<'_>) -> f64 {
        let moved = self.by.get(parameter).and_then(Option::as_ref);
        moved.map_or(0.0, |moved| self.own.by_parameter(moved, [node.at.q, node.v, node.a]))
    }
    fn reads(&self) -> NodeReads {
        NodeReads { accelerations: true, ..NodeReads::default() }
    }
}

/// What a sensor of forces of constraints or of accelerations shows; `None` of others.
///
/// # Errors
/// [`ModelError`] of one that has no derivative.
pub(crate) fn of_sensor(asked: Asked<'_>, rows: &IndependentRows) -> OfNode {
    let Asked { model, system, key, of, tangents } = asked;
    let sensor = of.0;
    let Some(number) = number(model, system, key, of)? else { return accelerated(asked) };
    let mechanism = &system.mechanism;
    if !is_unique(mechanism, rows, &number) {
        let what = format!(
            "the derivative of the sensor `{}`, which a redundant loop does not determine",
            sensor.name
        );
        let help = "take a joint or a component that is unique, as the sensor shows";
        return Err(refused(key, what, help));
    }
    let moved = tangents.iter().map(|own| number.moved(mechanism, &own.numbers));
    let by = moved.collect::<Result<_, _>>();
    let by = by.map_err(|error| refused(key, error.to_string(), "leave the parameter out"))?;
    let mechanism = Arc::new(mechanism.clone());
    Ok(Some(Box::new(TransmittedNumber { mechanism, number, by })))
}

/// The number of accelerations that a sensor shows.
fn accelerated(asked: Asked<'_>) -> OfNode {
    let Asked { model, system, of: (sensor, _), tangents, .. } = asked;
    if sensor.kind == SensorKind::JointAcceleration {
        let freedom = asked.number()?;
        let joint = model.joints.iter().position(|own| own.name == sensor.of);
        let own = joint.and_then(|joint| system.mechanism.known_coordinate(joint, freedom));
        let own = own.ok_or_else(|| asked.refused())?;
        let moved =
            |tangent: &ModelTangent| MovedCoordinate::of(&system.mechanism, &tangent.numbers, &own);
        let by = tangents.iter().map(moved).collect();
        return Ok(Some(Box::new(JointTurning { own: CoordinateAcceleration::of(&own), by })));
    }
    let is_imu = sensor.kind == SensorKind::Imu;
    let is_turning = sensor.kind == SensorKind::AngularAcceleration;
    if !(is_imu || is_turning || sensor.kind == SensorKind::Acceleration) {
        return Ok(None);
    }
    let (mechanism, part) = (&system.mechanism, asked.number()?);
    let spin = |axis| model.frame(&sensor.of).map(|frame| Input::Spin(FRAME * frame, axis));
    if is_turning {
        let spin = spin(part).ok_or_else(|| asked.refused())?;
        return Ok(Some(Box::new(AngularAcceleration(spin))));
    }
    let along = match is_imu {
        false => Form::constant(Vector3::ith(part, 1.0)),
        true => {
            let axis: [f64; 3] = sensor.axes().column(part % 3).into_owned().into();
            let end = point(model, mechanism, &sensor.of, Some(axis));
            end.minus(&point(model, mechanism, &sensor.of, None))
        }
    };
    if part >= 3 {
        let spins = [spin(0), spin(1), spin(2)].map(|own| own.unwrap_or(Input::Time));
        return Ok(Some(Box::new(Gyro { along, spins })));
    }
    let felt = |x: Vector3<f64>| if is_imu { x } else { Vector3::zeros() };
    let still = || Form::constant(Vector3::zeros());
    let change = |own: &ModelTangent| {
        let point = own.sensors.get(&sensor.name).cloned().unwrap_or_else(still);
        (point, felt(own.numbers.gravity))
    };
    Ok(Some(Box::new(Felt {
        point: point(model, mechanism, &sensor.of, sensor.point),
        along,
        gravity: felt(mechanism.description().gravity),
        by: tangents.iter().map(change).collect(),
    })))
}

/// What the acceleration level of a run follows from.
///
/// # Errors
/// [`ModelError`] where it has no derivative.
pub(crate) fn level(
    system: &System,
    tangents: &[ModelTangent],
) -> Result<AccelerationLevel, ModelError> {
    let System { mechanism, dynamics, .. } = system;
    let mass = dynamics.parts.mass_matrix(mechanism);
    let design: Option<Arc<dyn Design + Send + Sync>> = match tangents {
        [] => None,
        tangents => Some(Arc::new(mechanism_design(system, &mass, tangents)?)),
    };
    let rests = system.stands;
    Ok(AccelerationLevel { system: Arc::new(dynamics.variational(mechanism)), design, rests })
}

/// The system of a run whose steps add to the masses, where velocities are read.
pub(crate) fn masses(
    (model, system): (&Model, &System),
    run: &MechanismIntegrator,
    are_read: bool,
) -> Option<AddedMasses> {
    let System { mechanism, dynamics, .. } = system;
    let adds = are_read && run.system().adds_mass();
    adds.then(|| AddedMasses {
        system: Arc::new(dynamics.variational(mechanism)),
        step: model.settings.step,
    })
}

/// The number of multipliers that a sensor shows.
fn number(
    model: &Model,
    system: &System,
    key: &str,
    (sensor, part): (&Sensor, Option<&str>),
) -> Result<Option<ForceNumber>, ModelError> {
    let description = system.mechanism.description();
    let of = sensor.of.as_str();
    let scalar = || description.scalars.iter().position(|own| own.name == of);
    match sensor.kind {
        SensorKind::Reaction => {}
        SensorKind::Effort if scalar().is_some() => {}
        _ => return Ok(None),
    }
    let part = number_of(model, key, (sensor, part))?;
    if sensor.kind == SensorKind::Effort {
        let Some(k) = scalar() else { return Ok(None) };
        let rows = system.mechanism.scalar_rows(k);
        let rows = rows.start..rows.start + 1;
        let factor = match description.scalars[k].rows.first() {
            Some(ScalarRow::Product(distance)) => distance.target.sqrt(), // l, c = l²
            _ => -1.0,
        };
        return Ok(Some(ForceNumber::Rows { rows, factor, of: ReactionRows::Scalar(k) }));
    }
    if let Some(k) = description.bars.iter().position(|own| own.name == of) {
        let (rows, factor) = (system.mechanism.bar_rows(k), description.bars[k].length);
        return Ok(Some(ForceNumber::Rows { rows, factor, of: ReactionRows::Bar(k) }));
    }
    let held = model.constraints.iter().find(|own| own.name() == of && own.carries_a_body());
    if let (Some(Constraint::Rolling { body, .. } | Constraint::Blade { body, .. }), Some(scalar)) =
        (held, scalar())
    {
        let frame = model.frame(body).ok_or_else(|| no_derivative(key, sensor))?;
        return Ok(Some(ForceNumber::Carried { scalar, frame, axis: part }));
    }
    let joint = description.joints.iter().position(|own| own.name == of);
    let joint = joint.ok_or_else(|| no_derivative(key, sensor))?;
    let axes = match sensor.frame.unwrap_or_default() {
        ReactionFrame::Parent => Axes::Parent,
        ReactionFrame::Child => Axes::Child,
        ReactionFrame::Space => Axes::Space,
    };
    Ok(Some(ForceNumber::Reaction { joint, axes, part }))
}

/// Whether such a number is determined at the initial configuration.
fn is_unique(mechanism: &Mechanism, rows: &IndependentRows, number: &ForceNumber) -> bool {
    let q = mechanism.initial_configuration();
    let at = Configuration::new(0.0, &q);
    let mut observer = ReactionObserver::new(mechanism);
    let force = vec![0.0; q.len()];
    let found = observer.observe(mechanism, at, &force, rows);
    match number {
        ForceNumber::Reaction { joint, axes, part } => {
            let reaction = match axes {
                Axes::Parent => found.joint(*joint),
                Axes::Child => found.joint_along_child(*joint),
                Axes::Space => found.joint_along(*joint, &nalgebra::Matrix3::identity()),
            };
            reaction.unique[*part]
        }
        ForceNumber::Carried { scalar, axis, .. } => found.scalar_force(*scalar).1[*axis],
        ForceNumber::Rows { of: ReactionRows::Bar(k), .. } => found.bar(*k).unique,
        ForceNumber::Rows { rows, .. } => found.scalar_row(rows.start).unique,
    }
}
