//! What a pair is drawn as: solids of unit size, scaled, about its anchor.

use serde::Serialize;

/// A solid of the symbol of a pair; sizes as multiples of that of symbols.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SymbolPart {
    /// Which solid.
    pub solid: SymbolSolid,
    /// Across its axis.
    pub width: f64,
    /// Along its axis.
    pub length: f64,
    /// Whether its axis is `m_1'`, not `n`.
    pub second: bool,
    /// Whether it is about the anchor of the parent, not that of the child.
    pub on_parent: bool,
}

/// A solid of unit diameter and length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SymbolSolid {
    /// Its axis is that of the part.
    Cylinder,
    /// With a square section.
    Box,
    /// An ellipsoid.
    Sphere,
}

impl SymbolPart {
    /// A solid along `n`.
    #[must_use]
    pub const fn new(solid: SymbolSolid, width: f64, length: f64) -> Self {
        Self { solid, width, length, second: false, on_parent: false }
    }

    /// A cylinder along `n`.
    #[must_use]
    pub const fn pin(width: f64, length: f64) -> Self {
        Self::new(SymbolSolid::Cylinder, width, length)
    }

    /// The same about the anchor of the parent.
    #[must_use]
    pub const fn on_parent(self) -> Self {
        Self { on_parent: true, ..self }
    }

    /// The same along `m_1'`.
    #[must_use]
    pub const fn along_second(self) -> Self {
        Self { second: true, ..self }
    }
}
