//! The gradient of the objectives of a model by its parameters, controls and initial values.
//!
//! ```text
//! J = Σ weight term        one run, one sweep backward, whatever the number of derivatives
//! dJ/dθ = a_0·δq_0 + b_0·δp̄_0 + explicit        dJ/dz, dJ/dż: the same of coordinates and rates
//! ```
//! The efforts of the controls are zero. [`Check`] compares with central differences of whole runs.

#[cfg(test)]
mod beam_models;
#[cfg(test)]
mod beam_shape_tests;
#[cfg(test)]
mod beam_tests;
#[cfg(test)]
mod bushing_tests;
mod check;
#[cfg(test)]
mod check_tests;
#[cfg(test)]
mod comparison;
#[cfg(test)]
mod contact_tests;
#[cfg(test)]
mod dual_tests;
pub(crate) mod equilibrium;
#[cfg(test)]
mod expression_tests;
#[cfg(test)]
mod force_models;
#[cfg(test)]
mod force_tests;
#[cfg(test)]
mod galerkin_tests;
pub(crate) mod growth;
pub(crate) mod objective;
pub(crate) mod prepared;
#[cfg(test)]
mod rolling_tests;
#[cfg(test)]
mod sampled_tests;
#[cfg(test)]
pub(crate) mod start_tests;
#[cfg(test)]
mod static_models;
#[cfg(test)]
mod static_tests;
#[cfg(test)]
mod tests;
pub(crate) mod trial;
#[cfg(test)]
mod turning_tests;

pub use check::Check;
pub use prepared::GradientFailure;

use crate::design::start::GivenJoint;
use crate::design::{self, LEAVE_OUT, ModelTangent, key_of, refused};
use crate::shown::depends_on;
use crate::start::independent::TreeCoordinate;
use crate::system::System;
use crate::system::outside::{ExternalActions, JointStart};
use growth::TermCosts;
use holonom_model::{Model, ModelError, ModelText, Override};
use objective::Costs;
pub(crate) use objective::Prices;
use prepared::{Begin, Prepared};
use serde::Serialize;
use trial::{InitialCoordinate, ModelStart};
use vi_control::checkpoints::Checkpoints;
use vi_control::gradient::{Gradient, Passing, SUSPECT, Task};
use vi_control::objective::Objective;
use vi_control::sensitivities::{Beside, Direction, Sensitivities};
use vi_multibody::design::start::{self, StartTangent};
use vi_multibody::joint_coordinate::JointCoordinate;

/// What derivatives are wanted.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Objectives by name, and numbers of sensors at the end (`tip.z`); all objectives where there
    /// are none.
    pub of: Vec<String>,
    /// By the parameters of the model file.
    pub parameters: bool,
    /// By these of them alone, or by numbers of the file by their keys (`body.arm.mass`), in this
    /// order; by all parameters where there are none.
    pub only: Vec<String>,
    /// By the efforts of controls.
    pub controls: bool,
    /// By initial coordinates and rates.
    pub initial: bool,
    /// By the length of all steps, at a fixed number of them.
    pub step: bool,
    /// The values of the controls, a list for each; zero where there is none.
    pub values: Vec<Vec<f64>>,
    /// Where joints begin; where the model states where there is none.
    pub start: JointStart,
}

impl Wanted {
    /// All derivatives of the sum of all objectives, at efforts of zero, but that by the step.
    #[must_use]
    pub fn everything() -> Self {
        let (of, values, start) = (Vec::new(), Vec::new(), JointStart::default());
        let only = Vec::new();
        Self {
            of,
            parameters: true,
            only,
            controls: true,
            initial: true,
            step: false,
            values,
            start,
        }
    }

    /// The tangents of the parameters that are wanted.
    fn tangents(
        &self,
        from: (&ModelText, &[Override], &Model),
        system: &System,
    ) -> Result<Vec<ModelTangent>, ModelError> {
        let (text, overrides, model) = from;
        let place = |name: &str| self.only.iter().position(|own| own == name);
        let wanted = |name: &str| self.only.is_empty() || place(name).is_some();
        parameters(text, overrides, &self.only)?; // each of them is one
        let of = (&self.only[..], text, overrides);
        let counts = |key: &str| self.counts(model, key);
        let mut found = design::tangents_of((of, model), system, wanted, counts)?;
        found.sort_by_key(|own| place(&own.name));
        Ok(found)
    }

    /// Whether the cost and the motion depend on a key: not on those of a search, of a fit, of
    /// other objectives, of sensors that no objective reads.
    fn counts(&self, model: &Model, key: &str) -> bool {
        let chosen = |name: &str| self.of.is_empty() || self.of.iter().any(|own| own == name);
        let parts: Vec<&str> = key.split('.').collect();
        match parts[..] {
            ["condition" | "optimize" | "identify" | "measurement", ..] => false,
            ["control", _, "min" | "max"] => false,
            ["objective", name, ..] => chosen(name),
            ["sensor", name, ..] => model.objectives.iter().any(|own| {
                let sensor = own.sensor.as_deref().and_then(|text| text.split('.').next());
                let read = |sensor: &str| depends_on(model, sensor, name);
                chosen(&own.name) && sensor.is_some_and(read)
            }),
            _ => true,
        }
    }

    /// Of an equilibrium derivatives are by parameters alone.
    ///
    /// # Errors
    /// [`ModelError`] where something else is asked for, or given.
    fn of_run(&self, prepared: &Prepared) -> Result<Self, ModelError> {
        if !prepared.system.stands {
            return Ok(self.clone());
        }
        let given = self.start != JointStart::default() || !self.values.is_empty() || self.step;
        if given || !self.parameters {
            let what = "an equilibrium by controls, by its step, or by where joints begin";
            let help = "ask for derivatives by parameters, or integrate a motion";
            return Err(refused("simulation.scheme", what, help));
        }
        Ok(Self { controls: false, initial: false, step: false, ..self.clone() })
    }

    fn outside(&self) -> ExternalActions {
        ExternalActions { start: self.start.clone(), ..ExternalActions::default() }
    }

    /// The joints whose start is given.
    fn given(&self, model: &Model) -> Vec<GivenJoint> {
        let JointStart { coordinates, rates } = &self.start;
        let mut given: Vec<GivenJoint> = Vec::new();
        let all = coordinates.iter().map(|own| (own, [true, false]));
        for ((name, freedom, _), of) in all.chain(rates.iter().map(|own| (own, [false, true]))) {
            let Some(joint) = model.joints.iter().position(|own| own.name == *name) else {
                continue;
            };
            let [coordinate, rate] = of;
            match given.iter_mut().find(|own| (own.joint, own.freedom) == (joint, *freedom)) {
                Some(own) => own.rate |= rate,
                None => given.push(GivenJoint { joint, freedom: *freedom, coordinate, rate }),
            }
        }
        given
    }
}

/// A derivative by a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ByParameter {
    /// The parameter.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// `dJ/dθ`, through the start as well.
    pub derivative: f64,
}

/// Derivatives by the start of a joint, or of what is free.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ByStart {
    /// The joint, the body or the particle.
    pub name: String,
    /// Which of its coordinates.
    pub freedom: usize,
    /// By the coordinate, at fixed rates.
    pub coordinate: f64,
    /// By the rate; `None` where it follows from others by constraints on velocities.
    pub rate: Option<f64>,
}

/// Derivatives by the values of a control.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ByControl {
    /// The control.
    pub name: String,
    /// One for each of its values.
    pub derivatives: Vec<f64>,
}

/// A term of the objective.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TermValue {
    /// Its name.
    pub name: String,
    /// Its value, with its weight.
    pub value: f64,
}

/// The equilibrium at the end of a path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EndEquilibrium {
    /// Time of the loads, s.
    pub t: f64,
    /// Directions in which it is unstable.
    pub unstable: usize,
}

/// The gradient of the objectives of a model.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ModelGradient {
    /// The model.
    pub model: String,
    /// Steps of the run.
    pub steps: usize,
    /// The step, s.
    pub step: f64,
    /// `J`.
    pub value: f64,
    /// Its terms.
    pub terms: Vec<TermValue>,
    /// By parameters.
    pub parameters: Vec<ByParameter>,
    /// By initial values.
    pub initial: Vec<ByStart>,
    /// By controls.
    pub controls: Vec<ByControl>,
    /// By the length of all steps, at a fixed number of them and fixed values of controls, where it
    /// was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by_step: Option<f64>,
    /// `max_n |δq_n|/|δq_0|` of a change of the start, by a neighbouring run, up to 1e6; `None`
    /// where derivatives do not grow along the sweep backward.
    pub growth: Option<f64>,
    /// From which time on derivatives say nothing of the mechanism, s.
    pub meaningless_from: Option<f64>,
    /// The equilibrium of which it is; `None` of a motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equilibrium: Option<EndEquilibrium>,
    /// Comparisons with central differences.
    pub checks: Vec<Check>,
}

impl ModelGradient {
    /// A word of warning where derivatives are meaningless.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        if let Some(own) = self.equilibrium.as_ref().filter(|own| own.unstable > 0) {
            let n = own.unstable;
            let ways = if n == 1 { "one direction" } else { &format!("{n} directions") };
            return Some(format!(
                "the equilibrium at t = {} s is unstable in {ways}: derivatives are exact, and no real system stays there",
                crate::digits::rounded(own.t, 6)
            ));
        }
        let t = self.meaningless_from?;
        Some(format!(
            "from t = {} s on a change of the start has grown by more than 1e6: derivatives of what comes later are exact and \
             say nothing of the mechanism; end the run earlier",
            crate::digits::rounded(t, 6)
        ))
    }
}

/// Parameters by their names, and numbers by their keys, with their values; where there are no
/// names, all numbers under `[parameters]` on which something depends.
///
/// # Errors
/// [`ModelError`] of a name that is none of these.
pub fn parameters(
    text: &ModelText,
    overrides: &[Override],
    names: &[String],
) -> Result<Vec<(String, f64)>, ModelError> {
    let known = text.tangents_of(overrides, names)?;
    if names.is_empty() {
        let moving = known.iter().filter(|own| !own.is_idle());
        return Ok(moving.map(|own| (own.name.clone(), own.value)).collect());
    }
    let one =
        |name: &String| Ok((name.clone(), design::number(&key_of(name), name, &known)?.value));
    names.iter().map(one).collect()
}

/// The gradient of the objectives of a model.
///
/// # Errors
/// [`GradientFailure`].
pub fn gradient(
    text: &ModelText,
    overrides: &[Override],
    model: &Model,
    wanted: &Wanted,
) -> Result<ModelGradient, GradientFailure> {
    let from = &objective::with_sensors(model, &wanted.of);
    objective::known(from, &wanted.of)?;
    if from.objectives.is_empty() {
        let help = "add an [[objective]]: effort, work, time, rate, sensor, value or momentum, or name a sensor by --of";
        return Err(refused("objective", "a gradient of nothing", help).into());
    }
    let (mut gradient, swelling) =
        sweep((text, overrides, from), wanted, (&Prices::default(), true))?;
    terms(from, wanted, &mut gradient)?;
    if swelling > SUSPECT {
        let outside = (&wanted.outside(), &wanted.values[..]);
        let own = growth::growth(model, outside, gradient.steps)?;
        (gradient.growth, gradient.meaningless_from) = (Some(own.largest), own.meaningless_from);
    }
    Ok(gradient)
}

/// The derivatives by parameters of the objectives of a model and of its conditions, as objectives,
/// at their prices.
///
/// # Errors
/// [`GradientFailure`].
pub(crate) fn priced(
    from: (&ModelText, &[Override], &Model),
    wanted: &Wanted,
    prices: &Prices,
) -> Result<Vec<ByParameter>, GradientFailure> {
    Ok(sweep(from, wanted, (prices, false))?.0.parameters)
}

/// One run forward and one backward, for a gradient that is shown with each of its terms or not,
/// and by how much derivatives swell.
fn sweep(
    (text, overrides, from): (&ModelText, &[Override], &Model),
    wanted: &Wanted,
    (prices, is_shown): (&Prices, bool),
) -> Result<(ModelGradient, f64), GradientFailure> {
    let mut prepared = Prepared::new(from, &wanted.of, &wanted.values, &wanted.outside())?;
    let own = prepared.model.clone();
    let model = &*own;
    let wanted = wanted.of_run(&prepared)?;
    let tangents = match wanted.parameters {
        true => wanted.tangents((text, overrides, model), &prepared.system)?,
        false => Vec::new(),
    };
    prepared.depend(&wanted.of, prices, &tangents)?;
    let begin = Begin::new(&mut prepared)?;
    let mut terms = match is_shown {
        true => TermCosts::new(&mut prepared, &wanted)?,
        false => TermCosts::default(),
    };
    let design = design::mechanism_design(&prepared.system, &begin.mass, &tangents)?;
    let mechanism = &prepared.system.mechanism;
    let of = begin.of(model, mechanism);
    let given = wanted.given(model);
    let changes: Vec<StartTangent> = match given.is_empty() {
        true => {
            let run = prepared.simulation.integrator();
            begin.changes(&of, run, &design, &tangents)?
        }
        false => begin.given(&of, &tangents, &given)?.parameters,
    };
    let coordinates = match wanted.initial {
        true => of.coordinates_with(&given)?,
        false => Vec::new(),
    };
    let controls = if wanted.controls { &model.controls[..] } else { &[] };
    let is_empty = tangents.is_empty() && coordinates.is_empty() && controls.is_empty();
    if is_shown && is_empty && !wanted.step {
        return Err(of_nothing(&wanted).into());
    }
    let plain: Vec<_> = coordinates.iter().map(|own| own.2.clone()).collect();
    let starts = match wanted.initial {
        true => start::derivatives(mechanism, &begin.mass, begin.rows(), begin.at(), &plain, &[])
            .map_err(|error| of.refusal(&error, &ModelTangent::default()))?,
        false => start::StartDerivatives::default(),
    };
    // run and sweep
    let design = (!tangents.is_empty()).then_some(&design as &dyn vi_constraints::design::Design);
    let task = Task {
        steps: prepared.steps,
        objective: &prepared.costs.sum,
        controls: &prepared.controls,
        design,
        by_step: wanted.step,
        checkpoints: Checkpoints::default(),
    };
    let run = prepared.simulation.integrator();
    let acting = &prepared.controls;
    let mut watch = |passing: Passing<'_>| terms.see(passing, acting);
    let found = Gradient::watched(run, &task, &mut watch).map_err(GradientFailure::Run)?;
    let run = &*run;
    let along = |own: &StartTangent, parameter: Option<&ModelTangent>| {
        found.initial.along(&begin.tangent(run, own, parameter))
    };
    let by_parameter = |(k, own): (usize, &ModelTangent)| ByParameter {
        name: own.name.clone(),
        value: own.value,
        derivative: along(&changes[k], Some(own))
            + found.parameters.get(k).copied().unwrap_or_default(),
    };
    let by_start = |(k, own): (usize, &TreeCoordinate)| ByStart {
        name: name_of(mechanism, own),
        freedom: own.1,
        coordinate: along(&starts.coordinates[k], None),
        rate: starts.is_free[k].then(|| along(&starts.rates[k], None)),
    };
    let step = model.settings.step;
    let rates = prepared.costs.rate_slopes(&prepared.controls, step);
    let by_control = |(k, own): (usize, &holonom_model::Control)| {
        let mut derivatives = vec![0.0; own.shape.values(own.hold, prepared.steps)];
        for (n, row) in found.controls.iter().enumerate() {
            for (value, weight) in own.shape.weights(own.hold, n) {
                if weight != 0.0 {
                    derivatives[value] += weight * (row[k] + rates[n][k]);
                }
            }
        }
        ByControl { name: own.name.clone(), derivatives }
    };
    let equilibrium = prepared.outside.still.as_ref();
    let equilibrium = equilibrium.map(|own| EndEquilibrium { t: begin.t, unstable: own.unstable });
    let gradient = ModelGradient {
        model: model.header.name.clone(),
        steps: prepared.steps,
        step,
        value: found.value + prepared.costs.rates(&prepared.controls, step),
        terms: terms.values(run.state(), &prepared.controls),
        parameters: tangents.iter().enumerate().map(by_parameter).collect(),
        initial: coordinates.iter().enumerate().map(by_start).collect(),
        controls: controls.iter().enumerate().map(by_control).collect(),
        by_step: found.step.map(|by| by + prepared.costs.rates_by_step(&prepared.controls, step)),
        growth: None,
        meaningless_from: None,
        equilibrium,
        checks: Vec::new(),
    };
    if let Some(own) = gradient.parameters.iter().find(|own| !own.derivative.is_finite()) {
        let what = format!(
            "the derivative by `{}`, which is no number: an expression has no slope where the motion leads",
            own.name
        );
        return Err(refused(&key_of(&own.name), what, LEAVE_OUT).into());
    }
    if prepared.system.mechanism.velocity_rows().next().is_some() {
        stay_redundant(model, &wanted, (&begin, &changes), &tangents)?;
    }
    Ok((gradient, found.swelling))
}

/// The refusal of derivatives by what a model does not have.
fn of_nothing(wanted: &Wanted) -> ModelError {
    let kinds = [
        (wanted.parameters, "parameters", "state numbers under [parameters] and read them"),
        (wanted.controls, "controls", "add a [[control]]"),
        (wanted.initial, "initial values", "leave a joint free to move"),
    ];
    let asked = kinds.iter().filter(|own| own.0);
    let names: Vec<&str> = asked.clone().map(|own| own.1).collect();
    let help: Vec<&str> = asked.map(|own| own.2).collect();
    let what = format!("derivatives by {}, of which there are none", names.join(" and "));
    let key = if wanted.controls && !wanted.parameters { "control" } else { "parameters" };
    refused(key, what, help.join(", or "))
}

/// What a tolerance of Newton's method leaves out of derivatives, in words; `None` without one.
#[must_use]
pub fn inexact(model: &Model) -> Option<String> {
    let tolerance = model.settings.newton_tolerance;
    (tolerance > 0.0).then(|| {
        format!(
            "simulation.newton_tolerance = {tolerance:e}: steps are solved to that, and derivatives are those of steps \
             that are solved exactly; leave it out"
        )
    })
}

/// Independent coordinates of joints at the start of a model, as derivatives are by them: joint,
/// which of its coordinates, its value (m, rad) and its rate, which is `None` where it follows from
/// others by constraints on velocities.
///
/// # Errors
/// [`ModelError`]: the model has no start, or something that is free has no joint.
pub fn initial_values(model: &Model) -> Result<Vec<(String, usize, f64, Option<f64>)>, ModelError> {
    let (chosen, is_free) = coordinates_and_rates(model, &ExternalActions::default())?;
    let stated = ModelStart::of(model)?;
    let one = |((joint, freedom), is_free): ((String, usize), bool)| {
        let both = InitialCoordinate::both(model, &joint, freedom);
        let [value, rate] = both.map(|own| stated.value(&own));
        Some((joint, freedom, value?, rate.filter(|_| is_free))) // each has them
    };
    Ok(chosen.into_iter().zip(is_free).filter_map(one).collect())
}

/// The joints and coordinates alone, at a start that is given from outside.
///
/// # Errors
/// As of [`initial_values`].
pub(crate) fn independent_coordinates(
    model: &Model,
    outside: &ExternalActions,
) -> Result<Vec<(String, usize)>, ModelError> {
    Ok(coordinates_and_rates(model, outside)?.0)
}

/// The same, and which of their rates are free.
fn coordinates_and_rates(
    model: &Model,
    outside: &ExternalActions,
) -> Result<(Vec<(String, usize)>, Vec<bool>), ModelError> {
    let mut prepared = Prepared::new(model, &[], &[], outside)?;
    let begin = Begin::new(&mut prepared)?;
    let mechanism = &prepared.system.mechanism;
    let of = begin.of(model, mechanism);
    let chosen = of.coordinates()?;
    let plain: Vec<_> = chosen.iter().map(|own| own.2.clone()).collect();
    let free = start::free_rates(mechanism, begin.rows(), begin.at(), &plain);
    let free = free.map_err(|error| of.refusal(&error.into(), &ModelTangent::default()))?;
    let one = |own: &TreeCoordinate| {
        let joint = own.0.map(|joint| &mechanism.description().joints[joint]);
        let joint = joint.filter(|joint| JointCoordinate::principal(joint, own.1).is_some());
        joint.map(|joint| (joint.name.clone(), own.1)).ok_or_else(|| {
            let name = name_of(mechanism, own);
            let what = format!("derivatives by the start of `{name}`, which has no joint");
            refused("joint", what, "hold it by a joint")
        })
    };
    let names = chosen.iter().map(one).collect::<Result<_, _>>()?;
    Ok((names, (0..chosen.len()).map(|k| free.contains(&k)).collect()))
}

/// The name of what a coordinate of the start is of.
fn name_of(mechanism: &vi_multibody::Mechanism, (joint, _, coordinate): &TreeCoordinate) -> String {
    let description = mechanism.description();
    match (joint, coordinate) {
        (Some(joint), _) => description.joints[*joint].name.clone(),
        (None, start::StartCoordinate::Place(i)) => mechanism.coordinate_name(*i).to_owned(),
        (None, start::StartCoordinate::Turn { frame, .. }) => {
            description.bodies[*frame].name.clone()
        }
        (None, start::StartCoordinate::Joint(_)) => String::new(),
    }
}

/// The values of the terms where the run of the gradient does not show them.
fn terms(model: &Model, wanted: &Wanted, out: &mut ModelGradient) -> Result<(), GradientFailure> {
    let names = growth::terms_of(model, wanted);
    if let [name] = names[..] {
        out.terms = vec![TermValue { name: name.clone(), value: out.value }];
    }
    if !out.terms.is_empty() {
        return Ok(());
    }
    let mut prepared = Prepared::new(model, &wanted.of, &wanted.values, &wanted.outside())?;
    let model = &*prepared.model;
    let costs: Result<Vec<Costs>, ModelError> = names
        .iter()
        .map(|name| {
            let parts = (&mut prepared.system, &*prepared.simulation.integrator());
            Costs::new(model, parts, std::slice::from_ref(*name), &[])
        })
        .collect();
    let costs = costs?;
    let values = prepared.values_of(&costs.iter().collect::<Vec<_>>())?;
    let term = |(name, value): (&&String, f64)| TermValue { name: (*name).clone(), value };
    out.terms = names.iter().zip(values).map(term).collect();
    Ok(())
}

/// Refuses parameters by which constraints on velocities that follow from others do not stay so
/// along the run: a sweep backward does not see rows that are left out.
fn stay_redundant(
    model: &Model,
    wanted: &Wanted,
    (begin, changes): (&Begin, &[StartTangent]),
    tangents: &[ModelTangent],
) -> Result<(), GradientFailure> {
    if !model.has_velocity_constraints() {
        return Ok(()); // equilibria have none
    }
    let mut prepared = Prepared::new(model, &wanted.of, &wanted.values, &wanted.outside())?;
    let mechanism = &prepared.system.mechanism;
    let left_out = |row: usize| begin.rows().redundant().any(|own| own == row);
    let scalars = 0..mechanism.description().scalars.len();
    let of_velocities: Vec<usize> = scalars
        .filter(|&k| {
            mechanism.velocity_rows().any(|(row, _)| mechanism.scalar_rows(k).contains(&row))
        })
        .collect();
    let moves = |own: &ModelTangent| {
        let scalars = &own.numbers.scalars;
        !own.numbers.joints.is_empty() || of_velocities.iter().any(|k| scalars.contains_key(k))
    };
    let touched: Vec<usize> = (0..tangents.len()).filter(|&k| moves(&tangents[k])).collect();
    if touched.is_empty() || !mechanism.velocity_rows().any(|(row, _)| left_out(row)) {
        return Ok(());
    }
    let design = design::mechanism_design(&prepared.system, &begin.mass, tangents)?;
    let run = prepared.simulation.integrator();
    let direction = |&k: &usize| Direction {
        start: begin.tangent(run, &changes[k], Some(&tangents[k])),
        parameter: Some(k),
        ..Direction::default()
    };
    let directions = touched.iter().map(direction).collect();
    let beside = Sensitivities::new(run, model.settings.step, directions);
    let mut beside = beside.map_err(GradientFailure::Run)?;
    for _ in 0..prepared.steps {
        let objective = &Objective::new();
        let with = Beside { controls: &prepared.controls, design: Some(&design), objective };
        beside.advance(run, with).map_err(GradientFailure::Run)?;
    }
    Ok(())
}
