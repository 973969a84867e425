//! The constraints `g_ex` of pairs, by groups that several of them share: rows, and what removes
//! the round-off that a step transports.

use super::joint::{Joint, JointConfiguration};
use super::thread;
use crate::geometry::form::BilinearRow;
use nalgebra::Vector3;
use vi_core::Number;

/// Some rows of `g_ex`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PairConstraint {
    /// `r = 0`.
    NoGap,
    /// `m_1·r = m_2·r = 0`.
    GapAlongAxis,
    /// `n·r = 0`.
    GapAcrossAxis,
    /// `n·m_1' = n·m_2' = 0`.
    ParallelAxes,
    /// `m_1·m_2' = m_2·n' = n·m_1' = 0`.
    EqualAttitude,
    /// `n·m_1' = 0`.
    OrthogonalAxes,
    /// `n·r − p θ = 0`, `θ` unwrapped: the one row that is no product of linear forms, see
    /// [`ScalarRow::Gear`](crate::scalar_constraint::ScalarRow).
    Thread,
}

impl PairConstraint {
    /// Number of rows.
    #[must_use]
    pub const fn count(self) -> usize {
        match self {
            Self::NoGap | Self::EqualAttitude => 3,
            Self::GapAlongAxis | Self::ParallelAxes => 2,
            Self::GapAcrossAxis | Self::OrthogonalAxes | Self::Thread => 1,
        }
    }

    /// Its rows but the thread.
    pub(crate) fn rows<T: Number>(self, joint: &Joint<T>) -> Vec<BilinearRow<T>> {
        let gap =
            |axis: usize| BilinearRow::product(joint.parent.axis(axis), joint.gap(), T::of(0.0));
        let axes = |[parent, child]: [usize; 2]| {
            BilinearRow::product(joint.parent.axis(parent), joint.child.axis(child), T::of(0.0))
        };
        match self {
            Self::NoGap => BilinearRow::vanishing(&joint.gap()),
            Self::GapAlongAxis => vec![gap(0), gap(1)],
            Self::GapAcrossAxis => vec![gap(2)],
            Self::ParallelAxes => vec![axes([2, 0]), axes([2, 1])],
            Self::EqualAttitude => vec![axes([0, 1]), axes([1, 2]), axes([2, 0])],
            Self::OrthogonalAxes => vec![axes([2, 0])],
            Self::Thread => Vec::new(),
        }
    }
}

/// Small rotation of the child that removes round-off from the relative attitude.
pub(super) fn attitude_correction(
    constraints: &[PairConstraint],
    at: &JointConfiguration,
) -> Vector3<f64> {
    let turn = |i: usize| at.axis_child(i).cross(&at.axis(i));
    let of = |constraint: &PairConstraint| match constraint {
        PairConstraint::ParallelAxes => Some(turn(2)),
        PairConstraint::EqualAttitude => Some((0..3).map(turn).sum::<Vector3<f64>>() * 0.5),
        PairConstraint::OrthogonalAxes => {
            let (n, m) = (at.axis(2), at.axis_child(0));
            Some(-n.dot(&m) * m.cross(&n)) // about their common normal
        }
        _ => None,
    };
    constraints.iter().find_map(of).unwrap_or_else(Vector3::zeros)
}

/// Translation of the child that removes round-off from the gap.
pub(super) fn gap_correction(
    constraints: &[PairConstraint],
    at: &JointConfiguration,
) -> Vector3<f64> {
    let mut shift = Vector3::zeros();
    for constraint in constraints {
        match constraint {
            PairConstraint::NoGap => shift = -at.gap(),
            PairConstraint::GapAlongAxis => shift = close_gap(at, &[2]),
            PairConstraint::GapAcrossAxis => shift = close_gap(at, &[0, 1]),
            PairConstraint::Thread => shift -= thread::excess_to_revolution(at) * at.axis(2),
            _ => {}
        }
    }
    shift
}

/// The same for the part of the gap off the directions that the pair allows.
fn close_gap(at: &JointConfiguration, allowed: &[usize]) -> Vector3<f64> {
    let mut gap = at.gap();
    for &i in allowed {
        gap -= at.axis(i) * at.axis(i).dot(&at.gap());
    }
    -gap
}
