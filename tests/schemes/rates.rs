//! Constraints on weighed rates: closed forms, agreement with blades and with prescribed motions,
//! orders, reversal, what is refused.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark::{model, samples};
use crate::harness::models::orders;
use holonom::modes::{About, ModalAnalysis};
use holonom::{Model, Sample, Simulation};
use vi_testkit::model::sensor;

fn run(text: &str, set: &[(&str, &str)]) -> Vec<Sample> {
    samples(&mut Simulation::new(&model(text, set)).unwrap())
}

/// Sliders along x, y and z, one on the other, with unit masses in effect.
fn sliders(settings: &str, more: &str) -> String {
    let slider = |name: &str, parent: &str, axis: [f64; 3], rate: f64, mass: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [1.0, 1.0, 1.0]\n\
             [[joint]]\nname = \"j{name}\"\ntype = \"prismatic\"\nparent = \"{parent}\"\n\
             child = \"{name}\"\nposition = [0.0, 0.0, 0.0]\naxis = {axis:?}\nrate = {rate:?}\n"
        )
    };
    [
        format!("model = {{ name = \"sliders\" }}\nsimulation = {{ {settings} }}\n"),
        slider("x", "ground", [1.0, 0.0, 0.0], 0.8, 1.0),
        slider("y", "ground", [0.0, 1.0, 0.0], 0.6, 1.0),
        slider("z", "ground", [0.0, 0.0, 1.0], 0.0, 1.0),
        more.to_owned(),
        ["x", "y", "z"]
            .map(|own| sensor(&format!("at_{own}"), "joint_coordinate", &format!("j{own}")))
            .concat(),
    ]
    .concat()
}

fn rates(terms: &str, value: &str) -> String {
    format!("[[constraint]]\nname = \"tie\"\ntype = \"velocity\"\nterms = [{terms}]\n{value}\n")
}

fn coordinate(sample: &Sample, k: usize) -> f64 {
    sample.sensors[k]
}

/// `ż = y ẋ`: a particle that no configuration is left out by, in closed form.
#[test]
fn the_nonholonomic_particle_is_met_with_order_two() {
    let terms = "{ joint = \"jz\" }, { joint = \"jx\", factor = \"-jy\" }";
    let text =
        sliders("step = 0.1, end = 2.0", &(rates(terms, "") + &sensor("slip", "slip", "tie")));
    // y = w t, ẋ = u/√(1 + y²), ż = y ẋ; u = 0.8 at y = 0
    let (w, u, end) = (0.6_f64, 0.8, 2.0);
    let y = w * end;
    let exact = [u / w * y.asinh(), y, u / w * ((1.0 + y * y).sqrt() - 1.0)];
    let errors: Vec<f64> = ["0.1", "0.05", "0.025"]
        .into_iter()
        .map(|step| {
            let nodes = run(&text, &[("simulation.step", step)]);
            let slip = nodes.iter().map(|node| coordinate(node, 0).abs()).fold(0.0, f64::max);
            assert!(slip < 1e-14, "slip {slip:e}");
            let last = nodes.last().unwrap();
            (0..3).map(|k| (coordinate(last, 1 + k) - exact[k]).abs()).fold(0.0, f64::max)
        })
        .collect();
    let orders = orders(&errors);
    println!("errors {errors:?}, orders {orders:?}");
    assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.05) && errors[2] < 1e-3);
}

/// `ẏ = x ẋ` has the integral `y − x²/2`, which the mean of both ends keeps to round-off.
#[test]
fn an_integrable_tie_keeps_its_integral() {
    let terms = "{ joint = \"jy\" }, { joint = \"jx\", factor = \"-jx - 0.5\" }";
    let start = sliders("step = 0.05, end = 4.0", &rates(terms, ""));
    let text = start.replace("rate = 0.6", "rate = 0.4"); // ẏ = (x + ½) ẋ at x = 0
    let nodes = run(&text, &[]);
    let integral = |node: &Sample| {
        let [x, y] = [0, 1].map(|k| coordinate(node, k));
        y - 0.5 * x * x - 0.5 * x
    };
    let worst = nodes.iter().map(|node| integral(node).abs()).fold(0.0, f64::max);
    println!("drift of the integral {worst:.1e}");
    assert!(worst < 1e-13, "{worst:e}");
    // it does no work
    let energy = nodes.iter().map(|node| (node.hamiltonian - nodes[0].hamiltonian).abs());
    assert!(energy.fold(0.0, f64::max) < 1e-2 * nodes[0].hamiltonian);
}

/// A value in time and place: `ẋ = 0.8 cos 3t + 0.5 y`.
#[test]
fn a_driven_rate_follows_its_value() {
    let more = rates("{ joint = \"jx\" }", "value = \"0.8*cos(3*t) + 0.5*jy\"");
    let text = sliders("step = 0.02, end = 1.0", &more);
    let errors: Vec<f64> = ["0.02", "0.01", "0.005"]
        .into_iter()
        .map(|step| {
            let nodes = run(&text, &[("simulation.step", step)]);
            let exact = 0.8 / 3.0 * 3.0_f64.sin() + 0.25 * 0.6; // y = 0.6 t
            (coordinate(nodes.last().unwrap(), 0) - exact).abs()
        })
        .collect();
    let orders = orders(&errors);
    println!("errors {errors:?}, orders {orders:?}");
    assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.05));
}

/// A direction of a body at a point of it is a blade; one of space at the same point is not.
#[test]
fn a_point_of_a_body_without_a_rate_is_a_blade() {
    let text = include_str!("../reference/laws/p12_sleigh.toml");
    let blade = run(text, &[("simulation.end", "1.0")]);
    let as_rates = text.replace(
        "type = \"blade\"\nbody = \"plate\"\nposition = [0.0, 0.0, 0.0]\naxis = [0.0, 1.0, 0.0]",
        "type = \"velocity\"\nterms = [{ of = \"plate\", point = [\"= -a\", 0.0, 0.0], \
         direction = [0.0, 2.0, 0.0], axes = \"body\", factor = 0.5 }]",
    );
    assert_ne!(as_rates, text);
    let found = run(&as_rates, &[("simulation.end", "1.0")]);
    let apart = crate::benchmark::apart(&found.last().unwrap().q, &blade.last().unwrap().q);
    println!("apart {apart:.1e}");
    assert!(apart < 1e-12, "{apart:e}");
    let in_space = as_rates.replace("axes = \"body\"", "axes = \"space\"");
    let other = run(&in_space, &[("simulation.end", "1.0")]);
    // ẏ of the point is zero in space
    let y = |sample: &Sample| sample.q[1] - 0.3 * (sample.q[4] / sample.q[3].hypot(sample.q[4]));
    let worst = other.iter().map(|node| y(node).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-12, "{worst:e}");
}

const FOUR_BAR: &str = r#"
model = { name = "four_bar", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 1.0, project_start = true }
body = [
  { name = "crank", mass = 1.0, inertia = [0.01, 0.02, 0.02], position = [0.0, 0.0, 0.15], euler = { sequence = "y", degrees = [-90.0] } },
  { name = "coupler", mass = 2.0, inertia = [0.01, 0.1, 0.1], position = [0.4, 0.0, 0.4] },
  { name = "rocker", mass = 1.5, inertia = [0.01, 0.05, 0.05], position = [0.8, 0.0, 0.25] },
]
joint = [
  { name = "a", type = "revolute", parent = "ground", child = "crank", position = [0.0, 0.0, 0.0], axis = [0.0, -1.0, 0.0], rate = 2.0 },
  { name = "b", type = "revolute", parent = "crank", child = "coupler", position = [0.0, 0.0, 0.3], axis = [0.0, -1.0, 0.0] },
  { name = "c", type = "revolute", parent = "coupler", child = "rocker", position = [0.8, 0.0, 0.5], axis = [0.0, -1.0, 0.0] },
  { name = "d", type = "revolute", parent = "ground", child = "rocker", position = [0.8, 0.0, 0.0], axis = [0.0, -1.0, 0.0] },
]
"#;

/// In a closed loop the rate of a crank as a tie is the motion that a path prescribes; its effort
/// is the motor's.
#[test]
fn a_crank_in_a_loop_turns_at_its_rate() {
    let turned = |name: &str| sensor(&format!("at_{name}"), "joint_coordinate", name);
    let effort = turned("a") + &turned("d") + &sensor("torque", "effort", "drive");
    let path = "[[constraint]]\nname = \"drive\"\ntype = \"motion\"\njoint = \"a\"\npath = { rate = 2.0 }\n";
    let tied = "[[constraint]]\nname = \"drive\"\ntype = \"velocity\"\nterms = [{ joint = \"a\" }]\nvalue = 2.0\n";
    let [by_path, by_rate] =
        [path, tied].map(|own| run(&(FOUR_BAR.to_owned() + own + &effort), &[]));
    let worst = by_path.iter().zip(&by_rate).map(|(a, b)| crate::benchmark::apart(&a.q, &b.q));
    let worst = worst.fold(0.0, f64::max);
    let torque = |sample: &Sample| coordinate(sample, 2);
    let efforts = by_path.iter().zip(&by_rate).skip(1).map(|(a, b)| torque(a) - torque(b));
    let efforts = efforts.fold(0.0, |worst: f64, x| worst.max(x.abs()));
    let size = by_path.iter().map(|node| torque(node).abs()).fold(0.0, f64::max);
    println!("apart {worst:.1e} m, {efforts:.1e} of {size:.1} N·m");
    assert!(worst < 1e-11 && efforts < 1e-7 * size, "{worst:e} {efforts:e}");
}

/// A run back in time returns to its start.
#[test]
fn a_tie_is_reversible() {
    let terms = "{ joint = \"jz\" }, { joint = \"jx\", factor = \"-sin(jy) - 0.3*jx\" }";
    let text = sliders("step = 0.05, end = 2.0", &rates(terms, ""));
    let mut simulation = Simulation::new(&model(&text, &[])).unwrap();
    let start = simulation.integrator().state().q.clone();
    for _ in 0..40 {
        simulation.integrator().step().unwrap();
    }
    simulation.integrator().reverse();
    for _ in 0..40 {
        simulation.integrator().step().unwrap();
    }
    let apart = crate::benchmark::apart(&simulation.integrator().state().q, &start);
    println!("apart {apart:.1e}");
    assert!(apart < 1e-12, "{apart:e}");
}

/// A driven tie of a damped rate has the eigenvalue of its linear equation: `ẋ = −2 x`.
#[test]
fn a_rate_that_follows_a_place_decays() {
    let more = rates("{ joint = \"jx\" }", "value = \"-2*jx\"");
    let text = sliders("step = 0.02, end = 1.0", &more).replace("rate = 0.8", "rate = 0.0");
    let report = ModalAnalysis::new(&model(&text, &[]), About::Start);
    let found = report.map(|mut own| own.modes(10).unwrap().modes);
    match found {
        Ok(modes) => {
            let decays: Vec<f64> =
                modes.iter().map(|mode| mode.decay).filter(|d| *d > 0.0).collect();
            assert!(decays.len() == 1 && (decays[0] - 2.0).abs() < 1e-12, "{decays:?}");
        }
        Err(error) => assert!(error.to_string().contains("depend on the motion"), "{error}"),
    }
}

/// What cannot be integrated is refused by name.
#[test]
fn faults_of_rates_are_named() {
    let cases = [
        ("{ factor = 1.0 }", "", "the rate of a joint or of a point"),
        ("{ joint = \"jx\", of = \"x\" }", "", "the rate of a joint or of a point"),
        ("{ joint = \"jq\" }", "", "`jq`"),
        ("{ of = \"x\" }", "", "the term has no direction"),
        ("{ joint = \"jx\", direction = [1, 0, 0] }", "", "`direction` belongs to a point"),
        ("{ joint = \"jx\", factor = \"t\" }", "", "does not change with time"),
        ("{ joint = \"jx\", factor = \"jy.rate\" }", "", "is no joint coordinate"),
        ("{ joint = \"jx\" }", "value = \"x.vx\"", "is no joint coordinate"),
        ("{ joint = \"jx\", factor = \"jyy\" }", "", "`jyy` is not known"),
        ("{ joint = \"jx\", factor = \"= 2*jy\" }", "", "jy"),
        ("", "", "there are no terms"),
        ("{ joint = \"jx\", freedom = 1 }", "", "has no coordinate 1"),
    ];
    for (terms, value, expected) in cases {
        let text = sliders("step = 0.1, end = 1.0", &rates(terms, value));
        let found = match Model::from_toml(&text) {
            Ok(model) => Simulation::new(&model).map(|_| ()).unwrap_err(),
            Err(error) => error,
        };
        let found: Vec<String> = found.problems(&text).iter().map(|p| format!("{p:?}")).collect();
        let found = found.join("\n");
        assert!(found.contains(expected), "{terms}: {expected}: {found}");
    }
    let angle = FOUR_BAR.to_owned()
        + "[[constraint]]\nname = \"tie\"\ntype = \"velocity\"\nterms = [{ joint = \"a\", factor = \"1 + d\" }]\n";
    let found = Model::from_toml(&angle).unwrap_err().problems(&angle);
    assert!(format!("{found:?}").contains("has no period in the angle `d`"), "{found:?}");
    let statics =
        sliders("scheme = \"static\", step = 0.1, end = 1.0", &rates("{ joint = \"jx\" }", ""));
    let found = Model::from_toml(&statics).unwrap_err().problems(&statics);
    assert!(format!("{found:?}").contains("statics has no equilibria"), "{found:?}");
    let moving = sliders("step = 0.1, end = 1.0", &rates("{ joint = \"jx\" }", "value = 0.3"));
    let found = Simulation::new(&Model::from_toml(&moving).unwrap()).map(|_| ()).unwrap_err();
    assert!(
        found.to_string().contains("constraint.tie: the initial velocities violate"),
        "{found}"
    );
}
