//! A law along a joint coordinate that is an unknown of a step: its effort by the unknowns.

use super::target::Target;
use super::{Input, LawForce};
use vi_core::configuration::Configuration;
use vi_core::coordinate_force::SignedUnknown;
use vi_core::interval::{Interval, Slot};
use vi_core::quantity_effort::{QuantityEffort, StepQuantity};

impl LawForce {
    /// The unknown along which it acts.
    pub(super) fn along(&self) -> Option<SignedUnknown> {
        match &self.target {
            Target::Coordinate(own) => own.unknown(),
            Target::Points(_) | Target::Member(_) | Target::Relative(_) => None,
        }
    }
}

/// Of laws that act along an unknown.
impl QuantityEffort for LawForce {
    fn unknown(&self) -> SignedUnknown {
        self.along().expect("its coordinate is an unknown")
    }

    fn count(&self) -> usize {
        self.reading.inputs.len()
    }

    fn quantity(&self, j: usize) -> StepQuantity {
        match &self.reading.inputs[j] {
            Input::Time | Input::Held(_) | Input::Past(_) => StepQuantity::Fixed,
            Input::Coordinate(own) => {
                own.unknown().map_or(StepQuantity::Configuration, StepQuantity::Coordinate)
            }
            Input::Rate(own) => {
                own.unknown().map_or(StepQuantity::Configuration, StepQuantity::Rate)
            }
            _ => StepQuantity::Configuration,
        }
    }

    fn at_start(&self, j: usize, at: Configuration<'_>) -> f64 {
        match &self.reading.inputs[j] {
            Input::Coordinate(own) => own.at_node(at),
            _ => f64::NAN, // no coordinate
        }
    }

    fn in_step(&self, j: usize, s: &Interval) -> f64 {
        self.reading.inputs[j].in_step(s, self.reading.own(&s.internal))
    }

    fn for_each_slope(&self, j: usize, s: &Interval, visit: &mut dyn FnMut(usize, f64)) {
        self.reading.inputs[j].for_each_slope(s, Slot::Second, visit);
    }

    fn effort(&self, s: &Interval, y: &[f64]) -> f64 {
        self.reading.with_values_of(y, s, |work| work.efforts()[0])
    }

    fn effort_and_slopes(&self, s: &Interval, y: &[f64], slopes: &mut [f64]) -> f64 {
        self.reading.with_slopes_of(y, s, |work| {
            slopes.iter_mut().enumerate().for_each(|(j, slope)| *slope = work.slope(0, j));
            work.efforts()[0]
        })
    }

    fn is_affine(&self) -> bool {
        self.reading.law.is_affine()
    }

    fn add_gradient(&self, q: &[f64], scale: f64, out: &mut [f64]) {
        if let Target::Coordinate(own) = &self.target {
            own.add_gradient(q, scale, out);
        }
    }
}
