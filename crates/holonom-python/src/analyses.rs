//! Modes, critical loads, Campbell diagrams, harmonic responses, costs of steps: the JSON, the
//! words and the pages of the program.

use crate::errors::{json, no_word, raise};
use crate::model::Model;
use crate::verbs::{VerbAnswer, schemes_of};
use holonom::Simulation;
use holonom::bench::{BenchRequest, bench as measured};
use holonom::model::Scheme;
use holonom::modes::{About, Campbell, ModalAnalysis, ModesError, Report};
use holonom::report::{campbell_page, mode_page, response_page};
use holonom::response::{AddedDamping, Band, Response, ResponseError, ResponseInput};
use holonom_cli::text;
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

/// Adds these functions.
pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(modes, module)?)?;
    module.add_function(wrap_pyfunction!(modes_page, module)?)?;
    module.add_function(wrap_pyfunction!(campbell, module)?)?;
    module.add_function(wrap_pyfunction!(campbell_page_of, module)?)?;
    module.add_function(wrap_pyfunction!(response, module)?)?;
    module.add_function(wrap_pyfunction!(response_page_of, module)?)?;
    module.add_function(wrap_pyfunction!(sense, module)?)?;
    module.add_function(wrap_pyfunction!(costs, module)?)
}

fn about(word: &str) -> PyResult<About> {
    Ok(match word {
        "start" => About::Start,
        "static" => About::Static,
        "rotation" => About::Rotation,
        "motion" => About::Motion,
        other => return Err(no_word("at", other, &["start", "static", "rotation", "motion"])),
    })
}

fn no_modes(py: Python<'_>, model: &Model, error: ModesError) -> PyErr {
    match error {
        ModesError::Model(error) => model.refused(py, &error),
        other => raise(py, "AnalysisFailed", text::no_modes(other)),
    }
}

fn report_of(
    py: Python<'_>,
    model: &Model,
    at: &str,
    count: usize,
    buckling: bool,
) -> PyResult<Report> {
    let about = about(at)?;
    let found = py.detach(|| {
        if buckling {
            return ModalAnalysis::of_loads(&model.model, about)?.buckling(count);
        }
        ModalAnalysis::new(&model.model, about)?.modes(count)
    });
    found.map_err(|error| no_modes(py, model, error))
}

/// What `holonom modes` finds, `count` of them, about the start, an equilibrium, a rotation or a
/// motion; with `buckling` critical loads.
#[pyfunction]
fn modes<'py>(
    py: Python<'py>,
    model: &Model,
    at: &str,
    count: usize,
    buckling: bool,
) -> PyResult<VerbAnswer<'py>> {
    let report = report_of(py, model, at, count, buckling)?;
    let value = serde_json::to_value(&report).unwrap_or_default();
    Ok((json(py, &value)?, text::modes(&report, count)))
}

/// The page of the same.
#[pyfunction]
fn modes_page(
    py: Python<'_>,
    model: &Model,
    at: &str,
    count: usize,
    buckling: bool,
) -> PyResult<String> {
    let report = report_of(py, model, at, count, buckling)?;
    let page = py.detach(|| mode_page(&model.model, &report, "holonom.modes"));
    page.map_err(|error| model.refused(py, &error))
}

fn diagram(py: Python<'_>, model: &Model, speeds: &[f64], count: usize) -> PyResult<Campbell> {
    let found = py.detach(|| Campbell::new(&model.model, speeds, count));
    found.map_err(|error| no_modes(py, model, error))
}

/// What `holonom modes --speeds` finds; `speeds` in rad/s.
#[pyfunction]
fn campbell<'py>(
    py: Python<'py>,
    model: &Model,
    speeds: Vec<f64>,
    count: usize,
) -> PyResult<VerbAnswer<'py>> {
    let found = diagram(py, model, &speeds, count)?;
    let value = serde_json::to_value(&found).unwrap_or_default();
    Ok((json(py, &value)?, text::campbell(&found)))
}

/// The page of the same.
#[pyfunction]
#[pyo3(name = "campbell_page")]
fn campbell_page_of(
    py: Python<'_>,
    model: &Model,
    speeds: Vec<f64>,
    count: usize,
) -> PyResult<String> {
    let found = diagram(py, model, &speeds, count)?;
    Ok(campbell_page(&model.model, &found, "holonom.campbell"))
}

/// What excites, where, about which state, with which damping beside that of the model.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct ExcitationRequest {
    inputs: Vec<String>,
    band: (f64, f64, usize),
    at: String,
    rayleigh: (f64, f64),
    ratios: Vec<f64>,
}

fn response_of(py: Python<'_>, model: &Model, asked: ExcitationRequest) -> PyResult<Response> {
    let ExcitationRequest { inputs, band: (low, high, count), at, rayleigh, ratios } = asked;
    let wrong = |words: String| raise(py, "AnalysisFailed", (words,));
    let inputs: Vec<ResponseInput> = inputs
        .iter()
        .map(|text| text.parse().map_err(|help| wrong(format!("`{text}` is no input: {help}"))))
        .collect::<PyResult<_>>()?;
    let band = Band::new([low, high], count).map_err(|words| wrong(words.into()))?;
    let damping =
        AddedDamping::new([rayleigh.0, rayleigh.1], ratios).map_err(|words| wrong(words.into()))?;
    let about = about(&at)?;
    let found = py.detach(|| Response::new(&model.model, about, &inputs, &band, &damping));
    found.map_err(|error| match error {
        ResponseError::Modes(ModesError::Model(error)) => model.refused(py, &error),
        other => raise(py, "AnalysisFailed", text::no_response(other)),
    })
}

/// What `holonom response` finds.
#[pyfunction]
fn response<'py>(
    py: Python<'py>,
    model: &Model,
    asked: ExcitationRequest,
) -> PyResult<VerbAnswer<'py>> {
    let found = response_of(py, model, asked)?;
    let value = serde_json::to_value(&found).unwrap_or_default();
    Ok((json(py, &value)?, text::response(&found)))
}

/// The page of the same.
#[pyfunction]
#[pyo3(name = "response_page")]
fn response_page_of(py: Python<'_>, model: &Model, asked: ExcitationRequest) -> PyResult<String> {
    let found = response_of(py, model, asked)?;
    Ok(response_page(&model.model, &found, "holonom.response"))
}

/// What a sensor of a model measures at configurations `(K, n)` at times `(K,)`: row after row.
#[pyfunction]
fn sense<'py>(
    py: Python<'py>,
    model: &Model,
    sensor: &str,
    t: PyReadonlyArray1<'py, f64>,
    q: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (t, q) = (t.as_slice()?, q.as_slice()?);
    let run = py.detach(|| Simulation::new(&model.model));
    let mut run = run.map_err(|error| model.refused(py, &error))?;
    let found = py.detach(|| run.sense_configurations(sensor, t, q));
    let found = found.map_err(|words| raise(py, "AnalysisFailed", (words,)))?;
    Ok(PyArray1::from_vec(py, found))
}

/// What `holonom bench` measures.
#[pyfunction]
#[pyo3(name = "bench")]
fn costs<'py>(
    py: Python<'py>,
    model: &Model,
    schemes: Vec<String>,
    steps: u64,
) -> PyResult<VerbAnswer<'py>> {
    let schemes = schemes_of(py, &schemes)?;
    let own = [model.model.settings.scheme];
    if (if schemes.is_empty() { &own[..] } else { &schemes }).contains(&Scheme::Static) {
        let words = "`static` computes equilibria, no motion: it has no steps";
        return Err(raise(py, "AnalysisFailed", (words, r#"write schemes=["nodal"]"#)));
    }
    if steps == 0 {
        return Err(raise(py, "AnalysisFailed", ("steps: at least 1",)));
    }
    let request = BenchRequest { schemes, steps };
    let found = py.detach(|| measured(&model.model, &request));
    let found = found.map_err(|error| model.refused(py, &error))?;
    let value = serde_json::to_value(&found).unwrap_or_default();
    Ok((json(py, &value)?, found.table()))
}
