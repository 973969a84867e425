//! Fixed pair: no relative motion.
//!
//! ```text
//! g:   r = 0;  m_1·m_2' = m_2·n' = n·m_1' = 0
//! P:   [I −ĉ; 0 I]
//! F_d: A² = A¹,  φ²_{n+1} = φ¹_{n+1} + A¹ c_n
//! ```

use super::{Motion, TooLarge, Transfer, VelocityMap};
use crate::form::Row;
use crate::joint::{Joint, Placement};
use nalgebra::{Matrix3, Vector3};

/// Name in model files.
pub const NAME: &str = "fixed";
/// Freedoms.
pub const FREEDOMS: usize = 0;

/// `r = 0`; `m_1·m_2' = m_2·n' = n·m_1' = 0`.
#[must_use]
pub fn rows(joint: &Joint) -> Vec<Row> {
    let mut rows = Row::vanishing(&joint.gap());
    rows.extend(super::equal_attitude(joint));
    rows
}

/// `X = [I −ĉ; 0 I]`.
#[must_use]
pub fn velocity_map(at: &Placement) -> VelocityMap {
    VelocityMap::new(Transfer::Rigid(at.c), &[])
}

/// `A² = A¹`.
///
/// # Errors
/// None; the signature is that of all pairs.
pub fn reparametrize(_u: &[f64], parent: &Motion, at: &Placement) -> Result<Motion, TooLarge> {
    Ok(parent.child(at, &Matrix3::zeros(), &Vector3::zeros(), &Vector3::zeros()))
}

/// As the velocity map.
#[must_use]
pub fn tangent(_u: &[f64], at: &Placement) -> VelocityMap {
    velocity_map(at)
}

/// Equal attitude.
#[must_use]
pub fn clean_attitude(at: &Placement) -> Vector3<f64> {
    super::align_attitude(at)
}

/// The whole gap.
#[must_use]
pub fn clean_gap(at: &Placement) -> Vector3<f64> {
    super::close_gap(at, &[])
}

/// None.
#[must_use]
pub fn coordinates(_at: &Placement) -> [f64; super::MAX_FREEDOMS] {
    [0.0; super::MAX_FREEDOMS]
}
