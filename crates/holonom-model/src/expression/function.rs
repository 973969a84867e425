//! Elementary functions of expressions with their first two derivatives.
//!
//! The value is that of `libm`: equal bits on every machine. At a kink the slope is that of the
//! branch taken: of the larger number in `abs` and `max`, of the first where both are equal.

use crate::smooth_step::smooth_step;

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unary {
    Negative,
    Sqrt,
    Abs,
    Exp,
    Ln,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Floor,
    Sign,
    /// [`smooth_step`].
    Smooth,
    /// `x^n` by multiplication.
    Integer(u8),
}

/// A function of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Binary {
    Sum,
    Difference,
    Product,
    Quotient,
    Power,
    Atan2,
    Hypot,
    Min,
    Max,
}

/// Functions of one number by their names.
pub(super) const UNARY: [(&str, Unary); 15] = [
    ("sqrt", Unary::Sqrt),
    ("abs", Unary::Abs),
    ("exp", Unary::Exp),
    ("ln", Unary::Ln),
    ("sin", Unary::Sin),
    ("cos", Unary::Cos),
    ("tan", Unary::Tan),
    ("asin", Unary::Asin),
    ("acos", Unary::Acos),
    ("atan", Unary::Atan),
    ("sinh", Unary::Sinh),
    ("cosh", Unary::Cosh),
    ("tanh", Unary::Tanh),
    ("floor", Unary::Floor),
    ("sign", Unary::Sign),
];

/// Functions of two.
pub(super) const BINARY: [(&str, Binary); 4] = [
    ("atan2", Binary::Atan2),
    ("hypot", Binary::Hypot),
    ("min", Binary::Min),
    ("max", Binary::Max),
];

/// Functions of three: `clamp(x, lo, hi)`, `select(c, a, b)`, `smooth(x, a, b)`.
pub(super) const TERNARY: [&str; 3] = ["clamp", "select", "smooth"];

impl Unary {
    pub(super) fn value(self, x: f64) -> f64 {
        match self {
            Self::Negative => -x,
            Self::Sqrt => x.sqrt(),
            Self::Abs => x.abs(),
            Self::Exp => libm::exp(x),
            Self::Ln => libm::log(x),
            Self::Sin => libm::sin(x),
            Self::Cos => libm::cos(x),
            Self::Tan => libm::tan(x),
            Self::Asin => libm::asin(x),
            Self::Acos => libm::acos(x),
            Self::Atan => libm::atan(x),
            Self::Sinh => libm::sinh(x),
            Self::Cosh => libm::cosh(x),
            Self::Tanh => libm::tanh(x),
            Self::Floor => x.floor(),
            Self::Sign if x > 0.0 => 1.0,
            Self::Sign if x < 0.0 => -1.0,
            Self::Sign => 0.0,
            Self::Smooth => smooth_step(x, [1.0; 3])[0],
            Self::Integer(n) => (1..n).fold(x, |product, _| product * x),
        }
    }

    /// `f'(x)`, where `f = f(x)`.
    pub(super) fn slope(self, x: f64, f: f64) -> f64 {
        match self {
            Self::Negative => -1.0,
            Self::Sqrt => 0.5 / f,
            Self::Abs if x < 0.0 => -1.0,
            Self::Abs => 1.0,
            Self::Exp => f,
            Self::Ln => 1.0 / x,
            Self::Sin => libm::cos(x),
            Self::Cos => -libm::sin(x),
            Self::Tan => 1.0 + f * f,
            Self::Asin => 1.0 / ((1.0 - x) * (1.0 + x)).sqrt(),
            Self::Acos => -1.0 / ((1.0 - x) * (1.0 + x)).sqrt(),
            Self::Atan => 1.0 / (1.0 + x * x),
            Self::Sinh => libm::cosh(x),
            Self::Cosh => libm::sinh(x),
            Self::Tanh => 1.0 - f * f,
            Self::Floor | Self::Sign => 0.0,
            Self::Smooth => smooth_step(x, [1.0; 3])[1],
            Self::Integer(n) => f64::from(n) * power(x, n - 1),
        }
    }

    /// `f''(x)`, where `f = f(x)`.
    pub(super) fn bend(self, x: f64, f: f64) -> f64 {
        match self {
            Self::Negative | Self::Abs | Self::Floor | Self::Sign => 0.0,
            Self::Sqrt => -0.25 / (x * f),
            Self::Exp | Self::Sinh | Self::Cosh => f,
            Self::Ln => -1.0 / (x * x),
            Self::Sin | Self::Cos => -f,
            Self::Tan => 2.0 * f * (1.0 + f * f),
            Self::Asin => x * libm::pow((1.0 - x) * (1.0 + x), -1.5),
            Self::Acos => -x * libm::pow((1.0 - x) * (1.0 + x), -1.5),
            Self::Atan => -2.0 * x / ((1.0 + x * x) * (1.0 + x * x)),
            Self::Tanh => -2.0 * f * (1.0 - f * f),
            Self::Smooth => smooth_step(x, [1.0; 3])[2],
            Self::Integer(1) => 0.0,
            Self::Integer(n) => f64::from(n) * f64::from(n - 1) * power(x, n - 2),
        }
    }
}

fn power(x: f64, n: u8) -> f64 {
    (0..n).fold(1.0, |product, _| product * x)
}

/// `[f_x, f_y]`, then `[f_xx, f_xy, f_yy]`.
pub(super) type Partials = ([f64; 2], [f64; 3]);

impl Binary {
    pub(super) fn value(self, x: f64, y: f64) -> f64 {
        match self {
            Self::Sum => x + y,
            Self::Difference => x - y,
            Self::Product => x * y,
            Self::Quotient => x / y,
            Self::Power => libm::pow(x, y),
            Self::Atan2 => libm::atan2(x, y),
            Self::Hypot => libm::hypot(x, y),
            Self::Min => x.min(y),
            Self::Max => x.max(y),
        }
    }

    /// `[f_x, f_y]`, where `f = f(x, y)`; `constant`: `y` does not change.
    pub(super) fn slopes(self, [x, y]: [f64; 2], f: f64, constant: bool) -> [f64; 2] {
        match self {
            Self::Sum => [1.0, 1.0],
            Self::Difference => [1.0, -1.0],
            Self::Product => [y, x],
            Self::Quotient => [1.0 / y, -f / y],
            Self::Power => {
                let by_base = if y == 0.0 { 0.0 } else { y * libm::pow(x, y - 1.0) };
                [by_base, if constant || f == 0.0 { 0.0 } else { f * libm::log(x) }]
            }
            Self::Atan2 => {
                let square = x * x + y * y;
                [y / square, -x / square]
            }
            Self::Hypot => [x / f, y / f],
            Self::Min if x <= y => [1.0, 0.0],
            Self::Max if x >= y => [1.0, 0.0],
            Self::Min | Self::Max => [0.0, 1.0],
        }
    }

    /// First and second partial derivatives.
    pub(super) fn partials(self, [x, y]: [f64; 2], f: f64, constant: bool) -> Partials {
        let first = self.slopes([x, y], f, constant);
        let second = match self {
            Self::Sum | Self::Difference | Self::Min | Self::Max => [0.0; 3],
            Self::Product => [0.0, 1.0, 0.0],
            Self::Quotient => [0.0, -1.0 / (y * y), 2.0 * f / (y * y)],
            Self::Power => {
                let flat = y * (y - 1.0) == 0.0;
                let bend = if flat { 0.0 } else { y * (y - 1.0) * libm::pow(x, y - 2.0) };
                if constant || f == 0.0 {
                    [bend, 0.0, 0.0]
                } else {
                    let log = libm::log(x);
                    [bend, libm::pow(x, y - 1.0) * (1.0 + y * log), f * log * log]
                }
            }
            Self::Atan2 => {
                let square = x * x + y * y;
                let (across, along) = (2.0 * x * y, y * y - x * x);
                let scale = square * square;
                [-across / scale, -along / scale, across / scale]
            }
            Self::Hypot => {
                let cube = f * f * f;
                [y * y / cube, -x * y / cube, x * x / cube]
            }
        };
        (first, second)
    }
}
