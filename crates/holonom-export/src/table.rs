//! The CSV files of a run as columns.

use crate::ExportError;
use holonom_sim::output::columns::FieldKind;
use holonom_sim::output::{RowTable, RunFolder};

/// Files with one column for each quantity after `step, t`, beside the trajectory.
pub(crate) const GROUPS: [RowTable; 4] =
    [RowTable::Residuals, RowTable::Sensors, RowTable::Momenta, RowTable::Energy];

/// The files of a run.
pub(crate) struct RunFiles {
    pub(crate) trajectory: ColumnTable,
    /// Of [`GROUPS`], those that there are.
    pub(crate) groups: Vec<(&'static str, ColumnTable)>,
    pub(crate) beams: Option<ColumnTable>,
}

impl RunFiles {
    /// Reads all that stand in a folder; a trajectory is required.
    pub(crate) fn read(folder: &RunFolder) -> Result<Self, ExportError> {
        let read = |of: RowTable| ColumnTable::read(folder, of);
        let trajectory = read(RowTable::Trajectory)?.ok_or_else(|| ColumnTable::missing(folder))?;
        let mut groups = Vec::new();
        for of in GROUPS {
            groups.extend(read(of)?.map(|table| (of.name(), table)));
        }
        Ok(Self { trajectory, groups, beams: read(RowTable::Beams)? })
    }
}

/// Columns of numbers, and the one of words that `beams.csv` has.
pub(crate) struct ColumnTable {
    pub(crate) names: Vec<String>,
    pub(crate) kinds: Vec<FieldKind>,
    pub(crate) columns: Vec<Vec<f64>>,
    /// Of the column `beam`; empty without one.
    pub(crate) words: Vec<String>,
}

impl ColumnTable {
    /// Reads a file; `None` where there is none. Empty fields are NaN.
    pub(crate) fn read(folder: &RunFolder, of: RowTable) -> Result<Option<Self>, ExportError> {
        let path = folder.path().join(of.file());
        let failed = |message: String| ExportError::Read { path: path.clone(), message };
        if !path.is_file() {
            return Ok(None);
        }
        let mut reader = folder.reader(&of.file()).map_err(|e| failed(e.to_string()))?;
        let header = reader.headers().map_err(|e| failed(e.to_string()))?;
        let names: Vec<String> = header.iter().map(str::to_owned).collect();
        let kinds = names.iter().map(|name| of.column(name).kind).collect();
        let columns = vec![Vec::new(); names.len()];
        let mut table = Self { names, kinds, columns, words: Vec::new() };
        let words = table.kinds.iter().position(|kind| *kind == FieldKind::Text);
        let mut row = csv::StringRecord::new();
        while reader.read_record(&mut row).map_err(|e| failed(e.to_string()))? {
            for (k, (field, column)) in row.iter().zip(&mut table.columns).enumerate() {
                if Some(k) == words {
                    table.words.push(field.to_owned());
                    continue;
                }
                let value = if field.is_empty() { Ok(f64::NAN) } else { field.parse() };
                let line = row.position().map_or(0, csv::Position::line);
                let no_number = |_| failed(format!("line {line}: `{field}` is no number"));
                column.push(value.map_err(no_number)?);
            }
        }
        Ok(Some(table))
    }

    /// What is wrong with a folder without a trajectory.
    pub(crate) fn missing(folder: &RunFolder) -> ExportError {
        let path = folder.path().join(RowTable::Trajectory.file());
        ExportError::Read { path, message: "there is no such file".into() }
    }

    /// How many rows there are.
    pub(crate) fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// The column of a name.
    pub(crate) fn column(&self, name: &str) -> Option<&[f64]> {
        let k = self.names.iter().position(|column| column == name)?;
        Some(&self.columns[k])
    }
}
