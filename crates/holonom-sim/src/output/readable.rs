//! What can be read of the files of rows of a run that is in progress or was killed.
//!
//! Each file is written in blocks of its own. A run that was killed leaves files that end at
//! different nodes, the last of them perhaps within a row. The nodes that all files have are read,
//! and the rest is left out.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Take};
use std::path::Path;
use std::str::FromStr;

use csv::{Reader, ReaderBuilder, StringRecord};
use holonom_model::open_regular;

/// A file of rows as far as it is read.
pub type RowReader = Reader<Take<File>>;

/// What is left out of a file of rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// The file.
    pub file: String,
    /// Whole rows that other files lack.
    pub rows: u64,
    /// Whether its last row is not whole.
    pub torn: bool,
}

/// Where the rows of a node end.
#[derive(Clone, Copy, Debug, Default)]
struct Extent {
    rows: u64,
    torn: bool,
    ends: [(Option<u64>, u64); 2], // step and end of the last two nodes
}

/// The bytes to read of each file, and what is left out of them; `ended`: whether the run has
/// written all its rows.
pub(super) fn readable(
    folder: &Path,
    files: &[&'static str],
    ended: bool,
) -> io::Result<(BTreeMap<String, u64>, Vec<LeftOut>)> {
    let mut lengths = BTreeMap::new();
    let mut left_out = Vec::new();
    let present: Vec<&str> =
        files.iter().copied().filter(|name| folder.join(name).is_file()).collect();
    if ended {
        for name in present {
            let path = folder.join(name);
            if !ends_with_a_row(&path)? {
                lengths.insert(name.to_owned(), Extent::read(&path, None)?.ends[0].1);
                left_out.push(LeftOut { file: name.to_owned(), rows: 0, torn: true });
            }
        }
        return Ok((lengths, left_out));
    }
    let whole = |name: &str| -> io::Result<Option<u64>> {
        let extent = Extent::read(&folder.join(name), None)?;
        // the rows of a node of beams.csv may go on
        Ok(extent.ends[usize::from(name == "beams.csv")].0)
    };
    let last = present.iter().map(|name| whole(name)).collect::<io::Result<Vec<_>>>()?;
    let common = last.into_iter().min().flatten();
    for name in present {
        let path = folder.join(name);
        let all = Extent::read(&path, None)?;
        let read = Extent::read(&path, Some(common))?;
        lengths.insert(name.to_owned(), read.ends[0].1);
        let rows = all.rows - read.rows;
        if rows > 0 || all.torn {
            left_out.push(LeftOut { file: name.to_owned(), rows, torn: all.torn });
        }
    }
    Ok((lengths, left_out))
}

/// Whether a file is empty or its last row is whole.
fn ends_with_a_row(path: &Path) -> io::Result<bool> {
    let mut file = open_regular(path)?;
    let mut last = [b'\n'];
    if file.metadata()?.len() > 0 {
        file.seek(SeekFrom::End(-1))?;
        file.read_exact(&mut last)?;
    }
    Ok(last == [b'\n'])
}

impl Extent {
    /// Up to the last row, or to the last of the steps that all files have (`Some(None)`: the
    /// header alone).
    fn read(path: &Path, upto: Option<Option<u64>>) -> io::Result<Self> {
        let mut reader = BufReader::new(bounded(path)?);
        let mut row = Vec::new();
        let mut found = Self::default();
        let mut end = reader.read_until(b'\n', &mut row)? as u64;
        if row.last() != Some(&b'\n') {
            return Ok(Self { torn: end > 0, ..found });
        }
        found.ends = [(None, end); 2];
        loop {
            row.clear();
            let length = reader.read_until(b'\n', &mut row)? as u64;
            if row.last() != Some(&b'\n') {
                found.torn = length > 0;
                return Ok(found);
            }
            let digits: Vec<u8> = row.iter().copied().take_while(u8::is_ascii_digit).collect();
            let step = std::str::from_utf8(&digits).ok().and_then(|text| text.parse().ok());
            if upto.is_some_and(|upto| step > upto) {
                return Ok(found);
            }
            end += length;
            found.rows += 1;
            if found.ends[0].0 != step {
                found.ends[1] = found.ends[0];
            }
            found.ends[0] = (step, end);
        }
    }
}

/// A file of rows up to a length.
pub(super) fn open(path: &Path, length: Option<u64>) -> io::Result<Take<File>> {
    let file = bounded(path)?;
    let all = file.limit();
    Ok(file.into_inner().take(length.unwrap_or(all)))
}

/// A regular file up to its present length: one that grows while it is read has an end all the
/// same.
fn bounded(path: &Path) -> io::Result<Take<File>> {
    let file = open_regular(path)?;
    let length = file.metadata()?.len();
    Ok(file.take(length))
}

/// A file of rows, line by line: nobody looks at the fields of a row that is passed over.
#[derive(Debug)]
pub struct Lines {
    reader: BufReader<Take<File>>,
    columns: Vec<String>,
    line: Vec<u8>,
}

impl Lines {
    /// Reads the header of a file.
    pub(super) fn new(file: Take<File>) -> io::Result<Self> {
        let (mut reader, mut line) = (BufReader::with_capacity(1 << 16, file), Vec::new());
        reader.read_until(b'\n', &mut line)?;
        let mut header = Reader::from_reader(&line[..]);
        let columns = header.headers()?.iter().map(str::to_owned).collect();
        Ok(Self { reader, columns, line })
    }

    /// Names of the columns.
    pub(super) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Goes on to the next row; `false` at the end.
    pub(super) fn advance(&mut self) -> io::Result<bool> {
        loop {
            self.line.clear();
            if self.reader.read_until(b'\n', &mut self.line)? == 0 {
                return Ok(false);
            }
            if !self.line.trim_ascii().is_empty() {
                return Ok(true);
            }
        }
    }

    /// Goes past some rows, without a copy of them; returns past how many.
    pub(super) fn pass_over(&mut self, rows: usize) -> io::Result<usize> {
        let is_blank = |text: &[u8]| text.trim_ascii().is_empty();
        let (mut passed, mut begun) = (0, false); // begun: the line at hand is not blank
        while passed < rows {
            let block = self.reader.fill_buf()?;
            if block.is_empty() {
                return Ok(passed + usize::from(begun));
            }
            let mut used = 0;
            for end in memchr::memchr_iter(b'\n', block) {
                passed += usize::from(begun || !is_blank(&block[used..end]));
                (used, begun) = (end + 1, false);
                if passed == rows {
                    break;
                }
            }
            if passed < rows {
                begun |= !is_blank(&block[used..]);
                used = block.len();
            }
            self.reader.consume(used);
        }
        Ok(passed)
    }

    /// The fields of a row without quoted text.
    pub(super) fn fields(&self) -> impl Iterator<Item = &[u8]> {
        let row = self.line.trim_ascii_end();
        let mut start = 0;
        memchr::memchr_iter(b',', row).chain([row.len()]).map(move |end| {
            let field = &row[start..end];
            start = end + 1;
            field
        })
    }

    /// The fields of a row that may hold quoted text, one for each column.
    pub(super) fn record(&self) -> io::Result<StringRecord> {
        let mut record = StringRecord::new();
        if self.line.contains(&b'"') {
            let mut reader = ReaderBuilder::new().has_headers(false).from_reader(&self.line[..]);
            reader.read_record(&mut record)?;
        } else {
            let fields = self.fields().collect();
            record = StringRecord::from_byte_record(fields).map_err(io::Error::other)?;
        }
        match record.len() == self.columns.len() {
            true => Ok(record),
            false => Err(invalid("a row has not one field for each column")),
        }
    }
}

/// The number of a field of column `column`, counted from 0.
pub(super) fn number<T: FromStr>(field: Option<&[u8]>, column: usize) -> io::Result<T> {
    let text = field.and_then(|field| std::str::from_utf8(field).ok());
    let value = text.and_then(|text| text.parse().ok());
    value.ok_or_else(|| invalid(&format!("no number in column {}", column + 1)))
}

/// Refuses what follows the last column of a row.
pub(super) fn end<'a>(mut fields: impl Iterator<Item = &'a [u8]>) -> io::Result<()> {
    match fields.next() {
        None => Ok(()),
        Some(_) => Err(invalid("a row has more fields than there are columns")),
    }
}

pub(super) fn invalid(message: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_nodes_that_all_files_have_are_read() {
        let folder = std::env::temp_dir().join(format!("readable-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
        let files = ["trajectory.csv", "residuals.csv", "beams.csv", "sensors.csv"];
        let left = |file: &str, rows, torn| LeftOut { file: file.into(), rows, torn };
        // killed: beams.csv may go on with the node 2, so the node 1 is the last one
        write("trajectory.csv", "step,t\n0,0\n1,1\n2,2\n3,3\n4,");
        write("residuals.csv", "step,t\n0,0\n1,1\n2,2\n");
        write("beams.csv", "step,t\n0,0\n0,0\n1,1\n1,1\n2,2\n");
        let (lengths, found) = readable(&folder, &files, false).unwrap();
        assert_eq!(lengths["trajectory.csv"], 15);
        assert_eq!(lengths["beams.csv"], 23);
        let expected = [
            left("trajectory.csv", 2, true),
            left("residuals.csv", 1, false),
            left("beams.csv", 1, false),
        ];
        assert_eq!(found, expected);
        // of a run that has ended only rows that are not whole
        let (lengths, found) = readable(&folder, &files, true).unwrap();
        assert_eq!(lengths.len(), 1);
        assert_eq!((lengths["trajectory.csv"], found), (23, vec![left("trajectory.csv", 0, true)]));
        // not even one row, and not even a header
        write("residuals.csv", "step,t\n0,");
        assert_eq!(readable(&folder, &files, false).unwrap().0["trajectory.csv"], 7);
        write("residuals.csv", "ste");
        assert_eq!(readable(&folder, &files, false).unwrap().0["residuals.csv"], 0);
        fs::remove_dir_all(&folder).unwrap();
    }

    /// Blank lines are no rows, and a row may be longer than a block.
    #[test]
    fn rows_that_are_passed_over_are_those_that_would_be_read() {
        let path = std::env::temp_dir().join(format!("passed-{}.csv", std::process::id()));
        let long = "1,".repeat(50_000);
        for end in ["", "\n", "\n \r\n"] {
            let rows = format!("step,t\n0,0\r\n\n1,1\n{long}2\n \n{long}3\n4,4{end}");
            fs::write(&path, rows).unwrap();
            let open = || Lines::new(open(&path, None).unwrap()).unwrap();
            assert_eq!(open().pass_over(usize::MAX).unwrap(), 5);
            for passed in 0..=5 {
                let (mut one, mut other) = (open(), open());
                assert_eq!(one.pass_over(passed).unwrap(), passed);
                (0..passed).for_each(|_| assert!(other.advance().unwrap()));
                assert_eq!(one.advance().unwrap(), other.advance().unwrap());
                assert!(passed == 5 || one.line == other.line, "after {passed} rows");
            }
        }
        fs::remove_file(&path).unwrap();
    }

    #[test]
    fn rows_have_one_field_for_each_column() {
        let path = std::env::temp_dir().join(format!("lines-{}.csv", std::process::id()));
        fs::write(&path, "step,beam,M\n0,\"a, b\",1\n1,c,2\n2,c\n3,c,4,5\n").unwrap();
        let mut lines = Lines::new(open(&path, None).unwrap()).unwrap();
        for name in ["a, b", "c"] {
            assert!(lines.advance().unwrap());
            assert_eq!(&lines.record().unwrap()[1], name);
        }
        for fields in [2, 4] {
            assert!(lines.advance().unwrap());
            assert!(lines.record().is_err(), "{fields} fields");
            assert_eq!(end(lines.fields().skip(3)).is_err(), fields == 4);
        }
        assert!(!lines.advance().unwrap());
        fs::remove_file(&path).unwrap();
    }
}
