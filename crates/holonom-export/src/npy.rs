//! Arrays as NumPy stores them: format NPY 1.0, in an archive without compression.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Bytes of a value.
const BYTES: usize = 8;
/// The values of an array begin at a multiple of this many bytes.
const ALIGNMENT: usize = 64;

/// A file `.npz`.
#[derive(Debug)]
pub(crate) struct Archive(ZipWriter<BufWriter<File>>);

impl Archive {
    /// An empty one.
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        Ok(Self(ZipWriter::new(BufWriter::new(File::create(path)?))))
    }

    /// Adds an array of real numbers, the last index running fastest.
    pub(crate) fn reals(
        &mut self,
        name: &str,
        shape: &[usize],
        values: impl Iterator<Item = f64>,
    ) -> io::Result<()> {
        self.add(name, &header("<f8", shape), values.map(f64::to_le_bytes))
    }

    /// Adds a list of whole numbers.
    pub(crate) fn wholes(&mut self, name: &str, values: &[i64]) -> io::Result<()> {
        let bytes = values.iter().map(|value| value.to_le_bytes());
        self.add(name, &header("<i8", &[values.len()]), bytes)
    }

    fn add(
        &mut self,
        name: &str,
        header: &[u8],
        values: impl Iterator<Item = [u8; BYTES]>,
    ) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(true);
        self.0.start_file(format!("{name}.npy"), options)?;
        let mut out = BufWriter::new(&mut self.0);
        out.write_all(header)?;
        for value in values {
            out.write_all(&value)?;
        }
        out.flush()
    }

    /// Writes the list of the arrays, and all that is left.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.0.finish()?.flush()
    }
}

/// What stands before the values: magic number, version, length, and the type and shape as a Python
/// literal, padded.
fn header(kind: &str, shape: &[usize]) -> Vec<u8> {
    let lengths: String = shape.iter().map(|length| format!("{length}, ")).collect();
    let text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({lengths}), }}");
    let before = b"\x93NUMPY\x01\x00";
    let used = before.len() + 2 + text.len() + 1;
    let padding = used.next_multiple_of(ALIGNMENT) - used;
    let length = (text.len() + padding + 1) as u16;
    let mut out = before.to_vec();
    out.extend(length.to_le_bytes());
    out.extend(text.bytes());
    out.extend(std::iter::repeat_n(b' ', padding));
    out.push(b'\n');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_begin_at_a_multiple_of_64_bytes() {
        for shape in [&[1][..], &[1_000_000, 12], &[3, 3, 3]] {
            let header = header("<f8", shape);
            let length = usize::from(u16::from_le_bytes([header[8], header[9]]));
            assert_eq!((header.len() % 64, header.len() - 10), (0, length), "{shape:?}");
        }
        let text = String::from_utf8_lossy(&header("<f8", &[7, 3])[10..]).into_owned();
        let literal = "{'descr': '<f8', 'fortran_order': False, 'shape': (7, 3, ), }";
        assert_eq!(text.trim_end(), literal);
    }
}
