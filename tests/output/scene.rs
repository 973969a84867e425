//! The animated scene of a motion in a real browser: it draws the bodies where they are, and obeys
//! keys.
#![allow(clippy::unwrap_used)] // a test

use crate::output::browser::{Shown, assert_marked, browser, run, show, with_keys};
use crate::program::command::{command, folder};
use std::path::Path;

/// Positions `(x, y)` of members in the row of `trajectory.csv` at a time.
fn positions(folder: &Path, t: f64, members: [&str; 3]) -> [[f64; 2]; 3] {
    let text = std::fs::read_to_string(folder.join("trajectory.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    let row = lines.find(|row| (row[1].parse::<f64>().unwrap() - t).abs() < 1e-9).unwrap();
    let value = |name: String| row[head.iter().position(|h| *h == name).unwrap()].parse().unwrap();
    members.map(|m| [value(format!("{m}.x")), value(format!("{m}.y"))])
}

#[test]
fn a_plane_motion_is_shown_to_scale() {
    let Some(browser) = browser() else { return };
    let folder = run("plane", "andrews_squeezer.toml", &[]);
    let members = ["K1", "K3", "K7"];
    for t in [0.01, 0.025] {
        let page = folder.join("report.html");
        let shown = show(browser, &page, &format!("t={t}&view=top"), [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        let [a, b, c] = members.map(|name| shown.member(name));
        assert_marked(&shown, t, 6);
        let [x, y, z] = positions(&folder, t, members);
        let scale = (c[0] - a[0]).hypot(c[1] - a[1]) / (z[0] - x[0]).hypot(z[1] - x[1]);
        for (pixel, place) in [(b, y), (c, z)] {
            let expected = [scale * (place[0] - x[0]), -scale * (place[1] - x[1])];
            let found = [pixel[0] - a[0], pixel[1] - a[1]];
            let off = (found[0] - expected[0]).hypot(found[1] - expected[1]);
            println!("t = {t} s: {found:?} px, expected {expected:?} px");
            assert!(off < 1.0 && scale > 100.0, "{off} px");
        }
    }
}

#[test]
fn bodies_are_drawn_in_their_colours() {
    let Some(browser) = browser() else { return };
    let set = ["simulation.end=1.0", "simulation.every=10"];
    let folder = run("colours", "slider_crank.toml", &set);
    let page = folder.join("report.html");
    let size = std::fs::metadata(&page).unwrap().len();
    assert!(size < 3_000_000, "{size} bytes");
    for t in [0.3, 0.9] {
        let shown = show(browser, &page, &format!("t={t}&view=front"), [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        // Okabe and Ito's blue, vermilion and green
        let [crank, rod, slider] =
            ["crank", "rod", "slider"].map(|name| shown.color(shown.member(name)).map(i32::from));
        println!("t = {t} s: {crank:?} {rod:?} {slider:?}");
        assert!(crank[2] > crank[0] + 40, "the crank is blue: {crank:?}");
        assert!(rod[0] > rod[2] + 60, "the rod is vermilion: {rod:?}");
        assert!(slider[1] > slider[0] + 40, "the slider is green: {slider:?}");
    }
}

const HANGING: &str = include_str!("../models/hanging_weight.toml");

const MARKS: &str = include_str!("../models/marks.toml");

const ANGLE_BAR: &str = include_str!("../models/angle_bar.toml");

/// A model between the marks, seen from the front, and the scale of the picture, px/m.
fn between_marks(browser: &str, folder: &Path, model: &str) -> (Shown, f64) {
    std::fs::write(folder.join("marked.toml"), format!("{model}{MARKS}")).unwrap();
    assert!(command(folder, &["run", "marked.toml", "-o", "."]).output().unwrap().status.success());
    let shown = show(browser, &folder.join("report.html"), "t=0.05&view=front", [1100, 900]);
    assert_eq!(shown.console, Vec::<String>::new());
    let [left, right] = ["left", "right"].map(|name| shown.member(name));
    let scale = (right[0] - left[0]) / 8.0;
    (shown, scale)
}

#[test]
fn a_mesh_is_drawn_where_its_triangles_are() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "mesh");
    std::fs::write(folder.join("bar.obj"), crate::output::meshes::angle_bar()).unwrap();
    let (shown, scale) = between_marks(browser, &folder, ANGLE_BAR);
    let bar = shown.member("bar");
    assert!(scale > 20.0, "{scale} px/m");
    // in the axes of the file, whose centre of mass is (1.1, 0.25, 1.1): x points upwards now, z to
    // the left
    let color = |x: f64, z: f64| {
        let place = [bar[0] - (z - 1.1) * scale, bar[1] - (x - 1.1) * scale];
        shown.color(place).map(i32::from)
    };
    let blue = |[red, _, blue]: [i32; 3]| blue > red + 40;
    for (x, z) in [(2.7, 0.5), (0.5, 2.7), (0.5, 0.5), (0.1, 1.5), (1.5, 0.9)] {
        assert!(blue(color(x, z)), "({x}, {z}) lies in the bar: {:?}", color(x, z));
    }
    for (x, z) in [(2.0, 2.0), (1.3, 1.3), (-0.3, 1.0), (3.3, 0.5), (0.5, 3.3)] {
        assert!(!blue(color(x, z)), "({x}, {z}) lies beside the bar: {:?}", color(x, z));
    }
}

const PICTURE: &str = include_str!("../models/picture.toml");

#[test]
fn all_shapes_of_a_picture_are_drawn_at_their_places() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "picture");
    let (shown, scale) = between_marks(browser, &folder, PICTURE);
    let arm = shown.member("arm");
    // in the axes of the body: x points upwards, z to the left
    let blue = |x: f64, z: f64| {
        let place = [arm[0] - z * scale, arm[1] - x * scale];
        let [red, _, blue] = shown.color(place).map(i32::from);
        blue > red + 40
    };
    for (x, z) in [(0.0, 0.0), (0.4, 0.0), (0.8, 2.0), (-0.8, 2.0), (0.0, 1.9)] {
        assert!(blue(x, z), "({x}, {z}) lies in the picture");
    }
    for (x, z) in [(0.7, 0.0), (0.0, 1.2), (1.3, 2.0), (0.0, -2.0), (0.8, 1.5)] {
        assert!(!blue(x, z), "({x}, {z}) lies beside it");
    }
}

#[test]
fn reactions_are_arrows_that_a_key_hides() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "reactions");
    std::fs::write(folder.join("hanging.toml"), HANGING).unwrap();
    assert!(
        command(&folder, &["run", "hanging.toml", "-o", "."]).output().unwrap().status.success()
    );
    let html = std::fs::read_to_string(folder.join("report.html")).unwrap();
    let page = folder.join("hidden.html");
    let key = "<script>document.querySelector('#scene canvas').dispatchEvent(new KeyboardEvent('keydown', \
               { key: 'r', bubbles: true }));document.body.dataset.pressed = \
               document.querySelector('[data-reactions]').getAttribute('aria-pressed');</script>";
    std::fs::write(&page, html.replace("</body>", &format!("{key}</body>"))).unwrap();
    let arrow = |page: &Path| {
        let shown = show(browser, page, "t=0.05&view=front", [1100, 900]);
        assert_eq!(shown.console, Vec::<String>::new());
        // yellow-brown: much red and green, little blue
        let own = |p: &&[u8]| p[0] > p[2].saturating_add(60) && p[1] > p[2].saturating_add(50);
        let count = shown.pixels.chunks(3).filter(own).count();
        (count, shown.document.contains("data-pressed=\"false\""))
    };
    let (shown, hidden) = (arrow(&folder.join("report.html")), arrow(&page));
    println!("pixels of the arrow: {} shown, {} hidden", shown.0, hidden.0);
    assert!(shown.0 > 100 && hidden.0 < shown.0 / 10, "{} and {} pixels", shown.0, hidden.0);
    assert!(hidden.1 && !shown.1, "the button tells");
}

const SUSPENDED: &str = include_str!("../models/suspended_points.toml");

#[test]
fn tensions_of_bars_and_springs_are_arrows_at_their_ends() {
    let Some(browser) = browser() else { return };
    let folder = folder("scene", "tensions");
    std::fs::write(folder.join("suspended.toml"), SUSPENDED).unwrap();
    let run = command(&folder, &["run", "suspended.toml", "-o", "."]).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let shown = show(browser, &folder.join("report.html"), "t=0.05&view=front", [1100, 900]);
    assert_eq!(shown.console, Vec::<String>::new());
    for name in ["left", "right"] {
        // both pull upwards with 19.62 N
        let [x, y] = shown.member(name);
        let arrow = |dy: f64| {
            (-3..=3).any(|dx| {
                let [red, green, blue] = shown.color([x + f64::from(dx), y - dy]);
                red > blue.saturating_add(60) && green > blue.saturating_add(50)
            })
        };
        let above = (15..105).filter(|dy| arrow(f64::from(*dy))).count();
        println!("{name}: {above} of 90 pixels above the point mass show the arrow");
        assert!(above > 80, "{name}: {above} pixels of the arrow");
    }
}

#[test]
fn the_scene_obeys_keys_and_fits_a_phone() {
    let Some(browser) = browser() else { return };
    let folder = run("pendulum", "pendulum.toml", &["simulation.end=2.0"]);
    let page = with_keys(&folder.join("report.html"), &["End", "ArrowLeft", "ArrowLeft", "4"]);
    for size in [[360, 740], [3840, 2160]] {
        let shown = show(browser, &page, "t=0.5", size);
        assert_eq!(shown.console, Vec::<String>::new());
        let t: f64 = shown.attribute("time").parse().unwrap();
        println!(
            "{size:?}: t = {t} s after End and two steps back, view {}",
            shown.attribute("view")
        );
        assert!(t > 1.9 && t < 2.0, "{t}");
        assert_eq!(shown.attribute("view"), "top");
        assert!(shown.attribute("overflow").parse::<f64>().unwrap() <= 0.0, "{size:?}: too wide");
    }
}
