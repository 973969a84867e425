//! Values of a model text as serde reads them, with a strict count of entries.
//!
//! A list that stands for a vector, a matrix row, a pair of names or anything else of fixed length
//! must have exactly that many entries; serde alone reads the first ones and leaves the rest
//! unread. Every error knows its place.

use std::fmt;
use std::ops::Range;

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, Error as _, IntoDeserializer, MapAccess, SeqAccess, Visitor,
};
use serde::forward_to_deserialize_any;
use toml::Spanned;
use toml::de::{DeFloat, DeInteger, DeTable, DeValue};

/// What is expected where a table belongs.
pub(crate) const TABLE: &str = "a table";

/// Why a value cannot be read, and where it stands.
#[derive(Debug)]
pub(crate) struct ReadError {
    pub(crate) message: String,
    pub(crate) span: Option<Range<usize>>,
}

impl ReadError {
    fn at(mut self, span: &Range<usize>) -> Self {
        self.span.get_or_insert_with(|| span.clone());
        self
    }
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for ReadError {}

impl serde::de::Error for ReadError {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self { message: message.to_string(), span: None }
    }
}

/// A value with its place.
#[derive(Clone, Copy)]
pub(crate) struct Strict<'a, 'i>(pub(crate) &'a Spanned<DeValue<'i>>);

impl<'de> Deserializer<'de> for Strict<'_, '_> {
    type Error = ReadError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        let read = match self.0.get_ref() {
            DeValue::String(text) => visitor.visit_str(text),
            DeValue::Integer(number) => whole(number).and_then(|number| visitor.visit_i64(number)),
            DeValue::Float(number) => real(number).and_then(|number| visitor.visit_f64(number)),
            DeValue::Boolean(truth) => visitor.visit_bool(*truth),
            DeValue::Datetime(_) => Err(ReadError::custom("a date has no place here")),
            DeValue::Array(entries) => visitor.visit_seq(MapEntries(entries.iter())),
            DeValue::Table(table) => {
                visitor.visit_map(TableEntries { entries: table.iter(), value: None })
            }
        };
        read.map_err(|error| error.at(&self.0.span()))
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        expected: usize,
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        match self.0.get_ref() {
            DeValue::Array(entries) if entries.len() != expected => {
                let error = ReadError::custom(wrong_length(entries.len(), expected));
                Err(error.at(&self.0.span()))
            }
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        expected: usize,
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        self.deserialize_tuple(expected, visitor)
    }

    /// Never by the order of the keys: entries of a list have no names.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        self.deserialize_map(visitor)
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        match no_table(self.0.get_ref()) {
            Some(message) => Err(ReadError::custom(message).at(&self.0.span())),
            None => self.deserialize_any(visitor),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        let read = match self.0.get_ref() {
            DeValue::String(word) => {
                let word: StrDeserializer<'_, ReadError> = word.as_ref().into_deserializer();
                word.deserialize_enum(name, variants, visitor)
            }
            _ => {
                Err(ReadError::custom(format!("expected one of the words {}", variants.join(", "))))
            }
        };
        read.map_err(|error| error.at(&self.0.span()))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit
        unit_struct seq identifier ignored_any
    }
}

/// What is wrong with a value where a table belongs; `None` of a table.
pub(crate) fn no_table(value: &DeValue<'_>) -> Option<String> {
    let found = match value {
        DeValue::String(text) => format!("string {text:?}"),
        DeValue::Integer(number) => format!("number `{}`", number.as_str()),
        DeValue::Float(number) => format!("number `{}`", number.as_str()),
        DeValue::Boolean(truth) => format!("boolean `{truth}`"),
        DeValue::Array(_) => "list".to_owned(),
        DeValue::Datetime(_) => "date".to_owned(),
        DeValue::Table(_) => return None,
    };
    Some(format!("invalid type: {found}, expected {TABLE}"))
}

fn whole(number: &DeInteger<'_>) -> Result<i64, ReadError> {
    let read = i64::from_str_radix(number.as_str(), number.radix());
    read.map_err(|_| ReadError::custom("the whole number is too large"))
}

fn real(number: &DeFloat<'_>) -> Result<f64, ReadError> {
    number.as_str().parse().map_err(|_| ReadError::custom("this is not a number"))
}

/// The words for a list of the wrong length.
pub(crate) fn wrong_length(found: usize, expected: usize) -> String {
    let entries = if expected == 1 { "entry" } else { "entries" };
    format!("{found} given where {expected} {entries} are needed")
}

struct MapEntries<'a, 'i>(std::slice::Iter<'a, Spanned<DeValue<'i>>>);

impl<'de> SeqAccess<'de> for MapEntries<'_, '_> {
    type Error = ReadError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, ReadError> {
        let Some(value) = self.0.next() else { return Ok(None) };
        seed.deserialize(Strict(value)).map(Some).map_err(|error| error.at(&value.span()))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

struct TableEntries<'a, 'i, I: Iterator<Item = KeyValue<'a, 'i>>> {
    entries: I,
    value: Option<&'a Spanned<DeValue<'i>>>,
}

type KeyValue<'a, 'i> = (&'a Spanned<std::borrow::Cow<'i, str>>, &'a Spanned<DeValue<'i>>);

impl<'a, 'i: 'a, 'de, I: Iterator<Item = KeyValue<'a, 'i>>> MapAccess<'de>
    for TableEntries<'a, 'i, I>
{
    type Error = ReadError;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, ReadError> {
        let Some((key, value)) = self.entries.next() else { return Ok(None) };
        self.value = Some(value);
        let word: StrDeserializer<'_, ReadError> = key.get_ref().as_ref().into_deserializer();
        seed.deserialize(word).map(Some).map_err(|error| error.at(&key.span()))
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, ReadError> {
        let value = self.value.take().expect("a key comes first");
        seed.deserialize(Strict(value)).map_err(|error| error.at(&value.span()))
    }
}

/// The place of the first list with `length` entries at or below a value: enums with a `type` are
/// read through a buffer that does not know the places of its lists.
pub(crate) fn list_of(value: &Spanned<DeValue<'_>>, length: usize) -> Option<Range<usize>> {
    match value.get_ref() {
        DeValue::Array(entries) if entries.len() == length => Some(value.span()),
        DeValue::Array(entries) => entries.iter().find_map(|entry| list_of(entry, length)),
        DeValue::Table(table) => in_table(table, length),
        _ => None,
    }
}

fn in_table(table: &DeTable<'_>, length: usize) -> Option<Range<usize>> {
    table.values().find_map(|value| list_of(value, length))
}
