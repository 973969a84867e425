//! `holonom export-fmu`: a model as a functional mock-up unit.

use std::fmt::Write;
use std::io;
use std::path::Path;

pub use crate::unit_library::{add_libraries, help_on_libraries};
use holonom::experiment::RunnableModel;
use holonom::export::configuration;
use holonom::model::{Model, ModelError, ModelText};
use holonom::output::OutputError;
use holonom::{ExternalActions, Input as Held, Override, Simulation};
use holonom_fmu::{Causality, Resources, Unit, Variable};
pub use holonom_fmu::{UnitRequest, Version};
use serde_json::json;

use crate::arguments::UnitArguments;
use crate::check::page;
use crate::failure::Failure;
use crate::input::ModelInput;
use crate::picture::{self, PictureFormat};
use crate::{stderr, stdout};

/// The licences of the library.
const LICENSES: [(&str, &str); 2] = [
    ("LICENSE-APACHE", include_str!("../LICENSE-APACHE")),
    ("LICENSE-MIT", include_str!("../LICENSE-MIT")),
];
/// Pixels of the icon for each px of 1/96 inch.
const ICON_PIXELS: f64 = 0.5;

/// Why there is no unit.
#[derive(Debug)]
pub enum UnitError {
    /// The model has none: its scheme, an input or a parameter that was asked for.
    Model(ModelError),
    /// It cannot be packed.
    Packing(io::Error),
}

impl From<ModelError> for UnitError {
    fn from(error: ModelError) -> Self {
        Self::Model(error)
    }
}

impl From<io::Error> for UnitError {
    fn from(error: io::Error) -> Self {
        Self::Packing(error)
    }
}

/// The unit of a model with its documentation and its icon, still without a library; `experiment`:
/// its run, that is ready.
///
/// # Errors
/// [`UnitError`].
pub fn unit(
    (text, overrides, model): (&ModelText, &[Override], &Model),
    experiment: &dyn RunnableModel,
    version: Version,
    request: UnitRequest,
) -> Result<Unit, UnitError> {
    let resources = Resources::new(text, overrides.to_vec(), model, request)?;
    let (_, interface) = resources.interface()?;
    let inputs: Vec<Held> = interface.places.iter().cloned().map(Held::new).collect();
    Simulation::with_outside(model, &ExternalActions::of_inputs(&inputs))?;
    let (page, drawing) = (page(model, experiment)?, configuration(model)?);
    let mut unit = Unit::new(version, model, interface, &resources)?;
    unit.add_file("documentation/index.html", page.into_bytes());
    for (name, words) in LICENSES {
        unit.add_file(format!("documentation/licenses/{name}"), words.as_bytes().to_vec());
    }
    let icon = drawing.map(|drawing| picture::bytes(&drawing, PictureFormat::Png, ICON_PIXELS));
    if let Some(Ok(bytes)) = icon {
        let path = match version {
            Version::Fmi2 => "model.png",
            Version::Fmi3 => "terminalsAndIcons/icon.png",
        };
        unit.add_file(path, bytes);
    }
    Ok(unit)
}

pub(crate) fn export(arguments: &UnitArguments) -> Result<(), Failure> {
    let to = arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.model.model.file_stem().filter(|stem| !stem.is_empty());
        let mut name = stem.unwrap_or_else(|| "model".as_ref()).to_owned();
        name.push(".fmu");
        name.into()
    });
    Failure::unless_vacant(&to, arguments.force)?;
    let overrides = &arguments.model.set;
    let input = ModelInput::new(&arguments.model, overrides.clone(), arguments.json);
    let (model, run) = input.assemble()?;
    let request =
        UnitRequest { inputs: arguments.input.clone(), parameters: arguments.parameter.clone() };
    let written = |source: io::Error| Failure::Output(OutputError::Io { path: to.clone(), source });
    let made = unit((input.text(), overrides, &model), run.as_ref(), arguments.fmi, request);
    let mut unit = match made {
        Ok(unit) => unit,
        Err(UnitError::Packing(error)) => return Err(written(error)),
        Err(UnitError::Model(error)) => match asked_in_vain(&error) {
            Some(failure) => return Err(failure),
            None => return Err(input.refused(error)?),
        },
    };
    let package = arguments.package.as_deref();
    add_libraries(&mut unit, &arguments.library, package).map_err(Failure::Library)?;
    picture::whole(&to, &unit.to_bytes().map_err(written)?)?;
    match arguments.json {
        true => stdout::json(&object(&model, &unit, &to)),
        false => {
            stderr::line(&words(&model, &unit, &to));
            Ok(())
        }
    }
}

/// That of an input or a parameter that was asked for and is not there.
fn asked_in_vain(error: &ModelError) -> Option<Failure> {
    let ModelError::Assembly(problems) = error else { return None };
    let own = problems.first()?;
    let is_asked = ["input", "parameter"].iter().any(|word| own.key.starts_with(word));
    is_asked.then(|| Failure::Usage {
        message: format!("{}: {}", own.key, own.message),
        help: own.help.clone().unwrap_or_default(),
    })
}

/// What a unit has, as JSON; `to`: its file.
#[must_use]
pub fn object(model: &Model, unit: &Unit, to: &Path) -> serde_json::Value {
    let list = |causality| -> Vec<serde_json::Value> {
        let entry =
            |own: &Variable| json!({ "name": own.name, "unit": own.unit, "start": own.start });
        unit.interface().of_causality(causality).map(|(_, own)| entry(own)).collect()
    };
    json!({
        "file": to.display().to_string(),
        "model": model.header.name,
        "fmi": unit.version().name(),
        "step": model.settings.step,
        "platforms": unit.platforms(),
        "inputs": list(Causality::Input),
        "outputs": list(Causality::Output),
        "parameters": list(Causality::Parameter),
    })
}

/// The same in words.
#[must_use]
pub fn words(model: &Model, unit: &Unit, to: &Path) -> String {
    let version = unit.version().name();
    let mut text = format!("{}: FMI {version}, co-simulation\n", to.display());
    let kinds = [
        ("inputs", Causality::Input),
        ("outputs", Causality::Output),
        ("parameters", Causality::Parameter),
    ];
    for (label, causality) in kinds {
        let shown = |own: &Variable| match own.unit {
            "" => own.name.clone(),
            unit => format!("{} ({unit})", own.name),
        };
        let list: Vec<String> =
            unit.interface().of_causality(causality).map(|(_, own)| shown(own)).collect();
        let list = if list.is_empty() { "none".to_owned() } else { list.join(", ") };
        let _ = writeln!(text, "  {label:<11} {list}");
    }
    let _ = writeln!(text, "  {:<11} {} s", "step", model.settings.step);
    let _ = write!(text, "  {:<11} {}", "platforms", unit.platforms().join(", "));
    text
}
