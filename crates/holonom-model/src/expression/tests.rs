#![allow(clippy::unwrap_used, clippy::float_cmp)] // exactly representable numbers

use super::*;
use proptest::prelude::*;

fn of(text: &str) -> Result<f64, ExpressionError> {
    evaluate(text, &mut |name| match name {
        "x" => Some(3.0),
        "e1" => Some(0.5),
        _ => None,
    })
}

#[test]
fn signs_powers_and_products_bind_as_in_mathematics() {
    for (text, value) in [
        ("-x^2", -9.0),
        ("2*-x^2", -18.0),
        ("2^3^2", 512.0),
        ("2^-1", 0.5),
        ("10 - 4 - 3", 3.0),
        ("24 / 4 / 2", 3.0),
        ("1 + 2*x", 7.0),
        ("(1 + 2)*x", 9.0),
        ("1e-3*1E3 + .5", 1.5),
        ("e1*2 - --1", 0.0),
        ("180*deg", std::f64::consts::PI),
        ("hypot(3, 4) + max(1, x) + floor(2.9)", 10.0),
        ("cos(pi)", -1.0),
    ] {
        assert_eq!(of(text), Ok(value), "{text}");
    }
}

#[test]
fn what_is_no_expression_says_why() {
    for (text, why) in [
        ("", "it ends where"),
        ("1 +", "it ends where"),
        ("(1", "closing bracket"),
        ("1)", "`)` at character 2"),
        ("2 x", "`x` at character 3"),
        ("1..2", "`1..2` is no number"),
        ("y", "no parameter `y`"),
        ("sin(1, 2)", "a function of one number"),
        ("atan2(1)", "a function of two numbers"),
        ("sine(1)", "`sine` is no function"),
        ("1 % 2", "`%` at character 3"),
    ] {
        let ExpressionError { message, help, .. } = of(text).unwrap_err();
        assert!(message.contains(why), "{text}: {message}");
        assert!(!help.is_empty(), "{text}: {message}");
    }
    for deep in ["(".repeat(100_000), "2^".repeat(100_000) + "2", "-".repeat(100_000)] {
        assert!(of(&deep).is_err());
    }
}

/// Functions and operations that are finite for an argument which is not.
#[test]
fn what_is_not_a_finite_number_does_not_disappear() {
    for (text, part) in [
        ("min(1, 0/0)", "`0/0` is not defined"),
        ("max(sqrt(-x), 1)", "`sqrt(-x)` is not defined"),
        ("1^(0/0)", "`0/0` is not defined"),
        ("(0/0)^0", "`0/0` is not defined"),
        ("hypot(1/0, 2)", "`1/0` is not finite"),
        ("atan(1/0)", "`1/0` is not finite"),
        ("1/(1/(x - 3))", "`1/(x - 3)` is not finite"),
        ("exp(-1e200*1e200)", "`-1e200*1e200` is not finite"),
        ("min(1, 1e999)", "`1e999` is not finite"),
        ("0*ln(0)", "`ln(0)` is not finite"),
        ("atan(1e308 + 1e308)", "`1e308 + 1e308` is not finite"),
        ("min(asin(2), 3)", "`asin(2)` is not defined"),
        ("max(1, (-8)^(1/3))", "`(-8)^(1/3)` is not defined"),
    ] {
        let message = of(text).unwrap_err().message;
        assert_eq!(message, part, "{text}");
    }
}

#[test]
fn functions_of_time_are_not_expressions() {
    let help = of("sin(t)").unwrap_err().help;
    assert!(help.contains("history") && help.contains("motion"), "{help}");
    assert!(of("sine(1)").unwrap_err().help.contains("`sin`"));
}

#[test]
fn names_of_parameters_are_replaced() {
    assert_eq!(names("x/2 + 1e3*sin(x1) - pi*e"), ["x", "x1", "e"]);
    let new = |text: &str| renamed(text, &mut |name| format!("a_{name}"));
    assert_eq!(new("= x/2 + 1e3*sin(x1) - pi*e"), "= a_x/2 + 1e3*sin(a_x1) - pi*a_e");
    assert_eq!(new("=2E-5*x^min(y, 3)"), "=2E-5*a_x^min(a_y, 3)");
}

proptest! {
    #[test]
    fn any_text_is_answered(text in "[-+*/^()., 0-9a-zé]{0,40}") {
        let _ = of(&text);
    }

    #[test]
    fn numbers_are_read_as_they_are_written(x in any::<f64>().prop_filter("finite", |x| x.is_finite())) {
        prop_assert_eq!(of(&format!("{x:?}")), Ok(x));
    }
}

/// Names that tests of slopes use: `x` and `y` change, `k` is a number.
fn program(text: &str) -> ExpressionProgram {
    let mut known = |name: &str| match name {
        "x" => Some(KnownName::Input(0)),
        "y" => Some(KnownName::Input(1)),
        "k" => Some(KnownName::Constant(2.5)),
        _ => None,
    };
    ExpressionProgram::parse(text, &mut known).unwrap_or_else(|error| panic!("{text}: {error:?}"))
}

/// Functions with each branch of each kink.
const SMOOTH: [&str; 40] = [
    "-2.0e4*x - 6.0e5*x^3",
    "k*x*y/(1 + x^2)",
    "sqrt(x + 1)",
    "abs(x - 2) + abs(x)",
    "exp(-x*y)",
    "ln(x + k)",
    "sin(x)*cos(y)",
    "tan(x/2)",
    "asin(x/3)",
    "acos(y/3)",
    "atan(x*y)",
    "sinh(x) + cosh(y)",
    "tanh(k*x)",
    "floor(x) + sign(y)*x",
    "atan2(y, x)",
    "atan2(-x, y)",
    "hypot(x, y)",
    "min(x, y)*max(x, y)^2",
    "max(x - 5, 0)^2 + max(x, -1)^3",
    "clamp(x, -1, 1)",
    "clamp(x, -10, 10)^2",
    "clamp(x, 3, y + 4)",
    "select(x, y^2, 3)",
    "select(-x, y^2, 3*x)",
    "smooth(x, 0, 2)",
    "smooth(x, -1, y + 1)",
    "smooth(x, 5, 6) + smooth(x, -6, -5)",
    "x^y",
    "x^k",
    "k^x",
    "x^-2",
    "x^0.5",
    "(x*y)^7",
    "x^1",
    "x^0",
    "-(-x)^2",
    "2^-x",
    "x/y/k",
    "x - y - k",
    "sqrt(x^2 + y^2 + 1e-2)",
];

/// Complex steps are no help with kinks, so derivatives are compared with central differences of
/// Richardson's kind: of order 4.
fn difference(f: impl Fn(f64) -> f64, x: f64) -> f64 {
    let central = |e: f64| (f(x + e) - f(x - e)) / (2.0 * e);
    (4.0 * central(1e-3) - central(2e-3)) / 3.0
}

#[test]
fn slopes_and_second_derivatives_agree_with_differences() {
    let mut worst: f64 = 0.0;
    for text in SMOOTH {
        let own = program(text);
        for at in [[0.7, 1.3], [1.4, 0.6], [0.35, 0.25]] {
            let mut slopes = [f64::NAN; 2];
            let value = own.gradient(&at, &mut slopes).unwrap();
            assert_eq!(value.to_bits(), own.value(&at).unwrap().to_bits(), "{text}");
            for k in 0..2 {
                let moved = |x: f64| {
                    let mut at = at;
                    at[k] = x;
                    own.value(&at).unwrap()
                };
                let expected = difference(moved, at[k]);
                let error = (slopes[k] - expected).abs() / (1.0 + expected.abs());
                assert!(error < 1e-8, "{text} at {at:?}, input {k}: {} {expected}", slopes[k]);
                worst = worst.max(error);
            }
            let (along, mut bend) = ([0.8, -0.6], [f64::NAN; 2]);
            own.bend(&at, &along, &mut bend);
            for k in 0..2 {
                let moved = |by: f64| {
                    let at = [at[0] + by * along[0], at[1] + by * along[1]];
                    let mut slopes = [0.0; 2];
                    own.gradient(&at, &mut slopes).unwrap();
                    slopes[k]
                };
                let expected = difference(moved, 0.0);
                let error = (bend[k] - expected).abs() / (1.0 + expected.abs());
                assert!(error < 1e-8, "{text} at {at:?}, bend {k}: {} {expected}", bend[k]);
                worst = worst.max(error);
            }
        }
    }
    println!("largest error of a slope or a second derivative: {worst:.1e}");
    let mut bend = [f64::NAN; 2];
    program("abs(x)^1.5 + y^2").bend(&[0.0, 1.0], &[1.0, 1.0], &mut bend);
    assert_eq!(bend, [0.0; 2], "there is none");
}

#[test]
fn taylor_coefficients_agree_with_differences_of_slopes() {
    for text in SMOOTH {
        let moving = "(0.4 + x^2/3)";
        let text = renamed(text, &mut |name| if name == "y" { moving } else { name }.to_owned());
        let own = program(&text);
        for t in [0.7, 1.4, 0.35] {
            let [value, rate, acceleration] = own.taylor(t).unwrap();
            let mut slopes = [0.0; 2];
            let expected = own.gradient(&[t, 0.0], &mut slopes).unwrap();
            assert_eq!(value.to_bits(), expected.to_bits(), "{text}");
            assert!((rate - slopes[0]).abs() < 1e-12 * (1.0 + rate.abs()), "{text}: {rate}");
            let slope = |t: f64| {
                let mut slopes = [0.0; 2];
                own.gradient(&[t, 0.0], &mut slopes).unwrap();
                slopes[0]
            };
            let expected = difference(slope, t);
            let error = (acceleration - expected).abs() / (1.0 + expected.abs());
            assert!(error < 1e-6, "{text} at {t}: {acceleration} {expected}");
        }
    }
}

#[test]
fn at_a_kink_the_slope_is_that_of_the_branch_taken() {
    let slope = |text: &str, x: f64| {
        let mut slopes = [0.0; 2];
        program(text).gradient(&[x, 0.0], &mut slopes).unwrap();
        slopes[0]
    };
    assert_eq!(slope("abs(x)", 0.0), 1.0);
    assert_eq!(slope("max(3*x, x)", 0.0), 3.0);
    assert_eq!(slope("min(3*x, x)", 0.0), 3.0);
    assert_eq!(slope("select(x, 2*x, 5*x)", 0.0), 5.0);
    assert_eq!(slope("select(x, 2*x, 5*x)", 1e-300), 2.0);
    assert_eq!(slope("sign(x)*x", -1.0), -1.0);
}

#[test]
fn what_is_not_finite_names_its_part_and_its_arguments() {
    let undefined = |text: &str, at: [f64; 2]| program(text).value(&at).unwrap_err();
    let fault = undefined("min(1, sqrt(x - 0.02))", [0.0, 0.0]);
    assert_eq!(fault.message, "`sqrt(x - 0.02)` is not defined");
    assert_eq!(fault.arguments, [-0.02]);
    let fault = undefined("x + 1/(y - 1)", [3.0, 1.0]);
    assert_eq!(fault.message, "`1/(y - 1)` is not finite");
    assert_eq!(fault.arguments, [1.0, 0.0]);
    let slope = program("sqrt(x)").gradient(&[0.0; 2], &mut [0.0; 2]).unwrap_err();
    assert_eq!(slope.message, "the slope of `sqrt(x)` is not finite");
}

#[test]
fn functions_that_jump_are_named_unless_they_vanish_where_they_jump() {
    for (text, jumps) in [
        ("sign(x)", vec!["sign"]),
        ("-3*sign(x)*abs(x)", vec![]),
        ("-select(x, 2000, 1100)*x", vec![]),
        ("-select(x, 2000, 1100)*y", vec!["select"]),
        ("select(x, 2, 2)*y", vec![]),
        ("floor(x)*x + sign(y)/y", vec!["floor", "sign"]),
        ("max(x, 0)^2", vec![]),
        ("sign(x)*x^2*3", vec![]),
        ("sign(x)*x + sign(x)", vec!["sign"]),
    ] {
        assert_eq!(program(text).jumps(), jumps, "{text}");
    }
}

#[test]
fn jumps_count_where_what_they_are_taken_of_moves() {
    for (text, of_x, of_y) in [
        ("x + 0.1*floor(30*y)", None, Some("floor(30*y)")),
        ("floor(3*1.3)*x", None, None),
        ("select(x - y, x, 2*y)", Some("select(x - y, x, 2*y)"), Some("select(x - y, x, 2*y)")),
        ("sign(x)*x + sign(y)", None, Some("sign(y)")),
        ("abs(x) + min(x, y) + clamp(y, 0, 1)", None, None),
    ] {
        let own = program(text);
        let found = [0, 1].map(|input| own.jumps_moved(|k| k == input));
        assert_eq!(found, [of_x, of_y], "{text}");
    }
}

#[test]
fn equal_parts_are_computed_once() {
    let own = program("sin(x*y)^2 + cos(x*y)^2 + 0*sin(x*y)");
    assert_eq!(own.operations.len(), 11, "{:?}", own.operations);
    assert_eq!(program("3*k + sin(pi/2)").constant(), Some(8.5));
}

#[test]
fn long_expressions_are_refused() {
    let text = (0..5000).map(|k| format!("x*{k}.5")).collect::<Vec<_>>().join(" + ");
    let error = ExpressionProgram::parse(&text, &mut |_| Some(KnownName::Input(0))).unwrap_err();
    assert!(error.message.contains("4096 operations"), "{}", error.message);
}

fn curve(interpolation: &str, outside: &str) -> Curve {
    let text = format!(
        "name = \"f\"\npoints = [[0, 0], [1, 1], [2.5, 1.5], [3, 4], [4, 3.5]]\n\
         interpolation = \"{interpolation}\"\noutside = \"{outside}\"\n"
    );
    Curve::new(&toml::from_str(&text).unwrap())
}

#[test]
fn tables_are_what_their_interpolation_says() {
    for kind in ["pchip", "linear", "spline"] {
        let own = curve(kind, "slope");
        let e = 1e-5;
        for x in [0.3, 0.99, 1.7, 2.6, 3.4, 3.99, -0.5, 4.5] {
            let [_, slope, bend] = own.at(x).unwrap();
            let at = |x: f64| own.at(x).unwrap();
            let expected = (at(x + e)[0] - at(x - e)[0]) / (2.0 * e);
            assert!((slope - expected).abs() < 1e-8, "{kind} at {x}: {slope} {expected}");
            let expected = (at(x + e)[1] - at(x - e)[1]) / (2.0 * e);
            assert!((bend - expected).abs() < 1e-6, "{kind} at {x}: {bend} {expected}");
        }
        for (x, y) in [(0.0, 0.0), (1.0, 1.0), (2.5, 1.5), (3.0, 4.0), (4.0, 3.5)] {
            assert!((own.at(x).unwrap()[0] - y).abs() < 1e-14, "{kind} at {x}");
        }
    }
    let linear = curve("linear", "hold");
    assert_eq!(linear.at(1.75).unwrap(), [1.25, 0.5 / 1.5, 0.0]);
    assert_eq!([-1.0, 9.0].map(|x| linear.at(x).unwrap()), [[0.0; 3], [3.5, 0.0, 0.0]]);
    assert!(curve("pchip", "error").at(4.01).is_none());
    let steps = curve("steps", "slope");
    for (x, y) in [(-1.0, 0.0), (0.5, 0.0), (1.0, 1.0), (2.49, 1.0), (2.5 - 1e-10, 1.5), (9.0, 3.5)]
    {
        assert_eq!(steps.at(x).unwrap(), [y, 0.0, 0.0], "at {x}");
    }
    let of = |text: &str| {
        let known = |name: &str| match name {
            "f" => Some(KnownName::Curve(steps.clone())),
            "t" => Some(KnownName::Input(0)),
            _ => Some(KnownName::Input(1)),
        };
        ExpressionProgram::parse(text, &mut { known }).unwrap().jumps()
    };
    assert_eq!(
        [of("f(x)*x"), of("3*f(t)"), of("f(2*t)")],
        [vec!["a table"], vec![], vec!["a table"]]
    );
    // the second derivative of a spline is continuous, and 0 at the ends
    let spline = curve("spline", "slope");
    for x in [0.0, 1.0, 2.5, 3.0, 4.0] {
        let jump = spline.at(x + 1e-12).unwrap()[2] - spline.at(x - 1e-12).unwrap()[2];
        assert!(jump.abs() < 1e-9, "at {x}: {jump}");
    }
    // monotone where the points are
    let pchip = curve("pchip", "hold");
    let values: Vec<f64> = (0..=300).map(|k| pchip.at(0.01 * f64::from(k)).unwrap()[0]).collect();
    assert!(values.windows(2).all(|pair| pair[0] <= pair[1]));
    assert_eq!(pchip.at(3.0).unwrap()[1], 0.0, "an extremum");
    // h = 1, 1.5 and m = 1, 1/3: (w_0 + w_1)/(w_0/m_0 + w_1/m_1) with w = 4, 3.5
    assert!((pchip.at(1.0).unwrap()[1] - 7.5 / 14.5).abs() < 1e-15);
    // ((2 h_0 + h_1) m_0 − h_0 m_1)/(h_0 + h_1)
    assert!((pchip.at(0.0).unwrap()[1] - (3.5 - 1.0 / 3.0) / 2.5).abs() < 1e-15);
}

fn surface(interpolation: &str, outside: &str) -> Surface {
    let text = format!(
        "name = \"f\"\naxes = [[0.0, 1.0, 2.5, 3.0], [-1.0, 0.5, 1.0]]\n\
         values = [[0.0, 1.0, 0.5], [1.0, 2.0, -1.0], [1.5, 0.3, 0.2], [4.0, 3.0, 2.5]]\n\
         interpolation = \"{interpolation}\"\noutside = \"{outside}\"\n"
    );
    Surface::new(&toml::from_str(&text).unwrap()).unwrap()
}

/// Values at the corners; derivatives are those of the values, across sides of cells and outside.
#[test]
fn grids_have_their_derivatives() {
    for kind in ["pchip", "linear", "spline"] {
        let own = surface(kind, "slope");
        assert!((own.at([2.5, 0.5]).unwrap().0 - 0.3).abs() < 1e-14);
        let (e, mut worst) = (1e-5, [0.0_f64; 2]);
        for at in [[0.3, 0.2], [1.7, -0.4], [2.8, 0.9], [-0.5, 0.1], [3.6, 1.7], [0.4, -2.0]] {
            let moved = |k: usize, by: f64| {
                let mut at = at;
                at[k] += by;
                own.at(at).unwrap()
            };
            let (_, first, [xx, xy, yy]) = own.at(at).unwrap();
            for (k, second) in [[xx, xy], [xy, yy]].into_iter().enumerate() {
                let (plus, minus) = (moved(k, e), moved(k, -e));
                worst[0] = worst[0].max(((plus.0 - minus.0) / (2.0 * e) - first[k]).abs());
                for l in 0..2 {
                    let slope = (plus.1[l] - minus.1[l]) / (2.0 * e);
                    worst[1] = worst[1].max((slope - second[l]).abs());
                }
            }
        }
        println!("{kind}: slopes off by {:.1e}, second derivatives by {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-8 && worst[1] < 1e-6);
        for [a, b] in [[[1.0, 0.1], [1.0, 0.9]], [[0.2, 0.5], [2.8, 0.5]]] {
            let across = |x: [f64; 2]| {
                let d = if a[0] == b[0] { [1e-13, 0.0] } else { [0.0, 1e-13] };
                let side = |s: f64| own.at([x[0] + s * d[0], x[1] + s * d[1]]).unwrap();
                let (p, m) = (side(1.0), side(-1.0));
                (p.0 - m.0).abs().max((p.1[0] - m.1[0]).abs()).max((p.1[1] - m.1[1]).abs())
            };
            let jump = across(a).max(across(b));
            assert!(jump < 1e-10 || kind == "linear", "{kind}: {jump:e}");
        }
    }
    let hold = surface("pchip", "hold");
    let (value, slopes, second) = hold.at([9.0, 0.5]).unwrap();
    assert_eq!((value, slopes[0], second[0]), (3.0, 0.0, 0.0));
    assert!(surface("pchip", "error").at([1.0, 1.01]).is_none());
}

#[test]
fn a_grid_is_called_by_its_name() {
    let mut known = |name: &str| match name {
        "x" => Some(KnownName::Input(0)),
        "y" => Some(KnownName::Input(1)),
        "f" => Some(KnownName::Surface(surface("spline", "error"))),
        _ => None,
    };
    let own = ExpressionProgram::parse("2*f(x^2, x - y)", &mut known).unwrap();
    let (mut slopes, e) = ([0.0; 2], 1e-6);
    let value = own.gradient(&[1.2, 0.5], &mut slopes).unwrap();
    assert!((value - 2.0 * surface("spline", "hold").at([1.44, 0.7]).unwrap().0).abs() < 1e-14);
    let at = |x: f64, y: f64| own.value(&[x, y]).unwrap();
    let expected = [at(1.2 + e, 0.5) - at(1.2 - e, 0.5), at(1.2, 0.5 + e) - at(1.2, 0.5 - e)];
    (0..2).for_each(|k| assert!((slopes[k] - expected[k] / (2.0 * e)).abs() < 1e-8));
    let mut bend = [0.0; 2];
    own.bend(&[1.2, 0.5], &[0.3, 0.7], &mut bend);
    let slope = |by: f64| {
        let mut slopes = [0.0; 2];
        own.gradient(&[1.2 + 0.3 * by, 0.5 + 0.7 * by], &mut slopes).unwrap();
        slopes
    };
    let (plus, minus) = (slope(e), slope(-e));
    (0..2).for_each(|k| assert!((bend[k] - (plus[k] - minus[k]) / (2.0 * e)).abs() < 1e-7));
    let path = ExpressionProgram::parse("f(x^2, 0.3*x)", &mut known).unwrap();
    let [_, rate, acceleration] = path.taylor(1.2).unwrap();
    let at = |t: f64| path.taylor(t).unwrap();
    assert!((rate - (at(1.2 + e)[0] - at(1.2 - e)[0]) / (2.0 * e)).abs() < 1e-8);
    assert!((acceleration - (at(1.2 + e)[1] - at(1.2 - e)[1]) / (2.0 * e)).abs() < 1e-7);
    let outside = own.value(&[1.9, 0.5]).unwrap_err();
    assert_eq!(outside.message, "`f`: (3.61, 1.4) is outside of 0 … 3, -1 … 1");
}

#[test]
fn a_table_is_called_by_its_name() {
    let mut known = |name: &str| match name {
        "x" => Some(KnownName::Input(0)),
        "f" => Some(KnownName::Curve(curve("pchip", "error"))),
        _ => None,
    };
    let own = ExpressionProgram::parse("2*f(x^2) - f(1)", &mut known).unwrap();
    let mut slopes = [0.0];
    let value = own.gradient(&[1.2], &mut slopes).unwrap();
    let [f, slope, bend] = curve("pchip", "error").at(1.44).unwrap();
    assert!((value - (2.0 * f - 1.0)).abs() < 1e-14 && (slopes[0] - 4.8 * slope).abs() < 1e-13);
    let [_, rate, acceleration] = own.taylor(1.2).unwrap();
    assert!((rate - slopes[0]).abs() < 1e-14);
    assert!((acceleration - (4.0 * slope + 11.52 * bend)).abs() < 1e-12);
    let outside = own.value(&[2.1]).unwrap_err();
    assert_eq!(outside.message, "`f`: 4.41 is outside of 0 … 4");
    for (text, why) in
        [("f", "is a table"), ("f(x, 1)", "function of one"), ("g(x)", "no function")]
    {
        let error = ExpressionProgram::parse(text, &mut known).unwrap_err();
        assert!(error.message.contains(why), "{text}: {}", error.message);
    }
}

#[test]
fn affine_functions_are_known() {
    let affine = |text: &str| program(text).is_affine(|input| input == 0);
    for text in ["-3*x + sin(y)", "x/k*y^2", "select(y, 2*x, x - 1)", "-(x - y)*y", "7"] {
        assert!(affine(text), "{text}");
    }
    for text in ["x*x", "abs(x)", "x^2", "y/x", "select(x, 1, 2)", "max(x, 0)", "2^x"] {
        assert!(!affine(text), "{text}");
    }
}
