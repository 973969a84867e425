//! From 0 to 1 with two continuous derivatives.
//!
//! ```text
//! s(ξ) = 10 ξ³ − 15 ξ⁴ + 6 ξ⁵ within [0, 1], constant outside;   s' = s'' = 0 at both ends
//! ```

/// `[a s, b s', c s'']` at `x` for the factors `[a, b, c]`.
pub(crate) fn smooth_step(x: f64, [a, b, c]: [f64; 3]) -> [f64; 3] {
    let x = x.clamp(0.0, 1.0);
    let y = 1.0 - x;
    [
        a * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x),
        b * 30.0 * x * x * y * y,
        c * 60.0 * x * y * (y - x),
    ]
}
