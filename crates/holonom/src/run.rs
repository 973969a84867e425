//! A whole run: simulate, write, summarise, report.

use std::io;
use std::path::PathBuf;
use std::time::Instant;

use crate::beams::Beams;
use crate::model::{Model, ModelError, Scheme};
use crate::output::{OutputError, RunFolder, Summary, SummaryBuilder};
use crate::report;
use crate::sample::{Member, MomentaNames, Sample};
use crate::sensor::Sensors;
use crate::simulation::{AssemblyReport, RunOutcome, Simulation};
use crate::statics::{StaticFacts, Statics};

/// What can be run: a motion, or a walk along equilibria.
pub trait Experiment {
    /// What the assembly found.
    fn assembly(&self) -> &AssemblyReport;
    /// The members, in the order of their coordinates.
    fn members(&self) -> &[Member];
    /// The sensors.
    fn sensors(&self) -> &Sensors;
    /// The beams.
    fn beams(&self) -> &Beams;
    /// Names of the momenta of a node; `None` where the model does not ask for them.
    fn momenta_names(&self) -> Option<MomentaNames> {
        None
    }
    /// What is worth knowing of the assembly and of the run so far.
    fn warnings(&self) -> Vec<String>;
    /// What a walk along equilibria was like; `None` for motions.
    fn statics(&self) -> Option<StaticFacts> {
        None
    }
    /// Runs to the end; `observe` gets each recorded row and may stop the run by an error;
    /// `progress(step, of)` is called now and then.
    ///
    /// # Errors
    /// Whatever `observe` returns.
    fn run(
        &mut self,
        observe: &mut dyn FnMut(&Sample) -> io::Result<()>,
        progress: &mut dyn FnMut(u64, u64),
    ) -> io::Result<RunOutcome>;
}

impl Experiment for Simulation {
    fn assembly(&self) -> &AssemblyReport {
        self.assembly()
    }
    fn members(&self) -> &[Member] {
        self.members()
    }
    fn sensors(&self) -> &Sensors {
        self.sensors()
    }
    fn beams(&self) -> &Beams {
        self.beams()
    }
    fn momenta_names(&self) -> Option<MomentaNames> {
        self.momenta_names()
    }
    fn warnings(&self) -> Vec<String> {
        self.warnings()
    }
    fn run(
        &mut self,
        observe: &mut dyn FnMut(&Sample) -> io::Result<()>,
        progress: &mut dyn FnMut(u64, u64),
    ) -> io::Result<RunOutcome> {
        Self::run(self, observe, progress)
    }
}

/// What the scheme of a model asks for: a [`Simulation`], or [`Statics`].
///
/// # Errors
/// [`ModelError`].
pub fn prepare(model: &Model) -> Result<Box<dyn Experiment>, ModelError> {
    match model.settings.scheme {
        Scheme::Static => Ok(Box::new(Statics::new(model)?)),
        _ => Ok(Box::new(Simulation::new(model)?)),
    }
}

/// What a run left behind.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The run in numbers; `status` says whether it reached its end.
    pub summary: Summary,
    /// The files it wrote.
    pub files: Vec<PathBuf>,
}

/// Runs a simulation and writes all files of the run; `progress(step, of)` is called now and then.
///
/// A run that fails leaves valid files with everything up to the failure.
///
/// # Errors
/// [`OutputError`] when a file cannot be written.
pub fn run(
    model: &Model,
    simulation: &mut dyn Experiment,
    folder: &RunFolder,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Finished, OutputError> {
    let mut files = vec![folder.write("model.toml", &model.to_toml())?];
    let mut writer = folder.trajectory(simulation.members())?;
    files.extend(["trajectory.csv", "residuals.csv"].map(|f| folder.path().join(f)));
    let mut sensors = folder.sensors(simulation.sensors().columns())?;
    files.extend(sensors.is_some().then(|| folder.path().join("sensors.csv")));
    let mut beams = folder.beams(simulation.beams())?;
    files.extend(beams.is_some().then(|| folder.path().join("beams.csv")));
    let mut momenta = folder.momenta(simulation.momenta_names().as_ref())?;
    files.extend(momenta.is_some().then(|| folder.path().join("momenta.csv")));
    let mut summary = SummaryBuilder::default();
    let begin = Instant::now();
    let mut observe = |sample: &Sample| {
        summary.record(sample);
        writer.record(sample)?;
        sensors.as_mut().map_or(Ok(()), |sensors| sensors.record(sample))?;
        beams.as_mut().map_or(Ok(()), |beams| beams.record(sample))?;
        momenta.as_mut().map_or(Ok(()), |momenta| momenta.record(sample))
    };
    let trajectory = &files[1];
    let io = |source| OutputError::Io { path: trajectory.clone(), source };
    let outcome = simulation.run(&mut observe, progress).map_err(io)?;
    writer.finish().map_err(io)?;
    sensors.map_or(Ok(()), |sensors| sensors.finish()).map_err(io)?;
    beams.map_or(Ok(()), |beams| beams.finish()).map_err(io)?;
    momenta.map_or(Ok(()), |momenta| momenta.finish()).map_err(io)?;
    let wall = begin.elapsed().as_secs_f64();
    let mut summary = summary.finish(model, simulation.assembly(), &outcome, wall);
    summary.warnings = simulation.warnings();
    summary.statics = simulation.statics();
    files.push(folder.write_summary(&summary)?);
    files.extend(report::write(folder)?);
    Ok(Finished { summary, files })
}
