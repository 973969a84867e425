//! `energy.csv`: parts of the energy and the work done, on the same rows as `trajectory.csv`.
//!
//! ```text
//! step,t,kinetic,gravity,elastic,springs,total,work.NAME,…,work_of_motions,balance        all in J
//! ```

use std::io::{self, Write};

use super::csv::HEAD;
use super::rows::RowBlocks;
use crate::sample::Sample;

/// Writes `energy.csv`, whole rows only.
#[derive(Debug)]
pub struct EnergyWriter<W: Write> {
    rows: RowBlocks<W>,
}

impl<W: Write> EnergyWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn new(sink: W, columns: &[String]) -> io::Result<Self> {
        let head = HEAD.map(str::to_owned).into_iter();
        let header: Vec<String> = head.chain(columns.iter().cloned()).collect();
        let mut rows = RowBlocks::new(sink);
        rows.push(|row| row.write_record(&header))?;
        rows.flush()?; // a run that fails at once leaves a file with a header
        Ok(Self { rows })
    }

    /// Writes one node.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn record(&mut self, sample: &Sample) -> io::Result<()> {
        self.rows.numbers(sample.step, &[&[sample.t], &sample.energies])
    }

    /// Hands all rows to the file.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn flush(&mut self) -> io::Result<()> {
        self.rows.flush()
    }
}
