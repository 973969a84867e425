//! A file of a run: written whole or not at all.

use std::path::{Path, PathBuf};
use std::{fs, io};

/// The largest file that is read as a whole, bytes.
pub(crate) const LARGEST: u64 = 1 << 30;

/// Errors of the files of a run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The folder holds a run that may not be replaced.
    #[error("{} already holds a run ({file})", folder.display())]
    Occupied {
        /// The folder.
        folder: PathBuf,
        /// One of its files.
        file: String,
    },
    /// A picture that somebody else made, or a folder of pictures that is a link, is in the way.
    #[error("{} was not written by this program", path.display())]
    Foreign {
        /// The file or folder.
        path: PathBuf,
    },
    /// Another program writes to the folder.
    #[error("a run is in progress in {}", folder.display())]
    InUse {
        /// The folder.
        folder: PathBuf,
    },
    /// A run cannot be continued.
    #[error("{}{}", no_checkpoint(folder), refused.iter().map(|r| format!("; {r}")).collect::<String>())]
    NoCheckpoint {
        /// The folder.
        folder: PathBuf,
        /// Files that were refused, each with the reason.
        refused: Vec<String>,
    },
    /// The operating system refuses.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What it says.
        source: io::Error,
    },
    /// The folder holds no readable run.
    #[error("{}: not the summary of a run: {source}", path.display())]
    Summary {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// A plot cannot be drawn.
    #[error("cannot draw {name}: {reason}")]
    Plot {
        /// The plot.
        name: String,
        /// What is wrong.
        reason: String,
    },
}

impl OutputError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Occupied { .. } => {
                "add --force to replace it, or choose another folder with -o DIR"
            }
            Self::Foreign { .. } => "move it away, or choose another folder with -o DIR",
            Self::InUse { .. } => "wait for its end, or choose another folder",
            Self::NoCheckpoint { .. } => {
                "run the model again: `holonom run MODEL -o DIR --force`; with --checkpoint-every K a run that is \
                 killed can be continued"
            }
            Self::Io { source, .. } => remedy(source),
            Self::Summary { .. } => {
                "name the folder of a run; if the file was changed, run the model again with --force"
            }
            Self::Plot { .. } => {
                "choose other columns or another format; `holonom plot DIR --list` lists the columns"
            }
        }
    }
}

/// What to do about an error of the operating system, or about a file that cannot be read.
fn remedy(error: &io::Error) -> &'static str {
    use io::ErrorKind as FieldKind;
    match error.kind() {
        FieldKind::NotFound => "check the path: no such file or folder exists",
        FieldKind::PermissionDenied | FieldKind::ReadOnlyFilesystem => {
            "allow this user to read or write it, or choose another folder with -o DIR"
        }
        FieldKind::StorageFull | FieldKind::QuotaExceeded => {
            "make room on the disk, or record fewer rows with --every K"
        }
        FieldKind::AlreadyExists
        | FieldKind::NotADirectory
        | FieldKind::IsADirectory
        | FieldKind::InvalidInput => {
            "name a regular file where a file is read, a folder where a folder is"
        }
        FieldKind::InvalidData | FieldKind::UnexpectedEof => {
            "the file is not as this program writes it: run the model again with --force"
        }
        FieldKind::InvalidFilename => "choose a shorter path",
        _ => "check the file and the disk it is on",
    }
}

fn no_checkpoint(folder: &Path) -> String {
    format!("{} holds no checkpoint that the run can continue from", folder.display())
}

/// An error of the operating system, at a path.
pub(crate) fn at(path: &Path, source: io::Error) -> OutputError {
    OutputError::Io { path: path.to_owned(), source }
}

/// A name in the same folder that no other process uses, for a file or folder of some `kind` beside
/// `path`.
#[must_use]
pub fn beside(path: &Path, kind: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.{kind}", std::process::id()));
    path.with_file_name(name)
}

/// Lets `write` fill a file beside `path` and renames it: a reader sees the old file or the new
/// one, never a part.
///
/// # Errors
/// Those of `write`, and of the operating system.
pub fn atomically(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    let temporary = beside(path, "tmp");
    let written = write(&temporary).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        let _ = fs::remove_file(&temporary); // the first error is the one to report
    }
    written
}

/// The same with the content at hand, in a folder that is created if it does not exist.
pub(super) fn write_atomically(path: &Path, content: &[u8]) -> io::Result<()> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent)?;
    }
    atomically(path, |temporary| fs::write(temporary, content))
}
