//! What a pair is drawn as: solids about its anchor.

use serde::Serialize;

/// A solid of the symbol of a pair; sizes as multiples of that of symbols.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SymbolPart {
    /// Which solid.
    pub solid: SymbolSolid,
    /// The edges of a box across its axis; the radius of a cylinder or a sphere.
    pub across: f64,
    /// The length of a box or a cylinder; the radius of a sphere.
    pub along: f64,
    /// Whether its axis is `m_1'`, not `n`.
    pub second: bool,
    /// Whether it is about the anchor of the parent, not that of the child.
    pub on_parent: bool,
}

/// The shape of a part.
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
    pub const fn new(solid: SymbolSolid, across: f64, along: f64) -> Self {
        Self { solid, across, along, second: false, on_parent: false }
    }

    /// A cylinder along `n`.
    #[must_use]
    pub const fn pin(radius: f64, length: f64) -> Self {
        Self::new(SymbolSolid::Cylinder, radius, length)
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
