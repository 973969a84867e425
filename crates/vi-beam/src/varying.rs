//! Elements along which the section changes.
//!
//! ```text
//! C⁻¹ = Σ_g w_g C_g⁻¹                           compliances add
//! M_e = Σ_g w_g ℓ Σ_IJ m_IJ(ξ_g) N_I(ξ_g)ᵀ N_J(ξ_g)
//! N_φ = (½ − ξ, ½ + ξ) of φ, ½ (ξ² − ¼) ℓ of Δd_3,   N_I = (½ − ξ, ½ + ξ) of d_I
//! ```
//! The weights `w_g` of the places `ξ_g ∈ [−½, ½]` have the sum 1. Directors are lumped in the
//! quadratic mass: `½ ∓ ξ` of what is there belongs to each node.
//!
//! Source: theory §6.17.
#![allow(non_snake_case)] // M, N

use crate::mass_kind::MassKind;
use crate::section::Section;
use nalgebra::{Matrix4, SMatrix, SVector};
use vi_core::Number;

/// A section at a place of an element, one of a quadrature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPoint<T = f64> {
    /// `ξ`, −½ at the first node, ½ at the second.
    pub place: T,
    /// `w`, its part of the element.
    pub weight: T,
    /// The section there.
    pub section: Section<T>,
}

impl<T: Number> SectionPoint<T> {
    pub(crate) fn mass(&self) -> MassPoint<T> {
        let (place, weight) = (self.place, self.weight);
        MassPoint { place, weight, mass: self.section.mass_matrix() }
    }
}

/// The mass per length at a place of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MassPoint<T = f64> {
    pub(crate) place: T,
    pub(crate) weight: T,
    pub(crate) mass: Matrix4<T>,
}

/// Three Gauss points between two places of an element, with their parts of it.
#[must_use]
pub fn quadrature<T: Number>(from: T, to: T) -> [[T; 2]; 3] {
    let (middle, half) = (T::of(0.5) * (from + to), T::of(0.5) * (to - from));
    let far = T::of(0.6_f64.sqrt()) * half;
    let [inner, outer] = [T::of(8.0 / 9.0) * half, T::of(5.0 / 9.0) * half];
    [[middle - far, outer], [middle, inner], [middle + far, outer]]
}

/// As [`MassKind::matrix`], of a mass that changes along the element.
pub(crate) fn mass_along<T: Number>(
    kind: MassKind,
    length: T,
    points: &[MassPoint<T>],
) -> SMatrix<T, 8, 8> {
    let (half, quarter) = (T::of(0.5), T::of(0.25));
    let mut M = SMatrix::<T, 8, 8>::zeros();
    for MassPoint { place, weight, mass } in points {
        let (xi, m) = (*place, mass * (*weight * length));
        let N = [half - xi, half + xi];
        let linear = |slot: usize| {
            let mut shape = SVector::<T, 8>::zeros();
            (shape[slot], shape[4 + slot]) = (N[0], N[1]);
            shape
        };
        let mut center = linear(0);
        if kind == MassKind::Quadratic {
            let bend = half * (xi * xi - quarter) * length;
            (center[3], center[7]) = (-bend, bend);
        }
        let shape = |slot: usize| if slot == 0 { center } else { linear(slot) };
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            let of_center = i == 0 || j == 0;
            if kind == MassKind::Consistent || (kind == MassKind::Quadratic && of_center) {
                M += (shape(i) * m[(i, j)]) * shape(j).transpose();
            } else {
                M[(i, j)] += N[0] * m[(i, j)];
                M[(4 + i, 4 + j)] += N[1] * m[(i, j)];
            }
        }
    }
    M
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(mass: impl Fn(f64) -> Matrix4<f64>) -> Vec<MassPoint> {
        let of = |[place, weight]: [f64; 2]| MassPoint { place, weight, mass: mass(place) };
        quadrature(-0.5, 0.5).map(of).to_vec()
    }

    fn full() -> Matrix4<f64> {
        #[rustfmt::skip]
        let m = Matrix4::new(
            1.3, 0.2, -0.1, 0.0,
            0.2, 0.4, 0.03, 0.0,
            -0.1, 0.03, 0.3, 0.0,
            0.0, 0.0, 0.0, 0.05,
        );
        m
    }

    #[test]
    fn a_constant_mass_is_that_of_the_closed_form() {
        for kind in [MassKind::Consistent, MassKind::Lumped, MassKind::Quadratic] {
            let off = mass_along(kind, 0.7, &points(|_| full())) - kind.matrix(0.7, &full());
            println!("{kind:?}: off by {:.1e}", off.amax());
            assert!(off.amax() < 1e-16, "{kind:?}: {off}");
        }
    }

    #[test]
    fn a_rigid_motion_sees_the_moments_of_a_taper() {
        // φ = x e, d_3 = e: positions of a rotation about the first node in the plane of the beam
        let taper = |xi: f64| (1.0 + 0.8 * xi) * Matrix4::from_diagonal_element(1.0);
        let x = SVector::<f64, 8>::from_column_slice(&[0.0, 0.0, 0.0, 1.0, 0.7, 0.0, 0.0, 1.0]);
        for kind in [MassKind::Consistent, MassKind::Quadratic] {
            let M = mass_along(kind, 0.7, &points(taper));
            // ∫ (1 + 0.8 ξ) (½ + ξ)² dξ = 1/3 + 0.8/12, and lumped d_3 with 1 + 0.8 ξ
            let expected = 0.7_f64.powi(3) * (1.0 / 3.0 + 0.8 / 12.0) + 0.7;
            let found = (x.transpose() * M * x)[0];
            assert!((found - expected).abs() < 1e-14, "{kind:?}: {found} against {expected}");
        }
    }
}
