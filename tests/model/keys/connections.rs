//! Bars and scalar constraints: what they keep constant at every node, by the geometry of the
//! coordinates, gears and motions by their joint coordinates.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Rotation3, Vector3};
use std::f64::consts::TAU;
use vi_testkit::model::{
    AXES, FIRST, Rigid, SECOND, along, between, body_at, frame, gear, guide, head, heavy, motion,
    part, particle, sensor, slider,
};

type Vector = Vector3<f64>;

const TILTED: [f64; 3] = [0.3, 0.5, -0.8];
const ORIGIN: [f64; 3] = [0.1, 0.3, 0.2];

fn frames() -> String {
    frame("tilted", TILTED, ORIGIN) + &part("frame", "other") + "position = [0.0, 1.0, 3.0]\n"
}

/// A place stated in the tilted frame.
fn tilted(x: [f64; 3]) -> Vector {
    Vector::from(ORIGIN) + Rotation3::new(Vector::from(TILTED)) * Vector::from(x)
}

/// Two weights that hang below one another at rest; the upper bar is longer than drawn.
fn bars() -> Case {
    let point = [0.4, -0.2, 0.5];
    let place = |below: f64| -> [f64; 3] { (tilted(point) - below * Vector::z()).into() };
    let text = [
        heavy(
            "bars",
            [0.0, 0.0, -10.0],
            "step = 1e-3, end = 0.02, project_start = true, start_tolerance = 1e-2",
        ),
        frames(),
        particle("upper", 0.7, place(1.0)),
        particle("lower", 1.9, place(1.8)),
        between("bar", "first", ["ground", "upper"]),
        format!("point = {point:?}\nrelative_to = \"tilted\"\nlength = 1.2\n"),
        between("bar", "second", ["upper", "lower"]),
        sensor("t1", "reaction", "first"),
        sensor("t2", "reaction", "second"),
    ]
    .concat();
    Case::new("bars", text, move |run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            let [upper, lower] = ["upper", "lower"].map(|name| run.place(name, node));
            checks.near("first", (upper - tilted(point)).norm(), 1.2, 1e-9);
            checks.near("second", (lower - upper).norm(), 0.8, 1e-9);
        }
        checks.near("pull", run.sensor("t1.tension", 0), 26.0, 1e-6);
        checks.near("pull below", run.sensor("t2.tension", 0), 19.0, 1e-6);
        checks
    })
    .only("bar")
}

/// A body on a rod longer than drawn, and a rod between both.
fn distances() -> Case {
    let (held, on, from, to) =
        ([0.4, -0.2, 0.5], [0.1, -0.3, 0.2], [-0.2, 0.2, 0.1], [0.3, 0.1, -0.2]);
    let drawn = (FIRST.place(on) - tilted(held)).norm();
    let length = 1.04 * drawn;
    let text = [
        head("distances", "step = 2e-3, end = 0.1, project_start = true"),
        frames(),
        FIRST.text("first"),
        SECOND.text("second"),
        between("constraint", "rod", ["ground", "first"]),
        format!("type = \"distance\"\npoint_from = {held:?}\npoint_to = {on:?}\n"),
        format!("relative_to = \"tilted\"\nlength = {length:?}\n"),
        between("constraint", "link", ["first", "second"]),
        format!("type = \"distance\"\npoint_from = {from:?}\npoint_to = {to:?}\n"),
        sensor("d1", "distance", "rod"),
        sensor("d2", "distance", "link"),
        sensor("q1", "orientation", "first"),
        sensor("q2", "orientation", "second"),
    ]
    .concat();
    Case::new("distances", text, move |run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            let at = |k: usize, point: [f64; 3]| {
                let name = ["first", "second"][k];
                run.place(name, node) + run.rotation(["q1", "q2"][k], node) * Vector::from(point)
            };
            checks.near("rod", (at(0, on) - tilted(held)).norm(), length, 1e-9);
            let link = (at(1, to) - at(0, from)).norm();
            let initial = (run.place("second", 0) + run.rotation("q2", 0) * Vector::from(to)
                - run.place("first", 0)
                - run.rotation("q1", 0) * Vector::from(from))
            .norm();
            checks.near("link", link, initial, 1e-9);
            checks.near("rod by its sensor", run.sensor("d1", node), length, 1e-9);
            checks.near("link by its sensor", run.sensor("d2", node), initial, 1e-9);
        }
        checks
    })
    .only("constraint")
}

/// A point of one body on a line of another, and on a plane of it.
fn guides() -> Case {
    let (place, axis) = ([0.2, 0.1, -0.3], [0.6, 0.0, 0.8]);
    let (flat, normal) = ([-0.3, 0.4, 0.2], [0.0, 0.6, 0.8]);
    let text = [
        heavy(
            "guides",
            [1.0, -3.0, 2.0],
            "step = 2e-3, end = 0.1, momenta = true, project_start = true",
        ),
        frames(),
        FIRST.text("first"),
        SECOND.text("second"),
        Rigid { center: [2.0, 2.0, 2.0], ..SECOND }.text("third"),
        guide("point_on_line", "line", ["first", "second"], place, axis),
        "relative_to = \"tilted\"\n".into(),
        guide("point_on_plane", "plane", ["first", "second"], flat, normal),
        "relative_to = \"tilted\"\n".into(),
        sensor("q1", "orientation", "first"),
        sensor("q2", "orientation", "second"),
    ]
    .concat();
    Case::new("guides", text, move |run| {
        let mut checks = Checks::default();
        let tilt = Rotation3::new(Vector::from(TILTED)).into_inner();
        // both bodies as they are stated: the points on them
        let on =
            |body: &Rigid, x: Vector| body.rotation().transpose() * (x - Vector::from(body.center));
        let points = [tilted(place), tilted(flat)];
        let directions = [axis, normal].map(|d| tilt * Vector::from(d));
        for node in 0..run.steps() {
            let parent: Matrix3<f64> = run.rotation("q1", node);
            let child = run.rotation("q2", node);
            for (k, (point, direction)) in points.into_iter().zip(directions).enumerate() {
                let a = run.place("first", node) + parent * on(&FIRST, point);
                let b = run.place("second", node) + child * on(&SECOND, point);
                let along = parent * FIRST.rotation().transpose() * direction;
                let gap = b - a;
                let off =
                    if k == 0 { gap - gap.dot(&along) * along } else { gap.dot(&along) * along };
                checks.vector(["line", "plane"][k], off, Vector::zeros(), 1e-9);
            }
        }
        let owner = |name: &str| name.split('.').next().unwrap().to_owned();
        let mut owners: Vec<String> =
            run.facts.constraints.iter().flatten().map(|row| owner(row)).collect();
        owners.retain(|name| ["line", "plane"].contains(&name.as_str()));
        checks.holds("rows", owners == ["line", "line", "plane"]);
        checks
    })
    .only("constraint")
    .blind("constraint[point_on_line].axis", "a direction of any length; its entries are judged")
    .blind("constraint[point_on_plane].axis", "a direction of any length; its entries are judged")
}

/// Bodies on cylindrical joints along x: displacement and angle of each.
fn cylinders(count: usize, more: &str) -> String {
    let one = |k: usize| {
        let (name, joint, at) = (format!("b{k}"), format!("j{k}"), [0.0, k as f64, 0.0]);
        let moments = [0.6 + 0.1 * k as f64, 1.0, 1.0];
        body_at(at, &name, 1.5 + k as f64, moments)
            + &along(AXES[0], "cylindrical", &joint, ["ground", &name], at)
            + if k == 0 { more } else { "" }
    };
    let sensors = |k: usize| sensor(&format!("c{k}"), "joint_coordinate", &format!("j{k}"));
    (0..count).map(|k| format!("{}{}", one(k), sensors(k))).collect()
}

/// An angle geared to a displacement, driven by a motor; another gear of other joints at rest.
fn gears() -> Case {
    let text = [
        head("gears", "step = 1e-3, end = 0.05"),
        cylinders(4, "motor = { effort = 3.0, freedom = 1 }\n"),
        gear("rack", ["j0", "j1"], [1, 0], -2.5),
        gear("pair", ["j2", "j3"], [1, 1], 0.7),
        sensor("e1", "effort", "rack"),
        sensor("e2", "effort", "pair"),
    ]
    .concat();
    Case::new("gears", text, |run| {
        let mut checks = Checks::default();
        // I_a α = τ + λ, m_b a = r λ, α + r a = 0
        let (inertia, mass, ratio, torque) = (0.6, 2.5, -2.5, 3.0);
        let effort = -torque / inertia / (1.0 / inertia + ratio * ratio / mass);
        let angular = (torque + effort) / inertia;
        for node in 0..run.steps() {
            let t = run.t(node);
            let angle = 0.5 * angular * t * t;
            // the rotation of a step is arcsin hω: third order
            checks.near("angle", run.sensor("c0.theta", node), angle, 1e-6);
            checks.near("displacement", run.sensor("c1.u", node), -angle / ratio, 1e-6);
            checks.near("free displacement", run.sensor("c0.u", node), 0.0, 1e-12);
            checks.near("free angle", run.sensor("c1.theta", node), 0.0, 1e-12);
        }
        checks.near("effort", run.sensor("e1.effort", 0), effort, 1e-7);
        checks.near("effort of the other", run.sensor("e2.effort", 0), 0.0, 1e-9);
        checks
    })
    .only("constraint")
    .blind("constraint[gear].ratio", "of the pair at rest")
    .blind("constraint[gear].joints", "of the pair at rest")
    .blind("constraint[gear].freedoms", "of the pair at rest")
}

/// The text of a path and its value and rate.
type Path = (&'static str, &'static str, fn(f64) -> [f64; 2]);

fn quintic(t: f64, start: f64, end: f64, by: f64) -> [f64; 2] {
    let s = ((t - start) / (end - start)).clamp(0.0, 1.0);
    let value = s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
    [by * value, by * 30.0 * s * s * (1.0 - s).powi(2) / (end - start)]
}

/// The cubic spline through `(0, 0.2)`, `(0.02, 0.5)`, `(0.05, −0.1)` with the rates 3 and −4 at
/// its ends.
fn spline(t: f64) -> [f64; 2] {
    let (x, y) = ([0.0, 0.02, 0.05], [0.2, 0.5, -0.1]);
    let [h0, h1] = [x[1] - x[0], x[2] - x[1]];
    let [s0, s1] = [(y[1] - y[0]) / h0, (y[2] - y[1]) / h1];
    let middle = (3.0 * (s0 / h0 + s1 / h1) - 3.0 / h0 + 4.0 / h1) / (2.0 / h0 + 2.0 / h1);
    let slopes = [3.0, middle, -4.0];
    if t > x[2] {
        return [y[2] + slopes[2] * (t - x[2]), slopes[2]];
    }
    let k = usize::from(t > x[1]);
    let (h, s) = (x[k + 1] - x[k], (t - x[k]) / (x[k + 1] - x[k]));
    let (a, b) = (y[k], y[k + 1]);
    let (m, n) = (h * slopes[k], h * slopes[k + 1]);
    let value = a + s * (m + s * (3.0 * (b - a) - 2.0 * m - n + s * (2.0 * (a - b) + m + n)));
    let rate = m + s * (2.0 * (3.0 * (b - a) - 2.0 * m - n) + s * 3.0 * (2.0 * (a - b) + m + n));
    [value, rate / h]
}

const PATHS: [Path; 3] = [
    (
        "sine",
        "{ offset = 0.1, rate = 0.7, acceleration = 3.0, amplitude = 0.2, frequency = 9.0, phase = 0.6 }",
        |t| {
            let a = TAU * 9.0 * t + 0.6;
            let value = 0.1 + 0.7 * t + 1.5 * t * t + 0.2 * (a.sin() - 0.6_f64.sin());
            [value, 0.7 + 3.0 * t + 0.2 * TAU * 9.0 * a.cos()]
        },
    ),
    (
        "moves",
        "{ moves = [{ start = 0.005, end = 0.03, by = 0.4 }, { start = 0.02, end = 0.06, by = -0.3 }] }",
        |t| {
            let (a, b) = (quintic(t, 0.005, 0.03, 0.4), quintic(t, 0.02, 0.06, -0.3));
            [a[0] + b[0], a[1] + b[1]]
        },
    ),
    (
        "table",
        "{ table = { times = [0.0, 0.02, 0.05], values = [0.2, 0.5, -0.1], rates = [3.0, -4.0] } }",
        spline,
    ),
];

/// Prescribed motions of the angle of one joint and the displacement of another.
fn motions((name, path, value): Path) -> Case {
    let text = [
        heavy("motion", [2.0, 0.0, 0.0], "step = 1e-3, end = 0.07, project_start = true"),
        cylinders(2, ""),
        motion("drive", "j0", path) + "freedom = 1\n",
        motion("hold", "j1", "{ offset = 0.0 }"),
        sensor("e", "power", "drive"),
    ]
    .concat();
    Case::new(format!("motion, {name}"), text, move |run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            checks.near("angle", run.sensor("c0.theta", node), value(run.t(node))[0], 1e-9);
            checks.near("fall", run.sensor("c0.u", node), run.t(node).powi(2), 1e-11);
            checks.near("held displacement", run.sensor("c1.u", node), 0.0, 1e-12);
        }
        let (kinetic, total) = (run.energy("kinetic"), run.energy("total"));
        let work = run.energy("work_of_motions");
        let most = kinetic.iter().copied().fold(0.0, f64::max);
        for node in 1..run.steps() {
            let gain = total[node] - total[0];
            checks.near("work", work[node], gain, 0.1 * most);
        }
        // the drive that is named puts in what the bodies gain
        let power = run.column("e");
        let sum = power.windows(2).map(|p| 0.5e-3 * (p[0] + p[1]));
        let largest = sum
            .scan(0.0, |total, p| {
                *total += p;
                Some(total.abs())
            })
            .fold(0.0, f64::max);
        checks.holds("power", largest > 0.2 * most);
        checks
    })
    .only("constraint")
    .blind("constraint[motion].path.offset", "of the one at rest")
}

/// A motor that controls a slide to a path.
fn control((name, path, value): Path) -> Case {
    let text = [
        head("control", "step = 1e-3, end = 0.07"),
        slider("slider", "rail", 2.0),
        format!(
            "motor = {{ effort = 1.5, proportional = 300.0, derivative = 7.0, path = {path} }}\n"
        ),
        sensor("e", "effort", "rail"),
        sensor("u", "joint_coordinate", "rail"),
        sensor("v", "joint_rate", "rail"),
    ]
    .concat();
    Case::new(format!("control, {name}"), text, move |run: &Run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            let [to, rate] = value(run.t(node));
            let (u, v) = (run.sensor("u", node), run.sensor("v", node));
            let effort = 1.5 + 300.0 * (to - u) + 7.0 * (rate - v);
            checks.near("effort", run.sensor("e.motor", node), effort, 1e-9);
        }
        checks
    })
    .only("joint.motor")
}

pub(crate) fn cases() -> Vec<Case> {
    let mut cases = vec![bars(), distances(), guides(), gears()];
    cases.extend(super::rolling::cases());
    cases.extend(PATHS.map(motions));
    cases.extend(PATHS.map(control));
    cases
}
