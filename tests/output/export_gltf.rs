//! Results for Blender and viewers of glTF: the structure of the file, and what other programs read
//! in it.
#![allow(clippy::unwrap_used)] // a test

use crate::output::export::{compared, python, run, run_let_go};
use crate::program::command::{folder, holonom, words};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A binary file taken apart.
struct Document {
    json: Value,
    bytes: Vec<u8>,
}

impl Document {
    /// Header and two chunks, as section 4 of the specification of glTF 2.0 has them.
    fn read(path: &Path) -> Self {
        let file = fs::read(path).unwrap();
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
        let json = word(12);
        assert_eq!((&file[16..20], json % 4), (&b"JSON"[..], 0));
        let binary = word(20 + json);
        assert_eq!((&file[24 + json..28 + json], 28 + json + binary), (&b"BIN\0"[..], file.len()));
        let document = serde_json::from_slice(&file[20..20 + json]).unwrap();
        Self { json: document, bytes: file[28 + json..].to_vec() }
    }

    fn list(&self, key: &str) -> &[Value] {
        self.json[key].as_array().map(Vec::as_slice).unwrap_or_default()
    }

    /// The numbers of an accessor of single precision, with the number of components.
    fn floats(&self, accessor: &Value) -> (Vec<f32>, usize) {
        let accessor = &self.list("accessors")[accessor.as_u64().unwrap() as usize];
        assert_eq!(accessor["componentType"], 5126);
        let components = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            other => panic!("{other}"),
        };
        let view = &self.list("bufferViews")[accessor["bufferView"].as_u64().unwrap() as usize];
        let begin = view["byteOffset"].as_u64().unwrap() as usize;
        let length = 4 * components * accessor["count"].as_u64().unwrap() as usize;
        assert_eq!(view["byteLength"].as_u64().unwrap() as usize, length);
        let numbers = self.bytes[begin..begin + length].chunks(4);
        let number = |four: &[u8]| f32::from_le_bytes(four.try_into().unwrap());
        (numbers.map(number).collect(), components)
    }
}

#[test]
fn the_file_keeps_the_rules_of_its_format() {
    for (model, animated) in [
        ("slider_crank.toml", true),
        ("flexible_multibody.toml", true),
        ("four_particles.toml", true),
        ("elbow_cantilever.toml", true),
    ] {
        let folder = folder("export_gltf", &format!("rules_{model}"));
        run(&folder, model, 12);
        let output = holonom(&folder, &["export", "run", "--format", "gltf"]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        let document = Document::read(&folder.join("run.glb"));
        assert_eq!(document.json["asset"]["version"], "2.0");
        assert_eq!(document.json["buffers"][0]["byteLength"], document.bytes.len());
        assert_eq!(!document.list("animations").is_empty(), animated);
        let mut corners = 0;
        for mesh in document.list("meshes") {
            for primitive in mesh["primitives"].as_array().unwrap() {
                let (points, _) = document.floats(&primitive["attributes"]["POSITION"]);
                let (normals, _) = document.floats(&primitive["attributes"]["NORMAL"]);
                assert_eq!(points.len(), normals.len());
                for normal in normals.chunks(3) {
                    let length = normal.iter().map(|n| n * n).sum::<f32>().sqrt();
                    assert!((length - 1.0).abs() < 1e-6, "{model}: normal of length {length}");
                }
                assert!(points.iter().all(|x| x.is_finite()));
                corners += points.len() / 3;
            }
        }
        assert!(corners > 100, "{corners} corners");
        for animation in document.list("animations") {
            for channel in animation["channels"].as_array().unwrap() {
                let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
                let (times, _) = document.floats(&sampler["input"]);
                assert!(times[0] == 0.0 && times.windows(2).all(|t| t[0] < t[1]), "{times:?}");
                let (values, components) = document.floats(&sampler["output"]);
                assert_eq!(values.len(), components * times.len());
                if channel["target"]["path"] == "rotation" {
                    let turns: Vec<&[f32]> = values.chunks(4).collect();
                    let dot =
                        |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
                    assert!(turns.iter().all(|q| (dot(q, q) - 1.0).abs() < 1e-6));
                    assert!(turns.windows(2).all(|q| dot(q[0], q[1]) > 0.0), "the sign jumps");
                }
            }
        }
        println!("{model}: {corners} corners, {} bytes", document.bytes.len());
    }
}

#[test]
fn an_option_of_another_format_is_refused() {
    let folder = folder("export_gltf", "refused");
    run(&folder, "pendulum.toml", 5);
    for (arguments, expected) in [
        (&["--format", "npz", "--frames", "10"][..], "npz holds all recorded nodes"),
        (&["--format", "gltf", "--frames", "1"][..], "write a whole number, 2 or more"),
    ] {
        let output = holonom(&folder, &[&["export", "run"], arguments].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(words(&output).contains(expected), "{}", words(&output));
    }
}

/// Every node that moves against `trajectory.csv`, and the surfaces of beams at their nodes.
const COMPARE: &str = r#"
import csv, numpy, pygltflib
f32 = numpy.float32
g = pygltflib.GLTF2().load("run.glb")
blob = g.binary_blob()
def array(k):
    a = g.accessors[k]
    v = g.bufferViews[a.bufferView]
    n = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[a.type]
    kind = {5126: "<f4", 5125: "<u4", 5121: "u1"}[a.componentType]
    return numpy.frombuffer(blob, kind, n * a.count, v.byteOffset).reshape(a.count, n)
rows = list(csv.reader(open("run/trajectory.csv")))
head, rows = rows[0], rows[1:]
data = {c: numpy.array([float(r[k]) for r in rows]) for k, c in enumerate(head)}
times, t = None, data["t"] - data["t"][0]
tracks = {}
for c in g.animations[0].channels:
    s = g.animations[0].samplers[c.sampler]
    times = array(s.input)[:, 0]
    tracks[c.target.node, c.target.path] = array(s.output)
assert len(times) == len(rows)
factor = times[-1] / t[-1]
assert abs(numpy.log10(factor) - round(numpy.log10(factor))) < 1e-6
def near(a, b): # one unit in the last place
    b = b.astype(f32)
    return numpy.all((a == b) | (a == numpy.nextafter(b, f32(numpy.inf))) | (a == numpy.nextafter(b, f32(-numpy.inf))))
assert near(times, t * round(factor, 12) if factor > 1 else t * factor)
def rotation(q):
    x, y, z, w = q.T.astype(float)
    return numpy.moveaxis(numpy.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]), 2, 0)
compared, worst, pose = 0, 0.0, {}
for k, node in enumerate(g.nodes):
    if node.name + ".x" not in head or node.translation is None or k not in g.nodes[0].children: continue
    moved = tracks.get((k, "translation"), numpy.tile(f32(node.translation), (len(rows), 1)))
    for i, axis in enumerate("xyz"):
        assert near(moved[:, i], data.get(node.name + "." + axis, 0 * t)), node.name
        compared += len(rows)
    turned = rotation(tracks.get((k, "rotation"), numpy.tile(f32(node.rotation), (len(rows), 1))))
    if node.name + ".d1x" in head:
        d = numpy.array([[data["%s.d%d%s" % (node.name, i, a)] for i in (1, 2, 3)] for a in "xyz"])
        worst = max(worst, abs(turned - numpy.moveaxis(d, 2, 0)).max())
    pose[k] = moved.astype(float), turned
assert worst < 5e-7, worst
skinned = 0.0
for node in g.nodes:
    if node.skin is None: continue
    skin, at = g.skins[node.skin], g.meshes[node.mesh].primitives[0].attributes
    points = numpy.c_[array(at.POSITION).astype(float), numpy.ones(len(array(at.POSITION)))]
    joints, weights = array(at.JOINTS_0), array(at.WEIGHTS_0)
    binds = array(skin.inverseBindMatrices).astype(float).reshape(-1, 4, 4).transpose(0, 2, 1)
    size = abs(points).max()
    for frame in [0, len(rows) // 2, len(rows) - 1]:
        for j, joint in enumerate(skin.joints): # what a joint alone moves is a section about its node
            own = points[(joints[:, 0] == j) & (weights[:, 0] == 1)] @ binds[j].T
            center, turn = pose[joint][0][frame], pose[joint][1][frame]
            moved = own[:, :3] @ turn.T + center
            skinned = max(skinned, abs(moved.mean(0) - center).max() / size)
            compared += 1
assert skinned < 1e-6, skinned
print(compared, worst, skinned)
"#;

#[test]
fn python_reads_the_motion_to_single_precision() {
    let Some(python) = python("pygltflib") else { return };
    for model in ["slider_crank.toml", "flying_beam.toml", "four_particles.toml", "rotor.toml"] {
        let folder = folder("export_gltf", model);
        run(&folder, model, 40);
        let output = holonom(&folder, &["export", "run", "--format", "gltf"]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        println!("{model}: {}", compared(&python, COMPARE, &folder));
    }
}

/// The scene as trimesh builds it, at rest: the bodies are where the first row has them, with y
/// upwards.
const SCENE: &str = r#"
import csv, numpy, trimesh
scene = trimesh.load("run.glb")
rows = list(csv.reader(open("run/trajectory.csv")))
row = dict(zip(rows[0], map(float, rows[1])))
worst, count = 0.0, 0
for name in scene.graph.nodes:
    if name + ".d1x" in row and name in scene.graph.nodes_geometry:
        at = scene.graph.get(name)[0][:3, 3]
        x, y, z = (row[name + "." + a] for a in "xyz")
        worst = max(worst, abs(at - [x, z, -y]).max())
        count += 1
assert count > 0 and worst < 1e-6, (count, worst)
assert all(g.is_winding_consistent and g.volume > 0 for g in scene.geometry.values())
print(count, worst)
"#;

#[test]
fn another_reader_sees_the_bodies_where_they_are() {
    let Some(python) = python("trimesh") else { return };
    for model in ["flexible_multibody.toml", "heavy_top.toml"] {
        let folder = folder("export_gltf", &format!("scene_{model}"));
        run(&folder, model, 5);
        let output = holonom(&folder, &["export", "run", "--format", "gltf"]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        println!("{model}: {}", compared(&python, SCENE, &folder));
    }
}

/// What an event released has no size from the first frame after that on, and that at once.
#[test]
fn what_is_released_vanishes() {
    let folder = folder("export_gltf", "let_go");
    run_let_go(&folder);
    let output = holonom(&folder, &["export", "run", "--format", "gltf"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let document = Document::read(&folder.join("run.glb"));
    let animation = &document.list("animations")[0];
    let mut names = Vec::new();
    for channel in animation["channels"].as_array().unwrap() {
        let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
        if sampler["interpolation"] != "STEP" {
            continue;
        }
        assert_eq!(channel["target"]["path"], "scale");
        let node = &document.list("nodes")[channel["target"]["node"].as_u64().unwrap() as usize];
        assert!(node["mesh"].is_u64(), "{node}");
        names.push(node["name"].as_str().unwrap().to_owned());
        let (scales, _) = document.floats(&sampler["output"]);
        assert_eq!(scales.len(), 3 * 51);
        for (frame, scale) in scales.chunks(3).enumerate() {
            let there = if frame < 21 { [1.0; 3] } else { [0.0; 3] };
            assert_eq!(scale, there, "frame {frame}");
        }
    }
    names.sort();
    assert_eq!(names, ["coil", "cord", "mount", "pin"]);
}
