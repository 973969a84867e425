//! Tables for pandas, Polars, DuckDB: every CSV file of the run as a Parquet file.
//!
//! | column | type |
//! |---|---|
//! | `step`, `element` | int64 |
//! | `beam` | string |
//! | all others | double; null where the field of the CSV file is empty |

use crate::ExportError;
use crate::table::{GROUPS, Table};
use holonom_sim::output::RunFolder;
use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::Result;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

/// Rows that a reader can skip or take as one.
const GROUP: usize = 1 << 16;

/// Whether an entry of a folder is one that [`write`] makes.
pub(crate) fn known(entry: &str) -> bool {
    entry.strip_suffix(".parquet").is_some_and(|name| names().any(|known| known == name))
}

fn names() -> impl Iterator<Item = &'static str> {
    ["trajectory", "beams"].into_iter().chain(GROUPS)
}

/// Writes all tables of a run into the folder `to`, which it makes; how many rows the trajectory has.
pub(crate) fn write(run: &RunFolder, to: &Path) -> std::result::Result<usize, ExportError> {
    let failed =
        |path: &Path, message: String| ExportError::Write { path: path.to_owned(), message };
    std::fs::create_dir_all(to).map_err(|e| failed(to, e.to_string()))?;
    let trajectory = Table::read(run, "trajectory.csv")?.ok_or_else(|| Table::missing(run))?;
    let rows = trajectory.rows();
    let mut trajectory = Some(trajectory);
    for name in names() {
        let table = match trajectory.take() {
            None => Table::read(run, &format!("{name}.csv"))?,
            first => first,
        };
        if let Some(table) = table {
            let path = to.join(format!("{name}.parquet"));
            file(&table, &path).map_err(|e| failed(&path, e.to_string()))?;
        }
    }
    Ok(rows)
}

/// One column, with its type.
enum Column<'a> {
    Integers(&'a [f64]),
    Numbers(&'a [f64]),
    /// Some are missing: NaN.
    Optional(&'a [f64]),
    Words(&'a [String]),
}

impl<'a> Column<'a> {
    fn of(table: &'a Table, k: usize) -> Self {
        match table.names[k].as_str() {
            "step" | "element" => Self::Integers(&table.columns[k]),
            "beam" => Self::Words(&table.words),
            _ if table.columns[k].iter().any(|x| x.is_nan()) => Self::Optional(&table.columns[k]),
            _ => Self::Numbers(&table.columns[k]),
        }
    }

    fn field(&self, name: &str) -> Result<Type> {
        let (physical, converted) = match self {
            Self::Integers(_) => (Physical::INT64, ConvertedType::NONE),
            Self::Numbers(_) | Self::Optional(_) => (Physical::DOUBLE, ConvertedType::NONE),
            Self::Words(_) => (Physical::BYTE_ARRAY, ConvertedType::UTF8),
        };
        let repetition = match self {
            Self::Optional(_) => Repetition::OPTIONAL,
            _ => Repetition::REQUIRED,
        };
        Type::primitive_type_builder(name, physical)
            .with_repetition(repetition)
            .with_converted_type(converted)
            .build()
    }

    /// Writes rows `from..to` as the next column of a group.
    fn write(
        &self,
        group: &mut SerializedRowGroupWriter<'_, File>,
        rows: std::ops::Range<usize>,
    ) -> Result<()> {
        let Some(mut column) = group.next_column()? else { return Ok(()) };
        match self {
            Self::Integers(values) => {
                let values: Vec<i64> = values[rows].iter().map(|&x| x as i64).collect();
                column.typed::<Int64Type>().write_batch(&values, None, None)?;
            }
            Self::Optional(values) => {
                let there: Vec<i16> =
                    values[rows.clone()].iter().map(|x| i16::from(!x.is_nan())).collect();
                let values: Vec<f64> =
                    values[rows].iter().copied().filter(|x| !x.is_nan()).collect();
                column.typed::<DoubleType>().write_batch(&values, Some(&there), None)?;
            }
            Self::Numbers(values) => {
                column.typed::<DoubleType>().write_batch(&values[rows], None, None)?;
            }
            Self::Words(words) => {
                let words: Vec<ByteArray> =
                    words[rows].iter().map(|x| ByteArray::from(x.as_str())).collect();
                column.typed::<ByteArrayType>().write_batch(&words, None, None)?;
            }
        }
        column.close()
    }
}

fn file(table: &Table, path: &Path) -> Result<()> {
    let columns: Vec<Column<'_>> = (0..table.names.len()).map(|k| Column::of(table, k)).collect();
    let fields =
        columns.iter().zip(&table.names).map(|(column, name)| column.field(name).map(Arc::new));
    let schema =
        Type::group_type_builder("table").with_fields(fields.collect::<Result<_>>()?).build()?;
    let properties = WriterProperties::builder().set_dictionary_enabled(false).build();
    let mut writer =
        SerializedFileWriter::new(File::create(path)?, Arc::new(schema), Arc::new(properties))?;
    for from in (0..table.rows()).step_by(GROUP) {
        let rows = from..table.rows().min(from + GROUP);
        let mut group = writer.next_row_group()?;
        for column in &columns {
            column.write(&mut group, rows.clone())?;
        }
        group.close()?;
    }
    writer.close().map(drop)
}
