//! `sensors.csv` and `energy.csv` read back: columns over time.

use std::io;

use super::csv::HEAD;
use super::readable::{Lines, end, invalid, number};

/// A file of rows read back.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TimeSeries {
    /// Names of the columns, without `step` and `t`.
    pub columns: Vec<String>,
    /// Times, s.
    pub t: Vec<f64>,
    /// Values of each column.
    pub values: Vec<Vec<f64>>,
}

impl TimeSeries {
    /// Reads the file.
    ///
    /// # Errors
    /// When it cannot be read, or is not one of ours.
    pub fn read(mut lines: Lines) -> io::Result<Self> {
        let names = lines.columns();
        if !names.starts_with(&HEAD.map(str::to_owned)) {
            return Err(invalid("not a file of rows of a run"));
        }
        let columns = names[HEAD.len()..].to_vec();
        let mut table = Self { t: vec![], values: vec![vec![]; columns.len()], columns };
        while lines.advance()? {
            let mut fields = lines.fields().skip(1);
            table.t.push(number(fields.next(), 1)?);
            for (column, values) in (HEAD.len()..).zip(&mut table.values) {
                values.push(match fields.next() {
                    Some(b"") => f64::NAN,
                    field => number(field, column)?,
                });
            }
            end(fields)?;
        }
        Ok(table)
    }
}
