//! The columns of the files of a run, with quantities and units.

use holonom_sim::output::columns::{FieldKind, TIME};
use holonom_sim::output::{OutputError, RowTable, RunFolder};
use holonom_sim::sensor;

use super::nodes::names_of;

/// A column of a file of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileColumn {
    /// Its file without extension; empty for the time.
    pub file: &'static str,
    /// Its name there; of a beam `BEAM.k.N1` with the k-th row of the beam at a node, counted
    /// from 0.
    pub name: String,
    /// What it is.
    pub quantity: String,
    /// Its unit; empty when it has none.
    pub unit: &'static str,
    /// Whether its powers of ten matter.
    pub logarithmic: bool,
}

impl FileColumn {
    pub(super) fn time(quantity: &str, unit: &'static str) -> Self {
        let [name, quantity] = [TIME.name, quantity].map(str::to_owned);
        Self { file: "", name, quantity, unit, logarithmic: false }
    }

    /// Its name with that of its file: `residuals/position`.
    #[must_use]
    pub fn qualified(&self) -> String {
        format!("{}/{}", self.file, self.name)
    }

    /// What follows the last dot of its name.
    pub(super) fn part(&self) -> &str {
        self.name.rsplit_once('.').map_or("", |(_, part)| part)
    }
}

/// The columns of all files of a run, but for `step` and `t`.
///
/// # Errors
/// [`OutputError::Io`].
pub fn columns(folder: &RunFolder) -> Result<Vec<FileColumn>, OutputError> {
    let model = folder.model().ok();
    let sensors = model.as_ref().map(sensor::columns).unwrap_or_default();
    let mut all = Vec::new();
    for table in RowTable::ALL {
        for name in names_of(folder, table)? {
            let own = table.column(&name);
            let sensors = sensors.iter().filter(|_| table == RowTable::Sensors);
            let (quantity, unit) = match sensors.clone().find(|sensor| sensor.name() == name) {
                Some(sensor) => (sensor.quantity, sensor.unit),
                None => (own.quantity, own.unit),
            };
            let logarithmic = own.kind == FieldKind::Residual;
            let (file, quantity) = (table.name(), quantity.to_owned());
            all.push(FileColumn { file, name, quantity, unit, logarithmic });
        }
    }
    Ok(all)
}
