//! The states of signals: internal variables of a force that does nothing but advance them.

use super::evaluation::Reading;
use std::sync::Arc;
use vi_core::Configuration;
use vi_core::force::DiscreteForce;
use vi_core::interval::Interval;
use vi_core::sparse::Entries;

/// What happens at nodes: values that are sampled there and held, values of the past.
pub trait Sampler: Send + Sync {
    /// How many internal variables there are: states and held values.
    fn count(&self) -> usize;
    /// Whether it has anything to do at the node of this number.
    fn is_due(&self, step: u64, internal: &[f64]) -> bool;
    /// Updates held values at a node where `y` are the inputs.
    fn sample(&self, step: u64, y: &[f64], internal: &mut [f64]);
    /// `internal ←` the values at the start of a motion.
    fn begin(&self, y: &[f64], internal: &mut [f64]);
}

/// All states and held values of the signals of a model.
#[derive(Clone)]
pub struct SignalStates {
    /// The rates of all continuous states.
    pub reading: Reading,
    /// What happens at nodes.
    pub sampler: Arc<dyn Sampler>,
}

impl std::fmt::Debug for SignalStates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SignalStates").field("reading", &self.reading).finish_non_exhaustive()
    }
}

impl DiscreteForce for SignalStates {
    fn add_minus(&self, _: &Interval, _: &mut [f64]) {}
    fn add_plus(&self, _: &Interval, _: &mut [f64]) {}
    fn add_minus_d2(&self, _: &Interval, _: &mut dyn Entries) {}
    fn add_continuous(&self, _: Configuration<'_>, _: &[f64], _: &mut [f64]) {}
    fn work(&self, _: &Interval, _: &mut [f64]) -> f64 {
        0.0
    }
    fn add_stiffness(&self, _: Configuration<'_>, _: &[f64], _: f64, _: &mut dyn Entries) {}
    fn add_damping(&self, _: Configuration<'_>, _: &[f64], _: f64, _: &mut dyn Entries) {}

    /// The forces that read them say it.
    fn is_dissipative(&self) -> bool {
        self.reading.law.is_dissipative()
    }

    fn internal_variables(&self) -> usize {
        self.sampler.count()
    }

    fn begin(&self, at: Configuration<'_>, v: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        self.reading.with_inputs(at, v, out, |y, internal| self.sampler.begin(y, internal));
    }

    /// `z_{n+1} = 2 z̄ − z_n`; what is held stays.
    fn advance(&self, s: &Interval, out: &mut [f64]) {
        let first = self.reading.first;
        out.copy_from_slice(&s.internal[first..first + out.len()]);
        self.reading.with_values_in_step(s, |work| {
            for (place, middle) in self.reading.states.iter().zip(work.middle()) {
                out[*place] = 2.0 * middle - out[*place];
            }
        });
    }

    fn samples(&self, step: u64, internal: &[f64]) -> bool {
        self.sampler.is_due(step, internal)
    }

    fn sample(&self, step: u64, at: Configuration<'_>, v: &[f64], internal: &mut [f64]) {
        let sampler = &self.sampler;
        self.reading.with_inputs(at, v, internal, |y, own| sampler.sample(step, y, own));
    }
}
