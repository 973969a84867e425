//! The files of a run, node after node.

use std::io;

use holonom_sim::output::{OutputError, RowReader, RunFolder};

/// Fields before the numbers of a row.
const HEAD: usize = 2;
/// Fields before the strains and forces of a row of `beams.csv`: step, t, beam, element, s.
const BEAM_HEAD: usize = 5;

pub(super) fn failed(folder: &RunFolder, file: &str, source: io::Error) -> OutputError {
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

/// The numbers of a file, node after node: of one row, of `beams.csv` of as many as there are
/// elements.
pub(super) struct Nodes {
    reader: RowReader,
    beams: bool,
    row: csv::StringRecord,
    /// Whether `row` holds the first row of the next node.
    ahead: bool,
    pub(super) t: f64,
    pub(super) numbers: Vec<f64>,
}

impl Nodes {
    pub(super) fn open(folder: &RunFolder, file: &str) -> Result<Self, OutputError> {
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
    pub(super) fn next(&mut self) -> io::Result<bool> {
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
