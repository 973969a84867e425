//! Parts of the network of a model: what a law needs, what all signals need.

use super::network::{Network, NetworkTerm, NumberSource};
use super::sampler::{HeldInputs, NodeTasks};
use super::{Terms, output};
use crate::sensor::parts_of_signal;
use holonom_model::{ModelError, Signal};
use std::sync::{Arc, Mutex};
use vi_multibody::builder::{MechanismBuilder, Read};

/// Part of a network that some numbers need.
pub(crate) struct Needed {
    pub(crate) network: Arc<Network>,
    pub(crate) reads: Vec<Read>,
    /// Its states among the internal variables.
    pub(crate) states: Vec<usize>,
}

impl<'a> Terms<'a> {
    /// Terms, inputs and states that some numbers need, each in order.
    pub(super) fn reached(&self, sources: &[NumberSource]) -> (Vec<usize>, Vec<usize>, Vec<usize>) {
        let mut waiting = sources.to_vec();
        let mut found: [Vec<bool>; 3] =
            [self.terms.len(), self.inputs.len(), self.states].map(|n| vec![false; n]);
        while let Some(source) = waiting.pop() {
            match source {
                NumberSource::Input(k) => found[1][k] = true,
                NumberSource::State(k) if !found[2][k] => {
                    found[2][k] = true;
                    waiting.extend(self.rates[k]);
                }
                NumberSource::Term(k) if !found[0][k] => {
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
    pub(crate) fn needed(&self, efforts: &[Option<NumberSource>], is_conservative: bool) -> Needed {
        let wanted: Vec<NumberSource> = efforts.iter().flatten().copied().collect();
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

    pub(super) fn part_of(
        &self,
        terms: &[usize],
        inputs: &[usize],
        states: &[usize],
        efforts: &[Option<NumberSource>],
        dissipative: bool,
    ) -> Arc<Network> {
        let place = |list: &[usize], k: usize| list.binary_search(&k).ok();
        let moved = |source: NumberSource| match source {
            NumberSource::Input(k) => place(inputs, k).map(NumberSource::Input),
            NumberSource::State(k) => place(states, k).map(NumberSource::State),
            NumberSource::Term(k) => place(terms, k).map(NumberSource::Term),
        };
        let own = |k: &usize| {
            let NetworkTerm { owner, program, from, is_own } = self.terms[*k].clone();
            // what is named and not read is nowhere: the time stands for it
            let from = from
                .into_iter()
                .map(|(source, name)| (moved(source).unwrap_or(NumberSource::Input(0)), name))
                .collect();
            NetworkTerm { owner, program, from, is_own }
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
        let names = self.names;
        let watched = names.outside.watched.iter().map(|own| {
            let Some(formula) = own else { return Ok(None) };
            let time = [("t", NumberSource::Input(0))];
            self.formula("signals", "signal", formula, &time).map(Some)
        });
        let watched: Vec<Option<NumberSource>> = watched.collect::<Result<_, ModelError>>()?;
        let known = std::mem::take(&mut self.output);
        let of = |signal: &Signal, part: &str| {
            known.iter().find(|own| own.signal == signal.name && own.part == part).cloned()
        };
        let signals = self.names.model.signals.iter();
        let output: Vec<output::OutputNumber> = signals
            .flat_map(|own| parts_of_signal(own).into_iter().filter_map(move |part| of(own, part)))
            .collect();
        let all = |n: usize| (0..n).collect::<Vec<usize>>();
        let (terms, inputs, states) =
            (all(self.terms.len()), all(self.inputs.len()), all(self.states));
        let network = self.part_of(&terms, &inputs, &states, &watched, false);
        let held = self.inputs.iter().enumerate().filter_map(|(k, (read, _))| match read {
            Read::Held(place) => Some((k, HeldInputs::At(*place))),
            Read::Past(past) => Some((k, HeldInputs::Past(*past))),
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
        let measured = std::mem::take(&mut self.measured);
        let states = std::mem::take(&mut self.unseen);
        Ok(Some(output::SignalNetwork { network, parts: output, states, numbers, measured }))
    }

    /// The value of each signal, before its parts.
    pub(super) fn list_output(&mut self) {
        let values = self.signals.iter();
        let mut values: Vec<output::OutputNumber> =
            values.map(|(name, source)| output::OutputNumber::new(name, "", *source)).collect();
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
            | Read::AlongRate(..)
            | Read::RelativeSpin(..)
            | Read::Six { part: 6.., .. }
    )
}
