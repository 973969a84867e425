//! No pair: a free root, LMO08 (59), (61).
//!
//! ```text
//! P:   t² = (φ̇², ω²)
//! F_d: φ²_{n+1} = φ²_n + u_φ,  A² = exp(θ̂)                                  (61)
//! T:   diag(I, T(θ))
//! ```

use super::Properties;
use super::columns::MotionSubspace;
use super::symbol::SymbolPart;

/// The row of the joint table.
pub const PROPERTIES: Properties =
    Properties { name: "free", motion: MotionSubspace::Free, constraints: &[] };

/// Its symbol.
pub const SYMBOL: &[SymbolPart] = &[];
