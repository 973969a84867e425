//! `sensors.csv` and `energy.csv` read back: columns over time.

use std::io;

use super::csv::{HEAD, invalid};
use super::readable::RowReader;

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
    pub fn read(mut reader: RowReader) -> io::Result<Self> {
        let names: Vec<String> = reader.headers()?.iter().map(str::to_owned).collect();
        if !names.starts_with(&HEAD.map(str::to_owned)) {
            return Err(invalid("not a file of rows of a run"));
        }
        let columns = names[HEAD.len()..].to_vec();
        let mut table = Self { t: vec![], values: vec![vec![]; columns.len()], columns };
        let mut row = csv::StringRecord::new();
        while reader.read_record(&mut row)? {
            let number = |column: usize| -> io::Result<f64> {
                let parse = |field: &str| match field {
                    "" => Some(f64::NAN),
                    number => number.parse().ok(),
                };
                let value = row.get(column).and_then(parse);
                value.ok_or_else(|| invalid(&format!("no number in column {}", column + 1)))
            };
            table.t.push(number(1)?);
            for (k, values) in table.values.iter_mut().enumerate() {
                values.push(number(HEAD.len() + k)?);
            }
        }
        Ok(table)
    }
}
