//! Expressions along the run by a parameter: laws, bushings, histories of loads.
//!
//! ```text
//! τ = e(θ; t, x, v, …)        τ_θ = e_θ, the expression of [`slope`], in the place of e
//! ```
//! A force whose expressions are replaced by their derivatives is the derivative of the force: all
//! of them act in it linearly. Signals that are values count as what they stand for.

use super::signals::{SampledSlopes, SignalChanges, SignalsApart};
use super::{LEAVE_OUT, ModelTangent, NumberChain, refused};
use crate::system;
use crate::system::outside::ExternalActions;
use crate::system::signal::sampler::Gains;
use holonom_model::expression::{Moving, slope};
use holonom_model::{
    Bushing, Coefficients, Constraint, Curves, Formula, Model, ModelError, MovingText,
    ParameterTangent, Signal, Slopes,
};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use vi_multibody::builder::ForceElements;
use vi_multibody::design::{MechanismTangent, ScalarTangent, SignalTangent, WholeForce};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::scalar_constraint::ScalarRow;

/// The expressions that a parameter changes.
pub(super) struct Formulas<'a> {
    parameter: &'a ParameterTangent,
    curves: &'a Curves<'a>,
    apart: SignalsApart,
    /// Signals that are values and change.
    signals: BTreeMap<String, Moving>,
    states: SignalChanges,
    taken: RefCell<BTreeSet<String>>,
}

impl<'a> Formulas<'a> {
    /// Those of a model.
    ///
    /// # Errors
    /// [`ModelError`] where a signal has no derivative.
    pub(super) fn new(
        parameter: &'a ParameterTangent,
        model: &'a Model,
        curves: &'a Curves<'a>,
        slopes: &Slopes<'_>,
    ) -> Result<Self, ModelError> {
        let apart = SignalsApart::new(parameter, model, slopes);
        let (signals, states, taken) = Default::default();
        let mut own = Self { parameter, curves, apart, signals, states, taken };
        let all = own.apart.signals.clone();
        // each after those it reads: there are no circles
        for _ in &all {
            for signal in all.iter().filter(|own| own.every.is_none()) {
                let Some(value) = &signal.value else { continue };
                let key = format!("signal.{}.value", signal.name);
                let Some(Formula(slope)) = own.slope(&key, value)? else { continue };
                let value = signal.name.clone();
                own.signals.insert(signal.name.clone(), Moving { value, slope });
            }
        }
        for signal in &all {
            own.states_of(signal, model, slopes)?;
        }
        Ok(own)
    }

    /// The states of a signal: their rates and starts; what it samples, or keeps for later.
    fn states_of(
        &mut self,
        signal: &Signal,
        model: &Model,
        slopes: &Slopes<'_>,
    ) -> Result<(), ModelError> {
        let key = |part: &str| format!("signal.{}.{part}", signal.name);
        if let Some(rate) = &signal.rate {
            let slope = self.slope(&key("rate"), rate)?;
            let start = self.start_of(signal, model, slopes);
            self.states.push(slope, start);
        }
        if signal.every.is_none() && signal.delay.is_none() {
            return Ok(());
        }
        let mut own = SampledSlopes { signal: signal.name.clone(), ..SampledSlopes::default() };
        for (part, formula) in signal.formulas() {
            // what was held is read by the name of the signal
            let held = |name: &str| if name == "last" { &signal.name } else { name }.to_owned();
            let slope = self.slope(&key(part), formula)?;
            let slope = slope.map(|slope| slope.renamed(&mut |name| held(name)));
            *if part == "pid.feedforward" { &mut own.ahead } else { &mut own.of } = slope;
        }
        let mut number = |part: &str, value: f64| slopes.number(&key(part), value);
        if let Some(pid) = &signal.pid {
            own.numbers = Gains::of(pid, &mut number).slopes();
        }
        own.start = number("start", signal.start.unwrap_or(0.0)).eps;
        self.states.push_sampled(own);
        Ok(())
    }

    /// How what a state begins with changes: as it is stated, or as what a controller filters.
    fn start_of(&self, signal: &Signal, model: &Model, slopes: &Slopes<'_>) -> Option<Formula> {
        let name = &signal.name;
        if let Some(stated) = model.signals.iter().find(|own| own.name == *name) {
            let start = stated.start.unwrap_or(0.0);
            let slope = slopes.number(&format!("signal.{name}.start"), start).eps;
            return (slope != 0.0).then(|| Formula(format!("({slope:?})")));
        }
        let filtered = name.strip_suffix(".d").map(|of| format!("{of}.e"))?;
        self.signals.get(&filtered).map(|moving| Formula(moving.slope.clone()))
    }

    /// The signals of the model, those with states taken apart.
    pub(super) fn apart(&self) -> &[Signal] {
        &self.apart.signals
    }

    /// How the states of signals change; `None` where they do not.
    pub(super) fn watched(&self) -> Option<Vec<Option<Formula>>> {
        self.states.watched()
    }

    /// Whether no expression changes.
    fn is_empty(&self) -> bool {
        let still = self.signals.is_empty() && self.watched().is_none();
        self.parameter.formulas.is_empty() && still
    }

    pub(super) fn name(&self) -> &str {
        &self.parameter.name
    }

    /// The derivative of the expression at a key path; `None` where it does not change.
    ///
    /// # Errors
    /// [`ModelError`] where it has none.
    pub(super) fn slope(
        &self,
        path: &str,
        formula: &Formula,
    ) -> Result<Option<Formula>, ModelError> {
        let of_part = self.apart.keys.get(path).into_iter().flatten().cloned();
        self.taken.borrow_mut().extend(of_part.chain([path.to_owned()]));
        let none = MovingText { text: formula.0.clone(), moving: BTreeMap::new() };
        let own = self.apart.texts.get(path).or_else(|| self.parameter.formulas.get(path));
        let own = own.unwrap_or(&none);
        let mut moving = own.moving.clone();
        moving.extend(self.signals.iter().map(|(name, signal)| (name.clone(), signal.clone())));
        if moving.is_empty() {
            return Ok(None);
        }
        let found = slope(&own.text, &mut |name| self.curves.known(name), &moving);
        found.map(|text| text.map(Formula)).map_err(|error| {
            let what = format!("the derivative by `{}`: {error}", self.name());
            refused(path, what, format!("state a number there, or {LEAVE_OUT}"))
        })
    }

    /// The same of a sensor; where it has none, it is left for whoever reads it to refuse.
    pub(super) fn sensor(&self, path: &str, formula: &Formula) -> Option<Formula> {
        let found = self.slope(path, formula);
        if found.is_err() {
            self.taken.borrow_mut().remove(path);
        }
        found.ok().flatten()
    }

    /// The same of a number of a section that holds expressions, too.
    fn entry(
        &self,
        path: &str,
        number: f64,
        formula: &Formula,
    ) -> Result<Option<Formula>, ModelError> {
        match number {
            0.0 => self.slope(path, formula),
            slope => Ok(Some(Formula(format!("{slope:?}")))),
        }
    }

    /// Expressions that change and that nobody has taken.
    pub(super) fn left(&self) -> Vec<String> {
        let taken = self.taken.borrow();
        self.parameter.formulas.keys().filter(|key| !taken.contains(*key)).cloned().collect()
    }
}

/// Zero, but reading what is read.
fn still(formula: &mut Formula) {
    formula.0 = format!("0*({})", formula.0);
}

/// Replaces expressions by their derivatives, those that do not change by zero; whether one does.
fn replace<'f>(
    formulas: impl Iterator<Item = (String, &'f mut Formula)>,
    slope: impl Fn(&str, &Formula) -> Result<Option<Formula>, ModelError>,
) -> Result<bool, ModelError> {
    let mut moves = false;
    for (path, formula) in formulas {
        match slope(&path, formula)? {
            Some(found) => (*formula, moves) = (found, true),
            None => still(formula),
        }
    }
    Ok(moves)
}

impl NumberChain<'_> {
    /// Forces of which an expression changes.
    pub(super) fn expressions(&self, found: &mut ModelTangent) -> Result<(), ModelError> {
        let histories = self
            .model
            .loads
            .iter()
            .any(|load| self.slopes.touches(&format!("load.{}.history", load.name)));
        let rates =
            self.model.constraints.iter().any(|own| matches!(own, Constraint::Velocity { .. }));
        let numbers = histories || rates || !self.model.bushings.is_empty();
        if self.formulas.is_empty() && !numbers {
            return Ok(());
        }
        let mut derived = self.model.clone();
        derived.signals = self.formulas.apart().to_vec();
        found.signals.clone_from(&derived.signals);
        let mut changed = BTreeSet::new();
        for law in &mut derived.laws {
            let key = format!("law.{}", law.name);
            let single = [("effort", &mut law.effort), ("tension", &mut law.tension)];
            let single = single
                .into_iter()
                .filter_map(|(part, own)| Some((format!("{key}.{part}"), own.as_mut()?)));
            let several = [("force", &mut law.force), ("torque", &mut law.torque)];
            let several = several.into_iter().flat_map(|(part, own)| {
                let key = &key;
                let each = own.iter_mut().flatten().enumerate();
                each.map(move |(k, own)| (format!("{key}.{part}.{k}"), own))
            });
            if replace(single.chain(several), |path, own| self.formulas.slope(path, own))? {
                changed.insert(law.name.clone());
            }
        }
        for bushing in &mut derived.bushings {
            if self.bushing(bushing)? {
                changed.insert(bushing.name.clone());
            }
        }
        for load in &mut derived.loads {
            let path = format!("load.{}.history", load.name);
            if let Some(change) = self.history_change(&path, &load.history)? {
                load.history = change;
                changed.insert(load.name.clone());
                if load.beam.is_some() {
                    found.along_beams.push(load.clone());
                }
            }
        }
        let mut sums = Vec::new();
        for (k, constraint) in derived.constraints.iter_mut().enumerate() {
            if self.sum_of_rates(constraint)? {
                sums.push(k);
            }
        }
        let watched = self.formulas.watched();
        if changed.is_empty() && sums.is_empty() && watched.is_none() {
            return Ok(());
        }
        let outside = ExternalActions {
            watched: watched.clone().unwrap_or_default(),
            ..ExternalActions::default()
        };
        let system = system::build_with(&derived, &outside).map_err(|error| {
            let what = format!("the derivative by `{}`: {error}", self.formulas.name());
            refused("law", what, LEAVE_OUT)
        })?;
        self.same(&system.mechanism)?;
        for k in sums {
            let row = system.mechanism.description().scalars[k].rows.first();
            if let Some(ScalarRow::Velocity(row)) = row {
                found.numbers.scalars.insert(k, ScalarTangent::Velocity(row.clone()));
            }
        }
        let forces = &system.dynamics.forces;
        for name in &changed {
            let ForceElements { bushings, forces, .. } = forces.only(name);
            found.acting.bushings.extend(bushings);
            found.acting.forces.extend(forces);
        }
        if watched.is_some() {
            found.numbers.signals = self.signals(forces);
        }
        self.take(forces, &changed, &mut found.numbers)
    }

    /// Replaces the numbers and expressions of a bushing by their derivatives; whether one changes.
    fn bushing(&self, bushing: &mut Bushing) -> Result<bool, ModelError> {
        let key = format!("bushing.{}", bushing.name);
        let entry = |path: &str, formula: &Formula| {
            let value = formula.0.parse().unwrap_or_default();
            self.formulas.entry(path, self.slopes.number(path, value).eps, formula)
        };
        let mut moves = false;
        for (part, matrix) in
            [("stiffness", &mut bushing.stiffness), ("damping", &mut bushing.damping)]
        {
            let key = format!("{key}.{part}");
            moves |= match matrix {
                None => false,
                Some(Coefficients::Diagonal(own)) => {
                    let each = own.iter_mut().enumerate();
                    replace(each.map(|(k, own)| (format!("{key}.{k}"), own)), entry)?
                }
                Some(Coefficients::Full(rows)) => {
                    let rows = rows.iter_mut().enumerate();
                    let each = rows.flat_map(|(i, row)| {
                        let key = &key;
                        let row = row.iter_mut().enumerate();
                        row.map(move |(k, own)| (format!("{key}.{i}.{k}"), own))
                    });
                    replace(each, entry)?
                }
            };
        }
        if let Some(preload) = &mut bushing.preload {
            let slopes = self.slopes.list(&format!("{key}.preload"), *preload).map(|own| own.eps);
            moves |= slopes.iter().any(|slope| *slope != 0.0);
            *preload = slopes;
        }
        let force = bushing.force.iter_mut().flatten().enumerate();
        let force = force.map(|(k, own)| (format!("{key}.force.{k}"), own));
        Ok(moves | replace(force, |path, own| self.formulas.slope(path, own))?)
    }

    /// Replaces factors and value of a constraint on a sum of rates by their derivatives; whether
    /// one changes.
    fn sum_of_rates(&self, constraint: &mut Constraint) -> Result<bool, ModelError> {
        let Constraint::Velocity { name, terms, value } = constraint else { return Ok(false) };
        let key = format!("constraint.{name}");
        let entry = |path: &str, formula: &Formula| {
            let value = formula.0.parse().unwrap_or_default();
            self.formulas.entry(path, self.slopes.number(path, value).eps, formula)
        };
        let factors = terms.iter_mut().enumerate();
        let factors = factors.map(|(k, own)| (format!("{key}.terms.{k}.factor"), &mut own.factor));
        let value = value.iter_mut().map(|own| (format!("{key}.value"), own));
        replace(factors.chain(value), entry)
    }

    /// Refuses a mechanism that counts other angles than that of the run.
    fn same(&self, derived: &Mechanism) -> Result<(), ModelError> {
        let places = |own: &Mechanism| -> Vec<Option<(usize, usize)>> {
            own.angles().iter().map(|angle| angle.place()).collect()
        };
        let (own, of_run) = (places(derived), places(&self.system.mechanism));
        match of_run.starts_with(&own) {
            true => Ok(()),
            false => {
                let what = format!("the derivative by `{}` of these laws", self.formulas.name());
                Err(refused("law", what, LEAVE_OUT))
            }
        }
    }

    /// The states of the signals, with what changes them.
    fn signals(&self, derived: &ForceElements) -> Option<SignalTangent> {
        let dynamics = &self.system.dynamics;
        let first = dynamics.variational(&self.system.mechanism).places_of_signals().start;
        let (own, changes) = (dynamics.forces.signals.clone()?, derived.signals.clone()?);
        let gauge = self.system.sensors.signal_gauge()?;
        let sampled = self.formulas.states.sampled(|name| gauge.place(name))?;
        Some(SignalTangent::new(own, changes, first).with_sampled(sampled))
    }

    /// The forces of these names.
    fn take(
        &self,
        forces: &ForceElements,
        changed: &BTreeSet<String>,
        out: &mut MechanismTangent,
    ) -> Result<(), ModelError> {
        let stored =
            |all: &ForceElements, name: &str| all.bushings.iter().any(|own| own.name == name);
        let dynamics = &self.system.dynamics;
        let of_run = &dynamics.forces;
        let signals = dynamics.variational(&self.system.mechanism).places_of_signals().start;
        for own in forces.forces.iter().filter(|own| changed.contains(&own.name)) {
            let whole = WholeForce(own.force.discrete(signals));
            out.forces.push((own.name.clone(), Arc::new(whole)));
        }
        for own in forces.bushings.iter().filter(|own| changed.contains(&own.name)) {
            if stored(forces, &own.name) && !stored(of_run, &own.name) {
                let what = format!("the derivative by `{}`", self.formulas.name());
                return Err(refused(&format!("bushing.{}", own.name), what, LEAVE_OUT));
            }
            out.potentials.push(Arc::new(own.spring.clone()));
        }
        Ok(())
    }
}
