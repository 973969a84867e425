//! Screws as the unknowns of free roots.
//!
//! ```text
//! θ = D y_θ,  u_φ = T(θ) D y_φ        with the directors D of q_n
//! J ← J ∂(u_φ, θ)/∂(y_φ, y_θ),        ∂(u_φ, θ)/∂(y_φ, y_θ) = [T D, B D; 0, D],  B = ∂(T(θ)w)/∂θ,  w = D y_φ
//! ```
#![allow(non_snake_case)] // J, T, B, D

use crate::pair::PairKind;
use crate::tree::{Link, Tree};
use nalgebra::{Matrix3, Vector3, Vector6};
use vi_rigid::{directors, rotation};

/// Free roots: `(u_φ, θ) ← (T(D y_θ) D y_φ, D y_θ)` with the triad `D` of the root at `q`.
pub(super) fn to_increments(tree: &Tree, q: &[f64], y: &mut [f64]) {
    for link in tree.links().iter().filter(|link| link.joint.kind == PairKind::Free) {
        let own = &mut y[link.offset..link.offset + 6];
        let (w, theta) = screw(&directors::triad(&q[12 * link.frame..]), own);
        own[..3].copy_from_slice((rotation::tangent(&theta) * w).as_slice());
        own[3..].copy_from_slice(theta.as_slice());
    }
}

/// `J ← J ∂(u_φ, θ)/∂(y_φ, y_θ)` in the six columns of a free root, at the screws `y` of all and the triads of `q`;
/// without `y`: at zero, without `B`.
pub(super) fn chain(root: &Link, (q, y): (&[f64], Option<&[f64]>), columns: &mut [Vector6<f64>]) {
    let triad = directors::triad(&q[12 * root.frame..]);
    let (T, B) = match y {
        None => (Matrix3::identity(), Matrix3::zeros()),
        Some(y) => {
            let (w, theta) = screw(&triad, &y[root.offset..root.offset + 6]);
            (rotation::tangent(&theta), tangent_derivative(&theta, &w))
        }
    };
    let (TD, BD) = (T * triad, B * triad);
    let J: [Vector6<f64>; 6] = std::array::from_fn(|k| columns[k]);
    for k in 0..3 {
        columns[k] = (0..3).map(|l| J[l] * TD[(l, k)]).sum();
        columns[3 + k] = (0..3).map(|l| J[l] * BD[(l, k)] + J[3 + l] * triad[(l, k)]).sum();
    }
}

/// `(w, θ) = (D y_φ, D y_θ)`.
fn screw(triad: &Matrix3<f64>, y: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
    (triad * Vector3::new(y[0], y[1], y[2]), triad * Vector3::new(y[3], y[4], y[5]))
}

/// `B = ∂(T(θ)w)/∂θ` with `T = I + a θ̂ + b θ̂²`, `a = (1 − cos x)/x²`, `b = (x − sin x)/x³`, `x = |θ|`:
/// `B dθ = (a'/x θ×w + b'/x θ×(θ×w)) (θ·dθ) + a dθ×w + b (dθ×(θ×w) + θ×(dθ×w))`.
fn tangent_derivative(theta: &Vector3<f64>, w: &Vector3<f64>) -> Matrix3<f64> {
    let square = theta.norm_squared();
    let x = square.sqrt();
    let (a, b) = (rotation::cosine_gap(x), rotation::sine_gap(x));
    // a'/x = (b x² − a − … ) has no accurate closed form near zero: series up to x = 1
    let (da, db) = if square < 1.0 {
        let series = |first: f64, step: f64| {
            // Σ (−1)^{k+1} (2k+2)/(2k+4)! x^{2k} and with (2k+5)!
            let (mut term, mut sum) = (first, 0.0);
            for k in 0..9 {
                let k = f64::from(k);
                sum -= (2.0 * k + 2.0) * term;
                term *= -square / ((2.0 * k + 5.0 + step) * (2.0 * k + 6.0 + step));
            }
            sum
        };
        (series(1.0 / 24.0, 0.0), series(1.0 / 120.0, 1.0))
    } else {
        let (sin, cos) = libm::sincos(x);
        ((sin / x - 2.0 * a) / square, ((1.0 - cos) / square - 3.0 * b) / square)
    };
    let hat = rotation::skew(theta);
    let (once, twice) = (hat * w, hat * (hat * w));
    let along = (da * once + db * twice) * theta.transpose();
    along - a * rotation::skew(w) - b * (rotation::skew(&once) + hat * rotation::skew(w))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_of_the_tangent_map() {
        let (direction, w) = (Vector3::new(0.6, -0.48, 0.64), Vector3::new(0.4, 1.1, -0.7));
        let mut worst = 0.0_f64;
        for angle in [0.0, 1e-3, 0.3, 0.999, 1.001, 2.0, 3.1] {
            let theta = angle * direction;
            let exact = tangent_derivative(&theta, &w);
            for k in 0..3 {
                let e = 1e-5 * Vector3::ith(k, 1.0);
                let change = rotation::tangent(&(theta + e)) - rotation::tangent(&(theta - e));
                worst = worst.max((change * w / 2e-5 - exact.column(k)).amax());
            }
        }
        println!("∂(T(θ)w)/∂θ off by {worst:.1e}");
        assert!(worst < 1e-9, "{worst:e}");
    }
}
