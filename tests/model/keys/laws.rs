//! Laws and tables: accelerations at the start by Newton and Euler, impulses of each interpolation.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Rotation3, Vector3};
use vi_testkit::model::{
    FIRST, SECOND, between, body, frame, head, part, particle, sensor, slider,
};

type Vector = Vector3<f64>;

const TILTED: [f64; 3] = [0.3, 0.5, -0.8];

/// Sensors of the accelerations of a body.
fn accelerations(k: &str, body: &str) -> String {
    sensor(&format!("a{k}"), "acceleration", body)
        + &sensor(&format!("r{k}"), "angular_acceleration", body)
}

/// Between points of two bodies; from a point mass to the ground.
fn between_points() -> Case {
    let (from, to) = ([0.1, -0.3, 0.2], [-0.2, 0.1, 0.4]);
    let held = [0.3, 0.2, -0.1];
    let text = [
        head("laws", "step = 1e-4, end = 2e-4"),
        frame("tilted", TILTED, [0.0, 0.0, 3.0]),
        part("frame", "other") + "position = [0.0, 1.0, 3.0]\n",
        FIRST.text("first"),
        SECOND.text("second"),
        particle("ball", 0.6, [1.0, 2.0, 2.0]) + "velocity = [0.4, -0.2, 0.9]\n",
        between("law", "cord", ["first", "second"]),
        format!("point_from = {from:?}\npoint_to = {to:?}\ntension = \"9-x*2+v*3\"\n"),
        between("law", "band", ["ground", "ball"]),
        format!("point_from = {held:?}\nrelative_to = \"tilted\"\ntension = \"7*x-2\"\n"),
        accelerations("1", "first"),
        accelerations("2", "second"),
        sensor("a3", "acceleration", "ball"),
    ]
    .concat();
    Case::new("laws between points", text, move |run| {
        let mut checks = Checks::default();
        let line = SECOND.place(to) - FIRST.place(from);
        let along = line.normalize();
        let rate = along.dot(&(SECOND.rate(to) - FIRST.rate(from)));
        let tension = 9.0 - 2.0 * line.norm() + 3.0 * rate;
        let none = Vector::zeros();
        for (k, body, point, force) in
            [(1, FIRST, from, tension * along), (2, SECOND, to, -tension * along)]
        {
            let [a, r] = body.accelerations(point, force, none);
            checks.vector("acceleration", run.vector(&format!("a{k}"), 0), a, 1e-9);
            checks.vector("angular acceleration", run.vector(&format!("r{k}"), 0), r, 1e-9);
        }
        let work = |name: &str| run.energy(name)[run.last()] / run.t(run.last());
        checks.near("power of the cord", work("work.cord"), -tension * rate, 0.1);
        let rotation = Rotation3::new(Vector::from(TILTED));
        let anchor = Vector::new(0.0, 0.0, 3.0) + rotation * Vector::from(held);
        let line = Vector::new(1.0, 2.0, 2.0) - anchor;
        let l = line.norm();
        let pull = 7.0 * l - 2.0;
        checks.vector("ball", run.vector("a3", 0), -pull / l / 0.6 * line, 1e-9);
        let rate = line.dot(&Vector::new(0.4, -0.2, 0.9)) / l;
        checks.near("what the band stores", work("energy.band"), pull * rate, 0.1);
        checks
    })
    .blind("frame.position", "of the other one")
}

/// Along both freedoms of a joint, and along another joint.
fn along_joints() -> Case {
    let cylinder = |name: &str, child: &str, place: [f64; 3]| {
        part("joint", name)
            + &format!("type = \"cylindrical\"\nparent = \"ground\"\nchild = \"{child}\"\n")
            + &format!("position = {place:?}\naxis = [0.0, 0.0, 1.0]\nrate = [0.5, 0.8]\n")
    };
    let text = [
        head("laws", "step = 1e-4, end = 2e-4"),
        body("nut", 2.0, [0.1, 0.2, 0.3]),
        body("ring", 1.5, [0.3, 0.2, 0.4]),
        cylinder("post", "nut", [0.0; 3]),
        cylinder("pole", "ring", [0.0; 3]),
        part("law", "push") + "joint = \"post\"\neffort = \"5-v*2+x\"\n",
        part("law", "twist") + "joint = \"post\"\nfreedom = 1\neffort = \"4-v*3+x\"\n",
        part("law", "other") + "joint = \"pole\"\neffort = \"9-v*4\"\n",
        sensor("a", "acceleration", "nut"),
        sensor("r", "angular_acceleration", "nut"),
        sensor("b", "acceleration", "ring"),
        sensor("done", "work", "other"),
    ]
    .concat();
    Case::new("laws along joints", text, |run| {
        let mut checks = Checks::default();
        let (push, twist, other) = (5.0 - 2.0 * 0.5, 4.0 - 3.0 * 0.8, 9.0 - 4.0 * 0.5);
        checks.near("acceleration", run.sensor("a.z", 0), push / 2.0, 1e-9);
        checks.near("angular acceleration", run.sensor("r.z", 0), twist / 0.3, 1e-9);
        checks.near("other", run.sensor("b.z", 0), other / 1.5, 1e-9);
        let work = |name: &str| run.energy(name)[run.last()] / run.t(run.last());
        checks.near("power of the push", work("work.push"), push * 0.5, 1e-2);
        checks.near("power of the twist", work("work.twist"), twist * 0.8, 1e-2);
        checks.near("power of the other", work("work.other"), other * 0.5, 1e-2);
        let done = run.sensor("done", run.last()) / run.t(run.last());
        checks.near("work of the other", done, other * 0.5, 1e-2);
        checks
    })
    .only("law")
}

/// On bodies, along their axes and those of space, and on a point mass.
fn on_members() -> Case {
    let (point, at) = ([0.1, -0.3, 0.2], [-0.2, 0.1, 0.4]);
    let text = [
        head("laws", "step = 1e-4, end = 2e-4"),
        FIRST.text("first"),
        SECOND.text("second"),
        particle("ball", 0.6, [1.0, 2.0, 2.0]) + "velocity = [0.4, -0.2, 0.9]\n",
        part("law", "gust") + &format!("on = \"first\"\npoint = {point:?}\naxes = \"body\"\n"),
        "force = [\"3-2*vx\", \"1.5*z+7*t\", \"-0.4*wy\"]\n".into(),
        "torque = [\"0.2*wz\", \"x-0.3\", \"0.1*vy\"]\n".into(),
        part("law", "stream") + &format!("on = \"second\"\npoint = {at:?}\naxes = \"space\"\n"),
        "force = [\"vz-y\", 2.5, \"wx\"]\ntorque = [\"0.3*vx\", \"-0.2*wz\", 0.7]\n".into(),
        part("law", "drag") + "on = \"ball\"\nforce = [\"-2*vx\", \"x*z\", \"4-vy\"]\n",
        accelerations("1", "first"),
        accelerations("2", "second"),
        sensor("a3", "acceleration", "ball"),
    ]
    .concat();
    Case::new("laws on members", text, move |run| {
        let mut checks = Checks::default();
        let work = |name: &str| run.energy(name)[run.last()] / run.t(run.last());
        let (x, v, w) = (FIRST.place(point), FIRST.rate(point), Vector::from(FIRST.spin));
        let force = Vector::new(3.0 - 2.0 * v.x, 1.5 * x.z, -0.4 * w.y);
        let torque = Vector::new(0.2 * w.z, x.x - 0.3, 0.1 * v.y);
        let own = FIRST.rotation();
        let first = (FIRST, point, own * force, own * torque);
        let (x, v, w) = (SECOND.place(at), SECOND.rate(at), Vector::from(SECOND.spin));
        let force = Vector::new(v.z - x.y, 2.5, w.x);
        let second = (SECOND, at, force, Vector::new(0.3 * v.x, -0.2 * w.z, 0.7));
        for (k, (body, point, force, torque)) in [first, second].into_iter().enumerate() {
            let [a, r] = body.accelerations(point, force, torque);
            let name = |what: &str| format!("{what}{}", k + 1);
            checks.vector("acceleration", run.vector(&name("a"), 0), a, 1e-9);
            checks.vector("angular acceleration", run.vector(&name("r"), 0), r, 1e-9);
            let power = force.dot(&body.rate(point)) + torque.dot(&Vector::from(body.spin));
            let name = ["work.gust", "work.stream"][k];
            checks.near("power", work(name), power, 0.05 * (1.0 + power.abs()));
        }
        let force = Vector::new(-2.0 * 0.4, 2.0, 4.2);
        checks.vector("ball", run.vector("a3", 0), force / 0.6, 1e-9);
        checks.near("drag", work("work.drag"), force.dot(&Vector::new(0.4, -0.2, 0.9)), 0.05);
        checks
    })
    .only("law")
    .blind("law.axes dropped", "the default of the stream")
    .blind("law.axes of entry 1 moved", "the default")
    .blind("law.force", "numbers are judged by the other entries")
}

/// Along the axes of another body, which takes the opposite.
fn relative_to_a_body() -> Case {
    let at = [-0.2, 0.1, 0.4];
    let text = [
        head("laws", "step = 1e-4, end = 2e-4"),
        FIRST.text("first"),
        SECOND.text("second"),
        particle("ball", 0.6, [1.0, 2.0, 2.0]) + "velocity = [0.4, -0.2, 0.9]\n",
        part("law", "reach")
            + &format!("on = \"second\"\npoint = {at:?}\nrelative_to = \"first\"\n"),
        "force = [\"3-2*x\", \"1.5*vz+y\", \"-0.4*wy\"]\n".into(),
        "torque = [\"0.2*wz-0.1*z\", \"vx-0.3\", \"0.1*wx+0.2*vy\"]\n".into(),
        part("law", "tie")
            + "on = \"ball\"\nrelative_to = \"second\"\nforce = [\"-2*vx\", \"x*z-1\", \"4-vy\"]\n",
        accelerations("1", "first"),
        accelerations("2", "second"),
        sensor("a3", "acceleration", "ball"),
    ]
    .concat();
    Case::new("laws relative to a body", text, move |run| {
        let mut checks = Checks::default();
        let [spin, other] = [FIRST.spin, SECOND.spin].map(Vector::from);
        let [one, two] = [FIRST.rotation(), SECOND.rotation()];
        let rho = SECOND.place(at) - FIRST.place([0.0; 3]);
        let rate = SECOND.rate(at) - FIRST.rate([0.0; 3]) - spin.cross(&rho);
        let [x, v, w] = [rho, rate, other - spin].map(|x| one.transpose() * x);
        let force = one * Vector::new(3.0 - 2.0 * x.x, 1.5 * v.z + x.y, -0.4 * w.y);
        let torque = one * Vector::new(0.2 * w.z - 0.1 * x.z, v.x - 0.3, 0.1 * w.x + 0.2 * v.y);
        let [a, r] = FIRST.accelerations([0.0; 3], -force, -torque - rho.cross(&force));
        checks.vector("acceleration", run.vector("a1", 0), a, 1e-9);
        checks.vector("angular acceleration", run.vector("r1", 0), r, 1e-9);
        let away = Vector::new(1.0, 2.0, 2.0) - SECOND.place([0.0; 3]);
        let drift = Vector::new(0.4, -0.2, 0.9) - SECOND.rate([0.0; 3]) - other.cross(&away);
        let [x, v] = [away, drift].map(|x| two.transpose() * x);
        let tie = two * Vector::new(-2.0 * v.x, x.x * x.z - 1.0, 4.0 - v.y);
        checks.vector("ball", run.vector("a3", 0), tie / 0.6, 1e-9);
        let whole = [
            SECOND.accelerations(at, force, torque),
            SECOND.accelerations([0.0; 3], -tie, -away.cross(&tie)),
            SECOND.accelerations([0.0; 3], Vector::zeros(), Vector::zeros()), // of its own spin
        ];
        let [a, r] = [0, 1].map(|k| whole[0][k] + whole[1][k] - whole[2][k]);
        checks.vector("acceleration", run.vector("a2", 0), a, 1e-9);
        checks.vector("angular acceleration", run.vector("r2", 0), r, 1e-9);
        let power = force.dot(&rate) + torque.dot(&(other - spin));
        let work = run.energy("work.reach")[run.last()] / run.t(run.last());
        checks.near("power", work, power, 0.05 * (1.0 + power.abs()));
        checks
    })
    .only("law")
}

/// The tension of a spring at the start.
fn tension_of_a_spring() -> Case {
    let text = [
        head("tension", "step = 1e-3, end = 2e-3"),
        particle("ball", 0.6, [1.0, 2.0, 2.0]),
        particle("stone", 0.7, [1.0, -2.0, 2.0]),
        between("spring", "stay", ["ground", "ball"]) + "stiffness = 40.0\ntension = 12.0\n",
        between("spring", "cord", ["ground", "stone"]) + "stiffness = 40.0\n",
        sensor("a", "acceleration", "ball"),
        sensor("b", "acceleration", "stone"),
    ]
    .concat();
    Case::new("tension of a spring", text, |run| {
        let mut checks = Checks::default();
        let pull = -12.0 / 0.6 * Vector::new(1.0, 2.0, 2.0) / 3.0;
        checks.vector("ball", run.vector("a", 0), pull, 1e-9);
        checks.vector("stone", run.vector("b", 0), Vector::zeros(), 1e-9);
        checks
    })
    .only("spring.tension")
}

/// A law that reads the rate and does no work over a period, composed.
fn conservative() -> Case {
    let text = [
        head("conservative", "step = 1e-3, end = 2e-3, order = 4"),
        slider("slider", "rail", 2.0),
        part("law", "push") + "joint = \"rail\"\nconservative = true\neffort = \"6+v*0\"\n",
    ]
    .concat();
    Case::new("conservative law", text, |run| {
        let mut checks = Checks::default();
        let last = run.last();
        checks.near("momentum", run.linear_momentum(last).x, 6.0 * run.t(last), 1e-12);
        checks
    })
    .only("law")
    .blind("law.effort", "read from the right it is the same")
}

/// Values of a table at a time, by formulas of their own.
type Interpolated = (&'static str, &'static str, &'static str, fn(f64) -> f64);

const POINTS: &str = "[[0.01, 0.4], [0.02, 1.5], [0.035, -0.6]]";

fn linear(t: f64) -> f64 {
    match t {
        _ if t < 0.01 => 0.4,
        _ if t < 0.02 => 0.4 + 110.0 * (t - 0.01),
        _ if t < 0.035 => 1.5 - 140.0 * (t - 0.02),
        _ => -0.6,
    }
}

/// A cubic by values and slopes at both ends.
fn cubic(t: f64, [a, b]: [f64; 2], [x, y]: [f64; 2], [p, q]: [f64; 2]) -> f64 {
    let (h, s) = (b - a, (t - a) / (b - a));
    let (one, two) = ((1.0 - s) * (1.0 - s), s * s);
    x * (1.0 + 2.0 * s) * one + y * (3.0 - 2.0 * s) * two + h * (p * s * one - q * (1.0 - s) * two)
}

/// An extremum in the middle: slopes 210, 0, −290.
fn monotone(t: f64) -> f64 {
    match t {
        _ if t < 0.01 => 0.4 + 210.0 * (t - 0.01),
        _ if t < 0.02 => cubic(t, [0.01, 0.02], [0.4, 1.5], [210.0, 0.0]),
        _ if t < 0.035 => cubic(t, [0.02, 0.035], [1.5, -0.6], [0.0, -290.0]),
        _ => -0.6 - 290.0 * (t - 0.035),
    }
}

/// Second derivatives 0, −30000, 0.
fn spline(t: f64) -> f64 {
    let bend = |u: f64, h: f64| -30_000.0 * (u * u * u / (6.0 * h) - h * u / 6.0);
    match t {
        _ if (0.01..0.02).contains(&t) => linear(t) + bend(t - 0.01, 0.01),
        _ if (0.02..0.035).contains(&t) => linear(t) + bend(0.035 - t, 0.015),
        _ => linear(t),
    }
}

/// It jumps at the points.
fn steps(t: f64) -> f64 {
    match t {
        _ if t < 0.02 => 0.4,
        _ if t < 0.035 => 1.5,
        _ => -0.6,
    }
}

const TABLES: [Interpolated; 4] = [
    ("steps", "hold", POINTS, steps),
    ("linear", "hold", POINTS, linear),
    ("pchip", "slope", POINTS, monotone),
    ("spline", "hold", POINTS, spline),
];

/// The momentum that a force of 40 N times a function of time gives, its value in the middle of
/// each step.
fn impulses(run: &Run, value: fn(f64) -> f64) -> Checks {
    let mut checks = Checks::default();
    let mut expected = 0.0;
    for node in 1..run.steps() {
        let (a, b) = (run.t(node - 1), run.t(node));
        expected += (b - a) * 40.0 * value(0.5 * (a + b));
        checks.near("momentum", run.linear_momentum(node).x, expected, 1e-11);
    }
    checks
}

fn driven(table: &str) -> String {
    [
        head("table", "step = 1e-3, end = 0.05"),
        slider("slider", "rail", 2.0),
        part("law", "push") + "joint = \"rail\"\neffort = \"40*f(t)\"\n",
        part("table", "f") + table,
    ]
    .concat()
}

fn tables() -> Vec<Case> {
    let of = |(interpolation, outside, points, value): Interpolated| {
        let table = format!(
            "points = {points}\ninterpolation = \"{interpolation}\"\noutside = \"{outside}\"\n"
        );
        Case::new(format!("table, {interpolation}"), driven(&table), move |run| {
            impulses(run, value)
        })
        .only("table")
        .blind_if(outside == "hold", "table.outside dropped", "its default")
        .blind_if(interpolation == "pchip", "table.interpolation dropped", "its default")
        .blind_if(interpolation == "steps", "table.points 0.01 changed", "it holds before")
        .blind_if(
            interpolation == "steps",
            "table.outside `hold` → `slope`",
            "slopes are zero",
        )
    };
    let whole = "points = [[0.0, 0.5], [0.03, 1.0], [0.06, 0.0]]\ninterpolation = \"linear\"\noutside = \"error\"\n";
    let within = Case::new("table that ends", driven(whole), |run| {
        impulses(run, |t| if t < 0.03 { 0.5 + t / 0.06 } else { 1.0 - (t - 0.03) / 0.03 })
    })
    .only("table")
    .blind("table.outside", "within its range");
    let rows = |sign: f64| {
        format!(
            "time,other,\"force\"\n0.01,1,{}\n0.02,2,{}\n\n0.035,3,{}\n",
            0.4 * sign,
            1.5 * sign,
            -0.6 * sign
        )
    };
    let file =
        "file = \"force.csv\"\ncolumns = [\"time\", \"force\"]\ninterpolation = \"linear\"\n";
    let read = Case::new("table from a file", driven(file), |run| impulses(run, linear))
        .file("force.csv", rows(1.0))
        .file("other.csv", rows(-1.0))
        .only("table");
    TABLES.into_iter().map(of).chain([within, read]).collect()
}

/// Of two numbers: a product of a function of the time and of a line.
fn grids() -> Vec<Case> {
    let effort = |keys: &str| driven(keys).replace("40*f(t)", "40*f(t, 3*t)");
    let values = "axes = [[0.01, 0.02, 0.035], [0.0, 0.2]]\nvalues = [[0.4, 0.8], [1.5, 3.0], [-0.6, -1.2]]\n";
    let inline = |kind: &str, outside: &str, value: fn(f64) -> f64| {
        let keys = format!("{values}interpolation = \"{kind}\"\noutside = \"{outside}\"\n");
        Case::new(format!("grid, {kind}"), effort(&keys), move |run| impulses(run, value))
            .only("table")
            .blind_if(outside == "hold", "table.outside dropped", "its default")
            .blind_if(kind == "pchip", "table.interpolation dropped", "its default")
    };
    let rows = |sign: f64| {
        let row = |t: f64, f: f64| format!("{t},{},{}\n", sign * f, 2.0 * sign * f);
        format!("time,0.0,0.2\n{}{}{}", row(0.01, 0.4), row(0.02, 1.5), row(0.035, -0.6))
    };
    let file = effort("file = \"map.csv\"\ngrid = true\ninterpolation = \"linear\"\n");
    vec![
        inline("linear", "hold", |t| linear(t) * (1.0 + 15.0 * t)),
        inline("pchip", "slope", |t| monotone(t) * (1.0 + 15.0 * t)),
        inline("spline", "hold", |t| spline(t) * (1.0 + 15.0 * t)),
        Case::new("grid from a file", file, |run| impulses(run, |t| linear(t) * (1.0 + 15.0 * t)))
            .file("map.csv", rows(1.0))
            .file("other.csv", rows(-1.0))
            .only("table"),
    ]
}

/// A spring of a joint by a table, beside its stiffness.
fn spring_by_table() -> Case {
    let text = [
        head("spring", "step = 1e-4, end = 2e-4"),
        slider("slider", "rail", 2.0),
        "spring = { stiffness = 4.0, rest = -0.3, table = \"f\" }\n".to_owned(),
        part("table", "f") + "points = [[0.0, 1.0], [0.5, 2.5]]\ninterpolation = \"linear\"\n",
        part("table", "g") + "points = [[0.0, 3.0], [0.5, 7.0]]\ninterpolation = \"linear\"\n",
        sensor("a", "acceleration", "slider"),
    ]
    .concat();
    Case::new("spring by a table", text, |run| {
        let mut checks = Checks::default();
        let pull = 4.0 * 0.3 + 1.0 + 3.0 * 0.3;
        checks.near("acceleration", run.sensor("a.x", 0), -pull / 2.0, 1e-9);
        checks
    })
    .only("joint.spring")
}

pub(crate) fn cases() -> Vec<Case> {
    let mut cases = vec![
        between_points(),
        along_joints(),
        on_members(),
        relative_to_a_body(),
        tension_of_a_spring(),
        conservative(),
    ];
    cases.extend(tables());
    cases.extend(grids());
    cases.push(spring_by_table());
    cases
}
