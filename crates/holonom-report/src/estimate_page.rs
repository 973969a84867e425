//! `estimate.html`: unknown numbers from measurements, data over model, residuals, correlations.

use std::fmt::Write;

use holonom_sim::identification::{Found, Identified, MeasuredRow};
use holonom_sim::sensor::columns;

use super::chart::{Chart, ChartAxis, Series, Strokes};
use super::facts::rounded;
use super::page::{escape, foot, head, heading, inline, push_list, push_model, push_warnings};

/// The charts of an estimate: of each column the data over the model, and the residuals.
#[must_use]
pub fn estimate_charts(found: &Found) -> Vec<Chart> {
    let known = columns(&found.model);
    let mut charts = Vec::new();
    for (k, own) in found.estimate.columns.iter().enumerate() {
        let rows: Vec<&MeasuredRow> =
            found.rows.iter().filter(|row| row.measurement == k).collect();
        let curve = |name: &str, of: fn(&MeasuredRow) -> f64| Series {
            name: name.to_owned(),
            points: rows.iter().map(|row| (row.t, of(row))).collect(),
        };
        let sensor = known.iter().find(|column| column.name() == own.sensor);
        let (quantity, unit) = sensor.map_or(("value", ""), |own| (own.quantity, own.unit));
        let chart = |title: String, y: ChartAxis, strokes: Strokes, curves: Vec<Series>| Chart {
            title,
            x: ChartAxis::time(),
            y,
            strokes,
            resolution: 0.0,
            marks: Vec::new(),
            curves,
        };
        charts.push(chart(
            format!("{}: data over model", own.column),
            ChartAxis::linear(quantity, unit),
            Strokes::LineOverMarks,
            vec![curve("computed", |row| row.computed), curve("measured", |row| row.measured)],
        ));
        charts.push(chart(
            format!("{}: residuals in standard deviations", own.column),
            ChartAxis::linear("residual", ""),
            Strokes::Marks,
            vec![curve("", |row| row.residual)],
        ));
    }
    charts
}

/// The page of an estimate; `command` makes it again.
#[must_use]
pub fn estimate_page(found: &Found, command: &str) -> String {
    let own = &found.estimate;
    let title = format!("{}: numbers from measurements", own.model);
    let mut html = head(&title);
    let ended = format!("{} after {} iterations, {} runs", own.outcome, own.iterations, own.runs);
    html += &heading(&title, &[ended], command);
    push_warnings(&mut html, &own.warnings());
    push_list(
        &mut html,
        [
            ("measured values", own.values.to_string()),
            ("chi-square per degree of freedom", rounded(own.chi_square_per_freedom, 4)),
        ],
    );
    html += "<h2>Estimates</h2>\n<div class=\"scroll\"><table class=\"grid\">\n<tr><th>unknown number</th><th>estimate</th>\
             <th>± standard error</th><th>start</th></tr>\n";
    for one in &own.parameters {
        let error = match one.standard_error {
            Some(error) => rounded(error, 3),
            None if one.at_bound => "at a bound".to_owned(),
            None => "unknown".to_owned(),
        };
        let (name, value) = (escape(&one.name), rounded(one.value, 9));
        let start = rounded(one.start, 6);
        let _ = writeln!(
            html,
            "<tr><td>{name}</td><td>{value}</td><td>{error}</td><td>{start}</td></tr>"
        );
    }
    html += "</table></div>\n";
    push_correlations(&mut html, own);
    html += "<h2>Columns</h2>\n<div class=\"scroll\"><table class=\"grid\">\n<tr><th>column</th><th>sensor</th><th>values</th>\
             <th>rms</th><th>sigma</th><th>runs test</th></tr>\n";
    for one in &own.columns {
        let runs = one.probability_of_runs.map_or("–".to_owned(), |p| rounded(p, 3));
        let (column, sensor) = (escape(&one.column), escape(&one.sensor));
        let (values, rms, sigma) = (one.values, rounded(one.rms, 4), rounded(one.sigma, 4));
        let _ = writeln!(
            html,
            "<tr><td>{column}</td><td>{sensor}</td><td>{values}</td><td>{rms}</td><td>{sigma}</td><td>{runs}</td></tr>"
        );
    }
    html += "</table></div>\n";
    for chart in estimate_charts(found) {
        let _ = writeln!(html, "<figure>\n{}</figure>", inline(&chart.svg(), &chart.title));
    }
    push_model(&mut html, &found.model.to_toml());
    foot(&mut html, env!("CARGO_PKG_VERSION"));
    html
}

fn push_correlations(html: &mut String, own: &Identified) {
    let Some(correlation) = own.correlation.as_ref().filter(|all| all.len() > 1) else { return };
    let names: Vec<_> = own.parameters.iter().map(|one| escape(&one.name)).collect();
    *html += "<h2>Correlations</h2>\n<div class=\"scroll\"><table class=\"grid\">\n<tr><th></th>";
    names.iter().for_each(|name| *html += &format!("<th>{name}</th>"));
    *html += "</tr>\n";
    for (name, row) in names.iter().zip(correlation) {
        let cell = |x: &f64| if x.is_nan() { "–".to_owned() } else { format!("{x:.3}") };
        let cells: Vec<String> = row.iter().map(|x| format!("<td>{}</td>", cell(x))).collect();
        let _ = writeln!(html, "<tr><td>{name}</td>{}</tr>", cells.concat());
    }
    *html += "</table></div>\n";
}
