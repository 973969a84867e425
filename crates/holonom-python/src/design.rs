//! Gradients of objectives, unknown numbers from measurements, optima.

use crate::errors::{json, raise};
use crate::method::PythonMethod;
use crate::model::Model;
use crate::verbs::VerbAnswer;
use crate::watch;
use holonom::gradient::{GradientFailure, Wanted, initial_values, parameters};
use holonom::identification::{IdentificationWatch, IdentifyError, data};
use holonom::optimize::{FoundOptimum, OptimizeFailure, SearchProgress, optimize_by_own_method};
use holonom::report::optimum_page;
use holonom::system::outside::JointStart;
use holonom_cli::text;
use pyo3::prelude::*;
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// A coordinate of a joint with a value.
type GivenValue = (String, usize, f64);
/// An optimum beside its numbers: its model, the values of controls, multipliers of the balances,
/// the table of iterations, the page.
type Optimal = (String, Vec<Vec<f64>>, Vec<Vec<f64>>, String, String);
/// A measured value: which measurement, time, measured, computed, residual.
type FittedRow = (usize, f64, f64, f64, f64);

/// Adds these functions.
pub(crate) fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(gradient, module)?)?;
    module.add_function(wrap_pyfunction!(numbers, module)?)?;
    module.add_function(wrap_pyfunction!(initial, module)?)?;
    module.add_function(wrap_pyfunction!(inexact, module)?)?;
    module.add_function(wrap_pyfunction!(identify, module)?)?;
    module.add_function(wrap_pyfunction!(optimize, module)?)
}

/// By what derivatives are wanted, and where.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct DerivativeRequest {
    of: Vec<String>,
    parameters: Vec<String>,
    initial: bool,
    step: bool,
    controls: Option<Vec<Vec<f64>>>,
    coordinates: Vec<GivenValue>,
    rates: Vec<GivenValue>,
}

/// What `holonom gradient` finds, at values of controls and at a start of joints.
#[pyfunction]
fn gradient<'py>(
    py: Python<'py>,
    model: &Model,
    at: DerivativeRequest,
) -> PyResult<VerbAnswer<'py>> {
    let wanted = Wanted {
        of: at.of,
        parameters: !at.parameters.is_empty(),
        only: at.parameters,
        controls: at.controls.is_some(),
        initial: at.initial,
        step: at.step,
        values: at.controls.unwrap_or_default(),
        start: JointStart { coordinates: at.coordinates, rates: at.rates },
    };
    let found = py.detach(|| {
        holonom::gradient::gradient(&model.text, &model.overrides, &model.model, &wanted)
    });
    let found = found.map_err(|error| match error {
        GradientFailure::Model(error) => model.refused(py, &error),
        error => raise(py, "AnalysisFailed", (error.to_string(),)),
    })?;
    let value = serde_json::to_value(&found).unwrap_or_default();
    Ok((json(py, &value)?, text::gradient(&found)))
}

/// Parameters by their names with their values; all that are numbers where there are no names.
#[pyfunction]
fn numbers(py: Python<'_>, model: &Model, names: Vec<String>) -> PyResult<Vec<(String, f64)>> {
    parameters(&model.text, &model.overrides, &names).map_err(|error| model.refused(py, &error))
}

/// Independent coordinates of joints at the start: joint, which of its coordinates, value, rate.
#[pyfunction]
fn initial(py: Python<'_>, model: &Model) -> PyResult<Vec<(String, usize, f64, Option<f64>)>> {
    initial_values(&model.model).map_err(|error| model.refused(py, &error))
}

/// What a tolerance of Newton's method leaves out of derivatives, in words.
#[pyfunction]
fn inexact(model: &Model) -> Option<String> {
    holonom::gradient::inexact(&model.model)
}

/// What `holonom identify` finds from the text of a file of data, and the values beside one
/// another.
#[pyfunction]
fn identify<'py>(
    py: Python<'py>,
    model: &Model,
    name: &str,
    content: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<(VerbAnswer<'py>, Vec<FittedRow>)> {
    let wrong = |message: String, help: String| raise(py, "AnalysisFailed", (message, help));
    let columns = match model.model.identify {
        Some(_) => data::read(name, content, &model.model)
            .map_err(|error| wrong(error.message, error.help))?,
        None => Vec::new(), // refused below
    };
    let (found, asked) = py.detach(|| {
        let asked = RefCell::new(watch::Watch::new(progress));
        let runs = Cell::new(0);
        let mut run = |number: usize| runs.set(number as u64);
        let mut interrupted = || !asked.borrow_mut().proceed(runs.get(), u64::MAX);
        let mut watch = IdentificationWatch { run: &mut run, interrupted: &mut interrupted };
        let Model { text, overrides, model } = model;
        let found = holonom::identification::identify(text, overrides, model, &columns, &mut watch);
        (found, asked.into_inner())
    });
    asked.stopped()?;
    let found = found.map_err(|error| match error {
        IdentifyError::Model(error) => model.refused(py, &error),
        IdentifyError::Data(error) => wrong(error.message, error.help),
        error => wrong(error.to_string(), "start nearer to the truth".into()),
    })?;
    let value = serde_json::to_value(&found.estimate).unwrap_or_default();
    let rows = found.rows.iter();
    let rows = rows.map(|own| (own.measurement, own.t, own.measured, own.computed, own.residual));
    Ok(((json(py, &value)?, text::identified(&found.estimate)), rows.collect()))
}

/// What `holonom optimize` finds, by a method of Python where one is given.
#[pyfunction]
fn optimize<'py>(
    py: Python<'py>,
    model: &Model,
    method: Option<Py<PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(VerbAnswer<'py>, Optimal)> {
    let (found, asked, raised) = py.detach(|| {
        let asked = Rc::new(RefCell::new(watch::Watch::new(progress)));
        let told = asked.clone();
        let each =
            move |at: &SearchProgress| told.borrow_mut().proceed(at.iteration as u64, u64::MAX);
        let each: holonom::optimize::SearchWatch = Rc::new(RefCell::new(each));
        let Model { text, overrides, model } = model;
        let Some(function) = &method else {
            let found = optimize_by_own_method(text, overrides, model, None, &each);
            return (found, asked.replace(watch::Watch::new(None)), None);
        };
        let mut method = PythonMethod { function, raised: None };
        let found =
            holonom::optimize::optimize((text, overrides, model), Some(&mut method), None, &each);
        (found, asked.replace(watch::Watch::new(None)), method.raised)
    });
    asked.stopped()?;
    raised.map_or(Ok(()), Err)?;
    let found = found.map_err(|error| match error {
        OptimizeFailure::Model(error) => model.refused(py, &error),
        error => raise(py, "AnalysisFailed", (error.to_string(),)),
    })?;
    let value = serde_json::to_value(&found.report).unwrap_or_default();
    let words = text::optimum(&found.report);
    let page = optimum_page(&model.model, &found, "", "holonom.optimize");
    let iterations = found.iterations();
    let FoundOptimum { model, controls, costates, .. } = found;
    Ok(((json(py, &value)?, words), (model.to_toml(), controls, costates, iterations, page)))
}
