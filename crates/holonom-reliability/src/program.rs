//! The program `holonom`, beside the one that runs, and the repository.

use std::path::{Path, PathBuf};

/// What to do where there is none.
pub(crate) const HELP: &str = "no program beside this one: cargo build --release -p holonom-cli";

/// The program beside this one.
pub(crate) fn beside() -> Option<PathBuf> {
    let own = std::env::current_exe().ok()?;
    let name = format!("holonom{}", std::env::consts::EXE_SUFFIX);
    own.ancestors().skip(1).take(2).map(|folder| folder.join(&name)).find(|path| path.is_file())
}

/// The folder of the repository.
pub(crate) fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}
