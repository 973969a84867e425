//! The states and held values of signals.

use super::collocation::Collocation;
use super::evaluation::ReadingLaw;
use super::input::Input;
use super::sampling::{ByParameters, Change, Seed};
use nalgebra::DMatrix;
use std::sync::{Arc, Mutex, PoisonError};
use vi_core::Motion;
use vi_core::galerkin::{GaussLobatto, GaussPoint};
use vi_core::interval::{Interval, Slot};
use vi_core::signals::{Signals, StateRates};
use vi_core::sparse::Entries;

/// What happens at nodes: values that are sampled there and held, values of the past.
pub trait Sampler: Send + Sync {
    /// How many internal variables there are: states and held values.
    fn count(&self) -> usize;
    /// What they are at the start, before anything is sampled.
    fn start(&self) -> Arc<[f64]>;
    /// Whether it has anything to do at the node of this number.
    fn is_due(&self, step: u64) -> bool;
    /// Updates held values at a node where `y` are the inputs.
    fn sample(&self, step: u64, y: &[f64], internal: &mut [f64]);
    /// `internal ←` the values at the start of a motion.
    fn begin(&self, y: &[f64], internal: &mut [f64]);
    /// The same, and how all of them change with inputs, internal variables before, and parameters;
    /// shape [`Sampler::count`].
    fn sample_changes(
        &self,
        step: u64,
        y: &[f64],
        internal: &mut [f64],
        by: &ByParameters<'_>,
    ) -> Vec<Change>;
    /// The values at the start of a motion, and how they change with inputs, with those that are
    /// stated, and with parameters.
    fn begin_changes(&self, y: &[f64], internal: &mut [f64], by: &ByParameters<'_>) -> Vec<Change>;
}

/// All states and held values of the signals of a model.
pub struct SignalStates {
    /// The rates of all continuous states.
    pub reading: ReadingLaw,
    /// What happens at nodes.
    pub sampler: Arc<dyn Sampler>,
    collocation: Mutex<Collocation>, // scratch
}

impl Clone for SignalStates {
    fn clone(&self) -> Self {
        Self::new(self.reading.clone(), self.sampler.clone())
    }
}

impl SignalStates {
    /// Of the rates of all continuous states, and of what happens at nodes.
    #[must_use]
    pub fn new(reading: ReadingLaw, sampler: Arc<dyn Sampler>) -> Self {
        Self { reading, sampler, collocation: Mutex::default() }
    }

    /// With the efforts of the law in a step, at the middle of its states.
    pub fn with_efforts_in_step<T>(&self, s: &Interval, then: impl FnOnce(&[f64]) -> T) -> T {
        self.reading.with_values_in_step(s, |work| then(work.efforts()))
    }

    /// With the efforts of the law at a node where the internal variables are listed.
    pub fn with_efforts_at_node<T>(&self, at: Motion<'_>, then: impl FnOnce(&[f64]) -> T) -> T {
        self.reading.with_values_at_node(at, |work| then(work.efforts()))
    }

    /// How the internal variables change over a node with the velocity `v`, from these before.
    #[must_use]
    pub fn sample_changes(
        &self,
        step: u64,
        at: Motion<'_>,
        before: &[f64],
        by: &ByParameters<'_>,
    ) -> Vec<Change> {
        let (mut own, mut changes) = (before.to_vec(), Vec::new());
        self.reading.with_inputs(at, &mut own, |y, own| {
            changes = self.sampler.sample_changes(step, y, own, by);
        });
        changes
    }

    /// How what they begin with changes at the start of a motion with the velocity `v`.
    #[must_use]
    pub fn begin_changes(&self, at: Motion<'_>, by: &ByParameters<'_>) -> Vec<Change> {
        let (mut begun, mut changes) = (vec![0.0; self.count()], Vec::new());
        self.reading.with_inputs(at, &mut begun, |y, own| {
            changes = self.sampler.begin_changes(y, own, by);
        });
        changes
    }

    /// `out ←` the internal variables at a node of an equilibrium: states where they rest, held
    /// values as at the start.
    pub fn rest(&self, at: Motion<'_>, out: &mut Vec<f64>) {
        out.clear();
        out.extend(&*self.reading.start);
        let at = Motion { internal: &[], ..at };
        self.reading.with_values_at_node(at, |work| {
            let states = self.reading.states.iter().zip(work.middle());
            states.for_each(|(place, state)| out[*place] = *state);
        });
    }
}

impl std::fmt::Debug for SignalStates {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SignalStates").field("reading", &self.reading).finish_non_exhaustive()
    }
}

impl Signals for SignalStates {
    fn count(&self) -> usize {
        self.sampler.count()
    }

    fn has_states(&self) -> bool {
        !self.reading.states.is_empty()
    }

    fn is_sampled(&self) -> bool {
        self.sampler.is_due(0)
    }

    fn begin(&self, at: Motion<'_>, out: &mut [f64]) {
        out.fill(0.0);
        self.reading.with_inputs(at, out, |y, own| self.sampler.begin(y, own));
    }

    fn rest(&self, at: Motion<'_>, out: &mut [f64]) {
        let mut all = Vec::with_capacity(out.len());
        SignalStates::rest(self, at, &mut all);
        out.copy_from_slice(&all);
    }

    fn begin_change(&self, at: Motion<'_>, [dq, dv]: [&[f64]; 2], out: &mut [f64]) {
        let change = |input: &Input| {
            let mut sum = 0.0;
            input.for_each_slope_by_position(at.q, at.v, &mut |i, slope| sum += slope * dq[i]);
            input.for_each_slope_by_velocity(at.q, at.v, &mut |i, slope| sum += slope * dv[i]);
            sum
        };
        let dy: Vec<f64> = self.reading.inputs.iter().map(change).collect();
        let by_input = |seed: Seed| if let Seed::Input(j) = seed { dy[j] } else { 0.0 };
        let changes = self.begin_changes(at, &|_, _| Vec::new());
        out.iter_mut().zip(&changes).for_each(|(out, change)| *out = change.along(by_input));
    }

    /// `z_{n+1} = 2 z̄ − z_n`; what is held stays.
    fn advance(&self, s: &Interval, out: &mut [f64]) {
        let first = self.reading.first;
        out.copy_from_slice(&s.internal[first..first + out.len()]);
        if self.reading.states.is_empty() {
            return;
        }
        self.reading.with_values_in_step(s, |work| {
            for (place, middle) in self.reading.states.iter().zip(work.middle()) {
                out[*place] = 2.0 * middle - out[*place];
            }
        });
    }

    fn advance_slope(&self, s: &Interval, by: Slot, out: &mut dyn Entries) {
        let ReadingLaw { states, inputs, .. } = &self.reading;
        if states.is_empty() {
            return;
        }
        self.reading.with_state_slopes(s, |slopes| {
            for (j, input) in inputs.iter().enumerate() {
                input.for_each_slope(s, by, &mut |column, slope| {
                    for (i, place) in states.iter().enumerate() {
                        out.add(*place, column, 2.0 * slopes.by_input[(i, j)] * slope);
                    }
                });
            }
        });
    }

    fn advance_internal_slope(&self, s: &Interval, out: &mut dyn Entries) {
        let states = &self.reading.states;
        (0..self.count()).for_each(|place| {
            let sign = if states.contains(&place) { -1.0 } else { 1.0 };
            out.add(place, place, sign);
        });
        if states.is_empty() {
            return;
        }
        self.reading.with_state_slopes(s, |slopes| {
            for (i, row) in states.iter().enumerate() {
                for (j, column) in states.iter().enumerate() {
                    out.add(*row, *column, 2.0 * slopes.by_start[(i, j)]);
                }
                for (j, input) in self.reading.inputs.iter().enumerate() {
                    let by_input = 2.0 * slopes.by_input[(i, j)];
                    let held = self.reading.own(&s.internal);
                    input.for_each_held(s.t_mid(), held, &mut |place, slope| {
                        out.add(*row, place, by_input * slope);
                    });
                }
            }
        });
    }

    fn collocate(
        &self,
        s: &Interval,
        constants: &GaussLobatto,
        gauss: &mut [GaussPoint],
        end: &mut [f64],
    ) {
        let mut own = self.collocation.lock().unwrap_or_else(PoisonError::into_inner);
        own.find(&self.reading, s, constants, gauss, end);
    }

    fn rates(&self, at: Motion<'_>) -> StateRates {
        let ReadingLaw { inputs, states, first, .. } = &self.reading;
        let (m, n) = (states.len(), at.q.len());
        self.reading.with_slopes_at_node(at, |work| {
            let (rates, slopes) = work.rates();
            let mut by_position = DMatrix::zeros(m, n);
            let mut by_velocity = DMatrix::zeros(m, n);
            for (j, input) in inputs.iter().enumerate() {
                let add = |to: &mut DMatrix<f64>, column: usize, slope: f64| {
                    (0..m).for_each(|i| to[(i, column)] += slopes[(i, j)] * slope);
                };
                input.for_each_slope_by_position(at.q, at.v, &mut |k, slope| {
                    add(&mut by_position, k, slope);
                });
                input.for_each_slope_by_velocity(at.q, at.v, &mut |k, slope| {
                    add(&mut by_velocity, k, slope);
                });
            }
            StateRates {
                places: states.iter().map(|state| first + state).collect(),
                rates: rates.to_vec(),
                by_position,
                by_velocity,
                by_state: slopes.columns(inputs.len(), m).into_owned(),
            }
        })
    }

    fn samples(&self, step: u64) -> bool {
        self.sampler.is_due(step)
    }

    fn sample(&self, step: u64, at: Motion<'_>, internal: &mut [f64]) {
        let sampler = &self.sampler;
        self.reading.with_inputs(at, internal, |y, own| sampler.sample(step, y, own));
    }
}
