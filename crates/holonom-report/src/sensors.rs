//! Charts of `sensors.csv`: one for each quantity of each sensor.

use super::chart::{ChartAxis, LineChart, Series, Strokes};
use super::plots::{Plot, file_name};
use super::series::subsample;
use holonom_model::Model;
use holonom_sim::output::TimeSeries;
use holonom_sim::sensor::{self, SensorColumn};

/// Sensors that are drawn.
const SENSORS: usize = 24;

/// All charts of the sensors of a run.
#[must_use]
pub fn sensor_plots(table: &TimeSeries, columns: &[SensorColumn]) -> Vec<Plot> {
    let mut names: Vec<&str> = columns.iter().map(|c| c.sensor.as_str()).collect();
    names.dedup();
    let all = names.len();
    names.truncate(SENSORS);
    let mut plots = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let own = || columns.iter().enumerate().filter(|(_, c)| c.sensor == **name);
        let mut quantities: Vec<_> = own().map(|(_, c)| (c.quantity, c.unit)).collect();
        quantities.retain(|q| !q.0.is_empty());
        quantities.dedup();
        let several = quantities.len() > 1;
        for (quantity, unit) in quantities {
            let label = |c: &SensorColumn| {
                if c.part.is_empty() { c.sensor.clone() } else { c.part.clone() }
            };
            let (curves, empty): (Vec<_>, Vec<_>) = own()
                .filter(|(_, c)| c.quantity == quantity)
                .partition(|(k, _)| table.values[*k].iter().any(|value| value.is_finite()));
            if curves.is_empty() {
                continue;
            }
            let curve = |(k, c): (usize, &SensorColumn)| Series {
                name: label(c),
                points: subsample(&table.t, &table.values[k]),
            };
            let empty: Vec<String> = empty.into_iter().map(|(_, c)| label(c)).collect();
            let caption = match empty.is_empty() {
                true => String::new(),
                false => format!("Not unique at any node: {}.", empty.join(", ")),
            };
            let kind = if several { format!("_{}", file_name(quantity)) } else { String::new() };
            plots.push(Plot {
                name: format!("sensor_{:02}_{}{kind}", i + 1, file_name(name)),
                caption,
                chart: LineChart {
                    title: format!("Sensor {name}: {quantity}"),
                    x: ChartAxis::time(),
                    y: ChartAxis::linear(quantity, unit),
                    strokes: Strokes::Line,
                    resolution: 0.0,
                    marks: Vec::new(),
                    curves: curves.into_iter().map(curve).collect(),
                },
            });
        }
    }
    if let Some(last) = plots.last_mut().filter(|_| all > SENSORS) {
        let shown = format!("The first {SENSORS} of {all} sensors; all are in sensors.csv.");
        last.caption = format!("{} {shown}", last.caption).trim_start().to_owned();
    }
    plots
}

/// The columns of the table as the model describes them; without quantities and units when it does
/// not.
#[must_use]
pub fn sensor_columns(table: &TimeSeries, model: Option<&Model>) -> Vec<SensorColumn> {
    let columns = model.map(sensor::columns).unwrap_or_default();
    if columns.iter().map(SensorColumn::name).eq(table.columns.iter().cloned()) {
        return columns;
    }
    let bare = |name: &String| {
        let (sensor, part) = name.split_once('.').unwrap_or((name, ""));
        let quantity = if part == sensor::UNIQUE { "" } else { "value" };
        SensorColumn { sensor: sensor.to_owned(), part: part.to_owned(), quantity, unit: "" }
    };
    table.columns.iter().map(bare).collect()
}
