//! Corners of meshes on boxes and cylinders in model files: momenta and energy of free bodies, what
//! rests, a start with overlap, a run that is continued, what is said.

use super::shape_runs::{model, rule, samples, solid, tumble};
use holonom::model::ModelError;
use holonom::run::prepare;
use holonom::{Model, Simulation};
use vi_testkit::model::{changed, heavy, part};

const G: f64 = 9.81;
const BOX: &str = "type = \"box\", dimensions = [0.3, 0.3, 0.26]";
const CYLINDER: &str = "type = \"cylinder\", dimensions = [0.2, 0.26]";
const CUBE: &str = "type = \"mesh\", file = \"cube.obj\", scale = [0.2, 0.16, 0.12]";
const SQUARES: &str = "type = \"mesh\", file = \"squares.obj\", scale = [0.2, 0.16, 0.12]";

/// Free bodies that tumble into each other.
#[test]
fn tumbling_meshes_keep_their_momenta() {
    for first in [BOX, CYLINDER] {
        for second in [CUBE, SQUARES] {
            tumble(first, second);
            tumble(second, first);
        }
    }
}

/// A tower of a box, a mesh that is flush with it, a cylinder on that by corners below it, and a
/// mesh on top: it stands, on a floor that leans.
#[test]
fn a_tower_stands() {
    let base = "type = \"box\", dimensions = [0.2, 0.16, 0.12]";
    let can = "type = \"cylinder\", dimensions = [0.09, 0.1]";
    for (mesh, slope) in [(CUBE, 0.0_f64), (SQUARES, 0.0), (SQUARES, 0.15)] {
        for method in ["events", "stepping"] {
            let gravity = [G * slope.sin(), 0.0, -G * slope.cos()];
            let times = format!("step = 0.01, end = 1.0, contact = \"{method}\"");
            let at = |z: f64| format!("position = [0.0, 0.0, {z:?}]\n");
            let mut text = heavy("tower", gravity, &times)
                + &solid("base", 4.0, base, &at(0.06))
                + &solid("mesh", 2.0, mesh, &at(0.18))
                + &rule("floor", "a = { plane = {} }\nb = \"base\"\nfriction = 0.5\n")
                + &rule("first", "a = \"base\"\nb = \"mesh\"\nfriction = 0.5\n");
            if mesh == SQUARES {
                text += &solid("can", 1.0, can, &at(0.29));
                text += &solid("top", 0.5, mesh, &at(0.4));
                text += &rule("second", "a = \"can\"\nb = [\"mesh\", \"top\"]\nfriction = 0.5\n");
            }
            let all = samples(&text);
            let (first, last) = (&all[0].q, &all[all.len() - 1].q);
            let off = first.iter().zip(last).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{mesh}, slope {slope}, {method}: moved by {off:.1e} m");
            assert!(off < 1e-11, "{mesh}, slope {slope}, {method}: {off:e}");
        }
    }
}

fn sunk(overlap: &str, solid_shape: &str, height: f64) -> String {
    heavy("sunk", [0.0, 0.0, -G], "step = 0.01, end = 0.2")
        + &solid("table", 1.0, solid_shape, "fixed = true\n")
        + &solid("crate", 2.0, CUBE, &format!("position = [0.02, 0.01, {height:?}]\n"))
        + &rule("on", &format!("a = \"table\"\nb = \"crate\"\nfriction = 0.4\n{overlap}"))
}

/// A mesh whose corners are in a box or in a cylinder at the start is refused with the depth, or
/// lifted by it.
#[test]
fn a_mesh_that_overlaps_is_refused_or_lifted() {
    for shape in [BOX, CYLINDER] {
        let height = 0.13 + 0.06 - 0.01;
        let refused = match prepare(&model(&sunk("", shape, height))).err() {
            Some(ModelError::Assembly(mut problems)) => problems.swap_remove(0),
            other => panic!("{other:?}"),
        };
        println!("{}", refused.message);
        assert!(
            refused
                .message
                .starts_with("`crate` and `table` overlap by 10 mm at the start (point ")
        );
        let simulation = Simulation::new(&model(&sunk("overlap = \"separate\"\n", shape, height)));
        let q = simulation.unwrap().configuration().to_vec();
        let place = &q[q.len() - 12..q.len() - 9];
        println!("{place:?}");
        let off = [place[0] - 0.02, place[1] - 0.01, place[2] - 0.19].map(f64::abs);
        assert!(off.iter().all(|x| *x < 1e-12), "{place:?}");
    }
}

/// A stored state continues bit for bit, with corners that come and go.
#[test]
fn a_run_with_meshes_continues_to_the_bit() {
    for (shape, method) in [(BOX, "events"), (CYLINDER, "stepping")] {
        let keys = "position = [0.05, 0.02, 0.3]\nrotation_vector = [0.4, 0.3, 0.2]\nangular_velocity = [2.0, 3.0, 1.0]\n";
        let text = heavy(
            "falls",
            [0.0, 0.0, -G],
            &format!("step = 0.004, end = 0.4, contact = \"{method}\""),
        ) + &solid("table", 1.0, shape, "fixed = true\n")
            + &solid("crate", 2.0, SQUARES, keys)
            + &rule("on", "a = \"table\"\nb = \"crate\"\nfriction = 0.4\nrestitution = 0.3\n");
        let begin = || Simulation::new(&model(&text)).unwrap();
        let bits = |of: &Simulation| -> Vec<u64> {
            of.configuration().iter().map(|x| x.to_bits()).collect()
        };
        for stop in [30, 45, 60] {
            let (mut whole, mut first, mut second) = (begin(), begin(), begin());
            (0..stop).for_each(|_| _ = first.step().unwrap());
            let state = serde_json::to_string(&first.state()).unwrap();
            second.resume(serde_json::from_str(&state).unwrap()).unwrap();
            (0..100).for_each(|_| _ = whole.step().unwrap());
            (stop..100).for_each(|_| _ = second.step().unwrap());
            assert_eq!(bits(&whole), bits(&second), "{shape}, from step {stop}");
        }
    }
}

/// What is not there is refused by name; a mesh that lets thin bodies through is remarked.
#[test]
fn what_is_said_of_meshes() {
    let both = sunk("", CUBE, 1.0);
    let refused = match Model::from_toml_in(&both, &[], model(&sunk("", BOX, 1.0)).meshes).err() {
        Some(error) => error.to_string(),
        None => panic!("two meshes"),
    };
    assert!(
        refused.contains("the contact of a mesh (`table`) with a mesh (`crate`) is not available"),
        "{refused}"
    );
    let warnings = |text: &str| Simulation::new(&model(text)).unwrap().warnings().to_vec();
    assert!(warnings(&sunk("", BOX, 1.0)).is_empty(), "{:?}", warnings(&sunk("", BOX, 1.0)));
    let thin = changed(&sunk("", BOX, 1.0), "[0.3, 0.3, 0.26]", "[0.3, 0.3, 0.1]");
    let said = warnings(&thin);
    println!("{said:?}");
    assert!(
        said[0].starts_with("corners of the mesh of `crate` are up to 0.256 m apart"),
        "{said:?}"
    );
    assert!(said[0].contains("`table`"), "{said:?}");
    let fine = changed(&thin, "cube.obj", "squares.obj");
    assert!(warnings(&fine).is_empty(), "{:?}", warnings(&fine));
    let sensed = sunk("", BOX, 1.0)
        + &part("sensor", "far")
        + "type = \"clearance\"\nof = \"crate\"\nto = \"table\"\n";
    let gap = samples(&sensed)[0].sensors[0];
    assert!((gap - (1.0 - 0.06 - 0.13)).abs() < 1e-14, "{gap}");
}
