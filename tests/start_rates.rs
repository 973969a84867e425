//! Start velocities stated as joint rates.

#![allow(clippy::unwrap_used)] // a test

use holonom::{Model, Simulation};
use nalgebra::Vector3;

const ARM: &str = r#"
model = { name = "arm", gravity = [0, 0, -9.81] }
simulation = { step = 0.01, end = 1.0 }

[[body]]
name = "base"
mass = 2.0
inertia = [0.1, 0.1, 0.1]
position = [0, 0, 0.5]

[[body]]
name = "slide"
mass = 1.0
inertia = [0.1, 0.2, 0.2]
position = [1, 0, 1]

[[body]]
name = "hand"
mass = 0.5
inertia = [0.01, 0.02, 0.02]
position = [2, 0.3, 1]

[[joint]]
name = "column"
type = "revolute"
parent = "ground"
child = "base"
position = [0, 0, 0]
axis = [0, 0, 1]
rate = 2.0

[[joint]]
name = "guide"
type = "cylindrical"
parent = "base"
child = "slide"
position = [0.5, 0, 1]
axis = [1, 0, 0]
rate = [0.3, -1.5]

[[joint]]
name = "wrist"
type = "fixed"
parent = "slide"
child = "hand"
position = [1.5, 0, 1]
"#;

#[test]
fn velocities_follow_from_rates() {
    let mut simulation = Simulation::new(&Model::from_toml(ARM).unwrap()).unwrap();
    let report = simulation.assembly();
    assert!(report.closure.velocity < 1e-14, "{:?}", report.closure);
    let v = simulation.integrator().initial_velocity().to_vec();
    let spin = Vector3::new(-1.5, 0.0, 2.0); // of slide and hand
    let slide = Vector3::new(0.3, 2.0, 0.0); // 2 rad/s about z at (1, 0), and along the guide
    let hand = slide + spin.cross(&Vector3::new(1.0, 0.3, 0.0));
    for (body, expected) in [(0, Vector3::zeros()), (1, slide), (2, hand)] {
        let found = Vector3::from_column_slice(&v[12 * body..12 * body + 3]);
        println!("body {body}: {found:?}");
        assert!((found - expected).amax() < 1e-14, "body {body}: {found} {expected}");
    }
}

#[test]
fn rates_where_they_cannot_be_used_are_refused() {
    for (change, to, needle) in [
        ("rate = 2.0", "rate = [2.0, 1.0]", "2 rate(s) for 1 degree(s) of freedom"),
        ("name = \"wrist\"", "name = \"wrist\"\nrate = 1.0", "fixed joint has no rates"),
        (
            "parent = \"base\"\nchild = \"slide\"",
            "parent = \"slide\"\nchild = \"base\"",
            "outboard",
        ),
        ("position = [1, 0, 1]", "position = [1, 0, 1]\nvelocity = [0.3, 2, 0]", "stated twice"),
    ] {
        let text = ARM.replacen(change, to, 1);
        let error = Simulation::new(&Model::from_toml(&text).unwrap()).map(|_| ()).unwrap_err();
        println!("{error}");
        assert!(error.to_string().contains(needle), "{error}");
    }
}
