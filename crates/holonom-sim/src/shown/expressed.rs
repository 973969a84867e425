//! The value of a sensor of type `expression`, with its derivatives.
//!
//! ```text
//! y = e(t, y_1, …)        ∂y/∂q = Σ ∂e/∂y_i ∂y_i/∂q,   ∂y/∂v̂ likewise,   y_θ = e_θ + Σ ∂e/∂y_i (y_i)_θ
//! ```
//! `e_θ` is an expression of its own, of what `e` reads.

use super::configuration::Sensed;
use super::{Shown, jumps, signal};
use crate::design::{ModelTangent, refused};
use crate::system::System;
use holonom_model::expression::ExpressionProgram;
use holonom_model::{Model, ModelError, NodeReading, Observed, Quantities, Sensor, SensorPart};
use vi_constraints::saddle_point::IndependentRows;
use vi_control::identification::MeasuredReading as Rate;
use vi_control::node::{Curved, Node, NodeQuantity, NodeReads, NodeSlopes, RateOf};
use vi_control::objective::{NotedNode, Quantity};
use vi_core::Configuration;
use vi_core::linear::dot;

/// An expression with what it reads.
struct Evaluated {
    program: ExpressionProgram,
    inputs: Vec<Box<dyn NodeQuantity>>,
}

/// The value of an expression.
pub(crate) struct Expressed {
    own: Evaluated,
    by: Vec<Option<Evaluated>>, // e_θ, in the order of the parameters
}

/// A quantity of a configuration as one of a node.
struct ValueOf(Sensed);

impl NodeQuantity for ValueOf {
    fn value(&self, node: Node<'_>) -> f64 {
        self.0.value(node.at)
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, out: NodeSlopes<'_>) {
        self.0.add_slope(node.at, scale, out.q);
    }
    fn by_parameter(&self, parameter: usize, node: Node<'_>) -> f64 {
        self.0.by_parameter(parameter, node.at)
    }
    fn curved(&self) -> Option<&dyn Curved> {
        Some(self)
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        self.0.follow(node, seen);
    }
}

impl Curved for ValueOf {
    fn add_bend(&self, node: Node<'_>, [dq, _]: [&[f64]; 2], scale: f64, [q, _]: [&mut [f64]; 2]) {
        self.0.add_bend(node.at.moving(dq), scale, q);
    }
}

impl Evaluated {
    fn inputs(&self, node: Node<'_>) -> Vec<f64> {
        let read = self.inputs.iter().map(|own| own.value(node));
        std::iter::once(node.at.t).chain(read).collect()
    }

    /// Not a number where it has no value.
    fn value(&self, node: Node<'_>) -> f64 {
        self.program.value(&self.inputs(node)).unwrap_or(f64::NAN)
    }

    /// `∂e/∂y_i`.
    fn slopes(&self, node: Node<'_>) -> Vec<f64> {
        let y = self.inputs(node);
        let mut slopes = vec![0.0; y.len()];
        if self.program.gradient(&y, &mut slopes).is_err() {
            slopes.fill(f64::NAN);
        }
        slopes.split_off(1) // the time is no number of the node
    }
}

impl Expressed {
    fn inputs(&self) -> impl Iterator<Item = &Box<dyn NodeQuantity>> {
        let all = std::iter::once(&self.own).chain(self.by.iter().flatten());
        all.flat_map(|own| &own.inputs)
    }
}

impl NodeQuantity for Expressed {
    fn value(&self, node: Node<'_>) -> f64 {
        self.own.value(node)
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, mut out: NodeSlopes<'_>) {
        for (slope, input) in self.own.slopes(node).into_iter().zip(&self.own.inputs) {
            input.add_slopes(node, scale * slope, out.again());
        }
    }
    fn by_parameter(&self, parameter: usize, node: Node<'_>) -> f64 {
        let slopes = self.own.slopes(node).into_iter().zip(&self.own.inputs);
        let moved: f64 = slopes.map(|(e, own)| e * own.by_parameter(parameter, node)).sum();
        let stated = self.by.get(parameter).and_then(Option::as_ref);
        moved + stated.map_or(0.0, |own| own.value(node))
    }
    fn reads(&self) -> NodeReads {
        self.inputs().fold(NodeReads::default(), |all, own| all.or(own.reads()))
    }
    fn reads_time(&self) -> bool {
        let of_own = |own: &Evaluated| own.program.reads(0);
        of_own(&self.own) || self.own.inputs.iter().any(|input| input.reads_time())
    }
    fn curved(&self) -> Option<&dyn Curved> {
        self.own.inputs.iter().all(|input| input.curved().is_some()).then_some(self as _)
    }
    fn follow(&self, node: Configuration<'_>, seen: NotedNode) {
        self.inputs().for_each(|input| input.follow(node, seen));
    }
}

/// `Σ ∂e/∂y_i D²y_i + Σ ∂²e/∂y_i∂y_j ∇y_i ∇y_jᵀ`.
impl Curved for Expressed {
    fn add_bend(
        &self,
        node: Node<'_>,
        changes: [&[f64]; 2],
        scale: f64,
        [q, of_v]: [&mut [f64]; 2],
    ) {
        let own = &self.own;
        let slopes: Vec<[Vec<f64>; 2]> = own.inputs.iter().map(|own| own.slopes_at(node)).collect();
        let change = |[q, v]: &[Vec<f64>; 2]| dot(q, changes[0]) + dot(v, changes[1]);
        let changed: Vec<f64> = std::iter::once(0.0).chain(slopes.iter().map(change)).collect();
        let mut bend = vec![0.0; changed.len()];
        own.program.bend(&own.inputs(node), &changed, &mut bend);
        let each = own.inputs.iter().zip(own.slopes(node)).zip(slopes.iter().zip(&bend[1..]));
        for ((input, slope), ([by_q, by_v], bend)) in each {
            if let Some(curved) = input.curved() {
                curved.add_bend(node, changes, scale * slope, [&mut *q, &mut *of_v]);
            }
            for (out, by) in [(&mut *q, by_q), (&mut *of_v, by_v)] {
                out.iter_mut().zip(by).for_each(|(out, by)| *out += scale * bend * by);
            }
        }
    }
}

impl Expressed {
    /// # Errors
    /// [`ModelError`] where it reads what has no derivative.
    pub(super) fn new(
        of_run: (&Model, &IndependentRows),
        system: &mut System,
        key: &str,
        (sensor, own): (&Sensor, Observed),
        tangents: &[ModelTangent],
    ) -> Result<Self, ModelError> {
        let model = of_run.0;
        if let Some(part) = own.program.jumps_moved(|input| input > 0) {
            let key = format!("sensor.{}.value", sensor.name);
            return Err(jumps(&key, part, &format!("the sensor `{}`", sensor.name)));
        }
        let own = evaluated(of_run, system, key, own, tangents)?;
        let mut by = Vec::new();
        for tangent in tangents {
            by.push(match tangent.expressions.get(&sensor.name) {
                None => None,
                Some(slope) => {
                    let mut apart = model.clone();
                    apart.signals.clone_from(&tangent.signals);
                    let slope = Observed::expression(&slope.0, &apart, &Quantities::new(&apart));
                    let slope = slope.map_err(|error| refused(key, error.message, error.help))?;
                    Some(evaluated(of_run, system, key, slope, tangents)?)
                }
            });
        }
        Ok(Self { own, by })
    }
}

fn evaluated(
    (model, rows): (&Model, &IndependentRows),
    system: &mut System,
    key: &str,
    observed: Observed,
    tangents: &[ModelTangent],
) -> Result<Evaluated, ModelError> {
    let Observed { program, readings } = observed;
    let mut inputs: Vec<Box<dyn NodeQuantity>> = Vec::new();
    for reading in readings {
        let (sensor, part) = match reading {
            NodeReading::Sensor(sensor, part) => (sensor, part),
            NodeReading::Signal(name) => {
                inputs.push(signal::of_signal(system, key, &name, tangents)?);
                continue;
            }
        };
        let part = match part {
            SensorPart::Number(number) => Some(number.to_string()),
            SensorPart::Heading(heading) => Some(heading).filter(|own| !own.is_empty()),
        };
        let of = (&*sensor, part.as_deref());
        inputs.push(match Shown::of((model, rows), system, key, of, tangents)? {
            Shown::Configuration(own, Rate::Value) => Box::new(ValueOf(own)),
            Shown::Configuration(own, Rate::Rate) => Box::new(RateOf(own)),
            Shown::Node(own) => own,
        });
    }
    Ok(Evaluated { program, inputs })
}
