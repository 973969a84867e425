//! Planar pair E: LMO08 §5.
//!
//! ```text
//! g:   n·r = 0;  n·m_1' = n·m_2' = 0
//! P:   [I −ĉ m_1 m_2 ϱ²×n; 0 I 0 0 n],   τ = (u̇_1, u̇_2, θ̇)
//! F_d: A² = A¹ exp(ϑ n̂_n),
//!      φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹_n + r_n + u_1 m_{1,n} + u_2 m_{2,n}) − A²ϱ²_n
//! T:   as P at q_{n+1}
//! ```

use super::columns::{Column, MotionSubspace};
use super::{DegreeOfFreedom, Motion, Properties, TooLarge, Transfer, Twist, VelocityMap};
use crate::geometry::form::Row;
use crate::pair::joint::{Joint, JointConfiguration};
use nalgebra::Vector3;

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "planar",
    dof: &[DegreeOfFreedom::Length(0), DegreeOfFreedom::Length(1), DegreeOfFreedom::ABOUT_AXIS],
    motion: MotionSubspace::Several(&[Column::ALONG_M1, Column::ALONG_M2, Column::ABOUT_N]),
};

/// `n·r = 0`; `n·m_1' = n·m_2' = 0`.
#[must_use]
pub fn rows(joint: &Joint) -> Vec<Row> {
    let mut rows = vec![Row::product(joint.parent.axis(2), joint.gap(), 0.0)];
    rows.extend(super::parallel_axes(joint));
    rows
}

/// `X = [I −ĉ; 0 I]`, `S = [m_1, m_2, ϱ²×n; 0, 0, n]`.
#[must_use]
#[inline]
pub fn velocity_map(at: &JointConfiguration) -> VelocityMap {
    let n = at.axis(2);
    let slide = |i: usize| Twist::new(at.axis(i), Vector3::zeros());
    let turn = Twist::new(at.rho_child().cross(&n), n);
    VelocityMap::new(Transfer::Rigid(at.c()), &[slide(0), slide(1), turn])
}

/// `A² = A¹ exp(ϑ n̂_n)`, slide `u_1 m_1 + u_2 m_2`.
///
/// # Errors
/// [`TooLarge`].
#[inline]
pub fn reparametrize(
    u: &[f64],
    parent: &Motion,
    at: &JointConfiguration,
) -> Result<Motion, TooLarge> {
    super::check(u[2], 2)?;
    let slide = u[0] * at.axis(0) + u[1] * at.axis(1);
    Ok(parent.child(at, &super::about(&at.axis(2), u[2]), &slide, &at.gap())) // [5.5]
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

/// The gap along the normal.
#[must_use]
#[inline]
pub fn gap_correction(at: &JointConfiguration) -> Vector3<f64> {
    super::close_gap(at, &[0, 1])
}

/// `(u_1, u_2, θ)`.
#[must_use]
pub fn coordinates(at: &JointConfiguration) -> [f64; super::MAX_DOF] {
    let along = |i: usize| at.gap().dot(&at.axis(i));
    [along(0), along(1), super::angle_about_axis(at), 0.0, 0.0, 0.0]
}
