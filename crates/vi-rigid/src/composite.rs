//! Bodies put together from parts.
//!
//! ```text
//! m = Σ m_k,    x = Σ m_k x_k / m,    J = Σ [ J_k + m_k (|c_k|² I − c_k c_kᵀ) ],   c_k = x_k − x
//! ```
//! Letters: `x_k` centre of mass of a part (m), `J_k` its inertia tensor about that centre (kg·m²),
//! all in common axes. The last term is the parallel-axis shift.
//! [`crate::PrincipalInertia::from_tensor`] makes a body of the result.
#![allow(non_snake_case)] // E: Euler moments

use crate::inertia::InertiaError;
use crate::shape::positive;
use nalgebra::{Matrix3, Vector3};

/// A part of a body, or the body itself, in axes common to all parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub center: Vector3<f64>,
    /// Inertia tensor about the part's own centre of mass, kg·m².
    pub inertia: Matrix3<f64>,
}

/// Inertia tensor of a point mass at `offset`: the parallel-axis shift `m (|c|² I − c cᵀ)`, kg·m².
#[must_use]
pub fn parallel_axis(mass: f64, offset: &Vector3<f64>) -> Matrix3<f64> {
    let (x, y, z) = (offset.x, offset.y, offset.z);
    let (xy, xz, yz) = (-x * y, -x * z, -y * z);
    Matrix3::new(y * y + z * z, xy, xz, xy, x * x + z * z, yz, xz, yz, x * x + y * y) * mass
}

impl Part {
    /// Inertia tensor about another point, in the same axes, kg·m².
    #[must_use]
    pub fn inertia_about(&self, point: &Vector3<f64>) -> Matrix3<f64> {
        self.inertia + parallel_axis(self.mass, &(self.center - point))
    }
}

/// The rigid union of several parts.
///
/// # Errors
/// [`InertiaError::NoParts`]; [`InertiaError::NotPositive`] or [`InertiaError::NotFinite`] for a
/// mass.
pub fn compose(parts: &[Part]) -> Result<Part, InertiaError> {
    if parts.is_empty() {
        return Err(InertiaError::NoParts);
    }
    let (mut mass, mut moment) = (0.0, Vector3::zeros());
    for part in parts {
        positive("the mass of a part", part.mass)?;
        mass += part.mass;
        moment += part.mass * part.center;
    }
    let center = moment / mass;
    let inertia = parts.iter().map(|part| part.inertia_about(&center)).sum();
    Ok(Part { mass, center, inertia })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertia::{PrincipalAxes, PrincipalInertia};
    use crate::rotation::exp;
    use crate::shape::Shape;
    use vi_testkit::Sample;

    fn block(lengths: [f64; 3], center: Vector3<f64>) -> Part {
        let body = Shape::Box { lengths }.mass_properties(2.0).unwrap();
        Part { mass: body.mass, center, inertia: body.inertia.tensor(&Matrix3::identity()) }
    }

    #[test]
    fn two_halves_make_a_whole() {
        let half = |side: f64| block([1.0, 2.0, 1.5], Vector3::new(0.3 + 0.5 * side, -0.2, 0.9));
        let whole = compose(&[half(-1.0), half(1.0)]).unwrap();
        let exact = block([2.0, 2.0, 1.5], Vector3::new(0.3, -0.2, 0.9));
        assert!((whole.mass - exact.mass).abs() < 1e-14);
        assert!((whole.center - exact.center).norm() < 1e-15);
        let error = (whole.inertia - exact.inertia).amax();
        assert!(error < 1e-14, "inertia off by {error:e}");
    }

    #[test]
    fn the_inertia_of_points_is_recovered_in_any_axes() {
        let mut sample = Sample::new(51);
        let masses = [1.0, 0.5, 2.0, 0.7];
        let turn = exp(&sample.of_length(1.0));
        let parts = masses.map(|mass| {
            let center = turn * sample.vector();
            Part { mass, center, inertia: Matrix3::zeros() }
        });
        let whole = compose(&parts).unwrap();
        let PrincipalAxes { inertia, triad } =
            PrincipalInertia::from_tensor(&whole.inertia).unwrap();
        // ∫ ξ_I² dm along each principal axis
        for (i, E) in inertia.euler_moments().0.into_iter().enumerate() {
            let along = |part: &Part| (part.center - whole.center).dot(&triad.column(i));
            let exact: f64 = parts.iter().map(|part| part.mass * along(part).powi(2)).sum();
            assert!((E - exact).abs() < 1e-14, "E_{}: {E} against {exact}", i + 1);
        }
    }

    #[test]
    fn no_parts_and_no_mass_are_refused() {
        assert_eq!(compose(&[]), Err(InertiaError::NoParts));
        let mut part = block([1.0; 3], Vector3::zeros());
        part.mass = 0.0;
        let message = compose(&[part]).unwrap_err().to_string();
        assert_eq!(message, "the mass of a part is 0; it must be positive");
    }
}
