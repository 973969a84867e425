//! Wheels, spheres and blades: heights and slip to round-off, orders, reversal, restart, what holds
//! them, what is refused.
#![allow(clippy::unwrap_used)] // a test

use crate::harness::case::distance;
use crate::harness::models::{nodes, orders, overrides};
use holonom::{Model, Sample, Simulation};

/// A model of the reference cases with values replaced and sensors added.
fn model(name: &str, replaced: &[(&str, &str)], more: &str) -> Model {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/reference/laws/");
    let text = std::fs::read_to_string(format!("{folder}{name}.toml")).unwrap();
    Model::from_toml_with(&(text + more), &overrides(replaced)).unwrap()
}

fn sensor(name: &str, kind: &str, of: &str) -> String {
    format!("\n[[sensor]]\nname = \"{name}\"\ntype = \"{kind}\"\nof = \"{of}\"\n")
}

fn largest(samples: &[Sample], of: impl Fn(&Sample) -> f64) -> f64 {
    samples.iter().map(|sample| of(sample).abs()).fold(0.0, f64::max)
}

/// A wheel with a tyre on a slope, beside a ball on a turntable.
const SLOPE: &str = r#"
model = { name = "slope", gravity = [0.6, -0.4, -9.7] }
simulation = { step = 0.004, end = 0.4, project_start = true }
[[body]]
name = "wheel"
mass = 1.2
inertia = [0.02, 0.035, 0.02]
position = [0.0, 0.0, 0.31]
velocity = [1.5, 0.1, 0.0]
angular_velocity = [0.3, 5.0, 0.6]
[[body]]
name = "ball"
mass = 0.5
inertia = [0.003, 0.003, 0.003]
position = [2.0, 0.0, 0.1]
angular_velocity = [0.0, 3.0, 0.0]
[[constraint]]
name = "tyre"
type = "rolling"
body = "wheel"
axis = [0.1, 1.0, 0.2]
radius = 0.3
tube = 0.08
plane = { normal = [0.1, 0.0, 1.0] }
[[constraint]]
name = "table"
type = "rolling"
body = "ball"
radius = 0.1
plane = { spin = 2.0, position = [1.5, 0.2, 0.0] }
"#;

#[test]
fn heights_and_slip_are_round_off() {
    let slips = |names: &[&str]| -> String {
        names.iter().map(|name| sensor(&format!("{name}_slip"), "slip", name)).collect()
    };
    let own = Model::from_toml(&(SLOPE.to_owned() + &slips(&["tyre", "table"]))).unwrap();
    let models = [
        model("p06_rolling_disc", &[], &slips(&["floor"])),
        model("p07_bicycle", &[], &slips(&["rear_tyre", "front_tyre"])),
        model("p12_sleigh", &[], &slips(&["runner"])),
        model("p13_turntable", &[], &slips(&["table"])),
        // two wheels on one axle say one thing twice: what is not enforced holds, too
        model("p16_two_wheels", &[], &slips(&["left_tyre", "right_tyre"])),
        own,
    ];
    for model in models {
        let samples = nodes(&model);
        let height = largest(&samples, |sample| sample.residuals.position);
        let each = |sample: &Sample| sample.sensors.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let slip = largest(&samples, each);
        let step = largest(&samples, |sample| sample.residuals.velocity);
        println!("{}: height {height:.1e} m, slip {slip:.1e} m/s", model.header.name);
        assert!(height < 1e-14 && slip < 1e-13 && slip > 0.0, "{}", model.header.name);
        assert!(step < 1e-12, "rates of the step: {step:e}");
    }
}

/// A composition of order 4 on the disc, against one of order 8.
#[test]
fn compositions_reach_their_order() {
    let end = |order: &str, step: &str| {
        let replaced = [("simulation.order", order), ("simulation.step", step)];
        nodes(&model("p06_rolling_disc", &replaced, "")).last().unwrap().q.clone()
    };
    let exact = end("8", "0.01");
    let error = |order: &str, step: &str| distance(&end(order, step), &exact);
    let fourth: Vec<f64> = ["0.04", "0.02", "0.01"].map(|step| error("4", step)).into();
    let second: Vec<f64> = ["0.02", "0.01", "0.005"].map(|step| error("2", step)).into();
    println!("order 2: {second:?} {:?}, order 4: {fourth:?}", orders(&second));
    assert!((orders(&second)[1] - 2.0).abs() < 0.05, "{:?}", orders(&second));
    assert!((orders(&fourth)[1] - 4.0).abs() < 0.25, "{:?}", orders(&fourth));
}

#[test]
fn many_steps_and_back() {
    // backwards the castering mode of the bicycle grows by exp(14 t)
    for (name, steps) in [("p06_rolling_disc", 80), ("p07_bicycle", 20), ("p13_turntable", 80)] {
        let mut simulation = Simulation::new(&model(name, &[], "")).unwrap();
        let run = simulation.integrator();
        let start = run.state().q.clone();
        for _ in 0..steps {
            run.step().unwrap();
        }
        run.reverse();
        for _ in 0..steps {
            run.step().unwrap();
        }
        let apart = distance(&run.state().q, &start);
        println!("{name}: {apart:.1e}");
        assert!(apart < 1e-12, "{name}: {apart:e}");
    }
}

#[test]
fn a_restart_continues_to_the_bit() {
    let more = sensor("slip", "slip", "rear_tyre") + &sensor("carries", "reaction", "front_tyre");
    let model = model("p07_bicycle", &[], &more);
    let whole = nodes(&model);
    let mut first = Simulation::new(&model).unwrap();
    let mut count = 0;
    first
        .run_while::<()>(&mut |_| Ok(()), &mut |_, _| {
            count += 1;
            count <= 40
        })
        .unwrap();
    let state = serde_json::to_string(&first.state()).unwrap();
    let mut second = Simulation::new(&model).unwrap();
    second.resume(serde_json::from_str(&state).unwrap()).unwrap();
    let rest: Vec<Sample> = second.samples().map(Result::unwrap).collect();
    let tail = &whole[whole.len() - rest.len()..];
    for (own, other) in rest.iter().zip(tail) {
        assert_eq!(own.q, other.q);
        assert_eq!(own.sensors, other.sensors);
    }
}

/// A wheel that rolls straight ahead carries its weight; in a loop it does not slip, either.
#[test]
fn the_ground_carries_the_weight() {
    let text = r#"
model = { name = "straight", gravity = [0.0, 0.0, -10.0] }
simulation = { step = 0.01, end = 0.2 }
[[body]]
name = "wheel"
mass = 3.0
inertia = [0.02, 0.04, 0.02]
position = [0.0, 0.0, 0.25]
velocity = [1.0, 0.0, 0.0]
angular_velocity = [0.0, 4.0, 0.0]
[[constraint]]
name = "floor"
type = "rolling"
body = "wheel"
axis = [0.0, 1.0, 0.0]
radius = 0.25
[[law]]
name = "lift"
on = "wheel"
force = ["0", "0", "400*t"]
"#;
    let more = sensor("carries", "reaction", "floor");
    let model = Model::from_toml(&(text.to_owned() + &more)).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let samples: Vec<Sample> = simulation.samples().map(Result::unwrap).collect();
    for sample in &samples[1..] {
        let [x, y, z, unique] = sample.sensors[..] else { panic!("{:?}", sample.sensors) };
        let expected = 30.0 - 400.0 * sample.t;
        assert!(x.abs() < 1e-9 && y.abs() < 1e-9 && (z - expected).abs() < 1e-8, "{z} {expected}");
        assert!((unique - 1.0).abs() < 1e-15);
    }
    let warnings = simulation.warnings();
    println!("{warnings:?}");
    assert!(
        warnings.iter().any(|w| w.contains("`floor` would have left its plane at t = 0.08 s")),
        "{warnings:?}"
    );
}

/// Two wheels with a coupling rod: the rows of rolling join those of a closed loop.
#[test]
fn wheels_roll_in_a_closed_loop() {
    let wheel = |name: &str, x: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 2.0\ninertia = [0.02, 0.04, 0.02]\n\
             position = [{x:?}, 0.0, 0.3]\nvelocity = [1.5, 0.0, 0.0]\n\
             angular_velocity = [0.0, 5.0, 0.0]\n\
             [[constraint]]\nname = \"{name}_rail\"\ntype = \"rolling\"\nbody = \"{name}\"\n\
             axis = [0.0, 1.0, 0.0]\nradius = 0.3\n"
        )
    };
    let hinge = |name: &str, parent: &str, child: &str, at: [f64; 3]| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nparent = \"{parent}\"\n\
             child = \"{child}\"\nposition = {at:?}\naxis = [0.0, 1.0, 0.0]\n"
        )
    };
    let text = [
        "model = { name = \"engine\", gravity = [0.0, 0.0, -9.81] }\n\
         simulation = { step = 0.005, end = 1.0 }\n"
            .to_owned(),
        wheel("first", 0.0),
        wheel("second", 1.0),
        "[[body]]\nname = \"frame\"\nmass = 10.0\ninertia = [0.5, 1.0, 1.0]\n\
         position = [0.5, 0.0, 0.3]\nvelocity = [1.5, 0.0, 0.0]\n"
            .to_owned(),
        "[[body]]\nname = \"rod\"\nmass = 1.0\ninertia = [0.01, 0.1, 0.1]\n\
         position = [0.5, 0.0, 0.5]\nvelocity = [2.5, 0.0, 0.0]\n"
            .to_owned(),
        hinge("a", "frame", "first", [0.0, 0.0, 0.3]),
        hinge("b", "frame", "second", [1.0, 0.0, 0.3]),
        hinge("c", "first", "rod", [0.0, 0.0, 0.5]),
        hinge("d", "second", "rod", [1.0, 0.0, 0.5]),
        sensor("slip", "slip", "second_rail"),
        sensor("angle", "joint_coordinate", "b"),
    ]
    .concat();
    let model = Model::from_toml(&text).unwrap();
    let samples = nodes(&model);
    let slip = largest(&samples, |sample| sample.sensors[0].hypot(sample.sensors[1]));
    let height = largest(&samples, |sample| sample.residuals.position);
    let last = samples.last().unwrap();
    println!("slip {slip:.1e} m/s, gaps {height:.1e}, turned {:.6}", last.sensors[3]);
    assert!(slip < 1e-12 && height < 1e-13);
    // Δx = R Δθ
    assert!((last.q[0] - 0.3 * last.sensors[3]).abs() < 1e-11, "{}", last.q[0]);
    let energy = largest(&samples, |sample| sample.hamiltonian - samples[0].hamiltonian);
    assert!(energy < 1e-2 * samples[0].hamiltonian, "{energy:e}");
}

/// What is wrong with a rolling wheel is said with its numbers.
#[test]
fn faults_of_rolling_are_named() {
    let text = |more: &str| {
        format!(
            "model = {{ name = \"faults\" }}\nsimulation = {{ step = 0.01, end = 0.1{} }}\n\
             [[body]]\nname = \"wheel\"\nmass = 1.0\ninertia = [0.02, 0.04, 0.02]\n{more}",
            ""
        )
    };
    let at = |z: f64, omega: f64| {
        format!(
            "position = [0.0, 0.0, {z:?}]\nvelocity = [1.5, 0.0, 0.0]\n\
             angular_velocity = [0.0, {omega:?}, 0.0]\n"
        )
    };
    let wheel = |keys: &str| {
        format!("[[constraint]]\nname = \"tyre\"\ntype = \"rolling\"\nbody = \"wheel\"\n{keys}")
    };
    let upright = "axis = [0.0, 1.0, 0.0]\nradius = 0.3\n";
    let cases = [
        (text(&(at(0.303, 5.0) + &wheel(upright))), "0.003 m above the plane"),
        (text(&(at(0.3, 4.0) + &wheel(upright))), "it slips at 0.3 m/s"),
        (text(&(at(0.3, 4.0) + &wheel(upright))), "`angular_velocity = [0, 5, 0]`"),
        (text(&(at(0.3, 5.0) + &wheel("axis = [0.0, 0.0, 1.0]\nradius = 0.3\n"))), "lies flat"),
        (text(&(at(0.3, 5.0) + &wheel("axis = [0.0, 0.1, 1.0]\nradius = 0.3\n"))), "lies flat"),
        (
            text(&(at(0.3, 5.0) + &wheel("axis = [0.0, 1.0, 0.0]\nradius = 0.3\ntube = 0.3\n"))),
            "as large as the wheel",
        ),
        (text(&(at(0.3, 5.0) + &wheel("radius = 0.3\ntube = 0.1\n"))), "a sphere has no tyre"),
        (text(&(at(0.3, 5.0) + &wheel("radius = -0.3\n"))), "is not positive"),
        (
            text(&(at(0.3, 5.0) + &wheel("radius = 0.3\nplane = { on = \"wheel\" }\n"))),
            "`wheel` may move",
        ),
    ];
    for (text, expected) in cases {
        let found = match Model::from_toml(&text) {
            Ok(model) => Simulation::new(&model).map(|_| ()).unwrap_err(),
            Err(error) => error,
        };
        let found: Vec<String> = found.problems(&text).iter().map(|p| format!("{p:?}")).collect();
        let found = found.join("\n");
        println!("{found}");
        assert!(found.contains(expected), "{expected}: {found}");
    }
    let rolls = text(&(at(0.3, 5.0) + &wheel(upright)));
    for (setting, expected) in [
        ("scheme = \"reduced\"", "the scheme reduced does not integrate"),
        ("scheme = \"constrained\"", "does not integrate constraints on velocities"),
        ("scheme = \"em-nodal\"", "does not integrate constraints on velocities"),
        ("scheme = \"static\"", "statics has no equilibria"),
        ("method = \"galerkin\", order = 4", "the Galerkin schemes do not integrate"),
        ("start = \"relaxed\"", "no relaxed start"),
    ] {
        let text = rolls.replace("end = 0.1", &format!("end = 0.1, {setting}"));
        let found = Model::from_toml(&text).unwrap_err();
        let found: Vec<String> = found.problems(&text).iter().map(|p| format!("{p:?}")).collect();
        assert!(found.join("\n").contains(expected), "{setting}: {found:?}");
    }
}

/// A disc that falls over, and one that turns too far in a step, end with their own messages.
#[test]
fn wheels_that_fall_or_turn_too_far_say_so() {
    let failed = |set: &[(&str, &str)]| {
        let text = crate::harness::models::shipped("rolling_disc");
        let mut simulation = Simulation::new(&crate::benchmark::model(&text, set)).unwrap();
        let failure = simulation.samples().find_map(Result::err).expect("it fails");
        println!("{failure:?}");
        format!("{failure:?}")
    };
    let falls = [
        ("parameters.spin", "0.2"),
        ("parameters.yaw", "0.0"),
        ("parameters.fall", "0.5"),
        ("simulation.end", "3.0"),
    ];
    let found = failed(&falls);
    assert!(found.contains("the wheel of `floor` lies flat on its plane"), "{found}");
    assert!(found.contains("end the run before it falls over"), "{found}");
    let fast =
        [("parameters.spin", "60.0"), ("simulation.step", "0.052"), ("simulation.end", "0.52")];
    let found = failed(&fast);
    assert!(found.contains("turns by 3.1") && found.contains("at most 3 are taken"), "{found}");
}

/// `project_start` puts a wheel on its plane and lets it roll.
#[test]
fn a_start_that_slips_is_projected_when_asked() {
    let slips = sensor("slip", "slip", "tyre") + &sensor("x", "position", "wheel");
    let model = Model::from_toml(&(SLOPE.to_owned() + &slips)).unwrap();
    let samples = nodes(&model);
    let height = largest(&samples, |sample| sample.residuals.position);
    assert!(height < 1e-14, "{height:e}");
    let stated = SLOPE.replace(", project_start = true", "");
    let found = Model::from_toml(&stated).unwrap_err().to_string();
    assert!(found.contains("above the plane"), "{found}");
}

/// Two wheels of one leaning axle, as of a cone that rolls: the rows of the large one say in part
/// what those of the small one do. What is left out holds to round-off, too, the apex stays where
/// it is, and the order is 2; fixed to one another and each on its own bearing.
#[test]
fn wheels_of_a_leaning_axle_roll_about_their_apex() {
    let lean = 0.5_f64.atan();
    let (s, c) = lean.sin_cos();
    let spin = 3.0;
    for joint in ["fixed", "revolute"] {
        let wheel = |name: &str, d: f64| {
            let radius = 0.5 * d;
            format!(
                "[[body]]\nname = \"{name}\"\nmass = {:?}\ninertia = [{:?}, {:?}, {:?}]\n\
                 position = [{:?}, 0.0, {:?}]\neuler = {{ sequence = \"y\", angles = [{:?}] }}\n\
                 velocity = [0.0, {:?}, 0.0]\nangular_velocity = [{spin:?}, 0.0, 0.0]\n\
                 [[constraint]]\nname = \"{name}_rail\"\ntype = \"rolling\"\nbody = \"{name}\"\n\
                 axis = [{c:?}, 0.0, {s:?}]\nradius = {radius:?}\n",
                5.0 * radius,
                0.1 * radius,
                0.06 * radius,
                0.06 * radius,
                d * c,
                d * s,
                -lean,
                -spin * d * s,
            ) + &sensor(&format!("{name}_slip"), "slip", &format!("{name}_rail"))
        };
        let axis = match joint {
            "revolute" => format!("axis = [{c:?}, 0.0, {s:?}]\n"),
            _ => String::new(),
        };
        let text = |step: f64| {
            format!(
                "model = {{ name = \"cone\", gravity = [0.0, 1.0, -9.81] }}\n\
                 simulation = {{ step = {step:?}, end = 2.0 }}\n{}{}\
                 [[joint]]\nname = \"axle\"\ntype = \"{joint}\"\nparent = \"small\"\n\
                 child = \"large\"\nposition = [{:?}, 0.0, {:?}]\n{axis}",
                wheel("small", 0.2),
                wheel("large", 0.4),
                0.3 * c,
                0.3 * s,
            )
        };
        let run = |step: f64| nodes(&Model::from_toml(&text(step)).unwrap());
        let samples = run(0.02);
        let slip = largest(&samples, |sample| {
            sample.sensors.iter().fold(0.0, |worst: f64, slip| worst.max(slip.abs()))
        });
        let height = largest(&samples, |sample| sample.residuals.position);
        let exact = run(0.0025).last().unwrap().q.clone();
        let errors =
            [0.02, 0.01].map(|step| distance(&run(step).last().unwrap().q[..3], &exact[..3]));
        // errors of `(h² − h_0²)`
        let order = (errors[0] / errors[1]).log2() - (63.0_f64 / 60.0).log2();
        println!("{joint}: slip {slip:.1e} m/s, gaps {height:.1e}, order {order:.2}");
        assert!(slip < 1e-13 && height < 1e-14, "{slip:e}, {height:e}");
        assert!((1.9..2.1).contains(&order), "{order}");
        if joint == "fixed" {
            let apart = |sample: &Sample| {
                let both = sample.q[..3].iter().zip(&sample.q[12..15]);
                both.map(|(small, large)| (2.0 * small - large).abs()).fold(0.0, f64::max)
            };
            let apex = largest(&samples, apart);
            println!("{joint}: the apex moves by {apex:.1e} m");
            assert!(apex < 1e-12, "{apex:e}");
        }
    }
}
