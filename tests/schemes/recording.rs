//! What is recorded at a node without the saddle-point matrix agrees with its solution: `v̂` and
//! `ᵠp_n` (16), `p_n` (34), `H_d` (53) of trees, closed and redundant loops, beams, point masses
//! and prescribed motions, along the motion and from a singular initial configuration; `λ_n` (36)
//! of trees. Nothing of it changes the motion.
#![allow(clippy::unwrap_used)] // a test

use crate::harness;
use crate::loops::singular_start::Linkage;

use harness::models::shipped;
use holonom::vi_constraints::{LegendreTransforms, SchemeKind};
use holonom::vi_core::MechanicalSystem;
use holonom::vi_core::legendre::p_minus;
use holonom::vi_core::linear::norm_inf;
use holonom::vi_multibody::run::MechanismIntegrator;
use holonom::{Model, Override, Sample, Simulation};

const BRANCHES: &str = include_str!("../models/branches.toml");

/// A prescribed rotation of its elbow.
const DRIVE: &str = r#"
[[constraint]]
name = "drive"
type = "motion"
joint = "elbow"
path = { amplitude = 0.3, frequency = 0.5, phase = -1.5707963267948966 }
"#;

const LUMPED: &str = include_str!("../models/lumped_cantilever.toml");

/// Largest differences, relative to the size of each quantity.
#[derive(Clone, Copy, Debug, Default)]
struct Largest {
    v: f64,
    p: f64,
    projected: f64,
    hamiltonian: f64,
    lambda: f64,
}

fn apart(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let size = norm_inf(expected).max(1e-3);
    found.iter().zip(expected).map(|(a, b)| (a - b).abs() / size).fold(0.0, f64::max)
}

fn simulation(text: &str, scheme: &str) -> Simulation {
    let overrides = [Override::new("simulation.scheme", scheme)];
    Simulation::new(&Model::from_toml_with(text, &overrides).unwrap()).unwrap()
}

/// Compares the nodes of `steps` steps from node `first` on with the saddle-point solutions.
fn compare(run: &mut MechanismIntegrator, first: u64, steps: u64, multipliers: bool) -> Largest {
    run.record_multipliers(multipliers);
    let mut largest = Largest::default();
    for _ in 0..steps {
        run.step().unwrap();
        let node = run.node_before().unwrap().clone();
        let (before, s) = (run.before().clone(), run.interval().clone());
        if before.step < first {
            continue;
        }
        assert!(multipliers || node.lambda.is_empty());
        let (system, constraints, rows) = (run.system(), run.constraints(), run.rows());
        let mut of =
            LegendreTransforms::with_rows(system, constraints, rows).unwrap().of_steps(s.h);
        let at = before.configuration();
        let v = of.velocity(at, &before.p).unwrap();
        let mut projected = vec![0.0; v.len()];

        MechanicalSystem::add_momentum_of_step(system, at, s.h, &v, &mut projected);
        let mut w = vec![0.0; v.len()];
        p_minus(system, &s, &mut w);
        w.iter_mut().zip(&before.p).for_each(|(w, p)| *w = p - *w);
        let weight = if before.step == 0 { 0.5 * s.h } else { s.h };
        let lambda = of.r_d_transposed(at, weight, &w).unwrap(); // (36), (47)
        let p = of.momentum_minus(&s, &lambda).unwrap(); // (34)
        let energy = of.hamiltonian(at, &p).unwrap();
        let raise = |worst: &mut f64, by: f64| *worst = worst.max(by);
        raise(&mut largest.v, apart(&node.v, &v));
        raise(&mut largest.p, apart(&node.p, &p));
        raise(&mut largest.projected, apart(&node.p_projected, &projected));
        if let (Some(found), Some(energy)) = (node.hamiltonian, energy) {
            raise(&mut largest.hamiltonian, apart(&[found.total()], &[energy.total()]));
        }
        if multipliers {
            raise(&mut largest.lambda, apart(&node.lambda, &lambda));
        }
    }
    largest
}

#[test]
fn nodes_agree_with_the_saddle_point() {
    nodes_of_steps(15);
}

#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn more_nodes_agree_with_the_saddle_point() {
    nodes_of_steps(60);
}

/// Nodes of `steps` steps of shipped beams, of 60 of the other systems.
fn nodes_of_steps(steps: u64) {
    let driven = format!("{BRANCHES}{DRIVE}");
    let mut cases = vec![("branches", BRANCHES.to_owned()), ("driven branches", driven)];
    cases.push(("lumped beam", LUMPED.to_owned()));
    let names = ["chain8", "heavy_top", "four_particles", "bricard", "four_bar_windows"];
    let loops = ["andrews_squeezer", "flyball_governor", "six_hinge_cube", "six_hinge_line"];
    let beams = ["flying_beam", "flexible_four_bar", "elastic_ring", "flexible_multibody"];
    for name in names.into_iter().chain(loops).chain(beams) {
        cases.push((name, shipped(name)));
    }
    let judge = |name: &str, scheme: &str, found: Largest| {
        println!("{name}, {scheme}: {found:?}");
        let Largest { v, p, projected, hamiltonian, .. } = found;
        let worst = v.max(p).max(projected).max(hamiltonian);
        assert!(worst < 1e-9, "{name}, {scheme}: {found:?}");
    };
    for (name, text) in &cases {
        for scheme in ["nodal", "reduced", "dalembert"] {
            let steps = if beams.contains(name) { steps } else { 60 };
            let found = compare(simulation(text, scheme).integrator(), 0, steps, false);
            judge(name, scheme, found);
        }
    }
    // the first node is read with the rows of the initial configuration; `dalembert` does not leave
    // it
    let flat = Linkage::new(0.0, [1.0, 1.0], 9.81);
    for scheme in [SchemeKind::Nodal, SchemeKind::Reduced] {
        let mut run = flat.start(scheme, 1e-3).unwrap();
        judge("singular start", scheme.name(), compare(&mut run, 1, 60, false));
    }
}

#[test]
fn multipliers_of_trees_agree_with_the_saddle_point() {
    for (name, text) in [
        ("branches", BRANCHES.to_owned()),
        ("chain8", shipped("chain8")),
        ("flying_beam", shipped("flying_beam")),
    ] {
        let found = compare(simulation(&text, "nodal").integrator(), 0, 60, true);
        println!("{name}: λ {:.1e}, p {:.1e}", found.lambda, found.p);
        assert!(found.lambda < 1e-9 && found.p < 1e-9, "{name}: {found:?}");
    }
}

/// The same nodes with and without sensors of reactions.
#[test]
fn sensors_of_reactions_change_nothing_else() {
    let sensor = "\n[[sensor]]\nname = \"F\"\nof = \"elbow\"\ntype = \"reaction\"\n";
    let record = |text: &str| -> Vec<Sample> {
        let mut simulation = Simulation::new(&Model::from_toml(text).unwrap()).unwrap();
        simulation.samples().take(50).collect::<Result<_, _>>().unwrap()
    };
    let (plain, sensed) = (record(BRANCHES), record(&format!("{BRANCHES}{sensor}")));
    for (a, b) in plain.iter().zip(&sensed) {
        assert_eq!((&a.q, a.step), (&b.q, b.step));
        assert!(apart(&[a.energy, a.hamiltonian], &[b.energy, b.hamiltonian]) < 1e-13);
        let difference = (a.residuals.momentum - b.residuals.momentum).abs();
        assert!(difference < 1e-10 * b.residuals.momentum.max(1.0), "{difference:e}");
        assert!(b.sensors.len() > a.sensors.len());
    }
}
