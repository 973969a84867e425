//! The mean direction of a slip that changes from one velocity to another.
//!
//! ```text
//! s̄ = ∫_0^1 v/|v| dτ,   v = s_0 + τ (s_1 − s_0) = w + x e,   x from p to q
//! s̄ = e (p + q)/(|s_0| + |s_1|) + w [asinh(x/b)]_p^q/l
//! ∂s̄/∂s_1 = ∫_0^1 τ (I − v vᵀ/v²)/|v| dτ
//! ```
//! Letters: `l = |s_1 − s_0|`, `e` its direction, `p = s_0·e`, `q = s_1·e`, `w = s_0 − p e`,
//! `b = |w|`. Along a line it is `(s_0 + s_1)/(|s_0| + |s_1|)` of [N6] where the slip turns back.

/// `s̄`, and `∂s̄/∂s_1` row by row, s/m.
pub(super) fn mean_direction(s_0: [f64; 2], s_1: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
    /// Parts of a velocity below which a change turns the direction to first order.
    const SLIGHT: f64 = 1e-4;
    /// The least distance from zero that a line passes at, in parts of its length.
    const LEAST: f64 = 1e-9;
    let change = [s_1[0] - s_0[0], s_1[1] - s_0[1]];
    let [l, first, last] = [change, s_0, s_1].map(|v| libm::hypot(v[0], v[1]));
    if first.max(last) == 0.0 {
        return ([0.0; 2], [[0.0; 2]; 2]);
    }
    if l == 0.0 {
        return (s_0.map(|s| s / first), at_one(s_0, 0.5));
    }
    let e = change.map(|c| c / l);
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let (p, q) = (dot(s_0, e), dot(s_1, e));
    let w = [s_0[0] - p * e[0], s_0[1] - p * e[1]];
    let b = libm::hypot(w[0], w[1]).max(LEAST * l);
    let turned = libm::asinh(match p * q > 0.0 {
        // the same without a difference of numbers that are alike
        true => l * (p + q) / (q * first + p * last),
        false => (q * first - p * last) / (b * b),
    });
    let along = (p + q) / (first + last);
    let mean = [0, 1].map(|i| e[i] * along + w[i] * (turned / l));
    if l < SLIGHT * first.max(last) {
        return (mean, at_one([0.5 * (s_0[0] + s_1[0]), 0.5 * (s_0[1] + s_1[1])], 0.5));
    }
    let f = [-e[1], e[0]];
    let side = if dot(w, f) < 0.0 { -1.0 } else { 1.0 };
    let [r_p, r_q] = [p, q].map(|x| libm::hypot(x, b));
    // ∫ x^n/r³ dx
    let a_0 = (q / r_q - p / r_p) / (b * b);
    let a_1 = 1.0 / r_p - 1.0 / r_q;
    let a_2 = turned - (q / r_q - p / r_p);
    let a_3 = r_q - r_p + b * b * (1.0 / r_q - 1.0 / r_p);
    let square = l * l;
    let ee = b * b * (a_1 - p * a_0) / square;
    let ef = -side * b * (a_2 - p * a_1) / square;
    let ff = (a_3 - p * a_2) / square;
    let slope = [0, 1].map(|i| {
        [0, 1].map(|j| ee * e[i] * e[j] + ef * (e[i] * f[j] + f[i] * e[j]) + ff * f[i] * f[j])
    });
    (mean, slope)
}

/// `scale (I − v vᵀ/v²)/|v|`.
fn at_one(v: [f64; 2], scale: f64) -> [[f64; 2]; 2] {
    let size = libm::hypot(v[0], v[1]);
    let unit = v.map(|v| v / size);
    let entry = |i: usize, j: usize| f64::from(u8::from(i == j)) - unit[i] * unit[j];
    [0, 1].map(|i| [0, 1].map(|j| scale * entry(i, j) / size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vi_testkit::Sample;

    /// Against sums over many points, and the derivative against differences.
    #[test]
    fn the_mean_direction_is_that_of_the_integral() {
        let mut worst = [0.0_f64; 2];
        for seed in 0..300 {
            let mut sample = Sample::new(seed);
            let s_0: [f64; 2] = sample.array();
            let mut s_1: [f64; 2] = sample.array();
            if seed % 3 == 0 {
                s_1 = [s_0[0] + 0.01 * s_1[0], s_0[1] + 0.01 * s_1[1]];
            }
            let (mean, slope) = mean_direction(s_0, s_1);
            let count = 200_000;
            let mut sum = [0.0; 2];
            for k in 0..count {
                let part = (f64::from(k) + 0.5) / f64::from(count);
                let v = [0, 1].map(|i| s_0[i] + part * (s_1[i] - s_0[i]));
                let size = libm::hypot(v[0], v[1]);
                (0..2).for_each(|i| sum[i] += v[i] / size / f64::from(count));
            }
            for i in 0..2 {
                worst[0] = worst[0].max((mean[i] - sum[i]).abs());
                for j in 0..2 {
                    let step = 1e-6;
                    let at = |shift: f64| {
                        let mut s_1 = s_1;
                        s_1[j] += shift;
                        mean_direction(s_0, s_1).0[i]
                    };
                    let difference = (at(step) - at(-step)) / (2.0 * step);
                    let size = 1.0 + slope[i][j].abs();
                    worst[1] = worst[1].max((difference - slope[i][j]).abs() / size);
                }
            }
        }
        println!("means to {:.1e}, slopes to {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-6 && worst[1] < 1e-3, "{worst:?}");
        let (back, slope) = mean_direction([2.0, 0.0], [-1.0, 0.0]);
        assert!((back[0] - 1.0 / 3.0).abs() < 1e-15 && back[1] == 0.0, "{back:?}");
        assert!((slope[0][0] - 4.0 / 9.0).abs() < 1e-12, "{slope:?}");
    }
}
