//! The state of a run between two steps.
//!
//! The state of the integrator determines every later step. What is recorded of these steps also
//! depends on sums and angles that are followed along the run: work, unwrapped angles and signs of
//! sensors, angles of beam elements.

use super::contacts::ContactsSoFar;
use super::divided_steps::DividedSteps;
use super::energy_watch::EnergyWatch;
use super::rolling::RollingState;
use crate::assembly::loops::LoopResiduals;
use crate::event::switches::Switches;
use crate::resolution::rotation::FastestSoFar;
use serde::{Deserialize, Serialize};
use vi_constraints::integrator::ResumeError;
use vi_core::State;

/// All that the rest of a run depends on beside the model, as data.
///
/// A simulation of the same model that takes it up ([`crate::simulation::Simulation::resume`])
/// continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunState {
    pub(crate) motion: MotionState,
    // unwrapped coordinates or a quaternion; empty where nothing is followed
    pub(crate) sensors: Vec<Vec<f64>>,
    pub(crate) limits: Vec<Bent>, // of each beam
    pub(crate) energy: EnergyWatch,
    pub(crate) rotation: FastestSoFar,
    pub(crate) divided: DividedSteps,
    #[serde(default)]
    pub(crate) loops: LoopResiduals,
    #[serde(default)]
    pub(crate) rolling: RollingState,
    #[serde(default)]
    pub(crate) contacts: ContactsSoFar,
    pub(crate) switches: Option<Switches>, // of a model with events
    pub(crate) iterations: f64,            // of Newton's method in the last step
    pub(crate) held: Vec<f64>,             // by inputs, one after the other
}

impl RunState {
    /// Number of steps taken.
    #[must_use]
    pub fn step(&self) -> u64 {
        self.motion.state.step
    }

    /// Time, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.motion.state.t
    }
}

/// Bytes that are no state.
#[derive(Debug, thiserror::Error)]
#[error("these bytes are no state: {0}")]
pub struct NoState(postcard::Error);

impl RunState {
    /// As bytes, which [`RunState::from_bytes`] reads.
    ///
    /// # Panics
    /// Never: numbers and lists of them have bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        postcard::to_stdvec(self).expect("numbers and lists of them have bytes")
    }

    /// The state of such bytes.
    ///
    /// # Errors
    /// [`NoState`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, NoState> {
        postcard::from_bytes(bytes).map_err(NoState)
    }
}

/// The state of an integrator, with the sums along its steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct MotionState {
    pub(crate) state: State,
    pub(crate) ended: Option<f64>, // J  E_d of the composed step that ended at the node
    pub(crate) work: Vec<f64>,     // J  of each force, then of all prescribed motions
    pub(crate) impulse: Option<Impulse>, // with prescribed motions
    pub(crate) increment: Option<StepIncrement>, // with sensors of accelerations at order 2
}

/// What the impulse of constraints at a node is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Impulse {
    pub(crate) p: Vec<f64>, // n  p̄_n
    pub(crate) v: Vec<f64>, // n  of the step that ended here; the velocity at the start
    pub(crate) h: f64,      // s  of that step; 0 at the start
}

/// What a step changes the coordinates by.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct StepIncrement {
    pub(crate) dq: Vec<f64>, // n
    pub(crate) h: f64,       // s; 0: there was no step
}

/// How far the elements of a beam were bent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Bent {
    // element and time of the first that sets a record beyond the warning
    pub(crate) first: Option<(usize, f64)>,
    pub(crate) largest: (usize, f64, f64), // element, angle (rad), time: the record
}

/// Refuses a list of another length.
pub(crate) fn same_length(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), ResumeError> {
    if found == expected { Ok(()) } else { Err(ResumeError::Shape { what, found, expected }) }
}
