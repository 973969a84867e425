//! The animated scene of a page: what the model looks like, and where everything is.
//!
//! ```text
//! model.toml, trajectory.csv, beams.csv → Scene → JSON in the page → viewer/*.js (WebGL 2)
//! ```
//! What a reader goes through is the time of a motion, the load factor of equilibria, or the period
//! of a mode. Several motions of one model are drawn over one another, each in a colour of its own.
//!
//! Points and directions on a body are components along its directors, so that they move with the
//! coordinates of the trajectory. Numbers that change in time are single precision, base64.

mod contacts;
mod controls;
mod modes;
pub mod parts;
mod reactions;
mod surfaces;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use contacts::SceneContacts;
use holonom_model::{Model, ModelError, Scheme};
use holonom_sim::EventRecord;
use holonom_sim::output::{ContactRow, Frames, TimeSeries};
use holonom_sim::sample::MemberKind;
use modes::SceneMode;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use parts::{SceneBeam, SceneBody, SceneJoint, SceneLine, SceneLoad, SceneParts, ScenePlane};
use reactions::{AxialForce, JointReaction, SensorReadings};
use serde::Serialize;
use std::collections::BTreeMap;
use surfaces::{SceneSurface, Surfaces};
use vi_multibody::pair::symbol::SymbolPart;

/// Coordinates that are shown at most; a usual page then stays under 3 MB.
pub const NUMBERS: usize = 400_000;
/// Instants that are shown at most.
pub const INSTANTS: usize = 1200;

/// Colours of bodies, beams and point masses: red, green, blue (sRGB).
pub const PALETTE: [[u8; 3]; 8] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [143, 124, 236],
    [184, 161, 0],
];

/// The viewer: WebGL 2, without it a plane canvas; no library. One function in parts, in the order
/// of their use.
const VIEWER: [&str; 13] = [
    "\"use strict\";\n(() => {\n",
    include_str!("viewer/data.js"),
    include_str!("viewer/numbers.js"),
    include_str!("viewer/motion.js"),
    include_str!("viewer/webgl.js"),
    include_str!("viewer/flat.js"),
    include_str!("viewer/meshes.js"),
    include_str!("viewer/parts.js"),
    include_str!("viewer/camera.js"),
    include_str!("viewer/picture.js"),
    include_str!("viewer/controls.js"),
    concat!(
        include_str!("viewer/choices.js"),
        include_str!("viewer/charts.js"),
        include_str!("viewer/begin.js")
    ),
    "})();\n",
];

/// What a reader goes through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SceneParameter {
    /// The time of a motion.
    Time,
    /// The load factor of equilibria.
    Load,
    /// A period of the chosen mode, or its growth or decay.
    Mode,
    /// Nothing: one configuration.
    None,
}

/// What the viewer draws.
#[derive(Debug, Serialize)]
pub struct Scene {
    parameter: SceneParameter,
    /// Whether the system moves in a plane.
    planar: bool,
    /// Whether there is gravity, and so a ground with shadows.
    grounded: bool,
    /// Unit vector against gravity.
    up: [f64; 3],
    /// Colours of bodies, then of beams or point masses, one after the other.
    palette: [[u8; 3]; 8],
    /// Motions of the same members; more than one are drawn over one another.
    motions: Vec<SceneMotion>,
    modes: Vec<SceneMode>,
    members: Vec<SceneMember>,
    bodies: Vec<SceneBody>,
    meshes: Vec<SceneSurface>,
    beams: Vec<SceneBeam>,
    /// Members that are point masses.
    points: Vec<usize>,
    joints: Vec<SceneJoint>,
    /// What joints are drawn as, by type.
    symbols: BTreeMap<&'static str, &'static [SymbolPart]>,
    /// Bars and distances.
    bars: Vec<SceneLine>,
    springs: Vec<SceneLine>,
    /// Planes on which something rolls.
    planes: Vec<ScenePlane>,
    loads: Vec<SceneLoad>,
    reactions: Vec<JointReaction>,
    tensions: Vec<AxialForce>,
    contacts: SceneContacts,
    /// Points of the ground that something is held at.
    fixed: Vec<[f64; 3]>,
    /// What is said below the picture.
    #[serde(skip)]
    note: Option<String>,
}

/// Where the members are at some instants.
#[derive(Debug, Serialize)]
struct SceneMotion {
    /// In the legend.
    name: String,
    /// Whether it is drawn from the beginning.
    shown: bool,
    times: String,
    /// Of each instant and member: centre, and for frames the quaternion `x, y, z, w` of the
    /// directors.
    poses: String,
}

impl SceneMotion {
    fn new(name: &str, shown: bool, frames: &Frames) -> Self {
        Self {
            name: name.to_owned(),
            shown,
            times: encoded(frames.times.iter().copied()),
            poses: encoded((0..frames.q.len()).flat_map(|i| poses(frames, i))),
        }
    }
}

#[derive(Debug, Serialize)]
struct SceneMember {
    name: String,
    frame: bool,
}

/// One of several motions in a scene.
#[derive(Clone, Copy, Debug)]
pub struct OverlaidMotion<'a> {
    /// Its name.
    pub name: &'a str,
    /// Whether it is drawn from the beginning.
    pub is_shown: bool,
    /// Its frames.
    pub frames: &'a Frames,
}

impl Scene {
    /// From the model and the frames of its run; `moments`: bending moments of beams at the same
    /// instants; `sensors`: those of the run, at all its nodes.
    /// `None` without a motion to show.
    #[must_use]
    pub fn new(
        model: &Model,
        frames: &Frames,
        moments: &BTreeMap<String, Vec<Vec<f64>>>,
        sensors: Option<&TimeSeries>,
    ) -> Option<Self> {
        Self::with_events(model, frames, moments, sensors, &[], &[])
    }

    /// The same of a run with events and contacts: what events released is no longer drawn.
    #[must_use]
    pub fn with_events(
        model: &Model,
        frames: &Frames,
        moments: &BTreeMap<String, Vec<Vec<f64>>>,
        sensors: Option<&TimeSeries>,
        events: &[EventRecord],
        contacts: &[ContactRow],
    ) -> Option<Self> {
        let parts = SceneParts::new(model, frames)?.releasing(events);
        let member = |member: &holonom_sim::sample::Member| SceneMember {
            name: member.name.clone(),
            frame: member.kind == MemberKind::Frame,
        };
        let mut bodies = parts.bodies();
        let (joints, springs) = (parts.joints(&bodies), parts.springs());
        let bars = [parts.bars(), parts.distances()].concat();
        let ends = joints.iter().flat_map(|joint| [&joint.parent, &joint.child]);
        let ends = ends.chain(bars.iter().chain(&springs).flat_map(|line| [&line.from, &line.to]));
        let fixed = ends.filter_map(parts::SceneEnd::on_ground).collect();
        let parameter = match model.settings.scheme {
            _ if frames.q.len() < 2 => SceneParameter::None,
            Scheme::Static => SceneParameter::Load,
            _ => SceneParameter::Time,
        };
        let sensors = sensors.map(|table| SensorReadings::new(&frames.times, table));
        let sensors = sensors.as_ref();
        let Surfaces { list: meshes, note } = Surfaces::new(model, &mut bodies);
        Some(Self {
            parameter,
            planar: model.header.dimension == 2,
            grounded: Vector3::from(model.gravity()).norm() > 0.0,
            up: up(model),
            palette: PALETTE,
            motions: vec![SceneMotion::new("", true, frames)],
            modes: Vec::new(),
            members: frames.members.iter().map(member).collect(),
            bodies,
            meshes,
            beams: parts.beams(moments),
            points: parts.points(),
            symbols: joints.iter().map(|joint| (joint.kind, joint.symbol)).collect(),
            joints,
            bars,
            springs,
            planes: parts.planes(),
            loads: parts.loads(),
            reactions: sensors.map_or_else(Vec::new, |s| s.reactions(&parts, model)),
            tensions: sensors.map_or_else(Vec::new, |s| s.tensions(&parts, model)),
            contacts: SceneContacts::new(&frames.times, contacts),
            fixed,
            note,
        })
    }

    /// The initial configuration of a model. `None` where nothing can be shown.
    ///
    /// # Errors
    /// [`ModelError`] when the model cannot be assembled.
    pub fn initial(model: &Model) -> Result<Option<Self>, ModelError> {
        Ok(Self::new(model, &Frames::initial(model)?, &BTreeMap::new(), None))
    }

    /// Motions of one model over one another, all of the same members. `None` without a motion to
    /// show.
    #[must_use]
    pub fn overlaid(model: &Model, motions: &[OverlaidMotion<'_>]) -> Option<Self> {
        let first = motions.first()?.frames;
        let scene = Self::new(model, first, &BTreeMap::new(), None)?;
        let same = |frames: &Frames| frames.members == first.members && !frames.q.is_empty();
        let shown = motions.iter().filter(|motion| same(motion.frames));
        let motions =
            shown.map(|motion| SceneMotion::new(motion.name, motion.is_shown, motion.frames));
        Some(Self { motions: motions.collect(), ..scene })
    }

    /// The scene as a part of a page.
    #[must_use]
    pub fn html(&self) -> String {
        // no name is markup, and none ends the data
        let data = serde_json::to_string(self).unwrap_or_default().replace('<', "\\u003c");
        let note = self.note.as_deref().map(|note| format!("<p class=\"note\">{note}</p>\n"));
        let note = note.unwrap_or_default();
        format!(
            "{}{note}<script id=\"scene-data\" type=\"application/json\">{data}</script>\n<script>\n{}</script>\n",
            controls::html(self.parameter, self.motions.len() > 1),
            VIEWER.concat()
        )
    }
}

/// Unit vector against gravity; without gravity the second axis in the plane, the third in space.
#[must_use]
pub fn up(model: &Model) -> [f64; 3] {
    let gravity = Vector3::from(model.gravity());
    let up = match (gravity.norm() > 0.0, model.header.dimension) {
        (true, _) => -gravity.normalize(),
        (false, 2) => Vector3::y(),
        (false, _) => Vector3::z(),
    };
    up.into()
}

/// Base64 of the values in single precision, little endian.
fn encoded(values: impl Iterator<Item = f64>) -> String {
    let bytes: Vec<u8> = values.flat_map(|value| (value as f32).to_le_bytes()).collect();
    STANDARD.encode(bytes)
}

fn poses(frames: &Frames, frame: usize) -> Vec<f64> {
    let mut out = Vec::new();
    for (point, (member, own)) in frames.points(frame).zip(frames.coordinates(frame)) {
        out.extend(point);
        if member.kind == MemberKind::Frame {
            out.extend(quaternion(&directors(own)));
        }
    }
    out
}

/// The directors of a frame as columns, from its 12 coordinates.
#[must_use]
pub fn directors(own: &[f64]) -> Matrix3<f64> {
    Matrix3::from_column_slice(&own[3..12])
}

/// `x, y, z, w` of a rotation.
#[must_use]
pub fn quaternion(rotation: &Matrix3<f64>) -> [f64; 4] {
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation));
    turn.coords.into()
}
