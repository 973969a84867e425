//! The moving shapes of modes in a real browser: vibrations of a beam, a decay.
#![allow(clippy::unwrap_used)] // a test

use crate::output::browser::{browser, shipped, show, with_keys};
use crate::program::command::{command, folder};

/// A cantilever of 1 m, softer in bending along `z`: mode 1.
fn cantilever() -> String {
    let text = include_str!("../models/slender_cantilever.toml");
    assert!(text.contains("EI1 = 1,"));
    text.replace("EI1 = 1,", "EI1 = 4,")
}

/// Mode 1 of Euler and Bernoulli's cantilever, 1 at the end.
fn first_mode(x: f64) -> f64 {
    let k = 1.875_104_068_711_961_f64;
    let sigma = (k.sinh() - k.sin()) / (k.cosh() + k.cos());
    let shape = |x: f64| (k * x).cosh() - (k * x).cos() - sigma * ((k * x).sinh() - (k * x).sin());
    shape(x) / shape(1.0)
}

#[test]
fn a_mode_is_shown_as_the_shape_of_the_beam() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "modes");
    std::fs::write(folder.join("cantilever.toml"), cantilever()).unwrap();
    let output = command(&folder, &["modes", "cantilever.toml", "-n", "4", "-o", "."]).output();
    assert!(output.unwrap().status.success());
    let page = folder.join("modes.html");
    let mut side = 0.0; // to which the shape points
    for (phase, part) in [(0.0, 1.0), (0.25, 0.0), (0.5, -1.0)] {
        let fragment = format!("mode=1&phase={phase}&view=front");
        let shown = show(browser, &page, &fragment, [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        let [root, tip] = ["beam.0", "beam.16"].map(|name| shown.member(name));
        let length = tip[0] - root[0];
        if side == 0.0 {
            side = (root[1] - tip[1]).signum();
        }
        let mut largest = 0.0_f64;
        for k in 0..=16 {
            let x = f64::from(k) / 16.0;
            let node = shown.member(&format!("beam.{k}"));
            let found = (root[1] - node[1]) / length; // of the length, upwards
            let expected = side * part * 0.15 * first_mode(x);
            largest = largest.max((found - expected).abs());
        }
        let end = (root[1] - tip[1]) / length;
        println!("phase {phase}: end at {end:.4} of the length, largest difference {largest:.1e}");
        assert!((end.abs() - 0.15 * part.abs()).abs() < 1e-3 && largest < 2e-3, "{end} {largest}");
    }
    // the tube is where its nodes are, in the colour of the first beam
    let shown = show(browser, &page, "mode=1&phase=0&view=front", [1100, 900]);
    let [middle, rest] = ["beam.8", "beam.0"].map(|name| shown.member(name));
    let [r, _, b] = shown.color(middle).map(i32::from);
    let [r0, _, b0] = shown.color([middle[0], rest[1]]).map(i32::from);
    println!("tube: red {r}, blue {b}; at rest: red {r0}, blue {b0}");
    assert!(b > r + 40 && b0 < r0 + 40, "the tube is displaced");

    let keys = with_keys(&page, &["ArrowDown", "ArrowDown", "ArrowUp", "4"]);
    for size in [[390, 800], [3840, 2160]] {
        let shown = show(browser, &keys, "phase=0", size);
        assert_eq!(shown.console, Vec::<String>::new());
        assert_eq!((shown.attribute("mode"), shown.attribute("view")), ("2", "top"));
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
    }
}

#[test]
fn twenty_modes_of_a_beam_are_a_small_page() {
    let folder = folder("scene", "many-modes");
    let mut command = command(&folder, &["modes"]);
    command.arg(shipped("bend_45.toml")).args(["-n", "20", "-o", "."]);
    assert!(command.output().unwrap().status.success());
    let page = std::fs::read_to_string(folder.join("modes.html")).unwrap();
    println!("{} bytes", page.len());
    assert!(page.len() < 3_000_000 && page.matches("<tr data-mode=").count() == 20);
}

/// A mode that dies out without a vibration: of its displacement `e⁻¹` is left a quarter of the
/// way, and it never changes sides.
#[test]
fn a_decay_is_not_shown_as_a_vibration() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "decay");
    let mut command = command(&folder, &["modes"]);
    command.arg(shipped("flyball_governor.toml")).args(["-n", "6", "-o", "."]);
    assert!(command.output().unwrap().status.success());
    let page = folder.join("modes.html");
    let heights = [0.0, 0.25, 0.5, 1.0].map(|phase| {
        let shown = show(browser, &page, &format!("mode=6&phase={phase}&view=front"), [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        assert!(shown.document.contains("without a vibration"));
        assert!(shown.document.contains(&format!("t = {:.2}/δ", 4.0 * phase)));
        shown.member("slider")[1]
    });
    let left = |k: usize| (heights[k] - heights[3]) / (heights[0] - heights[3]);
    let end = (-4.0_f64).exp();
    for (k, decayed) in [(1, (-1.0_f64).exp()), (2, (-2.0_f64).exp())] {
        let expected = (decayed - end) / (1.0 - end);
        println!("{:.4} of the displacement, {expected:.4} expected", left(k));
        assert!((left(k) - expected).abs() < 0.02, "{}", left(k));
    }
}
