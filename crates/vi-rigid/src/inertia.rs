//! Principal inertias, the Euler tensor, and the diagonalization of a full tensor.
//!
//! ```text
//! J   = ∫ (|x|² I − x xᵀ) dm           inertia tensor about the centre of mass
//! E   = ∫ x xᵀ dm = ½ tr(J) I − J      Euler tensor                             LMO08 (57)
//! E_I = ½ (J_J + J_K − J_I) ≥ 0        the triangle inequality of principal inertias
//! ```
//! Letters: `J_I`, `E_I` principal values, kg·m², `I = 1, 2, 3`. A lamina has one `E_I = 0`, an
//! ideal rod two. `J` about a shifted point and the sum over several parts: [`crate::composite`].
#![allow(non_snake_case)] // J, E, A: the tensors of the formulas above

use crate::rotation::polar_step;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Relative violation of the triangle inequality, and relative asymmetry of a tensor, that is
/// taken for rounding of the input and repaired.
pub const INERTIA_TOLERANCE: f64 = 1e-10;

/// Mass properties that no body has.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InertiaError {
    /// A value is NaN or infinite.
    #[error("{what} is {value}; it must be a finite number")]
    NotFinite {
        /// Which value.
        what: &'static str,
        /// The value.
        value: f64,
    },
    /// A mass, density or length is zero or negative.
    #[error("{what} is {value}; it must be positive")]
    NotPositive {
        /// Which value.
        what: &'static str,
        /// The value.
        value: f64,
    },
    /// A principal inertia or Euler moment is negative.
    #[error("{what} is {value} kg·m²; it must not be negative")]
    Negative {
        /// Which value.
        what: &'static str,
        /// The value, kg·m².
        value: f64,
    },
    /// One principal inertia exceeds the sum of the two others.
    #[error(
        "J{axis} = {moment} kg·m² exceeds J{} + J{} = {sum} kg·m² by {:.3e} kg·m²; no distribution \
         of mass has such an inertia",
        axis % 3 + 1, (axis + 1) % 3 + 1, moment - sum
    )]
    TriangleInequality {
        /// `I` of the large one, 1 to 3.
        axis: usize,
        /// `J_I`, kg·m².
        moment: f64,
        /// Sum of the two others, kg·m².
        sum: f64,
    },
    /// The tensor is not symmetric.
    #[error(
        "the inertia tensor is not symmetric: J{row}{column} = {upper}, J{column}{row} = {lower}"
    )]
    NotSymmetric {
        /// Row, 1 to 3.
        row: usize,
        /// Column, 1 to 3.
        column: usize,
        /// Entry above the diagonal, kg·m².
        upper: f64,
        /// Entry below the diagonal, kg·m².
        lower: f64,
    },
    /// Mass properties from a density were asked of a shape without volume.
    #[error("the {shape} has no volume; give its mass instead of a density")]
    NoVolume {
        /// Name of the shape.
        shape: &'static str,
    },
    /// A composition of no parts.
    #[error("a composite body needs at least one part")]
    NoParts,
}

const MOMENT_NAMES: [&str; 3] = ["J1", "J2", "J3"];

/// Principal moments of inertia `J_1, J_2, J_3` of a possible body, kg·m².
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[f64; 3]", into = "[f64; 3]")]
pub struct PrincipalInertia {
    moments: [f64; 3],
}

impl PrincipalInertia {
    /// Principal inertias about `d_1, d_2, d_3`, kg·m².
    ///
    /// The triangle inequality may be violated by [`INERTIA_TOLERANCE`] relative to `tr J`.
    ///
    /// # Errors
    /// [`InertiaError::NotFinite`], [`InertiaError::Negative`],
    /// [`InertiaError::TriangleInequality`].
    pub fn new(moments: [f64; 3]) -> Result<Self, InertiaError> {
        for (what, value) in MOMENT_NAMES.into_iter().zip(moments) {
            if !value.is_finite() {
                return Err(InertiaError::NotFinite { what, value });
            }
            if value < 0.0 {
                return Err(InertiaError::Negative { what, value });
            }
        }
        let trace: f64 = moments.iter().sum();
        for i in 0..3 {
            let (moment, sum) = (moments[i], moments[(i + 1) % 3] + moments[(i + 2) % 3]);
            if moment - sum > INERTIA_TOLERANCE * trace {
                return Err(InertiaError::TriangleInequality { axis: i + 1, moment, sum });
            }
        }
        Ok(Self { moments })
    }

    /// `J_1, J_2, J_3`, kg·m².
    #[must_use]
    pub fn moments(&self) -> [f64; 3] {
        self.moments
    }

    /// The Euler moments `E_I`, LMO08 (57); values at round-off of `tr J` (a few ulp, or a
    /// tolerated violation) are zero.
    #[must_use]
    pub fn euler_moments(&self) -> EulerMoments {
        let J = self.moments;
        let floor = 4.0 * f64::EPSILON * (J[0] + J[1] + J[2]);
        EulerMoments(std::array::from_fn(|i| {
            let E = 0.5 * (J[(i + 1) % 3] + J[(i + 2) % 3] - J[i]); // (57)
            if E <= floor { 0.0 } else { E }
        }))
    }

    /// The tensor `Σ_I J_I d_I d_Iᵀ` for principal axes `d_I`, the columns of `triad`.
    #[must_use]
    pub fn tensor(&self, triad: &Matrix3<f64>) -> Matrix3<f64> {
        triad * Matrix3::from_diagonal(&Vector3::from(self.moments)) * triad.transpose()
    }

    /// Principal inertias and right-handed principal axes (columns) of a full inertia tensor about
    /// the centre of mass.
    ///
    /// The axes come from the given ones by plane rotations of at most 45° (Jacobi's method): no
    /// sorting, no sign to choose, and a tensor that is diagonal retains its axes and their order.
    ///
    /// # Errors
    /// [`InertiaError::NotFinite`], [`InertiaError::NotSymmetric`] beyond [`INERTIA_TOLERANCE`],
    /// and those of [`PrincipalInertia::new`].
    pub fn from_tensor(tensor: &Matrix3<f64>) -> Result<PrincipalAxes, InertiaError> {
        if let Some(&value) = tensor.iter().find(|value| !value.is_finite()) {
            return Err(InertiaError::NotFinite { what: "an entry of the inertia tensor", value });
        }
        let size = tensor.amax();
        for (i, j) in PLANES {
            let (upper, lower) = (tensor[(i, j)], tensor[(j, i)]);
            if (upper - lower).abs() > INERTIA_TOLERANCE * size {
                let (row, column) = (i + 1, j + 1);
                return Err(InertiaError::NotSymmetric { row, column, upper, lower });
            }
        }
        let (values, triad) = jacobi((tensor + tensor.transpose()) * 0.5);
        // a rod or a point may show a negative rounding error
        let moments =
            values.map(|v| if v < 0.0 && v > -INERTIA_TOLERANCE * size { 0.0 } else { v });
        Ok(PrincipalAxes { inertia: Self::new(moments)?, triad })
    }
}

/// What [`PrincipalInertia::from_tensor`] finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalAxes {
    /// The principal inertias, kg·m².
    pub inertia: PrincipalInertia,
    /// The principal axes, right-handed, as columns.
    pub triad: Matrix3<f64>,
}

impl TryFrom<[f64; 3]> for PrincipalInertia {
    type Error = InertiaError;
    fn try_from(moments: [f64; 3]) -> Result<Self, InertiaError> {
        Self::new(moments)
    }
}

impl From<PrincipalInertia> for [f64; 3] {
    fn from(inertia: PrincipalInertia) -> Self {
        inertia.moments
    }
}

/// Euler moments `E_I = ∫ ξ_I² dm`, kg·m²: the masses of the directors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EulerMoments(
    /// `E_1, E_2, E_3`.
    pub [f64; 3],
);

impl EulerMoments {
    /// `J_I = E_J + E_K`, kg·m².
    #[must_use]
    pub fn principal_inertia(&self) -> [f64; 3] {
        let E = self.0;
        [E[1] + E[2], E[2] + E[0], E[0] + E[1]]
    }
}

const PLANES: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// Eigenvalues and a right-handed triad of eigenvectors of a symmetric matrix, by cyclic Jacobi
/// rotations; the identity if the matrix is diagonal to round-off.
fn jacobi(mut A: Matrix3<f64>) -> ([f64; 3], Matrix3<f64>) {
    let mut triad = Matrix3::identity();
    let negligible = f64::EPSILON * A.amax();
    for _sweep in 0..30 {
        if PLANES.iter().all(|&place| A[place].abs() <= negligible) {
            break;
        }
        for (i, j) in PLANES {
            if A[(i, j)] == 0.0 {
                continue;
            }
            let cot2 = (A[(j, j)] - A[(i, i)]) / (2.0 * A[(i, j)]);
            let tan = cot2.signum() / (cot2.abs() + libm::hypot(cot2, 1.0));
            let cos = 1.0 / libm::hypot(tan, 1.0);
            let sin = tan * cos;
            let mut turn = Matrix3::identity();
            (turn[(i, i)], turn[(j, j)], turn[(i, j)], turn[(j, i)]) = (cos, cos, sin, -sin);
            A = turn.tr_mul(&(A * turn));
            (A[(i, j)], A[(j, i)]) = (0.0, 0.0);
            triad *= turn;
        }
    }
    polar_step(&mut triad);
    ([A[(0, 0)], A[(1, 1)], A[(2, 2)]], triad)
}

#[cfg(test)]
#[allow(clippy::float_cmp)] // copies and zeros are expected to be exact
mod tests {
    use super::*;
    use crate::rotation::{exp, orthonormality_defect};
    use vi_testkit::Sample;

    #[test]
    fn impossible_inertias_are_refused_with_the_numbers() {
        let message = |moments| PrincipalInertia::new(moments).unwrap_err().to_string();
        assert_eq!(
            message([1.0, 2.0, 3.5]),
            "J3 = 3.5 kg·m² exceeds J1 + J2 = 3 kg·m² by 5.000e-1 kg·m²; no distribution of mass \
             has such an inertia"
        );
        assert!(message([4.0, 2.0, 1.5]).starts_with("J1 = 4 kg·m² exceeds J2 + J3 = 3.5"));
        assert!(message([1.0, 4.0, 2.0]).starts_with("J2 = 4 kg·m² exceeds J3 + J1 = 3"));
        assert_eq!(message([1.0, -2.0, 3.0]), "J2 is -2 kg·m²; it must not be negative");
        assert_eq!(message([1.0, 1.0, f64::NAN]), "J3 is NaN; it must be a finite number");
        PrincipalInertia::new([0.0; 3]).unwrap();
        PrincipalInertia::new([1.0, 2.0, 3.0 + 1e-11]).unwrap();
        PrincipalInertia::new([1.0, 2.0, 3.0 + 1e-9]).unwrap_err();
    }

    #[test]
    fn euler_moments_invert_and_vanish_for_laminae_and_rods() {
        let euler = |moments| PrincipalInertia::new(moments).unwrap().euler_moments();
        assert_eq!(euler([3.0, 4.0, 5.0]), EulerMoments([3.0, 2.0, 1.0]));
        assert_eq!(euler([3.0, 4.0, 5.0]).principal_inertia(), [3.0, 4.0, 5.0]);
        assert_eq!(euler([0.1, 0.2, 0.1 + 0.2]).0[2], 0.0, "lamina");
        assert_eq!(euler([0.7, 0.7, 0.0]), EulerMoments([0.0, 0.0, 0.7]), "rod");
    }

    #[test]
    fn a_full_tensor_is_diagonalized_by_a_right_handed_triad() {
        let mut sample = Sample::new(41);
        let mut worst = 0.0_f64;
        for k in 0..300 {
            let mut E: [f64; 3] = sample.array::<3>().map(f64::abs);
            match k % 5 {
                0 => E[1] = 0.0,
                1 => (E[0], E[1]) = (0.0, 0.0),
                2 => E[2] = E[1],
                _ => {}
            }
            let moments = EulerMoments(E).principal_inertia();
            let axes = exp(&sample.of_length(2.0));
            let tensor = PrincipalInertia::new(moments).unwrap().tensor(&axes);
            let tensor = (tensor + tensor.transpose()) * 0.5;
            let PrincipalAxes { inertia: found, triad } =
                PrincipalInertia::from_tensor(&tensor).unwrap();
            worst = worst.max((found.tensor(&triad) - tensor).amax());
            worst = worst.max(orthonormality_defect(&triad));
            worst = worst.max((triad.determinant() - 1.0).abs());
            let again = PrincipalInertia::from_tensor(&tensor).unwrap();
            assert_eq!(PrincipalAxes { inertia: found, triad }, again, "deterministic");
        }
        assert!(worst < 3e-15, "{worst:e}");
    }

    #[test]
    fn a_diagonal_tensor_keeps_its_axes_and_their_order() {
        let tensor = Matrix3::from_diagonal(&Vector3::new(3.0, 1.0, 2.5));
        let PrincipalAxes { inertia: found, triad } =
            PrincipalInertia::from_tensor(&tensor).unwrap();
        assert_eq!(found.moments(), [3.0, 1.0, 2.5]);
        assert_eq!(triad, Matrix3::identity());
        // and a nearly diagonal one nearly retains them
        let mut near = tensor;
        (near[(0, 2)], near[(2, 0)]) = (1e-6, 1e-6);
        let triad = PrincipalInertia::from_tensor(&near).unwrap().triad;
        assert!((triad - Matrix3::identity()).amax() < 3e-6, "{triad}");
    }

    #[test]
    fn broken_tensors_are_refused() {
        let mut tensor = Matrix3::from_diagonal(&Vector3::new(3.0, 1.0, 2.5));
        tensor[(0, 1)] = 0.25;
        let message = PrincipalInertia::from_tensor(&tensor).unwrap_err().to_string();
        assert_eq!(message, "the inertia tensor is not symmetric: J12 = 0.25, J21 = 0");
        tensor[(1, 0)] = f64::INFINITY;
        let message = PrincipalInertia::from_tensor(&tensor).unwrap_err().to_string();
        assert_eq!(message, "an entry of the inertia tensor is inf; it must be a finite number");
        let negative = -Matrix3::identity();
        assert!(PrincipalInertia::from_tensor(&negative).is_err());
    }
}
