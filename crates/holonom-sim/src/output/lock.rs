//! Files that one program has at a time.

use std::fs::{File, TryLockError};
use std::path::Path;

use super::file::OutputError;

/// A locked file. The operating system releases it with the last handle, however the program ends;
/// without a lock where the file system has none.
#[derive(Debug)]
pub struct Lock(File);

impl Lock {
    /// Locks a file, or the folder itself, that stands for `folder`.
    ///
    /// # Errors
    /// [`OutputError::InUse`] when another program has it.
    pub fn take(file: File, folder: &Path) -> Result<Self, OutputError> {
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => Err(OutputError::InUse { folder: folder.to_owned() }),
            Ok(()) | Err(TryLockError::Error(_)) => Ok(Self(file)),
        }
    }

    /// The file.
    #[must_use]
    pub fn file(&self) -> &File {
        &self.0
    }
}

impl Drop for Lock {
    /// Closing alone does not do: a process that another thread is about to start holds a copy of
    /// the handle for a moment.
    fn drop(&mut self) {
        let _ = self.0.unlock(); // nobody could mend it
    }
}
