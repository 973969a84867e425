//! The model file: a validated description of a system, as TOML.
//!
//! ```text
//! text ── Document (values with their places) ── sections (serde) ── checks ── Model
//! ```
//! All units are SI, angles in rad. Unknown keys are errors. What is wrong is said all at once
//! where that is sensible: first everything that cannot be read, then everything that makes no
//! sense, then every bar and joint that the initial values violate.
//!
//! | type | is |
//! |---|---|
//! | [`Model`], [`ModelText`] | the valid description; the files that it is read from |
//! | [`Mesh`], [`Meshes`], [`BodySurface`] | the triangles of a file; the meshes of a model, each read once; a mesh in the frame of its body |
//! | [`ModelError`], [`Problem`] | all that is wrong with a model, each with its place and what to write instead |

#![cfg_attr(not(test), deny(clippy::disallowed_methods))] // equal bits on every machine
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod checks;
mod contact_nodes;
pub mod contact_pairs;
mod contact_passages;
pub mod expression;
mod formula;
mod frames;
mod hermite;
pub mod mesh;
mod observed;
mod quantity;
pub mod reference;
mod schema;
mod smooth_step;
mod stations;
mod table_files;
mod text;
mod types;

pub use formula::{ALONG, Curves, MOTION, SIX, TIME, is_readable};
pub use frames::placements::{Placements, Slopes};
pub use frames::start::StartPoints;
pub use mesh::{BodySurface, Mesh, MeshError, Meshes};
pub use observed::{NodeReading, Observed, SensorPart};
pub use quantity::{Quantities, Quantity};
pub use text::include::{LocatedProblem, ModelText, SourceFile};
pub use text::overrides::Override;
pub use text::places::{LineColumn, line_column, locate};
pub use text::problem::{Inconsistency, Level, MAX_PROBLEMS, ModelError, Problem, nearest, some};
pub use text::read::{open_regular, read_regular, read_regular_text, read_text};
pub use text::tangents::{MovingText, ParameterTangent};
pub use types::beam::{
    Beam, BeamElement, BeamMass, Count, Curve, End, MAX_INTERVALS, Normal, Twist,
};
pub use types::body::{Body, GROUND, Particle};
pub use types::bushing::{Bushing, BushingRotation, Coefficients};
pub use types::columns::Columns;
pub use types::condition::{Condition, ConditionKind, ConditionTime};
pub use types::connection::{Bar, Joint, JointKind, Rates, Spring, SpringLaw};
pub use types::contact::{
    BodyNames, Contact, ContactModel, ContactPlane, ContactSide, Overlap, PlaneSide,
};
pub use types::control::{Control, ControlShape, CountedAt, Objective, ObjectiveKind};
pub use types::damping::{Damping, LossFactor, RelaxationTimes};
pub use types::drive::{Constraint, JointDamper, JointMotor, JointSpring, VelocityTerm};
pub use types::event::{Event, Locate, coordinate_of};
pub use types::frame::Frame;
pub use types::friction::{FrictionCourse, FrictionModel};
pub use types::identify::{Identify, Measurement, Prior, Unknown};
pub use types::joint_contact::{
    ContactMethod, Impact, JointBumper, JointFriction, JointLimits, Limits,
};
pub use types::law::{Formula, Law};
pub use types::load::{History, Load};
pub use types::motion_path::{MotionPath, Move, PathTable};
pub use types::optimize::{FreeParameter, FreeTime, Optimize};
pub use types::orientation::Euler;
pub use types::outline::{Material, Outline, OutlineKind};
pub use types::reference_frame::{MovingFrame, ReferenceFrame};
pub use types::section::Section;
pub use types::sensor::{ReactionFrame, Sensor, SensorKind};
pub use types::settings::{
    Bifurcation, Family, Header, HighOrder, LinearSolver, MAX_STEPS, OnFailure, Quadrature, Scheme,
    Settings, Start, Strain,
};
pub use types::shape::{Inertia, Scale, Shape, ShapeKind};
pub use types::signal::{Delay, Filter, Pid, Signal, Transfer};
pub use types::signal_parts::{NumberAt, OUTPUT, SignalPart};
pub use types::station::{Station, Stations};
pub use types::table::{Interpolation, Outside, Table};

use frames::relative;
use frames::start::{coincide, distance, inconsistencies};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use text::source;
use types::columns;

/// The greatest size of a model text, bytes.
pub const MAX_BYTES: usize = 64 * 1024 * 1024;

/// A model: what there is, how it is connected, how it is simulated.
///
/// One that comes from [`Model::from_toml`] is valid and resolved: lengths, masses and inertias
/// that the text leaves open are filled in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// `[model]`.
    #[serde(rename = "model")]
    pub header: Header,
    /// `[simulation]`.
    #[serde(rename = "simulation")]
    pub settings: Settings,
    /// `[[frame]]`: reference frames for `relative_to`.
    #[serde(default, rename = "frame", skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<ReferenceFrame>,
    /// `[[body]]`: rigid bodies.
    #[serde(default, rename = "body", skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<Body>,
    /// `[[beam]]`: geometrically exact beams.
    #[serde(default, rename = "beam", skip_serializing_if = "Vec::is_empty")]
    pub beams: Vec<Beam>,
    /// `[[particle]]`: point masses.
    #[serde(default, rename = "particle", skip_serializing_if = "Vec::is_empty")]
    pub particles: Vec<Particle>,
    /// `[[bar]]`: rigid bars between particles.
    #[serde(default, rename = "bar", skip_serializing_if = "Vec::is_empty")]
    pub bars: Vec<Bar>,
    /// `[[joint]]`: joints between bodies.
    #[serde(default, rename = "joint", skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<Joint>,
    /// `[[constraint]]`: distances, guides, gears, prescribed motion.
    #[serde(default, rename = "constraint", skip_serializing_if = "Vec::is_empty")]
    pub constraints: Vec<Constraint>,
    /// `[[contact]]`: bodies that touch a plane, or one another.
    #[serde(default, rename = "contact", skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<Contact>,
    /// `[[spring]]`: springs and dampers.
    #[serde(default, rename = "spring", skip_serializing_if = "Vec::is_empty")]
    pub springs: Vec<Spring>,
    /// `[[bushing]]`: elastic bearings with full matrices between two frames.
    #[serde(default, rename = "bushing", skip_serializing_if = "Vec::is_empty")]
    pub bushings: Vec<Bushing>,
    /// `[[load]]`: loads on bodies.
    #[serde(default, rename = "load", skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<Load>,
    /// `[[law]]`: forces by expressions of time and state.
    #[serde(default, rename = "law", skip_serializing_if = "Vec::is_empty")]
    pub laws: Vec<Law>,
    /// `[[table]]`: functions that expressions call.
    #[serde(default, rename = "table", skip_serializing_if = "Vec::is_empty")]
    pub tables: Vec<Table>,
    /// `[[signal]]`: numbers that laws read.
    #[serde(default, rename = "signal", skip_serializing_if = "Vec::is_empty")]
    pub signals: Vec<Signal>,
    /// `[[sensor]]`: what is written to `sensors.csv`.
    #[serde(default, rename = "sensor", skip_serializing_if = "Vec::is_empty")]
    pub sensors: Vec<Sensor>,
    /// `[[event]]`: changes of the mechanism along the run.
    #[serde(default, rename = "event", skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<Event>,
    /// `[[control]]`: efforts that are free.
    #[serde(default, rename = "control", skip_serializing_if = "Vec::is_empty")]
    pub controls: Vec<Control>,
    /// `[[objective]]`: what derivatives are of and optima are least in.
    #[serde(default, rename = "objective", skip_serializing_if = "Vec::is_empty")]
    pub objectives: Vec<Objective>,
    /// `[[condition]]`: what an optimum has to meet.
    #[serde(default, rename = "condition", skip_serializing_if = "Vec::is_empty")]
    pub conditions: Vec<Condition>,
    /// `[optimize]`: what is free in an optimum, and how it is looked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub optimize: Option<Optimize>,
    /// `[[measurement]]`: sensors beside measured values.
    #[serde(default, rename = "measurement", skip_serializing_if = "Vec::is_empty")]
    pub measurements: Vec<Measurement>,
    /// `[identify]`: what is to be found from measurements.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identify: Option<Identify>,
    /// The meshes of its bodies.
    #[serde(skip)]
    pub meshes: Meshes,
    /// What looks like a slip in the text and does not show in the resolved model.
    #[serde(skip)]
    pub remarks: Vec<String>,
    /// Bodies that shared a joint before an event released it: they are no pair either.
    #[serde(skip)]
    pub released: Vec<[String; 2]>,
}

impl Model {
    /// A model without parts, which are added to its fields.
    #[must_use]
    pub fn without_parts(header: Header, settings: Settings) -> Self {
        Self {
            header,
            settings,
            frames: Vec::new(),
            bodies: Vec::new(),
            beams: Vec::new(),
            particles: Vec::new(),
            bars: Vec::new(),
            joints: Vec::new(),
            constraints: Vec::new(),
            contacts: Vec::new(),
            springs: Vec::new(),
            bushings: Vec::new(),
            loads: Vec::new(),
            laws: Vec::new(),
            tables: Vec::new(),
            signals: Vec::new(),
            sensors: Vec::new(),
            events: Vec::new(),
            controls: Vec::new(),
            objectives: Vec::new(),
            conditions: Vec::new(),
            optimize: None,
            measurements: Vec::new(),
            identify: None,
            meshes: Meshes::default(),
            remarks: Vec::new(),
            released: Vec::new(),
        }
    }

    /// Reads, checks and resolves a model.
    ///
    /// # Errors
    /// [`ModelError`], with everything that is wrong and where.
    pub fn from_toml(text: &str) -> Result<Self, ModelError> {
        Self::from_toml_with(text, &[])
    }

    /// The same with values of the text replaced.
    ///
    /// # Errors
    /// [`ModelError`]; problems of replaced values have no place in the text.
    pub fn from_toml_with(text: &str, overrides: &[Override]) -> Result<Self, ModelError> {
        Self::from_toml_in(text, overrides, Meshes::default())
    }

    /// The same with the files that the model names: `meshes` says in which folder relative paths
    /// start; files that it knows are not read again.
    ///
    /// # Errors
    /// [`ModelError`], as [`Model::from_toml_with`].
    pub fn from_toml_in(
        text: &str,
        overrides: &[Override],
        meshes: Meshes,
    ) -> Result<Self, ModelError> {
        if text.len() > MAX_BYTES {
            return Err(ModelError::TooLarge { limit: MAX_BYTES });
        }
        let values = source::values_of_expressions(text, overrides).map_err(ModelError::invalid)?;
        let document =
            source::Document::parse(text, overrides, &values).map_err(ModelError::Invalid)?;
        let mut model = Self::stated(&document, meshes)?;
        let problems = relative::resolve(&mut model, &document);
        if !problems.is_empty() {
            return Err(ModelError::invalid(problems));
        }
        let place = |(i, problem): (usize, Problem)| {
            let problem = problem.below(document.label("table", i));
            let span = document.span(&problem.key);
            problem.at(span)
        };
        let problems: Vec<_> = table_files::resolve(&mut model).into_iter().map(place).collect();
        if !problems.is_empty() {
            return Err(ModelError::invalid(problems));
        }
        let beam = |(i, problem): (usize, Problem)| {
            let problem = problem.below(document.label("beam", i));
            let span = document.span(&problem.key);
            problem.at(span)
        };
        let problems: Vec<_> = stations::resolve(&mut model).into_iter().map(beam).collect();
        if !problems.is_empty() {
            return Err(ModelError::invalid(problems));
        }
        let problems = checks::problems(&model, &document);
        if !problems.is_empty() {
            return Err(ModelError::invalid(problems));
        }
        let place = |(i, problem): (usize, Problem)| {
            let problem = problem.below(document.label("body", i));
            let span = document.span(&problem.key);
            problem.at(span)
        };
        let problems: Vec<_> = mesh::resolve(&mut model).into_iter().map(place).collect();
        if !problems.is_empty() {
            return Err(ModelError::invalid(problems));
        }
        model.frames.clear(); // nothing refers to them any more
        model.resolve();
        let out_of_range = checks::computed::out_of_range(&model);
        if !out_of_range.is_empty() {
            return Err(ModelError::Assembly(out_of_range));
        }
        let missed = inconsistencies(&model);
        if !missed.is_empty() && !model.settings.project_start {
            return Err(ModelError::InconsistentStart(missed));
        }
        Ok(model)
    }

    /// The model as it is stated, before frames are resolved and what is open is filled in.
    fn stated(document: &source::Document<'_>, meshes: Meshes) -> Result<Self, ModelError> {
        let mut problems = document.bad_numbers();
        problems.extend(document.unknown_sections());
        let header = document.table("model", &mut problems);
        let settings = document.table("simulation", &mut problems);
        let frames = document.list("frame", &mut problems);
        let lists = (
            document.list("body", &mut problems),
            document.list("beam", &mut problems),
            document.list("particle", &mut problems),
            document.list("bar", &mut problems),
            document.list("joint", &mut problems),
            document.list("constraint", &mut problems),
            document.list("spring", &mut problems),
            document.list("load", &mut problems),
        );
        let contacts = document.list("contact", &mut problems);
        let bushings = document.list("bushing", &mut problems);
        let laws = document.list("law", &mut problems);
        let tables = document.list("table", &mut problems);
        let signals = document.list("signal", &mut problems);
        let sensors = document.list("sensor", &mut problems);
        let events = document.list("event", &mut problems);
        let controls = document.list("control", &mut problems);
        let objectives = document.list("objective", &mut problems);
        let conditions = document.list("condition", &mut problems);
        let optimize = document.optional_table("optimize", &mut problems);
        let measurements = document.list("measurement", &mut problems);
        let identify = document.optional_table("identify", &mut problems);
        let (Some(header), Some(settings), true) = (header, settings, problems.is_empty()) else {
            return Err(ModelError::invalid(problems));
        };
        let (bodies, beams, particles, bars, joints, constraints, springs, loads) = lists;
        Ok(Self {
            header,
            settings,
            frames,
            bodies,
            beams,
            particles,
            bars,
            joints,
            constraints,
            contacts,
            springs,
            bushings,
            loads,
            laws,
            tables,
            signals,
            sensors,
            events,
            controls,
            objectives,
            conditions,
            optimize,
            measurements,
            identify,
            meshes,
            remarks: document.turns(),
            released: Vec::new(),
        })
    }

    /// The model that a text states, unresolved.
    pub(crate) fn stated_in(text: &str, overrides: &[Override]) -> Result<Self, ModelError> {
        let values = source::values_of_expressions(text, overrides).map_err(ModelError::invalid)?;
        let document =
            source::Document::parse(text, overrides, &values).map_err(ModelError::Invalid)?;
        Self::stated(&document, Meshes::default())
    }

    /// This model with values replaced, checked again.
    ///
    /// # Errors
    /// [`ModelError`], as [`Model::from_toml_with`].
    pub fn with_overrides(&self, overrides: &[Override]) -> Result<Self, ModelError> {
        Self::from_toml_in(&self.to_toml(), overrides, self.meshes.clone())
    }

    /// The text of this model, everything resolved; reading it again gives the same model.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let table = toml::Table::try_from(self).expect("names, numbers and lists of them are TOML");
        table.to_string()
    }

    /// The JSON schema of model files.
    #[must_use]
    pub fn schema() -> serde_json::Value {
        schema::of_models()
    }

    /// The body of this name.
    #[must_use]
    pub fn body(&self, name: &str) -> Option<&Body> {
        self.bodies.iter().find(|b| b.name == name)
    }

    /// The beam of this name.
    #[must_use]
    pub fn beam(&self, name: &str) -> Option<&Beam> {
        self.beams.iter().find(|b| b.name == name)
    }

    /// Where the frame of this name is among all frames: bodies in their order, then the nodes of
    /// the beams in their order.
    #[must_use]
    pub fn frame(&self, name: &str) -> Option<usize> {
        let Some((name, place)) = name.split_once('.') else {
            return self.bodies.iter().position(|body| body.name == name);
        };
        let mut first = self.bodies.len();
        for beam in &self.beams {
            if beam.name == name {
                return beam.node(place).map(|node| first + node);
            }
            first = first.saturating_add(beam.node_count());
        }
        None
    }

    /// How the ground holds the end of a beam called `NAME.start` or `NAME.end`; `None` when it
    /// does not.
    #[must_use]
    pub fn support(&self, name: &str) -> Option<End> {
        let (name, place) = name.split_once('.')?;
        let beam = self.beam(name)?;
        let end = match place {
            "start" => beam.start,
            "end" => beam.end,
            _ => End::Free,
        };
        (end != End::Free).then_some(end)
    }

    /// The joint of this name.
    #[must_use]
    pub fn joint(&self, name: &str) -> Option<&Joint> {
        self.joints.iter().find(|joint| joint.name == name)
    }

    /// The contact of this name.
    #[must_use]
    pub fn contact(&self, name: &str) -> Option<&Contact> {
        self.contacts.iter().find(|contact| contact.name == name)
    }

    /// The particle of this name.
    #[must_use]
    pub fn particle(&self, name: &str) -> Option<&Particle> {
        self.particles.iter().find(|p| p.name == name)
    }

    /// The time from which no load acts, s: 0 without loads, `None` when one never ends, or a law
    /// acts.
    #[must_use]
    pub fn loads_end(&self) -> Option<f64> {
        if !self.laws.is_empty() || self.bushings.iter().any(|own| !own.is_linear()) {
            return None;
        }
        self.loads.iter().try_fold(0.0_f64, |end, load| Some(end.max(load.history.end()?)))
    }

    /// Whether nothing but weight, springs and elastic beams does work: no load, law, motor,
    /// damper, damping of a section, algorithmic dissipation or prescribed motion.
    #[must_use]
    pub fn is_conservative(&self) -> bool {
        let passive = |joint: &Joint| {
            let motor = joint.motor.as_ref();
            joint.damper.as_ref().is_none_or(|damper| damper.damping == 0.0)
                && joint.spring.as_ref().is_none_or(|spring| spring.table.is_none())
                && joint.limits.is_none()
                && joint.friction.is_none()
                && motor
                    .is_none_or(|m| m.effort == 0.0 && m.proportional == 0.0 && m.derivative == 0.0)
        };
        self.loads.is_empty()
            && self.events.is_empty()
            && self.contacts.is_empty()
            && self.laws.is_empty()
            && self.bushings.iter().all(Bushing::is_conservative)
            && !self.dissipates_algorithmically()
            && !self.beams.iter().any(Beam::is_damped)
            && self.springs.iter().all(|spring| spring.damping == 0.0)
            && self.joints.iter().all(passive)
            && !self.constraints.iter().any(|c| matches!(c, Constraint::Motion { .. }))
            && !self.has_velocity_constraints()
    }

    /// Contacts that act by impulses.
    pub fn rigid_contacts(&self) -> impl Iterator<Item = &Contact> {
        self.contacts.iter().filter(|contact| contact.is_rigid())
    }

    /// Whether impulses act: contacts, rigid stops and dry friction of joints.
    #[must_use]
    pub fn is_nonsmooth(&self) -> bool {
        self.rigid_contacts().next().is_some() || self.joints.iter().any(Joint::is_nonsmooth)
    }

    /// Whether velocities are constrained: rolling, blades.
    #[must_use]
    pub fn has_velocity_constraints(&self) -> bool {
        self.constraints.iter().any(Constraint::is_of_velocities)
    }

    /// Whether vibrations of beams that the step does not resolve are dissipated.
    #[must_use]
    pub fn dissipates_algorithmically(&self) -> bool {
        !self.beams.is_empty() && self.settings.strain == Strain::Dissipative
    }

    /// Gravitational acceleration, m/s²; the third component is 0 in the plane.
    #[must_use]
    pub fn gravity(&self) -> [f64; 3] {
        spatial(&self.header.gravity)
    }

    /// The names of all parts, by section.
    fn names(&self) -> [(&'static str, Vec<&str>); 19] {
        [
            ("frame", self.frames.iter().map(|m| m.name.as_str()).collect()),
            ("body", self.bodies.iter().map(|m| m.name.as_str()).collect()),
            ("beam", self.beams.iter().map(|m| m.name.as_str()).collect()),
            ("particle", self.particles.iter().map(|m| m.name.as_str()).collect()),
            ("bar", self.bars.iter().map(|m| m.name.as_str()).collect()),
            ("joint", self.joints.iter().map(|m| m.name.as_str()).collect()),
            ("constraint", self.constraints.iter().map(Constraint::name).collect()),
            ("contact", self.contacts.iter().map(|m| m.name.as_str()).collect()),
            ("spring", self.springs.iter().map(|m| m.name.as_str()).collect()),
            ("bushing", self.bushings.iter().map(|m| m.name.as_str()).collect()),
            ("load", self.loads.iter().map(|m| m.name.as_str()).collect()),
            ("law", self.laws.iter().map(|m| m.name.as_str()).collect()),
            ("table", self.tables.iter().map(|m| m.name.as_str()).collect()),
            ("signal", self.signals.iter().map(|m| m.name.as_str()).collect()),
            ("sensor", self.sensors.iter().map(|m| m.name.as_str()).collect()),
            ("event", self.events.iter().map(|m| m.name.as_str()).collect()),
            ("control", self.controls.iter().map(|m| m.name.as_str()).collect()),
            ("objective", self.objectives.iter().map(|m| m.name.as_str()).collect()),
            ("condition", self.conditions.iter().map(|m| m.name.as_str()).collect()),
        ]
    }

    /// A name that no part has: this one, with as many `_` behind it as that takes.
    #[must_use]
    pub fn free_name(&self, wanted: &str) -> String {
        let names = self.names();
        let is_taken = |name: &str| names.iter().any(|(_, all)| all.contains(&name));
        let mut name = wanted.to_owned();
        while is_taken(&name) {
            name.push('_');
        }
        name
    }

    /// Fills in what the text leaves open.
    fn resolve(&mut self) {
        columns::resolve(self);
        let dimension = self.header.dimension;
        self.header.gravity.resize(dimension, 0.0);
        let step = self.settings.step;
        let motors = self.joints.iter_mut().filter_map(|joint| joint.motor.as_mut());
        let histories = motors.map(|motor| &mut motor.history);
        for history in histories.chain(self.loads.iter_mut().map(|load| &mut load.history)) {
            history.resolve(step);
        }
        for particle in &mut self.particles {
            particle.velocity.resize(dimension, 0.0);
        }
        // a part of the ground need not
        let weighs = |body: &Body| !body.fixed || body.mass() > 0.0;
        for body in self.bodies.iter_mut().filter(|b| b.shape.is_some() && weighs(b)) {
            let tensor = body.inertia_tensor();
            body.mass = Some(body.mass());
            body.inertia.get_or_insert(Inertia::Principal([tensor.m11, tensor.m22, tensor.m33]));
        }
        for beam in self.beams.iter_mut().filter(|beam| beam.stations.is_none()) {
            if let Ok(section) = beam.section.resolved() {
                beam.section = section;
            }
        }
        let points = StartPoints::new(self);
        let bars: Vec<f64> = self.bars.iter().map(|b| distance(points.bar(b))).collect();
        let length = |ends| if coincide(&ends) { 0.0 } else { distance(ends) };
        let springs: Vec<f64> = self.springs.iter().map(|s| length(points.spring(s))).collect();
        for (bar, start) in self.bars.iter_mut().zip(bars) {
            bar.length.get_or_insert(start);
        }
        for (spring, start) in self.springs.iter_mut().zip(springs) {
            let stretch = spring.tension.take().map_or(0.0, |tension| tension / spring.stiffness);
            spring.natural_length.get_or_insert(start - stretch);
        }
    }
}

/// A vector of the plane or of space, in space.
#[must_use]
pub fn spatial(vector: &[f64]) -> [f64; 3] {
    std::array::from_fn(|i| vector.get(i).copied().unwrap_or(0.0))
}
