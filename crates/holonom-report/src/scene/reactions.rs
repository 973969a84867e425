//! Reactions of joints, as far as sensors measure them along the axes of space; tensions of bars,
//! distances and springs.

use std::collections::HashMap;

use holonom_model::{Model, ReactionFrame, Sensor, SensorKind};
use holonom_sim::output::TimeSeries;
use holonom_sim::sensor::REACTION;
use serde::Serialize;

use super::encoded;
use super::parts::{SceneEnd, SceneLine, SceneParts};

/// The force of a joint on its child.
#[derive(Debug, Serialize)]
pub(super) struct JointReaction {
    end: SceneEnd,
    /// Three components at each instant, N; no numbers where they are not unique.
    forces: String,
}

/// The tension of a bar, a distance or a spring.
#[derive(Debug, Serialize)]
pub(super) struct AxialForce {
    line: SceneLine,
    /// At each instant, N; no number where it is not unique.
    tensions: String,
}

/// The sensors of a run at the instants of the scene.
pub(super) struct SensorReadings<'a> {
    table: &'a TimeSeries,
    rows: Vec<Option<usize>>,
}

impl<'a> SensorReadings<'a> {
    pub(super) fn new(times: &[f64], table: &'a TimeSeries) -> Self {
        let rows: HashMap<u64, usize> = table.t.iter().map(|t| t.to_bits()).zip(0..).collect();
        let rows = times.iter().map(|t| rows.get(&t.to_bits()).copied()).collect();
        Self { table, rows }
    }

    /// Columns at all instants, side by side.
    fn columns<const N: usize>(&self, names: [String; N]) -> Option<String> {
        let column = |name: &String| self.table.columns.iter().position(|column| column == name);
        let columns: Vec<usize> = names.iter().map(column).collect::<Option<_>>()?;
        let number =
            |row: Option<usize>, k: usize| row.map_or(f64::NAN, |n| self.table.values[k][n]);
        Some(encoded(self.rows.iter().flat_map(|row| columns.iter().map(|k| number(*row, *k)))))
    }

    /// Reactions of joints.
    pub(super) fn reactions(&self, parts: &SceneParts<'_>, model: &Model) -> Vec<JointReaction> {
        let kind = |sensor: &&Sensor| {
            sensor.kind == SensorKind::Reaction && sensor.frame == Some(ReactionFrame::Space)
        };
        let [fx, fy, fz, ..] = REACTION;
        let reaction = |sensor: &Sensor| {
            let forces = self.columns([fx, fy, fz].map(|f| format!("{}.{f}", sensor.name)))?;
            Some(JointReaction { end: parts.child_end(&sensor.of)?, forces })
        };
        model.sensors.iter().filter(kind).filter_map(reaction).collect()
    }

    /// Tensions of bars, distances and springs.
    pub(super) fn tensions(&self, parts: &SceneParts<'_>, model: &Model) -> Vec<AxialForce> {
        let tension = |sensor: &Sensor| {
            let (line, column) = match sensor.kind {
                SensorKind::Reaction => {
                    (parts.bar(&sensor.of)?, format!("{}.tension", sensor.name))
                }
                SensorKind::Effort => match parts.spring(&sensor.of) {
                    Some(spring) => (spring, sensor.name.clone()),
                    None => (parts.distance(&sensor.of)?, format!("{}.effort", sensor.name)),
                },
                _ => return None,
            };
            Some(AxialForce { line, tensions: self.columns([column])? })
        };
        model.sensors.iter().filter_map(tension).collect()
    }
}
