//! `holonom plot`: plots and report of a finished run.

use holonom::output::RunFolder;
use holonom::report;
use std::path::Path;

use crate::arguments::Plot;
use crate::failure::Failure;
use crate::stderr;

pub(crate) fn plot(arguments: &Plot) -> Result<(), Failure> {
    for file in report::write(&folder(&arguments.dir)?)? {
        stderr::line(&file.display().to_string());
    }
    Ok(())
}

/// The folder of a finished run.
pub(crate) fn folder(path: &Path) -> Result<RunFolder, Failure> {
    if path.join("summary.json").is_file() {
        return Ok(RunFolder::open(path));
    }
    Err(Failure::Usage {
        message: format!("{} is not the folder of a run", path.display()),
        help: "name a folder with summary.json and trajectory.csv, as `holonom run` writes it"
            .into(),
    })
}
