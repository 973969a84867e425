//! The tables of a folder of `holonom run`.

use crate::errors::{json, no_word, output, raise};
use holonom::RunFolder;
use holonom::export::{Format, export as write_export};
use holonom::output::{OutputError, Readable, RowTable};
use holonom_cli::text;
use numpy::IntoPyArray;
use numpy::ndarray::Array2;
use pyo3::prelude::*;
use std::io;
use std::path::{Path, PathBuf};

/// A file of rows: names of its columns, of their numbers, and of texts (`beams.csv`) the one
/// column.
struct ReadFile {
    columns: Vec<String>,
    values: Vec<f64>,
    texts: Vec<String>,
    rows: usize,
}

/// The column that holds names.
const TEXT: &str = "beam";

/// Reads `NAME.csv` as far as all files of the folder go: columns, values `(K, columns)`, the names
/// of beams; `None` where the folder has no such file. An empty field is NaN.
#[pyfunction]
pub(crate) fn read_table<'py>(
    py: Python<'py>,
    folder: PathBuf,
    name: &str,
) -> PyResult<Option<(Vec<String>, Bound<'py, PyAny>, Vec<String>)>> {
    let table = row_table(py, name)?;
    let found = py.detach(|| read(&folder, table)).map_err(|error| output(py, &error))?;
    let Some(ReadFile { columns, values, texts, rows }) = found else { return Ok(None) };
    let shape = (rows, columns.len());
    let array = Array2::from_shape_vec(shape, values)
        .map_err(|error| raise(py, "HolonomError", (error.to_string(),)))?;
    Ok(Some((columns, array.into_pyarray(py).into_any(), texts)))
}

fn read(folder: &Path, table: RowTable) -> Result<Option<ReadFile>, OutputError> {
    let path = folder.join(table.file());
    if !path.is_file() {
        return Ok(None);
    }
    let Readable { folder, .. } = RunFolder::open(folder).readable()?;
    read_rows(&folder, table).map(Some).map_err(|source| OutputError::Io { path, source })
}

fn read_rows(folder: &RunFolder, table: RowTable) -> io::Result<ReadFile> {
    let mut reader = folder.reader(&table.file())?;
    let header: Vec<String> = reader.headers()?.iter().map(str::to_owned).collect();
    let is_text = |k: usize| table == RowTable::Beams && header[k] == TEXT;
    let columns = (0..header.len()).filter(|k| !is_text(*k)).map(|k| header[k].clone());
    let (columns, mut values, mut texts, mut rows) = (columns.collect(), vec![], vec![], 0);
    for record in reader.records() {
        let record = record?;
        for (k, field) in record.iter().enumerate() {
            match field {
                text if is_text(k) => texts.push(text.to_owned()),
                "" => values.push(f64::NAN),
                number => values.push(number.parse().map_err(|_| {
                    let words = format!("row {}: `{number}` is no number", rows + 1);
                    io::Error::new(io::ErrorKind::InvalidData, words)
                })?),
            }
        }
        rows += 1;
    }
    Ok(ReadFile { columns, values, texts, rows })
}

/// The units of columns of the file `NAME.csv`; empty of numbers without one.
#[pyfunction]
pub(crate) fn units(
    py: Python<'_>,
    table: &str,
    columns: Vec<String>,
) -> PyResult<Vec<&'static str>> {
    let table = row_table(py, table)?;
    Ok(columns.iter().map(|column| table.column(column).unit).collect())
}

fn row_table(py: Python<'_>, name: &str) -> PyResult<RowTable> {
    let table = RowTable::ALL.into_iter().find(|table| table.name() == name);
    table.ok_or_else(|| raise(py, "HolonomError", (format!("`{name}` is no table of a run"),)))
}

/// `summary.json` of a folder, with its sentences.
#[pyfunction]
pub(crate) fn summary<'py>(
    py: Python<'py>,
    folder: PathBuf,
) -> PyResult<(Bound<'py, PyAny>, String)> {
    let summary = RunFolder::open(folder).summary().map_err(|error| output(py, &error))?;
    let value = serde_json::to_value(&summary).unwrap_or_default();
    Ok((json(py, &value)?, text::run(&summary)))
}

/// Writes plots and the page of a folder, where they are not there; the path of the page.
#[pyfunction]
pub(crate) fn write_page(py: Python<'_>, folder: PathBuf) -> PyResult<PathBuf> {
    let page = folder.join("report.html");
    let written = py.detach(|| match page.is_file() {
        true => Ok(()),
        false => holonom::report::write(&RunFolder::open(&folder)).map(drop),
    });
    written.map_err(|error| output(py, &error)).map(|()| page)
}

/// Writes the results of a folder in a format of other programs to a file or folder.
#[pyfunction]
pub(crate) fn export(
    py: Python<'_>,
    folder: PathBuf,
    format: &str,
    to: PathBuf,
    frames: Option<usize>,
) -> PyResult<()> {
    let Some(format) = Format::ALL.into_iter().find(|known| known.name() == format) else {
        return Err(no_word("format", format, &Format::ALL.map(Format::name)));
    };
    let written = py.detach(|| write_export(&RunFolder::open(folder), format, &to, frames));
    written.map(drop).map_err(|error| raise(py, "OutputFailed", (error.to_string(),)))
}
