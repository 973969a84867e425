//! `holonom plot`: plots and report of a finished run.

use holonom::output::RunFolder;
use holonom::report;

use crate::arguments::Plot;
use crate::failure::Failure;
use crate::stderr;

pub(crate) fn plot(arguments: &Plot) -> Result<(), Failure> {
    if !arguments.dir.join("summary.json").is_file() {
        return Err(Failure::Usage {
            message: format!("{} is not the folder of a run", arguments.dir.display()),
            help: "name a folder with summary.json and trajectory.csv, as `holonom run` writes it"
                .into(),
        });
    }
    for file in report::write(&RunFolder::open(&arguments.dir))? {
        stderr::line(&file.display().to_string());
    }
    Ok(())
}
