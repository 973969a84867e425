//! An animated scene for Blender and other programs that read glTF 2.0: one binary file (`.glb`).
//!
//! ```text
//! root              turns the axes of the run so that y points upwards, as glTF demands
//! ├ bodies          translation and rotation from centre and directors; the symbols of joints hang on the child
//! ├ bars, springs   translation, rotation, length
//! └ nodes of beams  translation and rotation
//! surfaces of beams are skins over their nodes
//! ```
//! Numbers are single precision, times those of the motion or a power of ten of them, so that it lasts from 1 s to 100 s.

mod buffer;
mod motion;
mod skin;

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde_json::{Value, json};
use std::io::{self, Write};

use crate::coil::coil;
use crate::look::{Color, INK, NamedLine, point, symbol};
use crate::mesh::{Mesh, along, stick};
use crate::run::Run;
use crate::tube::Pose;
use crate::{ExportError, Exported};
use buffer::Buffer;
use motion::{Motion, quaternion, rests, single};

/// Frames in a second of an animation of statics.
const STATIC_RATE: f64 = 10.0;
/// Shortest and longest animation, s.
const LENGTHS: [f64; 2] = [1.0, 100.0];
/// Rounding errors of a span of times, as a part of it.
const ROUNDING: f64 = 1e-9;

/// The file and what is said of it.
#[derive(Debug)]
pub(crate) struct Scene {
    json: Value,
    bytes: Vec<u8>,
    /// What it holds.
    pub(crate) exported: Exported,
}

impl Scene {
    /// Of the frames of a run.
    pub(crate) fn of(run: &Run<'_>) -> Result<Self, ExportError> {
        let mut times = Vec::new();
        let mut poses: Vec<Vec<Pose>> = Vec::new();
        for (index, frame) in run.frames()?.enumerate() {
            let frame = frame.map_err(|error| run.unreadable(&error))?;
            times.push(run.time(&frame, index));
            poses.push(run.poses(&frame));
        }
        let pace = if run.is_static() { None } else { pace(&times) };
        let scale = if run.is_static() { 1.0 / STATIC_RATE } else { pace.unwrap_or(1.0) };
        let begin = times.first().copied().unwrap_or_default();
        let times: Vec<f32> = times.iter().map(|t| ((t - begin) * scale) as f32).collect();
        // times that are one in single precision are one frame
        let kept: Vec<usize> =
            (0..times.len()).filter(|&k| k == 0 || times[k] > times[k - 1]).collect();
        let poses: Vec<&[Pose]> = kept.iter().map(|&k| &poses[k][..]).collect();
        let times: Vec<f32> = kept.iter().map(|&k| times[k]).collect();
        let exported = Exported { frames: times.len(), recorded: run.recorded, pace };
        let mut writer = Writer::new(&run.model.header.name, &run.look.up, &times);
        writer.run(run, &poses);
        let (json, bytes) = writer.finish();
        Ok(Self { json, bytes, exported })
    }

    /// Writes the file.
    pub(crate) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let mut json = serde_json::to_vec(&self.json)?;
        json.resize(json.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + json.len() + 8 + self.bytes.len();
        let word = |n: usize| {
            let n = u32::try_from(n).map_err(|_| {
                io::Error::other("more than 4 GiB: choose fewer frames with --frames N")
            })?;
            Ok::<_, io::Error>(n.to_le_bytes())
        };
        out.write_all(b"glTF")?;
        out.write_all(&word(2)?)?;
        out.write_all(&word(length)?)?;
        for (kind, bytes) in [(b"JSON", &json), (b"BIN\0", &self.bytes)] {
            out.write_all(&word(bytes.len())?)?;
            out.write_all(kind)?;
            out.write_all(bytes)?;
        }
        Ok(())
    }
}

/// The factor of the times of an animation, a power of ten; `None` for 1.
fn pace(times: &[f64]) -> Option<f64> {
    let span = times.last()? - times.first()?;
    let [shortest, longest] = LENGTHS;
    let exponent = match span {
        _ if span <= 0.0 => return None,
        _ if span < shortest => ((shortest / span).log10() - ROUNDING).ceil(),
        _ if span > longest => ((longest / span).log10() + ROUNDING).floor(),
        _ => return None,
    };
    Some(10f64.powf(exponent)).filter(|pace| pace.is_normal() && exponent.abs() >= 1.0)
}

/// Collects the parts of a file.
struct Writer {
    world: Rotation3<f64>,
    buffer: Buffer,
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<(Color, Value)>,
    skins: Vec<Value>,
    channels: Vec<Value>,
    samplers: Vec<Value>,
    /// Accessor of the times; `None` for a single frame.
    times: Option<usize>,
    /// Nodes that hang on nothing: the root, and what skins deform.
    roots: Vec<usize>,
    name: String,
}

impl Writer {
    fn new(name: &str, up: &[f64; 3], times: &[f32]) -> Self {
        let up = Vector3::from(*up);
        // no rotation is the only one to the opposite direction: one about the first axis is taken
        let world = Rotation3::rotation_between(&up, &Vector3::y()).unwrap_or_else(|| {
            Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        });
        let mut buffer = Buffer::default();
        let times = (times.len() > 1).then(|| buffer.times(times));
        let root = json!({ "name": name, "rotation": quaternion(world.matrix()), "children": [] });
        Self {
            world,
            buffer,
            nodes: vec![root],
            meshes: Vec::new(),
            materials: Vec::new(),
            skins: Vec::new(),
            channels: Vec::new(),
            samplers: Vec::new(),
            times,
            roots: vec![0],
            name: name.to_owned(),
        }
    }

    fn run(&mut self, run: &Run<'_>, poses: &[&[Pose]]) {
        let look = &run.look;
        let Some(first) = poses.first() else { return };
        let mut held = vec![0; run.members.len()]; // the node of each member
        for solid in &look.solids {
            let mesh = self.mesh(&solid.name, &solid.mesh, solid.color);
            let node = match solid.member {
                Some(member) => self.member(&solid.name, member, poses),
                None => self.node(json!({ "name": solid.name }), 0),
            };
            self.nodes[node]["mesh"] = json!(mesh);
            solid.member.into_iter().for_each(|member| held[member] = node);
        }
        for beam in &look.beams {
            for (k, skin) in skin::skins(beam, first).into_iter().enumerate() {
                for member in
                    skin.nodes.clone().filter(|member| held[*member] == 0).collect::<Vec<_>>()
                {
                    held[member] = self.member(&run.members[member].name, member, poses);
                }
                let name = if k == 0 { beam.name.clone() } else { format!("{} {k}", beam.name) };
                self.skin(&name, (&skin, beam.color), &held, first);
            }
        }
        for joint in &look.joints {
            let (parent, child) = (&joint.joint.parent, &joint.joint.child);
            let axes = |member: i64| match usize::try_from(member) {
                Ok(member) => first[member].directors,
                Err(_) => Matrix3::identity(),
            };
            let turn = |member, axis: Option<[f64; 3]>| {
                let axis = axis.map_or(Vector3::from(look.up), Vector3::from);
                axes(child.member).tr_mul(&(axes(member) * axis)) // along the directors of the child
            };
            let both =
                [turn(parent.member, joint.joint.axis), turn(child.member, joint.joint.axis2)];
            let mesh = symbol(joint.joint.kind, both, look.symbol);
            let mesh = self.mesh(&joint.name, &mesh, INK);
            let holder = usize::try_from(child.member).map_or(0, |member| held[member]);
            let place = single(&Vector3::from(child.point));
            self.node(json!({ "name": joint.name, "mesh": mesh, "translation": place }), holder);
        }
        for line in &look.lines {
            self.line(line, poses, look.symbol);
        }
    }

    /// A node below another one.
    fn node(&mut self, node: Value, parent: usize) -> usize {
        let index = self.nodes.len();
        self.nodes.push(node);
        let parent = &mut self.nodes[parent];
        match parent.get_mut("children").and_then(Value::as_array_mut) {
            Some(children) => children.push(json!(index)),
            None => parent["children"] = json!([index]),
        }
        index
    }

    /// The node of a member.
    fn member(&mut self, name: &str, member: usize, poses: &[&[Pose]]) -> usize {
        let mut motion = Motion::default();
        poses.iter().for_each(|frame| motion.push(&frame[member], None));
        self.moving(name, motion)
    }

    /// A node that moves.
    fn moving(&mut self, name: &str, motion: Motion) -> usize {
        let Motion { translations, rotations, scales } = &motion;
        let mut node = json!({ "name": name });
        node["translation"] = json!(translations[0]);
        node["rotation"] = json!(rotations[0]);
        if let Some(scale) = scales.first() {
            node["scale"] = json!(scale);
        }
        let index = self.node(node, 0);
        let Some(times) = self.times else { return index };
        let mut channel = |path: &str, output: usize| {
            let target = json!({ "node": index, "path": path });
            self.channels.push(json!({ "sampler": self.samplers.len(), "target": target }));
            let sampler = json!({ "input": times, "output": output, "interpolation": "LINEAR" });
            self.samplers.push(sampler);
        };
        if !rests(translations) {
            channel("translation", self.buffer.vectors(translations));
        }
        if !rests(rotations) {
            channel("rotation", self.buffer.rotations(rotations));
        }
        if !rests(scales) {
            channel("scale", self.buffer.vectors(scales));
        }
        index
    }

    fn material(&mut self, color: Color) -> usize {
        if let Some(known) = self.materials.iter().position(|(own, _)| *own == color) {
            return known;
        }
        let [r, g, b] = color.map(linear);
        let metal = json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6 });
        self.materials.push((color, json!({ "pbrMetallicRoughness": metal })));
        self.materials.len() - 1
    }

    fn mesh(&mut self, name: &str, mesh: &Mesh, color: Color) -> usize {
        let attributes = self.attributes(mesh, &Rotation3::identity());
        self.primitive(name, mesh, attributes, color)
    }

    fn attributes(&mut self, mesh: &Mesh, turn: &Rotation3<f64>) -> Value {
        let all = |values: &[[f64; 3]]| -> Vec<[f32; 3]> {
            values.iter().map(|x| single(&(turn * Vector3::from(*x)))).collect()
        };
        json!({
            "POSITION": self.buffer.positions(&all(&mesh.points)),
            "NORMAL": self.buffer.normals(&all(&mesh.normals)),
        })
    }

    fn primitive(&mut self, name: &str, mesh: &Mesh, attributes: Value, color: Color) -> usize {
        let indices = self.buffer.triangles(&mesh.triangles);
        let material = self.material(color);
        let primitive =
            json!({ "attributes": attributes, "indices": indices, "material": material });
        self.meshes.push(json!({ "name": name, "primitives": [primitive] }));
        self.meshes.len() - 1
    }

    /// A surface that nodes deform; `held`: the nodes of members.
    fn skin(
        &mut self,
        name: &str,
        (skin, color): (&skin::Skin, Color),
        held: &[usize],
        first: &[Pose],
    ) {
        let (joints, weights): (Vec<_>, Vec<_>) =
            skin.tube.sections.iter().map(skin::influence).unzip();
        let world = self.world;
        let surface = skin.tube.mesh();
        let mut attributes = self.attributes(&surface, &world);
        attributes["JOINTS_0"] = json!(self.buffer.joints(&joints));
        attributes["WEIGHTS_0"] = json!(self.buffer.weights(&weights));
        let mesh = self.primitive(name, &surface, attributes, color);
        let nodes: Vec<usize> = skin.nodes.clone().map(|member| held[member]).collect();
        let binds: Vec<[f32; 16]> =
            first[skin.nodes.clone()].iter().map(|pose| skin::inverse_bind(pose, &world)).collect();
        let binds = self.buffer.matrices(&binds);
        let own = json!({ "name": name, "joints": nodes, "inverseBindMatrices": binds });
        self.skins.push(own);
        self.roots.push(self.nodes.len());
        self.nodes.push(json!({ "name": name, "mesh": mesh, "skin": self.skins.len() - 1 }));
    }

    /// A bar or a spring between its ends, which is as long as it is at the first frame and scaled along.
    fn line(&mut self, line: &NamedLine, poses: &[&[Pose]], symbol: f64) {
        let ends = |frame: &[Pose]| [&line.line.from, &line.line.to].map(|end| point(end, frame));
        // of two ends at one point nothing is seen, but the scale stays one that can be inverted
        let length = |[from, to]: &[Vector3<f64>; 2]| (to - from).norm().max(1e-6 * symbol);
        let first = poses.first().map_or(symbol, |frame| length(&ends(frame)));
        let mut motion = Motion::default();
        for frame in poses {
            let both = ends(frame);
            let directors = along(&(both[1] - both[0])).unwrap_or_else(Matrix3::identity);
            let pose = Pose { center: 0.5 * (both[0] + both[1]), directors };
            motion.push(&pose, Some([1.0, 1.0, length(&both) / first]));
        }
        let half = Vector3::z() * (0.5 * first);
        let mesh = match line.spring {
            true => coil(1.2 * symbol, first, 0.25 * symbol),
            false => stick(&-half, &half, 0.4 * symbol).unwrap_or_default(),
        };
        let mesh = self.mesh(&line.name, &mesh, INK);
        let node = self.moving(&line.name, motion);
        self.nodes[node]["mesh"] = json!(mesh);
    }

    /// The document and its binary part.
    fn finish(self) -> (Value, Vec<u8>) {
        let materials: Vec<Value> =
            self.materials.into_iter().map(|(_, material)| material).collect();
        let generator = concat!("holonom ", env!("CARGO_PKG_VERSION"));
        let mut json = json!({
            "asset": { "version": "2.0", "generator": generator },
            "scene": 0,
            "scenes": [{ "name": self.name, "nodes": self.roots }],
            "nodes": self.nodes,
            "buffers": [{ "byteLength": self.buffer.bytes.len() }],
        });
        for (key, values) in [
            ("meshes", self.meshes),
            ("materials", materials),
            ("skins", self.skins),
            ("accessors", self.buffer.accessors),
            ("bufferViews", self.buffer.views),
        ] {
            if !values.is_empty() {
                json[key] = Value::Array(values);
            }
        }
        if !self.channels.is_empty() {
            let (channels, samplers) = (self.channels, self.samplers);
            json["animations"] =
                json!([{ "name": "motion", "channels": channels, "samplers": samplers }]);
        }
        (json, self.buffer.bytes)
    }
}

/// A component of a colour as light is added.
fn linear(component: u8) -> f64 {
    let c = f64::from(component) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_animation_lasts_from_one_second_to_a_hundred() {
        for (span, expected) in [
            (0.0, None),
            (1.0, None),
            (100.0, None),
            (0.99, Some(10.0)),
            (0.01, Some(100.0)),
            (2e-7, Some(1e7)),
            (101.0, Some(0.1)),
            (86400.0, Some(1e-3)),
        ] {
            let found = pace(&[3.0, 3.5, 3.0 + span]);
            let same = match (found, expected) {
                (Some(found), Some(expected)) => (found / expected - 1.0_f64).abs() < 1e-12,
                (found, expected) => found == expected,
            };
            assert!(same, "{span} s: {found:?}, expected {expected:?}");
        }
    }
}
