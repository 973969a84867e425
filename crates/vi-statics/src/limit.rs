//! The limit of bending of a two-node element in director coordinates.
//!
//! Nodes rotated relative to each other by `θ` about `d_I` give `K_I = sin θ/ℓ` and carry the
//! moment `EI_I sin θ cos θ/ℓ` at most: `EI/(2ℓ)` at 45°. Beyond 90° the energy falls again and the
//! element folds at no cost. Beyond [`WARN`] results are inaccurate; beyond [`STOP`] they are
//! meaningless: refine the mesh. Source: theory §6, "Limit of the element".

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
    let [a, b] = nodes.map(|node| &q[12 * node..12 * node + 12]);
    rotation_angle(a, b)
}

/// The angle between the triads of two frames, rad.
pub(crate) fn rotation_angle(a: &[f64], b: &[f64]) -> f64 {
    // |·|_F² = 8 sin²(θ/2)
    let difference: Matrix3<f64> = directors::triad(a) - directors::triad(b);
    2.0 * libm::asin((difference.norm() / 8.0_f64.sqrt()).min(1.0))
}

/// The relative rotations of the nodes of all elements.
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
    /// Pairs of neighbouring nodes in the configuration `q`; elements are numbered in this order.
    #[must_use]
    pub fn new(neighbours: &[[usize; 2]], q: &[f64]) -> Self {
        let mut report = Self::default();
        for (k, nodes) in neighbours.iter().enumerate() {
            let angle = angle_between(*nodes, q);
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

    /// A warning, if an element is beyond [`WARN`].
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
            let report = LimitReport::new(&[[0, 1]], &q);
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
