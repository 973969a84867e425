//! The text of a condition: `ball.vx > ball.vz and ball.z > 4`.
//!
//! ```text
//! condition  = both { "or" both }                           max
//! both       = comparison { "and" comparison }              min
//! comparison = sum (">" | ">=") sum                         left − right
//!            | sum ("<" | "<=") sum                         right − left
//!            | "(" condition ")"
//! ```
//! It is true where its value is positive, a continuous function of what it compares: events are
//! found as its roots.

use super::{DEEPEST, ExpressionError, ExpressionProgram, KnownName, Parser};
use crate::expression::belongs;
use crate::expression::function::Binary;

impl ExpressionProgram {
    /// Compiles a condition, which is true where its value is positive.
    ///
    /// # Errors
    /// [`ExpressionError`], as [`ExpressionProgram::parse`].
    pub fn condition(
        text: &str,
        known: &mut dyn FnMut(&str) -> Option<KnownName>,
    ) -> Result<Self, ExpressionError> {
        Self::compile(text, known, |parser| parser.condition())
    }
}

impl Parser<'_> {
    fn condition(&mut self) -> Result<usize, ExpressionError> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return self.wrong(format!("more than {DEEPEST} brackets are nested"));
        }
        let start = self.at;
        let mut result = self.both()?;
        while self.word("or") {
            let next = self.both()?;
            result = self.binary(start, Binary::Max, [result, next])?;
        }
        self.depth -= 1;
        Ok(result)
    }

    fn both(&mut self) -> Result<usize, ExpressionError> {
        let start = self.at;
        let mut result = self.comparison()?;
        while self.word("and") {
            let next = self.comparison()?;
            result = self.binary(start, Binary::Min, [result, next])?;
        }
        Ok(result)
    }

    /// A bracket may hold a number or a condition.
    fn comparison(&mut self) -> Result<usize, ExpressionError> {
        let bracket = self.peek() == Some('(');
        let (start, depth) = (self.at, self.depth);
        let number = self.sum().and_then(|left| self.compared(start, left));
        let Err(fault) = number else { return number };
        if !bracket {
            return Err(fault);
        }
        let reached = self.at;
        (self.at, self.depth) = (start + 1, depth);
        let inner = self.condition().and_then(|inner| self.close().map(|()| inner));
        inner.map_err(|own| if self.at > reached { own } else { fault })
    }

    fn compared(&mut self, start: usize, left: usize) -> Result<usize, ExpressionError> {
        let greater = match self.peek() {
            Some('>') => true,
            Some('<') => false,
            _ => {
                let help = "write a comparison, such as `knee > 0.5`, or several, joined by `and` and `or`";
                let message = "a condition compares two numbers by < or >".to_owned();
                return Err(ExpressionError { message, unknown: None, help: help.to_owned() });
            }
        };
        self.at += 1;
        if self.text[self.at..].starts_with('=') {
            self.at += 1;
        }
        let right = self.sum()?;
        let ends = if greater { [left, right] } else { [right, left] };
        self.binary(start, Binary::Difference, ends)
    }

    fn word(&mut self, word: &str) -> bool {
        self.peek();
        let rest = &self.text[self.at..];
        let found = rest.strip_prefix(word).is_some_and(|after| !after.starts_with(belongs));
        self.at += if found { word.len() } else { 0 };
        found
    }
}
