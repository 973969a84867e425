//! Reactions of joints, as far as sensors measure them along the axes of space.

use std::collections::HashMap;

use holonom_model::{Model, ReactionFrame, Sensor, SensorKind};
use holonom_sim::output::TimeSeries;
use serde::Serialize;

use super::encoded;
use super::parts::{End, Parts};

/// The force of a joint on its child.
#[derive(Serialize)]
pub(super) struct Reaction {
    end: End,
    /// Three components at each instant, N; no numbers where they are not unique.
    forces: String,
}

/// Those of the sensors of a run, at the instants of the scene.
pub(super) fn reactions(
    parts: &Parts<'_>,
    model: &Model,
    sensors: Option<&TimeSeries>,
) -> Vec<Reaction> {
    let Some(table) = sensors else { return Vec::new() };
    let rows: HashMap<u64, usize> = table.t.iter().map(|t| t.to_bits()).zip(0..).collect();
    let times = parts.times();
    let rows: Vec<Option<usize>> = times.iter().map(|t| rows.get(&t.to_bits()).copied()).collect();
    let kind = |sensor: &&Sensor| {
        sensor.kind == SensorKind::Reaction && sensor.frame == Some(ReactionFrame::Space)
    };
    let reaction = |sensor: &Sensor| {
        let column = |part: &str| -> Option<&Vec<f64>> {
            let name = format!("{}.{part}", sensor.name);
            let k = table.columns.iter().position(|column| *column == name)?;
            Some(&table.values[k])
        };
        let [x, y, z] = [column("fx")?, column("fy")?, column("fz")?];
        let at = |row: &Option<usize>| row.map_or([f64::NAN; 3], |k| [x[k], y[k], z[k]]);
        let forces = encoded(rows.iter().flat_map(at));
        Some(Reaction { end: parts.child_end(&sensor.of)?, forces })
    };
    model.sensors.iter().filter(kind).filter_map(reaction).collect()
}
