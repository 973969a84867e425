//! What a run looks like: surfaces that move with its members, as the scene of its page shows them.

use holonom_model::{Constraint, Model, ShapeKind};
use holonom_report::scene::parts::{
    SceneBeam, SceneBody, SceneEnd, SceneJoint, SceneLine, SceneParts,
};
use holonom_report::scene::{PALETTE, up};
use holonom_sim::EventRecord;
use holonom_sim::output::Frames;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use vi_multibody::pair::symbol::{SymbolPart, SymbolSolid};

use crate::mesh::{SurfaceMesh, along, stick};
use crate::tube::MemberPose;

/// Red, green, blue (sRGB).
pub(crate) type Rgb = [u8; 3];

/// Colour of bodies that do not move.
const FIXED: Rgb = [199, 204, 214];
/// Colour of joints, bars and springs.
pub(crate) const INK: Rgb = [64, 71, 84];
/// Size of the symbols of joints, as a part of the size of the motion.
const SYMBOL: f64 = 0.014;

/// A surface that moves with a member.
#[derive(Clone, Debug)]
pub(crate) struct RigidSurface {
    pub(crate) name: String,
    /// Among all members.
    pub(crate) member: usize,
    pub(crate) color: Rgb,
    /// In `[0, 1]`.
    pub(crate) opacity: f64,
    /// Along the directors from the centre.
    pub(crate) mesh: SurfaceMesh,
    /// Where the points of its parts end; the mesh is one part where there are none.
    pub(crate) ends: Vec<usize>,
}

impl RigidSurface {
    /// The points of its parts.
    pub(crate) fn parts(&self) -> impl Iterator<Item = &[[f64; 3]]> {
        let points = &self.mesh.points;
        let ends = self.ends.iter().copied().chain([points.len()]);
        let parts = ends.scan(0, |start, end| points.get(std::mem::replace(start, end)..end));
        parts.filter(|part| !part.is_empty())
    }
}

/// A joint or a bushing with its name.
#[derive(Clone, Debug)]
pub(crate) struct NamedJoint {
    pub(crate) name: String,
    pub(crate) joint: SceneJoint,
}

/// A beam with its name.
#[derive(Clone, Debug)]
pub(crate) struct NamedBeam {
    pub(crate) name: String,
    pub(crate) color: Rgb,
    pub(crate) beam: SceneBeam,
}

impl NamedBeam {
    /// The nodes of each leg among all members.
    pub(crate) fn legs(&self) -> Vec<std::ops::Range<usize>> {
        let mut first = self.beam.first;
        let leg = |count: &usize| {
            let leg = first..first + count;
            first = leg.end;
            leg
        };
        self.beam.legs.iter().map(leg).collect()
    }
}

/// A bar, a distance or a spring with its name.
#[derive(Clone, Debug)]
pub(crate) struct NamedLine {
    pub(crate) name: String,
    pub(crate) line: SceneLine,
    pub(crate) spring: bool,
}

/// All that is shown of a run.
#[derive(Clone, Debug)]
pub(crate) struct Look {
    /// Unit vector against gravity.
    pub(crate) up: [f64; 3],
    /// Bodies and point masses, in the order of the members.
    pub(crate) solids: Vec<RigidSurface>,
    pub(crate) beams: Vec<NamedBeam>,
    pub(crate) joints: Vec<NamedJoint>,
    pub(crate) lines: Vec<NamedLine>,
    /// Points of the ground where lines end.
    pub(crate) feet: Vec<[f64; 3]>,
    /// Size of symbols, m.
    pub(crate) symbol: f64,
}

impl Look {
    /// From the model, some frames of its run, the first one included, and what its events did.
    /// `None` where the frames are of another model.
    pub(crate) fn new(model: &Model, frames: &Frames, events: &[EventRecord]) -> Option<Self> {
        let parts = SceneParts::new(model, frames)?.releasing(events);
        let bodies = parts.bodies();
        let joints = parts.joints(&bodies);
        let (bars, distances, springs) = (parts.bars(), parts.distances(), parts.springs());
        let lines = bars.iter().chain(&distances).chain(&springs);
        let ends = lines.flat_map(|line| [&line.from, &line.to]);
        let feet: Vec<[f64; 3]> = ends.filter_map(SceneEnd::on_ground).collect();
        let held =
            joints.iter().flat_map(|j| [&j.parent, &j.child]).filter_map(SceneEnd::on_ground);
        let fixed: Vec<[f64; 3]> = held.chain(feet.iter().copied()).collect();
        let symbol = SYMBOL * size(frames, &bodies, &fixed);
        let mut solids: Vec<RigidSurface> =
            bodies.iter().enumerate().map(|(k, body)| solid(body, color(k), symbol)).collect();
        for (solid, (shown, stated)) in solids.iter_mut().zip(bodies.iter().zip(&model.bodies)) {
            let surfaces = model.surfaces(stated);
            if !surfaces.is_empty() || !shown.visible {
                solid.mesh = SurfaceMesh::default();
            }
            for surface in surfaces.into_iter().filter(|_| shown.visible) {
                solid.mesh.append(SurfaceMesh::of_surface(&surface).turned(&axes(shown)));
                solid.ends.push(solid.mesh.points.len());
            }
        }
        for (k, member) in parts.points().into_iter().enumerate() {
            solids.push(RigidSurface {
                name: frames.members[member].name.clone(),
                member,
                color: color(bodies.len() + k),
                opacity: 1.0,
                mesh: ball(1.6 * symbol),
                ends: Vec::new(),
            });
        }
        let beams = model.beams.iter().zip(parts.beams(&Default::default())).enumerate();
        let beam = |(k, (stated, beam)): (usize, (&holonom_model::Beam, SceneBeam))| NamedBeam {
            name: stated.name.clone(),
            color: color(bodies.len() + k),
            beam,
        };
        let line = |(name, line, spring): (&String, SceneLine, bool)| NamedLine {
            name: name.clone(),
            line,
            spring,
        };
        let bars = model.bars.iter().zip(bars).map(|(bar, l)| (&bar.name, l, false));
        let is_distance = |c: &&Constraint| matches!(c, Constraint::Distance { .. });
        let names = model.constraints.iter().filter(is_distance).map(Constraint::name);
        let distances: Vec<NamedLine> = names
            .zip(distances)
            .map(|(name, line)| NamedLine { name: name.to_owned(), line, spring: false })
            .collect();
        let springs = model.springs.iter().zip(springs).map(|(spring, l)| (&spring.name, l, true));
        let names = model.joints.iter().map(|joint| &joint.name);
        let joints = names.chain(model.bushings.iter().map(|own| &own.name)).zip(joints);
        Some(Self {
            up: up(model),
            beams: beams.map(beam).collect(),
            lines: bars.map(line).chain(distances).chain(springs.map(line)).collect(),
            feet,
            joints: joints.map(|(name, joint)| NamedJoint { name: name.clone(), joint }).collect(),
            solids,
            symbol,
        })
    }
}

/// The poses of all members in a configuration; those of point masses have the axes of space.
pub(crate) fn poses(members: &[holonom_sim::sample::Member], q: &[f64]) -> Vec<MemberPose> {
    let pose = |(_, own): (_, &[f64])| MemberPose {
        center: Vector3::new(own[0], own[1], own.get(2).copied().unwrap_or_default()),
        directors: match own.len() {
            12 => holonom_report::scene::directors(own),
            _ => Matrix3::identity(),
        },
    };
    holonom_sim::output::coordinates(members, q).map(pose).collect()
}

/// A point of a member or of the ground, m.
pub(crate) fn point(end: &SceneEnd, poses: &[MemberPose]) -> Vector3<f64> {
    match usize::try_from(end.member) {
        Ok(member) => poses[member].point(end.point),
        Err(_) => Vector3::from(end.point),
    }
}

fn color(k: usize) -> Rgb {
    PALETTE[k % PALETTE.len()]
}

fn ball(radius: f64) -> SurfaceMesh {
    let axes = Matrix3::identity() * radius;
    SurfaceMesh::sphere().placed(&axes, &Vector3::zeros()).unwrap_or_default()
}

/// The axes of a body along its directors.
fn axes(body: &SceneBody) -> Matrix3<f64> {
    let [x, y, z, w] = body.rotation;
    let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    *turn.to_rotation_matrix().matrix()
}

/// The shape of a body but for meshes; without one its links to joints, or the ellipsoid of its
/// inertia.
fn solid(body: &SceneBody, color: Rgb, symbol: f64) -> RigidSurface {
    let symbol = symbol.min(body.limit);
    let own = axes(body);
    let at = |k: usize| body.dimensions.get(k).copied().unwrap_or_default();
    let scaled = |x, y, z| own * Matrix3::from_diagonal(&Vector3::new(x, y, z));
    let none = Vector3::zeros();
    let (a, b, c) = (at(0), at(1), at(2));
    let shape = match body.shape {
        Some(ShapeKind::Box) => SurfaceMesh::cuboid().placed(&scaled(a, b, c), &none),
        Some(ShapeKind::Cylinder) => SurfaceMesh::cylinder().placed(&scaled(a, a, b), &none),
        Some(ShapeKind::Rod) => SurfaceMesh::cylinder().placed(&scaled(b, b, a), &none),
        Some(ShapeKind::Sphere) => SurfaceMesh::sphere().placed(&scaled(a, a, a), &none),
        Some(ShapeKind::Cone) => {
            let base = own * Vector3::new(0.0, 0.0, 0.25 * b);
            SurfaceMesh::cone().placed(&scaled(a, a, b), &base)
        }
        Some(ShapeKind::Mesh | ShapeKind::Capsule | ShapeKind::Ellipsoid) => None,
        None if body.link => None,
        None => {
            SurfaceMesh::sphere().placed(&Matrix3::from_diagonal(&Vector3::new(a, b, c)), &none)
        }
    };
    let mut mesh = shape.unwrap_or_else(|| ball(1.6 * symbol));
    let thickness = if body.link { 0.8 } else { 0.35 } * symbol;
    for anchor in &body.anchors {
        if let Some(link) = stick(&none, &Vector3::from(*anchor), thickness) {
            mesh.append(link);
        }
    }
    let color = body.color.unwrap_or(if body.fixed { FIXED } else { color });
    let (name, opacity) = (body.name.clone(), body.opacity);
    RigidSurface { name, member: body.member, color, opacity, mesh, ends: Vec::new() }
}

/// What marks a point of the ground.
pub(crate) fn foot(up: &[f64; 3], s: f64) -> SurfaceMesh {
    let axes = along(&Vector3::from(*up)).unwrap_or_else(Matrix3::identity);
    let axes = axes * Matrix3::from_diagonal(&Vector3::new(3.0 * s, 3.0 * s, 0.9 * s));
    SurfaceMesh::cuboid().placed(&axes, &Vector3::zeros()).unwrap_or_default()
}

/// Whether what an event released at a time, s, is still there; `None`: nothing did.
pub(crate) fn holds(until: Option<f64>, t: f64) -> bool {
    until.is_none_or(|until| t <= until)
}

/// The symbol of a joint in the axes of space about its point, with the directions of its axes in
/// space.
pub(crate) fn symbol(
    parts: &[SymbolPart],
    [axis, axis2]: [Vector3<f64>; 2],
    s: f64,
) -> SurfaceMesh {
    let part = |mesh: SurfaceMesh, axis: &Vector3<f64>, size: [f64; 3]| {
        let axes = along(axis).unwrap_or_else(Matrix3::identity);
        let axes = axes * Matrix3::from_diagonal(&(Vector3::from(size) * s));
        mesh.placed(&axes, &Vector3::zeros()).unwrap_or_default()
    };
    let mut whole = SurfaceMesh::default();
    for of in parts {
        let mesh = match of.solid {
            SymbolSolid::Cylinder => SurfaceMesh::cylinder(),
            SymbolSolid::Box => SurfaceMesh::cuboid(),
            SymbolSolid::Sphere => SurfaceMesh::sphere(),
        };
        let axis = if of.second { &axis2 } else { &axis };
        whole.append(part(mesh, axis, [of.across, of.across, of.along]));
    }
    whole
}

/// Half the diagonal of the box of the motion, m; of an instant where the system is free and
/// travels far.
fn size(frames: &Frames, bodies: &[SceneBody], fixed: &[[f64; 3]]) -> f64 {
    let mut reach = vec![0.0; frames.members.len()];
    for body in bodies.iter().filter(|body| body.visible) {
        reach[body.member] = body.reach;
    }
    let (mut whole, mut momentary) = (BoundingBox::default(), 0.0_f64);
    for frame in 0..frames.q.len() {
        let mut now = BoundingBox::default();
        for (point, reach) in frames.points(frame).zip(&reach) {
            now.grow(&point, *reach);
            whole.grow(&point, *reach);
        }
        momentary = momentary.max(now.half());
    }
    fixed.iter().for_each(|point| whole.grow(point, 0.0));
    let held = !fixed.is_empty() || bodies.iter().any(|body| body.fixed);
    let size = if !held && whole.half() > 2.5 * momentary { momentary } else { whole.half() };
    if size > 0.0 && size.is_finite() { size } else { 1.0 }
}

/// A box along the axes of space.
#[derive(Default)]
struct BoundingBox(Option<[Vector3<f64>; 2]>);

impl BoundingBox {
    fn grow(&mut self, point: &[f64; 3], margin: f64) {
        let point = Vector3::from(*point);
        let [low, high] = self.0.unwrap_or([point; 2]);
        let margin = Vector3::repeat(margin);
        self.0 = Some([low.inf(&(point - margin)), high.sup(&(point + margin))]);
    }

    fn half(&self) -> f64 {
        self.0.map_or(0.0, |[low, high]| 0.5 * (high - low).norm())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use holonom_model::JointKind;

    /// Lengths along the axis and along the second one, as multiples of the size of symbols.
    #[test]
    fn symbols_of_joints_have_their_sizes() {
        for (kind, along, across) in [
            (JointKind::Spherical, 2.6, 2.6),
            (JointKind::Revolute, 4.0, 2.0),
            (JointKind::Cylindrical, 6.0, 2.6),
            (JointKind::Prismatic, 4.0, 2.2),
            (JointKind::Planar, 0.4, 6.0),
            (JointKind::Fixed, 2.0, 2.0),
            (JointKind::Universal, 4.0, 4.0),
            (JointKind::Screw, 5.0, 3.0),
        ] {
            let mesh = symbol(kind.pair(None).symbol(), [Vector3::z(), Vector3::x()], 0.5);
            let extent = |i: usize| {
                let ends = mesh.points.iter().fold([f64::MAX, f64::MIN], |[low, high], point| {
                    [low.min(point[i]), high.max(point[i])]
                });
                ends[1] - ends[0]
            };
            let off = [extent(2) / (0.5 * along) - 1.0, extent(0) / (0.5 * across) - 1.0];
            println!("{kind:?}: off by {off:.3?}");
            assert!(off.iter().all(|off| off.abs() < 0.02), "{kind:?}: {off:?}");
        }
    }
}
