//! What force elements store, differentiated by parameters.
//!
//! ```text
//! V_θ at fixed q: ½ k_θ (x − x_0)² + k (x − x_0)(x_θ − x_0θ) of a spring
//!                 V_θ + ∇V·δq of a bushing, whose frames move
//! ```

use super::ModelTangent;
use crate::system::works::ElementStore;
use vi_core::Configuration;
use vi_core::num_dual::Dual64;
use vi_core::potential::DiscretePotential;
use vi_multibody::design::{EffortTangent, MovedCoordinate, MovedSixSpring};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::spring::Spring;

/// `V_θ` of one parameter.
pub(crate) type StoredTangent = Box<dyn Fn(Configuration<'_>) -> f64 + Send + Sync>;

/// `V_θ` at a configuration; `None` where a parameter does not change it.
pub(crate) fn by_parameter(
    stored: &ElementStore,
    force: &str,
    mechanism: &Mechanism,
    tangent: &ModelTangent,
) -> Option<StoredTangent> {
    match stored {
        ElementStore::Joint(joint, spring) => {
            let moved = MovedCoordinate::of(mechanism, &tangent.numbers, &spring.coordinate);
            let mut efforts = tangent.drives.iter();
            let own = efforts.find(|(of, part, _)| (*of, *part) == (*joint, "spring"));
            let by = own.map(|own| own.2.clone());
            if moved.is_none() && by.is_none() {
                return None;
            }
            let spring = spring.clone();
            Some(Box::new(move |at| {
                let (rest, x) = (spring.rest, spring.coordinate.at(at));
                let stretch = x - rest;
                // V_θ = −∫ τ_θ dx from x_0, of which τ_θ is linear in x
                let of =
                    |by: &EffortTangent| -0.5 * (by(at.t, rest, 0.0) + by(at.t, x, 0.0)) * stretch;
                let along = moved.as_ref().map_or(0.0, |own| own.by(at.q));
                by.as_ref().map_or(0.0, of) + spring.stiffness * stretch * along
            }))
        }
        ElementStore::Spring(k, spring) => {
            let change = tangent.numbers.springs.get(k)?;
            let dual = Spring {
                between: spring.between.with_tangent(&change.between),
                stiffness: Dual64::new(spring.stiffness, change.stiffness),
                natural_length: Dual64::new(spring.natural_length, change.natural_length),
                law: spring.law,
            };
            Some(Box::new(move |at| dual.energy(at.q).eps))
        }
        ElementStore::Bushing(spring) => {
            let own = tangent.acting.bushings.iter().find(|own| own.name == force);
            let own = own.map(|own| own.spring.clone()); // linear in its numbers
            let moved = tangent.bushings.iter().find(|own| own.0 == force);
            let moved = moved.map(|own| MovedSixSpring::new((**spring).clone(), own.1.clone()));
            if own.is_none() && moved.is_none() {
                return None;
            }
            Some(Box::new(move |at| {
                let by_numbers = own.as_ref().map_or(0.0, |own| own.potential(at));
                by_numbers + moved.as_ref().map_or(0.0, |own| own.energy(at))
            }))
        }
    }
}
