//! Masses, joints, bars and constraints by a parameter.

use super::{LEAVE_OUT, ModelTangent, NumberChain, eps, refused};
use crate::sensor::line_of;
use holonom_model::{
    Constraint, GROUND, Inertia, Joint, JointKind, ModelError, Sensor, SensorKind,
};
use nalgebra::{Matrix3, Vector3};
use vi_core::Number;
use vi_core::num_dual::Dual64;
use vi_multibody::design::{
    BarTangent, BodyTangent, JointTangent, MechanismTangent, ScalarTangent, SideTangent,
};
use vi_multibody::form::Form;
use vi_multibody::joint::{FrameId, Side, axes_along, complete_axis, complete_axis_in};

/// By how much a joint may differ from the one of the mechanism, in parts of its size.
const AGREEMENT: f64 = 1e-9;

impl NumberChain<'_> {
    /// Masses and inertia of the bodies.
    pub(super) fn bodies(&self, out: &mut MechanismTangent) {
        for (k, body) in self.stated.bodies.iter().enumerate() {
            let key = format!("body.{}", body.name);
            let shape = body.shape.as_ref().and_then(|shape| {
                let at = |i: usize| {
                    let own = shape.dimensions.get(i).copied().unwrap_or_default();
                    self.slopes.number(&format!("{key}.shape.dimensions.{i}"), own)
                };
                shape.solid_of(at)
            });
            let density = body.shape.as_ref().and_then(|shape| shape.density);
            let density =
                density.map(|own| self.slopes.number(&format!("{key}.shape.density"), own));
            let resolved = Dual64::of(self.model.bodies[k].mass());
            let mass = match (body.mass, &shape, density) {
                (Some(mass), ..) => self.slopes.number(&format!("{key}.mass"), mass),
                (None, Some(shape), Some(density)) => density * shape.volume(),
                _ => resolved,
            };
            let own = format!("{key}.inertia");
            let tensor = match (&body.inertia, &shape) {
                (Some(Inertia::Principal(moments)), _) => {
                    Matrix3::from_diagonal(&self.slopes.vector(&own, *moments))
                }
                (Some(Inertia::Tensor(rows)), _) => {
                    let row = |i: usize| self.slopes.vector(&format!("{own}.{i}"), rows[i]);
                    Matrix3::from_columns(&[row(0), row(1), row(2)]).transpose()
                }
                (None, Some(shape)) => {
                    let [a, b, c] = shape.euler_moments(mass);
                    Matrix3::from_diagonal(&Vector3::new(b + c, c + a, a + b))
                }
                (None, None) => Matrix3::zeros(),
            };
            let (mass, change) = (mass.eps, tensor.map(|x| x.eps));
            let spec = &self.system.mechanism.description().bodies[k];
            if spec.body.is_some() && (mass != 0.0 || change.amax() != 0.0) {
                let axes = self.principal(k);
                let along = axes * change * axes.transpose();
                out.bodies.insert(k, BodyTangent::of_inertia(mass, &along));
            }
        }
    }

    /// A side of a joint with its derivative.
    pub(super) fn side(
        &self,
        frame: FrameId,
        point: &Vector3<Dual64>,
        axes: &Matrix3<Dual64>,
    ) -> Side<Dual64> {
        let (center, triad) = match frame {
            FrameId::Frame(k) => self.placed(k),
            FrameId::Ground => (Vector3::zeros(), Matrix3::identity()),
        };
        Side::placed(frame, &center, &triad, point, axes)
    }

    /// How a joint at these points and axes changes; refused where it is not that of the mechanism.
    pub(super) fn change(
        &self,
        key: &str,
        joint: &vi_multibody::Joint,
        points: [Vector3<Dual64>; 2],
        axes: &Matrix3<Dual64>,
    ) -> Result<JointTangent, ModelError> {
        let mut change = JointTangent::default();
        let ends = [(&joint.parent, &mut change.parent), (&joint.child, &mut change.child)];
        for ((own, out), point) in ends.into_iter().zip(&points) {
            let dual = self.side(own.frame, point, axes);
            let anchor = (dual.anchor.map(|x| x.re) - own.anchor).amax();
            let turned = (dual.axes.map(|x| x.re) - own.axes).amax();
            if anchor > AGREEMENT * own.anchor.amax().max(1.0) || turned > AGREEMENT {
                let what = format!("the derivative by the geometry of `{}`", joint.name);
                return Err(refused(key, what, LEAVE_OUT));
            }
            *out = SideTangent { anchor: eps(&dual.anchor), axes: dual.axes.map(|x| x.eps) };
        }
        Ok(change)
    }

    /// Joints, what holds fixed bodies, rates.
    pub(super) fn joints(&self, found: &mut ModelTangent) -> Result<(), ModelError> {
        let joints = &self.system.mechanism.description().joints;
        for (k, joint) in self.stated.joints.iter().enumerate() {
            let key = format!("joint.{}", joint.name);
            let change = self.change(&key, &joints[k], self.places(joint), &self.axes(joint))?;
            if change != JointTangent::default() {
                if joint.kind == JointKind::Screw {
                    let what =
                        format!("the derivative by the geometry of the screw `{}`", joint.name);
                    return Err(refused(&key, what, LEAVE_OUT));
                }
                found.numbers.joints.insert(k, change);
            }
            let rates = joint.rate.as_ref().map_or(&[][..], |own| own.values());
            for (freedom, rate) in rates.iter().enumerate() {
                let one = matches!(joint.rate, Some(holonom_model::Rates::One(_)));
                let path =
                    if one { format!("{key}.rate") } else { format!("{key}.rate.{freedom}") };
                let slope = self.slopes.number(&path, *rate).eps;
                if slope != 0.0 {
                    found.rates.push((k, freedom, slope));
                }
            }
        }
        let fixed = self.model.bodies.iter().enumerate().filter(|(_, body)| body.fixed);
        for ((k, body), at) in fixed.zip(self.stated.joints.len()..) {
            let place = self.placed(k).0;
            let key = format!("body.{}", body.name);
            let change = self.change(&key, &joints[at], [place; 2], &Matrix3::identity())?;
            if change != JointTangent::default() {
                found.numbers.joints.insert(at, change);
            }
        }
        let fixed = self.model.bodies.iter().filter(|body| body.fixed).count();
        self.supports(self.stated.joints.len() + fixed, &mut found.numbers)
    }

    /// Where a joint sits on its parent and on its child.
    fn places(&self, joint: &Joint) -> [Vector3<Dual64>; 2] {
        let (key, base) = (format!("joint.{}", joint.name), joint.relative_to.as_deref());
        if let Some(position) = joint.position {
            let at = self.slopes.vector(&format!("{key}.position"), position);
            return [self.placements.base(base).point(at); 2];
        }
        let point = |member: &str, part: &str, anchor: Option<[f64; 3]>| {
            let anchor = self.slopes.vector(&format!("{key}.{part}"), anchor.unwrap_or_default());
            self.placements.point(member, anchor, base)
        };
        [
            point(&joint.parent, "anchor_parent", joint.anchor_parent),
            point(&joint.child, "anchor_child", joint.anchor_child),
        ]
    }

    /// The axes `m_1, m_2, n` of a joint, as the mechanism completes them.
    fn axes(&self, joint: &Joint) -> Matrix3<Dual64> {
        let key = format!("joint.{}", joint.name);
        let base = self.placements.base(joint.relative_to.as_deref()).rotation;
        let in_frame = |part: &str, axis: Option<[f64; 3]>| {
            axis.map(|axis| self.slopes.vector(&format!("{key}.{part}"), axis))
        };
        let of_frame = in_frame("axis", joint.axis);
        let axis = of_frame.map(|axis| base * axis);
        let second = in_frame("axis2", joint.axis2).map(|axis| base * axis);
        let first = in_frame("first_axis", joint.first_axis).map(|axis| base * axis);
        let motion = joint.pair().properties().motion;
        let turned = base.map(|x| x.re) != Matrix3::identity();
        let Some(axis) = axis.filter(|axis| axis.amax() != Dual64::of(0.0)) else {
            return if turned { base } else { Matrix3::identity() };
        };
        let carrier = || {
            let of = |name: &String| (name != GROUND).then(|| self.placements.frame(name).rotation);
            let found = [&joint.parent, &joint.child].into_iter().find_map(of);
            found.unwrap_or_else(Matrix3::identity)
        };
        let n = axis.normalize();
        match second.or(first) {
            Some(second) => axes_along(&axis, &second),
            None if motion.translates_across_axis() => {
                let first = complete_axis_in(&carrier(), &n).column(0).into_owned();
                axes_along(&axis, &first)
            }
            // axes that are not stated are those that it has in its frame
            None if turned => of_frame.map_or(base, |own| base * complete_axis(&own.normalize())),
            None => complete_axis(&n),
        }
    }

    /// Bars.
    pub(super) fn bars(&self, out: &mut MechanismTangent) {
        for (k, bar) in self.stated.bars.iter().enumerate() {
            let key = format!("bar.{}", bar.name);
            let [from, to] = [&bar.from, &bar.to].map(|end| {
                let held = self.held(&format!("{key}.point"), end, bar.point.as_deref());
                self.placements.point(end, held, bar.relative_to.as_deref())
            });
            let length = match bar.length {
                Some(length) => self.slopes.number(&format!("{key}.length"), length),
                None => (to - from).norm(),
            };
            let is_particle = |name: &str| self.stated.particle(name).is_some();
            let ground = match (is_particle(&bar.from), is_particle(&bar.to)) {
                (false, true) => eps(&from),
                (true, false) => eps(&to),
                _ => Vector3::zeros(),
            };
            if length.eps != 0.0 || ground.amax() != 0.0 {
                out.bars.insert(k, BarTangent { length: length.eps, ground });
            }
        }
    }

    /// The components of a point of a member; of a particle none.
    pub(super) fn held(&self, path: &str, member: &str, stated: Option<&[f64]>) -> Vector3<Dual64> {
        match self.stated.particle(member) {
            Some(_) => Vector3::zeros(),
            None => {
                let own = |i: usize| {
                    let value = stated.and_then(|own| own.get(i)).copied().unwrap_or_default();
                    self.slopes.number(&format!("{path}.{i}"), value)
                };
                Vector3::new(own(0), own(1), own(2))
            }
        }
    }

    /// How the form of a point changes: of a body by components along its axes.
    pub(super) fn point_change(
        &self,
        member: &str,
        components: &Vector3<Dual64>,
        relative_to: Option<&str>,
    ) -> Form {
        match self.model.frame(member) {
            Some(frame) => {
                let along = self.principal(frame) * eps(components);
                Form::vector(12 * frame, &along)
            }
            None if member == GROUND => {
                Form::constant(eps(&self.placements.base(relative_to).point(*components)))
            }
            None => Form::constant(Vector3::zeros()),
        }
    }

    /// How the line of a distance changes.
    fn line_change(&self, sensor: &Sensor) -> Form {
        let Some(line) = line_of(self.stated, sensor) else {
            return Form::constant(Vector3::zeros());
        };
        let [section, name] = line.of;
        let [from, to] = [0, 1].map(|k| {
            let (member, (part, stated)) = (line.members[k], line.points[k]);
            let own = self.held(&format!("{section}.{name}.{part}"), member, Some(stated));
            self.point_change(member, &own, line.relative_to)
        });
        to.minus(&from)
    }

    /// Points of sensors.
    pub(super) fn sensors(&self, found: &mut ModelTangent) {
        for sensor in &self.stated.sensors {
            let key = format!("sensor.{}", sensor.name);
            let change = |member: &str, part: &str, point: Option<[f64; 3]>| {
                let own = self.slopes.vector(&format!("{key}.{part}"), point.unwrap_or_default());
                self.point_change(member, &own, None)
            };
            let of = || change(&sensor.of, "point", sensor.point);
            if let (SensorKind::SectionForce | SensorKind::Strain, Some(at)) =
                (sensor.kind, sensor.at)
            {
                let slope = self.slopes.number(&format!("{key}.at"), at).eps;
                found.along.sensors.insert(sensor.name.clone(), slope);
            }
            if let (SensorKind::Expression, Some(value)) = (sensor.kind, &sensor.value) {
                let slope = self.formulas.sensor(&format!("{key}.value"), value);
                found.expressions.extend(slope.map(|slope| (sensor.name.clone(), slope)));
            }
            let moved = match sensor.kind {
                SensorKind::Position
                | SensorKind::Velocity
                | SensorKind::Acceleration
                | SensorKind::Imu => of(),
                SensorKind::Distance | SensorKind::DistanceRate => self.line_change(sensor),
                _ => continue,
            };
            if !moved.terms().is_empty() || moved.constant_part().amax() != 0.0 {
                found.sensors.insert(sensor.name.clone(), moved);
            }
        }
    }

    /// Distances, guides, gears, prescribed motions.
    pub(super) fn constraints(&self, out: &mut MechanismTangent) -> Result<(), ModelError> {
        for (k, constraint) in self.stated.constraints.iter().enumerate() {
            let key = format!("constraint.{}", constraint.name());
            let change = match constraint {
                Constraint::Distance {
                    from,
                    to,
                    point_from,
                    point_to,
                    relative_to,
                    length,
                    ..
                } => {
                    let base = relative_to.as_deref();
                    let start = self.slopes.vector(&format!("{key}.point_from"), *point_from);
                    let end = self.slopes.vector(&format!("{key}.point_to"), *point_to);
                    let between = self
                        .point_change(to, &end, base)
                        .minus(&self.point_change(from, &start, base));
                    let length = match length {
                        Some(length) => self.slopes.number(&format!("{key}.length"), *length),
                        None => {
                            let at = |name: &str, own| self.placements.point(name, own, base);
                            (at(to, end) - at(from, start)).norm()
                        }
                    };
                    let still = between.terms().is_empty() && between.constant_part().amax() == 0.0;
                    (length.eps != 0.0 || !still)
                        .then_some(ScalarTangent::Distance { between, length: length.eps })
                }
                Constraint::Gear { joints, freedoms, ratio, .. } => {
                    let ratio = self.slopes.number(&format!("{key}.ratio"), *ratio);
                    let [a, b] = [0, 1].map(|i| self.length_at_start(&joints[i], freedoms[i]));
                    let target = (a + ratio * b).eps;
                    let ratio = ratio.eps;
                    (ratio != 0.0 || target != 0.0).then_some(ScalarTangent::Gear { ratio, target })
                }
                Constraint::PointOnLine { parent, child, position, axis, relative_to, .. }
                | Constraint::PointOnPlane { parent, child, position, axis, relative_to, .. } => {
                    self.guide(&key, [parent, child], *position, *axis, relative_to.as_deref())?
                }
                Constraint::Motion { path, .. } => {
                    let change = self.path_change(&format!("{key}.path"), path)?;
                    let held = if self.system.stands { 0.0 } else { 1.0 };
                    change.map(|path| {
                        let path = move |t| {
                            let [value, rate, acceleration] = path(t);
                            [value, held * rate, held * acceleration]
                        };
                        ScalarTangent::Motion(std::sync::Arc::new(path))
                    })
                }
                Constraint::Rolling { .. } => self.rolling(&key, k, constraint)?,
                Constraint::Blade { body, position, axis, relative_to, .. } => {
                    self.blade(&key, k, body, *position, *axis, relative_to.as_deref())?
                }
                Constraint::Velocity { .. } => None, // of expressions
            };
            if let Some(change) = change {
                out.scalars.insert(k, change);
            }
        }
        Ok(())
    }

    /// A joint coordinate at the start: a length is not zero where its anchors are apart; an angle
    /// is.
    fn length_at_start(&self, joint: &str, freedom: usize) -> Dual64 {
        let Some(joint) = self.stated.joint(joint) else { return Dual64::of(0.0) };
        let motion = joint.pair().properties().motion;
        if motion.is_angle(freedom) {
            return Dual64::of(0.0);
        }
        let ([parent, child], axes) = (self.places(joint), self.axes(joint));
        let across = motion.translates_across_axis();
        let axis = if across { freedom } else { 2 };
        axes.column(axis).dot(&(child - parent))
    }

    /// A point on a line or on a plane.
    fn guide(
        &self,
        key: &str,
        members: [&String; 2],
        position: [f64; 3],
        axis: [f64; 3],
        relative_to: Option<&str>,
    ) -> Result<Option<ScalarTangent>, ModelError> {
        let base = self.placements.base(relative_to);
        let point = base.point(self.slopes.vector(&format!("{key}.position"), position));
        let axis = base.rotation * self.slopes.vector(&format!("{key}.axis"), axis);
        let axes = complete_axis(&axis.normalize());
        let frame = |name: &str| self.model.frame(name).map_or(FrameId::Ground, FrameId::Frame);
        let [parent, child] = members.map(|name| self.side(frame(name), &point, &axes));
        let plain = |side: &Side<Dual64>| Side {
            frame: side.frame,
            anchor: side.anchor.map(|x| x.re),
            axes: side.axes.map(|x| x.re),
        };
        let joint = vi_multibody::Joint {
            name: key.to_owned(),
            kind: vi_multibody::PairKind::Free,
            parent: plain(&parent),
            child: plain(&child),
        };
        let change = self.change(key, &joint, [point; 2], &axes)?;
        let moves = change != JointTangent::default();
        Ok(moves.then(|| ScalarTangent::Guide { joint: Box::new(joint), change }))
    }
}
