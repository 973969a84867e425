//! `response.html`: the harmonic response of a model, its charts and its peaks.

use std::fmt::Write;

use holonom_model::Model;
use holonom_sim::modes::About;
use holonom_sim::response::{Resonance, Response, ResponseColumn};

use super::chart::{ChartAxis, LineChart, Series, Strokes};
use super::facts::{counted, rounded};
use super::page::{foot, head, heading, inline, push_grid, push_list, push_model, push_warnings};

/// The charts of a response with their names: amplitudes and phases of each quantity.
#[must_use]
pub fn response_charts(response: &Response) -> Vec<(String, LineChart)> {
    let mut groups: Vec<(&str, &str)> = Vec::new();
    for column in &response.columns {
        let own = (column.quantity.as_str(), column.unit.as_str());
        if !groups.contains(&own) {
            groups.push(own);
        }
    }
    let mut charts = Vec::new();
    for (quantity, unit) in groups {
        let own = response.columns.iter();
        // what does not answer has no logarithm
        let own: Vec<&ResponseColumn> = own
            .filter(|c| (c.quantity.as_str(), c.unit.as_str()) == (quantity, unit))
            .filter(|c| c.amplitude.iter().any(|a| *a > 0.0))
            .collect();
        let stem: String =
            quantity.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let curves = |of: fn(&ResponseColumn) -> &[f64]| -> Vec<Series> {
            let points = |c: &ResponseColumn| {
                let pairs = response.frequencies.iter().copied().zip(of(c).iter().copied());
                pairs.collect::<Vec<_>>()
            };
            own.iter().map(|c| Series { name: c.name.clone(), points: points(c) }).collect()
        };
        let chart = |title: &str, y: ChartAxis, curves: Vec<Series>| LineChart {
            title: format!("{quantity}: {title}"),
            x: ChartAxis::linear("frequency", "Hz"),
            y,
            strokes: Strokes::Line,
            resolution: 0.0,
            marks: Vec::new(),
            curves,
        };
        let amplitude = ChartAxis::logarithmic("amplitude", unit);
        charts.push((
            format!("{stem}_amplitude"),
            chart("amplitude", amplitude, curves(|c| &c.amplitude)),
        ));
        let phase = ChartAxis::linear("phase", "°");
        charts.push((format!("{stem}_phase"), chart("phase", phase, curves(|c| &c.phase))));
    }
    charts
}

/// The page of a response; `command` makes it again.
#[must_use]
pub fn response_page(model: &Model, response: &Response, command: &str) -> String {
    let title = format!("{}: harmonic response", response.model);
    let mut html = head(&title);
    let about = match response.about {
        About::Start => "the initial configuration",
        About::Static => "the equilibrium under the loads",
        About::Rotation => "the steady rotation, in its frame",
        About::Motion => "the steady motion, in its frame",
    };
    let dof = counted(response.dof as u64, "degree of freedom", "degrees of freedom");
    html += &heading(&title, &[format!("{dof}; about {about}")], command);
    push_warnings(&mut html, &response.warnings);
    let inputs: Vec<String> = response.inputs.iter().map(ToString::to_string).collect();
    let [alpha, beta] = response.rayleigh;
    let ratios: Vec<String> = response.damping_ratios.iter().map(|z| rounded(*z, 6)).collect();
    let mut facts = vec![("inputs", inputs.join(", "))];
    if alpha != 0.0 || beta != 0.0 {
        let [alpha, beta] = [alpha, beta].map(|x| rounded(x, 6));
        facts.push(("Rayleigh damping", format!("α = {alpha} 1/s, β = {beta} s")));
    }
    if !ratios.is_empty() {
        facts.push(("damping ratios of the modes", ratios.join(", ")));
    }
    push_list(&mut html, facts);
    for (_, chart) in response_charts(response) {
        let _ = writeln!(html, "<figure>\n{}</figure>", inline(&chart.svg(), &chart.title));
    }
    html +=
        "<p class=\"note\">Phases are those against a cosine of the input.</p>\n<h2>Peaks</h2>\n";
    let names = ["sensor", "largest amplitude", "unit", "at (Hz)", "phase (°)"];
    let peaks = response.columns.iter().map(|column| {
        let k = column.peak();
        let [amplitude, frequency, phase] =
            [column.amplitude[k], response.frequencies[k], column.phase[k]].map(|x| rounded(x, 6));
        [column.name.clone(), amplitude, column.unit.clone(), frequency, phase]
    });
    push_grid(&mut html, &names, peaks);
    html += "<h2>Resonances</h2>\n";
    let resonance = |own: &Resonance| [own.frequency, own.damping_ratio].map(|x| rounded(x, 7));
    push_grid(&mut html, &["f (Hz)", "damping ratio"], response.resonances.iter().map(resonance));
    push_model(&mut html, &model.to_toml());
    foot(&mut html, env!("CARGO_PKG_VERSION"));
    html
}
