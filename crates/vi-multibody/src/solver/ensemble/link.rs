//! Links of all members of an ensemble: topology in common, numbers of each member in a lane.

use crate::geometry::lane_spatial::Columns;
use crate::geometry::lane_vectors::{Screw, Vector, three};
use crate::pair::PairKind;
use crate::solver::tree_step::columns::Motion;
use crate::solver::tree_step::link::Constants;
use vi_core::lanes::{Lanes, Register};

/// The most lanes that there are.
pub(super) const MOST: usize = 8;

/// Constants of a link; vectors in the directors of its parent or in its own. See [`Constants`].
#[derive(Clone, Debug)]
pub(super) struct Link<L> {
    pub(super) kind: PairKind,
    pub(super) motion: Motion,
    pub(super) closes_gap: bool,
    pub(super) parent: Option<usize>,
    pub(super) frame: usize,
    pub(super) parent_frame: usize,
    pub(super) unknown: usize,
    pub(super) is_diagonal: bool,
    /// Whether it carries others.
    pub(super) is_parent: bool,
    /// Whether it is the first, leaf to root, to add to the sums of its parent.
    pub(super) writes_first: bool,
    pub(super) pitch: L,
    pub(super) lever: Vector<L>,
    pub(super) axes: [Vector<L>; 3],
    pub(super) axes_child: [Vector<L>; 3],
    pub(super) anchor_parent: Vector<L>,
    pub(super) anchor: Vector<L>,
    pub(super) mass: [[L; 4]; 4],
    pub(super) moment: Vector<L>,
    pub(super) euler: Columns<L>,
}

/// Three numbers of each member.
fn vector<T: Register>(lanes: T, of: impl Fn(usize) -> [f64; 3]) -> Vector<T::Lanes> {
    Vector(three(|i| lanes.gather(|k| of(k)[i])))
}

/// Whether two links differ in numbers only.
fn are_alike(a: &Constants, b: &Constants) -> bool {
    let kinds = std::mem::discriminant(&a.kind) == std::mem::discriminant(&b.kind);
    kinds
        && (a.parent, a.frame, a.unknown) == (b.parent, b.frame, b.unknown)
        && a.is_diagonal == b.is_diagonal
}

/// The links of the members, as many as there are lanes; `None` where they do not have one
/// topology.
pub(super) fn links<T: Register>(
    lanes: T,
    members: &[&[Constants]],
) -> Option<Vec<Link<T::Lanes>>> {
    let first = members[0];
    let alike = |other: &&[Constants]| {
        other.len() == first.len() && first.iter().zip(*other).all(|(a, b)| are_alike(a, b))
    };
    if !members.iter().all(alike) {
        return None;
    }
    let link = |i: usize| {
        let (own, of) = (&first[i], |k: usize| &members[k][i]);
        Link {
            kind: own.kind,
            motion: own.motion,
            closes_gap: own.closes_gap,
            parent: own.parent,
            frame: own.frame,
            parent_frame: own.parent_frame,
            unknown: own.unknown,
            is_diagonal: own.is_diagonal,
            is_parent: first.iter().any(|other| other.parent == Some(i)),
            writes_first: first[i + 1..].iter().all(|other| other.parent != own.parent),
            pitch: lanes.gather(|k| of(k).pitch),
            lever: vector(lanes, |k| of(k).lever),
            axes: three(|j| vector(lanes, |k| of(k).axes[j])),
            axes_child: three(|j| vector(lanes, |k| of(k).axes_child[j])),
            anchor_parent: vector(lanes, |k| of(k).anchor_parent),
            anchor: vector(lanes, |k| of(k).anchor),
            mass: [0, 1, 2, 3].map(|r| [0, 1, 2, 3].map(|c| lanes.gather(|k| of(k).mass[r][c]))),
            moment: vector(lanes, |k| of(k).moment),
            euler: Columns(three(|j| vector(lanes, |k| of(k).euler[j]))),
        }
    };
    Some((0..first.len()).map(link).collect())
}

/// A column of a joint during a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct ColumnWork<L> {
    pub(super) axis: Vector<L>,      // n
    pub(super) axis_next: Vector<L>, // n'
    pub(super) of_left: Screw<L>,    // Sᵀ Ã
    pub(super) inverse: L,           // D⁻¹
}

/// Vectors of a link at `q_n`, and what the sweeps leave.
#[derive(Clone, Copy, Debug)]
pub(super) struct Work<L> {
    pub(super) lever: Vector<L>,      // ℓ
    pub(super) moment: Vector<L>,     // s
    pub(super) euler: Columns<L>,     // E
    pub(super) start: Screw<L>,       // what balances inertia at u = 0
    pub(super) turn: Columns<L>,      // A − 1
    pub(super) shift: Vector<L>,      // Δx of the reference point
    pub(super) lever_next: Vector<L>, // ℓ'
    pub(super) wrench: Screw<L>,      // balance of the link and all that it carries
    pub(super) twist: Screw<L>,       // δt'
}

impl<L: Lanes> ColumnWork<L> {
    pub(super) fn zero(lanes: impl Register<Lanes = L>) -> Self {
        let (vector, screw) = (Vector::splat(lanes, &[0.0; 3]), Screw::zero(lanes));
        Self { axis: vector, axis_next: vector, of_left: screw, inverse: lanes.splat(0.0) }
    }
}

impl<L: Lanes> Work<L> {
    pub(super) fn zero(lanes: impl Register<Lanes = L>) -> Self {
        let (vector, screw) = (Vector::splat(lanes, &[0.0; 3]), Screw::zero(lanes));
        let matrix = Columns::zero(lanes);
        Self {
            lever: vector,
            moment: vector,
            euler: matrix,
            start: screw,
            turn: matrix,
            shift: vector,
            lever_next: vector,
            wrench: screw,
            twist: screw,
        }
    }
}
