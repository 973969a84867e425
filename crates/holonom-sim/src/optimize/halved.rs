//! Conditions as a run of half the step has them: the same controls, and nodes between the nodes.
//!
//! Along the path a condition that holds at nodes may be missed by `O(h²)` between them, and the
//! end of a run of half the step is that of other equations.

use super::found::ConditionMet;
use crate::shown::{named, number_of};
use crate::simulation::Simulation;
use holonom_model::{Condition, ConditionKind, ConditionTime, CountedAt, HighOrder, Model};

/// Adds to the conditions of an optimum how far the run of half the step misses them; `found`: the
/// model of its motion. Left out where there is no such run: of compositions, whose sub-steps leave
/// the time of a value, and where a step is refused.
pub(super) fn judge(model: &Model, found: &Model, conditions: &mut [ConditionMet]) {
    let is_divided = found.settings.order > 2 && found.settings.method == HighOrder::Composition;
    if !is_divided
        && let Some(rows) = halved(found)
        && let Some(all) = missed(model, found, &rows)
    {
        for (name, by) in all {
            let of = |own: &&mut ConditionMet| own.of.is_none() && own.name == name;
            if let Some(own) = conditions.iter_mut().find(of) {
                own.halved = Some(by);
            }
        }
    }
}

/// What the sensors show at the nodes of the run of half the step.
fn halved(found: &Model) -> Option<Vec<Vec<f64>>> {
    let mut model = found.clone();
    model.settings.step *= 0.5;
    let mut simulation = Simulation::new(&model).ok()?;
    let mut rows = vec![simulation.sense().ok()?.to_vec()];
    for _ in 0..model.settings.steps() {
        simulation.step_on().ok()?;
        rows.push(simulation.sense().ok()?.to_vec());
    }
    Some(rows)
}

/// How far each condition on a sensor is missed by these rows.
fn missed(model: &Model, found: &Model, rows: &[Vec<f64>]) -> Option<Vec<(String, f64)>> {
    let simulation = Simulation::new(found).ok()?;
    let columns = simulation.sensors().columns();
    let last = rows.len() - 1;
    let place = |own: &Condition| {
        let of = named(model, "condition", own.sensor.as_deref()?).ok()?;
        let number = number_of(model, "condition", of).ok()?;
        Some(columns.iter().position(|column| column.sensor == of.0.name)? + number)
    };
    let missed = |own: &Condition| {
        let (at, [min, max]) = (place(own)?, own.bounds());
        let nodes = match own.at {
            ConditionTime::Word(CountedAt::Path) => 0..rows.len(),
            ConditionTime::Word(CountedAt::End) => last..rows.len(),
            ConditionTime::Time(t) => {
                let steps = (2.0 * t / found.settings.step).round();
                let node = (0..=last).find(|n| *n as f64 >= steps)?;
                node..node + 1
            }
        };
        let beyond = |row: &Vec<f64>| (min - row[at]).max(row[at] - max);
        let by = rows[nodes].iter().map(beyond).fold(0.0, f64::max);
        Some((own.name.clone(), by))
    };
    let sensors = model.conditions.iter().filter(|own| own.kind == ConditionKind::Sensor);
    sensors.map(missed).collect()
}
