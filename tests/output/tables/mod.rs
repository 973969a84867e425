//! Every column of the files of a run against values from other columns and from the model:
//! integrals and differences of rates, sums, closed forms. Defects are planted in the table as it
//! is read: a column exchanged with its neighbour, with the other sign, a row late, 0.1 % too
//! large. Each has to be seen.
#![allow(clippy::unwrap_used)] // a test

mod compliant;
mod contacts;
mod flexible;
mod laws;
mod modes;
mod optima;
mod rigid;
mod statics;
mod sweeps;

use holonom::nalgebra::{Matrix3, Rotation3, Vector3};
use holonom::output::RunFolder;
use holonom::run::{RunControl, prepare, run_with};
use holonom::{Model, Summary};
use std::collections::BTreeMap;

pub(crate) type Vector = Vector3<f64>;

/// The tables of a run.
pub(crate) struct Tables {
    files: BTreeMap<String, Table>,
    pub(crate) h: f64,
    pub(crate) summary: Option<Summary>,
}

/// A table by columns; an empty field is not a number, and neither is a name.
struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

/// What a column has to be, where that is known, and how well.
pub(crate) struct Known {
    pub(crate) values: Vec<f64>,
    pub(crate) tolerance: f64,
}

impl Known {
    pub(crate) fn new(values: Vec<f64>, tolerance: f64) -> Self {
        Self { values, tolerance }
    }

    /// How far a column is off, in tolerances.
    fn off(&self, found: &[f64]) -> f64 {
        let known = self.values.iter().zip(found).filter(|(value, _)| !value.is_nan());
        assert!(2 * known.clone().count() > found.len(), "known at fewer than half of the rows");
        let off = known.map(|(value, found)| (found - value).abs() / self.tolerance);
        off.fold(0.0, |a: f64, b| if b.is_nan() { f64::INFINITY } else { a.max(b) })
    }
}

impl Tables {
    /// Runs a model and reads its files.
    pub(crate) fn of(name: &str, text: &str) -> Self {
        let model = Model::from_toml(text).unwrap();
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("tables").join(name);
        let folder = RunFolder::create(&path, true).unwrap();
        let mut experiment = prepare(&model).unwrap();
        let control = RunControl {
            progress: &mut |_, _| {},
            notice: &mut |_| {},
            interrupted: &mut || false,
            checkpoint_every: None,
            report: false,
            command: None,
        };
        let done = run_with(&model, experiment.as_mut(), &folder, control).unwrap();
        let mut files = BTreeMap::new();
        for entry in std::fs::read_dir(&path).unwrap() {
            let file = entry.unwrap().path();
            if file.extension().is_some_and(|extension| extension == "csv") {
                let name = file.file_stem().unwrap().to_string_lossy().into_owned();
                files.insert(name, Table::read(&std::fs::read_to_string(&file).unwrap()));
            }
        }
        Self { files, h: model.settings.step, summary: Some(done.summary) }
    }

    /// A table alone.
    pub(crate) fn alone(name: &str, text: &str) -> Self {
        let files = [(name.to_owned(), Table::read(text))].into();
        Self { files, h: f64::NAN, summary: None }
    }

    /// Keeps these tables alone.
    pub(crate) fn keep(&mut self, names: &[&str]) {
        self.files.retain(|name, _| names.contains(&name.as_str()));
    }

    pub(crate) fn find(&self, name: &str) -> Option<&[f64]> {
        let (file, column) = name.split_once('/').unwrap();
        let table = self.files.get(file)?;
        let k = table.names.iter().position(|own| own == column)?;
        Some(&table.columns[k])
    }

    /// A column: `energy/total`.
    pub(crate) fn column(&self, name: &str) -> &[f64] {
        self.find(name).unwrap_or_else(|| panic!("no column {name}"))
    }

    /// `NAME.x`, `NAME.y`, `NAME.z` at each row; of a director `NAME.d1x`, …
    pub(crate) fn vectors(&self, name: &str) -> Vec<Vector> {
        let dot = if [".d1", ".d2", ".d3"].iter().any(|d| name.ends_with(d)) { "" } else { "." };
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.column(&format!("{name}{dot}{axis}")));
        (0..x.len()).map(|k| Vector::new(x[k], y[k], z[k])).collect()
    }

    /// Directors of a member as columns.
    pub(crate) fn directors(&self, member: &str) -> Vec<Matrix3<f64>> {
        let d = |i: usize, axis: &str| self.column(&format!("trajectory/{member}.d{i}{axis}"));
        let columns: Vec<&[f64]> =
            (1..4).flat_map(|i| ["x", "y", "z"].map(|axis| d(i, axis))).collect();
        (0..columns[0].len()).map(|k| Matrix3::from_fn(|i, j| columns[3 * j + i][k])).collect()
    }

    pub(crate) fn rows(&self) -> usize {
        self.column("trajectory/step").len()
    }

    /// A first value, and the trapezoidal sum of the rate.
    pub(crate) fn integral(&self, first: f64, rate: &[f64]) -> Vec<f64> {
        let mut sum = first;
        let steps = rate.windows(2).map(|pair| {
            sum += 0.5 * self.h * (pair[0] + pair[1]);
            sum
        });
        std::iter::once(first).chain(steps.collect::<Vec<_>>()).collect()
    }

    /// Central differences; unknown at the ends.
    pub(crate) fn difference(&self, of: &[f64]) -> Vec<f64> {
        let inner = of.windows(3).map(|three| (three[2] - three[0]) / (2.0 * self.h));
        let end = || std::iter::once(f64::NAN);
        end().chain(inner).chain(end()).collect()
    }

    /// Rotations that begin with one and follow an angular velocity.
    pub(crate) fn rotations(&self, first: Matrix3<f64>, spin: &[Vector]) -> Vec<Matrix3<f64>> {
        let mut rotation = first;
        let steps = spin.windows(2).map(|pair| {
            let turn = Rotation3::new(0.5 * self.h * (pair[0] + pair[1]));
            rotation = turn.matrix() * rotation;
            rotation
        });
        std::iter::once(first).chain(steps.collect::<Vec<_>>()).collect()
    }
}

impl Table {
    fn read(text: &str) -> Self {
        let mut lines = text.lines();
        let names: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
        let mut columns = vec![Vec::new(); names.len()];
        for line in lines {
            line.split(',')
                .zip(&mut columns)
                .for_each(|(field, column)| column.push(field.parse().unwrap_or(f64::NAN)));
        }
        Self { names, columns }
    }
}

/// The entry of a vector that a column ends with.
pub(crate) fn axis(column: &str) -> usize {
    "xyz".find(column.chars().last().unwrap()).unwrap()
}

/// Checks all columns of all tables against what `expected` knows of them, and that each defect is
/// seen but for `unseen`, a list of the begin of `FILE/COLUMN DEFECT` with reasons.
pub(crate) fn check(
    tables: &Tables,
    expected: &dyn Fn(&Tables, &str) -> Option<Known>,
    unseen: &[(&str, &str)],
) {
    let (mut columns, mut defects, mut faults) = (0, 0, Vec::new());
    let mut used = vec![false; unseen.len()];
    for (file, table) in &tables.files {
        let name = |k: usize| format!("{file}/{}", table.names[k]);
        let known: Vec<Option<Known>> =
            (0..table.names.len()).map(|k| expected(tables, &name(k))).collect();
        for (k, found) in table.columns.iter().enumerate() {
            columns += 1;
            let mut excused = |defect: &str| {
                let full = format!("{} {defect}", name(k));
                let entry = unseen.iter().position(|(begin, _)| full.starts_with(begin));
                entry.inspect(|entry| used[*entry] = true).is_some()
            };
            let Some(own) = &known[k] else {
                if !excused("unknown") {
                    faults.push(format!("{}: nothing is known of it", name(k)));
                }
                continue;
            };
            let off = own.off(found);
            println!("{}: off by {off:.1e} tolerances", name(k));
            if off > 1.0 {
                faults.push(format!("{} is off by {off:.1e} tolerances", name(k)));
            }
            let scaled: Vec<f64> = found.iter().map(|x| 1.001 * x).collect();
            let turned: Vec<f64> = found.iter().map(|x| -x).collect();
            let late: Vec<f64> = found[..1].iter().chain(found).copied().collect();
            let mut planted = vec![("too large", scaled), ("turned", turned), ("late", late)];
            if let Some(next) = table.columns.get(k + 1) {
                planted.push(("exchanged", next.clone()));
            }
            for (defect, column) in planted {
                defects += 1;
                // the neighbour may see an exchange as well
                let next =
                    || known.get(k + 1).and_then(Option::as_ref).map_or(0.0, |n| n.off(found));
                let seen =
                    own.off(&column[..found.len()]) > 1.0 || defect == "exchanged" && next() > 1.0;
                if !seen && !excused(defect) {
                    faults.push(format!("{}: not seen where it is {defect}", name(k)));
                }
            }
        }
    }
    println!("{columns} columns, {defects} defects");
    let needless = unseen.iter().zip(used).filter(|(_, used)| !used);
    faults.extend(needless.map(|((begin, _), _)| format!("{begin}: excused without need")));
    assert!(faults.is_empty(), "{faults:#?}");
}
