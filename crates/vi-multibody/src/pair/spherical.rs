//! Spherical pair S: LMO08 (79), (82), (84)–(86).
//!
//! ```text
//! g:   r = 0
//! P:   [I −ϱ̂¹ ϱ̂²; 0 0 I],   τ = ω²                                         (82)
//! F_d: A² = exp(ϑ̂),  φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹_n − A²ϱ²_n                  (84)–(86)
//! T:   δω² = T(ϑ) δϑ
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
    name: "spherical",
    dof: &[DegreeOfFreedom::Rotation, DegreeOfFreedom::Rotation, DegreeOfFreedom::Rotation],
    motion: MotionSubspace::Spherical,
};

/// `r = 0`.
#[must_use]
pub fn rows(joint: &Joint) -> Vec<Row> {
    Row::vanishing(&joint.gap())
}

/// (82).
#[must_use]
#[inline]
pub fn velocity_map(at: &JointConfiguration) -> VelocityMap {
    with_tangent(at, &Matrix3::identity())
}

fn with_tangent(at: &JointConfiguration, tangent: &Matrix3<f64>) -> VelocityMap {
    // ω² = T e_k,  φ̇² = … − ω² × ϱ²
    let column = |k: usize| {
        let omega: Vector3<f64> = tangent.column(k).into();
        Twist::new(at.rho_child().cross(&omega), omega) // (82)
    };
    VelocityMap::new(Transfer::Point(at.rho_parent()), &[column(0), column(1), column(2)])
}

/// (84)–(86).
///
/// # Errors
/// [`TooLarge`].
#[inline]
pub fn reparametrize(
    u: &[f64],
    parent: &Motion,
    at: &JointConfiguration,
) -> Result<Motion, TooLarge> {
    let theta = Vector3::new(u[0], u[1], u[2]);
    check(theta.norm(), 0)?;
    let turn = rotation::exp_minus_identity(&theta); // (84)
    let translation = parent.translation + parent.rotation_minus_identity * at.rho_parent()
        - turn * at.rho_child();
    Ok(Motion { translation, rotation_minus_identity: turn })
}

/// `S' = [ϱ̂² T; T]`.
#[must_use]
#[inline]
pub fn tangent(u: &[f64], at: &JointConfiguration) -> VelocityMap {
    with_tangent(at, &rotation::tangent(&Vector3::new(u[0], u[1], u[2])))
}

/// Nothing to align.
#[must_use]
#[inline]
pub fn attitude_correction(_at: &JointConfiguration) -> Vector3<f64> {
    Vector3::zeros()
}

/// The gap is closed anew.
#[must_use]
#[inline]
pub fn gap_correction(at: &JointConfiguration) -> Vector3<f64> {
    -at.gap()
}

/// Rotation vector of the relative attitude.
#[must_use]
pub fn coordinates(at: &JointConfiguration) -> [f64; super::MAX_DOF] {
    let v = relative_rotation_vector(at);
    [v[0], v[1], v[2], 0.0, 0.0, 0.0]
}
