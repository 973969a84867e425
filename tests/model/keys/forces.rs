//! Loads and springs: accelerations at the start by Newton and Euler, impulses of every history.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Rotation3, Vector3};
use std::f64::consts::TAU;

type Vector = Vector3<f64>;

/// A rigid body with its stated motion.
#[derive(Clone, Copy)]
pub(crate) struct Rigid {
    pub(crate) mass: f64,
    pub(crate) moments: [f64; 3],
    pub(crate) center: [f64; 3],
    pub(crate) turned: [f64; 3],
    pub(crate) velocity: [f64; 3],
    pub(crate) spin: [f64; 3],
}

pub(crate) const FIRST: Rigid = Rigid {
    mass: 1.7,
    moments: [0.3, 0.5, 0.6],
    center: [0.5, 0.2, -0.3],
    turned: [0.4, -0.3, 0.7],
    velocity: [0.3, -0.4, 0.8],
    spin: [0.5, 0.9, -0.6],
};

pub(crate) const SECOND: Rigid = Rigid {
    mass: 0.8,
    moments: [0.2, 0.15, 0.25],
    center: [-0.6, 1.1, 0.4],
    turned: [-0.2, 0.6, 0.3],
    velocity: [-0.5, 0.2, 0.1],
    spin: [-0.7, 0.3, 0.4],
};

impl Rigid {
    pub(crate) fn text(&self, name: &str) -> String {
        let Self { mass, moments, center, turned, velocity, spin } = self;
        format!(
            "[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = {moments:?}\nposition = {center:?}\nrotation_vector = {turned:?}\nvelocity = {velocity:?}\nangular_velocity = {spin:?}\n"
        )
    }

    pub(crate) fn rotation(&self) -> Matrix3<f64> {
        Rotation3::new(self.turned.into()).into_inner()
    }

    /// From the centre to a point of the body, in space.
    pub(crate) fn arm(&self, point: [f64; 3]) -> Vector {
        self.rotation() * Vector::from(point)
    }

    pub(crate) fn place(&self, point: [f64; 3]) -> Vector {
        Vector::from(self.center) + self.arm(point)
    }

    pub(crate) fn rate(&self, point: [f64; 3]) -> Vector {
        Vector::from(self.velocity) + Vector::from(self.spin).cross(&self.arm(point))
    }

    /// Accelerations of the centre and of the rotation under a force at a point and a torque.
    pub(crate) fn accelerations(
        &self,
        point: [f64; 3],
        force: Vector,
        torque: Vector,
    ) -> [Vector; 2] {
        let inertia = self.rotation()
            * Matrix3::from_diagonal(&self.moments.into())
            * self.rotation().transpose();
        let spin = Vector::from(self.spin);
        let moment = torque + self.arm(point).cross(&force) - spin.cross(&(inertia * spin));
        [force / self.mass, inertia.lu().solve(&moment).unwrap()]
    }
}

pub(crate) fn sensor(name: &str, kind: &str, of: &str) -> String {
    format!("[[sensor]]\nname = \"{name}\"\ntype = \"{kind}\"\nof = \"{of}\"\n")
}

const TILTED: [f64; 3] = [0.3, 0.5, -0.8];

fn tilted() -> Matrix3<f64> {
    Rotation3::new(Vector::from(TILTED)).into_inner()
}

/// Sensors `a1`, `r1`, `a2`, `r2` of both bodies.
fn accelerations() -> String {
    [("1", "first"), ("2", "second")]
        .map(|(k, body)| {
            sensor(&format!("a{k}"), "acceleration", body)
                + &sensor(&format!("r{k}"), "angular_acceleration", body)
        })
        .concat()
}

/// A follower on one body, a load along the axes of a frame on the other.
fn loads() -> Case {
    let (force, torque, point) = ([2.0, -3.0, 4.0], [0.6, 0.4, -0.5], [0.1, -0.3, 0.2]);
    let (pull, turn, at) = ([-1.0, 2.5, 3.0], [0.2, -0.7, 0.3], [-0.2, 0.1, 0.4]);
    let text = format!(
        r#"
model = {{ name = "loads" }}
simulation = {{ step = 1e-3, end = 2e-3 }}
frame = [{{ name = "tilted", rotation_vector = {TILTED:?} }}, {{ name = "other", rotation_vector = [0.0, 1.0, 0.0] }}]
{}{}
[[load]]
name = "follower"
body = "first"
force = {force:?}
torque = {torque:?}
point = {point:?}
frame = "body"
history = {{ type = "harmonic", frequency = 3.0, phase = 0.5 }}
[[load]]
name = "pull"
body = "second"
force = {pull:?}
torque = {turn:?}
point = {at:?}
relative_to = "tilted"
{}{}{}"#,
        FIRST.text("first"),
        SECOND.text("second"),
        accelerations(),
        sensor("w1", "power", "follower"),
        sensor("w2", "power", "pull"),
    );
    Case::new("loads", text, move |run| {
        let mut checks = Checks::default();
        let factor = 0.5_f64.sin();
        let own = FIRST.rotation() * factor;
        let acting = [
            (FIRST, point, own * Vector::from(force), own * Vector::from(torque)),
            (SECOND, at, tilted() * Vector::from(pull), tilted() * Vector::from(turn)),
        ];
        for (k, (body, point, force, torque)) in acting.into_iter().enumerate() {
            let [a, r] = body.accelerations(point, force, torque);
            let name = |what: &str| format!("{what}{}", k + 1);
            checks.vector("acceleration", run.vector(&name("a"), 0), a, 1e-9);
            checks.vector("angular acceleration", run.vector(&name("r"), 0), r, 1e-9);
            let power = force.dot(&body.rate(point)) + torque.dot(&Vector::from(body.spin));
            checks.near("power", run.sensor(&name("w"), 0), power, 1e-9);
        }
        checks
    })
    .blind(
        "load.history[harmonic].frequency",
        "at the start only the phase counts: see the histories",
    )
    .blind("body.position", "nothing acts at a distance")
    .blind("frame", "the other one holds nothing")
}

/// Two free beams, one under a force and a torque along it.
fn distributed() -> Case {
    let (force, torque) = ([2.0, -3.0, 4.0], [0.6, 0.4, -0.5]);
    let section = "section = { EA = 1e3, GA1 = 1e3, GA2 = 1e3, EI1 = 1.0, EI2 = 1.0, GJ = 1.0, rhoA = 0.5, rhoI1 = 1e-2, rhoI2 = 1e-2 }";
    let text = format!(
        r#"
model = {{ name = "distributed" }}
simulation = {{ step = 1e-5, end = 1e-5 }}
[[beam]]
name = "first"
points = [[0.0, 0.0, 0.0], [1.5, 0.0, 0.0]]
elements = 3
{section}
[[beam]]
name = "second"
points = [[0.0, 2.0, 0.0], [0.0, 2.0, 0.9]]
elements = 2
{section}
[[load]]
name = "wind"
beam = "first"
force = {force:?}
torque = {torque:?}
"#
    );
    Case::new("load along a beam", text, move |run| {
        let mut checks = Checks::default();
        let (h, force, torque) = (run.t(1), 1.5 * Vector::from(force), 1.5 * Vector::from(torque));
        checks.vector("impulse", run.linear_momentum(1), h * force, 1e-12);
        let moment = Vector::new(0.75, 0.0, 0.0).cross(&force) + torque;
        checks.vector("angular impulse", run.angular_momentum(1), h * moment, 1e-7 * h);
        checks
    })
    .blind("beam.section", "total impulses do not depend on it")
    .blind("beam.elements", "total impulses do not depend on them")
    .blind("beam.points", "of the other beam; of the first one see its moment")
}

/// The text of a history and its value.
type History = (&'static str, &'static str, fn(f64) -> f64);

const HISTORIES: [History; 6] = [
    ("linear", "end = 0.03", |t| t / 0.03),
    ("ramp", "start = 0.01, end = 0.03", |t| ((t - 0.01) / 0.02).clamp(0.0, 1.0)),
    ("pulse", "start = 0.01, end = 0.03", |t| f64::from(u8::from((0.01..0.03).contains(&t)))),
    ("triangle", "start = 0.01, peak = 0.02, end = 0.04", |t| {
        ((t - 0.01) / 0.01).min((0.04 - t) / 0.02).max(0.0)
    }),
    ("harmonic", "frequency = 20.0, phase = 0.3", |t| (TAU * 20.0 * t + 0.3).sin()),
    ("table", "times = [0.005, 0.02, 0.035], values = [0.4, 1.5, -0.6]", |t| match t {
        _ if t < 0.005 => 0.0,
        _ if t < 0.02 => 0.4 + 1.1 * (t - 0.005) / 0.015,
        _ if t < 0.035 => 1.5 - 2.1 * (t - 0.02) / 0.015,
        _ => -0.6,
    }),
];

/// The momentum that a history gives in steps, each with the value in its middle.
fn impulses(run: &Run, force: f64, value: fn(f64) -> f64) -> Checks {
    let mut checks = Checks::default();
    let mut expected = 0.0;
    for node in 1..run.steps() {
        let (a, b) = (run.t(node - 1), run.t(node));
        expected += (b - a) * force * value(0.5 * (a + b));
        checks.near("momentum", run.linear_momentum(node).x, expected, 1e-11);
    }
    checks
}

fn histories() -> Vec<Case> {
    const FORCE: f64 = 40.0;
    let settings = "simulation = { step = 1e-3, end = 0.05 }";
    let load = |(kind, keys, value): History| {
        let text = format!(
            r#"
model = {{ name = "history" }}
{settings}
particle = [{{ name = "ball", mass = 2.0, position = [0.0, 0.0, 0.0] }}]
[[load]]
name = "push"
body = "ball"
force = [{FORCE:?}, 0.0, 0.0]
history = {{ type = "{kind}", {keys} }}
"#
        );
        Case::new(format!("load, {kind}"), text, move |run| impulses(run, FORCE, value))
            .blind("particle", "the momentum does not depend on the mass")
            .blind("load.force", "across: only the first component is judged")
    };
    let motor = |(kind, keys, value): History| {
        let text = format!(
            r#"
model = {{ name = "history" }}
{settings}
body = [{{ name = "slider", mass = 2.0, inertia = [1.0, 1.0, 1.0] }}]
[[joint]]
name = "rail"
type = "prismatic"
parent = "ground"
child = "slider"
position = [0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
motor = {{ effort = {FORCE:?}, history = {{ type = "{kind}", {keys} }} }}
"#
        );
        Case::new(format!("motor, {kind}"), text, move |run| impulses(run, FORCE, value))
            .blind("body", "the momentum does not depend on it")
            .blind("joint.position", "a slide")
            .blind("joint.axis", "a direction of any length")
            .blind("joint.type", "others that slide along the axis, too")
    };
    HISTORIES.into_iter().map(load).chain(HISTORIES.into_iter().map(motor)).collect()
}

/// A spring with a damper between points of two bodies, one of the other law from a point mass to
/// the ground.
fn springs() -> Case {
    let (from, to) = ([0.1, -0.3, 0.2], [-0.2, 0.1, 0.4]);
    let held = [0.3, 0.2, -0.1];
    let text = format!(
        r#"
model = {{ name = "springs" }}
simulation = {{ step = 1e-4, end = 2e-4 }}
frame = [{{ name = "tilted", rotation_vector = {TILTED:?}, position = [0.0, 0.0, 3.0] }}, {{ name = "other", position = [0.0, 1.0, 3.0] }}]
{}{}
[[particle]]
name = "ball"
mass = 0.6
position = [1.0, 2.0, 2.0]
velocity = [0.4, -0.2, 0.9]
[[spring]]
name = "cord"
from = "first"
to = "second"
point_from = {from:?}
point_to = {to:?}
stiffness = 30.0
natural_length = 0.7
damping = 1.3
[[spring]]
name = "band"
from = "ground"
to = "ball"
point_from = {held:?}
relative_to = "tilted"
law = "quadratic_stretch"
stiffness = 5.0
natural_length = 1.1
{}{}{}{}{}"#,
        FIRST.text("first"),
        SECOND.text("second"),
        accelerations(),
        sensor("a3", "acceleration", "ball"),
        sensor("cord_force", "effort", "cord"),
        sensor("band_force", "effort", "band"),
        sensor("cord_length", "length", "cord"),
    );
    Case::new("springs", text, move |run| {
        let mut checks = Checks::default();
        let line = SECOND.place(to) - FIRST.place(from);
        let along = line.normalize();
        let rate = along.dot(&(SECOND.rate(to) - FIRST.rate(from)));
        let tension = 30.0 * (line.norm() - 0.7) + 1.3 * rate;
        let none = Vector::zeros();
        for (k, body, point, force) in
            [(1, FIRST, from, tension * along), (2, SECOND, to, -tension * along)]
        {
            let [a, r] = body.accelerations(point, force, none);
            checks.vector("acceleration", run.vector(&format!("a{k}"), 0), a, 1e-9);
            checks.vector("angular acceleration", run.vector(&format!("r{k}"), 0), r, 1e-9);
        }
        checks.near("tension", run.sensor("cord_force", 0), tension, 1e-9);
        checks.near("length", run.sensor("cord_length", 0), line.norm(), 1e-12);
        let anchor = Vector::new(0.0, 0.0, 3.0) + tilted() * Vector::from(held);
        let line = Vector::new(1.0, 2.0, 2.0) - anchor;
        let l = line.norm();
        let pull = 2.0 * 5.0 * (l * l - 1.1 * 1.1) * l;
        checks.near("pull", run.sensor("band_force", 0), pull, 1e-9);
        checks.vector("ball", run.vector("a3", 0), -pull / l / 0.6 * line, 1e-9);
        checks
    })
    .blind("frame.position", "of the other one")
    .blind("particle.velocity", "nothing resists it")
    .blind("sensor.type", "`length` is another word for `distance`")
}

pub(crate) fn cases() -> Vec<Case> {
    let mut cases = vec![loads(), distributed(), springs()];
    cases.extend(histories());
    cases
}
