//! The space of many trees: a lane of a register holds a number of each of them.

use super::matrix;
use super::one_tree::three;
use super::space::{self, Space, Store};
use std::marker::PhantomData;
use std::ops::{Add, Div, Mul, Sub};
use vi_core::lanes::{Lanes, Register};
use vi_rigid::rotation;

/// Many trees: what stands in memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EachMember<L>(PhantomData<L>);

impl<L: Lanes> Store for EachMember<L> {
    type Number = L;
    type Held = LanesVector<L>;
    type Constant = L;
}

/// Three components, each in all lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LanesVector<L>(pub(crate) [L; 3]);

/// A twist or a wrench, in all lanes.
pub(crate) type LanesScrew<L> = matrix::Screw<LanesVector<L>>;

impl<L: Lanes> LanesVector<L> {
    /// Another vector in the first lane.
    #[inline(always)]
    pub(crate) fn with_first(self, x: &[f64; 3]) -> Self {
        let [a, b, c] = self.0;
        Self([a.with_first(x[0]), b.with_first(x[1]), c.with_first(x[2])])
    }
}

impl<L: Lanes> Add for LanesVector<L> {
    type Output = Self;

    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self([self.0[0] + o.0[0], self.0[1] + o.0[1], self.0[2] + o.0[2]])
    }
}

impl<L: Lanes> Sub for LanesVector<L> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self([self.0[0] - o.0[0], self.0[1] - o.0[1], self.0[2] - o.0[2]])
    }
}

impl<L: Lanes> Mul<f64> for LanesVector<L> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self([self.0[0] * factor, self.0[1] * factor, self.0[2] * factor])
    }
}

impl<L: Lanes> Div<f64> for LanesVector<L> {
    type Output = Self;

    #[inline(always)]
    fn div(self, divisor: f64) -> Self {
        let [x, y, z] = self.0;
        let divisor = x.like(divisor);
        Self([x.over(divisor), y.over(divisor), z.over(divisor)])
    }
}

impl<L: Lanes> space::Vector for LanesVector<L> {
    type Number = L;
    type Held = Self;

    #[inline(always)]
    fn of(self, components: [L; 3]) -> Self {
        Self(components)
    }

    #[inline(always)]
    fn components(self) -> [L; 3] {
        self.0
    }

    #[inline(always)]
    fn held(self) -> Self {
        self
    }

    #[inline(always)]
    fn scaled(self, factor: L) -> Self {
        Self([self.0[0] * factor, self.0[1] * factor, self.0[2] * factor])
    }

    #[inline(always)]
    fn dot(self, o: Self) -> L {
        self.0[0] * o.0[0] + self.0[1] * o.0[1] + self.0[2] * o.0[2]
    }

    #[inline(always)]
    fn cross(self, o: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, o.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }
}

impl<R: Register> Space for R {
    type Store = EachMember<R::Lanes>;
    type Vector = LanesVector<R::Lanes>;
    /// One where it fails.
    type Check = R::Lanes;

    #[inline(always)]
    fn number(self, x: f64) -> R::Lanes {
        self.splat(x)
    }

    #[inline(always)]
    fn vector(self, x: [f64; 3]) -> LanesVector<R::Lanes> {
        LanesVector([self.splat(x[0]), self.splat(x[1]), self.splat(x[2])])
    }

    #[inline(always)]
    fn factor(self, x: R::Lanes) -> R::Lanes {
        x
    }

    #[inline(always)]
    fn constant(self, x: &[R::Lanes; 3]) -> LanesVector<R::Lanes> {
        LanesVector(*x)
    }

    #[inline(always)]
    fn take(self, held: &LanesVector<R::Lanes>) -> LanesVector<R::Lanes> {
        *held
    }

    #[inline(always)]
    fn read(self, x: &[R::Lanes], first: usize) -> LanesVector<R::Lanes> {
        LanesVector([x[first], x[first + 1], x[first + 2]])
    }

    #[inline(always)]
    fn read_frame(self, q: &[R::Lanes], first: usize) -> [LanesVector<R::Lanes>; 4] {
        let q = &q[first..first + 12];
        [self.read(q, 0), self.read(q, 3), self.read(q, 6), self.read(q, 9)]
    }

    #[inline(always)]
    fn write_frame(self, v: [LanesVector<R::Lanes>; 4], q: &mut [R::Lanes], first: usize) {
        q[first..first + 12].copy_from_slice([v[0].0, v[1].0, v[2].0, v[3].0].as_flattened());
    }

    #[inline(always)]
    fn rotation(self, square: R::Lanes) -> [R::Lanes; 2] {
        rotation::coefficients_of_each(square)
    }

    #[inline(always)]
    fn kappa(self, square: R::Lanes) -> R::Lanes {
        rotation::kappa_of_each(square)
    }

    #[inline(always)]
    fn within(self, v: LanesVector<R::Lanes>, bound: f64) -> R::Lanes {
        let (zero, one, bound) = (self.splat(0.0), self.splat(1.0), self.splat(bound));
        let [x, y, z] = three!(i => v.0[i].abs().if_at_most(bound, zero, one));
        x.larger(y).larger(z)
    }

    #[inline(always)]
    fn both(self, a: R::Lanes, b: R::Lanes) -> R::Lanes {
        a.larger(b)
    }

    #[inline(always)]
    fn failing(self, check: R::Lanes) -> u8 {
        let mut failing = 0;
        for lane in 0..R::Lanes::COUNT {
            failing |= u8::from(check.at(lane) > 0.0) << lane;
        }
        failing
    }
}
