//! Measured values from a file: a line of headings, a column `t` of times, one column for each
//! `[[measurement]]`.

use holonom_model::{Model, nearest};

/// Heading of the times, s.
const TIME: &str = "t";
/// By how much a time may pass the end of the run, in steps.
const AT_END: f64 = 1e-9;

/// Why a file is no data of a model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct DataError {
    /// What is wrong, and where.
    pub message: String,
    /// What instead.
    pub help: String,
}

/// The values of a column, with their times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredColumn {
    /// Times since the start, s, increasing.
    pub times: Vec<f64>,
    /// Values, as many, in the unit of the sensor.
    pub values: Vec<f64>,
}

/// Reads the columns of the measurements of a model, in their order, from the text of a file;
/// `name`: of the file, for messages. An empty field was not measured.
///
/// # Errors
/// [`DataError`]: a column is missing or empty, a field is no number, times do not increase or are
/// not those of the run.
pub fn read(name: &str, text: &str, model: &Model) -> Result<Vec<MeasuredColumn>, DataError> {
    let mut lines = text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty());
    let headings: Vec<&str> =
        lines.next().map_or_else(Vec::new, |(line, _)| line.split(',').map(unquoted).collect());
    let place = |wanted: &str| {
        let mut all = headings.iter().enumerate().filter(|(_, own)| **own == wanted);
        match (all.next(), all.next()) {
            (Some((place, _)), None) => Ok(place),
            (Some(_), Some(_)) => {
                let message = format!("`{name}` has two columns `{wanted}`");
                Err(DataError { message, help: "keep one of them".to_owned() })
            }
            (None, _) => Err(missing(name, wanted, &headings)),
        }
    };
    let time = place(TIME)?;
    let places: Vec<usize> = model
        .measurements
        .iter()
        .map(|own| place(own.column()))
        .collect::<Result<_, DataError>>()?;
    let mut columns = vec![MeasuredColumn::default(); places.len()];
    let mut last: Option<f64> = None;
    for (line, row) in lines {
        let cells: Vec<&str> = line.split(',').map(unquoted).collect();
        if cells.len() != headings.len() {
            let (found, wanted) = (cells.len(), headings.len());
            let message =
                format!("row {row} of `{name}` has {found} fields, the headings {wanted}");
            let help = "numbers have a decimal point, fields are separated by commas";
            return Err(DataError { message, help: help.to_owned() });
        }
        let number = |place: usize| -> Result<f64, DataError> {
            let (cell, heading) = (cells[place], headings[place]);
            cell.parse::<f64>().ok().filter(|number| number.is_finite()).ok_or_else(|| {
                let message =
                    format!("row {row} of `{name}`: `{cell}` in column `{heading}` is no number");
                let help = "write a finite number, or nothing where none was measured";
                DataError { message, help: help.to_owned() }
            })
        };
        let t = number(time)?;
        in_run(name, row, t, last, model)?;
        last = Some(t);
        for (column, &place) in
            columns.iter_mut().zip(&places).filter(|(_, k)| !cells[**k].is_empty())
        {
            column.times.push(t);
            column.values.push(number(place)?);
        }
    }
    let empty = columns.iter().zip(&model.measurements).find(|(own, _)| own.values.is_empty());
    if let Some((_, own)) = empty {
        let message = format!("the column `{}` of `{name}` has no values", own.column());
        let help = "write its values in rows below the headings".to_owned();
        return Err(DataError { message, help });
    }
    Ok(columns)
}

fn unquoted(cell: &str) -> &str {
    cell.trim().trim_start_matches('\u{feff}').trim_matches('"').trim()
}

fn missing(name: &str, wanted: &str, headings: &[&str]) -> DataError {
    let message = match wanted {
        TIME => format!("`{name}` has no column `{TIME}` of times in s"),
        _ => format!("`{name}` has no column `{wanted}`"),
    };
    let list = || headings.iter().map(|own| format!("`{own}`")).collect::<Vec<_>>().join(", ");
    let help = match nearest(wanted, headings.iter().copied()) {
        _ if headings.iter().any(|own| own.parse::<f64>().is_ok()) => {
            "write the headings of the columns into the first line, such as t,angle".to_owned()
        }
        Some(best) => format!("did you mean `{best}`?"),
        None if headings.is_empty() => "the first line has the headings of the columns".to_owned(),
        None => format!("its columns are {}", list()),
    };
    DataError { message, help }
}

/// Times increase, and lie between the start and the end of the run.
fn in_run(
    name: &str,
    row: usize,
    t: f64,
    last: Option<f64>,
    model: &Model,
) -> Result<(), DataError> {
    let refused = |what: String, help: String| {
        Err(DataError { message: format!("row {row} of `{name}`: {what}"), help })
    };
    if let Some(last) = last.filter(|last| t <= *last) {
        let help = "sort the rows by time, and keep one of equal times".to_owned();
        return refused(format!("the time {t} s does not follow {last} s"), help);
    }
    if t < 0.0 {
        let help = "a run begins at t = 0: shift the times".to_owned();
        return refused(format!("the time {t} s is before the start"), help);
    }
    let (end, step) = (model.settings.end, model.settings.step);
    if t > end + AT_END * step {
        let help = format!("write end = {t} under [simulation], or leave later rows out");
        return refused(format!("the time {t} s is beyond the end of the run, {end} s"), help);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> Model {
        Model::from_toml(
            r#"
            [model]
            name = "fall"
            gravity = [0.0, 0.0, -9.81]
            [simulation]
            step = 0.1
            end = 1.0
            [[particle]]
            name = "bob"
            mass = 1.0
            position = [0.0, 0.0, 0.0]
            [[sensor]]
            name = "place"
            type = "position"
            of = "bob"
            [[measurement]]
            sensor = "place.z"
            sigma = 0.1
            [[measurement]]
            sensor = "place.x"
            column = "far"
            sigma = 0.1
            "#,
        )
        .expect("a valid model")
    }

    #[test]
    fn columns_are_found_by_their_headings() {
        let text = "\u{feff}far,\"t\", note ,place.z\r\n1,0,,2\n,0.25,x,-3e-1\n\n4.5,1.0,,\n";
        let found = read("data.csv", text, &model()).expect("data");
        assert_eq!(found[0], MeasuredColumn { times: vec![0.0, 0.25], values: vec![2.0, -0.3] });
        assert_eq!(found[1], MeasuredColumn { times: vec![0.0, 1.0], values: vec![1.0, 4.5] });
    }

    #[test]
    fn what_is_no_data_is_refused_with_its_row() {
        let cases = [
            ("", "no column `t`", "headings"),
            ("0,1,2\n0.1,1,2", "no column `t`", "headings of the columns into the first line"),
            ("time,place.z,far\n", "no column `t`", "its columns are"),
            ("t,place.z,fat\n", "no column `far`", "did you mean `fat`"),
            ("t,far,place.z,far\n", "two columns `far`", "keep one"),
            ("t,place.z,far\n", "`place.z` of `d.csv` has no values", "rows below"),
            ("t,place.z,far\n0,1,nan\n", "row 2 of `d.csv`: `nan` in column `far`", "finite"),
            ("t,place.z,far\n0,1,2\n0.1,1,inf\n", "row 3 of `d.csv`: `inf`", "finite"),
            ("t,place.z,far\n,1,2\n", "row 2 of `d.csv`: `` in column `t`", "finite"),
            ("t,place.z,far\n0,1;5,2\n", "`1;5` in column `place.z`", "finite"),
            ("t,place.z,far\n0,1,5,2\n", "has 4 fields, the headings 3", "decimal point"),
            ("t,place.z,far\n0.2,1,2\n0.2,1,2\n", "0.2 s does not follow 0.2 s", "sort"),
            ("t,place.z,far\n-0.1,1,2\n", "before the start", "shift"),
            ("t,place.z,far\n1.01,1,2\n", "beyond the end of the run, 1 s", "end = 1.01"),
        ];
        for (text, what, help) in cases {
            let error = read("d.csv", text, &model()).expect_err(text);
            assert!(error.message.contains(what), "{text:?}: {}", error.message);
            assert!(error.help.contains(help), "{text:?}: {}", error.help);
        }
    }
}
