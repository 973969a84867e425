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

use crate::pair::PairKind;

/// How a link moves relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
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
pub(crate) struct Column {
    pub(crate) act: Act,
    pub(crate) axis: Axis,
}

/// What a unit of an increment does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Act {
    /// A translation.
    Slide,
    /// A rotation.
    Turn,
    /// A rotation with an advance.
    Screw,
}

impl Act {
    /// Whether it rotates.
    pub(crate) fn turns(self) -> bool {
        self != Self::Slide
    }
}

/// The axis of a column: `m_1, m_2, n` by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
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
    pub(crate) fn of(kind: PairKind) -> Self {
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
