//! Revolute pair R: LMO08 §5.
//!
//! ```text
//! g:   r = 0;  n·m_1' = n·m_2' = 0
//! P:   [I −ĉ ϱ²×n; 0 I n],   τ = θ̇
//! F_d: A² = A¹ exp(ϑ n̂_n),  φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹_n − A²ϱ²_n
//! T:   as P at q_{n+1}, since A¹ n_n = n_{n+1}
//! ```

use super::Properties;
use super::columns::{Act, MotionSubspace};
use super::constraints::PairConstraint;
use super::symbol::SymbolPart;

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "revolute",
    motion: MotionSubspace::Along(Act::Turn), // [5.5]
    constraints: &[PairConstraint::NoGap, PairConstraint::ParallelAxes],
};

/// Its symbol.
pub const SYMBOL: &[SymbolPart] = &[SymbolPart::pin(1.0, 4.0)];
