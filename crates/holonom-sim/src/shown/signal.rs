//! Numbers of signals, with derivatives.
//!
//! ```text
//! y = s(u(t, q, v̂), z)        ∂y/∂q = Σ s_u ∂u/∂q,   ∂y/∂v̂ likewise,   ∂y/∂z = s_z
//! ```
//! `u`: what signals read, `z`: their states. What a signal that is a value stands for has its
//! derivative by a parameter in the expression that reads it.

use crate::design::{ModelTangent, refused};
use crate::system::System;
use crate::system::signal::network::NumberSource;
use crate::system::signal::output::SignalGauge;
use holonom_model::ModelError;
use std::ops::Range;
use vi_control::node::{Curved, Node, NodeQuantity, NodeReads, NodeSlopes};
use vi_core::Configuration;
use vi_core::linear::dot;
use vi_multibody::design::MovedCoordinate;

/// A number of a signal.
struct SignalNumber {
    gauge: SignalGauge,
    source: NumberSource,
    places: Range<usize>, // of the signals among the internal variables
}

impl SignalNumber {
    fn at<'a>(&self, at: Configuration<'a>) -> Configuration<'a> {
        Configuration { internal: at.internal.get(self.places.clone()).unwrap_or_default(), ..at }
    }
}

impl NodeQuantity for SignalNumber {
    fn value(&self, Node { at, v, .. }: Node<'_>) -> f64 {
        self.gauge.value(self.source, self.at(at).moving(v))
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, mut out: NodeSlopes<'_>) {
        let row = self.gauge.slopes(self.source, self.at(node.at).moving(node.v));
        let (inputs, states) = self.gauge.reads();
        let held = self.at(node.at).internal;
        for (input, slope) in inputs.iter().zip(&row).filter(|(_, slope)| **slope != 0.0) {
            input.add_slopes(node, scale * slope, out.again());
            input.for_each_held(node.at.t, held, &mut |place, by_held| {
                if let Some(z) = out.z.get_mut(self.places.start + place) {
                    *z += scale * slope * by_held;
                }
            });
        }
        for (state, slope) in states.iter().zip(row.iter().skip(inputs.len())) {
            if let Some(z) = out.z.get_mut(self.places.start + state) {
                *z += scale * slope;
            }
        }
    }
    fn reads(&self) -> NodeReads {
        NodeReads { internal: !self.places.is_empty(), ..NodeReads::default() }
    }
    fn reads_time(&self) -> bool {
        true // its expressions may
    }
    fn curved(&self) -> Option<&dyn Curved> {
        self.places.is_empty().then_some(self as _)
    }
}

/// Of signals without states: `Σ s_u D²u + Σ s_uu' ∇u ∇u'ᵀ`.
impl Curved for SignalNumber {
    fn add_bend(
        &self,
        node: Node<'_>,
        changes: [&[f64]; 2],
        scale: f64,
        [q, of_v]: [&mut [f64]; 2],
    ) {
        let at = self.at(node.at);
        let row = self.gauge.slopes(self.source, at.moving(node.v));
        let (inputs, _) = self.gauge.reads();
        let slopes: Vec<[Vec<f64>; 2]> = inputs.iter().map(|own| own.slopes_at(node)).collect();
        let change = |[q, v]: &[Vec<f64>; 2]| dot(q, changes[0]) + dot(v, changes[1]);
        let changed: Vec<f64> = slopes.iter().map(change).collect();
        let bend = self.gauge.bend(self.source, at.moving(node.v), &changed);
        for (((input, slope), bend), [by_q, by_v]) in
            inputs.iter().zip(&row).zip(&bend).zip(&slopes)
        {
            input.add_bend(node, changes, scale * slope, [&mut *q, &mut *of_v]);
            for (out, by) in [(&mut *q, by_q), (&mut *of_v, by_v)] {
                out.iter_mut().zip(by).for_each(|(out, by)| *out += scale * bend * by);
            }
        }
    }
}

/// What a signal shows, by the name of its column.
///
/// # Errors
/// [`ModelError`] where a parameter moves what it may read.
pub(super) fn of_signal(
    system: &System,
    key: &str,
    name: &str,
    tangents: &[ModelTangent],
) -> Result<Box<dyn NodeQuantity>, ModelError> {
    let gauge = system.sensors.signal_gauge();
    let found = gauge.and_then(|gauge| Some((gauge.clone(), gauge.source(name)?)));
    let (gauge, source) = found.ok_or_else(|| {
        let what = format!("the derivative of a sensor that reads `{name}`, which events change");
        refused(key, what, "write what it stands for")
    })?;
    if let Some((owner, part)) = gauge.jump(source) {
        return Err(super::jumps(key, &part, &owner));
    }
    let (inputs, _) = gauge.reads();
    let moves =
        |own: &&ModelTangent| MovedCoordinate::moves_any(&system.mechanism, &own.numbers, inputs);
    if let Some(own) = tangents.iter().find(moves) {
        let what = format!(
            "the derivative by `{}`, which moves a joint that the signal `{name}` may read",
            own.name
        );
        return Err(refused(key, what, "name others, or write what the signal stands for"));
    }
    let places = system.dynamics.variational(&system.mechanism).places_of_signals();
    Ok(Box::new(SignalNumber { gauge, source, places }))
}
