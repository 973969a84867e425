//! The space of the control points of a step: a lane of a register holds a number of each of them,
//! and the constants of the mechanism are in common.

use super::members::LanesVector;
use super::space::{Space, Store};
use std::marker::PhantomData;
use vi_core::lanes::{Lanes, Register};
use vi_rigid::rotation;

/// The control points of a step in registers of a kind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointRegisters<R>(pub(crate) R);

/// What stands in memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Points<L>(PhantomData<L>);

impl<L: Lanes> Store for Points<L> {
    type Number = L;
    type Held = LanesVector<L>;
    type Constant = f64;
}

impl<R: Register> Space for PointRegisters<R> {
    type Store = Points<R::Lanes>;
    type Vector = LanesVector<R::Lanes>;
    type Check = R::Lanes;

    /// `P(q_j)ᵀ M P(q_j)`.
    const SYMMETRIC: bool = true;

    #[inline(always)]
    fn number(self, x: f64) -> R::Lanes {
        self.0.splat(x)
    }

    #[inline(always)]
    fn vector(self, x: [f64; 3]) -> LanesVector<R::Lanes> {
        self.0.vector(x)
    }

    #[inline(always)]
    fn factor(self, x: f64) -> R::Lanes {
        self.0.splat(x)
    }

    #[inline(always)]
    fn constant(self, x: &[f64; 3]) -> LanesVector<R::Lanes> {
        self.0.vector(*x)
    }

    #[inline(always)]
    fn take(self, held: &LanesVector<R::Lanes>) -> LanesVector<R::Lanes> {
        *held
    }

    #[inline(always)]
    fn read(self, x: &[R::Lanes], first: usize) -> LanesVector<R::Lanes> {
        self.0.read(x, first)
    }

    #[inline(always)]
    fn read_frame(self, q: &[R::Lanes], first: usize) -> [LanesVector<R::Lanes>; 4] {
        self.0.read_frame(q, first)
    }

    #[inline(always)]
    fn write_frame(self, v: [LanesVector<R::Lanes>; 4], q: &mut [R::Lanes], first: usize) {
        self.0.write_frame(v, q, first);
    }

    /// Without a sine.
    #[inline(always)]
    fn rotation(self, square: R::Lanes) -> [R::Lanes; 2] {
        rotation::coefficients_by_doubling(square)
    }

    /// For corrections.
    #[inline(always)]
    fn kappa(self, square: R::Lanes) -> R::Lanes {
        rotation::kappa_by_series(square)
    }

    #[inline(always)]
    fn within(self, v: LanesVector<R::Lanes>, bound: f64) -> R::Lanes {
        self.0.within(v, bound)
    }

    #[inline(always)]
    fn both(self, a: R::Lanes, b: R::Lanes) -> R::Lanes {
        self.0.both(a, b)
    }

    #[inline(always)]
    fn failing(self, check: R::Lanes) -> u8 {
        self.0.failing(check)
    }
}
