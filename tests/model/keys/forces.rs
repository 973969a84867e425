//! Loads and springs: accelerations at the start by Newton and Euler, impulses of every history.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Rotation3, Vector3};
use std::f64::consts::TAU;
use vi_testkit::model::{
    FIRST, SECOND, beam, between, frame, head, load, part, particle, section, sensor, slider,
};

type Vector = Vector3<f64>;

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
    let text = [
        head("loads", "step = 1e-3, end = 2e-3"),
        format!(
            "frame = [{{ name = \"tilted\", rotation_vector = {TILTED:?} }}, {{ name = \"other\", rotation_vector = [0.0, 1.0, 0.0] }}]\n"
        ),
        FIRST.text("first"),
        SECOND.text("second"),
        load("follower", "first", [force, torque]),
        format!("point = {point:?}\nframe = \"body\"\n"),
        "history = { type = \"harmonic\", frequency = 3.0, phase = 0.5 }\n".into(),
        load("pull", "second", [pull, turn]),
        format!("point = {at:?}\nrelative_to = \"tilted\"\n"),
        accelerations(),
        sensor("w1", "power", "follower"),
        sensor("w2", "power", "pull"),
    ]
    .concat();
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
    let section = section([1e3, 1e3, 1e3, 1.0, 1.0, 1.0], [0.5, 1e-2, 1e-2]);
    let text = [
        head("distributed", "step = 1e-5, end = 1e-5"),
        beam("first", &[[0.0, 0.0, 0.0], [1.5, 0.0, 0.0]], 3) + &section,
        beam("second", &[[0.0, 2.0, 0.0], [0.0, 2.0, 0.9]], 2) + &section,
        part("load", "wind"),
        format!("beam = \"first\"\nforce = {force:?}\ntorque = {torque:?}\n"),
    ]
    .concat();
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

const HISTORIES: [History; 7] = [
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
    ("steps", "values = [0.4, 1.5, -0.6], step = 0.012", |t| match t {
        _ if t < 0.012 => 0.4,
        _ if t < 0.024 => 1.5,
        _ if t < 0.036 => -0.6,
        _ => 0.0,
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
    let head = || head("history", "step = 1e-3, end = 0.05");
    let load = |(kind, keys, value): History| {
        let text = [
            head(),
            particle("ball", 2.0, [0.0; 3]),
            part("load", "push"),
            format!("body = \"ball\"\nforce = [{FORCE:?}, 0.0, 0.0]\n"),
            format!("history = {{ type = \"{kind}\", {keys} }}\n"),
        ]
        .concat();
        Case::new(format!("load, {kind}"), text, move |run| impulses(run, FORCE, value))
            .blind("particle", "the momentum does not depend on the mass")
            .blind("load.force", "across: only the first component is judged")
    };
    let motor = |(kind, keys, value): History| {
        let text = [
            head(),
            slider("slider", "rail", 2.0),
            format!(
                "motor = {{ effort = {FORCE:?}, history = {{ type = \"{kind}\", {keys} }} }}\n"
            ),
        ]
        .concat();
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
    let text = [
        head("springs", "step = 1e-4, end = 2e-4"),
        frame("tilted", TILTED, [0.0, 0.0, 3.0]),
        part("frame", "other") + "position = [0.0, 1.0, 3.0]\n",
        FIRST.text("first"),
        SECOND.text("second"),
        particle("ball", 0.6, [1.0, 2.0, 2.0]) + "velocity = [0.4, -0.2, 0.9]\n",
        between("spring", "cord", ["first", "second"]),
        format!("point_from = {from:?}\npoint_to = {to:?}\n"),
        "stiffness = 30.0\nnatural_length = 0.7\ndamping = 1.3\n".into(),
        between("spring", "band", ["ground", "ball"]),
        format!("point_from = {held:?}\nrelative_to = \"tilted\"\n"),
        "law = \"quadratic_stretch\"\nstiffness = 5.0\nnatural_length = 1.1\n".into(),
        accelerations(),
        sensor("a3", "acceleration", "ball"),
        sensor("cord_force", "effort", "cord"),
        sensor("band_force", "effort", "band"),
        sensor("cord_length", "length", "cord"),
    ]
    .concat();
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
