//! How large the quantities of a run are: what is small against them is round-off.

use std::collections::BTreeMap;

use holonom_sim::output::{RowTable, TimeSeries, Trajectory, columns};
use holonom_sim::sensor;

/// Changes below this part of a quantity are round-off of a long run.
const ROUND_OFF: f64 = 1e-10;

/// The largest magnitude that occurs with each unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Scales(BTreeMap<&'static str, f64>);

impl Scales {
    /// Of the columns that the plots of a run show.
    pub(crate) fn of_run(
        trajectory: &Trajectory,
        energies: Option<&TimeSeries>,
        sensors: Option<(&TimeSeries, &[sensor::SensorColumn])>,
    ) -> Self {
        let mut scales = Self::default();
        for (name, values) in trajectory.columns_read() {
            let column = RowTable::Trajectory.column(name);
            if !columns::HEAD.contains(&column) {
                scales.add_all(column.unit, values);
            }
        }
        for (name, values) in energies.iter().flat_map(|of| of.columns.iter().zip(&of.values)) {
            scales.add_all(RowTable::Energy.column(name).unit, values);
        }
        if let Some((table, columns)) = sensors {
            for (values, column) in table.values.iter().zip(columns) {
                scales.add_all(column.unit, values);
            }
        }
        scales
    }

    fn add_all(&mut self, unit: &'static str, values: &[f64]) {
        let finite = values.iter().map(|value| value.abs()).filter(|value| value.is_finite());
        finite.reduce(f64::max).into_iter().for_each(|largest| self.add(unit, largest));
    }

    /// Takes a magnitude into account.
    pub(crate) fn add(&mut self, unit: &'static str, magnitude: f64) {
        if magnitude.is_finite() {
            let scale = self.0.entry(unit).or_insert(0.0);
            *scale = scale.max(magnitude.abs());
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        other.0.iter().for_each(|(unit, scale)| self.add(unit, *scale));
    }

    fn own(&self, unit: &str) -> f64 {
        self.0.get(unit).copied().unwrap_or(0.0)
    }

    /// The largest magnitude of a unit; of moments also that of a force at the largest distance, of
    /// angles at least one.
    pub(crate) fn of(&self, unit: &str) -> f64 {
        let lever = match unit {
            "N·m" => self.own("N") * self.own("m"),
            "kg·m²/s" => self.own("kg·m/s") * self.own("m"),
            "rad" | "" => 1.0,
            _ => 0.0,
        };
        self.own(unit).max(lever)
    }

    /// Changes below are round-off.
    pub(crate) fn resolution(&self, unit: &str) -> f64 {
        ROUND_OFF * self.of(unit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_is_small_against_a_force_times_a_distance() {
        let mut scales = Scales::default();
        for (unit, magnitude) in [("N", -40.0), ("m", 2.0), ("N·m", 1e-15), ("N", f64::NAN)] {
            scales.add(unit, magnitude);
        }
        let found = ["N·m", "N", "J"].map(|unit| format!("{:?}", scales.of(unit)));
        assert_eq!(found, ["80.0", "40.0", "0.0"]);
    }
}
