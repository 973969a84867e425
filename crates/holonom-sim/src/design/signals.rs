//! Signals by a parameter: what their values and the rates of their states are by it.
//!
//! ```text
//! s = e(θ; …)        s_θ: an expression that reads what e reads
//! ż = φ(θ; y, z)     φ_θ likewise;    z(0) = start, or what is filtered
//! z⁺ = S(θ; y, z)    S_θ by the same, and by the numbers of controllers     [2.70]
//! ```
//! A signal with states is taken apart into signals that are values or rates ([`Signal::parts`]),
//! which have the states of the signal in their order.

use holonom_model::expression::Moving;
use holonom_model::{
    Formula, Model, MovingText, OUTPUT, ParameterTangent, Signal, SignalPart, Slopes,
};
use std::collections::BTreeMap;
use vi_multibody::design::SampledTangent;

/// The signals of a model, taken apart.
#[derive(Default)]
pub(super) struct SignalsApart {
    pub(super) signals: Vec<Signal>,
    /// Expressions that a parameter changes, by the key of the part.
    pub(super) texts: BTreeMap<String, MovingText>,
    /// What is taken of the keys of the model: where the expressions of a part stand.
    pub(super) keys: BTreeMap<String, Vec<String>>,
}

/// A signal, or a part of one, that is a value or has a rate.
fn own(name: String, is_rate: bool, text: String) -> Signal {
    let formula = Some(Formula(text));
    match is_rate {
        true => Signal { name, rate: formula, ..Signal::default() },
        false => Signal { name, value: formula, ..Signal::default() },
    }
}

impl SignalsApart {
    pub(super) fn new(parameter: &ParameterTangent, model: &Model, slopes: &Slopes<'_>) -> Self {
        let mut all = Self::default();
        for signal in &model.signals {
            let at = |key: &str| format!("signal.{}.{key}", signal.name);
            let parts = signal.parts(&mut |key, value| slopes.number(&at(key), value));
            match &parts[..] {
                [] => all.signals.push(signal.clone()),
                parts => parts.iter().for_each(|part| all.add(parameter, signal, part)),
            }
        }
        all
    }

    /// Adds a part of a signal.
    fn add(&mut self, parameter: &ParameterTangent, signal: &Signal, part: &SignalPart) {
        let of = &signal.name;
        let full = |part: &str| match part {
            OUTPUT => of.clone(),
            "w" => format!("{of}.u"), // as it is shown
            _ => format!("{of}.{part}"),
        };
        let number = |name: &str| part.numbers.iter().find(|(own, _)| own == name);
        let (mut moving, mut keys) = (BTreeMap::new(), Vec::new());
        let still = part.renamed(&mut |name| match (number(name), signal.stated(name)) {
            (Some((_, own)), _) => format!("({:?})", own.re),
            (_, Some((_, formula))) => format!("({})", formula.0),
            _ => full(name),
        });
        let changing = part.renamed(&mut |name| match (number(name), signal.stated(name)) {
            (Some((_, own)), _) if own.eps == 0.0 => format!("({:?})", own.re),
            (Some((_, own)), _) => {
                let (value, slope) = (format!("({:?})", own.re), format!("({:?})", own.eps));
                moving.insert(format!("{of}.{name}"), Moving { value, slope });
                format!("{of}.{name}")
            }
            (_, Some((key, formula))) => {
                let key = format!("signal.{of}.{key}");
                let text = match parameter.formulas.get(&key) {
                    None => formula.0.clone(),
                    Some(own) => {
                        moving.extend(own.moving.clone());
                        own.text.clone()
                    }
                };
                keys.push(key);
                format!("({text})")
            }
            _ => full(name),
        });
        let name = full(&part.name);
        let path = format!("signal.{name}.{}", if part.is_rate { "rate" } else { "value" });
        self.keys.insert(path.clone(), keys);
        self.texts.insert(path, MovingText { text: changing, moving });
        self.signals.push(own(name, part.is_rate, still));
    }
}

/// How signals change: the rates of their states, what these begin with, and what is sampled.
#[derive(Default)]
pub(super) struct SignalChanges {
    rates: Vec<Option<Formula>>,
    starts: Vec<Option<Formula>>,
    sampled: Vec<SampledSlopes>,
}

/// How a signal that is sampled or delayed changes.
#[derive(Default)]
pub(super) struct SampledSlopes {
    pub(super) signal: String,
    /// What is sampled.
    pub(super) of: Option<Formula>,
    /// What a controller adds to its output.
    pub(super) ahead: Option<Formula>,
    /// Numbers of a controller.
    pub(super) numbers: Vec<f64>,
    /// What is held before the first sample.
    pub(super) start: f64,
}

impl SampledSlopes {
    fn changes(&self) -> bool {
        let Self { of, ahead, numbers, start, .. } = self;
        of.is_some() || ahead.is_some() || !numbers.is_empty() || *start != 0.0
    }
}

impl SignalChanges {
    /// Adds a state.
    pub(super) fn push(&mut self, rate: Option<Formula>, start: Option<Formula>) {
        self.rates.push(rate);
        self.starts.push(start);
    }

    /// Adds what is sampled, where it changes.
    pub(super) fn push_sampled(&mut self, own: SampledSlopes) {
        self.sampled.extend(own.changes().then_some(own));
    }

    /// Of all states, rates and then starts, and of all that is sampled; `None` where nothing
    /// changes.
    pub(super) fn watched(&self) -> Option<Vec<Option<Formula>>> {
        let sampled = self.sampled.iter().flat_map(|own| [&own.of, &own.ahead]);
        let all: Vec<_> = self.rates.iter().chain(&self.starts).chain(sampled).cloned().collect();
        (!self.sampled.is_empty() || all.iter().any(Option::is_some)).then_some(all)
    }

    /// What is sampled and changes, held at the `place` of its signal: by which of the watched.
    pub(super) fn sampled(
        &self,
        place: impl Fn(&str) -> Option<usize>,
    ) -> Option<Vec<SampledTangent>> {
        let first = 2 * self.rates.len();
        let own = |(k, own): (usize, &SampledSlopes)| {
            let at = |side: usize, formula: &Option<Formula>| {
                formula.as_ref().map(|_| first + 2 * k + side)
            };
            Some(SampledTangent {
                place: place(&own.signal)?,
                of: at(0, &own.of),
                ahead: at(1, &own.ahead),
                numbers: own.numbers.clone(),
                start: own.start,
            })
        };
        self.sampled.iter().enumerate().map(own).collect()
    }
}
