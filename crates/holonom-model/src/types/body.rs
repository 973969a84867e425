//! `[[body]]` and `[[particle]]`: what moves.

use nalgebra::{Matrix3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::orientation::{Euler, Orientation};
use super::shape::{Inertia, Shape};

/// The reserved name of the inertial frame.
pub const GROUND: &str = "ground";

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
    /// The frame of its position, orientation and velocities: a body, a node of a beam, a joint or
    /// a `[[frame]]`; the inertial frame by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
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
    /// Shapes of its picture in the place of `shape`, each with a `position` and a `quaternion` in
    /// the body's frame; they weigh nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub picture: Vec<Shape>,
    /// Shapes with which it touches others in a `[[contact]]`, in the place of `shape`, each with a
    /// `position` and a `quaternion` in the body's frame; they weigh nothing and are not drawn.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub collision: Vec<Shape>,
    /// Its colour in pictures, `"#rrggbb"` or a name: the sixteen of HTML, `"orange"`, `"grey"`,
    /// `"cyan"`, `"magenta"`; one of a palette by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<String>,
    /// How much it covers in pictures, from 0, nothing, to 1, all that lies behind; 1 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opacity: Option<f64>,
    /// Whether it is drawn in pictures; `true` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub visible: Option<bool>,
}

/// Names of colours.
const COLORS: [(&str, [u8; 3]); 20] = [
    ("black", [0, 0, 0]),
    ("silver", [192, 192, 192]),
    ("gray", [128, 128, 128]),
    ("grey", [128, 128, 128]),
    ("cyan", [0, 255, 255]),
    ("magenta", [255, 0, 255]),
    ("white", [255, 255, 255]),
    ("maroon", [128, 0, 0]),
    ("red", [255, 0, 0]),
    ("purple", [128, 0, 128]),
    ("fuchsia", [255, 0, 255]),
    ("green", [0, 128, 0]),
    ("lime", [0, 255, 0]),
    ("olive", [128, 128, 0]),
    ("yellow", [255, 255, 0]),
    ("navy", [0, 0, 128]),
    ("blue", [0, 0, 255]),
    ("teal", [0, 128, 128]),
    ("aqua", [0, 255, 255]),
    ("orange", [255, 165, 0]),
];

/// Red, green, blue (sRGB) of a name or of six hexadecimal digits; `None` where it is neither.
pub(crate) fn rgb(color: &str) -> Option<[u8; 3]> {
    let named = COLORS.iter().find(|(name, _)| *name == color).map(|(_, rgb)| *rgb);
    let digits = color.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii());
    let part = |digits: &str, k: usize| u8::from_str_radix(&digits[2 * k..2 * k + 2], 16).ok();
    named.or_else(|| {
        let digits = digits?;
        Some([part(digits, 0)?, part(digits, 1)?, part(digits, 2)?])
    })
}

/// The names of colours in a list.
pub(crate) fn color_names() -> impl Iterator<Item = &'static str> {
    COLORS.iter().map(|(name, _)| *name)
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
        self.orientation().rotation()
    }

    /// Start angular velocity, spatial components, rad/s.
    #[must_use]
    pub fn spatial_angular_velocity(&self) -> Vector3<f64> {
        match self.body_angular_velocity {
            Some(omega) => self.rotation() * Vector3::from(omega),
            None => Vector3::from(self.angular_velocity.unwrap_or_default()),
        }
    }

    /// Its shape, those of its picture, and those with which it touches others.
    pub(crate) fn shapes(&self) -> impl Iterator<Item = &Shape> {
        self.shape.iter().chain(&self.picture).chain(&self.collision)
    }

    /// The shapes with which it touches others.
    #[must_use]
    pub fn contact_shapes(&self) -> &[Shape] {
        match (self.collision.is_empty(), &self.shape) {
            (true, Some(shape)) => std::slice::from_ref(shape),
            _ => &self.collision,
        }
    }

    /// The same, to change them.
    pub(crate) fn shapes_mut(&mut self) -> impl Iterator<Item = &mut Shape> {
        self.shape.iter_mut().chain(&mut self.picture).chain(&mut self.collision)
    }

    /// Its colour in pictures, red, green, blue (sRGB), where one is stated.
    #[must_use]
    pub fn rgb(&self) -> Option<[u8; 3]> {
        rgb(self.color.as_deref()?)
    }

    /// Whether it is drawn in pictures.
    #[must_use]
    pub fn is_visible(&self) -> bool {
        self.visible.unwrap_or(true)
    }

    /// How the orientation is stated.
    pub(crate) fn orientation(&self) -> Orientation<'_> {
        Orientation {
            quaternion: self.quaternion,
            rotation_vector: self.rotation_vector,
            matrix: self.matrix,
            euler: self.euler.as_ref(),
        }
    }

    /// A point given by body components from the centre of mass, in space, m.
    #[must_use]
    pub fn point(&self, components: [f64; 3]) -> Vector3<f64> {
        Vector3::from(self.position) + self.rotation() * Vector3::from(components)
    }
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
    /// The frame of its position and velocity: a body, a node of a beam, a joint or a `[[frame]]`;
    /// the inertial frame by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
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
                euler: Some(Euler {
                    sequence: "xyz".into(),
                    angles: Some(vec![0.0, angle, 0.0]),
                    degrees: None,
                }),
                ..Body::default()
            },
            Body {
                euler: Some(Euler {
                    sequence: "y".into(),
                    angles: None,
                    degrees: Some(vec![angle.to_degrees()]),
                }),
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
