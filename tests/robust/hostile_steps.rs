//! Steps at rounding, of half a turn, to a mirror image: taken as they should be, or refused by
//! name.

#![allow(clippy::unwrap_used)] // a test

use crate::harness::hostile::{hostile, run, run_with_warnings};
use holonom::simulation::RunOutcome;
use holonom::{Model, Override, Simulation};

#[test]
fn a_body_at_rest_stays_there_in_every_scheme() {
    let text = hostile("em_constrained_at_rest");
    let locked = text.replace("end = 3.0", "end = 0.3");
    let (open, _) = locked.split_once("[[constraint]]").unwrap();
    let (_, simulation) = locked.split_once("[simulation]").unwrap();
    let screw = format!("{open}[simulation]{simulation}");
    for text in [&locked, &screw] {
        for (scheme, order) in [
            ("nodal", 2),
            ("reduced", 2),
            ("constrained", 2),
            ("constrained", 4),
            ("dalembert", 2),
            ("em-nodal", 2),
            ("em-constrained", 2),
            ("em-constrained", 4),
            ("em-dalembert", 2),
        ] {
            let of = format!("scheme = \"{scheme}\"\norder = {order}");
            let text = text.replace("scheme = \"em-constrained\"", &of);
            let (outcome, largest, warnings) = run_with_warnings(&text);
            assert!(outcome == RunOutcome::Done, "{scheme}, order {order}: {outcome:?}");
            assert!(largest < 1e-14, "{scheme}, order {order}: {largest:e}");
            let others = warnings.into_iter().filter(|w| !w.starts_with("nothing can move"));
            let others: Vec<String> = others.collect();
            assert_eq!(others, [""; 0], "{scheme}, order {order}: of rounding");
        }
    }
}

/// Multipliers at rounding may be corrected by 1e-8 of their value in each iteration; the step is
/// taken where its residual is at the rounding of its terms.
#[test]
fn multipliers_of_a_galerkin_step_at_rounding_do_not_refuse_it() {
    let (outcome, largest) = run(&hostile("galerkin_multipliers"));
    println!("residual {largest:.1e}");
    assert_eq!(outcome, RunOutcome::Done);
    assert!(largest < 1e-14, "{largest:e}");
}

/// Where a body makes about half a turn in a step, averaged directors all but vanish, and
/// directions of the discrete null space with them. Such a step of `em-dalembert` is refused; in
/// parts it conserves the energy.
#[test]
fn a_half_turn_in_a_step_of_em_dalembert_is_refused() {
    let text = hostile("em_half_turn");
    let (outcome, _) = run(&text);
    let RunOutcome::Failed(failure) = outcome else { panic!("taken") };
    println!("step {}: {}; {}", failure.step, failure.message, failure.remedy);
    assert!(failure.message.contains("rotation") && failure.message.contains("`body0`"));
    assert!(failure.remedy.contains("half a turn"), "{}", failure.remedy);
    let set = [Override::new("simulation.on_failure", "\"substep\"")];
    let mut simulation = Simulation::new(&Model::from_toml_with(&text, &set).unwrap()).unwrap();
    let nodes: Vec<_> = simulation.samples().map(Result::unwrap).collect();
    let balance: Vec<f64> = nodes.iter().map(|node| *node.energies.last().unwrap()).collect();
    let worst = holonom::vi_core::linear::norm_inf(&balance);
    println!("in parts: balance {worst:.1e} J");
    assert!(worst < 1e-11, "{worst:e}");
}

/// Constraints that all but depend on one another enlarge the rounding of positions; a momentum of
/// the step must not change by that over the step. Nor may the axes of a bar change their places
/// between control points of a step.
#[test]
fn point_masses_on_bars_keep_their_momenta() {
    for name in ["thin_triangle", "flat_triangle", "galerkin_two_points"] {
        let model = Model::from_toml(&hostile(name)).unwrap();
        let mut simulation = Simulation::new(&model).unwrap();
        let nodes: Vec<_> = simulation.samples().map(Result::unwrap).collect();
        let maps = |k: usize| {
            let momentum = nodes[k].momentum;
            [momentum.linear, momentum.angular].concat()
        };
        for k in 1..nodes.len() {
            let pairs = maps(k).into_iter().zip(maps(0));
            let change: Vec<f64> = pairs.map(|(now, then)| now - then).collect();
            let change = holonom::vi_core::linear::norm_inf(&change);
            println!("{name}, step {k}: momentum maps change by {change:.1e} of 1 to 10");
            assert!(change < 1e-13, "{name}, step {k}: {change:e}");
        }
    }
}

/// The equations of a step also hold for the mirror image of a body, which no motion reaches.
/// Schemes whose unknown is the configuration itself may find it in a long step.
#[test]
fn the_mirror_image_of_a_body_is_refused() {
    let text = hostile("mirror_image");
    let (outcome, _) = run(&text);
    let RunOutcome::Failed(failure) = outcome else { panic!("taken") };
    println!("step {}: {}; {}", failure.step, failure.message, failure.remedy);
    assert!(failure.message.contains("mirror image") && failure.message.contains("`body1`"));
    let (outcome, largest) = run(&text.replace("em-dalembert", "em-nodal"));
    println!("em-nodal: residual {largest:.1e}");
    assert!(outcome == RunOutcome::Done && largest < 1e-14, "{outcome:?} {largest:e}");
}
