//! `estimate.html`: unknown numbers from measurements, data over model, residuals, correlations.

use holonom_sim::identification::{Identified, IdentifiedModel, MeasuredRow};
use holonom_sim::sensor::columns;

use super::chart::{ChartAxis, LineChart, Series, Strokes};
use super::facts::rounded;
use super::optimum_page::push_charts;
use super::page::{foot, head, heading, push_grid, push_list, push_model, push_warnings};

/// The charts of an estimate: of each column the data over the model, and the residuals.
#[must_use]
pub fn estimate_charts(found: &IdentifiedModel) -> Vec<LineChart> {
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
        let chart =
            |title: String, y: ChartAxis, strokes: Strokes, curves: Vec<Series>| LineChart {
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
pub fn estimate_page(found: &IdentifiedModel, command: &str) -> String {
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
    html += "<h2>Estimates</h2>\n";
    let names = ["unknown number", "estimate", "± standard error", "start"];
    let estimates = own.parameters.iter().map(|one| {
        let error = match one.standard_error {
            Some(error) => rounded(error, 3),
            None if one.at_bound => "at a bound".to_owned(),
            None => "unknown".to_owned(),
        };
        [one.name.clone(), rounded(one.value, 9), error, rounded(one.start, 6)]
    });
    push_grid(&mut html, &names, estimates);
    push_correlations(&mut html, own);
    html += "<h2>Columns</h2>\n";
    let names = ["column", "sensor", "values", "rms", "sigma", "runs test"];
    let columns = own.columns.iter().map(|one| {
        let runs = one.probability_of_runs.map_or("–".to_owned(), |p| rounded(p, 3));
        let numbers = [one.values.to_string(), rounded(one.rms, 4), rounded(one.sigma, 4), runs];
        let [values, rms, sigma, runs] = numbers;
        [one.column.clone(), one.sensor.clone(), values, rms, sigma, runs]
    });
    push_grid(&mut html, &names, columns);
    push_charts(&mut html, &estimate_charts(found));
    push_model(&mut html, &found.model.to_toml());
    foot(&mut html, env!("CARGO_PKG_VERSION"));
    html
}

fn push_correlations(html: &mut String, own: &Identified) {
    let Some(correlation) = own.correlation.as_ref().filter(|all| all.len() > 1) else { return };
    html.push_str("<h2>Correlations</h2>\n");
    let names = || own.parameters.iter().map(|one| one.name.as_str());
    let row = |(name, row): (&str, &Vec<f64>)| {
        let cell = |x: &f64| if x.is_nan() { "–".to_owned() } else { format!("{x:.3}") };
        let cells = std::iter::once(name.to_owned()).chain(row.iter().map(cell));
        cells.collect::<Vec<String>>()
    };
    let head: Vec<&str> = std::iter::once("").chain(names()).collect();
    push_grid(html, &head, names().zip(correlation).map(row));
}
