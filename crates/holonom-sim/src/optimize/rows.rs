//! What a design counts, as rows of residuals: squares of deviations, values, conditions.

use super::node::node;
use super::verdict::{names_of_unknowns, outside};
use crate::design::refused;
use crate::gradient::equilibrium;
use crate::gradient::prepared::last_node;
use crate::gradient::trial::{ReadNumber, SensorRead};
use crate::shown::reading;
use crate::system;
use holonom_model::{
    Condition, ConditionKind, ConditionTime, CountedAt, Model, ModelError, Objective,
    ObjectiveKind, Scheme,
};
use nalgebra::DMatrix;
use vi_control::identification::{MeasuredReading, MeasuredSeries};
use vi_control::least_squares::Residuals;

/// Which rows of the residuals are of what.
pub(super) struct ResidualRows {
    pub(super) series: Vec<MeasuredSeries>,
    pub(super) reads: Vec<ReadNumber>,
    /// Of each objective: its rows.
    pub(super) objectives: Vec<std::ops::Range<usize>>,
    /// Of rows that count as they are, after those of squares: what they are weighted with.
    pub(super) weights: Vec<f64>,
    /// Of each condition: its rows.
    pub(super) conditions: Vec<std::ops::Range<usize>>,
    /// Of the rows of rest: the joint.
    pub(super) resting: Vec<String>,
    pub(super) bounds: Vec<[f64; 2]>,
    pub(super) count: usize,
}

impl ResidualRows {
    pub(super) fn new(model: &Model) -> Result<Self, ModelError> {
        if model.settings.scheme == Scheme::Static {
            equilibrium::supported(model, &[])?;
        }
        let (series, reads, objectives) = (Vec::new(), Vec::new(), Vec::new());
        let (weights, conditions, bounds) = (Vec::new(), Vec::new(), Vec::new());
        let resting = Vec::new();
        let mut rows =
            Self { series, reads, objectives, weights, conditions, resting, bounds, count: 0 };
        rows.objectives = vec![0..0; model.objectives.len()];
        for values in [false, true] {
            for (k, own) in model.objectives.iter().enumerate() {
                if (own.kind == ObjectiveKind::Value) == values {
                    rows.objectives[k] = rows.objective(model, own)?;
                }
            }
        }
        rows.conditions(model)?;
        if rows.count == 0 {
            let what = "a design without an aim";
            let help = "add an [[objective]] of type \"sensor\" or \"value\", or a [[condition]]";
            return Err(refused("optimize", what, help));
        }
        Ok(rows)
    }

    /// Refuses a start that does not meet a condition along the path, and that no parameter
    /// changes.
    ///
    /// # Errors
    /// [`ModelError`].
    pub(super) fn start_within(
        &self,
        model: &Model,
        residuals: &mut dyn Residuals,
        parameters: &[f64],
    ) -> Result<(), ModelError> {
        let is_path = |own: &Condition| own.at == ConditionTime::Word(CountedAt::Path);
        if !model.conditions.iter().any(is_path) {
            return Ok(());
        }
        let mut values = vec![0.0; self.count];
        let mut slopes = DMatrix::zeros(self.count, parameters.len());
        if residuals.evaluate(parameters, &mut values, Some(&mut slopes)).is_err() {
            return Ok(()); // the search says why
        }
        for (own, place) in model.conditions.iter().zip(&self.conditions) {
            let (row, [min, max]) = (place.start, own.bounds());
            let beyond = is_path(own) && (min - values[row]).max(values[row] - max) > 0.0;
            if beyond && slopes.row(row).iter().all(|slope| *slope == 0.0) {
                return Err(outside(own, values[row]));
            }
        }
        Ok(())
    }

    /// Adds an objective; returns its rows.
    fn objective(
        &mut self,
        model: &Model,
        own: &Objective,
    ) -> Result<std::ops::Range<usize>, ModelError> {
        let first = self.count;
        let key = format!("objective.{}", own.name);
        match own.kind {
            ObjectiveKind::Sensor | ObjectiveKind::Momentum if own.weight <= 0.0 => {
                let what = "a design that makes a square largest";
                let help = "write a positive weight: the sum of squares becomes least";
                return Err(refused(&format!("{key}.weight"), what, help));
            }
            ObjectiveKind::Sensor | ObjectiveKind::Value => {
                let (last, h) = (last_step(model), model.settings.step);
                match own.at {
                    CountedAt::End => self.count_at(model, own, vec![last], own.weight),
                    CountedAt::Path => {
                        // the trapezoidal rule
                        self.count_at(model, own, (1..last).collect(), own.weight * h);
                        self.count_at(model, own, vec![0, last], 0.5 * own.weight * h);
                    }
                }
            }
            ObjectiveKind::Time => (),
            ObjectiveKind::Momentum => {
                let key = format!("{key}.type");
                let unknowns = moving(model, &key)?;
                self.momenta(model, &key, unknowns, [0.0, 1.0 / own.weight.sqrt()]);
            }
            _ => {
                let what = "a design by efforts of controls";
                let help = "take a sensor: without controls there is no effort";
                return Err(refused(&format!("{key}.type"), what, help));
            }
        }
        Ok(first..self.count)
    }

    /// Counts what a sensor shows at some nodes.
    fn count_at(&mut self, model: &Model, own: &Objective, nodes: Vec<usize>, weight: f64) {
        let sensor = own.sensor.clone().unwrap_or_default();
        let key = format!("objective.{}.sensor", own.name);
        let of_row = match own.kind {
            ObjectiveKind::Value => {
                self.weights.extend(nodes.iter().map(|_| weight));
                [0.0, 1.0]
            }
            _ => [own.target, 1.0 / weight.sqrt()],
        };
        self.read(model, &key, &sensor, nodes, of_row);
    }

    fn conditions(&mut self, model: &Model) -> Result<(), ModelError> {
        for own in &model.conditions {
            let first = self.count;
            let key = format!("condition.{}", own.name);
            if own.kind == ConditionKind::Rest {
                let (unknowns, joints) = resting(model, own)?;
                self.resting.extend(joints);
                self.bounds.extend(vec![[0.0; 2]; unknowns.len()]);
                self.momenta(model, &format!("{key}.type"), unknowns, [0.0, 1.0]);
                self.conditions.push(first..self.count);
                continue;
            }
            let nodes = nodes_of(own, model)?;
            let sensor = own.sensor.clone().unwrap_or_default();
            self.bounds.extend(vec![own.bounds(); nodes.len()]);
            self.read(model, &format!("{key}.sensor"), &sensor, nodes, [0.0, 1.0]);
            self.conditions.push(first..self.count);
        }
        Ok(())
    }

    fn read(
        &mut self,
        model: &Model,
        key: &str,
        sensor: &str,
        nodes: Vec<usize>,
        [value, sigma]: [f64; 2],
    ) {
        self.count += nodes.len();
        let values = vec![value; nodes.len()];
        let steps = nodes.into_iter().map(|node| node as f64).collect();
        self.series.push(MeasuredSeries {
            sensor: self.reads.len(),
            reading: reading(model, sensor),
            sigma,
            steps,
            values,
        });
        let own = SensorRead { key: key.to_owned(), sensor: sensor.to_owned() };
        self.reads.push(ReadNumber::Sensor(own));
    }

    /// Momenta along unknowns of the tree at the end.
    fn momenta(
        &mut self,
        model: &Model,
        key: &str,
        unknowns: Vec<usize>,
        [value, sigma]: [f64; 2],
    ) {
        for unknown in unknowns {
            self.count += 1;
            let (sensor, reading) = (self.reads.len(), MeasuredReading::Value);
            let steps = vec![last_step(model) as f64];
            self.series.push(MeasuredSeries { sensor, reading, sigma, steps, values: vec![value] });
            self.reads.push(ReadNumber::Momentum { key: key.to_owned(), unknown });
        }
    }
}

/// All unknowns of the tree.
fn moving(model: &Model, key: &str) -> Result<Vec<usize>, ModelError> {
    if model.settings.scheme == Scheme::Static {
        let help = "take sensors: at an equilibrium nothing moves";
        return Err(refused(key, "momenta of an equilibrium", help));
    }
    Ok((0..system::build(model)?.mechanism.tree().dof()).collect())
}

/// The unknowns of the tree that are at rest at the end, and the joints that they are of.
fn resting(model: &Model, own: &Condition) -> Result<(Vec<usize>, Vec<String>), ModelError> {
    let key = format!("condition.{}", own.name);
    let all = moving(model, &format!("{key}.type"))?;
    let mechanism = system::build(model)?.mechanism;
    let mut unknowns = if own.of.is_empty() { all } else { Vec::new() };
    for name in &own.of {
        for freedom in 0..model.joint(name).map_or(0, |joint| joint.pair().dof()) {
            let mut joints = mechanism.description().joints.iter();
            let joint = joints.find(|joint| joint.name == *name);
            let found = joint.and_then(|joint| mechanism.tree().unknown_of(joint, freedom));
            let Some(found) = found else {
                let what = format!("rest of `{name}`, which closes a loop");
                let help = "write `cut = true` at another joint of the loop";
                return Err(refused(&format!("{key}.of"), what, help));
            };
            unknowns.push(found.index);
        }
    }
    let names = names_of_unknowns(&mechanism);
    let joints = unknowns.iter().map(|unknown| names[*unknown].clone()).collect();
    Ok((unknowns, joints))
}

/// The number of the last node: of statics that of the run that stands at the last equilibrium.
pub(super) fn last_step(model: &Model) -> usize {
    match model.settings.scheme {
        Scheme::Static => 0,
        _ => last_node(model),
    }
}

/// The nodes at which a condition holds.
fn nodes_of(own: &Condition, model: &Model) -> Result<Vec<usize>, ModelError> {
    let last = last_step(model);
    if model.settings.scheme == Scheme::Static {
        let key = format!("condition.{}", own.name);
        let sensor = own.sensor.as_deref().unwrap_or_default();
        equilibrium::resting(model, &format!("{key}.sensor"), sensor)?;
        if own.at != ConditionTime::Word(CountedAt::End) {
            let what = "a condition along a path of equilibria";
            let help = "remove `at`: a condition of statics is that of the last equilibrium";
            return Err(refused(&format!("{key}.at"), what, help));
        }
    }
    Ok(match own.at {
        ConditionTime::Word(CountedAt::End) => vec![last],
        ConditionTime::Word(CountedAt::Path) => (0..=last).collect(),
        ConditionTime::Time(time) => vec![node(model, &own.name, time)?],
    })
}
