//! The limit of bending of a two-node element in director coordinates.
//!
//! Strains of mean directors: nodes rotated relative to each other by `θ` about `d_I` give
//! `K_I = sin θ/ℓ` and carry the moment `EI_I sin θ cos θ/ℓ` at most: `EI/(2ℓ)` at 45°. Beyond 90°
//! the energy falls again and the element folds at no cost. Helicoidal strains give `K_I = θ/ℓ` up
//! to 180°, where the axis of `θ` is lost. Beyond [`BendingBounds::warn`] results are inaccurate;
//! beyond [`BendingBounds::stop`] they are meaningless: refine the mesh.
//!
//! Source: theory §6, "Limit of the element", §6.16.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use vi_rigid::directors;

/// How far the nodes of an element may be rotated relative to each other, rad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BendingBounds {
    /// The angle beyond which the mesh should be refined.
    pub warn: f64,
    /// The angle beyond which a configuration is refused.
    pub stop: f64,
}

impl BendingBounds {
    /// Of strains of mean directors: 45°, 90°.
    pub const MEAN_DIRECTORS: Self =
        Self { warn: std::f64::consts::FRAC_PI_4, stop: std::f64::consts::FRAC_PI_2 };
    /// Of helicoidal strains: 90°, 150°.
    pub const HELICOIDAL: Self =
        Self { warn: std::f64::consts::FRAC_PI_2, stop: 5.0 * std::f64::consts::FRAC_PI_6 };

    /// What happens beyond the bound that an angle exceeds; `None` within both.
    #[must_use]
    pub fn consequence(&self, angle: f64) -> Option<&'static str> {
        let folds = *self == Self::MEAN_DIRECTORS;
        match (angle > self.stop, angle > self.warn) {
            (true, _) if folds => Some("beyond 90° an element folds without resistance"),
            (true, _) => Some("beyond 150° its strains lose their meaning"),
            (_, true) if folds => {
                Some("beyond 45° the bending moment of an element decreases the more it bends")
            }
            (_, true) => Some("beyond 90° an element follows its deformation poorly"),
            _ => None,
        }
    }
}

impl Default for BendingBounds {
    fn default() -> Self {
        Self::MEAN_DIRECTORS
    }
}

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
    /// The angle between the triads of the element that is next to its bound, rad.
    pub largest_angle: f64,
    /// The element that has it.
    pub element: usize,
    /// Its bounds.
    #[serde(default)]
    pub bounds: BendingBounds,
    /// Elements beyond [`BendingBounds::warn`], with their angles (rad).
    pub beyond_warning: Vec<(usize, f64)>,
}

impl LimitReport {
    /// Pairs of neighbouring nodes in the configuration `q`; elements are numbered in this order.
    #[must_use]
    pub fn new(neighbours: &[([usize; 2], BendingBounds)], q: &[f64]) -> Self {
        let mut report = Self::default();
        for (k, (nodes, bounds)) in neighbours.iter().enumerate() {
            let angle = angle_between(*nodes, q);
            if angle * report.bounds.stop > report.largest_angle * bounds.stop {
                (report.largest_angle, report.element, report.bounds) = (angle, k, *bounds);
            }
            if angle > bounds.warn {
                report.beyond_warning.push((k, angle));
            }
        }
        report
    }

    /// Whether an element is beyond [`BendingBounds::stop`].
    #[must_use]
    pub fn is_exceeded(&self) -> bool {
        self.largest_angle > self.bounds.stop
    }

    /// A warning, if an element is beyond [`BendingBounds::warn`].
    #[must_use]
    pub fn message(&self) -> Option<String> {
        let (element, degrees) = (self.element, self.largest_angle.to_degrees());
        let consequence = self.bounds.consequence(self.largest_angle)?;
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
        for (bounds, degrees, message) in [
            (BendingBounds::MEAN_DIRECTORS, 30.0, None),
            (BendingBounds::MEAN_DIRECTORS, 60.0, Some("beyond 45°")),
            (BendingBounds::MEAN_DIRECTORS, 120.0, Some("folds")),
            (BendingBounds::HELICOIDAL, 60.0, None),
            (BendingBounds::HELICOIDAL, 120.0, Some("beyond 90°")),
            (BendingBounds::HELICOIDAL, 160.0, Some("beyond 150°")),
        ] {
            let mut q = [0.0; 24];
            let turn = rotation::exp(&(f64::to_radians(degrees) * Vector3::new(0.6, 0.0, 0.8)));
            directors::set_triad(&mut q[..12], &Matrix3::identity());
            directors::set_triad(&mut q[12..], &turn);
            let report = LimitReport::new(&[([0, 1], bounds)], &q);
            let error = (report.largest_angle.to_degrees() - degrees).abs();
            // the angle is read from sin(ψ/2), which is flat near 180°
            let flat = (0.5 * degrees.to_radians()).cos();
            assert!(error < 1e-13 / flat, "{report:?}");
            assert_eq!(report.is_exceeded(), degrees.to_radians() > bounds.stop);
            let beyond = usize::from(degrees.to_radians() > bounds.warn);
            assert_eq!(report.beyond_warning.len(), beyond);
            let found = report.message();
            assert_eq!(found.is_some(), message.is_some());
            assert!(found.unwrap_or_default().contains(message.unwrap_or_default()));
        }
    }
}
