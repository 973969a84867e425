//! `[[constraint]]` of type `velocity`: factors and the value as one law of the configuration.

use super::coordinate::coordinate;
use super::law_fault::{LastFault, LawFault};
use super::names::Names;
use super::signal::refusal;
use holonom_model::expression::ExpressionProgram;
use holonom_model::{Constraint, Formula, Frame, ModelError, Quantities, Quantity, TIME};
use nalgebra::DMatrix;
use std::sync::{Arc, Mutex, PoisonError};
use vi_multibody::builder::{ConstrainedRate, MechanismBuilder, Read};
use vi_multibody::law::Law;

/// `c_k`, then `b`, of the time and of places.
#[derive(Debug)]
pub(crate) struct RatesLaw {
    name: String,
    programs: Vec<Option<ExpressionProgram>>, // `None`: zero
    names: Vec<String>,                       // of the inputs
    fault: LastFault,
    row: Mutex<Vec<f64>>,
}

impl RatesLaw {
    /// The last fault.
    pub(super) fn fault(&self) -> Option<LawFault> {
        self.fault.get()
    }

    /// What jumps in it.
    pub(super) fn jumps(&self) -> (String, Vec<&'static str>) {
        let all = self.programs.iter().flatten().flat_map(ExpressionProgram::jumps);
        (self.label(), all.collect())
    }

    fn label(&self) -> String {
        format!("constraint `{}`", self.name)
    }

    #[cold]
    fn note(
        &self,
        program: &ExpressionProgram,
        undefined: &holonom_model::expression::UndefinedPart,
        y: &[f64],
    ) -> f64 {
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        self.fault.note(&self.label(), program, undefined, &names, y, y[0])
    }
}

/// Not a number where an expression has no value: the step is then refused.
impl Law for RatesLaw {
    fn efforts(&self) -> usize {
        self.programs.len()
    }

    fn evaluate(&self, y: &[f64], _z: &[f64], values: &mut [f64]) {
        for (value, program) in values.iter_mut().zip(&self.programs) {
            *value = program.as_ref().map_or(0.0, |program| {
                program.value(y).unwrap_or_else(|undefined| self.note(program, &undefined, y))
            });
        }
    }

    fn gradient(&self, y: &[f64], _z: &[f64], values: &mut [f64], slopes: &mut DMatrix<f64>) {
        let row = &mut *self.row.lock().unwrap_or_else(PoisonError::into_inner);
        for (k, program) in self.programs.iter().enumerate() {
            row.fill(0.0);
            values[k] = program.as_ref().map_or(0.0, |program| {
                program.gradient(y, row).unwrap_or_else(|undefined| {
                    row.fill(f64::NAN);
                    self.note(program, &undefined, y)
                })
            });
            row.iter().enumerate().for_each(|(j, slope)| slopes[(k, j)] = *slope);
        }
    }

    fn is_dissipative(&self) -> bool {
        false
    }
}

/// Adds a constraint on a sum of rates; `None` where it is another.
pub(super) fn add_rates(
    builder: &mut MechanismBuilder,
    constraint: &Constraint,
    names: &Names<'_>,
    quantities: &Quantities<'_>,
) -> Result<Option<Arc<RatesLaw>>, ModelError> {
    let Constraint::Velocity { name, terms, value } = constraint else { return Ok(None) };
    let (name, value) = (name.as_str(), value.as_ref());
    let (mut reads, mut programs, mut rates) = (Vec::new(), Vec::new(), Vec::new());
    let mut compile = |key: String, formula: &Formula| {
        let program = quantities.compile(formula, &TIME, &mut reads);
        program.map_err(|error| refusal(&key, error))
    };
    for (k, term) in terms.iter().enumerate() {
        let key = format!("constraint.{name}.terms[{k}]");
        programs.push(Some(compile(format!("{key}.factor"), &term.factor)?));
        let joint = term.joint.as_deref().and_then(|joint| names.joint(joint));
        if let Some((joint, id)) = joint {
            let at = coordinate(joint, id, term.freedom, format!("{key}.freedom"))?;
            rates.push(ConstrainedRate::Coordinate(at));
        } else if let Some((of, body)) =
            term.of.as_deref().and_then(|of| Some((of, names.body(of)?)))
        {
            let at = names.point(of, term.point.unwrap_or_default());
            let along = term.direction.unwrap_or_default().into();
            rates.push(ConstrainedRate::Point {
                body,
                at,
                along,
                follows: term.axes == Frame::Body,
            });
        }
    }
    let value =
        value.map(|value| compile(format!("constraint.{name}.value"), value)).transpose()?;
    let driven = value.as_ref().is_some_and(|value| value.constant() != Some(0.0));
    programs.push(value);
    let mut inputs = vec![Read::Time];
    for quantity in &reads {
        inputs.push(match quantity {
            Quantity::Coordinate { joint, freedom } => match names.joint(joint) {
                Some((joint, id)) => {
                    Read::Coordinate(coordinate(joint, id, *freedom, format!("constraint.{name}"))?)
                }
                None => Read::Time, // refused by the checks
            },
            Quantity::Position { of, axis } => Read::Position(names.point(of, [0.0; 3]), *axis),
            _ => Read::Time, // refused by the checks
        });
    }
    let own = Arc::new(RatesLaw {
        name: name.to_owned(),
        programs,
        names: TIME
            .iter()
            .map(|t| (*t).to_owned())
            .chain(reads.iter().map(Quantity::name))
            .collect(),
        fault: LastFault::default(),
        row: Mutex::new(vec![0.0; inputs.len()]),
    });
    builder.rates(name, rates, inputs, own.clone(), driven);
    Ok(Some(own))
}
