//! Joints: what acts on each freedom against an integration of its own, initial velocities of
//! chains, anchors, cut loops.

use super::{Case, Checks, Run};
use crate::pairs::every_freedom::{Acting, Columns, Errors, Kind, errors, rates, text};
use holonom::nalgebra::{Rotation3, Vector3};
use vi_testkit::model::{FIRST, Rigid, SECOND, body_at, frame, head, hinge, joint, part, sensor};

type Vector = Vector3<f64>;

/// Spring, damper and motor on a freedom, wound; the text is that of the study of every freedom.
fn freedom(kind: Kind, freedom: usize) -> Case {
    let (acting, h) = (Acting { freedom, rest: 7.0 }, 0.01);
    let d = kind.freedoms().len();
    let start = [vec![0.0; d], rates(kind, acting), vec![0.0; 2]].concat();
    let mut exact = acting.integrate(kind, start, h);
    exact.truncate(66); // more than a revolution
    let text = text(kind, acting, &rates(kind, acting), h)
        .replace("end = 1 ", "end = 0.65 ")
        .replace("simulation = {", "simulation = { method = \"galerkin\", order = 4,");
    Case::new(format!("{kind:?}, freedom {freedom}"), text, move |run| {
        let mut checks = Checks::default();
        checks.holds("nodes", run.steps() == exact.len());
        if run.steps() != exact.len() {
            return checks;
        }
        let (sensor, energy) = (|name: &str| run.column(name), |name: &str| run.energy(name));
        let coordinates = run.columns_of("coordinate");
        let counted = coordinates.len() == kind.freedoms().len();
        checks.holds("coordinates", counted);
        if counted {
            let found = Columns { sensor: &sensor, energy: &energy, coordinates };
            let Errors { coordinates, efforts, energies, balance } =
                errors(kind, acting, &found, h, &exact);
            checks.near("coordinates", coordinates, 0.0, 2e-4);
            checks.near("efforts", efforts, 0.0, 2e-4);
            checks.near("energies", energies, 0.0, 2e-4);
            checks.near("balance", balance, 0.0, 1e-11);
        }
        checks
    })
    .only("joint")
    .blind("joint.first_axis", "a direction of any length; its entries are judged")
    .blind_if(kind == Kind::Prismatic, "joint.position", "a slide")
    .blind_if(freedom == 0, "joint.spring.freedom", "its default")
    .blind_if(freedom == 0, "joint.damper.freedom", "its default")
    .blind_if(freedom == 0, "joint.motor.freedom", "its default")
    .blind("joint.axis", "a direction of any length; its entries are judged")
    .blind("joint.axis2 1 changed", "a direction of any length")
}

fn every_freedom() -> Vec<Case> {
    let all =
        Kind::ALL.into_iter().flat_map(|kind| (0..kind.freedoms().len()).map(move |f| (kind, f)));
    all.map(|(kind, f)| freedom(kind, f)).collect()
}

const TILTED: [f64; 3] = [0.3, 0.5, -0.8];

/// Two hinges in a row, with rates; the second one is stated in a frame.
fn chain() -> Case {
    let (at, axis) = ([0.2, -0.1, 0.3], [0.0, 0.6, 0.8]);
    let (then, along) = ([0.4, 0.7, -0.2], [0.8, 0.0, 0.6]);
    let text = [
        head("chain", "step = 1e-4, end = 2e-4"),
        frame("tilted", TILTED, [0.0, 0.3, 0.1]),
        part("frame", "other") + "position = [0.0, 1.0, 3.0]\n",
        FIRST.still("first"),
        SECOND.still("second"),
        hinge("shoulder", ["ground", "first"], at, axis),
        "rate = 1.3\nspring = { stiffness = 4.0, rest = 0.3 }\n".into(),
        hinge("elbow", ["first", "second"], then, along),
        "relative_to = \"tilted\"\nrate = [-0.7]\ndamper = { damping = 0.4 }\n".into(),
        joint("spherical", "pin", ["second", "third"], [-1.0, 1.0, 0.0]),
        body_at([-1.0, 2.0, 0.5], "third", 1.0, [1.0; 3]),
        sensor("shoulder_effort", "effort", "shoulder"),
        sensor("elbow_effort", "effort", "elbow"),
        sensor("v", "velocity", "third"),
        sensor("w", "angular_velocity", "third"),
    ]
    .concat();
    Case::new("chain of hinges", text, move |run| {
        let mut checks = Checks::default();
        let tilt = Rotation3::new(Vector::from(TILTED));
        let (p1, w1) = (Vector::from(at), 1.3 * Vector::from(axis));
        let p2 = Vector::new(0.0, 0.3, 0.1) + tilt * Vector::from(then);
        let w2 = w1 - 0.7 * (tilt * Vector::from(along));
        let v = |x: Vector| w1.cross(&(p2 - p1)) + w2.cross(&(x - p2));
        let v1 = w1.cross(&(Vector::from(FIRST.center) - p1));
        let third = Vector::new(-1.0, 2.0, 0.5);
        let momentum = FIRST.mass * v1 + SECOND.mass * v(SECOND.center.into()) + v(third);
        checks.vector("momentum", run.linear_momentum(0), momentum, 1e-11);
        checks.vector("velocity", run.vector("v", 0), v(third), 1e-11);
        checks.vector("rotation", run.vector("w", 0), w2, 1e-11);
        checks.near("spring", run.sensor("shoulder_effort.spring", 0), 4.0 * 0.3, 1e-11);
        checks.near("damper", run.sensor("elbow_effort.damper", 0), 0.4 * 0.7, 1e-11);
        checks
    })
    .blind("joint.axis", "a direction of any length; its entries are judged")
    .blind("joint.type", "initial rates alone: see the study of every freedom")
    .blind(
        "joint.child",
        "the last two may be held in either order: the second one moves with the third",
    )
    .blind("joint.position", "of the ball joint, at rest against its neighbour")
    .blind("body.inertia", "velocities do not depend on it")
    .blind("body.rotation_vector", "velocities do not depend on it")
    .blind("frame.position", "of the other one")
    .blind("sensor", "of the third body, which moves as the second one")
}

/// Slides whose places on both bodies are apart along the axis.
fn anchors() -> Case {
    let text = include_str!("../../models/anchors.toml");
    Case::new(
        "anchors",
        text.replace("\"first\", type", "\"s1\", type").replace("\"second\", type", "\"s2\", type"),
        |run| {
            let mut checks = Checks::default();
            checks.near("first", run.sensor("s1", 0), 0.3 + 0.2 + 0.4, 1e-12);
            checks.near("second", run.sensor("s2", 0), -((1.3 - 0.35) - (0.3 + 0.15)), 1e-12);
            checks
        },
    )
    .only("joint")
    .blind("joint.axis", "a direction of any length")
    .blind("joint.type", "others that slide, too")
}

/// Two bodies that are one, in free rotation.
fn welded() -> Case {
    let arm = Vector::from(SECOND.center) - Vector::from(FIRST.center);
    let velocity = Vector::from(FIRST.velocity) + Vector::from(FIRST.spin).cross(&arm);
    let second = Rigid { velocity: velocity.into(), spin: FIRST.spin, ..SECOND };
    let text = [
        head("welded", "step = 0.01, end = 0.5, project_start = true"),
        FIRST.text("first"),
        second.text("second"),
        joint("fixed", "weld", ["first", "second"], [0.1, 0.2, 0.3]),
        sensor("q1", "orientation", "first"),
        sensor("q2", "orientation", "second"),
    ]
    .concat();
    Case::new("welded bodies", text, move |run| {
        let mut checks = Checks::default();
        for node in 0..run.steps() {
            let [a, b] = ["q1", "q2"].map(|q| run.rotation(q, node));
            let turned = FIRST.rotation().transpose() * SECOND.rotation();
            checks.matrix("relative orientation", a.transpose() * b, turned, 1e-10);
            let apart = run.place("second", node) - run.place("first", node);
            let own = a.transpose() * apart;
            checks.vector("relative place", own, FIRST.rotation().transpose() * arm, 1e-10);
        }
        checks
    })
    .only("joint")
    .blind("joint.position", "any place of a rigid body")
}

/// The loop of a four-bar linkage, cut where the model says.
fn cut() -> Case {
    let body = |name: &str, x: f64, y: f64| {
        format!(
            "{{ name = \"{name}\", mass = 1.0, inertia = [1.0, 1.0, 1.0], position = [{x:?}, {y:?}, 0.0] }}"
        )
    };
    let joint = |name: &str, parent: &str, child: &str, x: f64, y: f64, more: &str| {
        hinge(name, [parent, child], [x, y, 0.0], [0.0, 0.0, 1.0]) + more
    };
    let text = format!(
        "model = {{ name = \"loop\" }}\nsimulation = {{ step = 1e-3, end = 2e-3, momenta = true }}\nbody = [{}, {}, {}]\n{}{}{}{}",
        body("crank", 0.0, 0.5),
        body("rod", 1.0, 1.2),
        body("rocker", 2.0, 0.7),
        joint("a", "ground", "crank", 0.0, 0.0, ""),
        joint("b", "crank", "rod", 0.0, 1.0, "cut = true\n"),
        joint("c", "rod", "rocker", 2.0, 1.4, ""),
        joint("d", "rocker", "ground", 2.0, 0.0, ""),
    );
    Case::new("cut loop", text, |run: &Run| {
        let mut checks = Checks::default();
        let owners: Vec<&str> =
            run.facts.rates.iter().flatten().map(|rate| rate.split('.').next().unwrap()).collect();
        let has = |name: &str| owners.contains(&name);
        checks.holds("spanning tree", !has("b") && has("a") && has("c") && has("d"));
        checks.near("degrees of freedom", run.facts.dof as f64, 1.0, 0.1);
        checks
    })
    .only("joint")
    .blind("joint.name", "of two that are not cut")
    .blind("joint.position", "the tree does not depend on places")
    .blind("joint.axis", "a direction of any length")
    .blind("joint.type", "the tree alone is judged")
    .blind("joint.parent", "other mechanisms with the same tree")
    .blind("joint.child", "other mechanisms with the same tree")
}

pub(crate) fn cases() -> Vec<Case> {
    let mut cases = every_freedom();
    cases.extend([chain(), anchors(), welded(), cut()]);
    cases
}
