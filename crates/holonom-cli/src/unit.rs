//! `holonom export-fmu`: a model as a functional mock-up unit.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use holonom::export::configuration;
use holonom::model::{Model, ModelError, ModelText};
use holonom::output::OutputError;
use holonom::run::prepare;
use holonom::{Input as Held, Outside, Simulation};
use holonom_fmu::{Causality, Interface, Request, Resources, Unit, Variable, Version};
use serde_json::json;

use crate::arguments::UnitArguments;
use crate::check::page;
use crate::failure::Failure;
use crate::input::Input;
use crate::picture::{self, PictureFormat};
use crate::{stderr, stdout};

/// The licences of the library.
const LICENSES: [(&str, &str); 2] = [
    ("LICENSE-APACHE", include_str!("../LICENSE-APACHE")),
    ("LICENSE-MIT", include_str!("../LICENSE-MIT")),
];
/// How a library is built.
const BUILD: &str = "cargo build --profile unwinding -p holonom-fmi";
/// Pixels of the icon for each px of 1/96 inch.
const ICON_PIXELS: f64 = 0.5;

pub(crate) fn export(arguments: &UnitArguments) -> Result<(), Failure> {
    let to = arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.model.model.file_stem().filter(|stem| !stem.is_empty());
        let mut name = stem.unwrap_or_else(|| "model".as_ref()).to_owned();
        name.push(".fmu");
        name.into()
    });
    Failure::unless_vacant(&to, arguments.force)?;
    let input = || Input::new(&arguments.model, arguments.model.set.clone(), arguments.json);
    let (text, model, simulation) = input().with_text(prepare)?;
    let made = || -> Result<_, ModelError> {
        let (resources, interface) = resources(arguments, &text, &model)?;
        let inputs: Vec<Held> = interface.places.iter().cloned().map(Held::new).collect();
        Simulation::with_outside(&model, &Outside::of_inputs(&inputs))?;
        Ok((resources, interface, page(&model, simulation.as_ref())?, configuration(&model)?))
    };
    let (resources, interface, page, drawing) = match made() {
        Ok(made) => made,
        Err(error) => match asked_in_vain(&error) {
            Some(failure) => return Err(failure),
            None => return Err(input().refused(error)?),
        },
    };
    let written = |source: io::Error| Failure::Output(OutputError::Io { path: to.clone(), source });
    let mut unit = Unit::new(arguments.fmi, &model, interface, &resources).map_err(written)?;
    add_libraries(&mut unit, &arguments.library)?;
    unit.add_file("documentation/index.html", page.into_bytes());
    for (name, words) in LICENSES {
        unit.add_file(format!("documentation/licenses/{name}"), words.as_bytes().to_vec());
    }
    let icon = drawing.map(|drawing| picture::bytes(&drawing, PictureFormat::Png, ICON_PIXELS));
    if let Some(Ok(bytes)) = icon {
        let path = match arguments.fmi {
            Version::Fmi2 => "model.png",
            Version::Fmi3 => "terminalsAndIcons/icon.png",
        };
        unit.add_file(path, bytes);
    }
    picture::whole(&to, &unit.to_bytes().map_err(written)?)?;
    tell(arguments, &model, &unit, &to)
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

fn resources(
    arguments: &UnitArguments,
    text: &ModelText,
    model: &Model,
) -> Result<(Resources, Interface), ModelError> {
    let request =
        Request { inputs: arguments.input.clone(), parameters: arguments.parameter.clone() };
    let resources = Resources::new(text, arguments.model.set.clone(), model, request)?;
    let (_, interface) = resources.interface()?;
    Ok((resources, interface))
}

/// Adds the libraries that were named, or the one beside the program.
fn add_libraries(unit: &mut Unit, named: &[PathBuf]) -> Result<(), Failure> {
    let read = |path: &Path| fs::read(path).map_err(|error| refused(path, &error));
    for path in named {
        unit.add_library(read(path)?).map_err(|error| refused(path, &error))?;
    }
    if !named.is_empty() {
        return Ok(());
    }
    let mut first = None;
    for path in beside_the_program().into_iter().filter(|path| path.is_file()) {
        match unit.add_library(read(&path)?) {
            Ok(()) => return Ok(()),
            Err(error) => first = first.or_else(|| Some(refused(&path, &error))),
        }
    }
    let name = library_name();
    Err(first.unwrap_or_else(|| {
        Failure::Library(format!("there is no library `{name}` beside the program"))
    }))
}

fn refused(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    Failure::Library(format!("{}: {error}", path.display()))
}

fn library_name() -> String {
    format!("{DLL_PREFIX}holonom_fmi{DLL_SUFFIX}")
}

/// Where the library may be: where cargo puts it, and where packages do.
fn beside_the_program() -> Vec<PathBuf> {
    let program = std::env::current_exe().and_then(fs::canonicalize);
    let folder = program.ok().and_then(|program| Some(program.parent()?.to_owned()));
    let folders = folder.into_iter().flat_map(|folder| {
        let near = ["", "../unwinding", "../lib"];
        near.map(|near| folder.join(near))
    });
    folders.map(|folder| folder.join(library_name())).collect()
}

impl Failure {
    /// What helps where there is no library.
    pub(crate) fn help_on_libraries() -> String {
        format!("name one by --library; from the sources it is built by `{BUILD}`")
    }
}

/// Says what the unit has.
fn tell(arguments: &UnitArguments, model: &Model, unit: &Unit, to: &Path) -> Result<(), Failure> {
    let of = |causality| unit.interface().of_causality(causality).map(|(_, own)| own);
    let version = if arguments.fmi == Version::Fmi2 { "2.0" } else { "3.0" };
    let step = model.settings.step;
    if arguments.json {
        let list = |causality| -> Vec<serde_json::Value> {
            let entry =
                |own: &Variable| json!({ "name": own.name, "unit": own.unit, "start": own.start });
            of(causality).map(entry).collect()
        };
        return stdout::json(&json!({
            "file": to.display().to_string(),
            "model": model.header.name,
            "fmi": version,
            "step": step,
            "platforms": unit.platforms(),
            "inputs": list(Causality::Input),
            "outputs": list(Causality::Output),
            "parameters": list(Causality::Parameter),
        }));
    }
    stderr::line(&format!("{}: FMI {version}, co-simulation", to.display()));
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
        let list: Vec<String> = of(causality).map(shown).collect();
        let list = if list.is_empty() { "none".to_owned() } else { list.join(", ") };
        stderr::line(&format!("  {label:<11} {list}"));
    }
    stderr::line(&format!("  {:<11} {step} s", "step"));
    stderr::line(&format!("  {:<11} {}", "platforms", unit.platforms().join(", ")));
    Ok(())
}
