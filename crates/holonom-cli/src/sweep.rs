//! `holonom sweep` and `holonom collect`: a model at many points.

use std::num::NonZero;
use std::path::Path;

use holonom::RunFolder;
use holonom::model::{Meshes, ModelText};
use holonom::sweep::{
    Collected, Plan, PlanError, PointSampling, SweepError, SweepProgress, begin,
    collect as collected, run_point, table,
};

use crate::arguments::{CollectArguments, SweepArguments};
use crate::failure::Failure;
use crate::input::ModelInput;
use crate::run::keep_the_model;
use crate::signals::ReceivedSignals;
use crate::{progress, stderr, stdout};

pub(crate) fn sweep(arguments: &SweepArguments) -> Result<(), Failure> {
    let plan = plan(arguments)?;
    let path = &arguments.model.model;
    if path == Path::new("/dev/stdin") {
        return Err(Failure::Usage {
            message: "a sweep reads its model more than once, and standard input can be read once"
                .into(),
            help: "name a file".into(),
        });
    }
    let meshes = check(arguments, &plan)?;
    let text = match ModelText::read(path).text() {
        Ok(text) => text.to_owned(),
        Err(error) => return Err(ModelInput::new(&arguments.model, vec![], false).refused(error)?),
    };
    let folder = arguments.output.clone().unwrap_or_else(|| RunFolder::default_for(path, "sweep"));
    keep_the_model(path, &folder.join("model.toml"))?;
    let (set, how) = (arguments.model.set.clone(), (arguments.shard, arguments.force));
    let sweep = begin((&text, &meshes), set, plan, &folder, how)?;
    let jobs = arguments.jobs.or_else(|| std::thread::available_parallelism().ok());
    let sweep = sweep.jobs(jobs.unwrap_or(NonZero::<usize>::MIN));
    let signals = ReceivedSignals::watch();
    let template = "{bar:32} {human_pos} of {human_len} points, {per_sec}, {eta} left, {msg}";
    let bar = progress::bar(!arguments.no_progress && !arguments.quiet, template);
    let mut progress = |state: SweepProgress| {
        bar.set_length((state.points - state.before) as u64);
        bar.set_position(state.ended as u64);
        bar.set_message(format!("{} failed", state.failed));
    };
    let interrupted = || signals.caught().is_some();
    let work = |point: &holonom::sweep::SweepPoint<'_>| {
        if interrupted() {
            return None;
        }
        run_point(&text, &meshes, point, &mut || interrupted())
    };
    let state = sweep.run(&work, &mut progress);
    bar.finish_and_clear();
    let state = state?;
    let files = collected(&folder)?.files;
    if !arguments.quiet {
        let ended = state.before + state.ended;
        let line = match state.before {
            0 => format!("{ended} of {} points, {} failed", state.points, state.failed),
            before => format!(
                "{ended} of {} points, {before} of them before, {} failed",
                state.points, state.failed
            ),
        };
        stderr::line(&line);
        files.iter().for_each(|file| stderr::line(&format!("  {}", file.display())));
    }
    match (signals.caught(), state.failed) {
        (Some(signal), _) if !state.is_complete() => Err(Failure::SweepInterrupted { signal }),
        (_, 0) => Ok(()),
        (_, failed) => Err(Failure::Points { failed, of: state.points, table: files[0].clone() }),
    }
}

pub(crate) fn collect(arguments: &CollectArguments) -> Result<(), Failure> {
    if arguments.print {
        let csv = table(&arguments.dir)?.csv().map_err(|source| {
            holonom::output::OutputError::Io { path: arguments.dir.clone(), source }
        })?;
        return stdout::bytes(csv.as_bytes());
    }
    let Collected { table, files } = collected(&arguments.dir)?;
    stderr::line(&format!("{} points", table.rows.len()));
    files.iter().for_each(|file| stderr::line(&format!("  {}", file.display())));
    Ok(())
}

fn plan(arguments: &SweepArguments) -> Result<Plan, Failure> {
    let variations = arguments.vary.clone();
    let usage = |PlanError { message, help }| Failure::Usage { message, help };
    match (arguments.sample, arguments.points) {
        (PointSampling::Grid, None) => Plan::grid(variations).map_err(usage),
        (PointSampling::Grid, Some(_)) => Err(Failure::Usage {
            message: "-n is the number of samples, and a grid has none".into(),
            help: "write --sample random, latin or sobol, or leave -n out".into(),
        }),
        (sampling, Some(points)) => {
            Plan::samples(variations, sampling, points, arguments.seed).map_err(usage)
        }
        (sampling, None) => Err(Failure::Usage {
            message: format!("how many samples --sample {} takes is not said", sampling.name()),
            help: "add -n POINTS".into(),
        }),
    }
}

/// A model that is invalid at the first, the middle and the last point is refused before anything
/// is written: so are keys that do not exist. The meshes of the model.
fn check(arguments: &SweepArguments, plan: &Plan) -> Result<Meshes, Failure> {
    let values = plan.values();
    let read = |values: &Vec<String>| {
        let overrides = arguments.model.set.iter().cloned().chain(plan.overrides(values)).collect();
        ModelInput::new(&arguments.model, overrides, false).read()
    };
    let mut refused = None;
    for place in [0, values.len() / 2, values.len() - 1] {
        match read(&values[place]) {
            Ok(model) => return Ok(model.meshes),
            Err(failure) => refused = refused.or(Some(failure)),
        }
    }
    refused.map_or_else(|| Ok(Meshes::beside(&arguments.model.model)), Err)
}

impl From<SweepError> for Failure {
    fn from(error: SweepError) -> Self {
        match error {
            SweepError::Output(error) => Self::Output(error),
            other => Self::Usage {
                message: other.to_string(),
                help: "add --force to replace it, or choose another folder with -o DIR".into(),
            },
        }
    }
}
