//! Rates and accelerations of ball joints.
//!
//! ```text
//! y = B·Δω,   ẏ = Ḃ·Δω + B·Δω̇        B: an axis of the parent, Δω: how the child turns against it
//! Δω = ω(q, v) of both,   Δω̇ = ω(q, a),   ω = ½ Σ d_I × v_I
//! y_θ = B_θ·Δω                        where the axes change with a parameter
//! ```

use super::ball_coordinate::BallCoordinate;
use super::{Asked, OfNode};
use crate::design::ModelTangent;
use holonom_model::{ModelError, SensorKind};
use nalgebra::Vector3;
use vi_control::node::{Curved, Node, NodeQuantity, NodeReads, NodeSlopes};
use vi_core::{Configuration, Motion};
use vi_multibody::FrameId;
use vi_multibody::form::Form;
use vi_multibody::joint::Side;
use vi_multibody::law::Input;
use vi_rigid::directors::FRAME;

/// `B·Δω` or its rate.
struct BallTurn {
    along: Form,                   // B
    by: Vec<Form>,                 // B_θ, in the order of the parameters
    spins: Vec<(f64, [Input; 3])>, // of the child, and of the parent with the sign −
    accelerates: bool,
}

impl BallTurn {
    fn spin(&self, at: Motion<'_>) -> Vector3<f64> {
        let own = |(sign, own): &(f64, [Input; 3])| {
            *sign * Vector3::from_fn(|k, _| own[k].value(Node::moving(at)))
        };
        self.spins.iter().map(own).sum()
    }

    /// Adds the derivatives of `weights·Δω` by `q` and `v`.
    fn add_spin(&self, at: Motion<'_>, weights: &Vector3<f64>, [of_q, of_v]: [&mut [f64]; 2]) {
        for (sign, own) in &self.spins {
            for (own, weight) in own.iter().zip(weights) {
                let [lambda, a, z] = [(); 3].map(|()| &mut [][..]);
                let out = NodeSlopes { q: &mut *of_q, v: &mut *of_v, lambda, a, z };
                own.add_slopes(Node::moving(at), sign * weight, out);
            }
        }
    }

    /// The number with another `B`.
    fn with(&self, along: &Form, Node { at, v, a, .. }: Node<'_>) -> f64 {
        match self.accelerates {
            false => along.at(at.q).dot(&self.spin(at.moving(v))),
            true => {
                along.rate(v).dot(&self.spin(at.moving(v)))
                    + along.at(at.q).dot(&self.spin(at.moving(a)))
            }
        }
    }
}

impl NodeQuantity for BallTurn {
    fn value(&self, node: Node<'_>) -> f64 {
        self.with(&self.along, node)
    }
    fn add_slopes(&self, Node { at, v, a, .. }: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        let along = scale * self.along.at(at.q);
        if !self.accelerates {
            self.along.add_transposed(&(scale * self.spin(at.moving(v))), out.q);
            return self.add_spin(at.moving(v), &along, [out.q, out.v]);
        }
        self.along.add_transposed(&(scale * self.spin(at.moving(v))), out.v);
        self.along.add_transposed(&(scale * self.spin(at.moving(a))), out.q);
        self.add_spin(at.moving(v), &(scale * self.along.rate(v)), [&mut *out.q, out.v]);
        self.add_spin(at.moving(a), &along, [out.q, out.a]);
    }
    fn by_parameter(&self, parameter: usize, node: Node<'_>) -> f64 {
        self.by.get(parameter).map_or(0.0, |along| self.with(along, node))
    }
    fn reads(&self) -> NodeReads {
        NodeReads { accelerations: self.accelerates, ..NodeReads::default() }
    }
    fn curved(&self) -> Option<&dyn Curved> {
        (!self.accelerates).then_some(self as _)
    }
}

/// Of `B·Δω`, with `B` linear in `q` and `Δω` in `q` and in `v`.
impl Curved for BallTurn {
    fn add_bend(
        &self,
        Node { at, v, .. }: Node<'_>,
        [dq, dv]: [&[f64]; 2],
        scale: f64,
        [q, of_v]: [&mut [f64]; 2],
    ) {
        let moved = Configuration { q: dq, ..at };
        let [along, turned] = [self.along.at(at.q), self.along.rate(dq)].map(|b| scale * b);
        let spin = self.spin(moved.moving(v)) + self.spin(at.moving(dv));
        self.along.add_transposed(&(scale * spin), q);
        let mut unused = vec![0.0; v.len()];
        self.add_spin(at.moving(dv), &along, [&mut *q, &mut unused]);
        self.add_spin(moved.moving(v), &along, [&mut unused, &mut *of_v]);
        self.add_spin(at.moving(v), &turned, [q, of_v]);
    }
}

/// The joint of a sensor, where it is such a one, and which number of its vectors is asked for;
/// `None` of one before these.
fn joint_of(asked: Asked<'_>) -> Result<Option<(usize, Option<usize>)>, ModelError> {
    let Asked { model, system, of: (sensor, _), .. } = asked;
    let Some(k) = model.joints.iter().position(|own| own.name == sensor.of) else {
        return Ok(None);
    };
    let joint = &system.mechanism.description().joints[k];
    let Some(first) = joint.kind.rotation_vector() else { return Ok(None) };
    Ok(Some((k, asked.number()?.checked_sub(first))))
}

/// A number of the rotation vector that a sensor of such a joint shows; `None` of others.
///
/// # Errors
/// [`ModelError`] of one that has no derivative.
pub(super) fn coordinate(asked: Asked<'_>) -> Result<Option<BallCoordinate>, ModelError> {
    if asked.of.0.kind != SensorKind::JointCoordinate {
        return Ok(None);
    }
    let joints = &asked.system.mechanism.description().joints;
    let found = joint_of(asked)?;
    let found = found.and_then(|(k, axis)| Some((k, axis?)));
    Ok(found.map(|(k, axis)| BallCoordinate::new(&joints[k], k, axis, asked.tangents)))
}

/// What a sensor of such a joint shows; `None` of others.
///
/// # Errors
/// [`ModelError`] of one that has no derivative.
pub(super) fn of_sensor(asked: Asked<'_>) -> OfNode {
    let Asked { system, of: (sensor, _), tangents, .. } = asked;
    let accelerates = sensor.kind == SensorKind::JointAcceleration;
    if !(accelerates || sensor.kind == SensorKind::JointRate) {
        return Ok(None);
    }
    let Some((k, axis)) = joint_of(asked)? else { return Ok(None) };
    let axis = axis.ok_or_else(|| asked.refused())?;
    let joint = &system.mechanism.description().joints[k];
    let along = |own: &ModelTangent| {
        let axes = own.numbers.joints.get(&k).map(|own| own.parent.axes).unwrap_or_default();
        Side { axes, ..joint.parent }.axis(axis)
    };
    let spins =
        [(1.0, &joint.child), (-1.0, &joint.parent)].into_iter().filter_map(|(sign, end)| {
            let FrameId::Frame(frame) = end.frame else { return None };
            Some((sign, [0, 1, 2].map(|axis| Input::Spin(FRAME * frame, axis))))
        });
    Ok(Some(Box::new(BallTurn {
        along: joint.parent.axis(axis),
        by: tangents.iter().map(along).collect(),
        spins: spins.collect(),
        accelerates,
    })))
}
