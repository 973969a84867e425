//! The animated scene of a run: what the model looks like, and where everything is at some instants.
//!
//! ```text
//! model.toml, trajectory.csv, beams.csv → Scene → JSON in the page → viewer.js (WebGL 2)
//! ```
//! Points and directions on a body are components along its directors, so that they move with the
//! coordinates of the trajectory. Numbers that change in time are single precision, base64.

pub mod parts;
mod reactions;
mod surfaces;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use holonom_model::Model;
use holonom_sim::output::{Frames, TimeSeries};
use holonom_sim::sample::MemberKind;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use parts::{Beam, Body, Joint, Line, Load, Parts};
use reactions::{Reaction, reactions};
use serde::Serialize;
use std::collections::BTreeMap;
use surfaces::{Surface, Surfaces};

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

const VIEWER: &str = include_str!("viewer.js");

/// What `viewer.js` draws.
#[derive(Serialize)]
pub struct Scene {
    /// Whether the system moves in a plane.
    planar: bool,
    /// Whether there is gravity, and so a ground with shadows.
    grounded: bool,
    /// Unit vector against gravity.
    up: [f64; 3],
    /// Colours of bodies, then of beams or point masses, one after the other.
    palette: [[u8; 3]; 8],
    times: String,
    /// Of each instant and member: centre, and for frames the quaternion `x, y, z, w` of the directors.
    poses: String,
    members: Vec<Member>,
    bodies: Vec<Body>,
    meshes: Vec<Surface>,
    beams: Vec<Beam>,
    /// Members that are point masses.
    points: Vec<usize>,
    joints: Vec<Joint>,
    bars: Vec<Line>,
    springs: Vec<Line>,
    loads: Vec<Load>,
    reactions: Vec<Reaction>,
    /// Points of the ground that something is held at.
    fixed: Vec<[f64; 3]>,
    /// What is said below the picture.
    #[serde(skip)]
    note: Option<String>,
}

#[derive(Serialize)]
struct Member {
    name: String,
    frame: bool,
}

impl Scene {
    /// From the model and the frames of its run; `moments`: bending moments of beams at the same instants; `sensors`: those
    /// of the run, at all its nodes.
    /// `None` without a motion to show.
    #[must_use]
    pub fn new(
        model: &Model,
        frames: &Frames,
        moments: &BTreeMap<String, Vec<Vec<f64>>>,
        sensors: Option<&TimeSeries>,
    ) -> Option<Self> {
        let parts = Parts::new(model, frames)?;
        let member = |member: &holonom_sim::sample::Member| Member {
            name: member.name.clone(),
            frame: member.kind == MemberKind::Frame,
        };
        let (joints, bars, springs) = (parts.joints(), parts.bars(), parts.springs());
        let ends = joints.iter().flat_map(|joint| [&joint.parent, &joint.child]);
        let ends = ends.chain(bars.iter().chain(&springs).flat_map(|line| [&line.from, &line.to]));
        let fixed = ends.filter_map(parts::End::on_ground).collect();
        let mut bodies = parts.bodies();
        let Surfaces { list: meshes, note } = Surfaces::new(model, &mut bodies);
        Some(Self {
            planar: model.header.dimension == 2,
            grounded: Vector3::from(model.gravity()).norm() > 0.0,
            up: up(model),
            palette: PALETTE,
            times: encoded(frames.times.iter().copied()),
            poses: encoded((0..frames.q.len()).flat_map(|i| poses(frames, i))),
            members: frames.members.iter().map(member).collect(),
            bodies,
            meshes,
            beams: parts.beams(moments),
            points: parts.points(),
            joints,
            bars,
            springs,
            loads: parts.loads(),
            reactions: reactions(&parts, model, sensors),
            fixed,
            note,
        })
    }

    /// The scene as a part of a page.
    #[must_use]
    pub fn html(&self) -> String {
        // no name is markup, and none ends the data
        let data = serde_json::to_string(self).unwrap_or_default().replace('<', "\\u003c");
        let note = self.note.as_deref().map(|note| format!("<p class=\"note\">{note}</p>\n"));
        let note = note.unwrap_or_default();
        format!(
            "{CONTROLS}{note}<script id=\"scene-data\" type=\"application/json\">{data}</script>\n<script>\n{VIEWER}</script>\n"
        )
    }
}

const CONTROLS: &str = r#"<section id="scene" aria-label="animation">
<div class="scene-view"><canvas tabindex="0" aria-label="animated view of the mechanism: drag to rotate, shift and drag to move, keys + and − to zoom"></canvas><div class="scene-labels" aria-hidden="true"></div><p class="scene-note" role="status"></p></div>
<div class="scene-bar">
<button data-play aria-label="play">▶</button>
<input data-slider type="range" min="0" max="1000" step="any" value="0" aria-label="time">
<output data-clock></output>
<select data-speed aria-label="speed"></select>
<span><button data-view="iso">3-D</button><button data-view="front">front</button><button data-view="side">side</button><button data-view="top">top</button></span>
<span><button data-trails>trails</button><button data-labels>names</button><button data-loads>loads</button><button data-reactions>reactions</button><button data-follow>follow</button><button data-grid>grid</button><button data-full>full screen</button></span>
</div>
<p class="note">Drag to rotate, shift and drag to move, wheel or + − to zoom. Keys: space plays, ← → step (with shift ten at once), 1–4 views, T trails, N names, L loads, R reactions, G grid, F follows. A click on a chart goes to its time.</p>
</section>
"#;

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
