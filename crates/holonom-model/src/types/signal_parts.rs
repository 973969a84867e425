//! What signals with continuous states are made of: values and rates of states, as expressions.
//!
//! ```text
//! filter    ż = (of − z)/T
//! pid       e = of,  w = k_p e + k_i i + k_d (e − d)/T_f + feedforward,  u = clamp(w),
//!           i̇ = e + (u − w)/(k_i T_t),  ḋ = (e − d)/T_f
//! transfer  controllable form: ẋ_1 = of − Σ a_k x_k,  ẋ_k = x_{k−1},
//!           u = Σ (b_k − a_k b_0) x_k + b_0 of
//! ```
//! `T_t = k_p/k_i` unless it is stated. Back calculation: Åström & Hägglund, PID Controllers, 1995.

use super::law::Formula;
use super::signal::{Filter, Pid, Signal, Transfer};
use crate::expression::renamed;
use vi_core::Number;
use vi_core::num_dual::Dual64;

/// A number of a signal: an expression of [`SignalPart::numbers`], of `of` and `feedforward`, of
/// other parts and of states, by their names.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalPart {
    /// `e`, `w`, `u` of a controller; of a state its name.
    pub name: String,
    /// Whether it is the rate of the state of this name.
    pub is_rate: bool,
    /// The expression.
    pub text: String,
    /// The numbers that it names, which may change with a parameter.
    pub numbers: Vec<(String, Dual64)>,
}

impl SignalPart {
    /// Its expression with other words for what it names.
    #[must_use]
    pub fn renamed(&self, name: &mut dyn FnMut(&str) -> String) -> String {
        renamed(&self.text, name)
    }
}

/// A number at a key below that of the signal, as it is stated and as it changes.
pub type NumberAt<'a> = dyn FnMut(&str, f64) -> Dual64 + 'a;

/// The name of a filter's state, of a controller's output, and of that of a transfer function.
pub const OUTPUT: &str = "u";

fn part(name: &str, is_rate: bool, text: String, numbers: &[(&str, Dual64)]) -> SignalPart {
    let numbers = numbers.iter().map(|(name, own)| ((*name).to_owned(), *own)).collect();
    SignalPart { name: name.to_owned(), is_rate, text, numbers }
}

impl Signal {
    /// What its parts name `of` or `feedforward`, with the key where it is stated.
    #[must_use]
    pub fn stated(&self, name: &str) -> Option<(&'static str, &Formula)> {
        self.formulas().find(|(key, _)| key.split_once('.').is_some_and(|(_, own)| own == name))
    }

    /// Its parts in the order of dependence, states in the order in which they are counted; empty
    /// for a signal without continuous states, and for one whose `rate` is an expression.
    #[must_use]
    pub fn parts(&self, number: &mut NumberAt<'_>) -> Vec<SignalPart> {
        match self {
            Self { filter: Some(filter), .. } => vec![filter.part(number)],
            Self { pid: Some(pid), every: None, .. } => pid.parts(number),
            Self { transfer: Some(transfer), .. } => transfer.parts(number),
            _ => Vec::new(),
        }
    }
}

impl Filter {
    fn part(&self, number: &mut NumberAt<'_>) -> SignalPart {
        let time = number("filter.time_constant", self.time_constant);
        part(OUTPUT, true, "(of - u)/T".to_owned(), &[("T", time)])
    }
}

impl Pid {
    fn parts(&self, number: &mut NumberAt<'_>) -> Vec<SignalPart> {
        let proportional = number("pid.proportional", self.proportional);
        let (integrates, differentiates) = (self.integral != 0.0, self.derivative != 0.0);
        // a gain of zero has no state, and no derivative
        let mut counts = |own: bool, key: &str, value: f64| match own {
            true => number(key, value),
            false => Dual64::of(value),
        };
        let integral = counts(integrates, "pid.integral", self.integral);
        let derivative = counts(differentiates, "pid.derivative", self.derivative);
        let filter = counts(differentiates, "pid.filter", self.filter.unwrap_or(1.0));
        let mut text = "k_p*e".to_owned();
        let mut numbers = vec![("k_p", proportional)];
        if integrates {
            text += " + k_i*i";
            numbers.push(("k_i", integral));
        }
        if differentiates {
            text += " + k_d*((e - d)/T_f)";
            numbers.extend([("k_d", derivative), ("T_f", filter)]);
        }
        if self.feedforward.is_some() {
            text += " + feedforward";
        }
        let mut all = vec![part("e", false, "of".to_owned(), &[])];
        all.push(part("w", false, text, &numbers));
        all.push(match self.limits {
            Some([least, most]) => {
                let own = [("least", "pid.limits.0", least), ("most", "pid.limits.1", most)];
                let own = own.map(|(name, key, value)| (name, number(key, value)));
                part(OUTPUT, false, "clamp(w, least, most)".to_owned(), &own)
            }
            None => part(OUTPUT, false, "w".to_owned(), &[]),
        });
        if integrates {
            all.push(match self.limits {
                Some(_) => {
                    let time = match self.tracking {
                        Some(time) => number("pid.tracking", time),
                        None => proportional / integral,
                    };
                    let text = "e + (u - w)/T_w".to_owned();
                    part("i", true, text, &[("T_w", integral * time)])
                }
                None => part("i", true, "e".to_owned(), &[]),
            });
        }
        if differentiates {
            all.push(part("d", true, "(e - d)/T_f".to_owned(), &[("T_f", filter)]));
        }
        all
    }
}

impl Transfer {
    fn parts(&self, number: &mut NumberAt<'_>) -> Vec<SignalPart> {
        let mut coefficients = |key: &str, own: &[f64], direct: bool| -> Vec<Dual64> {
            // what goes through at once, or does not, is no matter of degree
            let counts = |k: usize, c: f64| !direct || k > 0 || c != 0.0;
            let each = own.iter().enumerate().map(|(k, c)| match counts(k, *c) {
                true => number(&format!("transfer.{key}.{k}"), *c),
                false => Dual64::of(*c),
            });
            each.collect()
        };
        let denominator = coefficients("denominator", &self.denominator, false);
        let direct = self.numerator.len() == denominator.len();
        let numerator = coefficients("numerator", &self.numerator, direct);
        let (n, lead) = (denominator.len() - 1, denominator[0]);
        let a: Vec<Dual64> = denominator.iter().map(|c| *c / lead).collect();
        let mut b = vec![Dual64::of(0.0); n + 1 - numerator.len()];
        b.extend(numerator.iter().map(|c| *c / lead));
        let mut all = Vec::new();
        let mut add = |name: &str, is_rate, first: String, c: &[Dual64]| {
            let counts = |(_, c): &(usize, &Dual64)| c.re != 0.0 || c.eps != 0.0;
            let terms = c.iter().enumerate().filter(counts);
            let (mut text, mut numbers) = (first, Vec::new());
            for (k, c) in terms {
                text += &format!(" + c{k}*x{k}");
                numbers.push((format!("c{k}"), *c));
            }
            all.push(SignalPart { name: name.to_owned(), is_rate, text, numbers });
        };
        let zero = Dual64::of(0.0);
        let out: Vec<Dual64> =
            (0..=n).map(|k| if k == 0 { zero } else { b[k] - a[k] * b[0] }).collect();
        let back: Vec<Dual64> = (0..=n).map(|k| if k == 0 { zero } else { -a[k] }).collect();
        let direct = b[0].re != 0.0;
        add(OUTPUT, false, if direct { "c0*of".to_owned() } else { "0".to_owned() }, &out);
        for k in 1..=n {
            let name = format!("x{k}");
            match k {
                1 => add(&name, true, "of".to_owned(), &back),
                _ => add(&name, true, format!("x{}", k - 1), &[]),
            }
        }
        if direct {
            all[0].numbers.push(("c0".to_owned(), b[0]));
        }
        all
    }
}
