//! No pair: a free root, LMO08 (59), (61).
//!
//! ```text
//! P:   t² = (φ̇², ω²)
//! F_d: φ²_{n+1} = φ²_n + u_φ,  A² = exp(θ̂)                                  (61)
//! T:   diag(I, T(θ))
//! ```

use super::columns::MotionSubspace;
use super::{
    DegreeOfFreedom, Motion, Properties, TooLarge, Transfer, Twist, VelocityMap, check,
    relative_rotation_vector,
};
use crate::geometry::form::Row;
use crate::pair::joint::{Joint, JointConfiguration};
use nalgebra::{Matrix3, Vector3};
use vi_rigid::rotation;

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "free",
    dof: &[
        DegreeOfFreedom::Position,
        DegreeOfFreedom::Position,
        DegreeOfFreedom::Position,
        DegreeOfFreedom::Rotation,
        DegreeOfFreedom::Rotation,
        DegreeOfFreedom::Rotation,
    ],
    motion: MotionSubspace::Free,
};

/// None.
#[must_use]
pub fn rows(_joint: &Joint) -> Vec<Row> {
    Vec::new()
}

/// `X = 0`, `S = I`.
#[must_use]
#[inline]
pub fn velocity_map(_at: &JointConfiguration) -> VelocityMap {
    with_tangent(&Matrix3::identity())
}

fn with_tangent(tangent: &Matrix3<f64>) -> VelocityMap {
    let zero = Vector3::zeros();
    let slide = |k: usize| Twist::new(Vector3::ith(k, 1.0), zero);
    let turn = |k: usize| Twist::new(zero, tangent.column(k).into());
    let columns = [slide(0), slide(1), slide(2), turn(0), turn(1), turn(2)];
    VelocityMap::new(Transfer::None, &columns)
}

/// (61).
///
/// # Errors
/// [`TooLarge`].
#[inline]
pub fn reparametrize(
    u: &[f64],
    _parent: &Motion,
    _at: &JointConfiguration,
) -> Result<Motion, TooLarge> {
    let theta = Vector3::new(u[3], u[4], u[5]);
    check(theta.norm(), 3)?;
    let translation = Vector3::new(u[0], u[1], u[2]);
    Ok(Motion { translation, rotation_minus_identity: rotation::exp_minus_identity(&theta) })
}

/// `S' = diag(I, T(θ))`.
#[must_use]
#[inline]
pub fn tangent(u: &[f64], _at: &JointConfiguration) -> VelocityMap {
    with_tangent(&rotation::tangent(&Vector3::new(u[3], u[4], u[5])))
}

/// Nothing to align.
#[must_use]
#[inline]
pub fn attitude_correction(_at: &JointConfiguration) -> Vector3<f64> {
    Vector3::zeros()
}

/// Nothing to close.
#[must_use]
#[inline]
pub fn gap_correction(_at: &JointConfiguration) -> Vector3<f64> {
    Vector3::zeros()
}

/// Gap vector and rotation vector.
#[must_use]
pub fn coordinates(at: &JointConfiguration) -> [f64; super::MAX_DOF] {
    let v = relative_rotation_vector(at);
    [at.gap()[0], at.gap()[1], at.gap()[2], v[0], v[1], v[2]]
}
