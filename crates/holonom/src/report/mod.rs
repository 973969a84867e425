//! Plots and the report page of a run, made from the files of its folder.

mod chart;
mod facts;
mod page;
mod picture;
mod plots;
mod sensors;
mod series;

use std::path::PathBuf;

use crate::output::{OutputError, RunFolder};

pub use chart::{Axis, Chart, Curve};
pub use facts::{Fact, counts, facts};
pub use page::page;
pub use picture::{Item, Paint, Picture, Point, Side, axonometric};
pub use plots::{Plot, plots};
pub use sensors::sensor_plots;

/// Draws `plots/*.svg` and writes `report.html`; returns the files written.
///
/// # Errors
/// [`OutputError`] when the files of the run cannot be read, or these cannot be written.
pub fn write(folder: &RunFolder) -> Result<Vec<PathBuf>, OutputError> {
    let (summary, trajectory) = (folder.summary()?, folder.read_trajectory(plots::MEMBERS)?);
    let model = folder.model_text();
    let mut plots = plots(&trajectory);
    if let Some(sensors) = folder.read_sensors()? {
        plots.extend(sensor_plots(&sensors, &model));
    }
    let mut files = Vec::new();
    let mut drawn = Vec::new();
    for plot in &plots {
        let svg = plot
            .chart
            .svg()
            .map_err(|reason| OutputError::Plot { name: plot.name.clone(), reason })?;
        files.push(folder.write(&format!("plots/{}.svg", plot.name), &svg)?);
        drawn.push((plot, svg));
    }
    let page = page(&summary, &trajectory, &drawn, &model);
    files.insert(0, folder.write("report.html", &page)?);
    Ok(files)
}
