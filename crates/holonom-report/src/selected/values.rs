//! Numbers of chosen columns, read in one pass over each file.

use std::collections::{BTreeMap, BTreeSet};

use holonom_sim::output::{OutputError, RowTable, RunFolder};

use super::columns::FileColumn;
use super::nodes::{Nodes, failed};
use super::scales::Scales;

/// The numbers of some columns, and how large those of all columns of the same files are.
pub(super) struct ColumnSamples {
    pub(super) t: Vec<f64>,
    columns: BTreeMap<usize, Vec<f64>>,
    pub(super) scales: Scales,
}

impl ColumnSamples {
    /// Reads the columns with these indices among `all`. The trajectory is read in any case: for
    /// times and lengths.
    pub(super) fn read(
        folder: &RunFolder,
        all: &[FileColumn],
        wanted: &BTreeSet<usize>,
    ) -> Result<Self, OutputError> {
        let mut values = Self {
            t: Vec::new(),
            columns: wanted.iter().map(|k| (*k, Vec::new())).collect(),
            scales: Scales::default(),
        };
        for table in RowTable::ALL {
            let belongs = |column: &&FileColumn| column.file == table.name();
            let first = all.iter().position(|column| belongs(&column));
            let count = all.iter().filter(belongs).count();
            let Some(own) = first.map(|first| first..first + count) else { continue };
            let scale =
                [RowTable::Trajectory, RowTable::Energy, RowTable::Sensors].contains(&table);
            if !scale && wanted.range(own.clone()).next().is_none() {
                continue;
            }
            let mut nodes = Nodes::open(folder, table)?;
            let mut largest = vec![0.0_f64; count];
            while nodes.next().map_err(|source| failed(folder, table, source))? {
                if table == RowTable::Trajectory {
                    values.t.push(nodes.t);
                }
                nodes.numbers.resize(count, f64::NAN); // a beam may lack rows at a node
                for (largest, number) in largest.iter_mut().zip(&nodes.numbers) {
                    *largest = largest.max(number.abs()); // of a number and NaN the number
                }
                values.take(&nodes.numbers, own.start);
            }
            for (column, largest) in all[own].iter().zip(largest) {
                values.scales.add(column.unit, largest);
            }
        }
        let rows = values.t.len();
        values.columns.values_mut().for_each(|column| column.resize(rows, f64::NAN));
        Ok(values)
    }

    fn take(&mut self, numbers: &[f64], first: usize) {
        for (k, column) in self.columns.range_mut(first..first + numbers.len()) {
            column.push(numbers[k - first]);
        }
    }

    pub(super) fn of(&self, column: usize) -> &[f64] {
        self.columns.get(&column).map(Vec::as_slice).unwrap_or_default()
    }
}
