//! Plots and the report page of a run, made from the files of its folder.
//!
//! | type | is |
//! |---|---|
//! | [`LineChart`], [`Drawing`] | curves with their axes; lines, areas and words as SVG, PDF, PNG |
//! | [`Scene`] | what moves on a page: motions over one another, equilibria, modes, one configuration |

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod axis;
mod chart;
mod coincidence;
mod command_line;
mod configuration_page;
mod drawing;
mod energies;
mod estimate_page;
mod facts;
mod mode_page;
mod mode_shapes;
mod optimum_facts;
mod optimum_page;
pub mod page;
mod panels;
mod picture;
mod plots;
mod response_page;
pub mod scene;
pub mod selected;
mod sensors;
mod series;
mod shapes;
mod style;

use std::path::PathBuf;

use holonom_model::{Columns, Model, Scheme};
use holonom_sim::output::{OutputError, RunFolder, TimeSeries};
use scene::Scene;
use selected::Scales;

pub use chart::{ChartAxis, LineChart, Series, Strokes};
pub use command_line::command_line;
pub use configuration_page::{Assembled, configuration_page};
pub use drawing::{Drawing, Point, Typeface};
pub use energies::energy_plots;
pub use estimate_page::{estimate_charts, estimate_page};
pub use facts::{Fact, counted, counts, facts, rounded, time};
pub use mode_page::{campbell_page, mode_page};
pub use mode_shapes::{campbell_diagram, mode_picture};
pub use optimum_facts::{optimum_counts, optimum_facts};
pub use optimum_page::{control_charts, iteration_charts, optimum_page};
pub use page::{Figure, page};
pub use picture::{Item, LabelSide, Paint, Picture, axonometric};
pub use plots::{Plot, plots, static_plots};
pub use response_page::{response_charts, response_page};
pub use sensors::{sensor_columns, sensor_plots};
pub use shapes::{caption, shapes};
pub use style::Style;

/// Most events that plots mark.
const MARKED: usize = 40;

/// Draws `plots/*.svg` and writes `report.html`; returns the files written.
///
/// # Errors
/// [`OutputError`] when the files of the run cannot be read, or these cannot be written.
pub fn write(folder: &RunFolder) -> Result<Vec<PathBuf>, OutputError> {
    let summary = folder.summary()?;
    let members = if summary.statics.is_some() { usize::MAX } else { plots::MEMBERS };
    let trajectory = folder.read_trajectory(members)?;
    let text = folder.model_text();
    let model = folder.model().ok();
    let mut plots = match summary.statics {
        Some(_) => static_plots(&trajectory),
        None => plots(&trajectory),
    };
    let energies = folder.read_energies()?;
    if let Some(energies) = &energies {
        let error = plots.iter().position(|plot| plot.name == "energy_error");
        let own = energy_plots(energies);
        // where anything does work the balance tells the error
        let worked = own.iter().any(|plot| plot.name == "balance");
        let place = error.map_or(0..0, |error| error + usize::from(!worked)..error + 1);
        plots.splice(place, own);
    }
    let sensors = folder.read_sensors()?;
    let sensors = sensors.as_ref().map(|table| (table, sensor_columns(table, model.as_ref())));
    if let Some((table, columns)) = &sensors {
        plots.extend(sensor_plots(table, columns));
    }
    if summary.statics.is_some() {
        plots.iter_mut().for_each(plots::Plot::over_load);
    }
    let sensors = sensors.as_ref().map(|(table, columns)| (*table, columns.as_slice()));
    let scales = Scales::of_run(&trajectory, energies.as_ref(), sensors);
    plots.iter_mut().for_each(|plot| plot.chart.resolution = scales.resolution(&plot.chart.y.unit));
    let mut events: Vec<f64> = folder.read_events()?.iter().map(|event| event.t).collect();
    events.dedup();
    if events.len() <= MARKED {
        let over_time = plots.iter_mut().filter(|plot| plot.chart.x == ChartAxis::time());
        over_time.for_each(|plot| plot.chart.marks.clone_from(&events));
    }
    let mut files = Vec::new();
    let mut figures = Vec::new();
    let mut draw = |name: &str, svg: &str, html: String| {
        files.push(folder.write_picture(&format!("plots/{name}.svg"), svg)?);
        figures.push(Figure { name: name.to_owned(), html });
        Ok::<(), OutputError>(())
    };
    if let Some((picture, caption)) = centre_lines(folder, model.as_ref())? {
        let name = "beams".to_owned();
        let svg = picture.svg().map_err(|reason| OutputError::Plot { name, reason })?;
        draw("beams", &svg, page::framed(&page::inline(&svg, &picture.title), &caption))?;
    }
    for plot in &plots {
        draw(&plot.name, &plot.chart.svg(), page::figure(&plot.chart, &plot.words()))?;
    }
    folder.keep_pictures(&files)?; // a drawing of fewer nodes may have had others
    let scene = model.as_ref().map(|model| scene_of(folder, model, sensors.map(|s| s.0)));
    let page = page(&summary, &trajectory, &figures, &text, &scene.unwrap_or_default());
    files.insert(0, folder.write("report.html", &page)?);
    Ok(files)
}

/// Whether the page is of the summary that the folder has. The page is the last file of
/// [`write()`]: of a run that was killed while it was drawn, it is missing or older.
#[must_use]
pub fn is_current(folder: &RunFolder) -> bool {
    let changed = |name: &str| folder.path().join(name).metadata().and_then(|file| file.modified());
    match (changed("report.html"), changed("summary.json")) {
        (Ok(page), Ok(summary)) => page >= summary,
        _ => false,
    }
}

/// The animated scene of a run as a part of another page.
///
/// # Errors
/// [`OutputError`] when the files of the run cannot be read.
pub fn scene_of_run(folder: &RunFolder) -> Result<String, OutputError> {
    let sensors = folder.read_sensors()?;
    let model = folder.model().ok();
    Ok(model.map_or_else(String::new, |model| scene_of(folder, &model, sensors.as_ref())))
}

/// The animated scene as a part of a page; empty where the files hold no motion that can be shown.
fn scene_of(folder: &RunFolder, model: &Model, sensors: Option<&TimeSeries>) -> String {
    let scene = folder.frames(scene::NUMBERS, scene::INSTANTS).ok().and_then(|frames| {
        let moments = folder.bending_moments(&frames).unwrap_or_default();
        let events = folder.read_events().unwrap_or_default();
        let contacts = folder.read_contacts().unwrap_or_default();
        Scene::with_events(model, &frames, &moments, sensors, &events, &contacts)
    });
    match scene {
        Some(scene) => scene.html(),
        None if model.settings.columns.contains(&Columns::Coordinates) => String::new(),
        None => "<p class=\"note\">No scene: the run has recorded no coordinates (<code>columns</code>).</p>\n".to_owned(),
    }
}

/// The picture of the beams of a run, with its caption.
fn centre_lines(
    folder: &RunFolder,
    model: Option<&Model>,
) -> Result<Option<(Picture, String)>, OutputError> {
    let Some(model) = model.filter(|model| !model.beams.is_empty()) else { return Ok(None) };
    let frames = folder.frames(usize::MAX, shapes::INSTANTS)?;
    let statics = model.settings.scheme == Scheme::Static;
    Ok(shapes(model, &frames).map(|picture| (picture, caption(&frames.times, statics))))
}
