//! Standard error: messages for people; errors of writing them are ignored.

use std::io::Write;

/// Writes words as they are.
pub(crate) fn print(words: &str) {
    let mut stderr = std::io::stderr().lock();
    let _ = stderr.write_all(words.as_bytes()).and_then(|()| stderr.flush());
}

/// Writes a line.
pub(crate) fn line(words: &str) {
    print(&format!("{words}\n"));
}
