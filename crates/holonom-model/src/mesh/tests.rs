use std::f64::consts::PI;
use std::fs;

use nalgebra::Matrix3;

use super::*;
use crate::{Inertia, ModelError, Override};

/// A folder with the file `part.obj`.
fn folder(name: &str, mesh: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("holonom-{name}-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("part.obj"), mesh).unwrap();
    folder
}

fn text(keys: &str, shape: &str) -> String {
    format!(
        "[model]\nname = \"mesh\"\n[simulation]\nstep = 0.01\nend = 1\n[[body]]\nname = \"part\"\n{keys}\n\
         shape = {{ type = \"mesh\", {shape} }}\n"
    )
}

/// A model of one body with a mesh.
fn model(name: &str, mesh: &str, keys: &str, shape: &str) -> Result<Model, ModelError> {
    let folder = folder(name, mesh);
    let read = Model::from_toml_in(&text(keys, shape), &[], Meshes::in_folder(&folder));
    fs::remove_dir_all(folder).unwrap();
    read
}

/// A box with edges 1, 2, 3 from a corner.
fn block([x, y, z]: [f64; 3]) -> String {
    let corner = |k: u32| {
        let at = |bit: u32, length: f64| if k & bit == 0 { 0.0 } else { length };
        format!("v {} {} {}\n", x + at(1, 1.0), y + at(2, 2.0), z + at(4, 3.0))
    };
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    (0..8).map(corner).collect::<String>() + faces
}

/// Points of a sphere on rings of latitude, with poles.
fn ball(rings: usize) -> String {
    let (sides, mut text) = (2 * rings, "v 0 0 -1\n".to_owned());
    for ring in 1..rings {
        let (s, c) = (PI * (ring as f64 / rings as f64 - 0.5)).sin_cos();
        for side in 0..sides {
            let (sin, cos) = (2.0 * PI * side as f64 / sides as f64).sin_cos();
            text += &format!("v {} {} {s}\n", c * cos, c * sin);
        }
    }
    text += "v 0 0 1\n";
    let at = |ring: usize, side: usize| 2 + (ring - 1) * sides + side % sides;
    for side in 0..sides {
        text += &format!("f 1 {} {}\n", at(1, side + 1), at(1, side));
        for ring in 1..rings - 1 {
            let [a, b] = [at(ring, side), at(ring, side + 1)];
            text += &format!("f {a} {b} {} {}\n", at(ring + 1, side + 1), at(ring + 1, side));
        }
        text += &format!("f {} {} -1\n", at(rings - 1, side), at(rings - 1, side + 1));
    }
    text
}

#[test]
fn a_box_of_triangles_weighs_what_the_box_weighs() {
    let mesh = block([5.0, -7.0, 11.0]);
    let shape = "file = \"part.obj\", scale = [0.1, -0.1, 0.2], density = 500.0";
    let model = model("box", &mesh, "", shape).unwrap();
    let body = &model.bodies[0];
    let lengths = [0.1, 0.2, 0.6];
    let exact = vi_rigid::Shape::Box { lengths }.mass_properties(500.0).unwrap();
    let error = (body.mass.unwrap() / exact.mass - 1.0).abs();
    assert!(error < 1e-13, "mass: {error:e}");
    let inertia = Matrix3::from_diagonal(&exact.inertia.moments().into());
    let error = (body.inertia_tensor() - inertia).amax() / inertia.amax();
    assert!(error < 1e-13, "inertia: {error:e}");
    let [low, high] = model.surface(body).unwrap().ends();
    let centred = (low + high).amax().max(((high - low) - Vector3::from(lengths)).amax());
    assert!(centred < 1e-14, "placed by the centre of mass: {centred:e}");
    assert!((model.shape_size(body).unwrap() - 0.6).abs() < 1e-14);
}

#[test]
fn a_turned_mesh_has_the_turned_inertia() {
    let half = 0.5_f64.sqrt();
    let shape = "file = \"part.obj\", density = 1.0";
    let straight = model("straight", &block([0.0; 3]), "", shape).unwrap();
    let turned = format!("{shape}, quaternion = [{half:?}, {half:?}, 0.0, 0.0]");
    let turned = model("turned", &block([0.0; 3]), "", &turned).unwrap();
    let [a, b] = [straight, turned].map(|model| model.bodies[0].inertia_tensor().diagonal());
    let error = (Vector3::new(a.x, a.z, a.y) - b).amax() / a.amax();
    assert!(error < 1e-14, "{a} {b}: {error:e}");
}

#[test]
fn finer_meshes_of_a_ball_approach_its_mass_and_inertia_with_order_2() {
    let errors = [8, 16].map(|rings| {
        let shape = "file = \"part.obj\", density = 3.0";
        let model = model(&format!("ball{rings}"), &ball(rings), "", shape).unwrap();
        let exact = 3.0 * 4.0 / 3.0 * PI;
        let found = model.bodies[0].inertia_tensor();
        let inertia = (found - Matrix3::identity() * (0.4 * exact)).amax();
        [1.0 - model.bodies[0].mass.unwrap() / exact, inertia / (0.4 * exact)]
    });
    for (coarse, fine) in errors[0].iter().zip(errors[1]) {
        let order = (coarse / fine).log2();
        assert!((order - 2.0).abs() < 0.1, "order {order}: {coarse:e}, {fine:e}");
    }
}

#[test]
fn a_resolved_model_needs_the_mesh_for_the_picture_alone() {
    let mesh = block([1.0, 2.0, 3.0]);
    let first = model("first", &mesh, "", "file = \"part.obj\", density = 2.0").unwrap();
    let open = mesh.replace("f 1 3 4 2\n", "");
    let folder = folder("again", &open);
    let again = Model::from_toml_in(&first.to_toml(), &[], Meshes::in_folder(&folder)).unwrap();
    assert_eq!(again.bodies, first.bodies);
    let other = again.meshes.iter().next().unwrap().stored_name();
    assert_ne!(first.meshes.iter().next().unwrap().stored_name(), other);
    assert!(again.to_stored_toml().contains(&format!("meshes/{other}")));
    let changed = [Override::new("body.part.shape.scale", "2.0")];
    fs::remove_dir_all(folder).unwrap();
    assert!(again.with_overrides(&changed).is_ok(), "meshes that are known are not read again");
}

#[test]
fn a_mass_that_is_stated_scales_the_inertia_of_the_mesh() {
    let shape = "file = \"part.obj\"";
    let model = model("stated", &block([0.0; 3]), "mass = 12.0", shape).unwrap();
    let Some(Inertia::Principal(found)) = model.bodies[0].inertia else { panic!("principal") };
    let error = found.iter().zip([13.0, 10.0, 5.0]).map(|(a, b)| (a - b).abs());
    assert!(error.clone().all(|e| e < 1e-13), "{found:?}");
}

#[test]
fn meshes_that_cannot_be_used_are_refused_with_a_place_and_a_remedy() {
    let whole = block([0.0; 3]);
    let open = whole.replace("f 1 3 4 2\n", "");
    let weighed = "file = \"part.obj\", density = 1.0";
    let flat = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n";
    let reversed = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n";
    let cases = [
        (open.as_str(), "", weighed),
        (reversed, "", weighed),
        (flat, "", weighed),
        ("", "", weighed),
        ("v 0 0 0\nv 1 0 oops\n", "", weighed),
        (&whole, "", "file = \"none.obj\", density = 1.0"),
        (&whole, "", "file = \".\", density = 1.0"),
        (&whole, "", "file = \"part.dae\", density = 1.0"),
        (&whole, "", "file = \"part.obj\""),
        (&whole, "", "density = 1.0"),
        (&whole, "", "file = \"part.obj\", density = 1.0, scale = 0.0"),
        (&whole, "", "file = \"part.obj\", density = 1.0, scale = [1.0, 2.0]"),
        (&whole, "", "file = \"part.obj\", density = 1.0, dimensions = [1.0]"),
        (&whole, "", "file = \"part.obj\", density = 1.0, quaternion = [1.0, 1.0, 0.0, 0.0]"),
        (&whole, "", "file = \"part.obj\", density = 1.0, position = [0.0, 0.0, 0.0]"),
    ];
    let mut report = String::new();
    for (mesh, keys, shape) in cases {
        let source = text(keys, shape);
        let answer = model("refused", mesh, keys, shape);
        report += &format!("{shape}\n");
        match answer {
            Ok(model) => report += &format!("  accepted: {:?}\n", model.bodies[0].mass),
            Err(error) => {
                for problem in error.problems(&source) {
                    let help = problem.help.as_deref().unwrap_or_default();
                    report += &format!("  {problem}\n    help: {help}\n");
                }
            }
        }
    }
    insta::assert_snapshot!(report);
}

#[test]
fn an_open_mesh_serves_as_a_picture() {
    let open = block([0.0; 3]).replace("f 1 3 4 2\n", "");
    let keys = "mass = 1.0\ninertia = [1.0, 1.0, 1.0]";
    let model = model("open", &open, keys, "file = \"part.obj\"").unwrap();
    assert_eq!(model.surface(&model.bodies[0]).unwrap().triangles.len(), 10);
    assert_eq!(model.bodies[0].shape.as_ref().unwrap().position, None);
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_not_opened() {
    let folder = folder("pipe", "");
    for target in ["/dev/zero", "/dev/stdin"] {
        let link = folder.join("zero.stl");
        let _ = fs::remove_file(&link);
        std::os::unix::fs::symlink(target, &link).unwrap();
        let found = Mesh::read(&link);
        assert!(!matches!(found, Ok(_) | Err(MeshError::TooLarge)), "{target}: {found:?}");
    }
    assert_eq!(Mesh::read(Path::new("/dev/zero")), Err(MeshError::Format));
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_stored_file_with_another_content_is_refused() {
    let folder = folder("stored", "");
    fs::create_dir_all(folder.join("meshes")).unwrap();
    let mesh = Mesh::from_bytes(Path::new("a.obj"), block([0.0; 3]).into_bytes()).unwrap();
    let name = mesh.stored_name();
    let read = || Meshes::in_folder(&folder).load(&format!("meshes/{name}"));
    fs::write(folder.join("meshes").join(&name), mesh.bytes()).unwrap();
    assert_eq!(read().as_deref(), Ok(&mesh));
    fs::write(folder.join("meshes").join(&name), block([1.0; 3])).unwrap();
    assert_eq!(read(), Err(MeshError::Changed));
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_shape_of_a_picture_has_a_place_and_no_density() {
    let read = |picture: &str| {
        let keys = format!("mass = 1\ninertia = [1, 1, 1]\npicture = [{picture}]");
        let shape = "file = \"part.obj\"";
        let wanted =
            text(&keys, shape).replace(&format!("shape = {{ type = \"mesh\", {shape} }}\n"), "");
        Model::from_toml(&wanted)
    };
    let placed = "{ type = \"rod\", dimensions = [2, 0.1], position = [0, 0, 3] }";
    let model = read(placed).unwrap();
    let [low, high] = model.surface(&model.bodies[0]).unwrap().ends();
    assert!((low.z - 2.0).abs().max((high.z - 4.0).abs()) < 1e-15, "{low} {high}");
    assert!((model.shape_size(&model.bodies[0]).unwrap() - 2.0).abs() < 1e-15);
    let faults = [
        ("{ type = \"sphere\", dimensions = [1], density = 2 }", "weighs nothing"),
        ("{ type = \"sphere\", dimensions = [1, 2] }", "dimension(s)"),
        ("{ type = \"sphere\", dimensions = [1], scale = 2 }", "type = \"mesh\" alone"),
        ("{ type = \"mesh\" }", "no file"),
        ("{ type = \"mesh\", file = \"/nowhere.stl\" }", "not found"),
    ];
    for (picture, expected) in faults {
        let error = read(&format!("{placed}, {picture}")).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains("picture[1]"), "{picture}: {error}");
    }
}
