//! A run as it is shown: its model, its look and its frames.

use holonom_model::{Columns, Model};
use holonom_sim::output::{FrameReader, Frames, RunFolder, Snapshot};
use holonom_sim::sample::Member;

use crate::ExportError;
use crate::look::{Look, poses};
use crate::tube::MemberPose;

/// Frames from which the size of the motion is read.
const PROBES: usize = 64;
const NO_COORDINATES: &str =
    "it has not the coordinates of all members: run the model again without `columns`";

/// A run that can be shown.
pub(crate) struct ShownRun<'a> {
    pub(crate) folder: &'a RunFolder,
    pub(crate) model: Model,
    pub(crate) look: Look,
    pub(crate) members: Vec<Member>,
    most: usize,
}

impl<'a> ShownRun<'a> {
    /// The run of a folder, at most `most` of its recorded nodes.
    pub(crate) fn open(folder: &'a RunFolder, most: usize) -> Result<Self, ExportError> {
        let read = |name: &str, message: String| ExportError::Read {
            path: folder.path().join(name),
            message,
        };
        let model = folder.model().map_err(|_| {
            read(
                "model.toml",
                "it is missing or no valid model: shapes and joints are read from it".into(),
            )
        })?;
        let whole = model.settings.columns.contains(&Columns::Coordinates);
        let probes: Frames = folder.frames(usize::MAX, PROBES)?;
        if whole && (probes.q.is_empty() || probes.members.is_empty()) {
            return Err(read(
                "trajectory.csv",
                "it has no node with bodies, beams or particles".into(),
            ));
        }
        let other = || match whole {
            true => read("trajectory.csv", "its columns are not those of model.toml".into()),
            false => read("trajectory.csv", NO_COORDINATES.into()),
        };
        if !names(&model).eq(probes.members.iter().map(|member| member.name.clone())) {
            return Err(other());
        }
        let events = folder.read_events()?;
        let look = Look::new(&model, &probes, &events).ok_or_else(other)?;
        Ok(Self { folder, model, look, members: probes.members, most })
    }

    /// The frames, one after the other.
    pub(crate) fn frames(&self) -> Result<FrameReader, ExportError> {
        Ok(self.folder.frame_reader(self.most)?)
    }

    /// Where the members are in a frame.
    pub(crate) fn poses(&self, frame: &Snapshot) -> Vec<MemberPose> {
        poses(&self.members, &frame.q)
    }

    /// Time of a frame in a file for animations, s: that of the motion; in statics, where the time
    /// of the loads may stand still or decrease, the number of the frame.
    pub(crate) fn time(&self, frame: &Snapshot, index: usize) -> f64 {
        if self.is_static() { index as f64 } else { frame.t }
    }

    pub(crate) fn is_static(&self) -> bool {
        self.model.settings.scheme == holonom_model::Scheme::Static
    }

    /// An error of `trajectory.csv`.
    pub(crate) fn unreadable(&self, message: String) -> ExportError {
        ExportError::Read { path: self.folder.path().join("trajectory.csv"), message }
    }
}

/// Names of the members of a model.
fn names(model: &Model) -> impl Iterator<Item = String> {
    let nodes = model
        .beams
        .iter()
        .flat_map(|beam| (0..beam.node_count()).map(move |node| format!("{}.{node}", beam.name)));
    let bodies = model.bodies.iter().map(|body| body.name.clone());
    bodies.chain(nodes).chain(model.particles.iter().map(|particle| particle.name.clone()))
}
