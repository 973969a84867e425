//! What a model file says of a contact is what is assembled, for each pair of shapes: which bodies
//! touch, where their shapes are, with which friction.

use super::shape_runs::{model, rule, samples};
use holonom::Simulation;
use holonom::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use holonom::vi_rigid::gap::{ContactShape, GROUND, smallest_gap};
use vi_testkit::Sample as Random;
use vi_testkit::model::{heavy, part};

const G: f64 = 9.81;

const BOX: &str = "type = \"box\", dimensions = [0.5, 0.4, 0.25]";
const CYLINDER: &str = "type = \"cylinder\", dimensions = [0.15, 0.3]";
const WIDE: &str = "type = \"cylinder\", dimensions = [0.4, 0.3]";
const CAPSULE: &str = "type = \"capsule\", dimensions = [0.1, 0.25]";
const CUBE: &str = "type = \"mesh\", file = \"cube.obj\", scale = [0.2, 0.15, 0.1]";

const PAIRS: [[&str; 2]; 7] = [
    [CYLINDER, BOX],
    [CYLINDER, CYLINDER],
    [CYLINDER, CAPSULE],
    [BOX, CAPSULE],
    [BOX, CUBE],
    [CUBE, CYLINDER],
    [CAPSULE, CUBE],
];

/// A shape in space, by its dimensions as they stand above.
fn in_space(shape: &str, at: &Isometry3<f64>) -> ContactShape {
    let point = |x: f64, y: f64, z: f64| at.transform_point(&Point3::new(x, y, z)).coords;
    let ends = |half: f64| [point(0.0, 0.0, -half), point(0.0, 0.0, half)];
    match shape {
        BOX => ContactShape::Box {
            center: at.translation.vector,
            axes: at.rotation.to_rotation_matrix().into_inner(),
            half_lengths: Vector3::new(0.25, 0.2, 0.125),
        },
        CYLINDER => ContactShape::Cylinder { ends: ends(0.15), radius: 0.15 },
        CAPSULE => ContactShape::Capsule { ends: ends(0.125), radius: 0.1 },
        _ => {
            let side = |k: usize| if k & 1 == 1 { 0.5 } else { -0.5 };
            let corner = |k: usize| point(0.2 * side(k), 0.15 * side(k >> 1), 0.1 * side(k >> 2));
            ContactShape::Points { points: (0..8).map(corner).collect(), radius: 0.0 }
        }
    }
}

fn pose(position: Vector3<f64>, turned: Vector3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(position), UnitQuaternion::from_scaled_axis(turned))
}

/// A body that touches with one shape, at its own place, and whose principal axes are not those of
/// the body; keys: what else is said.
fn body(
    name: &str,
    shape: &str,
    at: &Isometry3<f64>,
    of_shape: &Isometry3<f64>,
    keys: &str,
) -> String {
    let [position, place] = [at, of_shape].map(|own| <[f64; 3]>::from(own.translation.vector));
    let turned: [f64; 3] = at.rotation.scaled_axis().into();
    let q = of_shape.rotation.quaternion();
    let quaternion = [q.w, q.i, q.j, q.k];
    let inertia = [[0.04, 0.004, 0.0], [0.004, 0.03, -0.005], [0.0, -0.005, 0.05]];
    part("body", name)
        + &format!(
            "mass = 2.0\ninertia = {inertia:?}\nposition = {position:?}\nrotation_vector = {turned:?}\ncollision = [{{ {shape}, position = {place:?}, quaternion = {quaternion:?} }}]\n{keys}"
        )
}

/// The gap of a contact is that of the shapes of its two bodies where both stand, of three bodies
/// and contacts between each two.
#[test]
fn gaps_are_those_of_the_bodies_that_are_named() {
    let mut worst = 0.0_f64;
    for (seed, [first, second]) in (0..).zip(PAIRS.iter().cycle().take(21)) {
        let mut sample = Random::new(seed);
        let shapes = [*first, *second, *first];
        let mut text = heavy("wiring", [0.0; 3], "step = 0.01, end = 0.02");
        let mut places = Vec::new();
        for (name, shape, x) in
            [("a", shapes[0], 0.0), ("b", shapes[1], 0.9), ("c", shapes[2], 1.9)]
        {
            let turned: [Vector3<f64>; 2] = [sample.vector(), sample.vector()];
            let at = pose(Vector3::new(x, 0.0, 0.0) + 0.1 * sample.vector(), turned[0]);
            let own = pose(0.05 * sample.vector(), turned[1]);
            text += &body(name, shape, &at, &own, "");
            places.push(in_space(shape, &(at * own)));
        }
        text += &rule("first", "a = \"a\"\nb = \"b\"\n");
        text += &rule("last", "a = \"c\"\nb = \"b\"\n");
        for (contact, a, b) in [("first", "a", "b"), ("last", "c", "b")] {
            text += &(part("sensor", &format!("gap_{contact}")) + "type = \"gap\"\n");
            text += &format!("of = \"{contact}\"\n");
            text += &(part("sensor", &format!("between_{contact}")) + "type = \"clearance\"\n");
            text += &format!("of = \"{a}\"\nto = \"{b}\"\n");
        }
        let found = &samples(&text)[0].sensors;
        let gap = |k: usize| smallest_gap((&places[k], &GROUND), (&places[1], &GROUND)).unwrap();
        for (place, expected) in [gap(0), gap(0), gap(2), gap(2)].into_iter().enumerate() {
            assert!(expected > 0.0, "seed {seed}: apart");
            let off = (found[place] - expected).abs();
            assert!(off < 1e-13, "{first}, {second}, seed {seed}: {found:?} for {expected}");
            worst = worst.max(off);
        }
    }
    println!("gaps to {worst:.1e} m");
}

/// Two pairs with their own friction: each slides as far as its own one lets it.
#[test]
fn friction_is_that_of_the_contact_that_is_named() {
    let up = Isometry3::identity();
    let along = pose(Vector3::zeros(), Vector3::new(0.0, std::f64::consts::FRAC_PI_2, 0.0));
    // lower shape, upper shape, how the upper one lies, half of the heights of both
    let cases = [
        (BOX, CYLINDER, up, [0.125, 0.15]),
        (WIDE, CYLINDER, up, [0.15, 0.15]),
        (WIDE, CAPSULE, along, [0.15, 0.1]),
        (BOX, CAPSULE, along, [0.125, 0.1]),
        (BOX, CUBE, up, [0.125, 0.05]),
        (WIDE, CUBE, up, [0.15, 0.05]),
        (CUBE, BOX, up, [0.05, 0.125]),
    ];
    for (lower, upper, lies, [low, high]) in cases {
        for method in ["events", "stepping"] {
            let times = format!("step = 0.002, end = 0.06, contact = \"{method}\"");
            let mut text = heavy("friction", [0.0, 0.0, -G], &times);
            let (speed, frictions) = (0.5, [0.1, 0.4]);
            for (k, friction) in frictions.iter().enumerate() {
                let y = 3.0 * k as f64;
                let turned = Vector3::new(0.3, -0.4, 0.5 + y);
                let place = |z: f64, x: f64| Vector3::new(x, y, z);
                let at = [pose(place(0.0, 0.0), turned), pose(place(low + high, -0.02), -turned)];
                // shapes stand upright in bodies that do not
                let own = [at[0].rotation.inverse() * up, at[1].rotation.inverse() * lies];
                let names = ["low", "high"].map(|name| format!("{name}{k}"));
                text += &body(&names[0], lower, &at[0], &own[0], "fixed = true\n");
                let moves = format!("velocity = [{speed:?}, 0.0, 0.0]\n");
                text += &body(&names[1], upper, &at[1], &own[1], &moves);
                let sides = format!("a = \"{}\"\nb = \"{}\"\n", names[0], names[1]);
                text += &rule(&format!("on{k}"), &format!("{sides}friction = {friction:?}\n"));
            }
            let mut simulation = Simulation::new(&model(&text)).unwrap();
            let centers = |own: &Simulation| [0, 1].map(|k| own.configuration()[24 * k + 12]);
            let start = centers(&simulation);
            for _ in 0..30 {
                simulation.step().unwrap_or_else(|error| panic!("{error:?}\n{text}"));
            }
            let (end, t) = (centers(&simulation), 0.06);
            for k in 0..2 {
                let (way, exact) = (end[k] - start[k], speed * t - 0.5 * frictions[k] * G * t * t);
                println!("{lower} {upper} {method}: {way} m, {exact} m");
                assert!((way - exact).abs() < 1e-9, "{upper} on {lower}, {k}: {way} for {exact}");
            }
        }
    }
}
