//! `holonom plot`: plots and report of a run, finished or not; drawings of chosen columns of
//! several.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use holonom::report::selected::{
    ChartRequest, NamedRun, SelectionError, columns, groups, selected, table,
};
use holonom::report::{self, Style, Typeface};

use crate::arguments::{PlotArguments, PlotStyle};
use crate::failure::Failure;
use crate::folder::folder;
use crate::picture::{self, PictureFormat};
use crate::{stderr, stdout};

/// Pixels of a PNG for each px of 1/96 inch: on a page, and in print with 600 for each inch.
const PIXELS: [f64; 2] = [2.0, 6.25];

pub(crate) fn plot(arguments: &PlotArguments) -> Result<(), Failure> {
    if arguments.list {
        return list(arguments);
    }
    if let (Some(what), Some(output)) = (&arguments.what, &arguments.output) {
        return draw(arguments, what, output);
    }
    for dir in &arguments.dirs {
        for file in report::write(&folder(dir)?)? {
            stderr::line(&file.display().to_string());
        }
    }
    Ok(())
}

/// The columns of each run, one in a line: name, unit, quantity, file.
fn list(arguments: &PlotArguments) -> Result<(), Failure> {
    let mut text = String::new();
    for dir in &arguments.dirs {
        let all = columns(&folder(dir)?)?;
        if arguments.dirs.len() > 1 {
            let _ = writeln!(text, "{}", dir.display());
        }
        let present = groups().iter().filter(|group| all.iter().any(|c| group.contains(c)));
        let groups = present.map(|group| [group.name, "", group.about, "group"].map(str::to_owned));
        let own = all.iter().map(|c| {
            let file = format!("{}.csv", c.file);
            [c.name.clone(), c.unit.to_owned(), c.quantity.clone(), file]
        });
        let rows: Vec<[String; 4]> = groups.chain(own).collect();
        let width = |k: usize| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0);
        let [name, unit, quantity] = [0, 1, 2].map(width);
        for [a, b, c, d] in &rows {
            let _ = writeln!(text, "{a:name$}  {b:unit$}  {c:quantity$}  {d}");
        }
    }
    stdout::bytes(stderr::visible(&text).as_bytes())
}

/// Writes the columns as a table.
fn tabulate(
    arguments: &PlotArguments,
    request: &ChartRequest,
    output: &Path,
) -> Result<(), Failure> {
    let [dir] = arguments.dirs.as_slice() else {
        return Err(Failure::Usage {
            message: "a table has the columns of one run".into(),
            help: "name one folder, or let the file end with .svg, .pdf or .png".into(),
        });
    };
    let name = dir.display().to_string();
    let text = table(&name, &folder(dir)?, request).map_err(failure)?;
    picture::whole(output, text.as_bytes())?;
    stderr::line(&output.display().to_string());
    Ok(())
}

fn draw(arguments: &PlotArguments, what: &str, output: &Path) -> Result<(), Failure> {
    let PlotArguments { against, change, .. } = arguments;
    let request = ChartRequest { what: what.to_owned(), against: against.clone(), change: *change };
    let is_table = output.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    let format = if is_table { None } else { Some(PictureFormat::of(output, &[".csv"])?) };
    Failure::unless_vacant(output, arguments.force)?;
    let Some(format) = format else { return tabulate(arguments, &request, output) };
    let labels = labels(&arguments.dirs);
    let opened = arguments.dirs.iter().map(|dir| folder(dir));
    let runs = labels.into_iter().zip(opened);
    let runs = runs.map(|(name, folder)| Ok(NamedRun { name, folder: folder? }));
    let runs: Vec<NamedRun> = runs.collect::<Result<_, Failure>>()?;
    let found = selected(&runs, &request).map_err(failure)?;
    found.notes.iter().for_each(|note| stderr::line(&format!("note: {note}")));
    let drawing = found.drawing(&style(arguments, found.charts.len()));
    let pixels = PIXELS[usize::from(arguments.style != PlotStyle::Report)];
    picture::write(output, &drawing, format, pixels)?;
    stderr::line(&output.display().to_string());
    Ok(())
}

/// Short names of folders; their paths where these are not different.
fn labels(dirs: &[PathBuf]) -> Vec<String> {
    let path = |dir: &PathBuf| dir.display().to_string();
    let short = |dir: &PathBuf| {
        dir.file_name().map_or_else(|| path(dir), |name| name.to_string_lossy().into_owned())
    };
    let mut different: Vec<String> = dirs.iter().map(short).collect();
    different.sort();
    different.dedup();
    let all = different.len() == dirs.len();
    dirs.iter().map(|dir| if all { short(dir) } else { path(dir) }).collect()
}

fn style(arguments: &PlotArguments, charts: usize) -> Style {
    let style = match arguments.style {
        PlotStyle::Report => Style::report(),
        PlotStyle::Paper => Style::paper(Typeface::Sans),
        PlotStyle::PaperSerif => Style::paper(Typeface::Serif),
    };
    match arguments.size {
        Some((width, height)) => style.sized(width, height),
        None => style.for_charts(charts),
    }
}

fn failure(error: SelectionError) -> Failure {
    match error {
        SelectionError::Output(error) => Failure::Output(error),
        error => Failure::Usage {
            message: error.to_string(),
            help: "`holonom plot DIR --list` lists what can be drawn".into(),
        },
    }
}
