//! Shapes that overlap at the start: `overlap = "separate"` of a `[[contact]]` moves them apart by
//! the least way in the norm of the masses.

use holonom::model::Problem;
use holonom::nalgebra::Vector3;
use holonom::run::prepare;
use holonom::{Model, ModelError, Simulation};
use vi_testkit::model::{changed, heavy, part};

const HEAD: &str = "step = 0.01, end = 0.1";

fn simulation(text: &str) -> Simulation {
    Simulation::new(&Model::from_toml(text).unwrap()).unwrap_or_else(|error| panic!("{error}"))
}

fn center(simulation: &Simulation, body: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&simulation.configuration()[12 * body..12 * body + 3])
}

fn refused(text: &str) -> Problem {
    match prepare(&Model::from_toml(text).unwrap()).err() {
        Some(ModelError::Assembly(mut problems)) => problems.swap_remove(0),
        other => panic!("{other:?}"),
    }
}

fn body(name: &str, mass: f64, at: [f64; 3], shape: &str) -> String {
    part("body", name) + &format!("mass = {mass:?}\nposition = {at:?}\nshape = {{ {shape} }}\n")
}

fn ball(name: &str, mass: f64, at: [f64; 3], radius: f64) -> String {
    body(name, mass, at, &format!("type = \"sphere\", dimensions = [{radius:?}]"))
}

fn rule(name: &str, sides: &str) -> String {
    part("contact", name) + sides + "\noverlap = \"separate\"\n"
}

const FLOOR: &str = "a = { plane = {} }\nb = \"*\"";

fn near(found: f64, expected: f64, what: &str) {
    println!("{what}: {found} against {expected}");
    assert!((found - expected).abs() < 1e-12, "{what}: {found} against {expected}");
}

/// Two free balls: each moves along the line of the centres, in the ratio of the other's mass.
#[test]
fn free_bodies_part_in_the_ratio_of_their_masses() {
    let line = Vector3::new(0.12, 0.0, 0.16); // of length 0.2, radii 0.12 and 0.14
    let text = heavy("pair", [0.0; 3], HEAD)
        + &ball("light", 1.0, [0.0; 3], 0.12)
        + &ball("heavy", 3.0, line.into(), 0.14)
        + &rule("pair", "a = \"light\"\nb = \"heavy\"");
    let apart = simulation(&text);
    let way = line.normalize() * 0.06;
    near((center(&apart, 0) + way * 0.75).norm(), 0.0, "light");
    near((center(&apart, 1) - line - way * 0.25).norm(), 0.0, "heavy");
    let said = apart.warnings();
    assert!(
        said[0].starts_with("the initial configuration was changed so that no shapes overlap: moved `light` by 0.045 m"),
        "{said:?}"
    );
    near(apart.assembly().separated.unwrap(), 0.045, "moved");
    let refusal = refused(&changed(&text, "overlap = \"separate\"", ""));
    assert!(refusal.message.contains("overlap by 60 mm at the start"), "{}", refusal.message);
    assert!(refusal.help.unwrap().contains("overlap = \"separate\""));
    let both = changed(&text, "overlap = \"separate\"", "overlap = \"refuse\"");
    assert!(refused(&both).message.contains("overlap by 60 mm"));
}

/// A joint is kept: what slides leaves the plane along its axis; what hangs turns about its pin.
#[test]
fn joints_are_kept() {
    let along = |kind: &str| {
        part("joint", "guide")
            + &format!("type = \"{kind}\"\nparent = \"ground\"\nchild = \"ball\"\n")
    };
    let slide = heavy("slide", [0.0; 3], HEAD)
        + &ball("ball", 2.0, [0.0, 0.0, 0.07], 0.1)
        + &along("prismatic")
        + "position = [0.0, 0.0, 0.0]\naxis = [0.6, 0.0, 0.8]\n"
        + &rule("floor", FLOOR);
    let way = center(&simulation(&slide), 0) - Vector3::z() * 0.07;
    near((way - Vector3::new(0.6, 0.0, 0.8) * (0.03 / 0.8)).norm(), 0.0, "along the axis");
    let pendulum = heavy("pendulum", [0.0; 3], HEAD)
        + &ball("ball", 2.0, [0.6, 0.0, 0.2], 0.3)
        + "angular_velocity = [0.0, -0.5, 0.0]\nvelocity = [0.4, 0.0, 0.3]\n"
        + &along("revolute")
        + "position = [0.0, 0.0, 1.0]\naxis = [0.0, 1.0, 0.0]\n"
        + &rule("floor", FLOOR);
    let run = simulation(&pendulum);
    let found = center(&run, 0);
    near(found.z, 0.3, "height");
    near(f64::hypot(found.x, found.z - 1.0), 1.0, "length");
    let mut rates = Vec::new();
    let mut run = run;
    for sample in run.samples() {
        rates.push(sample.unwrap());
    }
    // the rate of the pin is kept
    let speed = 0.5;
    let moved = (rates[1].q[0] - rates[0].q[0]).hypot(rates[1].q[2] - rates[0].q[2]);
    assert!((moved - 0.01 * speed).abs() < 1e-6, "{moved}");
}

/// A corner in the floor: the box is lifted and turned, by less than a lift alone.
#[test]
fn a_corner_is_lifted_by_a_motion_without_a_push_aside() {
    let text = heavy("corner", [0.0, 0.0, -9.81], HEAD)
        + &body("crate", 4.0, [0.3, 0.2, 0.19], "type = \"box\", dimensions = [0.4, 0.3, 0.4]")
        + "rotation_vector = [0.0, 0.2, 0.0]\nangular_velocity = [1.0, 2.0, 3.0]\n"
        + &rule("floor", FLOOR);
    let run = simulation(&text);
    let way = center(&run, 0) - Vector3::new(0.3, 0.2, 0.19);
    near(way.xy().norm(), 0.0, "aside");
    let deepest = 0.2 * (0.2_f64.cos() + 0.2_f64.sin()) - 0.19;
    assert!(way.z > 0.2 * deepest && way.z < deepest, "{} of {deepest}", way.z);
    let triad = &run.configuration()[3..12];
    let corner = |k: usize| {
        let half = [0.2, 0.15, 0.2];
        let sign = |i: usize| if k >> i & 1 == 1 { 1.0 } else { -1.0 };
        run.configuration()[2] + (0..3).map(|i| sign(i) * half[i] * triad[3 * i + 2]).sum::<f64>()
    };
    let lowest = (0..8).map(corner).fold(f64::INFINITY, f64::min);
    near(lowest, 0.0, "lowest corner");
}

/// Several at once, one of them pushed by another one, and one that is far away stays.
#[test]
fn a_pile_is_parted_from_the_floor_upwards() {
    let text = heavy("pile", [0.0, 0.0, -9.81], HEAD)
        + &ball("low", 1.0, [0.0, 0.0, 0.08], 0.1)
        + &ball("high", 2.0, [0.0, 0.0, 0.25], 0.1)
        + &ball("far", 2.0, [5.0, 0.0, 0.3], 0.1)
        + &rule("floor", FLOOR)
        + &rule("balls", "a = \"*\"\nb = \"*\"");
    let run = simulation(&text);
    near(center(&run, 0).z, 0.1, "low");
    near(center(&run, 1).z, 0.3, "high");
    near((center(&run, 2) - Vector3::new(5.0, 0.0, 0.3)).norm(), 0.0, "far");
}

/// A loop stays closed: a four-bar linkage whose coupler is in the floor.
#[test]
fn loops_stay_closed() {
    let hinge = |name: &str, ends: [&str; 2], at: [f64; 3]| {
        let [parent, child] = ends;
        part("joint", name)
            + &format!(
                "type = \"revolute\"\nparent = \"{parent}\"\nchild = \"{child}\"\nposition = {at:?}\naxis = [0.0, 1.0, 0.0]\n"
            )
    };
    let bar = "type = \"sphere\", dimensions = [0.1]";
    let text = heavy("loop", [0.0, 0.0, -9.81], HEAD)
        + &body("left", 1.0, [0.0, 0.0, -0.5], bar)
        + &body("coupler", 2.0, [0.5, 0.0, -1.0], bar)
        + &body("right", 1.0, [1.0, 0.0, -0.5], bar)
        + &hinge("a", ["ground", "left"], [0.0; 3])
        + &hinge("b", ["left", "coupler"], [0.0, 0.0, -1.0])
        + &hinge("c", ["right", "coupler"], [1.0, 0.0, -1.0])
        + &hinge("d", ["ground", "right"], [1.0, 0.0, 0.0])
        + &rule(
            "floor",
            "a = { plane = { position = [0.0, 0.0, -0.95], normal = [0.2, 0.0, 1.0] } }\nb = \"coupler\"",
        );
    let run = simulation(&text);
    let found = center(&run, 1);
    let n = Vector3::new(0.2, 0.0, 1.0).normalize();
    near(n.dot(&(found + Vector3::z() * 0.95)), 0.1, "clearance");
    // a parallelogram: the coupler moves on a circle of radius 1
    near((found - Vector3::new(0.5, 0.0, 0.0)).norm(), 1.0, "radius");
    assert!((found.x - 0.5).abs() > 0.01);
}

/// What cannot be parted is said: a ball between walls, a slider that reaches its stop.
#[test]
fn what_no_motion_parts_is_said() {
    let wall = |name: &str, x: f64| {
        rule(
            name,
            &format!(
                "a = {{ plane = {{ position = [{x:?}, 0.0, 0.0], normal = [{:?}, 0.0, 0.0] }} }}\nb = \"ball\"",
                -x
            ),
        )
    };
    let wedged = heavy("wedged", [0.0; 3], HEAD)
        + &ball("ball", 1.0, [0.0; 3], 0.2)
        + &wall("left", -0.15)
        + &wall("right", 0.15);
    let problem = refused(&wedged);
    assert!(problem.message.contains("no motion nearby parts"), "{}", problem.message);
    assert!(problem.key.starts_with("contact."), "{}", problem.key);
    let stopped = heavy("stopped", [0.0; 3], HEAD)
        + &ball("ball", 2.0, [0.0, 0.0, 0.05], 0.1)
        + &part("joint", "guide")
        + "type = \"prismatic\"\nparent = \"ground\"\nchild = \"ball\"\nposition = [0.0, 0.0, 0.0]\n"
        + "axis = [0.0, 0.0, 1.0]\nlimits = { upper = 0.04 }\n"
        + &rule("floor", FLOOR);
    assert!(refused(&stopped).message.contains("no motion nearby parts"));
    let reaches = changed(&stopped, "upper = 0.04", "upper = 0.06");
    near(center(&simulation(&reaches), 0).z, 0.1, "below the stop");
    let soft = changed(
        &reaches,
        "overlap = \"separate\"",
        "overlap = \"separate\"\nmodel = { type = \"hunt_crossley\", stiffness = 1e4 }",
    );
    let error = Model::from_toml(&soft).unwrap_err().to_string();
    assert!(error.contains("a contact with a `model` may overlap"), "{error}");
}
