//! `sensors.csv`: what the sensors of a model measure, on the same rows as `trajectory.csv`.
//!
//! ```text
//! step,t,NAME.x,NAME.y,NAME.z,…           NAME alone for a single number
//! ```
//! A component of a reaction that is not unique is an empty field; `NAME.unique` is 1 when all
//! components are unique, 0 otherwise.

use std::io::{self, Write};

use super::csv::HEAD;
use super::rows::{RowBlocks, RowField};
use crate::sample::Sample;
use crate::sensor::SensorColumn;

/// Writes `sensors.csv`, whole rows only.
#[derive(Debug)]
pub struct SensorWriter<W: Write> {
    rows: RowBlocks<W>,
    flags: Vec<bool>,
}

impl<W: Write> SensorWriter<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn new(sink: W, columns: &[SensorColumn]) -> io::Result<Self> {
        let head = HEAD.map(str::to_owned).into_iter();
        let header: Vec<String> = head.chain(columns.iter().map(SensorColumn::name)).collect();
        let flags = columns.iter().map(SensorColumn::is_flag).collect();
        let mut writer = Self { rows: RowBlocks::new(sink), flags };
        writer.rows.push(|row| row.write_record(&header))?;
        writer.rows.flush()?; // a run that fails at once leaves a file with a header
        Ok(writer)
    }

    /// Writes one node.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn record(&mut self, sample: &Sample) -> io::Result<()> {
        let field = |(value, flag): (&f64, &bool)| match flag {
            true => RowField::Flag(*value != 0.0),
            false if value.is_nan() => RowField::Empty,
            false => RowField::Number(*value),
        };
        let fields = sample.sensors.iter().zip(&self.flags).map(field);
        self.rows.fields(sample.step, std::iter::once(RowField::Number(sample.t)).chain(fields))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_whole_and_what_is_not_unique_is_no_number() {
        let column = |part: &str, quantity| SensorColumn {
            sensor: "tip".into(),
            part: part.into(),
            quantity,
            unit: "",
        };
        let columns = [column("", "angle"), column("fx", "force"), column("unique", "")];
        let mut file = Vec::new();
        let mut writer = SensorWriter::new(&mut file, &columns).unwrap();
        let mut sample = Sample {
            step: 3,
            t: 0.25,
            q: vec![],
            energy: 0.0,
            hamiltonian: 0.0,
            shadow: None,
            work: 0.0,
            momentum: Default::default(),
            residuals: Default::default(),
            newton_iterations: 0.0,
            sensors: vec![0.1, f64::NAN, 0.0],
            energies: vec![],
            momenta: None,
            unstable: None,
            notice: None,
            contacts: Vec::new(),
            events: Vec::new(),
        };
        writer.record(&sample).unwrap();
        sample.sensors = vec![7.0, 1e-300, 1.0];
        writer.record(&sample).unwrap();
        writer.finish().unwrap();
        let expected = "step,t,tip,tip.fx,tip.unique\n3,0.25,0.1,,0\n3,0.25,7.0,1e-300,1\n";
        assert_eq!(String::from_utf8(file).unwrap(), expected);
    }
}
