//! How the numbers of a mechanism change with the parameters of its model file.
//!
//! ```text
//! [parameters] ── expressions ── keys ── shapes, placements, frames ── masses, anchors, axes, forces ── MechanismTangent
//!                                                                   └─ q_0, v_0
//! ```
//! Each function of the chain is evaluated with dual numbers, once for each parameter. A number of
//! the model file that no function of the chain takes has no derivative here: it is refused by its
//! key, so none counts as zero by neglect. Frames of bodies keep their principal axes: a body that
//! changes has a tensor that is not diagonal in them.

mod beams;
mod bushings;
mod contacts;
mod followed_rates;
mod forces;
mod formulas;
mod geometry;
pub(crate) mod relaxed;
mod rolling;
mod signals;
pub(crate) mod start;
pub(crate) mod stored;
#[cfg(test)]
mod tests;
mod turning;

use crate::system::System;
use formulas::Formulas;
use holonom_model::{
    Curves, Formula, Model, ModelError, ModelText, Override, ParameterTangent, Placements, Signal,
    Slopes, nearest,
};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::sync::Arc;
use vi_beam::design::ElementsTangent;
use vi_core::SparseMatrix;
use vi_core::num_dual::Dual64;
use vi_multibody::builder::ForceElements;
use vi_multibody::contact::compliant_change::CompliantChange;
use vi_multibody::design::{EffortTangent, MechanismDesign, MechanismTangent, MovedFrames};
use vi_multibody::form::Form;
use vi_rigid::directors::{self, FRAME};

/// How a model changes with one of its parameters.
#[derive(Clone, Default)]
pub struct ModelTangent {
    /// The parameter.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// The numbers of the mechanism and of what acts on it.
    pub numbers: MechanismTangent,
    /// `q_0` as it is stated, shape `n`.
    pub q: Vec<f64>,
    /// `v_0` as bodies and particles state it, shape `n`.
    pub v: Vec<f64>,
    /// `ω_0` of the bodies and of the nodes of beams, three numbers each.
    pub omega: Vec<f64>,
    /// Rates that joints state: joint, freedom, derivative.
    pub rates: Vec<(usize, usize, f64)>,
    /// Points of sensors, or lines between them, by the name of the sensor.
    pub sensors: BTreeMap<String, Form>,
    /// Derivatives of the values of sensors that are expressions, by the name of the sensor.
    pub expressions: BTreeMap<String, Formula>,
    /// The signals of which these are, those with states taken apart.
    pub(crate) signals: Vec<Signal>,
    /// Efforts of the elements of joints: joint, which element, derivative.
    pub drives: Vec<(usize, &'static str, EffortTangent)>,
    /// Laws and bushings that change, their expressions replaced by derivatives.
    pub acting: ForceElements,
    /// Bushings whose frames move, by name.
    pub(crate) bushings: Vec<(String, MovedFrames)>,
    /// Elements of beams.
    pub(crate) elements: Option<Arc<ElementsTangent>>,
    /// Compliant contacts, by their places among the contacts of the system.
    pub(crate) contacts: Vec<(usize, CompliantChange)>,
    /// Loads along beams that come to the others, in space or along the axes of the beam.
    pub(crate) along_beams: Vec<holonom_model::Load>,
    /// Places along beams.
    pub(crate) along: PlacesAlong,
}

/// How places along beams change, m from their starts.
#[derive(Clone, Default)]
pub(crate) struct PlacesAlong {
    /// Of sensors, by name.
    pub(crate) sensors: BTreeMap<String, f64>,
    /// Of loads, by name.
    pub(crate) loads: BTreeMap<String, f64>,
}

impl std::fmt::Debug for ModelTangent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut shown = f.debug_struct("ModelTangent");
        shown.field("name", &self.name).field("numbers", &self.numbers).finish_non_exhaustive()
    }
}

/// What is done about a parameter by which there is no derivative.
pub(crate) const LEAVE_OUT: &str = "name others by --parameters, or leave `parameters` out of --by";

/// A derivative that is not available, as an error of the model.
pub(crate) fn refused(key: &str, what: impl Into<String>, help: impl Into<String>) -> ModelError {
    ModelError::Unsupported { key: key.to_owned(), what: what.into(), help: help.into() }
}

/// A parameter by its name, on which something depends; `key`: of the model, where it is named.
///
/// # Errors
/// [`ModelError`] where there is none.
pub(crate) fn number<'a>(
    key: &str,
    name: &str,
    known: &'a [ParameterTangent],
) -> Result<&'a ParameterTangent, ModelError> {
    let Some(found) = known.iter().find(|known| known.name == name) else {
        let what = format!("`{name}`, which is no number under [parameters]");
        let help = match nearest(name, known.iter().map(|own| own.name.as_str())) {
            Some(best) => format!("did you mean `{best}`?"),
            None if known.is_empty() => {
                "state it there, and let expressions use it: mass = \"= NAME\"".to_owned()
            }
            None => {
                let all: Vec<_> = known.iter().map(|own| format!("`{}`", own.name)).collect();
                format!("numbers are {}; expressions follow from them", all.join(", "))
            }
        };
        return Err(refused(key, what, help));
    };
    if found.is_idle() {
        let what = format!("`{name}`, on which nothing depends");
        let help = format!("write \"= {name}\" where it counts, or leave it out");
        return Err(refused(key, what, help));
    }
    Ok(found)
}

/// The tangents of a model by those of its parameters on which it depends.
///
/// # Errors
/// [`ModelError`] where a parameter enters a key by which there is no derivative.
pub fn tangents(
    text: &ModelText,
    overrides: &[Override],
    model: &Model,
    system: &System,
) -> Result<Vec<ModelTangent>, ModelError> {
    tangents_of(((&[], text, overrides), model), system, |_| true, |_| true)
}

/// The sensor of which a key is.
pub(crate) fn of_sensor(key: &str) -> Option<&str> {
    key.strip_prefix("sensor.")?.split('.').next()
}

/// Whether a key is of pictures, or of shapes that touch others: with a rigid contact a run has no
/// derivative, and what is left of compliant ones was refused before.
fn is_drawn(key: &str) -> bool {
    let mut parts = key.split('.');
    let member = matches!(parts.next(), Some("body" | "particle"));
    member && matches!(parts.nth(1), Some("picture" | "collision"))
}

/// The key of a parameter by its name, of a number of the file the key itself.
pub(crate) fn key_of(name: &str) -> String {
    if name.contains('.') { name.to_owned() } else { format!("parameters.{name}") }
}

/// Names, among them keys of numbers of the file; a text, its replaced values.
pub(crate) type NamedNumbers<'a> = (&'a [String], &'a ModelText, &'a [Override]);

/// The same of some of them alone, by name, and of numbers of the file by their keys; `counts`:
/// whether a key matters.
///
/// # Errors
/// [`ModelError`] where one of these enters a key that matters and by which there is no derivative.
pub(crate) fn tangents_of(
    ((names, text, overrides), model): (NamedNumbers<'_>, &Model),
    system: &System,
    wanted: impl Fn(&str) -> bool,
    counts: impl Fn(&str) -> bool,
) -> Result<Vec<ModelTangent>, ModelError> {
    let stated = text.stated(overrides)?;
    let parameters = text.tangents_of(overrides, names)?;
    let moving = |own: &&ParameterTangent| wanted(&own.name) && !own.is_idle();
    let curves = Curves::new(model);
    let one = |own| tangent((&stated, model, &curves), (system, &counts), own);
    parameters.iter().filter(moving).map(one).collect()
}

fn tangent(
    (stated, model, curves): (&Model, &Model, &Curves<'_>),
    (system, counts): (&System, &dyn Fn(&str) -> bool),
    parameter: &ParameterTangent,
) -> Result<ModelTangent, ModelError> {
    let name = &parameter.name;
    let slopes = Slopes::new(parameter);
    let placements = Placements::new(stated, model, &slopes);
    let formulas = Formulas::new(parameter, model, curves, &slopes)?;
    let (slopes, placements, formulas) = (&slopes, &placements, &formulas);
    let found =
        NumberChain { stated, model, system, slopes, placements, formulas }.tangent(parameter)?;
    if let Some(formula) = formulas.left().iter().find(|key| counts(key)) {
        let what = format!("the derivative by `{name}`, which the expression `{formula}` reads");
        return Err(refused(formula, what, format!("state a number there, or {LEAVE_OUT}")));
    }
    let left = slopes.left();
    if let Some(key) = left.iter().find(|key| counts(key) && !is_drawn(key)) {
        let what = format!("the derivative by `{name}`, which enters `{key}`");
        let help = match (key == name, key.as_str()) {
            (_, "simulation.step") => "write --by step, at a fixed number of steps".to_owned(),
            (true, _) => LEAVE_OUT.to_owned(),
            (false, _) => format!("state a number there, or {LEAVE_OUT}"),
        };
        return Err(refused(key, what, help));
    }
    Ok(found)
}

/// What the numbers of a mechanism follow from.
struct NumberChain<'a> {
    stated: &'a Model,
    model: &'a Model,
    system: &'a System,
    slopes: &'a Slopes<'a>,
    placements: &'a Placements<'a>,
    formulas: &'a Formulas<'a>,
}

/// The derivatives of a vector.
fn eps(x: &Vector3<Dual64>) -> Vector3<f64> {
    x.map(|x| x.eps)
}

impl NumberChain<'_> {
    fn tangent(&self, parameter: &ParameterTangent) -> Result<ModelTangent, ModelError> {
        let mut found = ModelTangent {
            name: parameter.name.clone(),
            value: parameter.value,
            ..ModelTangent::default()
        };
        let gravity = self.slopes.vector("model.gravity", self.model.gravity());
        found.numbers.gravity = eps(&gravity);
        self.start(&mut found);
        self.bodies(&mut found.numbers);
        self.joints(&mut found)?;
        self.bars(&mut found.numbers);
        self.constraints(&mut found.numbers)?;
        self.forces(&mut found)?;
        self.bushing_frames(&mut found)?;
        self.contacts(&mut found)?;
        self.beams(&mut found)?;
        self.expressions(&mut found)?;
        self.sensors(&mut found);
        self.fixed_in_space()?;
        Ok(found)
    }

    /// From components along the axes of a body to those along its directors.
    fn principal(&self, frame: usize) -> Matrix3<f64> {
        let spec = &self.system.mechanism.description().bodies[frame];
        let own = self.model.bodies.get(frame).map(|body| body.rotation());
        own.map_or_else(Matrix3::identity, |own| spec.triad.tr_mul(&own))
    }

    /// Centre and triad of a frame of the mechanism.
    fn placed(&self, frame: usize) -> (Vector3<Dual64>, Matrix3<Dual64>) {
        match self.model.bodies.get(frame) {
            Some(body) => {
                let placed = self.placements.frame(&body.name);
                let axes = self.principal(frame).transpose().map(Dual64::from_re);
                (placed.origin, placed.rotation * axes)
            }
            None => match self.node_of(frame) {
                Some(node) => (node.origin, node.rotation),
                None => {
                    let spec = &self.system.mechanism.description().bodies[frame];
                    (spec.center.map(Dual64::from_re), spec.triad.map(Dual64::from_re))
                }
            },
        }
    }

    /// Whether a frame is placed elsewhere as the parameter changes.
    fn moves(&self, name: &str) -> bool {
        let placed = self.placements.base(Some(name));
        placed.origin.iter().chain(placed.rotation.iter()).any(|x| x.eps != 0.0)
    }

    /// `q_0` and `v_0` as they are stated.
    fn start(&self, found: &mut ModelTangent) {
        let mechanism = &self.system.mechanism;
        let n = mechanism.initial_configuration().len();
        (found.q, found.v) = (vec![0.0; n], vec![0.0; n]);
        for (k, body) in self.model.bodies.iter().enumerate() {
            let frame = self.placements.frame(&body.name);
            let (center, triad) = self.placed(k);
            let own = FRAME * k..FRAME * (k + 1);
            directors::set_frame(&mut found.q[own.clone()], &eps(&center), &triad.map(|x| x.eps));
            // ḋ_I = ω × d_I
            let spin = Matrix3::from_columns(
                &[0, 1, 2].map(|i| frame.omega.cross(&triad.column(i).into_owned())),
            );
            let (velocity, spin) = (eps(&frame.velocity), spin.map(|x| x.eps));
            directors::set_frame(&mut found.v[own], &velocity, &spin);
            found.omega.extend(frame.omega.iter().map(|x| x.eps));
        }
        self.nodes(found);
        for (k, particle) in self.model.particles.iter().enumerate() {
            let [position, velocity] = self.placements.particle(&particle.name);
            let at = mechanism.particle_offset(k);
            for i in 0..mechanism.description().dimension {
                (found.q[at + i], found.v[at + i]) = (position[i].eps, velocity[i].eps);
            }
            let mass =
                self.slopes.number(&format!("particle.{}.mass", particle.name), particle.mass);
            if mass.eps != 0.0 {
                found.numbers.particles.insert(k, mass.eps);
            }
        }
    }

    /// Parts of which no derivative is taken must not move: in their bodies where they are stated
    /// in space, or with their frames.
    fn fixed_in_space(&self) -> Result<(), ModelError> {
        let stated = self.stated;
        let laws = stated.laws.iter().map(|own| (format!("law.{}", own.name), &own.relative_to));
        let on_particles = stated.controls.iter().filter(|own| self.is_on_particle(own));
        let controls = on_particles.map(|own| (format!("control.{}", own.name), &own.relative_to));
        for (key, relative_to) in laws.chain(controls) {
            if let Some(frame) = relative_to.iter().find(|name| self.moves(name)) {
                let what = format!("the derivative by a parameter that moves `{frame}`");
                return Err(refused(&key, what, LEAVE_OUT));
            }
        }
        Ok(())
    }
}

/// How a mechanism changes with the parameters of its model, in the order of `tangents`.
pub(crate) fn mechanism_design(
    system: &System,
    mass: &SparseMatrix,
    tangents: &[ModelTangent],
) -> Result<MechanismDesign, ModelError> {
    let System { mechanism, dynamics, .. } = system;
    let numbers: Vec<_> = tangents.iter().map(|own| own.numbers.clone()).collect();
    let forces = &dynamics.forces;
    let found = MechanismDesign::new(mechanism, forces, mass, dynamics.quadrature, &numbers);
    let with_works = |own: MechanismDesign| {
        if dynamics.works.is_empty() {
            return Ok(own);
        }
        let places = dynamics.variational(mechanism).places_of_works();
        let works = places.zip(dynamics.works.iter().map(|own| own.force.as_str()));
        own.with_works(mechanism, forces, mass, &numbers, works)
    };
    found.and_then(with_works).map_err(|error| refused("model", error.to_string(), LEAVE_OUT))
}
