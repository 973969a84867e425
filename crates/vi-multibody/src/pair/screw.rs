//! Screw pair H: a rotation about the axis with an advance along it, `p` per radian.
//!
//! ```text
//! g:   m_1·r = m_2·r = 0;  n·m_1' = n·m_2' = 0;  n·r − p θ = 0        θ unwrapped
//! P:   [I −ĉ  p n + ϱ²×n; 0 I  n],   τ = θ̇
//! F_d: A² = A¹ exp(ϑ n̂_n),  φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹_n + r_n + p ϑ n_n) − A²ϱ²_n
//! T:   as P at q_{n+1}
//! ```
//! The thread `n·r − p θ` is the one row of all pairs that is not quadratic: the velocity-level
//! hidden constraint holds to second order there, not to round-off.

use super::columns::{Act, MotionSubspace};
use super::{
    DegreeOfFreedom, Motion, Properties, TooLarge, Transfer, Twist, VelocityMap, cylindrical,
};
use crate::geometry::form::Row;
use crate::pair::joint::{Joint, JointConfiguration};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "screw",
    dof: &[DegreeOfFreedom::ABOUT_AXIS],
    motion: MotionSubspace::Along(Act::Screw),
};

/// Advance of a screw, m per radian; compared bit by bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "f64", into = "f64")]
pub struct Pitch(u64);

impl Pitch {
    /// An advance, m per radian.
    #[must_use]
    pub const fn new(per_radian: f64) -> Self {
        Self(per_radian.to_bits())
    }
}

impl From<f64> for Pitch {
    fn from(per_radian: f64) -> Self {
        Self::new(per_radian)
    }
}

impl From<Pitch> for f64 {
    fn from(pitch: Pitch) -> Self {
        Self::from_bits(pitch.0)
    }
}

/// The rows of a cylindrical pair; the fifth is the thread, `ScalarRow::thread`.
#[must_use]
pub fn rows(joint: &Joint) -> Vec<Row> {
    cylindrical::rows(joint)
}

/// Moves the child's anchor along the axis to where the thread holds in the configuration `q` of
/// all frames.
pub fn fit_thread(joint: &mut Joint, q: &[f64]) {
    let at = joint.configuration(q);
    let excess = at.gap().dot(&at.axis(2)) - at.pitch() * super::angle_about_axis(&at);
    joint.child.anchor -= excess * joint.child.axes.column(2);
}

/// `X = [I −ĉ; 0 I]`, `S = (p n + ϱ²×n, n)`.
#[must_use]
#[inline]
pub fn velocity_map(at: &JointConfiguration) -> VelocityMap {
    let n = at.axis(2);
    let slide = at.pitch() * n + at.rho_child().cross(&n);
    VelocityMap::new(Transfer::Rigid(at.c()), &[Twist::new(slide, n)])
}

/// `A² = A¹ exp(ϑ n̂_n)`, slide `p ϑ n_n`.
///
/// # Errors
/// [`TooLarge`].
#[inline]
pub fn reparametrize(
    u: &[f64],
    parent: &Motion,
    at: &JointConfiguration,
) -> Result<Motion, TooLarge> {
    super::check(u[0], 0)?;
    let n = at.axis(2);
    Ok(parent.child(at, &super::about(&n, u[0]), &(at.pitch() * u[0] * n), &at.gap())) // [5.5]
}

/// As the velocity map.
#[must_use]
#[inline]
pub fn tangent(_u: &[f64], at: &JointConfiguration) -> VelocityMap {
    velocity_map(at)
}

/// `n'` onto `n`.
#[must_use]
#[inline]
pub fn attitude_correction(at: &JointConfiguration) -> Vector3<f64> {
    super::align_axis(at)
}

/// The gap across the axis, and along it the residual of the thread (to the nearest revolution).
#[must_use]
#[inline]
pub fn gap_correction(at: &JointConfiguration) -> Vector3<f64> {
    let (n, lead) = (at.axis(2), std::f64::consts::TAU * at.pitch());
    let mut excess = at.gap().dot(&n) - at.pitch() * super::angle_about_axis(at);
    if lead != 0.0 {
        excess -= lead * (excess / lead).round();
    }
    super::close_gap(at, &[2]) - excess * n
}

/// `θ`.
#[must_use]
pub fn coordinates(at: &JointConfiguration) -> [f64; super::MAX_DOF] {
    [super::angle_about_axis(at), 0.0, 0.0, 0.0, 0.0, 0.0]
}
