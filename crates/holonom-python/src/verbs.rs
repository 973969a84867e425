//! The other verbs of the program: their JSON and their words.

use crate::errors::{json, no_word, raise};
use crate::model::Model;
use holonom::certificate::{Provenance, certify_model, now};
use holonom::compare::{CompareError, Request, compare as compared, table};
use holonom::import::{Base, ImportError, ImportOptions, JointValue, import as translate};
use holonom::model::Scheme;
use holonom::output::OutputSize;
use holonom::run::prepare;
use holonom::sweep::{Plan, PointSampling, Values, Variation};
use holonom_cli::unit::{self, UnitError, Version};
use holonom_cli::{Call, text};
use pyo3::exceptions::{PyImportError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::ffi::OsString;
use std::path::PathBuf;

/// A JSON object and its words.
pub(crate) type VerbAnswer<'py> = (Bound<'py, PyAny>, String);

/// Adds these functions.
pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_function(wrap_pyfunction!(plot, module)?)?;
    module.add_function(wrap_pyfunction!(export_fmu, module)?)?;
    module.add_function(wrap_pyfunction!(schema, module)?)?;
    module.add_function(wrap_pyfunction!(check, module)?)?;
    module.add_function(wrap_pyfunction!(verify, module)?)?;
    module.add_function(wrap_pyfunction!(compare, module)?)?;
    module.add_function(wrap_pyfunction!(import_robot, module)?)?;
    module.add_function(wrap_pyfunction!(plan, module)?)?;
    module.add_function(wrap_pyfunction!(refuse, module)?)?;
    module.add_function(wrap_pyfunction!(panic, module)?)
}

/// The program, with the words of its command line; its exit code. `package`: the folder of the
/// library of units.
#[pyfunction]
fn main(py: Python<'_>, words: Vec<OsString>, package: PathBuf) -> u8 {
    py.detach(|| holonom_cli::main_with(words, Some(&package)))
}

/// Draws columns of a run with files as `holonom plot` does; its exit code and what it says.
#[pyfunction]
fn plot(py: Python<'_>, folder: PathBuf, what: String, to: PathBuf) -> (u8, String) {
    let words: [OsString; 7] = [
        "holonom".into(),
        "plot".into(),
        folder.into(),
        "--what".into(),
        what.into(),
        "-o".into(),
        to.into(),
    ];
    let called = py.detach(|| match Call::new(words) {
        Ok(call) => call.answer(u64::MAX),
        Err(called) => called,
    });
    (called.code, String::from_utf8_lossy(&called.error).into_owned())
}

/// What a unit is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct UnitOrder {
    version: u8,
    inputs: Vec<String>,
    parameters: Vec<String>,
    libraries: Vec<PathBuf>,
    package: PathBuf,
}

/// The bytes of a functional mock-up unit of a model, and what `holonom export-fmu` says of it;
/// `to`: the name of its file.
#[pyfunction]
fn export_fmu<'py>(
    py: Python<'py>,
    model: &Model,
    to: PathBuf,
    order: UnitOrder,
) -> PyResult<(Bound<'py, PyBytes>, VerbAnswer<'py>)> {
    let UnitOrder { version, inputs, parameters, libraries, package } = order;
    let version = match version {
        2 => Version::Fmi2,
        3 => Version::Fmi3,
        other => return Err(PyValueError::new_err(format!("fmi: 2 or 3, not {other}"))),
    };
    let request = unit::UnitRequest { inputs, parameters };
    let made = py.detach(|| {
        let experiment = prepare(&model.model)?;
        let source = (&model.text, &model.overrides[..], &model.model);
        unit::unit(source, &*experiment, version, request)
    });
    let packing = |error: std::io::Error| raise(py, "OutputFailed", (error.to_string(), ""));
    let mut made = made.map_err(|error| match error {
        UnitError::Model(error) => model.refused(py, &error),
        UnitError::Packing(error) => packing(error),
    })?;
    let no_library = |words: String| raise(py, "OutputFailed", (words, unit::help_on_libraries()));
    unit::add_libraries(&mut made, &libraries, Some(&package)).map_err(no_library)?;
    let bytes = py.detach(|| made.to_bytes()).map_err(packing)?;
    let said = unit::words(&model.model, &made, &to);
    let value = json(py, &unit::object(&model.model, &made, &to))?;
    Ok((PyBytes::new(py, &bytes), (value, said)))
}

/// The JSON schema of model files.
#[pyfunction]
fn schema(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    json(py, &holonom::Model::schema())
}

/// What `holonom check` finds.
#[pyfunction]
fn check<'py>(py: Python<'py>, model: &Model) -> PyResult<VerbAnswer<'py>> {
    let found = py.detach(|| {
        let experiment = prepare(&model.model)?;
        let size = OutputSize::of(&*experiment, &model.model.settings);
        Ok((experiment.assembly().clone(), size))
    });
    let (report, size) = found.map_err(|error| model.refused(py, &error))?;
    let words = text::assembly(&model.model, &report, size);
    let mut assembly = report;
    assembly.warnings.extend(size.warning());
    let value = serde_json::json!({
        "valid": true,
        "model": model.model.header.name,
        "steps": model.model.settings.steps(),
        "assembly": assembly,
        "output": size,
    });
    Ok((json(py, &value)?, words))
}

/// What `holonom verify` finds.
#[pyfunction]
fn verify<'py>(
    py: Python<'py>,
    model: &Model,
    accuracy: f64,
    progress: Option<Py<PyAny>>,
) -> PyResult<VerbAnswer<'py>> {
    let mut told = Told { progress, failed: None };
    let found = py.detach(|| certify_model(&model.model, accuracy, &mut |words| told.tell(words)));
    told.failed.map_or(Ok(()), Err)?;
    let mut certificate = found.map_err(|words| raise(py, "AnalysisFailed", (words,)))?;
    let command = "holonom.verify".to_owned();
    certificate.provenance =
        Some(Provenance::new(command, now(), model.merged(), &model.overrides));
    let value = serde_json::to_value(&certificate).unwrap_or_default();
    Ok((json(py, &value)?, text::certificate(&certificate, true)))
}

/// What `holonom compare` finds.
#[pyfunction]
fn compare<'py>(
    py: Python<'py>,
    model: &Model,
    schemes: Vec<String>,
    steps: Vec<f64>,
    orders: Vec<u32>,
    end: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<VerbAnswer<'py>> {
    let schemes = schemes_of(py, &schemes)?;
    let request = Request { schemes, steps, orders, end, ..Request::default() };
    let mut told = Told { progress, failed: None };
    let found = py.detach(|| compared(&model.model, &request, &mut |words| told.tell(words)));
    told.failed.map_or(Ok(()), Err)?;
    let comparison = found.map_err(|error| match error {
        CompareError::Model(error) => model.refused(py, &error),
        other => raise(py, "AnalysisFailed", (other.to_string(),)),
    })?;
    let value = serde_json::to_value(&comparison).unwrap_or_default();
    Ok((json(py, &value)?, table::text(&comparison)))
}

/// Schemes by their words.
pub(crate) fn schemes_of(py: Python<'_>, words: &[String]) -> PyResult<Vec<Scheme>> {
    let named = |word: &String| {
        let value = serde_json::Value::String(word.clone());
        serde_json::from_value(value)
            .map_err(|error| raise(py, "AnalysisFailed", (format!("schemes: {error}"),)))
    };
    words.iter().map(named).collect()
}

/// Tells Python which part of a measurement begins.
struct Told {
    progress: Option<Py<PyAny>>,
    failed: Option<PyErr>,
}

impl Told {
    fn tell(&mut self, words: &str) {
        if let (None, Some(progress)) = (&self.failed, &self.progress) {
            self.failed = Python::attach(|py| progress.call1(py, (words,))).err();
        }
    }
}

/// The model file of a robot description: its text, what has no counterpart, the folder of meshes.
#[pyfunction]
#[pyo3(signature = (path, *, joints, free_base, density, repair_inertia, flags, step, end))]
#[allow(clippy::too_many_arguments)] // keywords of Python
fn import_robot(
    py: Python<'_>,
    path: PathBuf,
    joints: Vec<(String, f64)>,
    free_base: bool,
    density: Option<f64>,
    repair_inertia: bool,
    flags: [bool; 3],
    step: Option<f64>,
    end: f64,
) -> PyResult<(String, Vec<String>)> {
    let [armature, actuators, contacts] = flags;
    let options = ImportOptions {
        base: if free_base { Base::Free } else { Base::Fixed },
        values: joints.into_iter().map(|(joint, value)| JointValue { joint, value }).collect(),
        density,
        repair_inertia,
        armature,
        actuators,
        contacts,
        step,
        end,
        folder: path.parent().map(PathBuf::from),
        ..ImportOptions::default()
    };
    let imported = py.detach(|| translate(&path, &options)).map_err(|error| {
        let problems: Vec<String> = match &error {
            ImportError::Invalid { problems, .. } => {
                problems.iter().map(ToString::to_string).collect()
            }
            _ => Vec::new(),
        };
        raise(py, "ImportFailed", (error.to_string(), problems))
    })?;
    Ok((imported.text, imported.remarks.iter().map(ToString::to_string).collect()))
}

/// Values of a key: a list of texts, or a range.
#[derive(FromPyObject)]
pub(crate) enum Varied {
    Range(f64, f64),
    List(Vec<String>),
}

/// Keys with their values, how they are sampled, how many points, the seed.
pub(crate) type SweepOrder = (Vec<(String, Varied)>, String, Option<usize>, u64);

/// The values of the keys at all points of a sweep, as texts.
#[pyfunction]
fn plan(py: Python<'_>, order: SweepOrder) -> PyResult<Vec<Vec<String>>> {
    Ok(plan_of(py, order)?.values())
}

/// The points of a sweep.
pub(crate) fn plan_of(
    py: Python<'_>,
    (variations, sample, count, seed): SweepOrder,
) -> PyResult<Plan> {
    let variations = variations.into_iter().map(|(key, varied)| Variation {
        key,
        values: match varied {
            Varied::Range(from, to) => Values::Range { from, to },
            Varied::List(values) => Values::List(values),
        },
    });
    let sampling = PointSampling::ALL.into_iter().find(|sampling| sampling.name() == sample);
    let Some(sampling) = sampling else {
        return Err(no_word("sample", &sample, &PointSampling::ALL.map(PointSampling::name)));
    };
    let made = match (sampling, count) {
        (PointSampling::Grid, None) => Plan::grid(variations.collect()),
        (PointSampling::Grid, Some(_)) => {
            let words = "n is the number of samples, and a grid has none";
            let help = r#"write sample="random", "latin" or "sobol", or leave n out"#;
            return Err(raise(py, "HolonomError", (words, help)));
        }
        (_, None) => {
            let words = format!("how many samples `{sample}` takes is not said");
            return Err(raise(py, "HolonomError", (words, "add n=POINTS")));
        }
        (sampling, Some(count)) => Plan::samples(variations.collect(), sampling, count, seed),
    };
    made.map_err(|error| raise(py, "HolonomError", (error.message, error.help)))
}

/// Panics, so that tests see what becomes of it.
#[pyfunction]
#[pyo3(name = "_panic")]
fn panic(py: Python<'_>) {
    py.detach(|| panic!("asked for by a test"));
}

/// Refuses a build in which a panic ends the interpreter.
///
/// # Errors
/// The exception of the import.
#[pyfunction]
#[pyo3(name = "_refuse")]
pub(crate) fn refuse(aborts: bool) -> PyResult<()> {
    if !aborts {
        return Ok(());
    }
    let words = "this build of holonom ends the interpreter at a panic: build the wheel with the profile `unwinding`";
    Err(PyImportError::new_err(words))
}
