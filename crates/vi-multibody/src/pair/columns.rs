//! What a pair leaves free: the definition of its motion.
//!
//! ```text
//! slide  S_j = (n_j, 0),   turn  S_j = (0, n_j),   screw  S_j = (p n, n)        S'_j with n'_j = A n_j
//! ```
//! Twists `(φ̇, ω)` about the anchor of the child. `A` is the rotation of the parent and of the
//! columns before. The columns of a rotation vector are `S = (0, I)`, `S' = (0, T(θ))`; a free
//! body adds the translations `S = S' = (I, 0)` before them.

use super::PairKind;

/// A column of `S`; translations are along axes of the parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Column {
    /// What a unit of its increment does.
    pub act: Act,
    /// Along or about which axis.
    pub axis: Axis,
}

/// What a unit of an increment does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Act {
    /// A translation.
    Slide,
    /// A rotation.
    Turn,
    /// A rotation with an advance.
    Screw,
}

/// The axis of a column: `m_1, m_2, n` by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Axis {
    /// Fixed in the parent.
    Parent(usize),
    /// Fixed in the child.
    Child(usize),
}

/// The span of the columns `S` of a pair: how a body moves relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MotionSubspace {
    /// With the parent.
    Fixed,
    /// With the parent, and by one column of the axis `n`.
    Along(Act),
    /// With the parent, and by several columns, one after another.
    Several(&'static [Column]),
    /// With a point of the parent, by a rotation vector.
    Spherical,
    /// With nothing: a displacement and a rotation vector.
    Free,
}

impl Act {
    /// Whether it rotates.
    #[must_use]
    pub fn turns(self) -> bool {
        self != Self::Slide
    }
}

impl Column {
    /// A translation along `m_1`.
    pub const ALONG_M1: Self = Self { act: Act::Slide, axis: Axis::Parent(0) };
    /// A translation along `m_2`.
    pub const ALONG_M2: Self = Self { act: Act::Slide, axis: Axis::Parent(1) };
    /// A translation along `n`.
    pub const ALONG_N: Self = Self { act: Act::Slide, axis: Axis::Parent(2) };
    /// A rotation about `n`.
    pub const ABOUT_N: Self = Self { act: Act::Turn, axis: Axis::Parent(2) };
    /// A rotation about `n` with an advance along it.
    pub const SCREW: Self = Self { act: Act::Screw, axis: Axis::Parent(2) };
    /// A rotation about `m_1'`.
    pub const ABOUT_M1_OF_CHILD: Self = Self { act: Act::Turn, axis: Axis::Child(0) };
}

impl MotionSubspace {
    /// That of a pair.
    #[must_use]
    pub fn of(kind: PairKind) -> Self {
        kind.properties().motion
    }

    /// Its columns, the first one nearest to the parent; none for rotation vectors.
    #[must_use]
    pub const fn columns(self) -> &'static [Column] {
        match self {
            Self::Along(Act::Slide) => &[Column::ALONG_N],
            Self::Along(Act::Turn) => &[Column::ABOUT_N],
            Self::Along(Act::Screw) => &[Column::SCREW],
            Self::Several(columns) => columns,
            Self::Fixed | Self::Spherical | Self::Free => &[],
        }
    }

    /// Number of degrees of freedom.
    #[must_use]
    pub const fn dof(self) -> usize {
        match self {
            Self::Spherical => 3,
            Self::Free => 6,
            _ => self.columns().len(),
        }
    }

    /// Where a rotation vector begins among the degrees of freedom, if there is one.
    #[must_use]
    pub const fn rotation_vector(self) -> Option<usize> {
        match self {
            Self::Spherical => Some(0),
            Self::Free => Some(3),
            _ => None,
        }
    }

    /// Whether a degree of freedom is an angle; the others are lengths.
    #[must_use]
    pub fn is_angle(self, freedom: usize) -> bool {
        match self.columns().get(freedom) {
            Some(column) => column.act != Act::Slide,
            None => self.rotation_vector().is_some_and(|first| freedom >= first),
        }
    }

    /// Whether the pair leaves a translation along `m_1`, `m_2`, `n` (0, 1, 2) free, or a rotation
    /// about them (3, 4, 5); one that comes with an advance, or about an axis of the child, is not.
    #[must_use]
    pub fn frees(self, component: usize) -> bool {
        let is_it = |column: &Column| match (column.act, column.axis) {
            (Act::Slide, Axis::Parent(axis)) => component == axis,
            (Act::Turn, Axis::Parent(axis)) => component == 3 + axis,
            _ => false,
        };
        match self {
            Self::Spherical => component >= 3,
            Self::Free => true,
            _ => self.columns().iter().any(is_it),
        }
    }

    /// Which column of the reversed joint is, with the other sign, a column of this one; `None`
    /// for a translation along an axis of one body that turns relative to the other.
    #[must_use]
    pub fn reversed(self, freedom: usize) -> Option<usize> {
        let columns = self.columns();
        let Some(column) = columns.get(freedom) else { return Some(freedom) };
        if self.swaps_axes() {
            return Some(columns.len() - 1 - freedom);
        }
        let keeps = |other: &Column| other.act == Act::Slide || other.axis == column.axis;
        (column.act != Act::Slide || columns.iter().all(keeps)).then_some(freedom)
    }

    /// Whether all its rotations are about `n`, with an advance or without, and there is one.
    #[must_use]
    pub fn rotates_about_axis(self) -> bool {
        let mut turns = self.columns().iter().filter(|column| column.act != Act::Slide).peekable();
        turns.peek().is_some() && turns.all(|turn| turn.axis == Axis::Parent(2))
    }

    /// Whether it can rotate, without an advance, about a line that is fixed in the parent.
    #[must_use]
    pub fn rotates_about_line(self) -> bool {
        let about_n = self.columns().contains(&Column::ABOUT_N);
        about_n && self.columns().iter().all(|column| column.axis == Axis::Parent(2))
    }

    /// Whether it translates along axes and does not rotate.
    #[must_use]
    pub fn only_translates(self) -> bool {
        self.has_axis() && self.columns().iter().all(|column| column.act == Act::Slide)
    }

    /// Whether something translates along `m_1` or `m_2`: their directions count, too.
    #[must_use]
    pub fn translates_across_axis(self) -> bool {
        self.columns().iter().any(|c| c.act == Act::Slide && c.axis != Axis::Parent(2))
    }

    /// Whether the pair needs an axis `n`.
    #[must_use]
    pub const fn has_axis(self) -> bool {
        !self.columns().is_empty()
    }

    /// Whether the pair leaves no gap, `r = 0`: nothing translates the anchor of the child.
    #[must_use]
    pub fn closes_gap(self) -> bool {
        let stays = self.columns().iter().all(|column| column.act == Act::Turn);
        self != Self::Free && stays
    }

    /// Whether `m_1` and `n` change their roles when the sides of a joint do: an axis is fixed in
    /// the child.
    #[must_use]
    pub fn swaps_axes(self) -> bool {
        self.columns().iter().any(|column| matches!(column.axis, Axis::Child(_)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said of each pair in words, from its columns.
    #[test]
    fn what_follows_from_the_columns() {
        let line = |kind: PairKind| {
            let motion = kind.properties().motion;
            let said = [
                (motion.has_axis(), "axis"),
                (motion.closes_gap(), "no gap"),
                (motion.swaps_axes(), "swaps axes"),
                (motion.rotates_about_axis(), "about n"),
                (motion.rotates_about_line(), "about a line"),
                (motion.only_translates(), "translates"),
                (motion.translates_across_axis(), "across n"),
                (kind.is_free(), "free"),
                (kind.is_fixed(), "fixed"),
            ];
            let said: Vec<&str> =
                said.iter().filter(|(is, _)| *is).map(|(_, text)| *text).collect();
            let reversed: Vec<_> =
                (0..motion.columns().len()).map(|k| motion.reversed(k)).collect();
            let rows: usize = kind.properties().constraints.iter().map(|c| c.count()).sum();
            assert_eq!(motion.dof() + rows, 6, "{kind:?}");
            assert_eq!(kind.symbol().is_empty(), kind.is_free(), "{kind:?}");
            format!("{} {}: {} {reversed:?}", kind.name(), motion.dof(), said.join(", "))
        };
        let found = PairKind::ALL.map(line);
        println!("{}", found.join("\n"));
        assert_eq!(
            found,
            [
                "spherical 3: no gap []",
                "revolute 1: axis, no gap, about n, about a line [Some(0)]",
                "cylindrical 2: axis, about n, about a line [Some(0), Some(1)]",
                "prismatic 1: axis, translates [Some(0)]",
                "planar 3: axis, about n, across n [None, None, Some(2)]",
                "fixed 0: no gap, fixed []",
                "screw 1: axis, about n [Some(0)]",
                "universal 2: axis, no gap, swaps axes [Some(1), Some(0)]",
                "free 6: free []",
            ]
        );
    }
}
