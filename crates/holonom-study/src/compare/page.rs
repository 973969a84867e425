//! `compare.html`: one file, nothing loaded from elsewhere.

use super::charts::figures;
use super::record::Comparison;
use super::table::{self, Rows};
use holonom_report::page::{escape, foot, head, inline};
use std::fmt::Write;

/// The page of a comparison.
pub fn page(c: &Comparison) -> String {
    let mut html = head(&format!("{}: schemes compared", c.model));
    let summary = table::head(c);
    let _ = write!(
        html,
        "<h1>{}: schemes compared</h1>\n<p class=\"counts\">{}</p>\n",
        escape(&c.model),
        summary.lines().map(escape).collect::<Vec<_>>().join("<br>\n")
    );
    for (scheme, reason) in table::reasons(c) {
        let _ = writeln!(html, "<p class=\"failed\">{}: {}</p>", escape(scheme), escape(&reason));
    }
    html += "<h2>What is conserved</h2>\n";
    push(&mut html, &table::quality(c));
    html += "<p class=\"note\">distance: to the reference; in family: to the first scheme of the family; \
             energy: largest deviation, J; momenta: largest change of those conserved; g, Ḡ Δq/h, G M⁻¹p: \
             constraints at positions, velocities, momenta.</p>\n<h2>Cost</h2>\n";
    push(&mut html, &table::cost(c));
    let time = table::time_word(c.clock);
    let _ = writeln!(
        html,
        "<p class=\"note\">{time} per step, median of repeated runs; its parts: evaluations of the \
         equations, assembly of Newton matrices with null spaces and multipliers, linear systems.</p>"
    );
    let tables = [
        (
            "Condition numbers",
            "As the equations are written | as factorized.",
            table::conditions(c),
        ),
        ("Error against time", "Error at the end | time of the run, s.", table::work(c)),
    ];
    html += "<h2>Plots</h2>\n";
    for figure in figures(c) {
        let svg = figure.chart.svg();
        let drawn = inline(&svg, &figure.chart.title);
        let _ = write!(
            html,
            "<figure>\n{drawn}<figcaption>{}</figcaption>\n</figure>\n",
            escape(figure.caption.trim())
        );
    }
    for (title, note, rows) in tables.iter().filter(|t| t.2.len() > 1) {
        let _ = writeln!(html, "<h2>{title}</h2>");
        push(&mut html, rows);
        let _ = writeln!(html, "<p class=\"note\">{note}</p>");
    }
    foot(&mut html, &c.version);
    html
}

fn push(html: &mut String, rows: &Rows) {
    *html += "<div class=\"scroll\"><table class=\"grid\">\n";
    for (k, row) in rows.iter().enumerate() {
        let tag = if k == 0 { "th" } else { "td" };
        let cells: String = row.iter().map(|c| format!("<{tag}>{}</{tag}>", escape(c))).collect();
        let _ = writeln!(html, "<tr>{cells}</tr>");
    }
    *html += "</table></div>\n";
}
