//! Tables from files of comma-separated values.

use std::path::Path;

use crate::Model;
use crate::text::problem::{MAX_PROBLEMS, Problem, nearest};
use crate::text::read::read_regular_text;
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
            _ if !table.points.is_empty() => {
                let message = "the points of the table are stated twice".to_owned();
                Err(Problem::new("file", message).help("keep `points` or `file`"))
            }
            Err(_) => {
                let message = format!("the file `{file}` has no folder to start from");
                Err(Problem::new("file", message).help("write its path from the root, or `points`"))
            }
            Ok(path) => read(&path, table),
        };
        match points {
            Ok(points) => {
                table.points = points;
                (table.file, table.columns) = (None, None);
            }
            Err(problem) if problems.len() < MAX_PROBLEMS => problems.push((k, problem)),
            Err(_) => {}
        }
    }
    problems
}

fn read(path: &Path, table: &Table) -> Result<Vec<[f64; 2]>, Problem> {
    let file = path.display();
    let text = read_regular_text(path, MAX_BYTES).map_err(|error| {
        let message = format!("the table `{file}` cannot be read: {error}");
        Problem::new("file", message).help("its path starts in the folder of the model file")
    })?;
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
