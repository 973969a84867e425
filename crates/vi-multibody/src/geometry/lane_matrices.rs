//! Matrices, twists and wrenches of [`Lanes`]: the algebra of sweeps over bodies.

use crate::geometry::lanes::{Held, Lanes, Width, three};

/// A 3×3 matrix by its columns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Columns<L>(pub(crate) [L; 3]);

impl Columns<Held> {
    #[inline(always)]
    pub(crate) fn take<W: Width>(&self, w: W) -> Columns<Lanes<W>> {
        Columns(three!(j => Lanes::take(w, &self.0[j])))
    }
}

impl<W: Width> Columns<Lanes<W>> {
    #[inline(always)]
    pub(crate) fn held(self) -> Columns<Held> {
        Columns(three!(j => self.0[j].held()))
    }

    #[inline(always)]
    pub(crate) fn zero(w: W) -> Self {
        Self([Lanes::zero(w); 3])
    }

    /// `x I`.
    #[inline(always)]
    pub(crate) fn multiple(w: W, x: f64) -> Self {
        Self([
            Lanes::new(w, [x, 0.0, 0.0]),
            Lanes::new(w, [0.0, x, 0.0]),
            Lanes::new(w, [0.0, 0.0, x]),
        ])
    }

    /// `v̂`, with `v̂ b = v × b`.
    #[inline(always)]
    pub(crate) fn skew(v: Lanes<W>) -> Self {
        let (w, after, before) = (v.width(), v.turn(), v.turn_back());
        let signs = [[0.0, 1.0, -1.0], [-1.0, 0.0, 1.0], [1.0, -1.0, 0.0]];
        let [a, b, c] = three!(j => Lanes::new(w, signs[j]));
        Self([
            after.with_component::<2>(before).times(a), // (0, z, −y)
            before.with_component::<2>(after).times(b), // (−z, 0, x)
            after.with_component::<1>(before).times(c), // (y, −x, 0)
        ])
    }

    /// `s n̂ + g n̂²`, without cancellation on the diagonal.
    #[inline(always)]
    pub(crate) fn turn_about(n: Lanes<W>, s: f64, g: f64) -> Self {
        let squares = n.times(n);
        let diagonal = (squares.turn() + squares.turn_back()) * -1.0; // −(y² + z²), …
        let (skew, [x, y, z]) = (Self::skew(n).0, n.xyz());
        Self([
            skew[0] * s + (n * x).with_component::<0>(diagonal) * g,
            skew[1] * s + (n * y).with_component::<1>(diagonal) * g,
            skew[2] * s + (n * z).with_component::<2>(diagonal) * g,
        ])
    }

    /// `M v`.
    #[inline(always)]
    pub(crate) fn mul(&self, v: Lanes<W>) -> Lanes<W> {
        let [x, y, z] = v.xyz();
        (self.0[0] * x + self.0[1] * y) + self.0[2] * z
    }

    /// `Mᵀ v`.
    #[inline(always)]
    pub(crate) fn tr_mul(&self, v: Lanes<W>) -> Lanes<W> {
        Lanes::dots(three!(j => (self.0[j], v)))
    }

    /// `M B`.
    #[inline(always)]
    pub(crate) fn times(&self, other: &Self) -> Self {
        Self(three!(j => self.mul(other.0[j])))
    }

    /// `M Bᵀ`.
    #[inline(always)]
    pub(crate) fn times_transposed(&self, other: &Self) -> Self {
        let [a, b, c] = three!(j => other.0[j].xyz());
        let [x, y, z] = self.0;
        Self(three!(j => (x * a[j] + y * b[j]) + z * c[j]))
    }

    #[inline(always)]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self(three!(j => self.0[j] + other.0[j]))
    }

    #[inline(always)]
    pub(crate) fn minus(&self, other: &Self) -> Self {
        Self(three!(j => self.0[j] - other.0[j]))
    }

    /// `M − x yᵀ`.
    #[inline(always)]
    fn minus_outer(&self, x: Lanes<W>, y: [f64; 3]) -> Self {
        Self(three!(j => self.0[j] - x * y[j]))
    }

    /// `(M_zy − M_yz, M_xz − M_zx, M_yx − M_xy)`: of `Σ b aᵀ` it is `Σ a × b`.
    #[inline(always)]
    pub(crate) fn moment(&self) -> Lanes<W> {
        let [x, y, z] = self.0;
        let below = z.with_component::<1>(x).with_component::<2>(y); // M_xz, M_yx, M_zy
        let above = y.with_component::<1>(z).with_component::<2>(x); // M_xy, M_yz, M_zx
        below.turn_back() - above.turn()
    }

    /// `tr(M) I − M`.
    #[inline(always)]
    pub(crate) fn trace_less(&self) -> Self {
        let [xx, yy, zz] = three!(i => self.0[i].xyz()[i]);
        Self::multiple(self.0[0].width(), (xx + yy) + zz).minus(self)
    }

    /// `M v̂`.
    #[inline(always)]
    pub(crate) fn times_skew(&self, v: Lanes<W>) -> Self {
        let ([x, y, z], [a, b, c]) = (v.xyz(), self.0);
        Self([b * z - c * y, c * x - a * z, a * y - b * x])
    }

    /// `v̂ M`.
    #[inline(always)]
    pub(crate) fn skew_times(v: Lanes<W>, m: &Self) -> Self {
        Self(three!(j => v.cross(m.0[j])))
    }
}

/// A twist `(v, ω)`, or a wrench `(f, τ)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pair<L> {
    pub(crate) linear: L,
    pub(crate) angular: L,
}

impl Pair<Held> {
    #[inline(always)]
    pub(crate) fn take<W: Width>(&self, w: W) -> Pair<Lanes<W>> {
        let (linear, angular) = (Lanes::take(w, &self.linear), Lanes::take(w, &self.angular));
        Pair { linear, angular }
    }
}

impl<W: Width> Pair<Lanes<W>> {
    #[inline(always)]
    pub(crate) fn held(self) -> Pair<Held> {
        Pair { linear: self.linear.held(), angular: self.angular.held() }
    }

    #[inline(always)]
    pub(crate) fn zero(w: W) -> Self {
        Self { linear: Lanes::zero(w), angular: Lanes::zero(w) }
    }

    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        Self { linear: self.linear + other.linear, angular: self.angular + other.angular }
    }

    #[inline(always)]
    pub(crate) fn plus_scaled(self, factor: f64, other: Self) -> Self {
        let (linear, angular) = (other.linear * factor, other.angular * factor);
        self.plus(Self { linear, angular })
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> f64 {
        self.linear.dot(other.linear) + self.angular.dot(other.angular)
    }

    /// The twist at the end of a lever `a` fixed in the body: `(v + ω × a, ω)`.
    #[inline(always)]
    pub(crate) fn at_end_of(self, a: Lanes<W>) -> Self {
        Self { linear: self.linear + self.angular.cross(a), ..self }
    }

    /// The wrench at the start of a lever `a`: `(f, τ + a × f)`.
    #[inline(always)]
    pub(crate) fn at_start_of(self, a: Lanes<W>) -> Self {
        Self { angular: self.angular + a.cross(self.linear), ..self }
    }
}

/// A 6×6 matrix on twists `(v, ω)`, by 3×3 blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Spatial<L> {
    pub(crate) ll: Columns<L>,
    pub(crate) la: Columns<L>,
    pub(crate) al: Columns<L>,
    pub(crate) aa: Columns<L>,
}

impl Spatial<Held> {
    #[inline(always)]
    pub(crate) fn take<W: Width>(&self, w: W) -> Spatial<Lanes<W>> {
        let Self { ll, la, al, aa } = self;
        Spatial { ll: ll.take(w), la: la.take(w), al: al.take(w), aa: aa.take(w) }
    }
}

impl<W: Width> Spatial<Lanes<W>> {
    #[inline(always)]
    pub(crate) fn held(self) -> Spatial<Held> {
        let Self { ll, la, al, aa } = self;
        Spatial { ll: ll.held(), la: la.held(), al: al.held(), aa: aa.held() }
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

    /// `self − x (factor y)ᵀ`.
    #[inline(always)]
    pub(crate) fn minus_outer(&self, x: Pair<Lanes<W>>, factor: f64, y: Pair<Lanes<W>>) -> Self {
        let (linear, angular) = ((y.linear * factor).xyz(), (y.angular * factor).xyz());
        Self {
            ll: self.ll.minus_outer(x.linear, linear),
            la: self.la.minus_outer(x.linear, angular),
            al: self.al.minus_outer(x.angular, linear),
            aa: self.aa.minus_outer(x.angular, angular),
        }
    }

    /// `Xᵀ A X'` with the levers `a` of `X = [I −â; 0 I]` and `b` of `X'`.
    #[inline(always)]
    pub(crate) fn between(&self, a: Lanes<W>, b: Lanes<W>) -> Self {
        let (ll, la) = (self.ll, self.la.minus(&self.ll.times_skew(b)));
        let al = self.al.plus(&Columns::skew_times(a, &ll));
        let aa = self.aa.minus(&self.al.times_skew(b)).plus(&Columns::skew_times(a, &la));
        Self { ll, la, al, aa }
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
#[allow(non_snake_case)] // A
mod tests {
    use super::*;
    use crate::geometry::lanes::{Narrow, sweep};
    use vi_testkit::Sample;

    sweep! {
        /// What the operations make of eight vectors.
        all = sweep_all(x: &'a [f64]) -> Vec<[f64; 3]>
    }

    #[inline(always)]
    fn sweep_all<W: Width>(w: W, x: &[f64]) -> Vec<[f64; 3]> {
        let v = |i: usize| Lanes::of(w, &x[3 * i..]);
        let m = |i: usize| Columns([v(i), v(i + 1), v(i + 2)]);
        let (a, b) = (v(0), v(7));
        let A = Spatial { ll: m(0), la: m(1), al: m(2), aa: m(3) };
        let t = Pair { linear: a, angular: b };
        let moved = A.minus_outer(t, 0.7, t.at_end_of(b)).between(a, b);
        let turned = Columns::turn_about(a, 0.3, 0.1).times_transposed(&m(4));
        let mut out = vec![a.cross(b).xyz(), (a / 0.7).xyz(), [a.dot(b), t.dot(t), 0.0]];
        out.push(a.if_small(0.5, [b, v(3)]).xyz());
        let (mut frame, of) = ([0.0; 12], Lanes::vectors(w, x[1..13].try_into().expect("twelve")));
        Lanes::write_vectors([of[0] + a, of[1], of[2], of[3]], &mut frame);
        out.extend(frame.chunks_exact(3).map(|v| [v[0], v[1], v[2]]));
        for columns in [moved.ll, moved.la, moved.al, moved.aa, turned, turned.trace_less()] {
            out.extend(columns.0.map(Lanes::xyz));
            out.extend([columns.tr_mul(b).xyz(), columns.mul(b).xyz(), columns.moment().xyz()]);
        }
        out
    }

    #[test]
    fn equal_bits_at_every_width() {
        let mut sample = Sample::new(77);
        for _ in 0..100 {
            let x: [f64; 24] = sample.array();
            let bits = |out: Vec<[f64; 3]>| out.into_iter().flatten().map(f64::to_bits).collect();
            let (chosen, narrow): (Vec<u64>, Vec<u64>) =
                (bits(all(&x)), bits(sweep_all(Narrow, &x)));
            assert_eq!(chosen, narrow);
        }
    }
}
