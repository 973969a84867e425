//! Checkpoints: the complete state of a run in a file, from which it continues bit for bit.
//!
//! ```text
//! byte  0   8   magic: "holonom", 0x1A
//!       8   4   version of this layout, little-endian
//!      12   8   FNV-1a hash of model.toml
//!      20   8   number of bytes of the payload
//!      28   8   FNV-1a hash of bytes 0 to 27 and the payload
//!      36       payload: a checkpoint in the format postcard, compressed by DEFLATE (RFC 1951)
//! ```
//! FNV-1a (64 bits) maps the bytes before a place to one value and that value one-to-one on: a
//! single changed byte always changes it.

use std::fs::{self, File};
use std::hash::Hasher;
use std::io::{self, Read};
use std::path::Path;

use fnv::FnvHasher;
use holonom_model::read_regular;
use miniz_oxide::deflate::compress_to_vec;
use miniz_oxide::inflate::{TINFLStatus, decompress_to_vec_with_limit};
use serde::{Deserialize, Serialize};

use super::file::{LARGEST, OutputError, at};
use super::pictures::is_there;
use super::summary::SummaryBuilder;
use super::written::Written;
use crate::run::run_state::RunState;

/// Names of the newest checkpoint of a folder and of the one before.
pub const CHECKPOINTS: [&str; 2] = ["checkpoint", "checkpoint.previous"];
/// The name of a newest checkpoint that was refused.
pub(super) const REFUSED: &str = "checkpoint.refused";
/// The name of a checkpoint that is being written.
pub(super) const TEMPORARY: &str = "checkpoint.tmp";
/// All files of this module.
const FILES: [&str; 4] = [CHECKPOINTS[0], CHECKPOINTS[1], REFUSED, TEMPORARY];

const MAGIC: [u8; 8] = *b"holonom\x1a";
const VERSION: u32 = 8;
const HEAD: usize = 36;
const LEVEL: u8 = 1; // of the compression
/// Most bytes of a payload that is not compressed: thirty times the state of 100,000 bodies.
const MOST: usize = 1 << 30;

/// The state of a run and of its files.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Version of the program; the first entry in every version.
    pub version: String,
    /// Steps from one checkpoint to the next; `None` where it was written at an interruption only.
    pub every: Option<u64>,
    /// Elapsed time so far, s.
    pub wall_seconds: f64,
    /// State of the simulation.
    pub run: RunState,
    /// The run in numbers so far.
    pub summary: SummaryBuilder,
    /// The files of rows, with what belongs to it of each.
    pub files: Vec<(String, Written)>,
}

/// Why a checkpoint is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// It does not begin as one.
    #[error("it is not a checkpoint")]
    Foreign,
    /// It has another layout.
    #[error("its format has version {found}; this program reads version {VERSION}")]
    Format {
        /// The version of the layout.
        found: u32,
    },
    /// Some bytes are missing or wrong.
    #[error("it is damaged: {0}")]
    Damaged(String),
    /// It belongs to another model.
    #[error("it belongs to another model than model.toml; was that changed?")]
    Model,
    /// It was written by another version of the program, which may round otherwise.
    #[error("it was written by version {0}; this is version {own}", own = env!("CARGO_PKG_VERSION"))]
    Program(String),
    /// A file of rows does not have what it says.
    #[error("{file} does not fit: {reason}")]
    Rows {
        /// The file.
        file: String,
        /// What is wrong with it.
        reason: String,
    },
    /// It cannot be read.
    #[error("{0}")]
    Io(String),
}

impl Checkpoint {
    /// The bytes of its file; `model`: the text of `model.toml`.
    ///
    /// # Errors
    /// Those of the compression.
    pub fn encode(&self, model: &str) -> io::Result<Vec<u8>> {
        let payload = postcard::to_stdvec(self).map_err(io::Error::other)?;
        let payload = compress_to_vec(&payload, LEVEL);
        let mut bytes = Vec::with_capacity(HEAD + payload.len());
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(fnv(&[model.as_bytes()]).to_le_bytes());
        bytes.extend((payload.len() as u64).to_le_bytes());
        bytes.extend(fnv(&[&bytes, &payload]).to_le_bytes());
        bytes.extend(payload);
        Ok(bytes)
    }

    /// Reads the bytes of a file, and compares it with the text of `model.toml` and with this
    /// program.
    ///
    /// # Errors
    /// [`CheckpointError`].
    pub fn decode(bytes: &[u8], model: &str) -> Result<Self, CheckpointError> {
        let damaged = |what: &str| CheckpointError::Damaged(what.to_owned());
        if !bytes.starts_with(&MAGIC) {
            return Err(CheckpointError::Foreign);
        }
        let head = bytes.get(..HEAD).ok_or_else(|| damaged("its head is cut off"))?;
        let number = |place: usize| {
            let mut eight = [0; 8];
            eight.copy_from_slice(&head[place..place + 8]);
            u64::from_le_bytes(eight)
        };
        let version = number(8) as u32; // the lower four bytes
        if version != VERSION {
            return Err(CheckpointError::Format { found: version });
        }
        let payload = &bytes[HEAD..];
        if payload.len() as u64 != number(20) {
            let (found, written) = (payload.len(), number(20));
            return Err(damaged(&format!("{found} bytes where {written} were written")));
        }
        if fnv(&[&head[..28], payload]) != number(28) {
            return Err(damaged("the checksum differs"));
        }
        if fnv(&[model.as_bytes()]) != number(12) {
            return Err(CheckpointError::Model);
        }
        let payload = unpacked(payload, MOST)?;
        let unreadable = |error: postcard::Error| damaged(&error.to_string());
        let (version, _) = postcard::take_from_bytes::<String>(&payload).map_err(unreadable)?;
        if version != env!("CARGO_PKG_VERSION") {
            return Err(CheckpointError::Program(version)); // what follows may be of another type
        }
        postcard::from_bytes(&payload).map_err(unreadable)
    }

    /// Reads a file and compares what the files of rows in its folder have up to it.
    pub(super) fn read(folder: &Path, name: &str, model: &str) -> Result<Self, CheckpointError> {
        let bytes = read_regular(&folder.join(name), LARGEST);
        let bytes = bytes.map_err(|error| CheckpointError::Io(error.to_string()))?;
        let read = Self::decode(&bytes, model)?;
        for (file, written) in &read.files {
            written.check(&folder.join(file)).map_err(|error| CheckpointError::Rows {
                file: file.clone(),
                reason: error.to_string(),
            })?;
        }
        Ok(read)
    }
}

/// The payload without its compression; a few bytes may stand for any number of them, so that there
/// is a limit.
fn unpacked(payload: &[u8], most: usize) -> Result<Vec<u8>, CheckpointError> {
    decompress_to_vec_with_limit(payload, most).map_err(|error| {
        CheckpointError::Damaged(match error.status {
            TINFLStatus::HasMoreOutput => format!("it holds more than {most} bytes"),
            _ => "its compressed part is not as DEFLATE writes it".to_owned(),
        })
    })
}

/// The FNV-1a hash of several pieces, one after the other.
fn fnv(pieces: &[&[u8]]) -> u64 {
    let mut hasher = FnvHasher::default();
    pieces.iter().for_each(|piece| hasher.write(piece));
    hasher.finish()
}

/// Refuses a folder in which a file that is no checkpoint has the name of one.
pub(super) fn check_before(folder: &Path) -> Result<(), OutputError> {
    for path in FILES.map(|name| folder.join(name)) {
        if is_there(&path) && !is_ours(&path).map_err(|e| at(&path, e))? {
            return Err(OutputError::Foreign { path });
        }
    }
    Ok(())
}

/// Removes the checkpoints of a run that is complete; one that was refused stays.
pub(super) fn remove_outdated(folder: &Path) -> Result<(), OutputError> {
    for path in CHECKPOINTS.map(|name| folder.join(name)) {
        if is_there(&path) && is_ours(&path).map_err(|e| at(&path, e))? {
            fs::remove_file(&path).map_err(|e| at(&path, e))?;
        }
    }
    Ok(())
}

/// Removes the checkpoints of a folder.
pub(super) fn remove(folder: &Path) -> Result<(), OutputError> {
    for path in FILES.map(|name| folder.join(name)) {
        if is_there(&path) {
            fs::remove_file(&path).map_err(|e| at(&path, e))?;
        }
    }
    Ok(())
}

/// Whether a file begins as a checkpoint.
fn is_ours(path: &Path) -> io::Result<bool> {
    let mut begin = Vec::new();
    let regular = path.symlink_metadata()?.is_file();
    if regular {
        File::open(path)?.take(MAGIC.len() as u64).read_to_end(&mut begin)?;
    }
    // one that was killed while it was written may be shorter
    Ok(regular && MAGIC.starts_with(&begin))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_payload_that_unpacks_to_too_much_is_refused() {
        let bytes = compress_to_vec(&vec![0; 1 << 21], LEVEL);
        assert_eq!(unpacked(&bytes, 1 << 21).map(|plain| plain.len()), Ok(1 << 21));
        let refused = unpacked(&bytes, (1 << 21) - 1).unwrap_err().to_string();
        println!("{} bytes: {refused}", bytes.len());
        assert!(refused.contains("more than 2097151 bytes"), "{refused}");
        let refused = unpacked(&bytes[..bytes.len() - 9], 1 << 21).unwrap_err().to_string();
        assert!(refused.contains("not as DEFLATE writes it"), "{refused}");
    }
}
