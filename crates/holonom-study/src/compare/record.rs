//! What a comparison finds, as data: `compare.json`.

use crate::clock::Clock;
use holonom_sim::output::columns::{ANGULAR_MOMENTUM, LINEAR_MOMENTUM, names};
use holonom_sim::output::{ConstraintSummary, Frames};
use serde::{Deserialize, Serialize};
use vi_constraints::scheme::ConditionNumbers;

/// Names of the momentum maps: linear, then angular.
pub(super) const MOMENTUM_MAPS: [&str; 6] = {
    let ([p1, p2, p3], [l1, l2, l3]) = (names(&LINEAR_MOMENTUM), names(&ANGULAR_MOMENTUM));
    [p1, p2, p3, l1, l2, l3]
};

/// All schemes on one model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Name of the model.
    pub model: String,
    /// Degrees of freedom.
    pub dof: usize,
    /// Redundant coordinates.
    pub coordinates: usize,
    /// Constraints, redundant ones included.
    pub constraints: usize,
    /// Step of the table, s.
    pub step: f64,
    /// Steps of the table.
    pub steps: u64,
    /// End of all runs, s.
    pub end: f64,
    /// End of the model, s, where the runs end before it and no end was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shortened_from: Option<f64>,
    /// Energy and momentum maps are measured from here on, s: the end of the last load, 0 when one
    /// never ends.
    pub free_from: f64,
    /// What trajectories are held against.
    pub reference: ReferenceTrajectory,
    /// Which momentum maps the system conserves: of `Px Py Pz Lx Ly Lz`.
    pub conserved: Vec<String>,
    /// What times are.
    pub clock: Clock,
    /// One record for each scheme.
    pub records: Vec<Record>,
    /// Version of the program.
    pub version: String,
    /// The motions of the table, for the page alone.
    #[serde(skip)]
    pub motions: Vec<RecordedMotion>,
}

/// The motion of a scheme.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedMotion {
    /// Name of the scheme in model files.
    pub scheme: String,
    /// Some of its nodes.
    pub frames: Frames,
}

/// The trajectory that others are held against.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceTrajectory {
    /// Scheme, order and step; or why there is none.
    pub description: String,
    /// Distance to the same with twice the step, in the unit of the coordinates (m; directors 1).
    pub known_to: Option<f64>,
}

/// How the run of a scheme ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "status")]
pub enum SchemeOutcome {
    /// At its end.
    Done,
    /// Before.
    Failed {
        /// The step that could not be taken.
        step: u64,
        /// Where it began, s.
        t: f64,
        /// What happened.
        message: String,
    },
    /// It does not run on this model.
    Refused {
        /// Why.
        reason: String,
    },
}

/// One scheme.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Its name in model files.
    pub scheme: String,
    /// Whether it is one of the energy–momentum schemes.
    pub energy_momentum: bool,
    /// How its run ended.
    pub outcome: SchemeOutcome,
    /// What was measured up to there.
    pub measured: Option<Measured>,
    /// Condition numbers of its Newton matrix.
    pub conditions: Vec<ConditionAt>,
    /// Error against time.
    pub work: Vec<WorkPoint>,
}

/// What was measured along the run of a scheme.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Steps taken.
    pub steps: u64,
    /// `max_n |q_n − q^ref_n|_∞`, in the unit of the coordinates (m; directors 1).
    pub distance: Option<f64>,
    /// The same against the first scheme of its family.
    pub apart: Option<f64>,
    /// Energy where nothing is loaded any more (`free_from`), J.
    pub energy: f64,
    /// Largest deviation from it, J.
    pub energy_error: f64,
    /// What it does.
    pub energy_verdict: EnergyBehaviour,
    /// Largest deviation of `Px Py Pz Lx Ly Lz` from their values there.
    pub momentum_drift: [f64; 6],
    /// Constraint residuals at three levels.
    pub constraint_residual: ConstraintSummary,
    /// Newton iterations per step, mean.
    pub mean_iterations: f64,
    /// Newton iterations per step, largest.
    pub max_iterations: f64,
    /// Time per step, s: median of repeated runs without observation.
    pub seconds_per_step: Option<f64>,
    /// The shortest and the longest of them, s.
    #[serde(default)]
    pub seconds_range: Option<[f64; 2]>,
    /// The run for drawing.
    pub series: Vec<DrawnNode>,
}

/// What the energy does along a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EnergyBehaviour {
    /// It stays what it is, to round-off.
    Conserved,
    /// It oscillates in a band, without secular drift.
    Bounded,
    /// It changes: by loads, dampers and motors, or by the scheme.
    Changes,
    /// Too few steps to say.
    Unknown,
}

/// A node of a run, for drawing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawnNode {
    /// Time, s.
    pub t: f64,
    /// `H` less its value at `free_from`, J.
    pub energy: f64,
    /// Largest change of a momentum map that the system conserves.
    pub momentum: f64,
    /// Constraint residuals at positions, velocities, momenta.
    pub residuals: [f64; 3],
}

/// A condition number at one step size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConditionAt {
    /// `h`, s.
    pub step: f64,
    /// `κ`; none where the step failed.
    pub condition: Option<ConditionNumbers>,
}

/// Error and time of a run at one step and order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorkPoint {
    /// Order of accuracy.
    pub order: u32,
    /// `h`, s.
    pub step: f64,
    /// Time of the whole run, s: median of repeated runs.
    pub seconds: Option<f64>,
    /// The shortest and the longest of them, s.
    #[serde(default)]
    pub seconds_range: Option<[f64; 2]>,
    /// Distance to the reference at the end.
    pub error: Option<f64>,
    /// Why there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing: Option<String>,
}
