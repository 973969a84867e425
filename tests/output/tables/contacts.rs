//! Contacts, a stop and dry friction under loads that vary: forces by the loads beside a node,
//! slips and places by sums of them, impacts of a ball between two walls in closed form.

use super::{Known, Tables, Vector, axis, check};
use std::f64::consts::TAU;
use vi_testkit::model::{AXES, along, body, body_at, head, load, part, sensor, slider};

const H: f64 = 1e-3;
const STEPS: usize = 200;

/// A ball that slides on a plane, pressed onto it.
struct Sliding {
    name: &'static str,
    mass: f64,
    inertia: f64,
    radius: f64,
    friction: f64,
    at: Vector, // where it touches at the start
    normal: Vector,
    v: Vector,
    force: f64,
    frequency: f64,
}

fn balls() -> [Sliding; 2] {
    let normals = [Vector::new(2.0, 3.0, 6.0) / 7.0, Vector::new(-4.0, 1.0, 8.0) / 9.0];
    let [a, b] = normals;
    [
        Sliding {
            name: "near",
            mass: 2.0,
            inertia: 0.1,
            radius: 0.2,
            friction: 0.3,
            at: Vector::new(0.3, -0.4, 0.7),
            normal: a,
            v: a.cross(&Vector::new(2.0, 1.0, -4.0)),
            force: 20.0,
            frequency: 1.0,
        },
        Sliding {
            name: "far",
            mass: 1.5,
            inertia: 0.05,
            radius: 0.25,
            friction: 0.2,
            at: Vector::new(9.0, 8.5, -7.7),
            normal: b,
            v: b.cross(&Vector::new(-1.0, 3.0, 2.0)),
            force: 35.0,
            frequency: 0.7,
        },
    ]
}

const PHASE: f64 = 0.5;
const STOP: [f64; 2] = [12.0, 0.9];
const DRY: [f64; 2] = [40.0, 1.1];
/// Of the ball between the walls: radius, mass, restitution, velocity, the gaps at the start.
const BETWEEN: ([f64; 4], [f64; 2]) = ([0.1, 0.8, 0.9, 5.0], [0.0413, 0.0587]);

/// A load along a direction, with its history.
fn pressing(name: &str, body: &str, along: Vector, frequency: f64) -> String {
    load(name, body, [along.into(), [0.0; 3]])
        + &format!(
            "history = {{ type = \"harmonic\", frequency = {frequency:?}, phase = {PHASE:?} }}\n"
        )
}

fn plane(name: &str, point: Vector, normal: Vector, b: &str, keys: &str) -> String {
    let (point, normal): ([f64; 3], [f64; 3]) = (point.into(), normal.into());
    let plane = format!("a = {{ plane = {{ position = {point:?}, normal = {normal:?} }} }}\n");
    format!("{}{plane}b = \"{b}\"\n{keys}\n", part("contact", name))
}

fn text() -> String {
    let sliding = |own: &Sliding| {
        let center: [f64; 3] = (own.at + own.normal * own.radius).into();
        let v: [f64; 3] = own.v.into();
        body_at(center, own.name, own.mass, [own.inertia; 3])
            + &format!(
                "velocity = {v:?}\nshape = {{ type = \"sphere\", dimensions = [{:?}] }}\n",
                own.radius
            )
            + &pressing(
                &format!("on {}", own.name),
                own.name,
                own.normal * -own.force,
                own.frequency,
            )
            + &plane(
                &format!("under {}", own.name),
                own.at,
                own.normal,
                own.name,
                &format!("friction = {:?}", own.friction),
            )
    };
    [
        head("contacts", &format!("step = {H:?}, end = {:?}, contacts = true", H * STEPS as f64)),
        balls().iter().map(sliding).collect(),
        slider("cart", "slide", 2.0) + "limits = { lower = 0.0 }\n",
        pressing("on cart", "cart", Vector::x() * -STOP[0], STOP[1]),
        body("sledge", 3.0, [1.0; 3]),
        along(AXES[0], "prismatic", "guide", ["ground", "sledge"], [0.0; 3]),
        "rate = 4.0\nfriction = { coefficient = 0.25 }\n".into(),
        pressing("on sledge", "sledge", Vector::z() * -DRY[0], DRY[1]),
        sensor("force", "contact_force", "under near"),
        sensor("force_on_far", "contact_force", "far"),
        sensor("slip", "slip", "under far"),
        sensor("stop", "stop_force", "slide"),
        sensor("dry", "friction_torque", "guide"),
    ]
    .concat()
}

/// A ball between two walls.
fn bounces() -> String {
    let ([radius, mass, restitution, v], [left, right]) = BETWEEN;
    let bounces = format!("restitution = {restitution:?}");
    head("bounces", &format!("step = {H:?}, end = {:?}", H * STEPS as f64))
        + &body("between", mass, [0.1; 3])
        + &format!(
            "velocity = [-{v:?}, 0.0, 0.0]\nshape = {{ type = \"sphere\", dimensions = [{radius:?}] }}\n"
        )
        + &plane("left", Vector::x() * -(radius + left), Vector::x(), "between", &bounces)
        + &plane("right", Vector::x() * (radius + right), -Vector::x(), "between", &bounces)
        + &sensor("gap", "gap", "left")
}

/// The mean of a load in the middle of both steps beside a node; of the first that of its step.
fn mean(force: f64, frequency: f64, node: usize) -> f64 {
    let at = |t: f64| force * (TAU * frequency * t * H + PHASE).sin();
    let n = node as f64;
    if node == 0 { at(0.5) } else { 0.5 * (at(n - 0.5) + at(n + 0.5)) }
}

/// A sliding ball at a node: place of its contact, normal force, slip of the step from there.
fn slides(own: &Sliding) -> Vec<(Vector, f64, f64)> {
    let along = own.v.normalize();
    let (mut x, mut v, mut slip) = (own.at, own.v.norm(), own.v.norm());
    let mut found = Vec::new();
    for node in 0..=STEPS {
        let normal = mean(own.force, own.frequency, node);
        let impulse = own.friction * normal * H * if node == 0 { 0.5 } else { 1.0 };
        v -= impulse / own.mass;
        slip -= impulse * (1.0 / own.mass + own.radius * own.radius / own.inertia);
        found.push((x, normal, slip));
        x += along * (v * H);
    }
    found
}

/// Time and velocity before each impact between the walls, and the place at a time.
fn impacts() -> (Vec<[f64; 2]>, impl Fn(f64) -> f64) {
    let ([_, _, restitution, v], [left, right]) = BETWEEN;
    let (mut t, mut x, mut v) = (0.0, 0.0, -v);
    let mut all = Vec::new();
    loop {
        let wall = if v < 0.0 { -left } else { right };
        let hit = t + (wall - x) / v;
        if hit >= H * STEPS as f64 {
            break;
        }
        all.push([hit, v.abs()]);
        (t, x, v) = (hit, wall, -restitution * v);
    }
    let known = all.clone();
    let at = move |time: f64| {
        let before = known.iter().rposition(|[t, _]| *t <= time);
        let (t, x, v) = match before {
            None => (0.0, 0.0, -5.0),
            Some(k) => {
                let [t, v] = known[k];
                if k % 2 == 0 { (t, -left, restitution * v) } else { (t, right, -restitution * v) }
            }
        };
        x + v * (time - t)
    };
    (all, at)
}

fn expected(tables: &Tables, name: &str) -> Option<Known> {
    let (file, column) = name.split_once('/')?;
    let known = |values: Vec<f64>, tolerance| Some(Known::new(values, tolerance));
    let [near, far] = balls();
    let found = [slides(&near), slides(&far)];
    // both at each node, one after the other
    let both = |of: &dyn Fn(&Sliding, &(Vector, f64, f64), usize) -> f64| -> Vec<f64> {
        let all = (0..=STEPS).flat_map(|n| [(&near, &found[0], n), (&far, &found[1], n)]);
        all.map(|(own, found, n)| of(own, &found[n], n)).collect()
    };
    let force = |own: &Sliding, normal: f64| {
        own.normal * normal - own.v.normalize() * (own.friction * normal)
    };
    match file {
        "contacts" => match column {
            "step" => known(both(&|_, _, n| n as f64), 1e-9),
            "t" => known(both(&|_, _, n| n as f64 * H), 1e-12),
            "feature" => known(both(&|_, _, _| 0.0), 1e-9),
            "gap" => known(both(&|_, _, _| 0.0), 1e-12),
            "x" | "y" | "z" => known(both(&|_, own, _| own.0[axis(column)]), 1e-9),
            "nx" | "ny" | "nz" => known(both(&|own, _, _| own.normal[axis(column)]), 1e-12),
            "normal" => known(both(&|_, own, _| own.1), 1e-6),
            "slip" => known(both(&|_, own, _| own.2), 1e-5),
            "tx" | "ty" | "tz" => {
                let across = |own: &Sliding, at: &(Vector, f64, f64)| {
                    -own.v.normalize()[axis(column)] * own.friction * at.1
                };
                known(both(&|own, at, _| across(own, at)), 1e-6)
            }
            _ => None,
        },
        "events" => {
            let ([_, mass, e, _], _) = BETWEEN;
            let all = |of: &dyn Fn([f64; 2]) -> f64| impacts().0.into_iter().map(of).collect();
            match column {
                "t" => known(all(&|[t, _]| t), 1e-10),
                "energy_lost" => known(all(&|[_, v]| 0.5 * mass * v * v * (1.0 - e * e)), 1e-9),
                "impulse" => known(all(&|[_, v]| mass * v * (1.0 + e)), 1e-9),
                "before" => known(all(&|[_, v]| -v), 1e-9),
                "after" => known(all(&|[_, v]| e * v), 1e-9),
                _ => None,
            }
        }
        _ => {
            let each = |of: &dyn Fn(usize) -> f64| (0..=STEPS).map(of).collect::<Vec<f64>>();
            let on = |own: &Sliding, k: usize, n: usize| force(own, found[k][n].1)[axis(column)];
            let t = tables.column("sensors/t");
            match column {
                "step" => known(each(&|n| n as f64), 1e-9),
                "t" => known(each(&|n| n as f64 * H), 1e-12),
                "gap" => {
                    let place = impacts().1;
                    known(each(&|n| place(t[n]) + BETWEEN.1[0]), 1e-9)
                }
                "slip" => known(each(&|n| found[1][n].2), 1e-5),
                "stop" => known(each(&|n| mean(STOP[0], STOP[1], n)), 1e-6),
                "dry" => known(each(&|n| -0.25 * mean(DRY[0], DRY[1], n)), 1e-6),
                _ if column.starts_with("force.") => known(each(&|n| on(&near, 0, n)), 1e-6),
                _ => known(each(&|n| on(&far, 1, n)), 1e-6),
            }
        }
    }
}

#[test]
fn columns_of_contacts() {
    let mut tables = Tables::of("contacts", &text());
    tables.keep(&["contacts", "sensors"]);
    check(
        &tables,
        &expected,
        &[
            ("contacts/contact unknown", "a name"),
            ("contacts/a unknown", "a name"),
            ("contacts/b unknown", "a name"),
            ("contacts/state unknown", "a name"),
            ("contacts/unique unknown", "a name"),
            ("contacts/feature", "the same at all rows"),
            ("contacts/gap", "what touches has none"),
        ],
    );
}

#[test]
fn columns_of_impacts() {
    let mut tables = Tables::of("bounces", &bounces());
    let counts = tables.summary.as_ref().and_then(|summary| summary.contacts).unwrap();
    assert_eq!(counts.impacts, impacts().0.len() as u64);
    assert_eq!((counts.exhausted, counts.guarded), (0, 0));
    tables.keep(&["events", "sensors"]);
    let names = [("events/event unknown", "a name"), ("events/action unknown", "a name")];
    check(&tables, &expected, &names);
}

/// What the columns with names hold, in a run with everything that a contact does.
#[test]
fn a_ball_that_bounces_slides_rolls_and_leaves() {
    let text = head("bouncing", "step = 2e-3, end = 1.2, contacts = true, every = 5")
        .replace("name =", "gravity = [0.0, 0.0, -9.81], name =")
        + &body_at([0.0, 0.0, 0.12], "ball", 1.0, [0.004; 3])
        + "velocity = [1.0, 0.0, 0.0]\nshape = { type = \"sphere\", dimensions = [0.1] }\n"
        + &plane(
            "floor",
            Vector::zeros(),
            Vector::z(),
            "ball",
            "friction = 0.2\nrestitution = 0.3",
        )
        + &load("lift", "ball", [[0.0, 0.0, 30.0], [0.0; 3]])
        + "history = { type = \"pulse\", start = 1.0, end = 1.2 }\n";
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("tables/bouncing");
    drop(Tables::of("bouncing", &text));
    let read = |name: &str| std::fs::read_to_string(path.join(name)).unwrap();
    let contacts = read("contacts.csv");
    let states = contacts.lines().skip(1).map(|line| {
        assert!(line.contains(",floor,ground,ball,0,"), "{line}");
        let own: Vec<&str> = line.rsplit(',').take(2).collect();
        assert_eq!(own[0], "all", "a ball touches at one point: {line}");
        own[1]
    });
    let states: Vec<&str> = states.collect();
    let slips = states.iter().take_while(|own| **own == "slip").count();
    assert!(slips > 2 && slips < states.len(), "{contacts}");
    assert!(states[slips..].iter().all(|own| *own == "stick"), "{contacts}");
    let events = read("events.csv");
    let actions: Vec<&str> = events.lines().skip(1).map(|l| l.split(',').nth(2).unwrap()).collect();
    let impacts = actions.iter().take_while(|own| **own == "impact ball").count();
    assert!((2..12).contains(&impacts), "{events}");
    assert_eq!(actions[impacts..], ["touch ball", "stick ball", "separate ball"], "{events}");
    let fields = |k: usize| events.lines().nth(k).unwrap().split(',').collect::<Vec<_>>();
    assert_eq!(fields(0).join(","), "t,event,action,energy_lost,impulse,before,after");
    assert_eq!(fields(1)[1], "floor");
    assert_eq!(fields(impacts + 2)[3..], ["0.0", "", "", ""], "nothing is lost where it rolls");
}
