//! Reactions of joints, as far as sensors measure them along the axes of space.

use holonom_model::{ReactionFrame, SensorKind};
use holonom_report::scene::parts::SceneEnd;
use holonom_sim::output::RowTable;
use holonom_sim::sensor::REACTION;
use nalgebra::Vector3;

use crate::ExportError;
use crate::look::point;
use crate::rows::{StepRows, number};
use crate::run::ShownRun;
use crate::tube::MemberPose;

/// A reaction at an instant.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct InstantReaction {
    /// The joint.
    pub(super) joint: String,
    /// Where it acts, m.
    pub(super) point: Vector3<f64>,
    /// On the child, N.
    pub(super) force: [f64; 3],
    /// On the child about the point, N·m.
    pub(super) moment: [f64; 3],
}

/// A sensor of a reaction.
struct ReactionSensor {
    joint: String,
    end: SceneEnd,
    columns: [usize; 6],
}

/// The sensors of reactions.
pub(super) struct ReactionSensors {
    file: Option<StepRows>,
    gauges: Vec<ReactionSensor>,
}

impl ReactionSensors {
    /// Those of a run.
    pub(super) fn open(run: &ShownRun<'_>) -> Result<Self, ExportError> {
        let file = StepRows::open(run.folder, RowTable::Sensors)?;
        let kind = |s: &&holonom_model::Sensor| {
            s.kind == SensorKind::Reaction && s.frame == Some(ReactionFrame::Space)
        };
        let gauge = |sensor: &holonom_model::Sensor| {
            let joint = run.look.joints.iter().find(|joint| joint.name == sensor.of);
            let member = run.model.frame(&sensor.of); // a fixed body, the end of a beam
            let held = || Some(SceneEnd { member: member? as i64, point: [0.0; 3] });
            let end = joint.map(|joint| joint.joint.child.clone()).or_else(held)?;
            let mut columns = [0; 6];
            for (part, column) in REACTION.iter().zip(&mut columns) {
                *column = file.as_ref()?.column(&format!("{}.{part}", sensor.name))?;
            }
            Some(ReactionSensor { joint: sensor.of.clone(), end, columns })
        };
        let gauges = run.model.sensors.iter().filter(kind).filter_map(gauge).collect();
        Ok(Self { file, gauges })
    }

    /// Whether there is any.
    pub(super) fn is_empty(&self) -> bool {
        self.gauges.is_empty()
    }

    /// Those that are unique at a step.
    pub(super) fn at(
        &mut self,
        step: u64,
        poses: &[MemberPose],
    ) -> Result<Vec<InstantReaction>, ExportError> {
        let Some(file) = &mut self.file else { return Ok(Vec::new()) };
        let Some(row) = file.at(step)?.into_iter().next() else { return Ok(Vec::new()) };
        let reaction = |gauge: &ReactionSensor| {
            let mut all = [0.0; 6];
            for (column, value) in gauge.columns.iter().zip(&mut all) {
                *value = number(&row, *column)?;
            }
            let [fx, fy, fz, mx, my, mz] = all;
            Some(InstantReaction {
                joint: gauge.joint.clone(),
                point: point(&gauge.end, poses),
                force: [fx, fy, fz],
                moment: [mx, my, mz],
            })
        };
        Ok(self.gauges.iter().filter_map(reaction).collect())
    }
}
