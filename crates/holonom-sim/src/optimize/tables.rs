//! The tables of an optimum.

use super::found::{FoundOptimum, SearchStep};
use std::fmt::Write;
use vi_control::program::Iterate;

/// A number as files have it; none that is not finite.
fn number(x: f64) -> String {
    if x.is_finite() { format!("{x:?}") } else { String::new() }
}

/// A row of numbers behind some words.
fn row(out: &mut String, words: &[String], numbers: impl IntoIterator<Item = f64>) {
    let cells: Vec<String> = words.iter().cloned().chain(numbers.into_iter().map(number)).collect();
    let _ = writeln!(out, "{}", cells.join(","));
}

impl FoundOptimum {
    /// `iterations.csv`: one row for each iteration; of a design with its parameters.
    #[must_use]
    pub fn iterations(&self) -> String {
        let of_controls = !self.controls.is_empty();
        let own: &[&str] = match of_controls {
            true => &["cost", "infeasibility", "stationarity", "barrier", "step_length", "shift"],
            false => &["cost", "infeasibility"],
        };
        let names = self.report.parameters.iter().map(|own| own.name.clone());
        let head = ["start", "steps", "iteration"].iter().chain(own).map(|name| (*name).to_owned());
        let mut out = head.chain(names).collect::<Vec<_>>().join(",") + "\n";
        for at in &self.steps {
            let SearchStep { start, steps, iterate, .. } = at;
            let Iterate { iteration, cost, infeasibility, stationarity, barrier, step, shift } =
                *iterate;
            let words = [*start, *steps, iteration].map(|count| count.to_string());
            let of_method = [stationarity, barrier, step, shift];
            let numbers = [cost, infeasibility].into_iter();
            let numbers = numbers.chain(of_method.into_iter().filter(|_| of_controls));
            row(&mut out, &words, numbers.chain(at.parameters.iter().copied()));
        }
        out
    }

    /// `controls.csv`: the middle of each step, s, and the value of each control in it, N or N·m.
    #[must_use]
    pub fn controls(&self) -> String {
        let names = self.report.controls.iter().map(|own| own.name.clone());
        let mut out =
            std::iter::once("t_mid".to_owned()).chain(names).collect::<Vec<_>>().join(",");
        out.push('\n');
        for (n, values) in self.controls.iter().enumerate() {
            let t = (n as f64 + 0.5) * self.report.step;
            row(&mut out, &[], std::iter::once(t).chain(values.iter().copied()));
        }
        out
    }

    /// `costates.csv`: the time of each node but the last, s, and the multipliers of its balances,
    /// one for each coordinate of the spanning tree.
    #[must_use]
    pub fn costates(&self) -> String {
        let count = self.costates.first().map_or(0, Vec::len);
        let names = (0..count).map(|j| format!("m{j}"));
        let mut out = std::iter::once("t".to_owned()).chain(names).collect::<Vec<_>>().join(",");
        out.push('\n');
        for (n, values) in self.costates.iter().enumerate() {
            let t = n as f64 * self.report.step;
            row(&mut out, &[], std::iter::once(t).chain(values.iter().copied()));
        }
        out
    }

    /// `prices.csv`: the time of each node, s, and what the bounds of controls and of conditions
    /// along the path cost there; empty where there are no such bounds.
    #[must_use]
    pub fn prices(&self) -> String {
        if self.prices.is_empty() {
            return String::new();
        }
        let names = self.prices.iter().map(|(name, _)| name.clone());
        let mut out = std::iter::once("t".to_owned()).chain(names).collect::<Vec<_>>().join(",");
        out.push('\n');
        for n in 0..=self.report.steps {
            let t = n as f64 * self.report.step;
            row(&mut out, &[], std::iter::once(t).chain(self.prices.iter().map(|own| own.1[n])));
        }
        out
    }
}
