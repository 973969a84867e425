//! Universal pair (Cardan, Hooke): two crossing axes, `n` fixed in the parent, `m_1'` in the child.
//!
//! ```text
//! g:   r = 0;  n·m_1' = 0
//! P:   [I −ĉ ϱ²×n ϱ²×m_1'; 0 I n m_1'],   τ = (θ̇_1, θ̇_2)
//! F_d: A² = A¹ exp(ϑ_1 n̂_n) exp(ϑ_2 m̂_1'),  φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹_n − A²ϱ²_n
//! T:   as P at q_{n+1}, since A¹ n_n = n_{n+1} and A¹ exp(ϑ_1 n̂_n) m_1' = m_1'_{n+1}
//! ```
//! In the reference configuration `m_1' = m_1`.

use super::columns::{Column, MotionSubspace};
use super::{DegreeOfFreedom, Motion, Properties, TooLarge, Transfer, Twist, VelocityMap};
use crate::geometry::form::Row;
use crate::pair::joint::{Joint, JointConfiguration};
use nalgebra::Vector3;

/// About `m_1'`, after the first rotation: `n = cos θ_2 n' + sin θ_2 m_2'`.
const SECOND: DegreeOfFreedom = DegreeOfFreedom::Angle { sine: [1, 2], cosine: [2, 2] };

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "universal",
    dof: &[DegreeOfFreedom::ABOUT_AXIS, SECOND],
    motion: MotionSubspace::Several(&[Column::ABOUT_N, Column::ABOUT_M1_OF_CHILD]),
};

/// `r = 0`; `n·m_1' = 0`.
#[must_use]
pub fn rows(joint: &Joint) -> Vec<Row> {
    let mut rows = Row::vanishing(&joint.gap());
    rows.push(Row::product(joint.parent.axis(2), joint.child.axis(0), 0.0));
    rows
}

/// `X = [I −ĉ; 0 I]`, `S = [ϱ²×n, ϱ²×m_1'; n, m_1']`.
#[must_use]
#[inline]
pub fn velocity_map(at: &JointConfiguration) -> VelocityMap {
    let turn = |axis: Vector3<f64>| Twist::new(at.rho_child().cross(&axis), axis);
    VelocityMap::new(Transfer::Rigid(at.c()), &[turn(at.axis(2)), turn(at.axis_child(0))])
}

/// `A² = A¹ exp(ϑ_1 n̂_n) exp(ϑ_2 m̂_1')`.
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
    super::check(u[1], 1)?;
    let (first, second) = (super::about(&at.axis(2), u[0]), super::about(&at.axis_child(0), u[1]));
    let relative = first + second + first * second;
    Ok(parent.child(at, &relative, &Vector3::zeros(), &Vector3::zeros())) // [5.5]
}

/// As the velocity map.
#[must_use]
#[inline]
pub fn tangent(_u: &[f64], at: &JointConfiguration) -> VelocityMap {
    velocity_map(at)
}

/// `m_1'` across `n`: a rotation about their common normal.
#[must_use]
#[inline]
pub fn attitude_correction(at: &JointConfiguration) -> Vector3<f64> {
    let (n, m) = (at.axis(2), at.axis_child(0));
    -n.dot(&m) * m.cross(&n)
}

/// The whole gap.
#[must_use]
#[inline]
pub fn gap_correction(at: &JointConfiguration) -> Vector3<f64> {
    super::close_gap(at, &[])
}

/// `θ_1` from `m_1` to `m_1'` about `n`, then `θ_2` of `n'` about `m_1'`.
#[must_use]
pub fn coordinates(at: &JointConfiguration) -> [f64; super::MAX_DOF] {
    let second_axis = at.axis_child(0);
    let reference = at.axis(2); // n' coincides with n when θ_2 = 0
    let sine = reference.cross(&at.axis_child(2)).dot(&second_axis);
    let second = libm::atan2(sine, reference.dot(&at.axis_child(2)));
    [super::angle_about_axis(at), second, 0.0, 0.0, 0.0, 0.0]
}
