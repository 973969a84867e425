//! Sums over vectors whose last bits do not depend on the machine.

/// `x · y`, summed in eight interleaved parts. Premise: both have the same length.
#[must_use]
#[inline(always)]
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    let mut parts = [0.0; 8];
    let (xs, ys) = (x.chunks_exact(8), y.chunks_exact(8));
    let rest: f64 = xs.remainder().iter().zip(ys.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in xs.zip(ys) {
        for k in 0..8 {
            parts[k] += x[k] * y[k];
        }
    }
    let [a, b, c, d, e, f, g, h] = parts;
    (((a + b) + (c + d)) + ((e + f) + (g + h))) + rest
}

/// The largest absolute value; NaN if any entry is NaN (unlike a fold with `f64::max`).
#[must_use]
#[inline]
pub fn norm_inf(x: &[f64]) -> f64 {
    // absolute values are ordered as their bits are, and NaN is above infinity
    f64::from_bits(x.iter().map(|v| v.abs().to_bits()).max().unwrap_or(0))
}
