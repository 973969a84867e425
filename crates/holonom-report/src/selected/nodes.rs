//! The files of a run, node after node.

use std::io;

use holonom_sim::output::columns::HEAD;
use holonom_sim::output::{OutputError, RowReader, RowTable, RunFolder};

pub(super) fn failed(folder: &RunFolder, table: RowTable, source: io::Error) -> OutputError {
    OutputError::Io { path: folder.path().join(table.file()), source }
}

/// Names of the numbers that a file has at a node; none where there is no such file.
pub(super) fn names_of(folder: &RunFolder, table: RowTable) -> Result<Vec<String>, OutputError> {
    if !folder.path().join(table.file()).is_file() {
        return Ok(Vec::new());
    }
    let mut nodes = Nodes::open(folder, table)?;
    nodes.names().map_err(|source| failed(folder, table, source))
}

/// The numbers of a file, node after node: of one row, of `beams.csv` of as many as there are
/// elements.
pub(super) struct Nodes {
    reader: RowReader,
    table: RowTable,
    row: csv::StringRecord,
    /// Whether `row` holds the first row of the next node.
    ahead: bool,
    pub(super) t: f64,
    pub(super) numbers: Vec<f64>,
}

impl Nodes {
    pub(super) fn open(folder: &RunFolder, table: RowTable) -> Result<Self, OutputError> {
        let reader = folder.reader(&table.file());
        let reader = reader.map_err(|source| failed(folder, table, source))?;
        let (row, numbers) = (csv::StringRecord::new(), Vec::new());
        Ok(Self { reader, table, row, ahead: false, t: 0.0, numbers })
    }

    /// Whether a node has several rows.
    fn has_elements(&self) -> bool {
        self.table == RowTable::Beams
    }

    fn names(&mut self) -> io::Result<Vec<String>> {
        let head = self.table.head();
        let header: Vec<String> =
            self.reader.headers()?.iter().skip(head).map(str::to_owned).collect();
        if !self.has_elements() {
            return Ok(header);
        }
        let mut places: Vec<(String, usize)> = Vec::new();
        let mut step = None;
        while self.reader.read_record(&mut self.row)? {
            let field = |k: usize| self.row.get(k).unwrap_or_default().to_owned();
            if step.get_or_insert_with(|| field(0)) != &field(0) {
                break;
            }
            let beam = field(HEAD.len());
            let k = places.iter().filter(|place| place.0 == beam).count();
            places.push((beam, k));
        }
        let of = |(beam, k): &(String, usize)| -> Vec<String> {
            header.iter().map(|part| format!("{beam}.{k}.{part}")).collect()
        };
        Ok(places.iter().flat_map(of).collect())
    }

    /// Goes to the next node; `false`: there is none.
    pub(super) fn next(&mut self) -> io::Result<bool> {
        self.numbers.clear();
        if !self.ahead && !self.reader.read_record(&mut self.row)? {
            return Ok(false);
        }
        self.ahead = false;
        self.t = number(self.row.get(1))?;
        let step = self.row.get(0).unwrap_or_default().to_owned();
        loop {
            for field in self.row.iter().skip(self.table.head()) {
                self.numbers.push(number(Some(field))?);
            }
            if !self.has_elements() || !self.reader.read_record(&mut self.row)? {
                return Ok(true);
            }
            if self.row.get(0) != Some(&step) {
                self.ahead = true;
                return Ok(true);
            }
        }
    }
}

/// An empty field is no number.
fn number(field: Option<&str>) -> io::Result<f64> {
    let number = match field {
        Some("") => Some(f64::NAN),
        field => field.and_then(|field| field.parse().ok()),
    };
    let message = || format!("`{}` is no number", field.unwrap_or_default());
    number.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, message()))
}
