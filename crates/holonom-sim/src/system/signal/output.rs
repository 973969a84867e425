//! Signals along a run: their values at nodes.

use super::network::{Network, Source};
use std::sync::Arc;
use vi_core::Configuration;
use vi_multibody::law::SignalStates;

/// A number of a signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    pub(crate) signal: String,
    /// `e`, `u`, `i`, `d` of a controller: error, output before its limits, integral, filtered
    /// error; empty for the value.
    pub(crate) part: &'static str,
    pub(crate) source: Source,
}

impl Part {
    pub(super) fn new(signal: &str, part: &'static str, source: Source) -> Self {
        Self { signal: signal.to_owned(), part, source }
    }
}

/// The network of all signals and what of it is written.
#[derive(Clone, Debug)]
pub(crate) struct SignalNetwork {
    pub(crate) network: Arc<Network>,
    pub(crate) parts: Vec<Part>,
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

    /// Appends all numbers at a node with the velocity `v`; `at` has the internal variables of
    /// signals alone.
    pub(crate) fn read(&self, at: Configuration<'_>, v: &[f64], out: &mut Vec<f64>) {
        let mut rest = Vec::new();
        let held = match at.internal {
            [] => {
                self.states.rest(at, v, &mut rest);
                &rest[..]
            }
            listed => listed,
        };
        self.states.reading.read_inputs(at, v, held, |y| {
            let z = &held[..self.states.reading.states.len()];
            out.extend(self.own.parts.iter().map(|part| self.own.network.value(part.source, y, z)));
        });
    }
}
