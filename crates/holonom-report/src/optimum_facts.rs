//! What is said of an optimum, in lines.

use super::facts::{Fact, counted as one_or, rounded};
use holonom_sim::optimize::{OptimumReport, Status};

fn counted(count: usize, one: &str) -> String {
    one_or(count as u64, one, &format!("{one}s"))
}

/// One line with the size of the search.
#[must_use]
pub fn optimum_counts(found: &OptimumReport) -> String {
    let free = match (found.controls.len(), found.parameters.len()) {
        (0, parameters) => counted(parameters, "parameter"),
        (controls, 0) => counted(controls, "control"),
        (controls, parameters) => {
            format!("{} and {}", counted(controls, "control"), counted(parameters, "parameter"))
        }
    };
    if found.steps == 0 {
        return format!("optimum of {free} at the equilibrium at t = {}", rounded(found.time, 9));
    }
    format!("optimum of {free} over {} steps of {} s", found.steps, rounded(found.step, 9))
}

/// The facts of an optimum: how the search ended, cost, parameters, bounds, conditions, order,
/// replay, starts.
#[must_use]
pub fn optimum_facts(found: &OptimumReport) -> Vec<Fact> {
    let mut facts = Vec::new();
    let mut fact = |subject: &'static str, finding: String| facts.push(Fact { subject, finding });
    let iterations = counted(found.iterations, "iteration");
    let sufficient = found.sufficient.map_or("", |own| match (own, found.parameters.is_empty()) {
        (true, true) => ", second-order sufficient",
        (true, false) => ", second-order sufficient in the controls",
        (false, _) => ", second order not shown",
    });
    let words = match found.status {
        Status::Optimal if found.terms.is_empty() => "the conditions are met",
        status => status.words(),
    };
    fact("status", format!("{words}, {iterations}{sufficient}"));
    if !found.terms.is_empty() {
        let terms = found.terms.iter();
        let terms = terms.map(|own| format!("{} {}", own.name, rounded(own.value, 10)));
        let terms: Vec<String> = terms.collect();
        fact("cost", format!("{}: {}", rounded(found.cost, 12), terms.join(", ")));
    }
    for own in &found.parameters {
        let bound = if own.at_bound { ", at its bound" } else { "" };
        let (value, start) = (rounded(own.value, 12), rounded(own.start, 6));
        let (min, max) = (rounded(own.min, 6), rounded(own.max, 6));
        let words = format!("{} = {value}, from {start} within {min} to {max}{bound}", own.name);
        fact("parameter", words);
    }
    if !found.controls.is_empty() {
        let active = found.controls.iter().filter(|own| own.at_bounds > 0);
        let active =
            active.map(|own| format!("`{}` in {}", own.name, counted(own.at_bounds, "step")));
        let active: Vec<String> = active.collect();
        let words = if active.is_empty() { "none active".to_owned() } else { active.join(", ") };
        fact("bounds", words);
    }
    if !found.conditions.is_empty() {
        fact("conditions", conditions(found));
    }
    if found.refinements.len() > 1 {
        let all = || found.refinements.iter();
        let costs: Vec<String> = all().map(|own| rounded(own.cost, 9)).collect();
        let steps: Vec<String> = all().map(|own| own.steps.to_string()).collect();
        let order = found.convergence().map_or_else(String::new, |[order, limit]| {
            format!(": order {order:.1}, limit about {}", rounded(limit, 7))
        });
        let (costs, steps) = (costs.join(", "), steps.join(", "));
        fact("convergence", format!("cost {costs} at {steps} steps{order}"));
    }
    if let Some(own) = &found.replay {
        let steps =
            own.by_steps.map_or_else(String::new, |by| format!(", step by step to {by:.0e}"));
        fact("replay", format!("the motion follows its controls to {:.0e}{steps}", own.deviation));
    }
    for own in &found.starts {
        let (cost, words) = (rounded(own.cost, 9), own.status.words());
        fact("start", format!("{}: cost {cost}, {words}", own.start));
    }
    facts
}

/// How far conditions are met, and the dearest of them.
fn conditions(found: &OptimumReport) -> String {
    let worst = found.conditions.iter().fold(0.0_f64, |worst, own| worst.max(own.violation));
    let met = match found.status {
        _ if worst == 0.0 => "all met".to_owned(),
        Status::Optimal => format!("all met to {worst:.0e}"),
        _ => format!("missed by {worst:.1e} at most"),
    };
    let dearest = found.conditions.iter().max_by(|a, b| a.price.abs().total_cmp(&b.price.abs()));
    let price = dearest.filter(|own| own.price != 0.0).map_or_else(String::new, |own| {
        format!("; the largest price: `{}`, {} for one more", own.name, rounded(own.price, 6))
    });
    met + &price
}
