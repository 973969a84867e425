//! The program on a column: critical loads, their files, refusals.
#![allow(clippy::unwrap_used)] // a test

use std::f64::consts::PI;
use std::fs;
use std::path::PathBuf;

use crate::program::command::{code, holonom, pendulum_folder, words};
use serde_json::Value;

fn folder(case: &str) -> PathBuf {
    pendulum_folder("critical_loads", case)
}

/// A strut of `EI = 350 N m²` and `1400 N m²` under 1000 N at the end of the path.
const COLUMN: &str = r#"
[model]
name = "column"

[simulation]
step = 0.5
end = 2.0
scheme = "static"

[[beam]]
name = "strut"
points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
elements = 32
normal = [0.0, 0.0, 1.0]
section = { EA = 1e9, GA1 = 1e9, GA2 = 1e9, EI1 = 1400.0, EI2 = 350.0, GJ = 300.0, rhoA = 1.0, rhoI1 = 1e-4, rhoI2 = 1e-4 }
start = "clamped"

[[load]]
name = "press"
body = "strut.end"
force = [-1000.0, 0.0, 0.0]

[[load]]
name = "rest"
body = "strut.end"
force = [-200.0, 0.0, 0.0]
history = { type = "constant" }
"#;

#[test]
fn load_factors_are_those_of_euler_beside_a_constant_load() {
    let folder = folder("factors");
    fs::write(folder.join("column.toml"), COLUMN).unwrap();
    let output =
        holonom(&folder, &["modes", "column.toml", "--buckling", "-n", "3", "--json", "-o", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let factors: Vec<f64> = report["modes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|m| m["load_factor"].as_f64().unwrap())
        .collect();
    let euler = |ei: f64, k: f64| (k * k * PI * PI / 4.0 * ei - 200.0) / 1000.0;
    let exact = [euler(350.0, 1.0), euler(1400.0, 1.0), euler(350.0, 3.0)];
    println!("load factors {factors:?}, closed form {exact:?}");
    for (found, exact) in factors.iter().zip(exact) {
        assert!((found / exact - 1.0).abs() < 1e-4, "{found} against {exact}");
    }
    assert_eq!(report["buckling"]["end"], 2.0);
    assert!(report["buckling"]["reversed"].is_null(), "{}", report["buckling"]);
    let csv = fs::read_to_string(folder.join("out/buckling.csv")).unwrap();
    let mut rows = csv.lines();
    assert_eq!(rows.next(), Some("mode,load_factor,time,member,ux,uy,uz,rx,ry,rz"));
    // the tip moves by 1 m across, along the thin side
    let row = rows.find(|row| row.starts_with("1,") && row.contains(",strut.32,")).unwrap();
    let cells: Vec<&str> = row.split(',').collect();
    let number = |k: usize| cells[k].parse::<f64>().unwrap();
    assert!((number(1) - factors[0]).abs() < 1e-12 && (number(2) - 2.0 * factors[0]).abs() < 1e-12);
    assert!(number(4).abs() < 1e-9 && (number(5).hypot(number(6)) - 1.0).abs() < 1e-9, "{row}");
    assert!((number(7).hypot(number(8)).hypot(number(9)) - PI / 2.0).abs() < 0.01, "{row}");
    let page = fs::read_to_string(folder.join("out/buckling.html")).unwrap();
    assert!(page.contains("Critical loads") && page.contains("load factor"), "no table");
    assert!(folder.join("out/buckling/shape_03.svg").exists());
    assert_eq!(code(&folder, &["modes", "column.toml", "--buckling", "-o", "out"]), 2);
    // from half of the load on: the same critical load
    let half = ["modes", "column.toml", "--buckling", "--at", "static", "-n", "1", "--json"];
    let output =
        holonom(&folder, &[&half[..], &["--set", "load.press.force=[-400.0, 0.0, 0.0]"]].concat());
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let found = 400.0 * report["modes"][0]["load_factor"].as_f64().unwrap();
    assert!((found / (1000.0 * factors[0]) - 1.0).abs() < 1e-4, "{found}");
}

#[test]
fn states_without_critical_loads_say_why() {
    let folder = folder("refusals");
    let refused = |model: String, extra: &[&str], expected: [&str; 2]| {
        fs::write(folder.join("column.toml"), model).unwrap();
        let output =
            holonom(&folder, &[&["modes", "column.toml", "--buckling"][..], extra].concat());
        let text = words(&output);
        assert_eq!(output.status.code(), Some(1), "{text}");
        expected.iter().for_each(|word| assert!(text.contains(word), "{text}"));
    };
    let press = "force = [-1000.0, 0.0, 0.0]";
    let with = |line: &str| COLUMN.replace(press, line);
    let heavy = with("force = [-1500.0, 0.0, 0.0]");
    refused(heavy, &["--at", "static"], ["unstable already", "--at start"]);
    let constant = with("force = [-100.0, 0.0, 0.0]\nhistory = { type = \"constant\" }");
    refused(constant, &[], ["no load that changes", "[[load]]"]);
    refused(COLUMN.into(), &["--at", "rotation"], ["steady rotation", "--at start"]);
    let follower = with("force = [0.0, 0.0, -1000.0]\nframe = \"body\"");
    refused(follower, &[], ["no potential", "--at static"]);
}

/// The same strut under 1.5 times its critical load, 863.59 N.
fn overloaded(bifurcation: &str) -> String {
    let rest = &COLUMN[COLUMN.find("[[load]]\nname = \"rest\"").unwrap()..];
    let sensor = "[[sensor]]\nname = \"tip\"\ntype = \"position\"\nof = \"strut.end\"\n";
    let model = COLUMN.replace(rest, sensor).replace("-1000.0", "-1295.4");
    model
        .replace("end = 2.0", "end = 1.0")
        .replace("step = 0.5", &format!("step = 0.1\n{bifurcation}"))
}

#[test]
fn a_path_names_its_bifurcation_and_follows_the_branch_when_asked() {
    let folder = folder("branch");
    let run = |bifurcation: &str| -> (String, Value, Vec<f64>) {
        fs::write(folder.join("column.toml"), overloaded(bifurcation)).unwrap();
        let output = holonom(&folder, &["run", "column.toml", "-o", "out", "--force"]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        let summary = fs::read_to_string(folder.join("out/summary.json")).unwrap();
        let csv = fs::read_to_string(folder.join("out/sensors.csv")).unwrap();
        let last = csv.lines().last().unwrap().split(',').skip(2);
        let tip = last.map(|cell| cell.parse().unwrap()).collect();
        (words(&output), serde_json::from_str(&summary).unwrap(), tip)
    };
    let (text, summary, tip) = run("");
    assert!(text.contains("a bifurcation point is there") && text.contains("\"switch\""), "{text}");
    assert_eq!(summary["statics"]["lost_stability"]["point"], "bifurcation");
    assert!(summary["statics"]["switched"].is_null() && tip[2].abs() < 1e-6, "{tip:?}");
    for path in ["", "arc_length = true\n"] {
        let (text, summary, tip) = run(&format!("{path}bifurcation = \"switch\""));
        let at = summary["statics"]["switched"].as_f64().unwrap();
        println!("switched at t = {at}, tip {tip:?}");
        assert!(text.contains("goes on along the branch"), "{text}");
        assert!((at - 863.6 / 1295.4).abs() < 2e-3, "{at}");
        assert!((tip[0] - 0.3635).abs() < 2e-3 && (tip[2].abs() - 0.789).abs() < 2e-3, "{tip:?}");
        assert!(summary["statics"]["lost_stability"].is_null(), "{summary}");
    }
    let motion = overloaded("bifurcation = \"switch\"").replace("scheme = \"static\"", "");
    fs::write(folder.join("column.toml"), motion).unwrap();
    let output = holonom(&folder, &["check", "column.toml"]);
    assert_eq!(output.status.code(), Some(3), "{}", words(&output));
    assert!(words(&output).contains("no path of equilibria that bifurcates"), "{}", words(&output));
}

/// A wire of mean directors with `L/h = 10⁶`, whose bending is `10⁻¹²` of its extension.
#[test]
fn modes_below_round_off_are_called_so() {
    let folder = folder("round_off");
    let wire = COLUMN
        .replace("elements = 32", "elements = 10\nelement = \"mean_directors\"")
        .replace("EI1 = 1400.0, EI2 = 350.0, GJ = 300.0", "EI1 = 8e-5, EI2 = 8e-5, GJ = 6e-5");
    let wire = wire.split("[[load]]").next().unwrap();
    fs::write(folder.join("wire.toml"), wire).unwrap();
    let output = holonom(&folder, &["modes", "wire.toml"]);
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(table.contains("modes below round-off: less than"), "{}{table}", words(&output));
    assert!(words(&output).contains("are not told from"), "{}", words(&output));
}
