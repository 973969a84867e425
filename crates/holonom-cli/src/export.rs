//! `holonom export`: the results of a run for other programs.

use holonom::export::export as write;

use crate::arguments::Export;
use crate::failure::Failure;
use crate::plot::folder;
use crate::stderr;

pub(crate) fn export(arguments: &Export) -> Result<(), Failure> {
    let folder = folder(&arguments.dir)?;
    let file = arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.dir.file_name().unwrap_or_else(|| "run".as_ref());
        std::path::PathBuf::from(stem).with_extension(arguments.format.name())
    });
    if file.exists() && !arguments.force {
        return Err(Failure::Usage {
            message: format!("{} already exists", file.display()),
            help: "add --force to replace it, or choose another file with -o FILE".into(),
        });
    }
    write(&folder, arguments.format, &file).map_err(|error| Failure::Export(error.to_string()))?;
    stderr::line(&file.display().to_string());
    Ok(())
}
