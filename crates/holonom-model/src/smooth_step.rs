//! From 0 to 1 with two continuous derivatives.
//!
//! ```text
//! s(ξ) = 10 ξ³ − 15 ξ⁴ + 6 ξ⁵ within [0, 1], constant outside;   s' = s'' = 0 at both ends
//! ```

use vi_core::Number;

/// `[a s, b s', c s'']` at `x` for the factors `[a, b, c]`.
pub(crate) fn smooth_step<T: Number>(x: T, [a, b, c]: [T; 3]) -> [T; 3] {
    let of = T::of;
    let x = if Number::real(x) < 0.0 {
        of(0.0)
    } else if Number::real(x) > 1.0 {
        of(1.0)
    } else {
        x
    };
    let y = of(1.0) - x;
    [
        a * x * x * x * (of(10.0) - of(15.0) * x + of(6.0) * x * x),
        b * of(30.0) * x * x * y * y,
        c * of(60.0) * x * y * (y - x),
    ]
}
