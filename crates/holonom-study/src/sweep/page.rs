//! `sweep.html`: what the sensors and the energy answer to the varied keys.

use super::manifest::PointStatus;
use super::table::{BALANCE_ERROR, ENERGY_ERROR, PointRow, SweepTable, WORK};
use holonom_report::page::{escape, figure, foot, head, heading};
use holonom_report::{ChartAxis, LineChart, Series, Strokes, rounded};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Most charts of a key.
const CHARTS: usize = 12;
/// Most curves of a chart.
const CURVES: usize = 6;
/// Points that are listed.
const POINTS: usize = 500;
/// A change, as a part of the size, that is none.
const ROUND_OFF: f64 = 1e-12;

/// The page of a sweep.
pub fn page(table: &SweepTable, version: &str) -> String {
    let title = format!("{}: response to {}", table.model, table.keys.join(", "));
    let mut html = head(&title);
    let count = |status| table.rows.iter().filter(|row| row.entry.status == status).count();
    let points = format!(
        "{} points: {} done, {} failed, {} invalid",
        table.rows.len(),
        count(PointStatus::Done),
        count(PointStatus::Failed),
        count(PointStatus::Invalid)
    );
    html += &heading(&title, &[points], &table.command);
    for row in table.rows.iter().filter(|row| row.entry.message.is_some()).take(20) {
        let why = row.entry.message.as_deref().unwrap_or_default();
        let point = format!("point {}: {why}", row.entry.point);
        let _ = writeln!(html, "<p class=\"failed\">{}</p>", escape(&point));
    }
    html += "<div class=\"charts\">\n";
    charts(table).iter().for_each(|chart| html += &figure(chart, ""));
    html += "</div>\n";
    push_points(&mut html, table);
    foot(&mut html, version);
    html
}

/// The points with links to their runs.
fn push_points(html: &mut String, table: &SweepTable) {
    let cell = |words: &str| format!("<td>{}</td>", escape(words));
    *html += "<h2>Points</h2>\n<div class=\"scroll\"><table class=\"grid\">\n<tr><th>point</th>";
    for key in &table.keys {
        let _ = write!(html, "<th>{}</th>", escape(key));
    }
    *html += "<th>status</th></tr>\n";
    for row in table.rows.iter().take(POINTS) {
        let point = row.entry.point.to_string();
        let point = match &row.link {
            Some(link) => format!("<td><a href=\"{}\">{point}</a></td>", escape(link)),
            None => cell(&point),
        };
        let values = row.entry.values.iter().enumerate().map(|(key, text)| {
            cell(&row.number(key).map_or_else(|| text.clone(), |x| rounded(x, 7)))
        });
        let (values, status) = (values.collect::<String>(), cell(row.entry.status.name()));
        let _ = writeln!(html, "<tr>{point}{values}{status}</tr>");
    }
    *html += "</table></div>\n";
    let rows = table.rows.len();
    if rows > POINTS {
        let _ = writeln!(html, "<p class=\"note\">The first {POINTS} of {rows} points.</p>");
    }
    *html += "<p class=\"note\">All numbers: sweep.csv. A link leads to the page of the run, which \
              <code>holonom plot FOLDER</code> makes where it is missing, else to its summary.</p>\n";
}

/// Each result that changes over each key that is a number: a curve for each combination of the
/// other keys while these are few, points otherwise. The energy error comes last; where anything
/// does work it is that of the balance.
fn charts(table: &SweepTable) -> Vec<LineChart> {
    let done: Vec<&PointRow> =
        table.rows.iter().filter(|row| row.entry.status == PointStatus::Done).collect();
    let place = |name: &str| table.results.iter().position(|result| result == name);
    let works =
        |row: &&PointRow| place(WORK).and_then(|k| row.results[k]).is_some_and(|w| w != 0.0);
    let energy = place(if done.iter().any(works) { BALANCE_ERROR } else { ENERGY_ERROR });
    let changes = |r: &usize| {
        let values = || done.iter().filter_map(|row| row.results[*r]);
        let size = values().fold(0.0, |size: f64, y| size.max(y.abs()));
        values().any(|y| (y - values().next().unwrap_or(y)).abs() > ROUND_OFF * size)
    };
    let shown: Vec<usize> = table.of_sensors().take(CHARTS).chain(energy).filter(changes).collect();
    let over = |key: usize| {
        let numbers = done.iter().all(|row| row.number(key).is_some());
        let shown = if numbers { shown.as_slice() } else { &[] };
        shown.iter().map(|result| chart(table, &done, key, *result)).collect::<Vec<_>>()
    };
    (0..table.keys.len()).flat_map(over).collect()
}

/// A result over a key.
fn chart(table: &SweepTable, done: &[&PointRow], key: usize, result: usize) -> LineChart {
    let others: Vec<usize> = (0..table.keys.len()).filter(|other| *other != key).collect();
    let mut curves: BTreeMap<String, Vec<(f64, f64)>> = BTreeMap::new();
    for row in done {
        let (Some(x), Some(y)) = (row.number(key), row.results[result]) else { continue };
        let values: Vec<&str> = others.iter().map(|k| row.entry.values[*k].as_str()).collect();
        curves.entry(values.join(", ")).or_default().push((x, y));
    }
    let few = curves.len() <= CURVES;
    if !few {
        curves = BTreeMap::from([(String::new(), curves.into_values().flatten().collect())]);
    }
    let sorted = |(name, mut points): (String, Vec<(f64, f64)>)| {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Series { name, points }
    };
    let (name, keys) = (&table.results[result], others.iter().map(|k| table.keys[*k].as_str()));
    let keys = keys.collect::<Vec<_>>().join(", ");
    LineChart {
        title: if few && !others.is_empty() { format!("{name}, by {keys}") } else { name.clone() },
        x: ChartAxis::linear(&table.keys[key], ""),
        y: ChartAxis::linear(name, &table.units[result]),
        strokes: if few { Strokes::MarkedLine } else { Strokes::Marks },
        resolution: 0.0,
        marks: Vec::new(),
        curves: curves.into_iter().map(sorted).collect(),
    }
}
