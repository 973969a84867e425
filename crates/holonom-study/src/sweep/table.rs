//! All points of a sweep in one table.

use super::manifest::{self, EndedPoint, PointStatus, SweepDescription};
use super::{FILES, SweepError};
use holonom_sim::output::{OutputError, RunFolder, Summary};
use holonom_sim::sensor;
use std::collections::BTreeMap;
use std::path::Path;

/// A table: a row for each point that has ended, a column for each varied key and each result.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepTable {
    /// Name of the model.
    pub model: String,
    /// The command of the sweep, of the model in `model.toml`.
    pub command: String,
    /// The varied keys.
    pub keys: Vec<String>,
    /// Names of the results.
    pub results: Vec<String>,
    /// Their units; empty where there is none or where it is not known.
    pub units: Vec<String>,
    /// The rows, in the order of the points.
    pub rows: Vec<PointRow>,
}

/// A point.
#[derive(Clone, Debug, PartialEq)]
pub struct PointRow {
    /// Its entry in the manifest.
    pub entry: EndedPoint,
    /// Its results; `None` where it has none.
    pub results: Vec<Option<f64>>,
    /// What a page links to, a path in the folder of the sweep: the page of the run, or its
    /// summary; `None` without a run.
    pub link: Option<String>,
}

/// Collects the points that have ended, of all shards.
///
/// # Errors
/// [`SweepError`].
pub fn table(folder: &Path) -> Result<SweepTable, SweepError> {
    let description = SweepDescription::of(folder)?.ok_or_else(|| {
        let (path, source) = (folder.join(FILES[0]), std::io::ErrorKind::NotFound.into());
        OutputError::Io { path, source }
    })?;
    let mut names: Vec<String> = Vec::new();
    let mut units: BTreeMap<String, &'static str> = BTreeMap::new();
    let mut model = String::new();
    let mut found = Vec::new();
    for entry in manifest::entries(folder)? {
        let mut results = BTreeMap::new();
        if entry.status != PointStatus::Invalid {
            let run = RunFolder::open(folder.join(&entry.folder));
            let summary = run.summary()?;
            model.clone_from(&summary.model);
            if units.is_empty() {
                let columns = run.model().map(|model| sensor::columns(&model)).unwrap_or_default();
                units.extend(columns.iter().map(|column| (column.name(), column.unit)));
                units.extend(OF_SUMMARY.map(|(name, unit)| (name.to_owned(), unit)));
            }
            for (name, value) in of_summary(&summary).into_iter().chain(of_sensors(&run)?) {
                if !names.contains(&name) {
                    names.push(name.clone());
                }
                results.insert(name, value);
            }
        }
        found.push((entry, results));
    }
    let row = |(entry, results): (EndedPoint, BTreeMap<String, f64>)| PointRow {
        results: names.iter().map(|name| results.get(name).copied()).collect(),
        link: ["report.html", "summary.json"]
            .map(|file| format!("{}/{file}", entry.folder))
            .into_iter()
            .find(|path| entry.status != PointStatus::Invalid && folder.join(path).exists()),
        entry,
    };
    let rows = found.into_iter().map(row).collect();
    let command = description.command();
    let keys = description.plan.variations.into_iter().map(|variation| variation.key).collect();
    let of_sensor = |name: &str| units.get(name.rsplit_once('.')?.0);
    let unit = |name: &String| units.get(name).or_else(|| of_sensor(name)).copied();
    let units = names.iter().map(|name| unit(name).unwrap_or_default().to_owned()).collect();
    Ok(SweepTable { model, command, keys, results: names, units, rows })
}

/// Results from the summary of a run; those of sensors follow them.
const OF_SUMMARY: [(&str, &str); 10] = [
    ("steps", ""),
    ("energy.initial", "J"),
    ("energy.final", "J"),
    (ENERGY_ERROR, "J"),
    (WORK, "J"),
    (BALANCE_ERROR, "J"),
    ("momentum.linear.max_abs_drift", "kg·m/s"),
    ("momentum.angular.max_abs_drift", "kg·m²/s"),
    ("constraint_residual.position.max", ""),
    ("newton_iterations.mean", ""),
];
/// Largest energy error of a run.
pub(super) const ENERGY_ERROR: &str = "energy.max_abs_error";
/// Work done in a run.
pub(super) const WORK: &str = "energy.work";
/// What of the change of the energy no work accounts for.
pub(super) const BALANCE_ERROR: &str = "energy.balance_error";

fn of_summary(summary: &Summary) -> Vec<(String, f64)> {
    let (energy, momentum) = (&summary.energy, &summary.momentum);
    let values = [
        summary.steps as f64,
        energy.initial,
        energy.last,
        energy.max_abs_error,
        energy.work,
        energy.balance_error,
        momentum.linear.max_abs_drift,
        momentum.angular.max_abs_drift,
        summary.constraint_residual.position.max,
        summary.newton_iterations.mean,
    ];
    OF_SUMMARY.iter().map(|(name, _)| (*name).to_owned()).zip(values).collect()
}

/// Least, largest and last value of each column of the sensors.
fn of_sensors(run: &RunFolder) -> Result<Vec<(String, f64)>, OutputError> {
    let Some(sensors) = run.read_sensors()? else { return Ok(Vec::new()) };
    let of_column = |(name, values): (&String, &Vec<f64>)| {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let (least, largest) = (finite().reduce(f64::min), finite().reduce(f64::max));
        [("min", least), ("max", largest), ("last", finite().next_back())]
            .into_iter()
            .filter_map(|(what, value)| Some((format!("{name}.{what}"), value?)))
            .collect::<Vec<_>>()
    };
    Ok(sensors.columns.iter().zip(&sensors.values).flat_map(of_column).collect())
}

impl PointRow {
    /// The value of a varied key, where it is a number.
    pub(super) fn number(&self, key: usize) -> Option<f64> {
        self.entry.values[key].parse().ok()
    }
}

impl SweepTable {
    /// The results of sensors.
    pub(super) fn of_sensors(&self) -> impl Iterator<Item = usize> {
        let is_sensor =
            |result: &usize| !OF_SUMMARY.iter().any(|(name, _)| *name == self.results[*result]);
        (0..self.results.len()).filter(is_sensor)
    }

    /// As CSV: `point`, the keys, `status`, the results.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn csv(&self) -> std::io::Result<String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let head = ["point"].into_iter().chain(self.keys.iter().map(String::as_str));
        let head = head.chain(["status"]).chain(self.results.iter().map(String::as_str));
        writer.write_record(head)?;
        for PointRow { entry, results, .. } in &self.rows {
            let number = |value: &Option<f64>| match value {
                // reads back as the same number
                Some(x) if x.fract() == 0.0 && x.abs() < 1e15 => format!("{x:.0}"),
                Some(x) if x.is_finite() => format!("{x:?}"),
                _ => String::new(),
            };
            let plain = |value: &String| value.trim_matches('"').to_owned();
            let cells = [entry.point.to_string()].into_iter().chain(entry.values.iter().map(plain));
            let cells = cells.chain([entry.status.name().to_owned()]);
            writer.write_record(cells.chain(results.iter().map(number)))?;
        }
        let bytes = writer.into_inner().map_err(csv::IntoInnerError::into_error)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
}
