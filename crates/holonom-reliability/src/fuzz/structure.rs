//! Mutations of documents: keys and values removed, doubled, exchanged, replaced.

use super::mutate::{NUMBERS, WORDS};
use crate::soak::draw::Draw;
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use toml::{Table, Value};

/// A mutated copy of a TOML text, `None` where it is none; `other`: another text, for crossings.
#[must_use]
pub fn toml(input: &[u8], other: &[u8], draw: &mut Draw) -> Option<Vec<u8>> {
    let mut table = Value::clone(&*document(input)?);
    let donor = document(other);
    for _ in 0..draw.weighted(&[(6, 1), (3, 2), (1, 5)]) {
        let count = places(&table);
        let mut place = draw.index(count);
        let piece = donor.as_deref().map(|donor| {
            let mut place = draw.index(places(donor));
            pick(donor, &mut place).cloned().unwrap_or(Value::Boolean(true))
        });
        change(&mut table, &mut place, &mut |value| alter(value, piece.clone(), draw));
    }
    let Value::Table(table) = table else { return None };
    toml::to_string(&table).ok().map(String::into_bytes)
}

/// Documents that are remembered: those that a lane mutates.
const REMEMBERED: usize = 1024;

thread_local! {
    static DOCUMENTS: RefCell<HashMap<Vec<u8>, Option<Rc<Value>>>> = RefCell::default();
}

/// The document of a text, `None` where it is none. Each is read once.
fn document(text: &[u8]) -> Option<Rc<Value>> {
    let read = || std::str::from_utf8(text).ok()?.parse::<Table>().ok();
    DOCUMENTS.with_borrow_mut(|known| {
        if let Some(document) = known.get(text) {
            return document.clone();
        }
        if known.len() >= REMEMBERED {
            known.clear();
        }
        let document = read().map(|table| Rc::new(Value::Table(table)));
        known.insert(text.to_vec(), document.clone());
        document
    })
}

/// Values of a document, all levels.
fn places(value: &Value) -> usize {
    1 + match value {
        Value::Table(table) => table.values().map(places).sum(),
        Value::Array(items) => items.iter().map(places).sum::<usize>(),
        _ => 0,
    }
}

/// The value at a place, counted through all levels.
fn pick<'a>(value: &'a Value, place: &mut usize) -> Option<&'a Value> {
    if *place == 0 {
        return Some(value);
    }
    *place -= 1;
    match value {
        Value::Table(table) => table.values().find_map(|value| pick(value, place)),
        Value::Array(items) => items.iter().find_map(|value| pick(value, place)),
        _ => None,
    }
}

/// Calls `alter` for the value at a place; whether it was reached.
fn change(value: &mut Value, place: &mut usize, alter: &mut dyn FnMut(&mut Value)) -> bool {
    if *place == 0 {
        alter(value);
        return true;
    }
    *place -= 1;
    match value {
        Value::Table(table) => table.iter_mut().any(|(_, value)| change(value, place, alter)),
        Value::Array(items) => items.iter_mut().any(|value| change(value, place, alter)),
        _ => false,
    }
}

/// Changes one value.
fn alter(value: &mut Value, piece: Option<Value>, draw: &mut Draw) {
    match (value, piece) {
        (Value::Table(table), piece) => alter_table(table, piece, draw),
        (Value::Array(items), piece) => alter_array(items, piece, draw),
        (value, Some(piece)) if draw.chance(0.1) => *value = piece,
        (Value::Integer(number), _) if draw.chance(0.5) => {
            *number = draw.pick(&[0, 1, 2, 3, -1, 7, 100_000, i64::MAX, i64::MIN, 1 << 40]);
        }
        (Value::Float(number), _) if draw.chance(0.5) => {
            *number *= draw.pick(&[-1.0, 0.5, 2.0, 1.001, 1e3, 1e-3]);
        }
        (value, _) => *value = odd(draw),
    }
}

fn alter_table(table: &mut Table, piece: Option<Value>, draw: &mut Draw) {
    let keys: Vec<String> = table.keys().cloned().collect();
    if keys.is_empty() {
        table.insert("x".into(), odd(draw));
        return;
    }
    let key = keys[draw.index(keys.len())].clone();
    let other = keys[draw.index(keys.len())].clone();
    match draw.index(5) {
        0 => drop(table.remove(&key)),
        1 => {
            let value = table.remove(&key).unwrap_or(Value::Boolean(false));
            let swapped = table.insert(other, value);
            table.extend(swapped.map(|value| (key, value)));
        }
        2 => {
            let copy = table.get(&key).cloned().unwrap_or_else(|| odd(draw));
            table.insert(draw.pick(&WORDS).to_owned(), copy);
        }
        3 => {
            let new = piece.unwrap_or_else(|| odd(draw));
            table.insert(key, new);
        }
        _ => {
            table.insert(key, odd(draw));
        }
    }
}

fn alter_array(items: &mut Vec<Value>, piece: Option<Value>, draw: &mut Draw) {
    let at = draw.index(items.len().max(1));
    match draw.index(5) {
        0 if at < items.len() => drop(items.remove(at)),
        1 if at < items.len() => {
            let copy = items[at].clone();
            items.insert(draw.index(items.len() + 1), copy);
        }
        2 => items.reverse(),
        3 => items.extend(piece),
        _ if at < items.len() => items[at] = odd(draw),
        _ => items.push(odd(draw)),
    }
}

/// A value that nobody expects.
fn odd(draw: &mut Draw) -> Value {
    match draw.index(8) {
        0 => Value::String(draw.pick(&WORDS).to_owned()),
        1 => Value::Boolean(draw.chance(0.5)),
        2 => Value::Array(Vec::new()),
        3 => Value::Table(Table::new()),
        4 => Value::Float(draw.between(-2.0, 2.0)),
        _ => {
            let text = draw.pick(&NUMBERS);
            let float = || text.parse::<f64>().map_or(Value::Integer(7), Value::Float);
            text.parse::<i64>().map_or_else(|_| float(), Value::Integer)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mutated_documents_are_documents() {
        let text = b"a = 1\n[b]\nc = [1.0, 2.0]\nd = \"x\"\n[[e]]\nf = true\n".as_slice();
        let mut draw = Draw::new(3, 0);
        let mut changed = 0;
        for _ in 0..300 {
            let out = toml(text, text, &mut draw).expect("it is TOML");
            let text = String::from_utf8(out.clone()).expect("and text");
            assert!(text.parse::<Table>().is_ok(), "{text}");
            changed += usize::from(out != b"a = 1\n");
        }
        assert!(changed > 250, "{changed}");
    }
}
