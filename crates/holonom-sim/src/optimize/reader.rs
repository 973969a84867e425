//! The sections of a model as parts of a problem of optimal control, and what it does not have.

use super::node::node;
use crate::design::refused;
use crate::gradient::objective::momentum_term;
use crate::gradient::prepared::unit_load;
use crate::shown::counted::CountedTerm;
use crate::shown::{Shown, named};
use crate::system::System;
use crate::system::input::Input;
use holonom_model::{
    Condition as Stated, ConditionTime, ControlShape, CountedAt, Model, ModelError, Sensor,
    SensorKind,
};
use vi_constraints::saddle_point::IndependentRows;
use vi_control::identification::MeasuredReading;
use vi_control::momentum::NodeMomentum;
use vi_control::node::{NodeQuantity, NodeReads, RateOf};
use vi_control::objective::{NumberCost, Quantity as _};
use vi_control::transcription::problem::{
    Acts, Condition, Control, Cost, CostKind, NodeNumber, RestAtEnd, When,
};
use vi_core::coordinate_force::SignedUnknown;
use vi_core::{Configuration, SparseMatrix};
use vi_multibody::form::BilinearRow;

/// Refuses what the program does not have, by its key.
pub(super) fn supported(model: &Model) -> Result<(), ModelError> {
    let refuse = |key: &str, what: &str, help: &str| Err(refused(key, what, help));
    if model.is_nonsmooth() {
        let help = "remove contacts, stops and dry friction: their impulses have no derivative";
        return refuse("contact", "controls beside impulses", help);
    }
    if model.has_velocity_constraints() {
        let own = model.constraints.iter().find(|own| own.is_of_velocities());
        let key = own.map_or_else(String::new, |own| format!("constraint.{}", own.name()));
        let what = "controls beside rolling, blades and sums of rates: a search needs second \
                    derivatives of their equations, which are not there";
        let help = "remove the [[control]]: designs and gradients take them, by parameters of \
                    motors, histories and laws as well";
        return refuse(&key, what, help);
    }
    if model.objectives.is_empty() {
        let help = "add an [[objective]]: effort, work, time, rate or sensor";
        return refuse("objective", "an optimum of nothing", help);
    }
    Ok(())
}

/// Reads sections as parts of a problem.
pub(super) struct ProblemReader<'a> {
    pub(super) model: &'a Model,
    pub(super) system: &'a mut System,
    /// The same with the controls.
    pub(super) acting: &'a System,
    /// The independent constraints.
    pub(super) rows: &'a IndependentRows,
    pub(super) mass: &'a SparseMatrix,
    pub(super) q: &'a [f64],
    pub(super) t: f64,
    /// Whether the final time is.
    pub(super) is_free: bool,
}

impl ProblemReader<'_> {
    fn unknown(&self, joint: usize, freedom: usize) -> Option<SignedUnknown> {
        let mechanism = &self.system.mechanism;
        mechanism.tree().unknown_of(mechanism.description().joints.get(joint)?, freedom)
    }

    /// A control.
    pub(super) fn control(&self, own: &holonom_model::Control) -> Result<Control, ModelError> {
        let refuse = |part: &str, what: String, help: &str| {
            Err(refused(&format!("control.{}.{part}", own.name), what, help))
        };
        let acts = match &own.joint {
            Some(name) => {
                let joint = self.model.joints.iter().position(|joint| joint.name == *name);
                let Some(along) = joint.and_then(|joint| self.unknown(joint, own.freedom)) else {
                    let what =
                        format!("an optimum of an effort along `{name}`, which closes a loop");
                    let help = "write `cut = true` at another joint of the loop";
                    return refuse("joint", what, help);
                };
                Acts::Along(along)
            }
            None => match unit_load(self.acting, &Input::of(own)) {
                Some(load) => Acts::Wrench(load),
                None => {
                    let what = "an optimum of a force on a point mass".to_owned();
                    return refuse("body", what, "let it act on a body");
                }
            },
        };
        let bounds = [own.min.unwrap_or(f64::NEG_INFINITY), own.max.unwrap_or(f64::INFINITY)];
        let linear = own.shape == ControlShape::Linear;
        Ok(Control { name: own.name.clone(), acts, bounds, hold: own.hold, linear })
    }

    /// A sensor as a quantity; a distance as half its square where that is `squared`, which has
    /// slopes everywhere.
    fn quantity(
        &mut self,
        key: &str,
        (sensor, part): (&Sensor, Option<&str>),
        squared: bool,
    ) -> Result<NodeNumber, ModelError> {
        let own = match Shown::of((self.model, self.rows), self.system, key, (sensor, part), &[])? {
            Shown::Configuration(own, MeasuredReading::Rate) => NodeNumber::of_node(RateOf(own)),
            Shown::Node(own) => {
                self.known(key, sensor, &*own)?;
                NodeNumber::of_node(own)
            }
            Shown::Configuration(own, MeasuredReading::Value) => {
                let unknown = own.joint().and_then(|(joint, freedom)| self.unknown(joint, freedom));
                match (unknown, own.between_points()) {
                    (Some(unknown), _) => {
                        let start = own.value(Configuration::new(self.t, self.q));
                        NodeNumber::Joint { unknown, start }
                    }
                    (None, Some(between)) if squared => {
                        NodeNumber::of(BilinearRow::distance(between, 0.0))
                    }
                    _ => NodeNumber::of(own),
                }
            }
        };
        Ok(own)
    }

    /// Refuses a number that is not one of a node and the step to it.
    fn known(&self, key: &str, sensor: &Sensor, own: &dyn NodeQuantity) -> Result<(), ModelError> {
        let of_time = own.reads_time() && self.is_free;
        let (what, help) = match own.reads() {
            NodeReads { accelerations: true, .. } => {
                ("accelerations, which controls change as well", "take rates, or efforts")
            }
            NodeReads { forces: true, .. } => (
                "forces of constraints, which are those of the step from a node: the last one has none",
                "take efforts of controls, springs or laws",
            ),
            _ if of_time => (
                "what may change with the time by itself, beside a free final time",
                "give the time, or leave `t` and motors out of it",
            ),
            _ => return Ok(()),
        };
        let what =
            format!("an optimum of controls by the sensor `{}`: it reads {what}", sensor.name);
        Err(refused(key, what, help))
    }

    /// All objectives.
    pub(super) fn costs(&mut self) -> Result<Vec<Cost>, ModelError> {
        let (model, mut costs) = (self.model, Vec::new());
        for own in &model.objectives {
            let kind = match CountedTerm::of(model, own)? {
                CountedTerm::Effort(places) => CostKind::Effort(places),
                CountedTerm::Work(places) => CostKind::Work(places),
                CountedTerm::Rate(places) => CostKind::Rate(places),
                CountedTerm::Time => CostKind::Time,
                CountedTerm::Momentum => {
                    let key = format!("objective.{}.type", own.name);
                    let momentum = momentum_term(self.acting, &key, &[])?;
                    let mass = self.mass.clone();
                    let quantity = NodeNumber::of_node(NodeMomentum { momentum, mass });
                    CostKind::Number { quantity, judged: NumberCost::Itself, when: When::End }
                }
                CountedTerm::Sensor { key, of, judged } => {
                    let quantity = self.quantity(&key, of, false)?;
                    let when = match own.at {
                        CountedAt::End => When::End,
                        CountedAt::Path => When::Path,
                    };
                    CostKind::Number { quantity, judged, when }
                }
            };
            costs.push(Cost { weight: own.weight, kind });
        }
        Ok(costs)
    }

    /// A condition on a sensor.
    pub(super) fn condition(&mut self, own: &Stated) -> Result<Condition, ModelError> {
        let key = format!("condition.{}", own.name);
        let sensor = own.sensor.as_deref().unwrap_or_default();
        let key_of = format!("{key}.sensor");
        let of = named(self.model, &key_of, sensor)?;
        let quantity = self.quantity(&key_of, of, true)?;
        let mut bounds = own.bounds();
        if of.0.kind == SensorKind::Distance {
            if bounds[1] < 0.0 {
                return Err(refused(&key, "a negative distance", "write positive bounds"));
            }
            bounds = bounds.map(|x| 0.5 * x * x.abs()); // of half a square
        }
        let when = match own.at {
            ConditionTime::Word(CountedAt::End) => When::End,
            ConditionTime::Word(CountedAt::Path) => When::Path,
            ConditionTime::Time(t) => When::Node(node(self.model, &own.name, t)?),
        };
        Ok(Condition { name: own.name.clone(), quantity, when, bounds })
    }

    /// A condition of rest.
    pub(super) fn rest(&self, own: &Stated) -> Result<RestAtEnd, ModelError> {
        if own.of.is_empty() {
            return Ok(RestAtEnd::All);
        }
        let mut unknowns = Vec::new();
        for name in &own.of {
            let joint = self.model.joints.iter().position(|joint| joint.name == *name);
            let count = joint.map_or(0, |k| self.model.joints[k].pair().dof());
            for freedom in 0..count {
                let found = joint.and_then(|joint| self.unknown(joint, freedom));
                let Some(unknown) = found else {
                    let key = format!("condition.{}.of", own.name);
                    let what = format!("rest of `{name}`, which closes a loop");
                    return Err(refused(&key, what, "leave `of` out: all comes to rest"));
                };
                unknowns.push(unknown.index);
            }
        }
        Ok(RestAtEnd::Unknowns(unknowns))
    }
}
