//! How large the files of rows of a run will be, before it begins.

use holonom_model::{Columns, Settings};
use serde::{Deserialize, Serialize};

use super::columns::{
    CONTACT_COLUMNS, HEAD, NODE_ENERGIES, NODE_PARTS, PLACE, POSITION_NAMES, RESIDUALS, SECTION,
    TAIL,
};
use crate::experiment::RunnableModel;
use crate::system::contact_origin::{ContactOrigin, TouchingBodies};

/// Bytes of a number in a row, with its comma, on average: 17 digits where it is not round.
const NUMBER: f64 = 17.0;
/// Fields of a row of `trajectory.csv` beside the coordinates, of `residuals.csv`, of a row of
/// `beams.csv`.
const FIXED: [usize; 3] = [
    HEAD.len() + TAIL.len(),
    HEAD.len() + RESIDUALS.len(),
    HEAD.len() + PLACE.len() + SECTION.len(),
];
/// Points on which a body rests.
const POINTS: usize = 4;
/// Size from which on fewer rows are advised, bytes.
const LARGE: f64 = 2e8;

/// The rows that a run records, and the size of its files of rows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OutputSize {
    /// Recorded nodes, the initial one included.
    pub rows: u64,
    /// All files of rows together, bytes, roughly.
    pub bytes: f64,
}

impl OutputSize {
    /// Of a run to its end.
    #[must_use]
    pub fn of(experiment: &dyn RunnableModel, settings: &Settings) -> Self {
        let (steps, every) = (settings.steps(), settings.every.max(1));
        let rows = 1 + steps.div_ceil(every);
        let columns = experiment.columns();
        let recorded = |of: usize| match () {
            () if columns.contains(&Columns::Coordinates) => of,
            () if columns.contains(&Columns::Positions) => of.min(POSITION_NAMES.len()),
            () => 0,
        };
        let members = experiment.members().iter().map(|m| recorded(m.kind.columns().len()));
        let sensors = experiment.sensors().columns().len();
        let energies = experiment.energy_columns().len();
        let momenta = experiment.momenta_names().map_or(0, |names| {
            let energies = NODE_ENERGIES.len() * NODE_PARTS.len();
            let vectors = names.constraints.len() + 2 * names.coordinates.len() + names.rates.len();
            HEAD.len() + vectors + energies
        });
        let beams = experiment.beams();
        let elements = beams.list.iter().map(|beam| beams.pairs(beam).count()).sum::<usize>();
        let contacts = if experiment.writes_contacts() { contacts(experiment) } else { 0 };
        let head = |count: usize| if count > 0 { count + HEAD.len() } else { 0 };
        let numbers = members.sum::<usize>()
            + FIXED[0]
            + FIXED[1]
            + head(sensors)
            + head(energies)
            + momenta
            + contacts * (HEAD.len() + CONTACT_COLUMNS.len())
            + FIXED[2] * elements;
        Self { rows, bytes: rows as f64 * numbers as f64 * NUMBER }
    }

    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        format!("{} rows, about {}", self.rows, size(self.bytes))
    }

    /// Advises fewer rows where the files become large.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        if self.bytes <= LARGE {
            return None;
        }
        let least = self.bytes / LARGE;
        let factors = (0..).flat_map(|power| [1_u64, 2, 5].map(|k| k * 10_u64.pow(power)));
        let factor = factors.take(54).find(|factor| *factor as f64 >= least)?;
        Some(format!(
            "the tables of the run will take about {}: record fewer rows, for example with --every {factor} or `every = {factor}` \
             under [simulation]",
            size(self.bytes)
        ))
    }
}

/// Rows of `contacts.csv` of a node at most, roughly: bodies rest on few points.
fn contacts(experiment: &dyn RunnableModel) -> usize {
    let shapes = experiment.contacts().iter().filter_map(ContactOrigin::shapes);
    let points = shapes.map(|own| match &own.bodies {
        TouchingBodies::Pair { .. } => (own.sides(0).of as usize).min(POINTS),
        TouchingBodies::Group(bodies) => POINTS * bodies.len(),
    });
    points.sum::<usize>().min(POINTS * experiment.members().len())
}

/// A size in words.
fn size(bytes: f64) -> String {
    let (number, unit) = match bytes {
        b if b < 1e6 => (b / 1e3, "kB"),
        b if b < 1e9 => (b / 1e6, "MB"),
        b => (b / 1e9, "GB"),
    };
    format!("{} {unit}", crate::digits::rounded(number.max(1e-3), 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_tables_are_advised_against() {
        let of = |bytes| OutputSize { rows: 1, bytes };
        assert_eq!(of(1.9e8).warning(), None);
        assert!(of(3.35e8).warning().is_some_and(|w| w.contains("--every 2 ")));
        assert!(
            of(1.1e10)
                .warning()
                .is_some_and(|w| w.contains("about 11 GB") && w.contains("--every 100 "))
        );
        assert!(of(1e24).warning().is_some());
        assert_eq!(of(3.36e6).words(), "1 rows, about 3.4 MB");
        assert_eq!(of(640.0).words(), "1 rows, about 0.64 kB");
    }
}
