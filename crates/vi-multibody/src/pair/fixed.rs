//! Fixed pair: no relative motion.
//!
//! ```text
//! g:   r = 0;  m_1·m_2' = m_2·n' = n·m_1' = 0
//! P:   [I −ĉ; 0 I]
//! F_d: A² = A¹,  φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹_n − A²ϱ²_n
//! ```

use super::columns::MotionSubspace;
use super::{Motion, Properties, TooLarge, Transfer, VelocityMap};
use crate::geometry::form::Row;
use crate::pair::joint::{Joint, JointConfiguration};
use nalgebra::{Matrix3, Vector3};

/// The row of the joint table.
pub const PROPERTIES: Properties =
    Properties { name: "fixed", dof: &[], motion: MotionSubspace::Fixed };

/// `r = 0`; `m_1·m_2' = m_2·n' = n·m_1' = 0`.
#[must_use]
pub fn rows(joint: &Joint) -> Vec<Row> {
    let mut rows = Row::vanishing(&joint.gap());
    rows.extend(super::equal_attitude(joint));
    rows
}

/// `X = [I −ĉ; 0 I]`.
#[must_use]
#[inline]
pub fn velocity_map(at: &JointConfiguration) -> VelocityMap {
    VelocityMap::new(Transfer::Rigid(at.c()), &[])
}

/// `A² = A¹`. A gap `r_n` of round-off is transported; [`gap_correction`] removes it.
///
/// # Errors
/// None; the signature is that of all pairs.
#[inline]
pub fn reparametrize(
    _u: &[f64],
    parent: &Motion,
    at: &JointConfiguration,
) -> Result<Motion, TooLarge> {
    Ok(parent.child(at, &Matrix3::zeros(), &Vector3::zeros(), &Vector3::zeros())) // [5.5]
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

/// The whole gap.
#[must_use]
#[inline]
pub fn gap_correction(at: &JointConfiguration) -> Vector3<f64> {
    super::close_gap(at, &[])
}

/// None.
#[must_use]
pub fn coordinates(_at: &JointConfiguration) -> [f64; super::MAX_DOF] {
    [0.0; super::MAX_DOF]
}
