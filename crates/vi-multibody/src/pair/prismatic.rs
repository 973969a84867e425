//! Prismatic pair P: LMO08 §5.
//!
//! ```text
//! g:   m_1·r = m_2·r = 0;  m_1·m_2' = m_2·n' = n·m_1' = 0
//! P:   [I −ĉ n; 0 I 0],   τ = u̇
//! F_d: A² = A¹,  φ²_{n+1} = φ¹_{n+1} + A¹(c_n + u n_n)
//! T:   as P at q_{n+1}
//! ```

use super::columns::{Act, MotionSubspace};
use super::{DegreeOfFreedom, Motion, Properties, TooLarge, Transfer, Twist, VelocityMap};
use crate::geometry::form::Row;
use crate::pair::joint::{Joint, JointConfiguration};
use nalgebra::{Matrix3, Vector3};

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "prismatic",
    dof: &[DegreeOfFreedom::Length(2)],
    motion: MotionSubspace::Along(Act::Slide),
};

/// `m_1·r = m_2·r = 0`; `m_1·m_2' = m_2·n' = n·m_1' = 0`.
#[must_use]
pub fn rows(joint: &Joint) -> Vec<Row> {
    let mut rows = super::gap_on_axis(joint, &joint.gap());
    rows.extend(super::equal_attitude(joint));
    rows
}

/// `X = [I −ĉ; 0 I]`, `S = (n, 0)`.
#[must_use]
#[inline]
pub fn velocity_map(at: &JointConfiguration) -> VelocityMap {
    VelocityMap::new(Transfer::Rigid(at.c()), &[Twist::new(at.axis(2), Vector3::zeros())])
}

/// `A² = A¹`, slide `u n_n`.
///
/// # Errors
/// None; the signature is that of all pairs.
#[inline]
pub fn reparametrize(
    u: &[f64],
    parent: &Motion,
    at: &JointConfiguration,
) -> Result<Motion, TooLarge> {
    Ok(parent.child(at, &Matrix3::zeros(), &(u[0] * at.axis(2)), &at.gap())) // [5.5]
}

/// As the velocity map.
#[must_use]
#[inline]
pub fn tangent(_u: &[f64], at: &JointConfiguration) -> VelocityMap {
    velocity_map(at)
}

/// Equal attitude.
#[must_use]
#[inline]
pub fn attitude_correction(at: &JointConfiguration) -> Vector3<f64> {
    super::align_attitude(at)
}

/// The gap across the axis.
#[must_use]
#[inline]
pub fn gap_correction(at: &JointConfiguration) -> Vector3<f64> {
    super::close_gap(at, &[2])
}

/// `u`.
#[must_use]
pub fn coordinates(at: &JointConfiguration) -> [f64; super::MAX_DOF] {
    [at.gap().dot(&at.axis(2)), 0.0, 0.0, 0.0, 0.0, 0.0]
}
