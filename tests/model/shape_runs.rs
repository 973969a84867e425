//! What tests of model files with contacts between shapes share: bodies, meshes, runs.

use holonom::model::{Mesh, Meshes};
use holonom::{Model, Sample, Simulation};
use std::path::Path;
use vi_testkit::Sample as Random;
use vi_testkit::model::{cube_of_squares, heavy, part};

pub(crate) fn solid(name: &str, mass: f64, shape: &str, keys: &str) -> String {
    part("body", name) + &format!("mass = {mass:?}\nshape = {{ {shape} }}\n{keys}")
}

pub(crate) fn rule(name: &str, sides: &str) -> String {
    part("contact", name) + sides
}

pub(crate) fn samples(text: &str) -> Vec<Sample> {
    let mut simulation = Simulation::new(&model(text)).unwrap();
    let samples = simulation.samples().map(|own| own.map_err(|failure| failure.message));
    samples.collect::<Result<_, _>>().unwrap_or_else(|message| panic!("{message}\n{text}"))
}

/// A model that knows the meshes `cube.obj`, the corners of a box of length 1, and `squares.obj`, a
/// box of so many squares that it has more corners than count.
pub(crate) fn model(text: &str) -> Model {
    let meshes = Meshes::default().with("cube.obj", mesh_box(1)).unwrap();
    let meshes = meshes.with("squares.obj", mesh_box(10)).unwrap();
    Model::from_toml_in(text, &[], meshes).unwrap_or_else(|error| panic!("{error:?}\n{text}"))
}

fn mesh_box(squares: usize) -> Mesh {
    Mesh::from_bytes(Path::new("box.obj"), cube_of_squares(squares).into_bytes()).unwrap()
}

/// By how much linear and angular momentum change at most, relative to their largest components at
/// the start.
pub(crate) fn momenta_off(all: &[Sample]) -> f64 {
    let first = &all[0].momentum;
    let size = |own: &[f64; 3]| own.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let (linear, angular) = (size(&first.linear), size(&first.angular));
    let mut worst = 0.0_f64;
    for now in all[1..].iter().map(|own| &own.momentum) {
        for i in 0..3 {
            worst = worst.max((now.linear[i] - first.linear[i]).abs() / linear);
            worst = worst.max((now.angular[i] - first.angular[i]).abs() / angular);
        }
    }
    worst
}

/// Free bodies that tumble into each other: momenta to rounding errors, no energy from contact.
pub(crate) fn tumble(first: &str, second: &str) {
    let (mut hits, mut worst, mut most) = (0, 0.0_f64, f64::MIN);
    for seed in 0..18 {
        let mut sample = Random::new(seed);
        let mut three = |size: f64| [0; 3].map(|_| size * sample.number());
        let mut body = |name: &str, mass: f64, x: f64, shape: &str| {
            let (turned, spin, aside) = (three(3.0), three(4.0), three(1.0));
            let velocity = [-2.0 * x, 0.3 * aside[0], 0.3 * aside[1]];
            let keys = format!(
                "position = {:?}\nvelocity = {velocity:?}\nrotation_vector = {turned:?}\nangular_velocity = {spin:?}\n",
                [x, 0.05 * aside[1], 0.05 * aside[2]]
            );
            solid(name, mass, shape, &keys)
        };
        let method = ["events", "stepping"][seed as usize % 2];
        let times = format!("step = 0.002, end = 1.0, contact = \"{method}\"");
        let text = [
            heavy("pair", [0.0; 3], &times),
            body("a", 1.0, -0.5, first),
            body("b", 2.5, 0.5, second),
            rule("pair", "a = \"a\"\nb = \"b\"\nrestitution = 0.4\nfriction = 0.4\n"),
        ];
        let all = samples(&text.concat());
        let first = &all[0];
        worst = worst.max(momenta_off(&all));
        for own in &all[1..] {
            most = most.max(own.energy - first.energy);
        }
        hits += usize::from(first.energy - all[all.len() - 1].energy > 1e-3);
    }
    println!("{first}, {second}: {hits} of 18 hit, momenta off by {worst:.1e}, gain {most:.1e} J");
    assert!(worst < 1e-13, "{first}, {second}: {worst:e}");
    assert!(most < 1e-9 && hits >= 8, "{first}, {second}: {most:e} J, {hits}");
}
