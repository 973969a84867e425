//! Matrices, twists and wrenches: the algebra of sweeps over bodies, in every [`Space`].

use crate::geometry::one_tree::three;
use crate::geometry::space::{Space, Store, Vector};
use vi_core::lanes::Lanes;

/// A 3×3 matrix by its columns.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Columns<V>(pub(crate) [V; 3]);

impl<H> Columns<H> {
    /// From memory.
    #[inline(always)]
    pub(crate) fn take<S: Space>(&self, s: S) -> Columns<S::Vector>
    where
        S::Store: Store<Held = H>,
    {
        Columns(three!(j => s.take(&self.0[j])))
    }
}

impl<V: Vector> Columns<V> {
    /// In memory.
    #[inline(always)]
    pub(crate) fn held(self) -> Columns<V::Held> {
        Columns(three!(j => self.0[j].held()))
    }

    #[inline(always)]
    pub(crate) fn zero(s: impl Space<Vector = V>) -> Self {
        Self([s.zero(); 3])
    }

    /// `I`.
    #[inline(always)]
    pub(crate) fn identity(s: impl Space<Vector = V>) -> Self {
        let zero = s.zero();
        Self::diagonal(zero, zero.components()[0].like(1.0))
    }

    /// `x I`.
    #[inline(always)]
    pub(crate) fn multiple(s: impl Space<Vector = V>, x: V::Number) -> Self {
        Self::diagonal(s.zero(), x)
    }

    /// `x I`, by another vector.
    #[inline(always)]
    fn diagonal(v: V, x: V::Number) -> Self {
        let zero = x.like(0.0);
        Self([v.of([x, zero, zero]), v.of([zero, x, zero]), v.of([zero, zero, x])])
    }

    /// `v̂`, with `v̂ b = v × b`.
    #[inline(always)]
    pub(crate) fn skew(v: V) -> Self {
        Self(v.skew())
    }

    /// `s n̂ + g n̂²`, without cancellation on the diagonal.
    #[inline(always)]
    pub(crate) fn turn_about(n: V, s: V::Number, g: V::Number) -> Self {
        Self(n.turn_about(s, g))
    }

    /// `M v`.
    #[inline(always)]
    pub(crate) fn mul(&self, v: V) -> V {
        let [x, y, z] = v.components();
        (self.0[0].scaled(x) + self.0[1].scaled(y)) + self.0[2].scaled(z)
    }

    /// `Mᵀ v`.
    #[inline(always)]
    pub(crate) fn tr_mul(&self, v: V) -> V {
        V::dots(three!(j => (self.0[j], v)))
    }

    /// `M B`.
    #[inline(always)]
    pub(crate) fn times(&self, other: &Self) -> Self {
        Self(three!(j => self.mul(other.0[j])))
    }

    /// `M Bᵀ`.
    #[inline(always)]
    pub(crate) fn times_transposed(&self, other: &Self) -> Self {
        let [a, b, c] = three!(j => other.0[j].components());
        let [x, y, z] = self.0;
        Self(three!(j => (x.scaled(a[j]) + y.scaled(b[j])) + z.scaled(c[j])))
    }

    #[inline(always)]
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self(three!(j => self.0[j] + other.0[j]))
    }

    #[inline(always)]
    pub(crate) fn minus(&self, other: &Self) -> Self {
        Self(three!(j => self.0[j] - other.0[j]))
    }

    /// `x M`.
    #[inline(always)]
    pub(crate) fn scaled(&self, x: V::Number) -> Self {
        Self(three!(j => self.0[j].scaled(x)))
    }

    /// `M − x yᵀ`.
    #[inline(always)]
    fn minus_outer(&self, x: V, y: [V::Number; 3]) -> Self {
        Self(three!(j => self.0[j] - x.scaled(y[j])))
    }

    /// `(M_zy − M_yz, M_xz − M_zx, M_yx − M_xy)`: of `Σ b aᵀ` it is `Σ a × b`.
    #[inline(always)]
    pub(crate) fn moment(&self) -> V {
        V::moment(self.0)
    }

    /// `tr(M) I − M`.
    #[inline(always)]
    pub(crate) fn trace_less(&self) -> Self {
        let [xx, yy, zz] = three!(i => self.0[i].components()[i]);
        Self::diagonal(self.0[0], (xx + yy) + zz).minus(self)
    }

    /// `M v̂`.
    #[inline(always)]
    pub(crate) fn times_skew(&self, v: V) -> Self {
        let ([x, y, z], [a, b, c]) = (v.components(), self.0);
        Self([b.scaled(z) - c.scaled(y), c.scaled(x) - a.scaled(z), a.scaled(y) - b.scaled(x)])
    }

    /// `v̂ M`.
    #[inline(always)]
    pub(crate) fn skew_times(v: V, m: &Self) -> Self {
        Self(three!(j => v.cross(m.0[j])))
    }

    /// By rows.
    #[inline(always)]
    pub(crate) fn rows(&self) -> [[V::Number; 3]; 3] {
        let [a, b, c] = three!(j => self.0[j].components());
        three!(i => [a[i], b[i], c[i]])
    }
}

/// A twist `(v, ω)`, or a wrench `(f, τ)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Screw<V> {
    pub(crate) linear: V,
    pub(crate) angular: V,
}

impl<H> Screw<H> {
    /// From memory.
    #[inline(always)]
    pub(crate) fn take<S: Space>(&self, s: S) -> Screw<S::Vector>
    where
        S::Store: Store<Held = H>,
    {
        Screw { linear: s.take(&self.linear), angular: s.take(&self.angular) }
    }
}

impl<V: Vector> Screw<V> {
    /// In memory.
    #[inline(always)]
    pub(crate) fn held(self) -> Screw<V::Held> {
        Screw { linear: self.linear.held(), angular: self.angular.held() }
    }

    #[inline(always)]
    pub(crate) fn zero(s: impl Space<Vector = V>) -> Self {
        Self { linear: s.zero(), angular: s.zero() }
    }

    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        Self { linear: self.linear + other.linear, angular: self.angular + other.angular }
    }

    #[inline(always)]
    pub(crate) fn times(self, factor: V::Number) -> Self {
        Self { linear: self.linear.scaled(factor), angular: self.angular.scaled(factor) }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> V::Number {
        self.linear.dot(other.linear) + self.angular.dot(other.angular)
    }

    /// The twist at the end of a lever `a` fixed in the body: `(v + ω × a, ω)`.
    #[inline(always)]
    pub(crate) fn at_end_of(self, a: V) -> Self {
        Self { linear: self.linear + self.angular.cross(a), ..self }
    }

    /// The wrench at the start of a lever `a`: `(f, τ + a × f)`.
    #[inline(always)]
    pub(crate) fn at_start_of(self, a: V) -> Self {
        Self { angular: self.angular + a.cross(self.linear), ..self }
    }
}

/// A 6×6 matrix on twists `(v, ω)`, by 3×3 blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Spatial<V> {
    pub(crate) ll: Columns<V>,
    pub(crate) la: Columns<V>,
    pub(crate) al: Columns<V>,
    pub(crate) aa: Columns<V>,
}

impl<H> Spatial<H> {
    /// From memory.
    #[inline(always)]
    pub(crate) fn take<S: Space>(&self, s: S) -> Spatial<S::Vector>
    where
        S::Store: Store<Held = H>,
    {
        let Self { ll, la, al, aa } = self;
        Spatial { ll: ll.take(s), la: la.take(s), al: al.take(s), aa: aa.take(s) }
    }
}

impl<V: Vector> Spatial<V> {
    /// In memory.
    #[inline(always)]
    pub(crate) fn held(self) -> Spatial<V::Held> {
        let Self { ll, la, al, aa } = self;
        Spatial { ll: ll.held(), la: la.held(), al: al.held(), aa: aa.held() }
    }

    #[inline(always)]
    pub(crate) fn zero(s: impl Space<Vector = V>) -> Self {
        let zero = Columns::zero(s);
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

    /// `self − x (factor y)ᵀ`.
    #[inline(always)]
    pub(crate) fn minus_outer(&self, x: Screw<V>, factor: V::Number, y: Screw<V>) -> Self {
        let y = y.times(factor);
        let (linear, angular) = (y.linear.components(), y.angular.components());
        Self {
            ll: self.ll.minus_outer(x.linear, linear),
            la: self.la.minus_outer(x.linear, angular),
            al: self.al.minus_outer(x.angular, linear),
            aa: self.aa.minus_outer(x.angular, angular),
        }
    }

    /// `Xᵀ A X'` with the levers `a` of `X = [I −â; 0 I]` and `b` of `X'`.
    #[inline(always)]
    pub(crate) fn between(&self, a: V, b: V) -> Self {
        let (ll, la) = (self.ll, self.la.minus(&self.ll.times_skew(b)));
        let al = self.al.plus(&Columns::skew_times(a, &ll));
        let aa = self.aa.minus(&self.al.times_skew(b)).plus(&Columns::skew_times(a, &la));
        Self { ll, la, al, aa }
    }
}

#[cfg(test)]
#[allow(non_snake_case)] // A
mod tests {
    use super::*;
    use crate::geometry::one_tree::{Narrow, OneTree, sweep};
    use crate::geometry::space::Number;
    use vi_core::lanes::{Plain, Register, Twice};
    use vi_testkit::Sample;

    sweep! {
        /// In the registers of this processor.
        wide = all(x: &'a [f64]) -> Vec<f64>
    }

    /// What the operations make of eight vectors.
    #[inline(always)]
    fn all<S: Space>(s: S, x: &[Number<S>]) -> Vec<Number<S>> {
        let v = |i: usize| s.read(x, 3 * i);
        let m = |i: usize| Columns([v(i), v(i + 1), v(i + 2)]);
        let (a, b) = (v(0), v(7));
        let A = Spatial { ll: m(0), la: m(1), al: m(2), aa: m(3) };
        let t = Screw { linear: a, angular: b };
        let moved = A.minus_outer(t, s.number(0.7), t.at_end_of(b)).between(a, b);
        let turned = Columns::turn_about(a, s.number(0.3), s.number(0.1)).times_transposed(&m(4));
        let mut out = vec![a.dot(b), t.dot(t)];
        out.extend([a.cross(b), a / 0.7, a.if_small(0.5, [b, v(3)])].map(V3::components).concat());
        let (mut frame, of) = ([s.number(0.0); 12], s.read_frame(x, 1));
        s.write_frame([of[0] + a, of[1], of[2], of[3]], &mut frame, 0);
        out.extend(frame);
        for columns in [moved.ll, moved.la, moved.al, moved.aa, turned, turned.trace_less()] {
            out.extend(columns.0.map(V3::components).concat());
            let more = [columns.tr_mul(b), columns.mul(b), columns.moment()];
            out.extend(more.map(V3::components).concat());
        }
        let square = a.dot(a);
        out.extend(s.rotation(square));
        out.extend([s.kappa(square), s.kappa(square * 1e-6)]);
        out
    }
    use crate::geometry::space::Vector as V3;

    fn compare<T: Register>(lanes: T) {
        let (mut sample, count) = (Sample::new(77), <T::Lanes as Lanes>::COUNT);
        for round in 0..200 {
            let size = if round % 2 == 0 { 1.0 } else { 0.1 };
            let members: Vec<[f64; 24]> =
                (0..count).map(|_| sample.array().map(|x: f64| x * size)).collect();
            let x: Vec<T::Lanes> = (0..24).map(|i| lanes.gather(|k| members[k][i])).collect();
            let all_members = lanes.run(|| all(lanes, &x));
            for (k, x) in members.iter().enumerate() {
                let (chosen, narrow) = (wide(x), all(OneTree(Narrow), x));
                for ((chosen, narrow), member) in chosen.iter().zip(&narrow).zip(&all_members) {
                    assert_eq!(chosen.to_bits(), narrow.to_bits());
                    assert_eq!(member.at(k).to_bits(), narrow.to_bits());
                }
            }
        }
    }

    #[test]
    fn equal_bits_in_every_space() {
        compare(Plain);
        compare(Twice(Plain));
        #[cfg(target_arch = "x86_64")]
        if let Some(lanes) = vi_core::lanes::Wide::detect() {
            compare(lanes);
            compare(Twice(lanes));
        }
    }
}
