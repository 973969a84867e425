//! Universal pair (Cardan, Hooke): two crossing axes, `n` fixed in the parent, `m_1'` in the child.
//!
//! ```text
//! g:   r = 0;  n·m_1' = 0
//! P:   [I −ĉ ϱ²×n ϱ²×m_1'; 0 I n m_1'],   τ = (θ̇_1, θ̇_2)
//! F_d: A² = A¹ exp(ϑ_1 n̂_n) exp(ϑ_2 m̂_1'),  φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹_n − A²ϱ²_n
//! T:   as P at q_{n+1}, since A¹ n_n = n_{n+1} and A¹ exp(ϑ_1 n̂_n) m_1' = m_1'_{n+1}
//! ```
//! In the reference configuration `m_1' = m_1`.

use super::Properties;
use super::columns::{Column, MotionSubspace};
use super::constraints::PairConstraint;
use super::symbol::SymbolPart;

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "universal",
    motion: MotionSubspace::Several(&[Column::ABOUT_N, Column::ABOUT_M1_OF_CHILD]), // [5.5]
    constraints: &[PairConstraint::NoGap, PairConstraint::OrthogonalAxes],
};

/// Its symbol.
pub const SYMBOL: &[SymbolPart] =
    &[SymbolPart::pin(0.6, 4.0), SymbolPart::pin(0.6, 4.0).along_second()];
