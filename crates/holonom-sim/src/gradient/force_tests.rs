//! Gradients of sensors that need forces, orientations and accelerations: the number is that of
//! `sensors.csv`, its derivatives are those of whole runs, forward as backward.

use super::comparison::{PATH, SeenNumber, Worst, seen, sensing};
use super::force_models::{
    ACCELERATIONS, BALLS, DRAGGED, DRIVEN, EFFORTS, FORCES, HELD, LAGGING, LAGS, LOADS,
    ORIENTATIONS, REACTIONS, READING, SLACK, THREADED, TUNED, TURNS, WORKS, conservative, far,
    held, without_controls, without_objectives,
};
use super::prepared::{Begin, Prepared};
use super::tests::FLYING;
use super::tests::LINKAGE;
use super::{GradientFailure, Wanted, gradient};
use crate::shown::Shown;
use crate::system::outside::ExternalActions;
use holonom_model::{Model, ModelError, ModelText};
use std::path::Path;
use vi_control::checkpoints::Checkpoints;
use vi_control::gradient::{Gradient, Task};
use vi_control::identification::MeasuredReading;
use vi_control::node::{Node, NodeQuantity, RateOf};
use vi_control::sensitivities::{Beside, Direction, Sensitivities};
use vi_core::Motion;

/// Of derivatives and differences, and of forward and backward.
const WITHIN: [f64; 2] = [1e-9, 1e-11];

/// Compares numbers of sensors, counted there.
fn compare_all(text: &str, all: &[(&str, &str, &str, &[&str])], at: &str) {
    Worst::default().compare_all(text, &seen(all, at), WITHIN);
}

/// The same at the end and along the path.
fn compare_both(text: &str, all: &[(&str, &str, &str, &[&str])]) {
    let both = [seen(all, ""), seen(all, PATH)];
    Worst::default().compare_all(text, &both.into_iter().flatten().collect::<Vec<_>>(), WITHIN);
}

#[test]
fn efforts_agree_with_differences() {
    let held = held();
    for (text, of_held) in [(FORCES, false), (&held, true)] {
        let own = EFFORTS.iter().filter(|own| ["soft", "follows"].contains(&own.1) == of_held);
        let own: Vec<_> = own.map(|(kind, of, parts)| (*kind, *of, "", *parts)).collect();
        compare_both(text, &own);
    }
    // of the first the control changes nothing, or next to nothing where a bushing reads its joint
    let held_loads = LOADS.replace("*length", "*0.8");
    for text in [format!("{FORCES}{LOADS}"), format!("{held}{held_loads}")] {
        compare_both(&text, &["push", "weighs"].map(|of| ("power", of, "", &[""][..])));
    }
    let of_loop = [("pin", "damper"), ("pivot", "spring")];
    let of_loop =
        of_loop.each_ref().map(|(of, part)| ("effort", *of, "", std::slice::from_ref(part)));
    compare_both(&without_objectives(LINKAGE), &of_loop);
    compare_both(&far(), &[("effort", "far", "", &[""])]);
}

/// All works, counted there.
fn works() -> Vec<(&'static str, &'static str, &'static str, &'static [&'static str])> {
    WORKS.iter().map(|(of, parts)| ("work", *of, "", *parts)).collect()
}

/// Along the path the work up to each node counts.
#[test]
fn works_agree_with_differences() {
    compare_both(&format!("{FORCES}{LOADS}{DRAGGED}"), &works());
}

/// In Galerkin steps works are sums over their Gauss nodes.
#[test]
fn works_in_galerkin_steps_agree_with_differences() {
    let text = without_controls(&format!("{FORCES}{LOADS}{DRAGGED}"));
    compare_both(&by(&text, "method = \"galerkin\"\norder = 4\n"), &works());
}

/// In sub-steps, in a closed loop, and in one expression with other numbers.
#[test]
fn works_of_other_runs_agree_with_differences() {
    let loops = without_objectives(LINKAGE);
    compare_both(&loops, &[("work", "pin", "", &["damper"]), ("work", "pivot", "", &["spring"])]);
    let free = by(&without_controls(&conservative()), "order = 4\n");
    compare_both(&free, &[("work", "shoulder", "", &["spring"]), ("work", "tie", "", &[""])]);
    compare_both(&far(), &[("work", "far", "", &[""])]);
    compare_both(&held(), &[("work", "soft", "", &[""]), ("work", "follows", "", &[""])]);
    let more = "[[sensor]]\nname = \"done\"\ntype = \"work\"\nof = \"shoulder\"\n\
                [[sensor]]\nname = \"felt\"\ntype = \"acceleration\"\nof = \"lower\"\n\
                [[sensor]]\nname = \"held\"\ntype = \"work\"\nof = \"tie\"\n";
    let value = "value = \"done.motor*held + k*felt.x*done.spring\"\n";
    compare_both(&format!("{FORCES}{more}"), &[("expression", "", value, &[""])]);
}

/// Of what reads signals with states, which are internal variables of the run.
#[test]
fn sensors_beside_signals_with_states_agree_with_differences() {
    let text = held() + LAGGING + SLACK;
    compare_both(&text, &LAGS);
    let text = by(&without_controls(&text), "method = \"galerkin\"\norder = 4\n");
    compare_all(&text, &LAGS, "");
}

/// Histories of loads and motors and paths of motors by their own numbers: frequencies, phases,
/// times, values.
#[test]
fn numbers_of_histories_agree_with_differences() {
    let histories = [
        "{ type = \"harmonic\", frequency = \"= 0.4*k\", phase = \"= c\" }",
        "{ type = \"ramp\", start = \"= 0.1*c + 0.007\", end = \"= 0.02*k + 0.003\" }",
        "{ type = \"triangle\", start = \"= 0.05*c\", peak = \"= 0.02*k + 0.003\", end = \"= 0.7*c\" }",
        "{ type = \"table\", times = [0.03, \"= 0.3*c\", 0.5], values = [0.0, \"= k\", \"= c\"] }",
        "{ type = \"steps\", values = [\"= c\", \"= 0.2*k\", -0.3], step = 0.1 }",
        "{ type = \"linear\", end = \"= 0.1*k\" }",
    ];
    let path = "{ offset = \"= c\", rate = \"= 0.1*k\", acceleration = \"= c\", amplitude = \"= 0.02*k\", \
                frequency = \"= 0.3*k\", phase = \"= c\", moves = [{ start = \"= 0.1*c\", \
                end = \"= 0.03*k\", by = \"= c\" }], table = { times = [-0.1, \"= 0.3*c\", 0.6], \
                values = [\"= 0.1*k\", \"= c\", 0.2], rates = [\"= c\", \"= 0.05*k\"] } }";
    let kinks = [
        "limits = [-0.05, 0.02]\nbumper = { stiffness = 40.0, damping = 0.05 }\n",
        "friction = { torque = 0.3, model = { type = \"stribeck\", transition_velocity = 0.5 } }\n",
    ];
    let forces = kinks.iter().fold(format!("{FORCES}{LOADS}"), |text, own| text.replace(own, ""));
    assert!(!forces.contains("bumper") && !forces.contains("friction"));
    for history in histories {
        let text = forces.replace("history = \"cos(k*t)\"", &format!("history = {history}"));
        let text = text.replace("path = \"0.2*c*t\"", &format!("path = {path}"));
        assert!(text.matches(history).count() == 2 && text.contains(path));
        let all: [(&str, &str, &str, &[&str]); 2] =
            [("effort", "shoulder", "", &["motor"]), ("acceleration", "box", "", &["y"])];
        compare_all(&without_controls(&text), &all, "");
    }
}

/// Why there is no gradient of a model.
pub(super) fn refusal(text: &str) -> String {
    let source = ModelText::from_text(Path::new("model.toml"), text);
    let model = source.model(&[]).unwrap();
    gradient(&source, &[], &model, &Wanted::everything()).unwrap_err().to_string()
}

/// A hanging rod that a controller pushes, whose derivative rests at its error.
pub(super) const AT_REST: &str = r#"
[model]
name = "hangs"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.01
end = 0.1
[parameters]
c = 0.4
[[body]]
name = "lower"
position = [0.0, 0.0, -0.5]
mass = 1.0
inertia = [0.1, 0.1, 0.01]
[[joint]]
name = "slide"
type = "revolute"
parent = "ground"
child = "lower"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[signal]]
name = "s"
pid = { of = "c - slide", proportional = "= 4*c", derivative = "= 0.3*c", filter = "= 0.1*c" }
[[law]]
name = "pushes"
joint = "slide"
effort = "s"
"#;

/// Gains of zero, which have no state.
#[test]
fn numbers_of_signals_without_derivatives_are_refused() {
    let signal = |own: &str| {
        let law = "[[law]]\nname = \"pushes\"\njoint = \"slide\"\neffort = \"s\"\n";
        format!("{}[[signal]]\nname = \"s\"\n{own}\n{law}", without_controls(&held()))
    };
    let cases = [
        (
            signal("pid = { of = \"-slide\", proportional = 2.0, integral = \"= c - 0.4\" }"),
            "signal.s.pid.integral",
        ),
        (
            signal(
                "transfer = { of = \"slide\", numerator = [\"= c - 0.4\", 1.0], denominator = [1.0, 2.0] }",
            ),
            "signal.s.transfer.numerator.0",
        ),
    ];
    for (text, key) in cases {
        let text = sensing(&text, "type = \"position\"\nof = \"lower\"\n", "x", "");
        let found = refusal(&text);
        println!("{found}");
        assert!(found.starts_with(key), "{key}: {found}");
    }
}

/// A history that jumps has no derivative by its times.
#[test]
fn times_of_jumps_are_refused() {
    let jumps = [
        "{ type = \"pulse\", start = 0.05, end = \"= 0.3*c\" }",
        "{ type = \"table\", times = [\"= 0.3*c\", 0.5], values = [1.0, 2.0] }",
        "{ type = \"steps\", values = [0.3, 0.5], step = \"= 0.3*c\" }",
    ];
    for history in jumps {
        let text = FORCES.replace("history = \"cos(k*t)\"", &format!("history = {history}"));
        let text = sensing(&text, "type = \"position\"\nof = \"box\"\n", "x", "");
        let found = refusal(&text);
        println!("{found}");
        assert!(found.contains(".history."), "{found}");
    }
}

/// Of signals with states by their own numbers: gains, time constants, coefficients, starts.
#[test]
fn numbers_of_signals_with_states_agree_with_differences() {
    let text = held() + TUNED + SLACK;
    let of = |kinds: &[&str], at| {
        let own: Vec<_> = LAGS.into_iter().filter(|own| kinds.contains(&own.0)).collect();
        seen(&own, at)
    };
    let shown = "type = \"expression\"\n\
                 value = \"k*slow + steers*slide.rate - c*bounded + shaped + charge\"\n";
    let mut all = of(&["effort", "work", "joint_acceleration"], "");
    all.extend(of(&["power"], PATH));
    all.push(SeenNumber::new(shown, "", PATH));
    Worst::default().compare_all(&text, &all, WITHIN);
    for order in ["2", "4"] {
        let galerkin = by(&text, &format!("method = \"galerkin\"\norder = {order}\n"));
        let mut at_end = of(&["effort", "work"], "");
        at_end.push(SeenNumber::new(shown, "", PATH));
        Worst::default().compare_all(&galerkin, &at_end, WITHIN);
    }
}

/// Of a closed loop: gains, time constants and coefficients of a controller of its crank.
#[test]
fn numbers_of_signals_beside_a_loop_agree_with_differences() {
    let steers = "[[signal]]\nname = \"s\"\npid = { of = \"0.5 - shaft\", proportional = \"= 3*gain\", integral = \"= gain\", derivative = \"= 0.2*gain\", filter = \"= 0.1*gain\" }\n\
                  [[signal]]\nname = \"late\"\ntransfer = { of = \"s + gain*pin\", numerator = [\"= gain\", 20.0], denominator = [1.0, \"= 30*gain\"] }\n\
                  [[law]]\nname = \"steers\"\njoint = \"shaft\"\neffort = \"late\"\n";
    let linkage =
        without_objectives(LINKAGE).replace("[parameters]\n", "[parameters]\ngain = 0.7\n");
    let linkage = linkage + steers;
    let own = [("effort", "steers", "", &[""][..]), ("joint_rate", "pin", "", &[""])];
    for steps in ["", "method = \"galerkin\"\norder = 4\n"] {
        compare_both(&by(&linkage, steps), &own);
    }
}

/// At a relaxed start that depends on what a controller asks for.
#[test]
fn signals_at_a_relaxed_start_agree_with_differences() {
    let place = "type = \"position\"\nof = \"lower\"\n";
    let (pid, law) = (AT_REST.find("pid").unwrap(), AT_REST.find("\n[[law]]").unwrap());
    // states that begin elsewhere than where they rest
    let shaped =
        "transfer = { of = \"c - slide\", numerator = [2.0], denominator = [1.0, \"= 3*c\"] }";
    let shaped = format!("{}{shaped}{}", &AT_REST[..pid], &AT_REST[law..]);
    for text in [AT_REST, &shaped] {
        let text = by(text, "start = \"relaxed\"\n");
        for (steps, at) in [("", ""), ("", PATH), ("method = \"galerkin\"\norder = 4\n", "")] {
            let effort = "type = \"effort\"\nof = \"pushes\"\n";
            let own = [SeenNumber::new(place, "x", at), SeenNumber::new(effort, "", at)];
            Worst::default().compare_all(&by(&text, steps), &own, WITHIN);
        }
    }
}

#[test]
fn orientations_agree_with_differences() {
    let linkage = without_objectives(LINKAGE);
    compare_both(&linkage, &[("orientation", "coupler", "", &["w", "y"])]);
    // beyond half a turn, where the sign of the quaternion is that of the motion; in sub-steps
    let spinning = without_objectives(FLYING).replace("[\"= spin\", 0.5", "[\"= 6*spin\", 0.5");
    compare_both(&spinning, &[("orientation", "box", "", &["w", "x", "z"])]);
    let all = ORIENTATIONS.map(|(of, from)| ("orientation", of, from, &["w", "1", "y", "z"][..]));
    compare_both(FORCES, &all);
}

/// What has no derivative is refused by the name of the sensor, with what to take instead.
#[test]
fn sensors_without_derivatives_are_refused_with_a_remedy() {
    let held = held();
    for (kind, of, part, remedy) in [
        ("effort", "shoulder", "", "seen.spring, seen.damper, seen.bumper"),
        ("effort", "shoulder", "brake", "seen.spring, seen.damper, seen.bumper"),
        ("orientation", "box", "", "seen.w, seen.x, seen.y, seen.z"),
    ] {
        let sensor = format!("type = \"{kind}\"\nof = \"{of}\"\n");
        let text = sensing(&held, &sensor, part, "");
        let source = ModelText::from_text(Path::new("model.toml"), text);
        let model = source.model(&[]).unwrap_or_else(|error| panic!("{kind} of {of}: {error}"));
        let error = gradient(&source, &[], &model, &Wanted::everything()).unwrap_err();
        let GradientFailure::Model(ModelError::Unsupported { what, help, .. }) = error else {
            panic!("{kind} of {of}: {error}");
        };
        println!("{what}: {help}");
        assert!(what.contains("`seen`") && help.contains(remedy), "{kind} of {of}: {what}: {help}");
    }
}

/// The same model by steps of another kind.
pub(super) fn by(text: &str, steps: &str) -> String {
    text.replace("[simulation]\n", &format!("[simulation]\n{steps}"))
}

/// Of trees and bars, by parameters, by the start, by controls: at the end those act in the steps
/// on both sides of the node; along the path the first node has the multipliers of the acceleration
/// level.
#[test]
fn reactions_agree_with_differences() {
    compare_both(FORCES, &REACTIONS);
    let held =
        [("effort", "tether", "", &["effort"][..]), ("reaction", "other", "", &["fx", "fy"])];
    compare_both(HELD, &held);
    let driven = [
        ("effort", "drives", "", &["effort"][..]),
        ("reaction", "rail", "frame = \"space\"\n", &["fx", "fz"]),
    ];
    compare_all(&format!("{HELD}{DRIVEN}"), &driven, "");
}

/// Of a redundant closed loop, whose components in the plane are unique.
#[test]
fn reactions_of_a_loop_agree_with_differences() {
    let linkage = without_objectives(LINKAGE);
    let joints = [
        ("reaction", "shaft", "", &["fx"][..]),
        ("reaction", "pin", "frame = \"space\"\n", &["fx", "fz"]),
        ("reaction", "cut", "", &["fx", "fy"]),
        ("reaction", "pivot", "frame = \"child\"\n", &["fy"]),
    ];
    compare_both(&linkage, &joints);
}

/// Of a tree of bodies alone, beside forces between them: on a thread, along whose coordinate a
/// change of the joint has a part, and on a hinge.
#[test]
fn reactions_beside_forces_agree_with_differences() {
    let all = [
        ("reaction", "thread", "", &["fx", "fz", "mx", "mz"][..]),
        ("reaction", "hinge", "frame = \"space\"\n", &["fx", "fz", "mx"]),
    ];
    compare_all(THREADED, &all, "");
    let hinged = THREADED.replace("type = \"screw\"\npitch = 0.05", "type = \"cylindrical\"");
    let hinged = hinged.replace("spring = { ", "spring = { freedom = 1, ");
    let hinged = hinged.replace("damper = { ", "damper = { freedom = 1, ");
    let hinged = hinged.replace("rate = 2.0", "rate = [0.1, 2.0]");
    compare_all(&hinged, &[("reaction", "hinge", "", &["fy", "mx"][..])], PATH);
}

/// By sub-steps and by Galerkin steps all is of the acceleration level, on which controls act as in
/// the step from the node, at the end as in the last one.
#[test]
fn forces_of_higher_order_agree_with_differences() {
    let linkage = without_objectives(LINKAGE);
    let loops = [("reaction", "cut", "", &["fx"][..]), ("acceleration", "coupler", "", &["z"])];
    let galerkin = "method = \"galerkin\"\norder = 4\n";
    let still = linkage.replace("damper = { damping = 0.05 }\n", "");
    let (forces, free) = (FORCES.to_owned(), conservative());
    for (text, loops_of, steps) in [(&forces, &linkage, galerkin), (&free, &still, "order = 4\n")] {
        let of_tree =
            [REACTIONS[0], REACTIONS[5], REACTIONS[6], ACCELERATIONS[0], ACCELERATIONS[3]];
        compare_both(&by(text, steps), &of_tree);
        compare_both(&by(loops_of, steps), &loops);
    }
}

/// Of a closed loop.
const LOOP_ACCELERATIONS: [(&str, &str, &str, &[&str]); 3] = [
    ("acceleration", "coupler", "point = [0.1, 0.0, 0.2]\n", &["x", "z"]),
    ("joint_acceleration", "pin", "", &[""]),
    ("joint_acceleration", "cut", "", &[""]),
];

/// Of a hinge whose axis changes with a parameter.
#[test]
fn accelerations_about_an_axis_that_changes_agree_with_differences() {
    let text = FORCES.replace("axis = [0.0, 1.0, 0.2]", "axis = [0.0, 1.0, \"= 0.25*length\"]");
    assert_ne!(text, FORCES);
    let own = [("joint_acceleration", "shoulder", "", &[""][..])];
    compare_both(&text, &own);
}

/// Of a ball joint whose axes change with a parameter.
#[test]
fn ball_joints_agree_with_differences() {
    compare_both(BALLS, &TURNS);
}

/// Along the path: those of the steps on both sides of a node, at the ends of the run those of the
/// acceleration level; beside controls the values of the last step act at the end.
#[test]
fn accelerations_agree_with_differences() {
    compare_both(FORCES, &ACCELERATIONS);
    compare_both(&without_objectives(LINKAGE), &LOOP_ACCELERATIONS);
    // in one expression with rates and efforts
    let more = "[[sensor]]\nname = \"felt\"\ntype = \"imu\"\nof = \"lower\"\npoint = [0.1, 0.0, 0.1]\n\
                [[sensor]]\nname = \"slides\"\ntype = \"joint_acceleration\"\nof = \"slide\"\n\
                [[sensor]]\nname = \"works\"\ntype = \"effort\"\nof = \"tie\"\n";
    let value = "value = \"felt.ax*felt.gy + k*slides*works + c*slide.rate\"\n";
    compare_all(&format!("{FORCES}{more}"), &[("expression", "", value, &[""])], PATH);
}

/// Expressions of forces, rates, efforts and orientations together.
#[test]
fn expressions_of_forces_agree_with_differences() {
    let more = "[[sensor]]\nname = \"pull\"\ntype = \"reaction\"\nof = \"string\"\n\
                [[sensor]]\nname = \"held\"\ntype = \"reaction\"\nof = \"shoulder\"\n\
                [[sensor]]\nname = \"works\"\ntype = \"effort\"\nof = \"tie\"\n\
                [[sensor]]\nname = \"turned\"\ntype = \"orientation\"\nof = \"box\"\n";
    let text = without_controls(FORCES) + more;
    let value = "value = \"sqrt(1 + pull.tension^2) + k*works*slide.rate + held.fx*turned.y \
                 - c*t*held.mx\"\n";
    let galerkin = by(&text, "method = \"galerkin\"\norder = 4\n");
    let own = [("expression", "", value, &[""][..])];
    compare_both(&text, &own);
    compare_all(&galerkin, &own, PATH);
}

/// Accelerations beside reactions in one expression, of a tree and of a closed loop: at the first
/// node both are of the acceleration level, at the last one accelerations alone.
#[test]
fn accelerations_beside_reactions_agree_with_differences() {
    let more = "[[sensor]]\nname = \"held\"\ntype = \"reaction\"\nof = \"shoulder\"\n\
                [[sensor]]\nname = \"pull\"\ntype = \"reaction\"\nof = \"string\"\n\
                [[sensor]]\nname = \"felt\"\ntype = \"imu\"\nof = \"lower\"\npoint = [\"= 0.1*length\", 0.0, 0.1]\n\
                [[sensor]]\nname = \"slides\"\ntype = \"joint_acceleration\"\nof = \"slide\"\n";
    let value = "value = \"0.1*held.fx*felt.az + k*slides*pull.tension + c*slide.rate*held.mx\"\n";
    compare_both(&format!("{FORCES}{more}"), &[("expression", "", value, &[""])]);
    compare_both(&format!("{}{OF_LOOP}", without_objectives(LINKAGE)), &LOOP_EXPRESSION);
    let galerkin = by(&without_objectives(LINKAGE), "method = \"galerkin\"\norder = 4\n");
    compare_both(&format!("{galerkin}{OF_LOOP}"), &LOOP_EXPRESSION);
}

/// Sensors of a closed loop.
const OF_LOOP: &str = "[[sensor]]\nname = \"held\"\ntype = \"reaction\"\nof = \"cut\"\n\
                       [[sensor]]\nname = \"turns\"\ntype = \"joint_acceleration\"\nof = \"pin\"\n";

/// An expression of both.
const LOOP_EXPRESSION: [(&str, &str, &str, &[&str]); 1] =
    [("expression", "", "value = \"0.1*held.fx*turns + 0.03*turns^2 + 0.2*held.fy\"\n", &[""])];

/// By the length of all steps at a fixed number of them, backward and forward, against runs with
/// other steps.
#[test]
fn forces_by_the_time_step_agree_with_differences() {
    let linkage = without_controls(&without_objectives(LINKAGE));
    let galerkin = "method = \"galerkin\"\norder = 4\n";
    let cut = "type = \"reaction\"\nof = \"cut\"\n";
    let other = "type = \"reaction\"\nof = \"other\"\n";
    let tether = "type = \"effort\"\nof = \"tether\"\n";
    let both = "value = \"0.1*held.fx + 0.05*turns\"\n";
    let mut worst = 0.0_f64;
    for (text, sensor, part, steps) in [
        (&linkage, cut, "fx", ""),
        (&linkage, cut, "fx", galerkin),
        (&HELD.to_owned(), other, "fx", ""),
        (&HELD.to_owned(), tether, "effort", ""),
        (&HELD.to_owned(), tether, "effort", galerkin),
        (&linkage, "type = \"joint_acceleration\"\nof = \"pin\"\n", "", ""),
        (&format!("{linkage}{OF_LOOP}"), &format!("type = \"expression\"\n{both}"), "", ""),
    ] {
        for at in ["", PATH] {
            let text = sensing(&by(text, steps), sensor, part, at);
            let source = ModelText::from_text(Path::new("model.toml"), text);
            let model = source.model(&[]).unwrap();
            let mut prepared =
                Prepared::new(&model, &[], &[], &ExternalActions::default()).unwrap();
            let (controls, objective) = (&prepared.controls, &prepared.costs.sum);
            let (steps, checkpoints) = (prepared.steps, Checkpoints::All);
            let task =
                Task { steps, objective, controls, design: None, by_step: true, checkpoints };
            let run = prepared.simulation.integrator();
            let start = run.state().clone();
            let found = Gradient::of(run, &task).unwrap().step.unwrap();
            run.place_at(&start);
            let n = start.q.len();
            let still = vi_constraints::linearization::Tangent::zero(n, start.internal.len());
            let direction = Direction { start: still, step: true, ..Direction::default() };
            let beside = Beside { controls, design: None, objective };
            let h = model.settings.step;
            let mut forward = Sensitivities::new(run, h, vec![direction]).unwrap();
            for _ in 0..steps {
                forward.advance(run, beside).unwrap();
            }
            forward.add_forces(run, beside, true).unwrap();
            let forward = forward.rates(beside, run.state())[0];
            let value = |h: f64| {
                let mut model = model.clone();
                (model.settings.step, model.settings.end) = (h, h * steps as f64);
                let mut own = Prepared::new(&model, &[], &[], &ExternalActions::default()).unwrap();
                own.value().unwrap()
            };
            let central = |e: f64| (value(h + e * h) - value(h - e * h)) / (2.0 * e * h);
            let (long, short) = (central(1e-3), central(5e-4));
            let wanted = (4.0 * short - long) / 3.0;
            let off = (found - wanted).abs() / wanted.abs();
            println!(
                "{sensor}{part} {at}: {found:e}, off by {off:.1e}, forward {:.1e}",
                (forward / found - 1.0).abs()
            );
            worst = worst.max(off);
            assert!((forward - found).abs() < 1e-11 * found.abs(), "{forward:e} for {found:e}");
        }
    }
    assert!(worst < 1e-8, "{worst:e}");
}

/// The same bits with everything recorded and with checkpoints; the cost of a gradient beside that
/// of a run is printed.
#[test]
fn gradients_of_forces_have_the_same_bits_with_checkpoints() {
    let cut = "type = \"reaction\"\nof = \"cut\"\n";
    let pin = "type = \"joint_acceleration\"\nof = \"pin\"\n";
    let done = "type = \"work\"\nof = \"pin\"\n";
    let both = format!("type = \"expression\"\n{}", LOOP_EXPRESSION[0].2);
    let all = [(cut, "fx", true), (pin, "", true), (&both, "", true), (done, "damper", false)];
    for (sensor, part, by_step) in all {
        let text = format!("{}{OF_LOOP}", without_objectives(LINKAGE));
        let text = sensing(&text, sensor, part, PATH);
        same_bits_with_checkpoints(&text, by_step);
    }
}

pub(super) fn same_bits_with_checkpoints(text: &str, by_step: bool) {
    let source = ModelText::from_text(Path::new("model.toml"), text);
    let model = source.model(&[]).unwrap();
    let mut all = Vec::new();
    for checkpoints in
        [Checkpoints::All, Checkpoints::Every(1), Checkpoints::Every(7), Checkpoints::Memory(9000)]
    {
        let mut prepared = Prepared::new(&model, &[], &[], &ExternalActions::default()).unwrap();
        let tangents = Wanted::everything();
        let tangents = tangents.tangents((&source, &[], &model), &prepared.system).unwrap();
        prepared.depend(&[], &super::Prices::default(), &tangents).unwrap();
        let begin = Begin::new(&mut prepared).unwrap();
        let design =
            crate::design::mechanism_design(&prepared.system, &begin.mass, &tangents).unwrap();
        let (controls, objective) = (&prepared.controls, &prepared.costs.sum);
        let (steps, design) = (prepared.steps, Some(&design as _));
        let task = Task { steps, objective, controls, design, by_step, checkpoints };
        let run = prepared.simulation.integrator();
        let start = run.state().clone();
        all.push(Gradient::of(run, &task).unwrap());
        assert_eq!(run.state().step, start.step + steps as u64);
        let begin = std::time::Instant::now();
        run.place_at(&start);
        for _ in 0..steps {
            run.step_with(&mut |_, _, _| {}).unwrap();
        }
        let of_run = begin.elapsed();
        run.place_at(&start);
        let begin = std::time::Instant::now();
        Gradient::of(run, &task).unwrap();
        let ratio = begin.elapsed().as_secs_f64() / of_run.as_secs_f64();
        println!("{checkpoints:?}: {ratio:.1} runs");
    }
    assert!(all.iter().all(|own| own == &all[0]));
}

/// Second derivatives of a number at a node that moves, along any change, against differences of
/// order 4 of its slopes; relative to the largest entry.
fn bend_error(of: (&Model, &mut Prepared, &Begin), part: &str) -> f64 {
    let (model, prepared, begin) = of;
    let sensor = model.sensors.iter().find(|own| own.name == "seen").unwrap();
    let part = Some(part).filter(|part| !part.is_empty());
    let (rows, system) = (begin.rows(), &mut prepared.system);
    let shown = Shown::of((model, rows), system, "key", (sensor, part), &[]).unwrap();
    let number: Box<dyn NodeQuantity> = match shown {
        Shown::Configuration(own, MeasuredReading::Rate) => Box::new(RateOf(own)),
        Shown::Configuration(..) => panic!("of the configuration"),
        Shown::Node(own) => own,
    };
    let n = begin.q.len();
    let any =
        |seed: f64| -> Vec<f64> { (0..n).map(|i| (seed * (i * i + 1) as f64).sin()).collect() };
    let (v, changes) = (any(0.71), [any(0.37), any(0.23)]);
    let moved = |by: f64| -> [Vec<f64>; 2] {
        let each =
            |x: &[f64], change: &[f64]| x.iter().zip(change).map(|(x, d)| x + by * d).collect();
        [each(&begin.q, &changes[0]), each(&v, &changes[1])]
    };
    let slopes = |by: f64| {
        let [q, v] = moved(by);
        number.slopes_at(Node::moving(Motion::new(0.13, &q, &v))).concat()
    };
    let mut bend = [vec![0.0; n], vec![0.0; n]];
    let [q, of_v] = &mut bend;
    let at = Node::moving(Motion::new(0.13, &begin.q, &v));
    number.curved().unwrap().add_bend(at, [&changes[0], &changes[1]], 1.0, [q, of_v]);
    let e = 1e-4;
    let [one, back, far, beyond] = [e, -e, 2.0 * e, -2.0 * e].map(slopes);
    let found = bend.concat();
    let (mut worst, mut most) = (0.0_f64, 1e-3_f64);
    for (i, found) in found.iter().enumerate() {
        let wanted = (8.0 * (one[i] - back[i]) - (far[i] - beyond[i])) / (12.0 * e);
        (worst, most) = (worst.max((found - wanted).abs()), most.max(wanted.abs()));
    }
    worst / most
}

/// Of all numbers that optimal control can count.
#[test]
fn second_derivatives_of_numbers_agree_with_differences() {
    let mut worst: f64 = 0.0;
    let mut all: Vec<(&str, String, &[&str])> = Vec::new();
    let reading = format!("{FORCES}{READING}");
    for (kind, of, parts) in EFFORTS {
        let text = if ["soft", "follows"].contains(&of) { &reading } else { FORCES };
        all.push((text, format!("type = \"{kind}\"\nof = \"{of}\"\n"), parts));
    }
    all.push((BALLS, "type = \"joint_rate\"\nof = \"ball\"\n".to_owned(), TURNS[0].3));
    let imu = "type = \"imu\"\nof = \"lower\"\n";
    all.push((BALLS, imu.to_owned(), &["gx", "gy", "gz"]));
    for value in [
        "y.rate*sin(far) + far^3/(1 + slide^2)",
        "t*slide^2 - exp(-lower.wy)*lower.vz + hypot(lower.x, upper.z)",
    ] {
        let value = value.replace("y.rate", "shoulder.rate").replace("far", "shoulder");
        all.push((FORCES, format!("type = \"expression\"\nvalue = \"{value}\"\n"), &[""]));
    }
    for (text, sensor, parts) in all {
        for part in parts {
            let source =
                ModelText::from_text(Path::new("model.toml"), sensing(text, &sensor, part, ""));
            let model = source.model(&[]).unwrap_or_else(|error| panic!("{sensor}: {error}"));
            let mut prepared =
                Prepared::new(&model, &[], &[], &ExternalActions::default()).unwrap();
            let begin = Begin::new(&mut prepared).unwrap();
            let error = bend_error((&model, &mut prepared, &begin), part);
            println!("{part} of {}: {error:.1e}", sensor.replace('\n', " "));
            assert!(error < 1e-7, "{part} of {sensor}: {error:e}");
            worst = worst.max(error);
        }
    }
    println!("worst {worst:.1e}");
}
