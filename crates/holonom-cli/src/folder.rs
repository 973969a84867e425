//! The folder of a finished or interrupted run, for the commands that read it.

use std::io::ErrorKind;
use std::path::Path;

use holonom::output::{LeftOut, OutputError, Readable, RunFolder};

use crate::failure::Failure;
use crate::stderr;

/// The folder of a run as far as it can be read, with notes on what cannot.
pub(crate) fn folder(path: &Path) -> Result<RunFolder, Failure> {
    let summary = path.join("summary.json");
    let found = summary.metadata();
    if let Err(source) = &found
        && source.kind() == ErrorKind::PermissionDenied
    {
        return Err(
            OutputError::Io { path: summary, source: ErrorKind::PermissionDenied.into() }.into()
        );
    }
    if found.is_ok_and(|file| file.is_file()) {
        let Readable { folder, left_out } = RunFolder::open(path).readable()?;
        for LeftOut { file, rows, torn } in left_out {
            let rows = (rows > 0).then(|| format!("{rows} rows that other files lack"));
            let torn = torn.then(|| "a last row that is not whole".to_owned());
            let what: Vec<String> = rows.into_iter().chain(torn).collect();
            stderr::line(&format!("note: {file}: {} left out", what.join(" and ")));
        }
        return Ok(folder);
    }
    Err(Failure::Usage {
        message: format!("{} is not the folder of a run", path.display()),
        help: "name a folder with summary.json and trajectory.csv, as `holonom run` writes it"
            .into(),
    })
}
