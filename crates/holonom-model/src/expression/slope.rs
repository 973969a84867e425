//! The derivative of an expression by a parameter, as an expression.
//!
//! ```text
//! e(p(θ), x)        e_θ = Σ_j ∂e/∂p_j p_j'(θ)        by the rules of each function, part by part
//! ```

use std::collections::BTreeMap;

use super::function::{BINARY, Binary, UNARY, Unary};
use super::parse::{ExpressionError, KnownName};
use super::program::{ExpressionProgram, Operation};

/// A name that changes with the parameter: its value and its derivative, as expressions.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Moving {
    /// What stands for it: a name, or a number in brackets.
    pub value: String,
    /// The derivative.
    pub slope: String,
}

/// Why an expression has no derivative by a parameter.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoSlope {
    /// It is no expression.
    #[error("{}", .0.message)]
    Invalid(ExpressionError),
    /// A part jumps, or is a table, at a place that the parameter moves.
    #[error("it changes what `{0}` is taken of, of which there is no slope")]
    Part(String),
}

/// A part with its derivative; none where the parameter does not change it.
#[derive(Clone)]
struct OperandSlope {
    value: String,
    slope: Option<String>,
}

/// The derivative of an expression by a parameter; `None` where it does not depend on it.
/// `tables`: what is called by its name; `moving`: what changes. It reads all other names that the
/// expression reads.
///
/// # Errors
/// [`NoSlope`].
pub fn slope(
    text: &str,
    tables: &mut dyn FnMut(&str) -> Option<KnownName>,
    moving: &BTreeMap<String, Moving>,
) -> Result<Option<String>, NoSlope> {
    let mut names: Vec<String> = Vec::new();
    let program = ExpressionProgram::parse(text, &mut |name| {
        if let Some(table) = tables(name) {
            return Some(table);
        }
        let known = names.iter().position(|own| own == name);
        Some(KnownName::Input(known.unwrap_or_else(|| {
            names.push(name.to_owned());
            names.len() - 1
        })))
    })
    .map_err(NoSlope::Invalid)?;
    let mut parts: Vec<OperandSlope> = Vec::with_capacity(program.operations.len());
    for (k, operation) in program.operations.iter().enumerate() {
        let part = match *operation {
            Operation::Constant(value) => OperandSlope { value: number(value), slope: None },
            Operation::Input(input) => match moving.get(&names[input]) {
                Some(Moving { value, slope }) => {
                    OperandSlope { value: value.clone(), slope: Some(format!("({slope})")) }
                }
                None => OperandSlope { value: names[input].clone(), slope: None },
            },
            Operation::Unary(function, x) => unary(function, &parts[x], program.part(k))?,
            Operation::Binary(function, [x, y]) => binary(function, &parts[x], &parts[y]),
            Operation::Select([c, a, b]) => select([&parts[c], &parts[a], &parts[b]])?,
            Operation::Curve(curve, x) => {
                called(program.curves[curve].name(), &[&parts[x]], program.part(k))?
            }
            Operation::Surface(surface, [x, y]) => {
                called(program.surfaces[surface].name(), &[&parts[x], &parts[y]], program.part(k))?
            }
        };
        parts.push(part);
    }
    let Some(slope) = parts.pop().and_then(|last| last.slope) else { return Ok(None) };
    let read = names.iter().filter(|name| !moving.contains_key(*name));
    let read: String = read.map(|name| format!(" + 0*{name}")).collect();
    Ok(Some(slope + &read))
}

fn number(value: f64) -> String {
    format!("({value:?})")
}

/// `factor * slope` of a part.
fn chain(of: &OperandSlope, factor: &str) -> Option<String> {
    of.slope.as_ref().map(|slope| format!("({factor}*{slope})"))
}

/// The sum of what there is.
fn sum(a: Option<String>, b: Option<String>) -> Option<String> {
    match (a, b) {
        (Some(a), Some(b)) => Some(format!("({a} + {b})")),
        (a, b) => a.or(b),
    }
}

fn unary(function: Unary, x: &OperandSlope, text: &str) -> Result<OperandSlope, NoSlope> {
    let u = &x.value;
    let named = UNARY.iter().find(|(_, own)| *own == function).map(|(name, _)| *name);
    let value = match function {
        Unary::Negative => format!("(-{u})"),
        Unary::Integer(n) => format!("({u}^{n})"),
        // of what `smooth` computes before
        Unary::Smooth => format!("smooth({u}, 0, 1)"),
        _ => format!("{}({u})", named.unwrap_or_default()),
    };
    let f = &value;
    let factor = match function {
        Unary::Negative => "(-1)".to_owned(),
        Unary::Sqrt => format!("(0.5/{f})"),
        Unary::Abs => format!("select(-{u}, -1, 1)"),
        Unary::Exp => f.clone(),
        Unary::Ln => format!("(1/{u})"),
        Unary::Sin => format!("cos({u})"),
        Unary::Cos => format!("(-sin({u}))"),
        Unary::Tan => format!("(1 + {f}^2)"),
        Unary::Asin => format!("(1/sqrt(1 - {u}^2))"),
        Unary::Acos => format!("(-1/sqrt(1 - {u}^2))"),
        Unary::Atan => format!("(1/(1 + {u}^2))"),
        Unary::Sinh => format!("cosh({u})"),
        Unary::Cosh => format!("sinh({u})"),
        Unary::Tanh => format!("(1 - {f}^2)"),
        Unary::Smooth => {
            let within = format!("clamp({u}, 0, 1)");
            format!("(30*{within}^2*(1 - {within})^2)")
        }
        Unary::Integer(n) => format!("({n}*{u}^{})", n - 1),
        Unary::Floor | Unary::Sign if x.slope.is_some() => {
            return Err(NoSlope::Part(text.to_owned()));
        }
        Unary::Floor | Unary::Sign => String::new(),
    };
    Ok(OperandSlope { slope: chain(x, &factor), value })
}

fn binary(function: Binary, x: &OperandSlope, y: &OperandSlope) -> OperandSlope {
    let (u, v) = (&x.value, &y.value);
    let named = BINARY.iter().find(|(_, own)| *own == function).map(|(name, _)| *name);
    let value = match function {
        Binary::Sum => format!("({u} + {v})"),
        Binary::Difference => format!("({u} - {v})"),
        Binary::Product => format!("({u}*{v})"),
        Binary::Quotient => format!("({u}/{v})"),
        Binary::Power => format!("({u}^{v})"),
        _ => format!("{}({u}, {v})", named.unwrap_or_default()),
    };
    let f = &value;
    let [by_x, by_y] = match function {
        Binary::Sum => ["1".to_owned(), "1".to_owned()],
        Binary::Difference => ["1".to_owned(), "(-1)".to_owned()],
        Binary::Product => [v.clone(), u.clone()],
        Binary::Quotient => [format!("(1/{v})"), format!("(-{f}/{v})")],
        Binary::Power => [format!("({v}*{u}^({v} - 1))"), format!("({f}*ln({u}))")],
        Binary::Atan2 => {
            let square = format!("({u}^2 + {v}^2)");
            [format!("({v}/{square})"), format!("(-{u}/{square})")]
        }
        Binary::Hypot => [format!("({u}/{f})"), format!("({v}/{f})")],
        Binary::Min => [format!("select({u} - {v}, 0, 1)"), format!("select({u} - {v}, 1, 0)")],
        Binary::Max => [format!("select({v} - {u}, 0, 1)"), format!("select({v} - {u}, 1, 0)")],
    };
    OperandSlope { slope: sum(chain(x, &by_x), chain(y, &by_y)), value }
}

/// `a` where `c > 0`, else `b`.
fn select([c, a, b]: [&OperandSlope; 3]) -> Result<OperandSlope, NoSlope> {
    if c.slope.is_some() {
        return Err(NoSlope::Part(format!("select({}, …)", c.value)));
    }
    let value = format!("select({}, {}, {})", c.value, a.value, b.value);
    let [da, db] = [a, b].map(|own| own.slope.clone());
    let slope = (da.is_some() || db.is_some()).then(|| {
        let [da, db] = [da, db].map(|own| own.unwrap_or_else(|| "0".to_owned()));
        format!("select({}, {da}, {db})", c.value)
    });
    Ok(OperandSlope { value, slope })
}

/// A table.
fn called(name: &str, of: &[&OperandSlope], text: &str) -> Result<OperandSlope, NoSlope> {
    if of.iter().any(|own| own.slope.is_some()) {
        return Err(NoSlope::Part(text.to_owned()));
    }
    let list: Vec<&str> = of.iter().map(|own| own.value.as_str()).collect();
    Ok(OperandSlope { value: format!("{name}({})", list.join(", ")), slope: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each function and operator against central differences, at three places.
    #[test]
    fn slopes_are_those_of_differences() {
        let texts = [
            "-k*x - 3*k^2*x^3 + 5",
            "sqrt(k + x) + abs(k - x)*v + exp(-k*x) + ln(k*x + 2)",
            "sin(k*x) + cos(k*v)*k + tan(0.1*k*x)",
            "asin(0.1*k*x) + acos(0.1*k*x) + atan(k*x) + sinh(k*x) - cosh(k) + tanh(k*v)",
            "smooth(x, k, 3) + smooth(x*k, 0.2, 2)",
            "k^x + x^k + 2^(k*x) + (k*x)^2.5 + k^-3 + (k + x)^9",
            "atan2(k, x) + atan2(x, k) + hypot(k*x, v)",
            "min(k*x, v) + max(k*x, v) + clamp(k*x, 0.1, 2*k)",
            "select(v, k*x, 3) + select(x - 9, 1, k*v) + select(v, 2, 3)",
            "x*sign(v) + floor(x)*k + k/(x + k) + -k",
        ];
        let at = |k: f64, x: f64, v: f64| {
            move |name: &str| match name {
                "k" => Some(k),
                "x" => Some(x),
                "v" => Some(v),
                _ => None,
            }
        };
        let mut worst = 0.0_f64;
        for text in texts {
            for (k, x, v) in [(1.3, 0.7, 0.4), (0.6, 1.9, -0.3), (2.1, 0.2, 1.1)] {
                let moving = Moving { value: format!("{k:?}"), slope: "2.0".to_owned() };
                let moving = BTreeMap::from([("k".to_owned(), moving)]);
                let found = slope(text, &mut |_| None, &moving).unwrap().expect("it depends on k");
                let found = super::super::evaluate(&found, &mut at(f64::NAN, x, v)).unwrap();
                let value = |k: f64| super::super::evaluate(text, &mut at(k, x, v)).unwrap();
                let d = 1e-5;
                let exact = 2.0 * (value(k + d) - value(k - d)) / (2.0 * d);
                let apart = (found - exact).abs() / exact.abs().max(1.0);
                assert!(apart < 1e-7, "{text} at {k}, {x}, {v}: {found}, {exact}");
                worst = worst.max(apart);
            }
        }
        println!("slopes apart from differences by {worst:.1e}");
    }

    #[test]
    fn what_does_not_depend_or_jumps_is_said() {
        let moving = Moving { value: "1.0".to_owned(), slope: "1.0".to_owned() };
        let moving = BTreeMap::from([("k".to_owned(), moving)]);
        let of = |text: &str| slope(text, &mut |_| None, &moving);
        assert_eq!(of("x^2 + floor(v)"), Ok(None));
        for text in ["floor(k*x)", "sign(x - k)", "select(x - k, 1, 2)"] {
            let refused = of(text).unwrap_err().to_string();
            println!("{text}: {refused}");
            assert!(refused.contains("no slope"), "{refused}");
        }
        assert!(matches!(of("k*"), Err(NoSlope::Invalid(_))));
        assert!(of("k*x").unwrap().unwrap().ends_with(" + 0*x"));
    }
}
