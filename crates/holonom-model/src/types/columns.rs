//! What a run records of the members and joints.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Model, Sensor, SensorKind};

/// Characters of the name of a joint in the name of its sensor.
const LONGEST: usize = 80;

/// What `trajectory.csv` contains beside the energies and the momentum maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Columns {
    /// All coordinates: positions, and directors of bodies and nodes of beams.
    Coordinates,
    /// Positions alone. The page of the run then has no scene, and the formats of motions have
    /// nothing to export.
    Positions,
    /// The coordinates of all joints, in `sensors.csv`: a sensor for each joint that has none.
    Joints,
}

impl Columns {
    /// The usual list.
    #[must_use]
    pub fn usual() -> Vec<Self> {
        vec![Self::Coordinates]
    }
}

/// Replaces [`Columns::Joints`] by sensors.
pub(crate) fn resolve(model: &mut Model) {
    if !model.settings.columns.contains(&Columns::Joints) {
        return;
    }
    model.settings.columns.retain(|column| *column != Columns::Joints);
    let coordinates = model.sensors.iter().filter(|s| s.kind == SensorKind::JointCoordinate);
    let measured: BTreeSet<&str> = coordinates.map(|sensor| sensor.of.as_str()).collect();
    let movable = model.joints.iter().filter(|joint| joint.pair().dof() > 0);
    let joints = movable.map(|joint| &joint.name).filter(|name| !measured.contains(name.as_str()));
    let joints: Vec<String> = joints.cloned().collect();
    let names = model.names().into_iter().flat_map(|(_, names)| names);
    let mut taken: BTreeSet<String> = names.map(str::to_owned).collect();
    for joint in joints {
        let stem: String = joint.chars().take(LONGEST).collect();
        let numbers = (2..).map(|k| format!("{stem}_coordinate_{k}"));
        let mut names = std::iter::once(format!("{stem}_coordinate")).chain(numbers);
        let Some(name) = names.find(|name| !taken.contains(name)) else { continue };
        taken.insert(name.clone());
        model.sensors.push(Sensor::new(name, SensorKind::JointCoordinate, joint));
    }
}
