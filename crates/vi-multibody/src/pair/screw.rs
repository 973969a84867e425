//! Screw pair H: a turn about the axis comes with an advance along it, `p` per radian.
//!
//! ```text
//! g:   m_1·r = m_2·r = 0;  n·m_1' = n·m_2' = 0;  n·r − p θ = 0        θ counted over whole turns
//! P:   [I −ĉ  p n + ϱ²×n; 0 I  n],   τ = θ̇
//! F_d: A² = A¹ exp(ϑ n̂_n),  φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹_n + r_n + p ϑ n_n) − A²ϱ²_n
//! T:   as P at q_{n+1}
//! ```
//! The thread `n·r − p θ` is the one row of all pairs that is not quadratic: the velocity-level hidden
//! constraint holds to second order there, not to round-off.

use super::{Motion, TooLarge, Transfer, Twist, VelocityMap, cylindrical};
use crate::coordinate::JointCoordinate;
use crate::form::Row;
use crate::joint::{Joint, Placement};
use crate::scalar_constraint::ScalarRow;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Name in model files.
pub const NAME: &str = "screw";
/// Freedoms.
pub const FREEDOMS: usize = 1;

/// Advance of a screw, m per radian; compared bit by bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "f64", into = "f64")]
pub struct Pitch(u64);

impl From<f64> for Pitch {
    fn from(per_radian: f64) -> Self {
        Self(per_radian.to_bits())
    }
}

impl From<Pitch> for f64 {
    fn from(pitch: Pitch) -> Self {
        Self::from_bits(pitch.0)
    }
}

/// The rows of a cylindrical pair; the fifth is [`thread`].
#[must_use]
pub fn rows(joint: &Joint) -> Vec<Row> {
    cylindrical::rows(joint)
}

/// `n·r − p θ = 0`. Premise: the anchors fit, see [`fit_thread`].
#[must_use]
pub fn thread(joint: &Joint, pitch: Pitch) -> ScalarRow {
    let (advance, turn) = (JointCoordinate::advance(joint), JointCoordinate::turn(joint));
    let (a, b) = (Box::new(advance), Box::new(turn));
    ScalarRow::Coupling { a, b, ratio: -f64::from(pitch), target: 0.0 }
}

/// Moves the child's anchor along the axis to where the thread holds at the configuration `at`.
pub fn fit_thread(joint: &mut Joint, at: &Placement) {
    let excess = at.gap.dot(&at.axis(2)) - at.pitch * super::angle_about_axis(at);
    joint.child.anchor -= excess * joint.child.axes.column(2);
}

/// `X = [I −ĉ; 0 I]`, `S = (p n + ϱ²×n, n)`.
#[must_use]
pub fn velocity_map(at: &Placement) -> VelocityMap {
    let n = at.axis(2);
    let slide = at.pitch * n + at.rho_child.cross(&n);
    VelocityMap::new(Transfer::Rigid(at.c), &[Twist::new(slide, n)])
}

/// `A² = A¹ exp(ϑ n̂_n)`, slide `p ϑ n_n`.
///
/// # Errors
/// [`TooLarge`].
pub fn reparametrize(u: &[f64], parent: &Motion, at: &Placement) -> Result<Motion, TooLarge> {
    super::check(u[0], 0)?;
    let n = at.axis(2);
    Ok(parent.child(at, &super::about(&n, u[0]), &(at.pitch * u[0] * n), &at.gap))
}

/// As the velocity map.
#[must_use]
pub fn tangent(_u: &[f64], at: &Placement) -> VelocityMap {
    velocity_map(at)
}

/// `n'` onto `n`.
#[must_use]
pub fn clean_attitude(at: &Placement) -> Vector3<f64> {
    super::align_axis(at)
}

/// The gap across the axis, and along it what the thread is off by (in the nearest turn).
#[must_use]
pub fn clean_gap(at: &Placement) -> Vector3<f64> {
    let (n, lead) = (at.axis(2), std::f64::consts::TAU * at.pitch);
    let mut excess = at.gap.dot(&n) - at.pitch * super::angle_about_axis(at);
    if lead != 0.0 {
        excess -= lead * (excess / lead).round();
    }
    super::close_gap(at, &[2]) - excess * n
}

/// `θ`.
#[must_use]
pub fn coordinates(at: &Placement) -> [f64; super::MAX_FREEDOMS] {
    [super::angle_about_axis(at), 0.0, 0.0, 0.0, 0.0, 0.0]
}
