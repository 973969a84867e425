//! Bodies whose shape is a mesh: a run needs no file but those of its folder, and shows the mesh
//! everywhere.

#![allow(clippy::unwrap_used)] // a test

use crate::program::command::{self, code, holonom, words};
use crate::program::interrupted::begin;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// An angle bar: the letter L with legs of 3 in the plane of `x` and `z`, of thickness 0.5 along
/// `y`, with its corner in the origin.
pub(crate) fn angle_bar() -> String {
    let outline = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)];
    let corners = [0.0, 0.5].map(|y| outline.map(|(x, z)| format!("v {x} {y} {z}\n")).concat());
    let caps = "f 1 2 3 4\nf 1 4 5 6\nf 7 10 9 8\nf 7 12 11 10\n";
    let side =
        |k: usize| format!("f {} {} {} {}\n", k + 1, k + 7, (k + 1) % 6 + 7, (k + 1) % 6 + 1);
    corners.concat() + caps + &(0..6).map(side).collect::<String>()
}

const MODEL: &str = include_str!("../models/mesh_on_hinge.toml");

/// A folder with the model and its mesh.
fn folder(case: &str) -> PathBuf {
    let folder = command::folder("meshes", case);
    fs::create_dir_all(folder.join("parts")).unwrap();
    fs::write(folder.join("parts/bar.obj"), angle_bar()).unwrap();
    fs::write(folder.join("model.toml"), MODEL).unwrap();
    folder
}

/// Names of the copies in the folder of a run.
fn copies(run: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(run.join("meshes")).into_iter().flatten().flatten();
    entries.map(|entry| entry.file_name().into_string().unwrap()).collect()
}

/// The same shape with one leg longer by a tenth.
fn lengthen(folder: &Path) {
    let longer = angle_bar().replace("v 3 ", "v 3.3 ");
    fs::write(folder.join("parts/bar.obj"), longer).unwrap();
}

#[test]
fn a_run_needs_no_file_but_its_own() {
    let folder = folder("alone");
    let run = ["run", "model.toml", "-q", "-o", "out", "--checkpoint-every", "5"];
    assert_eq!(code(&folder, &run), 0);
    assert_eq!(copies(&folder.join("out")).len(), 1);
    fs::remove_dir_all(folder.join("parts")).unwrap();
    fs::remove_file(folder.join("model.toml")).unwrap();
    fs::remove_file(folder.join("out/report.html")).unwrap();
    fs::rename(folder.join("out"), folder.join("moved")).unwrap();
    assert_eq!(code(&folder, &["view", "moved", "--print"]), 0);
    let page = fs::read_to_string(folder.join("moved/report.html")).unwrap();
    assert!(page.contains("\"shape\":\"mesh\""), "the page shows the mesh");
    assert_eq!(code(&folder, &["plot", "moved"]), 0);
    for format in ["vtk", "gltf", "svg"] {
        assert_eq!(code(&folder, &["export", "moved", "--format", format, "--frames", "3"]), 0);
    }
    assert_eq!(code(&folder, &["run", "moved/model.toml", "-q", "-o", "again"]), 0);
    let read = |run: &str, file: &str| fs::read_to_string(folder.join(run).join(file)).unwrap();
    for file in ["trajectory.csv", "model.toml"] {
        assert_eq!(read("again", file), read("moved", file), "{file}");
    }
    assert_eq!(copies(&folder.join("again")), copies(&folder.join("moved")));
}

/// A picture of three shapes, one of them a mesh, of a body that states its mass.
#[test]
fn a_picture_of_several_shapes_is_in_every_output() {
    let folder = folder("picture");
    let shape =
        "shape = { type = \"mesh\", file = \"parts/bar.obj\", scale = 0.1, density = 1000.0 }";
    let picture = "mass = 1.0\ninertia = [1, 1, 1]\npicture = [\n\
                   { type = \"mesh\", file = \"parts/bar.obj\", scale = 0.1, position = [1, 0, 0] },\n\
                   { type = \"box\", dimensions = [0.2, 0.4, 0.6], position = [0, 1, 0] },\n\
                   { type = \"sphere\", dimensions = [0.3], position = [0, 0, -1] } ]";
    fs::write(folder.join("model.toml"), MODEL.replace(shape, picture)).unwrap();
    assert_eq!(code(&folder, &["run", "model.toml", "-q", "-o", "out"]), 0);
    assert_eq!(copies(&folder.join("out")).len(), 1);
    fs::remove_dir_all(folder.join("parts")).unwrap();
    let page = fs::read_to_string(folder.join("out/report.html")).unwrap();
    assert!(page.contains("\"shape\":\"mesh\""), "the page shows the picture");
    for format in ["vtk", "gltf", "svg"] {
        assert_eq!(code(&folder, &["export", "out", "--format", format, "--frames", "3"]), 0);
    }
    assert_eq!(code(&folder, &["run", "out/model.toml", "-q", "-o", "again"]), 0);
    let text = fs::read_to_string(folder.join("again/model.toml")).unwrap();
    assert_eq!(text, fs::read_to_string(folder.join("out/model.toml")).unwrap());
    let meshes = holonom::model::Meshes::in_folder(folder.join("out"));
    let model = holonom::Model::from_toml_in(&text, &[], meshes).unwrap();
    let [low, high] = model.surface(&model.bodies[0]).unwrap().ends();
    let expected = [[-0.3, -0.3, -1.3], [1.3, 1.2, 0.3]];
    let missed = |i: usize| (low[i] - expected[0][i]).abs().max((high[i] - expected[1][i]).abs());
    println!("{low:?} {high:?}");
    assert!((0..3).all(|i| missed(i) < 1e-15), "{low} {high}");
}

#[test]
fn a_run_continues_with_the_mesh_that_it_had() {
    let folder = folder("resume");
    assert_eq!(code(&folder, &["run", "model.toml", "-q", "-o", "whole"]), 0);
    let model = holonom::model::ModelText::read(&folder.join("model.toml")).model(&[]).unwrap();
    begin(&model, &folder.join("out"), (13, Some(5)));
    fs::remove_dir_all(folder.join("parts")).unwrap();
    let mesh = folder.join("out/meshes").join(copies(&folder.join("out")).pop_first().unwrap());
    fs::write(&mesh, angle_bar() + "# changed\n").unwrap();
    let output = holonom(&folder, &["resume", "out", "-q"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(words(&output).contains("its content was changed"), "{}", words(&output));
    fs::write(&mesh, angle_bar()).unwrap();
    assert_eq!(code(&folder, &["resume", "out", "-q"]), 0);
    let trajectory =
        |run: &str| fs::read_to_string(folder.join(run).join("trajectory.csv")).unwrap();
    assert_eq!(trajectory("out"), trajectory("whole"));
    fs::write(&mesh, angle_bar() + "# changed\n").unwrap();
    assert_eq!(code(&folder, &["plot", "out"]), 0);
    let page = fs::read_to_string(folder.join("out/report.html")).unwrap();
    assert!(page.contains("Meshes that cannot be read in the folder of the run: 1;"), "a note");
    assert_eq!(code(&folder, &["export", "out", "--format", "svg", "--frames", "3"]), 0);
}

#[test]
fn a_changed_mesh_is_another_model_and_force_removes_copies_alone() {
    let folder = folder("changed");
    let run = ["run", "model.toml", "-q", "-o", "out", "--force"];
    assert_eq!(code(&folder, &run), 0);
    let (first, text) = (copies(&folder.join("out")), fs::read(folder.join("out/model.toml")));
    fs::write(folder.join("out/meshes/mine.stl"), "mine").unwrap();
    fs::write(folder.join("out/meshes/0123456789abcdef.stl"), "mine").unwrap();
    lengthen(&folder);
    assert_eq!(code(&folder, &run), 0);
    let second = copies(&folder.join("out"));
    println!("{first:?} {second:?}");
    assert_ne!(fs::read(folder.join("out/model.toml")).unwrap(), text.unwrap());
    assert!(first.is_disjoint(&second) && second.len() == 3, "mine stay, the old copy goes");
    assert_eq!(fs::read_to_string(folder.join("out/meshes/mine.stl")).unwrap(), "mine");
}

#[cfg(unix)]
#[test]
fn a_folder_of_meshes_that_is_a_link_is_not_written_to() {
    let folder = folder("link");
    fs::create_dir_all(folder.join("out")).unwrap();
    std::os::unix::fs::symlink(folder.join("parts"), folder.join("out/meshes")).unwrap();
    fs::write(folder.join("out/trajectory.csv"), "earlier").unwrap();
    for verb in ["run", "compare", "sweep"] {
        let more: &[&str] = if verb == "sweep" { &["--vary", "simulation.step=0.01"] } else { &[] };
        let command = [&[verb, "model.toml", "-q", "-o", "out", "--force"], more].concat();
        assert_eq!(code(&folder, &command), 2, "{verb}");
    }
    let earlier = fs::read_to_string(folder.join("out/trajectory.csv")).unwrap();
    assert_eq!(earlier, "earlier", "nothing is removed before");
    let parts: Vec<_> = fs::read_dir(folder.join("parts")).unwrap().collect();
    assert_eq!(parts.len(), 1, "{parts:?}");
}

#[test]
fn every_command_finds_the_mesh_beside_the_model() {
    let folder = folder("commands");
    let above = folder.parent().unwrap();
    for arguments in [
        &["check", "commands/model.toml"][..],
        &["modes", "commands/model.toml"],
        &["compare", "commands/model.toml", "--end", "0.05", "-q", "-o", "commands/compare"],
        &["verify", "commands/model.toml", "-q", "-o", "commands/verify"],
    ] {
        assert_eq!(code(above, arguments), 0, "{arguments:?}");
    }
    assert_eq!(copies(&folder.join("compare")).len(), 1);
}

#[test]
fn points_of_a_sweep_share_the_mesh() {
    let folder = folder("sweep");
    let vary = ["--vary", "body.bar.shape.density=1000.0,2000.0", "-q", "-o", "out"];
    let sweep = [&["sweep", "model.toml"], &vary[..]].concat();
    assert_eq!(code(&folder, &sweep), 0);
    let name = copies(&folder.join("out")).pop_first().unwrap();
    for point in ["out/00000", "out/00001"] {
        assert!(copies(&folder.join(point)).contains(&name), "{point}");
        assert_eq!(code(&folder, &["view", point, "--print"]), 0);
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let copy = fs::metadata(folder.join("out/meshes").join(&name)).unwrap();
        assert_eq!(copy.nlink(), 3, "one file on the disk");
    }
    lengthen(&folder);
    let other = holonom(&folder, &sweep);
    assert_eq!(other.status.code(), Some(2), "another sweep: {}", words(&other));
}

/// The extents of the bar along its principal axes, at 45° to its legs: 0.05, 0.4/√2, 0.6/√2.
#[test]
fn the_exports_have_the_triangles_of_the_mesh() {
    let folder = folder("exports");
    assert_eq!(code(&folder, &["run", "model.toml", "-q", "-o", "out"]), 0);
    for format in ["gltf", "vtk"] {
        assert_eq!(code(&folder, &["export", "out", "--format", format, "--frames", "2"]), 0);
    }
    let file = fs::read(folder.join("out.glb")).unwrap();
    let length = u32::from_le_bytes(file[12..16].try_into().unwrap()) as usize;
    let json: serde_json::Value = serde_json::from_slice(&file[20..20 + length]).unwrap();
    let positions = json["accessors"].as_array().unwrap().iter().filter(|a| a["max"].is_array());
    let extents = positions.map(|accessor| {
        let at = |end: &str, i: usize| accessor[end][i].as_f64().unwrap_or(0.0);
        let mut extents = [0, 1, 2].map(|i| at("max", i) - at("min", i));
        extents.sort_by(f64::total_cmp);
        extents
    });
    let expected = [0.05, 0.4 / 2f64.sqrt(), 0.6 / 2f64.sqrt()];
    let near = |e: &[f64; 3]| e.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6);
    let found: Vec<_> = extents.collect();
    assert!(found.iter().any(near), "{found:?}");

    let files = walk(&folder.join("out-vtk"));
    let bodies = files.iter().filter(|file| file.to_string_lossy().contains("bodies"));
    let texts: Vec<_> = bodies.map(|file| fs::read(file).unwrap()).collect();
    let head = |text: &Vec<u8>| String::from_utf8_lossy(&text[..2000.min(text.len())]).into_owned();
    // 4 caps of 2 triangles and 6 sides of 2; a corner has a point for each of its three sides
    let whole = texts.iter().map(head).filter(|head| {
        head.contains("NumberOfPolys=\"20\"") && head.contains("NumberOfPoints=\"36\"")
    });
    assert_eq!(whole.count(), 2, "{:?}", texts.first().map(head));
}

fn walk(folder: &Path) -> Vec<PathBuf> {
    let paths = fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path());
    paths.flat_map(|path| if path.is_dir() { walk(&path) } else { vec![path] }).collect()
}

#[test]
fn a_large_mesh_leaves_the_page_small() {
    let folder = folder("large");
    let n = 250;
    let at = |i: usize, j: usize| i * (n + 1) + j + 1;
    let corners = (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j)));
    let mut mesh: String = corners
        .map(|(i, j)| {
            let (x, y) = (i as f64 / n as f64, j as f64 / n as f64);
            format!("v {x} {y} {}\n", x * y)
        })
        .collect();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        mesh += &format!("f {} {} {} {}\n", at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
    fs::write(folder.join("parts/bar.obj"), mesh).unwrap();
    let stated = MODEL.replace("position = [0.0, 0.0, 1.0]", "mass = 1.0\ninertia = [1, 1, 1]");
    fs::write(folder.join("model.toml"), stated).unwrap();
    assert_eq!(code(&folder, &["run", "model.toml", "-q", "-o", "out"]), 0);
    let page = fs::read_to_string(folder.join("out/report.html")).unwrap();
    println!("125,000 triangles: a page of {} bytes", page.len());
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    let note = page.split("Meshes are simplified here: ").nth(1).expect("a note");
    assert!(note.contains("of 125000 triangles are drawn"), "{}", &note[..80]);
}

/// The mesh of an included file stands beside that file, also in a folder of its own.
#[test]
fn an_included_file_names_its_mesh_from_its_own_folder() {
    let folder = folder("included");
    let body = MODEL.split("[[body]]").nth(1).unwrap().split("[[joint]]").next().unwrap();
    let body = format!("[[body]]{}", body.replace("parts/bar.obj", "bar.obj"));
    fs::write(folder.join("parts/bar.toml"), body).unwrap();
    let twice = r#"
include = ["parts/bar.toml", { file = "parts/bar.toml", prefix = "other_", position = [1.0, 0.0, 0.0] }]
model = { name = "bars" }
simulation = { step = 0.01, end = 0.1 }
"#;
    fs::write(folder.join("model.toml"), twice).unwrap();
    let output = holonom(&folder, &["run", "model.toml", "-o", "run", "-q"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    assert_eq!(copies(&folder.join("run")).len(), 1, "both bodies share one mesh");
    let text = fs::read_to_string(folder.join("run/model.toml")).unwrap();
    assert_eq!(text.matches("file = \"meshes/").count(), 2, "{text}");
}

/// A file in millimetres that is read as metres is far larger than the mechanism; a scale that is
/// stated says that it is meant.
#[test]
fn a_mesh_in_millimetres_is_warned_of() {
    let folder = folder("millimetres");
    let said = |scale: &str| {
        fs::write(folder.join("model.toml"), MODEL.replace(", scale = 0.1", scale)).unwrap();
        words(&holonom(&folder, &["check", "model.toml"]))
    };
    assert!(!said(", scale = 0.1").contains("millimetres"));
    let corner = |line: &str| {
        let numbers = line.strip_prefix("v ")?.split(' ');
        let large: Vec<String> =
            numbers.map(|x| (100.0 * x.parse::<f64>().unwrap()).to_string()).collect();
        Some(format!("v {}\n", large.join(" ")))
    };
    let large =
        angle_bar().lines().map(|l| corner(l).unwrap_or(format!("{l}\n"))).collect::<String>();
    fs::write(folder.join("parts/bar.obj"), large).unwrap();
    let warned = said("");
    assert!(
        warned.contains("measures 300 m") && warned.contains("write scale = 0.001"),
        "{warned}"
    );
    assert!(!said(", scale = 1.0").contains("millimetres"), "it is meant");
    assert!(!said(", scale = 0.001").contains("millimetres"));
}
