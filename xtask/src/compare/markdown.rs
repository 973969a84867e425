//! `COMPARISON.md` from the findings.

use super::Compared;
use holonom::compare::{Measured, Outcome, Record, Verdict, table};
use holonom::vi_core::linear::norm_inf;
use std::fmt::Write;

const HEAD: &str = include_str!("head.md");
const CAUSES: &str = include_str!("causes.md");

pub(super) fn page(all: &[Compared]) -> String {
    let mut out = HEAD.to_owned();
    out += "\n## EM : VI\n\n";
    ratios(&mut out, all);
    out += CAUSES;
    for one in all {
        model(&mut out, one);
    }
    out
}

fn number(value: f64) -> String {
    if value == 0.0 { "0".into() } else { format!("{value:.1e}") }
}

fn record<'a>(one: &'a Compared, scheme: &str) -> Option<&'a Record> {
    one.found.records.iter().find(|r| r.scheme == scheme)
}

/// Seconds of a step, and of the assembly in it.
fn times(m: &Measured) -> Option<(f64, f64)> {
    let seconds = m.seconds_per_step?;
    Some((seconds, seconds * m.shares?.assembly))
}

fn ratios(out: &mut String, all: &[Compared]) {
    out.push_str("| model | form | iterations | assembly | assembly per iteration | step |\n");
    out.push_str("|---|---|---|---|---|---|\n");
    for one in all {
        let pairs = [
            ("constrained", record(one, "constrained"), record(one, "em-constrained")),
            ("d'Alembert", record(one, "dalembert"), record(one, "em-dalembert")),
            ("nodal, both dense", one.dense.as_ref(), record(one, "em-nodal")),
            ("nodal, as they run", record(one, "nodal"), record(one, "em-nodal")),
        ];
        for (form, vi, em) in pairs {
            let measured = |r: Option<&Record>| r?.measured.clone();
            let (Some(vi), Some(em)) = (measured(vi), measured(em)) else { continue };
            let (Some(a), Some(b)) = (times(&vi), times(&em)) else { continue };
            let iterations = em.mean_iterations / vi.mean_iterations;
            let _ = writeln!(
                out,
                "| {} | {form} | {:.2} : {:.2} | {:.1} | {:.1} | {:.1} |",
                one.name,
                em.mean_iterations,
                vi.mean_iterations,
                b.1 / a.1,
                b.1 / a.1 / iterations,
                b.0 / a.0
            );
        }
    }
}

fn model(out: &mut String, one: &Compared) {
    let _ = write!(out, "\n## {}\n\n{}.\n\n", one.name, one.description.trim_end_matches('.'));
    for line in table::head(&one.found).lines() {
        let _ = writeln!(out, "{line}  ");
    }
    let head = "\n| scheme | distance | energy error | | momenta | g | Ḡ Δq/h | G M⁻¹p | iterations | \
                µs/step | equations | assembly | solution |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    out.push_str(head);
    for r in &one.found.records {
        row(out, one, &r.scheme, r);
        if let Some(dense) = one.dense.as_ref().filter(|_| r.scheme == "nodal") {
            row(out, one, "nodal, dense", dense);
        }
    }
    work(out, one);
}

fn row(out: &mut String, one: &Compared, name: &str, r: &Record) {
    let Some(m) = &r.measured else {
        if let Outcome::Refused { reason } = &r.outcome {
            let _ = writeln!(out, "| {name} | does not run: {reason} ||||||||||||");
        }
        return;
    };
    let g = &m.constraint_residual;
    let verdict = match m.energy_verdict {
        Verdict::Conserved => "conserved",
        Verdict::Bounded => "bounded",
        Verdict::Changes => "changes",
        Verdict::Unknown => "",
    };
    let names = ["Px", "Py", "Pz", "Lx", "Ly", "Lz"];
    let kept =
        names.iter().zip(m.momentum_drift).filter(|d| one.found.kept.iter().any(|k| k == d.0));
    let drift = norm_inf(&kept.map(|d| d.1).collect::<Vec<_>>());
    let failed = if r.outcome == Outcome::Done { "" } else { " (failed)" };
    let micro = |x: f64| format!("{:.2}", 1e6 * x);
    let part = |of: fn(&holonom::compare::Shares) -> f64| match (m.seconds_per_step, m.shares) {
        (Some(seconds), Some(shares)) => micro(seconds * of(&shares)),
        _ => String::new(),
    };
    let _ = writeln!(
        out,
        "| {name}{failed} | {} | {} | {verdict} | {} | {} | {} | {} | {:.2}, {} | {} | {} | {} | {} |",
        m.distance.map_or_else(String::new, number),
        number(m.energy_error),
        number(drift),
        number(g.position.max),
        number(g.velocity.max),
        number(g.momentum.max),
        m.mean_iterations,
        m.max_iterations,
        m.seconds_per_step.map_or_else(String::new, micro),
        part(|s| s.residual),
        part(|s| s.assembly),
        part(|s| s.solve)
    );
}

/// Error at the end against the time of the run, of the nodal forms.
fn work(out: &mut String, one: &Compared) {
    let rows = ["nodal", "em-nodal"].into_iter().filter_map(|s| record(one, s)).flat_map(|r| {
        let orders = [2, 4, 6].into_iter();
        orders.map(move |k| (r, k, r.work.iter().filter(move |p| p.order == k)))
    });
    let rows: Vec<_> = rows.map(|(r, k, points)| (r, k, points.collect::<Vec<_>>())).collect();
    let Some(steps) = rows.iter().map(|row| &row.2).find(|points| !points.is_empty()) else {
        return;
    };
    let heads: String = steps.iter().map(|p| format!(" h = {} |", p.step)).collect();
    let lines = "---|".repeat(steps.len());
    let _ = write!(out, "\n| error at the end, CPU time in s | order |{heads}\n|---|---|{lines}\n");
    for (r, order, points) in rows.iter().filter(|row| row.2.iter().any(|p| p.error.is_some())) {
        let cell = |p: &&holonom::compare::record::WorkPoint| match (p.error, p.seconds) {
            (Some(error), Some(seconds)) => format!(" {}, {} |", number(error), number(seconds)),
            _ => " |".to_owned(),
        };
        let cells: String = points.iter().map(cell).collect();
        let _ = writeln!(out, "| {} | {order} |{cells}", r.scheme);
    }
}
