//! Centre and directors of a link, and where they stand among the coordinates.

use super::link::{Link, Work};
use crate::geometry::matrix::{Columns, Screw};
use crate::geometry::space::{Number, Space, Vector};

/// Where a link is: its centre and its directors.
#[derive(Clone, Copy)]
pub(crate) struct LinkPlace<V> {
    pub(crate) center: V,
    pub(crate) d: Columns<V>,
}

impl<V: Vector> LinkPlace<V> {
    #[inline(always)]
    pub(crate) fn of<S: Space<Vector = V>>(s: S, q: &[Number<S>], first: usize) -> Self {
        let [center, a, b, c] = s.read_frame(q, first);
        Self { center, d: Columns([a, b, c]) }
    }

    /// Of the parent of a link; of the ground: the inertial base.
    #[inline(always)]
    pub(crate) fn of_parent<S: Space<Vector = V>>(
        s: S,
        link: &Link<S::Store>,
        q: &[Number<S>],
    ) -> Self {
        match link.parent {
            Some(_) => Self::of(s, q, link.parent_frame),
            None => Self::ground(s),
        }
    }

    /// Of the ground.
    #[inline(always)]
    pub(crate) fn ground<S: Space<Vector = V>>(s: S) -> Self {
        Self { center: s.zero(), d: Columns::identity(s) }
    }

    /// `φ, d_1, d_2, d_3`.
    #[inline(always)]
    pub(crate) fn vectors(self) -> [V; 4] {
        let [a, b, c] = self.d.0;
        [self.center, a, b, c]
    }

    /// The gap of the joint of a link that is here; `parent`: where its parent is.
    #[inline(always)]
    pub(crate) fn gap<S: Space<Vector = V>>(
        &self,
        s: S,
        link: &Link<S::Store>,
        parent: &Self,
    ) -> V {
        let start = parent.center + parent.d.mul(s.constant(&link.anchor_parent));
        (self.center + self.d.mul(s.constant(&link.anchor))) - start
    }
}

/// The wrench about the reference point of a link, from the vectors that belong to its centre and
/// its directors `d`; `anchor`: from the centre to that point.
#[inline(always)]
pub(crate) fn balance<V: Vector>(
    d: &Columns<V>,
    anchor: V,
    [linear, first, second, third]: [V; 4],
) -> Screw<V> {
    let spin = (d.0[0].cross(first) + d.0[1].cross(second)) + d.0[2].cross(third);
    Screw { linear, angular: spin - anchor.cross(linear) }
}

/// `Δφ, Δd_I` of the motion of a link from its directors `d` on; `anchor`: from the centre to its
/// reference point there.
#[inline(always)]
pub(crate) fn change<S: Space>(
    s: S,
    work: &Work<S::Store>,
    d: &Columns<S::Vector>,
    anchor: S::Vector,
) -> [S::Vector; 4] {
    let turn = work.turn.take(s);
    let moved = s.take(&work.shift) - turn.mul(anchor); // Δx − (A − 1) ϱ²
    let [a, b, c] = turn.times(d).0; // (A − 1) d
    [moved, a, b, c]
}

/// `rate M v` of a link.
#[inline(always)]
pub(crate) fn momenta<S: Space>(
    s: S,
    link: &Link<S::Store>,
    v: [S::Vector; 4],
    rate: f64,
) -> [S::Vector; 4] {
    let mut momenta = [s.zero(); 4];
    for i in 0..4 {
        if link.is_diagonal {
            momenta[i] = v[i].scaled(s.factor(link.mass[i][i]) * rate);
        } else {
            for j in 0..4 {
                momenta[i] = momenta[i] + v[j].scaled(s.factor(link.mass[i][j]) * rate);
            }
        }
    }
    momenta
}
