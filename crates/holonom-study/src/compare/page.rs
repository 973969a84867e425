//! `compare.html`: one file, nothing loaded from elsewhere.

use super::charts::{figures, representatives};
use super::record::{Comparison, RecordedMotion};
use super::table::{self, TableRows};
use crate::equations;
use holonom_model::{Model, Scheme};
use holonom_report::page::{self, escape, foot, head, heading};
use holonom_report::scene::{OverlaidMotion, Scene};
use std::fmt::Write;

/// The page of a comparison of schemes on a model; `command` makes it again.
#[must_use]
pub fn page(c: &Comparison, model: &Model, command: &str) -> String {
    let title = format!("{}: schemes compared", c.model);
    let mut html = head(&title);
    let about: Vec<String> = table::head(c).lines().map(str::to_owned).collect();
    html += &heading(&title, &about, command);
    for (scheme, reason) in table::reasons(c) {
        let _ = writeln!(html, "<p class=\"warning\">{}: {}</p>", escape(scheme), escape(&reason));
    }
    if let Some(scene) = scene(c, model) {
        html += &scene.html();
        let _ = writeln!(html, "<p class=\"note\">{}</p>", escape(&coincidence(c)));
    }
    html += "<h2>What is conserved</h2>\n";
    push(&mut html, &table::quality(c));
    html += "<p class=\"note\">distance: to the reference; in family: to the first scheme of the family; \
             energy: largest deviation, J; momenta: largest change of those conserved; constraints: g at position \
             level, Ḡ Δq/h at velocity level (45), G M⁻¹p at momentum level (46).</p>\n<h2>Cost</h2>\n";
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
    html += "<h2>Plots</h2>\n<div class=\"charts\">\n";
    for figure in figures(c) {
        html += &page::figure(&figure.chart, &figure.caption);
    }
    html += "</div>\n";
    for (title, note, rows) in tables.iter().filter(|t| t.2.len() > 1) {
        let _ = writeln!(html, "<h2>{title}</h2>");
        push(&mut html, rows);
        let _ = writeln!(html, "<p class=\"note\">{note}</p>");
    }
    html += &equations::legend(&html);
    foot(&mut html, &c.version);
    html
}

/// Schemes that are drawn from the beginning, where there are more.
const DRAWN: usize = 3;

/// The motions over one another: the schemes that stand for their families first, in the colours of
/// the charts.
fn scene(c: &Comparison, model: &Model) -> Option<Scene> {
    let first: Vec<&str> = representatives(c).iter().map(|(r, _)| r.scheme.as_str()).collect();
    let mut motions: Vec<&RecordedMotion> = c.motions.iter().collect();
    let place = |motion: &&RecordedMotion| first.iter().position(|name| *name == motion.scheme);
    motions.sort_by_key(|motion| place(motion).unwrap_or(first.len()));
    let all = motions.len() <= DRAWN;
    let named = |motion: &&RecordedMotion| {
        let record = c.records.iter().find(|record| record.scheme == motion.scheme);
        record.map_or_else(|| motion.scheme.clone(), table::name)
    };
    let names: Vec<String> = motions.iter().map(named).collect();
    let shown = motions.iter().zip(&names).map(|(motion, name)| {
        let is_shown = all || place(motion).is_some();
        OverlaidMotion { name, is_shown, frames: &motion.frames }
    });
    let mut moving = model.clone();
    moving.settings.scheme = Scheme::Nodal; // also where the model asks for equilibria
    Scene::overlaid(&moving, &shown.collect::<Vec<_>>())
}

/// How far motions that seem to be one are apart.
fn coincidence(c: &Comparison) -> String {
    let measured = || c.records.iter().filter_map(|r| Some((r, r.measured.as_ref()?)));
    let of = |em: bool| {
        let apart = measured().filter(|(r, _)| r.energy_momentum == em);
        apart.filter_map(|(_, m)| m.apart).reduce(super::larger)
    };
    let mut words = "One colour for each scheme; the buttons show and hide them. Where motions coincide, their colours \
                     alternate in stripes."
        .to_owned();
    for (family, apart) in [("variational", of(false)), ("energy–momentum", of(true))] {
        if let Some(apart) = apart {
            let _ = write!(
                words,
                " The {family} schemes differ by at most {} (m; directors 1).",
                table::number(apart)
            );
        }
    }
    words
}

fn push(html: &mut String, rows: &TableRows) {
    *html += "<div class=\"scroll\"><table class=\"grid\">\n";
    for (k, row) in rows.iter().enumerate() {
        let tag = if k == 0 { "th" } else { "td" };
        let cells: String = row.iter().map(|c| format!("<{tag}>{}</{tag}>", escape(c))).collect();
        let _ = writeln!(html, "<tr>{cells}</tr>");
    }
    *html += "</table></div>\n";
}
