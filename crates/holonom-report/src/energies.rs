//! Charts of `energy.csv`: parts of the energy, work, balance.

use super::chart::{ChartAxis, LineChart, Series, Strokes};
use super::plots::Plot;
use super::series::subsample;
use holonom_sim::output::TimeSeries;
use holonom_sim::output::columns::{self, BALANCE, TOTAL};

/// Most curves of a chart.
const CURVES: usize = 6;

/// The charts of a run: parts of the energy where there are two, work and balance where anything
/// does work.
#[must_use]
pub fn energy_plots(table: &TimeSeries) -> Vec<Plot> {
    let size = |values: &[f64]| values.iter().fold(0.0_f64, |size, y| size.max(y.abs()));
    let column = |name: &str| {
        let k = table.columns.iter().position(|column| column == name)?;
        Some(table.values[k].as_slice()).filter(|values| size(values) > 0.0)
    };
    let curve = |name: &str, label: &str| {
        Some(Series { name: label.to_owned(), points: subsample(&table.t, column(name)?) })
    };
    let chart = |name: &str, title: &str, caption: &str, curves: Vec<Series>| Plot {
        name: name.to_owned(),
        caption: caption.to_owned(),
        chart: LineChart {
            title: title.to_owned(),
            x: ChartAxis::time(),
            y: ChartAxis::linear(if name == "work" { "work" } else { "energy" }, "J"),
            strokes: Strokes::Line,
            resolution: 0.0,
            marks: Vec::new(),
            curves,
        },
    };
    let mut plots = Vec::new();
    let parts: Vec<Series> =
        columns::PARTS.iter().filter_map(|part| curve(part.name, part.name)).collect();
    if parts.len() > 1 {
        let all = parts.into_iter().chain(curve(TOTAL.name, TOTAL.name)).collect();
        plots.push(chart("energies", "Parts of the energy", "Values at the nodes.", all));
    }
    let work = |name: &String| {
        let source = columns::source_of_work(name)?;
        column(name).map(|_| (name.clone(), source))
    };
    let works: Vec<(String, String)> = table.columns.iter().filter_map(work).collect();
    if works.is_empty() {
        return plots;
    }
    let shown = works.iter().take(CURVES).filter_map(|(name, source)| curve(name, source));
    let shown = shown.collect();
    let caption = match works.len() > CURVES {
        true => format!("The first {CURVES} of {}; all are in energy.csv.", works.len()),
        false => {
            "Of loads, motors, dampers, material damping and prescribed motions since the start."
                .into()
        }
    };
    plots.push(chart("work", "Work", &caption, shown));
    let caption = "The total energy less its initial value and all work: the error of the balance.";
    let balance = curve(BALANCE.name, BALANCE.name).into_iter().collect();
    plots.push(chart(BALANCE.name, "Energy balance", caption, balance));
    plots
}
