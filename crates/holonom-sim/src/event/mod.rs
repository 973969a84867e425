//! Events: changes of the mechanism along a run, which becomes a sequence of phases.
//!
//! ```text
//! e(n) ≤ 0 < e(n+1):   the step is taken again as h*, e(t_n + h*) = 0, then h − h*
//! phase                the model without what is released, with what is locked, at (q, v̂)
//! lock                 v⁺ = v̂ − M⁻¹Gᵀ (G M⁻¹ Gᵀ)⁻¹ G v̂,   loss ½ (v⁺ − v̂)ᵀ M (v⁺ − v̂)
//! ```
//! `v̂` is the velocity of the projected momentum at the event: `p̄_n` carries half an impulse of
//! the constraints before. The impact is the projection of inconsistent initial velocities
//! ([`vi_constraints::initialization`]). The nodes of the grid stay where they are.
//!
//! | file | concept |
//! |---|---|
//! | [`switches`] | the state of events |
//! | `conditions` | the value of each condition at a node |
//! | `phase` | the model that is in force, and its start |

pub(crate) mod conditions;
pub(crate) mod phase;
pub(crate) mod switches;

pub use switches::{EventJump, EventRecord};

use crate::system::outside::ExternalActions;
use conditions::EventConditions;
use holonom_model::{Event, Model, ModelError};
use switches::{HeldJoint, PhaseStart, Switches};
use vi_constraints::Constraints;
use vi_core::Configuration;
use vi_multibody::joint::Joint;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::run::Solver;

/// Events of a step that are located.
pub(crate) const MOST: usize = 12;

/// The events of a model.
#[derive(Debug)]
pub(crate) struct Events {
    pub(crate) model: Model,
    pub(crate) outside: ExternalActions,
    pub(crate) solver: Solver,
    pub(crate) list: Vec<Event>,
    pub(crate) conditions: EventConditions,
    joints: Vec<Joint>,           // of the whole model
    angles: Vec<JointCoordinate>, // likewise, whose revolutions count
    pub(crate) first: PhaseStart,
    pub(crate) switches: Switches,
    pub(crate) acting: Vec<usize>, // scratch
    pub(crate) sides: Vec<f64>,    // scratch
    pub(crate) swings: Vec<f64>,   // change of each condition over the step that was divided
}

impl Events {
    /// Those of a model whose first phase has begun at `first`.
    pub(crate) fn new(
        model: &Model,
        outside: &ExternalActions,
        solver: Solver,
        mechanism: &vi_multibody::mechanism::Mechanism,
        first: PhaseStart,
    ) -> Result<Self, ModelError> {
        let list = model.events.clone();
        let mut conditions = EventConditions::new(model, &list, outside)?;
        conditions.sensors().begin(&first.q);
        let switches = Switches {
            ready: vec![true; list.len()],
            counts: vec![0; list.len()],
            turns: mechanism.principal_angles(&first.q),
            readings: conditions.sensors().state(),
            ..Switches::default()
        };
        Ok(Self {
            model: model.clone(),
            outside: outside.clone(),
            solver,
            list,
            conditions,
            joints: mechanism.description().joints.clone(),
            angles: mechanism.angles().to_vec(),
            first,
            switches,
            acting: Vec::new(),
            sides: Vec::new(),
            swings: Vec::new(),
        })
    }

    /// How often each event has acted.
    pub(crate) fn counts(&self) -> impl Iterator<Item = (&str, u64)> {
        self.list.iter().map(|event| event.name.as_str()).zip(self.switches.counts.iter().copied())
    }

    /// What is worth knowing of them.
    pub(crate) fn warnings(&self) -> impl Iterator<Item = String> {
        let crowded = (self.switches.crowded > 0).then(|| {
            format!(
                "in {} step(s) there were more than {MOST} events: the further ones act at the end of the step; a smaller \
                 step has fewer",
                self.switches.crowded
            )
        });
        crowded.into_iter()
    }

    /// Follows angles to the next node.
    pub(crate) fn follow(&mut self, q: &[f64]) {
        self.conditions.sensors().follow(q);
        let turns = &mut self.switches.turns;
        for (slot, angle) in self.angles.iter().enumerate() {
            let next = angle.at(Configuration { t: 0.0, q, angles: turns, internal: &[] });
            turns[slot] = next;
        }
    }

    /// A joint coordinate of the whole model, with the place of its revolutions where they count.
    fn coordinate(&self, joint: &str, freedom: usize) -> Option<JointCoordinate> {
        let joint = self.joints.iter().find(|own| own.name == joint)?;
        let own = JointCoordinate::principal(joint, freedom)?;
        let listed = self.angles.iter().find(|angle| angle.value() == own.value());
        Some(listed.cloned().unwrap_or(own))
    }

    /// Holds a joint coordinate where it is; the name of the constraint.
    pub(crate) fn lock(&mut self, joint: &str, freedom: usize, at: &PhaseStart) -> Option<String> {
        let coordinate = self.coordinate(joint, freedom)?;
        let turns = &self.switches.turns;
        let value =
            coordinate.at(Configuration { t: at.t, q: &at.q, angles: turns, internal: &[] });
        let lock = HeldJoint { joint: joint.to_owned(), freedom, value };
        let name = lock.name();
        self.switches.locks.push(lock);
        Some(name)
    }

    /// The value of a condition relative to its change over the step that was divided; `None` where
    /// it was not located.
    pub(crate) fn located(&self, event: usize) -> Option<f64> {
        let own = &self.list[event];
        let swing = self.swings.get(event).copied().filter(|swing| *swing > 0.0)?;
        let located = own.when.is_some() && conditions::is_located(own);
        located.then(|| self.sides[event].abs() / swing)
    }

    /// Takes up an action.
    pub(crate) fn switch(&mut self, action: &str, part: &str) {
        let switches = &mut self.switches;
        match action {
            "release" => {
                switches.released.insert(part.to_owned());
                switches.locks.retain(|lock| lock.joint != part);
            }
            "disable" => {
                switches.disabled.insert(part.to_owned());
            }
            "enable" => {
                switches.disabled.remove(part);
            }
            "end" => switches.ended = true,
            _ => {}
        }
    }
}
