//! Reading the text of a model.

use std::io::Read;
use std::path::Path;

use crate::{MAX_BYTES, ModelError};

/// Reads a model text; never more than [`MAX_BYTES`] and a little.
///
/// # Errors
/// [`ModelError::Unreadable`], [`ModelError::TooLarge`], [`ModelError::NotUtf8`].
pub fn read_text(path: &Path) -> Result<String, ModelError> {
    let unreadable = |e: std::io::Error| ModelError::Unreadable { reason: e.to_string() };
    if path.is_dir() {
        return Err(ModelError::Unreadable { reason: "this is a directory, not a file".into() });
    }
    // a named pipe that nobody writes to would block
    if !path.metadata().map_err(unreadable)?.is_file() && !is_device(path) {
        return Err(ModelError::Unreadable { reason: "this is not a regular file".into() });
    }
    let file = std::fs::File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    file.take(MAX_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() > MAX_BYTES {
        return Err(ModelError::TooLarge { limit: MAX_BYTES });
    }
    String::from_utf8(bytes)
        .map_err(|e| ModelError::NotUtf8 { offset: e.utf8_error().valid_up_to() })
}

/// The folder in which the files are that a file names: its own, the current one for a device.
pub(crate) fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|_| !is_device(file)).unwrap_or(Path::new(""))
}

/// Whether a path is a device or a pipe of a shell.
fn is_device(path: &Path) -> bool {
    path.starts_with("/dev") || path.starts_with("/proc")
}
