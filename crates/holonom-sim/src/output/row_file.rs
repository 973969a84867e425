//! A file of rows: new, or continued at the length of a checkpoint; what cannot be written whole is
//! taken back.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::PathBuf;

use super::readable::invalid;
use super::written::check_length;

/// A file of rows that is being written.
///
/// Its writer hands over the header first, then blocks of whole rows, each with one call of
/// `write_all`. A block that does not fit on the disk is cut off again, so that the file ends with
/// a whole row.
#[derive(Debug)]
pub struct RowFile {
    file: File,
    path: PathBuf,
    length: u64,   // bytes of whole blocks
    compare: bool, // the header is there already
}

impl RowFile {
    /// A new, empty file.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn create(path: PathBuf) -> io::Result<Self> {
        Ok(Self { file: File::create(&path)?, path, length: 0, compare: false })
    }

    /// A file that is there, continued after `length` bytes; what follows them is cut off. The
    /// header that the writer hands over must be that of the file.
    ///
    /// # Errors
    /// Those of the operating system; `InvalidData` for a file that is shorter or has no row that
    /// ends there.
    pub fn resume(path: PathBuf, length: u64) -> io::Result<Self> {
        check_length(&path, length)?;
        let file = OpenOptions::new().read(true).write(true).open(&path)?;
        file.set_len(length)?;
        Ok(Self { file, path, length, compare: true })
    }

    fn compare_header(&mut self, header: &[u8]) -> io::Result<()> {
        let mut found = vec![0; header.len()];
        self.file.seek(SeekFrom::Start(0))?;
        self.file.read_exact(&mut found)?;
        if found != header {
            return Err(invalid("the header is not that of this model"));
        }
        self.file.seek(SeekFrom::Start(self.length))?;
        self.compare = false;
        Ok(())
    }

    /// The same error with the name of the file.
    fn named(&self, error: &io::Error) -> io::Error {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        io::Error::new(error.kind(), format!("{name}: {error}"))
    }
}

impl Write for RowFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.write_all(bytes).map(|()| bytes.len())
    }

    fn write_all(&mut self, block: &[u8]) -> io::Result<()> {
        let written = match self.compare {
            true => return self.compare_header(block).map_err(|error| self.named(&error)),
            false => self.file.write_all(block),
        };
        match written {
            Ok(()) => self.length += block.len() as u64,
            Err(error) => {
                let _ = self.file.set_len(self.length); // the first error is the one to report
                let _ = self.file.seek(SeekFrom::Start(self.length));
                return Err(self.named(&error));
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_file_continues_after_the_rows_of_a_checkpoint() {
        let path = std::env::temp_dir().join(format!("rows-{}.csv", std::process::id()));
        fs::write(&path, "step,t\n0,0.0\n1,0.1\n2,0.").unwrap();
        let resumed = |length| RowFile::resume(path.clone(), length);
        assert!(resumed(100).is_err(), "shorter than the checkpoint says");
        assert!(resumed(9).is_err(), "within a row");
        assert!(resumed(13).unwrap().write_all(b"step,x\n").is_err(), "another header");
        assert_eq!(fs::read_to_string(&path).unwrap(), "step,t\n0,0.0\n");
        let mut file = resumed(13).unwrap();
        file.write_all(b"step,t\n").unwrap();
        file.write_all(b"1,0.5\n").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "step,t\n0,0.0\n1,0.5\n");
        fs::remove_file(&path).unwrap();
    }
}
