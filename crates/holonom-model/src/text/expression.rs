//! Arithmetic expressions of parameters: `length/2 + 0.1`, `30*deg`, `-x^2`, `atan2(y, x)`.
//!
//! ```text
//! sum     = product { ("+" | "-") product }
//! product = sign { ("*" | "/") sign }
//! sign    = ("-" | "+") sign | power              −x² = −(x²)
//! power   = atom [ "^" sign ]                     from the right
//! atom    = number | name | name "(" sum { "," sum } ")" | "(" sum ")"
//! ```

use std::ops::Range;

use super::problem::nearest;

/// Deepest nesting.
const DEEPEST: usize = 64;
/// Names that no parameter may have.
pub(crate) const CONSTANTS: [(&str, f64); 2] =
    [("pi", std::f64::consts::PI), ("deg", std::f64::consts::PI / 180.0)];

/// Functions of one number.
const FUNCTIONS: [(&str, fn(f64) -> f64); 11] = [
    ("sqrt", f64::sqrt),
    ("abs", f64::abs),
    ("exp", libm::exp),
    ("ln", libm::log),
    ("sin", libm::sin),
    ("cos", libm::cos),
    ("tan", libm::tan),
    ("asin", libm::asin),
    ("acos", libm::acos),
    ("atan", libm::atan),
    ("floor", f64::floor),
];

/// Functions of two; their arguments are finite.
const BINARY: [(&str, fn(f64, f64) -> f64); 4] =
    [("atan2", libm::atan2), ("hypot", libm::hypot), ("min", f64::min), ("max", f64::max)];

/// What expressions may use, in words.
pub(crate) fn vocabulary() -> String {
    let list = |names: &[&str]| names.join(" ");
    format!(
        "operators + - * / ^ with brackets; constants {}; functions {} of one number, {} of two",
        list(&CONSTANTS.map(|c| c.0)),
        list(&FUNCTIONS.map(|f| f.0)),
        list(&BINARY.map(|f| f.0))
    )
}

/// Whether a name is that of a constant or function.
pub(crate) fn is_reserved(name: &str) -> bool {
    let functions = FUNCTIONS.iter().map(|f| f.0).chain(BINARY.iter().map(|f| f.0));
    functions.chain(CONSTANTS.iter().map(|c| c.0)).any(|own| own == name)
}

/// What is wrong with an expression, and where in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ExpressionError {
    /// What.
    pub(crate) message: String,
    /// The name that is not known, if that is the reason.
    pub(crate) unknown: Option<String>,
    /// What to write instead.
    pub(crate) help: String,
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
    let (mut out, mut rest) = (String::new(), text);
    while let Some(first) = rest.chars().next() {
        let word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        let end = match first {
            c if word(c) => rest.find(|c: char| !word(c)).unwrap_or(rest.len()),
            c => c.len_utf8(),
        };
        let (token, after) = rest.split_at(end);
        let own = (first.is_alphabetic() || first == '_') && !token.contains('.');
        match own && !is_reserved(token) && !after.trim_start().starts_with('(') {
            true => out += &name(token),
            false => out += token,
        }
        rest = after;
    }
    out
}

/// The value of an expression; `value` knows the parameters. Every intermediate value is a finite
/// number, so that none that is not defined disappears in a later operation.
pub(crate) fn evaluate(
    text: &str,
    value: &mut dyn FnMut(&str) -> Option<f64>,
) -> Result<f64, ExpressionError> {
    let mut parser = Parser { text, at: 0, depth: 0, value };
    let result = parser.sum()?;
    match parser.peek() {
        None => Ok(result),
        Some(c) => Err(parser.unexpected(c)),
    }
}

struct Parser<'a> {
    text: &'a str,
    at: usize, // byte
    depth: usize,
    value: &'a mut dyn FnMut(&str) -> Option<f64>,
}

impl Parser<'_> {
    /// The next character that is no space.
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        self.at += if found { wanted.len_utf8() } else { 0 };
        found
    }

    fn wrong<T>(&self, message: impl Into<String>) -> Result<T, ExpressionError> {
        let help = format!("expressions have {}", vocabulary());
        Err(ExpressionError { message: message.into(), unknown: None, help })
    }

    fn unexpected(&self, c: char) -> ExpressionError {
        let place = self.text[..self.at].chars().count() + 1;
        let help = match c {
            ',' => "numbers have a decimal point: write 0.5, not 0,5".to_owned(),
            _ => format!("expressions have {}", vocabulary()),
        };
        let message = format!("`{c}` at character {place} is not expected");
        ExpressionError { message, unknown: None, help }
    }

    /// The value of the text since `start`, if it is a number.
    fn finite(&self, start: usize, value: f64) -> Result<f64, ExpressionError> {
        if value.is_finite() {
            return Ok(value);
        }
        let text = self.text[start..self.at].trim();
        let (what, help) = match value.is_nan() {
            true => ("is not defined", "let its arguments stay where it is defined"),
            false => {
                ("is not finite", "let its value stay finite: no division by zero, no overflow")
            }
        };
        let message = format!("`{text}` {what}");
        Err(ExpressionError { message, unknown: None, help: help.to_owned() })
    }

    fn sum(&mut self) -> Result<f64, ExpressionError> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return self.wrong(format!("more than {DEEPEST} brackets or signs are nested"));
        }
        let start = self.at;
        let mut result = self.product()?;
        loop {
            match self.peek() {
                Some('+') if self.take('+') => result += self.product()?,
                Some('-') if self.take('-') => result -= self.product()?,
                _ => break,
            }
            result = self.finite(start, result)?;
        }
        self.depth -= 1;
        Ok(result)
    }

    fn product(&mut self) -> Result<f64, ExpressionError> {
        let start = self.at;
        let mut result = self.sign()?;
        loop {
            match self.peek() {
                Some('*') if self.take('*') => result *= self.sign()?,
                Some('/') if self.take('/') => result /= self.sign()?,
                _ => return Ok(result),
            }
            result = self.finite(start, result)?;
        }
    }

    fn sign(&mut self) -> Result<f64, ExpressionError> {
        let mut negative = false;
        loop {
            match self.peek() {
                Some('-') => negative = !negative,
                Some('+') => {}
                _ => break,
            }
            self.at += 1;
        }
        let power = self.power()?;
        Ok(if negative { -power } else { power })
    }

    fn power(&mut self) -> Result<f64, ExpressionError> {
        let start = self.at;
        let base = self.atom()?;
        if !self.take('^') {
            return Ok(base);
        }
        self.depth += 1;
        if self.depth > DEEPEST {
            return self.wrong(format!("more than {DEEPEST} powers are nested"));
        }
        let exponent = self.sign()?;
        self.depth -= 1;
        self.finite(start, libm::pow(base, exponent))
    }

    fn atom(&mut self) -> Result<f64, ExpressionError> {
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let result = self.sum()?;
                self.close()?;
                Ok(result)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.name(),
            Some(c) => Err(self.unexpected(c)),
            None => self.wrong("it ends where a number or a name is missing"),
        }
    }

    fn close(&mut self) -> Result<(), ExpressionError> {
        if self.take(')') {
            return Ok(());
        }
        match self.peek() {
            Some(c) => Err(self.unexpected(c)),
            None => self.wrong("a closing bracket is missing"),
        }
    }

    fn number(&mut self) -> Result<f64, ExpressionError> {
        let range = self.while_it(|before, c| {
            let exponent = matches!(before, 'e' | 'E') && matches!(c, '+' | '-');
            c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E') || exponent
        });
        let (start, word) = (range.start, &self.text[range]);
        let number = word.parse().or_else(|_| self.wrong(format!("`{word}` is no number")))?;
        self.finite(start, number)
    }

    fn name(&mut self) -> Result<f64, ExpressionError> {
        let range = self.while_it(|_, c| c.is_alphanumeric() || c == '_');
        let (start, name) = (range.start, &self.text[range]);
        if self.take('(') {
            let first = self.sum()?;
            let second = if self.take(',') { Some(self.sum()?) } else { None };
            self.close()?;
            let unary = FUNCTIONS.iter().find(|f| f.0 == name);
            let binary = BINARY.iter().find(|f| f.0 == name);
            return match (unary, binary, second) {
                (Some((_, f)), _, None) => self.finite(start, f(first)),
                (_, Some((_, f)), Some(second)) => self.finite(start, f(first, second)),
                (None, None, _) => Err(no_function(name)),
                (_, binary, _) => {
                    let count = if binary.is_some() { "two numbers" } else { "one number" };
                    self.wrong(format!("`{name}` is a function of {count}"))
                }
            };
        }
        if let Some((_, constant)) = CONSTANTS.iter().find(|constant| constant.0 == name) {
            return Ok(*constant);
        }
        (self.value)(name).ok_or_else(|| no_parameter(name))
    }

    /// The characters that belong to a word, given the one before.
    fn while_it(&mut self, belongs: impl Fn(char, char) -> bool) -> Range<usize> {
        let (start, mut before) = (self.at, ' ');
        for c in self.text[start..].chars() {
            if !belongs(before, c) {
                break;
            }
            self.at += c.len_utf8();
            before = c;
        }
        start..self.at
    }
}

fn no_function(name: &str) -> ExpressionError {
    let functions = FUNCTIONS.iter().map(|f| f.0).chain(BINARY.iter().map(|f| f.0));
    let help = match nearest(name, functions.clone()) {
        Some(best) => format!("did you mean `{best}`?"),
        None => format!("functions are {}", functions.collect::<Vec<_>>().join(" ")),
    };
    ExpressionError { message: format!("`{name}` is no function"), unknown: None, help }
}

/// Whether a name is meant as the time.
pub(crate) fn is_time(name: &str) -> bool {
    matches!(name, "t" | "time")
}

fn no_parameter(name: &str) -> ExpressionError {
    let help = match is_time(name) {
        true => {
            "an expression is one number: for a function of time write the `history` of a load, the path of a \
             [[constraint]] of type \"motion\", or the `path` of a motor"
        }
        false => "state it under [parameters]",
    };
    let message = format!("there is no parameter `{name}`");
    ExpressionError { message, unknown: Some(name.to_owned()), help: help.to_owned() }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::float_cmp)] // exactly representable numbers
mod tests {
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
}
