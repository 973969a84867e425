//! Efforts of what acts along joints, between points and by laws, and powers, with derivatives.
//!
//! ```text
//! y = τ(t, x, ẋ)  or  y = σ ẋ τ(t, x, ẋ)        x: a joint coordinate or a distance, at (q, v̂)
//! ∂y/∂q = y_x ∇x + y_ẋ D²x v̂,   ∂y/∂v̂ = y_ẋ ∇x,   y_θ = y_x x_θ + y_ẋ (∇x)_θ v̂ + τ_θ
//! y = f(t, q, v̂)·v̂          power of a law, a bushing or a load
//! ∂y/∂q = f_qᵀ v̂,   ∂y/∂v̂ = f + f_vᵀ v̂,   y_θ = f_θ·v̂
//! ```
//! Efforts of laws and bushings change with whatever they read; `τ_θ` is what the law states whose
//! expressions are replaced by their derivatives. The efforts are those of [`crate::sensor`].

use super::configuration::{MeasuredNumber, Sensed};
use super::{no_derivative, number_of};
use crate::design::ModelTangent;
use crate::sensor::{EffortSensor, columns_of};
use crate::system::System;
use crate::system::joint_drive::{ElementLaw, JointDrive};
use holonom_model::{Model, ModelError, Sensor, SensorKind};
use std::ops::Range;
use std::sync::Arc;
use vi_control::node::{Curved, Node, NodeQuantity, NodeSlopes};
use vi_control::objective::Quantity;
use vi_core::discrete_lagrangian::DiscreteLagrangian as _;
use vi_core::interval::Interval;
use vi_core::linear::dot;
use vi_core::num_dual::Dual64;
use vi_core::sparse::{Block, Product};
use vi_core::{Configuration, MechanicalSystem as _, Motion, SeparableSystem};
use vi_multibody::builder::{ElementForce, ForceElements, NamedForce};
use vi_multibody::design::{EffortTangent, MovedCoordinate, MovedFrames, SpringTangent};
use vi_multibody::form::Form;
use vi_multibody::joint_force::{EffortBends, EffortSlopes, JointForce, JointLaw};
use vi_multibody::law::Input;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::six_coordinates::Vector6;
use vi_multibody::spring::{Damper, Spring};
use vi_rigid::load::{Load, LoadChange};

/// What acts along a coordinate.
enum CoordinateAction {
    /// The elements of a joint of one kind.
    Elements(Vec<JointDrive>),
    /// A spring between points with its damper.
    Spring(Box<Spring>, Box<Damper>),
}

impl CoordinateAction {
    /// `τ` and its derivatives.
    fn effort(&self, t: f64, x: f64, rate: f64) -> (f64, EffortSlopes) {
        let mut sum = (0.0, EffortSlopes::default());
        match self {
            Self::Elements(all) => {
                for (effort, slopes) in all.iter().map(|own| own.effort_and_slopes(t, x, rate)) {
                    sum.0 += effort;
                    sum.1.by_coordinate += slopes.by_coordinate;
                    sum.1.by_rate += slopes.by_rate;
                }
            }
            Self::Spring(spring, damper) => {
                let own = with_tangent(spring, None).tension_at(Dual64::new(x, 1.0));
                sum.0 = own.re + damper.damping * rate;
                sum.1 = EffortSlopes { by_coordinate: own.eps, by_rate: damper.damping };
            }
        }
        sum
    }
}

impl CoordinateAction {
    /// The second derivatives of `τ`.
    fn bends(&self, t: f64, x: f64, rate: f64) -> EffortBends {
        let mut sum = EffortBends::default();
        match self {
            Self::Elements(all) => {
                for own in all.iter().map(|own| own.bends(t, x, rate)) {
                    sum.by_coordinate += own.by_coordinate;
                    sum.mixed += own.mixed;
                    sum.by_rate += own.by_rate;
                }
            }
            Self::Spring(spring, _) => sum.by_coordinate = spring.tension_bend(x),
        }
        sum
    }
}

/// A spring with its derivative by a parameter.
fn with_tangent(spring: &Spring, change: Option<&SpringTangent>) -> Spring<Dual64> {
    let Spring { between, stiffness, natural_length, law } = spring;
    let [by_stiffness, by_length] =
        change.map_or([0.0; 2], |own| [own.stiffness, own.natural_length]);
    let still = Form::constant(nalgebra::Vector3::zeros());
    Spring {
        between: between.with_tangent(&still),
        stiffness: Dual64::new(*stiffness, by_stiffness),
        natural_length: Dual64::new(*natural_length, by_length),
        law: *law,
    }
}

/// An effort along a coordinate, or its power.
struct AlongCoordinate {
    inputs: [Input; 2], // x, ẋ
    moved: Sensed,      // x, by parameters
    acts: CoordinateAction,
    by: Vec<Vec<EffortTangent>>, // τ_θ, in the order of the parameters
    power: Option<f64>,          // σ
}

impl AlongCoordinate {
    fn seen(&self, at: Motion<'_>) -> [f64; 2] {
        [0, 1].map(|k| self.inputs[k].value(Node::moving(at)))
    }

    /// `y`, with `y_x` and `y_ẋ`.
    fn slopes(&self, at: Motion<'_>) -> [f64; 3] {
        let [x, rate] = self.seen(at);
        let (effort, EffortSlopes { by_coordinate, by_rate }) = self.acts.effort(at.t, x, rate);
        match self.power {
            None => [effort, by_coordinate, by_rate],
            Some(sign) => [
                sign * rate * effort,
                sign * rate * by_coordinate,
                sign * (effort + rate * by_rate),
            ],
        }
    }
}

/// `y_x D²x + y_ẋ D²ẋ` and the second derivatives of `y` by both.
impl Curved for AlongCoordinate {
    fn add_bend(
        &self,
        node: Node<'_>,
        changes: [&[f64]; 2],
        scale: f64,
        [q, of_v]: [&mut [f64]; 2],
    ) {
        let [x, rate] = self.seen(node.at.moving(node.v));
        let [_, by_coordinate, by_rate] = self.slopes(node.at.moving(node.v));
        let mut bends = self.acts.bends(node.at.t, x, rate);
        if let Some(sign) = self.power {
            let (_, slopes) = self.acts.effort(node.at.t, x, rate);
            bends.by_coordinate *= sign * rate;
            bends.mixed = sign * (slopes.by_coordinate + rate * bends.mixed);
            bends.by_rate = sign * (2.0 * slopes.by_rate + rate * bends.by_rate);
        }
        let slopes = self.inputs.each_ref().map(|input| input.slopes_at(node));
        let [dx, dv] = slopes.each_ref().map(|[q, v]| dot(q, changes[0]) + dot(v, changes[1]));
        let turned =
            [bends.by_coordinate * dx + bends.mixed * dv, bends.mixed * dx + bends.by_rate * dv];
        let each = self.inputs.iter().zip([by_coordinate, by_rate]).zip(&slopes).zip(turned);
        for (((input, slope), [by_q, by_v]), turned) in each {
            input.add_bend(node, changes, scale * slope, [&mut *q, &mut *of_v]);
            for (out, by) in [(&mut *q, by_q), (&mut *of_v, by_v)] {
                out.iter_mut().zip(by).for_each(|(out, by)| *out += scale * turned * by);
            }
        }
    }
}

impl NodeQuantity for AlongCoordinate {
    fn curved(&self) -> Option<&dyn Curved> {
        Some(self)
    }
    fn reads_time(&self) -> bool {
        // springs beside numbers follow paths
        let moves = |own: &JointDrive| match own.part {
            "motor" => true,
            "spring" => matches!(own.law, ElementLaw::Force(_)),
            _ => false,
        };
        matches!(&self.acts, CoordinateAction::Elements(all) if all.iter().any(moves))
    }
    fn value(&self, Node { at, v, .. }: Node<'_>) -> f64 {
        self.slopes(at.moving(v))[0]
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, mut out: NodeSlopes<'_>) {
        let [_, by_coordinate, by_rate] = self.slopes(node.at.moving(node.v));
        for (input, slope) in self.inputs.iter().zip([by_coordinate, by_rate]) {
            input.add_slopes(node, scale * slope, out.again());
        }
    }
    fn by_parameter(&self, parameter: usize, Node { at, v, .. }: Node<'_>) -> f64 {
        let [_, by_coordinate, by_rate] = self.slopes(at.moving(v));
        let [x, rate] = self.seen(at.moving(v));
        let own = self.by.get(parameter).into_iter().flatten();
        let own: f64 = own.map(|by| by(at.t, x, rate)).sum();
        by_coordinate * self.moved.by_parameter(parameter, at)
            + by_rate * self.moved.rate_by_parameter(parameter, at.moving(v))
            + self.power.map_or(1.0, |sign| sign * rate) * own
    }
}

/// A number of the efforts that a law or a bushing states.
struct StatedEffort {
    forces: ForceElements,
    /// Of a bushing.
    name: Option<String>,
    part: usize,
    signals: Range<usize>,
    by: Vec<ForceElements>, // the derivatives, in the order of the parameters
    moved: Vec<Option<MovedCoordinate>>, // the coordinate of a law along a joint
    frames: Vec<Option<MovedFrames>>, // of a bushing
}

impl StatedEffort {
    fn of(&self, forces: &ForceElements, at: Motion<'_>) -> f64 {
        let at = with_signals(at.configuration(), &self.signals).moving(at.v);
        match &self.name {
            Some(name) => forces.bushing_efforts(name, at).map_or(0.0, |own| own[self.part]),
            None => {
                let own = forces.forces.iter().find_map(|own| own.efforts(at));
                own.map_or(0.0, |(efforts, _)| efforts[self.part])
            }
        }
    }
}

/// Of what reads no states: others have memory.
impl Curved for StatedEffort {
    fn add_bend(
        &self,
        Node { at, v, .. }: Node<'_>,
        changes: [&[f64]; 2],
        scale: f64,
        out: [&mut [f64]; 2],
    ) {
        let (at, effort) = (with_signals(at, &self.signals), (self.part, scale));
        match &self.name {
            Some(name) => self.forces.add_bushing_bends(name, at.moving(v), effort, changes, out),
            None => {
                let law = self.forces.forces.iter().find(|own| own.efforts(at.moving(v)).is_some());
                if let Some(own) = law {
                    own.add_effort_bends(at.moving(v), effort, changes, out);
                }
            }
        }
    }
}

impl NodeQuantity for StatedEffort {
    fn curved(&self) -> Option<&dyn Curved> {
        Some(self)
    }
    fn reads_time(&self) -> bool {
        true // its expressions may
    }
    fn value(&self, Node { at, v, .. }: Node<'_>) -> f64 {
        self.of(&self.forces, at.moving(v))
    }
    fn add_slopes(&self, Node { at, v, .. }: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        let at = with_signals(at, &self.signals);
        let of_z = out.z.get_mut(self.signals.clone()).unwrap_or_default();
        let out = [out.q, out.v, of_z];
        match &self.name {
            Some(name) => {
                let w = Vector6::ith(self.part, scale);
                self.forces.add_bushing_slopes(name, at.moving(v), &w, out);
            }
            None => {
                let law = self.forces.forces.iter().find(|own| own.efforts(at.moving(v)).is_some());
                if let Some(own) = law {
                    own.add_effort_slopes(at.moving(v), self.part, scale, out);
                }
            }
        }
    }
    fn by_parameter(&self, parameter: usize, Node { at, v, .. }: Node<'_>) -> f64 {
        let own = self.by.get(parameter).map_or(0.0, |own| self.of(own, at.moving(v)));
        let moved = self.moved.get(parameter).and_then(Option::as_ref);
        let along = moved.zip(along(&self.forces)).map(|(moved, force)| {
            let (x, rate) = (force.coordinate.at(at), force.coordinate.rate(at.q, v));
            let slopes = force.law.slopes(at.t, x, rate);
            slopes.by_coordinate * moved.by(at.q) + slopes.by_rate * moved.rate_by(at.q, v)
        });
        own + along.unwrap_or(0.0) + by_frames(self, &self.frames, parameter, at.moving(v))
    }
}

/// What a law, a bushing or a load puts into the system in a second.
struct Supplied {
    forces: ForceElements,
    system: SeparableSystem, // in which these alone act
    signals: Range<usize>,
    by: Vec<ForceElements>, // the derivatives, in the order of the parameters
    moved: Vec<Option<MovedCoordinate>>, // the coordinate of a law along a joint
    frames: Vec<Option<MovedFrames>>, // of a bushing
    loads: Vec<Vec<(Load, LoadChange)>>,
}

impl Supplied {
    fn new(system: &System, sensor: &Sensor, tangents: &[ModelTangent]) -> Self {
        let (mechanism, dynamics) = (&system.mechanism, &system.dynamics);
        let forces = dynamics.forces.only(&sensor.of);
        let mass = dynamics.parts.mass_matrix(mechanism);
        let changed = |own: &ModelTangent| {
            let all = own.numbers.loads.iter();
            let of = all.filter_map(|(k, change)| match dynamics.forces.forces.get(*k)? {
                NamedForce { name, force: ElementForce::Body(load) } if *name == sensor.of => {
                    Some((load.clone(), *change))
                }
                _ => None,
            });
            of.collect()
        };
        Self {
            system: forces.add_to(SeparableSystem::new(mass)),
            by: tangents.iter().map(|own| own.acting.only(&sensor.of)).collect(),
            signals: dynamics.variational(mechanism).places_of_signals(),
            moved: moved_along(mechanism, &forces, tangents),
            frames: frames_of(&sensor.of, tangents),
            loads: tangents.iter().map(changed).collect(),
            forces,
        }
    }
}

/// Of what reads no states: others have memory.
/// ```text
/// δ(f_qᵀ v) = f_qᵀ δv + D²(z·f)|_{z = v},   δ(f + f_vᵀ v) = f_q δq + f_v δv + f_vᵀ δv + D²(z·f)|_{z = v}
/// ```
impl Curved for Supplied {
    fn add_bend(
        &self,
        Node { at, v, .. }: Node<'_>,
        [dq, dv]: [&[f64]; 2],
        scale: f64,
        [q, of_v]: [&mut [f64]; 2],
    ) {
        let at = with_signals(at, &self.signals);
        for (by, out) in [([1.0, 0.0], &mut *q), ([0.0, 1.0], &mut *of_v)] {
            let into = &mut Product { v: dv, out };
            let mut transposed = Block { into, row: 0, column: 0, scale, transposed: true };
            self.system.gauss_slopes(at.moving(v), by, &mut transposed);
        }
        for (by, v_of) in [([scale, 0.0], dq), ([0.0, scale], dv)] {
            self.system.gauss_slopes(at.moving(v), by, &mut Product { v: v_of, out: of_v });
        }
        let out = [q, of_v];
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let mut by = [0.0; 4];
            by[2 * i + j] = scale;
            let into = &mut Product { v: [dq, dv][j], out: &mut *out[i] };
            self.system.gauss_bend(at.moving(v), v, by, into);
        }
    }
}

impl NodeQuantity for Supplied {
    fn curved(&self) -> Option<&dyn Curved> {
        Some(self)
    }
    fn value(&self, Node { at, v, .. }: Node<'_>) -> f64 {
        self.forces.power(with_signals(at, &self.signals).moving(v), &mut Vec::new())
    }
    fn add_slopes(&self, Node { at, v, .. }: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        let at = with_signals(at, &self.signals);
        if let Some(of_z) = out.z.get_mut(self.signals.clone()) {
            let into = &mut Product { v, out: of_z };
            let mut transposed = Block { into, row: 0, column: 0, scale, transposed: true };
            self.system.state_slopes(at.moving(v), &mut transposed);
        }
        let mut force = vec![0.0; v.len()];
        self.system.add_gauss_force(at.moving(v), &mut force);
        out.v.iter_mut().zip(force).for_each(|(out, f)| *out += scale * f);
        for (by, out) in [([1.0, 0.0], out.q), ([0.0, 1.0], out.v)] {
            let into = &mut Product { v, out };
            let mut transposed = Block { into, row: 0, column: 0, scale, transposed: true };
            self.system.gauss_slopes(at.moving(v), by, &mut transposed);
        }
    }
    fn by_parameter(&self, parameter: usize, Node { at, v, .. }: Node<'_>) -> f64 {
        let at = with_signals(at, &self.signals);
        let own =
            self.by.get(parameter).map_or(0.0, |own| own.power(at.moving(v), &mut Vec::new()));
        let moved = self.moved.get(parameter).and_then(Option::as_ref);
        let along = moved.zip(along(&self.forces)).map(|(moved, force)| {
            let (x, rate) = (force.coordinate.at(at), force.coordinate.rate(at.q, v));
            let (effort, slopes) = force.law.effort_and_slopes(at.t, x, rate);
            let faster = moved.rate_by(at.q, v);
            rate * (slopes.by_coordinate * moved.by(at.q) + slopes.by_rate * faster)
                + effort * faster
        });
        let mut standing = Interval::new(at.q.len());
        standing.gather_at(at, v, 1.0);
        let changed = self.loads.get(parameter).into_iter().flatten();
        let changed = changed.map(|(load, change)| {
            let half = load.half_impulse_by(change, &standing, at.q);
            2.0 * dot(&half, load.of_frame(v))
        });
        let by_frames = by_frames(self, &self.frames, parameter, at.moving(v));
        own + along.unwrap_or(0.0) + changed.sum::<f64>() + by_frames
    }
    fn reads_time(&self) -> bool {
        true // expressions and histories may
    }
}

/// The force of a law along a joint.
fn along(forces: &ForceElements) -> Option<&JointForce<Arc<dyn JointLaw>>> {
    match &forces.forces.first()?.force {
        ElementForce::Joint(force) => Some(force),
        _ => None,
    }
}

/// How the coordinate of a law along a joint changes, in the order of the parameters.
fn moved_along(
    mechanism: &Mechanism,
    forces: &ForceElements,
    tangents: &[ModelTangent],
) -> Vec<Option<MovedCoordinate>> {
    let of = along(forces).map(|force| &force.coordinate);
    let moved = |own: &ModelTangent| MovedCoordinate::of(mechanism, &own.numbers, of?);
    tangents.iter().map(moved).collect()
}

/// How the frames of a bushing of this name move, in the order of the parameters.
fn frames_of(name: &str, tangents: &[ModelTangent]) -> Vec<Option<MovedFrames>> {
    let of = |own: &ModelTangent| {
        own.bushings.iter().find(|bushing| bushing.0 == name).map(|bushing| bushing.1.clone())
    };
    tangents.iter().map(of).collect()
}

/// `y_θ` of a number of a bushing whose frames move with a parameter.
fn by_frames(
    y: &dyn NodeQuantity,
    frames: &[Option<MovedFrames>],
    parameter: usize,
    at: Motion<'_>,
) -> f64 {
    let Some(frames) = frames.get(parameter).and_then(Option::as_ref) else { return 0.0 };
    let [mut q, mut of_v] = [(); 2].map(|()| vec![0.0; at.q.len()]);
    let mut z = vec![0.0; at.internal.len()];
    let out = NodeSlopes { q: &mut q, v: &mut of_v, lambda: &mut [], a: &mut [], z: &mut z };
    y.add_slopes(Node::moving(at), 1.0, out);
    frames.change([at.q, at.v], [&q, &of_v])
}

/// A node with the internal variables of signals alone, as efforts read it.
fn with_signals<'a>(at: Configuration<'a>, places: &Range<usize>) -> Configuration<'a> {
    Configuration { internal: at.internal.get(places.clone()).unwrap_or_default(), ..at }
}

/// What a sensor of an effort or of a power shows; `None` of others, and of constraints.
///
/// # Errors
/// [`ModelError`] of one that has no derivative.
pub(crate) fn of_sensor(
    model: &Model,
    system: &mut System,
    key: &str,
    (sensor, part): (&Sensor, Option<&str>),
    tangents: &[ModelTangent],
) -> Result<Option<Box<dyn NodeQuantity>>, ModelError> {
    if !matches!(sensor.kind, SensorKind::Effort | SensorKind::Power) {
        return Ok(None);
    }
    let is_power = sensor.kind == SensorKind::Power;
    let acts = |name: &String| *name == sensor.of;
    let on_body = |own: &&holonom_model::Load| own.body.is_some() && acts(&own.name);
    let is_load = model.loads.iter().any(|own| on_body(&own))
        && system.dynamics.forces.loads(&sensor.of).next().is_some();
    let acting = model.laws.iter().any(|own| acts(&own.name))
        || model.bushings.iter().any(|own| acts(&own.name));
    if is_power && (is_load || acting) {
        return Ok(Some(Box::new(Supplied::new(system, sensor, tangents))));
    }
    let Some(effort) = system.sensors.effort(&sensor.name).cloned() else { return Ok(None) };
    let part = number_of(model, key, (sensor, part))?;
    Ok(match effort {
        EffortSensor::Joint(elements, _) => {
            let name = &columns_of(model, sensor)[part].part;
            let power = is_power.then_some(1.0);
            let found = along_joint(model, system, (sensor, name), (elements, power), tangents);
            Some(Box::new(found.ok_or_else(|| no_derivative(key, sensor))?))
        }
        EffortSensor::Spring(spring, damper) => {
            let power = is_power.then_some(-1.0);
            let k = model.springs.iter().position(|own| own.name == sensor.of);
            let k = k.ok_or_else(|| no_derivative(key, sensor))?;
            Some(Box::new(between_points(k, spring, damper, power, tangents)))
        }
        EffortSensor::Six(name, forces) => {
            stated(system, sensor, part, forces, Some(name), tangents)
        }
        EffortSensor::Law(forces, _) => stated(system, sensor, part, forces, None, tangents),
        EffortSensor::Row(..) => None,
    })
}

/// The elements of one kind of a joint; `None` where it has no such coordinate.
fn along_joint(
    model: &Model,
    system: &mut System,
    (sensor, part): (&Sensor, &str),
    (elements, power): (Vec<JointDrive>, Option<f64>),
    tangents: &[ModelTangent],
) -> Option<AlongCoordinate> {
    let own: Vec<JointDrive> = elements.into_iter().filter(|own| own.part == part).collect();
    let freedom = own.first()?.freedom;
    let moved = MeasuredNumber::coordinate(model, &mut system.mechanism, &sensor.of, freedom)?;
    let MeasuredNumber::Joint { joint, coordinate, .. } = &moved else { return None };
    let inputs = [Input::Coordinate((**coordinate).clone()), Input::Rate((**coordinate).clone())];
    let by = |own: &ModelTangent| -> Vec<EffortTangent> {
        let all = own.drives.iter().filter(|(of, name, _)| (of, *name) == (joint, part));
        all.map(|(_, _, by)| by.clone()).collect()
    };
    let by = tangents.iter().map(by).collect();
    let moved = Sensed::new(moved, &system.mechanism, &sensor.name, tangents);
    Some(AlongCoordinate { inputs, moved, acts: CoordinateAction::Elements(own), by, power })
}

/// Spring `k` between points.
fn between_points(
    k: usize,
    spring: Box<Spring>,
    damper: Box<Damper>,
    power: Option<f64>,
    tangents: &[ModelTangent],
) -> AlongCoordinate {
    let changes = || tangents.iter().map(|own| own.numbers.springs.get(&k));
    let by = |change: Option<&SpringTangent>| -> Vec<EffortTangent> {
        let Some(change) = change else { return Vec::new() };
        let (spring, damping) = (with_tangent(&spring, Some(change)), change.damping);
        vec![Arc::new(move |_, x: f64, rate: f64| {
            spring.tension_at(Dual64::from_re(x)).eps + damping * rate
        })]
    };
    let by = changes().map(by).collect();
    let moved = changes().map(|own| own.map(|own| own.between.clone()));
    AlongCoordinate {
        inputs: [Input::Length(spring.between.clone()), Input::LengthRate(spring.between.clone())],
        moved: Sensed::between(spring.between.clone(), moved),
        acts: CoordinateAction::Spring(spring, damper),
        by,
        power,
    }
}

/// A number of a law, or of the bushing of a name.
fn stated(
    system: &System,
    sensor: &Sensor,
    part: usize,
    forces: Box<ForceElements>,
    name: Option<String>,
    tangents: &[ModelTangent],
) -> Option<Box<dyn NodeQuantity>> {
    let by = tangents.iter().map(|own| own.acting.only(&sensor.of)).collect();
    let moved = moved_along(&system.mechanism, &forces, tangents);
    let signals = system.dynamics.variational(&system.mechanism).places_of_signals();
    let frames = frames_of(&sensor.of, tangents);
    Some(Box::new(StatedEffort { forces: *forces, name, part, signals, by, moved, frames }))
}
