//! What looks like a slip of units in a valid model is warned of, and the model runs all the same.

use crate::harness::models::{all_shipped, read};
use holonom::{Model, Simulation};

const ARM: &str = include_str!("../models/arm_of_boxes.toml");

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

/// What bushings and laws hold does not fall.
#[test]
fn what_bushings_and_laws_hold_is_held() {
    let free = ARM.split("[[joint]]").next().unwrap();
    assert!(warnings(free).iter().any(|warning| warning.contains("nothing is joined")));
    for held in [
        "[[bushing]]\nname = \"mount\"\nfrom = \"ground\"\nto = \"arm\"\nposition = [0, 0, 0]\nstiffness = [9, 9, 9, 1, 1, 1]\n",
        "[[law]]\nname = \"cord\"\nfrom = \"ground\"\nto = \"arm\"\npoint_from = [0, 0, 5]\ntension = \"9*x\"\n",
        "[[law]]\nname = \"lift\"\non = \"arm\"\nforce = [0, 0, \"9 - z\"]\n",
    ] {
        let found = warnings(&format!("{free}{held}"));
        assert!(!found.iter().any(|warning| warning.contains("nothing is joined")), "{found:?}");
    }
}

const LINKS: &str = include_str!("../models/links_of_boxes.toml");

/// Sizes that no mechanism has: each gives one warning, which names the part, the number and the
/// remedy.
#[test]
fn impossible_sizes_are_warned_of() {
    assert_eq!(warnings(LINKS), [""; 0], "nothing is wrong with this model");
    let of = |from: &str, to: &str| {
        assert!(LINKS.contains(from), "{from}");
        LINKS.replacen(from, to, 1)
    };
    let crank = "shape = { type = \"box\", dimensions = [0.2, 0.02, 0.02], density = 2700.0 }";
    let axis = "position = [0.0, 0.0, 0.0]\naxis = [0.0, 1.0, 0.0]";
    let cases: Vec<(String, &[&str])> = vec![
        (
            of(crank, "mass = 1.0\ninertia = [10000, 20000, 25000]"),
            &["radius of gyration of body `crank` is 158 m", "1e-9"],
        ),
        (
            of(crank, "mass = 0.05\ninertia = [1.5, 1.5, 1.5]"),
            &["radius of gyration of body `crank` is 5.48 m"],
        ),
        (
            of(crank, &format!("inertia = [1.0, 1.0, 1.0]\n{crank}")),
            &["radius of gyration of body `crank`", "its shape measures 0.2 m"],
        ),
        (
            of(crank, "mass = 5.0\ninertia = [1e-9, 1e-9, 1e-9]"),
            &["body `crank` is 1.41e-5 m at a mass of 5 kg"],
        ),
        (
            of(crank, "mass = 654000.0\ninertia = [260, 260, 260]"),
            &["body `crank` is 0.0199 m at a mass of 654000 kg"],
        ),
        (
            of("density = 2700.0", "density = 1e40"),
            &["density 1e40 kg/m³ of body `crank`", "steel 7850"],
        ),
        (
            of("position = [0.6, 0.0, 0.0]\naxis", "position = [0.65, 0.0, 0.05]\naxis"),
            &["joint `rocker_pin`", "of `coupler`", "of `rocker`"],
        ),
        (
            of(axis, &format!("{axis}\nrate = 360")),
            &["`rate` of joint `shaft` is 360 rad/s", "\"= 360*deg\""],
        ),
        (
            of(axis, &format!("{axis}\nlimits = [-45, 1.5]")),
            &["a limit of joint `shaft` is -45 rad", "\"= -45*deg\""],
        ),
        (
            of(axis, &format!("{axis}\nspring = {{ stiffness = 1.0, rest = 90 }}")),
            &["`rest` of the spring of joint `shaft` is 90 rad"],
        ),
        (
            of(
                axis,
                &format!(
                    "{axis}\nmotor = {{ proportional = 1.0, path = {{ moves = [{{ start = 0, end = 1, by = 90 }}] }} }}"
                ),
            ),
            &["`by` in the path of motor of joint `shaft` is 90 rad"],
        ),
        (
            of(
                "position = [0.1, 0.0, 0.0]",
                "position = [0.1, 0.0, 0.0]\neuler = { sequence = \"x\", angles = [180] }",
            ),
            &["`body.crank.euler.angles` is 180.0 rad", "`degrees`"],
        ),
        (
            of("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, 9.81]"),
            &["gravity points along +z", "-9.81"],
        ),
        (
            of("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, -9810]"),
            &["gravity is 9810 m/s²", "mm/s²"],
        ),
        (
            of("step = 0.001, end = 1.0", "step = 0.01, end = 0.001"),
            &["`end` = 0.001 s is less than a step", "t = 0.01 s"],
        ),
        (
            of("step = 0.001, end = 1.0", "step = 0.5, end = 1.0"),
            &["within a step of 0.5 s a body falls by 1.23 m", "below"],
        ),
    ];
    for (text, expected) in &cases {
        let found = warnings(text);
        println!("{found:?}");
        let all = |warning: &&String| expected.iter().all(|part| warning.contains(part));
        assert_eq!(found.iter().filter(all).count(), 1, "{expected:?}: {found:?}");
    }
    let frame = "[[frame]]\nname = \"f\"\neuler = { sequence = \"z\", angles = [360] }\n";
    assert!(
        warnings(&format!("{LINKS}{frame}"))[0].contains("`frame.f.euler.angles` is 360.0 rad")
    );
}

/// What is unusual and right: shapes that are symbols, a rotor, a point mass as a body, a frame of
/// thin rods, a free rod.
#[test]
fn unusual_sizes_are_no_slips() {
    let body = |what: &str| {
        format!(
            "model = {{ name = \"one\" }}\nsimulation = {{ step = 1e-4, end = 1.0 }}\n[[body]]\nname = \"b\"\n{what}\n"
        )
    };
    for what in [
        "mass = 1.0\ninertia = [1e-6, 1e-6, 1e-6]",
        "mass = 5.0\ninertia = [41.7, 41.7, 0.001]",
        "mass = 10.0\ninertia = [250, 250, 250]",
        "mass = 1000.0\ninertia = [5e3, 8e3, 1e4]",
        "mass = 1.0\ninertia = [1.0, 1.0, 2.0]\nangular_velocity = [0.0, 0.0, 500.0]",
        "mass = 100.0\ninertia = [2.0, 2.0, 4.0]\nshape = { type = \"sphere\", dimensions = [0.15] }",
        "mass = 1.0\nshape = { type = \"box\", dimensions = [30, 2, 2] }",
    ] {
        assert_eq!(warnings(&body(what)), [""; 0], "{what}");
    }
    let bob = LINKS
        .replace("[0.2, 0.02, 0.02]", "[0.02, 0.02, 0.02]")
        .replace("[0.4, 0.02, 0.02]", "[0.02, 0.02, 0.02]")
        .replace("[0.02, 0.02, 0.3]", "[0.02, 0.02, 0.02]");
    assert_eq!(warnings(&bob), [""; 0], "shapes that mark centres of mass say nothing of joints");
}

/// Warnings are for slips: models that are meant as they are have none but that they are free.
#[test]
fn shipped_models_have_no_slips() {
    for (name, path) in all_shipped() {
        let model = read(&path, &[]);
        let Ok(simulation) = Simulation::new(&model) else { continue };
        for warning in &simulation.assembly().warnings {
            println!("{name}: {warning}");
            assert!(!warning.contains("from the centre of mass of body"), "{name}: {warning}");
            let slips = [
                "a turn",
                "metres",
                "radius of gyration",
                "of no material",
                "outside the shape",
                "for degrees",
                "gravity",
                "within a step",
                "less than a step",
            ];
            let slip = slips.iter().find(|slip| warning.contains(**slip));
            assert!(slip.is_none(), "{name}: {warning}");
        }
    }
}
