//! How parts are drawn: colours, what lets see through, what is hidden, distances, ends on the
//! ground; with and without WebGL.
#![allow(clippy::unwrap_used)] // a test

use crate::output::browser::{browser, show_with};
use crate::output::export::run_let_go;
use crate::program::command::{command, folder, holonom, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

const LOOKS: &str = include_str!("../models/looks.toml");

fn write(folder: &Path) {
    fs::write(folder.join("looks.toml"), LOOKS).unwrap();
}

/// The data of the scene of a page.
fn scene(page: &Path) -> Value {
    let html = fs::read_to_string(page).unwrap();
    let data = html.split("<script id=\"scene-data\" type=\"application/json\">").nth(1).unwrap();
    serde_json::from_str(data.split("</script>").next().unwrap()).unwrap()
}

#[test]
fn looks_and_distances_are_part_of_the_scene() {
    let folder = folder("looks", "scene");
    write(&folder);
    let output = holonom(&folder, &["check", "looks.toml", "--page", "looks.html"]);
    assert!(output.status.success(), "{}", words(&output));
    let checked = scene(&folder.join("looks.html"));
    let output = holonom(&folder, &["run", "looks.toml", "-o", "out"]);
    assert!(output.status.success(), "{}", words(&output));
    let ran = scene(&folder.join("out/report.html"));
    for scene in [&checked, &ran] {
        let bodies = &scene["bodies"];
        assert_eq!(bodies[0]["color"], serde_json::json!([255, 0, 0]));
        assert_eq!(bodies[1]["color"], serde_json::json!([0, 0, 255]));
        assert_eq!((&bodies[1]["opacity"], &bodies[3]["opacity"]), (&0.25.into(), &1.0.into()));
        assert_eq!((&bodies[2]["visible"], &bodies[3]["visible"]), (&false.into(), &true.into()));
        assert_eq!(bodies[3]["color"], Value::Null, "of the palette");
        let bars = scene["bars"].as_array().unwrap();
        assert_eq!(bars.len(), 1, "the tie rod");
        assert_eq!(bars[0]["from"], serde_json::json!({ "member": -1, "point": [2.0, 0.0, 1.0] }));
        assert_eq!(bars[0]["to"]["member"], 3);
        let fixed = scene["fixed"].as_array().unwrap();
        assert!(fixed.contains(&serde_json::json!([2.0, 0.0, 1.0])), "{fixed:?}");
        // the symbol of the slide is no larger than the tile
        assert!(scene["joints"][0]["limit"].as_f64().unwrap() < 0.1);
    }
    assert_eq!(ran["tensions"].as_array().unwrap().len(), 1, "of the tie rod");
}

/// A joint of what is hidden is not drawn: a flywheel that stands for an inertia.
#[test]
fn joints_of_what_is_hidden_are_not_drawn() {
    let folder = folder("looks", "hidden");
    let body = |name: &str, x: f64, more: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\nposition = [{x:?}, 0.0, 0.0]\n{more}\
             [[joint]]\nname = \"{name}_pin\"\ntype = \"revolute\"\nparent = \"ground\"\nchild = \"{name}\"\n\
             position = [0.0, 0.0, 0.0]\naxis = [0.0, 1.0, 0.0]\n"
        )
    };
    let text = format!(
        "[model]\nname = \"m\"\ngravity = [0.0, 0.0, -9.81]\n[simulation]\nstep = 0.01\nend = 0.1\n{}{}",
        body("arm", 0.5, ""),
        body("wheel", 0.0, "visible = false\n"),
    );
    fs::write(folder.join("m.toml"), text).unwrap();
    let output = holonom(&folder, &["run", "m.toml"]);
    assert!(output.status.success(), "{}", words(&output));
    let scene = scene(&folder.join("m-out/report.html"));
    let joints = scene["joints"].as_array().unwrap();
    assert_eq!(joints.len(), 1, "{joints:?}");
    assert_eq!(joints[0]["child"]["member"], 0, "of the arm");
}

/// A bushing is a sleeve on its first body and a pin on the second, until an event releases it.
#[test]
fn bushings_are_drawn_until_they_are_released() {
    let folder = folder("looks", "bushing");
    run_let_go(&folder);
    let scene = scene(&folder.join("run/report.html"));
    let joints = scene["joints"].as_array().unwrap();
    let of = |kind: &str| joints.iter().find(|joint| joint["type"] == kind).unwrap();
    let bushing = of("bushing");
    assert_eq!(joints.len(), 2);
    for joint in [bushing, of("revolute")] {
        assert_eq!(joint["until"], 0.205);
    }
    let ground = serde_json::json!({ "member": -1, "point": [0.1, 1.0, 0.0] });
    assert_eq!(bushing["parent"], ground);
    assert_eq!(bushing["child"]["member"], 1, "the block");
    assert_eq!(bushing["child"]["point"][0], 0.1);
    assert_eq!(bushing["axis"], serde_json::json!([0.0, 0.0, 1.0]));
    let parts = scene["symbols"]["bushing"].as_array().unwrap();
    let on_parent: Vec<bool> = parts.iter().map(|part| part["on_parent"] == true).collect();
    assert_eq!(on_parent, [true, false], "sleeve and pin");
    let anchors = scene["bodies"][1]["anchors"].as_array().unwrap();
    assert_eq!(anchors.len(), 1, "the block is held there");
}

/// In front of the red tile stands a blue cover that lets see through, and a larger hidden one.
#[test]
fn what_lets_see_through_shows_what_is_behind() {
    let Some(browser) = browser() else { return };
    let folder = folder("looks", "glass");
    write(&folder);
    let mut command = command(&folder, &["check"]);
    command.args(["looks.toml", "--page", "looks.html"]);
    assert!(command.output().unwrap().status.success());
    for (flags, stage) in [(&[][..], "webgl"), (&["--disable-3d-apis"], "flat")] {
        let shown =
            show_with(browser, &folder.join("looks.html"), "view=front", [1100, 900], flags);
        assert_eq!(shown.console, Vec::<String>::new(), "{stage}");
        assert_eq!(shown.attribute("stage"), stage);
        let [x, y] = shown.member("tile");
        let seen = shown.color([x, y - 8.0]).map(i32::from);
        let stone = shown.color(shown.member("stone")).map(i32::from);
        println!("{stage}: tile behind the cover {seen:?}, stone {stone:?}");
        assert!(seen[0] > seen[2] + 15, "the red tile shows: {seen:?}");
        assert!(seen[2] > seen[1] + 40, "with some blue of the cover: {seen:?}");
        assert!(seen[1] < 60, "and nothing of the page: {seen:?}");
        assert!(stone[1] < 140 || stone[0] < 200, "the stone is there: {stone:?}");
        if stage == "flat" {
            assert!(shown.document.contains("drawn without WebGL"));
        }
    }
}

#[test]
fn exports_have_looks_distances_and_ends_on_the_ground() {
    let folder = folder("looks", "exports");
    write(&folder);
    assert!(holonom(&folder, &["run", "looks.toml", "-o", "out"]).status.success());
    for format in ["gltf", "svg", "vtk"] {
        let output = holonom(&folder, &["export", "out", "--format", format]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    }
    let file = fs::read(folder.join("out.glb")).unwrap();
    let length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    let json: Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
    let node = |name: &str| {
        let nodes = json["nodes"].as_array().unwrap();
        nodes.iter().find(|node| node["name"] == name).unwrap_or_else(|| panic!("no {name}"))
    };
    let material = |name: &str| {
        let mesh = &json["meshes"][node(name)["mesh"].as_u64().unwrap() as usize];
        &json["materials"][mesh["primitives"][0]["material"].as_u64().unwrap() as usize]
    };
    let color = |name: &str| material(name)["pbrMetallicRoughness"]["baseColorFactor"].clone();
    assert_eq!(color("tile"), serde_json::json!([1.0, 0.0, 0.0, 1.0]));
    assert_eq!(color("cover"), serde_json::json!([0.0, 0.0, 1.0, 0.25]));
    assert_eq!(material("cover")["alphaMode"], "BLEND");
    assert!(material("tile").get("alphaMode").is_none());
    assert!(node("ghost").get("mesh").is_none(), "nothing of it is shown");
    assert!(node("tie").get("mesh").is_some() && node("ground").get("mesh").is_some());
    let svg = fs::read_to_string(folder.join("out.svg")).unwrap();
    let surfaces: Vec<&str> = svg.lines().filter(|line| line.starts_with("<polygon")).collect();
    assert_eq!(surfaces.len(), 3, "tile, cover and stone");
    assert!(surfaces.iter().any(|s| s.contains("#0000ff") && s.contains("fill-opacity=\"0.21")));
    let lines = svg.lines().filter(|line| line.starts_with("<polyline")).count();
    assert_eq!(lines, 4, "the tie rod, its end on the ground, the slide: a dot and an axis");
    let lines = fs::read_to_string(folder.join("out-vtk/frames/000000/lines.vtp"));
    let lines = lines.or_else(|_| fs::read_to_string(folder.join("out/frames/000000/lines.vtp")));
    let bodies = walk(&folder, "bodies.vtp");
    assert!(bodies.contains("\"opacity\""), "opacities of cells");
    assert!(lines.is_ok() || !walk(&folder, "lines.vtp").is_empty(), "the tie rod");
}

/// The text of the first file of a name below a folder.
fn walk(folder: &Path, name: &str) -> String {
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => folders.push(path),
                false if path.file_name().is_some_and(|own| own == name) => {
                    return String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
                }
                false => {}
            }
        }
    }
    panic!("no {name}")
}

#[test]
fn colours_that_are_none_are_refused() {
    let folder = folder("looks", "refused");
    for (from, to, said) in [
        ("\"#ff0000\"", "\"redd\"", "did you mean `red`?"),
        ("\"#ff0000\"", "\"#ff00\"", "is no colour"),
        ("opacity = 0.25", "opacity = 25", "is not between 0 and 1"),
    ] {
        fs::write(folder.join("model.toml"), LOOKS.replace(from, to)).unwrap();
        let output = holonom(&folder, &["check", "model.toml"]);
        assert_eq!(output.status.code(), Some(3));
        assert!(words(&output).contains(said), "{}", words(&output));
    }
}
