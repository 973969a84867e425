//! The objectives of a model as terms of a cost.

use crate::design::{ModelTangent, refused};
use crate::shown::configuration::{MeasuredNumber, Sensed};
use crate::shown::counted::CountedTerm;
use crate::shown::{Shown, forces};
use crate::system::System;
use holonom_model::{
    CountedAt, Model, ModelError, Objective as Stated, ObjectiveKind, Sensor, nearest,
};
use std::collections::BTreeMap;
use vi_control::controls::Controls;
use vi_control::identification::MeasuredReading;
use vi_control::momentum::TerminalMomentum;
use vi_control::objective::{
    self, CostTerm, Effort, NumberCost, Objective, Quantity as _, Running, StepGradient, Terminal,
    Time,
};
use vi_control::priced::{AtNodes, VelocityAlong};
use vi_control::terminal_rate::{
    AccelerationLevel, NodeQuantity, NodeSources, RateOf, TerminalRate,
};
use vi_control::transcription::PriceOfRest;
use vi_core::Interval;
use vi_multibody::design::MovedCoordinate;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::run::MechanismIntegrator;

/// A model with the numbers of sensors among `of` as objectives: their values at the end.
pub(crate) fn with_sensors(model: &Model, of: &[String]) -> Model {
    let mut model = model.clone();
    for name in of {
        let sensor = name.split('.').next();
        let is_sensor = model.sensors.iter().any(|own| Some(own.name.as_str()) == sensor);
        if is_sensor && !model.objectives.iter().any(|own| own.name == *name) {
            let (sensor, controls) = (Some(name.clone()), Vec::new());
            let (kind, at) = (ObjectiveKind::Value, CountedAt::End);
            let (name, target, weight) = (name.clone(), 0.0, 1.0);
            model.objectives.push(Stated { name, kind, controls, sensor, at, target, weight });
        }
    }
    model
}

/// Refuses names that are those of no objective; numbers of sensors are objectives by now.
///
/// # Errors
/// [`ModelError`], with names that are near.
pub(crate) fn known(model: &Model, of: &[String]) -> Result<(), ModelError> {
    let is_known = |name: &String| model.objectives.iter().any(|own| own.name == *name);
    let Some(unknown) = of.iter().find(|name| !is_known(name)) else { return Ok(()) };
    let objectives = model.objectives.iter().map(|own| &*own.name);
    let names: Vec<&str> = objectives.chain(model.sensors.iter().map(|own| &*own.name)).collect();
    let (own, part) = unknown.split_once('.').map_or((&**unknown, None), |(a, b)| (a, Some(b)));
    let near = nearest(unknown, names.iter().copied());
    let near = near.or_else(|| nearest(own, names.iter().copied()));
    let help = match near {
        Some(near) => {
            let is_sensor = model.sensors.iter().any(|own| own.name == near);
            let part = part.filter(|_| is_sensor).map_or(String::new(), |part| format!(".{part}"));
            format!("did you mean `{near}{part}`?")
        }
        None if names.is_empty() => "add an [[objective]] or a [[sensor]]".to_owned(),
        None => format!("there are: {}", names.join(", ")),
    };
    let what = format!("an objective or a sensor `{unknown}`, which the model does not have");
    Err(refused("objective", what, help))
}

/// Objectives that are conditions of an optimum, with their multipliers [2.67].
#[derive(Clone, Debug, Default)]
pub(crate) struct Prices {
    /// Of objectives that count at single nodes: each node with its multiplier.
    pub(crate) nodes: BTreeMap<String, Vec<(usize, f64)>>,
    /// Of rest.
    pub(crate) rest: PriceOfRest,
    /// Of unknowns of the tree whose turns are bounded, at nodes.
    pub(crate) turns: BTreeMap<usize, Vec<(usize, f64)>>,
}

/// A cost, with what is no matter of the motion.
pub(crate) struct Costs {
    /// Terms of the motion.
    pub(crate) sum: Objective,
    /// `½ Σ (Δw)²/h`: weight, controls.
    of_rates: Vec<(f64, Vec<usize>)>,
}

/// `Σ w Δθ`.
struct WorkTerm {
    coordinates: Vec<(usize, JointCoordinate)>,
    /// By parameters: of those coordinates that change, control and change.
    moved: Vec<Vec<(usize, MovedCoordinate)>>,
}

impl CostTerm for WorkTerm {
    fn of_step(&self, s: &Interval, w: &[f64]) -> f64 {
        self.coordinates.iter().map(|(k, own)| w[*k] * own.change(s).difference).sum()
    }
    fn add_of_step(&self, s: &Interval, w: &[f64], scale: f64, out: &mut StepGradient) {
        for (k, own) in &self.coordinates {
            out.controls[*k] += scale * own.change(s).difference;
            own.add_gradient(&s.q0, -scale * w[*k], &mut out.start);
            own.add_gradient(&s.q1, scale * w[*k], &mut out.end);
        }
    }
    fn add_parameters_of_step(&self, s: &Interval, w: &[f64], scale: f64, out: &mut [f64]) {
        for (sum, moved) in out.iter_mut().zip(&self.moved) {
            for (k, own) in moved {
                *sum += scale * w[*k] * (own.by(&s.q1) - own.by(&s.q0));
            }
        }
    }
}

impl Costs {
    /// The objectives of these names, all where there are none, with their derivatives by the
    /// parameters of `tangents`.
    pub(crate) fn new(
        model: &Model,
        (system, run): (&mut System, &MechanismIntegrator),
        of: &[String],
        tangents: &[ModelTangent],
    ) -> Result<Self, ModelError> {
        Self::priced(model, (system, run), (of, &Prices::default()), tangents)
    }

    /// The same with the prices of conditions.
    pub(crate) fn priced(
        model: &Model,
        (system, run): (&mut System, &MechanismIntegrator),
        (of, prices): (&[String], &Prices),
        tangents: &[ModelTangent],
    ) -> Result<Self, ModelError> {
        known(model, of)?;
        let mut costs = Self { sum: Objective::new(), of_rates: Vec::new() };
        let chosen = model.objectives.iter().filter(|own| of.is_empty() || of.contains(&own.name));
        for own in chosen {
            match prices.nodes.get(&own.name) {
                Some(at) => costs.add_at_nodes(model, system, run, own, at, tangents)?,
                None => costs.add(model, system, run, own, tangents)?,
            }
        }
        costs.add_rest(model, system, run, &prices.rest, tangents)?;
        costs.add_turns(model, system, run, &prices.turns, tangents);
        Ok(costs)
    }

    /// A number of single nodes, each with its weight.
    fn add_at_nodes(
        &mut self,
        model: &Model,
        system: &mut System,
        run: &MechanismIntegrator,
        own: &Stated,
        at: &[(usize, f64)],
        tangents: &[ModelTangent],
    ) -> Result<(), ModelError> {
        let CountedTerm::Sensor { key, of, judged } = CountedTerm::of(model, own)? else {
            return Ok(());
        };
        let shown = Shown::of((model, run.rows()), system, &key, of, tangents)?;
        let from = (model, &*system, run);
        let term: Box<dyn CostTerm> = match shown {
            Shown::Node(number) => Box::new(rate_term(&key, (number, judged), from, tangents)?),
            Shown::Configuration(quantity, MeasuredReading::Rate) => {
                Box::new(rate_term(&key, (RateOf(quantity), judged), from, tangents)?)
            }
            Shown::Configuration(quantity, MeasuredReading::Value) => {
                Box::new(Terminal { quantity, judged })
            }
        };
        let term = AtNodes::new(term, nodes_of(model, run), at.iter().copied());
        self.sum.add_along(own.weight, Box::new(term));
        Ok(())
    }

    /// Angles of joints at nodes.
    fn add_turns(
        &mut self,
        model: &Model,
        system: &mut System,
        run: &MechanismIntegrator,
        turns: &BTreeMap<usize, Vec<(usize, f64)>>,
        tangents: &[ModelTangent],
    ) {
        for (k, joint) in model.joints.iter().enumerate() {
            for freedom in 0..joint.pair().coordinate_count() {
                let mechanism = &mut system.mechanism;
                let of_tree = mechanism.description().joints.get(k);
                let unknown = of_tree.and_then(|own| mechanism.tree().unknown_of(own, freedom));
                let priced = unknown.and_then(|own| Some((own.sign, turns.get(&own.index)?)));
                let angle = MeasuredNumber::coordinate(model, mechanism, &joint.name, freedom);
                let (Some((sign, at)), Some(angle)) = (priced, angle) else { continue };
                let quantity = Sensed::new(angle, mechanism, &joint.name, tangents);
                let term = Box::new(Terminal { quantity, judged: NumberCost::Itself });
                let term = AtNodes::new(term, nodes_of(model, run), at.iter().copied());
                self.sum.add_along(sign, Box::new(term));
            }
        }
    }

    /// The momentum that is zero at rest.
    fn add_rest(
        &mut self,
        model: &Model,
        system: &mut System,
        run: &MechanismIntegrator,
        rest: &PriceOfRest,
        tangents: &[ModelTangent],
    ) -> Result<(), ModelError> {
        match rest {
            PriceOfRest::Free => (),
            PriceOfRest::All(momentum) => {
                let number = (VelocityAlong(momentum.clone()), NumberCost::Itself);
                let term = rate_term("condition", number, (model, &*system, run), tangents)?;
                self.sum.add(1.0, Box::new(term));
            }
            PriceOfRest::Unknowns(eta) => {
                let key = "condition".to_owned();
                let term = momentum_term(system, &key, tangents)?;
                self.sum.add(1.0, Box::new(term.along(&system.mechanism, eta)));
            }
        }
        Ok(())
    }

    fn add(
        &mut self,
        model: &Model,
        system: &mut System,
        run: &MechanismIntegrator,
        own: &Stated,
        tangents: &[ModelTangent],
    ) -> Result<(), ModelError> {
        match CountedTerm::of(model, own)? {
            CountedTerm::Effort(places) => {
                self.sum.add(own.weight, Box::new(Effort { of: places }))
            }
            CountedTerm::Time => self.sum.add(own.weight, Box::new(Time)),
            CountedTerm::Rate(places) => self.of_rates.push((own.weight, places)),
            CountedTerm::Work(places) => {
                let mut coordinates = Vec::new();
                for k in places {
                    let control = &model.controls[k];
                    let Some(name) = &control.joint else {
                        let key = format!("objective.{}.controls", own.name);
                        let what = format!("the work of `{}`, a wrench on a body", control.name);
                        let help = "name those along joints, or take another term";
                        return Err(refused(&key, what, help));
                    };
                    let joint = model.joints.iter().position(|joint| joint.name == *name);
                    let found =
                        joint.and_then(|joint| system.mechanism.coordinate(joint, control.freedom));
                    coordinates.extend(found.map(|found| (k, found)));
                }
                let moved = |tangent: &ModelTangent| {
                    let of = |(k, own): &(usize, JointCoordinate)| {
                        Some((*k, MovedCoordinate::of(&system.mechanism, &tangent.numbers, own)?))
                    };
                    coordinates.iter().filter_map(of).collect()
                };
                let moved = tangents.iter().map(moved).collect();
                self.sum.add(own.weight, Box::new(WorkTerm { coordinates, moved }));
            }
            CountedTerm::Momentum => self.add_momentum(system, own, tangents)?,
            CountedTerm::Sensor { key, of, judged } => {
                let counted = (own, judged);
                self.add_sensor(model, (system, run), counted, (&key, of), tangents)?;
            }
        }
        Ok(())
    }

    /// `½ Σ ᴾp²` of all joints at the end.
    fn add_momentum(
        &mut self,
        system: &System,
        own: &Stated,
        tangents: &[ModelTangent],
    ) -> Result<(), ModelError> {
        let term = momentum_term(system, &format!("objective.{}.type", own.name), tangents)?;
        self.sum.add(own.weight, Box::new(term));
        Ok(())
    }

    fn add_sensor(
        &mut self,
        model: &Model,
        (system, run): (&mut System, &MechanismIntegrator),
        (own, judged): (&Stated, NumberCost),
        (key, of): (&str, (&Sensor, Option<&str>)),
        tangents: &[ModelTangent],
    ) -> Result<(), ModelError> {
        let shown = Shown::of((model, run.rows()), system, key, of, tangents)?;
        let (quantity, reading) = match shown {
            Shown::Node(number) => {
                return self.add_rate((own, judged), number, (model, system, run), tangents);
            }
            Shown::Configuration(quantity, reading) => (quantity, reading),
        };
        let term: Box<dyn CostTerm> = match (reading, own.at) {
            (MeasuredReading::Rate, _) => {
                let from = (model, &*system, run);
                return self.add_rate((own, judged), RateOf(quantity), from, tangents);
            }
            (MeasuredReading::Value, CountedAt::Path) if quantity.is_continued() => {
                let term = Terminal { quantity, judged };
                self.sum.add_along(own.weight, Box::new(term));
                return Ok(());
            }
            (MeasuredReading::Value, CountedAt::End) => Box::new(Terminal { quantity, judged }),
            (MeasuredReading::Value, CountedAt::Path) => Box::new(Running { quantity, judged }),
        };
        self.sum.add(own.weight, term);
        Ok(())
    }

    /// A number of a node with its velocity, its multipliers, its acceleration.
    fn add_rate<Q: NodeQuantity + 'static>(
        &mut self,
        (own, judged): (&Stated, NumberCost),
        quantity: Q,
        (model, system, run): (&Model, &System, &MechanismIntegrator),
        tangents: &[ModelTangent],
    ) -> Result<(), ModelError> {
        let key = format!("objective.{}.sensor", own.name);
        let (reads, of_states) = (quantity.reads(), run.reads_states() || system.stands);
        // multipliers and accelerations of order 2 are those of steps, but for the ends of a run
        let of_steps = reads.any() && !of_states;
        let is_known = of_steps && !reads.accelerations && own.at == CountedAt::End;
        let level = match reads.any() && !is_known {
            true => Some(forces::level(system, tangents)?),
            false => None,
        };
        let from = (model, system, run);
        let term = rate_term_by(&key, (quantity, judged), from, (tangents, level))?;
        let (weight, term) = (own.weight, Box::new(term));
        let counted = match own.at {
            CountedAt::End => objective::Counted::AtEnd,
            CountedAt::Path => objective::Counted::Along,
        };
        match (own.at, of_steps) {
            (_, true) => self.sum.add_step_term(weight, counted, term),
            (CountedAt::End, false) => self.sum.add(weight, term),
            (CountedAt::Path, false) => self.sum.add_along(weight, term),
        }
        Ok(())
    }

    /// `½ Σ (Δw)²/h`.
    pub(crate) fn rates(&self, controls: &Controls, h: f64) -> f64 {
        let square = |k: usize| -> f64 {
            controls.values().windows(2).map(|pair| (pair[1][k] - pair[0][k]).powi(2)).sum()
        };
        let term = |(weight, of): &(f64, Vec<usize>)| {
            weight * 0.5 / h * of.iter().map(|&k| square(k)).sum::<f64>()
        };
        self.of_rates.iter().map(term).sum()
    }

    /// Their derivative by the length of all steps.
    pub(crate) fn rates_by_step(&self, controls: &Controls, h: f64) -> f64 {
        -self.rates(controls, h) / h
    }

    /// Its derivatives by the values of each step.
    pub(crate) fn rate_slopes(&self, controls: &Controls, h: f64) -> Vec<Vec<f64>> {
        let mut out = vec![vec![0.0; controls.count()]; controls.values().len()];
        for (weight, of) in &self.of_rates {
            for &k in of {
                for (n, pair) in controls.values().windows(2).enumerate() {
                    let slope = weight / h * (pair[1][k] - pair[0][k]);
                    out[n][k] -= slope;
                    out[n + 1][k] += slope;
                }
            }
        }
        out
    }
}

/// The start of a run, its step, and how many.
fn nodes_of(model: &Model, run: &MechanismIntegrator) -> (f64, f64, usize) {
    let steps = usize::try_from(model.settings.steps()).unwrap_or(usize::MAX);
    (run.state().t, model.settings.step, steps)
}

/// A number of a node that follows from configuration and velocity.
fn rate_term<Q: NodeQuantity + 'static>(
    key: &str,
    (quantity, cost): (Q, NumberCost),
    (model, system, run): (&Model, &System, &MechanismIntegrator),
    tangents: &[ModelTangent],
) -> Result<TerminalRate<Q>, ModelError> {
    rate_term_by(key, (quantity, cost), (model, system, run), (tangents, None))
}

/// The same of one that may follow from the acceleration level.
fn rate_term_by<Q: NodeQuantity + 'static>(
    key: &str,
    (quantity, judged): (Q, NumberCost),
    (model, system, run): (&Model, &System, &MechanismIntegrator),
    (tangents, level): (&[ModelTangent], Option<AccelerationLevel>),
) -> Result<TerminalRate<Q>, ModelError> {
    let numbers: Vec<_> = tangents.iter().map(|own| own.numbers.clone()).collect();
    let masses = forces::masses((model, system), run, quantity.reads_velocity());
    let sources = NodeSources { level, masses };
    TerminalRate::with(quantity, judged, run, &numbers, sources).map_err(|error| {
        let help = "take a position or a joint coordinate";
        refused(key, error.to_string(), help)
    })
}

/// Momenta along the joints at the end.
pub(crate) fn momentum_term(
    system: &System,
    key: &str,
    tangents: &[ModelTangent],
) -> Result<TerminalMomentum, ModelError> {
    let numbers: Vec<_> = tangents.iter().map(|own| own.numbers.clone()).collect();
    let of_tree = TerminalMomentum::of(&system.mechanism);
    of_tree.and_then(|own| own.by_parameters(&numbers)).ok_or_else(|| {
        let what = "momenta along joints that are not all revolute, prismatic, cylindrical or \
                    fixed, of a tree, the parent inboard";
        refused(key, what, "take rates of joints, by sensors")
    })
}
