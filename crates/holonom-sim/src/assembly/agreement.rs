//! Constraints of a model that contradict each other, as errors that name them.

use super::loops;
use crate::system;
use holonom_model::{Model, ModelError, Problem};
use vi_constraints::Constraints;
use vi_constraints::agreement::Contradiction;
use vi_constraints::saddle_point::IndependentRows;
use vi_multibody::mechanism::Mechanism;
use vi_multibody::prescribed::path_conflict;

/// Members that are named at most.
const NAMED: usize = 4;

/// The contradiction of initial values as an error of the model.
pub(crate) fn refusal(found: &Contradiction, model: &Model) -> ModelError {
    match system::build(model) {
        Ok(system) => at_start(found, &system.mechanism, model.settings.loop_tolerance),
        Err(error) => error,
    }
}

fn at_start(found: &Contradiction, mechanism: &Mechanism, tolerance: f64) -> ModelError {
    let (names, motion) = members(mechanism, &found.rows);
    let level = found.level;
    if let Some(why) = loops::locks(mechanism, tolerance) {
        let message = format!("{}: {why}", together(&names));
        return problem(&names, message, "correct the axis, or raise `simulation.loop_tolerance`");
    }
    if motion {
        let message = format!("{}: no initial {level} satisfies them", together(&names));
        return problem(&names, message, AGREE);
    }
    let message = format!(
        "{}: no branch of the motion has the initial velocities, no {level} satisfies the \
         constraints with them (a chain that is fully stretched, or a velocity across a dead centre)",
        together(&names)
    );
    let help = "start without these velocities from a configuration that can move, or correct the \
                velocities";
    problem(&names, message, help)
}

const AGREE: &str = "remove one of them, or write paths that agree at all times";

/// Prescribed motions that contradict each other, or the constraints that lock a joint, up to `end`
/// (s).
///
/// # Errors
/// [`ModelError::Assembly`] with the names of both.
pub(crate) fn paths(
    mechanism: &Mechanism,
    rows: &IndependentRows,
    q: &[f64],
    end: f64,
) -> Result<(), ModelError> {
    if !mechanism.is_rheonomic() {
        return Ok(());
    }
    // 400 times that no frequency of a path shares: multiples of the golden ratio
    let times: Vec<f64> =
        (0..400).map(|k| end * (0.618_033_988_749_894_9 * f64::from(k)).fract()).collect();
    let Some(found) = path_conflict(mechanism, rows, q, &times) else { return Ok(()) };
    let (names, _) = members(mechanism, &found.rows);
    let t = found.t;
    if found.locked {
        let why = loops::locks(mechanism, mechanism.loop_tolerance());
        let why = why.map_or_else(String::new, |why| format!("; {why}"));
        let message = format!(
            "{}: the motion moves a joint that other constraints lock (at t = {t:.3} s){why}",
            together(&names)
        );
        return Err(problem(&names, message, "remove the motion, or what locks its joint"));
    }
    let message = format!("{}: their paths disagree (at t = {t:.3} s)", together(&names));
    Err(problem(&names, message, AGREE))
}

fn problem(keys: &[String], message: String, help: &str) -> ModelError {
    let key = keys.first().cloned().unwrap_or_default();
    ModelError::Assembly(vec![Problem::new(key, message).help(help)])
}

/// "`a` and `b` contradict each other".
fn together(keys: &[String]) -> String {
    format!("{} contradict each other", names(keys))
}

/// "`a` and `b`".
fn names(keys: &[String]) -> String {
    let name = |key: &String| {
        let name = key.split_once('.').map_or(key.as_str(), |(_, name)| name);
        format!("`{name}`")
    };
    let names: Vec<String> = keys.iter().take(NAMED).map(name).collect();
    let more = if keys.len() > NAMED { ", …" } else { "" };
    names.join(" and ") + more
}

/// The members of constraint rows by name, prescribed motions first.
pub(crate) fn named(mechanism: &Mechanism, rows: &[usize]) -> String {
    names(&members(mechanism, rows).0)
}

/// The members of constraint rows, prescribed motions first, and whether there is one.
fn members(mechanism: &Mechanism, rows: &[usize]) -> (Vec<String>, bool) {
    let first = mechanism.len() - mechanism.rows().len();
    let moves = |row: &usize| *row >= first && mechanism.rows()[row - first].is_rheonomic();
    let (motions, others): (Vec<usize>, Vec<usize>) = rows.iter().copied().partition(|r| moves(r));
    let mut keys: Vec<String> = Vec::new();
    for row in motions.iter().chain(others.iter().filter(|row| **row >= first)) {
        let key = constraint_key(mechanism, *row);
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    (keys, !motions.is_empty())
}

/// The key of the member that constraint `row` belongs to.
pub(crate) fn constraint_key(mechanism: &Mechanism, row: usize) -> String {
    let name = mechanism.constraint_name(row);
    let description = mechanism.description();
    let own = |count: usize, rows: &dyn Fn(usize) -> std::ops::Range<usize>| {
        (0..count).any(|k| rows(k).contains(&row))
    };
    if description.bodies.iter().any(|body| body.name == name) {
        return format!("body.{name}");
    }
    if own(description.joints.len(), &|k| mechanism.joint_rows(k)) {
        return joint_key(name);
    }
    let bar = own(description.bars.len(), &|k| mechanism.bar_rows(k));
    format!("{}.{name}", if bar { "bar" } else { "constraint" })
}

/// The key of a joint; what holds `BEAM.start` is a key of the beam.
pub(crate) fn joint_key(name: &str) -> String {
    let section = if name.contains('.') { "beam" } else { "joint" };
    format!("{section}.{name}")
}
