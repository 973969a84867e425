//! Spherical pair S: LMO08 (79), (82), (84)–(86).
//!
//! ```text
//! g:   r = 0
//! P:   [I −ϱ̂¹ ϱ̂²; 0 0 I],   τ = ω²                                         (82)
//! F_d: A² = exp(ϑ̂),  φ²_{n+1} = φ¹_{n+1} + A¹ϱ¹_n − A²ϱ²_n                  (84)–(86)
//! T:   δω² = T(ϑ) δϑ
//! ```

use super::Properties;
use super::columns::MotionSubspace;
use super::constraints::PairConstraint;
use super::symbol::{SymbolPart, SymbolSolid};

/// The row of the joint table.
pub const PROPERTIES: Properties = Properties {
    name: "spherical",
    motion: MotionSubspace::Spherical,
    constraints: &[PairConstraint::NoGap],
};

/// Its symbol.
pub const SYMBOL: &[SymbolPart] = &[SymbolPart::new(SymbolSolid::Sphere, 1.3, 1.3)];
