//! `beams.csv`: strains and section forces along all beams, at the nodes of `trajectory.csv`.
//!
//! ```text
//! step,t,beam,element,s,Gamma1,…,Gamma3,K1,…,K3,N1,…,N3,M1,…,M3
//! ```
//! One row for each element, at its middle; one for each Gauss point of an element of higher order.
//! `s` is the arc length of the stress-free beam (m); forces in N, moments in N·m, curvatures in
//! 1/m.

use std::io::{self, Write};

use super::columns;
use super::csv::HEAD;
use super::rows::{RowBlocks, RowField, quoted};
use crate::sample::Sample;
use crate::system::beams::Beams;
use vi_beam::section_force::SectionState;

/// Writes `beams.csv`, whole rows only.
#[derive(Debug)]
pub struct BeamWriter<W: Write> {
    rows: RowBlocks<W>,
    beams: Beams,
    names: Vec<String>, // of the beams, as fields
}

impl<W: Write> BeamWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn new(sink: W, beams: &Beams) -> io::Result<Self> {
        let names = beams.list.iter().map(|beam| quoted(&beam.name)).collect::<io::Result<_>>()?;
        let mut writer = Self { rows: RowBlocks::new(sink), beams: beams.clone(), names };
        let own = columns::PLACE.iter().chain(&columns::SECTION).map(|column| column.name);
        writer.rows.push(|row| row.write_record(HEAD.into_iter().chain(own)))?;
        writer.rows.flush()?; // a run that fails at once leaves a file with a header
        Ok(writer)
    }

    /// Writes one node.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn record(&mut self, sample: &Sample) -> io::Result<()> {
        let Self { rows, beams, names } = self;
        let mut written = Ok(());
        for (beam, name) in beams.list.iter().zip(names) {
            beams.for_each_state(beam, &sample.q, |state| {
                let SectionState { element, arc_length, .. } = state;
                let [time, s] = [sample.t, arc_length].map(RowField::Number);
                let place = [time, RowField::Text(name), RowField::Index(element), s];
                let strains = [state.shear_extension, state.curvature];
                let stresses = [state.force, state.moment];
                let numbers = strains.iter().chain(&stresses).flatten().copied();
                let fields = place.into_iter().chain(numbers.map(RowField::Number));
                if written.is_ok() {
                    written = rows.fields(sample.step, fields);
                }
            });
        }
        written
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
