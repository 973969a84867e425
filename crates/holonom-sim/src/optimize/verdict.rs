//! What a search has found, as a report with the model of its motion.

use super::found::{
    ConditionMet, ControlFound, FoundOptimum, Judged, OptimumReport, ProblemSize, Replayed,
    SearchStatus, StartFound, plain,
};
use super::halved;
use super::kept::{ProgramPoint, SearchEnd};
use super::node::take_times;
use super::searched::Searched;
use crate::design::refused;
use crate::gradient::TermValue;
use holonom_model::{
    Condition as Stated, ConditionKind, ConditionTime, Control, CountedAt, Formula, History,
    Interpolation, Joint, JointMotor, Law, Load, Model, ModelError, MotionPath, Outside,
    SensorKind, Table,
};
use vi_control::optimum::{Optimum, OptimumVerdict};
use vi_control::program::Outcome;
use vi_control::replay::Replay;
use vi_control::transcription::{Met, SolvedMotion};
use vi_multibody::Mechanism;

/// Violations up to this are rounding.
const MISSED: f64 = 1e-9;

/// The model of a motion with its controls as motors, laws of the time and loads, for an ordinary
/// run.
fn moved(model: &Model, motion: &SolvedMotion) -> Model {
    let mut own = model.clone();
    take_times(&mut own, motion);
    for (k, control) in model.controls.iter().enumerate() {
        let values = motion.controls.iter().map(|row| row[k]).collect();
        let history = History::Steps { values, step: Some(motion.step) };
        if let Some(load) = control.load() {
            own.loads.push(Load { history, ..load });
            continue;
        }
        let is_own = |joint: &&mut Joint| Some(&joint.name) == control.joint.as_ref();
        match own.joints.iter_mut().find(is_own) {
            Some(joint) if joint.motor.is_none() => {
                joint.motor = Some(JointMotor {
                    freedom: control.freedom,
                    effort: 1.0,
                    history,
                    proportional: 0.0,
                    derivative: 0.0,
                    path: MotionPath::default(),
                });
            }
            _ => effort_of_time(&mut own, control, k, motion),
        }
    }
    plain(&mut own);
    own
}

/// Adds an effort beside the motor of its joint: a law of the time by a table of steps.
fn effort_of_time(model: &mut Model, control: &Control, k: usize, motion: &SolvedMotion) {
    let (name, table) = (control.name.clone(), model.free_name(&format!("values_{k}")));
    // zero after the last, as a history is
    let all = motion.controls.iter().map(|row| row[k]).chain([0.0]);
    let points = all.enumerate().map(|(n, value)| [n as f64 * motion.step, value]).collect();
    let effort = Some(Formula(format!("{table}(t)")));
    let (joint, freedom) = (control.joint.clone(), control.freedom);
    model.laws.push(Law { name, joint, freedom, effort, ..Law::default() });
    let (interpolation, outside) = (Interpolation::Steps, Outside::Hold);
    model.tables.push(Table { name: table, points, interpolation, outside, ..Table::default() });
}

/// The conditions of sensors, in the order of those of a problem.
pub(super) fn with_sensors(model: &Model) -> impl Iterator<Item = &Stated> {
    model.conditions.iter().filter(|own| own.kind == ConditionKind::Sensor)
}

/// Whether a condition is on a distance: its value is half the square, its multiplier that of it.
pub(super) fn is_distance(model: &Model, own: &Stated) -> bool {
    let name = own.sensor.as_deref().unwrap_or_default();
    model.sensors.iter().any(|own| own.name == name && own.kind == SensorKind::Distance)
}

/// Refuses a start that does not meet a condition along the path; `value`: of its quantity.
pub(super) fn starts_outside(model: &Model, condition: usize, value: f64) -> ModelError {
    let Some(own) = with_sensors(model).nth(condition) else {
        return refused("condition", "a start outside of the bounds", "begin within them");
    };
    let value = if is_distance(model, own) { (2.0 * value).max(0.0).sqrt() } else { value };
    outside(own, value)
}

/// The same with what the sensor shows at the start.
pub(super) fn outside(own: &Stated, value: f64) -> ModelError {
    let sensor = own.sensor.as_deref().unwrap_or_default();
    let what = format!("a start outside of the bounds: `{sensor}` begins with {value}");
    let key = format!("condition.{}", own.name);
    refused(&key, what, "widen the bounds, or begin within them")
}

pub(super) fn status(found: &Optimum) -> SearchStatus {
    match found.verdict {
        OptimumVerdict::Optimal if !found.bounded_turns.is_empty() => SearchStatus::TurnsBounded,
        OptimumVerdict::Optimal => SearchStatus::Optimal,
        OptimumVerdict::Infeasible(_) => SearchStatus::Infeasible,
        OptimumVerdict::Stopped => SearchStatus::Stopped,
        OptimumVerdict::Unfinished(_) => SearchStatus::Unfinished,
        OptimumVerdict::NotOptimal => SearchStatus::NotOptimal,
        OptimumVerdict::OtherMotion => SearchStatus::OtherMotion,
        OptimumVerdict::TurnsTooFar { .. } => SearchStatus::TurnsTooFar,
    }
}

/// The names of the unknowns of a tree: of their joints, with the number of the freedom where there
/// are several.
pub(super) fn names_of_unknowns(mechanism: &Mechanism) -> Vec<String> {
    let tree = mechanism.tree();
    let name = |unknown: usize| match tree.owner(unknown) {
        Some(link) if link.dof() > 1 => format!("{}.{}", link.joint.name, unknown - link.offset),
        _ => mechanism.rate_name(unknown).to_owned(),
    };
    (0..tree.dof()).map(name).collect()
}

pub(super) fn report(model: &Model, searched: Searched) -> FoundOptimum {
    let Searched { found, rows, starts, refinements, unknowns } = searched;
    let motion = &found.motion;
    let steps = motion.controls.len();
    let term = |(own, value): (&holonom_model::Objective, &f64)| TermValue {
        name: own.name.clone(),
        value: *value,
    };
    let used = |(k, own): (usize, &holonom_model::Control)| {
        let values = motion.controls.iter().map(|row| row[k]);
        let size = values.clone().fold(0.0_f64, |most, value| most.max(value.abs()));
        let near = |value: f64, bound: f64| (value - bound).abs() <= 1e-6 * size.max(1e-300);
        let bounds = [own.min, own.max];
        let at_bound = |value: &f64| bounds.iter().flatten().any(|bound| near(*value, *bound));
        ControlFound {
            name: own.name.clone(),
            min: own.min,
            max: own.max,
            largest: size,
            at_bounds: values.filter(at_bound).count(),
        }
    };
    let met = |(k, own): (usize, &Stated)| {
        let is_distance = is_distance(model, own);
        let at = found.met.iter().filter(|met| met.condition == k);
        ConditionMet::of(own, at.map(|met| shown(met, is_distance)))
    };
    let prices = prices(model, &found);
    let mut of_sensors = with_sensors(model).enumerate().map(met);
    let mut conditions: Vec<ConditionMet> = Vec::new();
    for own in &model.conditions {
        if own.kind == ConditionKind::Rest {
            let resting = found.resting.iter();
            conditions.extend(resting.map(|at| {
                let joint = unknowns[at.unknown].clone();
                ConditionMet::of_rest(own, joint, (at.momentum, at.multiplier))
            }));
        } else {
            conditions.extend(of_sensors.next());
        }
    }
    let mut missed = match &found.verdict {
        OptimumVerdict::Infeasible(rows) => rows.clone(),
        OptimumVerdict::Unfinished(outcome) => {
            std::iter::once(unfinished(outcome)).chain(steep(&conditions, found.cost())).collect()
        }
        OptimumVerdict::NotOptimal => steep(&conditions, found.cost()).into_iter().collect(),
        OptimumVerdict::TurnsTooFar { step, turn } => {
            let part = if motion.within[*step].is_empty() { "" } else { "a part of " };
            vec![format!("{turn:.2} rad in {part}step {step}: take more steps")]
        }
        OptimumVerdict::OtherMotion => vec![other_motion(found.replay.as_ref())],
        OptimumVerdict::Optimal if !found.bounded_turns.is_empty() => {
            let count = found.bounded_turns.len();
            vec![format!(
                "a joint turns by 1 rad, as much as it may, in {count} of {steps} steps: take more steps"
            )]
        }
        _ => Vec::new(),
    };
    missed.extend(found.unreached.iter().map(|names| unreached(names)));
    if let Some(wanted) = found.wanted {
        let words = format!("this is with {wanted} steps; the optimum with {steps} is kept");
        missed.insert(0, words);
    }
    let time = motion.step * steps as f64;
    let moved = moved(model, motion);
    if status(&found).is_found() {
        halved::judge(model, &moved, &mut conditions);
    }
    let report = OptimumReport {
        model: model.header.name.clone(),
        status: status(&found),
        missed,
        problem: ProblemSize {
            unknowns: found.size.unknowns,
            values: found.size.values,
            equations: found.size.equations,
            inequalities: found.size.inequalities,
            coordinates: unknowns,
        },
        steps,
        step: motion.step,
        time,
        cost: found.cost(),
        terms: model.objectives.iter().zip(&motion.costs).map(term).collect(),
        controls: model.controls.iter().enumerate().map(used).collect(),
        conditions,
        iterations: found.iterations,
        sufficient: Some(found.is_sufficient()),
        turns_at_bound: Some(found.bounded_turns.len()),
        refinements,
        judged: Some(Judged {
            stationarity: found.kkt.stationarity,
            violation: found.kkt.violation,
            complementarity: found.kkt.complementarity,
        }),
        replay: found.replay.as_ref().map(|own| Replayed {
            deviation: own.deviation,
            node: own.node,
            by_steps: own.by_steps,
        }),
        starts: StartFound::several(starts),
        ..OptimumReport::default()
    };
    let controls = motion.controls.clone();
    let kept = SearchEnd { point: ProgramPoint::of(found.held), ..SearchEnd::default() };
    FoundOptimum {
        report,
        steps: rows,
        model: moved,
        costates: found.costates,
        prices,
        controls,
        kept,
    }
}

/// The conditions that are missed, by name, those that miss most first.
pub(super) fn missed(conditions: &[ConditionMet]) -> Vec<String> {
    let mut missed: Vec<&ConditionMet> =
        conditions.iter().filter(|own| own.violation > MISSED || own.violation.is_nan()).collect();
    missed.sort_by(|a, b| b.violation.total_cmp(&a.violation));
    let words = |own: &&ConditionMet| format!("`{}`: {:.1e}", own.label(), own.violation);
    missed.iter().take(5).map(words).collect()
}

/// What a sensor shows where a condition is met, and the multiplier by that.
fn shown(met: &Met, is_distance: bool) -> (f64, f64) {
    if !is_distance {
        return (met.value, met.multiplier);
    }
    let length = (2.0 * met.value).max(0.0).sqrt(); // of half a square
    (length, met.multiplier * length)
}

/// What bounds of controls and conditions along the path cost, at each node.
fn prices(model: &Model, found: &Optimum) -> Vec<(String, Vec<f64>)> {
    let count = found.motion.nodes.len();
    let mut prices = Vec::new();
    for (k, own) in model.controls.iter().enumerate() {
        if own.min.is_some() || own.max.is_some() {
            let mut column: Vec<f64> = found.bounds.iter().map(|row| 0.0 - row[k]).collect();
            column.push(f64::NAN);
            prices.push((format!("control.{}", own.name), column));
        }
    }
    for (k, own) in with_sensors(model).enumerate() {
        if own.at != ConditionTime::Word(CountedAt::Path) {
            continue;
        }
        let (mut column, is_distance) = (vec![f64::NAN; count], is_distance(model, own));
        for met in found.met.iter().filter(|met| met.condition == k) {
            column[met.node] = 0.0 - shown(met, is_distance).1;
        }
        prices.push((format!("condition.{}", own.name), column));
    }
    prices
}

/// How the run of the controls parts from the motion, in words.
fn other_motion(replay: Option<&Replay>) -> String {
    let Some(own) = replay else {
        return "there is no run of these controls: see what `holonom run` says of the model"
            .into();
    };
    let (node, deviation) = (own.node, own.deviation);
    if let Some(refused) = &own.refused {
        return format!("its run stops in step {node}: {refused}; take more steps");
    }
    let single = own.by_steps.map_or_else(String::new, |by| format!(", single steps by {by:.1e}"));
    format!(
        "its run is off by {deviation:.1e} (m, directors 1) at node {node}{single}: a step has \
         another solution there, as where it turns a body far: take more steps"
    )
}

/// Why a method has not finished, in words.
fn unfinished(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Exhausted => "`max_iterations` of [optimize] were made".to_owned(),
        Outcome::Failed(words) if words == "Not_Enough_Degrees_Of_Freedom" => {
            "conditions ask for more than the controls have values: take more steps, or ask for less"
                .to_owned()
        }
        Outcome::Failed(words) => format!("the method says {words}"),
        other => format!("the method says {other:?}"),
    }
}

/// Conditions that controls cannot meet at the guess, in words.
fn unreached(names: &[String]) -> String {
    let all = names.join(", ");
    let help = "begin elsewhere (`guess` of [optimize])";
    match names {
        [_] => format!(
            "no control changes {all} at the guess, to first order: {help}, or state another component"
        ),
        _ => format!(
            "{all} change together at the guess, whatever the controls, and are not met together: {help}, or ask for fewer"
        ),
    }
}

/// What is said where a method has not converged and prices have grown without bound: multipliers
/// `y` with `∇f + Jᵀy = 0` of that size state that rows of `J` depend on one another, to `1/|y|`.
fn steep(conditions: &[ConditionMet], cost: f64) -> Option<String> {
    const STEEP: f64 = 1e5; // times the cost for one unit
    let dearest = conditions.iter().max_by(|a, b| a.price.abs().total_cmp(&b.price.abs()))?;
    (dearest.price.abs() > STEEP * cost.abs()).then(|| {
        format!(
            "the price of `{}` grows without bound, {:.0e}: nothing changes it there, as a component at its largest value, \
             or it depends on other conditions; state other components",
            dearest.label(), dearest.price
        )
    })
}
