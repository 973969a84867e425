//! One, four or eight numbers side by side, with the same bits on every processor.
//!
//! Sums and products act number by number and are rounded one by one (no fused multiplication and
//! addition), so the bits do not depend on the registers in use. [`Plain`] leaves the choice of
//! instructions to the compiler, [`Wide`] uses registers of 256 bits where [`Wide::detect`] finds
//! them.
//!
//! A [`Register`] is the proof that its instructions exist; [`Register::run`] is where they may be
//! used, and what it calls must be inlined there.

use std::fmt::Debug;
use std::ops::{Add, Mul, Sub};

/// `COUNT` numbers.
pub trait Lanes:
    Copy
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + 'static
{
    /// How many numbers.
    const COUNT: usize;
    /// Number `k`.
    fn at(self, k: usize) -> f64;
    /// `x`, as many times.
    #[must_use]
    fn like(self, x: f64) -> Self;
    /// The same but for the first number.
    #[must_use]
    fn with_first(self, x: f64) -> Self;
    /// Writes number `k` where it stands in memory.
    fn set(&mut self, k: usize, x: f64);
    /// The quotients.
    #[must_use]
    fn over(self, divisor: Self) -> Self;
    /// The larger one of each; that of `other` where one is not a number.
    #[must_use]
    fn larger(self, other: Self) -> Self;
    /// The absolute values; not a number stays so.
    #[must_use]
    #[inline(always)]
    fn abs(self) -> Self {
        self.larger(self.like(0.0) - self)
    }
    /// Each by a function.
    #[must_use]
    fn map(self, f: impl Fn(f64) -> f64) -> Self;
    /// `then` where the number is at most `bound`, `other` elsewhere.
    #[must_use]
    fn if_at_most(self, bound: Self, then: Self, other: Self) -> Self;
    /// Whether all are at most `bound`; not so where one is not a number.
    #[must_use]
    fn are_at_most(self, bound: f64) -> bool;
}

/// A kind of registers.
pub trait Register: Copy + Debug + Send + Sync + 'static {
    /// What one of them holds.
    type Lanes: Lanes;
    /// The same number `COUNT` times.
    fn splat(self, x: f64) -> Self::Lanes;
    /// Number `k` is `number(k)`.
    fn gather(self, number: impl Fn(usize) -> f64) -> Self::Lanes;
    /// Calls `f`, compiled for these registers.
    fn run<R>(self, f: impl FnOnce() -> R) -> R;
}

/// A number alone.
impl Lanes for f64 {
    const COUNT: usize = 1;
    #[inline(always)]
    fn at(self, _: usize) -> f64 {
        self
    }
    #[inline(always)]
    fn like(self, x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn with_first(self, x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn set(&mut self, _: usize, x: f64) {
        *self = x;
    }
    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        self / divisor
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        f(self)
    }
    #[inline(always)]
    fn if_at_most(self, bound: Self, then: Self, other: Self) -> Self {
        if self <= bound { then } else { other }
    }
    #[inline(always)]
    fn are_at_most(self, bound: f64) -> bool {
        self <= bound
    }
}

/// Four numbers in an array.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct Four([f64; 4]);

macro_rules! each {
    ($a:ident $op:tt $b:expr) => {
        Four([$a.0[0] $op $b[0], $a.0[1] $op $b[1], $a.0[2] $op $b[2], $a.0[3] $op $b[3]])
    };
}

impl Add for Four {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        each!(self + other.0)
    }
}

impl Sub for Four {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        each!(self - other.0)
    }
}

impl Mul for Four {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        each!(self * other.0)
    }
}

impl Mul<f64> for Four {
    type Output = Self;
    #[inline(always)]
    fn mul(self, x: f64) -> Self {
        each!(self * [x; 4])
    }
}

impl Lanes for Four {
    const COUNT: usize = 4;
    #[inline(always)]
    fn at(self, k: usize) -> f64 {
        self.0[k]
    }
    #[inline(always)]
    fn like(self, x: f64) -> Self {
        Self([x; 4])
    }
    #[inline(always)]
    fn with_first(self, x: f64) -> Self {
        Self([x, self.0[1], self.0[2], self.0[3]])
    }
    #[inline(always)]
    fn set(&mut self, k: usize, x: f64) {
        self.0[k] = x;
    }
    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        each!(self / divisor.0)
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        let larger = |k: usize| if self.0[k] > other.0[k] { self.0[k] } else { other.0[k] };
        Four([larger(0), larger(1), larger(2), larger(3)])
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Four(self.0.map(f))
    }
    #[inline(always)]
    fn if_at_most(self, bound: Self, then: Self, other: Self) -> Self {
        let chosen = |k: usize| if self.0[k] <= bound.0[k] { then.0[k] } else { other.0[k] };
        Four([chosen(0), chosen(1), chosen(2), chosen(3)])
    }
    #[inline(always)]
    fn are_at_most(self, bound: f64) -> bool {
        let [a, b, c, d] = self.0;
        (a <= bound) & (b <= bound) & (c <= bound) & (d <= bound)
    }
}

/// Registers that the compiler chooses.
#[derive(Clone, Copy, Debug)]
pub struct Plain;

impl Register for Plain {
    type Lanes = Four;
    #[inline(always)]
    fn splat(self, x: f64) -> Four {
        Four([x; 4])
    }
    #[inline(always)]
    fn gather(self, number: impl Fn(usize) -> f64) -> Four {
        Four([number(0), number(1), number(2), number(3)])
    }
    #[inline(always)]
    fn run<R>(self, f: impl FnOnce() -> R) -> R {
        f()
    }
}

#[cfg(target_arch = "x86_64")]
pub use wide::{Wide, WideFour};

#[cfg(target_arch = "x86_64")]
mod wide {
    use super::{Lanes, Register};
    use pulp::bytemuck::cast_mut;
    use pulp::cast;
    use pulp::x86::V3;
    use std::arch::x86_64::{__m256d, _CMP_GT_OQ, _CMP_LE_OQ};
    use std::ops::{Add, Mul, Sub};

    /// Registers of 256 bits.
    #[derive(Clone, Copy, Debug)]
    pub struct Wide(V3);

    impl Wide {
        /// Whether the processor has them.
        #[must_use]
        pub fn detect() -> Option<Self> {
            V3::try_new().map(Self)
        }
    }

    /// Four numbers in a register. Not four fields: the compiler would move them one by one.
    #[derive(Clone, Copy, Debug)]
    pub struct WideFour {
        simd: V3,
        x: __m256d,
    }

    impl Add for WideFour {
        type Output = Self;
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            Self { x: self.simd.avx._mm256_add_pd(self.x, other.x), ..self }
        }
    }

    impl Sub for WideFour {
        type Output = Self;
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            Self { x: self.simd.avx._mm256_sub_pd(self.x, other.x), ..self }
        }
    }

    impl Mul for WideFour {
        type Output = Self;
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            Self { x: self.simd.avx._mm256_mul_pd(self.x, other.x), ..self }
        }
    }

    impl Mul<f64> for WideFour {
        type Output = Self;
        #[inline(always)]
        fn mul(self, x: f64) -> Self {
            Self { x: self.simd.avx._mm256_mul_pd(self.x, self.simd.avx._mm256_set1_pd(x)), ..self }
        }
    }

    impl Lanes for WideFour {
        const COUNT: usize = 4;
        #[inline(always)]
        fn at(self, k: usize) -> f64 {
            cast::<__m256d, [f64; 4]>(self.x)[k]
        }
        #[inline(always)]
        fn like(self, x: f64) -> Self {
            Self { x: self.simd.avx._mm256_set1_pd(x), ..self }
        }
        #[inline(always)]
        fn with_first(self, x: f64) -> Self {
            let avx = self.simd.avx;
            Self { x: avx._mm256_blend_pd::<0b0001>(self.x, avx._mm256_set1_pd(x)), ..self }
        }
        #[inline(always)]
        fn set(&mut self, k: usize, x: f64) {
            cast_mut::<__m256d, [f64; 4]>(&mut self.x)[k] = x;
        }
        #[inline(always)]
        fn over(self, divisor: Self) -> Self {
            Self { x: self.simd.avx._mm256_div_pd(self.x, divisor.x), ..self }
        }
        #[inline(always)]
        fn larger(self, other: Self) -> Self {
            let avx = self.simd.avx;
            let is_larger = avx._mm256_cmp_pd::<_CMP_GT_OQ>(self.x, other.x);
            Self { x: avx._mm256_blendv_pd(other.x, self.x, is_larger), ..self }
        }
        #[inline(always)]
        fn map(self, f: impl Fn(f64) -> f64) -> Self {
            Self { x: cast(cast::<__m256d, [f64; 4]>(self.x).map(f)), ..self }
        }
        #[inline(always)]
        fn if_at_most(self, bound: Self, then: Self, other: Self) -> Self {
            let avx = self.simd.avx;
            let is_at_most = avx._mm256_cmp_pd::<_CMP_LE_OQ>(self.x, bound.x);
            Self { x: avx._mm256_blendv_pd(other.x, then.x, is_at_most), ..self }
        }
        #[inline(always)]
        fn are_at_most(self, bound: f64) -> bool {
            let avx = self.simd.avx;
            let bound = avx._mm256_set1_pd(bound);
            let are = avx._mm256_cmp_pd::<_CMP_LE_OQ>(self.x, bound);
            avx._mm256_movemask_pd(are) == 0b1111
        }
    }

    impl Register for Wide {
        type Lanes = WideFour;
        #[inline(always)]
        fn splat(self, x: f64) -> WideFour {
            WideFour { simd: self.0, x: self.0.avx._mm256_set1_pd(x) }
        }
        #[inline(always)]
        fn gather(self, number: impl Fn(usize) -> f64) -> WideFour {
            let x = cast([number(0), number(1), number(2), number(3)]);
            WideFour { simd: self.0, x }
        }
        #[inline(always)]
        fn run<R>(self, f: impl FnOnce() -> R) -> R {
            self.0.vectorize(f)
        }
    }
}

/// Twice as many numbers.
#[derive(Clone, Copy, Debug)]
pub struct Pair<L>(L, L);

impl<L: Lanes> Add for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}

impl<L: Lanes> Sub for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}

impl<L: Lanes> Mul for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0, self.1 * other.1)
    }
}

impl<L: Lanes> Mul<f64> for Pair<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, x: f64) -> Self {
        Self(self.0 * x, self.1 * x)
    }
}

impl<L: Lanes> Lanes for Pair<L> {
    const COUNT: usize = 2 * L::COUNT;
    #[inline(always)]
    fn at(self, k: usize) -> f64 {
        if k < L::COUNT { self.0.at(k) } else { self.1.at(k - L::COUNT) }
    }
    #[inline(always)]
    fn like(self, x: f64) -> Self {
        Self(self.0.like(x), self.1.like(x))
    }
    #[inline(always)]
    fn with_first(self, x: f64) -> Self {
        Self(self.0.with_first(x), self.1)
    }
    #[inline(always)]
    fn set(&mut self, k: usize, x: f64) {
        match k.checked_sub(L::COUNT) {
            None => self.0.set(k, x),
            Some(k) => self.1.set(k, x),
        }
    }
    #[inline(always)]
    fn over(self, divisor: Self) -> Self {
        Self(self.0.over(divisor.0), self.1.over(divisor.1))
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        Self(self.0.larger(other.0), self.1.larger(other.1))
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self(self.0.map(&f), self.1.map(&f))
    }
    #[inline(always)]
    fn if_at_most(self, bound: Self, then: Self, other: Self) -> Self {
        Self(
            self.0.if_at_most(bound.0, then.0, other.0),
            self.1.if_at_most(bound.1, then.1, other.1),
        )
    }
    #[inline(always)]
    fn are_at_most(self, bound: f64) -> bool {
        self.0.are_at_most(bound) & self.1.are_at_most(bound)
    }
}

/// Two registers for one.
#[derive(Clone, Copy, Debug)]
pub struct Twice<T>(
    /// The kind of both.
    pub T,
);

impl<T: Register> Register for Twice<T> {
    type Lanes = Pair<T::Lanes>;
    #[inline(always)]
    fn splat(self, x: f64) -> Self::Lanes {
        Pair(self.0.splat(x), self.0.splat(x))
    }
    #[inline(always)]
    #[allow(clippy::redundant_closure)] // a reference to a closure is not inlined
    fn gather(self, number: impl Fn(usize) -> f64) -> Self::Lanes {
        Pair(
            self.0.gather(
                #[inline(always)]
                |k| number(k),
            ),
            self.0.gather(
                #[inline(always)]
                |k| number(k + T::Lanes::COUNT),
            ),
        )
    }
    #[inline(always)]
    fn run<R>(self, f: impl FnOnce() -> R) -> R {
        self.0.run(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers after each operation.
    fn results<T: Register>(register: T) -> Vec<u64> {
        let count = T::Lanes::COUNT;
        register.run(|| {
            let a = register.gather(|k| 1.0 / (k + 3) as f64);
            let b = register.gather(|k| (k as f64 - 1.7).exp2()) + register.splat(0.1);
            let c = (a * b - b.over(a) * 0.3 + a).larger(b * -9.0).with_first(0.7 / 3.0);
            let c = b.if_at_most(register.splat(2.0), c, a);
            assert!(a.are_at_most(1.0 / 3.0) && !a.are_at_most(0.333));
            let mut last = a;
            last.set(count - 1, f64::NAN);
            assert!(!last.are_at_most(1.0));
            (0..count).map(|k| c.at(k).to_bits()).collect()
        })
    }

    #[test]
    fn all_registers_give_the_same_bits() {
        let plain = results(Twice(Plain));
        assert_eq!(results(Plain), plain[..4]);
        #[cfg(target_arch = "x86_64")]
        if let Some(wide) = Wide::detect() {
            assert_eq!(results(wide), plain[..4]);
            assert_eq!(results(Twice(wide)), plain);
        }
        let at = |k: usize| {
            let (a, b) = (1.0 / (k + 3) as f64, (k as f64 - 1.7).exp2() + 0.1);
            match k {
                0 => 0.7 / 3.0,
                _ if b > 2.0 => a,
                _ => (a * b - b / a * 0.3 + a).max(b * -9.0),
            }
        };
        assert_eq!(plain, (0..8).map(|k| at(k).to_bits()).collect::<Vec<_>>());
    }
}
