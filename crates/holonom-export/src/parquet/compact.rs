//! Structures in the compact protocol of Apache Thrift, in which Parquet states its metadata.
//!
//! Source: Apache Thrift, doc/specs/thrift-compact-protocol.md.

const STOP: u8 = 0;
const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// The fields of a structure, in the order of their numbers.
pub(super) struct Fields<'a> {
    bytes: &'a mut Vec<u8>,
    last: u8,
}

/// Appends a structure with the fields that `write` states.
pub(super) fn structure(bytes: &mut Vec<u8>, write: impl FnOnce(&mut Fields<'_>)) {
    write(&mut Fields { bytes: &mut *bytes, last: 0 });
    bytes.push(STOP);
}

impl Fields<'_> {
    pub(super) fn int(&mut self, number: u8, value: i32) {
        self.head(number, I32);
        varint(self.bytes, zigzag(i64::from(value)));
    }

    pub(super) fn long(&mut self, number: u8, value: i64) {
        self.head(number, I64);
        varint(self.bytes, zigzag(value));
    }

    pub(super) fn text(&mut self, number: u8, value: &str) {
        self.head(number, BINARY);
        text(self.bytes, value);
    }

    pub(super) fn nested(&mut self, number: u8, write: impl FnOnce(&mut Fields<'_>)) {
        self.head(number, STRUCT);
        structure(self.bytes, write);
    }

    pub(super) fn structures<T>(
        &mut self,
        number: u8,
        items: &[T],
        mut write: impl FnMut(&T, &mut Fields<'_>),
    ) {
        self.list(number, STRUCT, items.len());
        items.iter().for_each(|item| structure(self.bytes, |fields| write(item, fields)));
    }

    pub(super) fn ints(&mut self, number: u8, items: &[i32]) {
        self.list(number, I32, items.len());
        items.iter().for_each(|item| varint(self.bytes, zigzag(i64::from(*item))));
    }

    pub(super) fn texts(&mut self, number: u8, items: &[&str]) {
        self.list(number, BINARY, items.len());
        items.iter().for_each(|item| text(self.bytes, item));
    }

    fn head(&mut self, number: u8, kind: u8) {
        debug_assert!((1..16).contains(&(number - self.last)), "field {number}");
        self.bytes.push(((number - self.last) << 4) | kind);
        self.last = number;
    }

    fn list(&mut self, number: u8, kind: u8, length: usize) {
        self.head(number, LIST);
        match u8::try_from(length) {
            Ok(length @ ..15) => self.bytes.push((length << 4) | kind),
            _ => {
                self.bytes.push(0xF0 | kind);
                varint(self.bytes, length as u64);
            }
        }
    }
}

fn text(bytes: &mut Vec<u8>, value: &str) {
    varint(bytes, value.len() as u64);
    bytes.extend_from_slice(value.as_bytes());
}

fn zigzag(value: i64) -> u64 {
    ((value << 1) ^ (value >> 63)) as u64
}

/// Seven bits a byte, the lowest first (ULEB128).
pub(super) fn varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value > 0x7F {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples of the specification: 50399 is DF 89 03; zigzag of 0, -1, 1, -2 is 0, 1, 2, 3.
    #[test]
    fn numbers_are_written_as_in_the_specification() {
        let mut bytes = Vec::new();
        varint(&mut bytes, 50_399);
        println!("{bytes:X?}");
        assert_eq!(bytes, [0xDF, 0x89, 0x03]);
        assert_eq!([0, -1, 1, -2, i64::MIN].map(zigzag), [0, 1, 2, 3, u64::MAX]);
    }

    #[test]
    fn fields_state_the_distance_of_their_numbers() {
        let mut bytes = Vec::new();
        structure(&mut bytes, |fields| {
            fields.int(1, -1);
            fields.long(3, 1);
            fields.nested(5, |inner| inner.text(2, "ab"));
            fields.ints(6, &[0; 15]);
        });
        println!("{bytes:X?}");
        let (head, list) = bytes.split_at(11);
        assert_eq!(head, [0x15, 1, 0x26, 2, 0x2C, 0x28, 2, b'a', b'b', 0, 0x19]);
        assert_eq!(list[..2], [0xF5, 15]);
        assert_eq!((list.len(), list.last()), (2 + 15 + 1, Some(&0)));
    }
}
