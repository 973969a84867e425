//! An animated scene for Blender and other programs that read glTF 2.0: one binary file (`.glb`).
//!
//! ```text
//! root              turns the axes of the run so that y points upwards, as glTF demands
//! ├ bodies          translation and rotation from centre and directors; the symbols of joints hang on the child
//! ├ bars, springs   translation, rotation, length; distances as bars
//! ├ ground          where these end on the ground
//! └ nodes of beams  translation and rotation
//! surfaces of beams are skins over their nodes
//! ```
//! Numbers are single precision, times those of the motion or a power of ten of them, so that it
//! lasts from 1 s to 100 s.

mod buffer;
mod document;
mod motion;
mod skin;

use serde_json::Value;
use std::io::{self, Write};

use crate::pace::AnimationPace;
use crate::run::ShownRun;
use crate::tube::MemberPose;
use crate::{ExportError, Exported};
use document::DocumentWriter;

/// The file and what is said of it.
#[derive(Debug)]
pub(crate) struct GltfFile {
    json: Value,
    bytes: Vec<u8>,
    /// What it holds.
    pub(crate) exported: Exported,
}

impl GltfFile {
    /// Of the frames of a run.
    pub(crate) fn of(run: &ShownRun<'_>) -> Result<Self, ExportError> {
        let reader = run.frames()?;
        let recorded = reader.rows();
        let mut times = Vec::new();
        let mut poses: Vec<Vec<MemberPose>> = Vec::new();
        for (index, frame) in reader.enumerate() {
            let frame = frame.map_err(|error| run.unreadable(error.to_string()))?;
            times.push(run.time(&frame, index));
            poses.push(run.poses(&frame));
        }
        let pace = AnimationPace::of(&times, run.is_static());
        let scale = pace.scale();
        let begin = times.first().copied().unwrap_or_default();
        // times that are one in single precision are one frame
        let mut kept: (Vec<f32>, Vec<&[MemberPose]>, Vec<f64>) = Default::default();
        for (own, poses) in times.iter().zip(&poses) {
            let t = ((own - begin) * scale) as f32;
            if kept.0.last().is_none_or(|last| t > *last) {
                kept.0.push(t);
                kept.1.push(poses);
                kept.2.push(*own);
            }
        }
        let (times, poses, of_motion) = kept;
        let exported = Exported { frames: times.len(), recorded, pace: pace.reported() };
        let mut writer = DocumentWriter::new(&run.model.header.name, &run.look.up, &times);
        writer.run(run, &poses, &of_motion);
        let (json, bytes) = writer.finish().ok_or_else(|| {
            run.unreadable("it has numbers that are too large for single precision".into())
        })?;
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
