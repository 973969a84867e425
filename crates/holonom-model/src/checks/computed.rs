//! Numbers that follow from those of a model file: masses of shapes, lengths, sections.

use crate::text::key_path::below;
use crate::text::problem::{MAX_PROBLEMS, Problem};
use crate::text::source::HUGE;
use crate::{Inertia, Model};
use serde::Serialize;
use toml::Value;

/// Numbers of a resolved model that its own file could not state again: too large, or rounded to
/// nothing.
pub(crate) fn out_of_range(model: &Model) -> Vec<Problem> {
    let mut problems = too_large(model);
    for body in model.bodies.iter().filter(|b| b.shape.is_some() && b.inertia.is_some()) {
        let inertia = body.inertia.as_ref().and_then(Inertia::fault);
        let mass = (body.mass() <= 0.0).then(|| format!("its mass is {} kg", body.mass()));
        for (what, fault) in [("mass", mass), ("inertia", inertia)] {
            if let Some(fault) = fault.filter(|_| problems.len() < MAX_PROBLEMS) {
                let message = format!("the shape is too small or too light: {fault}");
                let key = format!("body.{}.{what}", body.name);
                problems
                    .push(Problem::new(key, message).help("write larger dimensions or density"));
            }
        }
    }
    problems
}

fn too_large(model: &Model) -> Vec<Problem> {
    let mut problems = Vec::new();
    list("bar", &model.bars, &mut problems);
    list("beam", &model.beams, &mut problems);
    list("body", &model.bodies, &mut problems);
    list("bushing", &model.bushings, &mut problems);
    list("constraint", &model.constraints, &mut problems);
    list("contact", &model.contacts, &mut problems);
    list("control", &model.controls, &mut problems);
    list("event", &model.events, &mut problems);
    list("joint", &model.joints, &mut problems);
    list("law", &model.laws, &mut problems);
    list("load", &model.loads, &mut problems);
    part("model", &model.header, &mut problems);
    list("particle", &model.particles, &mut problems);
    list("sensor", &model.sensors, &mut problems);
    list("signal", &model.signals, &mut problems);
    part("simulation", &model.settings, &mut problems);
    list("spring", &model.springs, &mut problems);
    list("table", &model.tables, &mut problems);
    problems
}

fn list(section: &str, parts: &[impl Serialize], problems: &mut Vec<Problem>) {
    parts.iter().for_each(|own| part(section, own, problems));
}

/// A part of a list has its name in the key.
fn part(section: &str, part: &impl Serialize, problems: &mut Vec<Problem>) {
    let Ok(value) = Value::try_from(part) else { return };
    if !has_too_large(&value) {
        return; // no path is written for nothing
    }
    let name = value.get("name").and_then(Value::as_str).filter(|_| section != "model");
    let mut key = name.map_or_else(|| section.to_owned(), |name| format!("{section}.{name}"));
    visit(&mut key, &value, problems);
}

fn is_too_large(number: f64) -> bool {
    number.is_nan() || number.abs() > HUGE
}

fn has_too_large(value: &Value) -> bool {
    match value {
        Value::Float(number) => is_too_large(*number),
        Value::Array(list) => list.iter().any(has_too_large),
        Value::Table(table) => table.values().any(has_too_large),
        _ => false,
    }
}

fn visit(key: &mut String, value: &Value, problems: &mut Vec<Problem>) {
    match value {
        _ if problems.len() >= MAX_PROBLEMS => {}
        Value::Float(number) if is_too_large(*number) => {
            let message = format!("the number that follows for it is too large: {number:e}");
            let help =
                format!("choose numbers from which one of magnitude at most {HUGE:e} follows");
            problems.push(Problem::new(&**key, message).help(help));
        }
        Value::Array(list) => {
            for (i, value) in list.iter().enumerate() {
                below(key, format_args!("[{i}]"), |key| visit(key, value, problems));
            }
        }
        Value::Table(table) => {
            for (name, value) in table {
                below(key, format_args!(".{name}"), |key| visit(key, value, problems));
            }
        }
        _ => {}
    }
}
