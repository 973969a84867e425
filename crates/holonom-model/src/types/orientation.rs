//! Orientations as model files state them: quaternion, rotation vector, matrix, Euler angles in rad
//! or in degrees.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vi_core::Number;
use vi_core::num_dual::Dual64;
use vi_rigid::rotation;

use crate::text::problem::{Problem, fault};

/// `euler`: up to three rotations about the axes of the rotated body (intrinsic).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Euler {
    /// One to three of the letters x, y, z: `"zxz"` is `R = R_z(a) R_x(b) R_z(c)`.
    pub sequence: String,
    /// An angle for each letter, `[a, b, c]`, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angles: Option<Vec<f64>>,
    /// The angles in degrees, instead of `angles`; multiples of 90 are exact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees: Option<Vec<f64>>,
}

impl Euler {
    /// The axes, 0 to 2; `None` when the sequence is not one to three of the letters x, y, z.
    #[must_use]
    pub fn axes(&self) -> Option<Vec<usize>> {
        let axis = |c: char| "xyz".find(c.to_ascii_lowercase());
        let axes: Option<Vec<usize>> = self.sequence.chars().map(axis).collect();
        axes.filter(|axes| (1..=3).contains(&axes.len()))
    }

    /// The product of the rotations that have an axis and an angle: all of them where there is no
    /// [fault](Self::fault).
    fn rotation(&self) -> Matrix3<f64> {
        let angles = self.degrees.as_ref().or(self.angles.as_ref());
        self.rotation_by(angles.map_or(&[][..], Vec::as_slice))
    }

    /// The same with other angles, in the unit in which they are stated.
    pub(crate) fn rotation_by<T: TurningNumber>(&self, angles: &[T]) -> Matrix3<T> {
        let about_axis = |axis: usize, angle: T| match &self.degrees {
            Some(_) => about(axis, angle.sine_cosine_of_degrees()),
            None => {
                let mut vector = Vector3::zeros();
                vector[axis] = angle;
                T::turned(&vector)
            }
        };
        let axes = self.axes().unwrap_or_default();
        let rotations = axes.into_iter().zip(angles);
        let rotations = rotations.map(|(axis, &angle)| about_axis(axis, angle));
        rotations.reduce(|before, next| before * next).unwrap_or_else(Matrix3::identity)
    }

    fn fault(&self) -> Option<Problem> {
        let Some(axes) = self.axes() else {
            let message = format!("`{}` is no sequence of axes", self.sequence.escape_debug());
            let help = "write one to three of the letters x, y, z, such as \"zxz\"";
            return Some(fault("euler.sequence", message, help));
        };
        let (key, angles) = match (&self.angles, &self.degrees) {
            (Some(_), Some(_)) => {
                let message = "the angles are stated twice: `angles` and `degrees`";
                return Some(fault(
                    "euler.degrees",
                    message,
                    "keep `angles`, in rad, or `degrees`",
                ));
            }
            (None, None) => {
                let help = "add `angles = [a, b, c]`, in rad, or `degrees = [a, b, c]`";
                return Some(fault("euler", "the Euler angles are missing", help));
            }
            (Some(angles), None) => ("euler.angles", angles),
            (None, Some(degrees)) => ("euler.degrees", degrees),
        };
        (angles.len() != axes.len()).then(|| {
            let message = format!(
                "{} angle(s) for the {} axes of `{}`",
                angles.len(),
                axes.len(),
                self.sequence
            );
            fault(key, message, "write an angle for each letter of the sequence")
        })
    }
}

/// A number by which things turn.
pub(crate) trait TurningNumber: Number {
    /// `exp(θ̂)`.
    fn turned(vector: &Vector3<Self>) -> Matrix3<Self>;
    /// Sine and cosine of an angle in degrees; exact for multiples of 90.
    fn sine_cosine_of_degrees(self) -> [Self; 2];
}

impl TurningNumber for f64 {
    fn turned(vector: &Vector3<f64>) -> Matrix3<f64> {
        rotation::exp(vector)
    }
    fn sine_cosine_of_degrees(self) -> [f64; 2] {
        let (sine, cosine) = sin_cos_degrees(self);
        [sine, cosine]
    }
}

impl TurningNumber for Dual64 {
    /// The rate of `exp(θ̂)` is `(T(θ) θ̇)^ exp(θ̂)`.
    fn turned(vector: &Vector3<Dual64>) -> Matrix3<Dual64> {
        let value = vector.map(|x| x.re);
        let turned = rotation::exp(&value);
        let spin = rotation::tangent(&value) * vector.map(|x| x.eps);
        turned.zip_map(&(rotation::skew(&spin) * turned), Dual64::new)
    }
    fn sine_cosine_of_degrees(self) -> [Dual64; 2] {
        let ((sine, cosine), rate) = (sin_cos_degrees(self.re), self.eps.to_radians());
        [Dual64::new(sine, cosine * rate), Dual64::new(cosine, -sine * rate)]
    }
}

/// The rotation about a coordinate axis by an angle with this sine and cosine.
fn about<T: Number>(axis: usize, [sin, cos]: [T; 2]) -> Matrix3<T> {
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut matrix = Matrix3::identity();
    (matrix[(i, i)], matrix[(i, j)]) = (cos, -sin);
    (matrix[(j, i)], matrix[(j, j)]) = (sin, cos);
    matrix
}

/// Sine and cosine: the angle is reduced to within 45 degrees of a multiple of 90 without rounding.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let within = degrees % 360.0;
    let quarter = (within / 90.0).round();
    let (sin, cos) = libm::sincos((within - 90.0 * quarter).to_radians());
    match quarter.rem_euclid(4.0) as u8 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// How an orientation is stated; at most one form of it is.
pub(crate) struct Orientation<'a> {
    pub(crate) quaternion: Option<[f64; 4]>,
    pub(crate) rotation_vector: Option<[f64; 3]>,
    pub(crate) matrix: Option<[[f64; 3]; 3]>,
    pub(crate) euler: Option<&'a Euler>,
}

impl Orientation<'_> {
    /// The rotation matrix; its columns are the axes of the rotated frame.
    pub(crate) fn rotation(&self) -> Matrix3<f64> {
        if let Some(quaternion) = self.quaternion {
            return rotation_of(quaternion);
        }
        if let Some(vector) = self.rotation_vector {
            return rotation::exp(&Vector3::from(vector));
        }
        if let Some(rows) = self.matrix {
            return orthonormal(Matrix3::from_fn(|i, j| rows[i][j]));
        }
        self.euler.map_or_else(Matrix3::identity, Euler::rotation)
    }

    /// What is wrong with it: its key, the fault, what to write instead.
    pub(crate) fn fault(&self) -> Option<Problem> {
        const ROTATION: &str =
            "the rows of a rotation matrix are orthonormal, its determinant is +1";
        let stated = [
            ("quaternion", self.quaternion.is_some()),
            ("rotation_vector", self.rotation_vector.is_some()),
            ("matrix", self.matrix.is_some()),
            ("euler", self.euler.is_some()),
        ];
        let mut stated = stated.into_iter().filter(|s| s.1).map(|s| s.0);
        if let (Some(first), Some(second)) = (stated.next(), stated.next()) {
            let message = format!("the orientation is stated twice: `{first}` and `{second}`");
            return Some(fault(second, message, "keep one of them"));
        }
        if let Some(quaternion) = self.quaternion {
            return quaternion_fault(quaternion);
        }
        if let Some(rows) = self.matrix {
            let matrix = Matrix3::from_fn(|i, j| rows[i][j]);
            let excess = (matrix.tr_mul(&matrix) - Matrix3::identity()).amax();
            if excess > 1e-6 {
                let message =
                    format!("the matrix is not a rotation: RᵀR differs from 1 by {excess:e}");
                return Some(fault("matrix", message, ROTATION));
            }
            let reflects = matrix.determinant() < 0.0;
            return reflects.then(|| fault("matrix", "the matrix is a reflection", ROTATION));
        }
        self.euler?.fault()
    }
}

/// The rotation of a quaternion `[w, x, y, z]`.
pub(crate) fn rotation_of<T: Number>([w, x, y, z]: [T; 4]) -> Matrix3<T> {
    let unit = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    *unit.to_rotation_matrix().matrix()
}

/// A quaternion must have norm 1.
pub(crate) fn quaternion_fault(quaternion: [f64; 4]) -> Option<Problem> {
    let norm = quaternion.iter().map(|c| c * c).sum::<f64>().sqrt();
    let help = "write [w, x, y, z] with w² + x² + y² + z² = 1";
    let message = || format!("the quaternion has norm {norm}, not 1");
    ((norm - 1.0).abs() > 1e-6).then(|| fault("quaternion", message(), help))
}

/// The orthonormal matrix next to a nearly orthonormal one (Newton–Schulz).
pub(crate) fn orthonormal<T: Number>(mut matrix: Matrix3<T>) -> Matrix3<T> {
    for _ in 0..4 {
        let excess = matrix.tr_mul(&matrix) - Matrix3::identity();
        matrix -= matrix * excess * T::of(0.5);
    }
    matrix
}

#[cfg(test)]
#[allow(clippy::float_cmp)] // exact by construction
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn euler(sequence: &str, degrees: [f64; 3]) -> Matrix3<f64> {
        Euler { sequence: sequence.into(), angles: None, degrees: Some(degrees.into()) }.rotation()
    }

    #[test]
    fn multiples_of_90_degrees_are_exact() {
        for (sequence, turns) in [("zxz", [1, -3, 6]), ("xyz", [5, 2, -1]), ("yyx", [0, 400, 3])] {
            let matrix = euler(sequence, turns.map(|k| 90.0 * f64::from(k)));
            assert!(matrix.iter().all(|x| *x == 0.0 || x.abs() == 1.0), "{sequence}: {matrix}");
            assert_eq!(matrix.determinant(), 1.0);
        }
        assert_eq!(euler("zxz", [90.0, 0.0, 0.0]) * Vector3::x(), Vector3::y());
        assert_eq!(euler("xyz", [90.0, 0.0, 0.0]) * Vector3::y(), Vector3::z());
        assert_eq!(euler("yxz", [90.0, 0.0, 0.0]) * Vector3::z(), Vector3::x());
    }

    proptest! {
        #[test]
        fn degrees_and_radians_give_the_same_rotation(a in -720.0..720.0, b in -720.0..720.0, c in -720.0..720.0) {
            let angles = Some([a, b, c].map(f64::to_radians).into());
            let radians = Euler { sequence: "zxy".into(), angles, degrees: None }.rotation();
            let error = (euler("zxy", [a, b, c]) - radians).amax();
            prop_assert!(error < 1e-14, "{error:e}");
        }
    }
}
