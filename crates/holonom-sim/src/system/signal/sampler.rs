//! What signals do at nodes: sampled values, sampled controllers, values of the past, the start.
//!
//! ```text
//! value      u ← value(y, z, last)
//! pid        D ← D + T d,  d = (e − D)/(T_f + T),   w = k_p e + k_i I + k_d d + feedforward
//!            u ← clamp(w),   I ← I + T (e + (u − w)/(k_i T_t))
//! ```
//! `u` acts from the node on. Back calculation: Åström & Hägglund, PID Controllers, 1995.
//!
//! All of it may carry how it changes with inputs, with what was held before, and with parameters
//! [2.70].

use super::network::{Network, NumberSource};
use holonom_model::Pid;
use std::sync::{Arc, Mutex, PoisonError};
use vi_core::Number;
use vi_core::num_dual::Dual64;
use vi_multibody::law::{ByParameters, Change, Past, SampledChange, Sampler, Seed};

/// Gains of a controller.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gains<D> {
    proportional: D,
    integral: D,
    derivative: D,
    filter: D,
    limits: Option<[D; 2]>,
    tracking: Option<D>, // s
}

impl<D: Number> Gains<D> {
    /// Of a sampled controller, whose numbers are these below its key.
    pub(crate) fn of(pid: &Pid, number: &mut dyn FnMut(&str, f64) -> D) -> Self {
        let [proportional, integral, derivative, filter] = [
            ("pid.proportional", pid.proportional),
            ("pid.integral", pid.integral),
            ("pid.derivative", pid.derivative),
            ("pid.filter", pid.filter.unwrap_or(0.0)),
        ]
        .map(|(key, value)| number(key, value));
        let limits = pid
            .limits
            .map(|[least, most]| [number("pid.limits.0", least), number("pid.limits.1", most)]);
        let tracking = (limits.is_some() && pid.integral != 0.0).then(|| match pid.tracking {
            Some(own) => number("pid.tracking", own),
            None => proportional / integral,
        });
        Self { proportional, integral, derivative, filter, limits, tracking }
    }

    /// `u`, `I` and `D` after a node, from `(e, feedforward, I, D)` there.
    fn next(&self, [e, ahead, sum, filtered]: [D; 4], period: f64) -> [D; 3] {
        let period = D::of(period);
        let slope = (e - filtered) / (self.filter + period);
        let w = self.proportional * e + self.integral * sum + self.derivative * slope + ahead;
        let u = match self.limits {
            Some([least, _]) if Number::real(w) < Number::real(least) => least,
            Some([_, most]) if Number::real(w) > Number::real(most) => most,
            _ => w,
        };
        let back = self.tracking.map_or(D::of(0.0), |t| (u - w) / (self.integral * t));
        [u, sum + period * (e + back), filtered + period * slope]
    }
}

impl Gains<f64> {
    /// The same numbers with derivatives of zero.
    fn still(&self) -> Gains<Dual64> {
        let still = Dual64::from_re;
        Gains {
            proportional: still(self.proportional),
            integral: still(self.integral),
            derivative: still(self.derivative),
            filter: still(self.filter),
            limits: self.limits.map(|own| own.map(still)),
            tracking: self.tracking.map(still),
        }
    }
}

impl Gains<Dual64> {
    /// Their derivatives; empty where all are zero.
    pub(crate) fn slopes(&self) -> Vec<f64> {
        let own = [self.proportional, self.integral, self.derivative, self.filter];
        let none = Dual64::from_re(0.0);
        let [least, most] = self.limits.unwrap_or([none; 2]);
        let all = own.into_iter().chain([least, most, self.tracking.unwrap_or(none)]);
        let all: Vec<f64> = all.map(|own| own.eps).collect();
        if all.iter().all(|own| *own == 0.0) { Vec::new() } else { all }
    }

    /// With derivatives in the order of [`Gains::slopes`].
    fn with(mut self, slopes: &[f64]) -> Self {
        let Self { proportional, integral, derivative, filter, limits, tracking } = &mut self;
        let all = [proportional, integral, derivative, filter].into_iter();
        let limits = limits.iter_mut().flatten();
        let (first, rest) = slopes.split_at(4.min(slopes.len()));
        all.zip(first).for_each(|(own, slope)| own.eps = *slope);
        limits.zip(rest).for_each(|(own, slope)| own.eps = *slope);
        tracking.iter_mut().zip(rest.iter().skip(2)).for_each(|(own, slope)| own.eps = *slope);
        self
    }
}

/// What happens at a node.
#[derive(Clone, Copy, Debug)]
pub(super) enum SamplerTask {
    /// A sampled expression.
    Value { held: usize, of: NumberSource },
    /// A sampled controller: `u`, `I`, `D` from `held` on.
    Pid {
        held: usize,
        error: NumberSource,
        feedforward: Option<NumberSource>,
        gains: Gains<f64>,
        period: f64,
    },
    /// A value is kept for later.
    Keep { past: Past, of: NumberSource },
}

/// A task at every so many nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Due {
    pub(super) every: u64,
    pub(super) task: SamplerTask,
}

/// Inputs that are internal variables.
#[derive(Clone, Copy, Debug)]
pub(super) enum HeldInputs {
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
    pub(super) held: Vec<(usize, HeldInputs)>, // among the inputs
    pub(super) start: Vec<f64>, // of the internal variables
    pub(super) filtered: Vec<(usize, NumberSource)>, // states that start where something else does
    pub(super) work: Mutex<Vec<f64>>,
}

/// What tasks read and write at a node.
struct SampledNode<'a> {
    y: &'a mut [f64],
    internal: &'a mut [f64],
    changes: Option<Changes<'a>>,
}

/// How the internal variables change, where that is wanted.
struct Changes<'a> {
    own: Vec<Change>,
    by: &'a ByParameters<'a>,
}

impl<'a> Changes<'a> {
    /// Of variables that are what they are before.
    fn of_before(count: usize, by: &'a ByParameters<'a>) -> Self {
        Self { own: (0..count).map(|k| Change::of(Seed::Internal(k))).collect(), by }
    }
}

impl NodeTasks {
    /// The value of a source with what is held at present.
    fn value(&self, source: NumberSource, at: &mut SampledNode<'_>) -> f64 {
        for (input, held) in &self.held {
            at.y[*input] = match held {
                HeldInputs::At(place) => at.internal[*place],
                HeldInputs::Past(past) => past.at(at.y[0], at.internal),
            };
        }
        self.network.value(source, at.y, &at.internal[..self.states])
    }

    /// How it changes.
    fn change(&self, source: NumberSource, at: &SampledNode<'_>, known: &[Change]) -> Change {
        let row = self.network.row(source, at.y, &at.internal[..self.states]);
        let (by_inputs, by_states) = row.split_at(at.y.len());
        let mut change = Change::default();
        for (j, slope) in by_inputs.iter().enumerate().filter(|(_, slope)| **slope != 0.0) {
            match self.held.iter().find(|(input, _)| *input == j) {
                None => change.add_to(Seed::Input(j), *slope),
                Some((_, HeldInputs::At(place))) => change.add(&known[*place], *slope),
                Some((_, HeldInputs::Past(past))) => {
                    past.for_each_slope(at.y[0], at.internal, &mut |place, part| {
                        change.add(&known[place], slope * part);
                    });
                }
            }
        }
        let states = by_states.iter().zip(known).filter(|(slope, _)| **slope != 0.0);
        states.for_each(|(slope, own)| change.add(own, *slope));
        change
    }

    /// The value of what a task samples into a place, and how that changes.
    fn sampled(&self, of: NumberSource, place: usize, at: &mut SampledNode<'_>) -> (f64, Change) {
        let value = self.value(of, at);
        let Some(Changes { own, by }) = &at.changes else { return (value, Change::default()) };
        let mut change = self.change(of, at, own);
        for own in by(place, at.internal) {
            change.add_to(Seed::Parameter(own.parameter), own.of);
        }
        (value, change)
    }

    fn run(&self, task: &SamplerTask, at: &mut SampledNode<'_>) {
        match *task {
            SamplerTask::Value { held, of } => {
                let (value, change) = self.sampled(of, held, at);
                at.put(held, value, change);
            }
            SamplerTask::Keep { past, of } => {
                let (value, change) = self.sampled(of, past.first, at);
                past.push(at.y[0], value, at.internal);
                if let Some(Changes { own, .. }) = &mut at.changes {
                    own[past.first] = Change::default();
                    own[past.first + 1..=past.first + past.count].rotate_right(1);
                    own[past.first + 1] = change;
                }
            }
            SamplerTask::Pid { held, error, feedforward, gains, period } => {
                let e = self.value(error, at);
                let ahead = feedforward.map_or(0.0, |of| self.value(of, at));
                let [_, sum, filtered] = [0, 1, 2].map(|k| at.internal[held + k]);
                let arguments = [e, ahead, sum, filtered];
                let next = gains.next(arguments, period);
                let mut changes: [Change; 3] = Default::default();
                if let Some(Changes { own, by }) = &at.changes {
                    let known = [
                        self.change(error, at, own),
                        feedforward.map_or_else(Change::default, |of| self.change(of, at, own)),
                        own[held + 1].clone(),
                        own[held + 2].clone(),
                    ];
                    let still = gains.still();
                    let moved = |gains: &Gains<Dual64>, slopes: [f64; 4]| {
                        let all = [0, 1, 2, 3].map(|k| Dual64::new(arguments[k], slopes[k]));
                        gains.next(all, period).map(|own| own.eps)
                    };
                    for (k, known) in known.iter().enumerate() {
                        let slopes = moved(&still, [0, 1, 2, 3].map(|i| f64::from(i == k)));
                        changes.iter_mut().zip(slopes).for_each(|(own, by)| own.add(known, by));
                    }
                    for SampledChange { parameter, of, ahead, numbers } in by(held, at.internal) {
                        let slopes = moved(&still.with(&numbers), [of, ahead, 0.0, 0.0]);
                        let by = changes.iter_mut().zip(slopes);
                        by.for_each(|(own, by)| own.add_to(Seed::Parameter(parameter), by));
                    }
                }
                for (k, (value, change)) in next.into_iter().zip(changes).enumerate() {
                    at.put(held + k, value, change);
                }
            }
        }
    }

    fn fill(&self, at: &mut SampledNode<'_>) {
        for due in &self.tasks {
            match due.task {
                SamplerTask::Keep { past, of } => {
                    at.put(past.first, at.y[0], Change::default());
                    self.fill_past(past, of, at);
                }
                SamplerTask::Pid { held, error, .. } => {
                    let (value, change) = self.sampled(error, held, at);
                    at.put(held + 2, value, change);
                }
                SamplerTask::Value { .. } => {}
            }
        }
        self.filter(at);
    }

    /// All that is kept is what it is now.
    fn fill_past(&self, past: Past, of: NumberSource, at: &mut SampledNode<'_>) {
        let (value, change) = self.sampled(of, past.first, at);
        (1..=past.count).for_each(|k| at.put(past.first + k, value, change.clone()));
    }

    /// States that start where something else does, and change with what is stated of them.
    fn filter(&self, at: &mut SampledNode<'_>) {
        for (state, of) in &self.filtered {
            let value = self.value(*of, at);
            let mut change = Change::default();
            if let Some(Changes { own, .. }) = &at.changes {
                change = self.change(*of, at, own);
                change.add_to(Seed::Internal(*state), 1.0);
            }
            at.put(*state, value, change);
        }
    }

    fn sample_at(&self, step: u64, y: &[f64], mut at: SampledNode<'_>) -> Option<Vec<Change>> {
        at.y.copy_from_slice(y);
        for due in self.tasks.iter().filter(|due| step.is_multiple_of(due.every)) {
            self.run(&due.task, &mut at);
        }
        at.changes.map(|changes| changes.own)
    }

    /// What is kept and filtered starts with what is read there, after what is sampled.
    fn begin_at(&self, y: &[f64], mut at: SampledNode<'_>) -> Option<Vec<Change>> {
        at.y.copy_from_slice(y);
        at.internal.copy_from_slice(&self.start);
        self.fill(&mut at);
        for due in &self.tasks {
            if !matches!(due.task, SamplerTask::Keep { .. }) {
                self.run(&due.task, &mut at);
            }
        }
        self.filter(&mut at);
        for due in &self.tasks {
            if let SamplerTask::Keep { past, of } = due.task {
                self.fill_past(past, of, &mut at);
            }
        }
        at.changes.map(|changes| changes.own)
    }
}

impl SampledNode<'_> {
    fn put(&mut self, place: usize, value: f64, change: Change) {
        self.internal[place] = value;
        if let Some(Changes { own, .. }) = &mut self.changes {
            own[place] = change;
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
        self.sample_at(step, y, SampledNode { y: own, internal, changes: None });
    }

    fn begin(&self, y: &[f64], internal: &mut [f64]) {
        self.begin_at(y, SampledNode { y: &mut y.to_vec(), internal, changes: None });
    }

    fn sample_changes(
        &self,
        step: u64,
        y: &[f64],
        internal: &mut [f64],
        by: &ByParameters<'_>,
    ) -> Vec<Change> {
        let changes = Some(Changes::of_before(self.count, by));
        let found = self.sample_at(step, y, SampledNode { y: &mut y.to_vec(), internal, changes });
        found.unwrap_or_default()
    }

    fn begin_changes(&self, y: &[f64], internal: &mut [f64], by: &ByParameters<'_>) -> Vec<Change> {
        let changes = Some(Changes::of_before(self.count, by));
        let found = self.begin_at(y, SampledNode { y: &mut y.to_vec(), internal, changes });
        found.unwrap_or_default()
    }
}
