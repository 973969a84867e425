//! Linear vector forms and the quadratic constraint rows built from them.
//!
//! A point or a vector that is fixed in a body is a linear function of the body's coordinates,
//! `x = φ + Σ ϱ_I d_I` or `n = Σ n_I d_I`; on the ground it is constant. Every constraint of the
//! kinematic pairs is a product of two such forms:
//! ```text
//! g      = s (A(q)·B(q) − c)
//! G δq   = s (B·A(δq) + A·B(δq))            A(δq): the homogeneous part
//! D²g[v, w] = s (A(v)·B(w) + A(w)·B(v))      constant in q
//! ```
//! so `g(q_{n+1}) − g(q_n) = G(q_{n+1/2}) Δq` holds exactly, and the second derivative costs
//! nothing. With dual numbers as coefficients each of these has its derivative by a parameter
//! beside it ([`Form::with_tangent`]).

use crate::geometry::twist::Twist;
use nalgebra::{Matrix3, Vector3};
use vi_core::Number;
use vi_core::num_dual::Dual64;
use vi_core::sparse::Entries;

/// `Σ_k c_k x_k + c_0` with vectors `x_k` of two or three coordinates stored from given offsets on.
#[derive(Clone, Debug, PartialEq)]
pub struct Form<T = f64> {
    constant: Vector3<T>,
    terms: Vec<Term<T>>,
    points: f64, // how far it moves where all bodies and point masses move by 1
}

/// `coefficient · q[offset .. offset + dimension]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term<T = f64> {
    /// First coordinate of the vector.
    pub offset: usize,
    /// Number of its coordinates, 2 or 3.
    pub dimension: usize,
    /// Factor.
    pub coefficient: T,
}

impl<T> Term<T> {
    /// The vector among the coordinates `q`.
    #[inline]
    pub(crate) fn of(&self, q: &[f64]) -> Vector3<f64> {
        match q[self.offset..self.offset + self.dimension] {
            [x, y, z] => Vector3::new(x, y, z),
            [x, y] => Vector3::new(x, y, 0.0),
            _ => Vector3::zeros(),
        }
    }
}

impl<T: Number> Form<T> {
    /// A constant vector.
    #[must_use]
    pub fn constant(value: Vector3<T>) -> Self {
        Self { constant: value, terms: Vec::new(), points: 0.0 }
    }

    /// A point mass: the vector at `offset`.
    #[must_use]
    pub fn particle(offset: usize, dimension: usize) -> Self {
        let term = Term { offset, dimension, coefficient: T::of(1.0) };
        Self { constant: Vector3::zeros(), terms: vec![term], points: 1.0 }
    }

    /// The vector with components `c` in the directors of the frame at `offset`.
    #[must_use]
    pub fn vector(offset: usize, c: &Vector3<T>) -> Self {
        let term = |i: usize| Term { offset: offset + 3 + 3 * i, dimension: 3, coefficient: c[i] };
        let terms = (0..3).filter(|&i| !c[i].vanishes()).map(term).collect();
        Self { constant: Vector3::zeros(), terms, points: 0.0 }
    }

    /// The point at `φ + Σ c_I d_I` of the frame at `offset`.
    #[must_use]
    pub fn point(offset: usize, c: &Vector3<T>) -> Self {
        let mut form = Self::vector(offset, c);
        form.terms.insert(0, Term { offset, dimension: 3, coefficient: T::of(1.0) });
        form.points = 1.0;
        form
    }

    /// `self − other`.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Self {
        self.plus_multiple(-1.0, other)
    }

    /// `self + other`.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        self.plus_multiple(1.0, other)
    }

    fn plus_multiple(&self, by: f64, other: &Self) -> Self {
        let mut terms = self.terms.clone();
        let factor = T::of(by);
        terms
            .extend(other.terms.iter().map(|t| Term { coefficient: factor * t.coefficient, ..*t }));
        let points = self.points + by * other.points;
        Self { constant: self.constant + other.constant * factor, terms, points }
    }

    /// Whether a translation of all bodies and point masses changes it: a point, or the distance of
    /// one from the ground.
    #[must_use]
    pub fn is_seen_from_ground(&self) -> bool {
        self.points != 0.0
    }

    /// `c_0`.
    #[must_use]
    pub fn constant_part(&self) -> Vector3<T> {
        self.constant
    }

    /// Its terms.
    #[must_use]
    pub fn terms(&self) -> &[Term<T>] {
        &self.terms
    }

    /// The value at `q`.
    #[must_use]
    pub fn at(&self, q: &[f64]) -> Vector3<T> {
        self.constant + self.rate(q)
    }

    /// The homogeneous part at `v`: the rate of the form along the velocity `v`.
    #[must_use]
    pub fn rate(&self, v: &[f64]) -> Vector3<T> {
        let mut sum = Vector3::zeros();
        for term in &self.terms {
            sum += term.of(v).map(T::of) * term.coefficient;
        }
        sum
    }

    /// The entries of `∂(f·form)/∂q`: coordinate and slope, always in the same order.
    #[inline]
    pub fn for_each_slope(&self, f: &Vector3<T>, mut visit: impl FnMut(usize, T)) {
        for term in self.terms() {
            for i in 0..term.dimension {
                visit(term.offset + i, term.coefficient * f[i]);
            }
        }
    }
}

impl Form<Dual64> {
    /// The form without its derivative.
    fn values(&self) -> Form {
        let term = |t: &Term<Dual64>| Term {
            offset: t.offset,
            dimension: t.dimension,
            coefficient: t.coefficient.re,
        };
        let terms = self.terms.iter().map(term).collect();
        Form { constant: self.constant.map(|c| c.re), terms, points: self.points }
    }
}

impl Form {
    /// The form with its derivative by a parameter: coefficients and constant of `tangent`.
    #[must_use]
    pub fn with_tangent(&self, tangent: &Self) -> Form<Dual64> {
        let pair = |[value, slope]: [f64; 2]| Dual64::new(value, slope);
        let own = self.terms.iter().map(|t| (t, [t.coefficient, 0.0]));
        let moved = tangent.terms.iter().map(|t| (t, [0.0, t.coefficient]));
        let term = |(t, c): (&Term, _)| Term {
            offset: t.offset,
            dimension: t.dimension,
            coefficient: pair(c),
        };
        Form {
            constant: self.constant.zip_map(&tangent.constant, Dual64::new),
            terms: own.chain(moved).map(term).collect(),
            points: self.points,
        }
    }

    /// `out ← out + (∂form/∂q)ᵀ f`.
    pub fn add_transposed(&self, f: &Vector3<f64>, out: &mut [f64]) {
        for term in &self.terms {
            for i in 0..term.dimension {
                out[term.offset + i] += term.coefficient * f[i];
            }
        }
    }

    /// `out ← out + scale D²l v` of its length `l = |form|`, `D²l[v, w] = v_⊥·w_⊥/l` of their
    /// parts across it.
    pub fn add_length_bend(&self, q: &[f64], v: &[f64], scale: f64, out: &mut [f64]) {
        let (own, v) = (self.at(q), self.rate(v));
        let length = own.norm();
        let along = own / length;
        self.add_transposed(&(scale / length * (v - along.dot(&v) * along)), out);
    }

    /// `out ← out + scale D³l[v, w]`.
    pub fn add_length_third(&self, q: &[f64], [v, w]: [&[f64]; 2], scale: f64, out: &mut [f64]) {
        self.add_transposed(&(scale * self.length_third(q, v) * self.rate(w)), out);
    }

    /// `D³l[v]` by the vector itself: with its direction `e`, `x_⊥` across it,
    /// `D³l[v] = −[(e·v)(I − e eᵀ) + v_⊥ eᵀ + e v_⊥ᵀ]/l²`.
    pub(crate) fn length_third(&self, q: &[f64], v: &[f64]) -> Matrix3<f64> {
        let (own, v) = (self.at(q), self.rate(v));
        let length = own.norm();
        let e = own / length;
        let along = e.dot(&v);
        let across = v - along * e;
        let third = along * (Matrix3::identity() - e * e.transpose())
            + across * e.transpose()
            + e * across.transpose();
        -third / (length * length)
    }

    /// A force on it as wrenches on the frames it touches (coordinates in twelves): force at `φ`
    /// and torque, term by term.
    #[inline]
    pub fn for_each_wrench(
        &self,
        q: &[f64],
        f: &Vector3<f64>,
        mut visit: impl FnMut(usize, Twist),
    ) {
        for term in &self.terms {
            let f = term.coefficient * f;
            let (frame, local) = (term.offset / 12, term.offset % 12);
            if local == 0 {
                visit(frame, Twist::new(f, Vector3::zeros()));
            } else {
                let d = Vector3::from_column_slice(&q[term.offset..term.offset + 3]);
                visit(frame, Twist::new(Vector3::zeros(), d.cross(&f)));
            }
        }
    }

    /// Emits `(∂form/∂q)ᵀ W (∂form/∂q)` for a 3×3 matrix `W`.
    pub fn emit_congruence(&self, w: &nalgebra::Matrix3<f64>, out: &mut dyn Entries) {
        for a in &self.terms {
            for b in &self.terms {
                let factor = a.coefficient * b.coefficient;
                if a.dimension == 3 && b.dimension == 3 {
                    out.add_block(a.offset, b.offset, &(factor * w));
                    continue;
                }
                for i in 0..a.dimension {
                    for j in 0..b.dimension {
                        out.add(a.offset + i, b.offset + j, factor * w[(i, j)]);
                    }
                }
            }
        }
    }
}

/// A constraint `s (A·B − c) = 0`.
#[derive(Clone, Debug, PartialEq)]
pub struct BilinearRow<T = f64> {
    /// `s`.
    pub scale: f64,
    /// `A`.
    pub a: Form<T>,
    /// `B`.
    pub b: Form<T>,
    /// `c`.
    pub target: T,
}

impl<T: Number> BilinearRow<T> {
    /// `D²g[v, w]`.
    #[must_use]
    pub fn second(&self, v: &[f64], w: &[f64]) -> T {
        let crossed = self.a.rate(v).dot(&self.b.rate(w)) + self.a.rate(w).dot(&self.b.rate(v));
        crossed * T::of(self.scale)
    }

    /// `A·B − c = 0`.
    #[must_use]
    pub fn product(a: Form<T>, b: Form<T>, target: T) -> Self {
        Self { scale: 1.0, a, b, target }
    }

    /// The three rows `B = 0`.
    #[must_use]
    pub fn vanishing(b: &Form<T>) -> Vec<Self> {
        let unit = |i: usize| Form::constant(Vector3::ith(i, T::of(1.0)));
        (0..3).map(|i| Self::product(unit(i), b.clone(), T::of(0.0))).collect()
    }

    /// `½ (|B|² − l²) = 0`.
    #[must_use]
    pub fn distance(b: &Form<T>, length: T) -> Self {
        Self { scale: 0.5, a: b.clone(), b: b.clone(), target: length * length }
    }

    /// `g(q)`.
    #[must_use]
    pub fn value(&self, q: &[f64]) -> T {
        T::of(self.scale) * (self.a.at(q).dot(&self.b.at(q)) - self.target)
    }

    /// The entries of the row of `G(q)`: coordinate and slope, always in the same order.
    pub fn for_each_slope(&self, q: &[f64], mut visit: impl FnMut(usize, T)) {
        let scale = T::of(self.scale);
        let (a, b) = (self.a.at(q) * scale, self.b.at(q) * scale);
        for (form, f) in [(&self.a, b), (&self.b, a)] {
            form.for_each_slope(&f, &mut visit);
        }
    }
}

impl BilinearRow<Dual64> {
    /// The row without its derivative.
    pub(crate) fn values(&self) -> BilinearRow {
        let Self { scale, a, b, target } = self;
        BilinearRow { scale: *scale, a: a.values(), b: b.values(), target: target.re }
    }
}

impl BilinearRow {
    /// `G(q) v`.
    #[must_use]
    pub fn rate(&self, q: &[f64], v: &[f64]) -> f64 {
        self.value_and_rate(q, v)[1]
    }

    /// `g(q)` and `G(q) v`.
    #[must_use]
    pub fn value_and_rate(&self, q: &[f64], v: &[f64]) -> [f64; 2] {
        let (a, b) = (self.a.at(q), self.b.at(q));
        let rate = a.dot(&self.b.rate(v)) + self.a.rate(v).dot(&b);
        [self.scale * (a.dot(&b) - self.target), self.scale * rate]
    }

    /// Emits the row `row` of `G(q)`.
    pub fn emit(&self, q: &[f64], row: usize, out: &mut dyn Entries) {
        self.for_each_slope(q, |column, slope| out.add(row, column, slope));
    }

    /// The row of `G` as wrenches on the frames it touches (coordinates in twelves): force at `φ`
    /// and torque, `P_inᵀ` of the gradient, term by term.
    pub fn for_each_wrench(&self, q: &[f64], mut visit: impl FnMut(usize, Twist)) {
        for (form, other) in [(&self.a, &self.b), (&self.b, &self.a)] {
            if form.terms().is_empty() {
                continue; // constant: nothing moves with it
            }
            form.for_each_wrench(q, &(self.scale * other.at(q)), &mut visit);
        }
    }

    /// The entries of `D²g[v, ·]`: coordinate and value, always in the same order.
    pub fn for_each_bend(&self, v: &[f64], mut visit: impl FnMut(usize, f64)) {
        let (a, b) = (self.scale * self.a.rate(v), self.scale * self.b.rate(v));
        for (form, f) in [(&self.a, b), (&self.b, a)] {
            for term in form.terms() {
                for i in 0..term.dimension {
                    visit(term.offset + i, term.coefficient * f[i]);
                }
            }
        }
    }

    /// Emits `weight D²g`.
    pub fn emit_second(&self, weight: f64, out: &mut dyn Entries) {
        for a in &self.a.terms {
            for b in &self.b.terms {
                let value = weight * self.scale * a.coefficient * b.coefficient;
                for i in 0..a.dimension.min(b.dimension) {
                    out.add(a.offset + i, b.offset + i, value);
                    out.add(b.offset + i, a.offset + i, value);
                }
            }
        }
    }
}
