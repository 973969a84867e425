//! A part of a model that is turned with its frame moves and pulls as before: what acts along joint
//! coordinates, and the axes along which they are measured, turn with it.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::models::nodes;
use holonom::{Model, Simulation};
use nalgebra::{Rotation3, Vector3};
use vi_testkit::model::{along, arm_and_hand, body, head, joint, part, sensor};

/// Pairs with their keys and their lengths (`l`) and angles (`a`).
const PAIRS: [(&str, &str, &str); 8] = [
    ("revolute", "axis = [0.2, -0.3, 1.0]", "a"),
    ("cylindrical", "axis = [0.2, -0.3, 1.0]", "la"),
    ("prismatic", "axis = [0.2, -0.3, 1.0]", "l"),
    ("planar", "axis = [0.0, 0.0, 1.0]", "lla"),
    ("planar", "axis = [0.0, 0.0, 1.0]\nfirst_axis = [2.0, 1.0, 0.5]", "lla"),
    ("universal", "axis = [1.0, 0.0, 0.0]\naxis2 = [0.0, 0.6, 0.8]", "aa"),
    ("screw", "axis = [0.2, -0.3, 1.0]\npitch = 0.3", "a"),
    ("spherical", "", ""),
];

/// Two bodies, one on the ground and one on the other, both by the same pair; all of them stated in
/// a frame.
fn model((pair, keys, _): (&str, &str, &str), frame: &str, acts: &str, constraint: &str) -> Model {
    let paired = |name: &str, bodies: [&str; 2], at: [f64; 3], acts: &str| {
        joint(pair, name, bodies, at)
            + &format!("relative_to = \"part\"\n{keys}\n{acts}\n")
            + &sensor(&format!("q_{name}"), "joint_coordinate", name)
            + &sensor(&format!("v_{name}"), "joint_rate", name)
            + &sensor(&format!("r_{name}"), "reaction", name)
    };
    let text = [
        head("turned", "step = 0.005, end = 0.2, project_start = true"),
        part("frame", "part") + frame + "\n",
        arm_and_hand("relative_to = \"part\"\n"),
        paired("shoulder", ["ground", "arm"], [0.0; 3], ""),
        paired("wrist", ["arm", "hand"], [0.3, 0.2, 0.0], acts),
        constraint.into(),
    ]
    .concat();
    Model::from_toml(&text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// What acts on a coordinate: keys of the joint, and a constraint.
fn acting(freedom: usize, kind: char) -> [(String, String); 4] {
    let by = if kind == 'l' { 0.1 } else { 0.4 };
    [
        (
            format!("spring = {{ freedom = {freedom}, stiffness = 30.0, rest = {by} }}"),
            String::new(),
        ),
        (format!("damper = {{ freedom = {freedom}, damping = 0.3 }}"), String::new()),
        (format!("motor = {{ freedom = {freedom}, effort = 0.7 }}"), String::new()),
        (
            String::new(),
            format!(
                "[[constraint]]\nname = \"drive\"\ntype = \"motion\"\njoint = \"wrist\"\nfreedom = {freedom}\n\
                 path = {{ moves = [{{ start = 0.0, end = 0.2, by = {by} }}] }}\n\
                 [[sensor]]\nname = \"e\"\ntype = \"effort\"\nof = \"drive\"\n"
            ),
        ),
    ]
}

const FRAMES: [[f64; 3]; 3] = [[0.0, 0.0, 45.0], [90.0, 0.0, 0.0], [20.0, -130.0, 75.0]];

#[test]
fn what_acts_along_joint_coordinates_turns_with_the_frame() {
    let mut worst = (0.0_f64, String::new());
    for pair in PAIRS {
        let mut all = vec![(String::new(), String::new())];
        let freedoms = pair.2.chars().enumerate();
        all.extend(freedoms.flat_map(|(freedom, kind)| acting(freedom, kind)));
        for (acts, constraint) in all {
            let found = |frame: &str| {
                let model = model(pair, frame, &acts, &constraint);
                let last = nodes(&model).pop().unwrap();
                assert!((last.t - 0.2).abs() < 1e-12, "{pair:?} {acts} {constraint}");
                (Vector3::new(last.q[12], last.q[13], last.q[14]), last.sensors)
            };
            let (place, sensors) = found("");
            for [x, y, z] in FRAMES {
                let turn = format!(
                    "position = [0.5, -0.2, 0.3]\neuler = {{ sequence = \"xyz\", degrees = [{x:?}, {y:?}, {z:?}] }}"
                );
                let angle =
                    |axis, degrees: f64| Rotation3::from_axis_angle(&axis, degrees.to_radians());
                let rotation = angle(Vector3::x_axis(), x)
                    * angle(Vector3::y_axis(), y)
                    * angle(Vector3::z_axis(), z);
                let (turned, own) = found(&turn);
                let expected = Vector3::new(0.5, -0.2, 0.3) + rotation * place;
                let size = sensors.iter().fold(1.0_f64, |size, x| size.max(x.abs()));
                let sensed = own.iter().zip(&sensors).map(|(a, b)| (a - b).abs() / size);
                let off = sensed.fold((turned - expected).amax(), f64::max);
                if off.is_nan() || off > worst.0 {
                    worst = (off, format!("{pair:?}, {acts}{constraint}, {x} {y} {z}"));
                }
            }
        }
    }
    println!("largest difference {:.1e}: {}", worst.0, worst.1);
    assert!(worst.0 < 1e-9, "{worst:?}");
}

/// A slider on a plane that is free along one axis of the file and held along the other.
#[test]
fn the_first_displacement_of_a_planar_pair_is_along_its_first_axis() {
    let text = |first: &str| {
        [
            head("slider", "step = 0.001, end = 0.3"),
            body("slider", 1.0, [0.1; 3]),
            "velocity = [1.0, 0.0, 0.0]\nrotation_vector = [0.0, 0.0, 0.3]\n".into(),
            along([0.0, 0.0, 2.0], "planar", "table", ["ground", "slider"], [0.0; 3]),
            format!("{first}\nspring = {{ freedom = 0, stiffness = 100.0 }}\n"),
        ]
        .concat()
    };
    let place = |first: &str| {
        let model = Model::from_toml(&text(first)).unwrap();
        let last = nodes(&model).pop().unwrap();
        [last.q[0], last.q[1]]
    };
    // held along x: x = sin(10 t)/10 to the order of the scheme; free along x: x = t
    let [held, across] = place("first_axis = [1.0, 0.0, 0.7]");
    println!("{held} {across}");
    assert!((held - 3.0_f64.sin() / 10.0).abs() < 1e-5 && across.abs() < 1e-12, "{held} {across}");
    let [free, across] = place("first_axis = [0.0, -3.0, 0.0]");
    println!("{free} {across}");
    assert!((free - 0.3).abs() < 1e-12 && across.abs() < 1e-12, "{free} {across}");
}

#[test]
fn a_first_axis_that_says_nothing_is_refused() {
    for (keys, words) in [
        ("type = \"planar\", axis = [0, 0, 1], first_axis = [0, 0, 3],", "along `axis`"),
        ("type = \"planar\", axis = [0, 0, 1], first_axis = [0, 0, 0],", "zero length"),
        ("type = \"spherical\", first_axis = [1, 0, 0],", "no `first_axis`"),
        (
            "type = \"universal\", axis = [0, 0, 1], axis2 = [1, 0, 0], first_axis = [1, 0, 0],",
            "axis2",
        ),
    ] {
        let text = format!(
            "model = {{ name = \"x\" }}\nsimulation = {{ step = 0.01, end = 0.1 }}\n\
             body = [{{ name = \"b\", mass = 1.0, inertia = [1.0, 1.0, 1.0] }}]\n\
             joint = [{{ name = \"j\", {keys} parent = \"ground\", child = \"b\", position = [0, 0, 0] }}]\n"
        );
        let found = Model::from_toml(&text).unwrap_err();
        let problems = format!("{:?}", found.problems(&text));
        assert!(problems.contains(words) && problems.contains("first_axis"), "{problems}");
    }
}

/// Axes that a model does not state are written with it: the model that a run stores is the same
/// one.
#[test]
fn a_model_in_a_frame_reads_back_as_it_is() {
    for pair in PAIRS {
        let frame = "euler = { sequence = \"xyz\", degrees = [20.0, -130.0, 75.0] }";
        let model = model(pair, frame, "", "");
        let again = Model::from_toml(&model.to_toml()).unwrap();
        assert_eq!(again, model, "{pair:?}");
        Simulation::new(&again).unwrap();
    }
}
