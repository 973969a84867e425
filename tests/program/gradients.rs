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

/// A double pendulum whose motion is chaotic, without controls; angles of its first joint measured.
const CHAOS: &str = r#"
model = { name = "chaos", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 20.0 }
parameters = { m = 1.0 }
body = [{ name = "a", mass = 1.0, inertia = [0.01, 0.1, 0.1], position = [0.5, 0.0, 0.0] }, { name = "b", mass = "= m", inertia = [0.01, 0.1, 0.1], position = [1.5, 0.0, 0.0] }]
joint = [{ name = "j", type = "revolute", parent = "ground", child = "a", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0], rate = -4.0 }, { name = "k", type = "revolute", parent = "a", child = "b", position = [1.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0] }]
sensor = [{ name = "tip", type = "position", of = "b", point = [0.5, 0.0, 0.0] }, { name = "ja", type = "joint_coordinate", of = "j" }]
"#;

/// Exit code and words.
fn said(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = holonom(folder, arguments);
    let all = String::from_utf8_lossy(&output.stdout).into_owned() + &words(&output);
    (output.status.code().unwrap(), all)
}

#[test]
fn what_means_nothing_is_not_judged_and_what_is_not_there_is_named() {
    let folder = folder("gradients", "chaos");
    fs::write(folder.join("m.toml"), CHAOS).unwrap();
    let gradient = |more: &[&str]| said(&folder, &[&["gradient", "m.toml"], more].concat());
    let (code, words) = gradient(&["--of", "tip.z", "--by", "parameters", "--check"]);
    assert!(code == 0 && words.contains("grown by more than 1e6"), "{code} {words}");
    assert!(words.contains("not resolved"), "{words}");
    let short = "--set=simulation.end=3.0";
    let (code, words) = gradient(&["--of", "tip.z", short, "--check"]);
    assert!(code == 0 && !words.contains("warning"), "{code} {words}");
    let (code, words) = gradient(&["--of", "top.z"]);
    assert!(code == 3 && words.contains("did you mean `tip.z`?"), "{code} {words}");
    let (code, words) = gradient(&["--of", "tip.z", "--by", "controls"]);
    assert!(code == 3 && words.contains("add a [[control]]"), "{code} {words}");
    let (code, words) = gradient(&["--of", "tip.z", "--by", "controls,initial", short]);
    assert!(code == 0 && words.contains("warning: the model has no [[control]]"), "{words}");
}

/// In each verb that takes derivatives.
#[test]
fn a_tolerance_of_newton_is_warned_of() {
    let folder = folder("gradients", "tolerance");
    let more = "objective = [{ name = \"height\", type = \"value\", sensor = \"tip.z\" }]\n\
                optimize = { parameters = { m = { min = 0.5, max = 2.0 } } }\n\
                measurement = [{ sensor = \"ja\", sigma = 0.01 }]\n\
                identify = { parameters = { m = { start = 0.9 } } }\n";
    fs::write(folder.join("m.toml"), format!("{CHAOS}{more}")).unwrap();
    fs::write(folder.join("d.csv"), "t,ja\n0.1,-0.38\n0.2,-0.72\n0.3,-1.0\n").unwrap();
    let verbs =
        [&["gradient", "m.toml"][..], &["optimize", "m.toml"], &["identify", "m.toml", "d.csv"]];
    for verb in verbs {
        for (tolerance, warned) in [("1e-3", true), ("0.0", false)] {
            let set = format!("--set=simulation.newton_tolerance={tolerance}");
            let mut all = [verb, &["--set=simulation.end=0.3", &set]].concat();
            if verb[0] != "gradient" {
                all.extend(["-o", "out", "--force"]);
            }
            let (_, words) = said(&folder, &all);
            assert_eq!(words.contains("newton_tolerance = 1e-3"), warned, "{verb:?}: {words}");
        }
    }
}

/// Of an objective, a condition and a measurement.
#[test]
fn what_counts_may_not_jump() {
    let folder = folder("gradients", "jumps");
    let head =
        "[[sensor]]\nname = \"f\"\ntype = \"expression\"\nvalue = \"ja + 0.1*floor(30*ja)\"\n";
    let objective =
        |of: &str| format!("[[objective]]\nname = \"o\"\ntype = \"value\"\nsensor = \"{of}\"\n");
    let free = "[optimize]\nparameters = { m = { min = 0.5, max = 2.0 } }\n";
    let condition = "[[condition]]\nname = \"c\"\nsensor = \"f\"\nequals = -1.0\n";
    let fit = "[[measurement]]\nsensor = \"f\"\nsigma = 0.01\n[identify]\nparameters = { m = { start = 0.9 } }\n";
    fs::write(folder.join("d.csv"), "t,f\n0.1,-0.5\n0.2,-0.8\n0.3,-1.0\n").unwrap();
    let plain = CHAOS.replace(
        "sensor = [",
        "[[sensor]]\nname = \"ja\"\ntype = \"joint_coordinate\"\nof = \"j\"\n# ",
    );
    for (verb, more) in [
        (&["gradient", "m.toml"][..], objective("f")),
        (&["optimize", "m.toml"], objective("f") + free),
        (&["optimize", "m.toml"], objective("ja") + condition + free),
        (&["identify", "m.toml", "d.csv"], fit.to_owned()),
    ] {
        fs::write(folder.join("m.toml"), format!("{plain}{head}{more}")).unwrap();
        let (code, words) = said(&folder, &[verb, &["--set=simulation.end=0.3"]].concat());
        assert!(code == 3 && words.contains("floor(30*ja)"), "{verb:?}: {code} {words}");
        assert!(words.contains("sensor.f.value"), "{verb:?}: {words}");
    }
}

/// A mass alone, from the motion itself: its residuals have many minima.
#[test]
fn a_fit_of_a_chaotic_motion_is_led_to_segments() {
    let folder = folder("gradients", "chaotic_fit");
    let more = "measurement = [{ sensor = \"ja\", sigma = 0.01 }]\n\
                identify = { parameters = { m = { start = 0.95 } } }\n";
    let text = format!("{CHAOS}{more}").replace("end = 20.0", "end = 12.0");
    fs::write(folder.join("m.toml"), text).unwrap();
    assert_eq!(said(&folder, &["run", "m.toml", "-q", "-o", "r"]).0, 0);
    let rows = fs::read_to_string(folder.join("r/sensors.csv")).unwrap();
    let heading: Vec<&str> = rows.lines().next().unwrap().split(',').collect();
    let place = |name: &str| heading.iter().position(|own| *own == name).unwrap();
    let [t, ja] = [place("t"), place("ja")];
    let mut data = String::from("t,ja\n");
    for row in rows.lines().skip(1).step_by(10) {
        let row: Vec<&str> = row.split(',').collect();
        data += &format!("{},{}\n", row[t], row[ja]);
    }
    fs::write(folder.join("d.csv"), data).unwrap();
    let (code, words) = said(&folder, &["identify", "m.toml", "d.csv", "-o", "e"]);
    assert!(code == 1 && words.contains("write `segments` under [identify]"), "{code} {words}");
    let (_, words) = said(&folder, &["identify", "m.toml", "d.csv", "-o", "e", "--force", "-q"]);
    assert!(!words.contains("warnings above") && words.contains("without -q"), "{words}");
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
