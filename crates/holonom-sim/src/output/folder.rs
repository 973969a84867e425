//! The folder of a run.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Take};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::beams::BeamWriter;
use super::checkpoint::{self, Checkpoint};
use super::contacts::{self, ContactRow, ContactWriter};
use super::csv::{Trajectory, TrajectoryWriter};
use super::energy::EnergyWriter;
use super::events::{self, EventWriter};
use super::file::{LARGEST, OutputError, at, write_atomically};
use super::frames::{FrameReader, Frames};
use super::lock::Lock;
use super::meshes;
use super::momenta::MomentaWriter;
use super::pictures::{self, is_there};
use super::readable::{self, LeftOut, Lines, RowReader};
use super::row_file::RowFile;
use super::sensors::SensorWriter;
use super::summary::{Status, Summary};
use super::time_series::TimeSeries;
use super::written::Written;
use crate::event::EventRecord;
use crate::sample::{Member, MomentaNames};
use crate::sensor::SensorColumn;
use crate::system::beams::Beams;
use crate::system::contact_origin::ContactOrigin;
use holonom_model::{Columns, read_regular_text};

/// Files that make a folder one of ours.
const FILES: [&str; 19] = [
    "trajectory.csv",
    "residuals.csv",
    "sensors.csv",
    "beams.csv",
    "momenta.csv",
    "energy.csv",
    EVENTS,
    CONTACTS,
    "summary.json",
    MODEL,
    "report.html",
    "estimate.json",
    "estimate.csv",
    "estimate.html",
    "optimum.json",
    "optimum.html",
    "iterations.csv",
    "controls.csv",
    "costates.csv",
];

/// The file of the model.
pub(super) const MODEL: &str = "model.toml";

/// What events did; one row for each action.
const EVENTS: &str = "events.csv";

/// Contacts of bodies; one row for each and each node.
const CONTACTS: &str = "contacts.csv";

/// So many of them, the first, have a row for each node.
const ROWS: usize = 6;

/// The folder of a run, as far as it can be read.
#[derive(Clone, Debug)]
pub struct Readable {
    /// The folder.
    pub folder: RunFolder,
    /// What is left out of its files.
    pub left_out: Vec<LeftOut>,
}

/// A folder with the files of one run.
#[derive(Clone, Debug)]
pub struct RunFolder {
    path: PathBuf,
    lengths: BTreeMap<String, u64>, // bytes of files of rows that count; all where none are stated
    written: BTreeMap<String, Written>, // what files of rows have at a checkpoint
    _lock: Option<Arc<Lock>>,       // held as long as a folder that is written to exists
}

impl RunFolder {
    /// A folder for a new run; created, with its parents, if it does not exist. With `force`, the
    /// files of an earlier run are removed; pictures only where this program drew them.
    ///
    /// # Errors
    /// [`OutputError::Occupied`], [`OutputError::Foreign`], [`OutputError::InUse`],
    /// [`OutputError::Io`].
    pub fn create(path: impl Into<PathBuf>, force: bool) -> Result<Self, OutputError> {
        let folder = Self::claim(path.into())?;
        pictures::check_before(&folder.path.join("plots"))?;
        checkpoint::check_before(&folder.path)?;
        folder.clear(&FILES, force)?;
        checkpoint::remove(&folder.path)?;
        pictures::remove(&folder.path.join("plots"), &[])?;
        Ok(folder)
    }

    /// A folder for the given files, created if it does not exist; with `force`, those that are
    /// there are removed. No other program gets the folder as long as this object or a copy of it
    /// exists.
    ///
    /// # Errors
    /// [`OutputError::Occupied`], [`OutputError::InUse`], [`OutputError::Io`].
    pub fn create_for(
        path: impl Into<PathBuf>,
        files: &[&str],
        force: bool,
    ) -> Result<Self, OutputError> {
        let folder = Self::claim(path.into())?;
        folder.clear(files, force)?;
        Ok(folder)
    }

    /// Creates the folder if it does not exist, and locks it before anybody looks at its files.
    fn claim(path: PathBuf) -> Result<Self, OutputError> {
        if !path.is_dir() {
            fs::create_dir_all(&path).map_err(|e| at(&path, e))?;
        }
        Self::reopen(path)
    }

    fn clear(&self, files: &[&str], force: bool) -> Result<(), OutputError> {
        Self::vacant(&self.path, files, force)?;
        for file in files.iter().map(|f| self.path.join(f)).filter(|f| is_there(f)) {
            fs::remove_file(&file).map_err(|e| at(&file, e))?;
        }
        if files.contains(&MODEL) { meshes::remove(&self.path) } else { Ok(()) }
    }

    /// Whether the given files may be written to a folder: none is there, or `force` is set.
    /// Changes nothing.
    ///
    /// # Errors
    /// [`OutputError::Occupied`].
    pub fn vacant(path: &Path, files: &[&str], force: bool) -> Result<(), OutputError> {
        match files.iter().find(|file| is_there(&path.join(file))).filter(|_| !force) {
            Some(file) => {
                Err(OutputError::Occupied { folder: path.to_owned(), file: (*file).to_owned() })
            }
            None => Ok(()),
        }
    }

    /// The folder of an earlier run.
    #[must_use]
    pub fn open(path: impl Into<PathBuf>) -> Self {
        let (lengths, written) = (BTreeMap::new(), BTreeMap::new());
        Self { path: path.into(), lengths, written, _lock: None }
    }

    /// The folder of an earlier run that is to be continued. No other program gets it as long as
    /// this object or a copy of it exists.
    ///
    /// # Errors
    /// [`OutputError::InUse`].
    pub fn reopen(path: impl Into<PathBuf>) -> Result<Self, OutputError> {
        let mut folder = Self::open(path);
        folder._lock = lock(&folder.path)?;
        Ok(folder)
    }

    /// The folder as far as it can be read: of a run that is in progress or was killed the nodes
    /// that all files of rows have, of another whole rows.
    ///
    /// # Errors
    /// [`OutputError::Io`], [`OutputError::Summary`].
    pub fn readable(mut self) -> Result<Readable, OutputError> {
        let ended = self.summary()?.status != Status::Running;
        let read = readable::readable(&self.path, &FILES[..ROWS], ended);
        let (lengths, left_out) = read.map_err(|e| at(&self.path, e))?;
        self.lengths = lengths;
        Ok(Readable { folder: self, left_out })
    }

    /// The folder at a checkpoint: files of rows are continued after the bytes that belong to it.
    #[must_use]
    pub fn at(mut self, checkpoint: &Checkpoint) -> Self {
        self.written = checkpoint.files.iter().cloned().collect();
        let lengths = self.written.iter().map(|(name, written)| (name.clone(), written.bytes));
        self.lengths = lengths.collect();
        self
    }

    /// What a file of rows has at the checkpoint of the folder; nothing without one.
    pub(super) fn written(&self, name: &str) -> Written {
        self.written.get(name).copied().unwrap_or_default()
    }

    /// Removes the checkpoints of a run that is complete: there is nothing to continue.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn remove_outdated_checkpoints(&self) -> Result<(), OutputError> {
        checkpoint::remove_outdated(&self.path)
    }

    /// A file of rows, new or continued.
    fn rows(&self, name: &str) -> io::Result<RowFile> {
        let path = self.path.join(name);
        match self.lengths.get(name) {
            Some(length) => RowFile::resume(path, *length),
            None => RowFile::create(path),
        }
    }

    /// Reads a file of rows.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn reader(&self, name: &str) -> io::Result<RowReader> {
        Ok(RowReader::from_reader(self.open_rows(name)?))
    }

    /// Reads a file of rows line by line.
    fn lines(&self, name: &str) -> io::Result<Lines> {
        Lines::new(self.open_rows(name)?)
    }

    /// The readable part of a file of rows.
    fn open_rows(&self, name: &str) -> io::Result<Take<File>> {
        readable::open(&self.path.join(name), self.lengths.get(name).copied())
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The default folder of a model file for a purpose: `pendulum-out` for `…/pendulum.toml` and
    /// `out`.
    #[must_use]
    pub fn default_for(model: &Path, purpose: &str) -> PathBuf {
        let stem = model.file_stem().filter(|s| !s.is_empty());
        let mut name = stem.unwrap_or_else(|| "model".as_ref()).to_owned();
        name.push("-");
        name.push(purpose);
        PathBuf::from(name)
    }

    /// Begins `trajectory.csv` and `residuals.csv`, the latter of equilibria with a column
    /// `unstable`.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn trajectory(
        &self,
        members: &[Member],
        columns: &[Columns],
        is_static: bool,
    ) -> Result<TrajectoryWriter<RowFile>, OutputError> {
        let open = |name: &str| self.rows(name).map_err(|e| at(&self.path.join(name), e));
        let files = [open("trajectory.csv")?, open("residuals.csv")?];
        TrajectoryWriter::new(files, members, columns, is_static).map_err(|e| at(&self.path, e))
    }

    /// Begins `sensors.csv`; `None` without sensors.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn sensors(
        &self,
        columns: &[SensorColumn],
    ) -> Result<Option<SensorWriter<RowFile>>, OutputError> {
        if columns.is_empty() {
            return Ok(None);
        }
        let writer = self.rows("sensors.csv").and_then(|file| SensorWriter::new(file, columns));
        writer.map(Some).map_err(|e| at(&self.path.join("sensors.csv"), e))
    }

    /// Begins `beams.csv`; `None` without beams.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn beams(&self, beams: &Beams) -> Result<Option<BeamWriter<RowFile>>, OutputError> {
        if beams.list.is_empty() {
            return Ok(None);
        }
        let writer = self.rows("beams.csv").and_then(|file| BeamWriter::new(file, beams));
        writer.map(Some).map_err(|e| at(&self.path.join("beams.csv"), e))
    }

    /// Begins `momenta.csv`; `None` where nobody asks for momenta.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn momenta(
        &self,
        names: Option<&MomentaNames>,
    ) -> Result<Option<MomentaWriter<RowFile>>, OutputError> {
        let Some(names) = names else { return Ok(None) };
        let writer = self.rows("momenta.csv").and_then(|file| MomentaWriter::new(file, names));
        writer.map(Some).map_err(|e| at(&self.path.join("momenta.csv"), e))
    }

    /// Begins `energy.csv`; `None` without columns.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn energies(
        &self,
        columns: &[String],
    ) -> Result<Option<EnergyWriter<RowFile>>, OutputError> {
        if columns.is_empty() {
            return Ok(None);
        }
        let writer = self.rows("energy.csv").and_then(|file| EnergyWriter::new(file, columns));
        writer.map(Some).map_err(|e| at(&self.path.join("energy.csv"), e))
    }

    /// Begins `events.csv`.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn events(&self) -> Result<EventWriter<RowFile>, OutputError> {
        let writer = self.rows(EVENTS).and_then(EventWriter::new);
        writer.map_err(|e| at(&self.path.join(EVENTS), e))
    }

    /// Begins `contacts.csv`; `origins`: the elements with impulses of the model.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn contacts(
        &self,
        origins: &[ContactOrigin],
    ) -> Result<ContactWriter<RowFile>, OutputError> {
        let writer = self.rows(CONTACTS).and_then(|file| ContactWriter::new(file, origins));
        writer.map_err(|e| at(&self.path.join(CONTACTS), e))
    }

    /// Reads `contacts.csv`; empty where the run has none.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn read_contacts(&self) -> Result<Vec<ContactRow>, OutputError> {
        let path = self.path.join(CONTACTS);
        if !path.exists() {
            return Ok(Vec::new());
        }
        self.open_rows(CONTACTS).and_then(contacts::read).map_err(|e| at(&path, e))
    }

    /// Reads `events.csv`; empty where the run has none.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn read_events(&self) -> Result<Vec<EventRecord>, OutputError> {
        let path = self.path.join(EVENTS);
        if !path.exists() {
            return Ok(Vec::new());
        }
        self.open_rows(EVENTS).and_then(events::read).map_err(|e| at(&path, e))
    }

    /// Reads `sensors.csv`; `None` when the run has none.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn read_sensors(&self) -> Result<Option<TimeSeries>, OutputError> {
        self.time_series("sensors.csv")
    }

    /// Reads `energy.csv`; `None` when the run has none.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn read_energies(&self) -> Result<Option<TimeSeries>, OutputError> {
        self.time_series("energy.csv")
    }

    fn time_series(&self, name: &str) -> Result<Option<TimeSeries>, OutputError> {
        let path = self.path.join(name);
        if !path.exists() {
            return Ok(None);
        }
        let read = self.lines(name).and_then(TimeSeries::read);
        read.map(Some).map_err(|e| at(&path, e))
    }

    /// Writes a file as a whole: a reader sees the old one or the new one, never a part.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn write(&self, name: &str, content: &str) -> Result<PathBuf, OutputError> {
        let path = self.path.join(name);
        write_atomically(&path, content.as_bytes()).map_err(|e| at(&path, e))?;
        Ok(path)
    }

    /// Writes a picture as a whole; one that this program did not draw stays.
    ///
    /// # Errors
    /// [`OutputError::Foreign`], [`OutputError::Io`].
    pub fn write_picture(&self, name: &str, svg: &str) -> Result<PathBuf, OutputError> {
        pictures::write(self.path.join(name), svg)
    }

    /// Removes pictures of an earlier drawing from `plots`: those of this program that are not in
    /// `drawn`.
    ///
    /// # Errors
    /// [`OutputError::Foreign`], [`OutputError::Io`].
    pub fn keep_pictures(&self, drawn: &[PathBuf]) -> Result<(), OutputError> {
        pictures::remove(&self.path.join("plots"), drawn)
    }

    /// Writes `summary.json`.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn write_summary(&self, summary: &Summary) -> Result<PathBuf, OutputError> {
        let mut text = serde_json::to_string_pretty(summary)
            .map_err(|source| OutputError::Summary { path: self.path.clone(), source })?;
        text.push('\n');
        self.write("summary.json", &text)
    }

    /// Reads `summary.json`.
    ///
    /// # Errors
    /// [`OutputError::Io`], [`OutputError::Summary`].
    pub fn summary(&self) -> Result<Summary, OutputError> {
        let path = self.path.join("summary.json");
        let text = read_regular_text(&path, LARGEST).map_err(|e| at(&path, e))?;
        serde_json::from_str(&text).map_err(|source| OutputError::Summary { path, source })
    }

    /// Reads `trajectory.csv`, positions of the first `members` charted members only, and
    /// `residuals.csv`.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn read_trajectory(&self, members: usize) -> Result<Trajectory, OutputError> {
        let path = self.path.join("trajectory.csv");
        let read = || {
            let residuals = self.path.join("residuals.csv").exists();
            let residuals = residuals.then(|| self.lines("residuals.csv")).transpose()?;
            Trajectory::read(self.lines("trajectory.csv")?, residuals, members)
        };
        read().map_err(|e| at(&path, e))
    }

    /// Some rows of `trajectory.csv`, see [`Frames::read`].
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn frames(&self, numbers: usize, most: usize) -> Result<Frames, OutputError> {
        let path = self.path.join("trajectory.csv");
        let open = || self.lines("trajectory.csv");
        Frames::read(open, numbers, most).map_err(|e| at(&path, e))
    }

    /// At most `most` rows of `trajectory.csv`, read one after the other.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn frame_reader(&self, most: usize) -> Result<FrameReader, OutputError> {
        let open = || self.lines("trajectory.csv");
        FrameReader::new(open, usize::MAX, most)
            .map_err(|e| at(&self.path.join("trajectory.csv"), e))
    }

    /// Bending moments of beams in the rows of these frames, see [`Frames::bending_moments`].
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn bending_moments(
        &self,
        frames: &Frames,
    ) -> Result<BTreeMap<String, Vec<Vec<f64>>>, OutputError> {
        let read = self.lines("beams.csv").and_then(|lines| frames.bending_moments(lines));
        read.map_err(|e| at(&self.path.join("beams.csv"), e))
    }
}

/// Locks a folder for one program. `None` where folders cannot be opened (Windows).
fn lock(folder: &Path) -> Result<Option<Arc<Lock>>, OutputError> {
    let Ok(handle) = File::open(folder) else { return Ok(None) };
    Lock::take(handle, folder).map(|lock| Some(Arc::new(lock)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_folder_has_the_name_of_the_model() {
        assert_eq!(RunFolder::default_for(Path::new("a/b.toml"), "out"), Path::new("b-out"));
        assert_eq!(RunFolder::default_for(Path::new("b.c.toml"), "out"), Path::new("b.c-out"));
    }

    /// What a process that another thread starts at this moment does: it holds a copy of every
    /// handle until it has become another program.
    #[test]
    fn a_copy_of_the_handle_does_not_keep_the_folder() {
        let path = std::env::temp_dir().join(format!("holonom-lock-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        let folder = RunFolder::reopen(&path).unwrap();
        let copied = folder._lock.as_ref().map(|lock| lock.file().try_clone().unwrap());
        assert!(copied.is_none() || RunFolder::reopen(&path).is_err(), "held");
        drop(folder);
        assert!(RunFolder::reopen(&path).is_ok(), "released");
        drop(copied);
        fs::remove_dir(&path).unwrap();
    }
}
