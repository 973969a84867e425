//! The constant strain of the helix between two nodes.
#![allow(non_snake_case)] // G, K, C, S, R

use super::forms::{Bends, Forms, StrainSlopes};
use crate::small::re;
use crate::strain::Strain;
use nalgebra::{Matrix3, Vector3, Vector6};
use vi_core::Number;

/// `c_1, c_2, …` of `f = Σ c_j s^j`: `c_0 = 1`, `c_{j+1} = c_j (2j + 2)/(2j + 3)`.
const SERIES: [f64; 20] = {
    let (mut c, mut last, mut j) = ([0.0; 20], 1.0, 0);
    while j < c.len() {
        last *= (2 * j + 2) as f64 / (2 * j + 3) as f64;
        c[j] = last;
        j += 1;
    }
    c
};

/// `c_j (j + 1)` of `c_{j+1}`: the series of a derivative.
const fn derivative(c: [f64; 20]) -> [f64; 20] {
    let (mut out, mut j) = ([0.0; 20], 0);
    while j + 1 < c.len() {
        out[j] = (j + 1) as f64 * c[j + 1];
        j += 1;
    }
    out
}

/// Of `k` and two derivatives.
static GAP: [[f64; 20]; 3] = [SERIES, derivative(SERIES), derivative(derivative(SERIES))];

/// Where `k` is a series of so many terms, an even number.
fn terms(s: f64) -> Option<usize> {
    match s {
        0.05.. => None,
        0.01.. => Some(SERIES.len()),
        0.001.. => Some(12),
        _ => Some(8),
    }
}

/// `Σ c_j s^j`, even and odd powers apart: two short chains of operations.
#[inline]
fn series<T: Number>(c: &[f64], s: T) -> T {
    let square = s * s;
    let (mut even, mut odd) = (T::of(0.0), T::of(0.0));
    for c in c.as_chunks::<2>().0.iter().rev() {
        (even, odd) = (even * square + T::of(c[0]), odd * square + T::of(c[1]));
    }
    even + s * odd
}

/// `k = (f − 1)/s`; `f = 1 + s k`.
#[inline]
fn gap<T: Number>(s: T) -> T {
    let one = T::of(1.0);
    match terms(re(s)) {
        Some(terms) => series(&GAP[0][..terms], s),
        None => (s.sqrt().arcsine() / (s * (one - s)).sqrt() - one) / s,
    }
}

/// `k'`, from `k`.
#[inline]
fn slope_of_gap<T: Number>(s: T, k: T) -> T {
    if let Some(terms) = terms(re(s)) {
        return series(&GAP[1][..terms], s);
    }
    let [one, two] = [1.0, 2.0].map(T::of);
    let first = (one - (one - two * s) * (one + s * k)) / (two * s * (one - s)); // f'
    (first - k) / s
}

/// `k''`, from `k` and `k'`.
fn bend_of_gap<T: Number>(s: T, k: T, slope: T) -> T {
    if let Some(terms) = terms(re(s)) {
        return series(&GAP[2][..terms], s);
    }
    let [one, two, three] = [1.0, 2.0, 3.0].map(T::of);
    let (f, first) = (one + s * k, k + s * slope);
    let second = (two * f - three * (one - two * s) * first) / (two * s * (one - s)); // f''
    (second - two * slope) / s
}

/// `(G, K)` with what their derivatives need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Helix<T: Number = f64> {
    pub(super) g: Vector3<T>,
    pub(super) a: Vector3<T>,
    pub(super) s: T,
    pub(super) k: T,
    pub(super) f: T,
    pub(super) b: T,
    pub(super) xi: Strain<T>, // (G, K)
}

impl<T: Number> Helix<T> {
    #[inline]
    pub(super) fn at(y: &Forms<T>, length: T) -> Self {
        let (s, k) = (y[6], gap(y[6]));
        let (f, b) = (T::of(1.0) + s * k, k * (T::of(0.25) / (T::of(1.0) - s)));
        let (g, a) = (Vector3::new(y[0], y[1], y[2]), Vector3::new(y[3], y[4], y[5]));
        let xi = join(&(g * f - a * (b * a.dot(&g))), &(a / length * f));
        Self { g, a, s, k, f, b, xi }
    }

    /// `f'` and `b'`.
    #[inline]
    fn slopes_of_functions(&self) -> [T; 2] {
        let (w, slope) = (T::of(0.25) / (T::of(1.0) - self.s), slope_of_gap(self.s, self.k));
        [self.k + self.s * slope, slope * w + T::of(4.0) * self.k * w * w]
    }

    /// `f''` and `b''`.
    fn bends_of_functions(&self) -> [T; 2] {
        let (w, slope) = (T::of(0.25) / (T::of(1.0) - self.s), slope_of_gap(self.s, self.k));
        let bend = bend_of_gap(self.s, self.k, slope);
        let of_b = T::of(8.0) * slope * w * w + T::of(32.0) * self.k * w * w * w;
        [T::of(2.0) * slope + self.s * bend, bend * w + of_b]
    }

    /// `N·G + M·K`, and its slopes in `g` and `a`, with `f` and `b` or derivatives of both by `s`.
    #[inline]
    fn product(&self, n: &Strain<T>, [f, b]: [T; 2], length: T) -> (T, Vector3<T>, Vector3<T>) {
        let Self { g, a, .. } = self;
        let (N, M) = split(n);
        let (along, of_a) = (a.dot(g), N.dot(a));
        let by_g = N * f - a * (b * of_a);
        let by_a = M * (f / length) - (N * along + g * of_a) * b;
        (by_g.dot(g) + (f / length) * M.dot(a), by_g, by_a)
    }

    /// `∂(G, K)/∂y`.
    #[inline]
    pub(super) fn slopes(&self, length: T) -> StrainSlopes<T> {
        let Self { g, a, f, b, .. } = self;
        let (along, [df, db]) = (a.dot(g), self.slopes_of_functions());
        let mut out = StrainSlopes::zeros();
        for j in 0..3 {
            for i in 0..3 {
                out[(i, j)] = -*b * a[i] * a[j];
                out[(i, 3 + j)] = -*b * a[i] * g[j];
            }
            out[(j, j)] += *f;
            out[(j, 3 + j)] -= *b * along;
            out[(3 + j, 3 + j)] = *f / length;
            out[(j, 6)] = df * g[j] - db * along * a[j];
            out[(3 + j, 6)] = df / length * a[j];
        }
        out
    }

    /// `Σ n_i ∂(G, K)_i/∂y`.
    #[inline]
    pub(super) fn pull_back(&self, n: &Strain<T>, length: T) -> Forms<T> {
        let (_, by_g, by_a) = self.product(n, [self.f, self.b], length);
        let (by_s, ..) = self.product(n, self.slopes_of_functions(), length);
        Forms::from([by_g[0], by_g[1], by_g[2], by_a[0], by_a[1], by_a[2], by_s])
    }
}

impl Helix {
    /// `Σ n_i ∂²(G, K)_i/∂y∂y`.
    pub(super) fn bends(&self, n: &Strain, length: f64) -> Bends {
        let Self { g, a, b, .. } = self;
        let (N, _) = split(n);
        let mut out = Bends::zeros();
        let mut set = |i: usize, j: usize, block: Matrix3<f64>| {
            out.fixed_view_mut::<3, 3>(i, j).copy_from(&block);
            out.fixed_view_mut::<3, 3>(j, i).copy_from(&block.transpose());
        };
        set(0, 3, -*b * (a * N.transpose() + N.dot(a) * Matrix3::identity()));
        set(3, 3, -*b * (N * g.transpose() + g * N.transpose()));
        let (_, by_g, by_a) = self.product(n, self.slopes_of_functions(), length);
        for i in 0..3 {
            (out[(i, 6)], out[(6, i)]) = (by_g[i], by_g[i]);
            (out[(3 + i, 6)], out[(6, 3 + i)]) = (by_a[i], by_a[i]);
        }
        (out[(6, 6)], ..) = self.product(n, self.bends_of_functions(), length);
        out
    }
}

pub(crate) fn join<T: Number>(G: &Vector3<T>, K: &Vector3<T>) -> Vector6<T> {
    Vector6::new(G[0], G[1], G[2], K[0], K[1], K[2])
}

pub(crate) fn split<T: Number>(strain: &Vector6<T>) -> (Vector3<T>, Vector3<T>) {
    (strain.fixed_rows::<3>(0).into(), strain.fixed_rows::<3>(3).into())
}
