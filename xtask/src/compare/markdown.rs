//! `COMPARISON.md` from the findings.

use super::values::{drift, number};
use super::{Compared, claims, tables};
use holonom::compare::{EnergyBehaviour, Record, SchemeOutcome, table};
use std::fmt::Write;

const HEAD: &str = include_str!("head.md");

pub(super) fn page(all: &[Compared], provenance: &str) -> String {
    let mut out = "# Comparison of variational and energy–momentum schemes\n".to_owned();
    claims::summary(&mut out, all);
    out += HEAD;
    let _ = writeln!(out, "\n{provenance}");
    claims::table(&mut out, all);
    tables::equal_forms(&mut out, all);
    tables::equal_errors(&mut out, all);
    tables::same_step(&mut out, all);
    tables::conditions(&mut out, all);
    tables::linearizations(&mut out, all);
    for one in all {
        model(&mut out, one);
    }
    out
}

fn model(out: &mut String, one: &Compared) {
    let _ = write!(out, "\n## {}\n\n{}.\n\n", one.name, one.description.trim_end_matches('.'));
    for line in table::head(&one.found).lines() {
        let _ = writeln!(out, "{line}  ");
    }
    let head = "\n| scheme | distance | energy error | | momenta | g | Ḡ Δq/h | G M⁻¹p | iterations | \
                µs/step | range |\n\
                |---|---|---|---|---|---|---|---|---|---|---|\n";
    out.push_str(head);
    for r in &one.found.records {
        row(out, one, &r.scheme, r);
        if let Some(dense) = one.dense.iter().find(|dense| dense.scheme == r.scheme) {
            row(out, one, &format!("{}, dense", r.scheme), dense);
        }
    }
    work(out, one);
}

fn row(out: &mut String, one: &Compared, name: &str, r: &Record) {
    let Some(m) = &r.measured else {
        if let SchemeOutcome::Refused { reason } = &r.outcome {
            let _ = writeln!(out, "| {name} | does not run: {reason} ||||||||||");
        }
        return;
    };
    let g = &m.constraint_residual;
    let verdict = match m.energy_verdict {
        EnergyBehaviour::Conserved => "conserved",
        EnergyBehaviour::Bounded => "bounded",
        EnergyBehaviour::Changes => "changes",
        EnergyBehaviour::Unknown => "",
    };
    let failed = if r.outcome == SchemeOutcome::Done { "" } else { " (failed)" };
    let micro = |x: f64| format!("{:.2}", 1e6 * x);
    let _ = writeln!(
        out,
        "| {name}{failed} | {} | {} | {verdict} | {} | {} | {} | {} | {:.2}, {} | {} | {} |",
        m.distance.map_or_else(String::new, number),
        number(m.energy_error),
        number(drift(one, m)),
        number(g.position.max),
        number(g.velocity.max),
        number(g.momentum.max),
        m.mean_iterations,
        m.max_iterations,
        m.seconds_per_step.map_or_else(String::new, micro),
        m.seconds_range.map_or_else(String::new, |[a, b]| format!("{} … {}", micro(a), micro(b)))
    );
}

/// Error at the end against the time of the run, of the form of each family and order that is
/// fastest at the largest step.
fn work(out: &mut String, one: &Compared) {
    let time = |r: &Record, order| {
        r.work.iter().find(|p| p.order == order && p.error.is_some()).and_then(|p| p.seconds)
    };
    let mut rows = Vec::new();
    for em in [false, true] {
        for order in [2, 4, 6] {
            let family = one.found.records.iter().filter(|r| r.energy_momentum == em);
            let timed = family.filter_map(|r| Some((time(r, order)?, r)));
            let fastest = timed.min_by(|a, b| a.0.total_cmp(&b.0));
            rows.extend(fastest.map(|(_, r)| (r, order)));
        }
    }
    let points = |r: &&'_ Record, order: u32| {
        r.work.iter().filter(|p| p.order == order).cloned().collect::<Vec<_>>()
    };
    let Some((first, order)) = rows.first() else { return };
    let steps = points(first, *order);
    let heads: String = steps.iter().map(|p| format!(" h = {} |", p.step)).collect();
    let lines = "---|".repeat(steps.len());
    let _ = write!(out, "\n| error at the end, CPU time in s | order |{heads}\n|---|---|{lines}\n");
    for (r, order) in &rows {
        let cell = |p: &holonom::compare::record::WorkPoint| match (p.error, p.seconds) {
            (Some(error), Some(seconds)) => format!(" {}, {} |", number(error), number(seconds)),
            _ => " |".to_owned(),
        };
        let cells: String = points(r, *order).iter().map(cell).collect();
        let _ = writeln!(out, "| {} | {order} |{cells}", r.scheme);
    }
}
