//! Numbers that formulas of geometry are written for: real ones, and those with a tangent.
//!
//! ```text
//! x = x + ε x_θ,  ε² = 0
//! ```
//! A formula of the elements that is evaluated with a [`Dual64`] gives its value and its derivative
//! by one parameter, exactly; with `f64` it is the formula of the step.

use num_dual::{Dual64, HyperDual64, HyperHyperDual64};

/// `f64`, or a number with its derivative by a parameter.
pub trait Number: nalgebra::RealField + Copy {
    /// A constant.
    fn of(value: f64) -> Self;
    /// The value.
    fn real(self) -> f64;
    /// Whether it is zero, and its derivative as well.
    fn vanishes(self) -> bool;
    /// `atan2(self, x)`, rad.
    fn arctangent(self, x: Self) -> Self;
    /// `sin` and `cos`.
    fn sine_cosine(self) -> [Self; 2];
    /// `tanh`.
    fn hyperbolic_tangent(self) -> Self;
    /// `arcsin` of a number in `[0, 1)`, rad.
    fn arcsine(self) -> Self {
        self.arctangent((Self::of(1.0) - self * self).sqrt())
    }
}

/// A number that takes part in formulas of another kind: a constant, or one with a derivative.
pub trait Embed<T>: Number {
    /// The same number there.
    fn embed(self) -> T;
}

impl<T: Number> Embed<T> for f64 {
    #[inline]
    fn embed(self) -> T {
        T::of(self)
    }
}

impl Embed<Self> for Dual64 {
    #[inline]
    fn embed(self) -> Self {
        self
    }
}

/// The derivative is the second one there.
impl Embed<HyperDual64> for Dual64 {
    fn embed(self) -> HyperDual64 {
        HyperDual64::new(self.re, 0.0, self.eps, 0.0)
    }
}

/// The derivative is the third one there.
impl Embed<HyperHyperDual64> for Dual64 {
    fn embed(self) -> HyperHyperDual64 {
        HyperHyperDual64::new(self.re, 0.0, 0.0, self.eps, 0.0, 0.0, 0.0, 0.0)
    }
}

impl Number for f64 {
    #[inline]
    fn of(value: f64) -> Self {
        value
    }
    #[inline]
    fn real(self) -> f64 {
        self
    }
    #[inline]
    fn vanishes(self) -> bool {
        self == 0.0
    }
    #[inline]
    fn arctangent(self, x: Self) -> Self {
        libm::atan2(self, x)
    }
    #[inline]
    fn sine_cosine(self) -> [Self; 2] {
        [libm::sin(self), libm::cos(self)]
    }
    #[inline]
    fn hyperbolic_tangent(self) -> Self {
        libm::tanh(self)
    }
    #[inline]
    fn arcsine(self) -> Self {
        libm::asin(self)
    }
}

impl Number for Dual64 {
    fn of(value: f64) -> Self {
        Self::from_re(value)
    }
    fn real(self) -> f64 {
        self.re
    }
    fn vanishes(self) -> bool {
        self.re == 0.0 && self.eps == 0.0
    }
    fn arctangent(self, x: Self) -> Self {
        let square = self.re * self.re + x.re * x.re;
        let slope = (x.re * self.eps - self.re * x.eps) / square;
        Self::new(libm::atan2(self.re, x.re), slope)
    }
    fn sine_cosine(self) -> [Self; 2] {
        let (sine, cosine) = (libm::sin(self.re), libm::cos(self.re));
        [Self::new(sine, cosine * self.eps), Self::new(cosine, -sine * self.eps)]
    }
    fn hyperbolic_tangent(self) -> Self {
        let value = libm::tanh(self.re);
        Self::new(value, (1.0 - value * value) * self.eps)
    }
}

/// `x + ε_1 x_1 + ε_2 x_2 + ε_1 ε_2 x_12`: two derivatives at once.
impl Number for HyperDual64 {
    fn of(value: f64) -> Self {
        Self::from_re(value)
    }
    fn real(self) -> f64 {
        self.re
    }
    fn vanishes(self) -> bool {
        [self.re, self.eps1, self.eps2, self.eps1eps2].iter().all(|part| *part == 0.0)
    }
    fn arctangent(self, x: Self) -> Self {
        let y = self;
        let square = y.re * y.re + x.re * x.re;
        let first = x.re * y.eps1 - y.re * x.eps1;
        let second = x.re * y.eps2 - y.re * x.eps2;
        let mixed = x.eps2 * y.eps1 + x.re * y.eps1eps2 - y.eps2 * x.eps1 - y.re * x.eps1eps2;
        let grown = 2.0 * (x.re * x.eps2 + y.re * y.eps2);
        Self::new(
            libm::atan2(y.re, x.re),
            first / square,
            second / square,
            (mixed - first * grown / square) / square,
        )
    }
    fn sine_cosine(self) -> [Self; 2] {
        let (sine, cosine) = (libm::sin(self.re), libm::cos(self.re));
        let of = |value: f64, slope: f64| {
            let bend = slope * self.eps1eps2 - value * self.eps1 * self.eps2;
            Self::new(value, slope * self.eps1, slope * self.eps2, bend)
        };
        [of(sine, cosine), of(cosine, -sine)]
    }
    fn hyperbolic_tangent(self) -> Self {
        let value = libm::tanh(self.re);
        let slope = 1.0 - value * value;
        let bend = slope * (self.eps1eps2 - 2.0 * value * self.eps1 * self.eps2);
        Self::new(value, slope * self.eps1, slope * self.eps2, bend)
    }
}

/// Three derivatives at once. Beside its value `x_0` a number is `δ` with `δ⁴ = 0`: series in `δ`
/// end.
impl Number for HyperHyperDual64 {
    fn of(value: f64) -> Self {
        Self::from_re(value)
    }
    fn real(self) -> f64 {
        self.re
    }
    fn vanishes(self) -> bool {
        let first = [self.re, self.eps1, self.eps2, self.eps3];
        let mixed = [self.eps1eps2, self.eps1eps3, self.eps2eps3, self.eps1eps2eps3];
        first.iter().chain(&mixed).all(|part| *part == 0.0)
    }
    fn arctangent(self, x: Self) -> Self {
        let [sine, cosine] = [self * x.re - x * self.re, x * x.re + self * self.re];
        let turn = sine / cosine; // the tangent of what the angle has beside its value
        turn - turn * turn * turn / 3.0 + libm::atan2(self.re, x.re)
    }
    fn sine_cosine(self) -> [Self; 2] {
        let (sine, cosine, own) = (libm::sin(self.re), libm::cos(self.re), self - self.re);
        let [of_sine, of_cosine] = [own - own * own * own / 6.0, -(own * own) / 2.0 + 1.0];
        [of_cosine * sine + of_sine * cosine, of_cosine * cosine - of_sine * sine]
    }
    fn hyperbolic_tangent(self) -> Self {
        let (value, own) = (libm::tanh(self.re), self - self.re);
        let of_own = own - own * own * own / 3.0;
        (of_own + value) / (of_own * value + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_of_angles_follow_from_their_functions() {
        let angle = Dual64::new(2.3, 0.7);
        let [sine, cosine] = angle.sine_cosine();
        let again = sine.arctangent(cosine);
        assert!((again.re - 2.3).abs() < 1e-15 && (again.eps - 0.7).abs() < 1e-15);
        let [long, wide] = [sine * Dual64::new(3.0, 0.4), cosine * Dual64::new(3.0, 0.4)];
        assert!((long.arctangent(wide).eps - 0.7).abs() < 1e-15, "a length turns nothing");
    }

    #[test]
    fn second_derivatives_of_angles_follow_from_their_functions() {
        let angle = HyperDual64::new(2.3, 0.7, -0.4, 0.9);
        let [sine, cosine] = angle.sine_cosine();
        let length = HyperDual64::new(3.0, 0.4, 0.2, -0.5);
        let again = (sine * length).arctangent(cosine * length);
        let parts = [again.re, again.eps1, again.eps2, again.eps1eps2];
        for (part, exact) in parts.into_iter().zip([2.3, 0.7, -0.4, 0.9]) {
            assert!((part - exact).abs() < 1e-14, "{part} for {exact}");
        }
    }

    /// Of functions of one number `f(2.3 + δ)` along three equal directions, against formulas.
    #[test]
    fn third_derivatives_follow_from_series() {
        let x = HyperHyperDual64::new(0.7, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0);
        let [sine, cosine] = x.sine_cosine();
        let (s, c, t) = (libm::sin(0.7), libm::cos(0.7), libm::tanh(0.7));
        let flat = 1.0 - t * t;
        let of = |y: HyperHyperDual64| [y.re, y.eps2, y.eps1eps3, y.eps1eps2eps3];
        let bend = flat * (6.0 * t * t - 2.0);
        for (found, exact) in [
            (of(sine), [s, c, -s, -c]),
            (of(cosine), [c, -s, -c, s]),
            (of(x.hyperbolic_tangent()), [t, flat, -2.0 * t * flat, bend]),
            (of((sine * x).arctangent(cosine * x)), [0.7, 1.0, 0.0, 0.0]),
        ] {
            for (found, exact) in found.into_iter().zip(exact) {
                assert!((found - exact).abs() < 1e-14, "{found} for {exact}");
            }
        }
    }

    #[test]
    fn what_has_a_tangent_does_not_vanish() {
        assert!(Dual64::of(0.0).vanishes() && !Dual64::new(0.0, 1.0).vanishes());
    }
}
