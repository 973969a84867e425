//! `holonom identify`: unknown numbers of a model from measurements.

use std::fmt::Write;

use holonom::identification::{
    DataError, IdentificationWatch, Identified, IdentifiedModel, IdentifyError, MeasuredColumn,
    data, identify as find,
};
use holonom::model::{ModelText, read_regular_text};
use holonom::report::{estimate_page, rounded};
use holonom::run::run_with;
use holonom::simulation::Simulation;
use holonom::{Model, RunFolder};

use crate::arguments::IdentifyArguments;
use crate::failure::Failure;
use crate::gradient::warn_of_tolerance;
use crate::input::ModelInput;
use crate::reproduce::command;
use crate::run::{conduct, keep_the_model, warn_of_assembly};
use crate::signals::ReceivedSignals;
use crate::{progress, stderr, stdout};

/// The largest file of data, bytes.
const LARGEST: u64 = 256 * 1024 * 1024;

/// Files beside those of a run.
const ESTIMATE: &str = "estimate.json";
const ROWS: &str = "estimate.csv";
const PAGE: &str = "estimate.html";

pub(crate) fn identify(arguments: &IdentifyArguments) -> Result<(), Failure> {
    let talk = &arguments.talk;
    let text = read_regular_text(&arguments.data, LARGEST).map_err(|error| DataError {
        message: format!("{}: {error}", arguments.data.display()),
        help: "name a file of comma-separated values".to_owned(),
    })?;
    let model = &arguments.model.model;
    let folder =
        arguments.output.clone().unwrap_or_else(|| RunFolder::default_for(model, "estimate"));
    keep_the_model(model, &folder.join("model.toml"))?;
    keep_the_model(&arguments.data, &folder.join(ROWS))?;
    let input = ModelInput::new(&arguments.model, arguments.model.set.clone(), talk.json);
    let mut failed = None;
    RunFolder::vacant(&folder, &["summary.json", ESTIMATE, ROWS], arguments.force)?;
    let signals = ReceivedSignals::watch();
    let make = |model: &Model| match estimate(arguments, input.text(), model, &text, &signals) {
        Ok(found) => {
            let simulation = Simulation::with_outside(&found.model, &found.start)?;
            Ok(Some((found, simulation)))
        }
        Err(IdentifyError::Model(error)) => Err(error),
        Err(error) => {
            failed = Some(error);
            Ok(None)
        }
    };
    let (_, found) = input.assemble_as(make)?;
    let Some((found, mut simulation)) = found else {
        return Err(failed.map_or(Failure::Closed, |error| failure(error, &signals)));
    };
    let IdentifiedModel { estimate, .. } = &found;
    if !talk.quiet {
        warn_of_tolerance(&found.model);
        for warning in estimate.warnings() {
            stderr::line(&format!("warning: {warning}"));
        }
    }
    RunFolder::takes_meshes(&folder, &found.model.meshes)?;
    let folder = RunFolder::create(folder, arguments.force)?;
    write(&folder, &found)?;
    if talk.json {
        stdout::json(&serde_json::to_value(estimate).unwrap_or_default())?;
    } else if !talk.quiet {
        stdout::bytes(stderr::visible(&table(estimate)).as_bytes())?;
    }
    if let Some(signal) = signals.caught().filter(|_| found.interrupted) {
        return Err(Failure::FitInterrupted { signal, file: folder.path().join(ESTIMATE) });
    }
    warn_of_assembly(&simulation, talk);
    let talk = crate::arguments::Talk { json: false, ..*talk };
    conduct(&mut simulation, folder.path(), None, &talk, |simulation, control| {
        Ok(run_with(&found.model, simulation, &folder, control)?)
    })?;
    match found.estimate.is_sound() {
        true => Ok(()),
        false => {
            let (message, warned) = (unsound(&found.estimate), !talk.quiet);
            Err(Failure::Estimate { message, warned })
        }
    }
}

/// The estimate from the text of the data.
fn estimate(
    arguments: &IdentifyArguments,
    file: &ModelText,
    model: &Model,
    text: &str,
    signals: &ReceivedSignals,
) -> Result<IdentifiedModel, IdentifyError> {
    let columns: Vec<MeasuredColumn> = match model.identify {
        Some(_) => data::read(&arguments.data.display().to_string(), text, model)?,
        None => Vec::new(), // refused below
    };
    let talk = &arguments.talk;
    let bar = progress::bar(!talk.no_progress && !talk.quiet, "{spinner} run {pos}");
    let mut run = |number: usize| bar.set_position(number as u64);
    let mut interrupted = || signals.caught().is_some();
    let mut watch = IdentificationWatch { run: &mut run, interrupted: &mut interrupted };
    let found = find(file, &arguments.model.set, model, &columns, &mut watch);
    bar.finish_and_clear();
    found
}

/// What there is instead of an estimate.
fn failure(error: IdentifyError, signals: &ReceivedSignals) -> Failure {
    match error {
        IdentifyError::Data(error) => error.into(),
        IdentifyError::Interrupted => {
            Failure::FitInterrupted { signal: signals.caught().unwrap_or(2), file: "".into() }
        }
        error => {
            let remedy =
                "`holonom run` with `--set parameters.NAME=START` shows what happens there";
            Failure::before_a_step(error.to_string(), remedy)
        }
    }
}

/// Why an estimate is none.
fn unsound(estimate: &Identified) -> String {
    match estimate.unseen.first() {
        Some(own) => format!("the data do not see {}", own.words()),
        None => format!("the method has not converged: it is {}", estimate.outcome),
    }
}

/// Writes the estimate, and measured beside computed values.
fn write(folder: &RunFolder, found: &IdentifiedModel) -> Result<(), Failure> {
    let json = format!("{:#}\n", serde_json::to_value(&found.estimate).unwrap_or_default());
    folder.write(ESTIMATE, &json)?;
    folder.write(ROWS, &found.csv())?;
    folder.write(PAGE, &estimate_page(found, &command()))?;
    Ok(())
}

/// Estimates with their standard errors, correlations, columns.
pub(crate) fn table(found: &Identified) -> String {
    let (values, runs) = (found.values, found.runs);
    let mut text = format!(
        "{}: {} from {values} measured values; {} after {} iterations, {runs} runs\n",
        found.model,
        match found.parameters.len() {
            1 => "1 unknown number".to_owned(),
            count => format!("{count} unknown numbers"),
        },
        found.outcome,
        found.iterations
    );
    let width = found.parameters.iter().map(|own| own.name.chars().count()).max().unwrap_or(0);
    let width = width.max("unknown number".len());
    let _ = writeln!(
        text,
        "  {:width$} {:>17} {:>12} {:>14}",
        "unknown number", "estimate", "±", "start"
    );
    for own in &found.parameters {
        let error = own.standard_error.map_or_else(
            || if own.at_bound { "at a bound".to_owned() } else { "unknown".to_owned() },
            |error| rounded(error, 3).to_string(),
        );
        let (value, start) = (rounded(own.value, 9).to_string(), rounded(own.start, 6).to_string());
        let _ = writeln!(text, "  {:width$} {value:>17} {error:>12} {start:>14}", own.name);
    }
    for (i, row) in found.correlation.iter().flatten().enumerate() {
        for (j, own) in row.iter().enumerate().take(i).filter(|(_, own)| own.abs() >= 0.9) {
            let [a, b] = [j, i].map(|k| &found.parameters[k].name);
            let _ = writeln!(text, "  correlation of `{a}` and `{b}` {}", rounded(*own, 4));
        }
    }
    let chi = rounded(found.chi_square_per_freedom, 4);
    let _ = writeln!(text, "  chi-square per degree of freedom {chi}");
    let width =
        found.columns.iter().map(|own| own.column.chars().count()).max().unwrap_or(0).max(6);
    let _ = writeln!(
        text,
        "  {:width$} {:>8} {:>12} {:>12} {:>12}",
        "column", "values", "rms", "sigma", "runs test"
    );
    for own in &found.columns {
        let runs = own.probability_of_runs.map_or("-".to_owned(), |p| rounded(p, 3).to_string());
        let (rms, sigma) = (rounded(own.rms, 4).to_string(), rounded(own.sigma, 4).to_string());
        let (name, values) = (&own.column, own.values);
        let _ = writeln!(text, "  {name:width$} {values:>8} {rms:>12} {sigma:>12} {runs:>12}");
    }
    text
}
