//! Steps, what is recorded, tolerances: each tolerance is judged on both of its sides.

use super::{Case, Checks, Run};
use holonom::nalgebra::Vector3;

type Vector = Vector3<f64>;

/// Which nodes are recorded.
fn recorded() -> Case {
    let text = include_str!("../../models/falling_car.toml");
    Case::new("recorded nodes", text, |run: &Run| {
        let mut checks = Checks::default();
        let steps: Vec<f64> = run.nodes.iter().map(|node| node.step as f64).collect();
        checks.all("steps", &steps, &[0.0, 3.0, 6.0, 9.0, 10.0], 0.1);
        for node in 0..run.steps() {
            let t = run.nodes[node].step as f64 * 0.01;
            checks.near("time", run.t(node), t, 1e-14);
            checks.near("fall", run.sensor("rail_coordinate", node), -5.0 * t * t, 1e-12);
            let momenta = run.nodes[node].momenta.as_ref();
            let p = momenta.map_or(f64::NAN, |momenta| momenta.p_projected[2]);
            checks.near("momentum", p, -20.0 * t, 1e-11);
        }
        let mut columns = run.facts.columns.clone();
        columns.sort();
        checks.holds("columns", columns == ["Positions"]);
        checks
    })
    .settings()
    .only("simulation")
    .blind("simulation.columns", "in any order")
}

/// A bar that is longer than drawn by `off` tolerances is accepted or not.
fn start_tolerance() -> Case {
    let text = |length: f64| {
        format!(
            r#"
model = {{ name = "bar" }}
simulation = {{ step = 0.01, end = 0.02, start_tolerance = 2e-3 }}
particle = [{{ name = "ball", mass = 2.0, position = [1.0, 0.0, 0.0] }}]
bar = [{{ name = "rod", from = "ground", to = "ball", length = {length:?} }}]
"#
        )
    };
    Case::new("tolerance of the start", text(1.0008), |run: &Run| {
        let mut checks = Checks::default();
        let mut longer = run.document.clone();
        longer["bar"][0]["length"] = 1.0025.into();
        checks.holds("refused beyond", Run::of("longer bar", &longer, &[]).is_err());
        longer["bar"][0]["length"] = 1.0015.into();
        checks.holds("accepted below", Run::of("shorter bar", &longer, &[]).is_ok());
        checks.vector("place", run.place("ball", 0), Vector::x(), 1e-3);
        checks
    })
    .settings()
    .only("simulation.start_tolerance")
}

/// A four-bar linkage with an axis that is off by an angle moves up to the tolerance.
fn loop_tolerance() -> Case {
    let body = |name: &str, x: f64, y: f64| {
        format!(
            "{{ name = \"{name}\", mass = 1.0, inertia = [1.0, 1.0, 1.0], position = [{x:?}, {y:?}, 0.0] }}"
        )
    };
    let joint = |name: &str, parent: &str, child: &str, [x, y]: [f64; 2]| {
        format!(
            "{{ name = \"{name}\", type = \"revolute\", parent = \"{parent}\", child = \"{child}\", position = [{x:?}, {y:?}, 0.0], axis = [0.0, 0.0, 1.0] }}"
        )
    };
    let text = format!(
        "model = {{ name = \"loop\", gravity = [1.0, -9.81, 0.0] }}\nsimulation = {{ step = 1e-3, end = 5e-3, loop_tolerance = 4e-3 }}\nbody = [{}, {}, {}]\njoint = [{}, {}, {}, {}]\n",
        body("crank", 0.0, 0.5),
        body("rod", 1.0, 1.2),
        body("rocker", 2.0, 0.7),
        joint("a", "ground", "crank", [0.0, 0.0]),
        joint("b", "crank", "rod", [0.0, 1.0]),
        joint("c", "rod", "rocker", [2.0, 1.4]),
        joint("d", "ground", "rocker", [2.0, 0.0]),
    );
    Case::new("tolerance of loops", text, |run: &Run| {
        let mut checks = Checks::default();
        let dof = |off: f64| {
            let mut turned = run.document.clone();
            turned["joint"][2]["axis"][1] = off.into();
            Run::of("turned axis", &turned, &[]).map_or(f64::NAN, |run| run.facts.dof as f64)
        };
        for (off, expected) in [(2e-3, 1.0), (3e-3, 1.0), (7.5e-3, 0.0)] {
            checks.near(&format!("degrees of freedom at {off} rad"), dof(off), expected, 0.1);
        }
        checks
    })
    .settings()
    .only("simulation.loop_tolerance")
}

/// A point mass on a stiffening spring.
fn stiffening(settings: &str, speed: f64) -> String {
    format!(
        r#"
model = {{ name = "spring" }}
simulation = {{ step = 0.05, end = 2.0, {settings} }}
particle = [{{ name = "ball", mass = 2.0, position = [1.0, 0.0, 0.0], velocity = [0.3, {speed:?}, 0.0] }}]
spring = [{{ name = "cord", from = "ground", to = "ball", law = "quadratic_stretch", stiffness = 30.0, natural_length = 0.8 }}]
"#
    )
}

/// Newton's method stops at a residual, and not before.
fn newton_tolerance() -> Case {
    Case::new(
        "tolerance of Newton's method",
        stiffening("newton_tolerance = 1e-3", 1.0),
        |run: &Run| {
            let mut checks = Checks::default();
            let of = |tolerance: f64| {
                let mut other = run.document.clone();
                let settings = other["simulation"].as_table_mut().unwrap();
                settings.insert("newton_tolerance".into(), tolerance.into());
                Run::of("another tolerance", &other, &[]).unwrap()
            };
            let mean = |run: &Run| {
                run.nodes.iter().map(|node| node.newton_iterations).sum::<f64>() / run.last() as f64
            };
            // convergence is quadratic: the floor is two iterations further
            checks.near("iterations saved", mean(&of(0.0)) - mean(run), 1.5, 0.9);
            let off = (run.place("ball", 40) - of(0.0).place("ball", 40)).norm();
            checks.near("error", off.log10(), -5.0, 2.5);
            checks
        },
    )
    .settings()
    .only("simulation.newton_tolerance")
    .blind("simulation.newton_tolerance", "twice the tolerance: the same iterations in most steps")
}

/// The most iterations are enough for a slow motion, not for a fast one.
fn newton_iterations() -> Case {
    Case::new(
        "iterations of Newton's method",
        stiffening("newton_max_iterations = 3", 1.0),
        |run: &Run| {
            let mut checks = Checks::default();
            let most = run.nodes.iter().map(|node| node.newton_iterations).fold(0.0, f64::max);
            checks.near("iterations", most, 3.0, 0.1);
            let faster = |limit: Option<i64>| {
                let mut other = run.document.clone();
                other["particle"][0]["velocity"][1] = 60.0.into();
                if let Some(limit) = limit {
                    let settings = other["simulation"].as_table_mut().unwrap();
                    settings.insert("newton_max_iterations".into(), limit.into());
                }
                Run::of("faster", &other, &[]).map(|run| run.steps())
            };
            checks.holds("refused", faster(None).is_err());
            checks.holds("possible", faster(Some(30)).is_ok());
            checks
        },
    )
    .settings()
    .only("simulation.newton_max_iterations")
}

/// A rotation for which no whole step exists: `h ω = 1.5`, and two parts of it do.
fn divided() -> Case {
    let text = r#"
model = { name = "rotor" }
simulation = { step = 0.5, end = 2.0, on_failure = "substep" }
body = [{ name = "nut", mass = 1.0, inertia = [1.0, 1.2, 1.5], angular_velocity = [0.0, 0.0, 3.0] }]
"#;
    Case::new("divided steps", text, |run: &Run| {
        let mut checks = Checks::default();
        let turned = 2.0 * (0.25 * 3.0_f64).asin(); // two parts
        for node in 0..run.steps() {
            let angle = turned * node as f64;
            let d1 = Vector::new(angle.cos(), angle.sin(), 0.0);
            checks.vector("first axis", run.directors("nut", node).column(0).into(), d1, 1e-9);
        }
        checks.near("divided steps", run.facts.divided_steps as f64, 4.0, 0.1);
        checks
    })
    .settings()
    .only("simulation.on_failure")
}

pub(crate) fn cases() -> Vec<Case> {
    vec![
        recorded(),
        start_tolerance(),
        loop_tolerance(),
        newton_tolerance(),
        newton_iterations(),
        divided(),
    ]
}
