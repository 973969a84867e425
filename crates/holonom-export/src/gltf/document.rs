//! The nodes, surfaces and animations of a file.

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde_json::{Value, json};

use super::buffer::Buffer;
use super::motion::{NodeAnimation, quaternion, rests, single};
use super::skin;
use crate::coil::coil;
use crate::look::{INK, Look, NamedJoint, NamedLine, Rgb, foot, holds, point, symbol};
use crate::mesh::{SurfaceMesh, along, stick};
use crate::run::ShownRun;
use crate::tube::MemberPose;
use holonom_report::scene::parts::SceneJoint;

/// Collects the parts of a file.
pub(super) struct DocumentWriter {
    world: Rotation3<f64>,
    buffer: Buffer,
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<((Rgb, f64), Value)>,
    skins: Vec<Value>,
    channels: Vec<Value>,
    samplers: Vec<Value>,
    /// Accessor of the times; `None` for a single frame.
    times: Option<usize>,
    /// Nodes that hang on nothing: the root, and what skins deform.
    roots: Vec<usize>,
    name: String,
}

impl DocumentWriter {
    /// Of a run of a name at times of the animation, s; `up`: unit vector against gravity.
    pub(super) fn new(name: &str, up: &[f64; 3], times: &[f32]) -> Self {
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

    /// Adds all that is shown; `poses`: of the members at each time.
    pub(super) fn run(&mut self, run: &ShownRun<'_>, poses: &[&[MemberPose]], times: &[f64]) {
        let look = &run.look;
        let Some(first) = poses.first() else { return };
        let mut held = vec![0; run.members.len()]; // the node of each member
        for solid in &look.solids {
            held[solid.member] = self.member(&solid.name, solid.member, poses);
            let look = (solid.color, solid.opacity);
            self.show(held[solid.member], &solid.name, &solid.mesh, look);
        }
        for beam in &look.beams {
            for leg in beam.legs() {
                for member in leg {
                    held[member] = self.member(&run.members[member].name, member, poses);
                }
            }
            for (k, skin) in skin::skins(beam, first).into_iter().enumerate() {
                let name = if k == 0 { beam.name.clone() } else { format!("{} {k}", beam.name) };
                self.skin(&name, &skin, beam.color, 1.0, &held, first);
            }
        }
        for joint in &look.joints {
            let holder = usize::try_from(joint.joint.child.member).map_or(0, |child| held[child]);
            let node = self.joint(joint, holder, look, first);
            self.hide(node, joint.joint.until, times);
        }
        for line in &look.lines {
            let node = self.line(line, poses, look.symbol);
            self.hide(node, line.line.until, times);
        }
        for place in &look.feet {
            let place = single(&Vector3::from(*place));
            let node = self.node(json!({ "name": "ground", "translation": place }), 0);
            self.show(node, "ground", &foot(&look.up, look.symbol), (INK, 1.0));
        }
    }

    /// The symbol of a joint on the node of its child.
    fn joint(
        &mut self,
        named: &NamedJoint,
        holder: usize,
        look: &Look,
        first: &[MemberPose],
    ) -> usize {
        let SceneJoint { symbol: parts, parent, child, axis, axis2, limit, .. } = &named.joint;
        let axes = |member: i64| match usize::try_from(member) {
            Ok(member) => first[member].directors,
            Err(_) => Matrix3::identity(),
        };
        let turned = |member, axis: &Option<[f64; 3]>| {
            let axis = axis.map_or(Vector3::from(look.up), Vector3::from);
            axes(child.member).tr_mul(&(axes(member) * axis)) // along the directors of the child
        };
        let both = [turned(parent.member, axis), turned(child.member, axis2)];
        let place = single(&Vector3::from(child.point));
        let node = self.node(json!({ "name": named.name, "translation": place }), holder);
        let mesh = symbol(parts, both, look.symbol.min(*limit));
        self.show(node, &named.name, &mesh, (INK, 1.0));
        node
    }

    /// Hides what an event released: a scale of zero on all axes, as the format says.
    fn hide(&mut self, node: usize, until: Option<f64>, times: &[f64]) {
        let Some(input) = self.times.filter(|_| !times.iter().all(|t| holds(until, *t))) else {
            return;
        };
        let scales: Vec<[f32; 3]> =
            times.iter().map(|t| if holds(until, *t) { [1.0; 3] } else { [0.0; 3] }).collect();
        let output = self.buffer.vectors(&scales);
        let target = json!({ "node": node, "path": "scale" });
        self.channels.push(json!({ "sampler": self.samplers.len(), "target": target }));
        let sampler = json!({ "input": input, "output": output, "interpolation": "STEP" });
        self.samplers.push(sampler);
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
    fn member(&mut self, name: &str, member: usize, poses: &[&[MemberPose]]) -> usize {
        let mut motion = NodeAnimation::default();
        poses.iter().for_each(|frame| motion.push(&frame[member], None));
        self.moving(name, motion)
    }

    /// A node that moves.
    fn moving(&mut self, name: &str, motion: NodeAnimation) -> usize {
        let NodeAnimation { translations, rotations, scales } = &motion;
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

    /// Of a colour and an opacity.
    #[allow(clippy::float_cmp)] // a stated number is that number
    fn material(&mut self, look: (Rgb, f64)) -> usize {
        if let Some(known) = self.materials.iter().position(|(own, _)| *own == look) {
            return known;
        }
        let (color, opacity) = look;
        let [r, g, b] = color.map(linear);
        let metal = json!({ "baseColorFactor": [r, g, b, opacity], "metallicFactor": 0.0, "roughnessFactor": 0.6 });
        // meshes may be open
        let mut material = json!({ "pbrMetallicRoughness": metal, "doubleSided": true });
        if opacity < 1.0 {
            material["alphaMode"] = json!("BLEND");
        }
        self.materials.push((look, material));
        self.materials.len() - 1
    }

    /// Hangs a surface on a node; one without triangles is left out.
    fn show(&mut self, node: usize, name: &str, mesh: &SurfaceMesh, (color, opacity): (Rgb, f64)) {
        if !mesh.triangles.is_empty() {
            let attributes = self.attributes(mesh, &Rotation3::identity());
            self.nodes[node]["mesh"] =
                json!(self.primitive(name, mesh, attributes, color, opacity));
        }
    }

    fn attributes(&mut self, mesh: &SurfaceMesh, turn: &Rotation3<f64>) -> Value {
        let all = |values: &[[f64; 3]]| -> Vec<[f32; 3]> {
            values.iter().map(|x| single(&(turn * Vector3::from(*x)))).collect()
        };
        json!({
            "POSITION": self.buffer.positions(&all(&mesh.points)),
            "NORMAL": self.buffer.normals(&all(&mesh.normals)),
        })
    }

    fn primitive(
        &mut self,
        name: &str,
        mesh: &SurfaceMesh,
        attributes: Value,
        color: Rgb,
        opacity: f64,
    ) -> usize {
        let indices = self.buffer.triangles(&mesh.triangles);
        let material = self.material((color, opacity));
        let primitive =
            json!({ "attributes": attributes, "indices": indices, "material": material });
        self.meshes.push(json!({ "name": name, "primitives": [primitive] }));
        self.meshes.len() - 1
    }

    /// A surface that nodes deform; `held`: the nodes of members.
    fn skin(
        &mut self,
        name: &str,
        skin: &skin::Skin,
        color: Rgb,
        opacity: f64,
        held: &[usize],
        first: &[MemberPose],
    ) {
        let (joints, weights): (Vec<_>, Vec<_>) =
            skin.tube.sections.iter().map(skin::influence).unzip();
        let world = self.world;
        let surface = skin.tube.mesh();
        let mut attributes = self.attributes(&surface, &world);
        attributes["JOINTS_0"] = json!(self.buffer.joints(&joints));
        attributes["WEIGHTS_0"] = json!(self.buffer.weights(&weights));
        let mesh = self.primitive(name, &surface, attributes, color, opacity);
        let nodes: Vec<usize> = skin.nodes.clone().map(|member| held[member]).collect();
        let binds: Vec<[f32; 16]> =
            first[skin.nodes.clone()].iter().map(|pose| skin::inverse_bind(pose, &world)).collect();
        let binds = self.buffer.matrices(&binds);
        let own = json!({ "name": name, "joints": nodes, "inverseBindMatrices": binds });
        self.skins.push(own);
        self.roots.push(self.nodes.len());
        self.nodes.push(json!({ "name": name, "mesh": mesh, "skin": self.skins.len() - 1 }));
    }

    /// A bar, a distance or a spring between its ends, which is as long as it is at the first frame
    /// and scaled along.
    fn line(&mut self, line: &NamedLine, poses: &[&[MemberPose]], symbol: f64) -> usize {
        let ends =
            |frame: &[MemberPose]| [&line.line.from, &line.line.to].map(|end| point(end, frame));
        // of two ends at one point nothing is seen, but the scale stays one that can be inverted
        let length = |[from, to]: &[Vector3<f64>; 2]| (to - from).norm().max(1e-6 * symbol);
        let first = poses.first().map_or(symbol, |frame| length(&ends(frame)));
        let mut motion = NodeAnimation::default();
        for frame in poses {
            let both = ends(frame);
            let directors = along(&(both[1] - both[0])).unwrap_or_else(Matrix3::identity);
            let pose = MemberPose { center: 0.5 * (both[0] + both[1]), directors };
            motion.push(&pose, Some([1.0, 1.0, length(&both) / first]));
        }
        let half = Vector3::z() * (0.5 * first);
        let mesh = match line.spring {
            true => coil(1.2 * symbol, first, 0.25 * symbol),
            false => stick(&-half, &half, 0.4 * symbol).unwrap_or_default(),
        };
        let mut node = self.moving(&line.name, motion);
        if line.line.until.is_some() {
            // its own node is scaled along
            node = self.node(json!({ "name": line.name }), node);
        }
        self.show(node, &line.name, &mesh, (INK, 1.0));
        node
    }

    /// The document and its binary part.
    ///
    /// `None` where a number is too large for single precision.
    pub(super) fn finish(self) -> Option<(Value, Vec<u8>)> {
        if !self.buffer.finite {
            return None;
        }
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
        Some((json, self.buffer.bytes))
    }
}

/// A component of a colour as light is added.
fn linear(component: u8) -> f64 {
    let c = f64::from(component) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}
