//! Scenes on other pages than that of a motion, in a real browser: equilibria, a checked model, a
//! certificate, a comparison.
#![allow(clippy::unwrap_used)] // a test

use crate::output::browser::{assert_marked, browser, run, shipped, show, with_keys};
use crate::program::command::{command, folder};
use std::path::Path;

/// A cantilever under an end moment is a circle of `4π EI/L · t` for `2 t` revolutions: at the load
/// factor 0.5 its end is back at the clamp, at 0.25 it is a half circle.
#[test]
fn equilibria_are_shown_over_the_load_factor() {
    let Some(browser) = browser() else { return };
    let folder = run("statics", "roll_up.toml", &[]);
    let page = folder.join("report.html");
    for (factor, expected) in [(0.25, 2.0 / std::f64::consts::PI), (0.5, 0.0)] {
        let shown = show(browser, &page, &format!("t={factor}&view=top"), [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        assert_marked(&shown, factor, 3);
        let [root, next, end] = ["beam.0", "beam.1", "beam.80"].map(|name| shown.member(name));
        let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let gap = distance(root, end) / (80.0 * distance(root, next));
        println!(
            "load factor {factor}: end at {gap:.3} of the length from the clamp, {expected:.3} expected"
        );
        assert!((gap - expected).abs() < 0.02, "{gap}");
        assert!(shown.document.contains(&format!("load factor {factor:.3}")));
        let rise = shown.document.split("data-rise=\"").nth(1).expect("the load path").to_owned();
        let line = rise.split("class=\"cursor\"").nth(1).unwrap();
        let number = |name: &str| -> f64 {
            line.split(&format!(" {name}=\""))
                .nth(1)
                .unwrap()
                .split('"')
                .next()
                .unwrap()
                .parse()
                .unwrap()
        };
        assert!((number("y1") - number("y2")).abs() < 1e-9, "a horizontal line on the load path");
        // on the curve of the end, which was 10 m from the clamp
        let across = rise.split("data-across=\"").nth(1).unwrap().split('"').next().unwrap();
        let across: Vec<f64> = across.split(' ').map(|edge| edge.parse().unwrap()).collect();
        let circle = rise.split("class=\"cursor-mark\"").nth(1).unwrap();
        let mark = circle.split(" cx=\"").nth(1).unwrap().split('"').next().unwrap();
        let mark: f64 = mark.parse().unwrap();
        let way =
            across[4] + (mark - across[0]) / (across[1] - across[0]) * (across[5] - across[4]);
        // end of a circular arc of 10 m, of half a turn and of a full one
        let expected = if factor < 0.3 { 10.0 * 1.0_f64.hypot(expected) } else { 10.0 };
        println!("mark on the load path at a displacement of {way:.3} m, {expected:.3} m expected");
        assert!((way - expected).abs() < 0.1, "{way}");
    }
    let keys = with_keys(&page, &["End", "ArrowLeft", "4"]);
    let shown = show(browser, &keys, "t=0.5", [390, 800]);
    let factor: f64 = shown.attribute("time").parse().unwrap();
    println!("load factor {factor} after End and one equilibrium back");
    assert!((factor - 0.95).abs() < 1e-6 && shown.attribute("view") == "top");
    assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "too wide");
}

#[test]
fn a_checked_model_stands_in_its_initial_configuration() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "check");
    let mut command = command(&folder, &["check"]);
    command.arg(shipped("slider_crank.toml")).args(["--page", "crank.html"]);
    assert!(command.output().unwrap().status.success());
    let page = with_keys(&folder.join("crank.html"), &[" ", "2"]);
    for size in [[390, 800], [1100, 900], [3840, 2160]] {
        let shown = show(browser, &page, "", size);
        assert_eq!(shown.console, Vec::<String>::new());
        let [crank, slider] =
            ["crank", "slider"].map(|name| shown.color(shown.member(name)).map(i32::from));
        println!("{size:?}: crank {crank:?}, slider {slider:?}");
        if size[0] > 500 {
            // the document of a narrower window is not laid out as its picture
            assert!(crank[2] > crank[0] + 40, "the crank is blue: {crank:?}");
            assert!(slider[1] > slider[0] + 40, "the slider is green: {slider:?}");
        }
        assert!(
            shown.document.contains("data-play=\"\" aria-label=\"play\" hidden"),
            "nothing plays"
        );
        assert_eq!(shown.attribute("view"), "front");
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
    }
}

#[test]
fn a_certificate_shows_the_motion_of_its_model() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "certificate");
    let mut command = command(&folder, &["verify"]);
    command.arg(shipped("pendulum.toml")).args(["-o", ".", "--quiet"]);
    assert!(command.output().unwrap().status.success());
    let page = with_keys(&folder.join("certificate.html"), &["2"]);
    let shown = show(browser, &page, "t=0", [1100, 1000]);
    assert_eq!(shown.console, Vec::<String>::new());
    assert_marked(&shown, 0.0, 1);
    let bob = shown.color(shown.member("bob")).map(i32::from);
    println!("the point mass: {bob:?}");
    assert!(bob[2] > bob[0] + 40, "it is blue: {bob:?}");
    for size in [[390, 800], [3840, 2160]] {
        let shown = show(browser, &page, "t=0.5", size);
        assert_eq!(shown.console, Vec::<String>::new());
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
    }
}

/// Two schemes from the same initial values: at the start the body shows the colours of both, and
/// that of the one that is left when the other is hidden.
#[test]
fn schemes_that_coincide_show_both_colours() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "compare");
    let mut command = command(&folder, &["compare"]);
    command.arg(shipped("heavy_top.toml"));
    command.args(["--schemes", "nodal,em-nodal", "--step", "0.01,0.005", "--end", "1"]);
    command.args(["--order", "2", "-o", ".", "--quiet"]);
    assert!(command.output().unwrap().status.success());
    let page = folder.join("compare.html");
    let html = std::fs::read_to_string(&page).unwrap();
    let click =
        "<script>document.querySelectorAll('.scene-legend button')[1].click();</script></body>";
    let alone = folder.join("alone.html");
    std::fs::write(&alone, html.replace("</body>", click)).unwrap();
    let colors = |page: &Path| {
        let shown = show(browser, page, "t=0&view=front", [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        let [x, y] = shown.member("top");
        let near = (-12..=12).flat_map(|i| (-12..=12).map(move |j| (f64::from(i), f64::from(j))));
        let near: Vec<[u8; 3]> = near.map(|(i, j)| shown.color([x + i, y + j])).collect();
        let blue = near.iter().filter(|c| c[2] > c[0].saturating_add(40)).count();
        let vermilion = near.iter().filter(|c| c[0] > c[2].saturating_add(60)).count();
        (blue, vermilion)
    };
    let (both, one) = (colors(&page), colors(&alone));
    println!("pixels, blue and vermilion: {both:?}, the second one hidden: {one:?}");
    assert!(both.0 > 150 && both.1 > 150, "{both:?}");
    assert!(one.0 > 450 && one.1 == 0, "{one:?}");
    let shown = show(browser, &page, "t=0.5", [1100, 900]);
    assert_marked(&shown, 0.5, 2);
    let keys = with_keys(&page, &["4"]);
    for size in [[390, 800], [3840, 2160]] {
        let shown = show(browser, &keys, "t=0.5", size);
        assert_eq!(shown.console, Vec::<String>::new());
        assert_eq!(shown.attribute("view"), "top");
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
    }
}
