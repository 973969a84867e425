//! `holonom optimize`: parameters or controls of least cost that meet the conditions.

use std::cell::RefCell;
use std::fmt::Write;
use std::rc::Rc;

use holonom::model::ModelText;
use holonom::optimize::{
    Found, OptimizeFailure, OptimumReport, Progress, Status, Watch, optimize as find,
};
use holonom::report::{counted as one_or, rounded};
use holonom::run::{Control, prepare, run_with};
use holonom::{Model, Override, RunFolder};

use crate::arguments::OptimizeArguments;
use crate::failure::Failure;
use crate::input::Input;
use crate::reproduce::command;
use crate::run::keep_the_model;
use crate::signals::Signals;
use crate::{progress, stderr, stdout};

/// The files of an optimum beside those of its run.
const FILES: [&str; 4] = ["optimum.json", "iterations.csv", "controls.csv", "costates.csv"];
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
    let visible = !arguments.no_progress && !arguments.quiet;
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
    let text = ModelText::read(path);
    let mut failed = None;
    let make = |model: &Model| match search(&text, &overrides, model, &watch) {
        Ok(found) => Ok(Some(found)),
        Err(OptimizeFailure::Model(error)) => Err(error),
        Err(error) => {
            failed = Some(error);
            Ok(None)
        }
    };
    let input = Input::new(&arguments.model, overrides.clone(), arguments.json);
    let (_, found) = input.assemble_as(make)?;
    bar.finish_and_clear();
    let Some(found) = found else { return Err(failure(failed)) };
    let (folder, files) = written(&found, &place, arguments.force)?;
    if arguments.json {
        stdout::json(&serde_json::to_value(&found.report).unwrap_or_default())?;
    } else if !arguments.quiet {
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

/// Searches by the method that the program is built with.
fn search(
    text: &ModelText,
    overrides: &[Override],
    model: &Model,
    watch: &Watch,
) -> Result<Found, OptimizeFailure> {
    #[cfg(feature = "optimize")]
    {
        let settings = model.optimize.clone().unwrap_or_default();
        let mut method = holonom::vi_control::Pounce { max_iterations: settings.max_iterations };
        find(text, overrides, model, Some(&mut method), watch)
    }
    #[cfg(not(feature = "optimize"))]
    find(text, overrides, model, None, watch)
}

/// Runs the model of an optimum, and writes all files.
fn written(
    found: &Found,
    place: &std::path::Path,
    force: bool,
) -> Result<(RunFolder, String), Failure> {
    let folder = RunFolder::create(place, force)?;
    let mut files = vec![FILES[0], FILES[1]];
    let json = format!("{:#}\n", serde_json::to_value(&found.report).unwrap_or_default());
    folder.write(FILES[0], &json)?;
    folder.write(FILES[1], &found.iterations())?;
    if !found.controls.is_empty() {
        folder.write(FILES[2], &found.controls())?;
        folder.write(FILES[3], &found.costates())?;
        files.extend([FILES[2], FILES[3]]);
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

fn counted(count: usize, one: &str) -> String {
    one_or(count as u64, one, &format!("{one}s"))
}

/// An optimum for people.
fn table(found: &OptimumReport) -> String {
    let free = match (found.controls.len(), found.parameters.len()) {
        (0, parameters) => counted(parameters, "parameter"),
        (controls, _) => counted(controls, "control"),
    };
    let mut text = format!(
        "{}: optimum of {free} over {} steps of {} s\n",
        found.model,
        found.steps,
        rounded(found.step, 9)
    );
    let mut line = |subject: &str, finding: String| {
        let _ = writeln!(text, "  {subject:13} {finding}");
    };
    let iterations = counted(found.iterations, "iteration");
    let sufficient = found.sufficient.map_or("", |own| match own {
        true => ", second-order sufficient",
        false => ", second order not shown",
    });
    let words = match found.status {
        Status::Optimal if found.terms.is_empty() => "the conditions are met",
        status => status.words(),
    };
    line("status", format!("{words}, {iterations}{sufficient}"));
    if !found.terms.is_empty() {
        let own = |term: &holonom::gradient::TermValue| {
            format!("{} {}", term.name, rounded(term.value, 10))
        };
        let terms: Vec<String> = found.terms.iter().map(own).collect();
        line("cost", format!("{}: {}", rounded(found.cost, 12), terms.join(", ")));
    }
    for own in &found.parameters {
        let bound = if own.at_bound { ", at its bound" } else { "" };
        let (value, start) = (rounded(own.value, 12), rounded(own.start, 6));
        let (min, max) = (rounded(own.min, 6), rounded(own.max, 6));
        line(
            "parameter",
            format!("{} = {value}, from {start} within {min} to {max}{bound}", own.name),
        );
    }
    if !found.controls.is_empty() {
        let free = |own: &&holonom::optimize::ControlFound| own.at_bounds > 0;
        let active: Vec<String> = found
            .controls
            .iter()
            .filter(free)
            .map(|own| format!("`{}` in {}", own.name, counted(own.at_bounds, "step")))
            .collect();
        let words = if active.is_empty() { "none active".to_owned() } else { active.join(", ") };
        line("bounds", words);
    }
    if !found.conditions.is_empty() {
        let worst = found.conditions.iter().fold(0.0_f64, |worst, own| worst.max(own.violation));
        let met = match found.status {
            Status::Optimal => format!("all met to {worst:.0e}"),
            _ => format!("missed by {worst:.1e} at most"),
        };
        let dearest =
            found.conditions.iter().max_by(|a, b| a.price.abs().total_cmp(&b.price.abs()));
        let price = dearest.filter(|own| own.price != 0.0).map_or_else(String::new, |own| {
            format!("; the largest price: `{}`, {} for one more", own.name, rounded(own.price, 6))
        });
        line("conditions", met + &price);
    }
    if found.refinements.len() > 1 {
        let costs: Vec<String> =
            found.refinements.iter().map(|own| rounded(own.cost, 9).to_string()).collect();
        let steps: Vec<String> =
            found.refinements.iter().map(|own| own.steps.to_string()).collect();
        let order = found.convergence().map_or_else(String::new, |[order, limit]| {
            format!(": order {order:.1}, limit about {}", rounded(limit, 7))
        });
        let (costs, steps) = (costs.join(", "), steps.join(", "));
        line("convergence", format!("cost {costs} at {steps} steps{order}"));
    }
    if let Some(own) = &found.replay {
        let steps =
            own.by_steps.map_or_else(String::new, |by| format!(", step by step to {by:.0e}"));
        line("replay", format!("the motion follows its controls to {:.0e}{steps}", own.deviation));
    }
    for own in &found.starts {
        line(
            "start",
            format!("{}: cost {}, {}", own.start, rounded(own.cost, 9), own.status.words()),
        );
    }
    text
}
