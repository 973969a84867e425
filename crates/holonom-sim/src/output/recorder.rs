//! Everything that a run writes row by row, and its summary so far.

use std::io;

use super::beams::BeamWriter;
use super::checkpoint::Checkpoint;
use super::contacts::ContactWriter;
use super::csv::TrajectoryWriter;
use super::energy::EnergyWriter;
use super::events::EventWriter;
use super::file::{OutputError, at};
use super::folder::RunFolder;
use super::momenta::MomentaWriter;
use super::row_file::RowFile;
use super::sensors::SensorWriter;
use super::summary::SummaryBuilder;
use super::written::Written;
use crate::experiment::RunnableModel;
use crate::run::run_state::RunState;
use crate::sample::Sample;

/// The files of rows of a run, open for writing.
#[derive(Debug)]
pub struct Recorder {
    folder: RunFolder,
    trajectory: TrajectoryWriter<RowFile>,
    sensors: Option<SensorWriter<RowFile>>,
    beams: Option<BeamWriter<RowFile>>,
    momenta: Option<MomentaWriter<RowFile>>,
    energies: Option<EnergyWriter<RowFile>>,
    events: Option<EventWriter<RowFile>>,
    contacts: Option<ContactWriter<RowFile>>,
    summary: SummaryBuilder,
    files: Vec<&'static str>,
    written: Vec<Written>, // of the files, at the last checkpoint
}

impl Recorder {
    /// Begins all files of a run, or continues them where the folder is [at a
    /// checkpoint](RunFolder::at).
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn new(
        folder: &RunFolder,
        experiment: &dyn RunnableModel,
        summary: SummaryBuilder,
    ) -> Result<Self, OutputError> {
        let is_static = experiment.statics().is_some();
        let trajectory =
            folder.trajectory(experiment.members(), experiment.columns(), is_static)?;
        let sensors = folder.sensors(experiment.sensors().columns())?;
        let beams = folder.beams(experiment.beams())?;
        let momenta = folder.momenta(experiment.momenta_names().as_ref())?;
        let energies = folder.energies(experiment.energy_columns())?;
        let origins = experiment.contacts();
        let acts = experiment.events().is_some() || !origins.is_empty();
        let events = acts.then(|| folder.events()).transpose()?;
        let contacts =
            experiment.writes_contacts().then(|| folder.contacts(origins)).transpose()?;
        let others = [
            (sensors.is_some(), "sensors.csv"),
            (beams.is_some(), "beams.csv"),
            (momenta.is_some(), "momenta.csv"),
            (energies.is_some(), "energy.csv"),
            (events.is_some(), "events.csv"),
            (contacts.is_some(), "contacts.csv"),
        ];
        let mut files = vec!["trajectory.csv", "residuals.csv"];
        files.extend(others.into_iter().filter(|(there, _)| *there).map(|(_, name)| name));
        let written = files.iter().map(|name| folder.written(name)).collect();
        let folder = folder.clone();
        Ok(Self {
            folder,
            trajectory,
            sensors,
            beams,
            momenta,
            energies,
            events,
            contacts,
            summary,
            files,
            written,
        })
    }

    /// Names of the files.
    #[must_use]
    pub fn files(&self) -> &[&'static str] {
        &self.files
    }

    /// The run in numbers so far.
    #[must_use]
    pub fn summary(&self) -> &SummaryBuilder {
        &self.summary
    }

    /// Takes a row.
    ///
    /// # Errors
    /// Those of the files, with the name of the file.
    pub fn record(&mut self, sample: &Sample) -> io::Result<()> {
        self.trajectory.record(sample)?;
        self.sensors.as_mut().map_or(Ok(()), |sensors| sensors.record(sample))?;
        self.beams.as_mut().map_or(Ok(()), |beams| beams.record(sample))?;
        self.momenta.as_mut().map_or(Ok(()), |momenta| momenta.record(sample))?;
        self.energies.as_mut().map_or(Ok(()), |energies| energies.record(sample))?;
        self.events.as_mut().map_or(Ok(()), |events| events.record(&sample.events))?;
        self.contacts.as_mut().map_or(Ok(()), |contacts| contacts.record(sample))?;
        self.summary.record(sample);
        Ok(())
    }

    /// Hands all rows to the files.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn flush(&mut self) -> Result<(), OutputError> {
        let mut flush = || {
            self.trajectory.flush()?;
            self.sensors.as_mut().map_or(Ok(()), SensorWriter::flush)?;
            self.beams.as_mut().map_or(Ok(()), BeamWriter::flush)?;
            self.momenta.as_mut().map_or(Ok(()), MomentaWriter::flush)?;
            self.energies.as_mut().map_or(Ok(()), EnergyWriter::flush)?;
            self.events.as_mut().map_or(Ok(()), EventWriter::flush)?;
            self.contacts.as_mut().map_or(Ok(()), ContactWriter::flush)
        };
        flush().map_err(|e| at(self.folder.path(), e))
    }

    /// The checkpoint of a run at the state of its simulation: hands all rows to the files.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn checkpoint(
        &mut self,
        run: RunState,
        every: Option<u64>,
        wall_seconds: f64,
    ) -> Result<Checkpoint, OutputError> {
        self.flush()?;
        for (name, written) in self.files.iter().zip(&mut self.written) {
            let path = self.folder.path().join(name);
            *written = written.continued(&path).map_err(|e| at(&path, e))?;
        }
        let names = self.files.iter().map(|name| (*name).to_owned());
        let files = names.zip(self.written.iter().copied()).collect();
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Ok(Checkpoint { version, every, wall_seconds, run, summary: self.summary.clone(), files })
    }
}
