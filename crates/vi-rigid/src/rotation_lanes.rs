//! Coefficients of rotations at several angles side by side ([`vi_core::lanes`]).
//!
//! ```text
//! |x| ≤ 1/4   sin x/x, (1 − cos x)/x²  by their power series
//! |x| ≤ π     the same of x/4, doubled twice:  sin 2x/2x = cos x · sin x/x,   (1 − cos 2x)/(2x)² = ½ (sin x/x)²
//! ```
//! `T(θ)⁻¹ = I − ½ θ̂ + κ θ̂²` with `κ = Σ_k |B_{2k}| |θ|^{2k−2}/(2k)!`, `k = 1, 2 …`, Bernoulli
//! numbers `B_{2k}`.

use vi_core::lanes::{Lanes, Register};

/// Terms of the longer series; the first terms left out are below 1e-18 of the sums.
const TERMS: usize = 9;

/// `1/((2k+2)(2k+3))`, `1/((2k+3)(2k+4))`, `k = 0, 1 …`: ratios of neighbouring terms.
const RATIOS: [[f64; TERMS - 1]; 2] = {
    let mut ratios = [[0.0; TERMS - 1]; 2];
    let mut k = 0;
    while k < TERMS - 1 {
        let n = (2 * k + 2) as f64;
        ratios[0][k] = 1.0 / (n * (n + 1.0));
        ratios[1][k] = 1.0 / ((n + 1.0) * (n + 2.0));
        k += 1;
    }
    ratios
};

/// Coefficients of the power series in `x²`.
const SERIES: [[f64; TERMS]; 2] = {
    let mut series = [[1.0; TERMS], [0.5; TERMS]];
    let mut k = 1;
    while k < TERMS {
        series[0][k] = -series[0][k - 1] * RATIOS[0][k - 1];
        series[1][k] = -series[1][k - 1] * RATIOS[1][k - 1];
        k += 1;
    }
    series
};

/// `|B_{2k}|/(2k)!`, `k = 1, 2 …`.
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

#[inline(always)]
fn series<R: Register, const N: usize>(lanes: R, c: &[f64; TERMS], square: R::Lanes) -> R::Lanes {
    let mut sum = lanes.splat(c[N - 1]);
    for k in 0..N - 1 {
        sum = sum * square + lanes.splat(c[N - 2 - k]);
    }
    sum
}

/// `sin x/x` and `(1 − cos x)/x²` of `x² = square`, for `|x| ≤ π`.
#[inline(always)]
pub fn coefficients<R: Register>(lanes: R, square: R::Lanes) -> [R::Lanes; 2] {
    let mut largest = square.at(0);
    for k in 1..R::Lanes::COUNT {
        largest = if square.at(k) > largest { square.at(k) } else { largest };
    }
    if largest <= 1.0 / 16.0 {
        let [sine, gap] = &SERIES;
        return [series::<R, 7>(lanes, sine, square), series::<R, 7>(lanes, gap, square)];
    }
    doubled(lanes, square)
}

/// By the series of a quarter of the angle.
#[inline(always)]
fn doubled<R: Register>(lanes: R, square: R::Lanes) -> [R::Lanes; 2] {
    let mut square = square * (1.0 / 16.0);
    let mut sinc = series::<R, TERMS>(lanes, &SERIES[0], square);
    let mut gap = series::<R, TERMS>(lanes, &SERIES[1], square);
    for _ in 0..2 {
        let cosine = lanes.splat(1.0) - square * gap;
        gap = sinc * sinc * 0.5;
        sinc = sinc * cosine;
        square = square * 4.0;
    }
    [sinc, gap]
}

/// `κ` of `|θ|² = square`, to 1e-4 at `|θ| = π` and to round-off below 0.1 rad.
#[inline(always)]
pub fn kappa<R: Register>(lanes: R, square: R::Lanes) -> R::Lanes {
    let mut sum = lanes.splat(KAPPA[KAPPA.len() - 1]);
    for k in 1..KAPPA.len() {
        sum = sum * square + lanes.splat(KAPPA[KAPPA.len() - 1 - k]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rotation::{self, MAX_ROTATION, cosine_gap, sinc};
    use nalgebra::Vector3;
    use vi_core::lanes::Plain;

    #[test]
    fn coefficients_are_those_of_single_angles() {
        let (mut worst, mut bound) = ([0.0_f64; 2], [0.0_f64; 2]); // below a radian, and all
        for i in 0..4000 {
            let largest = MAX_ROTATION * f64::from(i) / 3999.0;
            let angle = |k: usize| largest / (k + 1) as f64;
            let [s, g] = coefficients(Plain, Plain.gather(|k| angle(k) * angle(k)));
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
    fn kappa_inverts_the_tangent() {
        for (angle, accuracy) in [(0.1, 1e-15), (1.0, 1e-11), (2.0, 1e-7), (3.1, 1e-3)] {
            let theta = Vector3::new(0.6, -0.48, 0.64) * angle;
            let hat = rotation::skew(&theta);
            let kappa = kappa(Plain, Plain.splat(angle * angle)).at(0);
            let inverse = nalgebra::Matrix3::identity() - hat * 0.5 + hat * hat * kappa;
            let error =
                (rotation::tangent(&theta) * inverse - nalgebra::Matrix3::identity()).amax();
            assert!(error < accuracy, "|θ| = {angle}: {error:e}");
        }
    }
}
