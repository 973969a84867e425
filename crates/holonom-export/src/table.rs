//! The CSV files of a run as columns.

use crate::ExportError;
use holonom_sim::output::RunFolder;

/// Files with one column for each quantity after `step, t`, by their names without extension.
pub(crate) const GROUPS: [&str; 4] = ["residuals", "sensors", "momenta", "energy"];

/// The files of a run.
pub(crate) struct Results {
    pub(crate) trajectory: Table,
    /// Of [`GROUPS`], those that there are.
    pub(crate) groups: Vec<(&'static str, Table)>,
    pub(crate) beams: Option<Table>,
}

impl Results {
    /// Reads all that stand in a folder; a trajectory is required.
    pub(crate) fn read(folder: &RunFolder) -> Result<Self, ExportError> {
        let read = |name: &str| Table::read(folder, &format!("{name}.csv"));
        let trajectory = read("trajectory")?.ok_or_else(|| Table::missing(folder))?;
        let mut groups = Vec::new();
        for name in GROUPS {
            groups.extend(read(name)?.map(|table| (name, table)));
        }
        Ok(Self { trajectory, groups, beams: read("beams")? })
    }
}

/// Columns of numbers, and the one of words that `beams.csv` has.
pub(crate) struct Table {
    pub(crate) names: Vec<String>,
    pub(crate) columns: Vec<Vec<f64>>,
    /// Of the column `beam`; empty without one.
    pub(crate) words: Vec<String>,
}

impl Table {
    /// Reads a file; `None` where there is none. Empty fields are NaN.
    pub(crate) fn read(folder: &RunFolder, name: &str) -> Result<Option<Self>, ExportError> {
        let path = folder.path().join(name);
        let failed = |message: String| ExportError::Read { path: path.clone(), message };
        if !path.is_file() {
            return Ok(None);
        }
        let mut reader = folder.reader(name).map_err(|e| failed(e.to_string()))?;
        let header = reader.headers().map_err(|e| failed(e.to_string()))?;
        let names: Vec<String> = header.iter().map(str::to_owned).collect();
        let mut table = Self { columns: vec![Vec::new(); names.len()], names, words: Vec::new() };
        let words = table.names.iter().position(|name| name == "beam");
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
        let path = folder.path().join("trajectory.csv");
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
