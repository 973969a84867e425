//! What a joint leaves free, about the reference point of its link: translations along axes,
//! rotations about them, or the rotation vector of the link.
//!
//! ```text
//! slide  S_j = (n_j, 0),   turn  S_j = (0, n_j),   screw  S_j = (p n, n)        S'_j with n'_j = A n_j
//! ```
//! `A` is the rotation of the parent and of the columns before. A joint of several columns is
//! eliminated column by column, the last one first, as if bodies without mass were between them.
//! The columns of a rotation vector are `S = (0, I)`, `S' = (0, T(θ))`, eliminated as a block with
//! row pivoting; the translation of a free body, `S = S' = (I, 0)`, is another.

use crate::geometry::lane_matrices::Pair;
use crate::geometry::lanes::Held;
use crate::pair::PairKind;

/// How a link moves relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::solver) enum Motion {
    /// With the parent.
    Fixed,
    /// With the parent, and by one column of the axis `n`.
    Along(Act),
    /// With the parent, and by several columns.
    Several(&'static [Column]),
    /// With a point of the parent, by a rotation vector.
    Spherical,
    /// With nothing: a displacement and a rotation vector.
    Free,
}

/// A column of `S`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::solver) struct Column {
    pub(in crate::solver) act: Act,
    pub(in crate::solver) axis: Axis,
}

/// What a unit of an increment does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::solver) enum Act {
    /// A translation.
    Slide,
    /// A rotation.
    Turn,
    /// A rotation with an advance.
    Screw,
}

/// The axis of a column: `m_1, m_2, n` by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::solver) enum Axis {
    /// Fixed in the parent.
    Parent(usize),
    /// Fixed in the link.
    Child(usize),
}

const ABOUT_N: Column = Column { act: Act::Turn, axis: Axis::Parent(2) };
const ALONG_N: Column = Column { act: Act::Slide, axis: Axis::Parent(2) };
const ABOUT_SECOND: Column = Column { act: Act::Turn, axis: Axis::Child(0) };
const ALONG_M1: Column = Column { act: Act::Slide, axis: Axis::Parent(0) };
const ALONG_M2: Column = Column { act: Act::Slide, axis: Axis::Parent(1) };

impl Motion {
    pub(in crate::solver) fn of(kind: PairKind) -> Self {
        match kind {
            PairKind::Fixed => Self::Fixed,
            PairKind::Revolute => Self::Along(Act::Turn),
            PairKind::Prismatic => Self::Along(Act::Slide),
            PairKind::Screw(_) => Self::Along(Act::Screw),
            PairKind::Cylindrical => Self::Several(&[ALONG_N, ABOUT_N]),
            PairKind::Universal => Self::Several(&[ABOUT_N, ABOUT_SECOND]),
            PairKind::Planar => Self::Several(&[ALONG_M1, ALONG_M2, ABOUT_N]),
            PairKind::Spherical => Self::Spherical,
            PairKind::Free => Self::Free,
        }
    }
}

/// A column during a step.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::solver) struct ColumnWork {
    pub(in crate::solver) axis: Held,      // n
    pub(in crate::solver) axis_next: Held, // n'
    pub(in crate::solver) SA: Pair<Held>,  // Sᵀ Ã
    pub(in crate::solver) inverse: f64,    // D⁻¹
    pub(in crate::solver) slope: f64,      // what acts along the column adds to D
}
