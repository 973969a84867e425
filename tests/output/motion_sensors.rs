//! Accelerations, what is seen from a body, distances and powers: against closed forms, against
//! differences of other sensors, and against the work that the steps have done.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{assert_order, model, orders, samples};
use holonom::{Sample, Simulation};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use vi_testkit::model::sensor;

/// Names of the columns, and all nodes.
struct Run {
    names: Vec<String>,
    energies: Vec<String>,
    nodes: Vec<Sample>,
}

impl Run {
    fn of(text: &str, replaced: &[(&str, &str)]) -> Self {
        let mut simulation = Simulation::new(&model(text, replaced)).unwrap();
        let nodes = samples(&mut simulation);
        let names = simulation.sensors().columns().iter().map(holonom::sensor::SensorColumn::name);
        let (names, energies) = (names.collect(), simulation.energy_columns().to_vec());
        Self { names, energies, nodes }
    }

    /// A column of all sensors.
    fn column(&self, name: &str) -> Vec<f64> {
        let k = self.names.iter().position(|own| own == name);
        let k = k.unwrap_or_else(|| panic!("no column {name}: {:?}", self.names));
        self.nodes.iter().map(|node| node.sensors[k]).collect()
    }

    /// The columns `NAME.x`, `NAME.y`, `NAME.z`.
    fn vectors(&self, name: &str) -> Vec<Vector3<f64>> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.column(&format!("{name}.{axis}")));
        (0..x.len()).map(|k| Vector3::new(x[k], y[k], z[k])).collect()
    }

    /// A column of `energy.csv`.
    fn energy(&self, name: &str) -> Vec<f64> {
        let k = self.energies.iter().position(|own| own == name).unwrap();
        self.nodes.iter().map(|node| node.energies[k]).collect()
    }

    fn h(&self) -> f64 {
        self.nodes[1].t - self.nodes[0].t
    }

    /// The trapezoidal sum of a column.
    fn integral(&self, name: &str) -> f64 {
        let y = self.column(name);
        0.5 * self.h() * y.windows(2).map(|pair| pair[0] + pair[1]).sum::<f64>()
    }
}

/// A bar of 1 m and 2 kg on a hinge about y.
fn bar() -> String {
    [
        include_str!("../models/bar.toml"),
        &sensor("tip", "acceleration", "bar"),
        "point = [0.5, 0, 0]\n",
        &sensor("turn", "angular_acceleration", "bar"),
        &sensor("hinge_acceleration", "joint_acceleration", "hinge"),
    ]
    .concat()
}

/// Angle, rate and its rate of the pendulum at the nodes: `0.7 θ̈ = 9.81 cos θ`, by the classical
/// method of fourth order.
fn pendulum(h: f64, steps: usize) -> Vec<[f64; 3]> {
    let acceleration = |angle: f64| 2.0 * 9.81 * 0.5 * angle.cos() / (0.2 + 2.0 * 0.25);
    let parts = (h / 1e-4).round() as usize;
    let d = h / parts as f64;
    let slope = |[a, b]: [f64; 2]| [b, acceleration(a)];
    let plus = |x: [f64; 2], k: [f64; 2], s: f64| [x[0] + s * k[0], x[1] + s * k[1]];
    let mut x = [0.0, 0.0];
    let mut all = vec![[0.0, 0.0, acceleration(0.0)]];
    for _ in 0..steps {
        for _ in 0..parts {
            let k1 = slope(x);
            let k2 = slope(plus(x, k1, 0.5 * d));
            let k3 = slope(plus(x, k2, 0.5 * d));
            let k4 = slope(plus(x, k3, d));
            let sum = |i: usize| d / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            x = [x[0] + sum(0), x[1] + sum(1)];
        }
        all.push([x[0], x[1], acceleration(x[0])]);
    }
    all
}

/// Largest errors of the tip, the body and the joint at the first, the inner and the last nodes.
fn pendulum_errors(h: f64, replaced: &[(&str, &str)]) -> [f64; 9] {
    let step = format!("{h:e}");
    let run = Run::of(&bar(), &[&[("simulation.step", step.as_str())], replaced].concat());
    let exact = pendulum(h, run.nodes.len() - 1);
    let (tip, turn, joint) =
        (run.vectors("tip"), run.vectors("turn"), run.column("hinge_acceleration"));
    let mut worst = [0.0_f64; 9];
    for (k, [angle, rate, acceleration]) in exact.into_iter().enumerate() {
        let along = Vector3::new(angle.cos(), 0.0, -angle.sin());
        let across = Vector3::new(-angle.sin(), 0.0, -angle.cos());
        let expected = acceleration * across - rate * rate * along;
        let errors = [
            (tip[k] - expected).amax(),
            (turn[k] - acceleration * Vector3::y()).amax(),
            (joint[k] - acceleration).abs(),
        ];
        let place = if k == 0 { 0 } else { 3 + 3 * usize::from(k + 1 == run.nodes.len()) };
        for (i, error) in errors.into_iter().enumerate() {
            worst[place + i] = worst[place + i].max(error);
        }
    }
    worst
}

#[test]
fn accelerations_have_the_order_of_the_scheme_at_every_node() {
    let cases: [(&str, &[(&str, &str)], f64); 7] = [
        ("nodal", &[], 2.0),
        ("constrained", &[("simulation.scheme", "constrained")], 2.0),
        ("dalembert", &[("simulation.scheme", "dalembert")], 2.0),
        ("em-nodal", &[("simulation.scheme", "em-nodal")], 2.0),
        ("em-constrained", &[("simulation.scheme", "em-constrained")], 2.0),
        ("order 4", &[("simulation.order", "4")], 4.0),
        ("galerkin", &[("simulation.method", "galerkin"), ("simulation.order", "4")], 4.0),
    ];
    for (name, replaced, order) in cases {
        let steps = if order > 2.0 { [0.1, 0.05] } else { [0.02, 0.01] };
        let errors = steps.map(|h| pendulum_errors(h, replaced));
        println!("{name}: {:?}", errors[1]);
        for i in 0..9 {
            let pair = [errors[0][i], errors[1][i]];
            if i < 3 {
                // the initial values are exact
                assert!(pair[1] < 1e-9, "{name}, start: {}", pair[1]);
                continue;
            }
            let found = orders(&format!("{name} {i}"), &steps, &pair);
            assert!(pair[1] < 0.05, "{name}: {}", pair[1]); // of 30 m/s²
            // a single node may be better than its order by chance
            if i < 6 {
                assert_order(&found, order, 0.4);
            }
        }
    }
}

const MACHINE: &str = include_str!("../models/machine.toml");

/// Pairs of columns, the second one the rate of the first.
const RATES: [(&str, &str); 18] = [
    ("seen.x", "seen_rate.x"),
    ("seen.y", "seen_rate.y"),
    ("seen.z", "seen_rate.z"),
    ("gap", "gap_rate"),
    ("length", "length_rate"),
    ("rail_rate", "rail_a"),
    ("swing_rate", "swing_a"),
    ("ball_rate.x", "ball_a.x"),
    ("ball_rate.y", "ball_a.y"),
    ("ball_rate.z", "ball_a.z"),
    ("guide_rate.u", "guide_a.u"),
    ("guide_rate.theta", "guide_a.theta"),
    ("tip_rate.x", "tip_a.x"),
    ("tip_rate.y", "tip_a.y"),
    ("tip_rate.z", "tip_a.z"),
    ("turn_rate.x", "turn_a.x"),
    ("turn_rate.y", "turn_a.y"),
    ("turn_rate.z", "turn_a.z"),
];

#[test]
fn rates_of_sensors_are_the_differences_of_those_that_they_are_rates_of() {
    let cases: [&[(&str, &str)]; 3] = [
        &[],
        &[("simulation.scheme", "em-nodal")],
        &[("simulation.order", "4"), ("spring.coil.damping", "0")], // without dissipation
    ];
    for replaced in cases {
        let steps = [2e-3, 1e-3];
        let runs = steps.map(|h| {
            let step = format!("{h:e}");
            Run::of(MACHINE, &[&[("simulation.step", step.as_str())], replaced].concat())
        });
        for (value, rate) in RATES {
            let errors = [0, 1].map(|k| {
                let (y, found, h) = (runs[k].column(value), runs[k].column(rate), steps[k]);
                let inner = 1..y.len() - 1;
                let error = |n: usize| ((y[n + 1] - y[n - 1]) / (2.0 * h) - found[n]).abs();
                inner.map(error).fold(0.0, f64::max)
            });
            let size = runs[1].column(rate).iter().fold(0.0_f64, |s, r| s.max(r.abs()));
            assert!(size > 0.05, "{rate} hardly moves: {size}");
            let found = orders(rate, &steps, &errors);
            if errors[1] > 1e-10 {
                assert_order(&found, 2.0, 0.3);
            }
            assert!(errors[1] < 1e-3 * (1.0 + size), "{rate}: {} of {size}", errors[1]);
        }
        let run = &runs[1];
        // what is seen from the tool: its own axes and centre
        let attitude = |name: &str| -> Vec<UnitQuaternion<f64>> {
            let [w, x, y, z] = ["w", "x", "y", "z"].map(|p| run.column(&format!("{name}.{p}")));
            let of = |k: usize| Quaternion::new(w[k], x[k], y[k], z[k]);
            (0..w.len()).map(|k| UnitQuaternion::from_quaternion(of(k))).collect()
        };
        let (seen, place) = (run.vectors("seen"), run.vectors("place"));
        let (tool, axes) = (run.vectors("tool_place"), attitude("tool_attitude"));
        let off = |k: usize| (axes[k].inverse() * (place[k] - tool[k]) - seen[k]).amax();
        let worst = (0..seen.len()).map(off).fold(0.0, f64::max);
        assert!(worst < 1e-13, "seen position off by {worst:e} m");
        // the relative angular velocity, along the axes of the observer, turns the relative
        // orientation
        let (relative, omega) = (attitude("attitude"), run.vectors("omega"));
        let turned = |k: usize| {
            let turn = relative[k + 1] * relative[k - 1].inverse();
            (turn.scaled_axis() / (2.0 * run.h()) - omega[k]).amax()
        };
        let worst = (1..omega.len() - 1).map(turned).fold(0.0, f64::max);
        assert!(worst < 2e-4, "relative angular velocity off by {worst:e} rad/s");
        let height = run.column("height");
        let off = |k: usize| ((tool[k] + Vector3::new(0.0, 0.0, 2.0)).norm() - height[k]).abs();
        assert!((0..height.len()).all(|k| off(k) < 1e-14));
    }
}

const DRIVEN: &str = include_str!("../models/powers.toml");

#[test]
fn the_integral_of_a_power_is_the_work_of_the_steps() {
    for replaced in
        [&[][..], &[("simulation.scheme", "em-nodal")], &[("simulation.scheme", "dalembert")]]
    {
        let steps = [2e-3, 1e-3];
        let runs = steps.map(|h| {
            let step = format!("{h:e}");
            Run::of(DRIVEN, &[&[("simulation.step", step.as_str())], replaced].concat())
        });
        let gain = |run: &Run, name: &str| {
            let column = run.energy(name);
            column.last().unwrap() - column[0]
        };
        // the spring of the joint and the strut: what they store is what they take out; its damper
        // is a work
        let stored = |run: &Run| -gain(run, "springs") + gain(run, "work.strut");
        let pairs: [(&str, &dyn Fn(&Run) -> [f64; 2]); 6] = [
            ("damper", &|run| [run.integral("arm.damper"), gain(run, "work.shoulder.damper")]),
            ("motor", &|run| [run.integral("arm.motor"), gain(run, "work.shoulder.motor")]),
            ("wind", &|run| [run.integral("wind_power"), gain(run, "work.wind")]),
            ("jet", &|run| [run.integral("jet_power"), gain(run, "work.jet")]),
            ("drive", &|run| [run.integral("drive_power"), gain(run, "work_of_motions")]),
            ("springs", &|run| {
                [run.integral("arm.spring") + run.integral("strut_power"), stored(run)]
            }),
        ];
        for (name, both) in pairs {
            let errors = [0, 1].map(|k| {
                let [sum, work] = both(&runs[k]);
                assert!(work.abs() > 0.02, "{name} does hardly any work: {work}");
                (sum - work).abs()
            });
            let work = both(&runs[1])[1];
            println!("{replaced:?} {name}: {work:.4} J, integral off by {errors:?}");
            assert!(errors[1] < 1e-3 * work.abs(), "{name}: {} of {work} J", errors[1]);
            if errors[0] > 1e-9 {
                assert!(errors[0] / errors[1] > 3.0, "{name}: {errors:?}");
            }
        }
        let power = runs[1].column("arm.damper");
        assert!(power.iter().all(|p| *p <= 0.0), "a damper takes out");
    }
}

/// The second difference needs the step before: it comes from the checkpoint.
#[test]
fn a_run_that_is_taken_up_again_measures_the_same_accelerations() {
    for scheme in ["nodal", "em-nodal"] {
        let own = [("simulation.scheme", scheme), ("simulation.end", "0.05")];
        let whole = Run::of(MACHINE, &own).nodes;
        let model = model(MACHINE, &own);
        let mut first = Simulation::new(&model).unwrap();
        let none = |_: &Sample| Ok::<(), std::convert::Infallible>(());
        let stopped = first.run_while(&mut { none }, &mut |step, _| step < 20).unwrap();
        assert!(stopped.is_none(), "it pauses");
        let state = first.state();
        let mut second = Simulation::new(&model).unwrap();
        second.resume(state).unwrap();
        let rest: Vec<Sample> = second.samples().collect::<Result<_, _>>().unwrap();
        assert_eq!(rest[0].step, 20);
        let bits = |s: &Sample| s.sensors.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for (a, b) in whole[20..].iter().zip(&rest) {
            assert_eq!(bits(a), bits(b), "{scheme}, step {}", a.step);
        }
    }
}

/// The rounding of a long way: a second difference of the coordinates would be wrong by
/// `ε|q|/h² = 2e-5 m/s²` and more.
#[test]
fn far_from_the_origin_accelerations_are_as_exact_as_velocities() {
    let text = r#"
model = { name = "fall", gravity = [0, 0, -9.81] }
simulation = { step = 1e-4, end = 0.01 }
body = [{ name = "stone", mass = 2, inertia = [0.1, 0.1, 0.1], position = [1e3, 2e3, 3e3] }]
sensor = [{ name = "a", type = "acceleration", of = "stone" }]
"#;
    let run = Run::of(text, &[]);
    let off = |a: &Vector3<f64>| (a - Vector3::new(0.0, 0.0, -9.81)).amax();
    let worst = run.vectors("a").iter().map(off).fold(0.0, f64::max);
    println!("off by {worst:.1e} m/s²");
    assert!(worst < 1e-9, "{worst:e}");
}

#[test]
fn what_a_sensor_cannot_measure_is_said() {
    let of = |sensor: &str| {
        let more = format!("sensor = [{{ name = \"more\", {} }},", sensor.replace('\n', ", "));
        let text = DRIVEN.replace("sensor = [", &more);
        holonom::Model::from_toml(&text).map(|_| ()).unwrap_err().to_string()
    };
    let cases = [
        ("type = \"distance\"\nof = \"lower\"", "to where the distance is"),
        ("type = \"distance\"\nof = \"drive\"", "is no distance"),
        ("type = \"distance\"\nof = \"strut\"\nto = \"lower\"", "two ends of its own"),
        ("type = \"distance\"\nof = \"lower\"\nto = \"nothing\"", "there is no"),
        ("type = \"position\"\nof = \"lower\"\nto = \"upper\"", "only for distances"),
        ("type = \"position\"\nof = \"lower\"\nseen_from = \"nobody\"", "there is no body"),
        ("type = \"acceleration\"\nof = \"lower\"\nseen_from = \"upper\"", "are seen from a body"),
        ("type = \"joint_acceleration\"\nof = \"lower\"", "is a body, not a joint"),
        ("type = \"power\"\nof = \"elbow\"", "no spring, no damper and no motor"),
        ("type = \"power\"\nof = \"lower\"", "is a body, not a joint or spring"),
        ("type = \"distance\"\nof = \"lower\"\nto = \"upper\"\npoint_to = [0, 0]", "3"),
    ];
    for (sensor, words) in cases {
        let found = of(sensor);
        assert!(found.contains(words), "{sensor}: {found}");
    }
}
