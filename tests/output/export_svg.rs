//! The animated drawing of a run: what it shows is the motion.
#![allow(clippy::unwrap_used)] // a test

use crate::output::export::{run, run_let_go};
use crate::program::command::{folder, holonom, words};
use std::fs;
use std::path::Path;

/// An element of a drawing: its points at each frame, or at all of them.
struct Element {
    tag: String,
    frames: Vec<Vec<[f64; 2]>>,
}

fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
    element.split(&format!(" {name}=\"")).nth(1)?.split('"').next()
}

fn points(text: &str) -> Vec<[f64; 2]> {
    let number = |text: &str| text.parse::<f64>().unwrap();
    let point = |pair: &str| pair.split_once(',').map(|(x, y)| [number(x), number(y)]).unwrap();
    text.split(' ').map(point).collect()
}

/// The size of a drawing and its elements, each on a line.
fn drawing(path: &Path) -> ([f64; 2], Vec<Element>) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.starts_with("<svg ") && text.ends_with("</svg>\n"), "{text}");
    let size: Vec<f64> =
        attribute(&text, "viewBox").unwrap().split(' ').map(|n| n.parse().unwrap()).collect();
    let elements = text.lines().filter(|line| line.starts_with("<poly")).map(|line| {
        let still = points(attribute(line, "points").unwrap());
        let frames = match attribute(line, "values") {
            Some(values) => values.split(';').map(points).collect(),
            None => vec![still.clone()],
        };
        assert_eq!(frames.first(), Some(&still), "the still picture is the first frame");
        let tag = line.trim_start_matches('<').split(' ').next().unwrap().to_owned();
        Element { tag, frames }
    });
    ([size[2], size[3]], elements.collect())
}

fn export(folder: &Path, frames: &str) -> String {
    let output =
        holonom(folder, &["export", "run", "--format", "svg", "--frames", frames, "--force"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    words(&output)
}

/// A planar drawing keeps lengths: the rod of a pendulum is as long in every frame, and it moves.
#[test]
fn a_rigid_bar_has_one_length() {
    let folder = folder("export_svg", "pendulum");
    run(&folder, "pendulum.toml", 200);
    let said = export(&folder, "41");
    assert!(said.contains("41 of 201 recorded nodes"), "{said}");
    let (_, elements) = drawing(&folder.join("run.svg"));
    let rod = elements.iter().find(|e| e.tag == "polyline" && e.frames.len() > 1).unwrap();
    assert_eq!(rod.frames.len(), 41);
    let length =
        |ends: &Vec<[f64; 2]>| f64::hypot(ends[0][0] - ends[1][0], ends[0][1] - ends[1][1]);
    let lengths: Vec<f64> = rod.frames.iter().map(length).collect();
    let [least, most] = lengths.iter().fold([f64::MAX, 0.0], |[a, b], l| [l.min(a), l.max(b)]);
    println!("{least} to {most} tenths of a pixel");
    assert!(least > 1000.0 && most - least <= 2.0, "{least} to {most}");
    let turned = rod
        .frames
        .iter()
        .map(|ends| ends[1][0])
        .fold([f64::MAX, f64::MIN], |[a, b], x| [x.min(a), x.max(b)]);
    assert!(
        turned[1] - turned[0] > length(&rod.frames[0]),
        "it swings to the other side: {turned:?}"
    );
}

/// Bodies, beams, joints and springs of models of all kinds, at all frames, are on the sheet.
#[test]
fn everything_is_on_the_sheet() {
    let models = [
        ("slider_crank.toml", 7),
        ("flexible_multibody.toml", 1),
        ("four_particles.toml", 8),
        ("bricard.toml", 11),
    ];
    for (model, least) in models {
        let folder = folder("export_svg", model);
        run(&folder, model, 100); // every tenth node is recorded by some
        export(&folder, "5");
        let ([width, height], elements) = drawing(&folder.join("run.svg"));
        println!("{model}: {} elements", elements.len());
        assert!(elements.len() >= least, "{model}: {} elements", elements.len());
        assert!(elements.iter().any(|element| element.frames.len() == 5), "{model}: nothing moves");
        for [x, y] in elements.iter().flat_map(|e| e.frames.iter().flatten()) {
            assert!((0.0..=width).contains(x) && (0.0..=height).contains(y), "{model}: {x}, {y}");
        }
    }
}

/// What an event released is hidden from the first frame after that on: the dot and the axis of a
/// hinge, those of a bushing, a spring, a cord.
#[test]
fn what_is_released_is_hidden() {
    let folder = folder("export_svg", "let_go");
    run_let_go(&folder);
    export(&folder, "51");
    let text = fs::read_to_string(folder.join("run.svg")).unwrap();
    let hidden = text.lines().filter_map(|line| {
        let states = line.split("attributeName=\"visibility\"").nth(1)?;
        Some(attribute(states, "values").unwrap().split(';').collect::<Vec<_>>())
    });
    let hidden: Vec<Vec<&str>> = hidden.collect();
    assert_eq!(hidden.len(), 6, "{hidden:?}");
    for states in hidden {
        let visible = |k: usize| if k < 21 { "visible" } else { "hidden" };
        let expected: Vec<&str> = (0..51).map(visible).collect();
        assert_eq!(states, expected);
    }
}
