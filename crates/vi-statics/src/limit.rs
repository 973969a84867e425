//! How far the elements of a configuration are from their limit.
//!
//! Nodes turned against each other by `θ` about `d_I` give `K_I = sin θ/ℓ` and carry the moment
//! `EI_I sin θ cos θ/ℓ` at most: `EI/(2ℓ)` at 45°. Beyond 90° the energy falls again and the element
//! folds at no cost. Beyond [`WARN`] results are coarse; beyond [`STOP`] they mean nothing: refine the
//! mesh. Source: theory §6, "Limit of the element".

use crate::element::Elements;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use vi_rigid::directors;

/// Angle between the triads of an element beyond which the mesh should be refined, rad.
pub const WARN: f64 = std::f64::consts::FRAC_PI_4;
/// Angle beyond which a configuration is refused, rad.
pub const STOP: f64 = std::f64::consts::FRAC_PI_2;

/// The angle between the triads of two nodes, rad.
#[must_use]
pub fn angle_between(nodes: [usize; 2], q: &[f64]) -> f64 {
    let [a, b] = nodes.map(|node| directors::triad(&q[12 * node..12 * node + 12]));
    let difference: Matrix3<f64> = a - b; // |·|_F² = 8 sin²(θ/2)
    2.0 * (difference.norm() / 8.0_f64.sqrt()).min(1.0).asin()
}

/// The angles of all elements, summed up.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LimitReport {
    /// Largest angle between the triads of an element, rad.
    pub largest_angle: f64,
    /// The element that has it.
    pub element: usize,
    /// Elements beyond [`WARN`], with their angles (rad).
    pub beyond_warning: Vec<(usize, f64)>,
}

impl LimitReport {
    /// Looks at all elements in the configuration `q`.
    #[must_use]
    pub fn new(elements: &Elements, q: &[f64]) -> Self {
        Self::of_pairs(elements.list().iter().map(|element| element.nodes), q)
    }

    /// Looks at pairs of neighbouring nodes; elements are then numbered in this order.
    pub fn of_pairs(pairs: impl Iterator<Item = [usize; 2]>, q: &[f64]) -> Self {
        let mut report = Self::default();
        for (k, nodes) in pairs.enumerate() {
            let angle = angle_between(nodes, q);
            if angle > report.largest_angle {
                (report.largest_angle, report.element) = (angle, k);
            }
            if angle > WARN {
                report.beyond_warning.push((k, angle));
            }
        }
        report
    }

    /// Whether an element is beyond [`STOP`].
    #[must_use]
    pub fn is_exceeded(&self) -> bool {
        self.largest_angle > STOP
    }

    /// What to tell the user, if anything.
    #[must_use]
    pub fn message(&self) -> Option<String> {
        let degrees = self.largest_angle.to_degrees();
        if self.largest_angle <= WARN {
            return None;
        }
        let element = self.element;
        let consequence = if self.is_exceeded() {
            "beyond 90° an element folds at no cost"
        } else {
            "beyond 45° an element carries less moment the more it bends"
        };
        Some(format!(
            "element {element} is bent by {degrees:.1}° between its nodes; {consequence}: refine the \
             mesh"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::Section;
    use nalgebra::Vector3;
    use vi_rigid::rotation;

    #[test]
    fn angles_and_their_messages() {
        for (degrees, message) in [(30.0, None), (60.0, Some("beyond 45°")), (120.0, Some("folds"))]
        {
            let mut q = [0.0; 24];
            let turn = rotation::exp(&(f64::to_radians(degrees) * Vector3::new(0.6, 0.0, 0.8)));
            directors::set_triad(&mut q[..12], &Matrix3::identity());
            directors::set_triad(&mut q[12..], &turn);
            let mut elements = Elements::new();
            elements.add_section(Section::new([1.0; 6], [1.0; 4]).unwrap());
            elements.add_stress_free([0, 1], 1.0, 0, &q).unwrap();
            let report = LimitReport::new(&elements, &q);
            let error = (report.largest_angle.to_degrees() - degrees).abs();
            assert!(error < 1e-13, "{report:?}");
            assert_eq!(report.is_exceeded(), degrees > 90.0);
            assert_eq!(report.beyond_warning.len(), usize::from(degrees > 45.0));
            let found = report.message();
            assert_eq!(found.is_some(), message.is_some());
            assert!(found.unwrap_or_default().contains(message.unwrap_or_default()));
        }
    }
}
