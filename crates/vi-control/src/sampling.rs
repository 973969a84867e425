//! What is sampled at nodes and held over steps, in derivatives of a run.
//!
//! ```text
//! z⁺ = S(t, y(q, v̂), z⁻; θ) at a node        y: what laws read
//! y⁻ = S_zᵀ y⁺,   (a, b) += (∂y/∂(q, p̄))ᵀ S_yᵀ y⁺,   dJ/dθ += y⁺·S_θ                        [2.70]
//! δz⁺ = S_y δy + S_z δz⁻ + S_θ δθ
//! ```
//! `y⁺`, `y⁻`: costates of the internal variables after and before. A node is sampled after the
//! step that ends there, and a step starts with what is held then.

use crate::node::{Node, NodeQuantity, NodeSlopes};
use crate::objective::{ByKnown, Known};
use crate::terminal_rate::{NodeReader, NodeSources, TerminalRateError};
use vi_constraints::linearization::{Costate, Tangent};
use vi_core::State;
use vi_core::signals::Signals as _;
use vi_multibody::design::{MechanismTangent, SignalTangent};
use vi_multibody::law::{Change, Input, Seed, SignalStates};
use vi_multibody::run::MechanismIntegrator;

/// The signals of a run that are sampled.
#[derive(Debug)]
pub struct Sampling {
    signals: SignalStates,
    first: usize, // of their internal variables
    reader: NodeReader,
    tangents: Vec<(usize, SignalTangent)>, // of parameters that change them
}

/// Some inputs, weighted.
struct Weighted<'a> {
    inputs: &'a [Input],
    weights: &'a [f64],
}

impl Weighted<'_> {
    fn parts(&self) -> impl Iterator<Item = (&Input, f64)> {
        let parts = self.inputs.iter().zip(self.weights.iter().copied());
        parts.filter(|(_, weight)| *weight != 0.0)
    }
}

impl NodeQuantity for Weighted<'_> {
    fn value(&self, node: Node<'_>) -> f64 {
        self.parts().map(|(input, weight)| weight * input.value(node)).sum()
    }
    fn add_slopes(&self, node: Node<'_>, scale: f64, mut out: NodeSlopes<'_>) {
        self.parts()
            .for_each(|(input, weight)| input.add_slopes(node, scale * weight, out.again()));
    }
    fn reads_velocity(&self) -> bool {
        self.parts().any(|(input, _)| input.is_rate())
    }
}

impl Sampling {
    /// Of signals whose internal variables begin at `first`, in a run where the numbers of its
    /// mechanism change so with parameters.
    ///
    /// # Errors
    /// [`TerminalRateError`].
    pub fn new(
        signals: SignalStates,
        first: usize,
        run: &MechanismIntegrator,
        tangents: &[MechanismTangent],
        sources: NodeSources,
    ) -> Result<Self, TerminalRateError> {
        let reader = NodeReader::new(run, tangents, sources)?;
        let own = |(k, own): (usize, &MechanismTangent)| Some((k, own.signals.clone()?));
        let tangents = tangents.iter().enumerate().filter_map(own).collect();
        Ok(Self { signals, first, reader, tangents })
    }

    /// Whether any is sampled at the node of this number.
    pub(crate) fn is_due(&self, number: u64) -> bool {
        self.signals.samples(number)
    }

    /// The node before it is sampled, by that where the step to it starts: what is held stays.
    pub(crate) fn before(&self, start: &State, node: &State) -> State {
        let mut before = node.clone();
        for k in (0..self.signals.count()).filter(|k| !self.signals.reading.states.contains(k)) {
            before.internal[self.first + k] = start.internal[self.first + k];
        }
        before
    }

    /// How the internal variables of signals change at a node that is not sampled yet; `None` where
    /// its velocity is not determined.
    fn changes(&self, number: u64, before: &State) -> Option<Vec<Change>> {
        let v = self.reader.velocity(before)?;
        let at = before.configuration().moving(&v);
        let held = &before.internal[self.first..self.first + self.signals.count()];
        let by = |place: usize, held: &[f64]| {
            let own = self.tangents.iter();
            own.filter_map(|(k, own)| own.of_sample(*k, at, place, held)).collect()
        };
        Some(self.signals.sample_changes(number, at, held, &by))
    }

    /// Takes the costate of a node after it is sampled to that before; not a number where it is not
    /// determined.
    pub(crate) fn pull(
        &self,
        number: u64,
        before: &State,
        costate: &mut Costate,
        parameters: &mut [f64],
    ) {
        let Some(changes) = self.changes(number, before) else {
            return costate.q.fill(f64::NAN);
        };
        let mut weights = vec![0.0; self.signals.reading.inputs.len()];
        let own = self.first..self.first + changes.len();
        let after: Vec<f64> = costate.z[own.clone()].to_vec();
        costate.z[own].fill(0.0);
        for (change, after) in changes.iter().zip(&after).filter(|(_, after)| **after != 0.0) {
            for (seed, slope) in change.slopes() {
                let slope = slope * after;
                match seed {
                    Seed::Input(j) => weights[j] += slope,
                    Seed::Internal(k) => costate.z[self.first + k] += slope,
                    Seed::Parameter(k) => {
                        parameters.iter_mut().skip(k).take(1).for_each(|own| *own += slope);
                    }
                }
            }
        }
        self.add_slopes(&weights, before, costate, parameters);
    }

    /// Takes tangents at a node before it is sampled to those after; `of`: the parameter of each,
    /// of so many.
    pub(crate) fn push(
        &self,
        number: u64,
        before: &State,
        tangents: &mut [Tangent],
        (of, parameters): (&dyn Fn(usize) -> Option<usize>, usize),
    ) {
        let Some(changes) = self.changes(number, before) else {
            return tangents.iter_mut().for_each(|own| own.q.fill(f64::NAN));
        };
        let (n, inputs) = (before.q.len(), self.signals.reading.inputs.len());
        let reads = |j: usize| {
            let mut slopes = changes.iter().flat_map(Change::slopes);
            slopes.any(|(seed, _)| seed == Seed::Input(j))
        };
        let slopes = |j: usize| {
            let mut weights = vec![0.0; inputs];
            weights[j] = 1.0;
            let mut by = Costate::zero(n, before.internal.len());
            let mut explicit = vec![0.0; parameters];
            self.add_slopes(&weights, before, &mut by, &mut explicit);
            (by, explicit)
        };
        let read: Vec<_> = (0..inputs).map(|j| reads(j).then(|| slopes(j))).collect();
        for (direction, tangent) in tangents.iter_mut().enumerate() {
            let parameter = of(direction);
            let of_input = |own: &(Costate, Vec<f64>)| {
                own.0.along(tangent) + parameter.map_or(0.0, |k| own.1[k])
            };
            let dy: Vec<f64> = read.iter().map(|own| own.as_ref().map_or(0.0, of_input)).collect();
            let change = |change: &Change| {
                change.along(|seed| match seed {
                    Seed::Input(j) => dy[j],
                    Seed::Internal(k) => tangent.z[self.first + k],
                    Seed::Parameter(k) => f64::from(u8::from(parameter == Some(k))),
                })
            };
            let after: Vec<f64> = changes.iter().map(change).collect();
            tangent.z[self.first..self.first + after.len()].copy_from_slice(&after);
        }
    }

    /// Adds the derivatives of a weighted sum of inputs.
    fn add_slopes(
        &self,
        weights: &[f64],
        node: &State,
        costate: &mut Costate,
        parameters: &mut [f64],
    ) {
        if weights.iter().all(|weight| *weight == 0.0) {
            return;
        }
        let inputs = &self.signals.reading.inputs[..];
        let sum = Weighted { inputs, weights };
        let out = (costate, ByKnown::default());
        self.reader.add_slopes((&sum, &|_| 1.0), (node, Known::STATE), out, parameters);
    }
}
