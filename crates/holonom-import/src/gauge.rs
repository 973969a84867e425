//! Sensors of a description, and what they are in the model.

use holonom_model::{Formula, Sensor, SensorKind};
use nalgebra::Isometry3;

use crate::drafter::Drafter;
use crate::numbers::{quaternion, vector};
use crate::remark::Remarks;
use crate::robot::{GaugeOf, NamedFrame, RobotSensor};

/// Frames that differ by less are one, m or rad.
const SAME: f64 = 1e-12;

const OF_NOTHING: &str = "sensors of the ground, or of what is no body and no joint of one coordinate in the model: \
     not translated";

impl Drafter<'_> {
    /// The sensor of the model.
    pub(crate) fn sensor(&mut self, gauge: &RobotSensor, remarks: &mut Remarks) {
        let found = match &gauge.of {
            GaugeOf::Joint(joint) => self.of_joint(gauge.kind, joint),
            GaugeOf::Frame(frame) => self.of_frame(gauge, frame, remarks),
            GaugeOf::Tendon(tendon) => self.of_tendon(gauge.kind, tendon),
        };
        let Some(sensor) = found else {
            remarks.mention(OF_NOTHING, gauge.label.clone(), &gauge.place);
            return;
        };
        let same = |own: &&Sensor| Sensor { name: String::new(), ..(*own).clone() } == sensor;
        if gauge.kind == SensorKind::Imu && self.draft.model.sensors.iter().any(|own| same(&own)) {
            return; // accelerations and rates are columns of one
        }
        let name = self.names.unique(&gauge.name, "sensor");
        self.draft.model.sensors.push(Sensor { name, ..sensor });
    }

    fn of_joint(&self, kind: SensorKind, joint: &str) -> Option<Sensor> {
        self.single(joint).map(|of| Sensor::new(String::new(), kind, of.to_owned()))
    }

    /// The joint of the model that one of the description is, if it has one coordinate.
    pub(crate) fn single(&self, joint: &str) -> Option<&str> {
        let of = self.joints.get(joint)?;
        let own = self.draft.model.joint(of)?;
        (own.pair().coordinate_count() == 1).then_some(of)
    }

    /// The length of a tendon, or its rate.
    fn of_tendon(&self, kind: SensorKind, tendon: &str) -> Option<Sensor> {
        let [length, rate] = self.lengths.get(tendon)?;
        let value = if kind == SensorKind::Distance { length } else { rate };
        let sensor = Sensor::new(String::new(), SensorKind::Expression, String::new());
        Some(Sensor { value: Some(Formula(value.clone())), ..sensor })
    }

    /// The body that a frame belongs to, and the pose of the frame in it; of the ground in space.
    pub(crate) fn in_body(&self, frame: &NamedFrame) -> (Option<usize>, Isometry3<f64>) {
        let in_space = self.tree.pose_of(frame.link) * frame.pose;
        let node = frame.link.and_then(|link| self.tree.body_of[link]);
        match node.filter(|k| !self.tree.nodes[*k].absent) {
            Some(node) => (Some(node), self.frames[node].inverse() * in_space),
            None => (None, in_space),
        }
    }

    fn of_frame(
        &self,
        gauge: &RobotSensor,
        frame: &NamedFrame,
        remarks: &mut Remarks,
    ) -> Option<Sensor> {
        let (node, own) = self.in_body(frame);
        let node = node?;
        let turned = own.rotation.angle() > SAME;
        if turned && gauge.kind == SensorKind::Orientation {
            let message = "orientations of frames that are turned in their body: those of the body";
            remarks.mention(message, gauge.label.clone(), &gauge.place);
        }
        let away = own.translation.vector.norm() > SAME && gauge.kind.has_point();
        let axes = turned && gauge.kind == SensorKind::Imu;
        let sensor = Sensor::new(String::new(), gauge.kind, self.bodies[node].clone());
        Some(Sensor {
            point: away.then(|| vector(&own.translation.vector)),
            quaternion: axes.then(|| quaternion(&own.rotation)),
            ..sensor
        })
    }
}
