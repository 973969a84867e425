//! The space of one tree: `x, y, z` of a vector in one register of four lanes.
//!
//! A [`Width`] says how four lanes are computed with: in a wide register of the processor, or one
//! by one. Every operation acts on the lanes in the same order and without fused multiply-add, so
//! that the width changes the speed and not a bit. The fourth lane is zero. [`HeldVector`] is what
//! stands in memory.

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

/// A sweep over one tree, compiled for each width, and chosen at run time.
macro_rules! sweep {
    ($(#[$doc:meta])* $name:ident = $sweep:ident($($argument:ident: $type:ty),*) -> $output:ty) => {
        $(#[$doc])*
        pub(crate) fn $name<'a>($($argument: $type),*) -> $output {
            struct Call<'a, W: $crate::geometry::one_tree::Width> {
                space: $crate::geometry::one_tree::OneTree<W>, $($argument: $type),*
            }
            impl<'a, W: $crate::geometry::one_tree::Width> pulp::NullaryFnOnce for Call<'a, W> {
                type Output = $output;

                #[inline(always)]
                fn call(self) -> $output {
                    $sweep(self.space, $(self.$argument),*)
                }
            }
            #[cfg(target_arch = "x86_64")]
            if let Some(width) = pulp::x86::V3::try_new() {
                let space = $crate::geometry::one_tree::OneTree(width);
                return width.vectorize(Call { space, $($argument),* });
            }
            let space = $crate::geometry::one_tree::OneTree($crate::geometry::one_tree::Narrow);
            pulp::NullaryFnOnce::call(Call { space, $($argument),* })
        }
    };
}
pub(crate) use sweep;

use super::space::{Space, Store, Vector};
use std::ops::{Add, Div, Mul, Sub};
use vi_rigid::rotation;

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
pub(crate) struct HeldVector([f64; 4]);

impl HeldVector {
    #[inline(always)]
    pub(crate) fn xyz(&self) -> [f64; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }
}

/// One tree: what stands in memory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct One;

impl Store for One {
    type Number = f64;
    type Held = HeldVector;
    type Constant = f64;
}

/// One tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OneTree<W>(pub(crate) W);

/// Three numbers in four lanes.
#[derive(Clone, Copy)]
pub(crate) struct Xyz<W: Width> {
    v: W::Lanes,
    w: W,
}

impl<W: Width> Xyz<W> {
    #[inline(always)]
    fn new(w: W, [x, y, z]: [f64; 3]) -> Self {
        Self { v: w.join([x, y, z, 0.0]), w }
    }

    /// Component by component.
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self { v: self.w.mul(self.v, other.v), w: self.w }
    }

    /// `(y, z, x)`.
    #[inline(always)]
    fn turn(self) -> Self {
        Self { v: self.w.turn(self.v), w: self.w }
    }

    /// `(z, x, y)`.
    #[inline(always)]
    fn turn_back(self) -> Self {
        Self { v: self.w.turn_back(self.v), w: self.w }
    }

    /// Component `I` of `other`, the others as they are.
    #[inline(always)]
    fn with_component<const I: usize>(self, other: Self) -> Self {
        Self { v: self.w.with_lane::<I>(self.v, other.v), w: self.w }
    }
}

impl<W: Width> Vector for Xyz<W> {
    type Number = f64;
    type Held = HeldVector;

    #[inline(always)]
    fn of(self, components: [f64; 3]) -> Self {
        Self::new(self.w, components)
    }

    #[inline(always)]
    fn components(self) -> [f64; 3] {
        let [x, y, z, _] = self.w.split(self.v);
        [x, y, z]
    }

    #[inline(always)]
    fn held(self) -> HeldVector {
        HeldVector(self.w.split(self.v))
    }

    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        self * factor
    }

    #[inline(always)]
    fn dot(self, other: Self) -> f64 {
        let [x, y, z, w] = self.w.split(self.times(other).v);
        (x + y) + (z + w)
    }

    #[inline(always)]
    fn cross(self, other: Self) -> Self {
        (self.times(other.turn()) - self.turn().times(other)).turn()
    }

    #[inline(always)]
    fn dots(pairs: [(Self, Self); 3]) -> Self {
        let w = pairs[0].0.w;
        Self { v: w.sums(three!(j => pairs[j].0.times(pairs[j].1).v)), w }
    }

    #[inline(always)]
    fn skew(self) -> [Self; 3] {
        let (after, before) = (self.turn(), self.turn_back());
        let signs = [[0.0, 1.0, -1.0], [-1.0, 0.0, 1.0], [1.0, -1.0, 0.0]];
        let [a, b, c] = three!(j => Self::new(self.w, signs[j]));
        [
            after.with_component::<2>(before).times(a), // (0, z, −y)
            before.with_component::<2>(after).times(b), // (−z, 0, x)
            after.with_component::<1>(before).times(c), // (y, −x, 0)
        ]
    }

    #[inline(always)]
    fn turn_about(self, s: f64, g: f64) -> [Self; 3] {
        let squares = self.times(self);
        let diagonal = (squares.turn() + squares.turn_back()) * -1.0; // −(y² + z²), …
        let (skew, [x, y, z]) = (self.skew(), self.components());
        [
            skew[0] * s + (self * x).with_component::<0>(diagonal) * g,
            skew[1] * s + (self * y).with_component::<1>(diagonal) * g,
            skew[2] * s + (self * z).with_component::<2>(diagonal) * g,
        ]
    }

    #[inline(always)]
    fn moment([x, y, z]: [Self; 3]) -> Self {
        let below = z.with_component::<1>(x).with_component::<2>(y); // M_xz, M_yx, M_zy
        let above = y.with_component::<1>(z).with_component::<2>(x); // M_xy, M_yz, M_zx
        below.turn_back() - above.turn()
    }

    #[inline(always)]
    fn if_small(self, factor: f64, sizes: [Self; 2]) -> Self {
        let v = self.w.if_small(self.v, factor, [sizes[0].v, sizes[1].v]);
        Self { v, w: self.w }
    }
}

impl<W: Width> Space for OneTree<W> {
    type Store = One;
    type Vector = Xyz<W>;
    type Check = bool;

    #[inline(always)]
    fn number(self, x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn vector(self, x: [f64; 3]) -> Xyz<W> {
        Xyz::new(self.0, x)
    }

    #[inline(always)]
    fn factor(self, x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn constant(self, x: &[f64; 3]) -> Xyz<W> {
        Xyz::new(self.0, *x)
    }

    #[inline(always)]
    fn take(self, held: &HeldVector) -> Xyz<W> {
        Xyz { v: self.0.join(held.0), w: self.0 }
    }

    #[inline(always)]
    fn read(self, x: &[f64], first: usize) -> Xyz<W> {
        Xyz::new(self.0, x[first..first + 3].try_into().expect("three numbers"))
    }

    #[inline(always)]
    fn read_frame(self, q: &[f64], first: usize) -> [Xyz<W>; 4] {
        let (w, frame) = (self.0, &q[first..first + 12]);
        let frame: &[f64; 12] = frame.try_into().expect("twelve coordinates");
        let [x1, y1, z1, x2, y2, z2, x3, y3, z3, x4, y4, z4] = *frame;
        let parts = [[x1, y1, z1, x2], [x2, y2, z2, x3], [x3, y3, z3, x4]];
        let [a, b, c] = three!(i => Xyz { v: w.first_three(w.join(parts[i])), w });
        [a, b, c, Xyz { v: w.last_three(w.join([z3, x4, y4, z4])), w }]
    }

    #[inline(always)]
    fn write_frame(self, [a, b, c, d]: [Xyz<W>; 4], q: &mut [f64], first: usize) {
        let (w, frame) = (self.0, &mut q[first..first + 12]);
        let frame: &mut [f64; 12] = frame.try_into().expect("twelve coordinates");
        frame[..4].copy_from_slice(&w.split(a.v)); // the excess is overwritten by the next one
        frame[3..7].copy_from_slice(&w.split(b.v));
        frame[6..10].copy_from_slice(&w.split(c.v));
        frame[9..].copy_from_slice(&d.components());
    }

    #[inline(always)]
    fn rotation(self, square: f64) -> [f64; 2] {
        rotation::coefficients(square)
    }

    #[inline(always)]
    fn kappa(self, square: f64) -> f64 {
        rotation::kappa(square)
    }

    #[inline(always)]
    fn within(self, v: Xyz<W>, bound: f64) -> bool {
        self.0.within(v.v, bound)
    }

    #[inline(always)]
    fn both(self, a: bool, b: bool) -> bool {
        a & b
    }

    #[inline(always)]
    fn failing(self, check: bool) -> u8 {
        u8::from(!check)
    }
}
impl<W: Width> Add for Xyz<W> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { v: self.w.add(self.v, other.v), w: self.w }
    }
}

impl<W: Width> Sub for Xyz<W> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { v: self.w.sub(self.v, other.v), w: self.w }
    }
}

impl<W: Width> Mul<f64> for Xyz<W> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self { v: self.w.mul(self.v, self.w.splat(factor)), w: self.w }
    }
}

impl<W: Width> Div<f64> for Xyz<W> {
    type Output = Self;

    #[inline(always)]
    fn div(self, divisor: f64) -> Self {
        Self { v: self.w.div(self.v, self.w.splat(divisor)), w: self.w }
    }
}
