//! Works since the start.
//!
//! ```text
//! load, motor, damper, law   Σ (f_d^- + f_d^+)·Δq/h     of the steps, as in energy.csv
//! spring, bushing            −Σ ΔV                      of the steps in which it acts
//! ```

use super::columns::PARTS;
use super::finder::Finder;
use super::view::View;
use crate::system::joint_drive::{ElementLaw, JointDrive};
use crate::system::time_function::TimeFunctions;
use crate::system::works::force_of;
use std::sync::Arc;
use vi_core::potential::Potential;
use vi_multibody::joint_motion::JointMotion;

/// The works of the parts of an element, a number each.
#[derive(Clone, Debug)]
pub(super) struct WorkOfParts {
    parts: Vec<WorkPart>,
}

/// The work of one part: of the forces of its name, and of what it stores.
#[derive(Clone, Debug)]
struct WorkPart {
    name: &'static str, // of a joint
    forces: String,
    stored: Option<StoredOfPart>,
}

/// What a part stores, followed from step to step.
#[derive(Clone, Debug)]
struct StoredOfPart {
    potential: OwnPotential,
    idle: bool,
    followed: [f64; 2], // J  V at the last node, work up to it
}

#[derive(Clone)]
enum OwnPotential {
    /// `½ k (θ − θ_0)²` of an unwrapped joint coordinate.
    Joint { motion: Box<JointMotion>, freedom: usize, stiffness: f64, rest: f64 },
    /// Of the configuration.
    Field(Arc<dyn Potential>),
}

impl std::fmt::Debug for OwnPotential {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OwnPotential").finish_non_exhaustive()
    }
}

impl OwnPotential {
    fn value(&self, q: &[f64]) -> f64 {
        match self {
            Self::Joint { motion, freedom, stiffness, rest } => {
                let stretch = motion.values()[*freedom] - rest;
                0.5 * stiffness * stretch * stretch
            }
            Self::Field(potential) => potential.value(q),
        }
    }
}

impl WorkOfParts {
    /// Of a joint, spring, load, law or bushing; `None` when there is none of this name.
    pub(super) fn of(name: &str, from: &Finder<'_>) -> Option<Self> {
        let model = from.names.model;
        if let Some((joint, _)) = from.names.joint(name) {
            let own = from.mechanism.description().joints[from.joint(name)?].clone();
            let motion = Box::new(JointMotion::new(own, &from.q));
            let elements = from.names.elements(joint, &mut TimeFunctions::new(model));
            let part = |part: &'static str| {
                let mut own = elements.iter().filter(|element| element.part == part).peekable();
                own.peek()?;
                let stored = own.find_map(|JointDrive { freedom, law, .. }| match *law {
                    ElementLaw::Spring { stiffness, rest } => {
                        let (motion, freedom) = (motion.clone(), *freedom);
                        Some(OwnPotential::Joint { motion, freedom, stiffness, rest })
                    }
                    _ => None,
                });
                Some(WorkPart::new(part, force_of(name, part), stored))
            };
            return Some(Self { parts: PARTS.into_iter().filter_map(part).collect() });
        }
        let forces = &from.dynamics.forces;
        let spring = model.springs.iter().position(|spring| spring.name == name);
        let stored = match spring {
            Some(k) => Some(OwnPotential::Field(Arc::new(forces.springs.get(k)?.clone()))),
            None => {
                let bushing = forces.bushings.iter().find(|own| own.name == name);
                bushing.map(|own| OwnPotential::Field(Arc::new(own.spring.clone())))
            }
        };
        Some(Self { parts: vec![WorkPart::new("", name.to_owned(), stored)] })
    }

    /// Goes on with other parts, `idle(name, part)` of them without effect.
    pub(super) fn act_by(&mut self, name: &str, idle: &dyn Fn(&str, &str) -> bool) {
        for part in &mut self.parts {
            if let Some(stored) = &mut part.stored {
                stored.idle = idle(name, part.name);
            }
        }
    }

    /// Begins to count at the configuration `q`.
    pub(super) fn begin(&mut self, q: &[f64]) {
        for stored in self.stored() {
            if let OwnPotential::Joint { motion, .. } = &mut stored.potential {
                **motion = JointMotion::new(motion.joint().clone(), q);
            }
            stored.followed = [stored.potential.value(q), 0.0];
        }
    }

    /// Goes on to the next step; allocates nothing.
    pub(super) fn follow(&mut self, q: &[f64]) {
        for stored in self.stored() {
            if let OwnPotential::Joint { motion, .. } = &mut stored.potential {
                motion.follow(q);
            }
            let [last, done] = stored.followed;
            let now = stored.potential.value(q);
            stored.followed = [now, if stored.idle { done } else { done + last - now }];
        }
    }

    fn stored(&mut self) -> impl Iterator<Item = &mut StoredOfPart> {
        self.parts.iter_mut().filter_map(|part| part.stored.as_mut())
    }

    /// What is followed: of each potential its values, then those of its joint.
    pub(super) fn state(&self) -> Vec<f64> {
        let mut state = Vec::new();
        for stored in self.parts.iter().filter_map(|part| part.stored.as_ref()) {
            state.extend(stored.followed);
            if let OwnPotential::Joint { motion, .. } = &stored.potential {
                state.extend(motion.values());
            }
        }
        state
    }

    /// Continues from [`WorkOfParts::state`].
    pub(super) fn resume(&mut self, state: &[f64]) {
        let mut rest = state;
        for stored in self.stored() {
            let Some((followed, others)) = rest.split_first_chunk() else { return };
            stored.followed = *followed;
            rest = others;
            if let OwnPotential::Joint { motion, .. } = &mut stored.potential {
                let (values, others) = rest.split_at(motion.values().len());
                motion.resume(values);
                rest = others;
            }
        }
    }

    pub(super) fn read(&self, at: &View<'_>, out: &mut Vec<f64>) {
        out.extend(self.parts.iter().map(|part| {
            let stored = part.stored.as_ref().map_or(0.0, |stored| stored.followed[1]);
            stored + at.works.map_or(0.0, |works| works.of(&part.forces))
        }));
    }
}

impl WorkPart {
    fn new(name: &'static str, forces: String, potential: Option<OwnPotential>) -> Self {
        let stored =
            potential.map(|potential| StoredOfPart { potential, idle: false, followed: [0.0; 2] });
        Self { name, forces, stored }
    }
}
