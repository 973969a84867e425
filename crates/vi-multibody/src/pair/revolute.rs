//! Revolute pair R: LMO08 §5.
//!
//! ```text
//! g:   r = 0;  n·m_1' = n·m_2' = 0
//! P:   [I −ĉ ϱ²×n; 0 I n],   τ = θ̇
//! F_d: A² = A¹ exp(ϑ n̂_n),  φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹_n − A²ϱ²_n
//! T:   as P at q_{n+1}, since A¹ n_n = n_{n+1}
//! ```

use super::columns::{Act, MotionSubspace};
use super::{DegreeOfFreedom, Motion, Properties, TooLarge, Transfer, Twist, VelocityMap};
use crate::geometry::form::Row;
use crate::pair::joint::{Joint, JointConfiguration};
use nalgebra::Vector3;

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "revolute",
    dof: &[DegreeOfFreedom::ABOUT_AXIS],
    motion: MotionSubspace::Along(Act::Turn),
};

/// `r = 0`; `n·m_1' = n·m_2' = 0`.
#[must_use]
pub fn rows(joint: &Joint) -> Vec<Row> {
    let mut rows = Row::vanishing(&joint.gap());
    rows.extend(super::parallel_axes(joint));
    rows
}

/// `X = [I −ĉ; 0 I]`, `S = (ϱ²×n, n)`.
#[must_use]
#[inline]
pub fn velocity_map(at: &JointConfiguration) -> VelocityMap {
    let n = at.axis(2);
    VelocityMap::new(Transfer::Rigid(at.c()), &[Twist::new(at.rho_child().cross(&n), n)])
}

/// `A² = A¹ exp(ϑ n̂_n)`. A gap `r_n` of round-off is transported; [`gap_correction`] removes it.
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
    let relative = super::about(&at.axis(2), u[0]);
    Ok(parent.child(at, &relative, &Vector3::zeros(), &Vector3::zeros())) // [5.5]
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

/// The whole gap.
#[must_use]
#[inline]
pub fn gap_correction(at: &JointConfiguration) -> Vector3<f64> {
    super::close_gap(at, &[])
}

/// `θ`.
#[must_use]
pub fn coordinates(at: &JointConfiguration) -> [f64; super::MAX_DOF] {
    [super::angle_about_axis(at), 0.0, 0.0, 0.0, 0.0, 0.0]
}
