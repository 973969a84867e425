//! What signals do at nodes: sampled values, sampled controllers, values of the past, the start.
//!
//! ```text
//! value      u ← value(y, z, last)
//! pid        D ← D + T d,  d = (e − D)/(T_f + T),   w = k_p e + k_i I + k_d d + feedforward
//!            u ← clamp(w),   I ← I + T (e + (u − w)/(k_i T_t))
//! ```
//! `u` acts from the node on. Back calculation: Åström & Hägglund, PID Controllers, 1995.

use super::network::{Network, Source};
use std::sync::{Arc, Mutex, PoisonError};
use vi_multibody::law::{Past, Sampler};

/// Gains of a controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    pub(super) proportional: f64,
    pub(super) integral: f64,
    pub(super) derivative: f64,
    pub(super) filter: f64,
    pub(super) limits: [f64; 2],
    pub(super) tracking: Option<f64>, // s
}

/// What happens at a node.
#[derive(Clone, Copy, Debug)]
pub(super) enum Task {
    /// A sampled expression.
    Value { held: usize, of: Source },
    /// A sampled controller: `u`, `I`, `D` from `held` on.
    Pid { held: usize, error: Source, feedforward: Option<Source>, gains: Gains, period: f64 },
    /// A value is kept for later.
    Keep { past: Past, of: Source },
}

/// A task at every so many nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Due {
    pub(super) every: u64,
    pub(super) task: Task,
}

/// Inputs that are internal variables.
#[derive(Clone, Copy, Debug)]
pub(super) enum Held {
    At(usize),
    Past(Past),
}

/// All that signals do at nodes.
#[derive(Debug)]
pub(super) struct NodeTasks {
    pub(super) network: Arc<Network>,
    pub(super) count: usize,
    pub(super) states: usize,   // the first of the internal variables
    pub(super) tasks: Vec<Due>, // in the order of their dependence
    pub(super) held: Vec<(usize, Held)>, // among the inputs
    pub(super) start: Vec<f64>, // of the internal variables
    pub(super) filtered: Vec<(usize, Source)>, // states that start where something else does
    pub(super) work: Mutex<Vec<f64>>,
}

impl NodeTasks {
    /// The value of a source with what is held at present.
    fn value(&self, source: Source, y: &mut [f64], internal: &[f64]) -> f64 {
        for (input, held) in &self.held {
            y[*input] = match held {
                Held::At(place) => internal[*place],
                Held::Past(past) => past.at(y[0], internal),
            };
        }
        self.network.value(source, y, &internal[..self.states])
    }

    fn run(&self, task: &Task, y: &mut [f64], internal: &mut [f64]) {
        match *task {
            Task::Value { held, of } => internal[held] = self.value(of, y, internal),
            Task::Keep { past, of } => {
                let value = self.value(of, y, internal);
                past.push(y[0], value, internal);
            }
            Task::Pid { held, error, feedforward, gains, period } => {
                let e = self.value(error, y, internal);
                let ahead = feedforward.map_or(0.0, |of| self.value(of, y, internal));
                let [_, sum, filtered] = [0, 1, 2].map(|k| internal[held + k]);
                let slope = (e - filtered) / (gains.filter + period);
                let w = gains.proportional * e
                    + gains.integral * sum
                    + gains.derivative * slope
                    + ahead;
                let [least, most] = gains.limits;
                let u = w.max(least).min(most);
                let back = gains.tracking.map_or(0.0, |t| (u - w) / (gains.integral * t));
                internal[held] = if w.is_nan() { w } else { u };
                internal[held + 1] = sum + period * (e + back);
                internal[held + 2] = filtered + period * slope;
            }
        }
    }

    fn fill(&self, y: &mut [f64], internal: &mut [f64]) {
        for due in &self.tasks {
            match due.task {
                Task::Keep { past, of } => {
                    let value = self.value(of, y, internal);
                    internal[past.first] = y[0];
                    internal[past.first + 1..=past.first + past.count].fill(value);
                }
                Task::Pid { held, error, .. } => {
                    internal[held + 2] = self.value(error, y, internal);
                }
                Task::Value { .. } => {}
            }
        }
        for (state, of) in &self.filtered {
            internal[*state] = self.value(*of, y, internal);
        }
    }
}

impl Sampler for NodeTasks {
    fn count(&self) -> usize {
        self.count
    }

    fn start(&self) -> Arc<[f64]> {
        self.start.as_slice().into()
    }

    fn is_due(&self, step: u64) -> bool {
        self.tasks.iter().any(|due| step.is_multiple_of(due.every))
    }

    fn sample(&self, step: u64, y: &[f64], internal: &mut [f64]) {
        let own = &mut *self.work.lock().unwrap_or_else(PoisonError::into_inner);
        own.copy_from_slice(y);
        for due in self.tasks.iter().filter(|due| step.is_multiple_of(due.every)) {
            self.run(&due.task, own, internal);
        }
    }

    /// What is kept and filtered starts with what is read there, after what is sampled.
    fn begin(&self, y: &[f64], internal: &mut [f64]) {
        internal.copy_from_slice(&self.start);
        let mut own = y.to_vec();
        self.fill(&mut own, internal);
        for due in &self.tasks {
            if !matches!(due.task, Task::Keep { .. }) {
                self.run(&due.task, &mut own, internal);
            }
        }
        for (state, of) in &self.filtered {
            internal[*state] = self.value(*of, &mut own, internal);
        }
        for due in &self.tasks {
            if let Task::Keep { past, of } = due.task {
                let value = self.value(of, &mut own, internal);
                internal[past.first + 1..=past.first + past.count].fill(value);
            }
        }
    }

    /// Of states alone: what is sampled or kept has no derivative.
    fn begin_change(&self, y: &[f64], dy: &[f64], own: &[f64], change: &mut [f64]) {
        let mut internal = self.start.clone();
        let mut y = y.to_vec();
        change.copy_from_slice(own);
        for (state, of) in self.filtered.iter().chain(&self.filtered) {
            let value = self.value(*of, &mut y, &internal);
            let by = [dy, &change[..self.states]];
            let read = self.network.change(*of, [&y, &internal[..self.states]], by);
            change[*state] = own[*state] + read;
            internal[*state] = value;
        }
    }
}
