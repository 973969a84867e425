//! `[[signal]]`: named numbers that laws read: expressions, filters, controllers, delays.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::law::Formula;

/// `filter = { of, time_constant }`: a lag of first order, `T u' = of − u`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Filter {
    /// What is filtered, an expression.
    pub of: Formula,
    /// `T`, s.
    pub time_constant: f64,
}

/// `transfer = { of, numerator, denominator }`: a proper transfer function of `s`, from rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Transfer {
    /// What goes in, an expression.
    pub of: Formula,
    /// Coefficients of the powers of `s`, the highest first.
    pub numerator: Vec<f64>,
    /// Coefficients of the powers of `s`, the highest first; of no lower degree.
    pub denominator: Vec<f64>,
}

/// `pid = { of, proportional, … }`: a controller of the error `of`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pid {
    /// The error, an expression: what is wanted less what is.
    pub of: Formula,
    /// `k_p`, output per error.
    #[serde(default)]
    pub proportional: f64,
    /// `k_i`, output per error and second.
    #[serde(default)]
    pub integral: f64,
    /// `k_d`, output per error and inverse second; it needs `filter`.
    #[serde(default)]
    pub derivative: f64,
    /// `T_f`, s: the time constant of the filter of the derivative.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<f64>,
    /// The least and the largest output.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<[f64; 2]>,
    /// `T_t`, s: how fast the integral is led back while the output is at a limit; `k_p/k_i` by
    /// default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracking: Option<f64>,
    /// What is added to the output before its limits, an expression.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub feedforward: Option<Formula>,
}

/// `delay = { of, time }`: what an expression was at a node in the past, linear between nodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Delay {
    /// What is delayed, an expression.
    pub of: Formula,
    /// By how much, s: at least a step.
    pub time: f64,
}

/// `[[signal]]`: a number that laws and other signals read by its name. One of `value`, `rate`,
/// `filter`, `transfer`, `pid` and `delay`; `start` alone is a number that only events change.
/// Expressions know `t`, joint coordinates (`knee`, `knee.rate`, `knee.1`), members (`arm.x`,
/// `arm.vx`, `arm.wx`), other signals, tables and parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Signal {
    /// Its name, unique in the model: letters, digits and `_`, a letter first.
    pub name: String,
    /// The signal as an expression; with `every` it may read `last`, its value until then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<Formula>,
    /// Its derivative by time as an expression, which may read the signal itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<Formula>,
    /// A lag of first order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<Filter>,
    /// A transfer function.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer: Option<Transfer>,
    /// A controller with proportional, integral and derivative parts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pid: Option<Pid>,
    /// A value of the past.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay: Option<Delay>,
    /// `value` or `pid` are sampled at nodes at multiples of this time, s, and held in between: a
    /// multiple of the step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<f64>,
    /// Its value at the start of `rate`, `filter`, of `last`, or until an event changes it; 0 by
    /// default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<f64>,
}

impl Signal {
    /// The keys of its kinds that are stated.
    #[must_use]
    pub fn kinds(&self) -> Vec<&'static str> {
        [
            ("value", self.value.is_some()),
            ("rate", self.rate.is_some()),
            ("filter", self.filter.is_some()),
            ("transfer", self.transfer.is_some()),
            ("pid", self.pid.is_some()),
            ("delay", self.delay.is_some()),
        ]
        .into_iter()
        .filter_map(|(kind, stated)| stated.then_some(kind))
        .collect()
    }

    /// Its expressions with the keys where they stand.
    pub fn formulas(&self) -> impl Iterator<Item = (&'static str, &Formula)> {
        let pid = self.pid.as_ref();
        [
            ("value", self.value.as_ref()),
            ("rate", self.rate.as_ref()),
            ("filter.of", self.filter.as_ref().map(|own| &own.of)),
            ("transfer.of", self.transfer.as_ref().map(|own| &own.of)),
            ("pid.of", pid.map(|own| &own.of)),
            ("pid.feedforward", pid.and_then(|own| own.feedforward.as_ref())),
            ("delay.of", self.delay.as_ref().map(|own| &own.of)),
        ]
        .into_iter()
        .filter_map(|(key, formula)| Some((key, formula?)))
    }

    /// Whether it follows at once from what its expressions read: no state of its own, no sampling
    /// and no delay stand between.
    #[must_use]
    pub fn is_algebraic(&self) -> bool {
        let through = self.transfer.as_ref().is_some_and(Transfer::passes_at_once);
        self.every.is_none() && (self.value.is_some() || self.pid.is_some() || through)
    }

    /// Whether it has continuous states.
    #[must_use]
    pub fn has_states(&self) -> bool {
        let continuous = self.every.is_none() && self.pid.is_some();
        continuous || self.rate.is_some() || self.filter.is_some() || self.transfer.is_some()
    }
}

impl Transfer {
    /// Whether a jump of what goes in is one of what comes out.
    #[must_use]
    pub fn passes_at_once(&self) -> bool {
        let degree = |c: &[f64]| c.iter().position(|c| *c != 0.0).map_or(0, |k| c.len() - k);
        degree(&self.numerator) >= degree(&self.denominator)
    }
}
