//! `[[body]]` and `[[particle]]`: what moves.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vi_rigid::rotation;

use super::problem::{Problem, fault};

use super::shape::{Inertia, Shape};

/// `euler`: three rotations about the axes of the rotated body (intrinsic).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Euler {
    /// Three of the letters x, y, z: `"zxz"` is `R = R_z(a) R_x(b) R_z(c)`.
    pub sequence: String,
    /// The three angles `[a, b, c]`, rad.
    pub angles: [f64; 3],
}

/// `[[body]]`: a rigid body; its frame sits in the centre of mass.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Its name, unique in the model.
    pub name: String,
    /// Mass, kg; from `shape` and its density when not stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Inertia about the centre of mass in the body's own frame, kg·m²: 3 principal moments, or the
    /// full tensor (3 rows); from `shape` and the mass when not stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia: Option<Inertia>,
    /// Initial position of the centre of mass, m.
    #[serde(default)]
    pub position: [f64; 3],
    /// Initial orientation as a unit quaternion `[w, x, y, z]`, body to space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion: Option<[f64; 4]>,
    /// Initial orientation as a rotation vector, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_vector: Option<[f64; 3]>,
    /// Initial orientation as a rotation matrix, rows; its columns are the body's axes in space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[[f64; 3]; 3]>,
    /// Initial orientation by Euler angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub euler: Option<Euler>,
    /// Initial velocity of the centre of mass, m/s.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Initial angular velocity, spatial components, rad/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angular_velocity: Option<[f64; 3]>,
    /// Initial angular velocity, body components, rad/s; instead of `angular_velocity`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_angular_velocity: Option<[f64; 3]>,
    /// The body does not move: a part of the ground with a name and a picture.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub fixed: bool,
    /// Its shape: gives mass and inertia when they are not stated, and the picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<Shape>,
}

impl Body {
    /// Mass, kg; that of the shape when not stated, 0 when there is none.
    #[must_use]
    pub fn mass(&self) -> f64 {
        let of_shape = || {
            let shape = self.shape.as_ref()?;
            Some(shape.density? * shape.volume())
        };
        self.mass.or_else(of_shape).unwrap_or(0.0)
    }

    /// Inertia tensor about the centre of mass in the body's own frame, kg·m².
    #[must_use]
    pub fn inertia_tensor(&self) -> Matrix3<f64> {
        match (&self.inertia, &self.shape) {
            (Some(inertia), _) => inertia.tensor(),
            (None, Some(shape)) => {
                Inertia::Principal(shape.inertia_per_mass().map(|i| i * self.mass())).tensor()
            }
            (None, None) => Matrix3::zeros(),
        }
    }

    /// Start orientation: columns are the body's axes in space.
    #[must_use]
    pub fn rotation(&self) -> Matrix3<f64> {
        if let Some(quaternion) = self.quaternion {
            return rotation_of(quaternion);
        }
        if let Some(vector) = self.rotation_vector {
            return rotation::exp(&Vector3::from(vector));
        }
        if let Some(rows) = self.matrix {
            return orthonormal(Matrix3::from_fn(|i, j| rows[i][j]));
        }
        self.euler.as_ref().map_or_else(Matrix3::identity, Euler::rotation)
    }

    /// Start angular velocity, spatial components, rad/s.
    #[must_use]
    pub fn spatial_angular_velocity(&self) -> Vector3<f64> {
        match self.body_angular_velocity {
            Some(omega) => self.rotation() * Vector3::from(omega),
            None => Vector3::from(self.angular_velocity.unwrap_or_default()),
        }
    }

    /// What is wrong with the stated orientation: its key, the fault, what to write instead.
    pub(super) fn orientation_fault(&self) -> Option<Problem> {
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
        let sequence = &self.euler.as_ref().filter(|e| e.axes().is_none())?.sequence;
        let message = format!("`{}` is no sequence of axes", sequence.escape_debug());
        let help = "write three of the letters x, y, z, such as \"zxz\"";
        Some(fault("euler.sequence", message, help))
    }

    /// A point given by body components from the centre of mass, in space, m.
    #[must_use]
    pub fn point(&self, components: [f64; 3]) -> Vector3<f64> {
        Vector3::from(self.position) + self.rotation() * Vector3::from(components)
    }
}

impl Euler {
    /// The three axes, 0 to 2; `None` when the sequence is not three of the letters x, y, z.
    #[must_use]
    pub fn axes(&self) -> Option<[usize; 3]> {
        let axis = |c: char| "xyz".find(c.to_ascii_lowercase());
        let axes: Option<Vec<usize>> = self.sequence.chars().map(axis).collect();
        <[usize; 3]>::try_from(axes?).ok()
    }

    fn rotation(&self) -> Matrix3<f64> {
        let axes = self.axes().unwrap_or_default();
        let rotation = |k: usize| {
            let mut vector = Vector3::zeros();
            vector[axes[k]] = self.angles[k];
            rotation::exp(&vector)
        };
        rotation(0) * rotation(1) * rotation(2)
    }
}

/// The rotation of a quaternion `[w, x, y, z]`.
pub(crate) fn rotation_of([w, x, y, z]: [f64; 4]) -> Matrix3<f64> {
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
fn orthonormal(mut matrix: Matrix3<f64>) -> Matrix3<f64> {
    for _ in 0..4 {
        let excess = matrix.tr_mul(&matrix) - Matrix3::identity();
        matrix -= matrix * excess * 0.5;
    }
    matrix
}

/// `[[particle]]`: a point mass.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Particle {
    /// Its name, unique in the model.
    pub name: String,
    /// Mass, kg.
    pub mass: f64,
    /// Start position, m; `dimension` numbers.
    pub position: Vec<f64>,
    /// Start velocity, m/s; `dimension` numbers, at rest by default.
    #[serde(default)]
    pub velocity: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_forms_of_an_orientation_agree() {
        let angle = 0.7_f64;
        let (s, c) = angle.sin_cos();
        let half = 0.5 * angle;
        let forms = [
            Body { quaternion: Some([half.cos(), 0.0, half.sin(), 0.0]), ..Body::default() },
            Body { rotation_vector: Some([0.0, angle, 0.0]), ..Body::default() },
            Body { matrix: Some([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]), ..Body::default() },
            Body {
                euler: Some(Euler { sequence: "xyz".into(), angles: [0.0, angle, 0.0] }),
                ..Body::default()
            },
        ];
        for body in &forms {
            let error = (body.rotation() - forms[0].rotation()).amax();
            assert!(error < 1e-15, "{error:e} {body:?}");
        }
    }

    #[test]
    fn body_components_turn_with_the_body() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let body = Body {
            rotation_vector: Some([0.0, 0.0, quarter]),
            body_angular_velocity: Some([1.0, 0.0, 0.0]),
            position: [5.0, 0.0, 0.0],
            ..Body::default()
        };
        let omega = body.spatial_angular_velocity();
        assert!((omega - Vector3::y()).amax() < 1e-15);
        assert!((body.point([2.0, 0.0, 0.0]) - Vector3::new(5.0, 2.0, 0.0)).amax() < 1e-15);
    }
}
