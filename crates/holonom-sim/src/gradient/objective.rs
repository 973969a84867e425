//! The objectives of a model as terms of a cost.

use crate::design::{ModelTangent, refused};
use holonom_model::{CountedAt, Model, ModelError, Objective as Stated, ObjectiveKind, SensorKind};
use nalgebra::Vector3;
use vi_control::controls::Controls;
use vi_control::objective::{
    Effort, Objective, PointComponent, Quantity, Running, StepGradient, Term, Terminal, Time,
};
use vi_core::{Configuration, Interval};
use vi_multibody::form::Form;
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::mechanism::{Attachment, Mechanism};

/// A cost, with what is no matter of the motion.
pub(crate) struct Costs {
    /// Terms of the motion.
    pub(crate) sum: Objective,
    /// `½ Σ (Δw)²/h`: weight, controls.
    of_rates: Vec<(f64, Vec<usize>)>,
    /// Joint coordinates that are read: objective, joint, freedom.
    reads: Vec<(String, usize, usize)>,
}

/// `Σ w Δθ`.
struct Work {
    coordinates: Vec<(usize, JointCoordinate)>,
}

impl Term for Work {
    fn of_step(&self, s: &Interval, w: &[f64]) -> f64 {
        self.coordinates.iter().map(|(k, own)| w[*k] * own.change(s).difference).sum()
    }
    fn add_of_step(&self, s: &Interval, w: &[f64], scale: f64, out: &mut StepGradient) {
        for (k, own) in &self.coordinates {
            out.controls[*k] += scale * own.change(s).difference;
            own.add_gradient(&s.q0, -scale * w[*k], &mut out.start);
            own.add_gradient(&s.q1, scale * w[*k], &mut out.end);
        }
    }
}

/// The distance of two points, m.
struct Distance(Form);

impl Quantity for Distance {
    fn value(&self, at: Configuration<'_>) -> f64 {
        self.0.at(at.q).norm()
    }
    fn add_slope(&self, at: Configuration<'_>, scale: f64, out: &mut [f64]) {
        let between = self.0.at(at.q);
        self.0.add_transposed(&(scale / between.norm() * between), out);
    }
    fn second(&self, at: Configuration<'_>, v: &[f64], w: &[f64]) -> f64 {
        let (between, v, w) = (self.0.at(at.q), self.0.rate(v), self.0.rate(w));
        let length = between.norm();
        let line = between / length;
        (v.dot(&w) - line.dot(&v) * line.dot(&w)) / length
    }
}

impl Costs {
    /// The objectives of these names; all where there are none.
    pub(crate) fn new(
        model: &Model,
        mechanism: &mut Mechanism,
        of: &[String],
    ) -> Result<Self, ModelError> {
        if let Some(unknown) =
            of.iter().find(|name| !model.objectives.iter().any(|own| own.name == **name))
        {
            let known: Vec<&str> = model.objectives.iter().map(|own| own.name.as_str()).collect();
            let what = format!("an objective `{unknown}`, which the model does not have");
            return Err(refused("objective", what, format!("there are: {}", known.join(", "))));
        }
        let mut costs = Self { sum: Objective::new(), of_rates: Vec::new(), reads: Vec::new() };
        let chosen = model.objectives.iter().filter(|own| of.is_empty() || of.contains(&own.name));
        for own in chosen {
            costs.add(model, mechanism, own)?;
        }
        Ok(costs)
    }

    fn add(
        &mut self,
        model: &Model,
        mechanism: &mut Mechanism,
        own: &Stated,
    ) -> Result<(), ModelError> {
        let is_of = |name: &String| own.controls.is_empty() || own.controls.contains(name);
        let places: Vec<usize> =
            (0..model.controls.len()).filter(|&k| is_of(&model.controls[k].name)).collect();
        match own.kind {
            ObjectiveKind::Effort => self.sum.add(own.weight, Box::new(Effort { of: places })),
            ObjectiveKind::Time => self.sum.add(own.weight, Box::new(Time)),
            ObjectiveKind::Rate => self.of_rates.push((own.weight, places)),
            ObjectiveKind::Work => {
                let mut coordinates = Vec::new();
                for k in places {
                    let control = &model.controls[k];
                    let joint = model.joints.iter().position(|joint| joint.name == control.joint);
                    let found =
                        joint.and_then(|joint| mechanism.coordinate(joint, control.freedom));
                    if let (Some(joint), Some(found)) = (joint, found) {
                        self.reads.push((own.name.clone(), joint, control.freedom));
                        coordinates.push((k, found));
                    }
                }
                self.sum.add(own.weight, Box::new(Work { coordinates }));
            }
            ObjectiveKind::Sensor => self.add_sensor(model, mechanism, own)?,
        }
        Ok(())
    }

    /// A sensor by its name, of one of several numbers with its part.
    fn add_sensor(
        &mut self,
        model: &Model,
        mechanism: &mut Mechanism,
        own: &Stated,
    ) -> Result<(), ModelError> {
        let key = format!("objective.{}.sensor", own.name);
        let text = own.sensor.as_deref().unwrap_or_default();
        let (name, part) =
            text.split_once('.').map_or((text, None), |(name, part)| (name, Some(part)));
        let refuse = |what: String, help: &str| Err(refused(&key, what, help));
        let Some(sensor) = model.sensors.iter().find(|sensor| sensor.name == name) else {
            return refuse(format!("a sensor `{name}`"), "add the [[sensor]]"); // checked before
        };
        let member = |name: &str| match model.frame(name) {
            Some(frame) => Attachment::Body(frame),
            None => match model.particles.iter().position(|own| own.name == name) {
                Some(k) => Attachment::Particle(k),
                None => Attachment::Ground,
            },
        };
        let point = |name: &str, components: Option<[f64; 3]>| {
            let own = Vector3::from(components.unwrap_or_default());
            let along = match (
                model.frame(name),
                model.bodies.get(model.frame(name).unwrap_or(usize::MAX)),
            ) {
                (Some(frame), Some(body)) => {
                    mechanism.description().bodies[frame].triad.tr_mul(&(body.rotation() * own))
                }
                _ => own,
            };
            mechanism.point_of(member(name), &along)
        };
        match sensor.kind {
            SensorKind::Position if sensor.seen_from.is_none() => {
                let axis = part.and_then(|part| {
                    ["x", "y", "z"].iter().position(|own| *own == part).or(part.parse().ok())
                });
                let Some(axis) = axis.filter(|axis| *axis < model.header.dimension) else {
                    let what = format!("the position `{name}`, which is several numbers");
                    return refuse(what, "write one of them, such as \"NAME.z\"");
                };
                let point = point(&sensor.of, sensor.point);
                self.count(own, PointComponent { point, axis });
            }
            SensorKind::Distance
                if model.frame(&sensor.of).is_some() || model.particle(&sensor.of).is_some() =>
            {
                let end = point(sensor.to.as_deref().unwrap_or_default(), sensor.point_to);
                let between = end.minus(&point(&sensor.of, sensor.point));
                self.count(own, Distance(between));
            }
            SensorKind::JointCoordinate => {
                let joint = model.joints.iter().position(|joint| joint.name == sensor.of);
                let freedom = part.map_or(Ok(0), str::parse::<usize>);
                let found = joint.zip(freedom.ok()).and_then(|(joint, freedom)| {
                    Some((joint, freedom, mechanism.coordinate(joint, freedom)?))
                });
                let Some((joint, freedom, found)) = found else {
                    let what = format!("`{text}`, which is no coordinate of a joint");
                    return refuse(what, "write the number of the coordinate, such as \"NAME.0\"");
                };
                self.reads.push((own.name.clone(), joint, freedom));
                self.count(own, found);
            }
            _ => {
                let what = format!("the derivative of the sensor `{name}`");
                let help = "take a position in space, a distance of points or a joint coordinate";
                return refuse(what, help);
            }
        }
        Ok(())
    }

    fn count(&mut self, own: &Stated, quantity: impl Quantity + 'static) {
        let target = own.target;
        match own.at {
            CountedAt::End => self.sum.add(own.weight, Box::new(Terminal { quantity, target })),
            CountedAt::Path => self.sum.add(own.weight, Box::new(Running { quantity, target })),
        }
    }

    /// `½ Σ (Δw)²/h`.
    pub(crate) fn rates(&self, controls: &Controls, h: f64) -> f64 {
        let square = |k: usize| -> f64 {
            controls.values().windows(2).map(|pair| (pair[1][k] - pair[0][k]).powi(2)).sum()
        };
        let term = |(weight, of): &(f64, Vec<usize>)| {
            weight * 0.5 / h * of.iter().map(|&k| square(k)).sum::<f64>()
        };
        self.of_rates.iter().map(term).sum()
    }

    /// Its derivatives by the values of each step.
    pub(crate) fn rate_slopes(&self, controls: &Controls, h: f64) -> Vec<Vec<f64>> {
        let mut out = vec![vec![0.0; controls.count()]; controls.values().len()];
        for (weight, of) in &self.of_rates {
            for &k in of {
                for (n, pair) in controls.values().windows(2).enumerate() {
                    let slope = weight / h * (pair[1][k] - pair[0][k]);
                    out[n][k] -= slope;
                    out[n + 1][k] += slope;
                }
            }
        }
        out
    }

    /// Refuses a parameter by which a joint coordinate changes that an objective reads: an angle by
    /// its axes, a length by its anchors as well.
    pub(crate) fn reads_moved(&self, model: &Model, tangent: &ModelTangent) -> Option<ModelError> {
        let moved = |(_, joint, freedom): &&(String, usize, usize)| {
            let Some(change) = tangent.numbers.joints.get(joint) else { return false };
            let angle = model.joints[*joint].pair().properties().motion.is_angle(*freedom);
            let turned = change.parent.axes.amax().max(change.child.axes.amax()) > 1e-14;
            turned || !angle
        };
        let (name, joint, _) = self.reads.iter().find(moved)?;
        let joint = &model.joints[*joint].name;
        let what = format!(
            "the derivative by `{}`, which changes the joint `{joint}` whose coordinate is measured",
            tangent.name
        );
        let help = "measure a position, or leave `parameters` out of --by";
        Some(refused(&format!("objective.{name}"), what, help))
    }
}
