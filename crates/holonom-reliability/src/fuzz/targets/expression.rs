//! Expressions of `[parameters]`.

use super::{Answer, FuzzTarget, Worker, lines};
use holonom::{Model, Override};

/// Expressions.
#[derive(Clone, Copy, Debug)]
pub struct Expression;

/// A model whose gravity is the value of an expression.
const MODEL: &str = "\
[model]
name = \"expression\"
gravity = [\"= x\", 0.0, 0.0]
[parameters]
a = 0.3
b = \"= 2*a\"
x = 0.0
[simulation]
step = 0.01
end = 0.1
[[body]]
name = \"body\"
mass = 1.0
inertia = [1.0, 1.0, 1.0]
";

impl FuzzTarget for Expression {
    fn name(&self) -> &'static str {
        "expression"
    }

    fn executions(&self) -> u64 {
        3_000_000
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        lines("tests/corpus/expression")
    }

    fn worker(&self) -> Box<dyn Worker> {
        Box::new(Evaluator)
    }
}

struct Evaluator;

impl Worker for Evaluator {
    fn execute(&mut self, input: &[u8]) -> Answer {
        evaluated(input, 1.0)
    }

    fn execute_unchecked(&mut self, input: &[u8]) -> Answer {
        evaluated(input, f64::INFINITY)
    }
}

fn evaluated(input: &[u8], factor: f64) -> Answer {
    let text = String::from_utf8_lossy(input);
    let value = toml::Value::String(format!("={text}")).to_string();
    match Model::from_toml_with(MODEL, &[Override::new("parameters.x", value)]) {
        Ok(model) if (factor * model.header.gravity[0]).is_finite() => Answer::Accepted,
        Ok(model) => Answer::Wrong(format!("accepted: {}", factor * model.header.gravity[0])),
        Err(error) => super::model::refused(&error, MODEL),
    }
}
