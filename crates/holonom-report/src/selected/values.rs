//! Numbers of chosen columns, read in one pass over each file.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use holonom_sim::output::{OutputError, RowReader, RunFolder};

use super::columns::{Column, FILES};
use super::scales::Scales;

/// Fields before the numbers of a row.
const HEAD: usize = 2;
/// Fields before the strains and forces of a row of `beams.csv`: step, t, beam, element, s.
const BEAM_HEAD: usize = 5;

/// The numbers of some columns, and how large those of all columns of the same files are.
pub(super) struct Values {
    pub(super) t: Vec<f64>,
    columns: BTreeMap<usize, Vec<f64>>,
    pub(super) scales: Scales,
}

impl Values {
    /// Reads the columns with these indices among `all`. The trajectory is read in any case: for times and lengths.
    pub(super) fn read(
        folder: &RunFolder,
        all: &[Column],
        wanted: &BTreeSet<usize>,
    ) -> Result<Self, OutputError> {
        let mut values = Self {
            t: Vec::new(),
            columns: wanted.iter().map(|k| (*k, Vec::new())).collect(),
            scales: Scales::default(),
        };
        for file in FILES {
            let first = all.iter().position(|column| column.file == file);
            let count = all.iter().filter(|column| column.file == file).count();
            let Some(own) = first.map(|first| first..first + count) else { continue };
            let scale = ["trajectory", "energy", "sensors"].contains(&file);
            if !scale && wanted.range(own.clone()).next().is_none() {
                continue;
            }
            let mut nodes = Nodes::open(folder, file)?;
            let mut largest = vec![0.0_f64; count];
            while nodes.next().map_err(|source| failed(folder, file, source))? {
                if file == "trajectory" {
                    values.t.push(nodes.t);
                }
                nodes.numbers.resize(count, f64::NAN); // a beam may lack rows at a node
                for (largest, number) in largest.iter_mut().zip(&nodes.numbers) {
                    *largest = largest.max(number.abs()); // of a number and NaN the number
                }
                values.take(&nodes.numbers, own.start);
            }
            for (column, largest) in all[own].iter().zip(largest) {
                values.scales.add(column.unit, largest);
            }
        }
        let rows = values.t.len();
        values.columns.values_mut().for_each(|column| column.resize(rows, f64::NAN));
        Ok(values)
    }

    fn take(&mut self, numbers: &[f64], first: usize) {
        for (k, column) in self.columns.range_mut(first..first + numbers.len()) {
            column.push(numbers[k - first]);
        }
    }

    pub(super) fn of(&self, column: usize) -> &[f64] {
        self.columns.get(&column).map(Vec::as_slice).unwrap_or_default()
    }
}

fn failed(folder: &RunFolder, file: &str, source: io::Error) -> OutputError {
    OutputError::Io { path: folder.path().join(format!("{file}.csv")), source }
}

/// Names of the numbers that a file has at a node; none where there is no such file.
pub(super) fn names_of(folder: &RunFolder, file: &str) -> Result<Vec<String>, OutputError> {
    if !folder.path().join(format!("{file}.csv")).is_file() {
        return Ok(Vec::new());
    }
    let mut nodes = Nodes::open(folder, file)?;
    nodes.names().map_err(|source| failed(folder, file, source))
}

/// The numbers of a file, node after node: of one row, of `beams.csv` of as many as there are elements.
struct Nodes {
    reader: RowReader,
    beams: bool,
    row: csv::StringRecord,
    /// Whether `row` holds the first row of the next node.
    ahead: bool,
    t: f64,
    numbers: Vec<f64>,
}

impl Nodes {
    fn open(folder: &RunFolder, file: &str) -> Result<Self, OutputError> {
        let reader = folder.reader(&format!("{file}.csv"));
        let reader = reader.map_err(|source| failed(folder, file, source))?;
        let (row, numbers) = (csv::StringRecord::new(), Vec::new());
        Ok(Self { reader, beams: file == "beams", row, ahead: false, t: 0.0, numbers })
    }

    fn names(&mut self) -> io::Result<Vec<String>> {
        let head = if self.beams { BEAM_HEAD } else { HEAD };
        let header: Vec<String> =
            self.reader.headers()?.iter().skip(head).map(str::to_owned).collect();
        if !self.beams {
            return Ok(header);
        }
        let mut places: Vec<(String, usize)> = Vec::new();
        let mut step = None;
        while self.reader.read_record(&mut self.row)? {
            let field = |k: usize| self.row.get(k).unwrap_or_default().to_owned();
            if step.get_or_insert_with(|| field(0)) != &field(0) {
                break;
            }
            let beam = field(HEAD);
            let k = places.iter().filter(|place| place.0 == beam).count();
            places.push((beam, k));
        }
        let of = |(beam, k): &(String, usize)| -> Vec<String> {
            header.iter().map(|part| format!("{beam}.{k}.{part}")).collect()
        };
        Ok(places.iter().flat_map(of).collect())
    }

    /// Goes to the next node; `false`: there is none.
    fn next(&mut self) -> io::Result<bool> {
        self.numbers.clear();
        if !self.ahead && !self.reader.read_record(&mut self.row)? {
            return Ok(false);
        }
        self.ahead = false;
        self.t = number(self.row.get(1))?;
        let step = self.row.get(0).unwrap_or_default().to_owned();
        loop {
            let head = if self.beams { BEAM_HEAD } else { HEAD };
            for field in self.row.iter().skip(head) {
                self.numbers.push(number(Some(field))?);
            }
            if !self.beams || !self.reader.read_record(&mut self.row)? {
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
