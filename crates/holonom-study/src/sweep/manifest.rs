//! `sweep.json`, what a sweep is, and `manifest.jsonl`, the points that have ended: one line of
//! JSON for each.

use super::FILES;
use super::plan::{Plan, PointSampling, Shard, Values, Variation};
use holonom_model::{Override, open_regular, read_regular, read_regular_text};
use holonom_report::command_line;
use holonom_sim::output::{Lock, OutputError};
use serde::{Deserialize, Serialize};
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The largest file that is read, bytes.
const LARGEST: u64 = 1 << 30;

/// What a sweep is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepDescription {
    /// Text of the model file.
    pub model: String,
    /// Its meshes, as the folders of runs name them: by the hash of their content.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub meshes: Vec<String>,
    /// Values of the model that are replaced at all points.
    pub set: Vec<Override>,
    /// The points.
    pub plan: Plan,
}

impl SweepDescription {
    /// The command that makes it of the model in `model.toml`.
    #[must_use]
    pub fn command(&self) -> String {
        let Plan { variations, sampling, points, seed } = &self.plan;
        let mut arguments = vec!["sweep".to_owned(), "model.toml".to_owned()];
        for replaced in &self.set {
            arguments.extend(["--set".to_owned(), replaced.to_string()]);
        }
        for Variation { key, values } in variations {
            let values = match values {
                Values::List(values) => values.join(","),
                Values::Range { from, to } => format!("{from}:{to}"),
            };
            arguments.extend(["--vary".to_owned(), format!("{key}={values}")]);
        }
        if *sampling != PointSampling::Grid {
            let (name, points, seed) = (sampling.name(), points.to_string(), seed.to_string());
            let chosen = ["--sample", name, "-n", &points, "--seed", &seed];
            arguments.extend(chosen.map(str::to_owned));
        }
        command_line(arguments)
    }

    /// That of the sweep in a folder; `None` where there is none.
    pub(super) fn of(folder: &Path) -> Result<Option<Self>, OutputError> {
        let path = folder.join(FILES[0]);
        match read_regular_text(&path, LARGEST) {
            Ok(text) => {
                let read = serde_json::from_str(&text);
                Ok(Some(read.map_err(|source| OutputError::Summary { path, source })?))
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(source) => Err(OutputError::Io { path, source }),
        }
    }
}

/// How a point ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PointStatus {
    /// At its end time.
    Done,
    /// The run failed; what it wrote is there.
    Failed,
    /// There is no such model.
    Invalid,
}

impl PointStatus {
    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Invalid => "invalid",
        }
    }
}

/// A point that has ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EndedPoint {
    /// Its number, from 0.
    pub point: usize,
    /// Its folder, in that of the sweep.
    pub folder: String,
    /// Values of the varied keys.
    pub values: Vec<String>,
    /// How it ended.
    pub status: PointStatus,
    /// Why it failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// Elapsed time, s.
    pub wall_seconds: f64,
}

/// The file of the points of a shard.
fn name(shard: Shard) -> String {
    match shard {
        Shard::WHOLE => "manifest.jsonl".to_owned(),
        Shard { number, of } => format!("manifest-{number}-of-{of}.jsonl"),
    }
}

/// A manifest that is written, by one program at a time.
#[derive(Debug)]
pub struct Manifest {
    path: PathBuf,
    file: Lock,
}

impl Manifest {
    /// Opens or creates the manifest of a shard; a last line that is not whole is removed.
    pub(super) fn open(folder: &Path, shard: Shard) -> Result<Self, OutputError> {
        let path = folder.join(name(shard));
        let io = |source| OutputError::Io { path: path.clone(), source };
        match open_regular(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(io(error)),
            _ => {} // to append to a pipe would block
        }
        let file =
            OpenOptions::new().read(true).append(true).create(true).open(&path).map_err(io)?;
        let file = Lock::take(file, folder)?;
        let text = read_regular(&path, LARGEST).map_err(io)?;
        let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        file.file().set_len(whole as u64).map_err(io)?;
        Ok(Self { path, file })
    }

    /// Adds a point that has ended.
    ///
    /// # Errors
    /// [`OutputError`].
    pub fn push(&mut self, entry: &EndedPoint) -> Result<(), OutputError> {
        let line = serde_json::to_string(entry).unwrap_or_default() + "\n";
        let mut file = self.file.file();
        let written = file.write_all(line.as_bytes()).and_then(|()| file.sync_data());
        written.map_err(|source| OutputError::Io { path: self.path.clone(), source })
    }
}

/// The files of all shards in a folder, in the order of their names.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let io = |source| OutputError::Io { path: folder.to_owned(), source };
    let mut files: Vec<PathBuf> = Vec::new();
    for item in fs::read_dir(folder).map_err(io)? {
        let path = item.map_err(io)?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if name.starts_with("manifest") && name.ends_with(".jsonl") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// The points of all shards that have ended, in their order; of a point that ran twice the last
/// entry.
pub(super) fn entries(folder: &Path) -> Result<Vec<EndedPoint>, OutputError> {
    let io = |path: &Path, source| OutputError::Io { path: path.to_owned(), source };
    let mut entries: Vec<EndedPoint> = Vec::new();
    for path in files(folder)? {
        let text = read_regular_text(&path, LARGEST).map_err(|e| io(&path, e))?;
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        for line in whole.lines() {
            let entry = serde_json::from_str(line);
            entries
                .push(entry.map_err(|e| io(&path, io::Error::new(io::ErrorKind::InvalidData, e)))?);
        }
    }
    entries.reverse(); // of equal points the last comes first
    entries.sort_by_key(|entry| entry.point);
    entries.dedup_by_key(|entry| entry.point);
    Ok(entries)
}
