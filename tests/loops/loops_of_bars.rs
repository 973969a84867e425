//! Bars that close loops, and loops of bodies beside point masses: all four schemes give one
//! motion.
#![allow(clippy::unwrap_used)] // a test

use crate::benchmark;

use benchmark::{Run, assert_order, study};
use holonom::{Model, Override, Simulation};
use nalgebra::Vector3;

/// A tetrahedron of bars that hangs by one more bar, and a swinging chain of two bars at its
/// corner.
const TETRAHEDRON: &str = r#"
[model]
name = "tetrahedron"
gravity = [0, 0, -9.81]
[simulation]
step = 0.01
end = 1.0
[[particle]]
name = "a"
mass = 1.0
position = [0.3, 0.0, -0.4]
[[particle]]
name = "b"
mass = 2.0
position = [1.3, 0.0, -0.4]
[[particle]]
name = "c"
mass = 1.5
position = [0.6, 0.9, -0.3]
[[particle]]
name = "d"
mass = 1.0
position = [0.7, 0.3, 0.5]
[[particle]]
name = "e"
mass = 0.5
position = [1.8, 0.0, -0.4]
[[bar]]
name = "hold"
from = "ground"
to = "a"
point = [0, 0, 0]
[[bar]]
name = "ab"
from = "a"
to = "b"
[[bar]]
name = "ac"
from = "a"
to = "c"
[[bar]]
name = "ad"
from = "a"
to = "d"
[[bar]]
name = "bc"
from = "b"
to = "c"
[[bar]]
name = "bd"
from = "b"
to = "d"
[[bar]]
name = "cd"
from = "c"
to = "d"
[[bar]]
name = "be"
from = "b"
to = "e"
"#;

/// A four-bar linkage of bodies whose coupler pulls a pendulum by a spring.
const LINKAGE: &str = r#"
[model]
name = "linkage and pendulum"
gravity = [0, -9.81, 0]
[simulation]
step = 0.01
end = 1.0
[[body]]
name = "left"
mass = 1.0
inertia = [0.1, 0.01, 0.1]
position = [0, 0.5, 0]
velocity = [0.5, 0, 0]
angular_velocity = [0, 0, -1]
[[body]]
name = "right"
mass = 1.0
inertia = [0.1, 0.01, 0.1]
position = [1, 0.5, 0]
velocity = [0.5, 0, 0]
angular_velocity = [0, 0, -1]
[[body]]
name = "coupler"
mass = 1.0
inertia = [0.01, 0.1, 0.1]
position = [0.5, 1, 0]
velocity = [1, 0, 0]
[[joint]]
name = "foot_left"
type = "revolute"
parent = "ground"
child = "left"
position = [0, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "foot_right"
type = "revolute"
parent = "ground"
child = "right"
position = [1, 0, 0]
axis = [0, 0, 1]
[[joint]]
name = "top_left"
type = "revolute"
parent = "left"
child = "coupler"
position = [0, 1, 0]
axis = [0, 0, 1]
[[joint]]
name = "top_right"
type = "revolute"
parent = "right"
child = "coupler"
position = [1, 1, 0]
axis = [0, 0, 1]
[[particle]]
name = "bob"
mass = 0.7
position = [2.0, 1.0, 0.0]
[[bar]]
name = "rod"
from = "ground"
to = "bob"
point = [2, 2, 0.3]
[[spring]]
name = "pull"
from = "coupler"
to = "bob"
stiffness = 20.0
natural_length = 1.0
"#;

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_four_schemes_agree() {
    for text in [TETRAHEDRON, LINKAGE] {
        let start = |scheme| Run::with(text, 0.005, 2, &[("simulation.scheme", scheme)]);
        for scheme in ["dalembert", "nodal", "reduced"] {
            let (mut run, mut reference) = (start(scheme), start("constrained"));
            let (mut q, mut p) = (0.0_f64, 0.0_f64);
            for _ in 0..100 {
                run.steps(2);
                reference.steps(2);
                q = q.max(apart(run.q(), reference.q()));
                let momentum = |run: &mut Run| {
                    let node = run.simulation.integrator().observe_state().unwrap();
                    node.p_projected.clone()
                };
                p = p.max(apart(&momentum(&mut run), &momentum(&mut reference)));
            }
            let closed = run.residual();
            println!(
                "{}, {scheme}: q apart by {q:.1e}, p by {p:.1e}, |g| {closed:.1e}, {} iterations",
                run.model.header.name, run.iterations
            );
            assert!(q < 1e-11 && p < 1e-11 && closed < 1e-14, "{scheme}: {q:e} {p:e} {closed:e}");
        }
    }
}

#[test]
fn positions_converge_with_the_nominal_order() {
    for (text, member) in [(TETRAHEDRON, "e"), (LINKAGE, "bob")] {
        let place = |h: f64, order: u32| {
            let mut run = Run::new(text, h, order);
            run.until(0.8);
            Vector3::from_column_slice(&run.coordinates(member)[..3])
        };
        let fine = place(0.005, 8);
        for (nominal, steps) in [(2, [0.02, 0.01, 0.005]), (4, [0.02, 0.01, 0.005])] {
            let what = format!("{member}, order {nominal}");
            let (_, orders) = study(&what, &steps, |h| (place(h, nominal) - fine).norm());
            assert_order(&orders, f64::from(nominal), 0.5);
        }
    }
}

#[test]
fn a_flat_start_is_refused() {
    let flat = r#"
        model = { name = "flat", dimension = 2, gravity = [0, -9.81] }
        simulation = { step = 0.01, end = 1.0 }
        particle = [
          { name = "a", mass = 1.0, position = [0.5, 0.0] },
          { name = "b", mass = 1.0, position = [1.5, 0.0] },
        ]
        bar = [
          { name = "left", from = "ground", point = [0, 0], to = "a" },
          { name = "top", from = "a", to = "b" },
          { name = "right", from = "ground", point = [1, 0], to = "b" },
        ]
    "#;
    for scheme in ["constrained", "dalembert", "nodal", "reduced"] {
        let overrides = [Override::new("simulation.scheme", scheme)];
        let model = Model::from_toml_with(flat, &overrides).unwrap();
        let refused = Simulation::new(&model).unwrap_err().to_string();
        println!("{refused}");
        assert!(refused.contains("rank 2 there and rank 3 next to it"), "{refused}");
    }
}
