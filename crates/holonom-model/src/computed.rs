//! Numbers that follow from those of a model file: masses of shapes, lengths, sections.

use super::problem::{MAX_PROBLEMS, Problem};
use super::source::HUGE;
use super::{Inertia, Model};
use toml::Value;

/// Numbers of a resolved model that its own file could not state again: too large, or rounded to nothing.
pub(super) fn out_of_range(model: &Model) -> Vec<Problem> {
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
    let Ok(Value::Table(sections)) = Value::try_from(model) else { return problems };
    for (section, value) in &sections {
        match value {
            Value::Array(list) => {
                for part in list {
                    let name = part.get("name").and_then(Value::as_str).unwrap_or_default();
                    visit(&format!("{section}.{name}"), part, &mut problems);
                }
            }
            other => visit(section, other, &mut problems),
        }
    }
    problems
}

fn visit(key: &str, value: &Value, problems: &mut Vec<Problem>) {
    match value {
        _ if problems.len() >= MAX_PROBLEMS => {}
        Value::Float(number) if number.is_nan() || number.abs() > HUGE => {
            let message = format!("the number that follows for it is too large: {number:e}");
            let help =
                format!("choose numbers from which one of magnitude at most {HUGE:e} follows");
            problems.push(Problem::new(key, message).help(help));
        }
        Value::Array(list) => {
            let of = list.iter().enumerate();
            of.for_each(|(i, value)| visit(&format!("{key}[{i}]"), value, problems));
        }
        Value::Table(table) => {
            table.iter().for_each(|(name, value)| visit(&format!("{key}.{name}"), value, problems));
        }
        _ => {}
    }
}
