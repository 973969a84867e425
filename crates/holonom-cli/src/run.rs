//! `holonom run`: simulate and write everything.

use std::path::Path;
use std::time::Duration;

use holonom::RunFolder;
use holonom::output::Status;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::arguments::Run;
use crate::failure::Failure;
use crate::input::Input;
use crate::{human, stderr, stdout};

pub(crate) fn run(arguments: &Run) -> Result<(), Failure> {
    let input = Input::new(&arguments.model, arguments.overrides(), arguments.json);
    let (model, mut simulation) = input.assemble()?;
    let path = &arguments.model.model;
    let folder = arguments.output.clone().unwrap_or_else(|| RunFolder::default_for(path));
    keep_the_model(path, &folder.join("model.toml"))?;
    let folder = RunFolder::create(folder, arguments.force)?;
    if !arguments.quiet {
        let warnings = &simulation.assembly().warnings;
        warnings.iter().for_each(|warning| stderr::line(&format!("warning: {warning}")));
    }
    let bar = bar(!arguments.no_progress && !arguments.quiet);
    let finished = holonom::run::run(&model, &mut *simulation, &folder, &mut |step, of| {
        bar.set_length(of);
        bar.set_position(step);
    });
    bar.finish_and_clear();
    let finished = finished?;
    if !arguments.quiet {
        let known = simulation.assembly().warnings.len();
        let new = finished.summary.warnings.iter().skip(known);
        new.for_each(|warning| stderr::line(&format!("warning: {warning}")));
        stderr::print(&human::summary(&finished));
    }
    if arguments.json {
        let summary = serde_json::to_value(&finished.summary).unwrap_or_default();
        match stdout::json(&summary) {
            Err(Failure::Closed) => {} // a failed run is one even if nobody reads
            other => other?,
        }
    }
    match (finished.summary.status, finished.summary.failure) {
        (Status::Failed, Some(failure)) => {
            let files = if arguments.quiet { finished.files } else { Vec::new() };
            Err(Failure::Run { failure, files })
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

/// A progress bar on standard error; invisible when that is no terminal.
fn bar(visible: bool) -> ProgressBar {
    let template = "{bar:32} {percent:>3} %  step {human_pos} of {human_len}, {eta} left";
    let bar = if visible { ProgressBar::new(1) } else { ProgressBar::hidden() };
    if visible {
        bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(10));
    }
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
