//! Cylindrical pair C: LMO08 §5.
//!
//! ```text
//! g:   m_1·r = m_2·r = 0;  n·m_1' = n·m_2' = 0
//! P:   [I −ĉ n ϱ²×n; 0 I 0 n],   τ = (u̇, θ̇)
//! F_d: A² = A¹ exp(ϑ n̂_n),  φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹_n + r_n + u n_n) − A²ϱ²_n
//! T:   as P at q_{n+1}
//! ```

use super::Properties;
use super::columns::{Column, MotionSubspace};
use super::constraints::PairConstraint;
use super::symbol::SymbolPart;

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "cylindrical",
    motion: MotionSubspace::Several(&[Column::ALONG_N, Column::ABOUT_N]), // [5.5]
    constraints: &[PairConstraint::GapAlongAxis, PairConstraint::ParallelAxes],
};

/// Its symbol.
pub const SYMBOL: &[SymbolPart] =
    &[SymbolPart::pin(0.8, 6.0).on_parent(), SymbolPart::pin(1.3, 2.5)];
