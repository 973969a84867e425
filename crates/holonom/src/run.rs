//! A whole run: simulate, write, summarise, report.

use std::path::PathBuf;
use std::time::Instant;

use holonom_model::{Model, ModelError, Scheme};
use holonom_sim::experiment::Experiment;
use holonom_sim::output::{OutputError, RunFolder, Summary, SummaryBuilder};
use holonom_sim::sample::Sample;
use holonom_sim::simulation::Simulation;
use holonom_sim::statics::Statics;

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
    files.extend(holonom_report::write(folder)?);
    Ok(Finished { summary, files })
}
