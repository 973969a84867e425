//! The mass matrix of one body.
//!
//! ```text
//! M = diag(M_φ I, E_1 I, E_2 I, E_3 I) ∈ R^{12×12}                                       LMO08 (58)
//! P_inᵀ M P_in = diag(M_φ I, J),    J = Σ_I E_I (|d_I|² I − d_I d_Iᵀ)
//! T = ½ M_φ |φ̇|² + ½ ω·J ω
//! ```
//! Letters: `M_φ` mass (kg), `E_I` Euler moments (kg·m²), `J` spatial inertia tensor about the
//! centre of mass. `M` is constant and, for laminae and rods, singular.
#![allow(non_snake_case)] // M, E, J, P: the matrices of the formulas above

use crate::directors::director;
use crate::inertia::{EulerMoments, InertiaError, PrincipalInertia};
use crate::shape::{MassProperties, positive};
use nalgebra::{Matrix3, SVector, Vector3};
use vi_core::sparse::Entries;

/// Mass and Euler moments of a rigid body.
///
/// ```
/// use vi_rigid::{RigidBody, Shape};
///
/// let plate = Shape::Box { lengths: [0.4, 0.3, 0.01] }.mass_properties(7800.0)?;
/// let plate = RigidBody::try_from(plate)?;
/// assert!((plate.mass() - 9.36).abs() < 1e-12); // kg
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidBody {
    mass: f64,
    euler: [f64; 3],
}

impl RigidBody {
    /// A body of mass `M_φ` (kg) with Euler moments `E_I` (kg·m²).
    ///
    /// # Errors
    /// [`InertiaError::NotPositive`] for the mass, [`InertiaError::Negative`] for an `E_I`,
    /// [`InertiaError::NotFinite`] for either.
    pub fn new(mass: f64, euler: EulerMoments) -> Result<Self, InertiaError> {
        positive("the mass", mass)?;
        for (what, value) in ["E1", "E2", "E3"].into_iter().zip(euler.0) {
            if !value.is_finite() {
                return Err(InertiaError::NotFinite { what, value });
            }
            if value < 0.0 {
                return Err(InertiaError::Negative { what, value });
            }
        }
        Ok(Self { mass, euler: euler.0 })
    }

    /// A body of mass `M_φ` (kg) with the given principal inertias about its directors.
    ///
    /// # Errors
    /// [`InertiaError::NotPositive`] or [`InertiaError::NotFinite`] for the mass.
    pub fn from_inertia(mass: f64, inertia: &PrincipalInertia) -> Result<Self, InertiaError> {
        Self::new(mass, inertia.euler_moments())
    }

    /// `M_φ`, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// `E_1, E_2, E_3`, kg·m².
    #[must_use]
    pub fn euler(&self) -> [f64; 3] {
        self.euler
    }

    /// `J_1, J_2, J_3`, kg·m².
    #[must_use]
    pub fn principal_inertia(&self) -> [f64; 3] {
        EulerMoments(self.euler).principal_inertia()
    }

    /// The diagonal of `M`, one number for each of the vectors `φ, d_1, d_2, d_3`.
    #[must_use]
    pub fn mass_scalars(&self) -> [f64; 4] {
        [self.mass, self.euler[0], self.euler[1], self.euler[2]]
    }

    /// Emits `M`, shape `12 × 12`, with its upper left corner at `(offset, offset)`; zeros of
    /// laminae and rods are emitted too.
    pub fn emit_mass(&self, offset: usize, out: &mut dyn Entries) {
        for (block, mass) in self.mass_scalars().into_iter().enumerate() {
            for k in 0..3 {
                let at = offset + 3 * block + k;
                out.add(at, at, mass); // (58)
            }
        }
    }

    /// `p = M v`, shape 12.
    #[must_use]
    pub fn momentum(&self, v: &[f64]) -> [f64; 12] {
        let masses = self.mass_scalars();
        std::array::from_fn(|i| masses[i / 3] * v[i])
    }

    /// `J = Σ_I E_I (|d_I|² I − d_I d_Iᵀ)`, kg·m², about the centre of mass.
    #[must_use]
    pub fn spatial_inertia(&self, q: &[f64]) -> Matrix3<f64> {
        let mut J = Matrix3::zeros();
        for (i, E) in self.euler.into_iter().enumerate() {
            J += crate::composite::parallel_axis(E, &director(q, i));
        }
        J
    }

    /// Kinetic energy of the twist `(φ̇, ω)` at `q`, J.
    #[must_use]
    pub fn kinetic_energy(&self, q: &[f64], twist: &SVector<f64, 6>) -> f64 {
        let velocity = Vector3::new(twist[0], twist[1], twist[2]);
        let omega = Vector3::new(twist[3], twist[4], twist[5]);
        let spin = omega.dot(&(self.spatial_inertia(q) * omega));
        0.5 * (self.mass * velocity.norm_squared() + spin)
    }
}

impl TryFrom<MassProperties> for RigidBody {
    type Error = InertiaError;
    fn try_from(properties: MassProperties) -> Result<Self, InertiaError> {
        Self::from_inertia(properties.mass, &properties.inertia)
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp)] // copies and zeros are expected to be exact
mod tests {
    use super::*;
    use crate::directors::triad;
    use crate::null_space;
    use nalgebra::{DMatrix, SMatrix};
    use vi_testkit::Sample;

    fn body() -> RigidBody {
        RigidBody::new(2.5, EulerMoments([0.3, 0.7, 0.2])).unwrap()
    }

    #[test]
    fn the_reduced_mass_is_the_spatial_inertia() {
        let mut sample = Sample::new(61);
        let body = body();
        let mut M = DMatrix::zeros(12, 12);
        body.emit_mass(0, &mut M);
        for _ in 0..100 {
            let q = sample.frame();
            let P = null_space::matrix(&q);
            let mut expected = SMatrix::<f64, 6, 6>::zeros();
            expected.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(2.5);
            let principal = PrincipalInertia::new(body.principal_inertia()).unwrap();
            expected.fixed_view_mut::<3, 3>(3, 3).copy_from(&principal.tensor(&triad(&q)));
            let reduced = P.transpose() * &M * P;
            let error = (reduced - expected).amax();
            assert!(error < 2e-15, "PᵀMP off by {error:e}");
            let spatial = body.spatial_inertia(&q);
            let error = (spatial - reduced.fixed_view::<3, 3>(3, 3)).amax();
            assert!(error < 1e-15, "spatial inertia off by {error:e}");
            let twist = SVector::<f64, 6>::from(sample.array::<6>());
            let energy = 0.5 * (twist.transpose() * reduced * twist)[0];
            let error = (body.kinetic_energy(&q, &twist) - energy).abs();
            assert!(error < 4e-15, "kinetic energy off by {error:e}");
        }
    }

    #[test]
    fn momentum_is_mass_times_velocity() {
        let mut sample = Sample::new(62);
        let v: [f64; 12] = sample.array();
        let mut M = DMatrix::zeros(24, 24);
        body().emit_mass(12, &mut M);
        let product = M.view((12, 12), (12, 12)) * SVector::<f64, 12>::from(v);
        assert_eq!(product.as_slice(), body().momentum(&v));
        assert_eq!(M.view((0, 0), (12, 24)).amax(), 0.0, "the block stays in its place");
    }

    #[test]
    fn impossible_bodies_are_refused() {
        let message =
            |mass, euler| RigidBody::new(mass, EulerMoments(euler)).unwrap_err().to_string();
        assert_eq!(message(0.0, [1.0; 3]), "the mass is 0; it must be positive");
        assert_eq!(message(f64::INFINITY, [1.0; 3]), "the mass is inf; it must be a finite number");
        assert_eq!(message(1.0, [1.0, -0.5, 1.0]), "E2 is -0.5 kg·m²; it must not be negative");
        RigidBody::new(1.0, EulerMoments([0.0; 3])).unwrap();
    }
}
