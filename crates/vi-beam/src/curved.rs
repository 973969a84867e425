//! How far an element stands for a beam that is curved or twisted, without stress or by its loads,
//! along which bending and twist pass into one another.
//!
//! ```text
//! m' = −K×m,   so that the mean moments of a length have the compliance  S + (ℓ²/12) K̂ᵀSK̂
//! x = (ℓ²/12) λ_max(S⁻¹ K̂ᵀSK̂)           = (ℓK)² A/(12 B), A and B the stiffnesses about the axes across K
//! stiffness of the beam: B/(1 + x),   of an element of order 4: B (1 − x/2)²
//! ```
//! The latter has the former to the order of `ℓ²`. At `x = 1/2` it is a sixth too soft, at `x = 2`
//! it has no stiffness at all, beyond it is too stiff.
//!
//! Letters: `S` lower right block of `C⁻¹`, `K` curvature, `ℓ` length.
//!
//! Source: theory §6.16.
#![allow(non_snake_case)] // K, S, L

use crate::element::{Element, ElementKind};
use crate::elements::Elements;
use crate::section::Section;
use nalgebra::{Matrix3, Vector3};

/// `x` beyond which an element does not stand for the beam.
pub const COARSE: f64 = 0.5;
/// `x` at which its stiffness is right to a twentieth.
const FINE: f64 = 0.25;

/// The element of a beam that stands for it least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvedElement {
    /// Which one, counted along the elements asked for.
    pub element: usize,
    /// `ℓ|K|`, rad.
    pub angle: f64,
    /// `x`.
    pub coupling: f64,
}

impl CurvedElement {
    /// By how many times as many elements the stiffness is right to a twentieth.
    #[must_use]
    pub fn refinement(&self) -> f64 {
        (self.coupling / FINE).sqrt()
    }
}

/// Of some elements with strains of order 4 the one with the largest `x`, with the stress-free
/// curvature or that of a configuration; `None` where all are straight, or of other strains.
#[must_use]
pub fn most_coupled<'a>(
    elements: &Elements,
    own: impl IntoIterator<Item = &'a Element>,
    q: Option<&[f64]>,
) -> Option<CurvedElement> {
    let own = own.into_iter().enumerate();
    let helicoidal = own.filter(|(_, own)| own.law.kind() == ElementKind::Helicoidal);
    let found = helicoidal.filter_map(|(element, own)| {
        let mut K: Vector3<f64> = own.reference.fixed_rows::<3>(3).into();
        if let Some(q) = q {
            K += own.strain(&own.coordinates(q)).fixed_rows::<3>(3);
        }
        let coupling = coupling(&(own.length * K), elements.section(own))?;
        Some(CurvedElement { element, angle: own.length * K.norm(), coupling })
    });
    found.filter(|own| own.coupling > 0.0).max_by(|a, b| a.coupling.total_cmp(&b.coupling))
}

/// `x` of `ℓK`: with `S = LLᵀ` the largest eigenvalue of `S⁻¹K̂ᵀSK̂` is that of `BᵀB`,
/// `B = LᵀK̂L⁻ᵀ`.
fn coupling(angle: &Vector3<f64>, section: &Section) -> Option<f64> {
    let S: Matrix3<f64> = section.compliance().fixed_view::<3, 3>(3, 3).into();
    let L = S.cholesky()?.l();
    let B = L.transpose() * angle.cross_matrix() * L.transpose().try_inverse()?;
    Some(B.tr_mul(&B).symmetric_eigenvalues().max() / 12.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::tests::{near_frames, random_elements, with_strains};
    use crate::strain::Strain;
    use vi_testkit::Sample;

    #[test]
    fn the_element_that_is_curved_most_is_named_with_its_angle() {
        let mut sample = Sample::new(41);
        let (elements, q) = (random_elements(&mut sample).0, near_frames(&mut sample));
        let mut elements = with_strains(elements, ElementKind::Helicoidal, &q);
        for (most, curvatures) in [(1, [0.3, 0.9]), (0, [0.9, 0.3])] {
            for (k, curvature) in curvatures.into_iter().enumerate() {
                elements.set_reference(k, Strain::new(0.0, 0.0, 1.0, 0.0, curvature, 0.0));
            }
            let found = most_coupled(&elements, elements.list(), None).unwrap();
            assert_eq!(found.element, most, "{found:?}");
            assert!((found.angle - 0.8 * 0.9).abs() < 1e-15, "{found:?}");
        }
        (0..2).for_each(|k| elements.set_reference(k, Strain::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0)));
        assert_eq!(most_coupled(&elements, elements.list(), None), None);
    }

    /// An arc of a strip, a blade and an open section about one axis: the ratio of the stiffnesses
    /// about the two others decides, whichever is the larger.
    #[test]
    fn the_coupling_is_that_of_the_stiffnesses_across_the_curvature() {
        let angle = 0.3;
        let members = [[1.0, 400.0, 1.5], [1.0, 10.0, 0.3], [50.0, 1.0, 0.01], [1.0, 1.0, 1e3]];
        for [a, b, c] in members {
            let section = Section::new([1e6, 1e6, 1e6, a, b, c], [1.0, 0.1, 0.1, 0.0]).unwrap();
            for (axis, [p, q]) in [[b, c], [c, a], [a, b]].into_iter().enumerate() {
                let found = coupling(&(angle * Vector3::ith(axis, 1.0)), &section).unwrap();
                let exact = angle * angle / 12.0 * (p / q).max(q / p);
                assert!((found / exact - 1.0).abs() < 1e-12, "{found} and {exact}");
            }
        }
    }
}
