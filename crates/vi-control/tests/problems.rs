//! Problems that are refused, by what is wrong; a path that keeps a point above a height.

use crate::control_case::Case;
use nalgebra::Vector3;
use std::sync::Arc;
use vi_constraints::OrderMethod;
use vi_constraints::setup::SetupError;
use vi_control::Transcription;
use vi_control::transcription::problem::{
    Acts, Condition, ControlProblem, Cost, CostKind, FinalTime, NodeNumber, ProblemError,
    RestAtEnd, Uncovered, When,
};
use vi_control::transcription::{Guess, GuessPath};
use vi_core::Composition;
use vi_core::coordinate_force::SignedUnknown;
use vi_core::galerkin::Stages;
use vi_multibody::form::{BilinearRow, Form};

fn refused(name: &str, change: &dyn Fn(&mut ControlProblem, &mut Guess)) -> ProblemError {
    let case = Case::read(name);
    let (mut problem, mut guess) = case.problem(5);
    change(&mut problem, &mut guess);
    let system = Arc::new(case.system());
    Transcription::new(&case.mechanism, system, case.initial(), problem, &guess).unwrap_err()
}

#[test]
fn what_is_wrong_is_said() {
    let of =
        |change: &dyn Fn(&mut ControlProblem, &mut Guess)| refused("oc03_two_link_effort", change);
    assert_eq!(of(&|p, _| p.steps = 0), ProblemError::NoSteps);
    assert_eq!(of(&|p, _| p.time = FinalTime::Fixed(0.0)), ProblemError::Time);
    assert_eq!(of(&|p, _| p.time = FinalTime::Fixed(f64::NAN)), ProblemError::Time);
    let free = FinalTime::Free { min: 0.5, max: 1.0, guess: 2.0 };
    assert_eq!(of(&|p, _| p.time = free), ProblemError::Time);
    let crossed = ProblemError::Bounds { name: "control 1".into(), min: 2.0, max: 1.0 };
    assert_eq!(of(&|p, _| p.controls[1].bounds = [2.0, 1.0]), crossed);
    let odd = ProblemError::NotANumber("control 0".into());
    assert_eq!(of(&|p, _| p.controls[0].bounds = [f64::NAN, 1.0]), odd);
    assert_eq!(of(&|p, _| p.controls[0].hold = 0), ProblemError::Hold("control 0".into()));
    assert_eq!(of(&|p, _| p.costs.clear()), ProblemError::NoCost);
    let names = |p: &mut ControlProblem| {
        p.costs = vec![Cost { weight: 1.0, kind: CostKind::Effort(vec![0, 2]) }];
    };
    assert_eq!(of(&|p, _| names(p)), ProblemError::Control { control: 2, count: 2 });
    let node = ProblemError::Node { name: "joint 0".into(), node: 6, steps: 5 };
    assert_eq!(of(&|p, _| p.conditions[0].when = When::Node(6)), node);
    let shape = ProblemError::Guess { found: 4, wanted: 5, unknowns: 2, degrees: 2 };
    assert_eq!(of(&|_, guess| *guess = Guess::line(4, &[0.0; 2])), shape);
    let shape = ProblemError::Guess { found: 5, wanted: 5, unknowns: 3, degrees: 2 };
    assert_eq!(of(&|_, guess| *guess = Guess::line(5, &[0.0; 3])), shape);
    let turns = |guess: &mut Guess| guess.path = GuessPath::Increments(vec![vec![4.0, 0.0]; 5]);
    assert_eq!(of(&|_, guess| turns(guess)), ProblemError::GuessTurns(1));
    let suzuki = OrderMethod::Composition(Composition::Suzuki5);
    let damped = refused("oc09_arm6_effort", &|p, _| p.method = suzuki);
    assert_eq!(damped, ProblemError::Method(SetupError::DissipativeComposition));
    // an effort along a rotation of a free body
    for method in [OrderMethod::default(), OrderMethod::Galerkin(Stages::new(2).unwrap())] {
        let turning = refused("oc06_satellite_three_wheels", &|p, _| {
            p.method = method;
            p.controls[0].acts = Acts::Along(SignedUnknown { index: 3, sign: 1.0 });
        });
        assert_eq!(turning, ProblemError::NotCovered(Uncovered::NoCoordinate));
    }
    let single = refused("oc07_four_bar_to_rest", &|p, _| p.rest = RestAtEnd::Unknowns(vec![0]));
    assert_eq!(single, ProblemError::NotCovered(Uncovered::RestInLoop));
}

/// The height of the tip of the two-link arm, m.
fn height() -> BilinearRow {
    let tip = Form::point(12, &Vector3::new(0.175, 0.0, 0.0));
    BilinearRow::product(tip, Form::constant(Vector3::z()), 0.0)
}

/// A condition of a path is as many rows, and their values are those of the quantity.
#[test]
fn a_path_has_a_row_for_each_node() {
    use vi_control::program::Program;
    let case = Case::read("oc03_two_link_effort");
    let (problem, guess) = case.problem(5);
    let program = |conditions: Vec<Condition>| {
        let mut own = problem.clone();
        own.conditions.extend(conditions);
        let system = Arc::new(case.system());
        Transcription::new(&case.mechanism, system, case.initial(), own, &guess).unwrap()
    };
    let bounds = [-1.0, f64::INFINITY];
    let above = Condition {
        name: "tip".into(),
        quantity: NodeNumber::of(height()),
        when: When::Path,
        bounds,
    };
    let (plain, mut kept) = (program(Vec::new()), program(vec![above]));
    assert_eq!(kept.rows(), plain.rows() + 5);
    let x = kept.start().x;
    kept.move_to(&x).unwrap();
    let mut values = vec![0.0; kept.rows()];
    kept.row_values(&mut values);
    let nodes = kept.motion(&x).unwrap().nodes;
    let mut node = 0;
    for row in (0..kept.rows()).filter(|row| kept.row_name(*row).starts_with("`tip`")) {
        node += 1;
        let product = height();
        assert_eq!(values[row].to_bits(), product.value(&nodes[node]).to_bits());
        assert_eq!(kept.bounds().rows[row].map(f64::to_bits), bounds.map(f64::to_bits));
    }
    assert_eq!(node, 5);
}

/// Bounds of a coordinate along the path, of a turn and of a value that lasts two steps, by five
/// sub-steps in each step: the first hold where steps meet, the second in each sub-step, the third
/// for ten of them.
#[test]
fn bounds_hold_where_sub_steps_have_them() {
    use vi_control::program::Program;
    let case = Case::read("oc03_two_link_effort");
    let (mut problem, guess) = case.problem(4);
    problem.method = OrderMethod::Composition(Composition::Suzuki5);
    problem.controls[0].hold = 2;
    let Condition { quantity, .. } = problem.conditions[0].clone();
    let NodeNumber::Joint { unknown, start } = quantity else { panic!("a coordinate") };
    let bounds = [start - 3.0, start + 4.0];
    let name = "kept".to_owned();
    problem.conditions.push(Condition { name, quantity, when: When::Path, bounds });
    let (system, at) = (Arc::new(case.system()), case.initial());
    let mut program = Transcription::new(&case.mechanism, system, at, problem, &guess).unwrap();
    // of 20 sub-steps two coordinates, one value in two steps and one in each
    assert_eq!(program.variables(), 20 * 2 + 2 + 4);
    let own = program.bounds();
    let bounded = own.variables.iter().filter(|own| own[0].is_finite()).count();
    assert_eq!(bounded, 4);
    let count = |words: &str| {
        (0..program.rows()).filter(|row| program.row_name(*row).starts_with(words)).count()
    };
    assert_eq!([count("turn of step"), count("balance at node"), count("rest")], [40, 40, 2]);
    let name = |words: &str| (0..program.rows()).any(|row| program.row_name(row) == words);
    assert!(name("turn of step 3, sub-step 4") && name("balance at node 1, sub-step 2"));
    assert!(name("`joint 0` at node 4") && !name("turn of step 4, sub-step 0"));
    // the bound of a variable is that of the number at its node
    let mut x = program.start().x;
    for (x, [low, _]) in x.iter_mut().zip(&own.variables).filter(|(_, own)| own[0].is_finite()) {
        *x = *low;
    }
    program.move_to(&x).unwrap();
    let met = program.met(
        &x,
        &vi_control::program::Multipliers {
            rows: vec![0.0; program.rows()],
            lower: vec![0.0; x.len()],
            upper: vec![0.0; x.len()],
        },
    );
    let kept = bounds[usize::from(unknown.sign < 0.0)];
    for met in met.unwrap().iter().filter(|met| met.condition == 2) {
        assert!((met.value - kept).abs() < 1e-12, "{met:?} for {kept}");
    }
    let motion = program.motion(&x).unwrap();
    assert_eq!((motion.nodes.len(), motion.within.len()), (5, 4));
    assert!(motion.within.iter().all(|own| own.len() == 4));
    assert_eq!(motion.all_nodes().count(), 21);
}

/// Kept 50 mm above the lowest point of its way, the tip touches that height, and it costs more.
#[cfg(feature = "pounce")]
#[test]
fn a_bounded_path_is_touched() {
    use std::cell::RefCell;
    use std::rc::Rc;
    use vi_control::Pounce;
    use vi_control::kkt::{Kkt, Tolerances};
    use vi_control::program::NlpSolver;
    let case = Case::read("oc03_two_link_effort");
    let lowest = |least: Option<f64>| {
        let (mut problem, guess) = case.problem(40);
        let bounds = [least.unwrap_or(f64::NEG_INFINITY), f64::INFINITY];
        if least.is_some() {
            let (name, quantity) = ("tip".to_owned(), NodeNumber::of(height()));
            problem.conditions.push(Condition { name, quantity, when: When::Path, bounds });
        }
        let system = Arc::new(case.system());
        let program =
            Transcription::new(&case.mechanism, system, case.initial(), problem, &guess).unwrap();
        let program = Rc::new(RefCell::new(program));
        let shared: vi_control::program::SharedProgram = program.clone();
        let start = program.borrow().start();
        let solved = Pounce::default().solve(&shared, &start, Box::new(|_| true)).unwrap();
        let kkt = Kkt::judge(&mut *shared.borrow_mut(), &solved.x, &solved.multipliers).unwrap();
        assert!(kkt.is_met(&Tolerances::default()), "{kkt:?}");
        let motion = program.borrow().motion(&solved.x).unwrap();
        let product = height();
        let heights = motion.nodes[1..].iter().map(|q| product.value(q));
        (heights.fold(f64::INFINITY, f64::min), motion.costs.iter().sum::<f64>())
    };
    let (free, cost) = lowest(None);
    let bound = free + 0.05;
    let (kept, more) = lowest(Some(bound));
    println!("lowest {free}, cost {cost}; above {bound}: {kept}, {more}");
    assert!((kept - bound).abs() < 1e-6 && more > cost);
}
