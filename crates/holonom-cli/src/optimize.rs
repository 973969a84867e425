//! `holonom optimize`: parameters or controls of least cost that meet the conditions.

use std::cell::RefCell;
use std::fmt::Write;
use std::rc::Rc;

use holonom::optimize::{
    Found, OptimizeFailure, OptimumReport, Progress, Status, Watch, optimize_by_own_method,
};
use holonom::report::{optimum_counts, optimum_facts, optimum_page, rounded, scene_of_run};
use holonom::run::{Control, prepare, run_with};
use holonom::{Model, RunFolder};

use crate::arguments::OptimizeArguments;
use crate::failure::Failure;
use crate::gradient::warn_of_tolerance;
use crate::input::{Input, text_of};
use crate::reproduce::command;
use crate::run::keep_the_model;
use crate::signals::Signals;
use crate::{progress, stderr, stdout};

/// The files of an optimum beside those of its run.
const FILES: [&str; 5] =
    ["optimum.json", "optimum.html", "iterations.csv", "controls.csv", "costates.csv"];
/// Files that show that a run is there.
const OF_RUN: [&str; 3] = ["model.toml", "summary.json", "trajectory.csv"];

pub(crate) fn optimize(arguments: &OptimizeArguments) -> Result<(), Failure> {
    let path = &arguments.model.model;
    let place = arguments.output.clone();
    let place = place.unwrap_or_else(|| RunFolder::default_for(path, "optimum"));
    keep_the_model(path, &place.join("model.toml"))?;
    RunFolder::vacant(&place, &FILES, arguments.force)?;
    RunFolder::vacant(&place, &OF_RUN, arguments.force)?;
    let signals = Rc::new(Signals::watch());
    let talk = &arguments.talk;
    let visible = !talk.no_progress && !talk.quiet;
    let bar = progress::bar(visible, "{spinner} iteration {pos}, {msg}");
    let (shown, heard) = (bar.clone(), signals.clone());
    let watch: Watch = Rc::new(RefCell::new(move |at: &Progress| {
        shown.set_position(at.iteration as u64);
        shown.set_message(format!(
            "cost {}, violation {:.1e}",
            rounded(at.cost, 8),
            at.infeasibility
        ));
        heard.caught().is_none()
    }));
    let overrides = arguments.model.set.clone();
    let text = text_of(path);
    let mut failed = None;
    let make = |model: &Model| match optimize_by_own_method(&text, &overrides, model, &watch) {
        Ok(found) => Ok(Some(found)),
        Err(OptimizeFailure::Model(error)) => Err(error),
        Err(error) => {
            failed = Some(error);
            Ok(None)
        }
    };
    let input = Input::new(&arguments.model, overrides.clone(), talk.json);
    let (model, found) = input.assemble_as(make)?;
    bar.finish_and_clear();
    let Some(found) = found else { return Err(failure(failed)) };
    if !talk.quiet {
        warn_of_tolerance(&model);
    }
    let (folder, files) = written((&model, &found), &place, arguments.force)?;
    if talk.json {
        stdout::json(&serde_json::to_value(&found.report).unwrap_or_default())?;
    } else if !talk.quiet {
        let text =
            table(&found.report) + &format!("  {:13} {}: {files}\n", "written", place.display());
        stdout::bytes(stderr::visible(&text).as_bytes())?;
    }
    drop(folder);
    match (found.report.status, signals.caught()) {
        (Status::Optimal, _) => Ok(()),
        (Status::Stopped, signal) => {
            Err(Failure::SearchInterrupted { signal: signal.unwrap_or(2), folder: place })
        }
        (status, _) => {
            let missed = found.report.missed.join("; ");
            let missed = if missed.is_empty() { String::new() } else { format!(" ({missed})") };
            Err(Failure::NoOptimum(format!("no optimum: {}{missed}", status.words())))
        }
    }
}

/// Runs the model of an optimum, and writes all files.
fn written(
    (model, found): (&Model, &Found),
    place: &std::path::Path,
    force: bool,
) -> Result<(RunFolder, String), Failure> {
    let folder = RunFolder::create(place, force)?;
    let [of_numbers, page, iterations, controls, costates] = FILES;
    let mut files = vec![of_numbers, page, iterations];
    let json = format!("{:#}\n", serde_json::to_value(&found.report).unwrap_or_default());
    folder.write(of_numbers, &json)?;
    folder.write(iterations, &found.iterations())?;
    if !found.controls.is_empty() {
        folder.write(controls, &found.controls())?;
        folder.write(costates, &found.costates())?;
        files.extend([controls, costates]);
    }
    let mut simulation = prepare(&found.model).map_err(|error| {
        let remedy = "the model of the optimum is not valid: tell its developers";
        Failure::before_a_step(error.to_string(), remedy)
    })?;
    let control = Control {
        progress: &mut |_, _| {},
        notice: &mut |_| {},
        interrupted: &mut || false,
        checkpoint_every: None,
        report: true,
        command: Some(command()),
    };
    let finished = run_with(&found.model, &mut *simulation, &folder, control)?;
    folder.write(page, &optimum_page(model, found, &scene_of_run(&folder)?, &command()))?;
    let names = finished.files.iter().filter_map(|file| file.strip_prefix(place).ok());
    let names: Vec<String> = names.map(|name| name.display().to_string()).collect();
    let plots = names.iter().filter(|name| name.ends_with(".svg")).count();
    let others = names.iter().filter(|name| !name.ends_with(".svg")).map(String::as_str);
    let all: Vec<&str> = files.into_iter().chain(others).collect();
    let plots = if plots > 0 { format!(", {plots} plots") } else { String::new() };
    Ok((folder, all.join(", ") + &plots))
}

/// What there is instead of an optimum.
fn failure(error: Option<OptimizeFailure>) -> Failure {
    let message = error.map_or_else(|| "no optimum was found".into(), |error| error.to_string());
    Failure::before_a_step(message, "`holonom run` shows whether the motion reaches its end")
}

/// An optimum for people.
pub(crate) fn table(found: &OptimumReport) -> String {
    let mut text = format!("{}: {}\n", found.model, optimum_counts(found));
    for fact in optimum_facts(found) {
        let _ = writeln!(text, "  {:13} {}", fact.subject, fact.finding);
    }
    text
}
