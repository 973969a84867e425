//! Signals along a run: their values at nodes.

use super::network::{Network, NumberSource};
use std::sync::Arc;
use vi_core::Motion;
use vi_multibody::law::{Input, SignalStates};

/// A number of a signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct OutputNumber {
    pub(crate) signal: String,
    /// `e`, `u`, `i`, `d` of a controller: error, output before its limits, integral, filtered
    /// error; empty for the value.
    pub(crate) part: &'static str,
    pub(crate) source: NumberSource,
}

impl OutputNumber {
    pub(super) fn new(signal: &str, part: &'static str, source: NumberSource) -> Self {
        Self { signal: signal.to_owned(), part, source }
    }
}

/// The network of all signals and what of it is written.
#[derive(Clone, Debug)]
pub(crate) struct SignalNetwork {
    pub(crate) network: Arc<Network>,
    pub(crate) parts: Vec<OutputNumber>,
    /// States that are not written, by their full names.
    pub(crate) states: Vec<(String, NumberSource)>,
    /// Numbers that only events change, and where they are held.
    pub(crate) numbers: Vec<(String, usize)>,
    /// Columns of sensors that are read as they were at the node before, and where they are held.
    pub(crate) measured: Vec<(String, usize)>,
}

/// Reads signals at nodes.
#[derive(Clone, Debug)]
pub(crate) struct SignalGauge {
    own: SignalNetwork,
    states: SignalStates,
}

impl SignalGauge {
    pub(crate) fn new(own: SignalNetwork, states: SignalStates) -> Self {
        Self { own, states }
    }

    /// Where each number that only events change is held among the internal variables of signals.
    pub(crate) fn numbers(&self) -> &[(String, usize)] {
        &self.own.numbers
    }

    /// Columns of sensors, and where their numbers are held likewise.
    pub(crate) fn measured(&self) -> &[(String, usize)] {
        &self.own.measured
    }

    /// Where the number of a signal comes from, by the name of its column.
    pub(crate) fn source(&self, name: &str) -> Option<NumberSource> {
        let (signal, part) = name.split_once('.').unwrap_or((name, ""));
        let mut parts = self.own.parts.iter();
        let found = parts.find(|own| own.signal == signal && own.part == part);
        let state = || self.own.states.iter().find(|(own, _)| own == name);
        found.map(|own| own.source).or_else(|| state().map(|(_, source)| *source))
    }

    /// Where what a signal samples or keeps is held among the internal variables of signals.
    pub(crate) fn place(&self, name: &str) -> Option<usize> {
        let NumberSource::Input(input) = self.source(name)? else { return None };
        match self.states.reading.inputs.get(input)? {
            Input::Held(place) => Some(*place),
            Input::Past(past) => Some(past.first),
            _ => None,
        }
    }

    /// What jumps in it where the motion leads: whose expression, and the part.
    pub(crate) fn jump(&self, source: NumberSource) -> Option<(String, String)> {
        let (owner, part) = self.own.network.jump(source)?;
        Some((owner.to_owned(), part.to_owned()))
    }

    /// The value of a number at a node as [`SignalGauge::read`] finds it.
    pub(crate) fn value(&self, source: NumberSource, at: Motion<'_>) -> f64 {
        let (reading, mut value) = (&self.states.reading, f64::NAN);
        let Some(z) = at.internal.get(..reading.states.len()) else { return value };
        reading.read_inputs(at, at.internal, |y| value = self.own.network.value(source, y, z));
        value
    }

    /// How its slopes by what signals read change where that changes by `along`; without states.
    pub(crate) fn bend(&self, source: NumberSource, at: Motion<'_>, along: &[f64]) -> Vec<f64> {
        let mut bend = vec![0.0; along.len()];
        self.states.reading.read_inputs(at, at.internal, |y| {
            let weight = std::iter::once((source, 1.0));
            self.own.network.bend_of(weight, [y, along], &mut bend);
        });
        bend
    }

    /// Its slopes there: by what signals read, then by their states.
    pub(crate) fn slopes(&self, source: NumberSource, at: Motion<'_>) -> Vec<f64> {
        let (reading, mut row) = (&self.states.reading, Vec::new());
        let Some(z) = at.internal.get(..reading.states.len()) else { return row };
        reading.read_inputs(at, at.internal, |y| row = self.own.network.row(source, y, z));
        row
    }

    /// What signals read, and where their states stand among their internal variables.
    pub(crate) fn reads(&self) -> (&[Input], &[usize]) {
        (&self.states.reading.inputs, &self.states.reading.states)
    }

    /// Appends all numbers at a node with the velocity `v`; `at` has the internal variables of
    /// signals alone.
    pub(crate) fn read(&self, at: Motion<'_>, out: &mut Vec<f64>) {
        let mut rest = Vec::new();
        let held = match at.internal {
            [] => {
                self.states.rest(at, &mut rest);
                &rest[..]
            }
            listed => listed,
        };
        self.states.reading.read_inputs(at, held, |y| {
            let z = &held[..self.states.reading.states.len()];
            out.extend(self.own.parts.iter().map(|part| self.own.network.value(part.source, y, z)));
        });
    }
}
