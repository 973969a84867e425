//! What sensors see of a node.

use crate::run::contacts::ContactSample;
use crate::run::energies::EnergyTerms;
use vi_core::{Configuration, Motion, State};
use vi_multibody::form::Form;

/// The works of force elements up to a node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Works<'a> {
    /// Those of earlier phases.
    pub(crate) terms: &'a EnergyTerms,
    /// Those of the present phase, of each force, J.
    pub(crate) of_forces: &'a [f64],
}

impl Works<'_> {
    /// That of a force element since the start, J.
    pub(super) fn of(&self, element: &str) -> f64 {
        self.terms.work_of(element, self.of_forces)
    }
}

/// A node as sensors see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View<'a> {
    /// Time, s.
    pub(crate) t: f64,
    /// `q_n`.
    pub(crate) q: &'a [f64],
    /// Unwrapped joint angles at `q_n`, rad.
    pub(crate) angles: &'a [f64],
    /// Internal variables of signals.
    pub(crate) signals: &'a [f64],
    /// `v̂`.
    pub(crate) v: &'a [f64],
    /// `q̈`; read only by sensors of accelerations.
    pub(crate) a: &'a [f64],
    /// `G(q_n)ᵀλ_n`, N; read only by sensors of reactions.
    pub(crate) force: &'a [f64],
    /// The works of force elements; read only by sensors of works.
    pub(crate) works: Option<Works<'a>>,
    /// `A_d` of the step that ended here, of each constraint on velocities, m/s.
    pub(crate) slips: &'a [f64],
    /// The contacts of the node; `None` where no step from it is known.
    pub(crate) contacts: Option<&'a [ContactSample]>,
}

impl<'a> View<'a> {
    /// A state with the velocities `v`, without signals and constraints on velocities.
    pub(crate) fn of_motion(state: &'a State, v: &'a [f64]) -> Self {
        let (t, q, angles) = (state.t, &state.q[..], &state.angles[..]);
        let none = &[][..];
        let (signals, a, force, slips) = (none, none, none, none);
        View { t, q, angles, signals, v, a, force, works: None, slips, contacts: None }
    }

    /// The configuration, with the internal variables of signals alone.
    pub(crate) fn configuration(&self) -> Configuration<'a> {
        let Self { t, q, angles, signals, .. } = *self;
        Configuration { t, q, angles, internal: signals }
    }

    /// The same with the velocity.
    pub(crate) fn motion(&self) -> Motion<'a> {
        self.configuration().moving(self.v)
    }

    /// `l̇ = D̂·Ḋ` of the vector between two points, m/s; `|Ḋ|` where they coincide, the rate from
    /// there on.
    pub(super) fn length_rate(&self, between: &Form) -> f64 {
        let (d, rate) = (between.at(self.q), between.rate(self.v));
        let length = d.norm();
        if length > 0.0 { d.dot(&rate) / length } else { rate.norm() }
    }
}
