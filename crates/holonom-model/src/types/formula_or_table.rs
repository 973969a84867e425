//! Values that are an expression of `t`, a text or a number, or a table of keys.

use schemars::Schema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

use super::law::Formula;

/// What is stated by an expression or by a table.
pub(crate) trait FormulaOr: Sized {
    /// What is expected, in words.
    const EXPECTING: &str;
    /// By an expression.
    fn of_formula(formula: Formula) -> Self;
    /// By a table.
    fn of_table<'de, D: Deserializer<'de>>(table: D) -> Result<Self, D::Error>;
}

struct StatedFormula<T>(PhantomData<T>);

impl<'de, T: FormulaOr> Visitor<'de> for StatedFormula<T> {
    type Value = T;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(T::EXPECTING)
    }
    fn visit_str<E: Error>(self, text: &str) -> Result<T, E> {
        Ok(T::of_formula(Formula(text.to_owned())))
    }
    fn visit_f64<E: Error>(self, number: f64) -> Result<T, E> {
        Ok(T::of_formula(Formula::of_number(number)))
    }
    fn visit_i64<E: Error>(self, number: i64) -> Result<T, E> {
        self.visit_f64(number as f64)
    }
    fn visit_u64<E: Error>(self, number: u64) -> Result<T, E> {
        self.visit_f64(number as f64)
    }
    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<T, A::Error> {
        T::of_table(MapAccessDeserializer::new(map))
    }
}

/// Reads one or the other.
pub(super) fn deserialize<'de, T: FormulaOr, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<T, D::Error> {
    deserializer.deserialize_any(StatedFormula(PhantomData))
}

/// The schema of a table, or of an expression beside it.
pub(super) fn or_text(schema: &mut Schema) {
    let text = serde_json::json!({
        "description": "An expression of `t` and of tables, evaluated along the run.",
        "type": "string",
    });
    let Some(own) = schema.as_object_mut() else { return };
    if let Some(words) = own.get_mut("oneOf").and_then(|words| words.as_array_mut()) {
        words.insert(0, text);
        return;
    }
    let mut table = std::mem::take(own);
    if let Some(description) = table.remove("description") {
        own.insert("description".into(), description);
    }
    table.insert("description".into(), "Its keys.".into());
    own.insert("anyOf".into(), serde_json::json!([text, table]));
}
