//! One mechanism stated otherwise: turned, moved, its parts in another order, in other units.
//!
//! Premise: the parts of the model state no frame (`relative_to`), as those of a model that was
//! read.

use holonom::Model;
use holonom::model::{
    Beam, Body, Constraint, ContactModel, ContactSide, Curve, Damping, Frame, FrictionModel,
    GROUND, History, Inertia, Joint, JointLimits, Limits, Load, MotionPath, Normal, Section, Shape,
    Spring, SpringLaw, Stations,
};
use holonom::nalgebra::{Matrix3, Vector3};

/// How much of a new unit one metre, one kilogram and one second are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Of lengths.
    pub length: f64,
    /// Of masses.
    pub mass: f64,
    /// Of times.
    pub time: f64,
}

impl Units {
    /// The factor of a quantity with these powers of length, mass and time.
    fn of(self, length: i32, mass: i32, time: i32) -> f64 {
        self.length.powi(length) * self.mass.powi(mass) * self.time.powi(time)
    }

    /// The factor of a quantity by its SI unit, as columns state it.
    #[must_use]
    pub fn of_unit(self, unit: &str) -> f64 {
        match unit {
            "m" => self.of(1, 0, 0),
            "m/s" => self.of(1, 0, -1),
            "rad/s" => self.of(0, 0, -1),
            "N" => self.of(1, 1, -2),
            "N·m" => self.of(2, 1, -2),
            "1/m" => self.of(-1, 0, 0),
            _ => 1.0,
        }
    }

    fn vector(self, x: &mut [f64], powers: [i32; 3]) {
        let factor = self.of(powers[0], powers[1], powers[2]);
        x.iter_mut().for_each(|x| *x *= factor);
    }

    fn length(self, x: &mut [f64]) {
        self.vector(x, [1, 0, 0]);
    }

    fn history(self, history: &mut History) {
        match history {
            History::Constant | History::Unstated | History::Function(_) => {}
            History::Expression(formula) => *formula = formula.with_time(self.time, 1.0),
            History::Linear { end } => *end *= self.time,
            History::Ramp { start, end } | History::Pulse { start, end } => {
                [start, end].into_iter().for_each(|t| *t *= self.time);
            }
            History::Triangle { start, peak, end } => {
                [start, peak, end].into_iter().for_each(|t| *t *= self.time);
            }
            History::Harmonic { frequency, .. } => *frequency /= self.time,
            History::Table { times, .. } => times.iter_mut().for_each(|t| *t *= self.time),
            History::Steps { step, .. } => step.iter_mut().for_each(|t| *t *= self.time),
        }
    }

    /// A path of a coordinate of which one is `size`.
    fn path(self, path: &mut MotionPath, size: f64) {
        if let Some(formula) = &mut path.expression {
            *formula = formula.with_time(self.time, size);
        }
        path.offset *= size;
        path.rate *= size / self.time;
        path.acceleration *= size / (self.time * self.time);
        path.amplitude *= size;
        path.frequency /= self.time;
        for step in &mut path.moves {
            (step.start, step.end) = (step.start * self.time, step.end * self.time);
            step.by *= size;
        }
        if let Some(table) = &mut path.table {
            table.times.iter_mut().for_each(|t| *t *= self.time);
            table.values.iter_mut().for_each(|x| *x *= size);
            table.rates.iter_mut().for_each(|x| *x *= size / self.time);
        }
    }

    fn shape(self, shape: &mut Shape) {
        self.length(&mut shape.dimensions);
        shape.density.iter_mut().for_each(|x| *x *= self.of(-3, 1, 0));
        shape.position.iter_mut().for_each(|x| self.length(x));
    }

    fn body(self, body: &mut Body) {
        body.mass.iter_mut().for_each(|x| *x *= self.mass);
        let moment = self.of(2, 1, 0);
        match &mut body.inertia {
            Some(Inertia::Principal(moments)) => moments.iter_mut().for_each(|x| *x *= moment),
            Some(Inertia::Tensor(rows)) => rows.iter_mut().flatten().for_each(|x| *x *= moment),
            None => {}
        }
        self.length(&mut body.position);
        self.vector(&mut body.velocity, [1, 0, -1]);
        let spins = [&mut body.angular_velocity, &mut body.body_angular_velocity];
        spins.into_iter().flatten().for_each(|x| self.vector(x, [0, 0, -1]));
        let others = body.picture.iter_mut().chain(&mut body.collision);
        body.shape.iter_mut().chain(others).for_each(|shape| self.shape(shape));
    }

    fn rows(self, rows: &mut Option<[[f64; 6]; 6]>, powers: [i32; 3]) {
        rows.iter_mut().for_each(|rows| self.matrix(rows, powers));
    }

    /// A matrix between forces and moments, or what they work on; the first entry has these powers
    /// of a length, a mass and a time.
    fn matrix(self, rows: &mut [[f64; 6]; 6], [length, mass, time]: [i32; 3]) {
        for (i, row) in rows.iter_mut().enumerate() {
            for (j, x) in row.iter_mut().enumerate() {
                let arms = i32::from(i >= 3) + i32::from(j >= 3);
                *x *= self.of(length + arms, mass, time);
            }
        }
    }

    fn section(self, section: &mut Section) {
        section.shape.iter_mut().for_each(|outline| self.length(&mut outline.dimensions));
        if let Some(material) = &mut section.material {
            let pressure = self.of(-1, 1, -2);
            material.young *= pressure;
            material.shear.iter_mut().for_each(|x| *x *= pressure);
            material.density *= self.of(-3, 1, 0);
        }
        let (force, moment) = (self.of(1, 1, -2), self.of(3, 1, -2));
        let stated = [
            (&mut section.ea, force),
            (&mut section.ga1, force),
            (&mut section.ga2, force),
            (&mut section.ei1, moment),
            (&mut section.ei2, moment),
            (&mut section.gj, moment),
            (&mut section.torsion_constant, self.of(4, 0, 0)),
            (&mut section.rho_a, self.of(-1, 1, 0)),
            (&mut section.rho_i1, self.of(1, 1, 0)),
            (&mut section.rho_i2, self.of(1, 1, 0)),
            (&mut section.rho_j, self.of(1, 1, 0)),
        ];
        for (value, factor) in stated {
            value.iter_mut().for_each(|x| *x *= factor);
        }
        let centers =
            [&mut section.tension_center, &mut section.shear_center, &mut section.mass_center];
        centers.into_iter().flatten().for_each(|center| self.length(center));
        self.rows(&mut section.stiffness, [1, 1, -2]);
        self.rows(&mut section.mass, [-1, 1, 0]);
        match &mut section.damping {
            Some(Damping::Viscosity(rows)) => self.matrix(rows, [1, 1, -1]),
            Some(Damping::Time(time)) => *time *= self.time,
            Some(Damping::LossFactor(loss)) => loss.frequency /= self.time,
            Some(Damping::Times(times)) => {
                let own = [&mut times.ea, &mut times.ga1, &mut times.ga2];
                let other = [&mut times.ei1, &mut times.ei2, &mut times.gj];
                own.into_iter().chain(other).for_each(|t| *t *= self.time);
            }
            None => {}
        }
    }

    fn beam(self, beam: &mut Beam) {
        points_of(beam, &mut |x| self.length(x));
        if let Some(Curve::Helix { pitch, .. }) = &mut beam.curve {
            *pitch *= self.length;
        }
        let force = self.of(1, 1, -2);
        beam.length.iter_mut().for_each(|x| *x *= self.length);
        beam.curvature.iter_mut().flatten().for_each(|x| *x /= self.length);
        beam.tension.iter_mut().for_each(|x| *x *= force);
        beam.prestress.iter_mut().for_each(|x| *x *= force);
        beam.radius.iter_mut().for_each(|x| *x *= self.length);
        self.section(&mut beam.section);
        if let Some(Stations::Rows(rows)) = &mut beam.stations {
            for row in rows {
                row.at *= self.length;
                row.section.iter_mut().for_each(|section| self.section(section));
            }
        }
        self.vector(&mut beam.velocity, [1, 0, -1]);
        self.vector(&mut beam.angular_velocity, [0, 0, -1]);
    }

    /// What one is of coordinate `freedom` of a joint.
    fn coordinate(self, joint: &Joint, freedom: usize) -> f64 {
        if joint.pair().is_angle(freedom) { 1.0 } else { self.length }
    }

    /// Limits, bumpers and dry friction.
    fn stops(self, joint: &mut Joint, sizes: &[f64]) {
        let energy = self.of(2, 1, -2);
        if let Some(limits) = joint.limits.map(|own| own.table()) {
            let size = sizes[limits.freedom];
            let [lower, upper] = [limits.lower, limits.upper].map(|own| own.map(|x| x * size));
            joint.limits = Some(Limits::Table(JointLimits { lower, upper, ..limits }));
            if let Some(bumper) = &mut joint.bumper {
                bumper.stiffness *= energy / (size * size);
                bumper.damping *= energy * self.time / (size * size);
            }
        }
        if let Some(friction) = &mut joint.friction {
            let size = sizes[friction.freedom];
            for effort in [&mut friction.torque, &mut friction.force] {
                effort.iter_mut().for_each(|x| *x *= energy / size);
            }
            friction.radius.iter_mut().for_each(|x| self.length(std::slice::from_mut(x)));
            if let Some(FrictionModel::Stribeck {
                transition_velocity, stribeck_velocity, ..
            }) = &mut friction.model
            {
                let rate = size / self.time;
                *transition_velocity *= rate;
                stribeck_velocity.iter_mut().for_each(|x| *x *= rate);
            }
        }
    }

    fn joint(self, joint: &mut Joint) {
        for place in [&mut joint.position, &mut joint.anchor_parent, &mut joint.anchor_child] {
            place.iter_mut().for_each(|x| self.length(x));
        }
        let sizes: Vec<f64> =
            (0..joint.pair().dof()).map(|freedom| self.coordinate(joint, freedom)).collect();
        if let Some(rates) = &joint.rate {
            let scaled =
                rates.values().iter().zip(&sizes).map(|(rate, size)| rate * size / self.time);
            joint.rate = Some(holonom::model::Rates::Many(scaled.collect()));
        }
        joint.pitch.iter_mut().for_each(|x| *x *= self.length);
        let energy = self.of(2, 1, -2);
        if let Some(spring) = &mut joint.spring {
            let size = sizes[spring.freedom];
            spring.stiffness *= energy / (size * size);
            spring.rest *= size;
        }
        if let Some(damper) = &mut joint.damper {
            let size = sizes[damper.freedom];
            damper.damping *= energy * self.time / (size * size);
        }
        if let Some(motor) = &mut joint.motor {
            let size = sizes[motor.freedom];
            motor.effort *= energy / size;
            self.history(&mut motor.history);
            motor.proportional *= energy / (size * size);
            motor.derivative *= energy * self.time / (size * size);
            self.path(&mut motor.path, size);
        }
        self.stops(joint, &sizes);
    }

    fn spring(self, spring: &mut Spring) {
        let points = [&mut spring.point_from, &mut spring.point_to];
        points.into_iter().flatten().for_each(|x| self.length(x));
        spring.stiffness *= match spring.law {
            SpringLaw::Linear => self.of(0, 1, -2),
            SpringLaw::QuadraticStretch => self.of(-2, 1, -2),
        };
        spring.natural_length.iter_mut().for_each(|x| *x *= self.length);
        spring.damping *= self.of(0, 1, -1);
    }

    fn load(self, load: &mut Load) {
        let per_length = if load.beam.is_some() && load.at.is_none() { 1 } else { 0 };
        load.at.iter_mut().for_each(|at| *at *= self.length);
        self.vector(&mut load.force, [1 - per_length, 1, -2]);
        self.vector(&mut load.torque, [2 - per_length, 1, -2]);
        load.point.iter_mut().for_each(|x| self.length(x));
        self.history(&mut load.history);
    }
}

/// The model in other units.
#[must_use]
pub fn in_units(model: &Model, units: Units) -> Model {
    let mut new = model.clone();
    units.vector(&mut new.header.gravity, [1, 0, -2]);
    new.settings.step *= units.time;
    new.settings.end *= units.time;
    new.settings.start_tolerance *= units.length;
    new.bodies.iter_mut().for_each(|body| units.body(body));
    new.beams.iter_mut().for_each(|beam| units.beam(beam));
    for particle in &mut new.particles {
        particle.mass *= units.mass;
        units.length(&mut particle.position);
        units.vector(&mut particle.velocity, [1, 0, -1]);
    }
    for bar in &mut new.bars {
        bar.point.iter_mut().for_each(|x| units.length(x));
        bar.length.iter_mut().for_each(|x| *x *= units.length);
    }
    new.joints.iter_mut().for_each(|joint| units.joint(joint));
    let size = |name: &str, freedom: usize| {
        let joint = model.joint(name);
        joint.map_or(1.0, |joint| units.coordinate(joint, freedom))
    };
    for constraint in &mut new.constraints {
        match constraint {
            Constraint::Distance { point_from, point_to, length, .. } => {
                units.length(point_from);
                units.length(point_to);
                length.iter_mut().for_each(|x| *x *= units.length);
            }
            Constraint::PointOnLine { position, .. }
            | Constraint::PointOnPlane { position, .. }
            | Constraint::Blade { position, .. } => {
                units.length(position);
            }
            Constraint::Rolling { radius, tube, plane, .. } => {
                units.length(&mut plane.position);
                (*radius, *tube) = (*radius * units.length, *tube * units.length);
                plane.spin /= units.time;
            }
            // random mechanisms have none: its expressions have units of their own
            Constraint::Velocity { terms, .. } => {
                terms.iter_mut().flat_map(|term| &mut term.point).for_each(|x| units.length(x));
            }
            Constraint::Gear { joints: [a, b], freedoms, ratio, .. } => {
                *ratio *= size(a, freedoms[0]) / size(b, freedoms[1]);
            }
            Constraint::Motion { joint, freedom, path, .. } => {
                units.path(path, size(joint, *freedom));
            }
        }
    }
    for contact in &mut new.contacts {
        if let ContactSide::Plane(side) = &mut contact.a {
            units.length(&mut side.plane.position);
        }
        if let Some(ContactModel::HuntCrossley {
            stiffness,
            exponent,
            dissipation,
            transition_velocity,
            stribeck_velocity,
            ..
        }) = &mut contact.model
        {
            let velocity = units.length / units.time;
            *stiffness *= units.of(1, 1, -2) / units.length.powf(*exponent);
            *dissipation /= velocity;
            for own in [transition_velocity, stribeck_velocity] {
                own.iter_mut().for_each(|x| *x *= velocity);
            }
        }
    }
    new.springs.iter_mut().for_each(|spring| units.spring(spring));
    new.loads.iter_mut().for_each(|load| units.load(load));
    for sensor in &mut new.sensors {
        sensor.point.iter_mut().for_each(|x| units.length(x));
        sensor.at.iter_mut().for_each(|x| *x *= units.length);
    }
    new
}

/// Visits the points of a beam.
fn points_of(beam: &mut Beam, visit: &mut dyn FnMut(&mut [f64; 3])) {
    beam.points.iter_mut().for_each(&mut *visit);
    match &mut beam.curve {
        Some(Curve::Arc { from, center, .. } | Curve::Helix { from, center, .. }) => {
            visit(from);
            visit(center);
        }
        Some(Curve::Spline { points }) => points.iter_mut().for_each(visit),
        None => {}
    }
}

/// A rigid displacement of the whole space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestatedDisplacement {
    /// Turn about the origin.
    pub rotation: Matrix3<f64>,
    /// Then a shift, m.
    pub shift: Vector3<f64>,
}

impl RestatedDisplacement {
    fn point(&self, x: &mut [f64; 3]) {
        *x = (self.shift + self.rotation * Vector3::from(*x)).into();
    }

    fn direction(&self, x: &mut [f64; 3]) {
        *x = (self.rotation * Vector3::from(*x)).into();
    }

    /// A point of the ground of a model in space, the origin if it is not stated.
    fn ground(&self, x: &mut Option<Vec<f64>>) {
        let stated = x.as_ref().and_then(|x| <[f64; 3]>::try_from(x.as_slice()).ok());
        let mut point = stated.unwrap_or_default();
        self.point(&mut point);
        *x = Some(point.to_vec());
    }

    fn beam(&self, beam: &mut Beam) {
        points_of(beam, &mut |x| self.point(x));
        if let Some(Curve::Arc { axis, .. } | Curve::Helix { axis, .. }) = &mut beam.curve {
            self.direction(axis);
        }
        match &mut beam.normal {
            Some(Normal::One(normal)) => self.direction(normal),
            Some(Normal::Legs(normals)) => normals.iter_mut().for_each(|n| self.direction(n)),
            None => {}
        }
        self.direction(&mut beam.velocity);
        self.direction(&mut beam.angular_velocity);
    }

    fn joint(&self, joint: &mut Joint) {
        joint.position.iter_mut().for_each(|x| self.point(x));
        let axes = [&mut joint.axis, &mut joint.axis2, &mut joint.first_axis];
        axes.into_iter().flatten().for_each(|axis| self.direction(axis));
        let anchors =
            [(&joint.parent, &mut joint.anchor_parent), (&joint.child, &mut joint.anchor_child)];
        for (end, anchor) in anchors {
            anchor.iter_mut().filter(|_| end == GROUND).for_each(|x| self.point(x));
        }
    }

    fn body(&self, body: &mut Body) {
        let rotation = self.rotation * body.rotation();
        body.matrix = Some(std::array::from_fn(|i| std::array::from_fn(|j| rotation[(i, j)])));
        (body.quaternion, body.rotation_vector, body.euler) = (None, None, None);
        self.point(&mut body.position);
        self.direction(&mut body.velocity);
        body.angular_velocity.iter_mut().for_each(|x| self.direction(x));
    }
}

/// The model in space displaced as a whole; one in the plane stays as it is.
#[must_use]
pub fn displaced(model: &Model, by: &RestatedDisplacement) -> Model {
    let mut new = model.clone();
    if model.header.dimension == 2 {
        return new;
    }
    if let Ok(mut gravity) = <[f64; 3]>::try_from(new.header.gravity.as_slice()) {
        by.direction(&mut gravity);
        new.header.gravity = gravity.to_vec();
    }
    new.bodies.iter_mut().for_each(|body| by.body(body));
    new.beams.iter_mut().for_each(|beam| by.beam(beam));
    for particle in &mut new.particles {
        if let Ok(mut position) = <[f64; 3]>::try_from(particle.position.as_slice()) {
            by.point(&mut position);
            particle.position = position.to_vec();
        }
        if let Ok(mut velocity) = <[f64; 3]>::try_from(particle.velocity.as_slice()) {
            by.direction(&mut velocity);
            particle.velocity = velocity.to_vec();
        }
    }
    for bar in new.bars.iter_mut().filter(|bar| bar.from == GROUND || bar.to == GROUND) {
        by.ground(&mut bar.point);
    }
    new.joints.iter_mut().for_each(|joint| by.joint(joint));
    for constraint in &mut new.constraints {
        match constraint {
            Constraint::Distance { from, to, point_from, point_to, .. } => {
                for (end, point) in [(from, point_from), (to, point_to)] {
                    if end == GROUND {
                        by.point(point);
                    }
                }
            }
            Constraint::PointOnLine { position, axis, .. }
            | Constraint::PointOnPlane { position, axis, .. }
            | Constraint::Blade { position, axis, .. } => {
                by.point(position);
                by.direction(axis);
            }
            Constraint::Rolling { axis, plane, .. } => {
                axis.iter_mut().for_each(|axis| by.direction(axis));
                by.point(&mut plane.position);
                by.direction(&mut plane.normal);
            }
            Constraint::Velocity { terms, .. } => {
                let in_space = terms.iter_mut().filter(|term| term.axes == Frame::Space);
                in_space.flat_map(|term| &mut term.direction).for_each(|own| by.direction(own));
            }
            Constraint::Gear { .. } | Constraint::Motion { .. } => {}
        }
    }
    for contact in &mut new.contacts {
        if let ContactSide::Plane(side) = &mut contact.a
            && side.plane.on == GROUND
        {
            by.point(&mut side.plane.position);
            by.direction(&mut side.plane.normal);
        }
    }
    for spring in &mut new.springs {
        let ends = [(&spring.from, &mut spring.point_from), (&spring.to, &mut spring.point_to)];
        for (_, point) in ends.into_iter().filter(|(end, _)| *end == GROUND) {
            by.ground(point);
        }
    }
    for load in new.loads.iter_mut().filter(|load| load.frame == Frame::Space) {
        by.direction(&mut load.force);
        by.direction(&mut load.torque);
    }
    new
}

/// The model with its bodies, point masses, bars and springs in the opposite order, and its joints.
/// Bodies stay where a joint states a rate: that moves the body beyond it, seen from the first one
/// where none is held.
#[must_use]
pub fn reordered(model: &Model) -> Model {
    let mut new = model.clone();
    if model.joints.iter().all(|joint| joint.rate.is_none()) {
        new.bodies.reverse();
    }
    new.particles.reverse();
    new.joints.reverse();
    new.bars.reverse();
    new.springs.reverse();
    new.loads.reverse();
    new
}
