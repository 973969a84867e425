//! Checkpoints of a folder: the newest and the one before.

use std::fs::{self, File};
use std::io::{self, Write};

use super::checkpoint::{CHECKPOINTS, Checkpoint, REFUSED, TEMPORARY};
use super::file::{OutputError, at};
use super::folder::RunFolder;
use super::pictures::is_there;

/// A checkpoint that was found, with the remarks on one that was refused.
#[derive(Clone, Debug)]
pub struct FoundCheckpoint {
    /// The checkpoint.
    pub checkpoint: Checkpoint,
    /// Why a newer one was refused.
    pub refused: Option<String>,
}

impl RunFolder {
    /// Writes a checkpoint beside the files of rows, which are on the disk before: the newest
    /// becomes the one before, and that is dropped. `model`: the text of `model.toml`.
    ///
    /// # Errors
    /// [`OutputError::Io`]; the earlier ones are then what they were.
    pub fn write_checkpoint(
        &self,
        checkpoint: &Checkpoint,
        model: &str,
    ) -> Result<(), OutputError> {
        let [newest, previous] = CHECKPOINTS.map(|name| self.path().join(name));
        let temporary = self.path().join(TEMPORARY);
        let write = || {
            let bytes = checkpoint.encode(model)?;
            for (file, _) in &checkpoint.files {
                File::options().append(true).open(self.path().join(file))?.sync_data()?;
            }
            if temporary.symlink_metadata().is_ok_and(|found| !found.is_file()) {
                let message = format!("{TEMPORARY} is no regular file");
                // a pipe would block
                return Err(io::Error::new(io::ErrorKind::AlreadyExists, message));
            }
            let mut file = File::create(&temporary)?;
            file.write_all(&bytes).and_then(|()| file.sync_all()).inspect_err(|_| {
                let _ = fs::remove_file(&temporary); // the first error is the one to report
            })?;
            if newest.is_file() {
                fs::rename(&newest, &previous)?;
            }
            fs::rename(&temporary, &newest)
        };
        write().map_err(|e| at(&newest, e))
    }

    /// The newest checkpoint that is good; a refused one is set aside as `checkpoint.refused`, so
    /// that it does not replace the good one. `model`: the text of `model.toml`.
    ///
    /// # Errors
    /// [`OutputError::NoCheckpoint`], [`OutputError::Io`].
    pub fn read_checkpoint(&self, model: &str) -> Result<FoundCheckpoint, OutputError> {
        let mut refused: Vec<String> = Vec::new();
        for name in CHECKPOINTS {
            let path = self.path().join(name);
            if !is_there(&path) {
                continue;
            }
            match Checkpoint::read(self.path(), name, model) {
                Ok(checkpoint) => {
                    let newest = self.path().join(CHECKPOINTS[0]);
                    if !refused.is_empty() {
                        let aside = self.path().join(REFUSED);
                        fs::rename(&newest, &aside).map_err(|e| at(&newest, e))?;
                    }
                    return Ok(FoundCheckpoint { checkpoint, refused: refused.pop() });
                }
                Err(error) => refused.push(format!("{}: {error}", path.display())),
            }
        }
        Err(OutputError::NoCheckpoint { folder: self.path().to_owned(), refused })
    }
}
