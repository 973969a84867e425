//! Standard output. Its reader may close it at any time; that is not an error.

use std::io::{ErrorKind, Write};

use holonom::output::OutputError;

use crate::captured::{self, Stream};
use crate::failure::Failure;

/// Writes all bytes.
pub(crate) fn bytes(bytes: &[u8]) -> Result<(), Failure> {
    if captured::take(Stream::Output, bytes) {
        return Ok(());
    }
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(bytes).and_then(|()| stdout.flush()) {
        Ok(()) => Ok(()),
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Err(Failure::Closed),
        Err(source) => Err(OutputError::Io { path: "standard output".into(), source }.into()),
    }
}

/// Writes a value as JSON, with a line end.
pub(crate) fn json(value: &serde_json::Value) -> Result<(), Failure> {
    bytes(format!("{value:#}\n").as_bytes())
}
