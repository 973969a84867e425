//! Fixed pair: no relative motion.
//!
//! ```text
//! g:   r = 0;  m_1·m_2' = m_2·n' = n·m_1' = 0
//! P:   [I −ĉ; 0 I]
//! F_d: A² = A¹,  φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹_n − A²ϱ²_n
//! ```

use super::Properties;
use super::columns::MotionSubspace;
use super::constraints::PairConstraint;
use super::symbol::{SymbolPart, SymbolSolid};

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "fixed",
    motion: MotionSubspace::Fixed, // [5.5]
    constraints: &[PairConstraint::NoGap, PairConstraint::EqualAttitude],
};

/// Its symbol.
pub const SYMBOL: &[SymbolPart] = &[SymbolPart::new(SymbolSolid::Box, 2.0, 2.0)];
