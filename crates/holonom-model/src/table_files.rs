//! Tables from files of comma-separated values.

use std::path::Path;
use std::sync::Arc;

use crate::Model;
use crate::mesh::Meshes;
use crate::text::problem::{MAX_PROBLEMS, Problem, nearest};
use crate::types::table::Table;

/// The greatest size of a file, bytes.
const MAX_BYTES: u64 = 64 * 1024 * 1024;

/// Reads the files of all tables into their points. The problems have the number of the table, and
/// a key below it.
pub(crate) fn resolve(model: &mut Model) -> Vec<(usize, Problem)> {
    let Model { tables, meshes, .. } = model;
    let mut problems = Vec::new();
    for (k, table) in tables.iter_mut().enumerate() {
        let Some(file) = table.file.clone() else { continue };
        let points = match meshes.path(&file) {
            _ if !table.points.is_empty() || table.axes.is_some() => {
                let message = "the points of the table are stated twice".to_owned();
                Err(Problem::new("file", message).help("keep `points`, `axes` or `file`"))
            }
            _ if table.grid && table.columns.is_some() => {
                let message = "a grid has no headings".to_owned();
                Err(Problem::new("columns", message).help("remove `columns`, or `grid`"))
            }
            Err(_) => {
                let message = format!("the file `{file}` has no folder to start from");
                Err(Problem::new("file", message).help("write its path from the root, or `points`"))
            }
            Ok(path) if table.grid => read_grid(&path, meshes).map(|(axes, values)| {
                (table.axes, table.values, table.grid) = (Some(axes), values, false);
            }),
            Ok(path) => read(&path, meshes, table).map(|points| table.points = points),
        };
        match points {
            Ok(()) => (table.file, table.columns) = (None, None),
            Err(problem) if problems.len() < MAX_PROBLEMS => problems.push((k, problem)),
            Err(_) => {}
        }
    }
    problems
}

fn read(path: &Path, meshes: &mut Meshes, table: &Table) -> Result<Vec<[f64; 2]>, Problem> {
    let file = path.display();
    let text = text_of(path, meshes)?;
    let mut lines = text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty());
    let headings: Vec<&str> =
        lines.next().map_or(Vec::new(), |(line, _)| line.split(',').map(unquoted).collect());
    let columns = columns(&headings, table)?;
    let mut points = Vec::new();
    for (line, row) in lines {
        let cells: Vec<&str> = line.split(',').map(unquoted).collect();
        let number = |column: usize| -> Result<f64, Problem> {
            let cell = cells.get(column).copied().unwrap_or_default();
            cell.parse::<f64>().ok().filter(|number| number.is_finite()).ok_or_else(|| {
                let heading = headings[column];
                let message =
                    format!("row {row} of `{file}`: `{cell}` in column `{heading}` is no number");
                let help = match cells.len() > headings.len() {
                    true => "numbers have a decimal point, columns are separated by commas",
                    false => "write a finite number with a decimal point",
                };
                Problem::new("file", message).help(help)
            })
        };
        if cells.len() > headings.len() {
            let message = format!(
                "row {row} of `{file}` has {} columns, the headings {}",
                cells.len(),
                headings.len()
            );
            let help = "numbers have a decimal point, columns are separated by commas";
            return Err(Problem::new("file", message).help(help));
        }
        points.push([number(columns[0])?, number(columns[1])?]);
    }
    Ok(points)
}

fn text_of(path: &Path, meshes: &mut Meshes) -> Result<Arc<str>, Problem> {
    meshes.text(path, MAX_BYTES).map_err(|error| {
        let message = format!("the table `{}` cannot be read: {error}", path.display());
        Problem::new("file", message).help("its path starts in the folder of the model file")
    })
}

/// Axes and values of a grid.
type Grid = ([Vec<f64>; 2], Vec<Vec<f64>>);

/// A grid: `y` in the first line, `x` in the first column.
fn read_grid(path: &Path, meshes: &mut Meshes) -> Result<Grid, Problem> {
    let (file, text) = (path.display(), text_of(path, meshes)?);
    let numbers = |row: usize, cells: &mut dyn Iterator<Item = &str>| {
        let number = |(column, cell): (usize, &str)| -> Result<f64, Problem> {
            let cell = unquoted(cell);
            cell.parse::<f64>().ok().filter(|number| number.is_finite()).ok_or_else(|| {
                let message = format!(
                    "row {row} of `{file}`: `{cell}` in column {} is no number",
                    column + 1
                );
                let help = "write finite numbers with a decimal point, separated by commas";
                Problem::new("file", message).help(help)
            })
        };
        cells.enumerate().map(number).collect::<Result<Vec<f64>, Problem>>()
    };
    let mut lines = text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty());
    let y = match lines.next() {
        Some((line, row)) => numbers(row, &mut line.split(',').skip(1))?,
        None => Vec::new(),
    };
    let (mut x, mut values) = (Vec::new(), Vec::new());
    for (line, row) in lines {
        let all = numbers(row, &mut line.split(','))?;
        let [first, rest @ ..] = &all[..] else { continue };
        x.push(*first);
        values.push(rest.to_vec());
    }
    Ok(([x, y], values))
}

fn unquoted(cell: &str) -> &str {
    cell.trim().trim_start_matches('\u{feff}').trim_matches('"')
}

/// Where the stated columns are.
fn columns(headings: &[&str], table: &Table) -> Result<[usize; 2], Problem> {
    let list = || headings.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    if headings.iter().any(|name| name.parse::<f64>().is_ok()) {
        let message =
            "the first row has numbers: it must be the headings of the columns".to_owned();
        return Err(Problem::new("file", message).help("write a first line such as speed,torque"));
    }
    let Some(stated) = &table.columns else {
        return match headings.len() {
            0 | 1 => {
                let message = format!("the file has {} column(s)", headings.len());
                Err(Problem::new("file", message)
                    .help("arguments and values stand in two columns, separated by a comma"))
            }
            _ => Ok([0, 1]),
        };
    };
    let mut found = [0; 2];
    for (place, name) in found.iter_mut().zip(stated) {
        *place = headings.iter().position(|own| own == name).ok_or_else(|| {
            let problem = Problem::new("columns", format!("the file has no column `{name}`"));
            match nearest(name, headings.iter().copied()) {
                Some(best) => problem.help(format!("did you mean `{best}`?")),
                None => problem.help(format!("its columns are {}", list())),
            }
        })?;
    }
    Ok(found)
}
