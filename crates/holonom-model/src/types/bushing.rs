//! `[[bushing]]`: elastic bearings with full matrices between two frames.

use nalgebra::{Matrix3, Matrix6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::law::Formula;
use super::orientation::{Euler, Orientation};

/// `[[bushing]]`: forces and torques by the six coordinates between a frame of `from` and one of
/// `to` that coincide initially: displacements `x1`, `x2`, `x3` along the axes of `from`, m, and
/// the rotation vector `x4`, `x5`, `x6` of `to` in `from`, rad; `v1` to `v6` are their rates.
/// Bushings of rubber, bearings, and dampers in all directions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bushing {
    /// Its name, unique in the model; its energy and its work are listed under it.
    pub name: String,
    /// A body, a node of a beam, or `ground`.
    pub from: String,
    /// Another one.
    pub to: String,
    /// The frame of its position and orientation: a body, a node of a beam, a joint or a
    /// `[[frame]]`; the inertial frame by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Where both frames are initially, m, in space.
    pub position: [f64; 3],
    /// Orientation of its axes as a unit quaternion `[w, x, y, z]`; by default they are those of
    /// space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion: Option<[f64; 4]>,
    /// Orientation of its axes as a rotation vector, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_vector: Option<[f64; 3]>,
    /// Orientation of its axes as a rotation matrix, rows; its columns are the axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[[f64; 3]; 3]>,
    /// Orientation of its axes by Euler angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub euler: Option<Euler>,
    /// How its rotation is measured.
    #[serde(default)]
    pub rotation: BushingRotation,
    /// Stiffness `K`: 6 numbers along and about its axes, or 6 rows of 6, N/m, N/rad, N and
    /// N·m/rad. Entries may be expressions of `t`, `x1` to `x6`, `v1` to `v6`, and of joints,
    /// members and signals by their names. It need not be symmetric.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Coefficients>,
    /// Damping `C`: 6 numbers, or 6 rows of 6, N·s/m, N·s/rad, N·s and N·m·s/rad; entries may be
    /// expressions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<Coefficients>,
    /// Forces, N, and torques, N·m, on `to` in the initial configuration, along and about its axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preload: Option<[f64; 6]>,
    /// Forces and torques on `to`, six expressions, instead of stiffness, damping and preload.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<[Formula; 6]>,
}

impl Bushing {
    /// How the orientation is stated.
    pub(crate) fn orientation(&self) -> Orientation<'_> {
        Orientation {
            quaternion: self.quaternion,
            rotation_vector: self.rotation_vector,
            matrix: self.matrix,
            euler: self.euler.as_ref(),
        }
    }

    /// Whether its coefficients are numbers.
    pub(crate) fn is_linear(&self) -> bool {
        let numbers =
            |own: &Option<Coefficients>| own.as_ref().is_none_or(Coefficients::is_numbers);
        self.force.is_none() && numbers(&self.stiffness) && numbers(&self.damping)
    }

    /// Whether it is a potential for certain: numbers, symmetric, no damping.
    pub(crate) fn is_conservative(&self) -> bool {
        let matrix = |own: &Option<Coefficients>| {
            own.as_ref().map_or_else(Matrix6::zeros, |own| own.numbers())
        };
        let stiffness = matrix(&self.stiffness);
        self.is_linear()
            && stiffness == stiffness.transpose()
            && matrix(&self.damping) == Matrix6::zeros()
    }

    /// Its axes, columns, in space.
    #[must_use]
    pub fn axes(&self) -> Matrix3<f64> {
        self.orientation().rotation()
    }
}

/// How the rotation of a bushing is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BushingRotation {
    /// By the rotation vector.
    #[default]
    Vector,
    /// By the tilts `x4`, `x5` of the third axis, for a shaft that turns about it: `x6` is zero.
    Tilt,
}

/// Coefficients along and about six axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "coefficients are 6 entries along and about the axes, or 6 rows of 6 entries; an entry is a number, or a text such as \"8e5*(1 + 2e4*x1^2)\""
)]
pub enum Coefficients {
    /// Along and about each axis.
    Diagonal(Box<[Formula; 6]>),
    /// Rows of a matrix.
    Full(Box<[[Formula; 6]; 6]>),
}

impl Coefficients {
    /// The entries that are stated: row, column, expression.
    #[must_use]
    pub fn entries(&self) -> Vec<(usize, usize, &Formula)> {
        match self {
            Self::Diagonal(entries) => entries.iter().enumerate().map(|(i, e)| (i, i, e)).collect(),
            Self::Full(rows) => {
                let mut all = Vec::new();
                for (i, row) in rows.iter().enumerate() {
                    all.extend(row.iter().enumerate().map(|(j, entry)| (i, j, entry)));
                }
                all
            }
        }
    }

    fn is_numbers(&self) -> bool {
        self.entries().iter().all(|(_, _, entry)| number(entry).is_some())
    }

    /// The matrix of those that are numbers.
    fn numbers(&self) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        for (i, j, entry) in self.entries() {
            matrix[(i, j)] = number(entry).unwrap_or_default();
        }
        matrix
    }

    /// Where an entry stands below its key.
    pub(crate) fn place(&self, i: usize, j: usize) -> String {
        match self {
            Self::Diagonal(_) => format!("[{i}]"),
            Self::Full(_) => format!("[{i}][{j}]"),
        }
    }
}

/// An entry that is a number as it stands.
fn number(entry: &Formula) -> Option<f64> {
    entry.0.trim().parse().ok()
}
