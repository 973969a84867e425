//! A folder for ParaView and other programs that read the XML files of VTK.
//!
//! ```text
//! run.pvd                  the frames with their times
//! frames/000000.vtm        a frame: its blocks by name
//! frames/000000/NAME.vtp   a block
//! ```
//!
//! | block | cells | arrays |
//! |---|---|---|
//! | `bodies` | triangles | points: `Normals`, `velocity`; cells: `body`, `color`, where any lets see through `opacity` |
//! | `centers` | a point for each body and point mass | `name`, `body`, `displacement`, `d1`, `d2`, `d3`, `velocity`, `angular_velocity`, `momentum` |
//! | `beams` | a line for each interval between nodes | points: `beam`, `node`, `displacement`, `d1`, `d2`, `d3`; cells: `Gamma`, `K`, `N`, `M` |
//! | `beam_surfaces` | triangles | points: `Normals`; cells: `beam`, `color`, `Gamma`, `K`, `N`, `M` |
//! | `joints` | a point for each joint and bushing | `name`, `axis` |
//! | `reactions` | a point for each sensor of a reaction along the axes of space, where it is unique | `name`, `force`, `moment` |
//! | `lines` | a line for each bar, distance and spring | `name`, `spring`, `length` |
//!
//! Joints, bushings and lines that an event released are in no block from then on. Every block has
//! `TimeValue` (s) and `step` as field data. Numbers are double precision, those of the files of
//! the run bit for bit.

mod blocks;
mod poly_data;
mod rates;
mod reactions;
mod sections;

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::run::ShownRun;
use crate::{ExportError, Exported};
use blocks::FrameData;
use poly_data::{Array, ArrayValues, PolyData};
use rates::MemberRates;
use reactions::ReactionSensors;
use sections::Sections;

/// The file that ParaView opens.
const COLLECTION: &str = "run.pvd";
/// The folder of the frames.
const FRAMES: &str = "frames";

/// Whether an entry of a folder is one that [`write`] makes.
pub(crate) fn known(entry: &str) -> bool {
    let frame = |name: &str| name.trim_end_matches(".vtm").bytes().all(|b| b.is_ascii_digit());
    let inner = entry.strip_prefix(FRAMES).and_then(|rest| rest.strip_prefix('/'));
    entry == COLLECTION || entry == FRAMES || inner.is_some_and(frame)
}

/// Writes the files of a run to a folder, which is created.
pub(crate) fn write(run: &ShownRun<'_>, to: &Path) -> Result<Exported, ExportError> {
    let failed =
        |error: io::Error| ExportError::Write { path: to.to_owned(), message: error.to_string() };
    fs::create_dir_all(to.join(FRAMES)).map_err(failed)?;
    let mut first = None;
    let mut sources = None;
    let mut times = Vec::new();
    let reader = run.frames()?;
    let recorded = reader.rows();
    for (index, frame) in reader.enumerate() {
        let frame = frame.map_err(|error| run.unreadable(error.to_string()))?;
        let poses = run.poses(&frame);
        let first = first.get_or_insert_with(|| poses.clone());
        let files = match &mut sources {
            Some(files) => files,
            none => none.insert(SupplementaryFiles::open(run, first)?),
        };
        let solids = run.look.solids.iter().map(|solid| solid.member);
        let own: Vec<_> = solids.map(|member| poses[member]).collect();
        let scene = FrameData {
            run,
            t: frame.t,
            poses: [first, &poses],
            rates: &files.rates.at(frame.step, &own)?,
            sections: &files.sections.at(frame.step)?,
            reactions: &files.reactions.at(frame.step, &poses)?,
        };
        let time = run.time(&frame, index);
        let fields = [
            Array::scalars("TimeValue", ArrayValues::Float64(vec![time])),
            Array::scalars("step", ArrayValues::Int64(vec![frame.step as i64])),
        ];
        let names = blocks::names(run, !files.reactions.is_empty());
        frame_files(to, index, &names, |name| {
            let mut block = scene.block(name);
            block.field_data = fields.to_vec();
            block
        })
        .map_err(failed)?;
        times.push(time);
    }
    collection(&to.join(COLLECTION), &times).map_err(failed)?;
    Ok(Exported { frames: times.len(), recorded, pace: None })
}

/// The files that tell more than where everything is.
struct SupplementaryFiles {
    rates: MemberRates,
    sections: Sections,
    reactions: ReactionSensors,
}

impl SupplementaryFiles {
    fn open(run: &ShownRun<'_>, first: &[crate::tube::MemberPose]) -> Result<Self, ExportError> {
        let solids = run.look.solids.iter().map(|solid| solid.member);
        let members: Vec<_> = solids.map(|member| (&run.members[member], first[member])).collect();
        Ok(Self {
            rates: MemberRates::open(run.folder, &run.model, &members)?,
            sections: Sections::open(run)?,
            reactions: ReactionSensors::open(run)?,
        })
    }
}

/// The name of a frame.
fn stem(index: usize) -> String {
    format!("{index:06}")
}

fn frame_files(
    to: &Path,
    index: usize,
    names: &[&str],
    block: impl Fn(&str) -> PolyData,
) -> io::Result<()> {
    let folder = to.join(FRAMES);
    let own = stem(index);
    fs::create_dir(folder.join(&own))?;
    for name in names {
        let mut file = BufWriter::new(File::create(folder.join(&own).join(format!("{name}.vtp")))?);
        block(name).write(&mut file)?;
        file.flush()?;
    }
    let mut file = BufWriter::new(File::create(folder.join(format!("{own}.vtm")))?);
    head(&mut file, "vtkMultiBlockDataSet", "1.0")?;
    writeln!(file, "<vtkMultiBlockDataSet>")?;
    for (k, name) in names.iter().enumerate() {
        writeln!(file, "<DataSet index=\"{k}\" name=\"{name}\" file=\"{own}/{name}.vtp\"/>")?;
    }
    writeln!(file, "</vtkMultiBlockDataSet>\n</VTKFile>")?;
    file.flush()
}

fn collection(path: &Path, times: &[f64]) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    head(&mut file, "Collection", "1.0")?;
    writeln!(file, "<Collection>")?;
    for (index, time) in times.iter().enumerate() {
        let name = stem(index);
        writeln!(file, "<DataSet timestep=\"{time:?}\" part=\"0\" file=\"{FRAMES}/{name}.vtm\"/>")?;
    }
    writeln!(file, "</Collection>\n</VTKFile>")?;
    file.flush()
}

fn head(file: &mut impl Write, kind: &str, version: &str) -> io::Result<()> {
    writeln!(file, "<?xml version=\"1.0\"?>")?;
    writeln!(file, "<VTKFile type=\"{kind}\" version=\"{version}\" byte_order=\"LittleEndian\">")
}
