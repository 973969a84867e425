//! The order of the page of a run, what its colours say, and that it fits windows of any width.
#![allow(clippy::unwrap_used)] // a test

use crate::output::browser::{browser, run, show};
use crate::program::command::{command, folder};
use std::fs;

/// The page of a run of a shipped model.
fn page(case: &str, model: &str, set: &[&str]) -> String {
    fs::read_to_string(run(case, model, set).join("report.html")).unwrap()
}

#[test]
fn sensors_come_first_and_charts_of_the_scheme_are_folded() {
    let html = page("layout_order", "heavy_top_steady.toml", &["simulation.end=0.5"]);
    let place = |words: &str| html.find(words).unwrap_or_else(|| panic!("no {words}"));
    let order = ["sensors", "motion", "energy", "method", "numbers", "model"];
    let places = order.map(|id| place(&format!("id=\"{id}\"")));
    assert!(places.is_sorted(), "{places:?}");
    for id in order {
        assert!(html.contains(&format!("<a href=\"#{id}\">")), "a link to {id}");
    }
    let folded = html.split("<details id=\"method\">").nth(1).unwrap();
    let folded = folded.split("</details>").next().unwrap();
    for title in ["Constraint residuals", "Angular momentum", "Linear momentum"] {
        assert!(folded.contains(title), "{title}");
    }
    assert!(place("Sensor base") < place("Position of"), "sensors before positions");
}

/// A slide that begins with a velocity across it.
const WISH: &str = r#"
model = { name = "wish" }
simulation = { step = 0.01, end = 0.1, project_start = true }
body = [{ name = "sled", mass = 1, inertia = [0.1, 0.1, 0.1], velocity = [1, 0.5, 0] }]
joint = [{ name = "rail", type = "prismatic", parent = "ground", child = "sled", position = [0, 0, 0], axis = [1, 0, 0] }]
"#;

/// A wish that was granted is grey, a warning amber, a failure red.
#[test]
fn colours_say_how_bad_it_is() {
    let classes = |html: &str| {
        let has = |class: &str| html.contains(&format!("<p class=\"{class}\">"));
        [has("remark"), has("warning"), has("failed")]
    };
    let plain = page("layout_plain", "pendulum.toml", &["simulation.end=0.5"]);
    assert_eq!(classes(&plain), [false; 3]);
    let folder = folder("layout", "wish");
    fs::write(folder.join("wish.toml"), WISH).unwrap();
    let mut command = command(&folder, &["run"]);
    command.args(["wish.toml", "-o", "out", "--force"]);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let wish = fs::read_to_string(folder.join("out/report.html")).unwrap();
    assert_eq!(classes(&wish), [true, false, false], "the projected start");
}

/// Texts of charts on one line: where each begins and how wide it was measured.
fn overlaps(svg: &str) -> Vec<String> {
    let number = |text: &str, name: &str| -> Option<f64> {
        text.split(&format!(" {name}=\"")).nth(1)?.split('"').next()?.parse().ok()
    };
    let wide = number(svg, "width").unwrap();
    let texts = svg.split("<text").skip(1).filter_map(|text| {
        let words = text.split('>').nth(1)?.split('<').next()?.to_owned();
        let text = &format!(" {text}");
        Some((number(text, "x")?, number(text, "y")?, number(text, "textLength")?, words))
    });
    let texts: Vec<_> = texts.collect();
    let mut bad = Vec::new();
    for (k, (x, y, length, words)) in texts.iter().enumerate() {
        if x + length > wide + 0.5 || *x < 0.0 {
            bad.push(format!("{words} reaches from {x} to {} of {wide}", x + length));
        }
        for (a, b, more, others) in &texts[..k] {
            let beside = x + length < a - 4.0 || a + more < x - 4.0;
            if (y - b).abs() < 9.0 && !beside {
                bad.push(format!("{words} runs into {others}"));
            }
        }
    }
    assert!(!texts.is_empty());
    bad
}

const NAMES: &str = include_str!("../models/long_names.toml");

#[test]
fn legends_touch_neither_titles_nor_each_other() {
    let folder = folder("layout", "names");
    // an inline list and a section cannot be mixed: the third body joins the list
    let (list, section) = NAMES.split_once("[[body]]").unwrap();
    let keys = section.trim().replace('\n', ", ");
    let text = list.replace("body = [", &format!("body = [{{ {keys} }}, "));
    fs::write(folder.join("names.toml"), text).unwrap();
    let mut command = command(&folder, &["run", "names.toml", "-o", "out", "--force"]);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let html = fs::read_to_string(folder.join("out/report.html")).unwrap();
    let charts: Vec<&str> =
        html.split("<svg ").skip(1).map(|svg| svg.split("</svg>").next().unwrap()).collect();
    let of = |class: &str| {
        charts.iter().filter(|svg| svg.contains(&format!("class=\"{class}\""))).count()
    };
    assert!(of("wide") > 8 && of("wide") == of("narrow"), "{} and {}", of("wide"), of("narrow"));
    let bad: Vec<String> = charts.iter().flat_map(|svg| overlaps(&format!(" {svg}"))).collect();
    assert_eq!(bad, Vec::<String>::new());
}

#[test]
fn the_page_fits_windows_of_any_width() {
    let Some(browser) = browser() else { return };
    let folder = run("layout_wide", "heavy_top_steady.toml", &["simulation.end=0.5"]);
    let page = folder.join("report.html");
    let html = fs::read_to_string(&page).unwrap();
    let script = "<script>document.querySelector('details').open = true; const seen = [...document.querySelectorAll('figure svg')]\
                  .filter((svg) => getComputedStyle(svg).display !== 'none'); const figures = [...document.querySelectorAll('figure')]; \
                  Object.assign(document.body.dataset, { overflow: document.documentElement.scrollWidth - innerWidth, charts: seen.length, \
                  figures: figures.length, narrow: seen.filter((svg) => svg.classList.contains('narrow')).length, \
                  columns: new Set(figures.map((f) => Math.round(f.getBoundingClientRect().left))).size, window: innerWidth });</script></body>";
    let probed = folder.join("probed.html");
    fs::write(&probed, html.replace("</body>", script)).unwrap();
    for (size, columns) in [([390, 800], 1), ([1000, 900], 1), ([1400, 900], 2)] {
        let shown = show(browser, &probed, "", size);
        assert_eq!(shown.console, Vec::<String>::new());
        let number = |name: &str| shown.attribute(name).parse::<f64>().unwrap();
        println!("{size:?}: {} columns, window of {} px", number("columns"), number("window"));
        assert!(number("overflow") <= 0.0, "{size:?}: too wide");
        assert_eq!(shown.attribute("charts"), shown.attribute("figures"), "each chart once");
        assert_eq!(number("columns") as usize, columns, "{size:?}");
        let phone = number("window") <= 640.0;
        assert_eq!(number("narrow") > 0.0, phone, "charts of a phone on a phone alone");
    }
}
