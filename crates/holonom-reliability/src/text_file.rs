//! Text files with errors in words.

use std::path::Path;

/// The text of a file.
///
/// # Errors
/// The path, and why it cannot be read.
pub fn read(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}

/// Writes a file, whole or not at all.
///
/// # Errors
/// The path, and why it cannot be written.
pub fn write(path: &Path, text: &str) -> Result<(), String> {
    let written = holonom::output::atomically(path, |temporary| std::fs::write(temporary, text));
    written.map_err(|error| format!("{}: {error}", path.display()))
}
