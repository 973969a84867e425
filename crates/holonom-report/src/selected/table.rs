//! Chosen columns of a run as a table in CSV.

use std::collections::BTreeSet;
use std::fmt::Write;

use holonom_sim::output::RunFolder;

use super::columns::columns;
use super::values::ColumnSamples;
use super::{ChartRequest, SelectionError, names};

/// The columns of a request, `X` before `Y` in `Y:X`, after the time; numbers are those of the
/// files, a field is empty where there is none.
///
/// # Errors
/// [`SelectionError`].
pub fn table(
    name: &str,
    folder: &RunFolder,
    request: &ChartRequest,
) -> Result<String, SelectionError> {
    let all = columns(folder)?;
    let chosen = names::resolve(request, &all)
        .map_err(|error| SelectionError::Name { run: name.to_owned(), error })?;
    let mut order: Vec<(usize, bool)> = Vec::new(); // with the change since the first node
    for pair in &chosen {
        let both = pair.x.map(|x| (x, false)).into_iter().chain([(pair.y, pair.change)]);
        order.extend(both.filter(|column| !order.contains(column)).collect::<Vec<_>>());
    }
    let wanted: BTreeSet<usize> = order.iter().map(|(column, _)| *column).collect();
    let values = ColumnSamples::read(folder, &all, &wanted)?;
    let mut text = String::from("t");
    for &(column, change) in &order {
        let own = &all[column].name;
        let shared = wanted.iter().filter(|k| all[**k].name == *own).count() > 1;
        let name = if shared { all[column].qualified() } else { own.clone() };
        let _ = write!(text, ",{}{name}", if change { "change of " } else { "" });
    }
    for (row, t) in values.t.iter().enumerate() {
        let _ = write!(text, "\n{t:?}");
        for &(column, change) in &order {
            let own = values.of(column);
            let first = own.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
            let _ = match own.get(row).filter(|value| value.is_finite()) {
                Some(value) if change => write!(text, ",{:?}", value - first),
                Some(value) => write!(text, ",{value:?}"),
                None => write!(text, ","),
            };
        }
    }
    text.push('\n');
    Ok(text)
}
