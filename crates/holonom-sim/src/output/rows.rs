//! Rows of a table as text, written in blocks that never end within a row.
//!
//! Numbers are the shortest decimals that read back as the same number.

use std::io::{self, Write};

use csv::Writer;

/// Collects whole rows and hands them over in blocks.
pub(super) struct RowBlocks<W: Write> {
    sink: W,
    block: Vec<u8>,
}

impl<W: Write> std::fmt::Debug for RowBlocks<W> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rows").field("waiting", &self.block.len()).finish_non_exhaustive()
    }
}

/// A field of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RowField<'a> {
    /// A number.
    Number(f64),
    /// 0 or 1.
    Flag(bool),
    /// A count.
    Index(usize),
    /// [`quoted`] text.
    Text(&'a str),
    /// Nothing.
    Empty,
}

impl<W: Write> RowBlocks<W> {
    const BLOCK: usize = 64 * 1024;

    pub(super) fn new(sink: W) -> Self {
        Self { sink, block: Vec::with_capacity(2 * Self::BLOCK) }
    }

    /// Writes a row that holds text.
    pub(super) fn push(
        &mut self,
        row: impl FnOnce(&mut Writer<&mut Vec<u8>>) -> csv::Result<()>,
    ) -> io::Result<()> {
        let before = self.block.len();
        let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(&mut self.block);
        let written = row(&mut writer).map_err(io::Error::from).and_then(|()| writer.flush());
        drop(writer);
        if written.is_err() {
            self.block.truncate(before);
        }
        written?;
        self.hand_over()
    }

    /// Writes a row of a step index and the numbers of all `parts`.
    pub(super) fn numbers(&mut self, step: u64, parts: &[&[f64]]) -> io::Result<()> {
        self.fields(step, parts.iter().copied().flatten().map(|x| RowField::Number(*x)))
    }

    /// Writes a row of a step index and `fields`; allocates only when the block grows.
    pub(super) fn fields<'a>(
        &mut self,
        step: u64,
        fields: impl Iterator<Item = RowField<'a>>,
    ) -> io::Result<()> {
        let mut text = zmij::Buffer::new();
        write!(self.block, "{step}")?;
        for field in fields {
            self.block.push(b',');
            match field {
                RowField::Number(x) if x.abs() < 1e15 => {
                    self.block.extend_from_slice(text.format(x).as_bytes());
                }
                // 1e16, not 1e+16, as the csv crate writes it
                RowField::Number(x) => {
                    self.block.extend(text.format(x).bytes().filter(|byte| *byte != b'+'));
                }
                RowField::Flag(flag) => self.block.push(b'0' + u8::from(flag)),
                RowField::Index(k) => write!(self.block, "{k}")?,
                RowField::Text(text) => self.block.extend_from_slice(text.as_bytes()),
                RowField::Empty => {}
            }
        }
        self.block.push(b'\n');
        self.hand_over()
    }

    fn hand_over(&mut self) -> io::Result<()> {
        if self.block.len() >= Self::BLOCK { self.flush() } else { Ok(()) }
    }

    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.sink.write_all(&self.block)?;
        self.block.clear();
        self.sink.flush()
    }
}

/// A text as a field, in quotation marks where it needs them.
pub(super) fn quoted(text: &str) -> io::Result<String> {
    let mut writer = Writer::from_writer(Vec::new());
    writer.write_record([text])?;
    let line = writer.into_inner().map_err(|error| error.into_error())?;
    Ok(String::from_utf8_lossy(&line).trim_end_matches('\n').to_owned())
}

impl<W: Write> Drop for RowBlocks<W> {
    fn drop(&mut self) {
        let _ = self.flush(); // nobody is left to hear of it
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bit patterns all over the range, and numbers near one.
    fn numbers() -> Vec<f64> {
        let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
        let mut next = || {
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            bits
        };
        let any = (0..2000).map(|_| f64::from_bits(next())).collect::<Vec<_>>();
        let near = (0..2000).map(|_| (next() >> 11) as f64 / 1e12_f64.powi((next() % 3) as i32));
        let mut all = [any, near.collect()].concat();
        all.extend([0.0, -0.0, 1.0, 1e15, 1e16, 1e17, 1e-4, 1e-5, 1e-6, 5e-324, f64::MAX]);
        all.extend([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]);
        all
    }

    #[test]
    fn numbers_are_written_as_the_csv_crate_writes_them() {
        for x in numbers() {
            let (mut own, mut other) = (Vec::new(), Vec::new());
            RowBlocks::new(&mut own).numbers(7, &[&[x], &[1.5]]).unwrap();
            RowBlocks::new(&mut other).push(|row| row.serialize((7, x, 1.5))).unwrap();
            let (own, other) = (String::from_utf8(own).unwrap(), String::from_utf8(other).unwrap());
            assert_eq!(own, other);
            let back: f64 = own.split(',').nth(1).unwrap().parse().unwrap();
            assert!(back.to_bits() == x.to_bits() || x.is_nan(), "{x:e}");
        }
    }

    #[test]
    fn flags_and_empty_fields() {
        let mut text = Vec::new();
        let [flags, numbers] = [
            [RowField::Flag(true), RowField::Empty],
            [RowField::Number(-2.0), RowField::Flag(false)],
        ];
        let name = quoted("a, \"b\"").unwrap();
        let names = [RowField::Text(&name), RowField::Index(12)];
        let fields = [flags, numbers, names].concat().into_iter();
        RowBlocks::new(&mut text).fields(0, fields).unwrap();
        assert_eq!(String::from_utf8(text).unwrap(), "0,1,,-2.0,0,\"a, \"\"b\"\"\",12\n");
    }
}
