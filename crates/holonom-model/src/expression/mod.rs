//! Expressions: compiled once, evaluated with exact slopes and without allocation.
//!
//! ```text
//! text ── parse ── operations in the order of evaluation ── value
//!                                                       ├── gradient   reverse sweep
//!                                                       ├── taylor     value, rate, acceleration in t
//!                                                       └── slope      by a parameter, as an expression
//! ```
//! [`ExpressionProgram::gradient`] costs about two evaluations whatever the number of inputs. Every
//! intermediate value is a finite number: the first that is not ends the evaluation and is named by
//! its text, so that none disappears in a later operation (`min(1, 0/0)`).
//!
//! ```
//! use holonom_model::expression::{ExpressionProgram, KnownName};
//!
//! let names = ["t", "x", "v"];
//! let mut known = |name: &str| names.iter().position(|own| *own == name).map(KnownName::Input);
//! let spring = ExpressionProgram::parse("-2.0e4*x - 6.0e5*x^3 - 30*abs(v)*v", &mut known).expect("valid");
//! let mut slopes = [0.0; 3];
//! let effort = spring.gradient(&[0.0, -0.01, 0.0], &mut slopes).expect("defined");
//! assert!((effort - 200.6).abs() < 1e-12 && (slopes[1] + 20180.0).abs() < 1e-9);
//! ```

mod function;
mod parse;
mod program;
mod slope;
mod surface;
mod table;
#[cfg(test)]
mod tests;

pub(crate) use parse::evaluate;
pub use parse::{ExpressionError, KnownName};
pub use program::{ExpressionProgram, UndefinedPart};
pub use slope::{Moving, NoSlope, slope};
pub use surface::Surface;
pub use table::Curve;

use function::{BINARY, TERNARY, UNARY};

/// Names that no parameter may have.
const CONSTANTS: [(&str, f64); 2] =
    [("pi", std::f64::consts::PI), ("deg", std::f64::consts::PI / 180.0)];

fn functions() -> impl Iterator<Item = &'static str> + Clone {
    let unary = UNARY.iter().map(|f| f.0);
    unary.chain(BINARY.iter().map(|f| f.0)).chain(TERNARY)
}

/// What expressions may use, in words.
pub(crate) fn vocabulary() -> String {
    let list = |names: &[&str]| names.join(" ");
    format!(
        "operators + - * / ^ with brackets; constants {}; functions {} of one number, {} of two, {} of three",
        list(&CONSTANTS.map(|c| c.0)),
        list(&UNARY.map(|f| f.0)),
        list(&BINARY.map(|f| f.0)),
        list(&TERNARY),
    )
}

/// Whether a name is that of a constant or function, or joins conditions.
pub(crate) fn is_reserved(name: &str) -> bool {
    let own = functions().chain(CONSTANTS.iter().map(|c| c.0));
    own.chain(["and", "or"]).any(|own| own == name)
}

/// Whether a name is meant as the time.
pub(crate) fn is_time(name: &str) -> bool {
    matches!(name, "t" | "time")
}

/// The names of parameters in an expression, valid or not.
pub(crate) fn names(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    renamed(text, &mut |name| {
        found.push(name.to_owned());
        String::new()
    });
    found
}

/// An expression with other names for its parameters.
pub(crate) fn renamed(text: &str, name: &mut dyn FnMut(&str) -> String) -> String {
    words(text, &mut |token, called| match token.contains('.') || called {
        true => token.to_owned(),
        false => name(token),
    })
}

/// An expression with other names for its parameters, for the tables that it calls, and for the
/// parts before a point: `knee.rate`.
pub(crate) fn renamed_parts(text: &str, name: &mut dyn FnMut(&str) -> String) -> String {
    words(text, &mut |token, _| match token.split_once('.') {
        Some((part, of)) => format!("{}.{of}", name(part)),
        None => name(token),
    })
}

/// Whether a character belongs to a word or a number of expressions.
fn belongs(c: char) -> bool {
    c.is_alphanumeric() || c == '_' || c == '.'
}

/// Whether a name is one word of expressions: letters, digits and `_`, no digit first.
pub(crate) fn is_word(name: &str) -> bool {
    name.chars().all(|c| belongs(c) && c != '.') && !name.starts_with(char::is_numeric)
}

/// An expression with other words in it, except for its own functions and constants; `word` gets a
/// word and whether it is called.
fn words(text: &str, word: &mut dyn FnMut(&str, bool) -> String) -> String {
    let (mut out, mut rest) = (String::new(), text);
    while let Some(first) = rest.chars().next() {
        let end = match first {
            c if belongs(c) => rest.find(|c: char| !belongs(c)).unwrap_or(rest.len()),
            c => c.len_utf8(),
        };
        let (token, after) = rest.split_at(end);
        match (first.is_alphabetic() || first == '_') && !is_reserved(token) {
            true => out += &word(token, after.trim_start().starts_with('(')),
            false => out += token,
        }
        rest = after;
    }
    out
}
