//! Unknown numbers of a model from measurements of its motion: `[identify]`, `[[measurement]]`.
//!
//! ```text
//! text, overrides, data ── ModelTrials: a run with its tangents for any θ ── least squares ── Identified
//! ```
//! The unknowns: parameters of the model file, then coordinate and rate of each freedom of the
//! joints under `initial`.

#[cfg(test)]
mod beam_tests;
pub mod data;
#[cfg(test)]
mod reference_tests;
mod report;
mod segments;
#[cfg(test)]
mod segments_tests;
#[cfg(test)]
mod start_tests;
#[cfg(test)]
mod tests;

pub use data::{DataError, MeasuredColumn};
pub use report::{Combination, EstimatedNumber, FitOf, Identified, MeasuredRow};

use crate::design::{number, refused};
use crate::gradient::growth::growth;
use crate::gradient::trial::{
    InitialCoordinate, ModelStart, ModelTrials, ReadNumber, RunBeginning, SensorRead,
};
use crate::shown::reading;
use crate::system::outside::ExternalActions;
use holonom_model::{
    Measurement, Model, ModelError, ModelText, Override, ParameterTangent, Scheme,
};
use nalgebra::DMatrix;
use segments::{Segments, Whole};
use std::fmt::Write;
use vi_control::identification::{MeasuredSeries, MotionResiduals};
use vi_control::least_squares::{FitError, LeastSquares, Parameter, Refused, Residuals};
use vi_control::sensitivities::DerivativeGrowth;

/// Sizes of initial coordinates and rates below this count as 1.
const SMALL: f64 = 1e-6;

/// Why there is no estimate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// The model has none.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The data have none.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The run at the start of the method fails.
    #[error("at the start of the method: {0}")]
    Run(String),
    /// It was interrupted before the first run was complete.
    #[error("interrupted before the first run was complete")]
    Interrupted,
}

/// What is asked and told while the method works.
pub struct IdentificationWatch<'a> {
    /// Called before each run with its number, from 1.
    pub run: &'a mut dyn FnMut(usize),
    /// Asked before each run; `true` ends the method with what it has.
    pub interrupted: &'a mut dyn FnMut() -> bool,
}

impl std::fmt::Debug for IdentificationWatch<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Watch").finish_non_exhaustive()
    }
}

/// Residuals that are watched.
struct Watched<'a, 'w> {
    own: &'a mut dyn Residuals,
    /// None: to the end.
    watch: Option<&'a mut IdentificationWatch<'w>>,
    runs: usize,
    stopped: bool,
}

impl Residuals for Watched<'_, '_> {
    fn len(&self) -> usize {
        self.own.len()
    }
    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused> {
        self.runs += 1;
        if let Some(watch) = &mut self.watch {
            self.stopped = self.stopped || (watch.interrupted)();
            if self.stopped {
                self.runs -= 1;
                return Err(Refused("interrupted".to_owned()));
            }
            (watch.run)(self.runs);
        }
        self.own.evaluate(theta, out, jacobian)
    }
}

/// What was found, and the run with it.
#[derive(Clone, Debug)]
pub struct IdentifiedModel {
    /// The estimate in numbers.
    pub estimate: Identified,
    /// Measured beside computed values.
    pub rows: Vec<MeasuredRow>,
    /// The model with the estimates.
    pub model: Model,
    /// Where its joints begin, as far as that was unknown.
    pub start: ExternalActions,
    /// Whether the method was interrupted.
    pub interrupted: bool,
}

impl IdentifiedModel {
    /// `estimate.csv`: measured beside computed values, column after column.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut text = String::from("column,t,measured,computed,residual\n");
        for MeasuredRow { t, measurement, measured, computed, residual } in &self.rows {
            let column = &self.estimate.columns[*measurement].column;
            let _ = writeln!(text, "{column},{t},{measured},{computed},{residual}");
        }
        text
    }
}

/// What is fitted: runs for any unknown numbers, these, their residuals.
struct PreparedFit<'m> {
    trials: ModelTrials<'m>,
    parameters: Vec<Parameter>,
    residuals: MotionResiduals<ModelTrials<'m>>,
}

impl<'m> PreparedFit<'m> {
    fn new(
        text: &'m ModelText,
        overrides: &'m [Override],
        model: &Model,
        data: &[MeasuredColumn],
    ) -> Result<Self, IdentifyError> {
        let Some(wanted) = &model.identify else {
            let help = "add [identify] with parameters = { NAME = { start = … } }";
            return Err(refused("identify", "an estimate of nothing", help).into());
        };
        if model.settings.scheme == Scheme::Static {
            let help = "integrate a motion, or let `holonom optimize` bring sensors at the last equilibrium \
                        to targets";
            return Err(refused("simulation.scheme", "estimates along equilibria", help).into());
        }
        let names: Vec<String> = wanted.parameters.keys().cloned().collect();
        let known = text.tangents_of(overrides, &names)?;
        let mut parameters = Vec::new();
        for (name, own) in &wanted.parameters {
            parameters.push(unknown(name, own, &known)?);
        }
        let key = |i: usize| format!("measurement[{i}].sensor");
        let reads = model.measurements.iter().enumerate();
        let read = |(i, own): (usize, &Measurement)| {
            ReadNumber::Sensor(SensorRead { key: key(i), sensor: own.sensor.clone() })
        };
        let reads = reads.map(read);
        let mut trials = ModelTrials {
            text,
            overrides,
            parameters: names,
            initial: Vec::new(),
            reads: reads.collect(),
            joints: Vec::new(),
            from: RunBeginning::default(),
        };
        let theta: Vec<f64> = parameters.iter().map(|own| own.start).collect();
        for (own, value) in initial(&trials.model(&theta)?, &wanted.initial)? {
            let mut parameter = Parameter::new(&own.name(), value);
            parameter.scale = if value.abs() < SMALL { 1.0 } else { value.abs() };
            parameters.push(parameter);
            trials.initial.push(own);
        }
        let theta: Vec<f64> = parameters.iter().map(|own| own.start).collect();
        trials.trial(&theta)?; // a refusal has its key
        let mut series = Vec::new();
        for (sensor, (own, column)) in model.measurements.iter().zip(data).enumerate() {
            let steps = column.times.iter().map(|t| t / model.settings.step).collect();
            let reading = reading(model, &own.sensor);
            let values = column.values.clone();
            series.push(MeasuredSeries { sensor, reading, sigma: own.sigma, steps, values });
        }
        let residuals = MotionResiduals::new(trials.clone(), series)
            .map_err(|error| IdentifyError::Run(error.to_string()))?;
        Ok(Self { trials, parameters, residuals })
    }

    /// How much a change of the start grows up to the last value; at the estimate, or where the
    /// method started if that is more.
    fn growth(&self, theta: &[f64]) -> Result<DerivativeGrowth, ModelError> {
        let series = self.residuals.series().iter();
        let last = series.filter_map(|own| own.steps.last()).copied().fold(0.0, f64::max);
        let start: Vec<f64> = self.parameters.iter().map(|own| own.start).collect();
        let mut most = DerivativeGrowth::NONE;
        for theta in [theta, &start] {
            let (model, outside) = (self.trials.model(theta)?, self.trials.outside(theta));
            let own = growth(&model, (&outside, &[]), last.ceil() as usize)?;
            if own.largest > most.largest {
                most = own;
            }
        }
        Ok(most)
    }

    /// What segments are of.
    fn whole<'a>(&'a self, model: &'a Model) -> Whole<'a, 'm> {
        let Self { trials, parameters, residuals } = self;
        Whole { model, trials, series: residuals.series(), parameters }
    }
}

/// Finds the unknown numbers of a model from data, one column for each of its measurements.
///
/// # Errors
/// [`IdentifyError`].
pub fn identify(
    text: &ModelText,
    overrides: &[Override],
    model: &Model,
    data: &[MeasuredColumn],
    watch: &mut IdentificationWatch<'_>,
) -> Result<IdentifiedModel, IdentifyError> {
    let mut prepared = PreparedFit::new(text, overrides, model, data)?;
    let (segments, most) =
        model.identify.as_ref().map_or((1, 0), |own| (own.segments, own.max_iterations));
    let (mut runs, mut stopped) = (0, false);
    let mut begin = prepared.parameters.clone();
    if segments > 1 {
        let mut all = Segments::new(&prepared.whole(model), segments, watch.interrupted)?;
        let parameters = all.parameters().to_vec();
        let mut watched = Watched { own: &mut all, watch: Some(&mut *watch), runs, stopped };
        let met = segments::meet(&mut watched, &parameters, begin.len(), most);
        (runs, stopped) = (watched.runs, watched.stopped);
        let met =
            met.map_err(|error| if stopped { IdentifyError::Interrupted } else { refusal(error) })?;
        begin.iter_mut().zip(met).for_each(|(own, value)| own.start = value);
    }
    let max_iterations = if stopped { 0 } else { most };
    let watch = (!stopped).then_some(watch); // what was found is stated in any case
    let own = &mut prepared.residuals;
    let mut residuals = Watched { own, watch, runs, stopped: false };
    let fit = LeastSquares { max_iterations }.fit(&mut residuals, &begin);
    let fit = fit.map_err(|error| match residuals.stopped {
        true => IdentifyError::Interrupted,
        false => refusal(error),
    })?;
    let (runs, interrupted) = (residuals.runs, residuals.stopped || stopped);
    let growth = match interrupted {
        true => DerivativeGrowth::NONE, // to end soon
        false => prepared.growth(&fit.parameters)?,
    };
    let PreparedFit { trials, parameters, .. } = prepared;
    let ended = (&fit, interrupted, runs);
    let (estimate, rows) = report::of(model, &parameters, data, ended, growth);
    let model = trials.model(&fit.parameters)?;
    let start = trials.outside(&fit.parameters);
    Ok(IdentifiedModel { estimate, rows, model, start, interrupted })
}

/// What a method that does not begin says of model and data.
fn refusal(error: FitError) -> IdentifyError {
    match error {
        FitError::Idle(name) => {
            let what = format!("an estimate of `{name}`: nothing that is measured depends on it");
            refused(&key_of(&name), what, "measure what depends on it, or leave it out").into()
        }
        FitError::TooFew { residuals, parameters } => {
            let message =
                format!("there are {residuals} measured values for {parameters} unknown numbers");
            let help = "measure more, or state what is known as a `prior`".to_owned();
            DataError { message, help }.into()
        }
        error => IdentifyError::Run(error.to_string()),
    }
}

/// The key of an unknown number; those of the start are `JOINT.coordinate`, `JOINT.rate`.
fn key_of(name: &str) -> String {
    match name.split('.').nth(1) {
        Some("coordinate" | "rate") => "identify.initial".to_owned(),
        _ => format!("identify.parameters.{name}"),
    }
}

/// A parameter of the model file that is unknown.
fn unknown(
    name: &str,
    own: &holonom_model::Unknown,
    known: &[ParameterTangent],
) -> Result<Parameter, ModelError> {
    let key = format!("identify.parameters.{name}");
    let found = number(&key, name, known)?;
    let mut parameter = Parameter::new(name, own.start.unwrap_or(found.value));
    let [min, max] = [own.min.unwrap_or(f64::NEG_INFINITY), own.max.unwrap_or(f64::INFINITY)];
    if !(min..=max).contains(&parameter.start) {
        let what = format!("the start {} of `{name}`, outside its bounds", parameter.start);
        return Err(refused(&key, what, "write `start`, between `min` and `max`"));
    }
    parameter.bounds = [min, max];
    parameter.prior = own.prior.map(|prior| [prior.value, prior.sigma]);
    Ok(parameter)
}

/// Coordinates and rates of joints at the start, with the values that the model states.
fn initial(model: &Model, joints: &[String]) -> Result<Vec<(InitialCoordinate, f64)>, ModelError> {
    let mut found = Vec::new();
    if joints.is_empty() {
        return Ok(found);
    }
    let stated = ModelStart::of(model)?;
    for name in joints {
        let count = model.joint(name).map_or(0, |joint| joint.pair().coordinate_count());
        for freedom in 0..count {
            for own in InitialCoordinate::both(model, name, freedom) {
                let value = stated.value(&own).ok_or_else(|| {
                    let what = format!("an estimate of the start of `{name}`");
                    refused("identify.initial", what, "name a joint that slides or turns")
                })?;
                found.push((own, value));
            }
        }
    }
    Ok(found)
}
