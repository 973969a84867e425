//! `events.csv`: what events did, in the order of time.
//!
//! ```text
//! t,event,action,energy_lost,impulse        s, …, J, N·s or N·m·s
//! ```
//! The rows are those of actions, not of nodes.

use std::io::{self, Write};

use super::columns::EVENT_COLUMNS;
use super::rows::RowBlocks;
use crate::event::EventRecord;

/// Writes `events.csv`, whole rows only.
#[derive(Debug)]
pub struct EventWriter<W: Write> {
    rows: RowBlocks<W>,
}

impl<W: Write> EventWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn new(sink: W) -> io::Result<Self> {
        let mut rows = RowBlocks::new(sink);
        rows.push(|row| row.write_record(EVENT_COLUMNS.map(|column| column.name)))?;
        rows.flush()?; // a run that fails at once leaves a file with a header
        Ok(Self { rows })
    }

    /// Writes what events did.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn record(&mut self, events: &[EventRecord]) -> io::Result<()> {
        for event in events {
            self.rows.push(|row| row.serialize(event))?;
        }
        Ok(())
    }

    /// Hands all rows to the file.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn flush(&mut self) -> io::Result<()> {
        self.rows.flush()
    }
}

/// Reads `events.csv`.
///
/// # Errors
/// Those of the file, and `InvalidData` for rows of another shape.
pub(super) fn read(file: impl io::Read) -> io::Result<Vec<EventRecord>> {
    let mut rows = csv::Reader::from_reader(file);
    rows.deserialize().map(|row| row.map_err(io::Error::from)).collect()
}
