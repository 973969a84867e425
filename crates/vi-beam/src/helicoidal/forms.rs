//! The quadratic forms of which helicoidal strains are functions, and what acts on them.
#![allow(non_snake_case)] // B

use crate::strain::{self, ElementCoordinates, SIZE, Strain};
use nalgebra::{SMatrix, SVector, Vector3};
use vi_core::Number;

/// How many quadratic forms the strains are functions of.
pub const FORMS: usize = 7;
/// `y = (g, a, s)`, without units.
pub type Forms<T = f64> = SVector<T, FORMS>;
/// `∂η/∂y`.
pub type StrainSlopes<T = f64> = SMatrix<T, 6, FORMS>;
/// `Σ n_i ∂²η_i/∂y∂y`.
pub type Bends<T = f64> = SMatrix<T, FORMS, FORMS>;

/// `y` of coordinates.
#[must_use]
#[inline]
pub fn forms<T: Number>(x: &ElementCoordinates<T>, length: T) -> Forms<T> {
    let mean = strain::forms(x, length);
    let mut y = Forms::zeros();
    for i in 0..3 {
        (y[i], y[3 + i]) = (mean[i], length * mean[3 + i]);
    }
    for k in 3..12 {
        y[6] += T::of(0.125) * (x[12 + k] - x[k]) * (x[12 + k] - x[k]);
    }
    y
}

/// Columns `𝔹_k x`, the gradients of the forms.
#[must_use]
pub fn gradients<T: Number>(x: &ElementCoordinates<T>, length: T) -> SMatrix<T, SIZE, FORMS> {
    force(&x.data.0[0], length, &Bends::identity())
}

/// Columns `Σ_k c_ik 𝔹_k x`, one for each row of `c`: of `∂η/∂y` they are the columns `∇η_i`.
#[must_use]
#[inline]
pub fn force<T: Number, const N: usize>(
    x: &[T; SIZE],
    length: T,
    c: &SMatrix<T, N, FORMS>,
) -> SMatrix<T, SIZE, N> {
    let (half, small) = (T::of(0.5), T::of(0.25));
    let over = half / length;
    let mut rows = [[T::of(0.0); N]; SIZE];
    for k in 0..3 {
        let (a, b) = (|i: usize| x[3 + 3 * i + k], |i: usize| x[15 + 3 * i + k]);
        let mean = |i: usize| (over * (a(i) + b(i)), i);
        rows[12 + k] = combination([mean(0), mean(1), mean(2)], c); // [6.5]
        rows[k] = rows[12 + k].map(|own| -own);
        let slope = over * (x[12 + k] - x[k]);
        for i in 0..3 {
            let (next, last) = ((i + 1) % 3, (i + 2) % 3);
            let (of_next, of_last, turn) = (3 + next, 3 + last, small * (b(i) - a(i)));
            let to_b = [(half * b(last), of_next), (-half * b(next), of_last)];
            let to_a = [(-half * a(last), of_next), (half * a(next), of_last)];
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
    let force = [0, 1, 2].map(|i| (a[i] + b[i]) * (0.5 / length));
    let [of_a, of_b] = [a, b].map(|own| own.map(|d| d.cross(&half_slope)));
    let turns = [0, 1, 2].map(|i| {
        let (m, l) = ((i + 1) % 3, (i + 2) % 3);
        (a[l].cross(&b[m]) - a[m].cross(&b[l])) * 0.5
    });
    let relative = (a[0].cross(&b[0]) + a[1].cross(&b[1]) + a[2].cross(&b[2])) * -0.25;
    let mut out = SMatrix::zeros();
    for (j, column) in out.data.0.iter_mut().enumerate() {
        let c = |k: usize| c[(j, k)];
        let sum = |v: &[Vector3<f64>; 3], k: usize| v[0] * c(k) + v[1] * c(k + 1) + v[2] * c(k + 2);
        let (force, turn) = (sum(&force, 0), sum(&turns, 3) + relative * c(6));
        let parts = [-force, sum(&of_a, 0) + turn, force, sum(&of_b, 0) - turn];
        column.as_chunks_mut().0.iter_mut().zip(parts).for_each(|(own, part)| *own = part.into());
    }
    out
}

/// The sum of some columns of `c` with their factors.
#[inline]
fn combination<T: Number, const N: usize, const TERMS: usize>(
    terms: [(T, usize); TERMS],
    c: &SMatrix<T, N, FORMS>,
) -> [T; N] {
    let mut sum = [T::of(0.0); N];
    for (factor, k) in terms {
        for (sum, own) in sum.iter_mut().zip(&c.data.0[k]) {
            *sum += factor * *own;
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
