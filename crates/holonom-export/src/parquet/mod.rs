//! Tables for pandas, Polars, DuckDB: every CSV file of the run as a Parquet file.
//!
//! | column | type |
//! |---|---|
//! | `step`, `element` | int64 |
//! | `beam` | string |
//! | all others | double; null where the field of the CSV file is empty |

mod compact;
mod file;

use crate::ExportError;
use crate::table::{ColumnTable, GROUPS};
use file::ColumnValues;
use holonom_sim::output::columns::FieldKind;
use holonom_sim::output::{RowTable, RunFolder};
use std::path::Path;

/// Whether an entry of a folder is one that [`write`] makes.
pub(crate) fn known(entry: &str) -> bool {
    entry.strip_suffix(".parquet").is_some_and(|name| tables().any(|known| known.name() == name))
}

fn tables() -> impl Iterator<Item = RowTable> {
    [RowTable::Trajectory, RowTable::Beams].into_iter().chain(GROUPS)
}

/// Writes all tables of a run into the folder `to`, which it makes; how many rows the trajectory
/// has.
pub(crate) fn write(run: &RunFolder, to: &Path) -> Result<usize, ExportError> {
    let failed =
        |path: &Path, message: String| ExportError::Write { path: path.to_owned(), message };
    std::fs::create_dir_all(to).map_err(|e| failed(to, e.to_string()))?;
    let trajectory =
        ColumnTable::read(run, RowTable::Trajectory)?.ok_or_else(|| ColumnTable::missing(run))?;
    let rows = trajectory.rows();
    let mut trajectory = Some(trajectory);
    for of in tables() {
        let table = match trajectory.take() {
            None => ColumnTable::read(run, of)?,
            first => first,
        };
        if let Some(table) = table {
            let path = to.join(format!("{}.parquet", of.name()));
            file::write(&path, &columns(&table), table.rows())
                .map_err(|e| failed(&path, e.to_string()))?;
        }
    }
    Ok(rows)
}

/// The columns of a table by their names, with their types.
fn columns(table: &ColumnTable) -> Vec<(&str, ColumnValues<'_>)> {
    let names = table.names.iter().zip(&table.kinds);
    let columns = names.zip(&table.columns).map(|((name, kind), values)| {
        let column = match kind {
            FieldKind::Index => ColumnValues::Integers(values),
            FieldKind::Text => ColumnValues::Words(&table.words),
            _ if values.iter().any(|x| x.is_nan()) => ColumnValues::Optional(values),
            _ => ColumnValues::Numbers(values),
        };
        (name.as_str(), column)
    });
    columns.collect()
}
