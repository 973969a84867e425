//! What the assembly of a model finds, before anything moves.

pub(crate) mod agreement;
mod bar_loops;
pub(crate) mod curved_elements;
pub(crate) mod loops;
pub(crate) mod measures;
mod plausibility;
mod section_centers;
mod stiff_sections;

pub use section_centers::SectionCenters;

use crate::digits::rounded;
use crate::resolution::Resolution;
use crate::resolution::limits::Stiffness;
use crate::resolution::rotation::FastestRotation;
use crate::system::beams::Beams;
use agreement::joint_key;
use holonom_model::{
    Beam, Body, Family, Inconsistency, Level, Model, ModelError, Problem, Settings,
};
use measures::Measures;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use vi_beam::ElementKind;
use vi_constraints::Constraints;
use vi_constraints::initialization::StartError;
use vi_constraints::integrator::{SetupError, SingularStart};
use vi_constraints::saddle_point::IndependentRows;
use vi_core::linear::norm_inf;
use vi_core::{Configuration, SparseMatrix};
use vi_emscheme::integrator::EmSetupError;
use vi_multibody::mechanism::Mechanism;

/// The size of an assembled model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Rigid bodies and particles, fixed ones included.
    pub bodies: usize,
    /// Beams.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub beams: usize,
    /// Elements of all beams.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub elements: usize,
    /// Joints, bars and scalar constraints.
    pub joints: usize,
    /// Redundant coordinates `n`.
    pub coordinates: usize,
    /// Constraints `m`, internal and external, redundant ones included.
    pub constraints: usize,
    /// Constraints that follow from the others.
    pub redundant_constraints: usize,
    /// Degrees of freedom.
    pub dof: usize,
}

/// What the assembly of a model found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AssemblyReport {
    /// Its size.
    #[serde(flatten)]
    pub counts: Counts,
    /// Joints and bars with redundant constraints, by name.
    pub redundant: Vec<String>,
    /// Size, masses and stiffnesses.
    pub measures: Measures,
    /// Violation of the constraints by the initial values.
    pub closure: Closure,
    /// The stiffest element against the step; `None` without beams.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Stiffness>,
    /// The fastest motion about the start, against the step; `None` in statics.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fastest_motion: Option<Resolution>,
    /// Why they are not known, where something can move.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fastest_motion_unknown: Option<String>,
    /// The fastest rotation at the start, against the step, beside prescribed motions; `None` where
    /// nothing turns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fastest_rotation: Option<FastestRotation>,
    /// Where the centres of sections are, of beams with one off the line of the nodes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sections: Vec<SectionCenters>,
    /// Whether the strains of beams dissipate; `None` without beams and in statics.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strains: Option<StrainVariant>,
    /// What the elements of beams measure, each kind once; empty without beams.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub element_kinds: Vec<ElementKind>,
    /// Distance of the projection of the initial configuration onto the constraints, m; `None` when
    /// it was not.
    pub projected: Option<f64>,
    /// By how much bodies were moved so that no shapes overlap, m; `None` where they did not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub separated: Option<f64>,
    /// What is worth knowing.
    pub warnings: Vec<String>,
}

impl AssemblyReport {
    /// Measures the model and warns of what looks like a slip.
    pub(crate) fn measure(&mut self, model: &Model, mechanism: &Mechanism, mass: &SparseMatrix) {
        self.measures = Measures::of(model, mechanism, mass);
        self.warnings.extend(measures::slips(model, mechanism, &self.measures));
        self.sections = section_centers::of(model);
        self.warnings.extend(replaced_elements(model));
        self.warnings.extend(section_centers::remarks(model));
        self.warnings.extend(plausibility::remarks(model, mechanism, &self.measures));
    }

    /// The step was judged by the stiffest element of the beams.
    pub(crate) fn step_judged(&mut self, stiffness: Option<Stiffness>, settings: &Settings) {
        self.warnings.extend(stiffness.as_ref().and_then(|stiffness| stiffness.warning(settings)));
        self.stiffness = stiffness;
    }

    /// The initial configuration was relaxed: moved by `moved`, m; `speed`: of the steady rotation,
    /// rad/s.
    pub(crate) fn configuration_relaxed(&mut self, moved: f64, speed: f64, unstable: usize) {
        let place = match speed {
            0.0 => "equilibrium".to_owned(),
            _ => {
                let speed = (1e6 * speed).round() / 1e6;
                format!("equilibrium of the steady rotation of {speed} rad/s")
            }
        };
        self.warnings.push(format!(
            "the initial configuration was relaxed to the {place}: moved by {} m",
            rounded(moved, 4)
        ));
        if unstable > 0 {
            let ways =
                if unstable == 1 { "one direction" } else { &format!("{unstable} directions") };
            self.warnings.push(format!(
                "the {place} that the run starts from is unstable, in {ways}: the least disturbance leads away from it; a \
                 small load across leads to a stable one"
            ));
        }
    }

    /// The initial configuration was projected onto the constraints: moved by `moved`, m; `changed`
    /// says how.
    pub(crate) fn configuration_projected(&mut self, moved: f64, changed: &str) {
        if !changed.is_empty() {
            self.warnings.push(format!(
                "the initial configuration was projected onto the constraints: moved {changed}"
            ));
            self.projected = Some(moved);
        }
    }

    /// Shapes that overlapped were moved apart, by `moved`, m; `changed` says how.
    pub(crate) fn shapes_separated(&mut self, moved: f64, changed: &str) {
        self.warnings.push(format!(
            "the initial configuration was changed so that no shapes overlap: moved {changed}"
        ));
        self.separated = Some(moved);
    }

    /// The initial velocities were: `changed` says how; `rates`: stated rates of joints were kept.
    pub(crate) fn velocity_projected(&mut self, changed: &str, rates: bool) {
        if !changed.is_empty() {
            let kept = if rates { "; stated rates of joints are kept" } else { "" };
            self.warnings.push(format!(
                "the initial velocities were projected onto the constraints: changed {changed}{kept}"
            ));
        }
    }
}

/// What stands in the place of elements with three or four nodes.
fn replaced_elements(model: &Model) -> impl Iterator<Item = String> {
    model.beams.iter().filter(|beam| beam.order > 1).map(|beam| {
        let counts: Vec<usize> = (0..beam.legs()).map(|leg| beam.elements_of(leg)).collect();
        let elements = match counts[..] {
            [one] => one.to_string(),
            _ => format!("{counts:?}"),
        };
        format!(
            "beam.{}.order: there are no elements with {} nodes; each stands for {} elements with two nodes, which \
             sensors count: write elements = {elements} and remove `order`",
            beam.name,
            beam.order + 1,
            beam.order
        )
    })
}

/// What the words of a granted wish begin with.
const GRANTED: [&str; 2] = ["the initial configuration was ", "the initial velocities were "];

/// Whether a warning of a run says only what a key of its model has asked for: that the start was
/// projected or relaxed.
#[must_use]
pub fn is_note(warning: &str) -> bool {
    GRANTED.iter().any(|words| warning.starts_with(words))
}

/// Whether unresolved vibrations of beams are dissipated by the scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StrainVariant {
    /// They are not; material damping is not of the scheme.
    Conservative,
    /// They are: `strain = "dissipative"`.
    Dissipative,
}

impl StrainVariant {
    /// Of a motion of a model with beams.
    fn of(model: &Model) -> Option<Self> {
        let moves = model.settings.scheme.family() != Family::Static && !model.beams.is_empty();
        let dissipates = model.dissipates_algorithmically();
        moves.then_some(if dissipates { Self::Dissipative } else { Self::Conservative })
    }

    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Conservative => "conservative",
            Self::Dissipative => "dissipative",
        }
    }
}

/// Whether a count is not worth a word.
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Largest residuals of the initial values as given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Closure {
    /// `|g(q_0)|_∞`.
    pub position: f64,
    /// `|G(q_0) v_0|_∞`.
    pub velocity: f64,
}

/// Residuals of initial values `(q, v)`.
pub(crate) fn closure(mechanism: &Mechanism, q: &[f64], v: &[f64]) -> Closure {
    let mut g = vec![0.0; mechanism.len()];
    mechanism.value(Configuration::new(0.0, q), &mut g);
    Closure { position: norm_inf(&g), velocity: norm_inf(&velocity_residuals(mechanism, q, v)) }
}

fn velocity_residuals(mechanism: &Mechanism, q: &[f64], v: &[f64]) -> Vec<f64> {
    let mut rate = vec![0.0; mechanism.len()];
    mechanism.time_derivative(0.0, q, &mut rate);
    mechanism.add_rates(0.0, q, v, &mut rate);
    rate
}

/// The largest rate of initial velocities, 1/s.
fn largest_rate(mechanism: &Mechanism, q: &[f64], v: &[f64]) -> f64 {
    let mut sizes = vec![1.0; q.len()];
    mechanism.coordinate_sizes(q, &mut sizes);
    v.iter().zip(&sizes).map(|(v, size)| (v / size).abs()).fold(0.0, f64::max)
}

/// Joints and bars that the initial velocity violates by more than the tolerance.
pub(crate) fn velocity_inconsistencies(
    mechanism: &Mechanism,
    q: &[f64],
    v: &[f64],
    tolerance: f64,
) -> Vec<Inconsistency> {
    let rate = velocity_residuals(mechanism, q, v);
    let description = mechanism.description();
    let allowances = mechanism.allowances();
    let fastest = if allowances.is_empty() { 0.0 } else { largest_rate(mechanism, q, v) };
    let beyond = |row: usize| {
        let allowed = allowances.get(row).map_or(0.0, |g| g * fastest);
        if rate[row].abs() <= allowed { 0.0 } else { rate[row] }
    };
    let worst = |rows: std::ops::Range<usize>| norm_inf(&rows.map(beyond).collect::<Vec<_>>());
    let unit = |rows: std::ops::Range<usize>| {
        let worst = rows.max_by(|&a, &b| rate[a].abs().total_cmp(&rate[b].abs()));
        worst.map_or("m/s", |row| unit_of_rate(mechanism, q, row))
    };
    let joints = description.joints.iter().enumerate().map(|(k, joint)| {
        let rows = mechanism.joint_rows(k);
        (joint_key(&joint.name), worst(rows.clone()), unit(rows))
    });
    let bars = description.bars.iter().enumerate().map(|(k, bar)| {
        let distance = worst(mechanism.bar_rows(k)) / bar.length;
        (format!("bar.{}", bar.name), distance, "m/s")
    });
    let scalars = description.scalars.iter().enumerate().map(|(k, constraint)| {
        let rows = mechanism.scalar_rows(k);
        (format!("constraint.{}", constraint.name), worst(rows.clone()), unit(rows))
    });
    let missed = |(key, distance, unit): (String, f64, &'static str)| {
        let (level, detail, instead) = (Level::Velocity, String::new(), None);
        let found = Inconsistency { key, level, distance, unit, detail, instead };
        (distance > tolerance).then_some(found)
    };
    joints.chain(bars).chain(scalars).filter_map(missed).collect()
}

/// The unit of the rate of a constraint: that of a length, of an angle, or of half the square of a
/// length.
fn unit_of_rate(mechanism: &Mechanism, q: &[f64], row: usize) -> &'static str {
    let Some(row) = row.checked_sub(mechanism.len() - mechanism.rows().len()) else { return "m/s" };
    let mut force = 0.0_f64;
    mechanism.rows()[row].for_each_wrench(q, |_, w| force = force.max(w.linear.norm()));
    if force > 0.0 { "m/s" } else { "rad/s" }
}

/// The report of constraints and those of them that are enforced.
pub(crate) fn counts(
    model: &Model,
    mechanism: &Mechanism,
    rows: &IndependentRows,
    beams: &Beams,
    closure: Closure,
) -> AssemblyReport {
    let mut known = BTreeSet::new();
    let names = rows.redundant().map(|row| mechanism.constraint_name(row));
    let redundant = names.filter(|name| known.insert(*name)).map(str::to_owned).collect();
    let (n, m) = (mechanism.dim(), mechanism.len());
    let counts = Counts {
        bodies: model.bodies.len() + model.particles.len(),
        beams: beams.list.len(),
        elements: model.beams.iter().map(Beam::element_count).sum(),
        joints: model.joints.len() + model.bars.len() + model.constraints.len(),
        coordinates: n,
        constraints: m,
        redundant_constraints: m - rows.len(),
        dof: n - rows.len(),
    };
    let strains = StrainVariant::of(model);
    let mut element_kinds: Vec<ElementKind> = Vec::new();
    for beam in &beams.list {
        if !element_kinds.contains(&beam.kind) {
            element_kinds.push(beam.kind);
        }
    }
    let report =
        AssemblyReport { counts, redundant, closure, strains, ..AssemblyReport::default() };
    let stiff = stiff_sections::remarks(beams);
    let warnings = curved_elements::remarks(beams).chain(stiff).collect();
    AssemblyReport { element_kinds, warnings, ..report }
}

/// A refused set-up of an energy–momentum scheme as an error of the model.
pub(crate) fn em_refusal(error: &EmSetupError, model: &Model) -> ModelError {
    match error {
        EmSetupError::Setup(error) => refusal(error, model),
        _ => ModelError::Unsupported {
            key: "simulation.scheme".into(),
            what: error.to_string(),
            help: "write scheme = \"nodal\"".into(),
        },
    }
}

/// The error for a motion that the constraints allow and that has no mass: a body without a moment
/// of inertia about one of its axes by name, if there is one.
pub(crate) fn without_mass(model: &Model) -> ModelError {
    const THIN: f64 = 1e-12; // relative to the largest moment
    let thin = |body: &&Body| {
        let moments = body.inertia_tensor().symmetric_eigenvalues();
        !body.fixed && moments.min() <= THIN * moments.max()
    };
    let (member, which) = match model.bodies.iter().find(thin) {
        Some(Body { name, .. }) => {
            (format!("body.{name}"), format!("; `{name}` has no inertia about one of its axes"))
        }
        None => ("model".to_owned(), String::new()),
    };
    let detail = format!("some motion that the constraints allow has no mass{which}");
    ModelError::SingularMass { member, detail }
}

/// A refused set-up as an error of the model.
pub(crate) fn refusal(error: &SetupError, model: &Model) -> ModelError {
    let unsupported = |key: &str, help: &str| ModelError::Unsupported {
        key: key.into(),
        what: error.to_string(),
        help: help.into(),
    };
    match error {
        SetupError::Start(StartError::Singular) => without_mass(model),
        SetupError::Start(StartError::Misfit { row, residual }) => misfit(model, *row, *residual),
        SetupError::Start(StartError::NoConfiguration { .. } | StartError::NotFinite) => {
            unsupported("simulation.project_start", "correct the initial positions")
        }
        SetupError::Contradiction(found) => agreement::refusal(found, model),
        SetupError::DissipativeComposition => {
            unsupported("simulation.order", "write order = 2, or method = \"galerkin\"")
        }
        SetupError::VelocityConstraints => {
            unsupported("simulation.scheme", "write scheme = \"nodal\"")
        }
        SetupError::Contacts { .. } => {
            unsupported("simulation.scheme", "write scheme = \"nodal\" and order = 2")
        }
        SetupError::Overlap { .. } => {
            unsupported("contacts at the start", "move the bodies apart, or widen the limits")
        }
        SetupError::NoGalerkin { instead, .. } => unsupported("simulation.method", instead),
        SetupError::RankAtStart { .. } => {
            unsupported("simulation.scheme", "displace a point mass or a body slightly")
        }
        SetupError::TooLarge { instead, .. } => unsupported("simulation.scheme", instead),
        SetupError::SingularStart { joint, reason } => {
            let help = match reason {
                SingularStart::Scheme => "write scheme = \"nodal\"",
                _ => "rotate one of its bodies slightly, or give the loop an initial velocity",
            };
            unsupported(&loop_key(model, joint), help)
        }
        SetupError::RankUnknown { joint } => {
            let help = "rotate one of its bodies slightly, or remove what is redundant in the loop";
            match joint {
                Some(joint) => unsupported(&loop_key(model, joint), help),
                None => unsupported("model", help),
            }
        }
        _ => unsupported("simulation", &format!("step = {}", model.settings.step)),
    }
}

/// The error for a loop that no motion closes.
fn misfit(model: &Model, row: usize, residual: f64) -> ModelError {
    let mechanism = match crate::system::build(model) {
        Ok(system) => system.mechanism,
        Err(error) => return error,
    };
    let (joint, how) = match loops::misfit(&mechanism, residual) {
        Some((joint, distance, axis)) => {
            let axis = axis.map(|x| rounded(x, 4));
            let how = format!(
                "its joints miss each other by {} m along ({}, {}, {}), the direction of its axes",
                rounded(distance, 3),
                axis[0],
                axis[1],
                axis[2]
            );
            (joint, how)
        }
        None => {
            let how = format!("one of its constraints is left with {}", rounded(residual, 2));
            (mechanism.constraint_name(row).to_owned(), how)
        }
    };
    let key = loop_key(model, &joint);
    let message =
        format!("the loop through `{joint}` cannot be closed: {how}, wherever the mechanism is");
    let is_bar = model.bars.iter().any(|bar| bar.name == joint);
    let help = match is_bar {
        true => {
            "correct the lengths or the positions: bars keep their lengths to the last digit; or leave out a bar that the others make redundant"
        }
        false => {
            "correct the anchors or the positions along that direction, or raise `simulation.loop_tolerance`"
        }
    };
    ModelError::Assembly(vec![Problem::new(key, message).help(help)])
}

/// The key of what closes a loop: a joint, a bar or a constraint.
fn loop_key(model: &Model, name: &str) -> String {
    if model.constraints.iter().any(|constraint| constraint.name() == name) {
        return format!("constraint.{name}");
    }
    match model.bars.iter().any(|bar| bar.name == name) {
        true => format!("bar.{name}"),
        false => agreement::joint_key(name),
    }
}
