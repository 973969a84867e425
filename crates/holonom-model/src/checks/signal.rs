//! Checks of signals: what they are, what they read, loops of them.

use std::collections::BTreeMap;

use crate::Model;
use crate::checks::Checker;
use crate::formula::{LAST, is_readable};
use crate::quantity::{Quantities, Quantity};
use crate::types::signal::{Pid, Signal, Transfer};

impl Checker<'_> {
    pub(crate) fn signal(&mut self, key: &str, signal: &Signal, known: &Quantities<'_>) {
        self.signal_name(key, &signal.name);
        self.signal_kind(key, signal);
        for (name, formula) in signal.formulas() {
            let own: &[&str] = match signal.every.is_some() && name == "value" {
                true => &["t", LAST],
                false => &["t"],
            };
            let (key, mut reads) = (format!("{key}.{name}"), Vec::new());
            match signal.every.is_some() || signal.delay.is_some() {
                true => self.formula_of_node(&key, formula, own, known, &mut reads),
                false => self.formula(&key, formula, own, known, &mut reads),
            };
        }
        let mut positive = |name: &str, value: Option<f64>| {
            if let Some(value) = value.filter(|value| *value <= 0.0) {
                let message = format!("`{name}` is {value} s");
                self.report(format!("{key}.{name}"), message, "write a positive time");
            }
        };
        positive("filter.time_constant", signal.filter.as_ref().map(|own| own.time_constant));
        positive("pid.filter", signal.pid.as_ref().and_then(|own| own.filter));
        positive("pid.tracking", signal.pid.as_ref().and_then(|own| own.tracking));
        positive("every", signal.every);
        if let Some(pid) = &signal.pid {
            self.pid(&format!("{key}.pid"), pid);
        }
        if let Some(transfer) = &signal.transfer {
            self.transfer(&format!("{key}.transfer"), transfer);
        }
        let step = self.model.settings.step;
        if let Some(every) = signal.every.filter(|every| *every > 0.0) {
            let count = every / step;
            let whole = count.round().max(1.0);
            if (count - whole).abs() > 1e-9 * whole {
                let (less, more) = (count.floor().max(1.0), count.ceil());
                let message = format!("`every = {every}` is {} steps", rounded(count));
                let times = match count < 1.0 {
                    true => format!("{}", rounded(less * step)),
                    false => format!("{}, {}", rounded(less * step), rounded(more * step)),
                };
                let help = format!("write {times}, or `step = {}`", rounded(every / more));
                self.report(format!("{key}.every"), message, help);
            }
        }
        if let Some(delay) = &signal.delay
            && delay.time < step
        {
            let message = format!("a delay of {} s is less than a step of {step} s", delay.time);
            let help = "write at least a step, or a `filter`";
            self.report(format!("{key}.delay.time"), message, help);
        }
        self.signal_and_scheme(key, signal);
    }

    /// Whether expressions can name it.
    fn signal_name(&mut self, key: &str, name: &str) {
        if !is_readable(name) {
            let message = format!("expressions cannot read a signal `{name}`");
            let help = "choose another name: letters, digits and _, a letter first, no function or variable of expressions";
            self.report(format!("{key}.name"), message, help);
        }
    }

    /// One kind, with what belongs to it.
    fn signal_kind(&mut self, key: &str, signal: &Signal) {
        let kinds = signal.kinds();
        if kinds.len() > 1 {
            let message = format!("the signal has {}", kinds.join(" and "));
            self.report(format!("{key}.{}", kinds[1]), message, "write a signal for each");
        }
        if kinds.is_empty() && signal.start.is_none() {
            let help = "add `value = \"…\"`, `rate`, `filter`, `transfer`, `pid` or `delay`, or `start` of a number that events change";
            self.report(key, "the signal has no value".into(), help);
        }
        let is = |kind: &str| kinds.contains(&kind);
        if signal.every.is_some() && !is("value") && !is("pid") {
            let message = "only `value` and `pid` are sampled".to_owned();
            self.report(format!("{key}.every"), message, "remove `every`");
        }
        let starts =
            kinds.is_empty() || is("rate") || is("filter") || is("value") && signal.every.is_some();
        if signal.start.is_some() && !starts {
            let message = format!("a signal by `{}` starts as it follows", kinds[0]);
            self.report(format!("{key}.start"), message, "remove `start`");
        }
    }

    fn pid(&mut self, key: &str, pid: &Pid) {
        if pid.derivative != 0.0 && pid.filter.is_none() {
            let message = "the derivative of a jump is infinite: it needs a filter".to_owned();
            let help = "add `filter = 0.01`, a time constant in s";
            self.report(format!("{key}.derivative"), message, help);
        }
        if pid.derivative == 0.0 && pid.filter.is_some() {
            let message = "the filter is that of the derivative, of which there is none".to_owned();
            let help = "remove `filter`, or add `derivative`; for a filter of the error write a signal by `filter`";
            self.report(format!("{key}.filter"), message, help);
        }
        if let Some([least, most]) = pid.limits.filter(|[least, most]| least >= most) {
            let message = format!("the limits are {least} to {most}");
            self.report(format!("{key}.limits"), message, "write the smaller one first");
        }
        let leads = pid.limits.is_some() && pid.integral != 0.0;
        if leads && pid.tracking.is_none() && pid.proportional / pid.integral <= 0.0 {
            let message = "nothing says how fast the integral is led back at a limit".to_owned();
            let help = "add `tracking = 0.1`, a time in s; it is proportional/integral by default";
            self.report(format!("{key}.limits"), message, help);
        }
        if pid.tracking.is_some() && !leads {
            let message = "tracking leads an integral back at a limit".to_owned();
            let help = "remove `tracking`, or add `integral` and `limits`";
            self.report(format!("{key}.tracking"), message, help);
        }
        if pid.proportional == 0.0 && pid.integral == 0.0 && pid.derivative == 0.0 {
            let help = "add `proportional`, `integral` or `derivative` with `filter`";
            self.report(key, "the controller has no gain".into(), help);
        }
    }

    fn transfer(&mut self, key: &str, transfer: &Transfer) {
        let Transfer { numerator, denominator, .. } = transfer;
        if denominator.first().is_none_or(|c| *c == 0.0) || denominator.len() < 2 {
            let message = "the denominator has no power of s".to_owned();
            let help =
                "write its coefficients, the highest power first, not 0: [0.1, 1.0] is 0.1 s + 1";
            return self.report(format!("{key}.denominator"), message, help);
        }
        if numerator.len() > denominator.len() || numerator.is_empty() {
            let message = format!(
                "{} coefficients over {}: the function is not proper",
                numerator.len(),
                denominator.len()
            );
            let help = "write a numerator of at most the degree of the denominator";
            self.report(format!("{key}.numerator"), message, help);
        }
    }

    /// States and held values have no place in some schemes.
    fn signal_and_scheme(&mut self, key: &str, signal: &Signal) {
        let settings = &self.model.settings;
        let kinds = signal.kinds();
        let what = kinds.first().copied().unwrap_or("start");
        if settings.scheme.is_energy_momentum() && (!signal.is_algebraic() || signal.has_states()) {
            let scheme = settings.scheme.name();
            let message = format!("the scheme {scheme} has no signals by `{what}`");
            let help = "write a variational scheme, such as \"nodal\"";
            self.report(key, message, help);
        } else if settings.method().stages().is_some() && signal.delay.is_some() {
            let message = "Galerkin's method has no signals by `delay`".to_owned();
            let help = "write order = 2 without `method`, or sample the signal by `every`";
            self.report(key, message, help);
        }
    }

    /// Signals that need one another at once.
    pub(crate) fn signal_loops(&mut self, known: &Quantities<'_>) {
        let needs = needs(self.model, known);
        let mut done: BTreeMap<&str, bool> = BTreeMap::new(); // false: on the way
        for (k, signal) in self.model.signals.iter().enumerate() {
            let mut path = Vec::new();
            if let Some(circle) = circle(&signal.name, &needs, &mut done, &mut path) {
                let [first, ..] = &circle[..] else { continue };
                let pairs = circle.iter().zip(circle.iter().skip(1).chain([first]));
                let list: Vec<String> = pairs.map(|(a, b)| format!("`{a}` needs `{b}`")).collect();
                let help = "break the circle with `filter`, `rate` or `every`";
                let key = self.document.label("signal", k).to_owned();
                self.report(key, list.join(", "), help);
            }
        }
    }
}

/// What each signal that follows at once needs of the others.
fn needs<'a>(model: &'a Model, known: &Quantities<'_>) -> BTreeMap<&'a str, Vec<String>> {
    let mut needs = BTreeMap::new();
    for signal in model.signals.iter().filter(|signal| signal.is_algebraic()) {
        let mut reads = Vec::new();
        for (_, formula) in signal.formulas() {
            let _ = known.compile(formula, &["t", LAST], &mut reads); // faults are reported
        }
        let signals = reads.into_iter().filter_map(|quantity| match quantity {
            Quantity::Signal(name) => Some(name),
            _ => None,
        });
        needs.insert(signal.name.as_str(), signals.collect());
    }
    needs
}

/// The signals of a circle that is reached from here and was not found before.
fn circle<'a>(
    name: &str,
    needs: &BTreeMap<&'a str, Vec<String>>,
    done: &mut BTreeMap<&'a str, bool>,
    path: &mut Vec<&'a str>,
) -> Option<Vec<String>> {
    let (name, others) = needs.get_key_value(name)?;
    match done.get(name) {
        Some(true) => return None,
        Some(false) => {
            let first = path.iter().position(|own| own == name)?;
            return Some(path[first..].iter().map(|own| (*own).to_owned()).collect());
        }
        None => {}
    }
    done.insert(name, false);
    path.push(name);
    let found = others.iter().find_map(|other| circle(other, needs, done, path));
    path.pop();
    done.insert(name, true);
    found
}

/// To 12 digits, without zeros at the end.
fn rounded(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}
