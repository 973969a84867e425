//! What is said of an optimum, in lines.

use super::facts::{Fact, counted as one_or, rounded};
use holonom_sim::optimize::{OptimumReport, SearchStatus};

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
    let words = match (found.status, found.sufficient) {
        (SearchStatus::Optimal, _) if found.terms.is_empty() => "the conditions are met",
        (SearchStatus::Optimal, Some(false)) => "a stationary point, which may be no minimum",
        (status, _) => status.words(),
    };
    let second = match (found.status, found.sufficient) {
        (SearchStatus::Optimal, Some(true)) if found.parameters.is_empty() => {
            ", second-order sufficient"
        }
        (SearchStatus::Optimal, Some(true)) => ", second-order sufficient in the controls",
        (SearchStatus::Optimal, Some(false)) => {
            "; second order not shown: try another `guess`, or `starts`"
        }
        _ => "",
    };
    fact("status", format!("{words}, {iterations}{second}"));
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
        let turns = found.turns_at_bound.filter(|count| *count > 0);
        let turns = turns.map(|count| format!("turns of 1 rad in {}", counted(count, "step")));
        let active: Vec<String> = active.chain(turns).collect();
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
        let order = match found.convergence() {
            Some([order, limit]) => {
                format!(": order {order:.1}, limit about {}", rounded(limit, 7))
            }
            None if all().all(|own| own.comparable) => String::new(),
            None => ", which are not all optima of the same problem".to_owned(),
        };
        let (costs, steps) = (costs.join(", "), steps.join(", "));
        fact("convergence", format!("cost {costs} at {steps} steps{order}"));
    }
    if let Some(own) = &found.replay {
        let steps =
            own.by_steps.map_or_else(String::new, |by| format!(", step by step to {by:.0e}"));
        let follows = own.by_steps.unwrap_or(own.deviation) <= FOLLOWED;
        let iterate = matches!(
            found.status,
            SearchStatus::Infeasible | SearchStatus::Stopped | SearchStatus::Unfinished
        );
        let words = match follows || !iterate {
            true => format!("the motion follows its controls to {:.0e}{steps}", own.deviation),
            false => "none: a search on its way has no motion of its controls yet".to_owned(),
        };
        fact("replay", words);
    }
    let halved = found.conditions.iter().filter_map(|own| Some((own, own.halved?)));
    if let Some((own, by)) = halved.max_by(|a, b| a.1.total_cmp(&b.1)) {
        let words = match by {
            0.0 => "its run meets all conditions".to_owned(),
            by => format!("its run misses `{}` by {by:.1e}", own.name),
        };
        fact("half step", words);
    }
    for own in &found.starts {
        let led = match own.count {
            1 => String::new(),
            count => format!(" ({count} starts)"),
        };
        let cost = if own.cost.is_finite() {
            format!("cost {}, ", rounded(own.cost, 9))
        } else {
            String::new()
        };
        let why = if own.message.is_empty() { "" } else { ": " };
        let (words, message) = (own.status.words(), &own.message);
        fact("start", format!("{}: {cost}{words}{why}{message}{led}", own.start));
    }
    facts
}

/// Violations that count as none.
const ROUNDING: f64 = 1e-9;
/// Deviations of a run that is the motion.
const FOLLOWED: f64 = 1e-8;

/// How far conditions are met, and the dearest of them.
fn conditions(found: &OptimumReport) -> String {
    let worst = found.conditions.iter().fold(0.0_f64, |worst, own| worst.max(own.violation));
    let met = match found.status {
        _ if worst == 0.0 => "all met".to_owned(),
        _ if worst <= ROUNDING => format!("all met to {worst:.0e}"),
        _ => format!("missed by {worst:.1e} at most"),
    };
    let dearest = found.conditions.iter().max_by(|a, b| a.price.abs().total_cmp(&b.price.abs()));
    let price = dearest.filter(|own| own.price != 0.0 && found.status.is_found()).map_or_else(
        String::new,
        |own| {
            format!(
                "; the largest price: `{}`, {} for one more",
                own.label(),
                rounded(own.price, 6)
            )
        },
    );
    met + &price
}

#[cfg(test)]
mod tests {
    use super::*;
    use holonom_sim::gradient::TermValue;
    use holonom_sim::optimize::{ConditionMet, ControlFound, Refinement, Replayed, StartFound};

    fn found() -> OptimumReport {
        let condition = |name: &str, of: Option<&str>, price: f64, halved: Option<f64>| {
            let (of, bound) = (of.map(str::to_owned), Some(0.0));
            let (name, value) = (name.to_owned(), 2e-12);
            let violation = value;
            ConditionMet { name, of, value, min: bound, max: bound, violation, halved, price }
        };
        let own = |steps: usize, cost: f64| Refinement { steps, cost, comparable: true };
        let (min, max) = (None, None);
        let torque = ControlFound { name: "t".into(), min, max, largest: 2.0, at_bounds: 0 };
        let start = |start: usize, count: usize, cost: f64| StartFound {
            start,
            count,
            status: SearchStatus::Optimal,
            cost,
            message: String::new(),
        };
        OptimumReport {
            status: SearchStatus::Optimal,
            sufficient: Some(true),
            cost: 4.0,
            terms: vec![TermValue { name: "cheap".into(), value: 4.0 }],
            controls: vec![torque],
            conditions: vec![
                condition("up", None, 1.0, Some(3e-4)),
                condition("stop", Some("hinge"), -2.5, None),
            ],
            turns_at_bound: Some(0),
            refinements: vec![own(10, 5.0), own(20, 4.25), own(40, 4.0625)],
            replay: Some(Replayed { deviation: 2.0, node: 3, by_steps: None }),
            starts: vec![start(1, 2, 4.0), start(3, 1, 6.0)],
            ..OptimumReport::default()
        }
    }

    fn finding(found: &OptimumReport, subject: &str) -> String {
        let facts = optimum_facts(found).into_iter().filter(|own| own.subject == subject);
        facts.map(|own| own.finding).collect::<Vec<_>>().join("; ")
    }

    #[test]
    fn an_optimum_is_told_by_what_is_known_of_it() {
        let own = found();
        for (subject, words) in [
            ("status", "a local optimum, 0 iterations, second-order sufficient"),
            ("bounds", "none active"),
            (
                "conditions",
                "all met to 2e-12; the largest price: `stop of hinge`, -2.5 for one more",
            ),
            ("half step", "its run misses `up` by 3.0e-4"),
            ("convergence", "cost 5, 4.25, 4.0625 at 10, 20, 40 steps: order 2.0, limit about 4"),
            ("start", "1: cost 4, a local optimum (2 starts); 3: cost 6, a local optimum"),
        ] {
            assert_eq!(finding(&own, subject), words, "{subject}");
        }
        let mut point = found();
        point.sufficient = Some(false);
        assert!(
            finding(&point, "status").starts_with("a stationary point, which may be no minimum")
        );
        assert!(finding(&point, "status").ends_with("try another `guess`, or `starts`"));
        let mut turned = found();
        (turned.status, turned.turns_at_bound) = (SearchStatus::TurnsBounded, Some(6));
        assert_eq!(finding(&turned, "bounds"), "turns of 1 rad in 6 steps");
        assert!(finding(&turned, "status").starts_with("an optimum among turns of at most 1 rad"));
    }

    #[test]
    fn a_search_that_did_not_end_is_no_optimum() {
        let mut own = found();
        own.status = SearchStatus::Stopped;
        own.refinements[1].comparable = false;
        own.conditions[1].violation = 0.25;
        assert_eq!(finding(&own, "conditions"), "missed by 2.5e-1 at most");
        assert!(finding(&own, "convergence").ends_with("are not all optima of the same problem"));
        assert!(finding(&own, "replay").starts_with("none"));
        // of an optimum with fewer steps that is kept the run is known
        own.replay = Some(Replayed { deviation: 1e-13, node: 3, by_steps: None });
        assert_eq!(finding(&own, "replay"), "the motion follows its controls to 1e-13");
    }
}
