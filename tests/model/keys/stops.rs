//! Stops, bumpers and dry friction of joints: free flights between impacts, uniform decelerations.

use super::{Case, Checks, Run};
use vi_testkit::model::{along, body, head, heavy, hinge, sensor, slider};

const X: [f64; 3] = [1.0, 0.0, 0.0];

fn last(run: &Run, name: &str) -> f64 {
    run.columns_of(name).first().map_or(f64::NAN, |column| column[run.last()])
}

/// A slide that is pushed to and fro between its limits; bodies that turn and come back.
fn limits() -> Case {
    let turning = |name: &str, body_name: &str, rates: &str, limits: &str| {
        body(body_name, 1.0, [0.5; 3])
            + &along(X, "cylindrical", name, ["ground", body_name], [0.0; 3])
            + &format!("rate = {rates}\nlimits = {limits}\n")
    };
    let text = [
        head("limits", "step = 0.01, end = 1.2, contact = \"events\""),
        slider("cart", "slide", 1.0),
        "limits = [-0.25, 0.5]\n".into(),
        "motor = { effort = 20.0, history = { type = \"harmonic\", frequency = 1.0 } }\n".into(),
        turning("up", "a", "[0.2, 1.0]", "{ freedom = 1, upper = 0.4, restitution = 0.5 }"),
        turning("down", "b", "[0.1, -1.0]", "{ freedom = 1, lower = -0.3, restitution = 0.25 }"),
        sensor("x", "joint_coordinate", "slide"),
        sensor("p", "joint_coordinate", "up"),
        sensor("q", "joint_coordinate", "down"),
    ]
    .concat();
    Case::new("limits", text, |run| {
        let mut checks = Checks::default();
        let x = run.columns_of("x").concat();
        checks.near("upper", x.iter().copied().fold(-9.0, f64::max), 0.5, 1e-11);
        checks.near("lower", x.iter().copied().fold(9.0, f64::min), -0.25, 1e-11);
        let of = |name: &str| run.columns_of(name).get(1).map_or(f64::NAN, |own| own[run.last()]);
        // a free rotation has the rate of its momentum to the second order of the step
        checks.near("impact at the upper limit", of("p"), 0.0, 2e-5);
        checks.near("impact at the lower limit", of("q"), -0.3 + 0.25 * 0.9, 2e-5);
        let lost = run.energy("work.up.stop").last().copied().unwrap_or(f64::NAN);
        checks.near("energy of the impact", lost, -0.5 * 0.5 * (1.0 - 0.25), 1e-5);
        checks.near("balance", run.energy("balance")[run.last()], 0.0, 2e-3);
        checks
    })
    .only("joint.limits")
}

/// A slide against an elastic stop: its effort by coordinate and rate, its work by the energy.
fn bumper() -> Case {
    let text = [
        head("bumper", "step = 1e-4, end = 0.25"),
        slider("cart", "slide", 2.0),
        "rate = 3.0\nlimits = [-0.4, 0.3]\nbumper = { stiffness = 500.0, damping = 6.0 }\n".into(),
        sensor("x", "joint_coordinate", "slide"),
        sensor("v", "joint_rate", "slide"),
        sensor("effort", "effort", "slide"),
    ]
    .concat();
    Case::new("bumper", text, |run| {
        let mut checks = Checks::default();
        let [x, v, effort] = ["x", "v", "effort"].map(|name| run.columns_of(name).concat());
        let mut deepest = 0.0_f64;
        for ((x, v), effort) in x.iter().zip(&v).zip(&effort) {
            let depth = x - 0.3;
            deepest = deepest.max(depth);
            let push = if depth > 0.0 { (500.0 * depth + 6.0 * v).max(0.0) } else { 0.0 };
            checks.near("effort", *effort, -push, 1e-9);
        }
        checks.holds("it is hit", deepest > 0.05);
        // x'' = −(k x + c x')/m from 3 m/s: the largest depth by a fine integration
        let (mut at, mut rate, h) = (0.0_f64, 3.0_f64, 1e-6);
        while rate > 0.0 {
            rate -= h * (500.0 * at + 6.0 * rate) / 2.0;
            at += h * rate;
        }
        checks.near("depth", deepest, at, 1e-5);
        let lost = run.energy("work.slide.bumper")[run.last()];
        let kinetic = run.energy("kinetic");
        checks.near("work", lost, kinetic[run.last()] - kinetic[0], 1e-4);
        checks
    })
    .only("joint.bumper")
}

/// Uniform decelerations: by a force, by torques, by the weight that slides and pins carry.
fn friction() -> Case {
    let turning = |name: &str, body_name: &str, friction: &str| {
        body(body_name, 1.0, [0.4; 3])
            + &hinge(name, ["ground", body_name], [0.0; 3], X)
            + &format!("rate = 2.0\nfriction = {friction}\n")
    };
    let text = [
        heavy("friction", [0.0, 0.0, -9.81], "step = 0.01, end = 0.5"),
        slider("cart", "slide", 2.0),
        "rate = 3.0\nfriction = { force = 4.0 }\n".into(),
        slider("sledge", "guide", 2.0),
        "rate = 3.0\nfriction = { coefficient = 0.2 }\n".into(),
        turning("drum", "a", "{ torque = 0.3 }"),
        turning("pin", "b", "{ coefficient = 0.3, radius = 0.05 }"),
        body("c", 1.0, [0.4; 3]),
        along(X, "cylindrical", "rod", ["ground", "c"], [0.0; 3]),
        "rate = [0.2, 2.0]\nfriction = { freedom = 1, torque = 0.5 }\n".into(),
        body("d", 1.0, [0.4; 3]),
        along(X, "universal", "cross", ["ground", "d"], [0.0; 3]),
        "axis2 = [0.0, 1.0, 0.0]\nrate = [0.0, 2.0]\nfriction = { freedom = 1, torque = 0.5 }\n"
            .into(),
        ["slide", "guide", "drum", "pin", "rod", "cross"]
            .map(|of| sensor(&format!("{of}_at"), "joint_coordinate", of))
            .concat(),
    ]
    .concat();
    Case::new("friction", text, |run| {
        let mut checks = Checks::default();
        let t = run.t(run.last());
        let at = |rate: f64, deceleration: f64| rate * t - 0.5 * deceleration * t * t;
        checks.near("force", last(run, "slide_at"), at(3.0, 2.0), 1e-10);
        checks.near("coefficient of a length", last(run, "guide_at"), at(3.0, 0.2 * 9.81), 1e-10);
        checks.near("torque", last(run, "drum_at"), at(2.0, 0.3 / 0.4), 2e-4);
        let pin = 0.3 * 0.05 * 9.81 / 0.4;
        checks.near("coefficient and radius", last(run, "pin_at"), at(2.0, pin), 2e-4);
        let rod = run.columns_of("rod_at");
        let of = |k: usize| rod.get(k).map_or(f64::NAN, |column| column[run.last()]);
        checks.near("displacement without friction", of(0), 0.1, 1e-10);
        checks.near("second freedom", of(1), at(2.0, 0.5 / 0.4), 2e-4);
        let cross = run.columns_of("cross_at");
        let of = |k: usize| cross.get(k).map_or(f64::NAN, |column| column[run.last()]);
        checks.near("first angle of a cross", of(0), 0.0, 1e-12);
        checks.near("second angle of a cross", of(1), at(2.0, 0.5 / 0.4), 2e-4);
        checks
    })
    .only("joint.friction")
}

/// A slide that a growing force pulls: it breaks loose by static friction, and slides by the other.
fn held() -> Case {
    let text = [
        head("held", "step = 0.001, end = 1.0"),
        slider("cart", "slide", 2.0),
        "friction = { force = 4.0, static_ratio = 1.5 }\n".into(),
        "motor = { effort = 10.0, history = { type = \"ramp\", start = 0.0, end = 1.0 } }\n".into(),
        sensor("x", "joint_coordinate", "slide"),
    ]
    .concat();
    Case::new("held", text, |run| {
        let mut checks = Checks::default();
        let (t, loose) = (run.t(run.last()), 0.6_f64);
        let pull = 10.0 * ((t.powi(3) - loose.powi(3)) / 6.0 - 0.5 * loose * loose * (t - loose));
        let way = (pull - 0.5 * 4.0 * (t - loose).powi(2)) / 2.0;
        checks.near("way", last(run, "x"), way, 4e-3 * way);
        checks
    })
    .only("joint.friction.static_ratio")
}

/// Impacts at the nodes of the steps: from the node before the limit.
fn stepping() -> Case {
    let text = [
        head("stepping", "step = 0.1, end = 1.0, contact = \"stepping\""),
        slider("cart", "slide", 1.0),
        "rate = 1.0\nlimits = { upper = 0.25, restitution = 0.5 }\n".into(),
        sensor("x", "joint_coordinate", "slide"),
    ]
    .concat();
    Case::new("stepping", text, |run| {
        let mut checks = Checks::default();
        checks.near("place", last(run, "x"), 0.2 - 0.5 * 0.8, 1e-12);
        checks
    })
    .settings()
    .only("simulation.contact")
}

/// Two first touches in one step, of which one is placed.
fn touches() -> Case {
    let text = [
        head("touches", "step = 0.1, end = 1.0, max_events = 1"),
        slider("first", "slide", 1.0),
        "rate = 1.0\nlimits = { upper = 0.23, restitution = 0.5 }\n".into(),
        slider("second", "guide", 1.0),
        "rate = 1.0\nlimits = { upper = 0.27, restitution = 0.5 }\n".into(),
        sensor("x", "joint_coordinate", "slide"),
        sensor("y", "joint_coordinate", "guide"),
    ]
    .concat();
    Case::new("touches", text, |run| {
        let mut checks = Checks::default();
        checks.near("the first", last(run, "x"), 0.23 - 0.5 * 0.77, 1e-11);
        checks.near("the second", last(run, "y"), 0.23 - 0.5 * 0.77, 1e-11);
        checks
    })
    .settings()
    .only("simulation.max_events")
}

pub(super) fn cases() -> Vec<Case> {
    vec![limits(), bumper(), friction(), held(), stepping(), touches()]
}
