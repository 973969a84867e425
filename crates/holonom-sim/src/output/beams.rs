//! `beams.csv`: strains and section forces along all beams, at the nodes of `trajectory.csv`.
//!
//! ```text
//! step,t,beam,element,s,Gamma1,…,Gamma3,K1,…,K3,N1,…,N3,M1,…,M3
//! ```
//! One row for each element, at its middle; one for each Gauss point of an element of higher order. `s` is the
//! arc length of the stress-free beam (m); forces in N, moments in N·m, curvatures in 1/m.

use std::io::{self, Write};

use super::csv::HEAD;
use super::rows::Rows;
use crate::beams::Beams;
use crate::sample::Sample;

/// Columns after step and time.
const COLUMNS: [&str; 15] = [
    "beam", "element", "s", "Gamma1", "Gamma2", "Gamma3", "K1", "K2", "K3", "N1", "N2", "N3", "M1",
    "M2", "M3",
];

/// Writes `beams.csv`, whole rows only.
pub struct BeamWriter<W: Write> {
    rows: Rows<W>,
    beams: Beams,
}

impl<W: Write> BeamWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn new(sink: W, beams: &Beams) -> io::Result<Self> {
        let mut writer = Self { rows: Rows::new(sink), beams: beams.clone() };
        writer.rows.push(|row| row.write_record(HEAD.iter().chain(&COLUMNS)))?;
        writer.rows.flush()?; // a run that fails at once leaves a file with a header
        Ok(writer)
    }

    /// Writes one node.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn record(&mut self, sample: &Sample) -> io::Result<()> {
        for beam in &self.beams.list {
            for state in self.beams.section_states(beam, &sample.q) {
                let place = (sample.step, sample.t, &beam.name, state.element, state.arc_length);
                let strains = (state.shear_extension, state.curvature);
                self.rows.push(|row| row.serialize((place, strains, state.force, state.moment)))?;
            }
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

    /// Ends the file.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn finish(mut self) -> io::Result<()> {
        self.flush()
    }
}
