//! Jacobians and Hessians of transcriptions against central differences.

use crate::control_case::{Case, with_springs};
use nalgebra::{DMatrix, Matrix3};
use std::sync::Arc;
use vi_constraints::{InitialValues, OrderMethod};
use vi_control::Transcription;
use vi_control::momentum::{NodeMomentum, TerminalMomentum};
use vi_control::node::RateOf;
use vi_control::objective::{NumberCost, PointComponent};
use vi_control::program::Program;
use vi_control::transcription::Guess;
use vi_control::transcription::problem::{
    Acts, Condition, Control, ControlProblem, Cost, CostKind, FinalTime, NodeNumber, RestAtEnd,
    When,
};
use vi_core::force::{DiscreteForce, MidpointForce};
use vi_core::galerkin::Stages;
use vi_core::{Composition, MechanicalSystem as _, Quadrature};
use vi_multibody::builder::{Inertia, MechanismBuilder};
use vi_multibody::bushing::{LinearSix, SixForce};
use vi_multibody::form::{BilinearRow, Form};
use vi_multibody::joint_coordinate::JointCoordinate;
use vi_multibody::joint_force::{EffortBends, EffortSlopes, JointForce, JointLaw};
use vi_multibody::law::{Input, ReadingLaw};
use vi_multibody::pair::screw::Pitch;
use vi_multibody::six_coordinates::{AttachedFrame, Matrix6, Rotation, SixCoordinates, Vector6};
use vi_multibody::spring::Damper;
use vi_multibody::tension::Tension;
use vi_multibody::wrench_law::{ActsOn, INPUTS, WrenchForce, WrenchLaw, WrenchSlopes};
use vi_multibody::{FrameId, PairKind};
use vi_rigid::load::{Load, LoadKind};
use vi_rigid::time_history::TimeHistory;
use vi_testkit::Sample;

/// Five sub-steps in each step, the third one backward.
const SUZUKI: OrderMethod = OrderMethod::Composition(Composition::Suzuki5);

/// Polynomials of degree `s` on each step.
fn galerkin(s: usize) -> OrderMethod {
    OrderMethod::Galerkin(Stages::new(s).unwrap())
}

fn jacobian(program: &Transcription) -> DMatrix<f64> {
    let mut entries = vec![0.0; program.jacobian_places().len()];
    program.jacobian(&mut entries);
    let mut out = DMatrix::zeros(program.rows(), program.variables());
    for (&(row, column), value) in program.jacobian_places().iter().zip(entries) {
        out[(row, column)] += value;
    }
    out
}

fn hessian(program: &Transcription, factor: f64, lambda: &[f64]) -> DMatrix<f64> {
    let mut entries = vec![0.0; program.hessian_places().len()];
    program.hessian(factor, lambda, &mut entries);
    let mut out = DMatrix::zeros(program.variables(), program.variables());
    for (&(row, column), value) in program.hessian_places().iter().zip(entries) {
        assert!(row >= column, "the lower triangle");
        out[(row, column)] += value;
        if row != column {
            out[(column, row)] += value;
        }
    }
    out
}

/// `∇f` and `g`, then `∇𝓛`.
fn first(program: &mut Transcription, x: &[f64], lambda: &[f64]) -> (f64, Vec<f64>, Vec<f64>) {
    program.move_to(x).unwrap();
    let (mut slope, mut rows) = (vec![0.0; x.len()], vec![0.0; program.rows()]);
    program.cost_gradient(&mut slope);
    program.row_values(&mut rows);
    let of_rows = jacobian(program).tr_mul(&DMatrix::from_column_slice(rows.len(), 1, lambda));
    let lagrangian = slope.iter().zip(of_rows.iter()).map(|(a, b)| 0.7 * a + b).collect();
    (program.cost(), rows, lagrangian)
}

/// Checks all derivatives at a random point against differences of order 4; `tolerance`: of the
/// Hessian.
fn check(name: &str, mut program: Transcription, tolerance: f64) {
    let mut sample = Sample::new(5);
    let mut x = program.start().x;
    x.iter_mut().for_each(|x| *x += 0.3 * sample.number());
    let lambda: Vec<f64> = (0..program.rows()).map(|_| sample.number()).collect();
    first(&mut program, &x, &lambda);
    let mut slope = vec![0.0; x.len()];
    program.cost_gradient(&mut slope);
    let (exact, second) = (jacobian(&program), hessian(&program, 0.7, &lambda));
    let (mut worst, mut bent) = (0.0_f64, 0.0_f64);
    for j in 0..x.len() {
        let e = 5e-4;
        let mut at = |by: f64| {
            let mut x = x.clone();
            x[j] += by * e;
            first(&mut program, &x, &lambda)
        };
        let [one, other, far, beyond] = [1.0, -1.0, 2.0, -2.0].map(&mut at);
        let difference = |near: f64, back: f64, far: f64, beyond: f64| {
            (8.0 * (near - back) - (far - beyond)) / (12.0 * e)
        };
        let size = |of: f64| 1.0 + of.abs();
        let wanted = difference(one.0, other.0, far.0, beyond.0);
        worst = worst.max((wanted - slope[j]).abs() / size(slope[j]));
        for i in 0..program.rows() {
            let wanted = difference(one.1[i], other.1[i], far.1[i], beyond.1[i]);
            let error = (wanted - exact[(i, j)]).abs() / size(wanted);
            worst = worst.max(error);
            assert!(
                error < 1e-8,
                "{name}: {} by {j}: {} for {wanted}",
                program.row_name(i),
                exact[(i, j)]
            );
        }
        for i in 0..x.len() {
            let wanted = difference(one.2[i], other.2[i], far.2[i], beyond.2[i]);
            let error = (wanted - second[(i, j)]).abs() / size(wanted);
            assert!(
                error < tolerance,
                "{name}: Hessian ({i}, {j}): {} for {wanted}",
                second[(i, j)]
            );
            bent = bent.max(error);
        }
    }
    println!("{name}: first {worst:.1e}, second {bent:.1e}");
    assert!(worst < 1e-8, "{name}: {worst:e}");
}

/// Of exact second derivatives.
const EXACT: f64 = 1e-8;

#[test]
fn of_the_reference_problems() {
    for name in [
        "oc01_pendulum_swing_up",
        "oc02_cart_pole_swing_up",
        "oc05_two_link_minimum_time",
        "oc06_satellite_three_wheels",
        "oc07_four_bar_to_rest",
        "oc08_six_r_to_rest",
        "oc09_arm6_effort",
    ] {
        check(name, Case::read(name).transcription(3), EXACT);
    }
}

/// Free time beside closed loops and dampers, all kinds of costs, values that last several steps,
/// by steps and by sub-steps.
#[test]
fn of_every_term() {
    for (name, method) in [
        ("oc07_four_bar_to_rest", OrderMethod::default()),
        ("oc09_arm6_effort", OrderMethod::default()),
        ("oc06_satellite_three_wheels", OrderMethod::default()),
        ("oc07_four_bar_to_rest", SUZUKI),
        ("oc06_satellite_three_wheels", SUZUKI),
        ("oc03_two_link_effort", galerkin(1)),
        ("oc07_four_bar_to_rest", galerkin(2)),
        ("oc09_arm6_effort", galerkin(2)),
        ("oc06_satellite_three_wheels", galerkin(3)),
        ("oc03_two_link_effort", galerkin(4)),
        ("oc07_four_bar_to_rest", galerkin(6)),
        ("oc03_two_link_effort", OrderMethod::Composition(Composition::SofroniouSpaletta21)),
    ] {
        for rest in [RestAtEnd::All, RestAtEnd::Free] {
            let case = Case::read(name);
            let (mut problem, _) = case.problem(4);
            problem.method = method;
            problem.time = FinalTime::Free { min: 0.1, max: 2.0, guess: 0.9 };
            problem.rest = rest;
            problem.controls[0].hold = 3;
            let point = Form::point(0, &nalgebra::Vector3::new(0.3, 0.1, -0.2));
            let fixed = Form::constant(nalgebra::Vector3::new(0.2, 0.5, 1.0));
            let distance = BilinearRow::distance(&point.minus(&fixed), 0.4);
            let joint = case.mechanism.description().joints.len().min(2) - 1;
            let coordinate = NodeNumber::joint(&case.mechanism, joint, 0, &case.q, 1).unwrap();
            let all: Vec<usize> = (0..problem.controls.len()).collect();
            let number = |judged| {
                move |quantity: NodeNumber, when| CostKind::Number { quantity, judged, when }
            };
            let (deviation, itself) =
                (number(NumberCost::Deviation(0.3)), number(NumberCost::Itself));
            for (weight, kind) in [
                (1.3, CostKind::Work(all.clone())),
                (0.4, CostKind::Rate(all.clone())),
                (0.2, CostKind::Time),
                (0.9, deviation(NodeNumber::of(distance.clone()), When::Path)),
                (0.8, deviation(NodeNumber::of(distance.clone()), When::Node(2))),
                (0.6, itself(NodeNumber::of(distance), When::Path)),
                (-0.5, itself(coordinate.clone(), When::Path)),
                (1.1, deviation(coordinate.clone(), When::Path)),
                (1.2, deviation(coordinate, When::End)),
            ] {
                problem.costs.push(Cost { weight, kind });
            }
            let guess = Guess::line(4, &vec![0.2; case.mechanism.tree().dof()]);
            let system = std::sync::Arc::new(case.system());
            let program =
                Transcription::new(&case.mechanism, system, case.initial(), problem, &guess)
                    .unwrap();
            check(name, program, EXACT);
        }
    }
}

/// A problem of a case beside more forces, by a method.
fn beside(
    case: &Case,
    (method, free): (OrderMethod, bool),
    force: Option<Box<dyn DiscreteForce>>,
) -> Transcription {
    let (mut problem, guess) = case.problem(2);
    problem.method = method;
    if free {
        problem.time = FinalTime::Free { min: 0.1, max: 2.0, guess: 0.9 };
    }
    let system = case.system();
    let system = match force {
        Some(force) => system.force(force),
        None => system,
    };
    let (system, at) = (std::sync::Arc::new(system), case.initial());
    Transcription::new(&case.mechanism, system, at, problem, &guess).unwrap()
}

const METHODS: [fn() -> OrderMethod; 4] =
    [OrderMethod::default, || SUZUKI, || galerkin(2), || galerkin(3)];

/// A spring between points, quadratic in the coordinates or not, and one along a joint.
#[test]
fn beside_springs() {
    for length in [0.0, 0.2] {
        for (name, method) in ["oc03_two_link_effort", "oc07_four_bar_to_rest"]
            .into_iter()
            .flat_map(|name| METHODS.map(|method| (name, method())))
        {
            let case = with_springs(name, length);
            check(&format!("springs by {method:?}"), beside(&case, (method, false), None), EXACT);
        }
    }
}

/// A damper between points, and a torque that turns with its body; the time given or free.
#[test]
fn beside_dampers_and_turning_torques() {
    let vector = nalgebra::Vector3::new;
    let end = Form::constant(vector(0.3, 0.1, 0.9));
    let between = Form::point(0, &vector(0.1, 0.0, 0.05)).minus(&end);
    let load = Load::new(
        0,
        LoadKind::Follower,
        vector(0.4, 0.2, -0.3),
        vector(0.3, 0.5, -0.2),
        TimeHistory::default(),
    );
    for (name, method) in ["oc03_two_link_effort", "oc06_satellite_three_wheels"]
        .into_iter()
        .flat_map(|name| METHODS.map(|method| (name, method())))
    {
        let case = Case::read(name);
        for free in [false, true] {
            if method != SUZUKI {
                // what is damped has no steps backward
                let damper = MidpointForce(Damper { between: between.clone(), damping: 1.7 });
                let program = beside(&case, (method, free), Some(Box::new(damper)));
                check(&format!("damper by {method:?}, {free}"), program, EXACT);
            }
            let program = beside(&case, (method, free), Some(Box::new(load.clone().unwrap())));
            check(&format!("torque by {method:?}, {free}"), program, EXACT);
        }
    }
}

/// `τ = 0.3 + θ² − 0.7 θ θ̇ + 0.4 θ̇²`.
#[derive(Debug)]
struct Curved;

impl JointLaw for Curved {
    fn effort(&self, _t: f64, x: f64, v: f64) -> f64 {
        0.3 + x * x - 0.7 * x * v + 0.4 * v * v
    }
    fn slopes(&self, _t: f64, x: f64, v: f64) -> EffortSlopes {
        EffortSlopes { by_coordinate: 2.0 * x - 0.7 * v, by_rate: -0.7 * x + 0.8 * v }
    }
    fn bends(&self, _t: f64, _x: f64, _v: f64) -> EffortBends {
        EffortBends { by_coordinate: 2.0, mixed: -0.7, by_rate: 0.8 }
    }
    fn by_time(&self, _t: f64, _x: f64, _v: f64) -> Option<f64> {
        Some(0.0)
    }
    fn is_dissipative(&self) -> bool {
        false
    }
}

/// `(f, τ)_k = Σ c_ki y_i y_{i+k}`, without the time `y_0`.
struct Quadratic;

impl Quadratic {
    fn terms() -> impl Iterator<Item = (usize, usize, usize, f64)> {
        let all = (0..6).flat_map(|k| (1..INPUTS).map(move |i| (k, i)));
        let other = |k: usize, i: usize| 1 + (i - 1 + k) % (INPUTS - 1);
        all.map(move |(k, i)| (k, i, other(k, i), 0.03 + 0.01 * (k * i % 7) as f64))
    }
}

impl WrenchLaw for Quadratic {
    fn evaluate(&self, y: &[f64; INPUTS]) -> [f64; 6] {
        let mut efforts = [0.0; 6];
        Self::terms().for_each(|(k, i, j, c)| efforts[k] += c * y[i] * y[j]);
        efforts
    }
    fn gradient(&self, y: &[f64; INPUTS], slopes: &mut WrenchSlopes) -> [f64; 6] {
        slopes.fill(0.0);
        for (k, i, j, c) in Self::terms() {
            slopes[(k, i)] += c * y[j];
            slopes[(k, j)] += c * y[i];
        }
        self.evaluate(y)
    }
    fn bend(&self, _y: &[f64; INPUTS], along: &[f64], w: &[f64], slopes: &mut [f64]) {
        slopes.fill(0.0);
        for (k, i, j, c) in Self::terms() {
            slopes[i] += w[k] * c * along[j];
            slopes[j] += w[k] * c * along[i];
        }
    }
    fn is_dissipative(&self) -> bool {
        false
    }
}

/// Laws that are curved, with a free time: along a joint, between points, of the motion of a body,
/// of the coordinates between two frames; with numbers of velocities that they change.
#[test]
fn beside_laws() {
    let vector = nalgebra::Vector3::new;
    for name in ["oc03_two_link_effort", "oc07_four_bar_to_rest"] {
        for (method, law) in METHODS.iter().flat_map(|own| (0..4).map(move |k| (own(), k))) {
            let mut case = Case::read(name);
            let end = Form::constant(vector(0.3, 0.1, 0.9));
            let between = Form::point(0, &vector(0.1, 0.0, 0.05)).minus(&end);
            let force: Box<dyn DiscreteForce> = match law {
                0 => {
                    let coordinate = case.mechanism.coordinate(1, 0).unwrap();
                    Box::new(JointForce { coordinate, law: Curved })
                }
                1 => Box::new(MidpointForce(Tension { between, law: Arc::new(Curved) })),
                2 => {
                    let point = vector(0.1, 0.2, -0.1);
                    let on = ActsOn::Frame { offset: 12, point, axes: Some(Matrix3::identity()) };
                    Box::new(WrenchForce { on, law: Arc::new(Quadratic) })
                }
                _ => {
                    let axes = Matrix3::identity();
                    let [from, to] =
                        [0, 12].map(|k| AttachedFrame::in_body(k, &vector(0.1, 0.2, 0.0), &axes));
                    let coordinates = SixCoordinates::new(from, to, Rotation::Vector);
                    let entry = |i: usize, j: usize| 0.1 * ((7 * i + 5 * j) % 11) as f64 - 0.4;
                    let six = LinearSix {
                        preload: Vector6::repeat(0.3),
                        stiffness: Matrix6::from_fn(entry),
                        damping: Matrix6::zeros(),
                    };
                    let inputs = (0..12).map(Input::Six).collect();
                    let reading = ReadingLaw::new(Arc::new(six), inputs, Vec::new());
                    Box::new(SixForce::new(coordinates, reading))
                }
            };
            let (mut problem, guess) = case.problem(2);
            problem.method = method;
            problem.time = FinalTime::Free { min: 0.1, max: 2.0, guess: 0.9 };
            let point = Form::point(12, &vector(0.3, 0.1, -0.2));
            let quantity = NodeNumber::of_node(RateOf(PointComponent { point, axis: 0 }));
            let kind =
                CostKind::Number { quantity, judged: NumberCost::Deviation(0.2), when: When::Path };
            problem.costs.push(Cost { weight: 0.7, kind });
            let system = Arc::new(case.system().force(force));
            let (mechanism, at) = (&case.mechanism, case.initial());
            let program = Transcription::new(mechanism, system, at, problem, &guess).unwrap();
            check(&format!("{name}, law {law} by {method:?}"), program, EXACT);
        }
    }
}

/// Numbers of nodes with their velocities as conditions and costs, beside efforts and wrenches, one
/// fixed in space and one in its body: rates of points and joints and angular velocities, momenta
/// along joints of trees, also with a free time.
fn of_numbers_with_velocities(name: &str) {
    let vector = nalgebra::Vector3::new;
    for (free, method) in [
        (false, OrderMethod::default()),
        (true, OrderMethod::default()),
        (true, SUZUKI),
        (true, galerkin(1)),
        (true, galerkin(3)),
    ] {
        let case = Case::read(name);
        let (mut problem, _) = case.problem(3);
        problem.method = method;
        if free {
            problem.time = FinalTime::Free { min: 0.1, max: 2.0, guess: 0.9 };
        }
        problem.controls[0].hold = 2;
        let force = vector(0.7, -0.4, 1.1);
        for (kind, torque) in [(LoadKind::Dead, force), (LoadKind::Follower, 0.0 * force)] {
            let load = Load::new(0, kind, force, torque, TimeHistory::default()).unwrap();
            problem.controls.push(Control {
                name: format!("{kind:?}"),
                acts: Acts::Wrench(load.at(vector(0.2, -0.1, 0.3)).unwrap()),
                bounds: [f64::NEG_INFINITY, f64::INFINITY],
                hold: 1,
                linear: false,
            });
        }
        let joint = case.mechanism.description().joints.last().unwrap();
        let point = Form::point(0, &vector(0.3, 0.1, -0.2));
        let coordinate = JointCoordinate::principal(joint, 0).unwrap();
        let between = point.minus(&Form::constant(vector(0.2, 0.5, 1.0)));
        let along = Form::vector(0, &vector(0.3, -0.8, 0.5));
        let last = 12 * (case.mechanism.description().bodies.len() - 1);
        let numbers = [
            NodeNumber::of_node(RateOf(PointComponent { point: point.clone(), axis: 0 })),
            NodeNumber::of_node(RateOf(coordinate.clone())),
            NodeNumber::of_node(RateOf(BilinearRow::product(point, along.clone(), 0.0))),
            NodeNumber::of_node(Input::Spin(0, 1)),
            NodeNumber::of_node(Input::Coordinate(coordinate.clone())),
            NodeNumber::of_node(Input::Rate(coordinate)),
            NodeNumber::of_node(Input::Length(between.clone())),
            NodeNumber::of_node(Input::LengthRate(between)),
            NodeNumber::of_node(Input::RelativeSpin { of: last, base: 0, along }),
        ];
        for (k, quantity) in numbers.into_iter().enumerate() {
            for (when, judged) in [
                (When::End, NumberCost::Deviation(0.3)),
                (When::Path, NumberCost::Deviation(-0.2)),
                (When::Node(1), NumberCost::Itself),
            ] {
                let quantity = quantity.clone();
                let kind = CostKind::Number { quantity, judged, when };
                problem.costs.push(Cost { weight: 0.7, kind });
            }
            let (name, bounds) = (format!("rate {k}"), [-9.0, 9.0]);
            problem.conditions.push(Condition { name, quantity, when: When::Path, bounds });
        }
        let (all, eta) = (TerminalMomentum::of(&case.mechanism), [(1, 0.8), (0, -0.3)]);
        for momentum in
            all.iter().flat_map(|own| [own.clone(), own.clone().along(&case.mechanism, &eta)])
        {
            let mass = case.system().mass().clone();
            let quantity = NodeNumber::of_node(NodeMomentum { momentum, mass });
            let (judged, when) = (NumberCost::Itself, When::End);
            let kind = CostKind::Number { quantity, judged, when };
            problem.costs.push(Cost { weight: 0.7, kind });
        }
        let guess = Guess::line(3, &vec![0.2; case.mechanism.tree().dof()]);
        let system = std::sync::Arc::new(case.system());
        let (mechanism, at) = (&case.mechanism, case.initial());
        let program = Transcription::new(mechanism, system, at, problem, &guess).unwrap();
        check(&format!("{name} by {method:?}"), program, EXACT);
    }
}

#[test]
fn of_numbers_with_velocities_of_a_tree() {
    of_numbers_with_velocities("oc03_two_link_effort");
}

#[test]
fn of_numbers_with_velocities_of_a_free_body() {
    of_numbers_with_velocities("oc06_satellite_three_wheels");
}

#[test]
fn of_numbers_with_velocities_of_a_closed_loop() {
    of_numbers_with_velocities("oc07_four_bar_to_rest");
}

/// Wrenches on bodies, in a tree, in closed loops, on what is free.
#[test]
fn beside_wrenches() {
    let vector = nalgebra::Vector3::new;
    let (point, force) = (vector(0.2, -0.1, 0.3), vector(0.7, -0.4, 1.1));
    let (torque, none) = (vector(0.3, 0.5, -0.2), vector(0.0, 0.0, 0.0));
    let wrench = |kind, force, torque| {
        Load::new(0, kind, force, torque, TimeHistory::default()).unwrap().at(point).unwrap()
    };
    let control = |name: &str, load: Load| Control {
        name: name.to_owned(),
        acts: Acts::Wrench(load),
        bounds: [f64::NEG_INFINITY, f64::INFINITY],
        hold: 2,
        linear: true,
    };
    let dead = control("dead", wrench(LoadKind::Dead, force, torque));
    let thrust = control("thrust", wrench(LoadKind::Follower, force, none));
    let turning = control("turning", wrench(LoadKind::Follower, none, torque));
    let cases = [vec![dead, thrust], vec![turning]];
    for name in ["oc03_two_link_effort", "oc06_satellite_three_wheels", "oc07_four_bar_to_rest"] {
        let methods = [
            (false, OrderMethod::default()),
            (true, OrderMethod::default()),
            (true, SUZUKI),
            (true, galerkin(2)),
        ];
        for (wrenches, (free, method)) in
            cases.iter().flat_map(|own| methods.map(|method| (own, method)))
        {
            let case = Case::read(name);
            let (mut problem, _) = case.problem(4);
            problem.method = method;
            if free {
                problem.time = FinalTime::Free { min: 0.1, max: 2.0, guess: 0.9 };
            }
            problem.controls.extend(wrenches.clone());
            let all = (0..problem.controls.len()).collect();
            problem.costs.push(Cost { weight: 0.4, kind: CostKind::Effort(all) });
            let guess = Guess::line(4, &vec![0.2; case.mechanism.tree().dof()]);
            let system = std::sync::Arc::new(case.system());
            let (mechanism, at) = (&case.mechanism, case.initial());
            let program = Transcription::new(mechanism, system, at, problem, &guess).unwrap();
            check(name, program, EXACT);
        }
    }
}

/// A nut on a thread that carries an arm: rows whose third derivatives do not vanish. They change
/// no velocity of what turns about one axis alone, so that the thread is not along the last joint.
#[test]
fn of_numbers_on_threads() {
    let vector = nalgebra::Vector3::new;
    let mut builder = MechanismBuilder::new().gravity(vector(0.0, 0.0, -9.81));
    let solid = |m: f64| Inertia::principal(m, [0.2, 0.3, 0.4]);
    let arm = builder.body("arm", solid(1.3)).at([0.4, 0.1, 0.0]).id();
    let nut = builder.body("nut", solid(0.7)).at([0.8, 0.1, 0.2]).id();
    builder
        .joint("hinge", PairKind::Revolute, FrameId::Ground, arm)
        .at([0.0; 3])
        .axis([0.0, 1.0, 0.3]);
    let thread = PairKind::Screw(Pitch::new(0.3));
    builder.joint("thread", thread, arm, nut).at([0.7, 0.1, 0.1]).axis([0.2, 0.3, 1.0]);
    let built = builder.build().unwrap();
    let (mechanism, q) = (&built.mechanism, built.mechanism.initial_configuration());
    for method in METHODS.map(|own| own()) {
        let along = |joint: usize| {
            let joint = &mechanism.description().joints[joint];
            Acts::Along(mechanism.tree().unknown_of(joint, 0).unwrap())
        };
        let control = |k: usize| Control {
            name: format!("control {k}"),
            acts: along(k),
            bounds: [f64::NEG_INFINITY, f64::INFINITY],
            hold: 1,
            linear: false,
        };
        let point = Form::point(12, &vector(0.3, 0.1, -0.2));
        let numbers = [
            NodeNumber::of_node(RateOf(PointComponent { point, axis: 2 })),
            NodeNumber::of_node(Input::Spin(12, 0)),
        ];
        let deviation = |quantity: NodeNumber| Cost {
            weight: 0.8,
            kind: CostKind::Number {
                quantity,
                judged: NumberCost::Deviation(0.3),
                when: When::Path,
            },
        };
        let problem = ControlProblem {
            steps: 2,
            time: FinalTime::Free { min: 0.1, max: 2.0, guess: 0.4 },
            method,
            controls: vec![control(0), control(1)],
            costs: numbers.into_iter().map(deviation).collect(),
            conditions: Vec::new(),
            rest: RestAtEnd::Free,
            max_increment: 1.0,
        };
        let system = Arc::new(built.system(Quadrature::Midpoint));
        let v = vec![0.0; q.len()];
        let at = InitialValues::new(0.0, &q, &v);
        let guess = Guess::line(2, &vec![0.2; mechanism.tree().dof()]);
        let program = Transcription::new(mechanism, system, at, problem, &guess).unwrap();
        check(&format!("thread by {method:?}"), program, EXACT);
    }
}
