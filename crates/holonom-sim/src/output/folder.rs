//! The folder of a run.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::beams::BeamWriter;
use super::csv::{Trajectory, TrajectoryWriter};
use super::file::{OutputError, at, write_atomically};
use super::frames::Frames;
use super::momenta::MomentaWriter;
use super::pictures::{self, is_there};
use super::sensors::{SensorTable, SensorWriter};
use super::summary::Summary;
use crate::beams::Beams;
use crate::sample::{Member, MomentaNames};
use crate::sensor::Column;

/// Files that make a folder one of ours.
const FILES: [&str; 8] = [
    "trajectory.csv",
    "residuals.csv",
    "sensors.csv",
    "beams.csv",
    "momenta.csv",
    "summary.json",
    "model.toml",
    "report.html",
];

/// A folder with the files of one run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunFolder {
    path: PathBuf,
}

impl RunFolder {
    /// A folder for a new run; created, with its parents, if it does not exist. With `force`, the
    /// files of an earlier run are removed; pictures only where this program drew them.
    ///
    /// # Errors
    /// [`OutputError::Occupied`], [`OutputError::Foreign`], [`OutputError::Io`].
    pub fn create(path: impl Into<PathBuf>, force: bool) -> Result<Self, OutputError> {
        let path = path.into();
        pictures::check_before(&path.join("plots"))?;
        let folder = Self::create_for(path, &FILES, force)?;
        pictures::remove(&folder.path.join("plots"))?;
        Ok(folder)
    }

    /// A folder for the given files, created if it does not exist; with `force`, those that are there
    /// are removed.
    ///
    /// # Errors
    /// [`OutputError::Occupied`], [`OutputError::Io`].
    pub fn create_for(
        path: impl Into<PathBuf>,
        files: &[&str],
        force: bool,
    ) -> Result<Self, OutputError> {
        let path = path.into();
        Self::vacant(&path, files, force)?;
        fs::create_dir_all(&path).map_err(|e| at(&path, e))?;
        for file in files.iter().map(|f| path.join(f)).filter(|f| is_there(f)) {
            fs::remove_file(&file).map_err(|e| at(&file, e))?;
        }
        Ok(Self { path })
    }

    /// Whether the given files may be written to a folder: none is there, or `force` is set. Changes
    /// nothing.
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
        Self { path: path.into() }
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The default folder of a model file: `pendulum-out` for `…/pendulum.toml`.
    #[must_use]
    pub fn default_for(model: &Path) -> PathBuf {
        let stem = model.file_stem().filter(|s| !s.is_empty());
        let mut name = stem.unwrap_or_else(|| "model".as_ref()).to_owned();
        name.push("-out");
        PathBuf::from(name)
    }

    /// Begins `trajectory.csv` and `residuals.csv`.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn trajectory(&self, members: &[Member]) -> Result<TrajectoryWriter<File>, OutputError> {
        let open = |name: &str| {
            let path = self.path.join(name);
            File::create(&path).map_err(|e| at(&path, e))
        };
        let files = (open("trajectory.csv")?, open("residuals.csv")?);
        TrajectoryWriter::new(files.0, files.1, members).map_err(|e| at(&self.path, e))
    }

    /// Begins `sensors.csv`; `None` without sensors.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn sensors(&self, columns: &[Column]) -> Result<Option<SensorWriter<File>>, OutputError> {
        if columns.is_empty() {
            return Ok(None);
        }
        let path = self.path.join("sensors.csv");
        let writer = File::create(&path).and_then(|file| SensorWriter::new(file, columns));
        writer.map(Some).map_err(|e| at(&path, e))
    }

    /// Begins `beams.csv`; `None` without beams.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn beams(&self, beams: &Beams) -> Result<Option<BeamWriter<File>>, OutputError> {
        if beams.list.is_empty() {
            return Ok(None);
        }
        let path = self.path.join("beams.csv");
        let writer = File::create(&path).and_then(|file| BeamWriter::new(file, beams));
        writer.map(Some).map_err(|e| at(&path, e))
    }

    /// Begins `momenta.csv`; `None` where nobody asks for momenta.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn momenta(
        &self,
        names: Option<&MomentaNames>,
    ) -> Result<Option<MomentaWriter<File>>, OutputError> {
        let Some(names) = names else { return Ok(None) };
        let path = self.path.join("momenta.csv");
        let writer = File::create(&path).and_then(|file| MomentaWriter::new(file, names));
        writer.map(Some).map_err(|e| at(&path, e))
    }

    /// Reads `sensors.csv`; `None` when the run has none.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn read_sensors(&self) -> Result<Option<SensorTable>, OutputError> {
        let path = self.path.join("sensors.csv");
        if !path.exists() {
            return Ok(None);
        }
        SensorTable::read(&path).map(Some).map_err(|e| at(&path, e))
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
        let text = fs::read_to_string(&path).map_err(|e| at(&path, e))?;
        serde_json::from_str(&text).map_err(|source| OutputError::Summary { path, source })
    }

    /// Reads `trajectory.csv`, positions of the first `members` charted members only, and `residuals.csv`.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn read_trajectory(&self, members: usize) -> Result<Trajectory, OutputError> {
        let path = self.path.join("trajectory.csv");
        Trajectory::read(&path, &self.path.join("residuals.csv"), members).map_err(|e| at(&path, e))
    }

    /// Some rows of `trajectory.csv`, see [`Frames::read`].
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn frames(&self, numbers: usize, most: usize) -> Result<Frames, OutputError> {
        let path = self.path.join("trajectory.csv");
        Frames::read(&path, numbers, most).map_err(|e| at(&path, e))
    }

    /// The text of `model.toml`; empty when there is none.
    #[must_use]
    pub fn model_text(&self) -> String {
        fs::read_to_string(self.path.join("model.toml")).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_folder_has_the_name_of_the_model() {
        assert_eq!(RunFolder::default_for(Path::new("a/b.toml")), Path::new("b-out"));
        assert_eq!(RunFolder::default_for(Path::new("b.c.toml")), Path::new("b.c-out"));
    }
}
