//! Prismatic pair P: LMO08 §5.
//!
//! ```text
//! g:   m_1·r = m_2·r = 0;  m_1·m_2' = m_2·n' = n·m_1' = 0
//! P:   [I −ĉ n; 0 I 0],   τ = u̇
//! F_d: A² = A¹,  φ²_{n+1} = φ¹_{n+1} + A¹(c_n + u n_n)
//! T:   as P at q_{n+1}
//! ```

use super::Properties;
use super::columns::{Act, MotionSubspace};
use super::constraints::PairConstraint;
use super::symbol::{SymbolPart, SymbolSolid};

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "prismatic",
    motion: MotionSubspace::Along(Act::Slide), // [5.5]
    constraints: &[PairConstraint::GapAlongAxis, PairConstraint::EqualAttitude],
};

/// Its symbol.
pub const SYMBOL: &[SymbolPart] = &[SymbolPart::new(SymbolSolid::Box, 2.2, 4.0)];
