//! Sensors of forces: efforts of bushings, powers and lengths of laws, expressions of other
//! sensors, inertial units; what events leave of them.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::model;
use holonom::sensor::SensorColumn;
use holonom::{Sample, Simulation};
use vi_testkit::model::sensor;

struct Run {
    names: Vec<String>,
    nodes: Vec<Sample>,
}

impl Run {
    fn of(text: &str) -> Self {
        let mut simulation = Simulation::new(&model(text, &[])).unwrap();
        let names = simulation.sensors().columns().iter().map(SensorColumn::name).collect();
        let nodes = simulation.samples().map(Result::unwrap).collect();
        Self { names, nodes }
    }

    fn column(&self, name: &str) -> Vec<f64> {
        let k = self.names.iter().position(|own| own == name).unwrap_or_else(|| panic!("{name}"));
        self.nodes.iter().map(|node| node.sensors[k]).collect()
    }
}

/// The trapezoidal sum over all nodes.
fn sum(power: &[f64], h: f64) -> f64 {
    power.windows(2).map(|own| 0.5 * h * (own[0] + own[1])).sum()
}

/// What several columns are apart from what is expected of them.
fn assert_same(found: &[f64], expected: impl Iterator<Item = f64>, tolerance: f64) {
    let expected: Vec<f64> = expected.collect();
    assert_eq!(found.len(), expected.len());
    let size = expected.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    let worst = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("{worst:.1e} of {size:.2e}");
    assert!(size > 0.0 && worst < tolerance * size, "{worst:e} of {size:e}");
}

const BLOCK: &str = r#"
model = { name = "block", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.001, end = 0.3 }
[[body]]
name = "block"
mass = 2.0
inertia = [0.02, 0.02, 0.02]
velocity = [0.5, -0.2, 0.0]
[[bushing]]
name = "mount"
from = "ground"
to = "block"
position = [0.0, 0.0, 0.0]
stiffness = [900.0, 1400.0, 2000.0, 5.0, 5.0, 5.0]
damping = [4.0, 3.0, 6.0, 0.0, 0.0, 0.0]
preload = [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]
"#;

/// Efforts are those along the coordinates, on `to`; their power is the change of the energy.
#[test]
fn a_bushing_shows_its_efforts_and_its_power() {
    let text = [
        BLOCK.to_owned(),
        sensor("held", "effort", "mount"),
        sensor("given", "power", "mount"),
        sensor("x", "position", "block"),
        sensor("v", "velocity", "block"),
    ]
    .concat();
    let run = Run::of(&text);
    let numbers = [("x", 900.0, 4.0, 1.0), ("y", 1400.0, 3.0, 2.0), ("z", 2000.0, 6.0, 3.0)];
    for (axis, k, c, preload) in numbers {
        let (x, v) = (run.column(&format!("x.{axis}")), run.column(&format!("v.{axis}")));
        let expected = x.iter().zip(&v).map(|(x, v)| preload - k * x - c * v);
        assert_same(&run.column(&format!("held.f{axis}")), expected, 1e-12);
        assert_eq!(run.column(&format!("held.m{axis}")).len(), x.len());
    }
    let velocities = ["x", "y", "z"].map(|axis| run.column(&format!("v.{axis}")));
    let efforts = ["x", "y", "z"].map(|axis| run.column(&format!("held.f{axis}")));
    let power = run.column("given");
    let product = |node: usize| (0..3).map(|k| velocities[k][node] * efforts[k][node]).sum();
    assert_same(&power, (0..power.len()).map(product), 1e-9);
    // kinetic energy and weight take it up
    let gained = |node: usize| {
        let v: f64 = velocities.iter().map(|own| own[node] * own[node]).sum();
        v + 2.0 * 9.81 * run.column("x.z")[node]
    };
    let (work, gain) = (sum(&power, 1e-3), gained(power.len() - 1) - gained(0));
    println!("work {work}, gain {gain}");
    assert!((work - gain).abs() < 1e-4 * gain.abs().max(0.1), "{work} {gain}");
}

const SLIDER: &str = r#"
model = { name = "slider" }
simulation = { step = 0.002, end = 1.0 }
[[body]]
name = "load"
mass = 2.0
inertia = [0.1, 0.1, 0.1]
[[joint]]
name = "x"
type = "prismatic"
parent = "ground"
child = "load"
position = [0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
rate = 0.6
[[signal]]
name = "lag"
filter = { of = "x", time_constant = 0.1 }
[[law]]
name = "along"
joint = "x"
effort = "-3*v - 50*x"
[[law]]
name = "between"
from = "ground"
to = "load"
point_from = [-0.5, 0.3, 0.0]
tension = "20*(x - 0.5) + 2*v"
[[law]]
name = "reads"
joint = "x"
effort = "5*lag"
[[law]]
name = "drag"
on = "load"
force = ["-0.8*vx", "0", "0"]
"#;

/// The power of each law, the length of one between points, an expression of all of them.
#[test]
fn laws_show_their_power_and_their_length() {
    let laws = ["along", "between", "reads", "drag"];
    let text = [
        SLIDER.to_owned(),
        laws.map(|law| sensor(&format!("power_{law}"), "power", law)).concat(),
        sensor("l", "length", "between"),
        sensor("dl", "length_rate", "between"),
        sensor("at", "joint_coordinate", "x"),
        sensor("rate", "joint_rate", "x"),
        sensor("acceleration", "joint_acceleration", "x"),
        "[[sensor]]\nname = \"missing\"\ntype = \"expression\"\n\
         value = \"2*acceleration*rate - power_along - power_between - power_reads - power_drag\"\n\
         [[sensor]]\nname = \"twice\"\ntype = \"expression\"\nvalue = \"2*load.x + lag + t\"\n"
            .to_owned(),
    ]
    .concat();
    let run = Run::of(&text);
    let [x, v, lag] = ["at", "rate", "lag"].map(|name| run.column(name));
    let nodes = || 0..x.len();
    let length = |node: usize| (x[node] + 0.5).hypot(0.3);
    let rate = |node: usize| (x[node] + 0.5) * v[node] / length(node);
    assert_same(&run.column("l"), nodes().map(length), 1e-12);
    assert_same(&run.column("dl"), nodes().map(rate), 1e-12);
    assert_same(
        &run.column("power_along"),
        nodes().map(|k| v[k] * (-3.0 * v[k] - 50.0 * x[k])),
        1e-12,
    );
    let tension = |k: usize| 20.0 * (length(k) - 0.5) + 2.0 * rate(k);
    assert_same(&run.column("power_between"), nodes().map(|k| -tension(k) * rate(k)), 1e-12);
    assert_same(&run.column("power_reads"), nodes().map(|k| 5.0 * lag[k] * v[k]), 1e-12);
    assert_same(&run.column("power_drag"), nodes().map(|k| -0.8 * v[k] * v[k]), 1e-12);
    let t = |k: usize| run.nodes[k].t;
    assert_same(&run.column("twice"), nodes().map(|k| 2.0 * x[k] + lag[k] + t(k)), 1e-12);
    // the powers of all laws are the rate of the kinetic energy, to the order of the step
    let missing = run.column("missing");
    let size = run.column("power_along").iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    let worst = missing.iter().fold(0.0, |worst: f64, x| worst.max(x.abs()));
    println!("missing {worst:.1e} of {size:.1} W");
    assert!(worst < 1e-3 * size, "{worst:e}");
}

/// An expression reads what no law may, and nothing of a law that an event released.
#[test]
fn expressions_read_reactions_and_go_on_after_events() {
    let text = [
        SLIDER.to_owned(),
        sensor("rail", "reaction", "x"),
        sensor("given", "power", "drag"),
        "[[sensor]]\nname = \"side\"\ntype = \"expression\"\nvalue = \"hypot(rail.fy, rail.fz)\"\n\
         [[event]]\nname = \"calm\"\nat = 0.5\nrelease = [\"drag\"]\n"
            .to_owned(),
    ]
    .concat();
    let run = Run::of(&text);
    let [y, z, side] = ["rail.fx", "rail.fy", "rail.fz"].map(|name| run.column(name));
    let _ = y;
    assert_same(&run.column("side"), z.iter().zip(&side).map(|(a, b)| a.hypot(*b)), 1e-12);
    let given = run.column("given");
    let before = run.nodes.iter().position(|node| node.t > 0.5).unwrap();
    assert!(given[..before - 1].iter().all(|power| *power < 0.0), "{:?}", &given[..5]);
    assert!(given[before..].iter().all(|power| *power == 0.0), "{:?}", &given[before..before + 5]);
}

/// At rest on a table an inertial unit feels the weight upwards along its own axes.
#[test]
fn an_inertial_unit_at_rest_feels_its_weight() {
    let text = "model = { name = \"unit\", gravity = [0.0, 0.0, -9.81] }\n\
                simulation = { step = 0.01, end = 0.1 }\n\
                [[body]]\nname = \"box\"\nmass = 1.0\ninertia = [0.1, 0.2, 0.3]\n\
                euler = { sequence = \"y\", degrees = [30.0] }\n\
                [[joint]]\nname = \"glued\"\ntype = \"fixed\"\nparent = \"ground\"\nchild = \"box\"\n\
                position = [0.0, 0.0, 0.0]\n"
        .to_owned()
        + &sensor("unit", "imu", "box");
    let run = Run::of(&text);
    for (part, expected) in [("ax", -9.81 * 0.5), ("ay", 0.0), ("az", 9.81 * 0.75_f64.sqrt())] {
        let worst = run.column(&format!("unit.{part}"));
        let worst = worst.iter().map(|x| (x - expected).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-9, "{part}: {worst:e}");
    }
}

/// What a sensor cannot be is said by its name.
#[test]
fn faults_of_sensors_are_named() {
    let cases = [
        (sensor("a", "expression", "load"), "an expression is of nothing"),
        ("[[sensor]]\nname = \"a\"\ntype = \"expression\"\n".to_owned(), "has no value"),
        (
            "[[sensor]]\nname = \"a\"\ntype = \"expression\"\nvalue = \"2*lod.x\"\n".to_owned(),
            "`lod.x` is not known",
        ),
        ("[[sensor]]\nname = \"a\"\ntype = \"position\"\n".to_owned(), "missing key `of`"),
        (sensor("a", "position", "load") + "value = \"1\"\n", "only an expression has a value"),
        (sensor("a", "imu", "x"), "`x`"),
        (sensor("a", "length", "along"), "does not act between points"),
        (
            "[[sensor]]\nname = \"a\"\ntype = \"expression\"\nvalue = \"1\"\n\
             [[sensor]]\nname = \"b\"\ntype = \"expression\"\nvalue = \"a\"\n"
                .to_owned(),
            "is an expression itself",
        ),
    ];
    for (more, expected) in cases {
        let text = SLIDER.to_owned() + &more;
        let found = holonom::Model::from_toml(&text).unwrap_err().problems(&text);
        let found = format!("{found:?}");
        assert!(found.contains(expected), "{expected}: {found}");
    }
}
