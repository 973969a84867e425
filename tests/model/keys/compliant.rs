//! Compliant contacts and smooth friction, by the differential equation of their one coordinate.

use super::{Case, Checks, Run};
use vi_testkit::model::{body, body_at, head, hinge, part, sensor, slider};

/// `(x, v)` after a time, of `x'' = a(x, v)`.
fn moved(
    start: [f64; 2],
    time: f64,
    acceleration: impl Fn(f64, f64) -> f64,
    steps: u32,
) -> [f64; 2] {
    let (mut y, h) = (start, time / f64::from(steps));
    let rate = |[x, v]: [f64; 2]| [v, acceleration(x, v)];
    let ahead = |y: [f64; 2], k: [f64; 2], h: f64| [y[0] + h * k[0], y[1] + h * k[1]];
    for _ in 0..steps {
        let first = rate(y);
        let second = rate(ahead(y, first, 0.5 * h));
        let third = rate(ahead(y, second, 0.5 * h));
        let fourth = rate(ahead(y, third, h));
        for i in 0..2 {
            y[i] += h / 6.0 * (first[i] + 2.0 * (second[i] + third[i]) + fourth[i]);
        }
    }
    y
}

/// The course of smooth friction.
fn course(v: f64, transition: f64, (ratio, stribeck): (f64, f64)) -> f64 {
    (1.0 + (ratio - 1.0) * (-(v / stribeck).powi(2)).exp()) * (v / transition).tanh()
}

fn last(run: &Run, name: &str) -> f64 {
    run.columns_of(name).first().map_or(f64::NAN, |column| column[run.last()])
}

/// Balls that bounce; a ball on a slide that is pressed on a plane.
fn contacts() -> Case {
    let ball = |name: &str, x: f64| {
        body_at([x, 0.0, 0.3], name, 2.0, [0.1; 3])
            + "velocity = [0.0, 0.0, -2.0]\n"
            + "shape = { type = \"sphere\", dimensions = [0.2] }\n"
    };
    let rule = |name: &str, below: f64, keys: &str| {
        let plane = format!("a = {{ plane = {{ position = [0.0, 0.0, {below:?}] }} }}\n");
        part("contact", &format!("under {name}")) + &plane + &format!("b = \"{name}\"\n{keys}\n")
    };
    let text = [
        head("compliant contacts", "step = 1e-4, end = 0.2"),
        ball("hertz", 0.0),
        ball("other", 3.0),
        slider("sledge", "slide", 2.0),
        "rate = 0.5\n".into(),
        sensor("x", "joint_coordinate", "slide"),
        rule("hertz", 0.0, "model = { type = \"hunt_crossley\", stiffness = 5e4 }"),
        rule(
            "other",
            0.0,
            "model = { type = \"hunt_crossley\", stiffness = 2e4, exponent = 1.25, dissipation = 0.2 }",
        ),
        rule(
            "sledge",
            -0.19,
            "friction = 0.25\nmodel = { type = \"hunt_crossley\", stiffness = 1e4, transition_velocity = 0.05, static_ratio = 1.5, stribeck_velocity = 0.3 }",
        ),
    ]
    .concat()
    .replace("[1.0, 1.0, 1.0]\n", "[1.0, 1.0, 1.0]\nshape = { type = \"sphere\", dimensions = [0.2] }\n");
    Case::new("compliant contacts", text, |run| {
        let mut checks = Checks::default();
        let bounce = |k: f64, p: f64, c: f64| {
            let push = move |z: f64, v: f64| match 0.2 - z {
                depth if depth > 0.0 => k * depth.powf(p) * (1.0 - c * v).max(0.0) / 2.0,
                _ => 0.0,
            };
            moved([0.3, -2.0], 0.2, push, 20_000)[0]
        };
        let height = |name| run.place(name, run.last()).z;
        checks.near("after Hertz", height("hertz"), bounce(5e4, 1.5, 0.0), 1e-5);
        checks.near("with dissipation", height("other"), bounce(2e4, 1.25, 0.2), 1e-5);
        let pressed = 1e4 * 0.01_f64.powf(1.5);
        let slowed = |_, v: f64| -0.25 * pressed * course(v, 0.05, (1.5, 0.3)) / 2.0;
        let sledge = moved([0.0, 0.5], 0.2, slowed, 2000)[0];
        checks.near("sliding", last(run, "x"), sledge, 1e-6);
        checks
    })
    .only("contact.model")
}

/// A slide and a hinge that friction slows down.
fn friction() -> Case {
    let text = [
        head("smooth friction", "step = 1e-3, end = 0.5"),
        slider("cart", "slide", 2.0),
        "rate = 0.5\nfriction = { force = 2.0, model = { type = \"stribeck\", transition_velocity = 0.05, static_ratio = 1.5, stribeck_velocity = 0.1 } }\n".into(),
        body("drum", 1.0, [0.4; 3]),
        hinge("axle", ["ground", "drum"], [0.0; 3], [1.0, 0.0, 0.0]),
        "rate = 2.0\nfriction = { torque = 0.3, model = { type = \"stribeck\", transition_velocity = 0.4 } }\n".into(),
        sensor("x", "joint_coordinate", "slide"),
        sensor("angle", "joint_coordinate", "axle"),
        sensor("effort", "effort", "axle"),
    ]
    .concat();
    Case::new("smooth friction", text, |run| {
        let mut checks = Checks::default();
        let slowed = |_, v: f64| -course(v, 0.05, (1.5, 0.1));
        let cart = moved([0.0, 0.5], 0.5, slowed, 5000)[0];
        checks.near("force", last(run, "x"), cart, 1e-5);
        let turning = |_, v: f64| -0.3 / 0.4 * course(v, 0.4, (1.0, 1.0));
        let [angle, rate] = moved([0.0, 2.0], 0.5, turning, 5000);
        checks.near("torque", last(run, "angle"), angle, 1e-5);
        checks.near("effort", last(run, "effort"), -0.3 * course(rate, 0.4, (1.0, 1.0)), 1e-5);
        let lost = run.energy("work.axle.friction")[run.last()];
        checks.near("work", lost, 0.2 * (rate * rate - 4.0), 1e-5);
        checks
    })
    .only("joint.friction.model")
}

pub(super) fn cases() -> Vec<Case> {
    vec![contacts(), friction()]
}
