//! `holonom check`: validate and assemble, simulate nothing; show the initial configuration.

use holonom::experiment::RunnableModel;
use holonom::export::configuration;
use holonom::model::{Model, ModelError};
use holonom::output::OutputSize;
use holonom::report::{Assembled, configuration_page};
use serde_json::json;

use crate::arguments::CheckArguments;
use crate::failure::Failure;
use crate::input::ModelInput;
use crate::picture::{self, PictureFormat};
use crate::reproduce::command;
use crate::{human, stderr, stdout};

/// Pixels of a PNG for each px of 1/96 inch.
const PIXELS: f64 = 2.0;

pub(crate) fn check(arguments: &CheckArguments) -> Result<(), Failure> {
    let format =
        arguments.picture.as_deref().map(|file| PictureFormat::of(file, &[])).transpose()?;
    for file in [&arguments.page, &arguments.picture].into_iter().flatten() {
        Failure::unless_vacant(file, arguments.force)?;
    }
    let input = ModelInput::new(&arguments.model, arguments.model.set.clone(), arguments.json);
    let (model, simulation) = input.assemble()?;
    if let Some(file) = &arguments.page {
        match page(&model, simulation.as_ref()) {
            Ok(page) => picture::whole(file, page.as_bytes())?,
            Err(error) => return Err(input.refused(error)?),
        }
    }
    if let (Some(file), Some(format)) = (&arguments.picture, format) {
        match configuration(&model) {
            Ok(Some(drawing)) => picture::write(file, &drawing, format, PIXELS)?,
            Ok(None) => return Err(nothing_to_draw()),
            Err(error) => return Err(input.refused(error)?),
        }
    }
    let written = [("page", &arguments.page), ("picture", &arguments.picture)];
    let written = written.iter().filter_map(|(key, file)| Some((*key, file.as_ref()?)));
    let size = OutputSize::of(simulation.as_ref(), &model.settings);
    if arguments.json {
        let mut assembly = simulation.assembly().clone();
        assembly.warnings.extend(size.warning());
        let mut found = json!({
            "valid": true,
            "file": arguments.model.model.display().to_string(),
            "model": model.header.name,
            "steps": model.settings.steps(),
            "assembly": assembly,
            "output": size,
        });
        written.for_each(|(key, file)| found[key] = file.display().to_string().into());
        return stdout::json(&found);
    }
    stderr::print(&human::assembly(&model, simulation.assembly(), size));
    written.for_each(|(_, file)| stderr::line(&format!("  written: {}", file.display())));
    Ok(())
}

fn nothing_to_draw() -> Failure {
    let message = "the initial configuration has no finite size: it cannot be drawn".into();
    Failure::Usage { message, help: "leave --picture out".into() }
}

/// The page of the initial configuration.
pub(crate) fn page(model: &Model, simulation: &dyn RunnableModel) -> Result<String, ModelError> {
    let report = simulation.assembly();
    let found =
        Assembled { facts: human::findings(model, report), warnings: report.warnings.clone() };
    configuration_page(model, &found, &command())
}
