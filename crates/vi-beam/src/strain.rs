//! Strains of the two-node element: homogeneous quadratic forms of its coordinates.
//!
//! ```text
//! Γ_I = d̄_I·φ' − (·)_0                 d̄_I = ½(d_I^a + d_I^b),   (·)' = ((·)^b − (·)^a)/ℓ
//! K_1 = ½(d̄_3·d_2' − d̄_2·d_3') − (·)_0 = (d_3^a·d_2^b − d_2^a·d_3^b)/(2ℓ) − (·)_0,   cyclic
//! ε_i = ½ xᵀ𝔹_i x − ε_i0,     𝔹_i = B_i ⊗ I_3 constant, symmetric;     ∇ε_i = 𝔹_i x
//! ```
//! `Γ_1, Γ_2` shear, `Γ_3` extension, `K_1, K_2` bending about `d_1, d_2`, `K_3` twist. Invariant
//! under rigid motions for any `x`, orthonormal or not. In the closed form of `K` the products of
//! directors of one node have cancelled: no digit is lost on fine meshes except in
//! `φ' = (φ^b − φ^a)/ℓ`.
//!
//! Letters: `x = (φ^a, d_1^a, d_2^a, d_3^a, φ^b, d_1^b, d_2^b, d_3^b) ∈ R^24` element coordinates,
//! `ε = (Γ_1, Γ_2, Γ_3, K_1, K_2, K_3)`, `ℓ` reference length (m). Of numbers with tangents they
//! change with coordinates and length.
//!
//! Source: theory §6; Betsch & Steinmann, IJNME 54 (2002) 1775–1788.
#![allow(non_snake_case)] // B: the matrix of a strain

use nalgebra::{SMatrix, SVector, Vector3};
use vi_core::Number;

/// Coordinates of an element: two frames.
pub const SIZE: usize = 24;
/// Strains of an element.
pub const STRAINS: usize = 6;

/// `x`, the coordinates of both nodes.
pub type ElementCoordinates<T = f64> = SVector<T, SIZE>;
/// `ε = (Γ_1, Γ_2, Γ_3, K_1, K_2, K_3)`: 1 and 1/m.
pub type Strain<T = f64> = SVector<T, STRAINS>;
/// Columns `𝔹_i x`, the gradients of the strains.
pub type StrainGradients<T = f64> = SMatrix<T, SIZE, STRAINS>;

/// Slots of `K_1, K_2, K_3`: `K = (x_p·x_q − x_r·x_s)/(2ℓ)` with vectors numbered `φ^a` 0 …
/// `d_3^b` 7.
const CURVATURE: [[usize; 4]; 3] = [[3, 6, 2, 7], [1, 7, 3, 5], [2, 5, 1, 6]];

fn vector<T: Number>(x: &ElementCoordinates<T>, slot: usize) -> Vector3<T> {
    x.fixed_rows::<3>(3 * slot).into()
}

/// `½ xᵀ𝔹_i x` for all six strains: the strains before the reference values are taken off.
#[must_use]
pub fn forms<T: Number>(x: &ElementCoordinates<T>, length: T) -> Strain<T> {
    let slope = (vector(x, 4) - vector(x, 0)) / length;
    let half = T::of(0.5) / length;
    let mut out = Strain::zeros();
    for i in 0..3 {
        out[i] = T::of(0.5) * (vector(x, 1 + i) + vector(x, 5 + i)).dot(&slope); // [6.4]
        let [p, q, r, s] = CURVATURE[i];
        out[3 + i] = half * (vector(x, p).dot(&vector(x, q)) - vector(x, r).dot(&vector(x, s)));
    }
    out
}

/// Columns `𝔹_i x`.
#[must_use]
pub fn gradients<T: Number>(x: &ElementCoordinates<T>, length: T) -> StrainGradients<T> {
    let mut out = StrainGradients::zeros();
    let half = T::of(0.5) / length;
    let half_slope = (vector(x, 4) - vector(x, 0)) * half;
    for i in 0..3 {
        let mean = (vector(x, 1 + i) + vector(x, 5 + i)) * half; // d̄_I/ℓ
        let mut set = |strain: usize, slot: usize, value: &Vector3<T>| {
            out.fixed_view_mut::<3, 1>(3 * slot, strain).copy_from(value);
        };
        set(i, 0, &-mean); // [6.5]
        set(i, 4, &mean);
        set(i, 1 + i, &half_slope);
        set(i, 5 + i, &half_slope);
        let [p, q, r, s] = CURVATURE[i];
        set(3 + i, p, &(vector(x, q) * half));
        set(3 + i, q, &(vector(x, p) * half));
        set(3 + i, r, &(vector(x, s) * -half));
        set(3 + i, s, &(vector(x, r) * -half));
    }
    out
}

/// `Σ_i n_i 𝔹_i x`, the product of the gradients with `n`, for each column `n`.
#[must_use]
pub fn force<T: Number, const N: usize>(
    x: &ElementCoordinates<T>,
    length: T,
    n: &SMatrix<T, STRAINS, N>,
) -> SMatrix<T, SIZE, N> {
    let half = T::of(0.5) / length;
    let half_slope = (vector(x, 4) - vector(x, 0)) * half;
    let sums: [Vector3<T>; 3] = std::array::from_fn(|i| vector(x, 1 + i) + vector(x, 5 + i));
    let mut force = SMatrix::<T, SIZE, N>::zeros();
    for (column, n) in n.column_iter().enumerate() {
        let (mut end, mut out) = (Vector3::zeros(), [Vector3::zeros(); 8]);
        for i in 0..3 {
            end += sums[i] * (half * n[i]); // [6.5]
            out[1 + i] += half_slope * n[i];
            out[5 + i] += half_slope * n[i];
            let ([p, q, r, s], moment) = (CURVATURE[i], half * n[3 + i]);
            out[p] += vector(x, q) * moment;
            out[q] += vector(x, p) * moment;
            out[r] -= vector(x, s) * moment;
            out[s] -= vector(x, r) * moment;
        }
        (out[0], out[4]) = (-end, end);
        let own = &mut force.as_mut_slice()[SIZE * column..SIZE * (column + 1)];
        for (own, vector) in own.chunks_exact_mut(3).zip(&out) {
            own.copy_from_slice(vector.as_slice());
        }
    }
    force
}

/// `Σ_i n_i B_i`, the 8×8 scalar matrix of the geometric stiffness `Σ n_i 𝔹_i`.
#[must_use]
pub fn weighted_matrix(n: &Strain, length: f64) -> SMatrix<f64, 8, 8> {
    let mut B = SMatrix::<f64, 8, 8>::zeros();
    let half = 0.5 / length;
    let mut add = |i: usize, j: usize, value: f64| {
        B[(i, j)] += value;
        B[(j, i)] += value;
    };
    for i in 0..3 {
        let shear = half * n[i];
        for director in [1 + i, 5 + i] {
            add(0, director, -shear);
            add(4, director, shear);
        }
        let [p, q, r, s] = CURVATURE[i];
        add(p, q, half * n[3 + i]);
        add(r, s, -half * n[3 + i]);
    }
    B
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_rigid::rotation;
    use vi_testkit::Sample;

    /// The definition of theory §6, written without simplification.
    fn definition(x: &ElementCoordinates, length: f64) -> Strain {
        let d = |i: usize| 0.5 * (vector(x, 1 + i) + vector(x, 5 + i));
        let slope = |k: usize| (vector(x, 4 + k) - vector(x, k)) / length;
        let mut out = Strain::zeros();
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            out[i] = d(i).dot(&slope(0));
            out[3 + i] = 0.5 * (d(k).dot(&slope(1 + j)) - d(j).dot(&slope(1 + k)));
        }
        out
    }

    #[test]
    fn the_closed_form_is_the_definition() {
        let mut sample = Sample::new(1);
        for _ in 0..100 {
            let x: ElementCoordinates = sample.array::<24>().into();
            let error = (forms(&x, 0.7) - definition(&x, 0.7)).amax();
            assert!(error < 1e-14, "strains off by {error:e}");
        }
    }

    #[test]
    fn gradients_and_matrices_belong_to_the_forms() {
        let mut sample = Sample::new(2);
        for _ in 0..50 {
            let (x, y): (ElementCoordinates, ElementCoordinates) =
                (sample.array::<24>().into(), sample.array::<24>().into());
            let n: Strain = sample.array::<6>().into();
            let (at, columns) = (forms(&x, 0.4), gradients(&x, 0.4));
            let homogeneous = (columns.tr_mul(&x) * 0.5 - at).amax();
            assert!(homogeneous < 2e-14, "½ xᵀ𝔹x off by {homogeneous:e}");
            // quadratic: the central difference along y is exact
            let difference = (forms(&(x + y), 0.4) - forms(&(x - y), 0.4)) * 0.5;
            let error = (columns.tr_mul(&y) - difference).amax();
            assert!(error < 1e-13, "𝔹x off by {error:e}");
            let B = weighted_matrix(&n, 0.4);
            let mut product = ElementCoordinates::zeros();
            for (i, j) in (0..8).flat_map(|i| (0..8).map(move |j| (i, j))) {
                let mut rows = product.fixed_rows_mut::<3>(3 * i);
                rows += B[(i, j)] * vector(&x, j);
            }
            let error = (product - columns * n).amax();
            assert!(error < 1e-13, "Σ n 𝔹 x off by {error:e}");
            let error = (force(&x, 0.4, &n) - columns * n).amax();
            assert!(error < 1e-13, "force off by {error:e}");
        }
    }

    #[test]
    fn rigid_motions_leave_the_strains() {
        let mut sample = Sample::new(3);
        let mut worst = 0.0_f64;
        for _ in 0..200 {
            let x: ElementCoordinates = sample.array::<24>().into();
            let (turn, shift) = (rotation::exp(&(3.0 * sample.vector())), sample.vector());
            let mut moved = ElementCoordinates::zeros();
            for slot in 0..8 {
                let shift = if slot % 4 == 0 { shift } else { Vector3::zeros() };
                let image = turn * vector(&x, slot) + shift;
                moved.fixed_rows_mut::<3>(3 * slot).copy_from(&image);
            }
            worst = worst.max((forms(&moved, 1.0) - forms(&x, 1.0)).amax());
        }
        println!("strains change by {worst:.1e} under rigid motions");
        assert!(worst < 1e-14, "{worst:e}");
    }

    #[test]
    fn curvature_turns_the_triad_about_its_own_director() {
        for i in 0..3 {
            let mut x = ElementCoordinates::zeros();
            let turn = rotation::exp(&(0.3 * Vector3::ith(i, 1.0)));
            for k in 0..3 {
                x.fixed_rows_mut::<3>(3 + 3 * k).copy_from(&Vector3::ith(k, 1.0));
                x.fixed_rows_mut::<3>(15 + 3 * k).copy_from(&turn.column(k));
            }
            let found = forms(&x, 0.5);
            let error = (found[3 + i] - 0.3_f64.sin() / 0.5).abs();
            assert!(error < 1e-15, "K_{} = {}", i + 1, found[3 + i]);
        }
    }
}
