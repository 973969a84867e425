//! Vectors of three numbers in four lanes: what sweeps over bodies compute with.
//!
//! A [`Width`] says how four lanes are computed with: in a wide register of the processor, or one by one. Every operation
//! acts on the lanes in the same order and without fused multiply-add, so that the width changes the speed and not a bit.
//! The fourth lane is zero. [`Held`] is what stands in memory.

/// `[e(0), e(1), e(2)]`. Not by a closure: that would not be compiled for the width of its caller.
macro_rules! three {
    ($j:ident => $e:expr) => {
        [
            {
                let $j = 0;
                $e
            },
            {
                let $j = 1;
                $e
            },
            {
                let $j = 2;
                $e
            },
        ]
    };
}
pub(crate) use three;

/// A sweep that is compiled for each width, and chosen at run time.
macro_rules! sweep {
    ($(#[$doc:meta])* $name:ident = $sweep:ident($($argument:ident: $type:ty),*) -> $output:ty) => {
        $(#[$doc])*
        pub(crate) fn $name<'a>($($argument: $type),*) -> $output {
            struct Call<'a, W> { width: W, $($argument: $type),* }
            impl<'a, W: $crate::geometry::lanes::Width> pulp::NullaryFnOnce for Call<'a, W> {
                type Output = $output;

                #[inline(always)]
                fn call(self) -> $output {
                    $sweep(self.width, $(self.$argument),*)
                }
            }
            #[cfg(target_arch = "x86_64")]
            if let Some(width) = pulp::x86::V3::try_new() {
                return width.vectorize(Call { width, $($argument),* });
            }
            pulp::NullaryFnOnce::call(Call { width: $crate::geometry::lanes::Narrow, $($argument),* })
        }
    };
}
pub(crate) use sweep;

use std::ops::{Add, AddAssign, Div, Mul, Sub, SubAssign};

/// How four lanes are computed with.
pub(crate) trait Width: Copy {
    /// Four lanes.
    type Lanes: Copy;
    /// From the lanes.
    fn join(self, lanes: [f64; 4]) -> Self::Lanes;
    /// The lanes.
    fn split(self, v: Self::Lanes) -> [f64; 4];
    /// The same in each lane.
    fn splat(self, x: f64) -> Self::Lanes;
    fn add(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    fn sub(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    fn mul(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    fn div(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// `(y, z, x, w)`.
    fn turn(self, v: Self::Lanes) -> Self::Lanes;
    /// `(x + y) + (z + w)` of three.
    fn sums(self, v: [Self::Lanes; 3]) -> Self::Lanes;
}

/// Lane by lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Narrow;

impl Width for Narrow {
    type Lanes = [f64; 4];

    #[inline(always)]
    fn join(self, lanes: [f64; 4]) -> [f64; 4] {
        lanes
    }

    #[inline(always)]
    fn split(self, v: [f64; 4]) -> [f64; 4] {
        v
    }

    #[inline(always)]
    fn splat(self, x: f64) -> [f64; 4] {
        [x; 4]
    }

    #[inline(always)]
    fn add(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
    }

    #[inline(always)]
    fn sub(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]]
    }

    #[inline(always)]
    fn mul(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]]
    }

    #[inline(always)]
    fn div(self, a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [a[0] / b[0], a[1] / b[1], a[2] / b[2], a[3] / b[3]]
    }

    #[inline(always)]
    fn turn(self, [x, y, z, w]: [f64; 4]) -> [f64; 4] {
        [y, z, x, w]
    }

    #[inline(always)]
    fn sums(self, v: [[f64; 4]; 3]) -> [f64; 4] {
        let [x, y, z] = three!(j => (v[j][0] + v[j][1]) + (v[j][2] + v[j][3]));
        [x, y, z, 0.0]
    }
}

#[cfg(target_arch = "x86_64")]
mod wide {
    use super::Width;
    use pulp::cast;
    use pulp::x86::V3;
    use std::arch::x86_64::__m256d;

    impl Width for V3 {
        type Lanes = __m256d;

        #[inline(always)]
        fn join(self, [x, y, z, w]: [f64; 4]) -> __m256d {
            self.avx._mm256_setr_pd(x, y, z, w)
        }

        #[inline(always)]
        fn split(self, v: __m256d) -> [f64; 4] {
            cast(v)
        }

        #[inline(always)]
        fn splat(self, x: f64) -> __m256d {
            self.avx._mm256_set1_pd(x)
        }

        #[inline(always)]
        fn add(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_add_pd(a, b)
        }

        #[inline(always)]
        fn sub(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_sub_pd(a, b)
        }

        #[inline(always)]
        fn mul(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_mul_pd(a, b)
        }

        #[inline(always)]
        fn div(self, a: __m256d, b: __m256d) -> __m256d {
            self.avx._mm256_div_pd(a, b)
        }

        #[inline(always)]
        fn turn(self, v: __m256d) -> __m256d {
            self.avx2._mm256_permute4x64_pd::<0b11_00_10_01>(v)
        }

        #[inline(always)]
        fn sums(self, [a, b, c]: [__m256d; 3]) -> __m256d {
            let zero = self.splat(0.0);
            let (ab, c) = (self.avx._mm256_hadd_pd(a, b), self.avx._mm256_hadd_pd(c, zero));
            let low = self.avx._mm256_permute2f128_pd::<0x20>(ab, c); // x + y of a, b, c
            let high = self.avx._mm256_permute2f128_pd::<0x31>(ab, c); // z + w
            self.add(low, high)
        }
    }
}

/// Three numbers in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub(crate) struct Held([f64; 4]);

/// Three numbers in four lanes.
#[derive(Clone, Copy)]
pub(crate) struct Lanes<W: Width> {
    v: W::Lanes,
    w: W,
}

impl<W: Width> Lanes<W> {
    #[inline(always)]
    pub(crate) fn new(w: W, [x, y, z]: [f64; 3]) -> Self {
        Self { v: w.join([x, y, z, 0.0]), w }
    }

    #[inline(always)]
    pub(crate) fn zero(w: W) -> Self {
        Self { v: w.splat(0.0), w }
    }

    #[inline(always)]
    pub(crate) fn width(self) -> W {
        self.w
    }

    /// The first three of a slice.
    #[inline(always)]
    pub(crate) fn of(w: W, x: &[f64]) -> Self {
        Self::new(w, [x[0], x[1], x[2]])
    }

    #[inline(always)]
    pub(crate) fn take(w: W, held: &Held) -> Self {
        Self { v: w.join(held.0), w }
    }

    #[inline(always)]
    pub(crate) fn held(self) -> Held {
        Held(self.w.split(self.v))
    }

    #[inline(always)]
    pub(crate) fn xyz(self) -> [f64; 3] {
        let [x, y, z, _] = self.w.split(self.v);
        [x, y, z]
    }

    /// Writes the first three of a slice.
    #[inline(always)]
    pub(crate) fn write(self, out: &mut [f64]) {
        out[..3].copy_from_slice(&self.xyz());
    }

    /// Whether no component is larger than `bound`; not so of what is not a number.
    #[inline(always)]
    pub(crate) fn within(self, bound: f64) -> bool {
        let [x, y, z] = self.xyz();
        (x.abs() <= bound) & (y.abs() <= bound) & (z.abs() <= bound)
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self { v: self.w.mul(self.v, other.v), w: self.w }
    }

    /// `a·b` of three pairs.
    #[inline(always)]
    pub(crate) fn dots(pairs: [(Self, Self); 3]) -> Self {
        let w = pairs[0].0.w;
        Self { v: w.sums(three!(j => pairs[j].0.times(pairs[j].1).v)), w }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> f64 {
        let [x, y, z, w] = self.w.split(self.times(other).v);
        (x + y) + (z + w)
    }

    #[inline(always)]
    fn turn(self) -> Self {
        Self { v: self.w.turn(self.v), w: self.w }
    }

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        (self.times(other.turn()) - self.turn().times(other)).turn()
    }
}

impl<W: Width> Add for Lanes<W> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { v: self.w.add(self.v, other.v), w: self.w }
    }
}

impl<W: Width> Sub for Lanes<W> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { v: self.w.sub(self.v, other.v), w: self.w }
    }
}

impl<W: Width> Mul<f64> for Lanes<W> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self { v: self.w.mul(self.v, self.w.splat(factor)), w: self.w }
    }
}

impl<W: Width> Div<f64> for Lanes<W> {
    type Output = Self;

    #[inline(always)]
    fn div(self, divisor: f64) -> Self {
        Self { v: self.w.div(self.v, self.w.splat(divisor)), w: self.w }
    }
}

impl<W: Width> AddAssign for Lanes<W> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<W: Width> SubAssign for Lanes<W> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
