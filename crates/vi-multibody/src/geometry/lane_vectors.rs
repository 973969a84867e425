//! Vectors of space, many at once: at all control points of a step, or of all members of an
//! ensemble. A lane holds one of them.

use crate::geometry::space::Vector as _;
use std::ops::{Add, Mul, Sub};
use vi_core::lanes::{Lanes, Register};

/// Three components, each in all lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vector<L>(pub [L; 3]);

impl<L: Lanes> Add for Vector<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl<L: Lanes> Sub for Vector<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}

impl<L: Lanes> Mul<f64> for Vector<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self([self.0[0] * factor, self.0[1] * factor, self.0[2] * factor])
    }
}

impl<L: Lanes> Vector<L> {
    /// The same vector in all lanes.
    #[inline(always)]
    pub(crate) fn splat(lanes: impl Register<Lanes = L>, x: &[f64; 3]) -> Self {
        Self([lanes.splat(x[0]), lanes.splat(x[1]), lanes.splat(x[2])])
    }

    /// Another vector in the first lane.
    #[inline(always)]
    pub(crate) fn with_first(self, x: &[f64; 3]) -> Self {
        let [a, b, c] = self.0;
        Self([a.with_first(x[0]), b.with_first(x[1]), c.with_first(x[2])])
    }
}

/// `f` of 0, 1, 2; attribute closures so that they are inlined.
#[inline(always)]
pub(crate) fn three<R>(f: impl Fn(usize) -> R) -> [R; 3] {
    [f(0), f(1), f(2)]
}

/// `Σ_J x_J c_J`: the vector with components `c` in three others.
#[inline(always)]
pub(crate) fn combine<L: Lanes>(x: &[Vector<L>; 3], c: &[f64; 3]) -> Vector<L> {
    x[0] * c[0] + x[1] * c[1] + x[2] * c[2]
}

/// The same with components that are different in each lane.
#[inline(always)]
pub(crate) fn combine_each<L: Lanes>(x: &[Vector<L>; 3], c: &Vector<L>) -> Vector<L> {
    x[0].scaled(c.0[0]) + x[1].scaled(c.0[1]) + x[2].scaled(c.0[2])
}

/// A twist `(φ̇, ω)` or a wrench `(f, τ)`.
pub(crate) type Screw<L> = super::matrix::Screw<Vector<L>>;

/// How the twist of the parent enters that of a link ([`crate::pair::Transfer`]), without its arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Transfer {
    Rigid,
    Point,
    None,
}

impl Transfer {
    /// `X t`.
    #[inline(always)]
    pub(crate) fn apply<L: Lanes>(
        self,
        lanes: impl Register<Lanes = L>,
        arm: &Vector<L>,
        t: &Screw<L>,
    ) -> Screw<L> {
        let linear = t.linear + t.angular.cross(*arm);
        match self {
            Self::Rigid => Screw { linear, angular: t.angular },
            Self::Point => Screw { linear, angular: Vector::splat(lanes, &[0.0; 3]) },
            Self::None => Screw::zero(lanes),
        }
    }

    /// `out ← out + Xᵀ w`.
    #[inline(always)]
    pub(crate) fn add_transposed<L: Lanes>(
        self,
        arm: &Vector<L>,
        w: &Screw<L>,
        out: &mut Screw<L>,
    ) {
        if self == Self::None {
            return;
        }
        let moment = arm.cross(w.linear);
        out.linear = out.linear + w.linear;
        out.angular = out.angular + if self == Self::Rigid { w.angular + moment } else { moment };
    }
}
