//! Order 2 of `q`, `p` and of the constraint force at the nodes; order 1 of the force of single steps.
#![allow(clippy::unwrap_used)] // helpers of tests

mod common;

use common::{Model, distance};
use vi_emscheme::EmForm;
use vi_multibody::PairKind;
use vi_multibody::spring::SpringLaw;

/// `q`, `v` and the constraint force at a node, and the force of the step in the middle of the last
/// coarse step; each of `steps` coarse steps is made in `parts` pieces.
fn end(model: &Model, form: EmForm, (h, steps, parts): (f64, usize, usize)) -> [Vec<f64>; 4] {
    let mut run = model.run(form, h / parts as f64);
    let mut force = Vec::new();
    for n in 0..steps * parts {
        run.step().unwrap();
        if n == (steps - 1) * parts + parts / 2 {
            force.clone_from(&run.node_before().constraint_force_mid);
        }
    }
    let node = run.observe().unwrap().constraint_force.clone();
    [run.state().q.clone(), run.state().v.clone(), node, force]
}

fn models() -> Vec<(&'static str, Model, f64, usize)> {
    vec![
        ("pendulum", common::pendulum(), 0.05, 12),
        ("heavy top", common::heavy_top(), 0.01, 20),
        ("C pair", common::pair(PairKind::Cylindrical, false), 0.02, 20),
        ("E pair", common::pair(PairKind::Planar, true), 0.02, 20),
        ("4 particles", common::four_particles(SpringLaw::QuadraticStretch), 0.005, 80),
        ("linkage 6R", common::linkage(), 0.04, 10),
        ("screw", common::screw(), 0.02, 20),
        ("gear", common::geared(), 0.02, 20),
        ("driven", common::driven(), 0.02, 20),
    ]
}

#[test]
fn order_two_in_q_p_and_the_force_at_nodes() {
    for (name, model, h, steps) in models() {
        let exact = end(&model, EmForm::Dalembert, (h, steps, 256));
        let errors: Vec<[f64; 3]> = [1, 2, 4, 8, 16]
            .map(|parts| {
                let found = end(&model, EmForm::Constrained, (h, steps, parts));
                std::array::from_fn(|k| distance(&found[k], &exact[k]))
            })
            .into();
        for pair in errors.windows(2).skip(1) {
            let orders: [f64; 3] = std::array::from_fn(|k| (pair[0][k] / pair[1][k]).log2());
            let [q, v, force] = pair[1];
            println!(
                "{name:<12} orders of q, v, Gᵀλ: {orders:.3?}  errors {q:.1e} {v:.1e} {force:.1e}"
            );
            for order in orders {
                assert!((order - 2.0).abs() < 0.15, "{name}: {orders:?}, errors {errors:?}");
            }
        }
    }
}

/// A known failure: the multiplier of a single step alternates by `O(h)` around the smooth one, since
/// the start with `G(q_0) v(0) = 0` is `O(h²)` off it. From rest it does not.
#[test]
fn the_force_of_a_single_step_is_of_order_one() {
    // steps are divided by three: the middle of a coarse step is the middle of a fine one
    let error = |model: &Model, h, steps| {
        let at = |parts| end(model, EmForm::Constrained, (h, steps, parts))[3].clone();
        let exact = at(729);
        // compared with the mean over the fine alternation, which is negligible there
        [3, 9, 27, 81].map(|parts| distance(&at(parts), &exact))
    };
    let found = error(&common::pendulum(), 0.05, 12);
    println!("pendulum with a push: errors {found:?}");
    let order = (found[0] / found[3]).ln() / 27.0_f64.ln();
    assert!((0.8..1.4).contains(&order), "order {order:.2}: {found:?}");
    let found = error(&common::pendulum_from_rest(), 0.05, 12);
    let order = (found[0] / found[3]).ln() / 27.0_f64.ln();
    println!("pendulum from rest: errors {found:?}, order {order:.2}");
    assert!((order - 2.0).abs() < 0.15, "order {order:.2}: {found:?}");
}

#[test]
fn four_particles_follow_the_published_motion() {
    // DOP853 reference of the benchmark collection, potential ½ K (l² − l_0²)², t = 1
    let q1 = [0.007_984_33, 0.011_392_15, 0.000_415_10];
    let q4 = [0.692_083_68, 0.655_341_36, 0.921_062_54];
    let error = |h: f64| {
        let mut run = common::four_particles(SpringLaw::QuadraticStretch).run(EmForm::Nodal, h);
        for _ in 0..(1.0 / h).round() as usize {
            run.step().unwrap();
        }
        let q = &run.state().q;
        distance(&q[..3], &q1).max(distance(&q[9..], &q4))
    };
    let (coarse, fine) = (error(0.002), error(0.001));
    println!("off by {coarse:.1e} at h = 0.002, {fine:.1e} at h = 0.001");
    assert!(fine < 1e-3 && (coarse / fine).log2() > 1.8, "{coarse:e} {fine:e}");
}

/// The triple jump of energy–momentum steps has order 4 in `q`, although their velocities leave the tangent
/// space. The integrator offers order 2, the method as published.
#[test]
fn a_composition_has_order_four() {
    use vi_constraints::Constraints;
    use vi_constraints::saddle_point::IndependentRows;
    use vi_constraints::scheme::SubStep;
    use vi_core::Composition;
    use vi_core::newton::NewtonSettings;
    use vi_emscheme::EmState;
    use vi_emscheme::constrained::EmConstrained;
    use vi_emscheme::scheme::EmScheme;
    let model = common::pendulum();
    let (mechanism, system) = (&model.mechanism, model.system());
    let gammas = Composition::of_order(4).unwrap().gammas();
    let end = |parts: usize| {
        let (q, v) = mechanism.start();
        let mut state = EmState::new(0.0, q, v);
        let rows = IndependentRows::all(mechanism.len());
        let settings = NewtonSettings::default();
        let size = (rows, mechanism.len());
        let mut scheme = EmConstrained::new(mechanism.dim(), size, settings);
        for _ in 0..12 * parts {
            for gamma in &gammas {
                let step = SubStep::single(state.t, gamma * 0.05 / parts as f64);
                scheme.advance(&system, mechanism, step, &mut state).unwrap();
            }
        }
        state.q
    };
    let exact = end(512);
    let errors = [1, 2, 4, 8, 16].map(|parts| distance(&end(parts), &exact));
    let order = (errors[2] / errors[4]).log2() / 2.0;
    println!("composed: errors {errors:?}, order {order:.2}");
    assert!((order - 4.0).abs() < 0.1, "order {order}: {errors:?}");
}
