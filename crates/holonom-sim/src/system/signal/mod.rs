//! `[[signal]]` of a model: terms of a network, states, held values, what happens at nodes.
//!
//! ```text
//! rate       ż = rate                        filter    ż = (of − z)/T
//! pid        İ = e + (u − w)/(k_i T_t),  Ḋ = (e − D)/T_f,
//!            w = k_p e + k_i I + k_d (e − D)/T_f + feedforward,  u = clamp(w),  I(0) = 0, D(0) = e(0)
//! transfer   controllable form: ẋ_1 = of − Σ a_k x_k,  ẋ_k = x_{k−1},  y = Σ (b_k − a_k b_0) x_k + b_0 of
//! ```
//!
//! | file | concept |
//! |---|---|
//! | `network` | expressions that read one another, with their slopes |
//! | `sampler` | what happens at nodes and at the start |
//! | `output` | signals along a run |

pub(crate) mod network;
pub(crate) mod output;
mod sampler;

use crate::digits::rounded;
use crate::sensor::parts_of_signal;
use crate::system::names::Names;
use holonom_model::expression::{ExpressionError, Known, Program};
use holonom_model::{
    Formula, MOTION, Model, ModelError, Pid, Problem, Quantities, Quantity, Signal, Transfer,
};
use network::{Network, Source, Term};
use sampler::{Due, Gains, Held, NodeTasks, Task};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use vi_multibody::builder::{MechanismBuilder, PointOn, Read};
use vi_multibody::law::Past;

/// The terms of the laws and signals of a model, as far as they are known.
pub(crate) struct Terms<'a> {
    names: &'a Names<'a>,
    quantities: &'a Quantities<'a>,
    terms: Vec<Term>,
    inputs: Vec<(Read, String)>, // the time first
    signals: BTreeMap<&'a str, Source>,
    places: BTreeMap<&'a str, usize>, // the first internal variable of each signal
    states: usize,
    rates: Vec<Option<Source>>,
    start: Vec<f64>,
    pasts: BTreeMap<&'a str, Past>,
    filtered: Vec<(usize, Source)>,
    output: Vec<output::Part>,
}

/// Part of a network that some numbers need.
pub(crate) struct Needed {
    pub(crate) network: Arc<Network>,
    pub(crate) reads: Vec<Read>,
    /// Its states among the internal variables.
    pub(crate) states: Vec<usize>,
}

/// How many internal variables a signal has: continuous states, then held values.
fn sizes(signal: &Signal, step: f64) -> [usize; 2] {
    if let Some(pid) = &signal.pid {
        let own = usize::from(pid.integral != 0.0) + usize::from(pid.derivative != 0.0);
        return if signal.every.is_some() { [0, 3] } else { [own, 0] };
    }
    if let Some(Transfer { denominator, .. }) = &signal.transfer {
        return [denominator.len() - 1, 0];
    }
    if let Some(delay) = &signal.delay {
        return [0, 1 + kept(delay.time, step)];
    }
    match (signal.rate.is_some() || signal.filter.is_some(), &signal.value) {
        (true, _) => [1, 0],
        (_, Some(_)) => [0, usize::from(signal.every.is_some())],
        _ => [0, 1],
    }
}

/// How many nodes are kept for a delay.
fn kept(time: f64, step: f64) -> usize {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // checked: not negative
    let whole = (time / step).ceil() as usize;
    whole + 2
}

impl<'a> Terms<'a> {
    /// Those of the signals of a model.
    pub(crate) fn new(
        names: &'a Names<'a>,
        quantities: &'a Quantities<'a>,
    ) -> Result<Self, ModelError> {
        let model = names.model;
        let mut own = Self {
            names,
            quantities,
            terms: Vec::new(),
            inputs: vec![(Read::Time, "t".to_owned())],
            signals: BTreeMap::new(),
            places: BTreeMap::new(),
            states: 0,
            rates: Vec::new(),
            start: Vec::new(),
            pasts: BTreeMap::new(),
            filtered: Vec::new(),
            output: Vec::new(),
        };
        let (mut states, mut held) = (0, 0);
        let all = model.signals.iter().map(|signal| (signal, sizes(signal, model.settings.step)));
        let all: Vec<_> = all.collect();
        own.states = all.iter().map(|(_, [states, _])| states).sum();
        for (signal, [own_states, own_held]) in &all {
            let place = if *own_states > 0 { states } else { own.states + held };
            own.places.insert(&signal.name, place);
            (states, held) = (states + own_states, held + own_held);
        }
        own.rates = vec![None; own.states];
        own.start = vec![0.0; own.states + held];
        for signal in &model.signals {
            own.signal(signal)?;
        }
        for signal in &model.signals {
            own.add_rates(signal)?;
        }
        own.list_output();
        Ok(own)
    }

    fn place(&self, signal: &Signal) -> usize {
        self.places[signal.name.as_str()]
    }

    pub(crate) fn input(&mut self, read: Read, name: String) -> Source {
        let known = self.inputs.iter().position(|(own, _)| *own == read);
        Source::Input(known.unwrap_or_else(|| {
            self.inputs.push((read, name));
            self.inputs.len() - 1
        }))
    }

    /// The variables of a law at a point of a member: time, place, velocity, angular velocity.
    pub(crate) fn of_point(
        &mut self,
        at: PointOn,
        frame: Option<usize>,
    ) -> Vec<(&'static str, Source)> {
        let mut own = vec![("t", Source::Input(0))];
        for (k, name) in MOTION.into_iter().enumerate().skip(1) {
            let axis = (k - 1) % 3;
            let read = match (k, frame) {
                (1..4, _) => Read::Position(at, axis),
                (4..7, _) => Read::Velocity(at, axis),
                (_, Some(frame)) => Read::AngularVelocity(self.names.frames[frame], axis),
                _ => continue,
            };
            own.push((name, self.input(read, name.to_owned())));
        }
        own
    }

    fn held(&mut self, place: usize, name: &str) -> Source {
        self.input(Read::Held(place), name.to_owned())
    }

    /// What a quantity is read from.
    fn quantity(&mut self, quantity: &Quantity) -> Result<Source, ModelError> {
        let name = quantity.name();
        let joint = |joint: &str, freedom: usize| {
            self.names.joint(joint).map(|(_, id)| id.coordinate(freedom))
        };
        let center = |of: &str| -> PointOn { self.names.point(of, [0.0; 3]) };
        let read = match quantity {
            Quantity::Signal(name) => {
                let signal = self.names.model.signals.iter().find(|own| own.name == *name);
                return self.signal(signal.expect("it was found by its name"));
            }
            Quantity::Coordinate { joint: of, freedom } => {
                joint(of, *freedom).map(Read::Coordinate)
            }
            Quantity::Rate { joint: of, freedom } => joint(of, *freedom).map(Read::Rate),
            Quantity::Position { of, axis } => Some(Read::Position(center(of), *axis)),
            Quantity::Velocity { of, axis } => Some(Read::Velocity(center(of), *axis)),
            Quantity::AngularVelocity { of, axis } => {
                let frame = self.names.index(of).map(|k| self.names.frames[k]);
                frame.map(|frame| Read::AngularVelocity(frame, *axis))
            }
        };
        Ok(self.input(read.expect("it was found by its name"), name))
    }

    /// Adds an expression of its own variables and of what it names.
    pub(crate) fn formula(
        &mut self,
        (owner, key): (&str, &str),
        formula: &Formula,
        own: &[(&str, Source)],
    ) -> Result<Source, ModelError> {
        let names: Vec<&str> = own.iter().map(|(name, _)| *name).collect();
        let mut reads = Vec::new();
        let program = self.quantities.compile(formula, &names, &mut reads);
        let program = program.map_err(|error| refusal(key, error))?;
        let mut from: Vec<(Source, String)> =
            own.iter().map(|(name, source)| (*source, (*name).to_owned())).collect();
        for read in &reads {
            from.push((self.quantity(read)?, read.name()));
        }
        Ok(self.term(Term { owner: owner.to_owned(), program, from, is_own: false }))
    }

    /// Adds a part of a signal.
    pub(crate) fn part(&mut self, owner: &str, text: &str, from: &[(&str, Source)]) -> Source {
        let place = |name: &str| from.iter().position(|(own, _)| *own == name);
        let program = Program::parse(text, &mut |name| place(name).map(Known::Input));
        let program = program.expect("numbers of a valid model");
        let from = from.iter().map(|(name, source)| (*source, (*name).to_owned())).collect();
        self.term(Term { owner: owner.to_owned(), program, from, is_own: true })
    }

    fn term(&mut self, term: Term) -> Source {
        self.terms.push(term);
        Source::Term(self.terms.len() - 1)
    }

    /// What the value of a signal is; those that need one another at once were refused.
    fn signal(&mut self, signal: &'a Signal) -> Result<Source, ModelError> {
        if let Some(known) = self.signals.get(signal.name.as_str()) {
            return Ok(*known);
        }
        let (place, name) = (self.place(signal), signal.name.as_str());
        let start = signal.start.unwrap_or(0.0);
        let source = if signal.rate.is_some() || signal.filter.is_some() {
            self.start[place] = start;
            Source::State(place)
        } else if let Some(delay) = &signal.delay {
            let step = self.names.model.settings.step;
            let count = kept(delay.time, step);
            let past = Past { first: place, count, step, delay: delay.time };
            self.pasts.insert(name, past);
            self.input(Read::Past(past), name.to_owned())
        } else if signal.every.is_some() {
            self.start[place] = start;
            self.held(place, name)
        } else if let Some(value) = &signal.value {
            let own = [("t", Source::Input(0))];
            self.formula((&label(name), &key(name, "value")), value, &own)?
        } else if let Some(pid) = &signal.pid {
            self.pid(name, pid, place)?
        } else if let Some(transfer) = &signal.transfer {
            self.transfer(name, transfer, place)?
        } else {
            self.start[place] = start;
            self.held(place, name)
        };
        self.signals.insert(name, source);
        Ok(source)
    }

    fn of(&mut self, name: &str, kind: &str, of: &Formula) -> Result<Source, ModelError> {
        let own = [("t", Source::Input(0))];
        self.formula((&label(name), &key(name, &format!("{kind}.of"))), of, &own)
    }

    fn feedforward(&mut self, name: &str, pid: &Pid) -> Result<Option<Source>, ModelError> {
        let own = [("t", Source::Input(0))];
        let Some(formula) = &pid.feedforward else { return Ok(None) };
        let key = key(name, "pid.feedforward");
        self.formula((&label(name), &key), formula, &own).map(Some)
    }

    /// A continuous controller, with the rates of its states.
    fn pid(&mut self, name: &'a str, pid: &Pid, place: usize) -> Result<Source, ModelError> {
        let error = self.of(name, "pid", &pid.of)?;
        let ahead = self.feedforward(name, pid)?;
        let mut from = vec![("e", error)];
        let mut text = format!("{:?}*e", pid.proportional);
        let integrates = pid.integral != 0.0;
        if integrates {
            from.push(("i", Source::State(place)));
            text += &format!(" + {:?}*i", pid.integral);
        }
        let filter = pid.filter.unwrap_or(1.0);
        let filtered = place + usize::from(integrates);
        if pid.derivative != 0.0 {
            from.push(("d", Source::State(filtered)));
            text += &format!(" + {:?}*((e - d)/{filter:?})", pid.derivative);
        }
        if let Some(ahead) = ahead {
            from.push(("f", ahead));
            text += " + f";
        }
        let owner = label(name);
        let unlimited = self.part(&owner, &text, &from);
        let output = match pid.limits {
            Some([least, most]) => {
                let text = format!("clamp(w, {least:?}, {most:?})");
                self.part(&owner, &text, &[("w", unlimited)])
            }
            None => unlimited,
        };
        let gains = gains(pid);
        let mut parts = vec![("e", error), ("u", unlimited)];
        if integrates {
            parts.push(("i", Source::State(place)));
            let rate = match gains.tracking {
                Some(time) => {
                    let text = format!("e + (u - w)/{:?}", pid.integral * time);
                    self.part(&owner, &text, &[("e", error), ("u", output), ("w", unlimited)])
                }
                None => error,
            };
            self.rates[place] = Some(rate);
        }
        if pid.derivative != 0.0 {
            parts.push(("d", Source::State(filtered)));
            let text = format!("(e - d)/{filter:?}");
            let from = [("e", error), ("d", Source::State(filtered))];
            self.rates[filtered] = Some(self.part(&owner, &text, &from));
            self.filtered.push((filtered, error));
        }
        let parts = parts.into_iter().map(|(part, source)| output::Part::new(name, part, source));
        self.output.extend(parts);
        Ok(output)
    }

    /// A transfer function, with the rates of its states.
    fn transfer(
        &mut self,
        name: &str,
        transfer: &Transfer,
        place: usize,
    ) -> Result<Source, ModelError> {
        let Transfer { of, numerator, denominator } = transfer;
        let n = denominator.len() - 1;
        let lead = denominator[0];
        let a: Vec<f64> = denominator.iter().map(|c| c / lead).collect();
        let mut b = vec![0.0; n + 1 - numerator.len()];
        b.extend(numerator.iter().map(|c| c / lead));
        let states: Vec<String> = (1..=n).map(|k| format!("x{k}")).collect();
        let mut from: Vec<(&str, Source)> =
            states.iter().zip(place..).map(|(x, k)| (x.as_str(), Source::State(k))).collect();
        let sum = |c: &dyn Fn(usize) -> f64| {
            let terms = (1..=n).filter(|k| c(*k) != 0.0);
            terms.map(|k| format!(" + {:?}*x{k}", c(k))).collect::<String>()
        };
        let owner = label(name);
        let (text, direct) = (sum(&|k| b[k] - a[k] * b[0]), b[0] != 0.0);
        // without a direct part the value needs nothing at once: signals in a circle
        let value = (!direct).then(|| self.part(&owner, &format!("0{text}"), &from));
        if let (Some(value), Some((name, _))) = (value, self.places.get_key_value(name)) {
            self.signals.insert(name, value);
        }
        let input = self.of(name, "transfer", of)?;
        from.push(("u", input));
        let rate = self.part(&owner, &format!("u{}", sum(&|k| -a[k])), &from);
        self.rates[place] = Some(rate);
        for k in 1..n {
            self.rates[place + k] = Some(Source::State(place + k - 1));
        }
        Ok(value.unwrap_or_else(|| self.part(&owner, &format!("{:?}*u{text}", b[0]), &from)))
    }

    /// The rates of states whose value needs none of what they read.
    fn add_rates(&mut self, signal: &'a Signal) -> Result<(), ModelError> {
        let (place, name) = (self.place(signal), signal.name.as_str());
        let own = [("t", Source::Input(0))];
        if let Some(rate) = &signal.rate {
            let rate = self.formula((&label(name), &key(name, "rate")), rate, &own)?;
            self.rates[place] = Some(rate);
        }
        if let Some(filter) = &signal.filter {
            let of = self.of(name, "filter", &filter.of)?;
            let text = format!("(of - u)/{:?}", filter.time_constant);
            let from = [("of", of), ("u", Source::State(place))];
            self.rates[place] = Some(self.part(&label(name), &text, &from));
        }
        Ok(())
    }

    /// What happens at nodes, in the order of dependence.
    fn tasks(&mut self) -> Result<Vec<Due>, ModelError> {
        let (model, mut all) = (self.names.model, Vec::new());
        let step = model.settings.step;
        for signal in &model.signals {
            let (place, name) = (self.place(signal), signal.name.as_str());
            if let (Some(past), Some(delay)) = (self.pasts.get(name).copied(), &signal.delay) {
                let of = self.of(name, "delay", &delay.of)?;
                all.push((place, of, None, Due { every: 1, task: Task::Keep { past, of } }));
            }
            let Some(period) = signal.every else { continue };
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // checked: positive
            let every = (period / step).round() as u64;
            if let Some(value) = &signal.value {
                let own = [("t", Source::Input(0)), ("last", self.held(place, name))];
                let key = key(name, "value");
                let of = self.formula((&label(name), &key), value, &own)?;
                let task = Task::Value { held: place, of };
                all.push((place, of, None, Due { every, task }));
            } else if let Some(pid) = &signal.pid {
                let error = self.of(name, "pid", &pid.of)?;
                let feedforward = self.feedforward(name, pid)?;
                let gains = gains(pid);
                let task = Task::Pid { held: place, error, feedforward, gains, period };
                all.push((place, error, feedforward, Due { every, task }));
                for (part, k) in [("i", 1), ("d", 2)] {
                    let source = self.held(place + k, &format!("{name}.{part}"));
                    self.output.push(output::Part::new(name, part, source));
                }
                self.output.push(output::Part::new(name, "e", error));
            }
        }
        let mut places = Vec::new();
        let mut sorted = Vec::new();
        for k in 0..all.len() {
            self.visit(k, &all, &mut places, &mut sorted);
        }
        Ok(sorted)
    }

    /// Adds a task after those whose held values it reads, but for circles.
    fn visit(
        &self,
        k: usize,
        all: &[(usize, Source, Option<Source>, Due)],
        visited: &mut Vec<usize>,
        sorted: &mut Vec<Due>,
    ) {
        if visited.contains(&k) {
            return;
        }
        visited.push(k);
        let (_, of, ahead, due) = all[k];
        let (_, inputs, _) =
            self.reached(&[Some(of), ahead].into_iter().flatten().collect::<Vec<_>>());
        for input in inputs {
            if let (Read::Held(place), _) = self.inputs[input]
                && let Some(other) = all.iter().position(|(own, ..)| *own == place)
            {
                self.visit(other, all, visited, sorted);
            }
        }
        sorted.push(due);
    }

    /// Terms, inputs and states that some numbers need, each in order.
    fn reached(&self, sources: &[Source]) -> (Vec<usize>, Vec<usize>, Vec<usize>) {
        let mut waiting = sources.to_vec();
        let mut found: [Vec<bool>; 3] =
            [self.terms.len(), self.inputs.len(), self.states].map(|n| vec![false; n]);
        while let Some(source) = waiting.pop() {
            match source {
                Source::Input(k) => found[1][k] = true,
                Source::State(k) if !found[2][k] => {
                    found[2][k] = true;
                    waiting.extend(self.rates[k]);
                }
                Source::Term(k) if !found[0][k] => {
                    found[0][k] = true;
                    waiting.extend(self.terms[k].reads());
                }
                _ => {}
            }
        }
        let [terms, inputs, states] = found.map(|found| {
            let all = found.iter().enumerate().filter(|(_, found)| **found);
            all.map(|(k, _)| k).collect()
        });
        (terms, inputs, states)
    }

    /// The part of the network that these efforts need.
    pub(crate) fn needed(&self, efforts: &[Option<Source>], is_conservative: bool) -> Needed {
        let wanted: Vec<Source> = efforts.iter().flatten().copied().collect();
        let (terms, mut inputs, states) = self.reached(&wanted);
        if inputs.first() != Some(&0) {
            inputs.insert(0, 0); // the time says where a fault is
        }
        let dissipative = !is_conservative
            && (!states.is_empty() || inputs.iter().any(|k| is_rate(&self.inputs[*k].0)));
        let network = self.part_of(&terms, &inputs, &states, efforts, dissipative);
        let reads = inputs.iter().map(|k| self.inputs[*k].0).collect();
        Needed { network, reads, states }
    }

    fn part_of(
        &self,
        terms: &[usize],
        inputs: &[usize],
        states: &[usize],
        efforts: &[Option<Source>],
        dissipative: bool,
    ) -> Arc<Network> {
        let place = |list: &[usize], k: usize| list.binary_search(&k).ok();
        let moved = |source: Source| match source {
            Source::Input(k) => place(inputs, k).map(Source::Input),
            Source::State(k) => place(states, k).map(Source::State),
            Source::Term(k) => place(terms, k).map(Source::Term),
        };
        let own = |k: &usize| {
            let Term { owner, program, from, is_own } = self.terms[*k].clone();
            // what is named and not read is nowhere: the time stands for it
            let from = from
                .into_iter()
                .map(|(source, name)| (moved(source).unwrap_or(Source::Input(0)), name))
                .collect();
            Term { owner, program, from, is_own }
        };
        let efforts = efforts.iter().map(|effort| effort.and_then(moved)).collect();
        let rates = states.iter().filter_map(|k| self.rates[*k].and_then(moved)).collect();
        let list = terms.iter().map(own).collect();
        Arc::new(Network::new(list, efforts, rates, inputs.len(), dissipative))
    }

    /// Adds all signals to a mechanism, before other terms are added; their numbers along a run.
    pub(crate) fn add_signals(
        &mut self,
        builder: &mut MechanismBuilder,
    ) -> Result<Option<output::SignalNetwork>, ModelError> {
        if self.names.model.signals.is_empty() {
            return Ok(None);
        }
        let tasks = self.tasks()?;
        let known = std::mem::take(&mut self.output);
        let of = |signal: &Signal, part: &str| {
            known.iter().find(|own| own.signal == signal.name && own.part == part).cloned()
        };
        let signals = self.names.model.signals.iter();
        let output: Vec<output::Part> = signals
            .flat_map(|own| parts_of_signal(own).into_iter().filter_map(move |part| of(own, part)))
            .collect();
        let all = |n: usize| (0..n).collect::<Vec<usize>>();
        let (terms, inputs, states) =
            (all(self.terms.len()), all(self.inputs.len()), all(self.states));
        let network = self.part_of(&terms, &inputs, &states, &[], false);
        let held = self.inputs.iter().enumerate().filter_map(|(k, (read, _))| match read {
            Read::Held(place) => Some((k, Held::At(*place))),
            Read::Past(past) => Some((k, Held::Past(*past))),
            _ => None,
        });
        let sampler = NodeTasks {
            network: network.clone(),
            count: self.start.len(),
            states: self.states,
            tasks,
            held: held.collect(),
            start: self.start.clone(),
            filtered: self.filtered.clone(),
            work: Mutex::new(vec![0.0; self.inputs.len()]),
        };
        let reads: Vec<Read> = self.inputs.iter().map(|(read, _)| *read).collect();
        builder.signals(reads, states, network.clone(), Arc::new(sampler));
        let numbers = self.names.model.signals.iter().filter(|own| own.kinds().is_empty());
        let numbers =
            numbers.map(|own| (own.name.clone(), self.places[own.name.as_str()])).collect();
        Ok(Some(output::SignalNetwork { network, parts: output, numbers }))
    }

    /// The value of each signal, before its parts.
    fn list_output(&mut self) {
        let values = self.signals.iter();
        let mut values: Vec<output::Part> =
            values.map(|(name, source)| output::Part::new(name, "", *source)).collect();
        values.append(&mut self.output);
        self.output = values;
    }
}

fn is_rate(read: &Read) -> bool {
    matches!(
        read,
        Read::Rate(_)
            | Read::Velocity(..)
            | Read::DistanceRate(_)
            | Read::AngularVelocity(..)
            | Read::Six { part: 6.., .. }
    )
}

fn gains(pid: &Pid) -> Gains {
    let Pid { proportional, integral, derivative, .. } = *pid;
    let limited = pid.limits.is_some() && integral != 0.0;
    Gains {
        proportional,
        integral,
        derivative,
        filter: pid.filter.unwrap_or(0.0),
        limits: pid.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
        tracking: limited.then(|| pid.tracking.unwrap_or(proportional / integral)),
    }
}

fn label(name: &str) -> String {
    format!("signal `{name}`")
}

fn key(name: &str, key: &str) -> String {
    format!("signal.{name}.{key}")
}

/// Time constants that the step does not resolve.
pub(crate) fn warnings(model: &Model) -> Vec<String> {
    let step = model.settings.step;
    let warning = |signal: &Signal| {
        let filter = signal.filter.as_ref().map(|own| own.time_constant);
        let pid = signal.pid.as_ref().filter(|_| signal.every.is_none());
        let time = filter.or(pid.and_then(|own| own.filter))?;
        (step > 0.5 * time).then(|| {
            format!(
                "signal `{}`: its time constant is {time} s, of which a step of {step} s is more than half: it \
                 oscillates from step to step; step = {} would resolve it",
                signal.name,
                rounded(0.5 * time, 3)
            )
        })
    };
    model.signals.iter().filter_map(warning).collect()
}

/// An expression that is none.
pub(crate) fn refusal(key: &str, error: ExpressionError) -> ModelError {
    ModelError::Assembly(vec![Problem::new(key, error.message).help(error.help)])
}
