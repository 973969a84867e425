//! How far the elements of a placement are from their limit.
//!
//! Nodes turned against each other by `θ` about `d_I` give `K_I = sin θ/ℓ` and carry the moment
//! `EI_I sin θ cos θ/ℓ` at most: `EI/(2ℓ)` at 45°. Beyond 90° the energy falls again and the element
//! folds at no cost. Beyond [`WARN`] results are coarse; beyond [`STOP`] they mean nothing: refine the
//! mesh. Source: theory §6, "Limit of the element".

use crate::element::{Element, Elements};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use vi_rigid::directors;

/// Angle between the triads of an element beyond which the mesh should be refined, rad.
pub const WARN: f64 = std::f64::consts::FRAC_PI_4;
/// Angle beyond which a placement is refused, rad.
pub const STOP: f64 = std::f64::consts::FRAC_PI_2;

/// The angle between the triads of both nodes, rad.
#[must_use]
pub fn element_angle(element: &Element, q: &[f64]) -> f64 {
    let [a, b] = element.nodes.map(|node| directors::triad(&q[12 * node..12 * node + 12]));
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
    /// Looks at all elements in the placement `q`.
    #[must_use]
    pub fn new(elements: &Elements, q: &[f64]) -> Self {
        let mut report = Self::default();
        for (k, element) in elements.list().iter().enumerate() {
            let angle = element_angle(element, q);
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
