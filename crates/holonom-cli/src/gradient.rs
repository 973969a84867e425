//! `holonom gradient`: derivatives of the objectives by parameters, controls and initial values.

use std::fmt::Write;

use holonom::RunFolder;
use holonom::gradient::{GradientFailure, ModelGradient, Wanted, gradient as find, inexact};
use holonom::report::rounded;

use crate::arguments::{By, GradientArguments};
use crate::failure::Failure;
use crate::input::ModelInput;
use crate::{stderr, stdout};

/// The file of a gradient.
const FILE: &str = "gradient.json";
/// Largest deviation of a comparison with differences.
const CLOSE: f64 = 1e-6;
/// Derivatives of a control that are printed.
const SHOWN: usize = 4;

pub(crate) fn gradient(arguments: &GradientArguments) -> Result<(), Failure> {
    let chosen = |kind: By| arguments.by.is_empty() || arguments.by.contains(&kind);
    let wanted = Wanted {
        of: arguments.of.clone(),
        parameters: chosen(By::Parameters),
        only: arguments.parameters.clone(),
        controls: chosen(By::Controls),
        initial: chosen(By::Initial),
        step: arguments.by.contains(&By::Step),
        ..Wanted::everything()
    };
    if let Some(folder) = &arguments.output {
        RunFolder::vacant(folder, &[FILE], arguments.force)?;
    }
    let overrides = &arguments.model.set;
    let input = ModelInput::new(&arguments.model, overrides.clone(), arguments.json);
    let mut failed = None;
    let make = |model: &holonom::Model| {
        let found = find(input.text(), overrides, model, &wanted).and_then(|mut found| {
            if arguments.check {
                found.check(input.text(), overrides, model, &wanted)?;
            }
            Ok(found)
        });
        match found {
            Ok(found) => Ok(Some(found)),
            Err(GradientFailure::Model(error)) => Err(error),
            Err(error) => {
                failed = Some(error);
                Ok(None)
            }
        }
    };
    let (model, found) = input.assemble_as(make)?;
    let Some(found) = found else { return Err(failure(failed)) };
    warn_of_tolerance(&model);
    missing(arguments, &found).for_each(|what| stderr::line(&format!("warning: {what}")));
    if let Some(warning) = found.warning() {
        stderr::line(&format!("warning: {warning}"));
    }
    if let Some(folder) = &arguments.output {
        let json = format!("{:#}\n", serde_json::to_value(&found).unwrap_or_default());
        RunFolder::open(folder).write(FILE, &json)?;
        if !arguments.quiet {
            stderr::line(&format!("written to {}: {FILE}", folder.display()));
        }
    }
    if arguments.json {
        stdout::json(&serde_json::to_value(&found).unwrap_or_default())?;
    } else if !arguments.quiet {
        stdout::bytes(stderr::visible(&table(&found)).as_bytes())?;
    }
    let worst = found.worst();
    if worst > CLOSE || worst.is_nan() {
        return Err(Failure::Property(format!(
            "a derivative and its differences are apart by {worst:.1e}, more than {CLOSE:e}"
        )));
    }
    Ok(())
}

/// Says that derivatives are not those of the motion that the model asks for.
pub(crate) fn warn_of_tolerance(model: &holonom::Model) {
    if let Some(warning) = inexact(model) {
        stderr::line(&format!("warning: {warning}"));
    }
}

/// By what derivatives were asked for that the model does not have.
fn missing(
    arguments: &GradientArguments,
    found: &ModelGradient,
) -> impl Iterator<Item = &'static str> {
    let kinds = [
        (By::Parameters, found.parameters.is_empty(), "the model has no [parameters] that count"),
        (By::Controls, found.controls.is_empty(), "the model has no [[control]]"),
        (By::Initial, found.initial.is_empty(), "nothing in the model begins freely"),
    ];
    kinds.into_iter().filter(|(by, none, _)| *none && arguments.by.contains(by)).map(|own| own.2)
}

/// What there is instead of a gradient.
fn failure(error: Option<GradientFailure>) -> Failure {
    let message = error.map_or_else(|| "no gradient was found".into(), |error| error.to_string());
    Failure::before_a_step(message, "`holonom run` shows whether the motion reaches its end")
}

/// The derivatives, kind by kind.
pub(crate) fn table(found: &ModelGradient) -> String {
    let steps = found.steps;
    let of = match &found.equilibrium {
        Some(own) => format!("at the equilibrium at t = {}", rounded(own.t, 9)),
        None => format!("over {steps} steps of {} s", rounded(found.step, 9)),
    };
    let mut text = format!("{}: gradient {of}\n", found.model);
    let number = |x: f64| format!("{:>17}", rounded(x, 10));
    let _ = writeln!(text, "  {:30} {}", "objective", number(found.value));
    for term in found.terms.iter().filter(|_| found.terms.len() > 1) {
        let _ = writeln!(text, "    {:28} {}", term.name, number(term.value));
    }
    if !found.parameters.is_empty() {
        let _ = writeln!(text, "  {:30} {:>17} {:>17}", "parameter", "value", "derivative");
    }
    for own in &found.parameters {
        let (value, derivative) = (number(own.value), number(own.derivative));
        let _ = writeln!(text, "    {:28} {value} {derivative}", own.name);
    }
    if !found.initial.is_empty() {
        let _ = writeln!(text, "  {:30} {:>17} {:>17}", "start of", "by coordinate", "by rate");
    }
    for own in &found.initial {
        let name = format!("{}.{}", own.name, own.freedom);
        let rate = own.rate.map_or_else(|| format!("{:>17}", "follows"), number);
        let coordinate = number(own.coordinate);
        let _ = writeln!(text, "    {name:28} {coordinate} {rate}");
    }
    if !found.controls.is_empty() {
        let _ = writeln!(text, "  {:30} {:>17}", "control", "by its values");
    }
    for own in &found.controls {
        let first = own.derivatives.iter().take(SHOWN).map(|x| rounded(*x, 6).to_string());
        let more = own.derivatives.len().saturating_sub(SHOWN);
        let rest = if more > 0 { format!(", … ({more} more)") } else { String::new() };
        let list = first.collect::<Vec<_>>().join(", ");
        let _ = writeln!(text, "    {:28} {list}{rest}", own.name);
    }
    if let Some(own) = found.by_step {
        let _ = writeln!(text, "  {:30} {}", "step", number(own));
    }
    if !found.checks.is_empty() {
        let _ = writeln!(
            text,
            "  {:30} {:>17} {:>17} {:>9}",
            "random direction", "derivative", "differences", "apart"
        );
    }
    for own in &found.checks {
        let name = format!("{} {}", own.by, own.direction);
        let (derivative, difference) = (number(own.derivative), number(own.difference));
        let apart = match own.resolved {
            true => format!("{:>9.0e}", own.relative),
            false => "not resolved".to_owned(),
        };
        let _ = writeln!(text, "    {name:28} {derivative} {difference} {apart}");
    }
    text
}
