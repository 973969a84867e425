//! Vectors of three numbers in four lanes: what sweeps over bodies compute with.
//!
//! A [`Width`] says how four lanes are computed with: in a wide register of the processor, or one
//! by one. Every operation acts on the lanes in the same order and without fused multiply-add, so
//! that the width changes the speed and not a bit. The fourth lane is zero. [`Held`] is what stands
//! in memory.

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
    /// `(z, x, y, w)`.
    fn turn_back(self, v: Self::Lanes) -> Self::Lanes;
    /// Lane `I` of `b`, the others of `a`.
    fn with_lane<const I: usize>(self, a: Self::Lanes, b: Self::Lanes) -> Self::Lanes;
    /// `(x, y, z, 0)`.
    fn first_three(self, v: Self::Lanes) -> Self::Lanes;
    /// `(y, z, w, 0)`.
    fn last_three(self, v: Self::Lanes) -> Self::Lanes;
    /// `(x + y) + (z + w)` of three.
    fn sums(self, v: [Self::Lanes; 3]) -> Self::Lanes;
    /// Whether no `|x|` is larger than `bound`; not so of what is not a number.
    fn within(self, x: Self::Lanes, bound: f64) -> bool;
    /// `x` where `|x| ≤ factor max(|a|, |b|)`, zero elsewhere.
    fn if_small(self, x: Self::Lanes, factor: f64, sizes: [Self::Lanes; 2]) -> Self::Lanes;
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
    fn turn_back(self, [x, y, z, w]: [f64; 4]) -> [f64; 4] {
        [z, x, y, w]
    }

    #[inline(always)]
    fn with_lane<const I: usize>(self, mut a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        a[I] = b[I];
        a
    }

    #[inline(always)]
    fn first_three(self, [x, y, z, _]: [f64; 4]) -> [f64; 4] {
        [x, y, z, 0.0]
    }

    #[inline(always)]
    fn last_three(self, [_, y, z, w]: [f64; 4]) -> [f64; 4] {
        [y, z, w, 0.0]
    }

    #[inline(always)]
    fn sums(self, v: [[f64; 4]; 3]) -> [f64; 4] {
        let [x, y, z] = three!(j => (v[j][0] + v[j][1]) + (v[j][2] + v[j][3]));
        [x, y, z, 0.0]
    }

    #[inline(always)]
    fn within(self, x: [f64; 4], bound: f64) -> bool {
        x.iter().all(|x| x.abs() <= bound)
    }

    #[inline(always)]
    fn if_small(self, x: [f64; 4], factor: f64, [a, b]: [[f64; 4]; 2]) -> [f64; 4] {
        let larger = |a: f64, b: f64| if a > b { a } else { b };
        let kept = |i: usize| {
            let is_small = x[i].abs() <= factor * larger(a[i].abs(), b[i].abs());
            if is_small { x[i] } else { 0.0 }
        };
        [kept(0), kept(1), kept(2), kept(3)]
    }
}

#[cfg(target_arch = "x86_64")]
mod wide {
    use super::Width;
    use pulp::cast;
    use pulp::x86::V3;
    use std::arch::x86_64::{__m256d, _CMP_LE_OQ};

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
        fn turn_back(self, v: __m256d) -> __m256d {
            self.avx2._mm256_permute4x64_pd::<0b11_01_00_10>(v)
        }

        #[inline(always)]
        fn with_lane<const I: usize>(self, a: __m256d, b: __m256d) -> __m256d {
            match I {
                0 => self.avx._mm256_blend_pd::<0b0001>(a, b),
                1 => self.avx._mm256_blend_pd::<0b0010>(a, b),
                2 => self.avx._mm256_blend_pd::<0b0100>(a, b),
                _ => self.avx._mm256_blend_pd::<0b1000>(a, b),
            }
        }

        #[inline(always)]
        fn first_three(self, v: __m256d) -> __m256d {
            self.avx._mm256_blend_pd::<0b1000>(v, self.splat(0.0))
        }

        #[inline(always)]
        fn last_three(self, v: __m256d) -> __m256d {
            self.first_three(self.avx2._mm256_permute4x64_pd::<0b00_11_10_01>(v))
        }

        #[inline(always)]
        fn sums(self, [a, b, c]: [__m256d; 3]) -> __m256d {
            let zero = self.splat(0.0);
            let (ab, c) = (self.avx._mm256_hadd_pd(a, b), self.avx._mm256_hadd_pd(c, zero));
            let low = self.avx._mm256_permute2f128_pd::<0x20>(ab, c); // x + y of a, b, c
            let high = self.avx._mm256_permute2f128_pd::<0x31>(ab, c); // z + w
            self.add(low, high)
        }

        #[inline(always)]
        fn within(self, x: __m256d, bound: f64) -> bool {
            let size = self.avx._mm256_andnot_pd(self.splat(-0.0), x);
            let is_small = self.avx._mm256_cmp_pd::<_CMP_LE_OQ>(size, self.splat(bound));
            self.avx._mm256_movemask_pd(is_small) == 0b1111
        }

        #[inline(always)]
        fn if_small(self, x: __m256d, factor: f64, [a, b]: [__m256d; 2]) -> __m256d {
            let sign = self.splat(-0.0);
            let (a, b) = (self.avx._mm256_andnot_pd(sign, a), self.avx._mm256_andnot_pd(sign, b));
            let size = self.avx._mm256_andnot_pd(sign, x);
            let bound = self.mul(self.splat(factor), self.avx._mm256_max_pd(a, b));
            let is_small = self.avx._mm256_cmp_pd::<_CMP_LE_OQ>(size, bound);
            self.avx._mm256_and_pd(x, is_small)
        }
    }
}

/// Three numbers in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub(crate) struct Held([f64; 4]);

impl Held {
    #[inline(always)]
    pub(crate) fn xyz(&self) -> [f64; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }
}

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

    /// The four vectors of a frame: its centre and its directors.
    #[inline(always)]
    pub(crate) fn vectors(w: W, frame: &[f64; 12]) -> [Self; 4] {
        let [x1, y1, z1, x2, y2, z2, x3, y3, z3, x4, y4, z4] = *frame;
        let parts = [[x1, y1, z1, x2], [x2, y2, z2, x3], [x3, y3, z3, x4]];
        let [a, b, c] = three!(i => Self { v: w.first_three(w.join(parts[i])), w });
        [a, b, c, Self { v: w.last_three(w.join([z3, x4, y4, z4])), w }]
    }

    /// Writes four vectors to a frame.
    #[inline(always)]
    pub(crate) fn write_vectors([a, b, c, d]: [Self; 4], frame: &mut [f64; 12]) {
        let w = a.w;
        // what is too much is overwritten by the next one
        frame[..4].copy_from_slice(&w.split(a.v));
        frame[3..7].copy_from_slice(&w.split(b.v));
        frame[6..10].copy_from_slice(&w.split(c.v));
        d.write(&mut frame[9..]);
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

    /// Each component where it is at most `factor` times the larger one of two others, zero
    /// elsewhere.
    #[inline(always)]
    pub(crate) fn if_small(self, factor: f64, sizes: [Self; 2]) -> Self {
        let v = self.w.if_small(self.v, factor, [sizes[0].v, sizes[1].v]);
        Self { v, w: self.w }
    }

    /// Adds to the first three of a slice.
    #[inline(always)]
    pub(crate) fn add_to(self, out: &mut [f64]) {
        (Self::of(self.w, out) + self).write(out);
    }

    /// Whether no component is larger than `bound`; not so of what is not a number.
    #[inline(always)]
    pub(crate) fn within(self, bound: f64) -> bool {
        self.w.within(self.v, bound)
    }

    /// Component by component.
    #[inline(always)]
    pub(crate) fn times(self, other: Self) -> Self {
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

    /// `(y, z, x)`.
    #[inline(always)]
    pub(crate) fn turn(self) -> Self {
        Self { v: self.w.turn(self.v), w: self.w }
    }

    /// `(z, x, y)`.
    #[inline(always)]
    pub(crate) fn turn_back(self) -> Self {
        Self { v: self.w.turn_back(self.v), w: self.w }
    }

    /// Component `I` of `other`, the others as they are.
    #[inline(always)]
    pub(crate) fn with_component<const I: usize>(self, other: Self) -> Self {
        Self { v: self.w.with_lane::<I>(self.v, other.v), w: self.w }
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
