//! `holonom gradient`: numbers of the file by their keys, beside values of runs.

use crate::program::command::{folder, holonom, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

const MAST: &str = r#"
model = { name = "mast", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.2 }
beam = [{ name = "mast", points = [[0.0, 0.0, 0.0], [0.9, 0.0, 0.2]], normal = [0.0, 1.0, 0.0], elements = 3, section = { shape = { type = "rectangle", dimensions = [0.02, 0.03] }, material = { density = 2700.0, E = 7e9, nu = 0.3 } } }]
joint = [{ name = "clamp", type = "fixed", parent = "ground", child = "mast.start", position = [0.0, 0.0, 0.0] }]
sensor = [{ name = "tip", type = "position", of = "mast.end" }]
"#;
const DISC: &str = include_str!("../../examples/models/rolling_disc.toml");

/// What the program prints of a model.
fn gradient(folder: &Path, more: &[&str]) -> Value {
    let all: Vec<&str> = ["gradient", "m.toml", "--json"].iter().chain(more).copied().collect();
    let output = holonom(folder, &all);
    assert!(output.status.success(), "{}", words(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The derivatives of a number at the end of a run by some keys, in their order, are those of
/// central differences of the values that the program prints for `--set`.
fn compare(case: &str, model: &str, of: &str, keys: &[&str], held: &[&str]) {
    let folder = folder("gradients", case);
    fs::write(folder.join("m.toml"), model).unwrap();
    let names = keys.join(",");
    let asked = ["--of", of, "--by", "parameters", "--parameters", &names];
    let printed = gradient(&folder, &[&asked, held].concat());
    let found = printed["parameters"].as_array().unwrap();
    assert_eq!(found.len(), keys.len());
    for (own, key) in found.iter().zip(keys) {
        assert_eq!(own["name"], *key);
        let (value, derivative) =
            (own["value"].as_f64().unwrap(), own["derivative"].as_f64().unwrap());
        let place = if key.contains('.') { (*key).to_owned() } else { format!("parameters.{key}") };
        let at = |value: f64| {
            let set = format!("--set={place}={value:?}");
            let printed = gradient(&folder, &[&asked[..2], held, &[&set]].concat());
            printed["value"].as_f64().unwrap()
        };
        let step = 1e-4 * value.abs().max(0.1);
        let one = |h: f64| (at(value + h) - at(value - h)) / (2.0 * h);
        let wanted = (4.0 * one(step) - one(2.0 * step)) / 3.0;
        println!("{case}: d {of}/d {key} = {derivative}, differences {wanted}");
        assert!(wanted.abs() > 1e-6 && (derivative - wanted).abs() < 1e-6 * wanted.abs());
    }
}

/// A beam: a coordinate of its end, a side of its section, its density.
#[test]
fn numbers_of_beams_are_named_by_their_keys() {
    let keys = [
        "beam.mast.points.1.2",
        "beam.mast.section.material.density",
        "beam.mast.section.shape.dimensions.1",
    ];
    compare("beam", MAST, "tip.z", &keys, &[]);
}

/// A disc that rolls: what the floor carries by its radius and by how it begins.
#[test]
fn numbers_of_what_rolls_are_named() {
    let keys = ["r", "lean", "spin"];
    compare("disc", DISC, "carried.fz", &keys, &["--set=simulation.end=0.3"]);
}
