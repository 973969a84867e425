//! Boxes against boxes in model files: what is stacked stays, and free boxes that collide with
//! faces, edges or corners keep their momenta and gain no energy.

use holonom::{Model, Sample, Simulation};
use vi_testkit::Sample as Random;
use vi_testkit::model::{heavy, part};

fn cube(name: &str, mass: f64, length: f64, keys: &str) -> String {
    let shape = format!("shape = {{ type = \"box\", dimensions = {:?} }}\n", [length; 3]);
    part("body", name) + &format!("mass = {mass:?}\n{shape}{keys}")
}

fn rule(name: &str, sides: &str) -> String {
    part("contact", name) + sides
}

fn samples(text: &str) -> Vec<Sample> {
    let model = Model::from_toml(text).unwrap_or_else(|error| panic!("{error:?}\n{text}"));
    let mut simulation = Simulation::new(&model).unwrap();
    let samples = simulation.samples().map(|own| own.map_err(|failure| failure.message));
    samples.collect::<Result<_, _>>().unwrap_or_else(|message| panic!("{message}\n{text}"))
}

/// A box on a box, of the same size and of a smaller one; a tower of three that leans.
#[test]
fn boxes_stand_on_boxes() {
    let floor = "a = { plane = {} }\nb = \"first\"\nfriction = 0.5\n";
    let each = |a: &str, b: &str| format!("a = {a:?}\nb = {b:?}\nfriction = 0.5\n");
    for (lengths, slope) in [
        (&[0.2, 0.2][..], 0.0),
        (&[0.3, 0.1], 0.0),
        (&[0.2, 0.2, 0.2], 0.2_f64),
        (&[0.3, 0.2, 0.1], 0.2),
    ] {
        for method in ["events", "stepping"] {
            let gravity = [9.81 * slope.sin(), 0.0, -9.81 * slope.cos()];
            let times = format!("step = 0.005, end = 1.0, contact = \"{method}\"");
            let (mut text, mut top) = (heavy("tower", gravity, &times), 0.0);
            let names = ["first", "second", "third"];
            for (name, length) in names.into_iter().zip(lengths) {
                let place = format!("position = [0.0, 0.0, {:?}]\n", top + 0.5 * length);
                text += &cube(name, 1.0 + length, *length, &place);
                top += length;
            }
            text += &rule("floor", floor);
            for two in names[..lengths.len()].windows(2) {
                text += &rule(&format!("on {}", two[0]), &each(two[0], two[1]));
            }
            let all = samples(&text);
            let off = |own: &Sample| {
                let both = own.q.iter().zip(&all[0].q);
                both.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            };
            let moved = all.iter().map(off).fold(0.0, f64::max);
            println!("{lengths:?}, slope {slope}, {method}: moved by {moved:.1e} m");
            assert!(moved < 1e-12, "{lengths:?}, slope {slope}, {method}: {moved:e}");
        }
    }
}

/// Beyond `tan α = μ` a box slides down a fixed one, from rest with `g (sin α − μ cos α)`.
#[test]
fn a_box_slides_down_a_box() {
    let (slope, friction, t) = (0.4_f64, 0.3, 0.4);
    let gravity = [9.81 * slope.sin(), 0.0, -9.81 * slope.cos()];
    let fixed = "position = [0.0, 0.0, 0.5]\nfixed = true\n";
    let text = [
        heavy("slide", gravity, &format!("step = 0.005, end = {t}")),
        cube("ramp", 1.0, 1.0, fixed),
        cube("load", 1.0, 0.1, "position = [-0.2, 0.0, 1.05]\n"),
        rule("slide", &format!("a = \"ramp\"\nb = \"load\"\nfriction = {friction}\n")),
    ];
    let all = samples(&text.concat());
    let place = |own: &Sample| own.q[own.q.len() - 12];
    let way = place(&all[all.len() - 1]) - place(&all[0]);
    let exact = 0.5 * 9.81 * (slope.sin() - friction * slope.cos()) * t * t;
    println!("slides by {way} m, exact {exact} m");
    assert!((way - exact).abs() < 1e-11, "{way} for {exact}");
}

/// Two free boxes meet with crossed edges, centre to centre: the velocities after it are those of
/// two balls, `v_A = (1 + e) m_B v/(m_A + m_B)`.
#[test]
fn crossed_edges_collide_as_balls_do() {
    let (m, speed, e) = ([2.0, 1.0], 1.5, 0.6);
    for method in ["events", "stepping"] {
        let text = [
            heavy("edges", [0.0; 3], &format!("step = 0.005, end = 0.5, contact = \"{method}\"")),
            cube("a", m[0], 0.2, "rotation_vector = [0.0, 0.7853981633974483, 0.0]\n"),
            cube(
                "b",
                m[1],
                0.2,
                &format!(
                    "rotation_vector = [0.7853981633974483, 0.0, 0.0]\nposition = [0.0, 0.0, 0.5]\nvelocity = [0.0, 0.0, -{speed}]\n"
                ),
            ),
            rule("edges", &format!("a = \"a\"\nb = \"b\"\nrestitution = {e}\nfriction = 0.3\n")),
        ];
        let all = samples(&text.concat());
        let last = &all[all.len() - 1];
        let moved = |k: usize| last.q[12 * k + 2] - all[all.len() - 11].q[12 * k + 2];
        let found = [0, 1].map(|k| moved(k) / 0.05);
        let shared = (1.0 + e) * speed / (m[0] + m[1]);
        let exact = [-m[1] * shared, -speed + m[0] * shared];
        let lost = 0.5 * m[0] * m[1] / (m[0] + m[1]) * (1.0 - e * e) * speed * speed;
        let energy = all[0].energy - last.energy;
        println!("{method}: velocities {found:?} for {exact:?}, lost {energy} J of {lost} J");
        for k in 0..2 {
            assert!((found[k] - exact[k]).abs() < 1e-10, "{method}: {found:?} {exact:?}");
        }
        assert!((energy - lost).abs() < 1e-10, "{energy} for {lost}");
    }
}

/// Free boxes that tumble into each other: momenta to rounding errors, no energy from contact, no
/// overlap beyond what a feature that changes leaves.
#[test]
fn tumbling_boxes_keep_their_momenta() {
    let mut hits = 0;
    for seed in 0..24 {
        let mut sample = Random::new(seed);
        let mut three = |size: f64| [0; 3].map(|_| size * sample.number());
        let body = |name: &str,
                    mass: f64,
                    x: f64,
                    turned: [f64; 3],
                    spin: [f64; 3],
                    aside: [f64; 3]| {
            let velocity = [-2.0 * x, 0.3 * aside[0], 0.3 * aside[1]];
            let keys = format!(
                "position = {:?}\nvelocity = {velocity:?}\nrotation_vector = {turned:?}\nangular_velocity = {spin:?}\n",
                [x, 0.05 * aside[1], 0.05 * aside[2]]
            );
            cube(name, mass, 0.3, &keys)
        };
        let method = ["events", "stepping"][seed as usize % 2];
        let text = [
            heavy("pair", [0.0; 3], &format!("step = 0.002, end = 1.0, contact = \"{method}\"")),
            body("a", 1.0, -0.5, three(3.0), three(4.0), three(1.0)),
            body("b", 2.5, 0.5, three(3.0), three(4.0), three(1.0)),
            rule("pair", "a = \"a\"\nb = \"b\"\nrestitution = 0.4\nfriction = 0.4\n"),
        ];
        let all = samples(&text.concat());
        let first = &all[0];
        let (mut off, mut gain) = (0.0_f64, f64::MIN);
        for two in all.windows(2) {
            let now = &two[1].momentum;
            let linear = (0..3).map(|i| (now.linear[i] - first.momentum.linear[i]).abs());
            let angular = (0..3).map(|i| (now.angular[i] - first.momentum.angular[i]).abs());
            off = linear.chain(angular).fold(off, f64::max);
            gain = gain.max(two[1].energy - first.energy);
        }
        let lost = first.energy - all[all.len() - 1].energy;
        hits += usize::from(lost > 1e-3);
        println!(
            "{seed} {method}: momenta off by {off:.1e}, {lost:.3} J lost of {:.3} J",
            first.energy
        );
        assert!(off < 1e-12, "seed {seed}: {off:e}");
        assert!(gain < 1e-9, "seed {seed}: {gain:e} J gained");
    }
    println!("{hits} of 24 pairs collide");
    assert!(hits >= 12);
}
