//! `optimum.html`: the motion, controls with their bounds, cost by term, conditions, convergence.

use std::fmt::Write;

use holonom_model::Model;
use holonom_sim::optimize::{FoundOptimum, OptimumReport, SearchStatus};

use super::chart::{ChartAxis, LineChart, Series, Strokes};
use super::facts::rounded;
use super::optimum_facts::{optimum_counts, optimum_facts};
use super::page::{
    escape, figure, foot, head, heading, push_contents, push_grid, push_list, push_model,
    push_warnings,
};

/// The values of each control over time, constant in each step, with its bounds.
#[must_use]
pub fn control_charts(model: &Model, found: &FoundOptimum) -> Vec<LineChart> {
    let (h, end) = (found.report.step, found.report.time);
    let chart = |(k, own): (usize, &holonom_model::Control)| {
        let ends = |(n, row): (usize, &Vec<f64>)| [n, n + 1].map(|node| (node as f64 * h, row[k]));
        let name = own.name.clone();
        let acts = found.controls.iter().enumerate().flat_map(ends).collect();
        let mut curves = vec![Series { name: name.clone(), points: acts }];
        let bounds = [own.min, own.max].into_iter().flatten();
        let bounds = bounds.flat_map(|y| [(0.0, y), (end, y), (f64::NAN, y)]); // in parts
        let bounds = Series { name: "bounds".to_owned(), points: bounds.collect() };
        curves.extend((!bounds.points.is_empty()).then_some(bounds));
        let y = match own.joint.as_deref().and_then(|name| model.joint(name)) {
            Some(joint) if joint.pair().is_angle(own.freedom) => ChartAxis::linear("torque", "N·m"),
            Some(_) => ChartAxis::linear("force", "N"),
            None => ChartAxis::linear("factor of its wrench", ""),
        };
        drawn(name, [ChartAxis::time(), y], Strokes::LineOverBounds, curves)
    };
    model.controls.iter().enumerate().map(chart).collect()
}

/// What iterations do: violations and slopes, the cost; of a design its parameters as well.
#[must_use]
pub fn iteration_charts(found: &FoundOptimum) -> Vec<LineChart> {
    let report = &found.report;
    let curve = |name: &str, of: &dyn Fn(&holonom_sim::optimize::SearchStep) -> f64| {
        let points = found.steps.iter().enumerate().map(|(i, at)| (i as f64, of(at)));
        Series { name: name.to_owned(), points: points.collect() }
    };
    let changes = found
        .steps
        .windows(2)
        .enumerate()
        .filter(|(_, pair)| (pair[0].steps, pair[0].start) != (pair[1].steps, pair[1].start));
    let marks: Vec<f64> = changes.map(|(i, _)| i as f64 + 0.5).collect();
    let chart = |title: &str, y: ChartAxis, curves: Vec<Series>| {
        let axes = [ChartAxis::linear("iteration", ""), y];
        let chart = drawn(title.to_owned(), axes, Strokes::MarkedLine, curves);
        LineChart { marks: marks.clone(), ..chart }
    };
    let mut left = vec![curve("violation", &|at| at.iterate.infeasibility)];
    if !found.controls.is_empty() {
        left.push(curve("stationarity", &|at| at.iterate.stationarity));
        left.push(curve("barrier", &|at| at.iterate.barrier));
    }
    let mut charts = Vec::new();
    if !(found.controls.is_empty() && report.conditions.is_empty()) {
        charts.push(chart("what is left", ChartAxis::logarithmic("size", ""), left));
    }
    if !report.terms.is_empty() {
        let cost = vec![curve("cost", &|at| at.iterate.cost)];
        charts.push(chart("cost", ChartAxis::linear("cost", ""), cost));
    }
    for (k, own) in report.parameters.iter().enumerate() {
        let value = |at: &holonom_sim::optimize::SearchStep| at.parameters[k];
        let curves = vec![curve(&own.name, &value)];
        charts.push(chart(&own.name, ChartAxis::linear(&own.name, ""), curves));
    }
    charts
}

fn drawn(
    title: String,
    [x, y]: [ChartAxis; 2],
    strokes: Strokes,
    curves: Vec<Series>,
) -> LineChart {
    LineChart { title, x, y, strokes, resolution: 0.0, marks: Vec::new(), curves }
}

/// The page of an optimum of a model; `scene`: of its run; `command` makes it again.
#[must_use]
pub fn optimum_page(model: &Model, found: &FoundOptimum, scene: &str, command: &str) -> String {
    let own = &found.report;
    let mut html = head(&format!("{}: optimum", own.model));
    html += &heading(&own.model, &[optimum_counts(own)], command);
    if own.status == SearchStatus::TurnsBounded {
        push_warnings(&mut html, &own.missed);
    } else if own.status != SearchStatus::Optimal {
        let missed = own.missed.iter().map(|words| format!("; {words}")).collect::<String>();
        let words = escape(&format!("No optimum: {}{missed}.", own.status.words()));
        let _ = writeln!(html, "<p class=\"failed\">{words}</p>");
    }
    let sections = [
        ("controls", "Controls", !own.controls.is_empty()),
        ("parameters", "Parameters", !own.parameters.is_empty()),
        ("cost", "Cost", !own.terms.is_empty()),
        ("conditions", "Conditions", !own.conditions.is_empty()),
        ("convergence", "Convergence", true),
        ("model", "Model", true),
    ];
    let there = sections.into_iter().filter(|(.., there)| *there);
    push_contents(&mut html, there.map(|(id, name, _)| (id, name)));
    html += scene;
    let plain = |finding: String| finding.replace('`', ""); // quotes of a terminal
    let facts = optimum_facts(own).into_iter();
    push_list(&mut html, facts.map(|fact| (fact.subject, plain(fact.finding))));
    html += "<p class=\"note\"><a href=\"report.html\">The page of the run</a> has all curves of the motion.</p>\n";
    push_controls(&mut html, model, found);
    push_parameters(&mut html, own);
    push_cost(&mut html, own);
    push_conditions(&mut html, own);
    html += "<h2 id=\"convergence\">Convergence</h2>\n";
    push_refinements(&mut html, own);
    push_charts(&mut html, &iteration_charts(found));
    push_model(&mut html, &model.to_toml());
    foot(&mut html, env!("CARGO_PKG_VERSION"));
    html
}

/// Charts beside one another, as far as there is room.
pub(crate) fn push_charts(html: &mut String, charts: &[LineChart]) {
    html.push_str("<div class=\"charts\">\n");
    charts.iter().for_each(|chart| html.push_str(&figure(chart, "")));
    html.push_str("</div>\n");
}

/// A bound that may be none.
fn bound(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| rounded(value, 9))
}

fn push_controls(html: &mut String, model: &Model, found: &FoundOptimum) {
    let own = &found.report.controls;
    if own.is_empty() {
        return;
    }
    html.push_str("<h2 id=\"controls\">Controls</h2>\n");
    push_charts(html, &control_charts(model, found));
    let row = |own: &holonom_sim::optimize::ControlFound| {
        let at = own.at_bounds.to_string();
        [own.name.clone(), bound(own.min), bound(own.max), rounded(own.largest, 9), at]
    };
    let names = ["control", "least", "largest", "largest modulus", "steps at a bound"];
    push_grid(html, &names, own.iter().map(row));
}

fn push_parameters(html: &mut String, own: &OptimumReport) {
    if own.parameters.is_empty() {
        return;
    }
    html.push_str("<h2 id=\"parameters\">Parameters</h2>\n");
    let row = |own: &holonom_sim::optimize::ParameterFound| {
        let at = if own.at_bound { "yes" } else { "no" };
        let [min, max] = [own.min, own.max].map(|bound| rounded(bound, 9));
        [own.name.clone(), rounded(own.start, 9), rounded(own.value, 12), min, max, at.to_owned()]
    };
    let names = ["parameter", "before", "after", "least", "largest", "at a bound"];
    push_grid(html, &names, own.parameters.iter().map(row));
}

fn push_cost(html: &mut String, own: &OptimumReport) {
    if own.terms.is_empty() {
        return;
    }
    html.push_str("<h2 id=\"cost\">Cost</h2>\n");
    let share = |value: f64| match own.cost {
        0.0 => "–".to_owned(),
        all => format!("{:.1} %", 100.0 * value / all),
    };
    let row = |name: &str, value: f64| [name.to_owned(), rounded(value, 12), share(value)];
    let rows = own.terms.iter().map(|term| row(&term.name, term.value));
    let sum = (own.terms.len() > 1).then(|| row("sum", own.cost));
    push_grid(html, &["term", "value", "share"], rows.chain(sum));
}

/// Prices below this part of the largest are what a method leaves of a bound that is not active.
const NO_PRICE: f64 = 1e-9;

fn push_conditions(html: &mut String, own: &OptimumReport) {
    if own.conditions.is_empty() {
        return;
    }
    html.push_str("<h2 id=\"conditions\">Conditions</h2>\n");
    let dearest = own.conditions.iter().fold(0.0_f64, |most, own| most.max(own.price.abs()));
    let price = |price: f64| match price.abs() <= NO_PRICE * dearest {
        true => "0".to_owned(),
        false => rounded(price, 6),
    };
    let row = |own: &holonom_sim::optimize::ConditionMet| {
        let beyond = |by: f64| if by == 0.0 { "0".to_owned() } else { format!("{by:.1e}") };
        let halved = own.halved.map_or_else(|| "–".to_owned(), beyond);
        let [value, missed] = [rounded(own.value, 12), beyond(own.violation)];
        [own.label(), value, bound(own.min), bound(own.max), missed, halved, price(own.price)]
    };
    let names =
        ["condition", "value", "least", "largest", "missed by", "at half the step", "price"];
    push_grid(html, &names, own.conditions.iter().map(row));
    html.push_str(
        "<p class=\"note\">The price is what the cost grows by where the bound is one unit larger. \
         Along the path the value is the one nearest to a bound. A run of half the step has nodes between the nodes.</p>\n",
    );
}

fn push_refinements(html: &mut String, own: &OptimumReport) {
    if own.refinements.len() > 1 {
        let before = own.refinements.iter().map(|own| Some(own.cost));
        let before = std::iter::once(None).chain(before);
        let row = |(own, before): (&holonom_sim::optimize::Refinement, Option<f64>)| {
            let change = before
                .map_or_else(|| "–".to_owned(), |before| format!("{:.3e}", own.cost - before));
            [own.steps.to_string(), rounded(own.cost, 12), change]
        };
        push_grid(html, &["steps", "cost", "change"], own.refinements.iter().zip(before).map(row));
    }
    if let Some(judged) = own.judged {
        let words = format!(
            "By the derivatives of the program: stationarity {:.1e} of the largest multiplier, violation {:.1e}, \
             complementarity {:.1e}.",
            judged.stationarity, judged.violation, judged.complementarity
        );
        let _ = writeln!(html, "<p class=\"note\">{words}</p>");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use holonom_sim::gradient::TermValue;
    use holonom_sim::optimize::{ConditionMet, ControlFound, Iterate, ParameterFound};
    use holonom_sim::optimize::{Refinement, SearchStep};

    const MODEL: &str = r#"
        model = { name = "m" }
        simulation = { step = 0.5, end = 1.0 }
        body = [{ name = "b", mass = 1.0, inertia = [1.0, 1.0, 1.0] }]
        joint = [{ name = "j", type = "revolute", parent = "ground", child = "b", position = [0, 0, 0], axis = [0, 0, 1] }]
        control = [{ name = "torque", joint = "j", max = 3.0 }]
        objective = [{ name = "cheap", type = "effort" }]
    "#;

    fn found(model: &Model) -> FoundOptimum {
        let cheap = TermValue { name: "cheap".into(), value: 1.25 };
        let (min, max) = (None, Some(3.0));
        let torque = ControlFound { name: "torque".into(), min, max, largest: 2.0, at_bounds: 0 };
        let up = ConditionMet {
            name: "up <".into(),
            of: None,
            value: 1.0,
            min: Some(1.0),
            max: Some(1.0),
            violation: 0.0,
            halved: Some(2e-5),
            price: -7.5,
        };
        let report = OptimumReport {
            model: "m".into(),
            status: SearchStatus::Optimal,
            steps: 2,
            step: 0.5,
            time: 1.0,
            cost: 1.25,
            terms: vec![cheap],
            controls: vec![torque],
            conditions: vec![up],
            refinements: [(1, 2.0), (2, 1.25)]
                .map(|(steps, cost)| Refinement { steps, cost, comparable: true })
                .into(),
            ..OptimumReport::default()
        };
        let step = |steps: usize, cost: f64| {
            let iterate = Iterate { cost, infeasibility: 0.1 * cost, ..Iterate::default() };
            SearchStep { start: 1, steps, iterate, parameters: vec![3.0 * cost] }
        };
        let steps = vec![step(1, 4.0), step(1, 2.0), step(2, 1.25)];
        let controls = vec![vec![-1.0], vec![2.0]];
        let kept = holonom_sim::optimize::SearchEnd::default();
        FoundOptimum {
            report,
            steps,
            model: model.clone(),
            costates: Vec::new(),
            prices: Vec::new(),
            controls,
            kept,
        }
    }

    #[test]
    fn a_control_is_constant_in_each_step_and_has_its_bounds() {
        let model = Model::from_toml(MODEL).unwrap();
        let charts = control_charts(&model, &found(&model));
        assert_eq!((charts.len(), charts[0].y.unit.as_str()), (1, "N·m"));
        let [acts, bounds] = &charts[0].curves[..] else { panic!("a control and its bounds") };
        assert_eq!(acts.points, [(0.0, -1.0), (0.5, -1.0), (0.5, 2.0), (1.0, 2.0)]);
        assert_eq!(bounds.points[..2], [(0.0, 3.0), (1.0, 3.0)]);
        assert!(bounds.points.len() == 3 && bounds.points[2].0.is_nan(), "there is no least one");
    }

    #[test]
    fn iterations_are_in_a_row_with_a_mark_where_steps_are_halved() {
        let model = Model::from_toml(MODEL).unwrap();
        let mut found = found(&model);
        let charts = iteration_charts(&found);
        let names = |chart: &LineChart| -> Vec<String> {
            chart.curves.iter().map(|curve| curve.name.clone()).collect()
        };
        assert_eq!(names(&charts[0]), ["violation", "stationarity", "barrier"]);
        assert_eq!(charts[1].curves[0].points, [(0.0, 4.0), (1.0, 2.0), (2.0, 1.25)]);
        assert_eq!((charts.len(), charts[0].marks.as_slice()), (2, &[1.5][..]));
        found.controls.clear();
        let (name, bounds) = ("length".to_owned(), [0.0, 9.0]);
        found.report.parameters.push(ParameterFound {
            name,
            value: 3.75,
            start: 12.0,
            min: bounds[0],
            max: bounds[1],
            at_bound: false,
        });
        let charts = iteration_charts(&found);
        assert_eq!(names(&charts[0]), ["violation"]);
        assert_eq!(charts[2].curves[0].points[2], (2.0, 3.75));
    }

    #[test]
    fn a_page_has_what_was_found_and_says_what_was_not() {
        let model = Model::from_toml(MODEL).unwrap();
        let mut own = found(&model);
        let page = optimum_page(&model, &own, "<p>scene</p>", "holonom optimize m.toml");
        for words in [
            "<p>scene</p>",
            "<td>up &lt;</td><td>1</td><td>1</td><td>1</td><td>0</td><td>2.0e-5</td><td>-7.5</td>",
            "<td>torque</td><td>–</td><td>3</td><td>2</td><td>0</td>",
            "<td>cheap</td><td>1.25</td><td>100.0 %</td>",
            "<td>2</td><td>1.25</td><td>-7.500e-1</td>",
            "<code>holonom optimize m.toml</code>",
        ] {
            assert!(page.contains(words), "{words}");
        }
        assert!(!page.contains("class=\"failed\"") && !page.contains("id=\"parameters\""));
        own.report.status = SearchStatus::Infeasible;
        own.report.missed = vec!["`up` by 3".into()];
        let page = optimum_page(&model, &own, "", "");
        assert!(page.contains("class=\"failed\"") && page.contains("`up` by 3."));
    }
}
