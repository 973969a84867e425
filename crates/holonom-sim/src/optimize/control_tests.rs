//! Optima of controls by POUNCE from model files: stored costs, the run of the result.
#![cfg(feature = "pounce")]

use super::{FoundOptimum, OptimizeFailure, SearchProgress, SearchStatus, SearchWatch, optimize};
use crate::simulation::Simulation;
use crate::system::input::Input;
use crate::system::outside::ExternalActions;
use holonom_model::{Model, ModelText, Override};
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;
use vi_control::Pounce;
use vi_control::program::{MethodStart, NlpSolver, SharedProgram, Solved, SolverError};

pub(super) fn watch() -> SearchWatch {
    Rc::new(RefCell::new(|_: &SearchProgress| true))
}

pub(super) fn found_with(
    text: &str,
    overrides: &[Override],
) -> Result<FoundOptimum, OptimizeFailure> {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(overrides)?;
    optimize((&text, overrides, &model), Some(&mut Pounce::default()), None, &watch())
}

fn found(text: &str) -> Result<FoundOptimum, OptimizeFailure> {
    found_with(text, &[])
}

const PENDULUM: &str = r#"
model = { name = "swing up", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.05, end = 2.0 }
body = [{ name = "rod", mass = 1.0, inertia = [0.08354166666666665, 0.08354166666666665, 0.00041666666666666675], position = [0.0, 0.0, -0.5] }]
joint = [{ name = "hinge", type = "revolute", parent = "ground", child = "rod", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0] }]
sensor = [{ name = "angle", type = "joint_coordinate", of = "hinge" }, { name = "place", type = "position", of = "rod" }]
control = [{ name = "torque", joint = "hinge" }]
objective = [{ name = "cheap", type = "effort" }]
condition = [{ name = "up", sensor = "angle", equals = 3.141592653589793 }, { name = "stop", type = "rest" }]
"#;

/// The run of the model that is found, read again from its text: its last node.
fn run(found: &FoundOptimum) -> Vec<f64> {
    let model = Model::from_toml(&found.model.to_toml()).unwrap();
    assert_eq!(model, found.model);
    let mut simulation = Simulation::new(&model).unwrap();
    let run = simulation.integrator();
    for _ in 0..model.settings.steps() {
        run.step().unwrap();
    }
    run.state().q.clone()
}

/// The nodes of the run of the model that is found, and those of the model with its controls from
/// outside, in turn.
fn run_and_replay(text: &str, found: &FoundOptimum) -> [Vec<Vec<f64>>; 2] {
    let mut model = Model::from_toml(text).unwrap();
    model.settings.step = found.report.step;
    model.settings.end = found.report.time;
    let inputs: Vec<Input> = model.controls.iter().map(Input::of).collect();
    let outside = ExternalActions::of_inputs(&inputs);
    let mut replay = Simulation::with_outside(&model, &outside).unwrap();
    let mut run = Simulation::new(&Model::from_toml(&found.model.to_toml()).unwrap()).unwrap();
    let mut nodes = [Vec::new(), Vec::new()];
    for values in &found.controls {
        inputs.iter().zip(values).for_each(|(input, value)| input.effort().set(*value));
        for (simulation, nodes) in [&mut run, &mut replay].into_iter().zip(&mut nodes) {
            simulation.integrator().step().unwrap();
            nodes.push(simulation.integrator().state().q.clone());
        }
    }
    nodes
}

/// Rest has a row for each momentum: how far it is met, and its price, which is the difference of
/// costs by momenta that are left.
#[test]
fn rest_has_its_rows_and_its_price() {
    let report = found(PENDULUM).unwrap().report;
    let [up, stop] = &report.conditions[..] else { panic!("{:?}", report.conditions) };
    assert_eq!((up.name.as_str(), up.of.as_deref()), ("up", None));
    assert_eq!((stop.name.as_str(), stop.of.as_deref()), ("stop", Some("hinge")));
    assert!(stop.violation < 1e-12 && stop.value.abs() < 1e-12, "{stop:?}");
    // the momentum that is left by a rate at the end, about the hinge
    let inertia = 0.08354166666666665 + 0.25;
    let with_rate = |rate: f64| {
        let text = PENDULUM.replace(
            "{ name = \"stop\", type = \"rest\" }",
            &format!("{{ name = \"stop\", sensor = \"rate\", equals = {rate:?} }}"),
        );
        let rate = "sensor = [{ name = \"rate\", type = \"joint_rate\", of = \"hinge\" }, ";
        found(&text.replace("sensor = [", rate)).unwrap().report.cost
    };
    let slope = (with_rate(1e-4) - with_rate(-1e-4)) / 2e-4 / inertia;
    println!("{} for {slope}", stop.price);
    assert!((stop.price - slope).abs() < 1e-5 * slope.abs(), "{} for {slope}", stop.price);
}

/// A step has a coordinate, a value, a balance and a bounded turn.
#[test]
fn the_size_of_the_program_is_told() {
    let text = PENDULUM.replace("joint = \"hinge\" }]", "joint = \"hinge\", hold = 4 }]");
    let own = found(&text).unwrap().report.problem;
    assert_eq!((own.unknowns, own.values), (50, 10));
    assert_eq!((own.equations, own.inequalities), (40 + 2, 40));
    assert_eq!(own.coordinates, ["hinge"]);
}

/// Conditions in the run of half the step, read from its configurations.
#[test]
fn conditions_are_judged_between_nodes() {
    let more = "type = \"rest\" }, { name = \"right\", sensor = \"place.x\", at = \"path\", max = 0.35 }, { name = \"half\", sensor = \"place.x\", at = 1.0, max = 0.2 }]";
    let text = PENDULUM.replace("type = \"rest\" }]", more);
    let found = found(&text).unwrap();
    let report = &found.report;
    assert_eq!(report.status, SearchStatus::Optimal, "{report:?}");
    let mut model = found.model.clone();
    model.settings.step = 0.025;
    let mut simulation = Simulation::new(&model).unwrap();
    let mut x = vec![0.0];
    for _ in 0..80 {
        simulation.integrator().step().unwrap();
        x.push(simulation.integrator().state().q[0]);
    }
    let most = x.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let wanted = [("right", most - 0.35), ("half", (x[40] - 0.2).max(0.0))];
    println!("{wanted:?}");
    assert!(wanted[0].1 > 1e-5, "{most}");
    for (name, by) in wanted {
        let own = report.conditions.iter().find(|own| own.name == name).unwrap();
        assert!((own.halved.unwrap() - by).abs() < 1e-12, "{name}: {own:?} for {by}");
    }
    let of = |name: &str| report.conditions.iter().find(|own| own.name == name).unwrap().halved;
    assert!(of("up").unwrap() > 1e-6 && of("stop").is_none());
}

/// What misses rest counts among what is missed.
#[test]
fn rest_that_is_missed_counts() {
    // two values of a torque bring one angle about, and no rest
    let text =
        PENDULUM.replace("{ name = \"torque\"", "{ name = \"torque\", max = 0.1, min = -0.1");
    let report = found(&text).unwrap().report;
    assert_ne!(report.status, SearchStatus::Optimal);
    let stop = &report.conditions[1];
    assert!((stop.violation - stop.value.abs()).abs() < 1e-15, "{stop:?}");
    assert!(report.conditions.iter().any(|own| own.violation > 1e-2), "{:?}", report.conditions);
}

/// Where turns are as large as a step may have them, the motion is an optimum of these steps alone.
#[test]
fn turns_at_their_bound_are_said() {
    let text = PENDULUM.replace("step = 0.05", "step = 0.25").replace("3.141592653589793", "7.0");
    let report = found(&text).unwrap().report;
    assert_eq!((report.status, report.turns_at_bound), (SearchStatus::TurnsBounded, Some(6)));
    assert!(report.missed[0].contains("6 of 8 steps: take more steps"), "{:?}", report.missed);
    let report = found(&text.replace("step = 0.25", "step = 0.05")).unwrap().report;
    assert_eq!((report.status, report.turns_at_bound), (SearchStatus::Optimal, Some(0)));
    assert!(report.missed.is_empty());
}

/// An optimum of fewer steps is kept where those that are asked for have none.
#[test]
fn an_optimum_of_fewer_steps_is_kept() {
    let text = PENDULUM.replace("step = 0.05", "step = 0.0125") + "optimize = { refine = 2 }";
    let all = found(&text).unwrap().report;
    let counts: Vec<usize> = all.refinements.iter().map(|own| own.steps).collect();
    assert_eq!((all.status, &counts[..]), (SearchStatus::Optimal, &[40, 80, 160][..]));
    assert!((all.convergence().unwrap()[0] - 2.0).abs() < 0.05);
    let mut method = Slower { of: Pounce { max_iterations: 300 }, solves: 0 };
    let text = ModelText::from_text(Path::new("model.toml"), &text);
    let model = text.model(&[]).unwrap();
    let kept = optimize((&text, &[], &model), Some(&mut method), None, &watch()).unwrap();
    let report = &kept.report;
    assert_eq!((report.status, report.steps), (SearchStatus::Unfinished, 40));
    assert!(
        report.missed[0].contains("with 160 steps; the optimum with 40"),
        "{:?}",
        report.missed
    );
    assert!((report.cost - all.refinements[0].cost).abs() < 1e-12);
    assert_eq!(kept.controls.len(), 40);
    let comparable: Vec<bool> = report.refinements.iter().map(|own| own.comparable).collect();
    assert_eq!(comparable, [true, false, false]);
    assert_eq!(report.convergence(), None);
    // and the search goes on from where it ended, with all steps
    let point = kept.kept.point.as_ref().unwrap();
    let more = optimize((&text, &[], &model), Some(&mut Pounce::default()), Some(point), &watch());
    let more = more.unwrap().report;
    assert_eq!((more.status, more.steps), (SearchStatus::Optimal, 160));
    assert!((more.cost - all.cost).abs() < 1e-9 * all.cost);
}

/// A method that has few iterations but for its first solve.
pub(super) struct Slower {
    pub(super) of: Pounce,
    pub(super) solves: usize,
}

impl NlpSolver for Slower {
    fn solve(
        &mut self,
        program: &SharedProgram,
        start: &MethodStart,
        watch: vi_control::program::MethodWatch,
    ) -> Result<Solved, SolverError> {
        self.solves += 1;
        self.of.max_iterations = if self.solves == 1 { 300 } else { 1 };
        self.of.solve(program, start, watch)
    }
}

/// An order is said of optima of the same problem: values of controls that last for other times
/// are another.
#[test]
fn an_order_is_that_of_alike_holds() {
    for (hold, alike) in [(1, true), (4, true), (2, false), (7, false)] {
        let text = PENDULUM
            .replace("step = 0.05", "step = 0.0125")
            .replace("joint = \"hinge\" }", &format!("joint = \"hinge\", hold = {hold} }}"));
        let report = found(&text).unwrap().report;
        assert_eq!(report.convergence().is_some(), alike, "{hold}: {:?}", report.refinements);
    }
}

/// A search that was stopped goes on from its point, its time and its multipliers.
#[test]
fn a_search_goes_on_from_where_it_was_stopped() {
    let timed = "optimize = { refine = 0, time = { min = 1.0, max = 4.0, guess = 1.5 } }";
    let text = PENDULUM.replace(
        "{ name = \"cheap\", type = \"effort\" }",
        "{ name = \"cheap\", type = \"effort\" }, { name = \"soon\", type = \"time\", weight = 2.0 }",
    );
    for text in [format!("{text}{timed}"), format!("{PENDULUM}optimize = {{ refine = 0 }}")] {
        let text = ModelText::from_text(Path::new("model.toml"), &text);
        let model = text.model(&[]).unwrap();
        let search = |most: usize, from: Option<&super::ProgramPoint>| {
            let count = std::cell::Cell::new(0);
            let watch: SearchWatch = Rc::new(RefCell::new(move |_: &SearchProgress| {
                count.set(count.get() + 1);
                count.get() < most
            }));
            optimize((&text, &[], &model), Some(&mut Pounce::default()), from, &watch).unwrap()
        };
        let whole = search(usize::MAX, None);
        let most = whole.report.iterations;
        let stopped = search(most, None);
        assert_eq!(stopped.report.status, SearchStatus::Stopped);
        let json = serde_json::to_string(&stopped.kept).unwrap();
        let kept: super::SearchEnd = serde_json::from_str(&json).unwrap();
        assert_eq!(kept, stopped.kept);
        let more = search(usize::MAX, kept.point.as_ref());
        let begins = more.steps[0].iterate;
        println!("{most} of {}, then {}", whole.report.iterations, more.report.iterations);
        println!("{begins:?} after {:?}", stopped.steps.last());
        assert_eq!(more.report.status, SearchStatus::Optimal);
        let cost = whole.report.cost;
        assert!((more.report.cost - cost).abs() < 1e-9 * cost);
        let last = stopped.steps.last().unwrap().iterate;
        assert!((begins.cost - last.cost).abs() < 1e-6 * cost, "{begins:?} after {last:?}");
        assert!(more.report.iterations < most, "{} after {most}", more.report.iterations);
        // without multipliers
        let mut json = serde_json::to_value(&stopped.kept).unwrap();
        for part in ["rows", "lower", "upper"] {
            let all = json["point"][part].as_array_mut().unwrap();
            all.iter_mut().for_each(|own| *own = 0.0.into());
        }
        let bare: super::SearchEnd = serde_json::from_value(json).unwrap();
        let bare = search(usize::MAX, bare.point.as_ref());
        println!(
            "{:?}, {} iterations without multipliers",
            bare.steps[0].iterate, bare.report.iterations
        );
    }
}

/// A start that no control changes has to lie within bounds along the path, of whatever sensor.
#[test]
fn a_start_outside_of_bounds_along_the_path_is_named() {
    let sensors = "sensor = [{ name = \"rate\", type = \"joint_rate\", of = \"hinge\" }, \
                   { name = \"far\", type = \"distance\", of = \"rod\", to = \"ground\", point_to = [1.0, 0.0, -0.5] }, ";
    let with = |condition: &str| {
        let text = PENDULUM.replace("sensor = [", sensors);
        let text = text.replace("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 1.0, 0.0], rate = 0.5");
        text.replace(
            "type = \"rest\" }",
            &format!("type = \"rest\" }}, {{ name = \"low\", {condition}, at = \"path\" }}"),
        )
    };
    for (condition, begins) in [
        ("sensor = \"place.z\", min = -0.4", "`place.z` begins with -0.5"),
        ("sensor = \"rate\", max = 0.4", "`rate` begins with 0.5"),
        ("sensor = \"far\", min = 1.2", "`far` begins with 1"),
        ("sensor = \"angle\", min = 0.1", "`angle` begins with 0"),
    ] {
        let error = found(&with(condition)).unwrap_err().to_string();
        assert!(error.contains("condition.low") && error.contains(begins), "{error}");
    }
    // at a bound, and within
    for condition in ["sensor = \"place.z\", min = -0.5", "sensor = \"rate\", min = -30.0"] {
        assert_eq!(
            found(&with(condition)).unwrap().report.status,
            SearchStatus::Optimal,
            "{condition}"
        );
    }
}

/// By every method the optimum is a motion of this method, and its model repeats it bit for bit.
/// Efforts that are constant over steps cost more than those that are not, 4.460032 (collocation):
/// a little more, but for the error of the method.
#[test]
fn optima_of_every_order_are_repeated_bit_for_bit() {
    let mut costs = Vec::new();
    for (order, method) in [
        (2, "composition"),
        (4, "composition"),
        (6, "composition"),
        (4, "galerkin"),
        (6, "galerkin"),
    ] {
        let with = format!("step = 0.05, order = {order}, method = \"{method}\"");
        let text = PENDULUM.replace("step = 0.05", &with);
        let found = found(&text).unwrap();
        let report = &found.report;
        let deviation = report.replay.as_ref().unwrap().deviation;
        println!(
            "{method} {order}: {} in {} iterations, {deviation:.1e}",
            report.cost, report.iterations
        );
        assert_eq!(report.status, SearchStatus::Optimal, "{report:?}");
        assert_eq!((report.steps, found.controls.len(), found.costates.len()), (40, 40, 40));
        assert_eq!((found.model.settings.order, report.sufficient), (order, Some(true)));
        assert!(deviation < 1e-10);
        let [run, replay] = run_and_replay(&text, &found);
        assert_eq!(run, replay, "{method} {order}");
        assert!((run[39][2] - 0.5).abs() < 1e-8, "{:?}", run[39]);
        costs.push(report.cost);
    }
    let exact = *costs.last().unwrap();
    assert!((1e-3..3e-2).contains(&(exact - 4.460032305)), "{exact}");
    let errors: Vec<f64> = costs.iter().map(|cost| (cost - exact).abs()).collect();
    assert!(errors[0] > 1e-2, "{errors:?}");
    assert!(errors[1..].iter().all(|error| *error < 1e-2 * errors[0]), "{errors:?}");
}

/// A control beside a motor of its coordinate: a motor to a path is a spring with a damper, so that
/// the optimum is the one beside these; its model keeps the motor and repeats the motion bit for
/// bit.
#[test]
fn a_motor_acts_beside_a_control_of_its_joint() {
    for method in ["", ", order = 4, method = \"galerkin\""] {
        let pendulum = PENDULUM.replace("step = 0.05", &format!("step = 0.05{method}"));
        let with = |what: &str| pendulum.replace("axis = [0.0, 1.0, 0.0]", what);
        let elements = "axis = [0.0, 1.0, 0.0], spring = { stiffness = 3.0, rest = 0.4 }, damper = { damping = 0.2 }";
        let wanted = found(&with(elements)).unwrap().report;
        let motor = "axis = [0.0, 1.0, 0.0], motor = { proportional = 3.0, derivative = 0.2, path = { offset = 0.4 } }";
        let text = with(motor).replace("name = \"place\"", "name = \"values_0\"");
        let found = found(&text).unwrap();
        println!("{method}: {} for {}", found.report.cost, wanted.cost);
        assert_eq!(found.report.status, SearchStatus::Optimal, "{:?}", found.report);
        assert!((found.report.cost - wanted.cost).abs() < 1e-9 * wanted.cost);
        assert!((found.report.cost - 4.434825997490211).abs() > 0.1);
        let model = Model::from_toml(&text).unwrap();
        assert_eq!(found.model.joints[0].motor, model.joints[0].motor);
        assert_eq!(
            [&found.model.laws[0].name, &found.model.tables[0].name],
            ["torque", "values_0_"]
        );
        let [run, replay] = run_and_replay(&text, &found);
        assert_eq!(run, replay);
        assert!((run[39][2] - 0.5).abs() < 1e-8, "{:?}", run[39]);
    }
}

/// Controls along both freedoms of a cylindrical joint: what slides and what turns do not feel one
/// another, so the costs are those of a prismatic and of a revolute joint.
#[test]
fn two_freedoms_of_a_joint_have_controls_of_their_own() {
    let text = |kind: &str, names: &[&str], wanted: &[f64]| {
        let list = |item: &dyn Fn(usize) -> String| {
            (0..names.len()).map(item).collect::<Vec<_>>().join(", ")
        };
        format!(
            "model = {{ name = \"both\", gravity = [0.0, 0.0, 0.0] }}\nsimulation = {{ step = 0.05, end = 1.0 }}\n\
             body = [{{ name = \"rod\", mass = 2.0, inertia = [0.3, 0.4, 0.5], position = [0.0, 0.0, 0.0] }}]\n\
             joint = [{{ name = \"screw\", type = \"{kind}\", parent = \"ground\", child = \"rod\", position = [0.0, 0.0, 0.0], axis = [0.0, 0.0, 1.0] }}]\n\
             sensor = [{{ name = \"s\", type = \"joint_coordinate\", of = \"screw\" }}]\n\
             objective = [{{ name = \"cheap\", type = \"effort\" }}]\n\
             control = [{}]\ncondition = [{}, {{ name = \"stop\", type = \"rest\" }}]\n",
            list(&|k| format!("{{ name = \"drive {k}\", joint = \"screw\", freedom = {k} }}")),
            list(&|k| format!(
                "{{ name = \"c{k}\", sensor = \"{}\", equals = {:?} }}",
                names[k], wanted[k]
            )),
        )
    };
    let to = [0.7, 1.9];
    let [slides, turns] = [("prismatic", 0), ("revolute", 1)]
        .map(|(kind, k)| found(&text(kind, &["s"], &to[k..])).unwrap().report.cost);
    let text = text("cylindrical", &["s.0", "s.1"], &to);
    let both = found(&text).unwrap();
    println!("{} for {slides} + {turns}", both.report.cost);
    assert_eq!(both.report.status, SearchStatus::Optimal, "{:?}", both.report);
    assert!((both.report.cost - slides - turns).abs() < 1e-9 * (slides + turns));
    let [run, replay] = run_and_replay(&text, &both);
    assert_eq!(run, replay);
    assert!((run[19][2] - 0.7).abs() < 1e-9, "{:?}", run[19]);
}

/// Efforts on lines between knots that are four steps apart: in the middle of each step the values
/// lie on these lines, a cost between that of any values and that of constant ones; knots of single
/// steps leave any values. The run repeats the motion, and no other knots are cheaper: what effort
/// and end make of a change of a knot vanishes.
#[test]
fn efforts_lie_on_lines_between_knots() {
    let with = |what: &str| {
        let text =
            PENDULUM.replace("joint = \"hinge\" }]", &format!("joint = \"hinge\"{what} }}]"));
        found(&text).unwrap()
    };
    let lines = with(", shape = \"linear\", hold = 4");
    let [free, held] = ["", ", hold = 4"].map(|what| with(what).report.cost);
    let single = with(", shape = \"linear\"").report.cost;
    println!("{free} < {} < {held}", lines.report.cost);
    assert_eq!(lines.report.status, SearchStatus::Optimal, "{:?}", lines.report);
    assert!((single - free).abs() < 1e-9 * free);
    assert!(free + 1e-4 < lines.report.cost && lines.report.cost < held - 1e-2);
    let values: Vec<f64> = lines.controls.iter().map(|row| row[0]).collect();
    for piece in values.chunks(4) {
        let bends = piece.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs());
        assert!(bends.fold(0.0, f64::max) < 1e-9, "{piece:?}");
    }
    // lines meet at their knots
    for (one, next) in values.chunks(4).zip(values.chunks(4).skip(1)) {
        let [before, after] = [1.5 * one[3] - 0.5 * one[2], 1.5 * next[0] - 0.5 * next[1]];
        assert!((before - after).abs() < 1e-9, "{before} and {after}");
    }
    let q = run(&lines);
    assert!((q[2] - 0.5).abs() < 1e-8, "{q:?}");
    let bounded = with(", shape = \"linear\", hold = 4, min = -3.0, max = 3.0");
    assert_eq!(bounded.report.status, SearchStatus::Optimal, "{:?}", bounded.report);
    assert!(
        bounded.report.controls[0].largest <= 3.0 + 1e-12
            && bounded.report.controls[0].at_bounds > 0
    );
}

/// Two equal rods that gears turn alike, one of them driven: each needs the torque of the one rod,
/// so that the effort is four times as dear; threads and gears of ratios of their own are motions
/// of the run. What is prescribed of an unknown is met, and a pivot that moves with a constant
/// velocity, and the rod with it, changes no torque.
#[test]
fn gears_and_prescribed_motions_hold_beside_controls() {
    let alone = found(PENDULUM).unwrap().report.cost;
    let second = PENDULUM
        .replace("[0.0, 0.0, -0.5] }]", "[0.0, 0.0, -0.5] }, { name = \"other\", mass = 1.0, inertia = [0.08354166666666665, 0.08354166666666665, 0.00041666666666666675], position = [0.0, 2.0, -0.5] }]")
        .replace("axis = [0.0, 1.0, 0.0] }]", "axis = [0.0, 1.0, 0.0] }, { name = \"axle\", type = \"revolute\", parent = \"ground\", child = \"other\", position = [0.0, 2.0, 0.0], axis = [0.0, 1.0, 0.0] }]");
    let with = |ratio: f64| {
        format!(
            "{second}constraint = [{{ name = \"teeth\", type = \"gear\", joints = [\"hinge\", \"axle\"], ratio = {ratio:?} }}]\n"
        )
    };
    let both = found(&with(-1.0)).unwrap();
    println!("{} for 4 x {alone}", both.report.cost);
    assert_eq!(both.report.status, SearchStatus::Optimal, "{:?}", both.report);
    assert!((both.report.cost - 4.0 * alone).abs() < 1e-9 * alone);
    let slow = found(&with(3.0)).unwrap();
    assert_eq!(slow.report.status, SearchStatus::Optimal, "{:?}", slow.report);
    let [run, replay] = run_and_replay(&with(3.0), &slow);
    assert_eq!(run, replay);
    // a third of a half turn the other way round
    let angle = std::f64::consts::FRAC_PI_3;
    assert!((run[39][12] + 0.5 * (-angle).sin()).abs() < 1e-8, "{:?}", &run[39][12..15]);
    // a pivot on a rail
    let rail = |rate: f64, method: &str| {
        let text = PENDULUM.replace("step = 0.05", &format!("step = 0.05{method}"));
        let text = text
            .replace("body = [", "body = [{ name = \"cart\", mass = 3.0, inertia = [0.1, 0.1, 0.1], position = [0.0, 0.0, 0.0] }, ")
            .replace("joint = [{", &format!("joint = [{{ name = \"rail\", type = \"prismatic\", parent = \"ground\", child = \"cart\", position = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0], rate = {rate:?} }}, {{"))
            .replace("parent = \"ground\", child = \"rod\"", "parent = \"cart\", child = \"rod\"")
            .replace("{ name = \"stop\", type = \"rest\" }", "{ name = \"slow\", sensor = \"rate\", equals = 0.0 }")
            .replace("sensor = [", "sensor = [{ name = \"rate\", type = \"joint_rate\", of = \"hinge\" }, ");
        format!(
            "{text}constraint = [{{ name = \"drive\", type = \"motion\", joint = \"rail\", path = {{ rate = {rate:?} }} }}]\n"
        )
    };
    let methods =
        ["", ", order = 4, method = \"composition\"", ", order = 4, method = \"galerkin\""];
    for method in methods {
        let [still, moving] = [0.0, 0.7].map(|rate| found(&rail(rate, method)).unwrap());
        println!("{method}: {} for {}", moving.report.cost, still.report.cost);
        assert_eq!(moving.report.status, SearchStatus::Optimal, "{:?}", moving.report);
        assert!((moving.report.cost - still.report.cost).abs() < 1e-8 * still.report.cost);
        let [run, replay] = run_and_replay(&rail(0.7, method), &moving);
        assert_eq!(run, replay);
        assert!((run[39][0] - 1.4).abs() < 1e-10 && (run[39][14] - 0.5).abs() < 1e-8);
    }
    let shaken = rail(0.0, "").replace("path = { rate = 0.0 }", "path = \"0.2*(1 - cos(5*t))\"");
    let own = found(&shaken).unwrap();
    assert_eq!(own.report.status, SearchStatus::Optimal, "{:?}", own.report);
    let [run, replay] = run_and_replay(&shaken, &own);
    assert_eq!(run, replay);
    assert!((run[39][0] - 0.2 * (1.0 - 10.0_f64.cos())).abs() < 1e-10);
    let free = format!("{shaken}optimize = {{ time = {{ min = 1.0, max = 4.0 }} }}\n");
    let error = found(&free).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.contains("beside prescribed motions"), "{error}");
}

/// The case `oc01` of `tests/reference/control`.
#[test]
fn a_pendulum_swings_up_at_the_stored_cost() {
    let found_of = found;
    let found = found(PENDULUM).unwrap();
    let report = &found.report;
    assert_eq!(report.status, SearchStatus::Optimal, "{report:?}");
    assert!((report.cost - 4.434825997490211).abs() < 1e-8, "{}", report.cost);
    assert_eq!(report.sufficient, Some(true));
    assert!(report.replay.as_ref().unwrap().deviation < 1e-8);
    assert!(report.conditions[0].violation < 1e-10 && report.conditions.len() == 2);
    let q = run(&found);
    assert!((q[2] - 0.5).abs() < 1e-8, "{q:?}");
    // the price: the cost of a little more
    let cost = |angle: f64| {
        found_of(&PENDULUM.replace("3.141592653589793", &format!("{angle:?}"))).unwrap().report.cost
    };
    let pi = std::f64::consts::PI;
    let slope = (cost(pi + 1e-3) - cost(pi - 1e-3)) / 2e-3;
    let price = report.conditions[0].price;
    assert!((slope - price).abs() < 1e-4 * price.abs(), "{slope} for {price}");
    assert_eq!(found.controls().lines().count(), 41);
    assert_eq!(found.costates().lines().count(), 41);
    assert!(
        found.iterations().starts_with("start,steps,iteration,cost,infeasibility,stationarity")
    );
}

/// A rod whose velocity does not fit its hinge: the program begins with the projected motion, as
/// the run of the result does.
#[test]
fn a_projected_start_is_that_of_the_run() {
    let velocity = "position = [0.0, 0.0, -0.5], velocity = [0.4, 0.1, 0.3]";
    let text = PENDULUM.replace("position = [0.0, 0.0, -0.5]", velocity);
    let text = text.replace("end = 2.0 }", "end = 2.0, project_start = true }");
    let found_of = found;
    let found = found_of(&text).unwrap();
    let report = &found.report;
    assert_eq!(report.status, SearchStatus::Optimal, "{report:?}");
    let replay = report.replay.as_ref().unwrap().deviation;
    let [x, _, z] = [0, 1, 2].map(|i| run(&found)[i]);
    // of the impulse [0.4, 0.1, 0.3] at the centre the hinge leaves a rate about its axis
    let rate = -0.5 * 0.4 / (0.5 * 0.5 + 0.08354166666666665);
    let stated = PENDULUM
        .replace("axis = [0.0, 1.0, 0.0]", &format!("axis = [0.0, 1.0, 0.0], rate = {rate:?}"));
    let wanted = found_of(&stated).unwrap().report.cost;
    println!("cost {}, of the stated rate {wanted}, replay off by {replay:.1e}", report.cost);
    assert!(replay < 1e-9 && x.abs() < 1e-8 && (z - 0.5).abs() < 1e-8, "{replay:e}, {x}, {z}");
    assert!((report.cost - wanted).abs() < 1e-9 * wanted, "{} for {wanted}", report.cost);
    assert!((report.cost - 4.434825997490211).abs() > 1e-2);
}

/// The motion of the case `oc01` by a torque on the body in the place of an effort of its joint:
/// about the axis both do the same.
#[test]
fn a_torque_on_a_body_swings_it_up_at_the_stored_cost() {
    for frame in ["space", "body"] {
        let acts = format!("body = \"rod\", torque = [0.0, 1.0, 0.0], frame = \"{frame}\"");
        let found = found(&PENDULUM.replace("joint = \"hinge\" }]\nobj", &(acts + " }]\nobj")));
        let found = found.unwrap();
        let report = &found.report;
        println!("{frame}: {} in {} iterations", report.cost, report.iterations);
        assert_eq!(report.status, SearchStatus::Optimal, "{report:?}");
        assert!((report.cost - 4.434825997490211).abs() < 1e-8, "{}", report.cost);
        assert!(report.replay.as_ref().unwrap().deviation < 1e-8);
        assert!((run(&found)[2] - 0.5).abs() < 1e-8);
    }
}

const TUG: &str = r#"
model = { name = "tug", gravity = [0.0, 0.0, 0.0] }
simulation = { step = 0.1, end = 2.0 }
body = [{ name = "tug", mass = 2.0, inertia = [0.3, 0.4, 0.5], position = [0.0, 0.0, 0.0] }]
sensor = [{ name = "place", type = "position", of = "tug" }]
control = [{ name = "x", body = "tug", force = [1.0, 0.0, 0.0] }, { name = "y", body = "tug", force = [0.0, 2.0, 0.0] }]
objective = [{ name = "cheap", type = "effort" }]
condition = [{ name = "there", sensor = "place.x", equals = 1.5 }, { name = "aside", sensor = "place.y", equals = -0.8 }, { name = "stop", type = "rest" }]
"#;

/// Two thrusters bring a body that is free to rest elsewhere and turned, in the plane: the cost of
/// the way is that of the discrete double integrator, `6 m² d²/(h³ N (N² − 1))`.
#[test]
fn thrusters_bring_a_free_body_to_rest() {
    let found = found(TUG).unwrap();
    let (h, n) = (0.1_f64, 20.0);
    let way = |d: f64, unit: f64| 6.0 * (2.0 * d / unit).powi(2) / (h.powi(3) * n * (n * n - 1.0));
    let wanted = way(1.5, 1.0) + way(0.8, 2.0);
    println!("{} for {wanted}", found.report.cost);
    assert_eq!(found.report.status, SearchStatus::Optimal, "{:?}", found.report);
    assert!((found.report.cost - wanted).abs() < 1e-9 * wanted, "{}", found.report.cost);
    let q = run(&found);
    assert!((q[0] - 1.5).abs() < 1e-9 && (q[1] + 0.8).abs() < 1e-9, "{q:?}");
    assert!(found.model.loads.iter().map(|own| own.name.as_str()).eq(["x", "y"]));
}

/// Three thrusters that turn with it bring a body to another attitude, at rest: a third of a turn
/// about no principal axis.
#[test]
fn thrusters_turn_a_satellite() {
    let text = r#"
model = { name = "satellite", gravity = [0.0, 0.0, 0.0] }
simulation = { step = 0.075, end = 3.0 }
body = [{ name = "hub", mass = 2.0, inertia = [0.3, 0.4, 0.5], position = [0.0, 0.0, 0.0] }]
sensor = [{ name = "a", type = "position", of = "hub", point = [1.0, 0.0, 0.0] }, { name = "b", type = "position", of = "hub", point = [0.0, 1.0, 0.0] }]
control = [{ name = "x", body = "hub", torque = [1.0, 0.0, 0.0], frame = "body" }, { name = "y", body = "hub", torque = [0.0, 1.0, 0.0], frame = "body" }, { name = "z", body = "hub", torque = [0.0, 0.0, 1.0], frame = "body" }]
objective = [{ name = "cheap", type = "effort" }]
condition = [{ name = "a2", sensor = "a.y", equals = 0.87149950180988 }, { name = "a3", sensor = "a.z", equals = -0.45849381366219244 }, { name = "b3", sensor = "b.z", equals = 0.7455040170157057 }, { name = "stop", type = "rest" }]
optimize = { refine = 2 }
"#;
    let found = found(text).unwrap();
    let (report, [order, _]) = (&found.report, found.report.convergence().unwrap());
    println!("{} in {} iterations, order {order:.2}", report.cost, report.iterations);
    assert_eq!(
        (report.status, report.sufficient),
        (SearchStatus::Optimal, Some(true)),
        "{report:?}"
    );
    assert!((order - 2.0).abs() < 0.2, "{order}");
    assert!(report.replay.as_ref().unwrap().deviation < 1e-8);
    let q = run(&found);
    for (i, wanted) in [(4, 0.87149950180988), (5, -0.45849381366219244), (8, 0.7455040170157057)] {
        assert!((q[i] - wanted).abs() < 1e-9, "{q:?}");
    }
}

/// Methods of higher order, as they are written behind a step.
const METHODS: [&str; 3] = ["", ", order = 4", ", order = 4, method = \"galerkin\""];

/// Bounds, a free time, `hold`, a condition on a point, the start from another motion.
#[test]
fn bounds_and_a_free_time_hold() {
    let costs = [4.434826, 4.470414, 4.470238]; // of the swing up by the angle
    METHODS.into_iter().zip(costs).for_each(|(method, cost)| bounds_hold_by(method, cost));
}

fn bounds_hold_by(method: &str, cost: f64) {
    let pendulum = PENDULUM.replace("step = 0.05", &format!("step = 0.05{method}"));
    let text = pendulum
        .replace("joint = \"hinge\" }]", "joint = \"hinge\", min = -7.0, max = 7.0, hold = 2 }]");
    let text = text.replace(
        "type = \"effort\" }]",
        "type = \"effort\" }, { name = \"soon\", type = \"time\", weight = 80.0 }]",
    ) + "optimize = { time = { min = 0.3, max = 6.0 }, refine = 0 }";
    let text = text.replace("3.141592653589793", "1.0");
    let free = found(&text).unwrap();
    let report = &free.report;
    assert_eq!(report.status, SearchStatus::Optimal, "{report:?}");
    assert!(report.time > 0.3 && report.time < 1.9 && (report.time - 2.0).abs() > 1e-3);
    assert!(report.controls[0].largest <= 7.0 && report.controls[0].at_bounds > 0, "{report:?}");
    let pairs = free.controls.chunks(2);
    assert!(pairs.into_iter().all(|pair| pair[0] == pair[1]), "two steps for each value");
    assert!((report.terms[1].value - 80.0 * report.time).abs() < 1e-10);
    assert!((run(&free)[2] + 0.5 * 1.0_f64.cos()).abs() < 1e-7);
    let by_point = pendulum.replace(
        "sensor = \"angle\", equals = 3.141592653589793",
        "sensor = \"place.z\", min = 0.499999",
    ) + "optimize = { guess = \"run\", starts = 3 }";
    let by_point = found(&by_point).unwrap();
    let starts = &by_point.report.starts;
    assert_eq!(starts.iter().map(|own| own.count).sum::<usize>(), 3, "{starts:?}");
    let rows = by_point.iterations();
    for start in ["1,", "2,", "3,"] {
        assert!(rows.lines().skip(1).any(|row| row.starts_with(start)), "no row of {start}");
    }
    if by_point.report.status == SearchStatus::Optimal {
        assert!((by_point.report.cost - cost).abs() < 0.01, "{}", by_point.report.cost);
    }
}

/// A free time beside what is not along joints: a damper between points, a force that turns with
/// the body, a law of its velocity. At the time that is found the cost of a given time is least.
#[test]
fn a_free_time_is_least_beside_dampers_loads_and_laws() {
    let forces = "spring = [{ name = \"tie\", from = \"ground\", to = \"rod\", point_from = [0.8, 0.1, 0.3], stiffness = 1.5, natural_length = 0.4, damping = 0.8 }]\n\
                  load = [{ name = \"push\", body = \"rod\", force = [0.5, 0.0, 0.2], point = [0.0, 0.0, 0.1], frame = \"body\" }]\n\
                  law = [{ name = \"drag\", on = \"rod\", force = [\"-0.3*vx*(1 + vx^2)\", \"0\", \"-0.3*vz\"] }]\n";
    for method in ["", ", order = 4, method = \"galerkin\""] {
        let stated = format!("step = 0.05{method}");
        let timed = "type = \"effort\" }, { name = \"soon\", type = \"time\", weight = 3.0 }]";
        let text = PENDULUM.replace("step = 0.05", &stated).replace("type = \"effort\" }]", timed)
            + forces;
        let free = found(&format!("{text}optimize = {{ time = {{ min = 0.5, max = 6.0 }} }}\n"));
        let free = free.unwrap().report;
        assert_eq!((free.status, free.sufficient), (SearchStatus::Optimal, Some(true)), "{free:?}");
        assert!(free.replay.as_ref().unwrap().deviation < 1e-8);
        let given = |time: f64| {
            let step = time / 40.0;
            let text = text.replace("step = 0.05", &format!("step = {step:?}"));
            let report = found(&text.replace("end = 2.0", &format!("end = {time:?}"))).unwrap();
            report.report.cost
        };
        let (at, by) = (given(free.time), 1e-3 * free.time);
        let [before, after] = [-by, by].map(|by| given(free.time + by));
        let (slope, bend) =
            ((after - before) / (2.0 * by), (after - 2.0 * at + before) / (by * by));
        println!("{method}: {} at {} s, slope {slope:.1e}, bend {bend:.1e}", free.cost, free.time);
        assert!((at - free.cost).abs() < 1e-9 * at && free.time > 0.6 && free.time < 5.9);
        assert!(bend > 0.0 && slope.abs() < 1e-5 * bend * free.time, "{slope} {bend}");
        for late in ["-0.3*vz*t", "-0.3*vz*select(t - 1.1, 2, 1)"] {
            let late = text.replace("-0.3*vz", late);
            let late = format!("{late}optimize = {{ time = {{ min = 0.5, max = 6.0 }} }}\n");
            let error = found(&late).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(error.contains("beside `drag`, which changes with the time"), "{error}");
        }
    }
}

/// Efforts that cannot lift it.
#[test]
fn what_no_effort_meets_is_infeasible() {
    let text =
        PENDULUM.replace("joint = \"hinge\" }]", "joint = \"hinge\", min = -0.3, max = 0.3 }]");
    let report = found(&text).unwrap().report;
    assert_eq!(report.status, SearchStatus::Infeasible, "{report:?}");
    assert!(!report.missed.is_empty());
}

#[test]
fn what_cannot_be_optimised_is_said() {
    for (changed, with, words) in [
        (
            "type = \"effort\" }]",
            "type = \"effort\" }]\noptimize = { guess = \"nowhere\" }",
            "no folder of an optimum",
        ),
        (
            "sensor = \"angle\", equals",
            "sensor = \"angle\", at = \"path\", min = 0.5, max",
            "start outside of the bounds",
        ),
        ("objective = [{ name = \"cheap\", type = \"effort\" }]", "", "an optimum of nothing"),
        (
            "type = \"effort\" }]",
            "type = \"effort\" }]\noptimize = { time = { min = 2.5, max = 3.0 } }",
            "begins with 2 s, outside of the bounds",
        ),
        ("\"angle\", equals", "\"angle\", at = 1.52, equals", "no node"),
        ("\"angle\", equals", "\"angle\", at = 2.5, equals", "later than the end"),
    ] {
        assert!(PENDULUM.contains(changed), "{changed}");
        let error = found(&PENDULUM.replace(changed, with)).err();
        let error = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(words), "{words}: {error}");
    }
}

/// A run that takes another solution of a step than the optimum says where, and what helps.
#[test]
fn another_motion_of_the_run_is_explained() {
    let nine = "step = 0.2222222222222222, end = 2.0, order = 4, method = \"composition\"";
    let found = found(&PENDULUM.replace("step = 0.05, end = 2.0", nine)).unwrap();
    println!("{:?}: {:?}", found.report.status, found.report.missed);
    assert_eq!((found.report.status, found.report.steps), (SearchStatus::OtherMotion, 9));
    let [message] = &found.report.missed[..] else { panic!("one") };
    assert!(message.contains("at node 8") && message.contains("take more steps"), "{message}");
}

/// A damper would feed energy in where sub-steps go backward.
#[test]
fn dampers_beside_backward_sub_steps_are_refused() {
    let text = PENDULUM.replace("step = 0.05", "step = 0.05, order = 4");
    let text = text.replace("1.0, 0.0] }]", "1.0, 0.0], damper = { damping = 0.1 } }]");
    assert_eq!(text.matches("damping").count(), 1);
    let error = found(&text).unwrap_err();
    let (message, all) = (error.to_string(), format!("{error:?}"));
    assert!(message.contains("backward sub-steps"), "{message}");
    assert!(all.contains("galerkin"), "{all}");
    let text = text.replace("order = 4", "order = 4, method = \"galerkin\"");
    assert_eq!(found(&text).unwrap().report.status, SearchStatus::Optimal);
}

/// The case `oc07`: a closed loop with redundant rows comes to rest, driven at one joint.
#[test]
fn a_four_bar_comes_to_rest_at_the_stored_cost() {
    let body = |name: &str, mass: f64, inertia: f64, x: f64, z: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [{inertia:?}, {inertia:?}, {:?}]\nposition = [{x:?}, 0.0, {z:?}]\n",
            0.1 * inertia
        )
    };
    let joint = |name: &str, [parent, child]: [&str; 2], x: f64, z: f64, more: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\ntype = \"revolute\"\nparent = \"{parent}\"\nchild = \"{child}\"\n\
             position = [{x:?}, 0.0, {z:?}]\naxis = [0.0, 1.0, 0.0]\n{more}\n"
        )
    };
    let (x, z) = (0.07500000000000001, 0.12990381056766578);
    let (u, w) = (0.546556821879383, 0.47251090512719507);
    let text = [
        "model = { name = \"four-bar\", gravity = [0.0, 0.0, -9.81] }\n".to_owned(),
        "simulation = { step = 0.0125, end = 0.5, project_start = true }\n".to_owned(),
        "sensor = [{ name = \"angle\", type = \"joint_coordinate\", of = \"shaft\" }]\n".to_owned(),
        "control = [{ name = \"drive\", joint = \"shaft\" }]\n".to_owned(),
        "objective = [{ name = \"cheap\", type = \"effort\" }]\n".to_owned(),
        "condition = [{ name = \"there\", sensor = \"angle\", equals = -2.0 }, { name = \"stop\", type = \"rest\" }]\n"
            .to_owned(),
        body("crank", 0.8, 0.0061066666666666665, x, z),
        body("coupler", 1.6, 0.10821333333333334, u, w),
        body("rocker", 1.2, 0.04915999999999999, 0.871556821879383, 0.3426070945595293),
        joint("shaft", ["ground", "crank"], 0.0, 0.0, "rate = -6.0"),
        joint("pin", ["crank", "coupler"], 2.0 * x, 2.0 * z, ""),
        joint("pivot", ["ground", "rocker"], 0.8, 0.0, ""),
        joint("cut", ["coupler", "rocker"], 2.0 * (u - x), 2.0 * (w - z), "cut = true"),
    ]
    .concat();
    let found = found(&text).unwrap();
    assert_eq!(found.report.status, SearchStatus::Optimal, "{:?}", found.report);
    assert!((found.report.cost - 8.43491718802377).abs() < 1e-7, "{}", found.report.cost);
    assert!(found.report.replay.unwrap().deviation < 1e-8);
}

/// Conditions that the controls cannot meet at the guess are named: a component that is extreme
/// there, two that contradict one another, more than there are values of controls; what can be met
/// is not.
#[test]
fn conditions_out_of_reach_are_named() {
    METHODS.into_iter().for_each(out_of_reach_by);
}

fn out_of_reach_by(method: &str) {
    let pendulum = PENDULUM.replace("step = 0.05", &format!("step = 0.05{method}"));
    let of = |from: &str, to: &str| {
        let text = pendulum.replace(from, to);
        assert_ne!(text, pendulum);
        found(&text).unwrap().report
    };
    let up = "{ name = \"up\", sensor = \"angle\", equals = 3.141592653589793 }";
    // the height of the rod is least where the search begins and ends
    let height = "{ name = \"high\", sensor = \"place.z\", equals = 0.4 }";
    let report = of(up, height);
    println!("{:?}: {:?}", report.status, report.missed);
    assert!(report.missed.iter().any(|own| own.starts_with("no control changes `high`")));
    let both = format!("{up}, {{ name = \"aside\", sensor = \"place.x\", equals = 0.3 }}");
    let report = of(up, &both);
    println!("{:?}: {:?}", report.status, report.missed);
    assert_ne!(report.status, SearchStatus::Optimal);
    let named =
        |own: &String| own.starts_with("`up` at node 40, `aside` at node 40 change together");
    assert!(report.missed.iter().any(named), "{:?}", report.missed);
    // what bounds of controls alone forbid is within reach to first order; so is rest along axes
    // that no thruster moves, for nothing else does
    let weak = of("joint = \"hinge\" }]\nobj", "joint = \"hinge\", min = -0.3, max = 0.3 }]\nobj");
    let text =
        TUG.replace("force = [1.0, 0.0, 0.0]", "force = [1.0, 0.0, 0.0], min = -0.1, max = 0.1");
    for report in [weak, found(&text).unwrap().report] {
        println!("{:?}: {:?}", report.status, report.missed);
        assert_eq!(report.status, SearchStatus::Infeasible);
        assert!(!report.missed.iter().any(|own| own.contains("at the guess")), "{report:?}");
    }
}
