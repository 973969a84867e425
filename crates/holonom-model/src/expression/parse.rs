//! The text of an expression: `length/2 + 0.1`, `30*deg`, `-x^2`, `atan2(y, x)`.
//!
//! ```text
//! sum     = product { ("+" | "-") product }
//! product = sign { ("*" | "/") sign }
//! sign    = ("-" | "+") sign | power              −x² = −(x²)
//! power   = atom [ "^" sign ]                     from the right
//! atom    = number | name | name "(" sum { "," sum } ")" | "(" sum ")"
//! name    = word { "." word }
//! ```
//! Equal parts become one operation; parts without inputs become their value.

mod condition;

use std::ops::Range;
use std::sync::Arc;

use super::function::{BINARY, Binary, TERNARY, UNARY, Unary};
use super::program::{ExpressionProgram, MOST, Operation, words};
use super::surface::Surface;
use super::table::Curve;
use super::{CONSTANTS, belongs, functions, is_time, vocabulary};
use crate::text::problem::nearest;

/// Deepest nesting.
const DEEPEST: usize = 64;
/// Powers up to this one are products where the base changes.
const LARGEST_PRODUCT: f64 = 8.0;

/// What a name in an expression stands for.
#[derive(Clone, Debug, PartialEq)]
pub enum KnownName {
    /// A number.
    Constant(f64),
    /// The input of this index.
    Input(usize),
    /// A function of one number, which is called.
    Curve(Curve),
    /// A function of two numbers, which is called.
    Surface(Surface),
}

/// What is wrong with an expression, and where in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExpressionError {
    /// What.
    pub message: String,
    /// The name that is not known, if that is the reason.
    pub unknown: Option<String>,
    /// What to write instead.
    pub help: String,
}

impl ExpressionProgram {
    /// Compiles an expression; `known` says what its names stand for.
    ///
    /// # Errors
    /// [`ExpressionError`]: not an expression, an unknown name, or a part without inputs that is
    /// no finite number.
    pub fn parse(
        text: &str,
        known: &mut dyn FnMut(&str) -> Option<KnownName>,
    ) -> Result<Self, ExpressionError> {
        Self::compile(text, known, |parser| parser.sum())
    }

    fn compile(
        text: &str,
        known: &mut dyn FnMut(&str) -> Option<KnownName>,
        whole: fn(&mut Parser<'_>) -> Result<usize, ExpressionError>,
    ) -> Result<Self, ExpressionError> {
        let mut parser = Parser {
            text,
            at: 0,
            depth: 0,
            known,
            operations: Vec::new(),
            spans: Vec::new(),
            curves: Vec::new(),
            surfaces: Vec::new(),
        };
        let result = whole(&mut parser)?;
        if let Some(c) = parser.peek() {
            return Err(parser.unexpected(c));
        }
        let (operations, spans) = (parser.operations, parser.spans);
        let (curves, surfaces) = (parser.curves.into(), parser.surfaces.into());
        Ok(Self { text: text.into(), curves, surfaces, ..reachable(&operations, &spans, result) })
    }
}

/// The operations on which `result` depends, which becomes the last.
fn reachable(operations: &[Operation], spans: &[Range<usize>], result: usize) -> ExpressionProgram {
    let mut used = vec![false; operations.len()];
    used[result] = true;
    for k in (0..=result).rev() {
        if used[k] {
            match operations[k] {
                Operation::Constant(_) | Operation::Input(_) => {}
                Operation::Unary(_, x) | Operation::Curve(_, x) => used[x] = true,
                Operation::Binary(_, all) | Operation::Surface(_, all) => {
                    all.iter().for_each(|x| used[*x] = true)
                }
                Operation::Select(all) => all.iter().for_each(|x| used[*x] = true),
            }
        }
    }
    let mut place = vec![0; operations.len()];
    let (mut kept, mut places) = (Vec::new(), Vec::new());
    for k in (0..=result).filter(|k| used[*k]) {
        place[k] = kept.len();
        kept.push(match operations[k] {
            Operation::Unary(f, x) => Operation::Unary(f, place[x]),
            Operation::Binary(f, all) => Operation::Binary(f, all.map(|x| place[x])),
            Operation::Select(all) => Operation::Select(all.map(|x| place[x])),
            Operation::Curve(curve, x) => Operation::Curve(curve, place[x]),
            Operation::Surface(own, all) => Operation::Surface(own, all.map(|x| place[x])),
            leaf => leaf,
        });
        places.push(spans[k].clone());
    }
    let (operations, spans) = (Arc::from(kept), Arc::from(places));
    let (curves, surfaces) = (Arc::from([]), Arc::from([]));
    ExpressionProgram { text: "".into(), operations, spans, curves, surfaces }
}

/// The value of an expression of parameters alone.
pub(crate) fn evaluate(
    text: &str,
    value: &mut dyn FnMut(&str) -> Option<f64>,
) -> Result<f64, ExpressionError> {
    let program = ExpressionProgram::parse(text, &mut |name| value(name).map(KnownName::Constant))?;
    Ok(program.constant().unwrap_or(f64::NAN)) // all its names are numbers
}

struct Parser<'a> {
    text: &'a str,
    at: usize, // byte
    depth: usize,
    known: &'a mut dyn FnMut(&str) -> Option<KnownName>,
    operations: Vec<Operation>,
    spans: Vec<Range<usize>>,
    curves: Vec<Curve>,
    surfaces: Vec<Surface>,
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

    /// The operation that is the text since `start`; its value where all operands are numbers.
    fn push(&mut self, start: usize, operation: Operation) -> Result<usize, ExpressionError> {
        let number = |k: usize| match self.operations[k] {
            Operation::Constant(value) => Some(value),
            _ => None,
        };
        let folded = match operation {
            Operation::Constant(value) => Some(value),
            Operation::Input(_) | Operation::Curve(..) | Operation::Surface(..) => None,
            Operation::Unary(function, x) => number(x).map(|x| function.value(x)),
            Operation::Binary(function, [x, y]) => {
                number(x).zip(number(y)).map(|(x, y)| function.value(x, y))
            }
            Operation::Select([c, a, b]) => {
                number(c).and_then(|c| number(if c > 0.0 { a } else { b }))
            }
        };
        let operation = folded.map_or(operation, Operation::Constant);
        if let Some(value) = folded.filter(|value| !value.is_finite()) {
            let message = words(self.text[start..self.at].trim(), value);
            let help = match value.is_nan() {
                true => "let its arguments stay where it is defined",
                false => "let its value stay finite: no division by zero, no overflow",
            };
            return Err(ExpressionError { message, unknown: None, help: help.to_owned() });
        }
        let bits = |operation: &Operation| match operation {
            Operation::Constant(value) => value.to_bits(),
            _ => 0,
        };
        let equal = |own: &Operation| *own == operation && bits(own) == bits(&operation);
        if let Some(k) = self.operations.iter().position(equal) {
            return Ok(k);
        }
        if self.operations.len() == MOST {
            return self.wrong(format!("it has more than {MOST} operations"));
        }
        self.operations.push(operation);
        self.spans.push(start..self.at);
        Ok(self.operations.len() - 1)
    }

    fn binary(
        &mut self,
        start: usize,
        f: Binary,
        ends: [usize; 2],
    ) -> Result<usize, ExpressionError> {
        self.push(start, Operation::Binary(f, ends))
    }

    fn sum(&mut self) -> Result<usize, ExpressionError> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return self.wrong(format!("more than {DEEPEST} brackets or signs are nested"));
        }
        let start = self.at;
        let mut result = self.product()?;
        loop {
            let function = match self.peek() {
                Some('+') => Binary::Sum,
                Some('-') => Binary::Difference,
                _ => break,
            };
            self.at += 1;
            let next = self.product()?;
            result = self.binary(start, function, [result, next])?;
        }
        self.depth -= 1;
        Ok(result)
    }

    fn product(&mut self) -> Result<usize, ExpressionError> {
        let start = self.at;
        let mut result = self.sign()?;
        loop {
            let function = match self.peek() {
                Some('*') => Binary::Product,
                Some('/') => Binary::Quotient,
                _ => return Ok(result),
            };
            self.at += 1;
            let next = self.sign()?;
            result = self.binary(start, function, [result, next])?;
        }
    }

    fn sign(&mut self) -> Result<usize, ExpressionError> {
        let (start, mut negative) = (self.at, false);
        loop {
            match self.peek() {
                Some('-') => negative = !negative,
                Some('+') => {}
                _ => break,
            }
            self.at += 1;
        }
        let power = self.power()?;
        if negative {
            self.push(start, Operation::Unary(Unary::Negative, power))
        } else {
            Ok(power)
        }
    }

    fn power(&mut self) -> Result<usize, ExpressionError> {
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
        let whole = match (self.operations[base], self.operations[exponent]) {
            (Operation::Constant(_), _) => None,
            (_, Operation::Constant(n)) => {
                Some(n).filter(|n| n.fract() == 0.0 && (1.0..=LARGEST_PRODUCT).contains(n))
            }
            _ => None,
        };
        match whole {
            Some(n) => {
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 1 to 8
                let n = n as u8;
                self.push(start, Operation::Unary(Unary::Integer(n), base))
            }
            None => self.binary(start, Binary::Power, [base, exponent]),
        }
    }

    fn atom(&mut self) -> Result<usize, ExpressionError> {
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

    fn number(&mut self) -> Result<usize, ExpressionError> {
        let range = self.while_it(|before, c| {
            let exponent = matches!(before, 'e' | 'E') && matches!(c, '+' | '-');
            c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E') || exponent
        });
        let (start, word) = (range.start, &self.text[range]);
        let number = word.parse().or_else(|_| self.wrong(format!("`{word}` is no number")))?;
        self.push(start, Operation::Constant(number))
    }

    fn name(&mut self) -> Result<usize, ExpressionError> {
        let range = self.while_it(|_, c| belongs(c));
        let (start, name) = (range.start, &self.text[range]);
        if self.take('(') {
            let mut arguments = vec![self.sum()?];
            while self.take(',') {
                arguments.push(self.sum()?);
            }
            self.close()?;
            return self.call(start, name, &arguments);
        }
        if let Some((_, constant)) = CONSTANTS.iter().find(|constant| constant.0 == name) {
            return self.push(start, Operation::Constant(*constant));
        }
        match (self.known)(name) {
            Some(KnownName::Constant(value)) => self.push(start, Operation::Constant(value)),
            Some(KnownName::Input(input)) => self.push(start, Operation::Input(input)),
            Some(known @ (KnownName::Curve(_) | KnownName::Surface(_))) => {
                let (call, of) = match known {
                    KnownName::Surface(_) => ("x, y", "arguments"),
                    _ => ("x", "argument"),
                };
                let help = format!("write {name}({call}), with its {of}");
                let message = format!("`{name}` is a table");
                Err(ExpressionError { message, unknown: None, help })
            }
            None => Err(no_parameter(name)),
        }
    }

    fn call(&mut self, start: usize, name: &str, x: &[usize]) -> Result<usize, ExpressionError> {
        let unary = UNARY.iter().find(|f| f.0 == name).map(|f| f.1);
        let binary = BINARY.iter().find(|f| f.0 == name).map(|f| f.1);
        match (unary, binary, x) {
            (Some(f), _, [x]) => self.push(start, Operation::Unary(f, *x)),
            (_, Some(f), [x, y]) => self.binary(start, f, [*x, *y]),
            (None, None, [x, a, b]) if TERNARY.contains(&name) => match name {
                "clamp" => {
                    let most = self.binary(start, Binary::Max, [*x, *a])?;
                    self.binary(start, Binary::Min, [most, *b])
                }
                "select" => self.push(start, Operation::Select([*x, *a, *b])),
                _ => {
                    let from = self.binary(start, Binary::Difference, [*x, *a])?;
                    let length = self.binary(start, Binary::Difference, [*b, *a])?;
                    let part = self.binary(start, Binary::Quotient, [from, length])?;
                    self.push(start, Operation::Unary(Unary::Smooth, part))
                }
            },
            (None, None, _) if !TERNARY.contains(&name) => match ((self.known)(name), x) {
                (Some(KnownName::Curve(curve)), [x]) => {
                    self.curves.push(curve);
                    self.push(start, Operation::Curve(self.curves.len() - 1, *x))
                }
                (Some(KnownName::Surface(surface)), [x, y]) => {
                    self.surfaces.push(surface);
                    self.push(start, Operation::Surface(self.surfaces.len() - 1, [*x, *y]))
                }
                (Some(KnownName::Surface(_)), _) => {
                    self.wrong(format!("the table `{name}` is a function of two numbers"))
                }
                (Some(KnownName::Curve(_)), _) => {
                    self.wrong(format!("the table `{name}` is a function of one number"))
                }
                _ => Err(no_function(name)),
            },
            _ => {
                let count = match (unary, binary) {
                    (Some(_), _) => "one number",
                    (_, Some(_)) => "two numbers",
                    _ => "three numbers",
                };
                self.wrong(format!("`{name}` is a function of {count}"))
            }
        }
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
    let help = match nearest(name, functions()) {
        Some(best) => format!("did you mean `{best}`?"),
        None => format!("functions are {}", functions().collect::<Vec<_>>().join(" ")),
    };
    ExpressionError { message: format!("`{name}` is no function"), unknown: None, help }
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
