//! Matrices of [`crate::geometry::lane_vectors`]: the algebra of sweeps over many trees at once.
//! Names and formulas are those of [`crate::geometry::lane_matrices`], which holds one tree in all
//! lanes.

use crate::geometry::lane_vectors::{Screw, Vector, three};
use vi_core::lanes::{Lanes, Register};

/// A 3×3 matrix by its columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Columns<L>(pub(crate) [Vector<L>; 3]);

impl<L: Lanes> Columns<L> {
    /// `x I`.
    #[inline(always)]
    pub(crate) fn multiple(lanes: impl Register<Lanes = L>, x: L) -> Self {
        let zero = lanes.splat(0.0);
        Self([Vector([x, zero, zero]), Vector([zero, x, zero]), Vector([zero, zero, x])])
    }

    /// Zero.
    #[inline(always)]
    pub(crate) fn zero(lanes: impl Register<Lanes = L>) -> Self {
        Self([Vector::splat(lanes, &[0.0; 3]); 3])
    }

    /// `v̂`, with `v̂ b = v × b`.
    #[inline(always)]
    pub(crate) fn skew(lanes: impl Register<Lanes = L>, v: Vector<L>) -> Self {
        let ([x, y, z], zero) = (v.0, lanes.splat(0.0));
        Self([
            Vector([zero, z, zero - y]),
            Vector([zero - z, zero, x]),
            Vector([y, zero - x, zero]),
        ])
    }

    /// `s n̂ + g n̂²`, without cancellation on the diagonal.
    #[inline(always)]
    pub(crate) fn turn_about(
        lanes: impl Register<Lanes = L>,
        n: Vector<L>,
        (s, g): (L, L),
    ) -> Self {
        let skew = Self::skew(lanes, n).0;
        Self(three(
            #[inline(always)]
            |j| skew[j].scaled(s) + n.cross(skew[j]).scaled(g),
        ))
    }

    /// `M v`.
    #[inline(always)]
    pub(crate) fn mul(&self, v: Vector<L>) -> Vector<L> {
        self.0[0].scaled(v.0[0]) + self.0[1].scaled(v.0[1]) + self.0[2].scaled(v.0[2])
    }

    /// `Mᵀ v`.
    #[inline(always)]
    pub(crate) fn tr_mul(&self, v: Vector<L>) -> Vector<L> {
        Vector([self.0[0].dot(v), self.0[1].dot(v), self.0[2].dot(v)])
    }

    /// `M B`.
    #[inline(always)]
    pub(crate) fn times(&self, other: &Self) -> Self {
        Self(three(
            #[inline(always)]
            |j| self.mul(other.0[j]),
        ))
    }

    /// `M Bᵀ`.
    #[inline(always)]
    pub(crate) fn times_transposed(&self, other: &Self) -> Self {
        let [a, b, c] = other.0;
        Self(three(
            #[inline(always)]
            |j| self.0[0].scaled(a.0[j]) + self.0[1].scaled(b.0[j]) + self.0[2].scaled(c.0[j]),
        ))
    }

    #[inline(always)]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self(three(
            #[inline(always)]
            |j| self.0[j] + other.0[j],
        ))
    }

    #[inline(always)]
    pub(crate) fn minus(&self, other: &Self) -> Self {
        Self(three(
            #[inline(always)]
            |j| self.0[j] - other.0[j],
        ))
    }

    /// `M − x yᵀ`.
    #[inline(always)]
    fn minus_outer(&self, x: Vector<L>, y: Vector<L>) -> Self {
        Self(three(
            #[inline(always)]
            |j| self.0[j] - x.scaled(y.0[j]),
        ))
    }

    /// `(M_zy − M_yz, M_xz − M_zx, M_yx − M_xy)`: of `Σ b aᵀ` it is `Σ a × b`.
    #[inline(always)]
    pub(crate) fn moment(&self) -> Vector<L> {
        let [x, y, z] = self.0;
        Vector([y.0[2] - z.0[1], z.0[0] - x.0[2], x.0[1] - y.0[0]])
    }

    /// `tr(M) I − M`.
    #[inline(always)]
    pub(crate) fn trace_less(&self, lanes: impl Register<Lanes = L>) -> Self {
        let trace = self.0[0].0[0] + self.0[1].0[1] + self.0[2].0[2];
        Self::multiple(lanes, trace).minus(self)
    }

    /// `M v̂`.
    #[inline(always)]
    fn times_skew(&self, v: Vector<L>) -> Self {
        let ([x, y, z], [a, b, c]) = (v.0, self.0);
        Self([b.scaled(z) - c.scaled(y), c.scaled(x) - a.scaled(z), a.scaled(y) - b.scaled(x)])
    }

    /// `v̂ M`.
    #[inline(always)]
    fn skew_times(v: Vector<L>, m: &Self) -> Self {
        Self(three(
            #[inline(always)]
            |j| v.cross(m.0[j]),
        ))
    }
}

impl<L: Lanes> Screw<L> {
    /// The twist at the end of a lever `a` fixed in the body: `(v + ω × a, ω)`.
    #[inline(always)]
    pub(crate) fn at_end_of(self, a: Vector<L>) -> Self {
        Self { linear: self.linear + self.angular.cross(a), ..self }
    }

    /// The wrench at the start of a lever `a`: `(f, τ + a × f)`.
    #[inline(always)]
    pub(crate) fn at_start_of(self, a: Vector<L>) -> Self {
        Self { angular: self.angular + a.cross(self.linear), ..self }
    }
}

/// A 6×6 matrix on twists `(v, ω)`, by 3×3 blocks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spatial<L> {
    pub(crate) ll: Columns<L>,
    pub(crate) la: Columns<L>,
    pub(crate) al: Columns<L>,
    pub(crate) aa: Columns<L>,
}

impl<L: Lanes> Spatial<L> {
    /// Zero.
    #[inline(always)]
    pub(crate) fn zero(lanes: impl Register<Lanes = L>) -> Self {
        let zero = Columns::zero(lanes);
        Self { ll: zero, la: zero, al: zero, aa: zero }
    }

    #[inline(always)]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            ll: self.ll.plus(&other.ll),
            la: self.la.plus(&other.la),
            al: self.al.plus(&other.al),
            aa: self.aa.plus(&other.aa),
        }
    }

    /// `self − x yᵀ`.
    #[inline(always)]
    pub(crate) fn minus_outer(&self, x: Screw<L>, y: Screw<L>) -> Self {
        Self {
            ll: self.ll.minus_outer(x.linear, y.linear),
            la: self.la.minus_outer(x.linear, y.angular),
            al: self.al.minus_outer(x.angular, y.linear),
            aa: self.aa.minus_outer(x.angular, y.angular),
        }
    }

    /// `Xᵀ A X'` with the levers `a` of `X = [I −â; 0 I]` and `b` of `X'`.
    #[inline(always)]
    pub(crate) fn between(&self, a: Vector<L>, b: Vector<L>) -> Self {
        let (ll, la) = (self.ll, self.la.minus(&self.ll.times_skew(b)));
        let al = self.al.plus(&Columns::skew_times(a, &ll));
        let aa = self.aa.minus(&self.al.times_skew(b)).plus(&Columns::skew_times(a, &la));
        Self { ll, la, al, aa }
    }
}
