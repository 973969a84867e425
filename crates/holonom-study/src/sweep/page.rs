//! `sweep.html`: what the sensors and the energy answer to the varied keys.

use super::manifest::PointStatus;
use super::table::{ENERGY_ERROR, Row, Table};
use holonom_report::page::{escape, foot, head, heading, inline};
use holonom_report::{Axis, Chart, Curve, Strokes};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Most charts of a key.
const CHARTS: usize = 12;
/// Most curves of a chart.
const CURVES: usize = 6;
/// A change, as a part of the size, that is none.
const ROUND_OFF: f64 = 1e-12;

/// The page of a sweep.
pub fn page(table: &Table, version: &str) -> String {
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
    for chart in charts(table) {
        let drawn = inline(&chart.svg(), &chart.title);
        let _ = write!(html, "<figure>\n{drawn}</figure>\n");
    }
    html += "<p class=\"note\">All numbers: sweep.csv.</p>\n";
    foot(&mut html, version);
    html
}

/// Each result that changes over each key that is a number: a curve for each combination of the other keys while these are
/// few, points otherwise. The energy error comes last.
fn charts(table: &Table) -> Vec<Chart> {
    let done: Vec<&Row> =
        table.rows.iter().filter(|row| row.entry.status == PointStatus::Done).collect();
    let energy = table.results.iter().position(|result| result == ENERGY_ERROR);
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
fn chart(table: &Table, done: &[&Row], key: usize, result: usize) -> Chart {
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
        Curve { name, points }
    };
    let (name, keys) = (&table.results[result], others.iter().map(|k| table.keys[*k].as_str()));
    let keys = keys.collect::<Vec<_>>().join(", ");
    Chart {
        title: if few && !others.is_empty() { format!("{name}, by {keys}") } else { name.clone() },
        x: Axis::linear(&table.keys[key], ""),
        y: Axis::linear(name, ""),
        strokes: if few { Strokes::MarkedLine } else { Strokes::Marks },
        resolution: 0.0,
        curves: curves.into_iter().map(sorted).collect(),
    }
}
