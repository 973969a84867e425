//! A Parquet file of columns that are neither nested nor compressed.
//!
//! ```text
//! PAR1   (page header, levels, values) for each column of each group of rows   metadata   its length   PAR1
//! ```
//! A column with missing values (`OPTIONAL`) has a bit for each row before its values, 1 where
//! there is one.
//!
//! Source: Apache Parquet, parquet.thrift (numbers of fields and enums), Encodings.md (PLAIN, RLE).

use super::compact::{Fields, structure, varint};
use std::fs::File;
use std::io::{BufWriter, Error, Result, Write};
use std::ops::Range;
use std::path::Path;

const MAGIC: &[u8; 4] = b"PAR1";
/// Rows that a reader can skip or take as one.
const GROUP: usize = 1 << 16;

// parquet.thrift: Type, FieldRepetitionType, ConvertedType, Encoding, PageType, CompressionCodec
const INT64: i32 = 2;
const DOUBLE: i32 = 5;
const BYTE_ARRAY: i32 = 6;
const REQUIRED: i32 = 0;
const OPTIONAL: i32 = 1;
const UTF8: i32 = 0;
const PLAIN: i32 = 0;
const RLE: i32 = 3;
const DATA_PAGE: i32 = 0;
const UNCOMPRESSED: i32 = 0;

/// One column, with its type.
pub(super) enum ColumnValues<'a> {
    /// Whole numbers.
    Integers(&'a [f64]),
    Numbers(&'a [f64]),
    /// Some are missing: NaN.
    Optional(&'a [f64]),
    Words(&'a [String]),
}

impl ColumnValues<'_> {
    fn physical(&self) -> i32 {
        match self {
            Self::Integers(_) => INT64,
            Self::Numbers(_) | Self::Optional(_) => DOUBLE,
            Self::Words(_) => BYTE_ARRAY,
        }
    }

    fn repetition(&self) -> i32 {
        if matches!(self, Self::Optional(_)) { OPTIONAL } else { REQUIRED }
    }

    /// Levels and values of some rows: the body of a page.
    fn write(&self, rows: Range<usize>, page: &mut Vec<u8>) {
        match self {
            Self::Integers(values) => {
                values[rows]
                    .iter()
                    .for_each(|x| page.extend_from_slice(&(*x as i64).to_le_bytes()));
            }
            Self::Numbers(values) => {
                values[rows].iter().for_each(|x| page.extend_from_slice(&x.to_le_bytes()));
            }
            Self::Optional(values) => {
                let values = &values[rows];
                write_levels(values, page);
                let present = values.iter().filter(|x| !x.is_nan());
                present.for_each(|x| page.extend_from_slice(&x.to_le_bytes()));
            }
            Self::Words(words) => {
                for word in &words[rows] {
                    page.extend_from_slice(&(word.len() as u32).to_le_bytes());
                    page.extend_from_slice(word.as_bytes());
                }
            }
        }
    }
}

/// One bit for each value, 0 for NaN: a single run of packed bits, after its length.
fn write_levels(values: &[f64], page: &mut Vec<u8>) {
    let mut run = Vec::with_capacity(values.len() / 8 + 5);
    varint(&mut run, ((values.len().div_ceil(8) << 1) | 1) as u64);
    run.extend(values.chunks(8).map(|eight| {
        let bits = eight.iter().enumerate().map(|(k, x)| u8::from(!x.is_nan()) << k);
        bits.sum::<u8>()
    }));
    page.extend_from_slice(&(run.len() as u32).to_le_bytes());
    page.extend_from_slice(&run);
}

/// Where the page of a column stands.
struct Chunk {
    offset: i64,
    size: i64,
}

/// Some rows of all columns.
struct RowGroup {
    rows: i64,
    chunks: Vec<Chunk>,
}

/// Writes columns of `rows` values each.
pub(super) fn write(path: &Path, columns: &[(&str, ColumnValues<'_>)], rows: usize) -> Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    file.write_all(MAGIC)?;
    let mut offset = MAGIC.len() as i64;
    let (mut groups, mut head, mut page) = (Vec::new(), Vec::new(), Vec::new());
    for from in (0..rows).step_by(GROUP) {
        let range = from..rows.min(from + GROUP);
        let mut chunks = Vec::with_capacity(columns.len());
        for (_, values) in columns {
            page.clear();
            values.write(range.clone(), &mut page);
            head.clear();
            let size = i32::try_from(page.len()).map_err(Error::other)?;
            structure(&mut head, |header| page_header(header, size, range.len() as i32));
            file.write_all(&head)?;
            file.write_all(&page)?;
            let size = (head.len() + page.len()) as i64;
            chunks.push(Chunk { offset, size });
            offset += size;
        }
        groups.push(RowGroup { rows: range.len() as i64, chunks });
    }
    let mut metadata = Vec::new();
    structure(&mut metadata, |fields| file_metadata(fields, columns, &groups));
    file.write_all(&metadata)?;
    file.write_all(&u32::try_from(metadata.len()).map_err(Error::other)?.to_le_bytes())?;
    file.write_all(MAGIC)?;
    file.flush()
}

fn page_header(header: &mut Fields<'_>, size: i32, rows: i32) {
    header.int(1, DATA_PAGE);
    header.int(2, size); // uncompressed
    header.int(3, size); // compressed
    header.nested(5, |data| {
        data.int(1, rows);
        data.int(2, PLAIN);
        data.int(3, RLE); // definition levels
        data.int(4, RLE); // repetition levels
    });
}

fn file_metadata(
    fields: &mut Fields<'_>,
    columns: &[(&str, ColumnValues<'_>)],
    groups: &[RowGroup],
) {
    fields.int(1, 1); // version
    let elements: Vec<_> = std::iter::once(None).chain(columns.iter().map(Some)).collect();
    fields.structures(2, &elements, |element, fields| match element {
        None => {
            fields.text(4, "table");
            fields.int(5, columns.len() as i32);
        }
        Some((name, values)) => {
            fields.int(1, values.physical());
            fields.int(3, values.repetition());
            fields.text(4, name);
            if let ColumnValues::Words(_) = values {
                fields.int(6, UTF8);
            }
        }
    });
    fields.long(3, groups.iter().map(|group| group.rows).sum());
    fields.structures(4, groups, |group, fields| {
        let chunks: Vec<_> = columns.iter().zip(&group.chunks).collect();
        fields.structures(1, &chunks, |((name, values), chunk), fields| {
            fields.long(2, chunk.offset);
            fields.nested(3, |fields| {
                fields.int(1, values.physical());
                fields.ints(2, &[PLAIN, RLE]);
                fields.texts(3, &[name]);
                fields.int(4, UNCOMPRESSED);
                fields.long(5, group.rows);
                fields.long(6, chunk.size);
                fields.long(7, chunk.size);
                fields.long(9, chunk.offset);
            });
        });
        fields.long(2, group.chunks.iter().map(|chunk| chunk.size).sum());
        fields.long(3, group.rows);
    });
    fields.text(6, concat!("holonom ", env!("CARGO_PKG_VERSION")));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_values_are_the_zero_bits_of_one_run() {
        let mut page = Vec::new();
        let nan = f64::NAN;
        let values = [1.0, nan, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, nan, 8.0];
        ColumnValues::Optional(&values).write(0..10, &mut page);
        println!("{page:?}");
        assert_eq!(page[..7], [3, 0, 0, 0, (2 << 1) | 1, 0b1111_1101, 0b10]);
        let rest: Vec<f64> =
            page[7..].chunks(8).map(|x| f64::from_le_bytes(x.try_into().unwrap())).collect();
        assert_eq!(rest, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
    }
}
