//! The parts of a scene, from the model and the first instant of its run.

use super::{directors, encoded, quaternion};
use holonom_model::{
    Bar, Constraint, Curves, Frame, GROUND, History, Model, OutlineKind, Scheme, ShapeKind, Spring,
    StartPoints,
};
use holonom_sim::EventRecord;
use holonom_sim::output::Frames;
use holonom_sim::sample::{Member, MemberKind};
use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::Serialize;
use std::collections::BTreeMap;
use vi_multibody::pair::symbol::SymbolPart;

/// A point of a member, or of the ground (`member = −1`): components along the directors from the
/// centre, m.
#[derive(Clone, Debug, Serialize)]
pub struct SceneEnd {
    /// Its index, −1 for the ground.
    pub member: i64,
    /// Components, m.
    pub point: [f64; 3],
}

impl SceneEnd {
    /// The point, if it is one of the ground.
    #[must_use]
    pub fn on_ground(&self) -> Option<[f64; 3]> {
        (self.member < 0).then_some(self.point)
    }
}

/// A body as it is shown.
#[derive(Clone, Debug, Serialize)]
pub struct SceneBody {
    /// Its name.
    pub name: String,
    /// Its index among the members.
    pub member: usize,
    /// Whether it does not move.
    pub fixed: bool,
    /// `None`, also of a mesh that cannot be read: the ellipsoid of its inertia, with the semi-axes
    /// as `dimensions`.
    pub shape: Option<ShapeKind>,
    /// Of the shape, m.
    pub dimensions: Vec<f64>,
    /// Of a mesh, its index among those of the scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<usize>,
    /// From the body's own axes to its directors: quaternion `x, y, z, w`.
    pub rotation: [f64; 4],
    /// Where joints, bushings and springs hold a body without a shape: components along the
    /// directors from the centre, m.
    pub anchors: Vec<[f64; 3]>,
    /// Whether these are apart, so that lines between them show the body.
    pub link: bool,
    /// Largest distance of its points from the centre, m.
    pub reach: f64,
    /// Largest size of a symbol on it, m.
    pub limit: f64,
    /// Red, green, blue (sRGB), where the model states it.
    pub color: Option<[u8; 3]>,
    /// In `[0, 1]`; 1: it covers what lies behind.
    pub opacity: f64,
    /// Whether it is drawn.
    pub visible: bool,
}

/// Width of a wheel without a tyre, as a part of its radius.
const WIDTH: f64 = 0.06;

/// What a rolling body is drawn as.
struct Wheel {
    kind: ShapeKind,
    dimensions: Vec<f64>,
    rotation: Matrix3<f64>, // from its shape to its directors
}

/// A plane on which something rolls.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ScenePlane {
    /// A point of it, m.
    pub position: [f64; 3],
    /// Its normal.
    pub normal: [f64; 3],
}

/// Size of a symbol on a body, as a part of the reach of the body.
const SYMBOL: f64 = 0.12;

/// A beam as it is shown.
#[derive(Clone, Debug, Serialize)]
pub struct SceneBeam {
    /// Index of its first node among the members.
    pub first: usize,
    /// Numbers of nodes.
    pub legs: Vec<usize>,
    /// Whether the section is an ellipse; else a rectangle.
    pub round: bool,
    /// Half the size of the section along `d_1` and `d_2`, m.
    pub half: [f64; 2],
    intervals: usize,
    largest: f64,
    /// Bending moment in each interval at each instant.
    values: Option<String>,
}

/// A sleeve on the first body of a bushing and a pin on the second, along its third axis.
const BUSHING: [SymbolPart; 2] = [SymbolPart::pin(2.2, 1.8).on_parent(), SymbolPart::pin(0.9, 4.5)];

/// A joint or a bushing as it is shown.
#[derive(Clone, Debug, Serialize)]
pub struct SceneJoint {
    /// The name of its type; of a bushing `bushing`.
    #[serde(rename = "type")]
    pub kind: &'static str,
    /// What it is drawn as.
    #[serde(skip)]
    pub symbol: &'static [SymbolPart],
    /// Where it is on the parent.
    pub parent: SceneEnd,
    /// Where it is on the child.
    pub child: SceneEnd,
    /// Its axis along the directors of the parent.
    pub axis: Option<[f64; 3]>,
    /// Its second axis along the directors of the child.
    pub axis2: Option<[f64; 3]>,
    /// Largest size of its symbol, m: that of the smaller one of its bodies.
    pub limit: f64,
    /// When an event released it, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
}

/// A bar, a distance or a spring.
#[derive(Clone, Debug, Serialize)]
pub struct SceneLine {
    /// Where it begins.
    pub from: SceneEnd,
    /// Where it ends.
    pub to: SceneEnd,
    /// When an event released it, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
}

/// A load as it is shown.
#[derive(Clone, Debug, Serialize)]
pub struct SceneLoad {
    ends: Vec<SceneEnd>,
    force: [f64; 3],
    follower: bool,
    factors: String,
}

/// Where the members of a model are at the first instant.
#[derive(Debug)]
pub struct SceneParts<'a> {
    model: &'a Model,
    frames: &'a Frames,
    start: StartPoints<'a>,
    /// Bodies and point masses by their names.
    members: BTreeMap<&'a str, usize>,
    /// Centre and directors of each member.
    poses: Vec<(Vector3<f64>, Matrix3<f64>)>,
    /// When events released parts, s, by their names.
    released: BTreeMap<String, f64>,
}

impl<'a> SceneParts<'a> {
    /// From a model and the frames of its run. `None` without frames, or where these are of another
    /// model.
    #[must_use]
    pub fn new(model: &'a Model, frames: &'a Frames) -> Option<Self> {
        let nodes: usize = model.beams.iter().map(holonom_model::Beam::node_count).sum();
        let own = model.bodies.len() + nodes;
        let is_frame = |member: &Member| member.kind == MemberKind::Frame;
        let fits = frames.members.iter().take_while(|member| is_frame(member)).count() == own
            && frames.members.len() == own + model.particles.len();
        if frames.q.is_empty() || !fits {
            return None;
        }
        let directors = frames.coordinates(0).map(|(member, own)| match member.kind {
            MemberKind::Frame => directors(own),
            _ => Matrix3::identity(),
        });
        let poses = frames.points(0).map(Vector3::from).zip(directors).collect();
        let members = frames.members.iter().enumerate();
        let members = members.rev().map(|(k, member)| (member.name.as_str(), k)).collect();
        let (start, released) = (StartPoints::new(model), BTreeMap::new());
        Some(Self { model, frames, start, members, poses, released })
    }

    /// With the parts that events released.
    #[must_use]
    pub fn releasing(self, events: &[EventRecord]) -> Self {
        let released = events.iter().filter_map(|event| {
            let name = event.action.strip_prefix("release ")?;
            Some((name.to_owned(), event.t))
        });
        Self { released: released.collect(), ..self }
    }

    fn released(&self, name: &str) -> Option<f64> {
        self.released.get(name).copied()
    }

    /// The member of a name of the model, `rod.start` of beams included.
    fn member(&self, name: &str) -> Option<usize> {
        let node = || self.model.frame(name).filter(|_| name.contains('.'));
        self.members.get(name).copied().or_else(node)
    }

    /// A point in space on a member.
    fn end(&self, name: &str, point: Vector3<f64>) -> SceneEnd {
        match self.member(name).filter(|_| name != GROUND) {
            Some(member) => {
                let (center, directors) = self.poses[member];
                SceneEnd {
                    member: member as i64,
                    point: directors.tr_mul(&(point - center)).into(),
                }
            }
            None => SceneEnd { member: -1, point: point.into() },
        }
    }

    /// A direction in space on a member.
    fn direction(&self, name: &str, direction: [f64; 3]) -> [f64; 3] {
        let direction = Vector3::from(direction);
        self.member(name).map_or(direction, |k| self.poses[k].1.tr_mul(&direction)).into()
    }

    /// The bodies.
    #[must_use]
    pub fn bodies(&self) -> Vec<SceneBody> {
        let mut held: BTreeMap<&str, Vec<Vector3<f64>>> = BTreeMap::new();
        let joints = self.model.joints.iter();
        let joints = joints.map(|joint| ([&joint.parent, &joint.child], self.start.joint(joint)));
        let springs = self.model.springs.iter();
        let springs = springs.map(|spring| ([&spring.from, &spring.to], self.start.spring(spring)));
        let bushings = self.model.bushings.iter();
        let bushings = bushings.map(|own| ([&own.from, &own.to], [Vector3::from(own.position); 2]));
        for (names, points) in joints.chain(springs).chain(bushings) {
            for (name, point) in names.into_iter().zip(points) {
                held.entry(name).or_default().push(point);
            }
        }
        let body = |(member, body): (usize, &holonom_model::Body)| {
            let directors = self.poses[member].1;
            let own = directors.tr_mul(&body.rotation());
            let surface = self.model.surface(body);
            let solid = body.shape.as_ref().filter(|shape| !shape.kind.is_of_triangles());
            let wheel = if body.shape.is_none() { self.wheel(member, &body.name) } else { None };
            let kind = match (&surface, &wheel) {
                (Some(_), _) => Some(ShapeKind::Mesh),
                (None, Some(wheel)) => Some(wheel.kind),
                (None, None) => solid.map(|shape| shape.kind),
            };
            let anchors: Vec<[f64; 3]> = if kind.is_none() && !body.fixed {
                let own = held.get(body.name.as_str()).into_iter().flatten();
                own.map(|point| self.end(&body.name, *point).point).collect()
            } else {
                Vec::new()
            };
            let dimensions = match (&surface, solid) {
                (Some(_), _) => Vec::new(),
                (None, Some(shape)) => shape.dimensions.clone(),
                (None, None) if wheel.is_some() => {
                    wheel.iter().flat_map(|wheel| wheel.dimensions.clone()).collect()
                }
                (None, None) => {
                    semi_axes(body.mass(), &(own * body.inertia_tensor() * own.transpose()))
                }
            };
            let own = wheel.map_or(own, |wheel| wheel.rotation);
            let apart = |a: &[f64; 3]| (Vector3::from(*a) - Vector3::from(anchors[0])).norm();
            let link = anchors.iter().any(|a| apart(a) > 0.0);
            let extent = match &surface {
                Some(surface) => surface.reach(),
                None if link => 0.0,
                None => extent(kind, &dimensions),
            };
            let reach = anchors.iter().map(|a| Vector3::from(*a).norm()).fold(extent, f64::max);
            SceneBody {
                name: body.name.clone(),
                member,
                fixed: body.fixed,
                shape: kind,
                dimensions,
                mesh: None,
                rotation: quaternion(&own),
                anchors,
                link,
                reach,
                limit: limit(reach),
                color: body.rgb(),
                opacity: body.opacity.unwrap_or(1.0),
                visible: body.is_visible(),
            }
        };
        self.model.bodies.iter().enumerate().map(body).collect()
    }

    /// What a body without a shape is drawn as where it rolls: a disc, a sphere.
    fn wheel(&self, member: usize, name: &str) -> Option<Wheel> {
        let directors = self.poses[member].1;
        self.model.constraints.iter().find_map(|constraint| {
            let Constraint::Rolling { body, axis, radius, tube, .. } = constraint else {
                return None;
            };
            if body != name {
                return None;
            }
            let Some(axis) = axis else {
                let (kind, dimensions) = (ShapeKind::Sphere, vec![*radius]);
                return Some(Wheel { kind, dimensions, rotation: Matrix3::identity() });
            };
            let along = directors.tr_mul(&Vector3::from(*axis)).normalize();
            let rotation = Rotation3::rotation_between(&Vector3::z(), &along)
                .map_or(Matrix3::identity(), Rotation3::into_inner);
            let dimensions = vec![*radius, (2.0 * tube).max(WIDTH * radius)];
            Some(Wheel { kind: ShapeKind::Cylinder, dimensions, rotation })
        })
    }

    /// The planes on which something rolls, and those of the ground that bodies touch.
    #[must_use]
    pub fn planes(&self) -> Vec<ScenePlane> {
        let plane = |constraint: &Constraint| match constraint {
            Constraint::Rolling { plane, .. } => {
                Some(ScenePlane { position: plane.position, normal: plane.normal })
            }
            _ => None,
        };
        let touched = self.model.contacts.iter().filter_map(holonom_model::Contact::plane);
        let touched = touched.filter(|plane| plane.on == holonom_model::GROUND);
        let touched = touched.map(|own| ScenePlane { position: own.position, normal: own.normal });
        let mut planes: Vec<ScenePlane> = Vec::new();
        for plane in self.model.constraints.iter().filter_map(plane).chain(touched) {
            if !planes.contains(&plane) {
                planes.push(plane);
            }
        }
        planes
    }

    /// The beams; `moments`: bending moments at the instants of the frames.
    #[must_use]
    pub fn beams(&self, moments: &BTreeMap<String, Vec<Vec<f64>>>) -> Vec<SceneBeam> {
        let mut first = self.model.bodies.len();
        let beam = |beam: &holonom_model::Beam| {
            let legs: Vec<usize> = (0..beam.legs()).map(|leg| beam.nodes_of(leg)).collect();
            let nodes = beam.node_count();
            let (round, half) = section(beam);
            let intervals = nodes.saturating_sub(1);
            let spread = |row: &Vec<f64>| -> Vec<f64> {
                let pick = |i: usize| row.get(i * row.len() / intervals.max(1)).copied();
                (0..intervals).map(|i| pick(i).unwrap_or_default()).collect()
            };
            let rows = moments.get(&beam.name).filter(|rows| rows.len() == self.frames.q.len());
            let values: Option<Vec<f64>> = rows.map(|rows| rows.iter().flat_map(spread).collect());
            let largest = values.iter().flatten().copied().fold(0.0, f64::max);
            let found = SceneBeam {
                first,
                legs,
                round,
                half,
                intervals,
                largest,
                values: values.map(|values| encoded(values.into_iter())),
            };
            first += nodes;
            found
        };
        self.model.beams.iter().map(beam).collect()
    }

    /// Members that are point masses.
    #[must_use]
    pub fn points(&self) -> Vec<usize> {
        let members = self.frames.members.iter().enumerate();
        members.filter(|(_, m)| m.kind != MemberKind::Frame).map(|(k, _)| k).collect()
    }

    /// The joints of what is drawn, then the bushings between the `bodies` of the model.
    #[must_use]
    pub fn joints(&self, bodies: &[SceneBody]) -> Vec<SceneJoint> {
        let limit = |name: &str| {
            let body = self.member(name).and_then(|member| bodies.get(member));
            body.filter(|body| !body.fixed).map_or(f64::MAX, |body| body.limit)
        };
        let joint = |joint: &holonom_model::Joint| {
            let [a, b] = self.start.joint(joint);
            let pair = joint.kind.pair(None);
            SceneJoint {
                limit: limit(&joint.parent).min(limit(&joint.child)),
                kind: pair.name(),
                symbol: pair.symbol(),
                parent: self.end(&joint.parent, a),
                child: self.end(&joint.child, b),
                axis: joint.axis.map(|axis| self.direction(&joint.parent, axis)),
                axis2: joint.axis2.map(|axis| self.direction(&joint.child, axis)),
                until: self.released(&joint.name),
            }
        };
        let bushing = |bushing: &holonom_model::Bushing| {
            let at = Vector3::from(bushing.position);
            let axis = bushing.axes().column(2).into_owned();
            SceneJoint {
                limit: limit(&bushing.from).min(limit(&bushing.to)),
                kind: "bushing",
                symbol: &BUSHING,
                parent: self.end(&bushing.from, at),
                child: self.end(&bushing.to, at),
                axis: Some(self.direction(&bushing.from, axis.into())),
                axis2: None,
                until: self.released(&bushing.name),
            }
        };
        let hidden = |name: &str| self.model.body(name).is_some_and(|body| !body.is_visible());
        let joints = self.model.joints.iter();
        let joints = joints.filter(|joint| !hidden(&joint.parent) && !hidden(&joint.child));
        joints.map(joint).chain(self.model.bushings.iter().map(bushing)).collect()
    }

    /// Where a joint, or what fixes a body, acts on its child.
    pub(super) fn child_end(&self, name: &str) -> Option<SceneEnd> {
        if let Some(joint) = self.model.joint(name) {
            let [_, child] = self.start.joint(joint);
            return Some(self.end(&joint.child, child));
        }
        let member = self.model.frame(name)?; // a fixed body, the end of a beam
        Some(SceneEnd { member: member as i64, point: [0.0; 3] })
    }

    fn line(&self, names: [&str; 2], [from, to]: [Vector3<f64>; 2]) -> SceneLine {
        SceneLine { from: self.end(names[0], from), to: self.end(names[1], to), until: None }
    }

    /// The bars.
    #[must_use]
    pub fn bars(&self) -> Vec<SceneLine> {
        self.model.bars.iter().map(|bar| self.bar_line(bar)).collect()
    }

    /// The bar of a name.
    pub(super) fn bar(&self, name: &str) -> Option<SceneLine> {
        self.model.bars.iter().find(|bar| bar.name == name).map(|bar| self.bar_line(bar))
    }

    fn bar_line(&self, bar: &Bar) -> SceneLine {
        let line = self.line([&bar.from, &bar.to], self.start.bar(bar));
        SceneLine { until: self.released(&bar.name), ..line }
    }

    /// The constraints of distance.
    #[must_use]
    pub fn distances(&self) -> Vec<SceneLine> {
        let lines = self.model.constraints.iter().map(|constraint| self.distance_line(constraint));
        lines.flatten().collect()
    }

    /// The constraint of distance of a name.
    pub(super) fn distance(&self, name: &str) -> Option<SceneLine> {
        let found = self.model.constraints.iter().find(|constraint| constraint.name() == name)?;
        self.distance_line(found)
    }

    fn distance_line(&self, constraint: &Constraint) -> Option<SceneLine> {
        let Constraint::Distance { from, to, point_from, point_to, .. } = constraint else {
            return None;
        };
        let points = [(from, point_from), (to, point_to)];
        let points = points.map(|(name, point)| self.start.point(name, Some(point)));
        let until = self.released(constraint.name());
        Some(SceneLine { until, ..self.line([from, to], points) })
    }

    /// The springs.
    #[must_use]
    pub fn springs(&self) -> Vec<SceneLine> {
        self.model.springs.iter().map(|spring| self.spring_line(spring)).collect()
    }

    /// The spring of a name.
    pub(super) fn spring(&self, name: &str) -> Option<SceneLine> {
        let found = self.model.springs.iter().find(|spring| spring.name == name);
        found.map(|spring| self.spring_line(spring))
    }

    fn spring_line(&self, spring: &Spring) -> SceneLine {
        let line = self.line([&spring.from, &spring.to], self.start.spring(spring));
        SceneLine { until: self.released(&spring.name), ..line }
    }

    /// Forces on bodies and nodes, and those along beams at each node.
    #[must_use]
    pub fn loads(&self) -> Vec<SceneLoad> {
        let loads = self.model.loads.iter();
        loads
            .filter(|load| load.force.iter().any(|f| *f != 0.0))
            .filter_map(|l| self.load(l))
            .collect()
    }

    fn load(&self, load: &holonom_model::Load) -> Option<SceneLoad> {
        let at = |member: usize, point: Vector3<f64>| SceneEnd {
            member: member as i64,
            point: point.into(),
        };
        let mut own = Matrix3::identity(); // from the axes of the force to the directors
        let mut ends = Vec::new();
        if let Some(name) = &load.body {
            let member = self.member(name)?;
            if let Some(body) = self.model.body(name) {
                own = self.poses[member].1.tr_mul(&body.rotation());
            }
            ends.push(at(member, own * Vector3::from(load.point.unwrap_or_default())));
        } else {
            let name = load.beam.as_deref()?;
            let (first, nodes) =
                (self.model.frame(&format!("{name}.0"))?, self.model.beam(name)?.node_count());
            let place = load.at.map(|at| self.model.beam(name).map_or(0, |b| b.nearest_node(at)));
            let shown = (0..nodes).step_by(nodes.div_ceil(24)).filter(|_| place.is_none());
            ends.extend(shown.chain(place).map(|node| at(first + node, Vector3::zeros())));
        }
        let history = match (self.model.settings.scheme, load.history.clone()) {
            (Scheme::Static, History::Unstated) => {
                History::Linear { end: self.model.settings.end } // as equilibria take it
            }
            (_, history) => history,
        };
        let history = history.time_history(&Curves::new(self.model));
        let follower = load.frame == Frame::Body;
        let force = Vector3::from(load.force);
        Some(SceneLoad {
            ends,
            force: if follower { own * force } else { force }.into(),
            follower,
            factors: encoded(self.frames.times.iter().map(|t| history.value(*t))),
        })
    }
}

/// Largest size of a symbol on a body; none on a body without extent.
fn limit(reach: f64) -> f64 {
    if reach > 0.0 { SYMBOL * reach } else { f64::MAX }
}

/// Semi-axes of the homogeneous ellipsoid with a mass and an inertia,
/// `a_1² = 5/2 (I_2 + I_3 − I_1)/m`.
fn semi_axes(mass: f64, inertia: &Matrix3<f64>) -> Vec<f64> {
    let moments = inertia.diagonal();
    let square = |i: usize| 2.5 * (moments.sum() - 2.0 * moments[i]) / mass;
    let axes: Vec<f64> = (0..3).map(|i| square(i).max(0.0).sqrt()).collect();
    let longest = axes.iter().copied().fold(0.0, f64::max);
    axes.iter().map(|a| if a.is_finite() { a.max(0.02 * longest) } else { 0.0 }).collect()
}

/// Largest distance of a point of a shape from its centre of mass, m; without a shape that of an
/// ellipsoid.
fn extent(kind: Option<ShapeKind>, dimensions: &[f64]) -> f64 {
    let at = |i: usize| dimensions.get(i).copied().unwrap_or_default();
    match kind {
        Some(ShapeKind::Box) => 0.5 * Vector3::new(at(0), at(1), at(2)).norm(),
        Some(ShapeKind::Cylinder) => at(0).hypot(0.5 * at(1)),
        Some(ShapeKind::Rod) => at(1).hypot(0.5 * at(0)),
        Some(ShapeKind::Cone) => at(0).hypot(0.25 * at(1)).max(0.75 * at(1)),
        Some(ShapeKind::Sphere | ShapeKind::Mesh | ShapeKind::Capsule | ShapeKind::Ellipsoid)
        | None => dimensions.iter().copied().fold(0.0, f64::max),
    }
}

/// Whether the section of a beam is round, and half its size along `d_1` and `d_2`.
fn section(beam: &holonom_model::Beam) -> (bool, [f64; 2]) {
    if let Some(shape) = &beam.section.shape {
        let at = |i: usize| shape.dimensions.get(i).copied().unwrap_or_default();
        return match shape.kind {
            OutlineKind::Rectangle | OutlineKind::Box | OutlineKind::I | OutlineKind::Channel => {
                (false, [0.5 * at(0), 0.5 * at(1)])
            }
            OutlineKind::Circle | OutlineKind::Tube => (true, [at(0); 2]),
        };
    }
    if let Some(radius) = beam.radius {
        return (true, [radius; 2]);
    }
    // stated numbers: the rectangle with the ratios EI/EA, but never thinner than can be seen
    let meshes = beam.meshes().unwrap_or_default();
    let length: f64 = meshes.iter().flat_map(|mesh| &mesh.lengths).sum();
    let half = |stiffness: Option<f64>| {
        let ratio = stiffness.zip(beam.section.ea).map(|(ei, ea)| (3.0 * ei / ea).sqrt());
        ratio
            .filter(|half| half.is_finite())
            .unwrap_or_default()
            .clamp(0.004 * length, 0.05 * length)
    };
    (true, [half(beam.section.ei2), half(beam.section.ei1)])
}
