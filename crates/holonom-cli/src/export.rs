//! `holonom export`: the results of a run for other programs.

use holonom::export::{ExportError, Exported, export as write};

use crate::arguments::ExportArguments;
use crate::failure::Failure;
use crate::folder::folder;
use crate::stderr;

pub(crate) fn export(arguments: &ExportArguments) -> Result<(), Failure> {
    let ExportArguments { dir, format, frames, .. } = arguments;
    if frames.is_some() && format.frames().is_none() {
        return Err(Failure::Usage {
            message: format!("{} holds all recorded nodes: --frames does not apply", format.name()),
            help: "leave it out, or choose --format vtk, gltf or svg".into(),
        });
    }
    let folder = folder(dir)?;
    let to = arguments.output.clone().unwrap_or_else(|| {
        let stem = dir.file_name().unwrap_or_else(|| "run".as_ref());
        format.file_name(&stem.to_string_lossy()).into()
    });
    Failure::unless_vacant(&to, arguments.force)?;
    let written = write(&folder, *format, &to, *frames);
    let Exported { frames, recorded, pace } = written.map_err(|error| match error {
        ExportError::Foreign { .. } => Failure::Usage {
            message: error.to_string(),
            help: "only a folder that was exported before is replaced: choose another with -o"
                .into(),
        },
        error => Failure::Export(error.to_string()),
    })?;
    if frames < recorded {
        let more = "--frames N changes their number";
        stderr::line(&format!("note: {frames} of {recorded} recorded nodes; {more}"));
    }
    if let Some(pace) = pace {
        stderr::line(&format!("note: 1 s of the motion is {pace} s of the animation"));
    }
    stderr::line(&to.display().to_string());
    Ok(())
}
