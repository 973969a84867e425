//! What the value of a signal of each kind is, and the rates of its states.

use super::sampler::Gains;
use super::{Source, Terms, key, label, output};
use holonom_model::{Formula, ModelError, Pid, Signal, Transfer};
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
    pub(super) fn signal(&mut self, signal: &'a Signal) -> Result<Source, ModelError> {
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

    pub(super) fn of(
        &mut self,
        name: &str,
        kind: &str,
        of: &Formula,
    ) -> Result<Source, ModelError> {
        let own = [("t", Source::Input(0))];
        self.formula((&label(name), &key(name, &format!("{kind}.of"))), of, &own)
    }

    pub(super) fn feedforward(
        &mut self,
        name: &str,
        pid: &Pid,
    ) -> Result<Option<Source>, ModelError> {
        let own = [("t", Source::Input(0))];
        let Some(formula) = &pid.feedforward else { return Ok(None) };
        let key = key(name, "pid.feedforward");
        self.formula((&label(name), &key), formula, &own).map(Some)
    }

    /// A continuous controller, with the rates of its states.
    pub(super) fn pid(
        &mut self,
        name: &'a str,
        pid: &Pid,
        place: usize,
    ) -> Result<Source, ModelError> {
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
    pub(super) fn transfer(
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
    pub(super) fn add_rates(&mut self, signal: &'a Signal) -> Result<(), ModelError> {
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
}

pub(super) fn gains(pid: &Pid) -> Gains {
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
