//! Linkages that are drawn roughly: `project_start` assembles them near the drawing, wherever their
//! links lie.
#![allow(clippy::unwrap_used)] // a test

use holonom::{Model, Simulation};
use nalgebra::{Rotation3, Vector3};
use std::f64::consts::PI;

/// A number in `[−1, 1]` of a linear congruence.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// The links of a four-bar linkage: length, and its angle when it is assembled, with the crank
/// upwards, rad about −y.
const LINKS: [(&str, f64, f64); 3] = [
    ("crank", 0.2, 0.5 * PI),
    ("coupler", 0.698_569_967_862_291_9, 0.412_410_441_597_387_3), // 0.64, 0.28
    ("rocker", 0.6, 2.214_297_435_588_181),                        // −0.36, 0.48
];

/// A drawing with the centres of the links off by `way` (m) and their angles by `turn` (rad), at
/// most.
fn drawing(draws: &mut Draws, way: f64, turn: f64) -> (String, [f64; 3]) {
    let mut text = "model = { name = \"sketch\", gravity = [0, 0, -9.81] }\n\
                    simulation = { step = 0.005, end = 0.1, project_start = true }\n"
        .to_owned();
    let mut angles = [0.0; 3];
    for ((name, length, angle), drawn) in LINKS.iter().zip(&mut angles) {
        *drawn = angle + turn * draws.next();
        let place: Vec<f64> = (0..3).map(|_| way * draws.next()).collect();
        text += &format!(
            "[[body]]\nname = \"{name}\"\nshape = {{ type = \"box\", dimensions = [{length}, 0.02, 0.02], density = 7800 }}\n\
             position = {place:?}\nrotation_vector = [0.0, {}, 0.0]\n",
            -*drawn
        );
    }
    let half = |k: usize| 0.5 * LINKS[k].1;
    let joints = [
        ("A", "ground", "crank", 0.0, -half(0)),
        ("B", "crank", "coupler", half(0), -half(1)),
        ("C", "coupler", "rocker", half(1), half(2)),
        ("D", "ground", "rocker", 1.0, -half(2)),
    ];
    for (name, parent, child, a, b) in joints {
        text += &format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"{child}\"\n\
             anchor_parent = [{a:?}, 0.0, 0.0]\nanchor_child = [{b:?}, 0.0, 0.0]\naxis = [0.0, 1.0, 0.0]\n"
        );
    }
    (text, angles)
}

#[test]
fn links_that_lie_apart_are_assembled_near_the_angles_of_the_drawing() {
    for (way, turn) in [(1.0, 0.0), (1.0, 0.35), (3.0, 0.5)] {
        let mut draws = Draws(7);
        let (mut found, mut largest) = (0, 0.0_f64);
        let count = 20;
        for k in 0..count {
            let (text, angles) = drawing(&mut draws, way, turn);
            let model = Model::from_toml(&text).unwrap();
            let simulation = match Simulation::new(&model) {
                Ok(simulation) => simulation,
                Err(error) => {
                    println!("{way} m, {turn} rad, drawing {k}: {error}");
                    continue;
                }
            };
            found += 1;
            assert_eq!(simulation.assembly().counts.dof, 1, "drawing {k}");
            let q = simulation.configuration();
            for (link, drawn) in angles.iter().enumerate() {
                let d_1 = Vector3::from_column_slice(&q[12 * link + 3..12 * link + 6]);
                // the principal axis of the smallest moment need not be the first: take the line of
                // the link
                let axes =
                    (0..3).map(|i| Vector3::from_column_slice(&q[12 * link + 3 + 3 * i..][..3]));
                let along = Rotation3::from_axis_angle(&-Vector3::y_axis(), *drawn) * Vector3::x();
                let near = axes.map(|axis| axis.dot(&along).abs()).fold(0.0, f64::max);
                assert!(d_1.norm() > 0.99);
                largest = largest.max(near.min(1.0).acos());
            }
            let residual = {
                let mechanism = simulation.mechanism();
                let gap = |joint: &holonom::vi_multibody::Joint| joint.gap().at(q).norm();
                mechanism.description().joints.iter().map(gap).fold(0.0, f64::max)
            };
            assert!(residual < 1e-12, "drawing {k}: open by {residual:e} m");
        }
        println!(
            "{way} m, {turn} rad: {found} of {count} assembled, turned by {largest:.2} rad at most"
        );
        assert_eq!(found, count, "{way} m, {turn} rad");
        assert!(largest < turn + 0.9, "turned by {largest} rad");
    }
}

/// A drawing that is only rounded is not moved as a rough one.
#[test]
fn a_small_gap_is_closed_by_the_smallest_change() {
    let (text, _) = drawing(&mut Draws(1), 0.0, 0.0);
    // every link where it is when assembled, but for the coupler, 1 mm off
    let places = [[0.0, 0.1], [0.32, 0.341], [0.82, 0.24]];
    let mut parts: Vec<String> = text.split("position = ").map(str::to_owned).collect();
    for (part, [x, z]) in parts[1..].iter_mut().zip(places) {
        let rest = part.split_once('\n').unwrap().1.to_owned();
        *part = format!("[{x}, 0.0, {z}]\n{rest}");
    }
    let model = Model::from_toml(&parts.join("position = ")).unwrap();
    let simulation = Simulation::new(&model).unwrap();
    let said = simulation.warnings().join("; ");
    println!("{said}");
    let moved = said.split("moved `").nth(1).unwrap().split(" by ").nth(1).unwrap();
    let moved = moved.split(' ').next().unwrap();
    let moved: f64 = moved.parse().unwrap();
    assert!(moved < 2e-3, "moved by {moved} m");
}
