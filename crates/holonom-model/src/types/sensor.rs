//! `[[sensor]]`: what is measured along a run and written to `sensors.csv`.

use nalgebra::Matrix3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::law::Formula;
use super::orientation::{Euler, Orientation};

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SensorKind {
    /// Of a body, at `point`, or of a particle, in space or as `seen_from` another body, m.
    Position,
    /// Of a body, at `point`, or of a particle, in space or as `seen_from` another body, m/s.
    Velocity,
    /// Of a body, at `point`, or of a particle, in space, m/s².
    Acceleration,
    /// Of a body: the quaternion `w, x, y, z` of its own frame, body to space or to the body it is
    /// `seen_from`; its sign does not jump.
    Orientation,
    /// Of a body, spatial components, rad/s; `seen_from` another body the relative one, along the
    /// axes of that.
    AngularVelocity,
    /// Of a body, spatial components, rad/s².
    AngularAcceleration,
    /// What an inertial measurement unit on a body shows, along its own axes, those of the body
    /// unless its orientation is stated: `ax, ay, az`, the acceleration of the `point` without that
    /// of gravity, m/s², and `gx, gy, gz`, the angular velocity, rad/s.
    Imu,
    /// Between the `point` of a body or a particle and the point `point_to` of another one, m. Of a
    /// `[[spring]]`, a `[[bar]]`, a `[[law]]` between points or a distance constraint its length,
    /// also as `length`.
    #[serde(alias = "length")]
    Distance,
    /// The rate of a distance, m/s, also as `length_rate`.
    #[serde(alias = "length_rate")]
    DistanceRate,
    /// Of a joint: lengths in m, angles in rad. Angles count on beyond ±π. Of a spherical joint the
    /// rotation vector of the child against the parent, at most π long.
    JointCoordinate,
    /// Of a joint: the rates of its coordinates, m/s and rad/s. Of a spherical joint the angular
    /// velocity of the child relative to the parent.
    JointRate,
    /// Of a joint: the rates of its rates, m/s² and rad/s².
    JointAcceleration,
    /// Of a joint: the force (N) and the moment about the joint's place on the child (N·m) that the
    /// joint exerts on the child, in the joint frame of the parent; of a fixed body the same of
    /// what holds it; of a bar its tension (N); of a rolling constraint or a blade the force on the
    /// body, along the axes of space (N).
    Reaction,
    /// What drives or resists a motion, N or N·m: of a joint the efforts of its spring, damper and
    /// motor along its coordinate; of a `[[spring]]` its tension, with its damper; of a
    /// `[[constraint]]` the effort of a prescribed motion, of a gear on its first joint, the
    /// tension of a distance; of a `[[bushing]]` its three forces and three torques along its
    /// coordinates, on `to`; of a `[[law]]` what it states: an effort along a joint, a tension, or
    /// force and torque along its axes.
    Effort,
    /// What is put into the system in a second, W, negative where it is taken out: of a joint by
    /// its spring, damper and motor; of a `[[spring]]`, with its damper; of a `[[load]]`, a
    /// `[[law]]` or a `[[bushing]]`; of a `[[constraint]]` by a prescribed motion.
    Power,
    /// What was put into the system since the start, J, negative where it was taken out: of what
    /// has a `power`, of a prescribed motion where it is the only one; a spring does the work that
    /// its energy decreases by.
    Work,
    /// Of a `[[constraint]]` of type `rolling` or `blade`: the slip of the step that ended, m/s; of
    /// what rolls in space, of a blade along its axis. Of a `[[contact]]` the largest slip of its
    /// points that touch, in the step that begins.
    Slip,
    /// Of a `[[contact]]`: the smallest gap, m; negative where shapes overlap.
    Gap,
    /// Between the shapes of a body and of the body `to`, which touch nothing by that: the smallest
    /// gap, m; negative where they overlap.
    Clearance,
    /// Of a `[[contact]]`: the sum of its forces on the bodies of `b`, in space, N; of a body the
    /// sum of all forces of contacts on it.
    ContactForce,
    /// Of a joint with rigid `limits`: the effort of its stops along the coordinate, N or N·m.
    StopForce,
    /// Of a joint with `friction`: its effort along the coordinate, N·m, of a displacement N.
    FrictionTorque,
    /// Of a beam at `element`: the shear forces `N1, N2` and the normal force `N3`, N, and the
    /// moments about its directors, `M1, M2` bending and `M3` twisting, N·m.
    SectionForce,
    /// A number by the expression `value` of time, joints, bodies, signals and other sensors at the
    /// node; it is of nothing, and has no unit.
    Expression,
    /// Of a beam at `element`: `Gamma1, Gamma2` shear, `Gamma3` extension; `K1, K2` bending, `K3`
    /// twist, 1/m; all measured from the stress-free beam.
    Strain,
}

impl SensorKind {
    /// Whether it follows from time, configuration and velocity of a node alone; an effort or a
    /// power unless it is of a constraint.
    #[must_use]
    pub fn is_of_state(self) -> bool {
        !matches!(
            self,
            Self::Acceleration
                | Self::AngularAcceleration
                | Self::JointAcceleration
                | Self::Reaction
                | Self::Slip
                | Self::ContactForce
                | Self::StopForce
                | Self::FrictionTorque
                | Self::Work
                | Self::Imu
                | Self::Expression
                | Self::SectionForce
                | Self::Strain
        )
    }

    /// Whether it is measured at an element of a beam.
    #[must_use]
    pub fn has_element(self) -> bool {
        matches!(self, Self::SectionForce | Self::Strain)
    }

    /// Whether it is the distance of two points or its rate.
    #[must_use]
    pub fn is_distance(self) -> bool {
        matches!(self, Self::Distance | Self::DistanceRate)
    }

    /// Whether it is a rate or a velocity.
    #[must_use]
    pub fn is_rate(self) -> bool {
        use SensorKind::{AngularVelocity, DistanceRate, JointRate, Velocity};
        matches!(self, Velocity | AngularVelocity | DistanceRate | JointRate)
    }

    /// Whether it is of a point of a body.
    #[must_use]
    pub fn has_point(self) -> bool {
        self.is_distance()
            || matches!(self, Self::Position | Self::Velocity | Self::Acceleration | Self::Imu)
    }

    /// Whether it can be seen from another body.
    pub(crate) fn is_relative(self) -> bool {
        matches!(self, Self::Position | Self::Velocity | Self::Orientation | Self::AngularVelocity)
    }
}

/// The axes along which a reaction is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReactionFrame {
    /// The joint frame `m_1, m_2, n` of the parent.
    #[default]
    Parent,
    /// The joint frame `m_1', m_2', n'` of the child.
    Child,
    /// The inertial axes x, y, z.
    Space,
}

impl Sensor {
    /// One without any choice.
    #[must_use]
    pub fn new(name: String, kind: SensorKind, of: String) -> Self {
        let (point, seen_from, to, point_to) = (None, None, None, None);
        let (element, at, frame, value) = (None, None, None, None);
        let (quaternion, rotation_vector, matrix, euler) = (None, None, None, None);
        Self {
            name,
            kind,
            of,
            point,
            seen_from,
            to,
            point_to,
            element,
            at,
            quaternion,
            rotation_vector,
            matrix,
            euler,
            frame,
            value,
        }
    }

    /// How the orientation of its axes is stated.
    pub(crate) fn orientation(&self) -> Orientation<'_> {
        Orientation {
            quaternion: self.quaternion,
            rotation_vector: self.rotation_vector,
            matrix: self.matrix,
            euler: self.euler.as_ref(),
        }
    }

    /// The axes of an `imu` along those of its body, as columns.
    #[must_use]
    pub fn axes(&self) -> Matrix3<f64> {
        self.orientation().rotation()
    }
}

/// `[[sensor]]`: a named column, or several, of `sensors.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Its name, unique in the model.
    pub name: String,
    /// What it measures.
    #[serde(rename = "type")]
    pub kind: SensorKind,
    /// The body, node, particle, joint, bar, beam or contact it is attached to; an `expression` has
    /// none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub of: String,
    /// The point of a body (`position`, `velocity`, `acceleration`, `imu`, `distance`): body
    /// components from the centre of mass, m; the centre by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// The body or node of a beam in whose frame a `position`, `velocity`, `orientation` or
    /// `angular_velocity` is given, as an observer on it sees it; by default space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seen_from: Option<String>,
    /// The other end of a `distance`: a body, a node of a beam, a particle or the ground; of a
    /// `clearance` the other body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
    /// The point at `to`, m: body components from the centre of mass; of the ground in space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_to: Option<[f64; 3]>,
    /// The element of a beam, counted along it from 0 (`section_force`, `strain`): at its middle;
    /// the mean of its Gauss points when it has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<usize>,
    /// The place on a beam (`section_force`, `strain`) in the place of `element`: arc length from
    /// its start, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
    /// Orientation of the axes of an `imu` in the body as a unit quaternion `[w, x, y, z]`; by
    /// default they are those of the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion: Option<[f64; 4]>,
    /// Orientation of the axes of an `imu` in the body as a rotation vector, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_vector: Option<[f64; 3]>,
    /// Orientation of the axes of an `imu` in the body as a rotation matrix, rows; its columns are
    /// the axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix: Option<[[f64; 3]; 3]>,
    /// Orientation of the axes of an `imu` in the body by Euler angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub euler: Option<Euler>,
    /// The axes of the components of a `reaction`: the joint frame of the parent by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<ReactionFrame>,
    /// The expression of an `expression`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<Formula>,
}
