//! Order 2 of `q`, `p` and of the constraint force at the nodes; order 1 of the force of single
//! steps.
#![allow(clippy::unwrap_used)] // helpers of tests

use crate::common;

use common::{Model, distance};
use vi_core::Composition;
use vi_emscheme::{EmForm, EmOptions};
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
            force.clone_from(&run.node_before().unwrap().constraint_force_mid);
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
        let exact = end(&model, EmForm::Dalembert, (h, steps, 128));
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

/// A known failure: the multiplier of a single step alternates by `O(h)` around the smooth one,
/// since the start with `G(q_0) v(0) = 0` is `O(h²)` off it. From rest it does not.
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

/// `q` and `v` at the end of `steps` macro steps of length `h`, each made in `parts` pieces.
fn composed(
    model: &Model,
    (form, composition): (EmForm, Composition),
    (h, steps, parts): (f64, usize, usize),
) -> [Vec<f64>; 2] {
    let options = EmOptions::new(form, h / parts as f64).composition(composition);
    let (system, mechanism) = (model.system(), model.mechanism.clone());
    let mut run = vi_emscheme::run::integrator(system, mechanism, options).unwrap();
    (0..steps * parts).for_each(|_| assert!(run.step().is_ok()));
    [run.state().q.clone(), run.state().v.clone()]
}

/// The order between two step sizes that differ by two: at the finest halving with errors above
/// `floor`.
fn finest_order(counts: &[usize], errors: &[f64], floor: f64) -> Option<f64> {
    let halvings = counts.iter().enumerate().filter_map(|(i, count)| {
        let fine = counts.iter().position(|other| *other == 2 * count)?;
        (errors[fine] > floor).then(|| (fine, (errors[i] / errors[fine]).log2()))
    });
    halvings.max_by_key(|(fine, _)| *fine).map(|(_, order)| order)
}

/// The compositions have their orders in `q` and in all of `v`, which without composition leaves
/// the tangent space by `O(h²)`: every order on every model, and by every form on some model.
#[test]
fn compositions_have_orders_four_six_and_eight() {
    use Composition::{KahanLi9, KahanLi17, SofroniouSpaletta13, SofroniouSpaletta21, Suzuki5};
    const COMPOSITIONS: [Composition; 5] =
        [Suzuki5, KahanLi9, SofroniouSpaletta13, KahanLi17, SofroniouSpaletta21];
    let counts = [2, 3, 4, 6, 8, 12, 16, 24];
    let models = [
        ("pendulum", common::pendulum(), 1.0),
        ("heavy top", common::heavy_top(), 0.2),
        ("C pair", common::pair(PairKind::Cylindrical, false), 0.25),
        ("4 particles", common::four_particles(SpringLaw::QuadraticStretch), 0.2),
        ("linkage 6R", common::linkage(), 1.2),
    ];
    for (place, (name, model, end)) in models.into_iter().enumerate() {
        let exact = composed(&model, (EmForm::Constrained, SofroniouSpaletta21), (end, 1, 60));
        for (number, form) in EmForm::ALL.into_iter().enumerate() {
            let all = number == place % EmForm::ALL.len();
            for composition in if all { &COMPOSITIONS[..] } else { &[Suzuki5] } {
                let errors: Vec<[f64; 2]> = counts
                    .map(|steps| {
                        let found = composed(&model, (form, *composition), (end, 1, steps));
                        std::array::from_fn(|k| distance(&found[k], &exact[k]))
                    })
                    .into();
                // of the others little is left of v between the first regular errors and round-off,
                // ε|q|/h
                let clear = matches!(composition, Suzuki5 | KahanLi9);
                let measured = [(0, 5e-14), (1, 1e-10)].into_iter().take(1 + usize::from(clear));
                let orders: Vec<f64> = measured
                    .map(|(k, floor)| {
                        let errors: Vec<f64> = errors.iter().map(|e| e[k]).collect();
                        finest_order(&counts, &errors, floor).unwrap()
                    })
                    .collect();
                println!("{name:<12} {:<14} {composition:?}: q, v {orders:.2?}", form.name());
                for found in &orders {
                    let off = found - f64::from(composition.order());
                    // down to round-off the next term of the expansion is seen
                    let next = if *composition == SofroniouSpaletta21 { 1.0 } else { 0.35 };
                    let holds = off > -0.35 && off < next;
                    assert!(holds, "{name} {}: {orders:?}, {errors:?}", form.name());
                }
            }
        }
    }
}

/// Why sub-steps come in pairs. Composed of single steps, an order of 6 is 4 in `q`, and 2 in `v`:
/// each single step turns the sign of the part of `v` that is not tangential.
#[test]
fn single_steps_compose_to_order_four_in_q_and_two_in_v() {
    use vi_constraints::Constraints;
    use vi_constraints::discretization::Discretization;
    use vi_constraints::saddle_point::IndependentRows;
    use vi_constraints::scheme::{StepSolver, SubStep};
    use vi_core::State;
    use vi_core::newton::NewtonSettings;
    use vi_emscheme::EmSystem;
    use vi_emscheme::constrained::EmConstrained;
    use vi_multibody::mechanism::Mechanism;
    let model = common::pendulum();
    let (mechanism, system) = (&model.mechanism, model.system());
    let gammas = Composition::of_order(6).unwrap().gammas();
    let end = |parts: usize| {
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let mut state = State::new(0.0, q, vec![0.0; v.len()]);
        Discretization::<Mechanism>::begin(&system, &mut state, &v);
        let (m, count) = (mechanism.len(), gammas.len());
        let mut scheme = EmConstrained::new(mechanism.dim(), m, IndependentRows::all(m));
        let mut solver = StepSolver::new::<EmSystem, Mechanism>(&scheme, NewtonSettings::default());
        for _ in 0..12 * parts {
            for (index, gamma) in gammas.iter().enumerate() {
                let h = gamma * 0.05 / parts as f64;
                let step = SubStep { index, count, h, t_end: state.t + h };
                solver.advance(&mut scheme, &system, mechanism, step, &mut state).unwrap();
            }
        }
        [state.q, state.v]
    };
    let exact = composed(&model, (EmForm::Constrained, Composition::KahanLi17), (0.05, 12, 8));
    for (k, nominal) in [4.0, 2.0].into_iter().enumerate() {
        let errors = [1, 2, 4, 8].map(|parts| distance(&end(parts)[k], &exact[k]));
        let order = (errors[1] / errors[3]).log2() / 2.0;
        println!("of single steps: errors {errors:?}, order {order:.2}");
        assert!((order - nominal).abs() < 0.15, "order {order}: {errors:?}");
    }
}
