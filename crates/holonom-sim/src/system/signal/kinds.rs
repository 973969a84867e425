//! What the value of a signal of each kind is, and the rates of its states.

use super::network::NetworkTerm;
use super::{NumberSource, Terms, key, label, output};
use holonom_model::expression::{ExpressionProgram, KnownName};
use holonom_model::{ModelError, OUTPUT, Signal, SignalPart, Transfer};
use vi_core::Number;
use vi_core::num_dual::Dual64;
use vi_multibody::builder::Read;
use vi_multibody::law::Past;

/// How many internal variables a signal has: continuous states, then held values.
pub(super) fn sizes(signal: &Signal, step: f64) -> [usize; 2] {
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
    /// What the value of a signal is; those that need one another at once were refused.
    pub(super) fn signal(&mut self, signal: &'a Signal) -> Result<NumberSource, ModelError> {
        if let Some(known) = self.signals.get(signal.name.as_str()) {
            return Ok(*known);
        }
        let (place, name) = (self.place(signal), signal.name.as_str());
        let start = signal.start.unwrap_or(0.0);
        let source = if signal.rate.is_some() || signal.filter.is_some() {
            self.start[place] = start;
            NumberSource::State(place)
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
            let own = [("t", NumberSource::Input(0))];
            self.formula(&label(name), &key(name, "value"), value, &own)?
        } else if signal.pid.is_some() || signal.transfer.is_some() {
            self.value_of_parts(signal, place)?
        } else {
            self.start[place] = start;
            self.held(place, name)
        };
        self.signals.insert(name, source);
        Ok(source)
    }

    /// The value of a signal by its parts; the rates of its states come later, since its value may
    /// need none of what they read.
    fn value_of_parts(
        &mut self,
        signal: &'a Signal,
        place: usize,
    ) -> Result<NumberSource, ModelError> {
        let name = signal.name.as_str();
        let parts = signal.parts(&mut |_, value| Dual64::of(value));
        let states = parts.iter().filter(|part| part.is_rate).zip(place..);
        let states: Vec<(String, NumberSource)> =
            states.map(|(part, k)| (part.name.clone(), NumberSource::State(k))).collect();
        self.parts.insert(name, states);
        for part in parts.iter().filter(|part| !part.is_rate) {
            let source = self.part_of_signal(signal, part)?;
            self.parts.entry(name).or_default().push((part.name.clone(), source));
        }
        let known = self.parts[name].clone();
        let of = |part: &str| known.iter().find(|(own, _)| own == part).map(|(_, source)| *source);
        if signal.transfer.is_some() {
            let states =
                known.iter().filter(|(_, source)| matches!(source, NumberSource::State(_)));
            self.unseen.extend(states.map(|(own, source)| (format!("{name}.{own}"), *source)));
        }
        if signal.pid.is_some() {
            let shown = [("e", "e"), ("u", "w"), ("i", "i"), ("d", "d")];
            let shown = shown.into_iter().filter_map(|(shown, part)| Some((shown, of(part)?)));
            self.output
                .extend(shown.map(|(part, source)| output::OutputNumber::new(name, part, source)));
            if let (Some(NumberSource::State(state)), Some(error)) = (of("d"), of("e")) {
                self.filtered.push((state, error));
            }
        }
        Ok(of(OUTPUT).expect("every signal has an output"))
    }

    /// A part of a signal, of its own expressions, its states and the parts that are known.
    fn part_of_signal(
        &mut self,
        signal: &'a Signal,
        part: &SignalPart,
    ) -> Result<NumberSource, ModelError> {
        let (name, mut read) = (signal.name.as_str(), Vec::<String>::new());
        let program = ExpressionProgram::parse(&part.text, &mut |name| {
            if let Some((_, number)) = part.numbers.iter().find(|(own, _)| own == name) {
                return Some(KnownName::Constant(number.re));
            }
            Some(KnownName::Input(read.iter().position(|own| own == name).unwrap_or_else(|| {
                read.push(name.to_owned());
                read.len() - 1
            })))
        });
        let program = program.expect("numbers of a valid model");
        let mut from = Vec::new();
        for read in read {
            let known = self.parts.get(name).into_iter().flatten();
            let known = known.clone().find(|(own, _)| *own == read).map(|(_, source)| *source);
            let source = match known {
                Some(source) => source,
                None => self.stated(signal, &read)?,
            };
            from.push((source, read));
        }
        if let [(source, read)] = &from[..]
            && *read == part.text
        {
            return Ok(*source);
        }
        Ok(self.term(NetworkTerm { owner: label(name), program, from, is_own: true }))
    }

    /// What a signal states as an expression, `of` or `feedforward`.
    pub(super) fn stated(
        &mut self,
        signal: &'a Signal,
        part: &str,
    ) -> Result<NumberSource, ModelError> {
        let own = [("t", NumberSource::Input(0))];
        let (of, formula) = signal.stated(part).expect("it is stated");
        let name = &signal.name;
        let source = self.formula(&label(name), &key(name, of), formula, &own)?;
        self.parts.entry(name).or_default().push((part.to_owned(), source));
        Ok(source)
    }

    /// The rates of the states of a signal.
    pub(super) fn add_rates(&mut self, signal: &'a Signal) -> Result<(), ModelError> {
        let (place, name) = (self.place(signal), signal.name.as_str());
        let own = [("t", NumberSource::Input(0))];
        if let Some(rate) = &signal.rate {
            let rate = self.formula(&label(name), &key(name, "rate"), rate, &own)?;
            self.rates[place] = Some(rate);
        }
        if signal.filter.is_some() {
            self.parts.insert(name, vec![(OUTPUT.to_owned(), NumberSource::State(place))]);
        }
        let parts = signal.parts(&mut |_, value| Dual64::of(value));
        for (part, state) in parts.iter().filter(|part| part.is_rate).zip(place..) {
            self.rates[state] = Some(self.part_of_signal(signal, part)?);
        }
        Ok(())
    }
}
