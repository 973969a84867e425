//! Reference problems of optimal control: optima by POUNCE, judged here, replayed as runs.
#![cfg(feature = "pounce")]

use crate::control_case::{Case, list, number, numbers, with_springs};
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::rc::Rc;
use vi_constraints::{Options, OrderMethod, SchemeKind};
use vi_control::kkt::{Kkt, Tolerances};
use vi_control::objective::NumberCost;
use vi_control::optimum::{OptimumVerdict, Progress, Setting, optimize};
use vi_control::program::{Iterate, NlpSolver, SharedProgram};
use vi_control::replay::Replay;
use vi_control::transcription::problem::{Cost, CostKind, FinalTime, ProblemError, When};
use vi_control::transcription::{Guess, SolvedMotion};
use vi_control::{Pounce, Transcription};
use vi_core::Composition;
use vi_core::galerkin::Stages;
use vi_core::linear::norm_inf;

type Shared = Rc<RefCell<Transcription>>;

fn solve(case: &Case, steps: usize) -> (SolvedMotion, usize, Kkt) {
    let (_, motion, iterations, kkt) = solved(case.transcription(steps));
    (motion, iterations, kkt)
}

struct Solved {
    motion: SolvedMotion,
    iterations: usize,
    kkt: Kkt,
    costates: Vec<Vec<f64>>,
}

fn solved(transcription: Transcription) -> (Shared, SolvedMotion, usize, Kkt) {
    let (program, Solved { motion, iterations, kkt, .. }) = solved_at(transcription);
    (program, motion, iterations, kkt)
}

fn solved_at(transcription: Transcription) -> (Shared, Solved) {
    let transcription = Rc::new(RefCell::new(transcription));
    let program: SharedProgram = transcription.clone();
    let start = transcription.borrow().start();
    let solved = Pounce::default().solve(&program, &start, Box::new(|_| true)).unwrap();
    let kkt = Kkt::judge(&mut *program.borrow_mut(), &solved.x, &solved.multipliers).unwrap();
    let motion = transcription.borrow().motion(&solved.x).unwrap();
    let costates = transcription.borrow().costates(&solved.multipliers);
    let iterations = solved.iterates.len() - 1;
    (transcription, Solved { motion, iterations, kkt, costates })
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

/// How far apart two motions are, the second in twice as many steps: states at common nodes,
/// controls in the middle of the longer steps.
fn apart(coarse: &SolvedMotion, fine: &SolvedMotion) -> [f64; 2] {
    let largest = |pairs: &mut dyn Iterator<Item = (f64, f64)>| {
        pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()))
    };
    let nodes = coarse.nodes.iter().zip(fine.nodes.iter().step_by(2));
    let states = largest(&mut nodes.flat_map(|(a, b)| a.iter().copied().zip(b.iter().copied())));
    let steps = coarse.controls.iter().zip(fine.controls.chunks_exact(2));
    let mean = |pair: &[Vec<f64>], k: usize| 0.5 * (pair[0][k] + pair[1][k]);
    let middles = steps.flat_map(|(a, pair)| (0..a.len()).map(move |k| (a[k], mean(pair, k))));
    [states, largest(&mut middles.into_iter())]
}

/// The ratios of the changes of cost, states and controls from each of three motions to the next.
fn ratios(all: &[SolvedMotion]) -> [f64; 3] {
    let [a, b, c] = all else { panic!("three motions") };
    let cost = |motion: &SolvedMotion| motion.costs.iter().sum::<f64>();
    let [states, controls] = [0, 1].map(|k| apart(a, b)[k] / apart(b, c)[k]);
    [(cost(b) - cost(a)) / (cost(c) - cost(b)), states, controls]
}

/// Each refinement from the last: the stored costs at `N`, `2N`, `4N` steps in a few iterations.
/// Cost, states and controls are of order 2 in the step where no bound is active; with active
/// bounds the cost nearly, states less, controls of order 1.
#[test]
fn refined_optima_are_those_of_order_2() {
    const SMOOTH: [[f64; 2]; 3] = [[3.8, 4.2]; 3];
    const BOUNDED: [[f64; 2]; 3] = [[3.7, 4.1], [1.5, 4.2], [1.0, 2.5]];
    for (name, wanted_ratios) in [
        ("oc01_pendulum_swing_up", Some(SMOOTH)),
        ("oc02_cart_pole_swing_up", Some(SMOOTH)),
        ("oc03_two_link_effort", Some(SMOOTH)),
        ("oc04_two_link_bounded", Some(BOUNDED)),
        ("oc06_satellite_three_wheels", Some(SMOOTH)),
        ("oc07_four_bar_to_rest", Some(SMOOTH)),
        ("oc09_arm6_effort", None),
    ] {
        let case = Case::read(name);
        let stored = list(&case.value["results"], "convergence");
        let level = |level: &serde_json::Value| {
            let steps = usize::try_from(level["steps"].as_u64().unwrap()).unwrap();
            (steps, Some(number(&level["cost"])))
        };
        let mut levels: Vec<_> = stored.iter().map(level).collect();
        if wanted_ratios.is_some() {
            levels.push((2 * levels[levels.len() - 1].0, None));
        }
        let mut motions = Vec::new();
        let mut last: Option<(Shared, SolvedMotion)> = None;
        for (steps, wanted) in levels {
            let program = match &last {
                None => case.transcription(steps),
                Some((program, motion)) => {
                    let guess = program.borrow().refined(motion, 2 * motion.controls.len());
                    let (problem, _) = case.problem(steps);
                    let (system, at) = (std::sync::Arc::new(case.system()), case.initial());
                    Transcription::new(&case.mechanism, system, at, problem, &guess).unwrap()
                }
            };
            let (program, motion, iterations, kkt) = solved(program);
            let cost: f64 = motion.costs.iter().sum();
            println!("{name}: {steps} steps, {iterations} iterations, cost {cost:.9}");
            assert!(kkt.is_met(&Tolerances::default()), "{name}: {kkt:?}");
            let is_near = |wanted: f64| (cost - wanted).abs() < 1e-8 * wanted;
            assert!(wanted.is_none_or(is_near), "{name}: {cost} for {wanted:?}");
            motions.push(motion.clone());
            last = Some((program, motion));
        }
        let Some(wanted) = wanted_ratios else { continue };
        let found = ratios(&motions[motions.len() - 3..]);
        println!("{name}: ratios of cost, states, controls {found:.3?}");
        for (found, [least, most]) in found.iter().zip(wanted) {
            assert!((least..=most).contains(found), "{name}: {found}");
        }
    }
}

/// A pendulum that swings up for the least effort and time: the final time that it takes is of
/// order 2 in the step as well.
#[test]
fn a_free_final_time_is_of_order_2() {
    let case = Case::read("oc01_pendulum_swing_up");
    let motions = [40, 80, 160].map(|steps| {
        let (mut problem, guess) = case.problem(steps);
        problem.time = FinalTime::Free { min: 0.5, max: 4.0, guess: 2.0 };
        problem.costs.push(Cost { weight: 4.0, kind: CostKind::Time });
        let (system, at) = (std::sync::Arc::new(case.system()), case.initial());
        let program = Transcription::new(&case.mechanism, system, at, problem, &guess).unwrap();
        let (_, motion, _, kkt) = solved(program);
        assert!(kkt.is_met(&Tolerances::default()), "{steps}: {kkt:?}");
        motion
    });
    let [a, b, c] = [0, 1, 2].map(|k| motions[k].step * motions[k].controls.len() as f64);
    let (time, others) = ((b - a) / (c - b), ratios(&motions));
    println!("{a:.6}, {b:.6}, {c:.6} s: ratio {time:.3}; of cost, states, controls {others:.3?}");
    assert!(others.iter().chain([&time]).all(|ratio| (ratio - 4.0).abs() < 0.2));
    assert!(a > 0.6 && a < 3.9, "no bound of the time is active: {a}");
}

/// What is asked for beside what a case asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Asks {
    Nothing,
    /// A time that is free and costs.
    Time,
    /// That a coordinate is near a value along the path.
    Path,
}

/// The optimum of `values` values of each control, each over `hold` steps by a method, from a
/// motion nearby.
fn held(
    case: &Case,
    [values, hold]: [usize; 2],
    method: OrderMethod,
    (near, asks): (Option<&SolvedMotion>, Asks),
) -> (SolvedMotion, Vec<Vec<f64>>) {
    let (mut problem, mut guess) = case.problem(values * hold);
    problem.method = method;
    problem.controls.iter_mut().for_each(|control| control.hold = hold);
    match asks {
        Asks::Nothing => {}
        Asks::Time => {
            problem.time = FinalTime::Free { min: 0.5, max: 4.0, guess: 2.0 };
            problem.costs.push(Cost { weight: 4.0, kind: CostKind::Time });
        }
        Asks::Path => {
            let (quantity, when) = (problem.conditions[0].quantity.clone(), When::Path);
            let kind = CostKind::Number { quantity, judged: NumberCost::Deviation(0.5), when };
            problem.costs.push(Cost { weight: 3.0, kind });
        }
    }
    if let Some(SolvedMotion { nodes, controls, .. }) = near {
        guess = Guess::of_run(&case.mechanism, nodes, controls, values * hold);
    }
    let (system, at) = (std::sync::Arc::new(case.system()), case.initial());
    let program = Transcription::new(&case.mechanism, system, at, problem, &guess).unwrap();
    let (_, solved) = solved_at(program);
    let (motion, kkt) = (solved.motion, solved.kkt);
    assert!(kkt.is_met(&Tolerances::default()), "{method:?}: {kkt:?}");
    let mut run = case.run_by(Options { method, ..Options::new(SchemeKind::Nodal, motion.step) });
    let replay = Replay::of(&mut run, &case.efforts, &motion);
    println!("  {method:?}, {hold}: {} iterations, {:.1e}", solved.iterations, replay.deviation);
    assert!(replay.is_same(), "{method:?}: {replay:?}");
    (motion, solved.costates)
}

/// How far two motions with as many values of controls are from one another: cost, states and
/// costates where the values change, the values.
fn from_another([a, b]: [&(SolvedMotion, Vec<Vec<f64>>); 2], values: usize) -> [f64; 4] {
    let cost = |motion: &SolvedMotion| motion.costs.iter().sum::<f64>();
    let at = |(motion, costates): &(SolvedMotion, Vec<Vec<f64>>), n: usize| {
        let hold = motion.controls.len() / values;
        let of = |rows: &[Vec<f64>]| rows.get(n * hold).cloned().unwrap_or_default();
        [of(&motion.nodes), of(&motion.controls), of(costates)]
    };
    let far = |x: &[f64], y: &[f64]| {
        x.iter().zip(y).fold(0.0_f64, |most, (x, y)| most.max((x - y).abs()))
    };
    let mut found = [(cost(&a.0) - cost(&b.0)).abs(), 0.0, 0.0, 0.0];
    for n in 0..=values {
        for (k, (own, other)) in at(a, n).iter().zip(&at(b, n)).enumerate() {
            found[k + 1] = found[k + 1].max(far(own, other));
        }
    }
    found
}

/// Controls of as many values as ever, motions in finer and finer steps: cost, states, costates and
/// controls of the optimum go to those of the exact motion with such controls by the order of the
/// method; each is replayed by its own method.
#[test]
fn optima_of_one_space_of_controls_have_the_order_of_the_method() {
    let methods = [
        (OrderMethod::default(), 2, [2, 4, 8]),
        (OrderMethod::Composition(Composition::Suzuki5), 4, [1, 2, 4]),
        (OrderMethod::Composition(Composition::SofroniouSpaletta13), 6, [1, 2, 4]),
        (OrderMethod::Galerkin(Stages::new(1).unwrap()), 2, [2, 4, 8]),
        (OrderMethod::Galerkin(Stages::new(2).unwrap()), 4, [1, 2, 4]),
        (OrderMethod::Galerkin(Stages::new(3).unwrap()), 6, [1, 2, 4]),
    ];
    for (name, values, asks) in [
        ("oc01_pendulum_swing_up", 10, Asks::Nothing),
        ("oc01_pendulum_swing_up", 10, Asks::Time),
        ("oc01_pendulum_swing_up", 10, Asks::Path),
        ("oc03_two_link_effort", 20, Asks::Nothing),
        ("oc07_four_bar_to_rest", 10, Asks::Nothing),
    ] {
        let case = Case::read(name);
        let finest = OrderMethod::Composition(Composition::SofroniouSpaletta21);
        let near = held(&case, [values, 1], methods[1].0, (None, asks));
        let exact = held(&case, [values, 4], finest, (Some(&near.0), asks));
        for (method, order, holds) in methods {
            // sums along the path are of order 2 in Galerkin steps
            let is_sum = asks == Asks::Path && method.stages().is_some();
            let order = if is_sum { 2 } else { order };
            let near = (Some(&near.0), asks);
            let motions = holds.map(|hold| held(&case, [values, hold], method, near));
            let errors = motions.map(|motion| from_another([&motion, &exact], values));
            let orders = [0, 1]
                .map(|k| [0, 1, 2, 3].map(|what| (errors[k][what] / errors[k + 1][what]).log2()));
            let of = |what: usize| errors.map(|error| format!("{:.1e}", error[what])).join(", ");
            let [cost, states, own, costates] = [0, 1, 2, 3].map(of);
            println!(
                "{name}, asks {asks:?}, order {order}: errors of costs {cost}, states {states}, controls {own}, costates {costates}; orders {orders:.2?}"
            );
            let least = orders[1].iter().fold(f64::INFINITY, |least, own| least.min(*own));
            assert!(least > f64::from(order) - 0.25, "{name}, order {order}: {least}");
        }
    }
}

/// The same of orders 8 and 10, in steps that are long enough for errors above rounding.
#[test]
fn optima_of_one_space_of_controls_have_orders_above_6() {
    let galerkin = |s: usize| OrderMethod::Galerkin(Stages::new(s).unwrap());
    let composition = OrderMethod::Composition(Composition::SofroniouSpaletta21);
    let (case, values, asks) = (Case::read("oc01_pendulum_swing_up"), 5, Asks::Nothing);
    let near =
        held(&case, [values, 6], OrderMethod::Composition(Composition::Suzuki5), (None, asks));
    let near = (Some(&near.0), asks);
    let exact = held(&case, [values, 6], galerkin(6), near);
    for (method, order, holds) in
        [(composition, 8, [6, 9]), (galerkin(4), 8, [3, 4]), (galerkin(5), 10, [3, 4])]
    {
        let [coarse, fine] = holds
            .map(|hold| from_another([&held(&case, [values, hold], method, near), &exact], values));
        let refined = (holds[1] as f64 / holds[0] as f64).ln();
        let orders = [0, 1, 2, 3].map(|what| (coarse[what] / fine[what]).ln() / refined);
        println!(
            "{method:?}, order {order}: cost, states, controls, costates {fine:?}; {orders:.2?}"
        );
        let least = orders.iter().fold(f64::INFINITY, |least, own| least.min(*own));
        assert!(least > f64::from(order) - 0.25, "order {order}: {least}");
    }
}

/// Wheels turn a satellite: the replay keeps the linear and the angular momentum of all, zero.
#[test]
fn efforts_between_bodies_leave_momentum_maps_exact() {
    let case = Case::read("oc06_satellite_three_wheels");
    let (motion, ..) = solve(&case, 50);
    let mut run = case.run(SchemeKind::Nodal, motion.step);
    let (mut worst, mut most) = (0.0_f64, 0.0_f64);
    for values in &motion.controls {
        case.efforts.iter().zip(values).for_each(|(effort, value)| effort.set(*value));
        run.step().unwrap();
        let state = run.state();
        let all = case.mechanism.momentum(&state.q, &state.p);
        worst = worst.max(norm_inf(&all.linear)).max(norm_inf(&all.angular));
        most = most.max(norm_inf(&state.p));
    }
    println!("momenta of all {worst:.1e}, of one coordinate up to {most:.1e}");
    assert!(most > 1e-2 && worst < 1e-14, "{worst:e} of {most:e}");
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

/// A run that begins a millionth faster is another motion; from the second node of the optimum on,
/// each of its steps is that of the optimum.
#[test]
fn single_steps_are_taken_from_the_nodes_of_the_optimum() {
    for method in [
        OrderMethod::default(),
        OrderMethod::Composition(Composition::Suzuki5),
        OrderMethod::Galerkin(Stages::new(2).unwrap()),
    ] {
        let mut case = Case::read("oc07_four_bar_to_rest");
        let (motion, _) = held(&case, [10, 1], method, (None, Asks::Nothing));
        case.v.iter_mut().for_each(|v| *v *= 1.0 + 1e-6);
        let options = Options { method, ..Options::new(SchemeKind::Nodal, motion.step) };
        let mut run = case.run_by(options);
        let replay = Replay::of(&mut run, &case.efforts, &motion);
        run = case.run_by(options);
        case.efforts.iter().zip(&motion.controls[0]).for_each(|(own, value)| own.set(*value));
        run.step().unwrap();
        let pairs = run.state().q.iter().zip(&motion.nodes[1]);
        let first = pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
        let by_steps = replay.by_steps.unwrap();
        println!(
            "{method:?}: {:.3e}, of steps {by_steps:.3e}, the first {first:.3e}",
            replay.deviation
        );
        assert!(replay.deviation > first && (by_steps - first).abs() < 1e-12, "{replay:?}");
    }
}

/// A case as a setting of the driver.
struct Own(Case);

/// The same from a guess that stands still.
struct Still(Own);

impl Setting for Still {
    fn program(&self, steps: usize, _: Option<&Guess>) -> Result<Transcription, ProblemError> {
        self.0.program(steps, Some(&Guess::line(steps, &[0.0; 9])))
    }
    fn replay(&self, motion: &SolvedMotion) -> Result<Replay, String> {
        self.0.replay(motion)
    }
}

/// The same by a method, without bounds of turns.
struct Unbounded(Own, OrderMethod);

impl Setting for Unbounded {
    fn program(&self, steps: usize, guess: Option<&Guess>) -> Result<Transcription, ProblemError> {
        let case = &self.0.0;
        let (mut problem, line) = case.problem(steps);
        (problem.method, problem.max_increment) = (self.1, f64::INFINITY);
        let (system, at) = (std::sync::Arc::new(case.system()), case.initial());
        Transcription::new(&case.mechanism, system, at, problem, guess.unwrap_or(&line))
    }
    fn replay(&self, motion: &SolvedMotion) -> Result<Replay, String> {
        let options = Options::new(SchemeKind::Nodal, motion.step);
        let mut run = self.0.0.run_by(Options { method: self.1, ..options });
        Ok(Replay::of(&mut run, &self.0.0.efforts, motion))
    }
}

impl Setting for Own {
    fn program(&self, steps: usize, guess: Option<&Guess>) -> Result<Transcription, ProblemError> {
        let (problem, line) = self.0.problem(steps);
        let (system, at) = (std::sync::Arc::new(self.0.system()), self.0.initial());
        let guess = guess.unwrap_or(&line);
        Transcription::new(&self.0.mechanism, system, at, problem, guess)
    }
    fn replay(&self, motion: &SolvedMotion) -> Result<Replay, String> {
        let mut run = self.0.run(SchemeKind::Nodal, motion.step);
        Ok(Replay::of(&mut run, &self.0.efforts, motion))
    }
}

fn progress(last: usize) -> Progress {
    let seen = std::cell::Cell::new(0);
    Rc::new(RefCell::new(move |_: usize, _: &Iterate| {
        seen.set(seen.get() + 1);
        if seen.get() > last { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }))
}

/// The driver: refined from a quarter of the steps, judged optimal; stopped where it is told to.
#[test]
fn optima_are_refined_and_judged() {
    for name in ["oc01_pendulum_swing_up", "oc06_satellite_three_wheels", "oc07_four_bar_to_rest"] {
        let own = Own(Case::read(name));
        let method = &mut Pounce::default();
        let steps = usize::try_from(own.0.value["steps"].as_u64().unwrap()).unwrap();
        let optimum = optimize(method, &own, (steps, 2), None, &progress(usize::MAX)).unwrap();
        assert_eq!(optimum.verdict, OptimumVerdict::Optimal, "{name}");
        let wanted = number(&own.0.value["results"]["cost"]);
        assert!((optimum.cost() - wanted).abs() < 1e-8 * wanted, "{name}: {}", optimum.cost());
        assert!(optimum.is_sufficient(), "{name}");
        println!("{name}: {:?}, {} iterations", optimum.levels, optimum.iterations);
        let halved = optimum.levels.len() > 1;
        assert_eq!(halved, steps % 2 == 0, "{name}: 25 steps have no half");
        let stopped = optimize(method, &own, (steps, 0), None, &progress(2)).unwrap();
        assert_eq!(stopped.verdict, OptimumVerdict::Stopped, "{name}");
    }
}

/// A satellite that turns by three radians along the straight guess, and by 1.5 rad about the
/// second axis of its charts from a guess that stands still: the charts follow.
#[test]
fn charts_follow_a_large_turn() {
    for (turn, stands) in [([2.0, -1.6, 1.2], false), ([0.0, 1.5, 0.0], true)] {
        let mut value = Case::read("oc06_satellite_three_wheels").value;
        for (k, turn) in turn.into_iter().enumerate() {
            value["terminal"]["coordinates"][k]["value"] = turn.into();
        }
        let still = Still(Own(Case::of(value)));
        let setting: &dyn Setting = if stands { &still } else { &still.0 };
        let method = &mut Pounce::default();
        let optimum = optimize(method, setting, (48, 0), None, &progress(usize::MAX)).unwrap();
        assert_eq!(optimum.verdict, OptimumVerdict::Optimal);
        let turn = vi_rigid::rotation::exp(&turn.into());
        let target = turn * vi_rigid::directors::triad(&still.0.0.q[..12]);
        let found = vi_rigid::directors::triad(&optimum.motion.nodes[48][..12]);
        let off = (target - found).amax();
        let (all, last) = (optimum.iterations, optimum.iterates.len() - 1);
        println!("cost {}, {all} iterations, {last} in the last chart", optimum.cost());
        assert!(off < 1e-10, "{off:e}");
        assert_eq!(all > last, stands, "whether charts were moved");
    }
}

/// Beside springs the optimum is met.
#[test]
fn springs_beside_are_met() {
    for length in [0.0, 0.2] {
        let own = Own(with_springs("oc03_two_link_effort", length));
        let optimum =
            optimize(&mut Pounce::default(), &own, (40, 0), None, &progress(usize::MAX)).unwrap();
        println!("length {length}: {} iterations, cost {}", optimum.iterations, optimum.cost());
        assert_eq!(optimum.verdict, OptimumVerdict::Optimal);
        assert!(optimum.iterations < 40);
    }
}

/// An effort that still acts beside the controls, which no run repeats: another motion.
#[test]
fn an_effort_beside_the_controls_is_another_motion() {
    let own = Own(Case::read("oc03_two_link_effort"));
    own.0.efforts[1].set(0.5);
    let optimum =
        optimize(&mut Pounce::default(), &own, (40, 0), None, &progress(usize::MAX)).unwrap();
    assert_eq!(optimum.verdict, OptimumVerdict::OtherMotion);
}

/// A pendulum that swings up in a few steps turns by more than 1 rad in one of them; what counts is
/// by how much it turns in a sub-step, or between control points.
#[test]
fn turns_are_those_between_all_nodes() {
    for (method, steps, is_far) in [
        (OrderMethod::Composition(Composition::Suzuki5), 6, true),
        (OrderMethod::Composition(Composition::SofroniouSpaletta13), 6, false),
        (OrderMethod::Galerkin(Stages::new(3).unwrap()), 4, true),
        (OrderMethod::Galerkin(Stages::new(3).unwrap()), 6, false),
    ] {
        let setting = Unbounded(Own(Case::read("oc01_pendulum_swing_up")), method);
        let method = &mut Pounce::default();
        let optimum = optimize(method, &setting, (steps, 0), None, &progress(usize::MAX)).unwrap();
        let turn = |from: &[f64], to: &[f64]| {
            let turn = (to[5] * from[3] - to[3] * from[5]).atan2(to[3] * from[3] + to[5] * from[5]);
            turn.abs() // of d_1, in the plane x, z
        };
        let all: Vec<&[f64]> = optimum.motion.all_nodes().collect();
        let parts = all.windows(2).map(|pair| turn(pair[0], pair[1])).fold(0.0, f64::max);
        let pairs = optimum.motion.nodes.windows(2);
        let whole = pairs.map(|pair| turn(&pair[0], &pair[1])).fold(0.0, f64::max);
        println!("{:?}, {steps}: {:?}, turns {whole:.2}, {parts:.2}", setting.1, optimum.verdict);

        assert!(whole > 1.0 && (parts > 1.0) == is_far, "{whole}, {parts}");
        match optimum.verdict {
            OptimumVerdict::TurnsTooFar { turn, .. } => {
                assert!(is_far && (turn - parts).abs() < 1e-12)
            }
            verdict => assert!(!is_far && verdict == OptimumVerdict::Optimal, "{verdict:?}"),
        }
    }
}

/// Nine steps of order 4 are few for this swing: with ten a run repeats the optimum, with
/// nine a sub-step of the run takes the other solution of its equations.
#[test]
fn a_sub_step_of_two_solutions_is_seen() {
    for (steps, is_same) in [(9, false), (10, true)] {
        let method = OrderMethod::Composition(Composition::Suzuki5);
        let setting = Unbounded(Own(Case::read("oc01_pendulum_swing_up")), method);
        let method = &mut Pounce::default();
        let optimum = optimize(method, &setting, (steps, 0), None, &progress(usize::MAX)).unwrap();
        println!("{steps} steps: {:?}, {:?}", optimum.verdict, optimum.replay);
        let verdict = if is_same { OptimumVerdict::Optimal } else { OptimumVerdict::OtherMotion };
        assert_eq!(optimum.verdict, verdict, "{steps} steps");
    }
}

/// With four steps a body has to turn too far in one: that is said, not hidden.
#[test]
fn too_few_steps_are_named() {
    let own = Own(Case::read("oc02_cart_pole_swing_up"));
    let optimum =
        optimize(&mut Pounce::default(), &own, (4, 0), None, &progress(usize::MAX)).unwrap();
    println!("{:?}", optimum.verdict);
    assert_ne!(optimum.verdict, OptimumVerdict::Optimal);
}
