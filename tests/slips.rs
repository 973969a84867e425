//! What looks like a slip of units in a valid model is warned of, and the model runs all the same.

use crate::harness::models::all_shipped;
use holonom::{Model, Simulation};

const ARM: &str = r#"
model = { name = "arm", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 1.0 }

[[body]]
name = "arm"
shape = { type = "box", dimensions = [1.0, 0.1, 0.1], density = 1000.0 }
position = [0.5, 0.0, 0.0]

[[body]]
name = "hand"
shape = { type = "box", dimensions = [0.1, 0.1, 0.1], density = 1000.0 }
position = [1.05, 0.0, 0.0]

[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "arm"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]

[[joint]]
name = "wrist"
type = "fixed"
parent = "arm"
child = "hand"
position = [1.0, 0.0, 0.0]
"#;

fn warnings(text: &str) -> Vec<String> {
    let model = Model::from_toml(text).unwrap();
    Simulation::new(&model).unwrap().assembly().warnings.clone()
}

#[test]
fn slips_of_units_are_warned_of() {
    assert_eq!(warnings(ARM), [""; 0], "nothing is wrong with this model");
    let with = |part: &str| format!("{ARM}{part}");
    let hand = |from: &str, to: &str| {
        let (arm, hand) = ARM.split_once("\"hand\"").unwrap();
        format!("{arm}\"hand\"{}", hand.replacen(from, to, 1))
    };
    let cases = [
        (hand("density = 1000.0", "density = 1e-6"), "masses from 1.0e-9 kg to 1.0e1 kg"),
        (
            hand("position", "rotation_vector = [0, 0, 90]\nposition"),
            "is 90.0 rad: more than a turn",
        ),
        (
            hand("[0.1, 0.1, 0.1], density = 1000.0", "[2000, 1, 1], density = 1e-3"),
            "measures 2000 m",
        ),
        (
            with(
                "[[spring]]\nname = \"s\"\nfrom = \"ground\"\nto = \"hand\"\npoint_to = [30, 0, 0]\nstiffness = 1.0\n",
            ),
            "a point of spring `s` is 30.000 m from the centre of mass of body `hand`",
        ),
        (
            with(
                "[[load]]\nname = \"l\"\nbody = \"hand\"\npoint = [0, 30, 0]\nforce = [0, 0, 1]\n",
            ),
            "a point of load `l`",
        ),
        (
            with(
                "[[sensor]]\nname = \"p\"\ntype = \"position\"\nof = \"hand\"\npoint = [0, 0, 30]\n",
            ),
            "a point of sensor `p`",
        ),
        (
            with(
                "[[constraint]]\nname = \"d\"\ntype = \"distance\"\nfrom = \"ground\"\nto = \"hand\"\npoint_from = [0, 5, 0]\npoint_to = [0, 0, 30]\n",
            )
            .replace("\"revolute\"", "\"spherical\""),
            "a point of constraint `d`",
        ),
        (
            ARM.replace("[1.0, 0.1, 0.1]", "[0.02, 0.02, 0.02]"),
            "joint `shoulder` is 0.500 m from the centre of mass of body `arm`",
        ),
        (
            with(
                "[[beam]]\nname = \"rod\"\npoints = [[0, 1, 0], [1, 1, 0]]\nelements = 2\nsection = { shape = { type = \"circle\", dimensions = [0.01] }, material = { E = 1e9, nu = 0.3, density = 1e3 } }\n[[load]]\nname = \"l\"\nbody = \"rod.end\"\ntorque = [1, 0, 0]\nframe = \"body\"\n",
            ),
            "load `l` follows d_1 and d_2 of beam `rod`, which are not stated",
        ),
        (ARM.split("[[joint]]").next().unwrap().to_owned(), "nothing is joined to the ground"),
    ];
    for (text, expected) in &cases {
        let found = warnings(text);
        println!("{found:?}");
        assert!(found.iter().any(|warning| warning.contains(expected)), "{expected}: {found:?}");
    }
}

/// Warnings are for slips: models that are meant as they are have none but that they are free.
#[test]
fn shipped_models_have_no_slips() {
    for (name, path) in all_shipped() {
        let model = Model::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap();
        let Ok(simulation) = Simulation::new(&model) else { continue };
        for warning in &simulation.assembly().warnings {
            println!("{name}: {warning}");
            assert!(!warning.contains("from the centre of mass of body"), "{name}: {warning}");
            assert!(
                !warning.contains("a turn") && !warning.contains("metres"),
                "{name}: {warning}"
            );
        }
    }
}
