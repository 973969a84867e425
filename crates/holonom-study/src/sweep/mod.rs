//! A model at many points: keys take listed or sampled values, each point is a run with a folder of
//! its own.
//!
//! ```text
//! DIR/sweep.json        what the sweep is
//! DIR/manifest.jsonl    a line for each point that has ended
//! DIR/00000/            the folder of point 0: a run without pictures
//! DIR/sweep.csv         all points in a table, by [`table`]
//! ```
//! A point that fails does not stop the others. The same command continues a sweep that was
//! stopped. Runs do not depend on one another, so that the table is the same for any number of
//! threads and shards.

mod manifest;
mod page;
mod plan;
mod table;

pub use manifest::{EndedPoint, Manifest, PointStatus, SweepDescription};
pub use page::page;
pub use plan::{Plan, PlanError, PointSampling, Shard, Values, Variation};
pub use table::{SweepTable, table};

use holonom_model::Override;
use holonom_sim::output::{OutputError, RunFolder};
use std::collections::BTreeSet;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Files of a sweep beside the folders of its points.
const FILES: [&str; 3] = ["sweep.json", "sweep.csv", "sweep.html"];

/// Why a sweep ends early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The folder holds another sweep.
    #[error("the folder {} holds another sweep", folder.display())]
    Other {
        /// The folder.
        folder: PathBuf,
    },
}

/// A point that is to be run.
#[derive(Debug)]
pub struct SweepPoint<'a> {
    /// Its number, from 0.
    pub number: usize,
    /// Replacements of values of the model, those of all points first.
    pub overrides: &'a [Override],
    /// Its folder.
    pub folder: &'a Path,
}

/// How a point ended.
#[derive(Clone, Debug, PartialEq)]
pub struct PointEnd {
    /// How.
    pub status: PointStatus,
    /// Why it failed.
    pub message: Option<String>,
}

/// What a sweep has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SweepProgress {
    /// Points of this shard.
    pub points: usize,
    /// Points that had ended before.
    pub before: usize,
    /// Points that have ended in this call.
    pub ended: usize,
    /// Of all that have ended, those that failed.
    pub failed: usize,
}

impl SweepProgress {
    /// Whether all points have ended.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.before + self.ended == self.points
    }
}

/// A sweep in its folder.
#[derive(Debug)]
pub struct Sweep {
    description: SweepDescription,
    folder: PathBuf,
    shard: Shard,
    jobs: NonZero<usize>,
}

impl Sweep {
    /// Begins or continues a sweep in a folder, which is created if it does not exist. With `force`
    /// another sweep there is replaced.
    ///
    /// # Errors
    /// [`SweepError`].
    pub fn new(
        description: SweepDescription,
        folder: impl Into<PathBuf>,
        shard: Shard,
        force: bool,
    ) -> Result<Self, SweepError> {
        let folder = folder.into();
        let sweep = Self { description, folder, shard, jobs: NonZero::<usize>::MIN };
        match SweepDescription::of(&sweep.folder)? {
            Some(found) if found == sweep.description && !force => {}
            Some(_) if !force => return Err(SweepError::Other { folder: sweep.folder }),
            _ => sweep.begin(force)?,
        }
        Ok(sweep)
    }

    /// With so many threads.
    #[must_use]
    pub fn jobs(self, jobs: NonZero<usize>) -> Self {
        Self { jobs, ..self }
    }

    fn begin(&self, force: bool) -> Result<(), SweepError> {
        let folder = RunFolder::create_for(&self.folder, &FILES, force)?;
        for path in manifest::files(&self.folder)? {
            std::fs::remove_file(&path).map_err(|source| OutputError::Io { path, source })?;
        }
        let text = serde_json::to_string_pretty(&self.description).unwrap_or_default() + "\n";
        folder.write(FILES[0], &text)?;
        Ok(())
    }

    /// The points of all shards that have ended, in their order.
    ///
    /// # Errors
    /// [`SweepError`].
    pub fn ended(&self) -> Result<Vec<EndedPoint>, SweepError> {
        Ok(manifest::entries(&self.folder)?)
    }

    /// The manifest of its shard, which one program writes at a time.
    ///
    /// # Errors
    /// [`SweepError`].
    pub fn manifest(&self) -> Result<Manifest, SweepError> {
        Ok(Manifest::open(&self.folder, self.shard)?)
    }

    /// The folder of a point, in that of the sweep.
    #[must_use]
    pub fn name_of(number: usize) -> String {
        format!("{number:05}")
    }

    /// Runs all points of the shard that have not ended. `work` runs one; `None`: it was
    /// interrupted, and no other begins.
    ///
    /// # Errors
    /// [`SweepError`].
    pub fn run(
        &self,
        work: &(dyn Fn(&SweepPoint<'_>) -> Option<PointEnd> + Sync),
        progress: &mut (dyn FnMut(SweepProgress) + Send),
    ) -> Result<SweepProgress, SweepError> {
        let values = self.description.plan.values();
        let mut manifest = self.manifest()?;
        let before = self.ended()?;
        let own = before.iter().filter(|entry| self.shard.has(entry.point));
        let ended: BTreeSet<usize> = own.clone().map(|entry| entry.point).collect();
        let failed = own.filter(|entry| entry.status != PointStatus::Done).count();
        let mine: Vec<usize> = (0..values.len()).filter(|point| self.shard.has(*point)).collect();
        let open: Vec<usize> = mine.iter().copied().filter(|p| !ended.contains(p)).collect();
        let state = SweepProgress { points: mine.len(), before: ended.len(), ended: 0, failed };
        progress(state);
        let next = AtomicUsize::new(0);
        let shared = Mutex::new((state, &mut manifest, progress, None::<OutputError>));
        std::thread::scope(|scope| {
            for _ in 0..self.jobs.get().min(open.len()) {
                scope.spawn(|| {
                    while let Some(&number) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let entry = self.point(number, &values[number], work);
                        let Ok(mut shared) = shared.lock() else { return };
                        let (state, manifest, progress, error) = &mut *shared;
                        let Some(entry) = entry else {
                            next.store(open.len(), Ordering::Relaxed); // interrupted
                            return;
                        };
                        if let Err(failure) = manifest.push(&entry) {
                            *error = Some(failure);
                            next.store(open.len(), Ordering::Relaxed);
                            return;
                        }
                        state.ended += 1;
                        state.failed += usize::from(entry.status != PointStatus::Done);
                        progress(*state);
                    }
                });
            }
        });
        let (state, _, _, error) =
            shared.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        error.map_or(Ok(state), |error| Err(error.into()))
    }

    /// Runs a point; `None` when it was interrupted.
    fn point(
        &self,
        number: usize,
        values: &[String],
        work: &(dyn Fn(&SweepPoint<'_>) -> Option<PointEnd> + Sync),
    ) -> Option<EndedPoint> {
        let begin = Instant::now();
        let SweepDescription { set, plan, .. } = &self.description;
        let overrides: Vec<Override> = set.iter().cloned().chain(plan.overrides(values)).collect();
        let name = Self::name_of(number);
        let folder = self.folder.join(&name);
        let PointEnd { status, message } =
            work(&SweepPoint { number, overrides: &overrides, folder: &folder })?;
        let wall_seconds = begin.elapsed().as_secs_f64();
        Some(EndedPoint {
            point: number,
            folder: name,
            values: values.to_vec(),
            status,
            message,
            wall_seconds,
        })
    }
}
