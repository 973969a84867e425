//! Mechanisms with contact by chance: each run ends, gaps hold, and contact gives no energy.

use holonom::Model;
use vi_testkit::Sample as Random;
use vi_testkit::model::{heavy, part};

const DOWN: [f64; 3] = [0.0, 0.0, -9.81];
const FLOOR: &str = "a = { plane = {} }\n";

/// Runs a model to its end.
fn runs(name: &str, seed: u64, text: &str) {
    if let Some(message) = stops(name, seed, text) {
        panic!("{name} {seed}: {message}\n{text}");
    }
}

/// Runs a model: no gap is passed, and the energy after is not above that before. What ends it
/// early.
fn stops(name: &str, seed: u64, text: &str) -> Option<String> {
    let model = Model::from_toml(text).unwrap_or_else(|error| panic!("{error:?}\n{text}"));
    let mut simulation = holonom::Simulation::new(&model).unwrap();
    let (mut first, mut last, mut smallest) = (None, 0.0, 0.0_f64);
    for own in simulation.samples() {
        let own = match own {
            Ok(own) => own,
            Err(failure) => return Some(failure.message),
        };
        let gaps = own.contacts.iter().map(|contact| contact.gap);
        smallest = gaps.fold(smallest, f64::min);
        first.get_or_insert(own.energy);
        last = own.energy;
    }
    let first = first.unwrap();
    println!("{name} {seed}: energy {first:.3} to {last:.3} J, smallest gap {smallest:.1e} m");
    assert!(smallest > -1e-9, "{name} {seed}: {smallest:e}");
    assert!(last < first + 1e-3 * (1.0 + first.abs()), "{name} {seed}: {first} {last}");
    None
}

fn head(sample: &mut Random, name: &str, end: f64) -> String {
    let step = [5e-4, 1e-3, 2e-3][(3.0 * (0.5 + 0.499 * sample.number())) as usize];
    let method = if sample.number() > 0.0 { "events" } else { "stepping" };
    let simulation = format!("step = {step}, end = {end}, contact = \"{method}\", contacts = true");
    heavy(name, DOWN, &simulation)
}

fn rule(sample: &mut Random, name: &str, sides: &str) -> String {
    let friction = [0.0, 0.3, 0.8][(3.0 * (0.5 + 0.499 * sample.number())) as usize];
    let restitution = 0.45 + 0.45 * sample.number();
    format!(
        "{}{sides}friction = {friction}\nrestitution = {restitution:?}\n",
        part("contact", name)
    )
}

fn solid(name: &str, shape: &str, position: [f64; 3], turned: [f64; 3]) -> String {
    let shape = format!("shape = {{ {shape}, density = 900.0 }}\n");
    let place = format!("position = {position:?}\nrotation_vector = {turned:?}\n");
    part("body", name) + &shape + &place
}

/// A drum that stands is hit by balls: it rocks through the upright, from one point of its rim to
/// another one.
#[test]
fn a_drum_that_is_hit_rocks() {
    for seed in 0..8 {
        let mut sample = Random::new(seed);
        let mut text = head(&mut sample, "drum", 0.8);
        text += &solid(
            "drum",
            "type = \"cylinder\", dimensions = [0.2, 0.1]",
            [0.0, 0.0, 0.05],
            [0.0; 3],
        );
        for k in 0..1 + seed % 2 {
            let at = [0.15 * sample.number(), 0.1 * sample.number(), 0.4 + 0.3 * k as f64];
            text +=
                &solid(&format!("ball{k}"), "type = \"sphere\", dimensions = [0.05]", at, [0.0; 3]);
        }
        text += &rule(&mut sample, "floor", &format!("{FLOOR}b = \"*\"\n"));
        text += &rule(&mut sample, "top", "a = \"drum\"\nb = \"ball*\"\n");
        if seed % 2 == 1 {
            text += &rule(&mut sample, "balls", "a = \"ball*\"\nb = \"ball*\"\n");
        }
        runs("drum", seed, &text);
    }
}

/// A log falls along two that lie side by side, or nearly so: they turn off each other. Where many
/// points of one line touch, their laws may contradict one another by rounding: such a run ends.
#[test]
fn logs_that_lie_along_each_other_roll_off() {
    let log = |length: f64| format!("type = \"capsule\", dimensions = [0.1, {length}]");
    let along = std::f64::consts::FRAC_PI_2;
    let mut ended = Vec::new();
    for seed in 0..8 {
        let mut sample = Random::new(seed);
        let mut text = head(&mut sample, "logs", 0.4);
        text += &solid("log1", &log(0.6), [-0.101, 0.0, 0.1], [along, 0.0, 0.0]);
        text += &solid("log2", &log(0.6), [0.101, 0.0, 0.1], [along, 0.0, 0.0]);
        let tilt = if seed % 2 == 0 { 0.0 } else { 0.1 };
        let turned =
            [along + tilt * sample.number(), tilt * sample.number(), tilt * sample.number()];
        text += &solid("log3", &log(0.5), [0.0, 0.02 * sample.number(), 0.4], turned);
        text += &rule(&mut sample, "floor", &format!("{FLOOR}b = \"*\"\n"));
        text += &rule(&mut sample, "logs", "a = \"log*\"\nb = \"log*\"\n");
        ended.extend(stops("logs", seed, &text));
    }
    println!("{} of 8 end early: {ended:?}", ended.len());
    assert!(ended.iter().all(|message| message.contains("do not converge")), "{ended:?}");
    assert!(ended.len() <= 2, "{ended:?}");
}

/// Chains whose joints have stops and friction, with balls at the ends of their links over a floor,
/// masses by chance over two decades.
#[test]
fn chains_fall_on_stops_and_floor() {
    const LENGTH: f64 = 0.2;
    for seed in 0..8 {
        let mut sample = Random::new(seed);
        let mut text = head(&mut sample, "chain", 1.0);
        let (count, height) = (2 + seed as usize % 4, 0.6);
        for k in 0..count {
            let mass = 10.0_f64.powf(sample.number());
            let at = [LENGTH * (k as f64 + 0.5), 0.0, height];
            text += &format!(
                "{}mass = {mass:?}\nposition = {at:?}\n\
                 shape = {{ type = \"box\", dimensions = [{LENGTH}, 0.02, 0.03] }}\n\
                 collision = [{{ type = \"sphere\", dimensions = [0.02], position = [0.1, 0.0, 0.0] }}]\n",
                part("body", &format!("link{k}"))
            );
        }
        for k in 0..count {
            let parent = if k == 0 { "ground".into() } else { format!("link{}", k - 1) };
            let [lower, upper] =
                [-1.0, 1.0].map(|sign| sign * 10.0_f64.powf(-0.8 + sample.number()));
            let restitution = 0.5 + 0.5 * sample.number();
            let torque = 10.0_f64.powf(-1.0 + sample.number());
            text += &format!(
                "{}type = \"revolute\"\nparent = \"{parent}\"\nchild = \"link{k}\"\n\
                 position = [{:?}, 0.0, {height}]\naxis = [0.0, 1.0, 0.0]\nrate = {:?}\n\
                 limits = {{ lower = {lower:?}, upper = {upper:?}, restitution = {restitution:?} }}\n\
                 friction = {{ torque = {torque:?} }}\n",
                part("joint", &format!("joint{k}")),
                LENGTH * k as f64,
                3.0 * sample.number(),
            );
        }
        text += &rule(&mut sample, "floor", &format!("{FLOOR}b = \"*\"\n"));
        runs("chain", seed, &text);
    }
}
