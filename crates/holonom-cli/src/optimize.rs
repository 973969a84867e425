//! `holonom optimize`: parameters or controls of least cost that meet the conditions.

use std::cell::RefCell;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use holonom::model::read_regular_text;
use holonom::optimize::{
    FoundOptimum, KeptSearch, OptimizeFailure, OptimumReport, SearchProgress, SearchStatus,
    SearchWatch, optimize_by_own_method,
};
use holonom::report::{optimum_counts, optimum_facts, optimum_page, rounded, scene_of_run};
use holonom::run::{RunControl, prepare, run_with};
use holonom::{Model, RunFolder};

use crate::arguments::{ModelArguments, OptimizeArguments, Talk};
use crate::failure::Failure;
use crate::gradient::warn_of_tolerance;
use crate::input::ModelInput;
use crate::reproduce::command;
use crate::run::keep_the_model;
use crate::signals::ReceivedSignals;
use crate::{progress, stderr, stdout};

const NUMBERS: &str = "optimum.json";
const ITERATIONS: &str = "iterations.csv";
const SEARCH: &str = "search.json";
/// The files of an optimum beside those of its run.
const FILES: [&str; 7] =
    [NUMBERS, "optimum.html", ITERATIONS, "controls.csv", "costates.csv", "prices.csv", SEARCH];
/// The size of a file that is read at most, bytes.
const LARGEST: u64 = 1 << 30;
/// Files that show that a run is there.
const OF_RUN: [&str; 3] = ["model.toml", "summary.json", "trajectory.csv"];

/// A search: of which model, where its results go, where it begins.
struct AskedSearch<'a> {
    input: ModelInput<'a>,
    place: PathBuf,
    force: bool,
    /// A search that it continues, with its iterations.
    earlier: Option<(KeptSearch, String)>,
    talk: &'a Talk,
}

pub(crate) fn optimize(arguments: &OptimizeArguments) -> Result<(), Failure> {
    let path = &arguments.model.model;
    let place = arguments.output.clone();
    let place = place.unwrap_or_else(|| RunFolder::default_for(path, "optimum"));
    keep_the_model(path, &place.join("model.toml"))?;
    RunFolder::vacant(&place, &FILES, arguments.force)?;
    RunFolder::vacant(&place, &OF_RUN, arguments.force)?;
    let talk = &arguments.talk;
    let input = ModelInput::new(&arguments.model, arguments.model.set.clone(), talk.json);
    search(AskedSearch { input, place, force: arguments.force, earlier: None, talk })
}

/// Of the folder of a search whether it has found its optimum; `None` of another folder.
pub(crate) fn is_found(folder: &Path) -> Option<bool> {
    let status = json(&folder.join(NUMBERS))?.get("status")?.clone();
    Some(serde_json::from_value(status).is_ok_and(SearchStatus::is_found))
}

fn json(file: &Path) -> Option<serde_json::Value> {
    serde_json::from_str(&read_regular_text(file, LARGEST).ok()?).ok()
}

/// Goes on with a search, in its folder.
pub(crate) fn resume(place: &Path, talk: &Talk) -> Result<(), Failure> {
    let shown = place.display();
    let earlier = json(&place.join(SEARCH))
        .and_then(|found| serde_json::from_value::<KeptSearch>(found).ok());
    let Some(earlier) = earlier else {
        return Err(Failure::Usage {
            message: format!("{shown} has no {SEARCH} that says where its search ended"),
            help: "search again with `holonom optimize MODEL --force`".into(),
        });
    };
    let rows = read_regular_text(&place.join(ITERATIONS), LARGEST).unwrap_or_default();
    let (model, text) = earlier.text();
    let model = ModelArguments { model: model.to_owned(), set: Vec::new() };
    if !talk.quiet {
        stderr::line(&format!("{shown}: the search goes on from where it ended"));
    }
    let input = ModelInput::of(&model, earlier.overrides(), talk.json, text);
    let earlier = Some((earlier, rows));
    search(AskedSearch { input, place: place.to_owned(), force: true, earlier, talk })
}

fn search(asked: AskedSearch) -> Result<(), Failure> {
    let signals = Rc::new(ReceivedSignals::watch());
    let talk = asked.talk;
    let visible = !talk.no_progress && !talk.quiet;
    let bar = progress::bar(visible, "{spinner} iteration {pos}, {msg}");
    let (shown, heard) = (bar.clone(), signals.clone());
    let watch: SearchWatch = Rc::new(RefCell::new(move |at: &SearchProgress| {
        shown.set_position(at.iteration as u64);
        shown.set_message(format!(
            "cost {}, violation {:.1e}",
            rounded(at.cost, 8),
            at.infeasibility
        ));
        heard.caught().is_none()
    }));
    let (text, overrides) = (asked.input.text(), asked.input.overrides());
    let from = asked.earlier.as_ref().and_then(|(earlier, _)| earlier.point());
    let mut failed = None;
    let make = |model: &Model| match optimize_by_own_method(text, overrides, model, from, &watch) {
        Ok(found) => Ok(Some(found)),
        Err(OptimizeFailure::Model(error)) => Err(error),
        Err(error) => {
            failed = Some(error);
            Ok(None)
        }
    };
    let (model, found) = asked.input.assemble_as(make)?;
    bar.finish_and_clear();
    let Some(found) = found else { return Err(failure(failed)) };
    if !talk.quiet {
        warn_of_tolerance(&model);
    }
    let (folder, files) = written(&model, &found, &asked)?;
    if talk.json {
        stdout::json(&serde_json::to_value(&found.report).unwrap_or_default())?;
    } else if !talk.quiet {
        let place = asked.place.display();
        let text = table(&found.report) + &format!("  {:13} {place}: {files}\n", "written");
        stdout::bytes(stderr::visible(&text).as_bytes())?;
    }
    drop(folder);
    ended(&found.report, signals.caught(), asked.place)
}

/// What the program says of the end of a search, with its exit code.
fn ended(found: &OptimumReport, signal: Option<u8>, folder: PathBuf) -> Result<(), Failure> {
    let missed = found.missed.join("; ");
    match found.status {
        SearchStatus::Optimal => Ok(()),
        SearchStatus::TurnsBounded => {
            stderr::line(&format!("warning: {missed}"));
            Ok(())
        }
        SearchStatus::Stopped => {
            Err(Failure::SearchInterrupted { signal: signal.unwrap_or(2), folder })
        }
        status => {
            let missed = if missed.is_empty() { String::new() } else { format!(" ({missed})") };
            let message = format!("no optimum: {}{missed}", status.words());
            let unfinished = (status == SearchStatus::Unfinished).then_some(folder);
            Err(Failure::NoOptimum { message, unfinished })
        }
    }
}

/// Runs the model of an optimum, and writes all files.
fn written(
    model: &Model,
    found: &FoundOptimum,
    asked: &AskedSearch,
) -> Result<(RunFolder, String), Failure> {
    let (place, force) = (&asked.place, asked.force);
    drop(RunFolder::create_for(place, &FILES, force)?);
    let folder = RunFolder::create(place, force)?;
    let [of_numbers, page, iterations, controls, costates, prices, search] = FILES;
    let mut files = vec![of_numbers, page, iterations];
    let input = &asked.input;
    let of = (input.text(), input.overrides());
    if !found.report.status.is_found()
        && let Ok(own) = KeptSearch::new(input.path(), of, found.kept.clone())
    {
        let text = serde_json::to_string(&own).unwrap_or_default();
        folder.write(search, &(text + "\n"))?;
        files.push(search);
    }
    let json = format!("{:#}\n", serde_json::to_value(&found.report).unwrap_or_default());
    folder.write(of_numbers, &json)?;
    let earlier = asked.earlier.as_ref().map_or("", |(_, rows)| rows);
    folder.write(iterations, &continued(earlier, &found.iterations()))?;
    if !found.controls.is_empty() {
        folder.write(controls, &found.controls())?;
        folder.write(costates, &found.costates())?;
        files.extend([controls, costates]);
    }
    if !found.prices.is_empty() {
        folder.write(prices, &found.prices())?;
        files.push(prices);
    }
    let mut simulation = prepare(&found.model).map_err(|error| {
        let remedy = "the model of the optimum is not valid: tell its developers";
        Failure::before_a_step(error.to_string(), remedy)
    })?;
    let control = RunControl {
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

/// The rows of a table after those of an earlier one with the same columns.
fn continued(earlier: &str, table: &str) -> String {
    match (earlier.split_once('\n'), table.split_once('\n')) {
        (Some((before, _)), Some((head, rows))) if before == head => format!("{earlier}{rows}"),
        _ => table.to_owned(),
    }
}

/// What there is instead of an optimum.
fn failure(error: Option<OptimizeFailure>) -> Failure {
    if let Some(error @ OptimizeFailure::Another) = error {
        let help = "search again with `holonom optimize MODEL --force`".into();
        return Failure::Usage { message: error.to_string(), help };
    }
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
