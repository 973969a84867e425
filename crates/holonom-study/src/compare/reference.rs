//! The trajectory that all schemes are held against.
//!
//! The nodal variational scheme (the constrained one where that has no map) at the highest order
//! and with the smallest step that the time allows; it is known to its distance from the same with
//! twice the step.

use super::record::ReferenceTrajectory;
use super::{ComparisonPlan, distance};
use crate::clock::timed;
use holonom_model::{Model, Scheme};
use holonom_sim::simulation::Simulation;

/// Orders that are tried, with the refinement of the smallest step of the comparison.
const TRIED: [(u32, u64); 5] = [(8, 1), (6, 1), (4, 1), (2, 16), (2, 4)];

/// Configurations at the nodes of the plan.
pub(super) type NodeConfigurations = Vec<Vec<f64>>;

/// The best reference that can be had.
pub(super) fn reference(
    model: &Model,
    plan: &ComparisonPlan,
) -> (ReferenceTrajectory, Option<NodeConfigurations>) {
    let mut reasons = Vec::new();
    for scheme in [Scheme::Nodal, Scheme::Constrained] {
        for (order, refinement) in TRIED {
            let parts = 2 * (refinement * plan.finest()).div_ceil(2);
            let model = plan.with(model, scheme, order, parts);
            let cost = match cost(&model) {
                Ok(cost) => cost,
                Err(reason) => {
                    reasons.push(reason);
                    continue;
                }
            };
            if cost * (parts * plan.steps) as f64 > 6.0 * plan.effort {
                reasons.push(format!("order {order} would take too long"));
                continue;
            }
            let coarse = plan.with(&model, scheme, order, parts / 2);
            match (nodes(&model, parts, plan.steps), nodes(&coarse, parts / 2, plan.steps)) {
                (Ok(fine), Ok(coarse)) => {
                    let apart = fine.iter().zip(&coarse).map(|(a, b)| distance(a, b));
                    let known_to = Some(apart.fold(0.0, super::larger));
                    let name = scheme.name();
                    let description = format!("{name}, order {order}, step/{parts}");
                    return (ReferenceTrajectory { description, known_to }, Some(fine));
                }
                (Err(reason), _) | (_, Err(reason)) => reasons.push(reason),
            }
        }
    }
    let reason = reasons.first().map_or("", String::as_str);
    let description = format!("none, no smaller step runs to the end: {reason}");
    (ReferenceTrajectory { description, known_to: None }, None)
}

/// Seconds that the reference takes, about.
pub(super) fn seconds(model: &Model, plan: &ComparisonPlan) -> f64 {
    let tried = [Scheme::Nodal, Scheme::Constrained].into_iter().flat_map(|scheme| {
        TRIED.map(|(order, refinement)| {
            (scheme, order, 2 * (refinement * plan.finest()).div_ceil(2))
        })
    });
    let mut expected = tried.filter_map(|(scheme, order, parts)| {
        let cost = cost(&plan.with(model, scheme, order, parts)).ok()?;
        Some(cost * (parts * plan.steps) as f64)
    });
    let within = |seconds: &f64| *seconds <= 6.0 * plan.effort;
    expected.find(within).map_or(0.0, |seconds| 1.5 * seconds)
}

/// Seconds of a step.
fn cost(model: &Model) -> Result<f64, String> {
    let mut run = Simulation::new(model).map_err(|e| e.to_string())?;
    run.step().map_err(|e| e.to_string())?;
    let (seconds, taken) = timed(|| (0..3).try_for_each(|_| run.step().map(|_| ())));
    taken.map_err(|e| e.to_string())?;
    Ok(seconds / 3.0)
}

/// The nodes of `steps` steps that are made in `parts` pieces each.
fn nodes(model: &Model, parts: u64, steps: u64) -> Result<NodeConfigurations, String> {
    let mut run = Simulation::new(model).map_err(|e| e.to_string())?;
    let mut nodes = vec![run.configuration().to_vec()];
    for _ in 0..steps {
        for _ in 0..parts {
            run.step().map_err(|e| e.to_string())?;
        }
        nodes.push(run.configuration().to_vec());
    }
    Ok(nodes)
}
