//! What a file of rows had when a checkpoint was written: its length and a hash, so that rows that
//! were changed since are found.

use std::fs::File;
use std::hash::Hasher;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use fnv::FnvHasher;
use holonom_model::open_regular;
use serde::{Deserialize, Serialize};

use super::readable::invalid;

/// The first bytes of a file of rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Written {
    /// How many.
    pub bytes: u64,
    /// Their FNV-1a hash (64 bits).
    pub hash: u64,
}

impl Default for Written {
    /// Nothing.
    fn default() -> Self {
        Self { bytes: 0, hash: FnvHasher::default().finish() }
    }
}

impl Written {
    /// These bytes and all that follow them in a file now.
    ///
    /// # Errors
    /// Those of the operating system; `InvalidData` for a file that has become shorter.
    pub(super) fn continued(self, path: &Path) -> io::Result<Self> {
        let mut file = open_regular(path)?;
        let length = file.metadata()?.len();
        if length < self.bytes {
            return Err(invalid(&format!("{length} bytes where {} were written", self.bytes)));
        }
        file.seek(SeekFrom::Start(self.bytes))?;
        self.with(file, length - self.bytes)
    }

    /// Refuses a file that does not begin with these bytes, or has no row that ends there.
    ///
    /// # Errors
    /// As [`Self::continued`], and `InvalidData` where bytes were changed.
    pub(super) fn check(&self, path: &Path) -> io::Result<()> {
        check_length(path, self.bytes)?;
        match Self::default().with(open_regular(path)?, self.bytes)? == *self {
            true => Ok(()),
            false => Err(invalid("rows before the checkpoint were changed")),
        }
    }

    /// These bytes and the next `more` of a file.
    fn with(self, file: File, more: u64) -> io::Result<Self> {
        let (mut hasher, mut block) = (FnvHasher::with_key(self.hash), vec![0; 1 << 16]);
        let (mut file, mut bytes) = (file.take(more), self.bytes);
        loop {
            match file.read(&mut block)? {
                0 => return Ok(Self { bytes, hash: hasher.finish() }),
                length => {
                    hasher.write(&block[..length]);
                    bytes += length as u64;
                }
            }
        }
    }
}

/// Refuses a file with fewer than `length` bytes, or without a row that ends there.
pub(super) fn check_length(path: &Path, length: u64) -> io::Result<()> {
    let mut file = open_regular(path)?;
    let found = file.metadata()?.len();
    if found < length {
        return Err(invalid(&format!("{found} bytes where {length} were written")));
    }
    let mut last = [0];
    file.seek(SeekFrom::Start(length.saturating_sub(1)))?;
    file.read_exact(&mut last)?;
    if last == [b'\n'] { Ok(()) } else { Err(invalid(&format!("no row ends at byte {length}"))) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn every_byte_before_the_checkpoint_counts_and_none_after_it() {
        let path = std::env::temp_dir().join(format!("written-{}.csv", std::process::id()));
        let text = b"step,t\n0,0.0\n1,0.5\n2,1.0\n";
        fs::write(&path, &text[..13]).unwrap();
        let first = Written::default().continued(&path).unwrap();
        fs::write(&path, &text[..19]).unwrap();
        let second = first.continued(&path).unwrap();
        assert_eq!((first.bytes, second.bytes), (13, 19));
        assert_eq!(Written::default().continued(&path).unwrap(), second, "in one piece");
        fs::write(&path, text).unwrap();
        assert!(first.check(&path).is_ok() && second.check(&path).is_ok());
        for place in 0..text.len() {
            let mut changed = text.to_vec();
            changed[place] ^= 1;
            fs::write(&path, changed).unwrap();
            assert_eq!(second.check(&path).is_ok(), place >= 19, "byte {place}");
            assert_eq!(first.check(&path).is_ok(), place >= 13, "byte {place}");
        }
        fs::write(&path, &text[..12]).unwrap();
        assert!(first.check(&path).is_err() && second.continued(&path).is_err(), "shorter");
        fs::remove_file(&path).unwrap();
    }
}
