//! Planar pair E: LMO08 §5.
//!
//! ```text
//! g:   n·r = 0;  n·m_1' = n·m_2' = 0
//! P:   [I −ĉ m_1 m_2 ϱ²×n; 0 I 0 0 n],   τ = (u̇_1, u̇_2, θ̇)
//! F_d: A² = A¹ exp(ϑ n̂_n),
//!      φ²_{n+1} = φ¹_{n+1} + A¹(ϱ¹_n + r_n + u_1 m_{1,n} + u_2 m_{2,n}) − A²ϱ²_n
//! T:   as P at q_{n+1}
//! ```

use super::Properties;
use super::columns::{Column, MotionSubspace};
use super::constraints::PairConstraint;
use super::symbol::SymbolPart;

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "planar",
    // [5.5]
    motion: MotionSubspace::Several(&[Column::ALONG_M1, Column::ALONG_M2, Column::ABOUT_N]),
    constraints: &[PairConstraint::GapAcrossAxis, PairConstraint::ParallelAxes],
};

/// Its symbol.
pub const SYMBOL: &[SymbolPart] = &[SymbolPart::pin(3.0, 0.4)];
