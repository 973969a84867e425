//! The program `holonom` and Cargo, as processes.

use std::path::PathBuf;
use std::process::Command;

/// The Cargo that runs this program.
#[must_use]
pub fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// What to do where there is none.
pub(crate) const HELP: &str = "no program beside this one: cargo build --release -p holonom-cli";

/// The program beside this one.
pub(crate) fn beside() -> Option<PathBuf> {
    let own = std::env::current_exe().ok()?;
    let name = format!("holonom{}", std::env::consts::EXE_SUFFIX);
    own.ancestors().skip(1).take(2).map(|folder| folder.join(&name)).find(|path| path.is_file())
}
