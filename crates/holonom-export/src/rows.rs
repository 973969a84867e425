//! Rows of a CSV file of a run, found by their steps.

use std::collections::BTreeMap;

use holonom_sim::output::{RowReader, RowTable, RunFolder};

use crate::ExportError;

/// The rows of a file, step after step.
pub(crate) struct StepRows {
    reader: RowReader,
    next: csv::StringRecord,
    more: bool,
    failed: Box<dyn Fn(String) -> ExportError>,
    columns: BTreeMap<String, usize>,
}

impl StepRows {
    /// Opens a file of a folder; `None` where there is none.
    pub(crate) fn open(folder: &RunFolder, of: RowTable) -> Result<Option<Self>, ExportError> {
        let path = folder.path().join(of.file());
        if !path.is_file() {
            return Ok(None);
        }
        let failed = move |message: String| ExportError::Read { path: path.clone(), message };
        let mut reader = folder.reader(&of.file()).map_err(|e| failed(e.to_string()))?;
        let columns = reader.headers().map_err(|e| failed(e.to_string()))?;
        let columns = columns.iter().map(str::to_owned).zip(0..).collect();
        let next = csv::StringRecord::new();
        let mut rows = Self { reader, next, more: true, failed: Box::new(failed), columns };
        rows.advance()?;
        Ok(Some(rows))
    }

    /// The index of a column.
    pub(crate) fn column(&self, name: &str) -> Option<usize> {
        self.columns.get(name).copied()
    }

    fn advance(&mut self) -> Result<(), ExportError> {
        self.more =
            self.reader.read_record(&mut self.next).map_err(|e| (self.failed)(e.to_string()))?;
        Ok(())
    }

    /// The rows of a step; steps are asked for in ascending order.
    pub(crate) fn at(&mut self, step: u64) -> Result<Vec<csv::StringRecord>, ExportError> {
        let mut rows = Vec::new();
        while self.more {
            let field = self.next.get(0).unwrap_or_default();
            let found: u64 =
                field.parse().map_err(|_| (self.failed)(format!("`{field}` is no step")))?;
            if found > step {
                break;
            }
            if found == step {
                rows.push(self.next.clone());
            }
            self.advance()?;
        }
        Ok(rows)
    }
}

/// A number of a row; `None` where the field is empty, and where it holds no finite number.
pub(crate) fn number(row: &csv::StringRecord, column: usize) -> Option<f64> {
    row.get(column)?.parse().ok().filter(|value: &f64| value.is_finite())
}
