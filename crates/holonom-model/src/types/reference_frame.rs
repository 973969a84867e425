//! `[[frame]]`: named reference frames, and the frames in which parts of a model are stated.

use nalgebra::{Matrix3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vi_core::Number;

use super::orientation::{Euler, Orientation};
use crate::Body;

/// `[[frame]]`: a reference frame with a name, for `relative_to`. It has neither mass nor motion of
/// its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReferenceFrame {
    /// Its name, unique in the model.
    pub name: String,
    /// The frame of its position and orientation: a body, a node of a beam, a joint or a
    /// `[[frame]]`; the inertial frame by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Its origin, m.
    #[serde(default)]
    pub position: [f64; 3],
    /// Orientation as a unit quaternion `[w, x, y, z]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion: Option<[f64; 4]>,
    /// Orientation as a rotation vector, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_vector: Option<[f64; 3]>,
    /// Orientation as a rotation matrix, rows; its columns are the axes of the frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[[f64; 3]; 3]>,
    /// Orientation by Euler angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub euler: Option<Euler>,
}

impl ReferenceFrame {
    /// How the orientation is stated.
    pub(crate) fn orientation(&self) -> Orientation<'_> {
        Orientation {
            quaternion: self.quaternion,
            rotation_vector: self.rotation_vector,
            matrix: self.matrix,
            euler: self.euler.as_ref(),
        }
    }
}

/// A frame `(φ_F, R_F)` in the initial configuration, with the velocities `(v_F, ω_F)` of the rigid
/// body that it is fixed to:
/// ```text
/// φ = φ_F + R_F x,   R = R_F R_x,   v = v_F + ω_F × (φ − φ_F) + R_F ẋ,   ω = ω_F + R_F ω_x
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingFrame<T = f64> {
    /// `φ_F`, m.
    pub origin: Vector3<T>,
    /// `R_F`.
    pub rotation: Matrix3<T>,
    /// `v_F`, m/s.
    pub velocity: Vector3<T>,
    /// `ω_F`, components in space, rad/s.
    pub omega: Vector3<T>,
}

impl<T: Number> MovingFrame<T> {
    /// The inertial frame.
    pub(crate) fn inertial() -> Self {
        let zero = Vector3::zeros();
        Self { origin: zero, rotation: Matrix3::identity(), velocity: zero, omega: zero }
    }

    /// A frame fixed in this one.
    pub(crate) fn fixed(&self, position: Vector3<T>, rotation: &Matrix3<T>) -> Self {
        let origin = self.point(position);
        let velocity = self.velocity_at(&origin);
        Self { origin, rotation: self.rotation * rotation, velocity, omega: self.omega }
    }

    /// A point in space.
    #[must_use]
    pub fn point(&self, x: Vector3<T>) -> Vector3<T> {
        self.origin + self.rotation * x
    }

    /// The velocity of the point of this frame that is at `point` in space.
    pub(crate) fn velocity_at(&self, point: &Vector3<T>) -> Vector3<T> {
        self.velocity + self.omega.cross(&(point - self.origin))
    }
}

impl MovingFrame {
    /// That of a body whose values are stated in the inertial frame.
    pub(crate) fn of(body: &Body) -> Self {
        Self {
            origin: body.position.into(),
            rotation: body.rotation(),
            velocity: body.velocity.into(),
            omega: body.spatial_angular_velocity(),
        }
    }

    /// Whether it moves.
    pub(crate) fn moves(&self) -> bool {
        self.velocity.iter().chain(&self.omega).any(|v| *v != 0.0)
    }
}
