//! The findings as text.

use super::record::{Comparison, EnergyBehaviour, MOMENTUM_MAPS, Measured, Record, SchemeOutcome};
use super::{Clock, larger};
use holonom_report::{counted, time};
use std::fmt::Write;
use vi_verify::judge::scientific;

/// All tables of a comparison.
#[must_use]
pub fn text(comparison: &Comparison) -> String {
    let mut out = head(comparison);
    let _ = write!(out, "\n{}", aligned(&quality(comparison)));
    let _ = write!(out, "\nCost\n{}", aligned(&cost(comparison)));
    let conditions = conditions(comparison);
    if conditions.len() > 1 {
        let _ =
            write!(out, "\nCondition number of the Newton matrix: as written | as factorized\n");
        out += &aligned(&conditions);
    }
    let work = work(comparison);
    if work.len() > 1 {
        let _ = write!(out, "\nError at the end | {} of the run, s\n", time_word(comparison.clock));
        out += &aligned(&work);
    }
    for (scheme, reason) in reasons(comparison) {
        let _ = writeln!(out, "\n{scheme}: {reason}");
    }
    out
}

pub(super) fn time_word(clock: Clock) -> &'static str {
    match clock {
        Clock::Cpu => "CPU time",
        Clock::Wall => "time",
    }
}

/// What was compared, in three lines; how much of the model, where that is not all.
#[must_use]
pub fn head(c: &Comparison) -> String {
    let known = c.reference.known_to.map_or(String::new(), |e| format!(", known to {e:.0e}"));
    let conserved = if c.conserved.is_empty() { "none".to_owned() } else { c.conserved.join(" ") };
    let free = match c.free_from > 0.0 {
        true => {
            format!("; energy and momenta once the loads have ended, from t = {} s", c.free_from)
        }
        false => String::new(),
    };
    let dof = counted(c.dof as u64, "degree of freedom", "degrees of freedom");
    let shortened = c
        .shortened_from
        .map_or(String::new(), |end| format!(" of {end} s (--end {end} takes all)"));
    format!(
        "{}: {dof}, {} coordinates, {} constraints; {} steps of {} s to t = {} s{shortened}\n\
         reference: {}{known} (m; directors 1)\nmomentum maps that the system conserves: {conserved}{free}\n",
        c.model,
        c.coordinates,
        c.constraints,
        c.steps,
        time(c.step),
        time(c.end),
        c.reference.description
    )
}

/// Why schemes did not run, or not to the end.
pub(super) fn reasons(c: &Comparison) -> Vec<(&str, String)> {
    let reason = |r: &Record| match &r.outcome {
        SchemeOutcome::Done => None,
        SchemeOutcome::Failed { step, t, message } => {
            Some(format!("failed in step {step}, at t = {t} s: {message}"))
        }
        SchemeOutcome::Refused { reason } => Some(format!("does not run: {reason}")),
    };
    c.records.iter().filter_map(|r| Some((r.scheme.as_str(), reason(r)?))).collect()
}

pub(super) fn number(value: f64) -> String {
    scientific(value, 1)
}

fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| "–".into(), number)
}

pub(super) fn verdict(m: &Measured) -> &'static str {
    match m.energy_verdict {
        EnergyBehaviour::Conserved => "conserved",
        EnergyBehaviour::Bounded => "bounded",
        EnergyBehaviour::Changes => "changes",
        EnergyBehaviour::Unknown => "–",
    }
}

/// Largest drift of the momentum maps that the system conserves.
fn kept_drift(c: &Comparison, m: &Measured) -> Option<f64> {
    let conserved =
        MOMENTUM_MAPS.iter().zip(m.momentum_drift).filter(|d| c.conserved.iter().any(|k| k == d.0));
    conserved.map(|d| d.1).reduce(larger)
}

/// Rows of a table; the first is its head.
pub(super) type TableRows = Vec<Vec<String>>;

fn row<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).into()
}

/// A mark for schemes that did not reach the end.
pub(super) fn name(r: &Record) -> String {
    match r.outcome {
        SchemeOutcome::Failed { .. } => format!("{} (failed)", r.scheme),
        _ => r.scheme.clone(),
    }
}

pub(super) fn quality(c: &Comparison) -> TableRows {
    let head =
        ["scheme", "distance", "in family", "energy", "is", "momenta", "g", "Ḡ Δq/h", "G M⁻¹p"];
    let mut rows = vec![row(head)];
    for record in &c.records {
        let Some(m) = &record.measured else { continue };
        let g = &m.constraint_residual;
        rows.push(vec![
            name(record),
            optional(m.distance),
            optional(m.apart),
            number(m.energy_error),
            verdict(m).into(),
            optional(kept_drift(c, m)),
            number(g.position.max),
            number(g.velocity.max),
            number(g.momentum.max),
        ]);
    }
    rows
}

pub(super) fn cost(c: &Comparison) -> TableRows {
    let mut rows = vec![row(["scheme", "Newton mean", "max", "µs/step"])];
    for record in &c.records {
        let Some(m) = &record.measured else { continue };
        rows.push(vec![
            name(record),
            format!("{:.2}", m.mean_iterations),
            format!("{}", m.max_iterations),
            m.seconds_per_step.map_or_else(|| "–".into(), |s| format!("{:.2}", 1e6 * s)),
        ]);
    }
    rows
}

pub(super) fn conditions(c: &Comparison) -> TableRows {
    let measured = || c.records.iter().filter(|r| !r.conditions.is_empty());
    let Some(first) = measured().next() else { return Vec::new() };
    let mut head = vec!["scheme".to_owned()];
    head.extend(first.conditions.iter().map(|at| format!("h = {}", at.step)));
    let mut rows = vec![head];
    for record in measured() {
        let mut cells = vec![name(record)];
        cells.extend(record.conditions.iter().map(|at| match at.condition {
            Some(k) if k.as_written.to_bits() == k.scaled.to_bits() => number(k.scaled),
            Some(k) => format!("{} | {}", number(k.as_written), number(k.scaled)),
            None => "–".into(),
        }));
        rows.push(cells);
    }
    rows
}

pub(super) fn work(c: &Comparison) -> TableRows {
    let mut rows = Vec::new();
    for record in &c.records {
        let mut orders: Vec<u32> = record.work.iter().map(|p| p.order).collect();
        orders.dedup();
        for order in orders {
            let points = || record.work.iter().filter(|p| p.order == order);
            if rows.is_empty() {
                let mut head = row(["scheme", "order"]);
                head.extend(points().map(|p| format!("h = {}", p.step)));
                rows.push(head);
            }
            let mut cells = vec![record.scheme.clone(), order.to_string()];
            cells.extend(points().map(|p| match (p.error, p.seconds) {
                (Some(error), Some(seconds)) => format!("{} | {}", number(error), number(seconds)),
                _ => "–".into(),
            }));
            if points().any(|p| p.error.is_some()) {
                rows.push(cells);
            }
        }
    }
    rows
}

/// Columns of equal width, numbers to the right.
fn aligned(rows: &TableRows) -> String {
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    let cell = |row: &Vec<String>, k: usize| row.get(k).map_or(0, |c| c.chars().count());
    let widths: Vec<usize> =
        (0..count).map(|k| rows.iter().map(|row| cell(row, k)).max().unwrap_or(0)).collect();
    let mut out = String::new();
    for row in rows {
        let mut line = String::new();
        for (k, (cell, width)) in row.iter().zip(&widths).enumerate() {
            let gap = width - cell.chars().count();
            match k {
                0 => line += &format!("{cell}{}", " ".repeat(gap)),
                _ => line += &format!("  {}{cell}", " ".repeat(gap)),
            }
        }
        let _ = writeln!(out, "{}", line.trim_end());
    }
    out
}
