//! Cylindrical pair C: LMO08 §5.
//!
//! ```text
//! g:   m_1·r = m_2·r = 0;  n·m_1' = n·m_2' = 0
//! P:   [I −ĉ n ϱ²×n; 0 I 0 n],   τ = (u̇, θ̇)
//! F_d: A² = A¹ exp(ϑ n̂_n),  φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹_n + r_n + u n_n) − A²ϱ²_n
//! T:   as P at q_{n+1}
//! ```

use super::columns::{Column, MotionSubspace};
use super::{DegreeOfFreedom, Motion, Properties, TooLarge, Transfer, Twist, VelocityMap};
use crate::geometry::form::Row;
use crate::pair::joint::{Joint, JointConfiguration};
use nalgebra::Vector3;

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "cylindrical",
    dof: &[DegreeOfFreedom::Length(2), DegreeOfFreedom::ABOUT_AXIS],
    motion: MotionSubspace::Several(&[Column::ALONG_N, Column::ABOUT_N]),
};

/// `m_1·r = m_2·r = 0`; `n·m_1' = n·m_2' = 0`.
#[must_use]
pub fn rows(joint: &Joint) -> Vec<Row> {
    let mut rows = super::gap_on_axis(joint, &joint.gap());
    rows.extend(super::parallel_axes(joint));
    rows
}

/// `X = [I −ĉ; 0 I]`, `S = [n, ϱ²×n; 0, n]`.
#[must_use]
#[inline]
pub fn velocity_map(at: &JointConfiguration) -> VelocityMap {
    let n = at.axis(2);
    let slide = Twist::new(n, Vector3::zeros());
    VelocityMap::new(Transfer::Rigid(at.c()), &[slide, Twist::new(at.rho_child().cross(&n), n)])
}

/// `A² = A¹ exp(ϑ n̂_n)`, slide `u n_n`.
///
/// # Errors
/// [`TooLarge`].
#[inline]
pub fn reparametrize(
    u: &[f64],
    parent: &Motion,
    at: &JointConfiguration,
) -> Result<Motion, TooLarge> {
    super::check(u[1], 1)?;
    let n = at.axis(2);
    Ok(parent.child(at, &super::about(&n, u[1]), &(u[0] * n), &at.gap())) // [5.5]
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

/// The gap across the axis.
#[must_use]
#[inline]
pub fn gap_correction(at: &JointConfiguration) -> Vector3<f64> {
    super::close_gap(at, &[2])
}

/// `(u, θ)`.
#[must_use]
pub fn coordinates(at: &JointConfiguration) -> [f64; super::MAX_DOF] {
    [at.gap().dot(&at.axis(2)), super::angle_about_axis(at), 0.0, 0.0, 0.0, 0.0]
}
