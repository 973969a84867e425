//! Strains and stress resultants at one section.

use crate::strain::Strain;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Strains and stress resultants at one section of a beam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionState {
    /// Which element of the beam.
    pub element: usize,
    /// Reference arc length from the start of the beam, m.
    pub arc_length: f64,
    /// The length of the beam that it represents, m.
    pub length: f64,
    /// Its position, m.
    pub point: [f64; 3],
    /// `Γ_1, Γ_2, Γ_3`.
    pub shear_extension: [f64; 3],
    /// `K_1, K_2, K_3`, 1/m.
    pub curvature: [f64; 3],
    /// `N_1, N_2, N_3`, N.
    pub force: [f64; 3],
    /// `M_1, M_2, M_3`, N·m.
    pub moment: [f64; 3],
    /// `n`, N, on the side of the first node, by the side of the second.
    pub spatial_force: [f64; 3],
    /// `m`, N·m.
    pub spatial_moment: [f64; 3],
}

/// A section of a beam in some configuration, with its strains and stress resultants.
pub(crate) struct StationState {
    /// Reference arc length from the start of the element, m.
    pub(crate) along: f64,
    /// The length that it represents, m.
    pub(crate) length: f64,
    /// `φ`.
    pub(crate) point: Vector3<f64>,
    /// `d̄_I`.
    pub(crate) directors: [Vector3<f64>; 3],
    /// `Γ, K`.
    pub(crate) strain: Strain,
    /// `N, M`.
    pub(crate) stress: Strain,
}

impl StationState {
    pub(crate) fn state(&self, element: usize, start: f64) -> SectionState {
        let three = |v: &[f64]| [v[0], v[1], v[2]];
        let spatial = |at: usize| -> Vector3<f64> {
            (0..3).map(|i| self.stress[at + i] * self.directors[i]).sum()
        };
        SectionState {
            element,
            arc_length: start + self.along,
            length: self.length,
            point: self.point.into(),
            shear_extension: three(&self.strain.as_slice()[..3]),
            curvature: three(&self.strain.as_slice()[3..]),
            force: three(&self.stress.as_slice()[..3]),
            moment: three(&self.stress.as_slice()[3..]),
            spatial_force: spatial(0).into(),
            spatial_moment: spatial(3).into(),
        }
    }
}
