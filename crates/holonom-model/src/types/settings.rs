//! `[model]` and `[simulation]`: what is simulated, and how.

use super::joint_contact::{ContactMethod, Impact};
use crate::Columns;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vi_constraints::{OrderMethod, SchemeKind};
use vi_core::galerkin::Stages;
use vi_emscheme::EmForm;

/// Steps that one run may take at most.
pub const MAX_STEPS: f64 = 1e9;

/// `[model]`: the system as a whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Name of the model, for titles and summaries.
    pub name: String,
    /// What it shows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// 3 (default), or 2: point masses in the plane.
    #[serde(default = "three")]
    pub dimension: usize,
    /// Gravitational acceleration, m/s²; `dimension` numbers, zero by default.
    #[serde(default)]
    pub gravity: Vec<f64>,
}

fn three() -> usize {
    3
}

/// The time-stepping scheme. The four variational ones give the same motion to round-off, and so do
/// the three energy–momentum ones.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Discrete null space method with nodal reparametrization, LMO08 (28).
    #[default]
    Nodal,
    /// Constrained scheme with multipliers, LMO08 (22).
    Constrained,
    /// d'Alembert-type scheme, LMO08 (25).
    Dalembert,
    /// Reduced variational scheme, LMO08 (30).
    Reduced,
    /// Energy–momentum scheme with multipliers: energy exact, not symplectic.
    EmConstrained,
    /// Energy–momentum scheme, discrete null space.
    EmDalembert,
    /// Energy–momentum scheme, discrete null space with nodal reparametrization.
    EmNodal,
    /// No motion: the equilibria along the loads, from `t = 0` to the end in steps of the loads'
    /// time.
    Static,
}

/// What kind of scheme it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Variational: symplectic, momentum maps exact, energy bounded.
    Variational(SchemeKind),
    /// Energy–momentum: energy and momentum maps exact, not symplectic.
    EnergyMomentum(EmForm),
    /// No motion: equilibria.
    Static,
}

impl Scheme {
    /// All schemes of motion.
    pub const ALL: [Self; 7] = [
        Self::Nodal,
        Self::Constrained,
        Self::Dalembert,
        Self::Reduced,
        Self::EmConstrained,
        Self::EmDalembert,
        Self::EmNodal,
    ];

    /// Its family, and which scheme of it.
    #[must_use]
    pub fn family(self) -> Family {
        match self {
            Self::Nodal => Family::Variational(SchemeKind::Nodal),
            Self::Constrained => Family::Variational(SchemeKind::Constrained),
            Self::Dalembert => Family::Variational(SchemeKind::Dalembert),
            Self::Reduced => Family::Variational(SchemeKind::Reduced),
            Self::EmConstrained => Family::EnergyMomentum(EmForm::Constrained),
            Self::EmDalembert => Family::EnergyMomentum(EmForm::Dalembert),
            Self::EmNodal => Family::EnergyMomentum(EmForm::Nodal),
            Self::Static => Family::Static,
        }
    }

    /// Whether it is one of the energy–momentum schemes.
    #[must_use]
    pub fn is_energy_momentum(self) -> bool {
        matches!(self.family(), Family::EnergyMomentum(_))
    }

    /// Its name in model files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self.family() {
            Family::Variational(kind) => kind.name(),
            Family::EnergyMomentum(form) => form.name(),
            Family::Static => "static",
        }
    }
}

/// The quadrature rule of the discrete Lagrangian.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Quadrature {
    /// `V` at the midpoint, LMO08 (18).
    #[default]
    Midpoint,
    /// `V` averaged over both ends.
    Trapezoidal,
}

impl From<Quadrature> for vi_core::Quadrature {
    fn from(quadrature: Quadrature) -> Self {
        match quadrature {
            Quadrature::Midpoint => Self::Midpoint,
            Quadrature::Trapezoidal => Self::Trapezoidal,
        }
    }
}

/// The discrete potential of beams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Strain {
    /// Of the strains averaged over both ends of a step, with selective mass scaling: for any step.
    #[default]
    MassScaled,
    /// Of the strains averaged over both ends of a step, with algorithmic dissipation: vibrations
    /// that the step does not resolve die out.
    Dissipative,
    /// Of the strains averaged over both ends of a step: a rigid rotation is free of strain.
    Averaged,
    /// Of the average of both configurations, LMO08 (18): for soft beams and small steps.
    Midpoint,
}

impl From<Strain> for vi_beam::StrainRule {
    fn from(strain: Strain) -> Self {
        match strain {
            Strain::MassScaled => Self::MassScaled,
            Strain::Dissipative => Self::Dissipative,
            Strain::Averaged => Self::Averaged,
            Strain::Midpoint => Self::Midpoint,
        }
    }
}

/// Where a run begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// With the stated configuration.
    #[default]
    Stated,
    /// In the equilibrium under the loads at t = 0, or in the steady rotation of the initial
    /// velocities: beams and springs then do not vibrate from the start.
    Relaxed,
}

/// How the order is reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum HighOrder {
    /// Symmetric compositions of steps of order 2: orders 4, 6, 8.
    #[default]
    Composition,
    /// Polynomials through control points on each step, Gauss quadrature of the action: orders 2, 4
    /// … 16; also with dampers. Closed loops of beams or point masses with scheme = "constrained".
    Galerkin,
}

/// What a path of equilibria does at a bifurcation point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Bifurcation {
    /// It goes on along itself, unstable, with a warning.
    #[default]
    Pass,
    /// It leaves for the branch that it meets there.
    Switch,
}

/// What happens where a step is refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OnFailure {
    /// The run ends.
    #[default]
    Stop,
    /// The step is taken in 2, 4, 8 … 1024 equal parts.
    Substep,
}

fn is_stop(on_failure: &OnFailure) -> bool {
    *on_failure == OnFailure::Stop
}

fn is_composition(method: &HighOrder) -> bool {
    *method == HighOrder::Composition
}

fn is_usual(columns: &[Columns]) -> bool {
    columns == [Columns::Coordinates]
}

fn is_stated(start: &Start) -> bool {
    *start == Start::Stated
}

/// How the nodal and reduced schemes solve their linear systems.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LinearSolver {
    /// What is fastest for the model.
    #[default]
    Auto,
    /// Dense matrices.
    Dense,
    /// The articulated recursion, where nothing couples bodies but joints, and springs and dampers
    /// of neighbours.
    Articulated,
    /// Sparse factorizations.
    Sparse,
}

impl From<LinearSolver> for vi_multibody::run::Solver {
    fn from(solver: LinearSolver) -> Self {
        match solver {
            LinearSolver::Auto => Self::Auto,
            LinearSolver::Dense => Self::Dense,
            LinearSolver::Articulated => Self::Articulated,
            LinearSolver::Sparse => Self::Sparse,
        }
    }
}

/// `[simulation]`: step, end and method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Time step, s.
    pub step: f64,
    /// End time, s. The run takes the whole number of steps that reaches it.
    pub end: f64,
    /// Time-stepping scheme.
    #[serde(default)]
    pub scheme: Scheme,
    /// Order of accuracy: 2; 4, 6, 8 by symmetric composition; 2, 4 … 16 by the Galerkin scheme.
    #[serde(default = "two")]
    pub order: u32,
    /// How an order above 2 is reached.
    #[serde(default, skip_serializing_if = "is_composition")]
    #[schemars(extend("default" = "composition"))]
    pub method: HighOrder,
    /// Quadrature rule of the discrete Lagrangian; energy–momentum schemes have none.
    #[serde(default)]
    pub quadrature: Quadrature,
    /// Discrete potential of beams.
    #[serde(default)]
    pub strain: Strain,
    /// Linear solver of the nodal and reduced schemes.
    #[serde(default)]
    pub solver: LinearSolver,
    /// Record every k-th step (the first and the last always).
    #[serde(default = "one")]
    pub every: u64,
    /// Write multipliers, discrete Legendre transforms and the parts of the energies to
    /// `momenta.csv`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub momenta: bool,
    /// What `trajectory.csv` contains beside the energies and the momentum maps.
    #[serde(default = "Columns::usual", skip_serializing_if = "is_usual")]
    #[schemars(extend("default" = ["coordinates"]))]
    pub columns: Vec<Columns>,
    /// Where the run begins.
    #[serde(default, skip_serializing_if = "is_stated")]
    #[schemars(extend("default" = "stated"))]
    pub start: Start,
    /// Project inconsistent initial values onto the constraints instead of refusing them.
    #[serde(default)]
    pub project_start: bool,
    /// Largest violation of a constraint by consistent initial values: parts of the size of the
    /// model, m/s, rad, rad/s.
    #[serde(default = "start_tolerance")]
    pub start_tolerance: f64,
    /// What closed loops may miss where their constraints nearly follow from one another: rad, or
    /// parts of the size of the loop. 0 takes every digit at its word.
    #[serde(default = "loop_tolerance")]
    pub loop_tolerance: f64,
    /// Statics: follow the path of equilibria by its arc length, through points where the load has
    /// to fall. Steps are then lengths of arc: `step/end` of all of the load, or of the size of the
    /// system.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub arc_length: bool,
    /// Statics: what a path does at a bifurcation point, where it turns unstable.
    #[serde(default, skip_serializing_if = "is_pass")]
    #[schemars(extend("default" = "pass"))]
    pub bifurcation: Bifurcation,
    /// Relative tolerance of Newton's method; 0 iterates to the round-off floor.
    #[serde(default)]
    pub newton_tolerance: f64,
    /// Newton iterations of a step before it counts as failed.
    #[serde(default = "thirty")]
    pub newton_max_iterations: usize,
    /// How impacts are placed in time.
    #[serde(default, skip_serializing_if = "is_events")]
    #[schemars(extend("default" = "events"))]
    pub contact: ContactMethod,
    /// Touches of one step at which a node is put; the rest of the step is then taken as with
    /// `contact = "stepping"`.
    #[serde(default = "twelve", skip_serializing_if = "is_twelve")]
    #[schemars(extend("default" = 12))]
    pub max_events: u32,
    /// What an impact is.
    #[serde(default, skip_serializing_if = "is_newton")]
    #[schemars(extend("default" = "newton"))]
    pub impact: Impact,
    /// Write the contacts of bodies at each recorded node to `contacts.csv`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub contacts: bool,
    /// What happens where a step is refused.
    #[serde(default, skip_serializing_if = "is_stop")]
    #[schemars(extend("default" = "stop"))]
    pub on_failure: OnFailure,
}

fn is_pass(own: &Bifurcation) -> bool {
    *own == Bifurcation::Pass
}
fn is_events(own: &ContactMethod) -> bool {
    *own == ContactMethod::Events
}
#[allow(clippy::trivially_copy_pass_by_ref)] // as serde calls it
fn is_newton(own: &Impact) -> bool {
    *own == Impact::Newton
}
fn twelve() -> u32 {
    12
}
#[allow(clippy::trivially_copy_pass_by_ref)] // as serde calls it
fn is_twelve(own: &u32) -> bool {
    *own == twelve()
}
fn one() -> u64 {
    1
}
fn two() -> u32 {
    2
}
fn thirty() -> usize {
    30
}
fn start_tolerance() -> f64 {
    1e-8
}
fn loop_tolerance() -> f64 {
    1e-3
}

impl Settings {
    /// Default method with this step and end time, s.
    #[must_use]
    pub fn new(step: f64, end: f64) -> Self {
        Self {
            step,
            end,
            scheme: Scheme::default(),
            order: two(),
            method: HighOrder::default(),
            quadrature: Quadrature::default(),
            strain: Strain::default(),
            solver: LinearSolver::default(),
            every: one(),
            momenta: false,
            columns: Columns::usual(),
            start: Start::default(),
            project_start: false,
            start_tolerance: start_tolerance(),
            loop_tolerance: loop_tolerance(),
            arc_length: false,
            bifurcation: Bifurcation::default(),
            newton_tolerance: 0.0,
            newton_max_iterations: thirty(),
            contact: ContactMethod::default(),
            max_events: twelve(),
            impact: Impact::default(),
            contacts: false,
            on_failure: OnFailure::default(),
        }
    }

    /// The composition of its order. Premise: the order is 2, 4, 6 or 8, as in a valid model.
    #[must_use]
    pub fn composition(&self) -> vi_core::Composition {
        vi_core::Composition::of_order(self.order).unwrap_or_default()
    }

    /// How the order is reached. Premise: as in a valid model.
    #[must_use]
    pub fn method(&self) -> OrderMethod {
        match (self.method, Stages::of_order(self.order)) {
            (HighOrder::Galerkin, Some(stages)) if self.order > 2 => OrderMethod::Galerkin(stages),
            _ => OrderMethod::Composition(self.composition()),
        }
    }

    /// Settings of Newton's method.
    #[must_use]
    pub fn newton(&self) -> vi_core::NewtonSettings {
        vi_core::NewtonSettings {
            max_iterations: self.newton_max_iterations,
            tolerance: self.newton_tolerance,
            ..vi_core::NewtonSettings::default()
        }
    }

    /// Number of steps to the end: `end/step`, rounded up unless it is whole to 1e-9.
    #[must_use]
    pub fn steps(&self) -> u64 {
        let ratio = self.end / self.step;
        let whole = (ratio - ratio.round()).abs() <= 1e-9 * ratio.max(1.0);
        let steps = if whole { ratio.round() } else { ratio.ceil() };
        steps.clamp(0.0, MAX_STEPS) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_reach_the_end() {
        assert_eq!(Settings::new(0.1, 1.0).steps(), 10);
        assert_eq!(Settings::new(0.3, 1.0).steps(), 4);
        assert_eq!(Settings::new(0.01, 40.0).steps(), 4000);
        assert_eq!(Settings::new(2.0, 1.0).steps(), 1);
    }
}
