//! Long data in segments: each begins at a state of its own, and the motions meet.
//!
//! ```text
//! minimise ½ Σ_j ρ_j(θ, x_j)ᵀρ_j(θ, x_j)      subject to  x_j⁺(θ, x_j) = x_{j+1}              [2.48]
//! x_j: independent joint coordinates and rates at the start of segment j, x_j⁺: where its motion ends
//! ```
//! A change of the unknown numbers grows over one segment alone, so sums of squares of long and of
//! chaotic motions keep one minimum. Where all segments meet, the motion is that of one run: the
//! fit of the whole motion goes on from there.

use super::IdentifyError;
use crate::design::refused;
use crate::gradient::independent_coordinates;
use crate::gradient::trial::{InitialCoordinate, ModelTrials, RunBeginning};
use holonom_model::{Constraint, Model};
use nalgebra::DMatrix;
use vi_control::constrained_least_squares::{Conditions, minimise};
use vi_control::identification::{MeasuredReading, MeasuredSeries, MotionResiduals};
use vi_control::least_squares::{FitError, LeastSquares, Parameter, Refused, Residuals};

/// The key that asks for them.
const KEY: &str = "identify.segments";
/// Iterations for the state of a segment.
const TRIES: usize = 20;

/// A part of the run.
struct RunSegment<'m> {
    /// Those of the data, then the state at the end.
    residuals: MotionResiduals<ModelTrials<'m>>,
    /// The places of its unknowns among all.
    unknowns: Vec<usize>,
    /// The number of its measured values.
    data: usize,
    /// Where the state of the next begins among all unknowns.
    next: Option<usize>,
}

/// The residuals of all segments; conditions are the last: that they meet.
pub(super) struct Segments<'m> {
    all: Vec<RunSegment<'m>>,
    /// The unknown numbers, then the states.
    parameters: Vec<Parameter>,
}

/// The fit of which the segments are.
pub(super) struct Whole<'a, 'm> {
    pub(super) model: &'a Model,
    pub(super) trials: &'a ModelTrials<'m>,
    pub(super) series: &'a [MeasuredSeries],
    pub(super) parameters: &'a [Parameter],
}

impl<'m> Segments<'m> {
    /// Of a fit, in this many segments of equal lengths. Parameters begin with the median of those
    /// that each segment has alone, states where they fit the data with these.
    pub(super) fn new(
        whole: &Whole<'_, 'm>,
        count: usize,
        interrupted: &mut dyn FnMut() -> bool,
    ) -> Result<Self, IdentifyError> {
        let Whole { model, trials, parameters, .. } = whole;
        let steps = usize::try_from(model.settings.steps()).unwrap_or(usize::MAX);
        refuse(model, count, steps)?;
        let theta: Vec<f64> = parameters.iter().map(|own| own.start).collect();
        begins_anew(trials, &theta)?;
        let begun = independent_coordinates(&trials.model(&theta)?, &trials.outside(&theta));
        let joints = begun.map_err(|_| {
            let what = "segments of a run in which something that moves has no joint";
            refused(KEY, what, "write segments = 1, or hold each body by a joint")
        })?;
        let both =
            |(joint, freedom): &(String, usize)| InitialCoordinate::both(model, joint, *freedom);
        let names = joints.iter().flat_map(both).collect();
        let nodes = (0..=count).map(|j| (j * steps + count / 2) / count).collect();
        let chain = SegmentChain { whole, joints, names, nodes };
        let Made { alone, .. } = chain.segments(parameters, interrupted)?;
        let of_model = trials.parameters.len();
        let mut held = parameters.to_vec();
        for (k, own) in held.iter_mut().enumerate().take(of_model) {
            own.start = median(alone.iter().map(|found| found[k]).collect());
            own.bounds = [own.start; 2];
        }
        let Made { all, mut parameters, .. } = chain.segments(&held, interrupted)?;
        for (own, free) in parameters.iter_mut().zip(&whole.parameters[..of_model]) {
            own.bounds = free.bounds;
        }
        Ok(Self { all, parameters })
    }

    /// The unknown numbers, then the states, where they begin.
    pub(super) fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }
}

/// Unknown numbers and states with which segments meet, as near to the data as can be; `first`: how
/// many of the parameters are numbers.
pub(super) fn meet(
    residuals: &mut dyn Residuals,
    parameters: &[Parameter],
    first: usize,
    max_steps: usize,
) -> Result<Vec<f64>, FitError> {
    let conditions =
        Conditions { bounds: vec![[0.0; 2]; parameters.len() - first], ..Conditions::default() };
    Ok(minimise(residuals, &conditions, parameters, max_steps, &mut |_| true)?.parameters)
}

/// What segments are made of.
struct SegmentChain<'a, 'b, 'm> {
    whole: &'a Whole<'b, 'm>,
    joints: Vec<(String, usize)>,
    names: Vec<InitialCoordinate>,
    nodes: Vec<usize>,
}

impl<'m> SegmentChain<'_, '_, 'm> {
    /// One after the other: each begins where the one before ends, as far as its data allow.
    fn segments(
        &self,
        parameters: &[Parameter],
        interrupted: &mut dyn FnMut() -> bool,
    ) -> Result<Made<'m>, IdentifyError> {
        let Self { whole: Whole { model, trials, series, .. }, joints, names, nodes } = self;
        let of_model = trials.parameters.len();
        let mut unknown = parameters.to_vec();
        let (mut all, mut alone, mut ends) = (Vec::new(), Vec::new(), SegmentEnds::default());
        for (j, pair) in nodes.windows(2).enumerate() {
            if interrupted() {
                return Err(IdentifyError::Interrupted);
            }
            let ([first, last], is_last) = ([pair[0], pair[1]], j + 2 == nodes.len());
            let mut own = ModelTrials { joints: joints.clone(), ..(*trials).clone() };
            let mut unknowns: Vec<usize> = (0..of_model).collect();
            if j == 0 {
                unknowns.extend(of_model..parameters.len());
            } else {
                let t = first as f64 * model.settings.step;
                own.from = RunBeginning { t, angles: std::mem::take(&mut ends.angles) };
                own.initial.clone_from(names);
                unknowns.extend((0..names.len()).map(|i| unknown.len() + i));
                unknown.extend(names.iter().zip(&ends.state).map(|(name, value)| {
                    let scale = value.abs().max(1.0);
                    Parameter { scale, ..Parameter::new(&name.name(), *value) }
                }));
            }
            let end = if is_last { usize::MAX } else { last };
            let mut parts: Vec<MeasuredSeries> =
                series.iter().map(|own| own.part(first..end)).collect();
            let data = parts.iter().map(|own| own.values.len()).sum();
            if !is_last {
                parts.extend(states(trials.reads.len(), joints.len(), last - first));
            }
            let residuals = MotionResiduals::new(own, parts).map_err(|error| run(&error))?;
            let next = (!is_last).then_some(unknown.len());
            let mut segment = RunSegment { residuals, unknowns, data, next };
            alone.push(segment.fit(&mut unknown, of_model));
            if !is_last {
                ends = segment.ends(&unknown, last - first)?;
            }
            all.push(segment);
        }
        Ok(Made { all, alone, parameters: unknown })
    }
}

/// Segments that were fitted one by one.
struct Made<'m> {
    all: Vec<RunSegment<'m>>,
    /// The parameters of the model that each has alone.
    alone: Vec<Vec<f64>>,
    /// The unknown numbers, then the states.
    parameters: Vec<Parameter>,
}

/// Refuses what has no segments.
fn refuse(model: &Model, count: usize, steps: usize) -> Result<(), IdentifyError> {
    if count > steps {
        let what = format!("{count} segments of {steps} steps");
        return Err(refused(KEY, what, "write fewer segments than steps").into());
    }
    let is_motion = |own: &&Constraint| matches!(own, Constraint::Motion { .. });
    if let Some(own) = model.constraints.iter().find(is_motion) {
        let what = format!("segments of a run with the prescribed motion `{}`", own.name());
        let help = "write segments = 1, or drive the joint by a motor that follows the path";
        return Err(refused(KEY, what, help).into());
    }
    if model.has_velocity_constraints() {
        let what = "segments of a run with constraints on velocities, whose rates are not all free";
        return Err(refused(KEY, what, "write segments = 1").into());
    }
    Ok(())
}

/// Coordinates and rates of joints at a node, as measurements; `first`: of the quantities.
fn states(first: usize, joints: usize, node: usize) -> impl Iterator<Item = MeasuredSeries> {
    let one = move |sensor: usize, reading: MeasuredReading| {
        let (steps, values) = (vec![node as f64], vec![0.0]);
        MeasuredSeries { sensor, reading, sigma: 1.0, steps, values }
    };
    (first..first + joints).flat_map(move |sensor| {
        [one(sensor, MeasuredReading::Value), one(sensor, MeasuredReading::Rate)]
    })
}

/// Refuses a state that is more than coordinates and rates.
fn begins_anew(trials: &ModelTrials<'_>, theta: &[f64]) -> Result<(), IdentifyError> {
    if trials.trial(theta)?.run.state().internal.is_empty() {
        return Ok(());
    }
    let what = "segments of a run whose state is more than joint coordinates and rates";
    let help = "write segments = 1: signals, works and forces with memory begin with the run";
    Err(refused(KEY, what, help).into())
}

/// Where a segment ends.
#[derive(Default)]
struct SegmentEnds {
    state: Vec<f64>,
    angles: Vec<f64>,
}

fn run(error: &dyn std::error::Error) -> IdentifyError {
    IdentifyError::Run(error.to_string())
}

impl RunSegment<'_> {
    /// Fits its unknowns to its data; they stay near to where they are as far as these say nothing.
    /// Where that fails, they stay. Those of the model.
    fn fit(&mut self, parameters: &mut [Parameter], of_model: usize) -> Vec<f64> {
        let near = |&k: &usize| {
            let own = &parameters[k];
            Parameter { prior: Some([own.start, own.scale]), ..own.clone() }
        };
        let free: Vec<Parameter> = self.unknowns.iter().map(near).collect();
        let mut alone = Alone { own: &mut self.residuals, data: self.data };
        match (LeastSquares { max_iterations: TRIES }).fit(&mut alone, &free) {
            Ok(found) => {
                for (&k, value) in self.unknowns.iter().zip(&found.parameters) {
                    parameters[k].start = *value;
                }
                found.parameters[..of_model].to_vec()
            }
            Err(_) => parameters[..of_model].iter().map(|own| own.start).collect(),
        }
    }

    /// The state and the angles where it ends.
    fn ends(
        &mut self,
        parameters: &[Parameter],
        steps: usize,
    ) -> Result<SegmentEnds, IdentifyError> {
        let theta: Vec<f64> = self.unknowns.iter().map(|&k| parameters[k].start).collect();
        let mut values = vec![0.0; self.residuals.len()];
        self.residuals.evaluate(&theta, &mut values, None).map_err(|error| run(&error))?;
        let mut trial = self.residuals.experiment().trial(&theta)?;
        for step in 0..steps {
            trial.controls.set(step);
            trial.run.step().map_err(|error| run(&error))?;
        }
        let angles = trial.run.state().angles.clone();
        Ok(SegmentEnds { state: values.split_off(self.data), angles })
    }
}

/// The residuals of the data of a segment.
struct Alone<'a, 'm> {
    own: &'a mut MotionResiduals<ModelTrials<'m>>,
    data: usize,
}

impl Residuals for Alone<'_, '_> {
    fn len(&self) -> usize {
        self.data
    }

    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused> {
        let mut values = vec![0.0; self.own.len()];
        let mut slopes = jacobian.is_some().then(|| DMatrix::zeros(values.len(), theta.len()));
        self.own.evaluate(theta, &mut values, slopes.as_mut())?;
        out.copy_from_slice(&values[..self.data]);
        if let (Some(jacobian), Some(slopes)) = (jacobian, slopes) {
            jacobian.copy_from(&slopes.rows(0, self.data));
        }
        Ok(())
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

impl Residuals for Segments<'_> {
    fn len(&self) -> usize {
        self.all.iter().map(|own| own.residuals.len()).sum()
    }

    fn evaluate(
        &mut self,
        theta: &[f64],
        out: &mut [f64],
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) -> Result<(), Refused> {
        let mut row = 0;
        let mut gap = self.all.iter().map(|own| own.data).sum::<usize>();
        if let Some(jacobian) = jacobian.as_deref_mut() {
            jacobian.fill(0.0);
        }
        for RunSegment { residuals, unknowns, data, next } in &mut self.all {
            let own: Vec<f64> = unknowns.iter().map(|&k| theta[k]).collect();
            let count = residuals.len();
            let mut values = vec![0.0; count];
            let mut slopes = jacobian.is_some().then(|| DMatrix::zeros(count, own.len()));
            residuals.evaluate(&own, &mut values, slopes.as_mut())?;
            let place = |i: usize| if i < *data { row + i } else { gap + i - *data };
            for (i, value) in values.iter().enumerate() {
                out[place(i)] = *value;
            }
            if let (Some(jacobian), Some(slopes)) = (jacobian.as_deref_mut(), &slopes) {
                for (i, own) in slopes.row_iter().enumerate() {
                    for (value, &k) in own.iter().zip(unknowns.iter()) {
                        jacobian[(place(i), k)] = *value;
                    }
                }
            }
            if let Some(first) = *next {
                for i in 0..count - *data {
                    out[gap + i] -= theta[first + i];
                    if let Some(jacobian) = jacobian.as_deref_mut() {
                        jacobian[(gap + i, first + i)] -= 1.0;
                    }
                }
            }
            row += *data;
            gap += count - *data;
        }
        Ok(())
    }
}
