//! Runs of a model for other values of its parameters, with the tangents along them.

use super::objective::momentum_term;
use super::prepared::{Begin, Prepared};
use crate::design::start::GivenJoint;
use crate::design::{self, refused};
use crate::shown::configuration::{MeasuredNumber, Sensed};
use crate::shown::{Shown, all_read, depends_on, forces, named, work};
use crate::start::StartValues;
use crate::system;
use crate::system::outside::{ExternalActions, JointStart};
use holonom_model::{Model, ModelError, ModelText, Override};
use vi_control::identification::{Experiment, Measurable, TrialRun};
use vi_control::least_squares::Refused;
use vi_control::node::{NodeQuantity, NodeReads};
use vi_control::sensitivities::Direction;
use vi_control::terminal_rate::NodeSources;
use vi_core::Configuration;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::mechanism::Mechanism;

/// A sensor that is read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SensorRead {
    /// The key of the model where it is named.
    pub(crate) key: String,
    /// Its name, of one of several numbers with its part.
    pub(crate) sensor: String,
}

/// A number that is read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ReadNumber {
    /// Of a sensor.
    Sensor(SensorRead),
    /// The momentum along an unknown of the tree.
    Momentum {
        /// The key of the model that asks for it.
        key: String,
        /// Which unknown.
        unknown: usize,
    },
}

impl ReadNumber {
    fn sensor(&self) -> Option<&SensorRead> {
        match self {
            Self::Sensor(own) => Some(own),
            Self::Momentum { .. } => None,
        }
    }
}

impl SensorRead {
    /// That of the sensor.
    fn name(&self) -> &str {
        self.sensor.split_once('.').map_or(&self.sensor, |(name, _)| name)
    }
}

/// A coordinate or a rate of a joint at the start that is free.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct InitialCoordinate {
    /// The joint.
    pub(crate) joint: String,
    /// Which of its coordinates.
    pub(crate) freedom: usize,
    /// Whether its rate is meant.
    pub(crate) is_rate: bool,
    /// Whether the joint has no other coordinate.
    pub(crate) alone: bool,
}

impl InitialCoordinate {
    /// A coordinate of a joint and its rate.
    pub(crate) fn both(model: &Model, joint: &str, freedom: usize) -> [Self; 2] {
        let count = model.joint(joint).map_or(0, |own| own.pair().coordinate_count());
        let (joint, alone) = (joint.to_owned(), count == 1);
        [false, true].map(|is_rate| Self { joint: joint.clone(), freedom, is_rate, alone })
    }

    /// `JOINT.coordinate`, `JOINT.rate`; of one of several with its number.
    pub(crate) fn name(&self) -> String {
        let what = if self.is_rate { "rate" } else { "coordinate" };
        match self.alone {
            true => format!("{}.{what}", self.joint),
            false => format!("{}.{what}.{}", self.joint, self.freedom),
        }
    }
}

/// The start that a model states.
pub(crate) struct ModelStart {
    mechanism: Mechanism,
    q: Vec<f64>,
    v: Vec<f64>,
}

impl ModelStart {
    /// Of a model.
    ///
    /// # Errors
    /// [`ModelError`], where it has none.
    pub(crate) fn of(model: &Model) -> Result<Self, ModelError> {
        let mechanism = system::build(model)?.mechanism;
        let StartValues { q, v, .. } = StartValues::consistent(model, &mechanism)?;
        Ok(Self { mechanism, q, v })
    }

    /// A coordinate or a rate, m, rad, m/s or rad/s; `None` where the joint has none.
    pub(crate) fn value(&self, own: &InitialCoordinate) -> Option<f64> {
        let joint = self.mechanism.description().joints.iter().find(|j| j.name == own.joint)?;
        let coordinate = JointCoordinate::principal(joint, own.freedom)?;
        Some(match own.is_rate {
            true => coordinate.rate(&self.q, &self.v),
            false => coordinate.at(Configuration::new(0.0, &self.q)),
        })
    }
}

/// The runs of a model by some of its parameters, and by the start of some of its joints.
#[derive(Clone)]
pub(crate) struct ModelTrials<'a> {
    pub(crate) text: &'a ModelText,
    pub(crate) overrides: &'a [Override],
    /// Their names.
    pub(crate) parameters: Vec<String>,
    /// The start of joints, after the parameters: each coordinate before its rate.
    pub(crate) initial: Vec<InitialCoordinate>,
    /// What is measured.
    pub(crate) reads: Vec<ReadNumber>,
    /// Coordinates of joints that are measured as well, after the sensors.
    pub(crate) joints: Vec<(String, usize)>,
    /// Where the runs begin.
    pub(crate) from: RunBeginning,
}

/// Where runs begin that are parts of a longer one.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct RunBeginning {
    /// Time, s.
    pub(crate) t: f64,
    /// Angles of the state there, with their revolutions; principal values where this is empty.
    pub(crate) angles: Vec<f64>,
}

impl ModelTrials<'_> {
    /// The values of the model file with these of the parameters.
    pub(crate) fn overrides(&self, theta: &[f64]) -> Vec<Override> {
        let mut overrides = self.overrides.to_vec();
        for (name, value) in self.parameters.iter().zip(theta) {
            let key = design::key_of(name);
            overrides.retain(|own| own.key != key);
            overrides.push(Override::new(key, format!("{value:?}")));
        }
        overrides
    }

    /// Where joints begin, for some parameters.
    pub(crate) fn outside(&self, theta: &[f64]) -> ExternalActions {
        let mut start = JointStart::default();
        for (own, value) in self.initial.iter().zip(theta.iter().skip(self.parameters.len())) {
            let list = if own.is_rate { &mut start.rates } else { &mut start.coordinates };
            list.push((own.joint.clone(), own.freedom, *value));
        }
        let (counted, angles) = (self.joints.clone(), self.from.angles.clone());
        ExternalActions { start, counted, angles, ..ExternalActions::default() }
    }

    /// The model for some parameters.
    ///
    /// # Errors
    /// [`ModelError`].
    pub(crate) fn model(&self, theta: &[f64]) -> Result<Model, ModelError> {
        self.text.model(&self.overrides(theta))
    }

    /// The run for some parameters.
    ///
    /// # Errors
    /// [`ModelError`], where there is none.
    pub(crate) fn trial(&self, theta: &[f64]) -> Result<TrialRun, ModelError> {
        let overrides = self.overrides(theta);
        let model = self.text.model(&overrides)?;
        let sensors = || self.reads.iter().filter_map(ReadNumber::sensor);
        let read = sensors().map(|own| own.sensor.as_str());
        let works = work::forces_of(&model, all_read(&model, read).iter());
        let with = (&[][..], &ExternalActions { works, ..self.outside(theta) });
        let mut prepared = Prepared::beginning_at(&model, &[], with, self.from.t)?;
        let own = prepared.model.clone();
        let model = &*own;
        let wanted = |name: &str| self.parameters.iter().any(|own| own == name);
        let read = |sensor: &str| sensors().any(|own| depends_on(model, own.name(), sensor));
        let counts = |key: &str| design::of_sensor(key).is_none_or(read);
        let from = ((&self.parameters[..], self.text, &overrides[..]), model);
        let mut tangents = design::tangents_of(from, &prepared.system, wanted, counts)?;
        let place = |name: &str| self.parameters.iter().position(|own| own == name);
        tangents.sort_by_key(|own| place(&own.name));
        if tangents.len() < self.parameters.len() {
            let moving = |name: &&String| tangents.iter().any(|own| own.name == **name);
            let idle = self.parameters.iter().find(|name| !moving(name));
            let name = idle.map_or("", String::as_str);
            let what = format!("`{name}`, on which nothing depends");
            return Err(refused(&design::key_of(name), what, "leave it out"));
        }
        prepared.sample(&tangents)?;
        let begin = Begin::new(&mut prepared)?;
        let design = design::mechanism_design(&prepared.system, &begin.mass, &tangents)?;
        let mut quantities = Vec::new();
        let run = prepared.simulation.integrator();
        let rows = run.rows().clone();
        let mut reads = NodeReads::default();
        for own in &self.reads {
            let SensorRead { key, sensor } = match own {
                ReadNumber::Sensor(own) => own,
                ReadNumber::Momentum { key, unknown } => {
                    let all = momentum_term(&prepared.system, key, &tangents)?;
                    let own = all.along(&prepared.system.mechanism, &[(*unknown, 1.0)]);
                    quantities.push(Measurable::State(Box::new(own)));
                    continue;
                }
            };
            let of = named(model, key, sensor)?;
            let (of_run, system) = ((model, &rows), &mut prepared.system);
            quantities.push(match Shown::of(of_run, system, key, of, &tangents)? {
                Shown::Configuration(own, _) => Measurable::Configuration(Box::new(own)),
                Shown::Node(own) => {
                    reads = reads.or(own.reads());
                    Measurable::Node(own)
                }
            });
        }
        for (name, freedom) in &self.joints {
            let mechanism = &mut prepared.system.mechanism;
            let own =
                MeasuredNumber::coordinate(model, mechanism, name, *freedom).ok_or_else(|| {
                    let what = format!("`{name}`, which has no coordinate {freedom}");
                    refused(&format!("joint.{name}"), what, "name a joint that slides or turns")
                })?;
            let own = Sensed::new(own, mechanism, name, &tangents);
            quantities.push(Measurable::Configuration(Box::new(own)));
        }
        let of = begin.of(model, &prepared.system.mechanism);
        let mut directions = Vec::new();
        let (changes, given) = match self.initial.is_empty() {
            true => {
                let run = prepared.simulation.integrator();
                (begin.changes(&of, run, &design, &tangents)?, Vec::new())
            }
            false => {
                let joint = |name: &str| model.joints.iter().position(|own| own.name == name);
                let rates = self.initial.iter().filter(|own| own.is_rate);
                let first = rates.filter_map(|own| {
                    let (joint, freedom) = (joint(&own.joint)?, own.freedom);
                    Some(GivenJoint { joint, freedom, coordinate: true, rate: true })
                });
                let found = begin.given(&of, &tangents, &first.collect::<Vec<_>>())?;
                (found.parameters, found.given)
            }
        };
        let parameters = (0..changes.len()).map(Some).chain(std::iter::repeat(None));
        for (change, parameter) in
            changes.into_iter().chain(given.into_iter().flatten()).zip(parameters)
        {
            let own = parameter.and_then(|k: usize| tangents.get(k));
            let start = begin.tangent(prepared.simulation.integrator(), &change, own);
            directions.push(Direction { start, parameter, ..Direction::default() });
        }
        let level = match reads.any() {
            true => Some(forces::level(&prepared.system, &tangents)?),
            false => None,
        };
        let parts = (model, &prepared.system);
        let masses = forces::masses(parts, prepared.simulation.integrator(), level.is_some());
        let sources = NodeSources { level, masses };
        let numbers = tangents.into_iter().map(|own| own.numbers).collect();
        let step = model.settings.step;
        let Prepared { simulation, controls, steps, .. } = prepared;
        let run = simulation.into_integrator();
        let design: Option<Box<dyn vi_constraints::design::Design>> = Some(Box::new(design));
        let tangents = numbers;
        Ok(TrialRun {
            run,
            step,
            controls,
            design,
            directions,
            tangents,
            quantities,
            sources,
            steps,
        })
    }
}

impl Experiment for ModelTrials<'_> {
    fn begin(&mut self, theta: &[f64]) -> Result<TrialRun, Refused> {
        self.trial(theta).map_err(|error| Refused(error.to_string()))
    }
}
