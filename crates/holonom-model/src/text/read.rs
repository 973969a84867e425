//! Reading files: the text of a model, and whatever else the program is given.

use std::fs::File;
use std::io::{self, Error, ErrorKind, Read};
use std::path::Path;

use crate::{MAX_BYTES, ModelError};

/// Reads a model text; never more than [`MAX_BYTES`] and a little.
///
/// # Errors
/// [`ModelError::Unreadable`], [`ModelError::TooLarge`], [`ModelError::NotUtf8`].
pub fn read_text(path: &Path) -> Result<String, ModelError> {
    let unreadable = |e: Error| ModelError::Unreadable { reason: e.to_string() };
    let file = if is_stream(path) { File::open(path) } else { open_regular(path) };
    let file = file.map_err(unreadable)?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() > MAX_BYTES {
        return Err(ModelError::TooLarge { limit: MAX_BYTES });
    }
    String::from_utf8(bytes)
        .map_err(|e| ModelError::NotUtf8 { offset: e.utf8_error().valid_up_to() })
}

/// Opens a regular file for reading. Nothing else is opened: a pipe that nobody writes to would
/// block, a device may have no end.
///
/// # Errors
/// Those of the operating system; `InvalidInput` for what is no regular file.
pub fn open_regular(path: &Path) -> io::Result<File> {
    let metadata = path.metadata()?;
    if metadata.is_file() {
        return File::open(path);
    }
    let what = match metadata.is_dir() {
        true => "this is a directory, not a file",
        false => "this is not a regular file",
    };
    Err(Error::new(ErrorKind::InvalidInput, what))
}

/// Reads a regular file of at most `most` bytes as a whole.
///
/// # Errors
/// As [`open_regular`]; `InvalidData` for a larger file, also for one that grows while it is read.
pub fn read_regular(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_regular(path)?.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        true => Err(Error::new(ErrorKind::InvalidData, format!("it is larger than {most} bytes"))),
        false => Ok(bytes),
    }
}

/// The same as text.
///
/// # Errors
/// As [`read_regular`]; `InvalidData` for what is not UTF-8.
pub fn read_regular_text(path: &Path, most: u64) -> io::Result<String> {
    let text = String::from_utf8(read_regular(path, most)?);
    text.map_err(|error| Error::new(ErrorKind::InvalidData, error.utf8_error()))
}

/// The folder in which the files are that a file names: its own, the current one for a device.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|_| !is_stream(file)).unwrap_or(Path::new(""))
}

/// Whether a path is standard input or a pipe of a shell. Other pipes and devices are not read:
/// nobody may write to them, or they may have no end.
fn is_stream(path: &Path) -> bool {
    let of_process =
        path.starts_with("/proc") && path.parent().is_some_and(|fd| fd.ends_with("fd"));
    path == Path::new("/dev/stdin") || path.starts_with("/dev/fd") || of_process
}
