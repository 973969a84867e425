//! What excites a harmonic response: a load, the motion of the ground, an unbalance.

use super::ResponseError;
use crate::statics::Statics;
use holonom_model::{History, Model, some};
use nalgebra::Complex;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A direction of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SpaceDirection {
    /// The first axis.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

impl SpaceDirection {
    fn index(self) -> usize {
        self as usize
    }

    /// Its unit vector.
    #[must_use]
    pub fn unit(self) -> [f64; 3] {
        std::array::from_fn(|i| f64::from(u8::from(i == self.index())))
    }

    fn named(text: &str) -> Option<Self> {
        [("x", Self::X), ("y", Self::Y), ("z", Self::Z)]
            .into_iter()
            .find_map(|(name, own)| (name == text).then_some(own))
    }
}

/// What excites, with amplitudes of cosines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ResponseInput {
    /// A `[[load]]` with what is stated of it as the amplitude, in the place of its history.
    Load(String),
    /// The ground and all that is fixed to it move.
    Base {
        /// Along this axis.
        along: SpaceDirection,
        /// Amplitude, m.
        amplitude: f64,
    },
    /// The force `U ω²` that turns about an axis with the frequency, at the centre of a body.
    Unbalance {
        /// The body or the node of a beam.
        body: String,
        /// The axis, by the right-hand rule.
        about: SpaceDirection,
        /// `U`, kg·m.
        unbalance: f64,
    },
}

impl fmt::Display for ResponseInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = |d: &SpaceDirection| ["x", "y", "z"][d.index()];
        match self {
            Self::Load(name) => write!(f, "load.{name}"),
            Self::Base { along, amplitude } => write!(f, "base.{}={amplitude}", axis(along)),
            Self::Unbalance { body, about, unbalance } => {
                write!(f, "unbalance.{body}.{}={unbalance}", axis(about))
            }
        }
    }
}

impl FromStr for ResponseInput {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let help = || {
            "write load.NAME, base.x=AMPLITUDE (m; also y, z; 1 m where nothing is stated) or \
             unbalance.BODY.z=U (kg·m)"
                .to_owned()
        };
        let (what, value) = match text.rsplit_once('=') {
            Some((what, value)) => {
                let value: Option<f64> = value.trim().parse().ok();
                (what.trim(), Some(value.filter(|x| x.is_finite()).ok_or_else(help)?))
            }
            None => (text.trim(), None),
        };
        if let (Some(name), None) = (what.strip_prefix("load."), value) {
            return if name.is_empty() { Err(help()) } else { Ok(Self::Load(name.to_owned())) };
        }
        if let Some(axis) = what.strip_prefix("base.") {
            let along = SpaceDirection::named(axis).ok_or_else(help)?;
            return Ok(Self::Base { along, amplitude: value.unwrap_or(1.0) });
        }
        let turning = what.strip_prefix("unbalance.").and_then(|rest| rest.rsplit_once('.'));
        let (body, axis) = turning.ok_or_else(help)?;
        let about = SpaceDirection::named(axis).ok_or_else(help)?;
        let unbalance = value.ok_or_else(help)?;
        Ok(Self::Unbalance { body: body.to_owned(), about, unbalance })
    }
}

/// Forces at a state that do not depend on the frequency, and those in proportion to `ω²`.
#[derive(Debug)]
pub(super) struct Excitation {
    constant: Vec<Complex<f64>>,
    inertial: Vec<Complex<f64>>,
    /// Of the ground, m.
    pub(super) base: [f64; 3],
}

impl Excitation {
    /// Of these inputs at the state of `statics`, which is that of the model without its exciting
    /// loads.
    pub(super) fn new(
        model: &Model,
        statics: &mut Statics,
        inputs: &[ResponseInput],
    ) -> Result<Self, ResponseError> {
        let n = statics.problem().configuration().len();
        let mut own = Self {
            constant: vec![Complex::default(); n],
            inertial: vec![Complex::default(); n],
            base: [0.0; 3],
        };
        for input in inputs {
            match input {
                ResponseInput::Load(name) => own.add_load(model, statics, name)?,
                ResponseInput::Base { along, amplitude } => {
                    let unit = along.unit();
                    (0..3).for_each(|i| own.base[i] += amplitude * unit[i]);
                    let inertia = statics.problem().inertia_of_translation(unit);
                    for (f, m) in own.inertial.iter_mut().zip(inertia) {
                        *f += amplitude * m;
                    }
                }
                ResponseInput::Unbalance { body, about, unbalance } => {
                    let first = frame(model, body).ok_or_else(|| ResponseError::NoSuch {
                        what: "body or node of a beam",
                        name: body.clone(),
                        known: listed(model.bodies.iter().map(|body| body.name.clone()).chain(
                            model.beams.iter().map(|beam| {
                                format!("{0}.0 … {0}.{1}", beam.name, beam.node_count() - 1)
                            }),
                        )),
                    })?;
                    let next = |k: usize| first + (about.index() + k) % 3;
                    own.inertial[next(1)] += Complex::new(*unbalance, 0.0);
                    own.inertial[next(2)] += Complex::new(0.0, -*unbalance);
                }
            }
        }
        Ok(own)
    }

    fn add_load(
        &mut self,
        model: &Model,
        statics: &mut Statics,
        name: &str,
    ) -> Result<(), ResponseError> {
        let mut loaded = model.clone();
        loaded.loads.retain(|load| load.name == name);
        let load = loaded.loads.first_mut();
        let load = load.ok_or_else(|| ResponseError::NoSuch {
            what: "load",
            name: name.to_owned(),
            known: listed(model.loads.iter().map(|load| load.name.clone())),
        })?;
        load.history = History::Constant;
        let mut free = loaded.clone();
        free.loads.clear();
        let q = statics.problem().configuration().to_vec();
        let force = |model: &Model| -> Result<Vec<f64>, ResponseError> {
            let statics = Statics::with_loads_as_stated(model)?;
            Ok(statics.beginning_at(&q).problem().applied_force())
        };
        let (with, without) = (force(&loaded)?, force(&free)?);
        for (f, (with, without)) in self.constant.iter_mut().zip(with.iter().zip(&without)) {
            *f += with - without;
        }
        Ok(())
    }

    /// The amplitudes at an angular frequency, N.
    pub(super) fn at(&self, omega: f64) -> Vec<Complex<f64>> {
        self.constant.iter().zip(&self.inertial).map(|(f, m)| f + m * (omega * omega)).collect()
    }
}

/// Some names, or that there are none.
fn listed(names: impl Iterator<Item = String>) -> String {
    let names: Vec<String> = names.collect();
    if names.is_empty() { "none".into() } else { some(&names) }
}

/// The first coordinate of a body or a node of a beam.
fn frame(model: &Model, name: &str) -> Option<usize> {
    let node = || name.contains('.').then(|| model.frame(name)).flatten();
    let own = model.bodies.iter().position(|body| body.name == name);
    own.or_else(node).map(|k| 12 * k)
}
