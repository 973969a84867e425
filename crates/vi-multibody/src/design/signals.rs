//! Rates of states of signals by a parameter, and what the states begin with.
//!
//! ```text
//! z̄ = z_n + (h/2) φ,  z_{n+1} = 2 z̄ − z_n,   ψ = (h/2) φ_θ(y, z̄)
//! (f_d^∓)_θ = ∂f_d^∓/∂z_n ψ,   (z_{n+1})_θ = ∂z_{n+1}/∂z_n ψ + ψ                                    [2.59]
//! ```
//! The change of a rate acts as one of the start of the step that its end has, too. At the Gauss
//! nodes of Galerkin steps `φ_θ` is a source of the collocation of the states. What is sampled at
//! nodes changes by its expressions and by the numbers of controllers: `S_θ` of [2.70].

use crate::force::law::{SampledChange, Seed, SignalStates};
use vi_core::Motion;
use vi_core::interval::Interval;
use vi_core::signals::Signals;
use vi_core::sparse::Entries;

/// How the states of signals change with a parameter.
#[derive(Clone, Debug)]
pub struct SignalTangent {
    states: SignalStates,
    changes: SignalStates,
    sampled: Vec<SampledTangent>,
}

/// How what is sampled changes with a parameter by itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampledTangent {
    /// The held value, the first of several.
    pub place: usize,
    /// Which effort of the changes is the derivative of what is sampled; `None`: zero.
    pub of: Option<usize>,
    /// The same of what a controller adds to its output.
    pub ahead: Option<usize>,
    /// Derivatives of the numbers of a controller, in its order.
    pub numbers: Vec<f64>,
    /// Of what is held before the first sample.
    pub start: f64,
}

/// A matrix times `ψ`, row by row.
pub(super) struct Times<'a, F> {
    pub(super) first: usize,
    pub(super) shift: &'a [f64],
    pub(super) visit: F,
}

impl<F: FnMut(usize, f64)> Entries for Times<'_, F> {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        let shift = column.checked_sub(self.first).and_then(|place| self.shift.get(place));
        if let Some(shift) = shift.filter(|shift| **shift != 0.0) {
            (self.visit)(row, value * shift);
        }
    }
}

impl SignalTangent {
    /// Of the states of a run, of which the internal variables begin at `first`. `changes`: the
    /// same states, with `φ_θ` and then the derivatives of what they begin with as efforts, each
    /// in the order of the states.
    #[must_use]
    pub fn new(mut states: SignalStates, mut changes: SignalStates, first: usize) -> Self {
        (states.reading.first, changes.reading.first) = (first, first);
        Self { states, changes, sampled: Vec::new() }
    }

    /// With what changes of what is sampled.
    #[must_use]
    pub fn with_sampled(self, sampled: Vec<SampledTangent>) -> Self {
        Self { sampled, ..self }
    }

    /// `S_θ` of what is sampled into a place at a node with the velocity `v`, as of the parameter
    /// of this number; `held`: internal variables of signals at present.
    #[must_use]
    pub fn of_sample(
        &self,
        parameter: usize,
        at: Motion<'_>,
        place: usize,
        held: &[f64],
    ) -> Option<SampledChange> {
        let own = self.sampled.iter().find(|own| own.place == place)?;
        let mut internal = vec![0.0; self.states.reading.first];
        internal.extend_from_slice(held);
        let (mut of, mut ahead) = (0.0, 0.0);
        self.changes.with_efforts_at_node(Motion { internal: &internal, ..at }, |efforts| {
            let effort = |k: Option<usize>| k.map_or(0.0, |k| efforts[k]);
            (of, ahead) = (effort(own.of), effort(own.ahead));
        });
        Some(SampledChange { parameter, of, ahead, numbers: own.numbers.clone() })
    }

    /// Where their internal variables begin.
    pub(super) fn first(&self) -> usize {
        self.states.reading.first
    }

    /// `ψ` of all internal variables of signals.
    pub(super) fn shift(&self, s: &Interval) -> Vec<f64> {
        let mut shift = vec![0.0; self.states.count()];
        self.changes.with_efforts_in_step(s, |efforts| {
            for (place, rate) in self.states.reading.states.iter().zip(efforts) {
                shift[*place] = 0.5 * s.h * rate;
            }
        });
        shift
    }

    /// `out ← out + φ_θ` at a node whose internal variables are listed; shape of all of them.
    pub fn add_rates(&self, at: Motion<'_>, out: &mut [f64]) {
        let (first, states) = (self.states.reading.first, &self.states.reading.states);
        self.changes.with_efforts_at_node(at, |efforts| {
            let all = states.iter().zip(efforts);
            all.for_each(|(place, rate)| out[first + place] += rate);
        });
    }

    /// `out ← out + (z_{n+1})_θ`; shape of all internal variables.
    pub(super) fn add_internal(&self, s: &Interval, out: &mut [f64]) {
        let (shift, first) = (self.shift(s), self.states.reading.first);
        let visit = |row: usize, value: f64| out[first + row] += value;
        self.states.advance_internal_slope(s, &mut Times { first: 0, shift: &shift, visit });
        out[first..].iter_mut().zip(&shift).for_each(|(out, shift)| *out += shift);
    }

    /// `out ← out + z_θ` at the start of a motion with the velocity `v`; shape of all internal
    /// variables.
    pub fn add_begin(&self, at: Motion<'_>, out: &mut [f64]) {
        let (first, count) = (self.states.reading.first, self.states.count());
        let mut internal = vec![0.0; first + count];
        self.states.begin(at, &mut internal[first..]);
        let mut own = vec![0.0; count];
        let begun = Motion { internal: &internal, ..at };
        self.changes.with_efforts_at_node(begun, |efforts| {
            let states = &self.states.reading.states;
            for (place, change) in states.iter().zip(&efforts[states.len()..]) {
                own[*place] = *change;
            }
        });
        self.sampled.iter().for_each(|sampled| own[sampled.place] = sampled.start);
        let by = |place: usize, held: &[f64]| -> Vec<SampledChange> {
            self.of_sample(0, at, place, held).into_iter().collect()
        };
        let changes = self.states.begin_changes(at, &by);
        for (out, change) in out[first..].iter_mut().zip(&changes) {
            *out += change.along(|seed| match seed {
                Seed::Internal(k) => own[k],
                Seed::Parameter(_) => 1.0,
                Seed::Input(_) => 0.0,
            });
        }
    }
}
