//! `holonom run`: simulate and write everything.

use std::path::Path;

use holonom::RunFolder;
use holonom::experiment::RunnableModel;
use holonom::output::{CHECKPOINTS, OutputError, OutputSize, Status};
use holonom::run::{ContinueError, Finished, RunControl, run_with};

use crate::arguments::{RunArguments, Talk};
use crate::failure::Failure;
use crate::input::ModelInput;
use crate::reproduce::command;
use crate::signals::ReceivedSignals;
use crate::{human, progress, stderr, stdout};

pub(crate) fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let talk = &arguments.talk;
    let input = ModelInput::new(&arguments.model, arguments.overrides(), talk.json);
    let (model, mut simulation) = input.assemble()?;
    let path = &arguments.model.model;
    let folder = arguments.output.clone().unwrap_or_else(|| RunFolder::default_for(path, "out"));
    keep_the_model(path, &folder.join("model.toml"))?;
    if arguments.checkpoint_every.is_some() && simulation.statics().is_some() {
        return Err(Failure::Usage {
            message: "a continuation of equilibria has no checkpoints".into(),
            help: "leave --checkpoint-every out, or choose another scheme than static".into(),
        });
    }
    RunFolder::takes_meshes(&folder, &model.meshes)?;
    let folder = RunFolder::create(folder, arguments.force)?;
    warn_of_assembly(&*simulation, talk);
    let size = OutputSize::of(&*simulation, &model.settings).warning();
    size.iter()
        .filter(|_| !talk.quiet)
        .for_each(|words| stderr::line(&format!("warning: {words}")));
    let every = arguments.checkpoint_every;
    conduct(&mut *simulation, folder.path(), every, talk, |simulation, control| {
        Ok(run_with(&model, simulation, &folder, control)?)
    })
}

pub(crate) fn warn_of_assembly(simulation: &dyn RunnableModel, talk: &Talk) {
    let warnings = simulation.assembly().warnings.iter();
    warnings
        .filter(|_| !talk.quiet)
        .for_each(|warning| stderr::line(&format!("warning: {warning}")));
}

/// Lets `go` run or continue a simulation, and reports.
pub(crate) fn conduct(
    simulation: &mut dyn RunnableModel,
    folder: &Path,
    checkpoint_every: Option<u64>,
    talk: &Talk,
    go: impl FnOnce(&mut dyn RunnableModel, RunControl<'_>) -> Result<Finished, ContinueError>,
) -> Result<(), Failure> {
    let signals = ReceivedSignals::watch();
    let template = "{bar:32} {percent:>3} %  step {human_pos} of {human_len}, {eta} left";
    let bar = progress::bar(!talk.no_progress && !talk.quiet, template);
    let known = simulation.assembly().warnings.len();
    let is_shown = !bar.is_hidden(); // it reads the clock
    let mut progress = |step, of| {
        if is_shown {
            bar.set_length(of);
            bar.set_position(step);
        }
    };
    let mut told: Vec<String> = Vec::new(); // warnings that have been printed
    let mut notice = |warning: &str| {
        if !talk.quiet {
            bar.suspend(|| stderr::line(&format!("warning: {warning}")));
        }
        told.push(warning.to_owned());
    };
    let mut interrupted = || signals.caught().is_some();
    let control = RunControl {
        progress: &mut progress,
        notice: &mut notice,
        interrupted: &mut interrupted,
        checkpoint_every,
        report: true,
        command: Some(command()),
    };
    let finished = go(simulation, control);
    bar.finish_and_clear();
    let finished = finished.map_err(|error| match error {
        ContinueError::Output(error @ OutputError::Io { .. })
            if CHECKPOINTS.iter().any(|name| folder.join(name).is_file()) =>
        {
            Failure::Stopped { error, folder: folder.to_owned() }
        }
        error => error.into(),
    })?;
    if !talk.quiet {
        let new = finished.summary.warnings.iter().skip(known);
        let new = new.filter(|warning| !told.contains(warning));
        new.for_each(|warning| stderr::line(&format!("warning: {warning}")));
        stderr::print(&human::summary(&finished));
    }
    if talk.json {
        let summary = serde_json::to_value(&finished.summary).unwrap_or_default();
        match stdout::json(&summary) {
            Err(Failure::Closed) => {} // a failed run is one even if nobody reads
            other => other?,
        }
    }
    let Finished { summary, files } = finished;
    match (summary.status, summary.failure, summary.interruption) {
        (Status::Failed, Some(failure), _) => {
            let files = if talk.quiet { files } else { Vec::new() };
            Err(Failure::Run { failure, files })
        }
        (Status::Interrupted, _, Some(at)) => {
            Err(Failure::Interrupted { at, signal: signals.caught().unwrap_or(2) })
        }
        _ => Ok(()),
    }
}

/// The resolved model must not replace the model that the user wrote.
pub(crate) fn keep_the_model(model: &Path, resolved: &Path) -> Result<(), Failure> {
    match (model.canonicalize(), resolved.canonicalize()) {
        (Ok(model), Ok(resolved)) if model == resolved => Err(Failure::Usage {
            message: format!("the results would replace the model {}", model.display()),
            help: "choose another folder with -o DIR".into(),
        }),
        _ => Ok(()),
    }
}
