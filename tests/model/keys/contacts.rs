//! Contacts of bodies: one impact each in free flight, with the impulse of rigid bodies in closed
//! form.

use super::{Case, Checks, Run};
use holonom::nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use vi_testkit::model::{
    along, beam, body_at, frame, head, heavy, load, part, sensor, slider, soft_section,
};

type V = Vector3<f64>;

/// A free body with a velocity.
fn flying(
    name: &str,
    mass: f64,
    inertia: [f64; 3],
    position: [f64; 3],
    velocity: [f64; 3],
) -> String {
    body_at(position, name, mass, inertia) + &format!("velocity = {velocity:?}\n")
}

fn ball(radius: f64) -> String {
    format!("shape = {{ type = \"sphere\", dimensions = [{radius:?}] }}\n")
}

fn end(run: &Run, name: &str) -> V {
    run.place(name, run.last())
}

/// Where a ball is at the end that meets a plane through `point` with restitution `e`, m.
fn reflected(x: V, v: V, radius: f64, (point, normal): (V, V), e: f64, t: f64) -> V {
    let (gap, rate) = (normal.dot(&(x - point)) - radius, v.dot(&normal));
    let hit = -gap / rate;
    x + v * t - normal * ((1.0 + e) * rate * (t - hit))
}

const T: f64 = 1.0;
const STEP: &str = "step = 0.01, end = 1.0";

/// Balls against planes: of the ground, of a frame, of a body that moves.
fn planes() -> Case {
    let text = [
        head("planes", STEP),
        flying("first", 2.0, [0.1; 3], [0.5, 0.4, 1.0], [0.3, -0.2, -2.0]) + &ball(0.2),
        flying("second", 1.0, [0.1; 3], [5.0, 0.0, 1.0], [0.1, 0.2, -1.5]) + &ball(0.3),
        flying("table", 3.0, [0.5; 3], [-5.0, 0.0, 0.0], [0.0, 0.0, 0.2]),
        "rotation_vector = [0.2, 0.1, 0.0]\n".into(),
        flying("third", 1.0, [0.1; 3], [-5.0, 0.0, 1.2], [0.0, 0.0, -1.0]) + &ball(0.1),
        frame("ramp", [0.1, 0.2, 0.3], [5.0, 0.1, -0.2]),
        part("contact", "floor"),
        "a = { plane = { position = [0.1, -0.2, -0.3], normal = [0.2, 0.3, 0.6] } }\n".into(),
        "b = \"first\"\nrestitution = 0.5\n".into(),
        part("contact", "wall"),
        "a = { plane = { position = [0.1, 0.2, 0.3], normal = [0.2, -0.1, 1.0] } }\n".into(),
        "b = [\"second\"]\nrelative_to = \"ramp\"\nrestitution = 0.25\n".into(),
        part("contact", "tray"),
        "a = { plane = { position = [0.2, 0.3, 0.1], normal = [-0.1, 0.2, 1.0], on = \"table\" } }\n"
            .into(),
        "b = \"third\"\nrestitution = 0.75\n".into(),
    ]
    .concat();
    Case::new("planes", text, |run| {
        let mut checks = Checks::default();
        let normal = V::new(2.0, 3.0, 6.0) / 7.0;
        let floor = (V::new(0.1, -0.2, -0.3), normal);
        let first = reflected(V::new(0.5, 0.4, 1.0), V::new(0.3, -0.2, -2.0), 0.2, floor, 0.5, T);
        checks.vector("plane of the ground", end(run, "first"), first, 1e-10);
        let turn = UnitQuaternion::from_scaled_axis(V::new(0.1, 0.2, 0.3));
        let tilted = V::new(0.2, -0.1, 1.0).normalize();
        let wall = (V::new(5.0, 0.1, -0.2) + turn * V::new(0.1, 0.2, 0.3), turn * tilted);
        let second = reflected(V::new(5.0, 0.0, 1.0), V::new(0.1, 0.2, -1.5), 0.3, wall, 0.25, T);
        checks.vector("plane of a frame", end(run, "second"), second, 1e-10);
        // both are free: the impulse at the point of contact turns the table
        let turn = UnitQuaternion::from_scaled_axis(V::new(0.2, 0.1, 0.0)).to_rotation_matrix();
        let normal = turn * V::new(-0.1, 0.2, 1.0).normalize();
        let (table, ball) = (V::new(-5.0, 0.0, 0.0), V::new(-5.0, 0.0, 1.2));
        let relative = V::new(0.0, 0.0, -1.2);
        let gap = normal.dot(&(ball - table - turn * V::new(0.2, 0.3, 0.1))) - 0.1;
        let hit = -gap / normal.dot(&relative);
        let arm = (ball + V::new(0.0, 0.0, -hit) - normal * 0.1) - (table + V::z() * (0.2 * hit));
        let across = arm.cross(&normal);
        let compliance = 1.0 + 1.0 / 3.0 + across.norm_squared() / 0.5;
        let impulse = -1.75 * normal.dot(&relative) / compliance;
        let third = ball - V::z() * T + normal * (impulse * (T - hit));
        checks.vector("ball on a body", end(run, "third"), third, 1e-10);
        let own = table + V::z() * (0.2 * T) - normal * (impulse / 3.0 * (T - hit));
        checks.vector("body with a plane", end(run, "table"), own, 1e-10);
        let lost = run.energy("work.tray")[run.last()];
        let square = normal.dot(&relative).powi(2) / compliance;
        checks.near("energy of an impact", lost, -0.5 * square * (1.0 - 0.75 * 0.75), 1e-10);
        let v = [V::new(0.3, -0.2, -2.0), V::new(0.1, 0.2, -1.5)];
        let of = [("floor", v[0].dot(&floor.1), 2.0, 0.5), ("wall", v[1].dot(&wall.1), 1.0, 0.25)];
        for (name, rate, mass, e) in of {
            let lost = run.energy(&format!("work.{name}"))[run.last()];
            checks.near(name, lost, -0.5 * mass * rate * rate * (1.0 - e * e), 1e-10);
        }
        checks
    })
    .only("contact")
}

/// Balls that spin hit planes with friction: one slides, one grips, one comes back.
fn friction() -> Case {
    let spinning = |name: &str, x: f64| {
        flying(name, 2.0, [0.04; 3], [x, 0.0, 0.7], [1.0, 0.5, -2.0])
            + "angular_velocity = [3.0, -4.0, 1.0]\n"
            + &ball(0.2)
    };
    let rule = |name: &str, keys: &str| {
        format!(
            "{}a = {{ plane = {{}} }}\nb = \"{name}\"\n{keys}",
            part("contact", &format!("under {name}"))
        )
    };
    let text = [
        head("friction", STEP),
        spinning("slides", 0.0),
        spinning("grips", 3.0),
        spinning("returns", 6.0),
        rule("slides", "friction = 0.1\nrestitution = 0.6\n"),
        rule("grips", "friction = 1.5\n"),
        rule("returns", "friction = 1.5\nrestitution = 0.6\ntangential_restitution = 0.4\n"),
    ]
    .concat();
    Case::new("friction", text, |run| {
        let mut checks = Checks::default();
        let hit = 0.25;
        let slip = V::new(1.0 - 0.2 * -4.0, 0.5 + 0.2 * 3.0, 0.0); // v + ω × (−R n)
        let (radius, inertia) = (0.2, 0.04);
        let compliance = 0.5 + radius * radius / inertia;
        let after = |e: f64, tangential: V| {
            let impulse = V::z() * (2.0 * (1.0 + e) * 2.0) + tangential;
            move |x: f64| V::new(x + 1.0, 0.5, 0.7 - 2.0) + impulse / 2.0 * (T - hit)
        };
        let slides = after(0.6, -slip.normalize() * (0.1 * 6.4));
        checks.vector("it slides", end(run, "slides"), slides(0.0), 1e-10);
        let returns = after(0.6, -slip * (1.4 / compliance));
        checks.vector("it returns", end(run, "returns"), returns(6.0), 1e-10);
        let lost = |e: f64, tangential: V| {
            let across = tangential.dot(&(slip + tangential * (0.5 * compliance)));
            across - 0.5 * 2.0 * 4.0 * (1.0 - e * e)
        };
        let works = [
            ("slides", lost(0.6, -slip.normalize() * (0.1 * 6.4)), 1e-10),
            ("grips", lost(0.0, -slip / compliance), 1e-4),
            ("returns", lost(0.6, -slip * (1.4 / compliance)), 1e-10),
        ];
        for (name, work, tolerance) in works {
            let found = run.energy(&format!("work.under {name}"))[run.last()];
            checks.near(name, found, work, tolerance);
        }
        // at rest on the plane it rolls
        let grips = after(0.0, -slip / compliance);
        checks.vector("it grips", end(run, "grips"), grips(3.0), 1e-4);
        checks
    })
    .only("contact")
    .blind("contact.friction 1.5 changed", "it grips with more friction, too")
}

/// Two bodies meet: names and lists of names.
fn pairs() -> Case {
    let text = [
        head("pairs", STEP),
        flying("red", 1.0, [0.1; 3], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]) + &ball(0.2),
        flying("blue_1", 2.0, [0.1; 3], [1.0, 0.1, 0.05], [0.0; 3]) + &ball(0.3),
        flying("blue_2", 2.0, [0.1; 3], [0.0, 2.0, 0.0], [0.0; 3]) + &ball(0.3),
        flying("green", 1.0, [0.1; 3], [0.0, 0.5, 2.0], [0.0, 0.0, -1.0]) + &ball(0.2),
        flying("black", 1.0, [0.1; 3], [0.1, 2.0, 1.5], [0.0, 0.0, -2.0]) + &ball(0.1),
        part("contact", "reds"),
        "a = \"red\"\nb = \"blue_*\"\nrestitution = 0.5\n".into(),
        part("contact", "others"),
        "a = [\"blue_2\"]\nb = [\"green\", \"black\"]\nrestitution = 1.0\n".into(),
    ]
    .concat();
    Case::new("pairs", text, |run| {
        let mut checks = Checks::default();
        let meet = |x: [V; 2], v: V, sum: f64, m: [f64; 2], e: f64| {
            let d = x[1] - x[0];
            let (b, c) = (d.dot(&v), d.norm_squared() - sum * sum);
            let hit = (b - (b * b - v.norm_squared() * c).sqrt()) / v.norm_squared();
            let normal = (d - v * hit) / sum;
            let impulse = (1.0 + e) * normal.dot(&v) / (1.0 / m[0] + 1.0 / m[1]);
            let own = x[0] + v * T - normal * (impulse / m[0] * (T - hit));
            let lost = 0.5 * (1.0 - e) * impulse * normal.dot(&v);
            (own, x[1] + normal * (impulse / m[1] * (T - hit)), lost)
        };
        let (red, blue, lost) =
            meet([V::zeros(), V::new(1.0, 0.1, 0.05)], V::x(), 0.5, [1.0, 2.0], 0.5);
        checks.vector("red", end(run, "red"), red, 1e-10);
        checks.vector("blue", end(run, "blue_1"), blue, 1e-10);
        let (black, other, none) = meet(
            [V::new(0.1, 2.0, 1.5), V::new(0.0, 2.0, 0.0)],
            V::z() * -2.0,
            0.4,
            [1.0, 2.0],
            1.0,
        );
        checks.vector("black", end(run, "black"), black, 1e-10);
        checks.vector("the other blue", end(run, "blue_2"), other, 1e-10);
        checks.near("work of reds", run.energy("work.reds")[run.last()], -lost, 1e-10);
        checks.near("work of others", run.energy("work.others")[run.last()], -none, 1e-10);
        checks.vector("green passes", end(run, "green"), V::new(0.0, 0.5, 1.0), 1e-12);
        checks
    })
    .only("contact")
    .blind("contact.b `green`*", "it meets nobody")
    .blind("contact.b entries 0 and 1 exchanged", "the order of names says nothing")
}

const TURN: [f64; 4] = [0.8, 0.0, 0.36, 0.48];

fn turn() -> Matrix3<f64> {
    let [w, x, y, z] = TURN;
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix().into_inner()
}

/// Shapes for contact apart from the centre of mass: the impulse of the lowest point.
fn collision() -> Case {
    let shaped = |name: &str, x: f64, shapes: &str| {
        flying(name, 2.0, [0.2, 0.3, 0.4], [x, 0.0, 1.0], [0.0, 0.0, -1.0])
            + &format!("collision = [{shapes}]\n")
    };
    let corners = "v 0 0 0\nv 0.2 0.1 -0.3\nv 0.1 0.4 0.2\nv -0.3 0.2 0.1\n";
    let faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let text = [
        head("collision", "step = 0.01, end = 0.7"),
        shaped("egg", 0.0, "{ type = \"sphere\", dimensions = [0.2], position = [0.1, 0.2, -0.3] }"),
        shaped(
            "crate",
            3.0,
            &format!("{{ type = \"box\", dimensions = [0.2, 0.5, 0.7], position = [0.15, -0.1, 0.1], quaternion = {TURN:?} }}"),
        ),
        shaped(
            "stone",
            6.0,
            &format!("{{ type = \"mesh\", file = \"stone.obj\", scale = [1.5, 0.5, 1.0], position = [0.1, 0.05, -0.2], quaternion = {TURN:?} }}"),
        ),
        shaped(
            "pill",
            9.0,
            &format!(
                "{{ type = \"capsule\", dimensions = [0.1, 0.6], position = [0.1, 0.2, -0.2], quaternion = {TURN:?} }}"
            ),
        ),
        shaped(
            "pebble",
            12.0,
            &format!(
                "{{ type = \"ellipsoid\", dimensions = [0.2, 0.3, 0.5], position = [0.1, -0.2, -0.1], quaternion = {TURN:?} }}"
            ),
        ),
        part("contact", "floor") + "a = { plane = {} }\nb = \"*\"\nrestitution = 0.5\n",
    ]
    .concat();
    Case::new("collision", text, |run| {
        let mut checks = Checks::default();
        let egg = V::new(0.1, 0.2, -0.3) - V::z() * 0.2;
        let corner = |k: usize| {
            let half = V::new(0.1, 0.25, 0.35);
            let own = V::from_fn(|i, _| if k >> i & 1 == 1 { half[i] } else { -half[i] });
            V::new(0.15, -0.1, 0.1) + turn() * own
        };
        let vertex = |x: [f64; 3]| {
            V::new(0.1, 0.05, -0.2) + turn() * V::from(x).component_mul(&V::new(1.5, 0.5, 1.0))
        };
        let stone = [[0.0; 3], [0.2, 0.1, -0.3], [0.1, 0.4, 0.2], [-0.3, 0.2, 0.1]].map(vertex);
        let pill = [-0.3, 0.3].map(|h| V::new(0.1, 0.2, -0.2) + turn() * V::z() * h - V::z() * 0.1);
        let half = V::new(0.2, 0.3, 0.5);
        let scaled = turn().tr_mul(&V::z()).component_mul(&half);
        let pebble = V::new(0.1, -0.2, -0.1) - turn() * scaled.normalize().component_mul(&half);
        let bodies = [
            ("pill", pill.to_vec()),
            ("pebble", vec![pebble]),
            ("egg", vec![egg]),
            ("crate", (0..8).map(corner).collect()),
            ("stone", stone.to_vec()),
        ];
        for (name, points) in bodies {
            let lowest =
                points.iter().copied().reduce(|a, b| if b.z < a.z { b } else { a }).unwrap();
            let hit = 1.0 + lowest.z;
            let across = lowest.cross(&V::z());
            let inertia = V::new(0.2, 0.3, 0.4);
            let compliance = 0.5 + across.component_mul(&across).component_div(&inertia).sum();
            let impulse = 1.5 / compliance;
            let height = 1.0 - 0.7 + impulse / 2.0 * (0.7 - hit);
            checks.near(name, end(run, name).z, height, 1e-9);
            let v = run.linear_momentum(0);
            checks.near("momentum", v.z, -10.0, 1e-12);
        }
        checks
    })
    .file("stone.obj", format!("{corners}{faces}"))
    .file("other.obj", format!("{}{faces}", corners.replace("0.4", "0.5").replace("-0.3", "-0.5")))
    .only("body.collision")
}

/// What sensors show of contacts, of a stop and of dry friction, each under its weight.
fn sensors() -> Case {
    let text = [
        heavy("sensors", [0.0, 0.0, -9.81], "step = 0.01, end = 0.2"),
        flying("falls", 2.0, [0.1; 3], [0.0, 0.0, 1.0], [0.0; 3]) + &ball(0.2),
        flying("slides", 3.0, [0.1; 3], [3.0, 0.0, 0.2], [2.0, 1.0, 0.0]) + &ball(0.2),
        flying("rests", 4.0, [0.1; 3], [6.0, 0.0, 0.2], [0.0; 3]) + &ball(0.2),
        part("contact", "below") + "a = { plane = {} }\nb = \"falls\"\n",
        part("contact", "under")
            + "a = { plane = {} }\nb = [\"slides\", \"rests\"]\nfriction = 0.1\n",
        slider("cart", "slide", 2.0) + "rate = 3.0\nfriction = { force = 4.0 }\n",
        body_at([0.0, 5.0, 0.0], "cage", 5.0, [1.0; 3]),
        along([0.0, 0.0, 1.0], "prismatic", "shaft", ["ground", "cage"], [0.0, 5.0, 0.0]),
        "limits = { lower = 0.0 }\n".into(),
        sensor("gap", "gap", "below"),
        sensor("clearance", "clearance", "falls") + "to = \"slides\"\n",
        sensor("force", "contact_force", "under"),
        sensor("on_body", "contact_force", "rests"),
        sensor("slip", "slip", "under"),
        sensor("stop", "stop_force", "shaft"),
        sensor("dry", "friction_torque", "slide"),
    ]
    .concat();
    Case::new("sensors of contacts", text, |run| {
        let mut checks = Checks::default();
        let t = run.t(run.last());
        let last = |name: &str| run.sensor(name, run.last());
        checks.near("gap", last("gap"), 0.8 - 0.5 * 9.81 * t * t, 1e-10);
        // that of the wheel slows down by its friction
        let speed = V::new(2.0, 1.0, 0.0);
        let way = speed * t - speed.normalize() * (0.5 * 0.1 * 9.81 * t * t);
        let between = V::new(3.0, 0.0, 0.2) + way - V::new(0.0, 0.0, 1.0 - 0.5 * 9.81 * t * t);
        checks.near("clearance", last("clearance"), between.norm() - 0.4, 1e-4);
        let across = V::new(2.0, 1.0, 0.0).normalize() * (0.1 * 3.0 * 9.81);
        let force = V::new(0.0, 0.0, 3.0 * 9.81) - across;
        let weight = V::z() * (4.0 * 9.81);
        let of = [("force", force + weight), ("on_body", weight)];
        for (name, force) in of {
            let parts = ["fx", "fy", "fz"].map(|part| last(&format!("{name}.{part}")));
            checks.vector(name, parts.into(), force, 1e-5);
        }
        // in the middle of the step from the last node
        let slip = 5.0_f64.sqrt() - 0.1 * 9.81 * (1.0 + 3.0 * 0.04 / 0.1) * (t + 0.005);
        checks.near("slip", last("slip"), slip, 1e-4);
        checks.near("stop", last("stop"), 5.0 * 9.81, 1e-9);
        checks.near("dry friction", last("dry"), -4.0, 1e-9);
        checks
    })
    .only("sensor")
}

/// Which nodes have contacts that are recorded.
fn recorded() -> Case {
    let text = [
        heavy("recorded", [0.0, 0.0, -9.81], "step = 0.01, end = 0.1, contacts = true"),
        flying("rests", 2.0, [0.1; 3], [0.0, 0.0, 0.2], [0.0; 3]) + &ball(0.2),
        part("contact", "below") + "a = { plane = {} }\nb = \"rests\"\n",
    ]
    .concat();
    Case::new("recorded", text, |run| {
        let mut checks = Checks::default();
        for node in &run.nodes {
            let forces: Vec<f64> = node.contacts.iter().map(|own| own.force[0]).collect();
            checks.all("force", &forces, &[2.0 * 9.81], 1e-9);
        }
        checks
    })
    .settings()
    .only("simulation.contacts")
}

/// Spheres of nodes of beams with a stated radius: the gap to a plane.
fn radius_of_nodes() -> Case {
    let text = [
        head("nodes", "step = 1e-3, end = 1e-3"),
        beam("rope", &[[0.0, 0.0, 0.7], [1.0, 0.0, 0.9]], 2),
        "normal = [0.0, 1.0, 0.0]\nradius = 0.15\n".into(),
        soft_section(),
        part("contact", "below") + "a = { plane = {} }\nb = \"rope.1\"\n",
        sensor("gap", "gap", "below"),
    ]
    .concat();
    Case::new("radius of nodes", text, |run| {
        let mut checks = Checks::default();
        checks.all("gap", &[run.columns_of("gap")[0][0]], &[0.8 - 0.15], 1e-12);
        checks
    })
    .only("beam.radius")
}

/// Two balls that overlap by 0.06 m part in the ratio of their masses; two others only touch.
fn overlapping() -> Case {
    let text = [
        head("overlapping", STEP),
        flying("light", 1.0, [0.1; 3], [0.0; 3], [0.0; 3]) + &ball(0.12),
        flying("heavy", 3.0, [0.1; 3], [0.12, 0.0, 0.16], [0.0; 3]) + &ball(0.14),
        flying("left", 1.0, [0.1; 3], [5.0, 0.0, 0.0], [0.0; 3]) + &ball(0.1),
        flying("right", 1.0, [0.1; 3], [5.2, 0.0, 0.0], [0.0; 3]) + &ball(0.1),
        part("contact", "pair"),
        "a = \"light\"\nb = \"heavy\"\noverlap = \"separate\"\n".into(),
        part("contact", "touching"),
        "a = \"left\"\nb = \"right\"\noverlap = \"refuse\"\n".into(),
    ]
    .concat();
    Case::new("overlapping", text, |run| {
        let mut checks = Checks::default();
        let way = V::new(0.6, 0.0, 0.8) * 0.06;
        let (light, heavy) = (run.place("light", 0), run.place("heavy", 0));
        checks.vector("light", light, -way * 0.75, 1e-12);
        checks.vector("heavy", heavy, V::new(0.12, 0.0, 0.16) + way * 0.25, 1e-12);
        checks
    })
    .only("contact.overlap")
    .blind("contact.overlap `refuse`*", "nothing overlaps there")
    .blind("contact.overlap dropped", "nothing overlaps there")
}

/// A block that a growing force pulls: it breaks loose by static friction, and slides by the other.
fn held() -> Case {
    let text = [
        heavy("held", [0.0, 0.0, -9.81], "step = 0.001, end = 1.0"),
        body_at([0.0, 0.0, 0.1], "block", 2.0, [0.1; 3]),
        "shape = { type = \"box\", dimensions = [0.4, 0.3, 0.2] }\n".into(),
        part("contact", "floor"),
        "a = { plane = {} }\nb = \"block\"\nfriction = 0.3\nstatic_friction = 0.45\n".into(),
        load("pull", "block", [[15.0, 0.0, 0.0], [0.0; 3]]),
        "history = { type = \"ramp\", start = 0.0, end = 1.0 }\n".into(),
    ]
    .concat();
    Case::new("held", text, |run| {
        let mut checks = Checks::default();
        let (weight, t) = (2.0_f64 * 9.81, run.t(run.last()));
        let loose = 0.45 * weight / 15.0;
        let pull = 15.0 * ((t.powi(3) - loose.powi(3)) / 6.0 - 0.5 * loose * loose * (t - loose));
        let way = (pull - 0.5 * 0.3 * weight * (t - loose).powi(2)) / 2.0;
        checks.near("way", end(run, "block").x, way, 4e-3 * way);
        checks
    })
    .only("contact.static_friction")
}

/// Three balls that touch: hit one after the other, the last one takes all of the velocity.
fn sequence() -> Case {
    let own = |name: &str, x: f64, v: f64| {
        flying(name, 1.0, [0.1; 3], [x, 0.0, 0.0], [v, 0.0, 0.0]) + &ball(0.1)
    };
    let text = [
        head("sequence", "step = 0.01, end = 1.0, impact = \"sequential\""),
        own("a", -0.7, 1.0),
        own("b", 0.0, 0.0),
        own("c", 0.2, 0.0),
        part("contact", "balls") + "a = \"*\"\nb = \"*\"\nrestitution = 1.0\n",
    ]
    .concat();
    Case::new("sequence", text, |run| {
        let mut checks = Checks::default();
        let x = ["a", "b", "c"].map(|name| end(run, name).x);
        checks.all("places", &x, &[-0.2, 0.0, 0.7], 1e-10);
        checks
    })
    .settings()
    .only("simulation.impact")
}

/// A spinning ball that grips: after Moreau its slip comes back, after Newton it rolls.
fn thrown_back() -> [Case; 2] {
    [("moreau", 0.6), ("newton", 0.0)].map(|(impact, back)| {
        let text = [
            head("thrown", &format!("step = 0.01, end = 0.4, impact = \"{impact}\"")),
            flying("ball", 2.0, [0.04; 3], [0.0, 0.0, 0.6], [1.0, 0.0, -2.0]) + &ball(0.2),
            "angular_velocity = [0.0, -4.0, 0.0]\n".into(),
            part("contact", "floor"),
            "a = { plane = {} }\nb = \"ball\"\nfriction = 1.5\nrestitution = 0.6\n".into(),
        ]
        .concat();
        Case::new(format!("thrown back by {impact}"), text, move |run| {
            let mut checks = Checks::default();
            let slip = 1.0 + 0.2 * 4.0;
            let impulse = -(1.0 + back) * slip / (0.5 + 0.2 * 0.2 / 0.04);
            checks.near("x", end(run, "ball").x, 0.4 + impulse / 2.0 * 0.2, 1e-10);
            checks.near("z", end(run, "ball").z, 0.2 + 0.6 * 2.0 * 0.2, 1e-10);
            checks
        })
        .settings()
        .only("simulation.impact")
        .blind_if(impact == "newton", "simulation.impact `newton`*", "one point is hit")
        .blind_if(impact == "newton", "simulation.impact dropped", "it is the default")
    })
}

pub(super) fn cases() -> Vec<Case> {
    let mut all = vec![planes(), friction(), pairs(), collision(), sensors(), recorded()];
    all.extend([overlapping(), held(), sequence(), radius_of_nodes()]);
    all.extend(thrown_back());
    all
}
