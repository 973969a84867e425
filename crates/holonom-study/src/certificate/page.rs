//! `certificate.html`: one file, nothing loaded from elsewhere.

use super::{ModelCertificate, Recommendation};
use crate::equations;
use holonom_model::Model;
use holonom_report::page::{escape, figure, foot, head, heading, push_list, push_model};
use holonom_report::scene::Scene;
use holonom_report::{ChartAxis, LineChart, Series, Strokes, time};
use std::collections::BTreeMap;
use std::fmt::Write;
use vi_verify::certificate::{Study, Verdict, counts};
use vi_verify::convergence::StudiedQuantity;
use vi_verify::subject::SteppingMethod;
use vi_verify::table::{Cell, CertificateTable, remarks, tables};

/// The verdict in a sentence.
#[must_use]
pub fn verdict(of: &ModelCertificate) -> String {
    let words = if of.holds { "no property fails" } else { "a property fails" };
    format!("{words}: {}", counts(&of.certificate.findings.iter().collect::<Vec<_>>()))
}

/// From when on the model was measured, in a sentence; `None` where from its beginning.
#[must_use]
pub fn rest(of: &ModelCertificate) -> Option<String> {
    let from = time(of.from);
    let said =
        format!("measured from t = {from} s on, times counted from there: before, the model rests");
    (of.from > 0.0).then_some(said)
}

/// A recommendation in a sentence.
#[must_use]
pub fn sentence(of: &Recommendation, accuracy: f64) -> String {
    let Recommendation { order, end, error, step, reason } = of;
    let end = time(*end);
    let why = if reason.is_empty() { String::new() } else { format!(" ({reason})") };
    match (step, error) {
        (Some(step), Some(error)) => format!(
            "order {order}: a step of {step:.2e} s gives an error of {accuracy:e} up to t = {end} s; the step \
             of the model gives {error:.1e}{why}"
        ),
        _ => format!("order {order}: no step can be recommended{why}"),
    }
}

/// The page of the certificate of a model.
#[must_use]
pub fn page(of: &ModelCertificate, model: &Model) -> String {
    let title = format!("Certificate of {}", of.model);
    let mut html = head(&title);
    let about = [
        "Numbers in parentheses are equations, explained at the end. A dash: inconclusive or not applicable; the remarks \
         say why."
            .to_owned(),
    ];
    html += &heading(&title, &about, of.provenance.as_ref().map_or("", |made| &made.command));
    let class = if of.holds { "passed" } else { "failed" };
    let _ = writeln!(html, "<p class=\"{class}\">{}</p>", escape(&verdict(of)));
    if let Some(rest) = rest(of) {
        let _ = writeln!(html, "<p>{}</p>", escape(&rest));
    }
    push_list(&mut html, provenance(of));
    if let Some(frames) = &of.motion {
        let scene = Scene::new(model, frames, &BTreeMap::new(), None);
        html += &scene.map_or_else(String::new, |scene| scene.html());
    }
    html.push_str("<h2>Recommended steps</h2>\n<ul>\n");
    for step in &of.steps {
        let _ = writeln!(html, "<li>{}</li>", escape(&sentence(step, of.accuracy)));
    }
    html.push_str("</ul>\n<h2>Plots</h2>\n<div class=\"charts\">\n");
    for chart in charts(of) {
        html += &figure(&chart, "");
    }
    html.push_str("</div>\n");
    for table in tables(&of.certificate) {
        push_table(&mut html, &table);
    }
    let remarks = remarks(&of.certificate);
    if !remarks.is_empty() {
        html.push_str("<h2>Remarks</h2>\n<ul>\n");
        for remark in &remarks {
            let _ = writeln!(html, "<li>{}</li>", escape(remark));
        }
        html.push_str("</ul>\n");
    }
    html += &equations::legend(&html);
    push_model(&mut html, &model.to_toml());
    foot(&mut html, &of.version);
    html
}

/// Program, date and model.
fn provenance(of: &ModelCertificate) -> Vec<(&'static str, String)> {
    let mut facts = vec![("program", format!("holonom {}", of.version))];
    let Some(made) = &of.provenance else { return facts };
    let commit = made.commit.clone().unwrap_or_else(|| "not stated by the build".to_owned());
    facts.push(("commit", commit));
    facts.push(("date", made.date.clone()));
    facts.push(("SHA-256 of the model file", made.model_sha256.clone()));
    if !made.overrides.is_empty() {
        facts.push(("replaced values", made.overrides.join(", ")));
    }
    facts
}

fn push_table(html: &mut String, table: &CertificateTable) {
    let _ = writeln!(
        html,
        "<h2>{}</h2>\n<div class=\"scroll\"><table class=\"grid\">",
        escape(&table.title)
    );
    html.push_str("<tr>");
    for name in &table.header {
        let _ = write!(html, "<th>{}</th>", escape(name));
    }
    html.push_str("</tr>\n");
    for (name, cells) in &table.rows {
        let _ = write!(html, "<tr><th>{}</th>", escape(name));
        for Cell { text, verdict } in cells {
            let (class, mark) = match verdict {
                Some(Verdict::Fail) => (" class=\"bad\"", " FAIL"),
                Some(Verdict::KnownDeviation) => ("", " (known deviation)"),
                _ => ("", ""),
            };
            let _ = write!(html, "<td{class}>{}{mark}</td>", escape(text));
        }
        html.push_str("</tr>\n");
    }
    html.push_str("</table></div>\n");
}

fn charts(of: &ModelCertificate) -> Vec<LineChart> {
    let mut charts = Vec::new();
    for quantity in [StudiedQuantity::Position, StudiedQuantity::Momentum] {
        let title = format!("Error of {}", quantity.name(SteppingMethod::NODAL));
        let curves = of.certificate.studies.iter().filter_map(|s| error_curve(s, quantity));
        let y = ChartAxis::logarithmic("largest relative error", "");
        charts.push(chart(
            &title,
            ChartAxis::logarithmic("step", "s"),
            y,
            curves.collect(),
            Strokes::MarkedLine,
        ));
    }
    let numbers = of.certificate.conditioning.iter().map(|(method, c)| Series {
        name: method.name().into(),
        points: c.numbers.iter().map(|n| (n.0, n.2)).collect(),
    });
    let y = ChartAxis::logarithmic("κ of the Newton matrix", "");
    let x = ChartAxis::logarithmic("step", "s");
    charts.push(chart("Condition numbers", x, y, numbers.collect(), Strokes::MarkedLine));
    let (energy, momentum): (Vec<_>, Vec<_>) =
        of.certificate.histories.iter().partition(|h| h.name.ends_with("energy"));
    let curves = |of: Vec<&vi_verify::certificate::TimeCurve>| -> Vec<Series> {
        of.into_iter().map(|h| Series { name: h.name.clone(), points: h.points.clone() }).collect()
    };
    let y = ChartAxis::linear("energy error", "J");
    charts.push(chart(
        "Energy of the long run",
        ChartAxis::time(),
        y,
        curves(energy),
        Strokes::Line,
    ));
    let y = ChartAxis::linear("relative change", "");
    let title = "Conserved momentum maps in the long run";
    charts.push(chart(title, ChartAxis::time(), y, curves(momentum), Strokes::Line));
    charts.retain(|chart| chart.curves.iter().any(|curve| curve.points.len() > 1));
    charts
}

fn chart(
    title: &str,
    x: ChartAxis,
    y: ChartAxis,
    curves: Vec<Series>,
    strokes: Strokes,
) -> LineChart {
    LineChart { title: title.to_owned(), x, y, strokes, resolution: 0.0, marks: Vec::new(), curves }
}

fn error_curve(study: &Study, quantity: StudiedQuantity) -> Option<Series> {
    let curve = study.curves.iter().find(|c| c.quantity == quantity)?;
    Some(Series {
        name: format!("{} {}", study.method.name(), study.order),
        points: curve.errors.iter().map(|e| (e.step, e.error)).collect(),
    })
}
