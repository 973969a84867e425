//! Rotations by the exponential map.
//!
//! ```text
//! exp θ̂      = I + sin|θ|/|θ| θ̂ + (1 − cos|θ|)/|θ|² θ̂²                        Rodrigues
//! T(θ)       = I + (1 − cos|θ|)/|θ|² θ̂ + (|θ| − sin|θ|)/|θ|³ θ̂²
//! δ(exp θ̂)   = \widehat{T(θ) δθ} exp θ̂
//! det T(θ)   = 2 (1 − cos|θ|)/|θ|²
//! ```
//! Letters: `θ` rotation vector (rad), `θ̂` its skew matrix, `θ̂ b = θ × b`. `T` turns the rate of
//! the rotation vector into the spatial angular velocity. `det T = 0` first at `|θ| = 2π`; a step
//! may turn a body by [`MAX_ROTATION`] at most.
//!
//! Round-off: a time step is divided by `h`, so `exp θ̂ − I` is formed from its own coefficients
//! and never by subtracting the identity. The three coefficients are good to round-off relative to
//! themselves on the whole range `[0, π]`; none of them is formed from `1 − cos`.
//!
//! Source: LMO08 §4, eq. (61).

#![allow(non_snake_case)] // R, T, X: the matrices of the formulas above

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use vi_core::lanes::Lanes;

/// Largest rotation in one step, rad.
pub const MAX_ROTATION: f64 = std::f64::consts::PI;

/// `sin x / x`; the quotient is good to round-off for every `x`, however small.
#[must_use]
pub fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { libm::sin(x) / x }
}

/// `(1 − cos x)/x² = ½ (sin(x/2)/(x/2))²`.
#[must_use]
pub fn cosine_gap(x: f64) -> f64 {
    let half = sinc(0.5 * x);
    0.5 * half * half
}

/// `x²` up to which [`kappa`] is a polynomial.
const KAPPA_SMALL: f64 = 1e-4;

/// `x²` up to which [`small_coefficients`] are used.
const SMALL: f64 = 1.0 / 16.0;

/// `sin x / x` and `(1 − cos x)/x²` from `x² ≤ 1/16` by their power series, without a root or a
/// sine; the first terms left out are below `2e-18` of the sums.
#[inline(always)]
fn small_coefficients<L: Lanes>(square: L) -> [L; 2] {
    const SINC: [f64; 7] = [
        1.0,
        -1.0 / 6.0,
        1.0 / 120.0,
        -1.0 / 5040.0,
        1.0 / 362_880.0,
        -1.0 / 39_916_800.0,
        1.0 / 6_227_020_800.0,
    ];
    const GAP: [f64; 7] = [
        1.0 / 2.0,
        -1.0 / 24.0,
        1.0 / 720.0,
        -1.0 / 40_320.0,
        1.0 / 3_628_800.0,
        -1.0 / 479_001_600.0,
        1.0 / 87_178_291_200.0,
    ];
    let (mut sinc, mut gap) = (square.like(SINC[6]), square.like(GAP[6]));
    for k in (0..6).rev() {
        sinc = sinc * square + square.like(SINC[k]);
        gap = gap * square + square.like(GAP[k]);
    }
    [sinc, gap]
}

/// `sin x / x` and `(1 − cos x)/x²` of `x² = square`.
#[must_use]
#[inline]
pub fn coefficients(square: f64) -> [f64; 2] {
    if square <= SMALL {
        return small_coefficients(square);
    }
    let angle = square.sqrt();
    [sinc(angle), cosine_gap(angle)]
}

/// [`coefficients`] of each of several numbers, with the same bits.
#[must_use]
#[inline(always)]
pub fn coefficients_of_each<L: Lanes>(square: L) -> [L; 2] {
    if square.are_at_most(SMALL) {
        return small_coefficients(square);
    }
    [square.map(|square| coefficients(square)[0]), square.map(|square| coefficients(square)[1])]
}

/// [`coefficients`] of each of several numbers without a sine, for `|x| ≤ π`: those of `x/8`,
/// doubled three times. Good to a few units of round-off.
///
/// ```text
/// sin 2x/2x = cos x · sin x/x,   (1 − cos 2x)/(2x)² = ½ (sin x/x)²
/// ```
#[must_use]
#[inline(always)]
pub fn coefficients_by_doubling<L: Lanes>(square: L) -> [L; 2] {
    if square.are_at_most(SMALL) {
        return small_coefficients(square);
    }
    let mut square = square * (1.0 / 64.0);
    let [mut sinc, mut gap] = small_coefficients(square); // to 2e-18 here, too
    for _ in 0..3 {
        let cosine = square.like(1.0) - square * gap;
        gap = sinc * sinc * 0.5;
        sinc = sinc * cosine;
        square = square * 4.0;
    }
    [sinc, gap]
}

/// `(x − sin x)/x³`.
///
/// Power series `1/6 (1 − x²/(4·5) (1 − x²/(6·7) (1 − …)))` up to `x = 2`, where the difference in
/// the numerator no longer loses a digit.
#[must_use]
pub fn sine_gap(x: f64) -> f64 {
    /// `1/((2k+4)(2k+5))`; the first term left out is below `1e-20` of the sum.
    const RECIPROCALS: [f64; 12] = [
        1.0 / 20.0,
        1.0 / 42.0,
        1.0 / 72.0,
        1.0 / 110.0,
        1.0 / 156.0,
        1.0 / 210.0,
        1.0 / 272.0,
        1.0 / 342.0,
        1.0 / 420.0,
        1.0 / 506.0,
        1.0 / 600.0,
        1.0 / 702.0,
    ];
    let square = x * x;
    if square <= 4.0 {
        RECIPROCALS.iter().rev().fold(1.0, |sum, r| 1.0 - square * r * sum) / 6.0
    } else {
        (x - libm::sin(x)) / (square * x)
    }
}

/// `(1 − (x/2) cot(x/2))/x²` of `x² = square`, on `[0, π]`: `T(θ)⁻¹ = I − ½ θ̂ + κ θ̂²` with this
/// `κ`. The product `κ x²` is good to round-off relative to 1.
#[must_use]
#[inline]
pub fn kappa(square: f64) -> f64 {
    if square <= KAPPA_SMALL {
        return small_kappa(square);
    }
    let [sinc, gap] = coefficients(square);
    (1.0 - 0.5 * sinc / gap) / square
}

/// [`kappa`] of small angles by its power series; the next term is `x⁴/30240`.
#[inline(always)]
fn small_kappa<L: Lanes>(square: L) -> L {
    square.like(1.0 / 12.0) + square.over(square.like(720.0))
}

/// [`kappa`] of each of several numbers, with the same bits.
#[must_use]
#[inline(always)]
pub fn kappa_of_each<L: Lanes>(square: L) -> L {
    if square.are_at_most(KAPPA_SMALL) {
        return small_kappa(square);
    }
    square.map(kappa)
}

/// [`kappa`] of each of several numbers by its power series `Σ_k |B_2k| x^(2k−2)/(2k)!` with
/// Bernoulli numbers `B_2k`: to `1e-4` at `x = π`, to round-off below 0.1. Corrections of Newton's
/// method need no more.
#[must_use]
#[inline(always)]
pub fn kappa_by_series<L: Lanes>(square: L) -> L {
    const KAPPA: [f64; 8] = [
        1.0 / 12.0,
        1.0 / 720.0,
        1.0 / 30_240.0,
        1.0 / 1_209_600.0,
        1.0 / 47_900_160.0,
        691.0 / 1_307_674_368_000.0,
        1.0 / 74_724_249_600.0,
        3617.0 / 10_670_622_842_880_000.0,
    ];
    let mut sum = square.like(KAPPA[7]);
    for k in (0..7).rev() {
        sum = sum * square + square.like(KAPPA[k]);
    }
    sum
}

/// The skew matrix `v̂` with `v̂ b = v × b`.
#[must_use]
#[inline]
pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// `v̂²`, without cancellation on the diagonal.
#[inline]
fn skew_square(v: &Vector3<f64>) -> Matrix3<f64> {
    let (xx, yy, zz) = (v.x * v.x, v.y * v.y, v.z * v.z);
    let (xy, xz, yz) = (v.x * v.y, v.x * v.z, v.y * v.z);
    Matrix3::new(-(yy + zz), xy, xz, xy, -(xx + zz), yz, xz, yz, -(xx + yy))
}

/// `exp θ̂`, the rotation by `|θ|` about `θ`.
#[must_use]
pub fn exp(theta: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::identity() + exp_minus_identity(theta)
}

/// `θ` with `exp θ̂ = R` and `|θ| ≤ π`, of a rotation matrix.
#[must_use]
pub fn vector(R: &Matrix3<f64>) -> Vector3<f64> {
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*R));
    of_quaternion(turn.scalar(), &turn.imag())
}

/// `θ` with `|θ| ≤ π` of a unit quaternion, which is `(cos(|θ|/2), sin(|θ|/2) θ/|θ|)` or its
/// negative.
fn of_quaternion(scalar: f64, imaginary: &Vector3<f64>) -> Vector3<f64> {
    let half = imaginary * 1.0_f64.copysign(scalar);
    let sine = half.norm();
    let angle = 2.0 * libm::atan2(sine, scalar.abs());
    if sine == 0.0 { Vector3::zeros() } else { half * (angle / sine) }
}

/// `θ` with `exp θ̂ = exp(then^) exp(first^)` and `|θ| ≤ π`.
#[must_use]
pub fn composed(first: &Vector3<f64>, then: &Vector3<f64>) -> Vector3<f64> {
    let quaternion = |theta: &Vector3<f64>| {
        let square = 0.25 * theta.norm_squared();
        let [sinc, gap] = coefficients(square);
        (1.0 - square * gap, theta * (0.5 * sinc))
    };
    let ((a, x), (b, y)) = (quaternion(then), quaternion(first));
    of_quaternion(a * b - x.dot(&y), &(y * a + x * b + x.cross(&y)))
}

/// `exp θ̂ − I`, accurate relative to its own size.
#[must_use]
#[inline]
pub fn exp_minus_identity(theta: &Vector3<f64>) -> Matrix3<f64> {
    let [sinc, gap] = coefficients(theta.norm_squared());
    skew(theta) * sinc + skew_square(theta) * gap
}

/// `T(θ)`: spatial angular velocity `ω = T(θ) θ̇` of the rotation `exp θ̂`.
#[must_use]
pub fn tangent(theta: &Vector3<f64>) -> Matrix3<f64> {
    let square = theta.norm_squared();
    let [_, gap] = coefficients(square);
    Matrix3::identity() + skew(theta) * gap + skew_square(theta) * sine_gap(square.sqrt())
}

/// `T(θ)⁻¹ ω`.
#[must_use]
pub fn untangent(theta: &Vector3<f64>, omega: &Vector3<f64>) -> Vector3<f64> {
    let across = theta.cross(omega);
    omega - 0.5 * across + kappa(theta.norm_squared()) * theta.cross(&across)
}

/// One Newton–Schulz step `X ← X (3I − XᵀX)/2` towards the orthogonal polar factor of `X`.
///
/// The defect `δ` of [`orthonormality_defect`] becomes `¾δ² + O(δ³)`, down to round-off.
pub fn polar_step(triad: &mut Matrix3<f64>) {
    let defect = triad.tr_mul(triad) - Matrix3::identity();
    *triad -= *triad * defect * 0.5;
}

/// `max |XᵀX − I|` over the entries; NaN if any of them is.
#[must_use]
pub fn orthonormality_defect(triad: &Matrix3<f64>) -> f64 {
    vi_core::linear::norm_inf((triad.tr_mul(triad) - Matrix3::identity()).as_slice())
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_core::lanes::{Plain, Register};
    use vi_testkit::Sample;

    /// `Σ (−1)^k x^{2k}/(2k+p)!` in double-double arithmetic, rounded once at the end.
    fn series(x: f64, p: u32) -> f64 {
        let two_sum = |a: f64, b: f64| {
            let s = a + b;
            let t = s - a;
            (s, (a - (s - t)) + (b - t))
        };
        let mul = |a: (f64, f64), b: (f64, f64)| {
            let hi = a.0 * b.0;
            two_sum(hi, a.0.mul_add(b.0, -hi) + (a.0 * b.1 + a.1 * b.0))
        };
        let div = |a: (f64, f64), n: f64| {
            let hi = a.0 / n;
            two_sum(hi, ((-hi).mul_add(n, a.0) + a.1) / n)
        };
        let square = mul((x, 0.0), (x, 0.0));
        let mut term = (1.0, 0.0);
        for k in 2..=p {
            term = div(term, f64::from(k));
        }
        let mut sum = term;
        for k in 0..25 {
            let n = f64::from((2 * k + p + 1) * (2 * k + p + 2));
            term = div(mul(term, square), -n);
            let (hi, lo) = two_sum(sum.0, term.0);
            sum = two_sum(hi, lo + sum.1 + term.1);
        }
        sum.0 + sum.1
    }

    #[test]
    fn the_coefficients_are_good_to_round_off_from_zero_to_pi() {
        let mut worst = [0.0_f64; 5];
        let mut sample = Sample::new(1);
        let mut angles: Vec<f64> =
            (0..4000).map(|_| MAX_ROTATION * 0.5 * (1.0 + sample.number())).collect();
        angles.extend((0..60).map(|k| MAX_ROTATION * 0.5_f64.powi(k)));
        angles.extend([0.0, 1e-300, 2.0, 2.0 + 4.0 * f64::EPSILON]);
        for x in angles {
            let [s, c] = coefficients(x * x);
            let values = [sinc(x), cosine_gap(x), sine_gap(x), s, c];
            for (p, value) in values.into_iter().enumerate() {
                let exact = series(x, p as u32 % 3 + 1);
                let error = if value.to_bits() == exact.to_bits() {
                    0.0
                } else {
                    ((value - exact) / exact).abs()
                };
                worst[p] = worst[p].max(error);
            }
        }
        println!("relative errors at most {worst:?}");
        for (p, worst) in worst.into_iter().enumerate() {
            assert!(worst < 5e-16, "coefficient {p}: relative error {worst:e}");
        }
    }

    #[test]
    fn doubled_coefficients_are_those_of_single_angles() {
        let (mut worst, mut bound) = ([0.0_f64; 2], [0.0_f64; 2]); // below a radian, and all
        for i in 0..4000 {
            let largest = MAX_ROTATION * f64::from(i) / 3999.0;
            let angle = |k: usize| largest / (k + 1) as f64;
            let [s, g] = coefficients_by_doubling(Plain.gather(|k| angle(k) * angle(k)));
            for k in 0..4 {
                let x = angle(k);
                worst[0] = worst[0].max((s.at(k) - sinc(x)).abs());
                worst[1] = worst[1].max((g.at(k) - cosine_gap(x)).abs() / cosine_gap(x));
                let (sine, gap) = (x * s.at(k), x * x * g.at(k));
                let defect = (sine * sine + (1.0 - gap) * (1.0 - gap) - 1.0).abs();
                bound[0] = if x < 1.0 { bound[0].max(defect) } else { bound[0] };
                bound[1] = bound[1].max(defect);
            }
        }
        println!("errors {worst:?}, sin² + cos² = 1 to {bound:?}");
        assert!(worst[0] < 5e-16 && worst[1] < 1e-15, "{worst:?}");
        assert!(bound[0] < 1e-15 && bound[1] < 3e-15, "{bound:?}");
    }

    #[test]
    fn the_series_of_kappa_inverts_the_tangent() {
        for (angle, accuracy) in [(0.1, 1e-15), (1.0, 1e-11), (2.0, 1e-7), (3.1, 1e-3)] {
            let theta = Vector3::new(0.6, -0.48, 0.64) * angle;
            let kappa = kappa_by_series(Plain.splat(angle * angle)).at(0);
            let inverse = Matrix3::identity() - skew(&theta) * 0.5 + skew_square(&theta) * kappa;
            let error = (tangent(&theta) * inverse - Matrix3::identity()).amax();
            assert!(error < accuracy, "|θ| = {angle}: {error:e}");
        }
    }

    #[test]
    fn exp_is_a_rotation_about_its_argument() {
        let mut sample = Sample::new(2);
        let mut worst = 0.0_f64;
        for _ in 0..500 {
            let angle = MAX_ROTATION * sample.number();
            let theta = sample.of_length(angle);
            let R = exp(&theta);
            worst = worst.max(orthonormality_defect(&R)).max((R.determinant() - 1.0).abs());
            worst = worst.max((R * theta - theta).norm() / 3.0);
            let cos = 0.5 * (R.trace() - 1.0);
            worst = worst.max((cos - angle.cos()).abs());
            let back = exp(&-theta) * R - Matrix3::identity();
            worst = worst.max(back.abs().max());
        }
        assert!(worst < 2e-15, "{worst:e}");
    }

    #[test]
    fn the_small_part_of_exp_keeps_its_own_precision() {
        let mut sample = Sample::new(3);
        for size in [1e-3, 1e-6, 1e-12, 1e-100, 0.0] {
            let theta = sample.of_length(size);
            let (K, D) = (skew(&theta), exp_minus_identity(&theta));
            // the exponential series; the next term is below 1e-18 of the first
            let exact = [2.0, 3.0, 4.0, 5.0].into_iter().rev().fold(K, |sum, n| K + K * sum / n);
            let error = (D - exact).abs().max();
            assert!(error <= 4e-16 * size, "|θ| = {size:e}: error {error:e}");
        }
    }

    #[test]
    fn the_tangent_is_the_derivative_of_exp() {
        let mut sample = Sample::new(4);
        let mut worst = 0.0_f64;
        for k in 0..200 {
            let angle = MAX_ROTATION * f64::from(k) / 199.0;
            let (theta, direction) = (sample.of_length(angle), sample.vector());
            let e = 1e-5;
            let plus = exp_minus_identity(&(theta + e * direction));
            let minus = exp_minus_identity(&(theta - e * direction));
            let exact = skew(&(tangent(&theta) * direction)) * exp(&theta);
            worst = worst.max(((plus - minus) / (2.0 * e) - exact).abs().max());
            let det = tangent(&theta).determinant();
            worst = worst.max((det - 2.0 * cosine_gap(angle)).abs());
            // T(θ)ᵀ exp θ̂ = T(θ): the same map in body and in spatial components
            let both = tangent(&theta).tr_mul(&exp(&theta)).transpose();
            worst =
                worst.max((exp(&theta).tr_mul(&tangent(&theta)) - tangent(&-theta)).abs().max());
            worst = worst.max((both - exp(&theta).tr_mul(&tangent(&theta))).abs().max());
        }
        assert!(worst < 1e-9, "{worst:e}");
    }

    #[test]
    fn the_inverse_of_the_tangent_undoes_it() {
        let mut sample = Sample::new(8);
        let angles = (0..=200).map(|k| MAX_ROTATION * f64::from(k) / 200.0);
        let mut worst = 0.0_f64;
        for angle in angles.chain([1e-9, 1e-3, 0.0099, 0.0101, 0.249, 0.251]) {
            let theta = sample.of_length(angle);
            let inverse = Matrix3::identity() - skew(&theta) * 0.5
                + skew_square(&theta) * kappa(theta.norm_squared());
            worst = worst.max((tangent(&theta) * inverse - Matrix3::identity()).abs().max());
        }
        assert!(worst < 2e-15, "T T⁻¹ off by {worst:e}");
    }

    #[test]
    fn the_polar_step_squares_the_defect() {
        let mut sample = Sample::new(5);
        for size in [1e-2, 1e-4, 1e-7, 1e-15] {
            let theta = sample.of_length(1.3);
            let mut X = exp(&theta);
            for x in X.iter_mut() {
                *x += size * sample.number();
            }
            let before = orthonormality_defect(&X);
            polar_step(&mut X);
            let after = orthonormality_defect(&X);
            assert!(after <= 4.0 * before * before + 2e-15, "{before:e} → {after:e}");
        }
        let mut broken = Matrix3::identity();
        broken[(1, 2)] = f64::NAN;
        assert!(orthonormality_defect(&broken).is_nan());
    }

    #[test]
    fn skew_is_the_cross_product() {
        let mut sample = Sample::new(6);
        let (a, b) = (sample.vector(), sample.vector());
        assert!((skew(&a) * b - a.cross(&b)).norm() < 1e-16);
        assert!((skew(&a) * skew(&a) - skew_square(&a)).abs().max() < 1e-15);
    }

    #[test]
    fn composed_rotation_vectors_are_those_of_the_product() {
        let mut sample = Sample::new(7);
        let mut worst = 0.0_f64;
        for size in [1e-9, 1e-3, 0.3, 1.5, 3.0] {
            for _ in 0..200 {
                let [first, then] = [sample.of_length(size), sample.of_length(0.8 * size)];
                let product = exp(&then) * exp(&first);
                let found = composed(&first, &then);
                assert!(found.norm() <= MAX_ROTATION + 1e-15, "{found:?}");
                worst = worst.max((exp(&found) - product).amax());
                let series = first + then + then.cross(&first) * 0.5;
                assert!(
                    (found - series).norm() <= size.powi(3) + 1e-15 * size,
                    "{size}: {found:?}"
                );
            }
        }
        println!("off by {worst:e}");
        assert!(worst < 3e-15, "{worst:e}");
        let theta = Vector3::new(0.3, -1.2, 0.5);
        assert_eq!(composed(&theta, &-theta), Vector3::zeros());
    }
}
