//! Helicoidal strains of the two-node element, corrected to order 4.
//!
//! ```text
//! y = (g, a, s):   g_I = d̄_I·φ',   a = ℓ K of the mean directors,   s = ⅛ Σ_I |d_I^b − d_I^a|² = sin²(ψ/2)
//! f = ψ/sin ψ = arcsin√s/√(s(1−s)),   b = (f − 1)/(4 s(1−s))
//! G = f g − b a (a·g),   K = f a/ℓ,   z = (G, K) − (G, K)_0                          order 2
//! C_r = (C⁻¹ + (ℓ²/12) [XᵀSX 0; 0 0])⁻¹,   X n = e_3×n,   S: lower right block of C⁻¹
//! m = (C_r z)_m,   w = S (K×m)
//! η_G = z_G − (ℓ²/12) w×e_3,   η_K = z_K + (ℓ²/24) K×w
//! η_3 += ρ − G_3 + q/10,   q = |γ_b|²,   ρ = √(G_3² + q),   γ_b = R (η_1, η_2)          order 4
//! ```
//! Between the nodes the frame is a helix of constant strain, `ψ` its angle: constant strain is
//! exact for any `ψ < π`. Order 4 adds the energy of the linear part of the moment, which a beam
//! without loads between its nodes has, `n' = −K×n`, `m' = −K×m − G×n`: its bending flexibility to
//! the shear compliances, and `γ_b`, the part of the shear that is bending, to the extension. All
//! are functions of quadratic forms of `x` that no rigid motion changes, and so are the strains.
//!
//! A rope has the strains of order 2 but for
//! ```text
//! η_3 = |G| + c (|G| − G_3) − G_3,0,   c = 2
//! ```
//! the stretch of its arc whatever the directions of the triads, which the tension alone ties to
//! the arc, with the stiffness `C_r` and no force along it where `η_3 < 0`. With `c` below 1 the
//! tension of a curved rope shortens its arcs by twisting them.
//!
//! Letters: `ψ` angle between the triads of both nodes, `n` here a vector; the others as in
//! [`crate::strain`].
//!
//! Source: theory §6.16; helicoidal interpolation: M. Borri, C. Bottasso, IJNME 37 (1994)
//! 2267–2289.
#![allow(non_snake_case)] // G, K, C, S, R

use crate::small::{inverse, product, re, times};
use crate::strain::{self, ElementCoordinates, SIZE, Strain};
use nalgebra::{Matrix2, Matrix3, Matrix6, SMatrix, SVector, Vector2, Vector3, Vector6};
use vi_core::Number;

/// How many quadratic forms the strains are functions of.
pub const FORMS: usize = 7;
/// `y = (g, a, s)`, without units.
pub type Forms = SVector<f64, FORMS>;
/// `∂η/∂y`.
pub type Slopes = SMatrix<f64, 6, FORMS>;
/// `Σ n_i ∂²η_i/∂y∂y`.
pub type Bends = SMatrix<f64, FORMS, FORMS>;

/// `|Δy|²` below which the change of the strains is their slope at the middle but for rounding.
const SMALL_CHANGE: f64 = 1e-16;

/// The strains of an element of a length and a stiffness.
#[derive(Clone, Debug, PartialEq)]
pub struct Helicoidal<T = f64> {
    length: f64,                  // ℓ, m
    stiffness: Matrix6<T>,        // C_r
    viscosity: Matrix6<T>,        // V_r
    order: Option<Correction<T>>, // None: order 2
    rope: bool,
}

/// `c`, how much tension ties the triads of a rope to its arc.
const TIE: f64 = 2.0;

/// What order 4 needs.
#[derive(Clone, Debug, PartialEq)]
struct Correction<T> {
    compliance: Matrix6<T>, // C⁻¹
    S: Matrix3<T>,          // of bending and twist in C⁻¹
    R: Matrix2<T>,          // from shear to that of bending
}

/// `y` of coordinates.
#[must_use]
#[inline]
pub fn forms(x: &ElementCoordinates, length: f64) -> Forms {
    let mean = strain::forms(x, length);
    let mut y = Forms::zeros();
    for i in 0..3 {
        (y[i], y[3 + i]) = (mean[i], length * mean[3 + i]);
    }
    for k in 3..12 {
        y[6] += 0.125 * (x[12 + k] - x[k]) * (x[12 + k] - x[k]);
    }
    y
}

/// Columns `𝔹_k x`, the gradients of the forms.
#[must_use]
pub fn gradients(x: &ElementCoordinates, length: f64) -> SMatrix<f64, SIZE, FORMS> {
    force(x, length, &Bends::identity())
}

/// Columns `Σ_k c_ik 𝔹_k x`, one for each row of `c`: of `∂η/∂y` they are the columns `∇η_i`.
#[must_use]
#[inline]
pub fn force<const N: usize>(
    x: &ElementCoordinates,
    length: f64,
    c: &SMatrix<f64, N, FORMS>,
) -> SMatrix<f64, SIZE, N> {
    let half = 0.5 / length;
    let mut rows = [[0.0; N]; SIZE];
    for k in 0..3 {
        let (a, b) = (|i: usize| x[3 + 3 * i + k], |i: usize| x[15 + 3 * i + k]);
        let mean = |i: usize| (half * (a(i) + b(i)), i);
        rows[12 + k] = combination([mean(0), mean(1), mean(2)], c); // [6.5]
        rows[k] = rows[12 + k].map(|own| -own);
        let slope = half * (x[12 + k] - x[k]);
        for i in 0..3 {
            let (next, last) = ((i + 1) % 3, (i + 2) % 3);
            let (of_next, of_last, turn) = (3 + next, 3 + last, 0.25 * (b(i) - a(i)));
            let to_b = [(0.5 * b(last), of_next), (-0.5 * b(next), of_last)];
            let to_a = [(-0.5 * a(last), of_next), (0.5 * a(next), of_last)];
            rows[3 + 3 * i + k] = combination([(slope, i), to_b[0], to_b[1], (-turn, 6)], c);
            rows[15 + 3 * i + k] = combination([(slope, i), to_a[0], to_a[1], (turn, 6)], c);
        }
    }
    SMatrix::from_fn(|i, j| rows[i][j])
}

/// `P_inᵀ Σ_k c_ik 𝔹_k x` with the directors of `x`, one column for each row of `c`: forces and
/// torques of both nodes.
/// ```text
/// f_a = −Σ_I c_gI d̄_I/ℓ = −f_b,   τ_a = ½ Σ_I c_gI d_I^a×φ' + t,   τ_b = ½ Σ_I c_gI d_I^b×φ' − t
/// t = ½ Σ_k c_ak (d_l^a×d_m^b − d_m^a×d_l^b) − ¼ c_s Σ_I d_I^a×d_I^b,      (k, m, l) cyclic
/// ```
#[must_use]
#[inline]
pub fn wrenches<const N: usize>(
    x: &ElementCoordinates,
    length: f64,
    c: &SMatrix<f64, N, FORMS>,
) -> SMatrix<f64, 12, N> {
    let vector = |slot: usize| Vector3::new(x[3 * slot], x[3 * slot + 1], x[3 * slot + 2]);
    let half_slope = (vector(4) - vector(0)) * (0.5 / length);
    let [a, b] = [1, 5].map(|first| [0, 1, 2].map(|i| vector(first + i)));
    let (mut of_g, mut turns) = ([[0.0; 12]; 3], [[0.0; 3]; 4]);
    let mut relative = Vector3::zeros();
    for i in 0..3 {
        let (m, l) = ((i + 1) % 3, (i + 2) % 3);
        let force = (a[i] + b[i]) * (0.5 / length);
        let parts = [-force, a[i].cross(&half_slope), force, b[i].cross(&half_slope)];
        of_g[i].as_chunks_mut().0.iter_mut().zip(parts).for_each(|(own, part)| *own = part.into());
        turns[i] = (0.5 * (a[l].cross(&b[m]) - a[m].cross(&b[l]))).into();
        relative -= 0.25 * a[i].cross(&b[i]);
    }
    turns[3] = relative.into();
    let mut out = product(&of_g, &c.fixed_columns::<3>(0).transpose());
    let turned = product(&turns, &c.fixed_columns::<4>(3).transpose());
    for (own, turned) in out.data.0.iter_mut().zip(&turned.data.0) {
        for i in 0..3 {
            (own[3 + i], own[9 + i]) = (own[3 + i] + turned[i], own[9 + i] - turned[i]);
        }
    }
    out
}

/// The sum of some columns of `c` with their factors.
#[inline]
fn combination<const N: usize, const TERMS: usize>(
    terms: [(f64, usize); TERMS],
    c: &SMatrix<f64, N, FORMS>,
) -> [f64; N] {
    let mut sum = [0.0; N];
    for (factor, k) in terms {
        for (sum, own) in sum.iter_mut().zip(&c.data.0[k]) {
            *sum += factor * own;
        }
    }
    sum
}

/// `Σ_k c_k B_k` with `𝔹_k = B_k ⊗ I_3`.
#[must_use]
pub fn weighted_matrix(c: &Forms, length: f64) -> SMatrix<f64, 8, 8> {
    let of_mean = Strain::from_fn(|i, _| if i < 3 { c[i] } else { length * c[i] });
    let mut B = strain::weighted_matrix(&of_mean, length);
    for director in 1..4 {
        let (a, b) = (director, 4 + director);
        B[(a, a)] += 0.25 * c[6];
        B[(b, b)] += 0.25 * c[6];
        B[(a, b)] -= 0.25 * c[6];
        B[(b, a)] -= 0.25 * c[6];
    }
    B
}

/// `e_3×n` as a matrix on `n`.
fn cross_3<T: Number>() -> Matrix3<T> {
    Vector3::z().cross_matrix()
}

/// `(ℓ²/12) XᵀSX`.
fn bending<T: Number>(length: f64, S: &Matrix3<T>) -> Matrix3<T> {
    times(length * length / 12.0, &cross_3().tr_mul(&(S * cross_3())))
}

impl<T: Number> Helicoidal<T> {
    /// Strains of order 2, of an element of the length `ℓ` (m) with the stiffness `C`, symmetric
    /// and positive definite.
    #[must_use]
    pub fn of_order_2(length: f64, C: Matrix6<T>) -> Self {
        let (viscosity, order, rope) = (Matrix6::zeros(), None, false);
        Self { length, stiffness: C, viscosity, order, rope }
    }

    /// Strains of order 4 from the compliance `C⁻¹`, whose shears may vanish; `None` where that is
    /// not positive definite with the flexibility of bending.
    #[must_use]
    pub fn of_order_4(length: f64, compliance: &Matrix6<T>) -> Option<Self> {
        let S: Matrix3<T> = compliance.fixed_view::<3, 3>(3, 3).into();
        let bending = bending(length, &S);
        let mut reduced = *compliance;
        let mut shear = reduced.fixed_view_mut::<3, 3>(0, 0);
        shear += bending;
        let stiffness = inverse(&reduced, |own| Some(own.cholesky()?.inverse()))?;
        let R = bending.fixed_view::<2, 2>(0, 0) * stiffness.fixed_view::<2, 2>(0, 0);
        let order = Some(Correction { compliance: *compliance, S, R });
        let (viscosity, rope) = (Matrix6::zeros(), false);
        Some(Self { length, stiffness, viscosity, order, rope })
    }

    /// The same with the viscosity `V` of the section, symmetric and positive semi-definite; of
    /// first order in the rate it condenses as the stiffness does:
    /// `V_r = C_r (Y + (ℓ²/12) [XᵀY_mm X 0; 0 0]) C_r`, `Y = C⁻¹VC⁻¹`.
    #[must_use]
    pub fn with_viscosity(mut self, V: &Matrix6<T>) -> Self {
        self.viscosity = *V;
        if let Some(Correction { compliance, .. }) = &self.order {
            let mut Y = compliance * V * compliance;
            let bending = bending(self.length, &Y.fixed_view::<3, 3>(3, 3).into());
            let mut shear = Y.fixed_view_mut::<3, 3>(0, 0);
            shear += bending;
            self.viscosity = self.stiffness * Y * self.stiffness;
        }
        self
    }

    /// Those of a rope with the same stiffness.
    #[must_use]
    pub fn of_rope(self) -> Self {
        Self { order: None, rope: true, ..self }
    }

    /// Whether it carries no force along it where `η_3 < 0`.
    #[must_use]
    pub fn carries_tension_only(&self) -> bool {
        self.rope
    }

    /// `C_r`, with which stress resultants are `C_r η` and the energy is `½ ℓ ηᵀC_r η`.
    #[must_use]
    pub fn stiffness(&self) -> &Matrix6<T> {
        &self.stiffness
    }

    /// Whether the strains are corrected to order 4.
    #[must_use]
    pub fn is_of_order_4(&self) -> bool {
        self.order.is_some()
    }

    /// `V_r`, with which damping adds `V_r η̇` to the stress resultants.
    #[must_use]
    pub fn viscosity(&self) -> &Matrix6<T> {
        &self.viscosity
    }

    /// `(G, K)`: the strains of order 2 before those of the stress-free placement are taken off.
    #[must_use]
    pub fn helix(&self, y: &Forms) -> Strain {
        let k = gap(y[6]);
        helix(y, [1.0 + y[6] * k, 0.25 * k / (1.0 - y[6])], self.length)
    }

    /// The same without derivatives.
    #[must_use]
    #[inline]
    pub fn strain(&self, y: &Forms, reference: &Vector6<T>) -> Vector6<T> {
        let helix = self.helix(y);
        let xi = helix.map(T::of);
        let mut z = xi - reference;
        if self.rope {
            z[2] += T::of(Arc::of(&helix).excess(&helix));
        }
        self.order.as_ref().map_or(z, |own| Corrected::at(self, own, &xi, &z).eta)
    }

    /// The strains at `y` of an element that is stress-free with `(G, K)_0 = reference`, with all
    /// that their derivatives need.
    #[must_use]
    #[inline]
    pub fn at<'a>(&'a self, y: &Forms, reference: &Vector6<T>) -> AtForms<'a, T> {
        let helix = Helix::at(y, self.length);
        let xi = helix.xi.map(T::of);
        let mut z = xi - reference;
        let arc = self.rope.then(|| Arc::of(&helix.xi));
        if let Some(arc) = &arc {
            z[2] += T::of(arc.excess(&helix.xi));
        }
        let corrected = self.order.as_ref().map(|own| (own, Corrected::at(self, own, &xi, &z)));
        AtForms { law: self, helix, z, arc, corrected }
    }
}

impl Helicoidal {
    /// The triad half-way between the nodes with the forms `y`, from the mean of their triads,
    /// whose stretch is `cos(ψ/2)` across the axis of `ψ`.
    pub(crate) fn middle<T: Number>(mean: &Matrix3<T>, y: &SVector<T, FORMS>) -> Matrix3<T> {
        let one = T::of(1.0);
        let (a, c) = (Vector3::new(y[3], y[4], y[5]), (one - y[6]).sqrt());
        let across = a * a.transpose() / (T::of(4.0) * c * c * c * (one + c));
        mean * (Matrix3::identity() / c - across)
    }

    /// `∂̄η`: the derivative between `y_0` and `y_1` whose product with their difference is that of
    /// the strains, `∂̄η (y_1 − y_0) = η(y_1) − η(y_0)`.
    ///
    /// Source: O. Gonzalez, J. Nonlinear Sci. 6 (1996) 449–467.
    #[must_use]
    pub fn discrete_slopes(&self, [y_0, y_1]: [&Forms; 2], reference: &Strain) -> Slopes {
        let middle = self.at(&(0.5 * (y_0 + y_1)), reference).slopes();
        self.away_from([y_0, y_1], &middle, reference).map_or(middle, |(slopes, _)| slopes)
    }

    /// `∂̄η` from `∂η/∂y(ȳ)`, with what the latter misses; `None` where they are the same.
    fn away_from(
        &self,
        [y_0, y_1]: [&Forms; 2],
        middle: &Slopes,
        reference: &Strain,
    ) -> Option<(Slopes, Strain)> {
        let change = y_1 - y_0;
        let size = change.norm_squared();
        if size < SMALL_CHANGE {
            return None;
        }
        let rest = self.rest([y_0, y_1], middle, reference);
        Some((middle + rest * change.transpose() / size, rest))
    }

    /// `η(y_1) − η(y_0) − ∂η/∂y(ȳ) Δy`, accurate relative to itself where `Δy` is small: by Gauss's
    /// rule with two points, whose error `|Δy|⁵/4320` is then below the rounding error of the
    /// difference.
    fn rest(&self, [y_0, y_1]: [&Forms; 2], middle: &Slopes, reference: &Strain) -> Strain {
        const CLOSE: f64 = 1e-6;
        let (mean, change) = (0.5 * (y_0 + y_1), y_1 - y_0);
        if change.norm_squared() > CLOSE {
            return self.strain(y_1, reference) - self.strain(y_0, reference) - middle * change;
        }
        let step = change * (0.5 / 3.0_f64.sqrt());
        let slopes = |y: &Forms| self.at(y, reference).slopes();
        let away = 0.5 * (slopes(&(mean + step)) + slopes(&(mean - step))) - middle;
        away * change
    }

    /// `∂̄η` and `∂(∂̄ηᵀn)/∂y_1`.
    #[must_use]
    pub fn discrete_derivatives(
        &self,
        [y_0, y_1]: [&Forms; 2],
        reference: &Strain,
        n: &Strain,
    ) -> (Slopes, Bends) {
        let (mean, change) = (0.5 * (y_0 + y_1), y_1 - y_0);
        let middle = self.at(&mean, reference);
        let (slopes, bends) = (middle.slopes(), 0.5 * middle.bends(n));
        let Some((discrete, rest)) = self.away_from([y_0, y_1], &slopes, reference) else {
            return (slopes, bends);
        };
        let size = change.norm_squared();
        let (rest, end) = (n.dot(&rest), self.at(y_1, reference));
        let of_rest = (end.slopes() - slopes).tr_mul(n) - bends * change;
        let across = of_rest - (2.0 * rest / size) * change;
        let by_end = Bends::identity() * (rest / size) + change * across.transpose() / size;
        (discrete, bends + by_end)
    }
}

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
fn series(c: &[f64], s: f64) -> f64 {
    let square = s * s;
    let (mut even, mut odd) = (0.0, 0.0);
    for c in c.as_chunks::<2>().0.iter().rev() {
        (even, odd) = (even * square + c[0], odd * square + c[1]);
    }
    even + s * odd
}

/// `k = (f − 1)/s`; `f = 1 + s k`.
fn gap(s: f64) -> f64 {
    match terms(s) {
        Some(terms) => series(&GAP[0][..terms], s),
        None => (libm::asin(s.sqrt()) / (s * (1.0 - s)).sqrt() - 1.0) / s,
    }
}

/// `k` and two derivatives.
fn gap_with_slopes(s: f64) -> [f64; 3] {
    if let Some(terms) = terms(s) {
        return std::array::from_fn(|k| series(&GAP[k][..terms], s));
    }
    let (k, less, twice) = (gap(s), 1.0 - 2.0 * s, 2.0 * s * (1.0 - s));
    let f = 1.0 + s * k;
    let first = (1.0 - less * f) / twice;
    let second = (2.0 * f - 3.0 * less * first) / twice;
    let slope = (first - k) / s;
    [k, slope, (second - 2.0 * slope) / s]
}

/// `(G, K)` of `y` with `f` and `b`.
#[inline]
fn helix(y: &Forms, [f, b]: [f64; 2], length: f64) -> Strain {
    let (g, a) = (y.fixed_rows::<3>(0), y.fixed_rows::<3>(3));
    join(&(f * g - b * a.dot(&g) * a), &(f / length * a))
}

/// `(G, K)` with what their derivatives need.
#[derive(Clone, Copy, Debug)]
struct Helix {
    g: Vector3<f64>,
    a: Vector3<f64>,
    f: [f64; 3], // and two derivatives
    b: [f64; 3],
    xi: Strain, // (G, K)
}

impl Helix {
    #[inline]
    fn at(y: &Forms, length: f64) -> Self {
        let [k, k1, k2] = gap_with_slopes(y[6]);
        let (s, less) = (y[6], 1.0 - y[6]);
        let w = 0.25 / less;
        let f = [1.0 + s * k, k + s * k1, 2.0 * k1 + s * k2];
        let b = [
            0.25 * k / less,
            k1 * w + 4.0 * k * w * w,
            k2 * w + 8.0 * k1 * w * w + 32.0 * k * w * w * w,
        ];
        let (g, a) = (Vector3::new(y[0], y[1], y[2]), Vector3::new(y[3], y[4], y[5]));
        Self { g, a, f, b, xi: helix(y, [f[0], b[0]], length) }
    }

    /// `N·G + M·K`, and its slopes in `g` and `a`, with `f` and `b` of a derivative by `s`.
    #[inline]
    fn product(&self, n: &Strain, order: usize, length: f64) -> (f64, Vector3<f64>, Vector3<f64>) {
        let (Self { g, a, .. }, f, b) = (self, self.f[order], self.b[order]);
        let (N, M) = split(n);
        let (along, of_a) = (a.dot(g), N.dot(a));
        let by_g = f * N - (b * of_a) * a;
        let by_a = (f / length) * M - b * (along * N + of_a * g);
        (by_g.dot(g) + (f / length) * M.dot(a), by_g, by_a)
    }

    /// `∂(G, K)/∂y`.
    #[inline]
    fn slopes(&self, length: f64) -> Slopes {
        let Self { g, a, f, b, .. } = self;
        let along = a.dot(g);
        let mut out = Slopes::zeros();
        for j in 0..3 {
            for i in 0..3 {
                out[(i, j)] = -b[0] * a[i] * a[j];
                out[(i, 3 + j)] = -b[0] * a[i] * g[j];
            }
            out[(j, j)] += f[0];
            out[(j, 3 + j)] -= b[0] * along;
            out[(3 + j, 3 + j)] = f[0] / length;
            out[(j, 6)] = f[1] * g[j] - b[1] * along * a[j];
            out[(3 + j, 6)] = f[1] / length * a[j];
        }
        out
    }

    /// `Σ n_i ∂(G, K)_i/∂y`.
    #[inline]
    fn pull_back(&self, n: &Strain, length: f64) -> Forms {
        let (_, by_g, by_a) = self.product(n, 0, length);
        let (by_s, ..) = self.product(n, 1, length);
        Forms::from([by_g[0], by_g[1], by_g[2], by_a[0], by_a[1], by_a[2], by_s])
    }

    /// `Σ n_i ∂²(G, K)_i/∂y∂y`.
    fn bends(&self, n: &Strain, length: f64) -> Bends {
        let Self { g, a, b, .. } = self;
        let (N, _) = split(n);
        let mut out = Bends::zeros();
        let mut set = |i: usize, j: usize, block: Matrix3<f64>| {
            out.fixed_view_mut::<3, 3>(i, j).copy_from(&block);
            out.fixed_view_mut::<3, 3>(j, i).copy_from(&block.transpose());
        };
        set(0, 3, -b[0] * (a * N.transpose() + N.dot(a) * Matrix3::identity()));
        set(3, 3, -b[0] * (N * g.transpose() + g * N.transpose()));
        let (_, by_g, by_a) = self.product(n, 1, length);
        for i in 0..3 {
            (out[(i, 6)], out[(6, i)]) = (by_g[i], by_g[i]);
            (out[(3 + i, 6)], out[(6, 3 + i)]) = (by_a[i], by_a[i]);
        }
        (out[(6, 6)], ..) = self.product(n, 2, length);
        out
    }
}

/// The strains at some forms.
#[derive(Clone, Debug)]
pub struct AtForms<'a, T: Number = f64> {
    law: &'a Helicoidal<T>,
    helix: Helix,
    z: Vector6<T>,
    arc: Option<Arc>,
    corrected: Option<(&'a Correction<T>, Corrected<T>)>,
}

/// The stretch of a rope.
#[derive(Clone, Copy, Debug)]
struct Arc {
    length: f64,             // |G|
    direction: Vector3<f64>, // G/|G|
    slope: Vector3<f64>,     // ∂η_3/∂G
}

impl Arc {
    fn of(xi: &Strain) -> Self {
        let (G, _) = split(xi);
        let length = G.norm();
        let direction = if length > 0.0 { G / length } else { Vector3::z() };
        let slope = (1.0 + TIE) * direction - TIE * Vector3::z();
        Self { length, direction, slope }
    }

    /// `η_3 − z_3 = (1 + c)(|G| − G_3)` without its cancellation.
    fn excess(&self, xi: &Strain) -> f64 {
        let excess = match xi[2] > 0.0 {
            true => (xi[0] * xi[0] + xi[1] * xi[1]) / (self.length + xi[2]),
            false => self.length - xi[2],
        };
        (1.0 + TIE) * excess
    }

    /// What `n` is on the strains of the helix: `n_3` acts along `∂η_3/∂G`.
    fn on_helix<T: Number>(&self, n: &Vector6<T>) -> Vector6<T> {
        let [a, b, c] = [0, 1, 2].map(|i| n[2] * T::of(self.slope[i]));
        Vector6::new(n[0] + a, n[1] + b, c, n[3], n[4], n[5])
    }

    /// `∂²η_3/∂G∂G`; nothing where the nodes meet.
    fn bend(&self) -> Matrix3<f64> {
        if self.length == 0.0 {
            return Matrix3::zeros();
        }
        let e = &self.direction;
        (Matrix3::identity() - e * e.transpose()) * ((1.0 + TIE) / self.length)
    }
}

impl<T: Number> AtForms<'_, T> {
    /// `η`.
    #[must_use]
    pub fn strain(&self) -> Vector6<T> {
        self.corrected.as_ref().map_or(self.z, |(_, corrected)| corrected.eta)
    }

    /// `Σ n_i ∂η_i/∂(G, K)`.
    #[inline]
    pub(crate) fn on_helix(&self, n: &Vector6<T>) -> Vector6<T> {
        match (&self.arc, &self.corrected) {
            (Some(arc), _) => arc.on_helix(n),
            (None, Some((own, corrected))) => corrected.pull_back(own, self.law, n),
            (None, None) => *n,
        }
    }

    /// `∂(G, K)/∂y` times a change of `y`.
    pub(crate) fn helix_rate(&self, y: &Forms) -> Strain {
        self.helix.slopes(self.law.length) * y
    }

    /// `Σ ξ_i ∂(G, K)_i/∂y`.
    #[inline]
    pub(crate) fn by_helix(&self, xi: &Strain) -> Forms {
        self.helix.pull_back(xi, self.law.length)
    }
}

impl AtForms<'_> {
    /// `Σ n_i ∂η_i/∂y`.
    #[must_use]
    #[inline]
    pub fn pull_back(&self, n: &Strain) -> Forms {
        self.by_helix(&self.on_helix(n))
    }

    /// `∂η/∂y`.
    #[must_use]
    pub fn slopes(&self) -> Slopes {
        let mut out = self.helix.slopes(self.law.length);
        if let Some(arc) = &self.arc {
            out.set_row(2, &arc.slope.tr_mul(&out.fixed_rows::<3>(0)));
        }
        match &self.corrected {
            Some((own, corrected)) => product(&corrected.slopes(own, self.law).of_eta.data.0, &out),
            None => out,
        }
    }

    /// `Σ n_i ∂²η_i/∂y∂y`.
    #[must_use]
    pub fn bends(&self, n: &Strain) -> Bends {
        let length = self.law.length;
        let mut out = self.helix.bends(&self.on_helix(n), length);
        let of_helix = self.helix.slopes(length);
        if let Some(arc) = &self.arc {
            let of_G = of_helix.fixed_rows::<3>(0);
            out += of_G.tr_mul(&(n[2] * arc.bend() * of_G));
        }
        if let Some((own, corrected)) = &self.corrected {
            out += of_helix.tr_mul(&(corrected.bends(own, self.law, n) * of_helix));
        }
        out
    }
}

/// The strains of order 4 with what they are made of.
#[derive(Clone, Copy, Debug)]
struct Corrected<T: Number> {
    K: Vector3<T>,
    G_3: T,
    m: Vector3<T>,
    w: Vector3<T>,
    gamma: Vector2<T>, // γ_b
    rho: T,
    q: T,
    eta: Vector6<T>,
}

/// Derivatives by `ξ` of `m`, `w`, `γ_b`, `q` and `η`.
struct CorrectedSlopes {
    of_m: SMatrix<f64, 3, 6>,
    of_w: SMatrix<f64, 3, 6>,
    of_gamma: SMatrix<f64, 2, 6>,
    of_q: SMatrix<f64, 1, 6>,
    of_eta: Matrix6<f64>,
}

/// What acts on `η_1, η_2, η_3`, with what acts on them by `q`; on `η_K`; on `K×m`.
struct OnParts<T> {
    N: Vector3<T>,
    M: Vector3<T>,
    of_k: Vector3<T>,
}

impl<T: Number> Corrected<T> {
    #[inline]
    fn at(
        law: &Helicoidal<T>,
        Correction { S, R, .. }: &Correction<T>,
        xi: &Vector6<T>,
        z: &Vector6<T>,
    ) -> Self {
        let square = law.length * law.length;
        let (_, K) = split(xi);
        let m: Vector3<T> = law.stiffness.fixed_rows::<3>(3) * z;
        let w = S * K.cross(&m);
        let mut eta = *z;
        let shear = T::of(square / 12.0);
        (eta[0], eta[1]) = (z[0] - shear * w[1], z[1] + shear * w[0]); // − (ℓ²/12) w×e_3
        let bent = times(square / 24.0, &K.cross(&w));
        for i in 0..3 {
            eta[3 + i] += bent[i];
        }
        let gamma = R * Vector2::new(eta[0], eta[1]);
        let (G_3, q) = (xi[2], gamma.norm_squared());
        let rho = (G_3 * G_3 + q).sqrt();
        // ρ − G_3 without its cancellation
        let excess = if re(G_3) > 0.0 { q / (rho + G_3) } else { rho - G_3 };
        eta[2] += T::of(0.1) * q + excess;
        Self { K, G_3, m, w, gamma, rho, q, eta }
    }

    /// `½/ρ + 1/10`, the slope of `ρ − G_3 + q/10` in `q`.
    fn slope_of_q(&self) -> T {
        T::of(0.5) / self.rho + T::of(0.1)
    }

    #[inline]
    fn parts(
        &self,
        Correction { S, R, .. }: &Correction<T>,
        law: &Helicoidal<T>,
        n: &Vector6<T>,
    ) -> OnParts<T> {
        let square = law.length * law.length;
        let (mut N, M) = split(n);
        let by_gamma = R.tr_mul(&self.gamma) * (T::of(2.0) * N[2] * self.slope_of_q());
        (N[0], N[1]) = (N[0] + by_gamma[0], N[1] + by_gamma[1]);
        let turned = Vector3::new(-N[1], N[0], T::of(0.0)); // e_3×N
        let bent = times(square / 24.0, &M.cross(&self.K));
        let of_k = S * (bent - times(square / 12.0, &turned));
        OnParts { N, M, of_k }
    }

    /// `Σ n_i ∂η_i/∂ξ`.
    #[inline]
    fn pull_back(&self, own: &Correction<T>, law: &Helicoidal<T>, n: &Vector6<T>) -> Vector6<T> {
        let Self { K, G_3, m, w, rho, .. } = self;
        let OnParts { N, M, of_k } = self.parts(own, law, n);
        let of_K = times(law.length * law.length / 24.0, &w.cross(&M)) + m.cross(&of_k);
        let mut out = join(&N, &(M + of_K));
        out[2] += n[2] * (*G_3 / *rho - T::of(1.0));
        out + law.stiffness.fixed_rows::<3>(3).tr_mul(&of_k.cross(K))
    }
}

impl Corrected<f64> {
    /// `∂η/∂ξ` and what it is made of.
    #[inline]
    fn slopes(&self, own: &Correction<f64>, law: &Helicoidal) -> CorrectedSlopes {
        let Self { K, G_3, m, w, gamma, rho, .. } = self;
        let square = law.length * law.length;
        let of_m: SMatrix<f64, 3, 6> = law.stiffness.fixed_rows::<3>(3).into();
        let (m_hat, w_hat) = (m.cross_matrix(), w.cross_matrix());
        let (mut of_w, mut of_eta) = (SMatrix::<f64, 3, 6>::zeros(), Matrix6::identity());
        for j in 0..6 {
            let m_j: Vector3<f64> = of_m.column(j).into();
            let mut k_j = K.cross(&m_j); // of K×m
            if j >= 3 {
                k_j -= m_hat.column(j - 3);
            }
            let w_j = own.S * k_j;
            let mut bent = K.cross(&w_j); // of K×w
            if j >= 3 {
                bent -= w_hat.column(j - 3);
            }
            of_w.set_column(j, &w_j);
            of_eta[(0, j)] -= square / 12.0 * w_j[1];
            of_eta[(1, j)] += square / 12.0 * w_j[0];
            (0..3).for_each(|i| of_eta[(3 + i, j)] += square / 24.0 * bent[i]);
        }
        let of_gamma = own.R * of_eta.fixed_rows::<2>(0);
        let of_q = 2.0 * gamma.transpose() * of_gamma;
        for j in 0..6 {
            of_eta[(2, j)] += self.slope_of_q() * of_q[j];
        }
        of_eta[(2, 2)] += G_3 / rho - 1.0;
        CorrectedSlopes { of_m, of_w, of_gamma, of_q, of_eta }
    }

    /// `Σ n_i ∂²η_i/∂ξ∂ξ`.
    fn bends(&self, own: &Correction<f64>, law: &Helicoidal, n: &Strain) -> Matrix6<f64> {
        let Self { G_3, rho, q, .. } = self;
        let (square, extension) = (law.length * law.length, n[2]);
        let CorrectedSlopes { of_m, of_w, of_gamma, of_q, .. } = self.slopes(own, law);
        // d²(K×m) = 2 dK×dm,  d²(K×w) = 2 dK×dw + K×S d²(K×m)
        let OnParts { M, of_k, .. } = self.parts(own, law, n);
        let by_K = of_k.cross_matrix() * of_m + M.cross_matrix() * of_w * (square / 24.0);
        let mut out = Matrix6::zeros();
        let mut lower = out.fixed_rows_mut::<3>(3);
        lower -= by_K;
        let mut out = out + out.transpose();
        out += (2.0 * extension * self.slope_of_q()) * of_gamma.tr_mul(&of_gamma);
        let cube = extension / (rho * rho * rho);
        out -= (0.25 * cube) * of_q.tr_mul(&of_q);
        let across = (0.5 * cube * G_3) * of_q;
        for j in 0..6 {
            out[(2, j)] -= across[j];
            out[(j, 2)] -= across[j];
        }
        out[(2, 2)] += cube * q;
        out
    }
}

pub(crate) fn join<T: Number>(G: &Vector3<T>, K: &Vector3<T>) -> Vector6<T> {
    Vector6::new(G[0], G[1], G[2], K[0], K[1], K[2])
}

pub(crate) fn split<T: Number>(strain: &Vector6<T>) -> (Vector3<T>, Vector3<T>) {
    (strain.fixed_rows::<3>(0).into(), strain.fixed_rows::<3>(3).into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_rigid::rotation;
    use vi_testkit::Sample;

    /// A node with the triad `exp(ψ n) e_I` at a point.
    fn node(x: &mut ElementCoordinates, first: usize, center: &Vector3<f64>, triad: &Matrix3<f64>) {
        x.fixed_rows_mut::<3>(first).copy_from(center);
        for i in 0..3 {
            x.fixed_rows_mut::<3>(first + 3 + 3 * i).copy_from(&triad.column(i));
        }
    }

    fn full_compliance(sample: &mut Sample) -> Matrix6<f64> {
        let half = Matrix6::from_fn(|_, _| sample.number());
        0.05 * (half * half.transpose()) + Matrix6::identity() * 0.02
    }

    fn laws(sample: &mut Sample) -> [Helicoidal; 2] {
        let compliance = full_compliance(sample);
        let C = compliance.try_inverse().unwrap();
        [Helicoidal::of_order_2(0.7, C), Helicoidal::of_order_4(0.7, &compliance).unwrap()]
    }

    /// Forms of strains that are neither small nor beyond what an element takes.
    fn some_forms(sample: &mut Sample, s: f64) -> Forms {
        let mut y = Forms::from_fn(|_, _| 0.3 * sample.number());
        (y[2], y[6]) = (1.0 + 0.2 * sample.number(), s);
        y
    }

    #[test]
    fn derivatives_match_central_differences() {
        let mut sample = Sample::new(31);
        let (e, mut worst) = (1e-5, [0.0_f64; 2]);
        for s in [0.0, 1e-3, 0.049, 0.051, 0.3, 0.7] {
            for law in laws(&mut sample) {
                let (y, n) = (some_forms(&mut sample, s + 2.0 * e), sample.array::<6>().into());
                let reference = 0.1 * Strain::from(sample.array::<6>());
                let at = |y: &Forms| law.at(y, &reference);
                let (slopes, bends) = (at(&y).slopes(), at(&y).bends(&n));
                for j in 0..FORMS {
                    let unit = Forms::ith(j, e);
                    let (plus, minus) = (at(&(y + unit)), at(&(y - unit)));
                    let slope = (plus.strain() - minus.strain()) / (2.0 * e);
                    worst[0] = worst[0].max((slope - slopes.column(j)).amax());
                    let bend = (plus.slopes() - minus.slopes()).tr_mul(&n) / (2.0 * e);
                    worst[1] = worst[1].max((bend - bends.column(j)).amax());
                }
                let asymmetry = (bends - bends.transpose()).amax();
                assert!(asymmetry < 1e-13 * bends.amax().max(1.0), "{asymmetry:e}");
            }
        }
        println!("slopes off by {:.1e}, second derivatives by {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-8 && worst[1] < 1e-7, "{worst:?}");
    }

    #[test]
    fn the_gradients_of_the_forms_are_those_of_quadratic_forms() {
        let mut sample = Sample::new(32);
        for _ in 0..50 {
            let (x, step): (ElementCoordinates, ElementCoordinates) =
                (sample.array::<24>().into(), sample.array::<24>().into());
            let difference = (forms(&(x + step), 0.4) - forms(&(x - step), 0.4)) * 0.5;
            let error = (gradients(&x, 0.4).tr_mul(&step) - difference).amax();
            assert!(error < 1e-13, "𝔹x off by {error:e}");
            let c: Forms = sample.array::<FORMS>().into();
            let (B, mut product) = (weighted_matrix(&c, 0.4), ElementCoordinates::zeros());
            for (i, j) in (0..8).flat_map(|i| (0..8).map(move |j| (i, j))) {
                let own = B[(i, j)] * x.fixed_rows::<3>(3 * j);
                let mut rows = product.fixed_rows_mut::<3>(3 * i);
                rows += own;
            }
            let error = (product - gradients(&x, 0.4) * c).amax();
            assert!(error < 1e-13, "Σ c 𝔹 x off by {error:e}");
            let error = (product - force(&x, 0.4, &c.transpose())).amax();
            assert!(error < 1e-13, "force off by {error:e}");
            let wrench = wrenches(&x, 0.4, &c.transpose());
            for node in [0, 1] {
                let rows = |of: usize| product.fixed_rows::<3>(12 * node + 3 * of).into_owned();
                let torque = |i: usize| x.fixed_rows::<3>(12 * node + 3 * i).cross(&rows(i));
                let expected = [rows(0), (1..4).map(torque).sum()];
                for (k, expected) in expected.iter().enumerate() {
                    let error = (wrench.fixed_rows::<3>(6 * node + 3 * k) - expected).amax();
                    assert!(error < 1e-13, "wrench {k} of node {node} off by {error:e}");
                }
            }
        }
    }

    /// Nodes on a helix: position and triad of constant `(G, K)` over the length of an element.
    fn on_helix(
        G: &Vector3<f64>,
        K: &Vector3<f64>,
        length: f64,
        start: &Matrix3<f64>,
    ) -> ElementCoordinates {
        let angle = K * length;
        let mut x = ElementCoordinates::zeros();
        let (first, end) = (Vector3::new(0.3, -0.2, 0.9), start * rotation::exp(&angle));
        // ∫ exp(s K) G ds = ℓ T(ℓK)ᵀ… by its series, ℓ Σ (ℓK̂)^k G/(k+1)!
        let (mut term, mut sum) = (*G * length, *G * length);
        for k in 1..60 {
            term = angle.cross(&term) / f64::from(k + 1);
            sum += term;
        }
        node(&mut x, 0, &first, start);
        node(&mut x, 12, &(first + start * sum), &end);
        x
    }

    #[test]
    fn constant_strain_is_exact() {
        let mut sample = Sample::new(33);
        let length = 0.7;
        let mut worst = 0.0_f64;
        for angle in [1e-6, 0.1, 0.44, 0.46, 1.0, 2.0, 2.6] {
            let axis = sample.vector().normalize();
            let (K, G) = (axis * (angle / length), Vector3::z() + 0.2 * sample.vector());
            let start = rotation::exp(&sample.vector());
            let y = forms(&on_helix(&G, &K, length, &start), length);
            let law: Helicoidal = Helicoidal::of_order_2(length, Matrix6::identity());
            worst = worst.max((law.helix(&y) - join(&G, &K)).amax());
        }
        println!("constant strain off by {worst:.1e}");
        assert!(worst < 1e-13, "{worst:e}");
    }

    #[test]
    fn the_discrete_slopes_give_the_change_of_the_strains() {
        let mut sample = Sample::new(34);
        for law in laws(&mut sample) {
            let reference = 0.1 * Strain::from(sample.array::<6>());
            let (from, to) = (some_forms(&mut sample, 0.02), some_forms(&mut sample, 0.2));
            let at = |y: &Forms| law.at(y, &reference).strain();
            let slopes = law.discrete_slopes([&from, &to], &reference);
            let error = (slopes * (to - from) - (at(&to) - at(&from))).amax();
            assert!(error < 1e-14, "{error:e}");
            let (e, n) = (1e-5, Strain::from(sample.array::<6>()));
            let (same, bends) = law.discrete_derivatives([&from, &to], &reference, &n);
            assert_eq!(same, slopes);
            for j in 0..FORMS {
                let at = |by| law.discrete_slopes([&from, &(to + Forms::ith(j, by))], &reference);
                let bend = (at(e) - at(-e)).tr_mul(&n) / (2.0 * e);
                let error = (bend - bends.column(j)).amax();
                assert!(error < 1e-8, "{error:e}");
            }
            let same = law.discrete_slopes([&from, &from], &reference);
            let error = (same - law.at(&from, &reference).slopes()).amax();
            assert!(error < 1e-15, "{error:e}");
        }
    }

    /// A chord that turns while the nodes do not: its tension is felt as that of the exact cubic,
    /// `w'² + γ²/5` in place of the `w'² − γ²` of one point.
    #[test]
    fn bending_within_an_element_is_taut() {
        let (EI, EA, length, slope) = (1e-4, 1e4, 0.5, 1e-3);
        let compliance =
            Matrix6::from_diagonal(&[0.0, 0.0, 1.0 / EA, 1.0 / EI, 1.0 / EI, 1.0].into());
        let law = Helicoidal::of_order_4(length, &compliance).unwrap();
        let mut x = ElementCoordinates::zeros();
        let straight = Vector3::new(slope, 0.0, 1.0) * length; // w' = slope, γ = w'
        node(&mut x, 0, &Vector3::zeros(), &Matrix3::identity());
        node(&mut x, 12, &straight, &Matrix3::identity());
        let reference = Strain::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
        let eta = law.at(&forms(&x, length), &reference).strain();
        // Γ_3 = ½ (w'² + γ²/5) = 0.6 w'² of the chord of unit slope in φ_3
        let error = eta[2] / (0.6 * slope * slope) - 1.0;
        println!("extension {:e}, off by {error:.1e}", eta[2]);
        assert!(error.abs() < 1e-6, "{error:e}");
    }
}
