//! `holonom resume`: continue a run that was interrupted or killed.

use holonom::RunFolder;
use holonom::output::{FoundCheckpoint, Status};
use holonom::report;
use holonom::run::resume as continue_run;

use crate::arguments::{ModelArguments, ResumeArguments};
use crate::failure::Failure;
use crate::input::ModelInput;
use crate::run::{conduct, warn_of_assembly};
use crate::{optimize, stderr};

pub(crate) fn resume(arguments: &ResumeArguments) -> Result<(), Failure> {
    let (dir, talk) = (&arguments.dir, &arguments.talk);
    let found = optimize::is_found(dir);
    if found == Some(false) {
        return optimize::resume(dir, talk);
    }
    let model = dir.join("model.toml");
    if !model.is_file() {
        return Err(Failure::Usage {
            message: format!("{} is not the folder of a run", dir.display()),
            help: "name a folder with model.toml and checkpoint, as `holonom run` writes it".into(),
        });
    }
    let folder = RunFolder::reopen(dir)?;
    let earlier = folder.summary().ok(); // a run that was killed at its very beginning has none
    if let Some(earlier) = earlier {
        match (earlier.status, earlier.failure) {
            (Status::Done, _) if found.is_some() => {
                let said = "the optimum is found already, nothing is left to do";
                stderr::line(&format!("{}: {said}", dir.display()));
                return Ok(());
            }
            (Status::Done, _) => return complete(&folder),
            (Status::Failed, Some(failure)) => {
                return Err(Failure::Run { failure, files: Vec::new() });
            }
            _ => {}
        }
    }
    let FoundCheckpoint { checkpoint, refused } = folder.read_checkpoint(&folder.model_text())?;
    if let Some(refused) = refused {
        stderr::line(&format!("warning: {refused}; continuing from the checkpoint before"));
    }
    let model = ModelArguments { model, set: Vec::new() };
    let (model, mut simulation) = ModelInput::new(&model, Vec::new(), talk.json).assemble()?;
    warn_of_assembly(&*simulation, talk);
    if !talk.quiet {
        let (step, of) = (checkpoint.run.step(), model.settings.steps());
        stderr::line(&format!("{}: continuing at step {step} of {of}", dir.display()));
    }
    let every = arguments.checkpoint_every;
    conduct(&mut *simulation, dir, every, talk, |simulation, control| {
        continue_run(&model, simulation, &folder, checkpoint, control)
    })
}

/// A run that is complete: draws it if it was killed before that was done.
fn complete(folder: &RunFolder) -> Result<(), Failure> {
    folder.remove_outdated_checkpoints()?; // of a run that was killed before it did
    let dir = folder.path().display();
    if report::is_current(folder) {
        stderr::line(&format!(
            "{dir}: the run is complete, nothing is left to do; `holonom plot {dir}` draws it again"
        ));
        return Ok(());
    }
    report::write(folder)?;
    stderr::line(&format!("{dir}: the run is complete; its plots and its page are drawn"));
    Ok(())
}
