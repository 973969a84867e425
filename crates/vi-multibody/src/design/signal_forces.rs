//! What forces feel of the rates of states of signals by a parameter: `∂f_d^∓/∂z_n ψ` [2.59].

use super::explicit::{Explicit, Sink};
use super::signals::{SignalTangent, Times};
use crate::builder::{ElementForce, ForceElements};
use vi_constraints::design::Place;
use vi_core::force::DiscreteForce;
use vi_core::interval::Slot;

/// Forces that read the states.
pub(super) struct OfSignals {
    own: SignalTangent,
    forces: Vec<Box<dyn DiscreteForce>>,
}

impl OfSignals {
    pub(super) fn new(own: &SignalTangent, forces: &ForceElements) -> Self {
        let reads =
            |force: &&ElementForce| matches!(force, ElementForce::Law(_) | ElementForce::Six(_));
        let first = own.first();
        let forces = forces.forces.iter().map(|named| &named.force).filter(reads);
        Self { own: own.clone(), forces: forces.map(|force| force.discrete(first)).collect() }
    }
}

impl Explicit for OfSignals {
    fn emit(&self, at: Place<'_>, out: &mut dyn Sink) {
        let Place::Step(s) = at else { return };
        let (shift, first) = (self.own.shift(s), self.own.first());
        for force in &self.forces {
            let visit = |i: usize, f: f64| out.minus(i, f);
            let mut times = Times { first, shift: &shift, visit };
            force.add_internal_slope(s, Slot::First, &mut times);
            let visit = |i: usize, f: f64| out.plus(i, f);
            let mut times = Times { first, shift: &shift, visit };
            force.add_internal_slope(s, Slot::Second, &mut times);
        }
    }
}
