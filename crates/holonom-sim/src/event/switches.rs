//! The state of events: what is in force, and what their conditions have seen.

use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use vi_constraints::nonsmooth::NamedContacts;
use vi_core::State;

/// All that events add to the state of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Switches {
    /// Where the mechanism in force began; `None` for the one that the model states.
    pub(crate) phase: Option<Box<PhaseStart>>,
    /// Parts that are gone.
    pub(crate) released: BTreeSet<String>,
    /// Laws, loads and motors, by their joint, that do not act.
    pub(crate) disabled: BTreeSet<String>,
    /// Joint coordinates that are held.
    pub(crate) locks: Vec<HeldJoint>,
    /// Whether each event acts when its condition becomes true next.
    pub(crate) ready: Vec<bool>,
    /// The value of each condition at the present node; of times 0.
    pub(crate) sides: Vec<f64>,
    /// How often each event has acted.
    pub(crate) counts: Vec<u64>,
    /// What is followed for the conditions.
    pub(crate) readings: Vec<Vec<f64>>,
    /// Angles with their revolutions, rad, that the parts of the whole model refer to.
    pub(crate) turns: Vec<f64>,
    /// Work of the earlier phases, J: of each column, of prescribed motions, of events.
    pub(crate) works: Vec<f64>,
    /// What events did since a node was handed out.
    pub(crate) pending: Vec<EventRecord>,
    /// Steps in which there were more events than are located.
    pub(crate) crowded: u64,
    /// An event has ended the run.
    pub(crate) ended: bool,
}

/// Where a mechanism began.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct PhaseStart {
    pub(crate) step: u64,
    pub(crate) t: f64,             // s
    pub(crate) q: Vec<f64>,        // n
    pub(crate) v: Vec<f64>,        // n  of the projected momentum before
    pub(crate) internal: Vec<f64>, // internal variables
    #[serde(default)]
    pub(crate) contacts: NamedContacts,
}

impl PhaseStart {
    pub(crate) fn new(state: &State, v: &[f64], contacts: NamedContacts) -> Self {
        let (q, internal) = (state.q.clone(), state.internal.clone());
        Self { step: state.step, t: state.t, q, v: v.to_vec(), internal, contacts }
    }
}

/// A joint coordinate that is held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct HeldJoint {
    pub(crate) joint: String,
    pub(crate) freedom: usize,
    pub(crate) value: f64, // m or rad, revolutions counted
}

impl HeldJoint {
    /// The name of its constraint.
    pub(crate) fn name(&self) -> String {
        match self.freedom {
            0 => format!("{}.lock", self.joint),
            k => format!("{}.{k}.lock", self.joint),
        }
    }
}

/// What an event did to a part, or what a contact did: a row of `events.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EventRecord {
    /// When, s.
    pub t: f64,
    /// The event, the contact, or the joint with a stop or with dry friction.
    pub event: String,
    /// The action and the part: `release sling`; of contacts `impact`, `touch`, `slip`, `stick`,
    /// `separate` and the bodies, or the limit of a joint: `impact upper`.
    pub action: String,
    /// What the energy is less than before, J: of a lock and of a contact by its impact, of all
    /// else at this time in the first row.
    pub energy_lost: f64,
    /// The impulse of a lock along its coordinate, of a contact along its normal, N·s or N·m·s.
    pub impulse: Option<f64>,
    /// The velocity of a contact along its normal before an impact or a touch, m/s or rad/s.
    pub before: Option<f64>,
    /// The same after it.
    pub after: Option<f64>,
    /// What changed at this time; not in files.
    #[serde(skip)]
    pub jump: EventJump,
}

/// What the events of a time change together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EventJump {
    /// Largest change of a velocity, relative to the largest of them.
    pub velocity: f64,
    /// Largest change of linear or angular momentum, relative to the largest momentum.
    pub momentum: f64,
    /// What the kinetic energy loses, J.
    pub kinetic: f64,
    /// `½ Δvᵀ M Δv`, J: the loss of a plastic impact.
    pub plastic: f64,
    /// The kinetic energy before, J.
    pub size: f64,
    /// Value of the condition relative to its change over the step; `None` where it is not located.
    pub condition: Option<f64>,
}
