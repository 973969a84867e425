//! What the names of a request stand for.
//!
//! ```text
//! request  = item { "," item }
//! item     = names [ ":" name ]                 y, or y over x
//! names    = group | column | file "/" column | owner | pattern with "*"
//! ```
//! A group comes before a column of the same name. An owner stands for the coordinates of a body or
//! a point mass, or for all numbers of a sensor. A pattern stands for flags (`NAME.unique`) only
//! where it says `unique`.

use holonom_model::nearest;
use holonom_sim::output::RowTable;
use holonom_sim::output::columns::{
    self, ANGULAR_MOMENTUM, DISCRETE_ENERGY, HAMILTONIAN, LINEAR_MOMENTUM,
};
use holonom_sim::sensor;

use super::ChartRequest;
use super::columns::FileColumn;

/// Names that are offered for one that stands for nothing.
const OFFERED: usize = 4;

/// A word for several columns.
#[derive(Clone, Copy, Debug)]
pub struct WordGroup {
    /// The word.
    pub name: &'static str,
    /// What it stands for.
    pub about: &'static str,
    holds: fn(&FileColumn) -> bool,
    change: bool,
}

impl WordGroup {
    /// Whether it stands for a column, among others.
    #[must_use]
    pub fn contains(&self, column: &FileColumn) -> bool {
        (self.holds)(column)
    }
}

/// Whether it is a coordinate of a position.
fn coordinate(c: &FileColumn) -> bool {
    c.file == RowTable::Trajectory.name() && c.unit == columns::COORDINATES[0].unit
}

/// Whether it is a number of a sensor.
fn reading(c: &FileColumn) -> bool {
    c.file == RowTable::Sensors.name() && c.part() != sensor::UNIQUE
}

/// The groups.
#[must_use]
pub fn groups() -> &'static [WordGroup] {
    const fn group(
        name: &'static str,
        about: &'static str,
        holds: fn(&FileColumn) -> bool,
    ) -> WordGroup {
        WordGroup { name, about, holds, change: false }
    }
    fn within(c: &FileColumn, columns: &[columns::OutputColumn]) -> bool {
        columns.iter().any(|column| column.name == c.name)
    }
    fn motion(c: &FileColumn, columns: &[columns::OutputColumn]) -> bool {
        c.file == RowTable::Trajectory.name() && within(c, columns)
    }
    fn energy(c: &FileColumn) -> bool {
        motion(c, &[DISCRETE_ENERGY, HAMILTONIAN])
    }
    fn of_energy(c: &FileColumn, quantity: &str) -> bool {
        c.file == RowTable::Energy.name() && c.quantity == quantity
    }
    const GROUPS: &[WordGroup] = &[
        group("energy", "E and H", energy),
        WordGroup { change: true, ..group("energy_error", "changes of E and H", energy) },
        group("energies", "parts of the energy", |c| {
            of_energy(c, columns::TOTAL.quantity) && !within(c, &[columns::BALANCE])
        }),
        group("work", "work of each source", |c| of_energy(c, columns::WORK.quantity)),
        group("momentum", "linear and angular momentum", |c| {
            motion(c, &LINEAR_MOMENTUM) || motion(c, &ANGULAR_MOMENTUM)
        }),
        group("linear_momentum", "Px, Py, Pz", |c| motion(c, &LINEAR_MOMENTUM)),
        group("angular_momentum", "Lx, Ly, Lz", |c| motion(c, &ANGULAR_MOMENTUM)),
        group("residuals", "constraint residuals", |c| {
            c.file == RowTable::Residuals.name() && c.logarithmic
        }),
        group("positions", "of all bodies, nodes and point masses", coordinate),
        group("sensors", "all sensors", reading),
    ];
    GROUPS
}

/// A name that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NameError {
    /// It stands for nothing.
    #[error("there is no `{name}`{}", offer(near))]
    Unknown {
        /// The name.
        name: String,
        /// Names like it.
        near: Vec<String>,
    },
    /// Several files have a column of this name.
    #[error("`{name}` is a column of several files: {}", columns.join(", "))]
    Ambiguous {
        /// The name.
        name: String,
        /// With the names of the files.
        columns: Vec<String>,
    },
    /// The horizontal axis shows one column.
    #[error("`{name}` stands for {count} columns, the horizontal axis shows one")]
    Several {
        /// The name.
        name: String,
        /// How many.
        count: usize,
    },
}

fn offer(near: &[String]) -> String {
    let near: Vec<String> = near.iter().map(|name| format!("`{name}`")).collect();
    match near.is_empty() {
        true => String::new(),
        false => format!("; did you mean {}?", near.join(" or ")),
    }
}

/// A column over another one, by their indices; without `x` over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ColumnPair {
    pub(super) y: usize,
    pub(super) x: Option<usize>,
    pub(super) change: bool,
    pub(super) is_named: bool, // by a name of its own, not by one of several
}

/// The columns of a request, each once.
pub(super) fn resolve(
    request: &ChartRequest,
    all: &[FileColumn],
) -> Result<Vec<ColumnPair>, NameError> {
    let against = match request.against.as_deref() {
        None => None,
        Some(name) if name == columns::TIME.name => None,
        Some(name) => Some(single(name, all)?),
    };
    let mut pairs: Vec<ColumnPair> = Vec::new();
    for item in request.what.split(',').map(str::trim).filter(|item| !item.is_empty()) {
        let (FoundColumns { columns, change }, x) = pair(item, all)?;
        let (change, is_named) = (change || request.change, columns.len() == 1);
        let own = columns.into_iter().map(|y| ColumnPair { y, x: x.or(against), change, is_named });
        for pair in own {
            if !pairs.iter().any(|known| known.draws(&pair)) {
                pairs.push(pair);
            }
        }
    }
    match pairs.is_empty() {
        true => Err(unknown(&request.what, all)),
        false => Ok(pairs),
    }
}

impl ColumnPair {
    /// Whether it is the curve of another.
    fn draws(&self, other: &Self) -> bool {
        (self.y, self.x, self.change) == (other.y, other.x, other.change)
    }
}

/// Columns, and whether their changes are meant.
struct FoundColumns {
    columns: Vec<usize>,
    change: bool,
}

/// An item: names, or names over a column. A name may hold a colon itself.
fn pair(item: &str, all: &[FileColumn]) -> Result<(FoundColumns, Option<usize>), NameError> {
    let whole = several(item, all);
    if whole.is_ok() || !item.contains(':') {
        return Ok((whole?, None));
    }
    let mut first = None;
    for (at, _) in item.match_indices(':') {
        let (y, x) = (item[..at].trim(), item[at + 1..].trim());
        match several(y, all).and_then(|y| Ok((y, Some(single(x, all)?)))) {
            Ok(found) => return Ok(found),
            Err(error) => first = first.or(Some(error)),
        }
    }
    Err(first.unwrap_or_else(|| unknown(item, all)))
}

/// The one column of a name.
fn single(name: &str, all: &[FileColumn]) -> Result<usize, NameError> {
    let found = several(name, all)?.columns;
    match found.as_slice() {
        [column] => Ok(*column),
        _ => Err(NameError::Several { name: name.to_owned(), count: found.len() }),
    }
}

/// The columns of a name, at least one.
fn several(name: &str, all: &[FileColumn]) -> Result<FoundColumns, NameError> {
    let pick = |holds: &dyn Fn(&FileColumn) -> bool| -> Vec<usize> {
        (0..all.len()).filter(|&k| holds(&all[k])).collect()
    };
    if let Some(group) = groups().iter().find(|group| group.name == name) {
        let found = pick(&group.holds);
        return match found.is_empty() {
            true => Err(unknown(name, all)),
            false => Ok(FoundColumns { columns: found, change: group.change }),
        };
    }
    let exact = pick(&|c| c.name == name);
    if exact.len() > 1 {
        let columns = exact.iter().map(|&k| all[k].qualified()).collect();
        return Err(NameError::Ambiguous { name: name.to_owned(), columns });
    }
    let owner = |c: &FileColumn| c.name.rsplit_once('.').is_some_and(|(owner, _)| owner == name);
    let candidates = [
        exact,
        pick(&|c| c.qualified() == name),
        pick(&|c| owner(c) && (coordinate(c) || reading(c))),
        pick(&|c| {
            let fits = matches(name, &c.name) || matches(name, &c.qualified());
            name.contains('*')
                && fits
                && (c.part() != sensor::UNIQUE || name.contains(sensor::UNIQUE))
        }),
    ];
    match candidates.into_iter().find(|found| !found.is_empty()) {
        Some(columns) => Ok(FoundColumns { columns, change: false }),
        None => Err(unknown(name, all)),
    }
}

/// Whether a name fits a pattern in which `*` stands for any letters.
fn matches(pattern: &str, name: &str) -> bool {
    let Some((head, tail)) = pattern.split_once('*') else { return pattern == name };
    let Some(rest) = name.strip_prefix(head) else { return false };
    let starts = rest.char_indices().map(|(k, _)| k).chain([rest.len()]);
    starts.into_iter().any(|k| matches(tail, &rest[k..]))
}

fn unknown(name: &str, all: &[FileColumn]) -> NameError {
    let present = |group: &&WordGroup| all.iter().any(group.holds);
    let words = groups().iter().filter(present).map(|group| group.name);
    let words: Vec<&str> = words.chain(all.iter().map(|c| c.name.as_str())).collect();
    let mut near: Vec<String> = Vec::new();
    let long = name.chars().count() > 2; // any letter is like any other
    let best = long.then(|| nearest(name, words.iter().copied())).flatten();
    let low = name.to_lowercase();
    let within = words.iter().filter(|word| low.len() > 1 && word.to_lowercase().contains(&low));
    for word in best.into_iter().chain(within.copied()) {
        if near.len() < OFFERED && !near.iter().any(|other| other == word) {
            near.push(word.to_owned());
        }
    }
    NameError::Unknown { name: name.to_owned(), near }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(file: &'static str, name: &str, unit: &'static str) -> FileColumn {
        let logarithmic = file == "residuals";
        FileColumn { file, name: name.into(), quantity: String::new(), unit, logarithmic }
    }

    fn all() -> Vec<FileColumn> {
        vec![
            column("trajectory", "arm.x", "m"),
            column("trajectory", "arm.z", "m"),
            column("trajectory", "arm.d1x", ""),
            column("trajectory", "rod.0.z", "m"),
            column("trajectory", "E", "J"),
            column("trajectory", "H", "J"),
            column("residuals", "position", "SI"),
            column("sensors", "angle", "rad"),
            column("sensors", "rate:1", "rad/s"),
            column("sensors", "pull.fx", "N"),
            column("sensors", "pull.unique", ""),
            column("sensors", "position", "m"),
        ]
    }

    fn found(what: &str) -> Result<Vec<String>, NameError> {
        let all = all();
        let pairs = resolve(&ChartRequest { what: what.into(), ..ChartRequest::default() }, &all)?;
        let name = |pair: ColumnPair| match pair.x {
            Some(x) => format!("{} over {}", all[pair.y].name, all[x].name),
            None => all[pair.y].name.clone() + if pair.change { " changes" } else { "" },
        };
        Ok(pairs.into_iter().map(name).collect())
    }

    #[test]
    fn names_groups_owners_and_patterns() {
        for (what, expected) in [
            ("arm.x,E", vec!["arm.x", "E"]),
            ("energy_error", vec!["E changes", "H changes"]),
            ("energy,E", vec!["E", "H"]),
            ("arm", vec!["arm.x", "arm.z"]),
            ("pull", vec!["pull.fx"]),
            ("*.z", vec!["arm.z", "rod.0.z"]),
            ("residuals/position", vec!["position"]),
            ("residuals/*", vec!["position"]),
            ("*pull*", vec!["pull.fx"]),
            ("*.unique", vec!["pull.unique"]),
            ("rate:1", vec!["rate:1"]),
            ("rate:1:angle", vec!["rate:1 over angle"]),
            ("arm.z:arm.x, angle", vec!["arm.z over arm.x", "angle"]),
        ] {
            assert_eq!(found(what).unwrap(), expected, "{what}");
        }
    }

    #[test]
    fn what_stands_for_nothing_is_answered_with_names_like_it() {
        let messages: Vec<String> = ["angel", "arm.q", "position", "E:arm", "work", "zebra", ","]
            .iter()
            .map(|what| found(what).unwrap_err().to_string())
            .collect();
        insta::assert_snapshot!(messages.join("\n"));
    }
}
