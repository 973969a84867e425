//! Designs with answers that are known.

#![allow(clippy::float_cmp)] // what is exact

use super::{FoundOptimum, OptimizeFailure, SearchStatus, optimize};
use holonom_model::{ModelText, Override};
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

/// A pendulum of a point mass on a rod of a length, from rest at an angle.
const PENDULUM: &str = r#"
[model]
name = "pendulum"
gravity = [0.0, 0.0, -9.81]
[simulation]
step = 0.005
end = 1.0
[parameters]
length = 0.7
[[body]]
name = "bob"
mass = 1.0
inertia = [1e-6, 1e-6, 1e-6]
position = ["= length*sin(0.1)", 0.0, "= -length*cos(0.1)"]
[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "bob"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
[[sensor]]
name = "place"
type = "position"
of = "bob"
"#;

fn found(text: &str, overrides: &[Override]) -> Result<FoundOptimum, OptimizeFailure> {
    let text = ModelText::from_text(Path::new("model.toml"), text);
    let model = text.model(overrides)?;
    let watch: super::SearchWatch = Rc::new(RefCell::new(|_: &super::SearchProgress| true));
    optimize((&text, overrides, &model), None, None, &watch)
}

/// A quarter of a period of 2 s: the length of a seconds pendulum of finite amplitude,
/// `T = 2π√(l/g) (1 + α²/16 + 11 α⁴/3072)`, but for the step and the inertia of the bob.
#[test]
fn a_pendulum_gets_the_length_of_its_period() {
    let text = format!(
        "{PENDULUM}[[condition]]\nname = \"quarter\"\nsensor = \"place.x\"\nat = 0.5\nequals = 0.0\n\
         [optimize]\nparameters = {{ length = {{ min = 0.3, max = 1.5 }} }}\n"
    );
    let found = found(&text, &[]).unwrap();
    assert_eq!(found.report.status, SearchStatus::Optimal, "{:?}", found.report);
    let longer = 1.0 + 0.01 / 16.0 + 11.0 * 1e-4 / 3072.0;
    let length = 9.81 * (1.0 / std::f64::consts::PI / longer).powi(2);
    let value = found.report.parameters[0].value;
    assert!((value - length).abs() < 1e-4 * length, "{value} for {length}");
    assert!(found.report.conditions[0].violation < 1e-10);
    assert!(found.report.iterations < 12, "{}", found.report.iterations);
    assert!(found.model.optimize.is_none() && found.model.conditions.is_empty());
}

/// An objective and a condition: the price is the change of the cost with the bound.
#[test]
fn a_price_is_what_the_condition_costs() {
    let with = |bound: f64| {
        let text = format!(
            "{PENDULUM}[[objective]]\nname = \"low\"\ntype = \"sensor\"\nsensor = \"place.z\"\ntarget = -1.2\nweight = 3.0\n\
             [[objective]]\nname = \"duration\"\ntype = \"time\"\n\
             [[condition]]\nname = \"narrow\"\nsensor = \"place.x\"\nat = \"path\"\nmin = {bound:?}\n\
             [optimize]\nparameters = {{ length = {{ min = 0.3, max = 1.5 }} }}\n"
        );
        found(&text, &[]).unwrap().report
    };
    let own = with(-0.08);
    assert_eq!(own.status, SearchStatus::Optimal, "{own:?}");
    assert!((own.conditions[0].value + 0.08).abs() < 1e-9 && own.conditions[0].price > 0.0);
    let slope = (with(-0.0799).cost - with(-0.0801).cost) / 2e-4;
    let price = own.conditions[0].price;
    assert!((slope - price).abs() < 1e-3 * price, "{slope} for {price}");
    assert_eq!(own.terms[1].value, 1.0);
    assert!((own.cost - own.terms[0].value - 1.0).abs() < 1e-14);
}

/// Optima that several searches find are listed once each; the table of iterations has all.
#[test]
fn several_starts_are_told_by_where_they_led() {
    let text = PENDULUM
        .replace("end = 1.0", "end = 6.0")
        .replace("sin(0.1)", "sin(1.5)")
        .replace("cos(0.1)", "cos(1.5)")
        + "[[objective]]\nname = \"low\"\ntype = \"sensor\"\nsensor = \"place.x\"\ntarget = -3.0\n\
           [optimize]\nparameters = { length = { min = 0.2, max = 2.0 } }\nstarts = 6\n";
    let found = found(&text, &[]).unwrap();
    let starts = &found.report.starts;
    println!("{starts:?}");
    assert_eq!(starts.iter().map(|own| own.count).sum::<usize>(), 6);
    assert!((2..6).contains(&starts.len()) && starts.iter().any(|own| own.count > 1), "{starts:?}");
    let best = starts.iter().map(|own| own.cost).fold(f64::INFINITY, f64::min);
    assert!((found.report.cost - best).abs() < 1e-9 * best);
    let costs: Vec<f64> = starts.iter().map(|own| own.cost).collect();
    for (k, cost) in costs.iter().enumerate() {
        assert!(costs[..k].iter().all(|other| (other - cost).abs() > 1e-6 * cost), "{costs:?}");
    }
    let rows = found.iterations();
    for start in 1..=6 {
        assert!(rows.lines().any(|row| row.starts_with(&format!("{start},"))), "no row of {start}");
    }
    assert_eq!(rows.lines().filter(|row| row.split(',').nth(2) == Some("0")).count(), 6);
}

/// Conditions that no parameter meets are named, by how much they miss.
#[test]
fn what_a_design_misses_is_named() {
    let text = format!(
        "{PENDULUM}[[condition]]\nname = \"far\"\nsensor = \"place.x\"\nequals = 5.0\n\
         [[condition]]\nname = \"low\"\nsensor = \"place.z\"\nat = \"path\"\nmax = 1.0\n\
         [optimize]\nparameters = {{ length = {{ min = 0.3, max = 1.5 }} }}\n"
    );
    let report = found(&text, &[]).unwrap().report;
    assert_eq!(report.status, SearchStatus::Infeasible);
    let [far] = &report.missed[..] else { panic!("{:?}", report.missed) };
    assert_eq!(*far, format!("`far`: {:.1e}", report.conditions[0].violation));
}

/// A start outside of bounds along the path is refused where no parameter changes it, and is moved
/// within where one does.
#[test]
fn a_start_counts_along_the_path() {
    let with = |condition: &str| {
        let text = format!(
            "{PENDULUM}[[sensor]]\nname = \"rate\"\ntype = \"joint_rate\"\nof = \"hinge\"\n\
             [[condition]]\nname = \"path\"\nat = \"path\"\n{condition}\n\
             [optimize]\nparameters = {{ length = {{ min = 0.3, max = 1.5 }} }}\n"
        );
        found(&text, &[])
    };
    for (condition, begins) in [
        ("sensor = \"rate\"\nmin = 0.1", "`rate` begins with 0"),
        ("sensor = \"place.y\"\nmax = -1.0", "`place.y`"),
    ] {
        let error = with(condition).unwrap_err().to_string();
        assert!(error.contains("condition.path") && error.contains(begins), "{error}");
    }
    // the start, cos(0.1) times the length, is what is highest
    let found = with("sensor = \"place.z\"\nmax = -0.9").unwrap();
    assert_eq!(found.report.status, SearchStatus::Optimal, "{:?}", found.report);
    let length = found.report.parameters[0].value;
    assert!(length * 0.1_f64.cos() > 0.9 - 1e-9, "{length}");
}

/// Conditions and terms of rates are those of the rates that the run of the result shows.
#[test]
fn rates_are_what_a_run_shows() {
    let sensors = "[[sensor]]\nname = \"speed\"\ntype = \"velocity\"\nof = \"bob\"\n\
                   [[sensor]]\nname = \"rate\"\ntype = \"joint_rate\"\nof = \"hinge\"\n\
                   [[sensor]]\nname = \"spin\"\ntype = \"angular_velocity\"\nof = \"bob\"\n";
    let table = "[[body]]\nname = \"table\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\nposition = [1.0, 0.0, 0.0]\n\
                 velocity = [0.1, 0.0, 4.9]\nrotation_vector = [0.0, 0.3, 0.0]\nangular_velocity = [0.0, 0.0, 0.5]\n";
    let seen = |name: &str, kind: &str| {
        format!(
            "[[sensor]]\nname = \"{name}\"\ntype = \"{kind}\"\nof = \"bob\"\nseen_from = \"table\"\n"
        )
    };
    let sensors = &(sensors.to_owned()
        + table
        + &seen("place_seen", "position")
        + &seen("speed_seen", "velocity")
        + &seen("spin_seen", "angular_velocity"));
    let cases = [
        ("speed.x", -0.28),
        ("rate", 0.31),
        ("spin.y", 0.31),
        ("place_seen.z", -1e3),
        ("speed_seen.y", -1e3),
        ("spin_seen.y", 0.31),
    ];
    for (sensor, wanted) in cases {
        let bound = if wanted < -1.0 { "min" } else { "equals" }; // far away: read alone
        compare_with_run(sensors, sensor, (bound, wanted));
    }
}

/// Asks for a sensor at the time 0.5 and for a small one along the path: what is met and what it
/// costs are what the run of the result shows.
fn compare_with_run(more: &str, sensor: &str, (bound, wanted): (&str, f64)) {
    let text = format!(
        "{PENDULUM}{more}[[condition]]\nname = \"fast\"\nsensor = \"{sensor}\"\n{bound} = {wanted:?}\nat = 0.5\n\
         [[objective]]\nname = \"calm\"\ntype = \"sensor\"\nsensor = \"{sensor}\"\nat = \"path\"\n\
         [optimize]\nparameters = {{ length = {{ min = 0.3, max = 1.5 }} }}\n"
    );
    let found = found(&text, &[]).unwrap();
    assert_eq!(found.report.status, SearchStatus::Optimal, "{:?}", found.report);
    let columns = crate::sensor::columns(&found.model);
    let place = columns.iter().position(|own| own.name() == sensor).unwrap();
    let mut run = crate::simulation::Simulation::new(&found.model).unwrap();
    let samples = run.samples().map(|sample| sample.unwrap().sensors[place]);
    let shown: Vec<f64> = samples.collect();
    let squares = shown.windows(2).map(|pair| 0.25 * 0.005 * (pair[0].powi(2) + pair[1].powi(2)));
    let (cost, own) = (squares.sum::<f64>(), found.report.terms[0].value);
    println!("{sensor}: {} for {wanted}, cost {own} for {cost}", shown[100]);
    let read = found.report.conditions[0].value;
    assert!((shown[100] - read).abs() < 1e-9, "{sensor}: {read} for {}", shown[100]);
    assert!(bound != "equals" || (read - wanted).abs() < 1e-9, "{sensor}: {read}");
    assert!((cost - own).abs() < 1e-9 * cost, "{sensor}: {own} for {cost}");
}

/// The same of efforts and orientations: a bound on the tension of a spring.
#[test]
fn efforts_are_what_a_run_shows() {
    let more = "[[spring]]\nname = \"tie\"\nfrom = \"ground\"\nto = \"bob\"\npoint_from = [0.5, 0.0, 0.2]\n\
                stiffness = 3.0\nnatural_length = 0.4\ndamping = 0.2\n\
                [[sensor]]\nname = \"pull\"\ntype = \"effort\"\nof = \"tie\"\n\
                [[sensor]]\nname = \"turn\"\ntype = \"orientation\"\nof = \"bob\"\n";
    for (sensor, bound, wanted) in
        [("pull", "equals", 2.0), ("pull", "max", 1.8), ("turn.y", "equals", 0.03)]
    {
        compare_with_run(more, sensor, (bound, wanted));
    }
}

/// The same of reactions: a bound on what the hinge carries.
#[test]
fn reactions_are_what_a_run_shows() {
    let more =
        "[[sensor]]\nname = \"carries\"\ntype = \"reaction\"\nof = \"hinge\"\nframe = \"space\"\n";
    for (sensor, bound, wanted) in [("carries.fx", "equals", -0.2), ("carries.fx", "max", -0.1)] {
        compare_with_run(more, sensor, (bound, wanted));
    }
}

/// The same of accelerations: a bound on what the bob feels, and on the hinge's.
#[test]
fn accelerations_are_what_a_run_shows() {
    let more = "[[sensor]]\nname = \"felt\"\ntype = \"imu\"\nof = \"bob\"\n\
                [[sensor]]\nname = \"swings\"\ntype = \"joint_acceleration\"\nof = \"hinge\"\n";
    for (sensor, bound, wanted) in
        [("felt.az", "min", -1e3), ("felt.ax", "min", -1e3), ("swings", "equals", 0.1)]
    {
        compare_with_run(more, sensor, (bound, wanted));
    }
    // beside a reaction in one expression
    let held = "[[sensor]]\nname = \"held\"\ntype = \"reaction\"\nof = \"hinge\"\n\
                [[sensor]]\nname = \"both\"\ntype = \"expression\"\nvalue = \"0.1*held.fx*swings + swings\"\n";
    compare_with_run(&format!("{more}{held}"), "both", ("min", -1e3));
}

/// A crane: a cart on a rail with a load on a rope, driven by a force of two values and a spring.
const CRANE: &str = r#"
model = { name = "crane", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.6 }
parameters = { length = 0.5, mass = 0.7, stiffness = 3.0, first = 2.0, second = 3.0 }
body = [{ name = "cart", mass = 1.0, inertia = [0.1, 0.1, 0.1], position = [0.0, 0.0, 0.0] }, { name = "load", mass = "= mass", inertia = [0.05, "= 0.02*length", 0.05], position = [0.0, 0.0, "= -length"] }]
joint = [{ name = "rail", type = "prismatic", parent = "ground", child = "cart", position = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0], spring = { stiffness = "= stiffness", rest = 0.3 } }, { name = "pin", type = "revolute", parent = "cart", child = "load", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0] }]
load = [{ name = "push", body = "cart", force = [1.0, 0.0, 0.0], history = { type = "table", times = [0.0, 0.3, 0.6], values = ["= first", 0.0, "= -second"] } }]
sensor = [{ name = "x", type = "joint_coordinate", of = "rail" }, { name = "angle", type = "joint_coordinate", of = "pin" }, { name = "rail_rate", type = "joint_rate", of = "rail" }, { name = "pin_rate", type = "joint_rate", of = "pin" }]
"#;

/// Momenta along the joints of a tree at the end as an objective beside a place: their sum of
/// squares is that of the gradient of the result, whose derivatives vanish along the parameters
/// within their bounds.
#[test]
fn momenta_at_the_end_become_least() {
    use crate::gradient::{Wanted, gradient};
    let counted = "objective = [{ name = \"still\", type = \"momentum\", weight = 0.7 }, { name = \"far\", type = \"sensor\", sensor = \"x\", target = 0.5, weight = 2.0 }]\n";
    let first = "first = { min = -30.0, max = 30.0 }";
    let pairs = [
        (first, "\"joint.pin.position.0\" = { min = -0.4, max = 0.4 }"),
        (first, "length = { min = 0.1, max = 4.0 }"),
        ("second = { min = -30.0, max = 30.0 }", "stiffness = { min = 0.1, max = 40.0 }"),
    ];
    let methods = ["", ", order = 4", ", order = 4, method = \"galerkin\""];
    for ((one, other), method) in pairs.into_iter().zip(methods) {
        let crane = CRANE.replace("end = 0.6", &format!("end = 0.6{method}"));
        let free = format!("optimize = {{ parameters = {{ {one}, {other} }} }}\n");
        let text = format!("{crane}{counted}{free}");
        let found = found(&text, &[]).unwrap();
        let report = &found.report;
        assert_eq!(report.status, SearchStatus::Optimal, "{report:?}");
        let set = |own: &super::ParameterFound| {
            Override::new(crate::design::key_of(&own.name), format!("{:?}", own.value))
        };
        let overrides: Vec<Override> = report.parameters.iter().map(set).collect();
        let text = ModelText::from_text(Path::new("model.toml"), &text);
        let model = text.model(&overrides).unwrap();
        let only = report.parameters.iter().map(|own| own.name.clone()).collect();
        let wanted = Wanted { only, initial: false, ..Wanted::everything() };
        let slope = gradient(&text, &overrides, &model, &wanted).unwrap();
        let apart = (slope.value - report.cost).abs() / report.cost;
        println!("crane{method}: cost {} apart {apart:.1e}", report.cost);
        assert!(apart < 1e-12, "{apart}");
        for (own, by) in report.parameters.iter().zip(&slope.parameters) {
            assert_eq!(own.name, by.name);
            println!("  {} = {}: slope {:.1e}", own.name, own.value, by.derivative);
            let inward = if own.value <= own.min { by.derivative } else { -by.derivative };
            let is_least = if own.at_bound { inward > 0.0 } else { inward.abs() < 1e-9 };
            assert!(is_least, "{own:?}: {}", by.derivative);
        }
        assert!(report.terms[0].value > 1e-3, "{:?}", report.terms);
    }
}

/// Rest by parameters alone: the two values of a force with which a crane stands still at the end,
/// as the rates of its run show; rest of one joint.
#[test]
fn a_crane_comes_to_rest() {
    let free = "optimize = { parameters = { first = { min = -9.0, max = 9.0 }, second = { min = -9.0, max = 9.0 } } }\n";
    let rest = |of: &str| {
        let stop = format!("condition = [{{ name = \"stop\", type = \"rest\"{of} }}]\n");
        let found = found(&format!("{CRANE}{stop}{free}"), &[]).unwrap();
        assert_eq!(found.report.status, SearchStatus::Optimal, "{:?}", found.report);
        let stop = &found.report.conditions[0];
        assert!(
            stop.violation < 1e-9 && stop.min == Some(0.0) && stop.max == Some(0.0),
            "{stop:?}"
        );
        let names: Vec<String> =
            crate::sensor::columns(&found.model).iter().map(|own| own.name()).collect();
        let mut run = crate::simulation::Simulation::new(&found.model).unwrap();
        let last = run.samples().last().unwrap().unwrap().sensors;
        ["angle", "rail_rate", "pin_rate"]
            .map(|name| last[names.iter().position(|own| own == name).unwrap()])
    };
    let [_, rail, pin] = rest("");
    println!("{rail:.1e} {pin:.1e}");
    assert!(rail.abs() < 1e-9 && pin.abs() < 1e-9, "{rail} {pin}");
    let [angle, rail, pin] = rest(", of = [\"pin\"]");
    let momentum = (0.01 + 0.7 * 0.25) * pin - 0.7 * 0.5 * angle.cos() * rail; // ∂T/∂φ̇
    println!("{rail:.1e} {pin:.1e}: {momentum:.1e}");
    assert!(rail.abs() > 1e-3 && momentum.abs() < 1e-9, "{rail}, {momentum}");
}

/// A ball on a turntable: what rolls has designs.
pub(super) const BALL: &str = r#"
model = { name = "ball", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.5, project_start = true }
parameters = { fast = 1.5, r = 0.1 }
body = [{ name = "ball", mass = 0.4, inertia = [0.0016, 0.0016, 0.0016], position = [0.3, 0.0, "= r"], velocity = ["= fast", 0.2, 0.0], angular_velocity = [0.0, "= fast/r", 0.0] }]
constraint = [{ name = "table", type = "rolling", body = "ball", radius = "= r", plane = { position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0], spin = 1.2 } }]
sensor = [{ name = "place", type = "position", of = "ball" }]
"#;

/// The speed with which a ball comes to a place on a turntable, as its run shows.
#[test]
fn what_rolls_has_designs() {
    let text = format!(
        "{BALL}condition = [{{ name = \"there\", sensor = \"place.x\", equals = 1.1 }}]\n\
         optimize = {{ parameters = {{ fast = {{ min = 0.5, max = 4.0 }} }} }}\n"
    );
    let found = found(&text, &[]).unwrap();
    assert_eq!(found.report.status, SearchStatus::Optimal, "{:?}", found.report);
    let mut run = crate::simulation::Simulation::new(&found.model).unwrap();
    let last = run.samples().last().unwrap().unwrap().sensors[0];
    println!("{last} with {:?}, {} iterations", found.report.parameters, found.report.iterations);
    assert!((last - 1.1).abs() < 1e-9, "{last}");
}

/// An arm of length 1 on a spring in equilibrium.
const HANGING: &str = r#"
[model]
name = "hanging"
gravity = [0.0, 0.0, -10.0]
[simulation]
step = 0.5
end = 1.0
scheme = "static"
[parameters]
stiffness = 20.0
mass = 1.0
[[body]]
name = "bob"
mass = "= mass"
inertia = [0.01, 0.01, 0.01]
position = [1.0, 0.0, 0.0]
[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "bob"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
spring = { stiffness = "= stiffness" }
[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "hinge"
[[sensor]]
name = "held"
type = "reaction"
of = "hinge"
frame = "space"
[[objective]]
name = "weight"
type = "sensor"
sensor = "held.fz"
target = 20.0
[[condition]]
name = "sag"
sensor = "angle"
equals = 0.3
[optimize]
parameters = { stiffness = { min = 1.0, max = 200.0 }, mass = { min = 0.5, max = 5.0 } }
"#;

/// The stiffness and the mass with which an arm hangs at an angle: `k φ = m g l cos φ`.
#[test]
fn an_equilibrium_gets_its_stiffness_and_its_mass() {
    let found = found(HANGING, &[]).unwrap();
    assert_eq!(found.report.status, SearchStatus::Optimal, "{:?}", found.report);
    let value = |name: &str| {
        found.report.parameters.iter().find(|own| own.name == name).map(|own| own.value).unwrap()
    };
    let (mass, stiffness) = (value("mass"), value("stiffness"));
    let exact = 20.0 * 0.3_f64.cos() / 0.3;
    println!("{mass} {stiffness} {exact}");
    assert!((mass - 2.0).abs() < 1e-8, "{mass}");
    assert!((stiffness - exact).abs() < 1e-7 * exact, "{stiffness} for {exact}");
    let path = HANGING.replace("equals = 0.3", "at = \"path\"\nequals = 0.3");
    let error = super::tests::found(&path, &[]).unwrap_err().to_string();
    assert!(error.contains("condition.sag.at") && error.contains("path of equilibria"), "{error}");
}

#[test]
fn what_cannot_be_is_said() {
    let condition =
        "[[condition]]\nname = \"quarter\"\nsensor = \"place.x\"\nat = 0.5\nequals = 0.0\n";
    let free = "[optimize]\nparameters = { length = { min = 0.3, max = 1.5 } }\n";
    let words = |text: &str| match found(&format!("{PENDULUM}{text}"), &[]) {
        Ok(found) => format!("{:?}", found.report.status),
        Err(error) => error.to_string(),
    };
    let one =
        |changed: &str, with: &str| words(&format!("{condition}{free}").replace(changed, with));
    assert!(one("equals = 0.0", "equals = 7.0").contains("Infeasible"));
    assert!(one("length = {", "size = {").contains("no number under"));
    assert!(one("min = 0.3", "min = 0.9").contains("outside of its bounds"));
    assert!(one("parameters", "time = { min = 0.5, max = 2.0 }\nparameters").contains("free"));
    let rest = one("sensor = \"place.x\"\nat = 0.5\nequals = 0.0", "type = \"rest\"");
    assert!(!rest.contains("condition"), "{rest}");
    let loose = "[[body]]\nname = \"loose\"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\nposition = [1.0, 0.0, 0.0]\n";
    let aim = "[[objective]]\nname = \"still\"\ntype = \"momentum\"\n";
    let error = words(&format!("{loose}{aim}{free}"));
    assert!(error.contains("objective.still.type") && error.contains("momenta along"), "{error}");
    let error =
        words(&format!("{}{free}", aim.replace("\"momentum\"", "\"momentum\"\nweight = -1.0")));
    assert!(error.contains("objective.still.weight") && error.contains("largest"), "{error}");
    assert!(one("at = 0.5", "at = 0.5012").contains("no node"));
    assert!(one("at = 0.5", "at = 1.5").contains("later than the end"));
    assert!(words(free).contains("without an aim"));
    assert!(words(condition).contains("nothing is free"));
    let idle = free.replace("length", "other");
    let text = format!("{condition}{idle}").replace("[optimize]", "[parameters.x]\n[optimize]");
    assert!(!words(&text).is_empty());
}

/// The angle of a throw that is largest in `x + z` after a given time: 45 degrees, whatever the
/// speed and the gravity, which the sum alone knows; a quarter of it along the path the same. A
/// square beside it pulls it aside to where both slopes cancel.
#[test]
fn a_value_becomes_largest() {
    let text = r#"
model = { name = "throw", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.02, end = 0.5 }
parameters = { angle = 0.3 }
particle = [{ name = "ball", mass = 0.4, position = [0.0, 0.0, 0.0], velocity = ["= 7*cos(angle)", 0.0, "= 7*sin(angle)"] }]
sensor = [{ name = "place", type = "position", of = "ball" }]
objective = [{ name = "far", type = "value", sensor = "place.x", weight = -1.0 }, { name = "high", type = "value", sensor = "place.z", weight = -1.0 }]
optimize = { parameters = { angle = { min = 0.0, max = 1.5 } } }
"#;
    let angle = |text: &str| {
        let own = found(text, &[]).unwrap();
        assert_eq!(own.report.status, SearchStatus::Optimal, "{:?}", own.report);
        (own.report.parameters[0].value, own.report)
    };
    let (value, report) = angle(text);
    println!("{value}, {} iterations", report.iterations);
    assert!((value - std::f64::consts::FRAC_PI_4).abs() < 1e-8, "{value}");
    let drop = 0.5 * 9.81 * 0.25;
    assert!((report.cost + 3.5 * std::f64::consts::SQRT_2 - drop).abs() < 1e-10, "{}", report.cost);
    assert!((report.terms[0].value + 3.5 * value.cos()).abs() < 1e-10);
    let path = text.replace("weight = -1.0 }", "weight = -0.25, at = \"path\" }");
    assert!((angle(&path).0 - std::f64::consts::FRAC_PI_4).abs() < 1e-8);
    let aside = "objective = [{ name = \"low\", type = \"sensor\", sensor = \"place.z\", target = 0.1, weight = 2.0 }, ";
    let (value, report) = angle(&text.replace("objective = [", aside));
    let (sin, cos) = value.sin_cos();
    let slope = 3.5 * sin - 3.5 * cos + 2.0 * (3.5 * sin - drop - 0.1) * 3.5 * cos;
    println!("{value}: slope {slope:.1e}, {} iterations", report.iterations);
    assert!(slope.abs() < 1e-7 && (value - std::f64::consts::FRAC_PI_4).abs() > 0.05);
}
