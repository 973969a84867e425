//! The numbers that sweeps over bodies compute with: of one tree, or of many at once.
//!
//! A sweep is written once, over a [`Space`]. What differs between spaces is how a vector stands in
//! registers and in memory:
//!
//! | space | number | vector |
//! |---|---|---|
//! | [`OneTree`](super::one_tree::OneTree) | `f64` | `x, y, z` in one register |
//! | every [`Register`](vi_core::lanes::Register) | one number of each member | three registers |
//! | [`PointRegisters`](super::control_points::PointRegisters) | one of each control point of a step | three registers |
//!
//! Every operation acts on the same numbers in the same order in the first two and is rounded by
//! itself: a member of an ensemble has the bits of a tree that moves alone.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Sub};
use vi_core::lanes::Lanes;

/// What stands in memory.
pub(crate) trait Store: Copy + Debug + 'static {
    /// A coordinate, an unknown.
    type Number: Lanes;
    /// A vector between two sweeps.
    type Held: Copy + Debug + Send + Sync;
    /// A number of the mechanism.
    type Constant: Copy + Debug + Send + Sync;
}

/// The numbers of a [`Space`].
pub(crate) type Number<S> = <<S as Space>::Store as Store>::Number;

/// Vectors of a [`Space`] in memory.
pub(crate) type Held<S> = <<S as Space>::Store as Store>::Held;

/// Constants of a [`Space`].
pub(crate) type Constant<S> = <<S as Space>::Store as Store>::Constant;

/// Three components in registers.
pub(crate) trait Vector:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> + Div<f64, Output = Self>
{
    /// A component.
    type Number: Lanes;
    /// The same in memory.
    type Held: Copy;

    /// Another vector.
    fn of(self, components: [Self::Number; 3]) -> Self;
    /// `x, y, z`.
    fn components(self) -> [Self::Number; 3];
    /// As it stands in memory.
    fn held(self) -> Self::Held;
    /// Times a number.
    fn scaled(self, factor: Self::Number) -> Self;
    fn dot(self, other: Self) -> Self::Number;
    fn cross(self, other: Self) -> Self;

    /// `a·b` of three pairs.
    #[inline(always)]
    fn dots(pairs: [(Self, Self); 3]) -> Self {
        let [a, b, c] = pairs;
        a.0.of([a.0.dot(a.1), b.0.dot(b.1), c.0.dot(c.1)])
    }

    /// The columns of `v̂`, with `v̂ b = v × b`.
    #[inline(always)]
    fn skew(self) -> [Self; 3] {
        let [x, y, z] = self.components();
        let zero = x.like(0.0);
        [self.of([zero, z, y * -1.0]), self.of([z * -1.0, zero, x]), self.of([y, x * -1.0, zero])]
    }

    /// The columns of `s n̂ + g n̂²` of the vector `n`, without cancellation on the diagonal.
    #[inline(always)]
    fn turn_about(self, s: Self::Number, g: Self::Number) -> [Self; 3] {
        let [x, y, z] = self.components();
        let (xx, yy, zz) = (x * x, y * y, z * z);
        let (xy, xz, yz) = (x * y, x * z, y * z);
        let [a, b, c] = self.skew();
        [
            a.scaled(s) + self.of([(yy + zz) * -1.0, xy, xz]).scaled(g),
            b.scaled(s) + self.of([xy, (zz + xx) * -1.0, yz]).scaled(g),
            c.scaled(s) + self.of([xz, yz, (xx + yy) * -1.0]).scaled(g),
        ]
    }

    /// `(M_zy − M_yz, M_xz − M_zx, M_yx − M_xy)` of the columns of `M`.
    #[inline(always)]
    fn moment([a, b, c]: [Self; 3]) -> Self {
        let (x, y, z) = (a.components(), b.components(), c.components());
        a.of([y[2] - z[1], z[0] - x[2], x[1] - y[0]])
    }

    /// Each component where it is at most `factor` times the larger one of two others, zero
    /// elsewhere.
    #[inline(always)]
    fn if_small(self, factor: f64, [a, b]: [Self; 2]) -> Self {
        let (a, b, x) = (a.components(), b.components(), self.components());
        let zero = x[0].like(0.0);
        let mut kept = x;
        for i in 0..3 {
            let bound = a[i].abs().larger(b[i].abs()) * factor;
            kept[i] = x[i].abs().if_at_most(bound, x[i], zero);
        }
        self.of(kept)
    }
}

/// How sweeps compute.
pub(crate) trait Space: Copy {
    /// What stands in memory.
    type Store: Store;
    /// A vector in registers.
    type Vector: Vector<Number = Number<Self>, Held = Held<Self>>;
    /// Whether something holds, for each tree.
    type Check: Copy;

    /// Whether balances are projected at the end of the motion, `S = S'`, and not at its start:
    /// matrices are symmetric and positive definite.
    const SYMMETRIC: bool = false;

    /// A number.
    fn number(self, x: f64) -> Number<Self>;
    /// A vector.
    fn vector(self, x: [f64; 3]) -> Self::Vector;
    /// A number of the mechanism.
    fn factor(self, x: Constant<Self>) -> Number<Self>;
    /// A vector of the mechanism.
    fn constant(self, x: &[Constant<Self>; 3]) -> Self::Vector;
    /// A vector from memory.
    fn take(self, held: &Held<Self>) -> Self::Vector;
    /// The vector that begins at an entry.
    fn read(self, x: &[Number<Self>], first: usize) -> Self::Vector;
    /// The four vectors of the frame that begins at an entry: its centre and its directors.
    fn read_frame(self, q: &[Number<Self>], first: usize) -> [Self::Vector; 4];
    /// Writes four vectors to the frame that begins at an entry.
    fn write_frame(self, vectors: [Self::Vector; 4], q: &mut [Number<Self>], first: usize);
    /// `sin x/x` and `(1 − cos x)/x²` of `x²`.
    fn rotation(self, square: Number<Self>) -> [Number<Self>; 2];
    /// `κ` of `|θ|²`, with `T(θ)⁻¹ = I − ½ θ̂ + κ θ̂²`.
    fn kappa(self, square: Number<Self>) -> Number<Self>;
    /// Whether no component is larger than `bound`; not so of what is not a number.
    fn within(self, v: Self::Vector, bound: f64) -> Self::Check;
    /// Whether both hold.
    fn both(self, a: Self::Check, b: Self::Check) -> Self::Check;
    /// The trees for which it does not hold, a bit each.
    fn failing(self, check: Self::Check) -> u8;

    /// Zero.
    #[inline(always)]
    fn zero(self) -> Self::Vector {
        self.vector([0.0; 3])
    }

    /// Writes the vector that begins at an entry.
    #[inline(always)]
    fn write(self, v: Self::Vector, out: &mut [Number<Self>], first: usize) {
        out[first..first + 3].copy_from_slice(&v.components());
    }
}
