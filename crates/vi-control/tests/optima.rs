//! Reference problems of optimal control: optima by POUNCE, judged here, replayed as runs.
#![cfg(feature = "pounce")]

use crate::support::{Case, list, number, numbers};
use std::cell::RefCell;
use std::rc::Rc;
use vi_constraints::SchemeKind;
use vi_control::kkt::{Kkt, Tolerances};
use vi_control::program::{NlpSolver, SharedProgram};
use vi_control::replay::Replay;
use vi_control::transcription::Motion;
use vi_control::{Pounce, Transcription};

type Shared = Rc<RefCell<Transcription>>;

fn solve(case: &Case, steps: usize) -> (Motion, usize, Kkt) {
    let (_, motion, iterations, kkt) = solved(case.transcription(steps));
    (motion, iterations, kkt)
}

fn solved(transcription: Transcription) -> (Shared, Motion, usize, Kkt) {
    let transcription = Rc::new(RefCell::new(transcription));
    let program: SharedProgram = transcription.clone();
    let start = transcription.borrow().start();
    let solved = Pounce::default().solve(&program, &start, Box::new(|_| true)).unwrap();
    let kkt = Kkt::judge(&mut *program.borrow_mut(), &solved.x, &solved.multipliers).unwrap();
    let motion = transcription.borrow().motion(&solved.x).unwrap();
    (transcription, motion, solved.iterates.len() - 1, kkt)
}

fn case(name: &str) {
    let case = Case::read(name);
    let results = &case.value["results"];
    let steps = usize::try_from(case.value["steps"].as_u64().unwrap()).unwrap();
    let clock = std::time::Instant::now();
    let (motion, iterations, kkt) = solve(&case, steps);
    let seconds = clock.elapsed().as_secs_f64();
    let cost: f64 = motion.costs.iter().sum();
    let tolerance = |key: &str| number(&case.value["tolerance"][key]);
    let mut run = case.run(SchemeKind::Nodal, motion.step);
    let replay = Replay::of(&mut run, &case.efforts, &motion);
    let off = (cost - number(&results["cost"])).abs() / tolerance("cost");
    let mut controls = 0.0_f64;
    for (own, other) in motion.controls.iter().zip(list(results, "controls")) {
        for (a, b) in own.iter().zip(numbers(other)) {
            controls = controls.max((a - b).abs() / tolerance("controls"));
        }
    }
    let mut states = 0.0_f64;
    for state in list(results, "states") {
        let node = usize::try_from(state["step"].as_u64().unwrap()).unwrap();
        for (a, b) in motion.nodes[node].iter().zip(numbers(&state["q"])) {
            states = states.max((a - b).abs() / tolerance("states"));
        }
    }
    println!(
        "{name}: cost {cost:.9} off {off:.2e}, controls {controls:.2e}, states {states:.2e}, {iterations} iterations, {seconds:.2} s, replay {:.1e}",
        replay.deviation
    );
    println!(
        "  stationarity {:.1e}, violation {:.1e}, complementarity {:.1e}, multiplier {:.1e}",
        kkt.stationarity, kkt.violation, kkt.complementarity, kkt.largest_multiplier
    );
    assert!(kkt.is_met(&Tolerances::default()), "{kkt:?}");
    assert!(replay.is_same(), "{replay:?}");
    assert!(off <= 1.0 && controls <= 1.0 && states <= 1.0);
}

macro_rules! cases {
    ($($name:ident),*) => {$(
        #[test]
        fn $name() {
            case(stringify!($name));
        }
    )*};
}

cases!(
    oc01_pendulum_swing_up,
    oc02_cart_pole_swing_up,
    oc03_two_link_effort,
    oc04_two_link_bounded,
    oc05_two_link_minimum_time,
    oc06_satellite_three_wheels,
    oc07_four_bar_to_rest,
    oc08_six_r_to_rest,
    oc09_arm6_effort
);

/// Each refinement from the last: the stored costs at `N`, `2N`, `4N` steps in a few iterations;
/// order 2 where no bound is active.
#[test]
fn refined_optima_are_those_of_order_2() {
    for (name, order) in [
        ("oc01_pendulum_swing_up", true),
        ("oc02_cart_pole_swing_up", true),
        ("oc03_two_link_effort", true),
        ("oc04_two_link_bounded", false),
        ("oc06_satellite_three_wheels", true),
        ("oc07_four_bar_to_rest", true),
        ("oc09_arm6_effort", false),
    ] {
        let case = Case::read(name);
        let stored = list(&case.value["results"], "convergence");
        let mut costs = Vec::new();
        let mut last: Option<(Shared, Motion)> = None;
        for level in stored {
            let steps = usize::try_from(level["steps"].as_u64().unwrap()).unwrap();
            let program = match &last {
                None => case.transcription(steps),
                Some((program, motion)) => {
                    let guess = program.borrow().refined(motion);
                    let (problem, _) = case.problem(steps);
                    let (system, at) = (std::sync::Arc::new(case.system()), case.initial());
                    Transcription::new(&case.mechanism, system, at, problem, &guess).unwrap()
                }
            };
            let (program, motion, iterations, kkt) = solved(program);
            let cost: f64 = motion.costs.iter().sum();
            let wanted = number(&level["cost"]);
            println!("{name}: {steps} steps, {iterations} iterations, cost {cost:.9}");
            assert!(kkt.is_met(&Tolerances::default()), "{name}: {kkt:?}");
            assert!((cost - wanted).abs() < 1e-8 * wanted, "{name}: {cost} for {wanted}");
            costs.push(cost);
            last = Some((program, motion));
        }
        if order && costs.len() > 2 {
            let ratio = (costs[1] - costs[0]) / (costs[2] - costs[1]);
            println!("{name}: ratio {ratio:.3}");
            assert!((ratio - 4.0).abs() < 0.2, "{name}: {ratio}");
        }
    }
}

/// An effort that cannot lift the pendulum: the method says so, and the conditions are named.
#[test]
fn what_cannot_be_met_is_infeasible() {
    let case = Case::read("oc01_pendulum_swing_up");
    let (mut problem, guess) = case.problem(40);
    problem.controls[0].bounds = [-0.3, 0.3];
    let (system, at) = (std::sync::Arc::new(case.system()), case.initial());
    let program = Transcription::new(&case.mechanism, system, at, problem, &guess).unwrap();
    let program = Rc::new(RefCell::new(program));
    let start = program.borrow().start();
    let shared: SharedProgram = program.clone();
    let solved = Pounce::default().solve(&shared, &start, Box::new(|_| true)).unwrap();
    assert_eq!(solved.outcome, vi_control::Outcome::Infeasible);
    let kkt = Kkt::judge(&mut *shared.borrow_mut(), &solved.x, &solved.multipliers).unwrap();
    assert!(!kkt.is_met(&Tolerances::default()));
    let named = shared.borrow().row_name(kkt.violated[0].0);
    println!("{named}: {:.2e}", kkt.violated[0].1);
    assert!(!named.starts_with("row"), "{named}");
}

/// Defects of a replay: a control of one step is another one, and the motion differs.
#[test]
fn a_replay_sees_other_controls() {
    let case = Case::read("oc03_two_link_effort");
    let (mut motion, _, _) = solve(&case, 40);
    motion.controls[17][1] += 1e-4;
    let replay = Replay::of(&mut case.run(SchemeKind::Nodal, motion.step), &case.efforts, &motion);
    assert!(!replay.is_same(), "{replay:?}");
    assert!(replay.by_steps.unwrap() > 1e-8);
}
