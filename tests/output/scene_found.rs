//! Pages of what was looked for, in a real browser: designs, optimal controls, estimates.
#![allow(clippy::unwrap_used)] // a test

use crate::output::browser::{Shown, browser, show, with_keys};
use crate::program::command::{command, folder};
use std::fs;
use std::path::{Path, PathBuf};

/// The folder in which the program has found something.
fn found(case: &str, files: &[(&str, &str)], arguments: &[&str]) -> PathBuf {
    let folder = folder("scene", case);
    files.iter().for_each(|(name, text)| fs::write(folder.join(name), text).unwrap());
    let mut command = command(&folder, arguments);
    let output = command.args(["-o", ".", "--force", "--quiet"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    folder
}

/// The page at a time, without messages of the console; it fits windows of any width.
fn shown(browser: &str, page: &Path, t: &str) -> Shown {
    let keys = with_keys(page, &["2"]);
    for size in [[390, 800], [1100, 900], [3840, 2160]] {
        let shown = show(browser, &keys, t, size);
        assert_eq!(shown.console, Vec::<String>::new());
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
        assert_eq!(shown.attribute("view"), "front");
    }
    let shown = show(browser, page, t, [1100, 1000]);
    assert_eq!(shown.console, Vec::<String>::new());
    shown
}

/// The text of the cells of a table below a heading, row by row.
fn cells(shown: &Shown, id: &str) -> Vec<Vec<String>> {
    let below = shown.document.split(&format!("<h2 id=\"{id}\">")).nth(1).expect(id);
    let table = below.split("<table").nth(1).unwrap().split("</table>").next().unwrap();
    let text = |cell: &str| cell.split('>').nth(1).unwrap().split('<').next().unwrap().to_owned();
    let row = |row: &str| row.split("<td").skip(1).map(text).collect();
    table.split("<tr").skip(1).map(row).filter(|row: &Vec<String>| !row.is_empty()).collect()
}

const CLOCK: &str = r#"
parameters = { length = 0.7 }
model = { name = "clock", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 1.0 }
body = [{ name = "bob", mass = 1.0, inertia = [1e-3, 1e-3, 1e-3], position = ["= length", 0.0, 0.0] }]
joint = [{ name = "hinge", type = "revolute", parent = "ground", child = "bob", position = [0.0, 0.0, 0.0], axis = [0.0, 1.0, 0.0] }]
sensor = [{ name = "place", type = "position", of = "bob" }]
condition = [{ name = "down", sensor = "place.x", at = 0.5, equals = 0.0 }]
optimize = { parameters = { length = { min = 0.2, max = 2.0 } } }
"#;

/// At the time of its condition the bob is below the hinge, in the scene as well.
#[test]
fn a_design_is_shown_with_its_motion() {
    let Some(browser) = browser() else { return };
    let folder = found("design", &[("clock.toml", CLOCK)], &["optimize", "clock.toml"]);
    let page = folder.join("optimum.html");
    let shown = shown(browser, &page, "t=0.5&view=front");
    let [x, _] = shown.member("bob");
    let [begins, _] = show(browser, &page, "t=0&view=front", [1100, 1000]).member("bob");
    println!("the bob at {x} px, at the start at {begins} px");
    assert!(begins - x > 100.0, "it swings from the right to the middle");
    let rows = cells(&shown, "parameters");
    assert_eq!((rows.len(), rows[0][0].as_str(), rows[0][1].as_str()), (1, "length", "0.7"));
    let rows = cells(&shown, "conditions");
    assert_eq!((rows.len(), rows[0][0].as_str()), (1, "down"));
}

/// Controls over time have the cursor of the scene; conditions are listed, rest by its joint.
#[cfg(feature = "optimize")]
#[test]
fn controls_are_shown_with_their_motion() {
    let Some(browser) = browser() else { return };
    let model = crate::output::browser::shipped("optimum_pendulum.toml");
    let text = fs::read_to_string(model).unwrap();
    let folder = found("controls", &[("m.toml", &text)], &["optimize", "m.toml"]);
    let page = folder.join("optimum.html");
    let shown = shown(browser, &page, "t=1.5&view=front");
    crate::output::browser::assert_marked(&shown, 1.5, 1);
    let [_, hangs] = show(browser, &page, "t=0&view=front", [1100, 1000]).member("rod");
    let [_, stands] = show(browser, &page, "t=2&view=front", [1100, 1000]).member("rod");
    println!("the rod from {hangs} to {stands} px");
    assert!(hangs - stands > 100.0, "it swings up");
    let rows = cells(&shown, "conditions");
    let names: Vec<&str> = rows.iter().map(|row| row[0].as_str()).collect();
    assert_eq!(names, ["upright", "stop of hinge"]);
    assert_eq!(cells(&shown, "controls")[0][0], "torque");
}

/// Data over the model, residuals and a table, without a scene.
#[test]
fn an_estimate_is_shown_with_its_data() {
    let Some(browser) = browser() else { return };
    let model = include_str!("../../examples/models/friction_pendulum.toml");
    let data = include_str!("../../examples/models/friction_pendulum.csv");
    let files = [("m.toml", model), ("d.csv", data)];
    let folder = found("estimate", &files, &["identify", "m.toml", "d.csv"]);
    let html = fs::read_to_string(folder.join("estimate.html")).unwrap();
    let estimate = fs::read(folder.join("estimate.json")).unwrap();
    let estimate: serde_json::Value = serde_json::from_slice(&estimate).unwrap();
    let figures = (2 * estimate["columns"].as_array().unwrap().len()).to_string();
    let script = "<script>const seen = [...document.querySelectorAll('figure svg')].filter((svg) => \
                  getComputedStyle(svg).display !== 'none'); Object.assign(document.body.dataset, { overflow: \
                  document.documentElement.scrollWidth - innerWidth, charts: seen.length, \
                  figures: document.querySelectorAll('figure').length });</script></body>";
    let probed = folder.join("probed.html");
    fs::write(&probed, html.replace("</body>", script)).unwrap();
    for size in [[390, 800], [1100, 900], [3840, 2160]] {
        let shown = show(browser, &probed, "", size);
        assert_eq!(shown.console, Vec::<String>::new());
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
        assert_eq!(shown.attribute("charts"), shown.attribute("figures"), "each chart once");
        assert_eq!(shown.attribute("figures"), figures, "data over the model, and residuals");
        for name in ["centre", "damping", "hinge.coordinate", "hinge.rate"] {
            assert!(shown.document.contains(&format!("<td>{name}</td>")), "{name}");
        }
    }
}
