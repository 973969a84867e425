//! Starts in singular configurations, or nearly so: welds beside them, bodies far away, axes
//! without inertia.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::hostile::{hostile, refusal, run};
use crate::harness::models::shipped;
use holonom::simulation::RunOutcome;
use holonom::vi_constraints::Constraints;
use holonom::vi_core::Configuration;
use holonom::{Model, Override, Simulation};
use vi_testkit::model::{AXES, body_at, hinge, joint};

/// The flat parallelogram in motion, `split`: the link made of two welded halves; `tool`: the link
/// with a body welded to it, 3 for the ground.
fn parallelogram(split: Option<usize>, tool: Option<usize>, scheme: &str) -> String {
    // name, from, to, velocity along y at x, spin
    let links = [("crank", 0.0, 1.0), ("coupler", 1.0, 3.0), ("rocker", 2.0, 3.0)];
    let velocity = |link: usize, x: f64| [x, 1.0, x - 2.0][link];
    let spin = [1.0, 0.0, 1.0];
    let mut text = format!(
        "[model]\nname = \"flat\"\n[simulation]\nstep = 0.005\nend = 1.0\nscheme = \"{scheme}\"\n"
    );
    let mut body = |name: &str, link: usize, x: f64| {
        let (v, w) = if link < 3 { (velocity(link, x), spin[link]) } else { (0.0, 0.0) };
        text += &(body_at([x, 0.0, 0.0], name, 1.0, [0.1; 3])
            + &format!("velocity = [0.0, {v:?}, 0.0]\nangular_velocity = [0.0, 0.0, {w:?}]\n"));
    };
    let mut welds = Vec::new();
    for (k, (name, from, to)) in links.into_iter().enumerate() {
        let middle = 0.5 * (from + to);
        if split == Some(k) {
            body(name, k, 0.5 * (from + middle));
            body(&format!("{name}_end"), k, 0.5 * (middle + to));
            welds.push((name.to_owned(), format!("{name}_end"), middle));
        } else {
            body(name, k, middle);
        }
    }
    if let Some(link) = tool {
        body("tool", link, 1.7);
        welds.push((["crank", "coupler", "rocker", "ground"][link].into(), "tool".into(), 1.7));
    }
    let end =
        |k: usize| if split == Some(k) { format!("{}_end", links[k].0) } else { links[k].0.into() };
    for (name, parent, child, x) in [
        ("A", "ground".to_owned(), "crank".to_owned(), 0.0),
        ("B", end(0), "coupler".to_owned(), 1.0),
        ("C", end(1), end(2), 3.0),
        ("D", "ground".to_owned(), "rocker".to_owned(), 2.0),
    ] {
        text += &hinge(name, [&parent, &child], [x, 0.0, 0.0], AXES[2]);
    }
    for (k, (parent, child, x)) in welds.into_iter().enumerate() {
        text += &joint("fixed", &format!("weld{k}"), [&parent, &child], [x, 0.0, 0.0]);
    }
    text
}

#[test]
fn welds_anywhere_beside_a_singular_start_give_the_right_motion() {
    // no gravity, masses at fixed radii: both cranks rotate at 1 rad/s
    let places = [None, Some(0), Some(1), Some(2)].map(|split| (split, None));
    let tools = [0, 1, 2, 3].map(|tool| (None, Some(tool)));
    for scheme in ["nodal", "reduced", "em-nodal"] {
        for (split, tool) in places.into_iter().chain(tools) {
            let text = parallelogram(split, tool, scheme);
            let model = Model::from_toml(&text).unwrap();
            let mut simulation = Simulation::new(&model).unwrap();
            assert_eq!(simulation.assembly().counts.dof, 1, "{split:?} {tool:?}");
            for _ in 0..200 {
                simulation.step().unwrap();
            }
            let q = simulation.configuration();
            let (x, y) = (q[3], q[4]); // first director of the crank: along it
            let error = (x - 1.0_f64.cos()).hypot(y - 1.0_f64.sin());
            assert!(error < 1e-5, "{scheme}, {split:?} {tool:?}: ({x}, {y}), error {error:e}");
        }
    }
}

/// The largest `|g_i|/Σ_j |G_ij| size_j` in `steps` steps.
fn largest_ratio(simulation: &mut Simulation, steps: u32) -> f64 {
    let m = simulation.mechanism().len();
    let (mut g, mut sizes) = (vec![0.0; m], vec![0.0; m]);
    let mut largest = 0.0_f64;
    for _ in 0..steps {
        simulation.step().unwrap();
        let (mechanism, q) = (simulation.mechanism(), simulation.configuration());
        mechanism.value(Configuration::new(0.0, q), &mut g);
        mechanism.row_sizes(Configuration::new(0.0, q), &mut sizes);
        let ratio = |(g, size): (&f64, &f64)| g.abs() / size;
        largest = g.iter().zip(&sizes).map(ratio).fold(largest, f64::max);
    }
    largest
}

/// Everything of a model moved by 10⁶ m.
fn far_away(text: &str) -> String {
    let mut moved = String::new();
    for line in text.lines() {
        match line.strip_prefix("position = [") {
            Some(rest) => {
                moved += &format!("position = [1000000.0, {}\n", rest.split_once(',').unwrap().1)
            }
            None => moved += &format!("{line}\n"),
        }
    }
    moved
}

#[test]
fn round_off_stays_orders_below_the_bound() {
    let upright = parallelogram(None, None, "nodal");
    let texts = ["pendulum", "chain8", "bricard", "slider_crank"].map(shipped);
    let far = far_away(&shipped("heavy_top_fast"));
    for text in texts.iter().chain([&upright, &far]) {
        let name = text.lines().find(|line| line.contains("name")).unwrap_or_default().to_owned();
        for scheme in ["nodal", "constrained", "em-nodal"] {
            let set = [Override::new("simulation.scheme", format!("\"{scheme}\""))];
            let model = Model::from_toml_with(text, &set).unwrap();
            let Ok(mut simulation) = Simulation::new(&model) else { continue };
            let ratio = largest_ratio(&mut simulation, 500);
            println!("{name}, {scheme}: {ratio:.1e}");
            assert!(ratio < 1e-12, "{name}, {scheme}: {ratio:e}");
        }
    }
}

#[test]
fn what_is_far_away_does_not_make_a_loop_singular() {
    let text = hostile("far_body_singular");
    let (linkage, _) = text.split_once("[[body]]\nname = \"far\"").unwrap();
    let far = "[[body]]\nname = \"far\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\n";
    let arm = "[[joint]]\nname = \"arm\"\ntype = \"revolute\"\nparent = \"ground\"\nchild = \"far\"\n\
               axis = [0.0, 0.0, 1.0]\n";
    for scheme in ["nodal", "constrained", "em-nodal"] {
        let begun = |more: &str| {
            let text = format!("{linkage}{more}")
                .replace("[simulation]", &format!("[simulation]\nscheme = \"{scheme}\""));
            let mut simulation = Simulation::new(&Model::from_toml(&text).unwrap()).unwrap();
            (0..20).for_each(|_| assert!(simulation.step().unwrap().residual.is_finite()));
            simulation
        };
        let alone = begun("");
        assert_eq!(alone.assembly().counts.dof, 7);
        for (more, dof) in [
            (format!("{far}position = [0.0, 1e8, 0.0]\n"), 6),
            (format!("{far}position = [0.0, 1e8, 0.0]\n{arm}position = [0.0, 0.0, 0.0]\n"), 1),
            (format!("{far}position = [1e8, 1e8, 0.0]\n{arm}position = [1e8, 0.0, 0.0]\n"), 1),
            ("[[particle]]\nname = \"far\"\nmass = 1.0\nposition = [0.0, 1e8, 0.0]\n".into(), 3),
        ] {
            let beside = begun(&more);
            assert_eq!(beside.assembly().counts.dof, 7 + dof, "{scheme}, {more}");
            let pairs = alone.configuration().iter().zip(beside.configuration());
            let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{scheme}, {dof} more degrees of freedom: {apart:.1e} apart");
            assert!(apart < 1e-12, "{scheme}, {more}: {apart:e} apart");
        }
    }
}

#[test]
fn welded_models_that_panicked_assemble_or_are_refused() {
    for name in ["panic_fixed_body_singular_start", "panic_fixed_joint_singular_start"] {
        let (outcome, largest) = run(&hostile(name));
        assert!(outcome == RunOutcome::Done && largest < 1e-12, "{name}: {outcome:?} {largest:e}");
    }
    let model = Model::from_toml(&hostile("panic_placement"));
    let refused = model.and_then(|model| Simulation::new(&model).map(|_| ()));
    println!("{refused:?}");
}

#[test]
fn a_body_that_is_free_to_turn_about_an_axis_without_inertia_is_refused() {
    let free = hostile("inertia_thin");
    let held = |kind: &str, axes: &str| {
        free.clone() + &joint(kind, "s", ["ground", "rod"], [0.0, 0.0, 0.5]) + axes
    };
    let along = held("revolute", "axis = [0.0, 0.0, 1.0]\n");
    let across = held("universal", "axis = [1.0, 0.0, 0.0]\naxis2 = [0.0, 1.0, 0.0]\n");
    for scheme in [
        "nodal",
        "reduced",
        "constrained",
        "dalembert",
        "em-nodal",
        "em-constrained",
        "em-dalembert",
    ] {
        let with = |text: &str| {
            text.replace("[simulation]", &format!("[simulation]\nscheme = \"{scheme}\""))
        };
        for text in [&free, &held("spherical", ""), &along] {
            let words =
                refusal(&with(text)).unwrap_or_else(|| panic!("{scheme}: accepted\n{text}"));
            assert!(words.contains("singular"), "{scheme}: {words}");
        }
        let (outcome, largest) = run(&with(&across));
        assert!(outcome == RunOutcome::Done && largest < 1e-14, "{scheme}: {outcome:?}");
    }
}
