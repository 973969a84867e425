//! Screw pair H: a rotation about the axis with an advance along it, `p` per radian.
//!
//! ```text
//! g:   m_1·r = m_2·r = 0;  n·m_1' = n·m_2' = 0;  n·r − p θ = 0        θ unwrapped
//! P:   [I −ĉ  p n + ϱ²×n; 0 I  n],   τ = θ̇
//! F_d: A² = A¹ exp(ϑ n̂_n),  φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹_n + r_n + p ϑ n_n) − A²ϱ²_n
//! T:   as P at q_{n+1}
//! ```
//! The thread ([`super::thread`]) is the one row of all pairs that is not quadratic: the
//! velocity-level hidden constraint holds to second order there, not to round-off.

use super::Properties;
use super::columns::{Act, MotionSubspace};
use super::constraints::PairConstraint;
use super::symbol::SymbolPart;
use serde::{Deserialize, Serialize};

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "screw",
    motion: MotionSubspace::Along(Act::Screw), // [5.5]
    constraints: &[
        PairConstraint::GapAlongAxis,
        PairConstraint::ParallelAxes,
        PairConstraint::Thread,
    ],
};

/// Its symbol.
pub const SYMBOL: &[SymbolPart] = &[SymbolPart::pin(1.0, 5.0), SymbolPart::pin(1.5, 1.2)];

/// Advance of a screw, m per radian; compared bit by bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(from = "f64", into = "f64")]
pub struct Pitch(u64);

impl Pitch {
    /// An advance, m per radian.
    #[must_use]
    pub const fn new(per_radian: f64) -> Self {
        Self(per_radian.to_bits())
    }
}

impl From<f64> for Pitch {
    fn from(per_radian: f64) -> Self {
        Self::new(per_radian)
    }
}

impl From<Pitch> for f64 {
    fn from(pitch: Pitch) -> Self {
        Self::from_bits(pitch.0)
    }
}
