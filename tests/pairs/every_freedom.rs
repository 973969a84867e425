//! A spring, a damper and a motor on each freedom of each joint, wound beyond a turn, against
//! Lagrange's equations in the joint coordinates, integrated here:
//! ```text
//! d/dt (M(θ) θ̇) − ½ ∂/∂θ (θ̇ᵀ M(θ) θ̇) = m g·∂x/∂θ + e_f (−k (θ_f − rest) − c θ̇_f + τ(t, θ_f, θ̇_f))
//! ```
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{model, samples};
use holonom::{Sample, Simulation};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};
use std::f64::consts::TAU;
use vi_testkit::model::{along, body_at, heavy, sensor};

const MASS: f64 = 1.7;
const MOMENTS: [f64; 3] = [0.3, 0.5, 0.6];
const TURNED: [f64; 3] = [0.4, -0.3, 0.7]; // rotation vector of the body initially
const CENTER: [f64; 3] = [0.5, 0.2, -0.3];
const GRAVITY: [f64; 3] = [1.0, -2.0, -5.0];
const PLACE: [f64; 3] = [0.1, -0.2, 0.15];
const AXIS: [f64; 3] = [0.0, 0.6, 0.8];
const ACROSS: [f64; 3] = [1.0, 0.0, 0.0]; // first axis, second axis of a universal joint
const PITCH: f64 = 0.4; // m per revolution
const RATES: [f64; 3] = [0.9, -0.7, 0.5];
const SPIN: f64 = 11.0; // of the freedom under test, where it is an angle
const STIFFNESS: f64 = 6.0;
const DAMPING: f64 = 0.35;
const EFFORT: f64 = 2.5;
const GAINS: [f64; 2] = [1.5, 0.2];
const END: f64 = 1.0;

/// A joint between the ground and the body, in its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    Revolute,
    Prismatic,
    Cylindrical,
    Planar,
    Universal,
    Screw,
}

use Kind::{Cylindrical, Planar, Prismatic, Revolute, Screw, Universal};

/// A coordinate: along an axis, about one, or both (m per rad).
#[derive(Clone, Copy)]
pub(crate) struct Freedom {
    axis: Vector3<f64>,
    slide: f64,
    turn: f64,
}

impl Kind {
    pub(crate) const ALL: [Self; 6] = [Revolute, Prismatic, Cylindrical, Planar, Universal, Screw];

    pub(crate) fn freedoms(self) -> Vec<Freedom> {
        let (n, first) = (Vector3::from(AXIS), Vector3::from(ACROSS));
        let slide = |axis| Freedom { axis, slide: 1.0, turn: 0.0 };
        let turn = |axis| Freedom { axis, slide: 0.0, turn: 1.0 };
        match self {
            Revolute => vec![turn(n)],
            Prismatic => vec![slide(n)],
            Cylindrical => vec![slide(n), turn(n)],
            Planar => vec![slide(first), slide(n.cross(&first)), turn(n)],
            Universal => vec![turn(n), turn(first)],
            Screw => vec![Freedom { axis: n, slide: PITCH / TAU, turn: 1.0 }],
        }
    }

    /// Centre, rotation since the beginning, and the twists `(∂x/∂θ_i, axis of rotation)`.
    fn place(self, theta: &[f64]) -> (Vector3<f64>, Matrix3<f64>, Vec<[Vector3<f64>; 2]>) {
        let freedoms = self.freedoms();
        let (mut rotation, mut point) = (Matrix3::identity(), Vector3::from(PLACE));
        let mut axes = Vec::new();
        for (freedom, theta) in freedoms.iter().zip(theta) {
            let axis = rotation * freedom.axis;
            axes.push(axis);
            point += freedom.slide * *theta * axis;
            let own = Rotation3::new(freedom.axis * (freedom.turn * theta));
            rotation *= own.matrix();
        }
        let center = point + rotation * (Vector3::from(CENTER) - Vector3::from(PLACE));
        let twist = |(freedom, axis): (&Freedom, &Vector3<f64>)| {
            let spin = freedom.turn * axis;
            [freedom.slide * axis + spin.cross(&(center - point)), spin]
        };
        let twists = freedoms.iter().zip(&axes).map(twist).collect();
        (center, rotation, twists)
    }

    fn mass(self, theta: &[f64]) -> DMatrix<f64> {
        let (_, rotation, twists) = self.place(theta);
        let own = rotation * Rotation3::new(Vector3::from(TURNED)).matrix();
        let inertia = own * Matrix3::from_diagonal(&Vector3::from(MOMENTS)) * own.transpose();
        let d = twists.len();
        DMatrix::from_fn(d, d, |i, j| {
            let ([x, w], [y, v]) = (&twists[i], &twists[j]);
            MASS * x.dot(y) + w.dot(&(inertia * v))
        })
    }
}

/// What acts on one freedom.
#[derive(Clone, Copy)]
pub(crate) struct Acting {
    pub(crate) freedom: usize,
    pub(crate) rest: f64,
}

fn history(t: f64) -> f64 {
    (TAU * 1.3 * t + 0.4).sin()
}

/// The path of the motor's control, and its rate.
fn path(t: f64) -> [f64; 2] {
    let angle = TAU * 0.8 * t + 0.2;
    let sine = 0.25 * (angle.sin() - 0.2_f64.sin());
    [0.3 + 1.1 * t + 0.35 * t * t + sine, 1.1 + 0.7 * t + 0.25 * TAU * 0.8 * angle.cos()]
}

impl Acting {
    /// Efforts of spring, damper and motor.
    fn efforts(self, t: f64, theta: f64, rate: f64) -> [f64; 3] {
        let [to, to_rate] = path(t);
        let motor = EFFORT * history(t) + GAINS[0] * (to - theta) + GAINS[1] * (to_rate - rate);
        [-STIFFNESS * (theta - self.rest), -DAMPING * rate, motor]
    }

    /// `(θ, θ̇, work of the damper, work of the motor)˙`.
    fn rate(self, kind: Kind, t: f64, y: &[f64]) -> Vec<f64> {
        let d = kind.freedoms().len();
        let (theta, nu) = (&y[..d], DVector::from_column_slice(&y[d..2 * d]));
        let mass = kind.mass(theta);
        let (_, _, twists) = kind.place(theta);
        let mut right =
            DVector::from_fn(d, |i, _| MASS * Vector3::from(GRAVITY).dot(&twists[i][0]));
        let efforts = self.efforts(t, theta[self.freedom], nu[self.freedom]);
        right[self.freedom] += efforts.iter().sum::<f64>();
        for k in 0..d {
            const E: f64 = 1e-4;
            let at = |e: f64| {
                let mut moved = theta.to_vec();
                moved[k] += e;
                kind.mass(&moved)
            };
            // of fourth order
            let slope = (8.0 * (at(E) - at(-E)) - (at(2.0 * E) - at(-2.0 * E))) / (12.0 * E);
            right -= &slope * &nu * nu[k];
            right[k] += 0.5 * (nu.transpose() * &slope * &nu)[0];
        }
        let acceleration = mass.lu().solve(&right).unwrap();
        let power = nu[self.freedom];
        let works = [efforts[1] * power, efforts[2] * power];
        nu.iter().chain(acceleration.iter()).chain(&works).copied().collect()
    }

    /// `y` at multiples of `h`, by the classical Runge–Kutta method with two steps in each.
    pub(crate) fn integrate(self, kind: Kind, y: Vec<f64>, h: f64) -> Vec<Vec<f64>> {
        const PARTS: usize = 2;
        let e = h / PARTS as f64;
        let plus = |y: &[f64], k: &[f64], s: f64| -> Vec<f64> {
            y.iter().zip(k).map(|(y, k)| y + s * k).collect()
        };
        let mut found = vec![y];
        for step in 0..(END / h).round() as usize * PARTS {
            let (t, mut y) = (step as f64 * e, found.pop().unwrap());
            if step % PARTS == 0 {
                found.push(y.clone());
            }
            let k1 = self.rate(kind, t, &y);
            let k2 = self.rate(kind, t + 0.5 * e, &plus(&y, &k1, 0.5 * e));
            let k3 = self.rate(kind, t + 0.5 * e, &plus(&y, &k2, 0.5 * e));
            let k4 = self.rate(kind, t + e, &plus(&y, &k3, e));
            for (y, ((a, b), (c, d))) in
                y.iter_mut().zip(k1.iter().zip(&k2).zip(k3.iter().zip(&k4)))
            {
                *y += e / 6.0 * (a + 2.0 * b + 2.0 * c + d);
            }
            found.push(y);
        }
        found
    }
}

pub(crate) fn text(kind: Kind, acting: Acting, rates: &[f64], step: f64) -> String {
    let Acting { freedom, rest } = acting;
    let name = format!("{kind:?}").to_lowercase();
    let [p, d] = GAINS;
    let own = match kind {
        Universal => format!("axis2 = {ACROSS:?}"),
        Planar => format!("first_axis = {ACROSS:?}"),
        Screw => format!("pitch = {PITCH}"),
        _ => String::new(),
    };
    [
        heavy("freedom", GRAVITY, &format!("step = {step:e}, end = {END}")),
        body_at(CENTER, "body", MASS, MOMENTS) + &format!("rotation_vector = {TURNED:?}\n"),
        along(AXIS, &name, "joint", ["ground", "body"], PLACE) + &format!("{own}\nrate = {rates:?}\n"),
        format!("spring = {{ freedom = {freedom}, stiffness = {STIFFNESS}, rest = {rest} }}\n"),
        format!("damper = {{ freedom = {freedom}, damping = {DAMPING} }}\n"),
        format!("[joint.motor]\nfreedom = {freedom}\neffort = {EFFORT}\n"),
        "history = { type = \"harmonic\", frequency = 1.3, phase = 0.4 }\n".into(),
        format!("proportional = {p}\nderivative = {d}\n"),
        "path = { offset = 0.3, rate = 1.1, acceleration = 0.7, amplitude = 0.25, frequency = 0.8, phase = 0.2 }\n".into(),
        sensor("coordinate", "joint_coordinate", "joint"),
        sensor("effort", "effort", "joint"),
    ]
    .concat()
}

/// The largest error of each kind of quantity, relative to its largest value.
#[derive(Debug, Default)]
pub(crate) struct Errors {
    pub(crate) coordinates: f64,
    pub(crate) efforts: f64,
    pub(crate) energies: f64,
    pub(crate) balance: f64,
}

/// Rates initially; those of an angle under test wind it up.
pub(crate) fn rates(kind: Kind, acting: Acting) -> Vec<f64> {
    let freedoms = kind.freedoms();
    let mut rates = RATES[..freedoms.len()].to_vec();
    if freedoms[acting.freedom].turn > 0.0 {
        rates[acting.freedom] = SPIN;
    }
    rates
}

/// Columns of `sensors.csv` and `energy.csv` at all nodes, by name; not a number where there is
/// none.
pub(crate) struct Columns<'a> {
    pub(crate) sensor: &'a dyn Fn(&str) -> Vec<f64>,
    pub(crate) energy: &'a dyn Fn(&str) -> Vec<f64>,
    /// Coordinates of the joint.
    pub(crate) coordinates: Vec<Vec<f64>>,
}

/// The larger one; NaN where one is.
fn larger(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

/// Of columns against `exact`, as [`Acting::integrate`] gives it.
pub(crate) fn errors(
    kind: Kind,
    acting: Acting,
    found: &Columns<'_>,
    h: f64,
    exact: &[Vec<f64>],
) -> Errors {
    let freedoms = kind.freedoms();
    let d = freedoms.len();
    let largest = |of: &dyn Fn(usize) -> f64| (0..exact.len()).map(of).fold(0.0, larger);
    let mut out = Errors::default();
    let size = largest(&|i| exact[i][..d].iter().map(|x| x.abs()).fold(0.0, larger));
    assert!(freedoms[acting.freedom].turn == 0.0 || size > TAU, "{kind:?}: not wound, {size}");
    for k in 0..d {
        let off = largest(&|i| (found.coordinates[k][i] - exact[i][k]).abs());
        out.coordinates = larger(out.coordinates, off / size);
    }
    let f = acting.freedom;
    let own = |i: usize| acting.efforts(i as f64 * h, exact[i][f], exact[i][d + f]);
    let size = largest(&|i| own(i).iter().map(|x| x.abs()).fold(0.0, larger));
    for (k, part) in ["spring", "damper", "motor"].into_iter().enumerate() {
        let column = (found.sensor)(&format!("effort.{part}"));
        let off = largest(&|i| (column[i] - own(i)[k]).abs());
        out.efforts = larger(out.efforts, off / size);
    }
    let height = |y: &[f64]| Vector3::from(GRAVITY).dot(&kind.place(&y[..d]).0);
    let parts: [(&str, &dyn Fn(&[f64]) -> f64); 5] = [
        ("springs", &|y| 0.5 * STIFFNESS * (y[f] - acting.rest).powi(2)),
        ("gravity", &|y| -MASS * height(y)),
        ("kinetic", &|y| {
            let nu = DVector::from_column_slice(&y[d..2 * d]);
            0.5 * (nu.transpose() * kind.mass(&y[..d]) * &nu)[0]
        }),
        ("work.joint.damper", &|y| y[2 * d]),
        ("work.joint.motor", &|y| y[2 * d + 1]),
    ];
    let size = largest(&|i| larger(parts[0].1(&exact[i]), parts[2].1(&exact[i])));
    for (name, value) in parts {
        let column = (found.energy)(name);
        let of = |i: usize| column[i] - column[0];
        let off = largest(&|i| (of(i) - (value(&exact[i]) - value(&exact[0]))).abs());
        out.energies = larger(out.energies, off / size);
    }
    let [kinetic, gravity, springs, total] =
        ["kinetic", "gravity", "springs", "total"].map(|name| (found.energy)(name));
    out.balance = largest(&|i| (kinetic[i] + gravity[i] + springs[i] - total[i]).abs()) / size;
    out
}

/// The same of a run with settings.
fn errors_of(
    kind: Kind,
    acting: Acting,
    settings: &[(&str, &str)],
    (h, exact): (f64, &[Vec<f64>]),
) -> Errors {
    let model = model(&text(kind, acting, &rates(kind, acting), h), settings);
    let mut simulation = Simulation::new(&model).unwrap();
    let found = samples(&mut simulation);
    assert_eq!(found.len(), exact.len());
    let names: Vec<_> =
        simulation.sensors().columns().iter().map(holonom::sensor::SensorColumn::name).collect();
    let energies = simulation.energy_columns().to_vec();
    let column = |names: &[String], name: &str, of: &dyn Fn(&Sample) -> &[f64]| -> Vec<f64> {
        let k = names.iter().position(|column| column == name);
        found.iter().map(|s| k.map_or(f64::NAN, |k| of(s)[k])).collect()
    };
    let sensor = |name: &str| column(&names, name, &|s| &s.sensors);
    let energy = |name: &str| column(&energies, name, &|s| &s.energies);
    let coordinates = (0..kind.freedoms().len()).map(|k| sensor(&names[k])).collect();
    errors(kind, acting, &Columns { sensor: &sensor, energy: &energy, coordinates }, h, exact)
}

#[test]
fn springs_dampers_and_motors_act_on_the_freedom_they_name() {
    let forms = [
        ("nodal", "composition", 2),
        ("reduced", "composition", 2),
        ("constrained", "composition", 2),
        ("dalembert", "composition", 2),
        ("em-nodal", "composition", 2),
        ("nodal", "galerkin", 4),
    ];
    for kind in Kind::ALL {
        for freedom in 0..kind.freedoms().len() {
            let (acting, h) = (Acting { freedom, rest: 7.0 }, 2e-3);
            let d = kind.freedoms().len();
            let start = [vec![0.0; d], rates(kind, acting), vec![0.0; 2]].concat();
            let exact = acting.integrate(kind, start, h);
            for (scheme, method, order) in forms {
                let order = order.to_string();
                let settings = [
                    ("simulation.scheme", scheme),
                    ("simulation.method", method),
                    ("simulation.order", order.as_str()),
                ];
                let found = errors_of(kind, acting, &settings, (h, &exact));
                println!("{kind:?} {freedom} {scheme} {method}: {found:?}");
                let Errors { coordinates, efforts, energies, balance } = found;
                let worst = [coordinates, efforts, energies].into_iter().fold(0.0, f64::max);
                let limit = if method == "galerkin" { 1e-7 } else { 1e-3 };
                assert!(worst < limit, "{kind:?} {freedom} {scheme} {method}: {found:?}");
                assert!(balance < 1e-12, "{kind:?} {freedom} {scheme} {method}: {found:?}");
            }
        }
    }
}
