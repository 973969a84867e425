//! `optimize` from outside: files, exit codes, the run of the result.

use std::fs;
use std::path::Path;

use crate::program::command::{code, files, folder, holonom, words};
use serde_json::Value;

const PENDULUM: &str = r#"
parameters = { length = 0.7 }
model = { name = "clock", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 1.0 }
body = [{ name = "bob", mass = 1.0, inertia = [1e-3, 1e-3, 1e-3], position = ["= length", 0.0, 0.0] }]
joint = [{ name = "hinge", type = "revolute", parent = "ground", child = "bob", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0] }]
sensor = [{ name = "place", type = "position", of = "bob" }, { name = "angle", type = "joint_coordinate", of = "hinge" }]
"#;
const DESIGN: &str = r#"
condition = [{ name = "down", sensor = "place.x", at = 0.5, equals = 0.0 }]
optimize = { parameters = { length = { min = 0.2, max = 2.0 } } }
"#;
const CONTROL: &str = r#"
control = [{ name = "torque", joint = "hinge" }]
objective = [{ name = "cheap", type = "effort" }]
condition = [{ name = "up", sensor = "angle", equals = -1.0 }, { name = "stop", type = "rest" }]
"#;

fn written(case: &str, more: &str) -> std::path::PathBuf {
    let folder = folder("optima", case);
    fs::write(folder.join("clock.toml"), format!("{PENDULUM}{more}")).unwrap();
    folder
}

fn optimum(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("clock-optimum/optimum.json")).unwrap()).unwrap()
}

/// The run of `model.toml` is the one in the folder, byte for byte.
fn is_repeated(folder: &Path) {
    let again = ["run", "clock-optimum/model.toml", "-o", "again", "-q", "--force"];
    assert_eq!(code(folder, &again), 0);
    for file in ["trajectory.csv", "sensors.csv", "energy.csv", "residuals.csv"] {
        let [own, again] =
            ["clock-optimum", "again"].map(|name| fs::read(folder.join(name).join(file)).unwrap());
        assert!(own == again, "{file} differs");
    }
}

#[test]
fn a_design_is_written_as_the_run_of_its_model() {
    let folder = written("design", DESIGN);
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 0);
    let found = optimum(&folder);
    assert_eq!(found["status"], "optimal");
    let names = files(&folder.join("clock-optimum"));
    for name in [
        "optimum.json",
        "optimum.html",
        "iterations.csv",
        "model.toml",
        "summary.json",
        "report.html",
    ] {
        assert!(names.contains(name), "{name} in {names:?}");
    }
    assert!(!names.contains("controls.csv"));
    let page = fs::read_to_string(folder.join("clock-optimum/optimum.html")).unwrap();
    assert!(page.contains("id=\"scene\"") && page.contains("id=\"parameters\""), "its page");
    is_repeated(&folder);
    let length = found["parameters"][0]["value"].as_f64().unwrap();
    let sensors = fs::read_to_string(folder.join("clock-optimum/sensors.csv")).unwrap();
    let row: Vec<&str> = sensors.lines().nth(51).unwrap().split(',').collect();
    let x: f64 = row[2].parse().unwrap();
    assert_eq!(row[1], "0.5");
    assert!(x.abs() < 1e-9 && length > 0.2 && length < 2.0, "{x} {length}");
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 2, "nothing is overwritten");
    let json = holonom(&folder, &["optimize", "clock.toml", "--force", "--json"]);
    assert_eq!(serde_json::from_slice::<Value>(&json.stdout).unwrap(), found);
    assert_eq!(code(&folder, &["run", "clock.toml", "-q"]), 0, "a run does without the sections");
}

#[test]
fn what_is_no_optimum_ends_with_1_and_says_so() {
    let folder = written("infeasible", &DESIGN.replace("equals = 0.0", "equals = 5.0"));
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 1);
    assert_eq!(optimum(&folder)["status"], "infeasible");
    let few = DESIGN.replace("optimize = {", "optimize = { max_iterations = 1,");
    let folder = written("few", &few);
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 1);
    assert_eq!(optimum(&folder)["status"], "unfinished");
    let idle = DESIGN.replace("length = {", "width = {");
    assert_eq!(code(&written("idle", &idle), &["optimize", "clock.toml"]), 3);
    assert_eq!(code(&written("nothing", ""), &["optimize", "clock.toml"]), 3);
}

/// A search that made as many iterations as it may goes on in its folder until it has found its
/// optimum, which it says then.
fn goes_on(folder: &Path, whole: &Value) {
    let rows = |folder: &Path| {
        let text = fs::read_to_string(folder.join("clock-optimum/iterations.csv")).unwrap();
        assert_eq!(text.lines().filter(|line| line.starts_with("start,")).count(), 1);
        text.lines().count()
    };
    assert!(folder.join("clock-optimum/search.json").is_file());
    let mut before = rows(folder);
    let mut ended = 1;
    for _ in 0..40 {
        let done = holonom(folder, &["resume", "clock-optimum", "--json"]);
        ended = done.status.code().unwrap();
        let found: Value = serde_json::from_slice(&done.stdout).unwrap();
        assert_eq!(found, optimum(folder), "{}", words(&done));
        assert!(words(&done).contains("goes on from where it ended"), "{}", words(&done));
        assert!(rows(folder) > before, "iterations are added");
        before = rows(folder);
        if ended == 0 {
            break;
        }
        assert_eq!((ended, &found["status"]), (1, &"unfinished".into()), "{}", words(&done));
    }
    let found = optimum(folder);
    assert_eq!((ended, &found["status"]), (0, &"optimal".into()));
    assert!(!folder.join("clock-optimum/search.json").exists());
    let number = |of: &Value| of["cost"].as_f64().unwrap();
    let off = (number(&found) - number(whole)).abs();
    assert!(off <= 1e-8 * number(whole), "{} for {}", number(&found), number(whole));
    for (own, wanted) in [("parameters", "value"), ("controls", "largest")] {
        let all = |of: &Value| of[own].as_array().unwrap().clone();
        for (own, wanted_of) in all(&found).iter().zip(&all(whole)) {
            let [a, b] = [own, wanted_of].map(|own| own[wanted].as_f64().unwrap());
            assert!((a - b).abs() < 1e-6 * b.abs(), "{a} for {b}");
        }
    }
    is_repeated(folder);
    let done = holonom(folder, &["resume", "clock-optimum"]);
    assert_eq!(done.status.code(), Some(0));
    assert!(words(&done).contains("the optimum is found already"), "{}", words(&done));
}

#[test]
fn a_design_goes_on_in_its_folder() {
    let folder = written("resume_design", DESIGN);
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 0);
    let whole = optimum(&folder);
    let few = ["optimize", "clock.toml", "--force", "--set", "optimize.max_iterations=2"];
    let done = holonom(&folder, &few);
    assert_eq!(done.status.code(), Some(1), "{}", words(&done));
    assert!(words(&done).contains("holonom resume clock-optimum"), "{}", words(&done));
    // as it was asked for, whatever the file says now
    fs::write(folder.join("clock.toml"), "").unwrap();
    goes_on(&folder, &whole);
    fs::write(folder.join("clock-optimum/optimum.json"), "{ \"status\": \"stopped\" }").unwrap();
    let done = holonom(&folder, &["resume", "clock-optimum"]);
    assert_eq!(done.status.code(), Some(2));
    assert!(words(&done).contains("search.json"), "{}", words(&done));
}

#[cfg(feature = "optimize")]
#[test]
fn controls_go_on_in_their_folder() {
    let timed = "optimize = { time = { min = 0.5, max = 3.0, guess = 2.0 }";
    let control = CONTROL.replace("equals = -1.0", "equals = 2.2");
    let soon = control.replace(
        "type = \"effort\" }",
        "type = \"effort\" }, { name = \"soon\", type = \"time\", weight = 3.0 }",
    );
    for (case, refine) in [("whole", 0), ("refined", 2)] {
        let more = format!("{soon}{timed}, refine = {refine} }}");
        let folder = written(&format!("resume_{case}"), &more);
        assert_eq!(code(&folder, &["optimize", "clock.toml"]), 0);
        let whole = optimum(&folder);
        let few = ["optimize", "clock.toml", "--force", "--set", "optimize.max_iterations=5"];
        let done = holonom(&folder, &few);
        assert_eq!(done.status.code(), Some(1), "{}", words(&done));
        goes_on(&folder, &whole);
        let [a, b] = [&optimum(&folder), &whole].map(|own| own["time"].as_f64().unwrap());
        assert!((a - b).abs() < 1e-6, "{a} for {b}");
    }
}

#[cfg(not(feature = "optimize"))]
#[test]
fn controls_need_a_method_that_is_named() {
    let folder = written("no_method", CONTROL);
    let output = holonom(&folder, &["optimize", "clock.toml"]);
    assert_eq!(output.status.code(), Some(3));
    let text = words(&output);
    assert!(text.contains("control") && text.contains("--features optimize"), "{text}");
}

#[cfg(feature = "optimize")]
#[test]
fn optimal_efforts_are_repeated_bit_for_bit() {
    let folder = written("control", CONTROL);
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 0);
    let found = optimum(&folder);
    assert_eq!((&found["status"], &found["sufficient"]), (&"optimal".into(), &true.into()));
    let controls = fs::read_to_string(folder.join("clock-optimum/controls.csv")).unwrap();
    assert_eq!((controls.lines().next(), controls.lines().count()), (Some("t_mid,torque"), 101));
    is_repeated(&folder);
    // from there again: at once
    let more = format!("{CONTROL}optimize = {{ guess = \"clock-optimum\", refine = 0 }}");
    fs::write(folder.join("again.toml"), format!("{PENDULUM}{more}")).unwrap();
    let again = holonom(&folder, &["optimize", "again.toml", "--json"]);
    let again: Value = serde_json::from_slice(&again.stdout).unwrap();
    let [a, b] = [&found, &again].map(|own| own["cost"].as_f64().unwrap());
    assert!((a - b).abs() < 1e-8 * a, "{a} {b}");
}

/// By methods of higher order: files have rows for whole steps, the run of `model.toml` is by the
/// same method, and an optimum of order 2 is where another search may begin.
#[cfg(feature = "optimize")]
#[test]
fn optima_of_higher_order_are_repeated_bit_for_bit() {
    let folder = written("higher", CONTROL);
    assert_eq!(code(&folder, &["optimize", "clock.toml"]), 0);
    let second = optimum(&folder)["cost"].as_f64().unwrap();
    assert_eq!(code(&folder, &["run", "clock.toml", "-o", "plain", "-q"]), 0);
    fs::rename(folder.join("clock-optimum"), folder.join("second")).unwrap();
    for set in [["order=4", "method=composition"], ["order=4", "method=galerkin"]] {
        for guess in ["line", "run", "second"] {
            let [order, method] = set.map(|own| format!("simulation.{own}"));
            let guess = format!("optimize.guess={guess}");
            let words_of = ["optimize", "clock.toml", "--force", "--set", &order, "--set", &method];
            let words_of = [&words_of[..], &["--set", &guess]].concat();
            let output = holonom(&folder, &words_of);
            assert_eq!(output.status.code(), Some(0), "{}", words(&output));
            let found = optimum(&folder);
            assert_eq!((&found["status"], &found["sufficient"]), (&"optimal".into(), &true.into()));
            let cost = found["cost"].as_f64().unwrap();
            println!("{set:?}, {guess}: {cost}, of order 2 {second}");
            assert!((cost - second).abs() < 1e-2 * second && (cost - second).abs() > 1e-6 * second);
            for file in ["controls.csv", "costates.csv"] {
                let text = fs::read_to_string(folder.join("clock-optimum").join(file)).unwrap();
                assert_eq!(text.lines().count(), 101, "{file}");
            }
            let model = fs::read_to_string(folder.join("clock-optimum/model.toml")).unwrap();
            assert!(model.contains("order = 4") && model.contains("type = \"steps\""), "{model}");
            is_repeated(&folder);
        }
    }
}

/// The cost of a reference case with so many steps.
#[cfg(feature = "optimize")]
fn stored_cost(case: &str, steps: u64) -> f64 {
    let path = format!("{}/../../tests/reference/control/{case}.json", env!("CARGO_MANIFEST_DIR"));
    let case: Value = serde_json::from_slice(&fs::read(path).unwrap()).unwrap();
    let all = case["results"]["convergence"].as_array().unwrap();
    let own = all.iter().find(|own| own["steps"] == steps);
    own.unwrap_or_else(|| panic!("no cost at {steps} steps"))["cost"].as_f64().unwrap()
}

/// Every shipped model with controls: its optimum, the cost of each refinement that a reference
/// case has, and the run of the result, bit for bit.
#[cfg(feature = "optimize")]
#[test]
fn shipped_optima_are_found_from_their_own_guess() {
    let cases = [
        ("optimum_pendulum", Some("oc01_pendulum_swing_up"), 3),
        ("optimum_cart_pole", Some("oc02_cart_pole_swing_up"), 3),
        ("optimum_satellite", Some("oc06_satellite_three_wheels"), 3),
        ("optimum_four_bar", Some("oc07_four_bar_to_rest"), 3),
        ("optimum_six_bodies", Some("oc08_six_r_to_rest"), 2),
        ("optimum_arm", None, 0),
    ];
    let folder = folder("optima", "shipped");
    let listed = holonom(&folder, &["examples"]);
    let listed = String::from_utf8(listed.stdout).unwrap();
    let shipped = listed.lines().filter(|line| line.starts_with("optimum_")).count();
    assert_eq!(shipped, cases.len());
    for (name, case, stored) in cases {
        assert_eq!(code(&folder, &["examples", name, "-o", "clock.toml", "--force"]), 0);
        let done = holonom(&folder, &["optimize", "clock.toml", "--force", "--json"]);
        assert_eq!(done.status.code(), Some(0), "{name}: {}", words(&done));
        let found: Value = serde_json::from_slice(&done.stdout).unwrap();
        assert_eq!(
            (&found["status"], &found["sufficient"]),
            (&"optimal".into(), &true.into()),
            "{name}"
        );
        let refined = found["refinements"].as_array().unwrap();
        for own in refined.iter().rev().take(stored) {
            let [steps, cost] = ["steps", "cost"].map(|key| own[key].as_f64().unwrap());
            let wanted = stored_cost(case.unwrap(), steps as u64);
            assert!((cost - wanted).abs() < 1e-8 * wanted, "{name}: {cost} for {wanted}");
        }
        for met in found["conditions"].as_array().unwrap() {
            assert!(met["violation"].as_f64().unwrap() < 1e-12, "{name}: {met}");
        }
        if case.is_none() {
            is_bang_bang(&found);
        }
        is_repeated(&folder);
        assert_eq!(code(&folder, &["run", "clock.toml", "-o", "plain", "-q", "--force"]), 0);
    }
}

/// A quarter of a turn, stated by a component that is at its largest there: it has no first
/// derivative, which is said.
#[cfg(feature = "optimize")]
#[test]
fn a_condition_at_its_largest_value_is_named() {
    let folder = folder("optima", "steep");
    assert_eq!(code(&folder, &["examples", "optimum_satellite", "-o", "clock.toml"]), 0);
    let set = ["first_y.equals=0.0", "first_z.equals=1.0", "second_z.equals=0.0"];
    let set = set.map(|own| format!("condition.{own}"));
    let mut words_of = vec!["optimize", "clock.toml", "--force"];
    set.iter().for_each(|own| words_of.extend(["--set", own]));
    let done = holonom(&folder, &words_of);
    let said = words(&done);
    assert_eq!(done.status.code(), Some(1), "{said}");
    assert!(said.contains("`first_z` grows without bound"), "{said}");
    // another component states the same attitude
    let last = words_of.len() - 3;
    words_of[last] = "condition.first_z.sensor=first.x";
    words_of.extend(["--set", "condition.first_z.equals=0.0"]);
    let done = holonom(&folder, &words_of);
    assert_eq!(done.status.code(), Some(0), "{}", words(&done));
}

/// What a search wants of step and end does not hold for a plain run.
#[test]
fn a_run_ends_outside_of_the_bounds_of_a_search() {
    let folder = folder("optima", "short");
    assert_eq!(code(&folder, &["examples", "optimum_arm", "-o", "arm.toml"]), 0);
    let text = std::fs::read_to_string(folder.join("arm.toml")).unwrap();
    let (before, time) = text.split_once("\ntime = ").unwrap();
    let after = time.split_once('\n').map_or("", |rest| rest.1);
    std::fs::write(folder.join("timed.toml"), format!("{before}\n{after}")).unwrap();
    let free = ["arm.toml", "--set", "optimize.time={min=0.2,max=3.0}"];
    let at = ["timed.toml", "--set", "condition.end1.at=0.8"];
    let run = ["run", "-q", "--force", "-o", "out"];
    for (set, with) in [
        (&free, ["--end", "0.1"]),
        (&free, ["--end", "4.0"]),
        (&at, ["--end", "0.1"]),
        (&at, ["--step", "0.03"]),
    ] {
        let done = holonom(&folder, &[&run, &set[..], &with].concat());
        assert_eq!(done.status.code(), Some(0), "{set:?} {with:?}: {}", words(&done));
    }
    let guess = ["arm.toml", "--set", "optimize.time={min=0.2,max=3.0,guess=5.0}"];
    let done = holonom(&folder, &[&run[..], &guess].concat());
    assert_eq!(done.status.code(), Some(3), "{}", words(&done));
}

/// Two conditions, and the value of a control in a single step.
#[cfg(feature = "optimize")]
#[test]
fn more_conditions_than_values_are_named() {
    let folder = folder("optima", "one_step");
    assert_eq!(code(&folder, &["examples", "optimum_pendulum", "-o", "clock.toml"]), 0);
    let set = ["--set", "simulation.step=2.0"];
    let done = holonom(&folder, &[&["optimize", "clock.toml"], &set[..]].concat());
    assert_eq!(done.status.code(), Some(1));
    assert!(words(&done).contains("more than the controls have values"), "{}", words(&done));
    let few = ["--set", "optimize.max_iterations=2", "--force"];
    let done = holonom(&folder, &[&["optimize", "clock.toml"], &few[..]].concat());
    assert_eq!(done.status.code(), Some(1));
    assert!(words(&done).contains("`max_iterations` of [optimize] were made"), "{}", words(&done));
}

/// In the least time each torque is at a bound nearly always; fewer steps need more time.
#[cfg(feature = "optimize")]
fn is_bang_bang(found: &Value) {
    let steps = found["steps"].as_u64().unwrap();
    for control in found["controls"].as_array().unwrap() {
        assert!(10 * control["at_bounds"].as_u64().unwrap() > 8 * steps, "{control}");
    }
    let time = found["terms"][0]["value"].as_f64().unwrap();
    assert_eq!(found["terms"][0]["name"], "time");
    assert!(
        time > 0.99 * found["cost"].as_f64().unwrap() && (time - 0.4814).abs() < 1e-3,
        "{time}"
    );
}
