//! Bodies and a point mass, with a spring, a damper and a motor on a joint, a drive, a spring
//! between points, a load.

mod momenta;
mod sensors;

use super::{Known, Tables, Vector, axis, check};
use holonom::nalgebra::Matrix3;
use std::f64::consts::TAU;
use vi_testkit::model::{
    FIRST, Rigid, SECOND, along, between, heavy, load, motion, particle, sensor,
};

const GRAVITY: [f64; 3] = [1.0, -2.0, -5.0];
const FREE: Rigid = Rigid { spin: [2.0, 3.1, -1.7], ..FIRST };
const CART: Rigid = Rigid {
    mass: 1.3,
    moments: [0.4, 0.35, 0.3],
    center: [0.7, -1.1, 0.6],
    turned: [0.3, 0.2, -0.5],
    velocity: [0.0; 3],
    spin: [0.0; 3],
};
const HINGE: [f64; 3] = [0.1, 0.9, 0.2];
const ALONG: [f64; 3] = [0.48, 0.6, 0.64];
const FIRST_ACROSS: [f64; 3] = [0.6, -0.48, 0.0]; // first axis of the hinge, not of unit length
const RATES: [f64; 2] = [0.7, 1.3];
const RAIL: [f64; 3] = [0.4, -0.8, 0.5];
const SCREW: [f64; 3] = [0.64, 0.48, 0.6];
const ACROSS: [f64; 3] = [0.6, -0.8, 0.0]; // first axis of the screw
const PATH: [f64; 4] = [1.5, 4.0, 0.1, 2.0]; // rate, acceleration, amplitude, frequency
const PITCH: f64 = 0.9;
const BALL: [[f64; 3]; 2] = [[1.0, 2.0, 2.0], [0.4, -0.2, 0.9]];
const POINT: [f64; 3] = [0.1, -0.3, 0.2];
const FORCE: [f64; 3] = [2.0, -3.0, 4.0];
const TORQUE: [f64; 3] = [0.6, 0.4, -0.5];

fn text() -> String {
    let [rate, acceleration, amplitude, frequency] = PATH;
    let drive = format!(
        "{{ rate = {rate:?}, acceleration = {acceleration:?}, amplitude = {amplitude:?}, frequency = {frequency:?} }}"
    );
    let members = ["free", "arm", "cart"].map(|name| {
        sensor(&format!("v_{name}"), "velocity", name)
            + &sensor(&format!("a_{name}"), "acceleration", name)
            + &sensor(&format!("q_{name}"), "orientation", name)
            + &sensor(&format!("w_{name}"), "angular_velocity", name)
            + &sensor(&format!("r_{name}"), "angular_acceleration", name)
    });
    let ball = sensor("v_ball", "velocity", "ball") + &sensor("a_ball", "acceleration", "ball");
    let joints = ["coordinate", "rate", "acceleration"].map(|what| {
        let kind = format!("joint_{what}");
        sensor(&format!("hinge_{what}"), &kind, "hinge")
            + &sensor(&format!("rail_{what}"), &kind, "rail")
    });
    let others = [
        sensor("x", "position", "free") + &format!("point = {POINT:?}\n"),
        sensor("hinge_effort", "effort", "hinge"),
        sensor("hinge_power", "power", "hinge"),
        sensor("cord_effort", "effort", "cord"),
        sensor("cord_power", "power", "cord"),
        sensor("cord_length", "length", "cord"),
        sensor("cord_rate", "length_rate", "cord"),
        sensor("drive_effort", "effort", "drive"),
        sensor("drive_power", "power", "drive"),
        sensor("push_power", "power", "push"),
        sensor("reaction", "reaction", "rail") + "frame = \"space\"\n",
        sensor("held", "reaction", "hinge"),
    ];
    [
        heavy("columns", GRAVITY, "step = 1e-3, end = 0.3, momenta = true"),
        FREE.text("free"),
        SECOND.still("arm"),
        CART.still("cart"),
        along(ALONG, "cylindrical", "hinge", ["ground", "arm"], HINGE),
        format!("first_axis = {FIRST_ACROSS:?}\nrate = {RATES:?}\n"),
        "spring = { freedom = 1, stiffness = 4.0, rest = 0.3 }\n".into(),
        "damper = { freedom = 0, damping = 2.5 }\n".into(),
        "motor = { freedom = 1, effort = 2.0, history = { type = \"harmonic\", frequency = 1.3, phase = 0.4 } }\n".into(),
        along(SCREW, "screw", "rail", ["ground", "cart"], RAIL),
        format!("pitch = {PITCH}\nfirst_axis = {ACROSS:?}\nrate = {:?}\n", path(0.0)[1]),
        motion("drive", "rail", &drive),
        particle("ball", 0.6, BALL[0]) + &format!("velocity = {:?}\n", BALL[1]),
        between("spring", "cord", ["free", "ball"]),
        "stiffness = 8.0\nnatural_length = 2.4\ndamping = 1.3\n".into(),
        load("push", "arm", [FORCE, TORQUE]),
        format!("point = {POINT:?}\nframe = \"body\"\n"),
        members.concat(),
        ball,
        joints.concat(),
        others.concat(),
    ]
    .concat()
}

/// The path of the drive, its rate and acceleration.
fn path(t: f64) -> [f64; 3] {
    let [rate, acceleration, amplitude, frequency] = PATH;
    let w = TAU * frequency;
    let sine = (w * t).sin();
    [
        rate * t + 0.5 * acceleration * t * t + amplitude * sine,
        rate + acceleration * t + amplitude * w * (w * t).cos(),
        acceleration - amplitude * w * w * sine,
    ]
}

/// A body with its initial velocities.
fn body(name: &str) -> Rigid {
    let moving = |body: Rigid, axis: [f64; 3], at: [f64; 3], [slide, turn]: [f64; 2]| {
        let (axis, arm) = (Vector::from(axis), Vector::from(body.center) - Vector::from(at));
        let spin = turn * axis;
        Rigid { velocity: (slide * axis + spin.cross(&arm)).into(), spin: spin.into(), ..body }
    };
    match name {
        "free" => FREE,
        "arm" => moving(SECOND, ALONG, HINGE, RATES),
        _ => moving(CART, SCREW, RAIL, [PITCH / TAU * path(0.0)[1], path(0.0)[1]]),
    }
}

/// Euler's tensor: `Σ_I E_I d_I ⊗ d_I` is the second moment of the mass.
fn euler(body: &Rigid) -> [f64; 3] {
    let half = 0.5 * body.moments.iter().sum::<f64>();
    body.moments.map(|moment| half - moment)
}

/// Entries of vectors.
fn entries(vectors: &[Vector], k: usize) -> Vec<f64> {
    vectors.iter().map(|vector| vector[k]).collect()
}

const BODIES: [&str; 3] = ["free", "arm", "cart"];

/// Of a member: centres, velocities, and mass.
fn members(t: &Tables) -> Vec<(Vec<Vector>, Vec<Vector>, f64)> {
    let one = |name: &str, mass: f64| {
        (t.vectors(&format!("trajectory/{name}")), t.vectors(&format!("sensors/v_{name}")), mass)
    };
    let mut all: Vec<_> = BODIES.iter().map(|name| one(name, body(name).mass)).collect();
    all.push(one("ball", 0.6));
    all
}

/// `R J Rᵀ ω` of a body.
fn spin(t: &Tables, name: &str) -> Vec<Vector> {
    let moments = Matrix3::from_diagonal(&body(name).moments.into());
    let w = t.vectors(&format!("sensors/w_{name}"));
    t.directors(name).iter().zip(w).map(|(d, w)| d * moments * d.transpose() * w).collect()
}

fn sum(parts: &[Vec<f64>]) -> Vec<f64> {
    (0..parts[0].len()).map(|row| parts.iter().map(|part| part[row]).sum()).collect()
}

fn kinetic(t: &Tables) -> Vec<f64> {
    let mut all: Vec<Vec<f64>> = members(t)
        .into_iter()
        .map(|(_, v, mass)| v.iter().map(|v| 0.5 * mass * v.norm_squared()).collect())
        .collect();
    for name in BODIES {
        let w = t.vectors(&format!("sensors/w_{name}"));
        all.push(spin(t, name).iter().zip(&w).map(|(l, w)| 0.5 * l.dot(w)).collect());
    }
    sum(&all)
}

fn gravity(t: &Tables) -> Vec<f64> {
    let g = Vector::from(GRAVITY);
    let all: Vec<Vec<f64>> = members(t)
        .into_iter()
        .map(|(x, _, mass)| x.iter().map(|x| -mass * g.dot(x)).collect())
        .collect();
    sum(&all)
}

fn map(of: &[f64], f: impl Fn(f64) -> f64) -> Vec<f64> {
    of.iter().map(|x| f(*x)).collect()
}

fn springs(t: &Tables) -> Vec<f64> {
    let cord = map(&lengths(t), |l| 4.0 * (l - 2.4).powi(2));
    let hinge = map(t.column("sensors/hinge_coordinate.theta"), |a| 2.0 * (a - 0.3).powi(2));
    sum(&[cord, hinge])
}

fn lengths(t: &Tables) -> Vec<f64> {
    let free = t.vectors("trajectory/free");
    t.vectors("trajectory/ball").iter().zip(free).map(|(x, y)| (x - y).norm()).collect()
}

fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

/// What the trajectory has to be.
fn trajectory(t: &Tables, column: &str) -> Option<Known> {
    let rows = 0..t.rows();
    match column {
        "step" => return Some(Known::new(rows.map(|k| k as f64).collect(), 1e-9)),
        "t" => return Some(Known::new(rows.map(|k| k as f64 * t.h).collect(), 1e-14)),
        "E" => {
            let parts = ["kinetic", "potential"]
                .map(|part| t.column(&format!("momenta/E_d.{part}")).to_vec());
            return Some(Known::new(sum(&parts), 1e-11));
        }
        "H" => return Some(Known::new(sum(&[kinetic(t), gravity(t), springs(t)]), 1e-10)),
        _ => {}
    }
    if let Some((name, part)) = column.split_once('.') {
        if let Some(k) = "xyz".find(part) {
            let (first, rate) = match name {
                "ball" => (BALL[0], t.vectors("sensors/v_ball")),
                _ => (body(name).center, t.vectors(&format!("sensors/v_{name}"))),
            };
            return Some(Known::new(t.integral(first[k], &entries(&rate, k)), 5e-5));
        }
        let turned = t.rotations(body(name).rotation(), &t.vectors(&format!("sensors/w_{name}")));
        let director = part[1..2].parse::<usize>().unwrap() - 1;
        let values = turned.iter().map(|r| r[(axis(part), director)]).collect();
        return Some(Known::new(values, 2e-5));
    }
    let k = axis(column);
    let all: Vec<Vec<f64>> = if column.starts_with('P') {
        let momenta = members(t).into_iter().map(|(_, v, mass)| map(&entries(&v, k), |v| mass * v));
        momenta.collect()
    } else {
        let moments = members(t)
            .into_iter()
            .map(|(x, v, mass)| x.iter().zip(&v).map(|(x, v)| mass * x.cross(v)[k]).collect());
        moments.chain(BODIES.map(|name| entries(&spin(t, name), k))).collect()
    };
    Some(Known::new(sum(&all), 1e-9))
}

/// What the energies have to be.
fn energies(t: &Tables, column: &str) -> Option<Known> {
    let work = |power: &str| t.integral(0.0, t.column(&format!("sensors/{power}")));
    let (values, tolerance) = match column {
        "kinetic" => (kinetic(t), 1e-10),
        "gravity" => (gravity(t), 1e-10),
        "springs" => (springs(t), 1e-10),
        "total" => {
            let parts = ["kinetic", "gravity", "springs"]
                .map(|part| t.column(&format!("energy/{part}")).to_vec());
            (sum(&parts), 1e-11)
        }
        "work.cord" => {
            // of the damper alone: what its spring takes is potential energy
            let rate = t.column("sensors/cord_rate");
            (t.integral(0.0, &map(rate, |rate| -1.3 * rate * rate)), 1e-4)
        }
        "work.hinge.damper" => (work("hinge_power.damper"), 2e-5),
        "work.hinge.motor" => (work("hinge_power.motor"), 1e-4),
        "work.push" => (work("push_power"), 2e-4),
        "work_of_motions" => (work("drive_power"), 2e-4),
        "balance" => {
            let total = t.column("energy/total");
            let works = [
                "work.cord",
                "work.hinge.damper",
                "work.hinge.motor",
                "work.push",
                "work_of_motions",
            ];
            let works = sum(&works.map(|work| t.column(&format!("energy/{work}")).to_vec()));
            (total.iter().zip(&works).map(|(e, w)| e - total[0] - w).collect(), 1e-11)
        }
        _ => return None,
    };
    Some(Known::new(values, tolerance))
}

fn expected(t: &Tables, name: &str) -> Option<Known> {
    let (file, column) = name.split_once('/').unwrap();
    match (file, column) {
        (_, "step" | "t") | ("trajectory", _) => trajectory(t, column),
        ("sensors", _) => sensors::expected(t, column),
        ("energy", _) => energies(t, column),
        ("momenta", _) => momenta::expected(t, column),
        ("residuals", "newton_iterations") => {
            let found = t.column("residuals/newton_iterations");
            let most = found.iter().copied().fold(0.0, f64::max);
            assert!((most - t.summary.as_ref().unwrap().newton_iterations.max).abs() < 0.1);
            let whole = |(k, x): (usize, &f64)| if k == 0 { 0.0 } else { x.round().max(1.0) };
            Some(Known::new(found.iter().enumerate().map(whole).collect(), 1e-4))
        }
        // rows of joints are of the same size: see the free body
        ("residuals", "momentum") => Some(Known::new(vec![0.0; t.rows()], 1e-4)),
        ("residuals", _) => Some(Known::new(vec![0.0; t.rows()], 1e-11)),
        _ => None,
    }
}

#[test]
fn columns_of_a_rigid_system() {
    let unseen = [
        ("momenta/lambda.arm", "rows as those of the free body, with the forces of the joint"),
        ("momenta/lambda.cart", "likewise"),
        ("momenta/p_reduced.free.4 late", "the moment of a force at the centre is zero"),
        ("momenta/p_reduced.free.5 late", "likewise"),
        ("momenta/p_reduced.free.6 late", "likewise"),
        ("residuals/position", "round-off"),
        ("residuals/momentum", "see the free body"),
        ("residuals/velocity", "round-off"),
        ("sensors/drive_effort.unique late", "it is always"),
        ("sensors/reaction.unique late", "it is always"),
        ("sensors/held.unique late", "it is always"),
        ("sensors/held.fz", "nothing holds along the axis"),
        ("sensors/held.mz", "nothing holds about the axis"),
    ];
    check(&Tables::of("rigid", &text()), &expected, &unseen);
}

/// The residual (46) where it is not round-off.
#[test]
fn the_momentum_residual_of_a_free_body() {
    let text = format!(
        "model = {{ name = \"free\" }}\nsimulation = {{ step = 0.02, end = 2.0, momenta = true }}\n{}",
        FREE.text("free")
    );
    let expected = |t: &Tables, name: &str| match name {
        "residuals/momentum" => Some(Known::new(momenta::off_manifold(t), 1e-12)),
        _ => None,
    };
    let others = ["energy", "momenta", "trajectory", "residuals/step", "residuals/t "];
    let others =
        [&others[..], &["residuals/position", "residuals/velocity", "residuals/newton"]].concat();
    let unseen: Vec<_> = others.iter().map(|begin| (*begin, "of the rigid system")).collect();
    check(&Tables::of("free", &text), &expected, &unseen);
}
