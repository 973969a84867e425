//! Results of a run in the formats of other programs, made from the files of its folder.
//!
//! | format | written | read by | numbers |
//! |---|---|---|---|
//! | [`Format::Npz`] | a file `.npz` | NumPy | of the folder, bit for bit; all recorded nodes |
//! | [`Format::Parquet`] | a folder of `.parquet` files | pandas, Polars, DuckDB | of the folder, bit for bit; all recorded nodes |
//! | [`Format::Vtk`] | a folder with `run.pvd` | ParaView, VTK, PyVista | of the folder, bit for bit; some frames |
//! | [`Format::Gltf`] | a file `.glb` | Blender, viewers of glTF | single precision; some frames |
//! | [`Format::Svg`] | a file `.svg` | browsers, pages, slides | a drawing; some frames |
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod coil;
mod gltf;
mod look;
mod mesh;
mod npy;
mod npz;
mod pace;
mod parquet;
mod replace;
mod rows;
mod run;
mod svg;
mod table;
mod tube;
mod vtk;

use holonom_sim::output::{OutputError, RunFolder, atomically};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use run::ShownRun;
use table::RunFiles;

pub use svg::still::configuration;

/// A format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Arrays for NumPy, not compressed.
    Npz,
    /// A folder of tables, a Parquet file each, not compressed.
    Parquet,
    /// A folder of VTK's XML files with a collection of all frames.
    Vtk,
    /// A binary glTF 2.0 file with an animation.
    Gltf,
    /// An animated drawing.
    Svg,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 5] = [Self::Npz, Self::Parquet, Self::Vtk, Self::Gltf, Self::Svg];

    /// The name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Npz => "npz",
            Self::Parquet => "parquet",
            Self::Vtk => "vtk",
            Self::Gltf => "gltf",
            Self::Svg => "svg",
        }
    }

    /// What it is, in a line.
    #[must_use]
    pub fn about(self) -> &'static str {
        match self {
            Self::Npz => "arrays for NumPy: data = numpy.load(\"FILE.npz\")",
            Self::Parquet => {
                "a folder of tables for pandas, Polars, DuckDB: pandas.read_parquet(\"FOLDER/trajectory.parquet\")"
            }
            Self::Vtk => "a folder for ParaView: open its run.pvd",
            Self::Gltf => "an animated scene for Blender: import the .glb file",
            Self::Svg => "an animated drawing for pages and slides",
        }
    }

    /// The name of what is written for a run whose folder has the name `run`.
    #[must_use]
    pub fn file_name(self, run: &str) -> String {
        match self {
            Self::Npz => format!("{run}.npz"),
            Self::Parquet => format!("{run}-parquet"),
            Self::Vtk => format!("{run}-vtk"),
            Self::Gltf => format!("{run}.glb"),
            Self::Svg => format!("{run}.svg"),
        }
    }

    /// Frames that it holds at most where nothing else is asked for; `None`: it holds all recorded
    /// nodes.
    #[must_use]
    pub fn frames(self) -> Option<usize> {
        match self {
            Self::Npz | Self::Parquet => None,
            Self::Vtk => Some(200),
            Self::Gltf => Some(600),
            Self::Svg => Some(200),
        }
    }
}

/// What was written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exported {
    /// Frames in the file.
    pub frames: usize,
    /// Recorded nodes of the run.
    pub recorded: usize,
    /// Seconds of an animation for one of the motion, where that would be too short or too long.
    pub pace: Option<f64>,
}

impl Exported {
    /// All recorded nodes.
    fn all(recorded: usize) -> Self {
        Self { frames: recorded, recorded, pace: None }
    }
}

/// Why nothing is exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A file of the run cannot be read.
    #[error("{}: {message}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        message: String,
    },
    /// The files of the run cannot be read.
    #[error(transparent)]
    Run(#[from] OutputError),
    /// A folder is in the way that holds other files than an earlier result.
    #[error("{} is not a folder that was exported: {entry} is in it", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// One of its entries.
        entry: String,
    },
    /// The result cannot be written.
    #[error("{}: {message}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        message: String,
    },
}

/// Writes the results of a folder to a file or folder, whole or not at all; what is there is
/// replaced. Where the format has frames, they are evenly spread over the recorded nodes: `frames`
/// at most, two at least; `None`: [`Format::frames`].
///
/// # Errors
/// [`ExportError`].
pub fn export(
    folder: &RunFolder,
    format: Format,
    to: &Path,
    frames: Option<usize>,
) -> Result<Exported, ExportError> {
    let failed = |error: std::io::Error| ExportError::Write {
        path: to.to_owned(),
        message: error.to_string(),
    };
    let frames = frames.or(format.frames()).unwrap_or(usize::MAX);
    match format {
        Format::Npz => {
            let results = RunFiles::read(folder)?;
            atomically(to, |file| npz::write(&results, file)).map_err(failed)?;
            Ok(Exported::all(results.trajectory.rows()))
        }
        Format::Parquet => {
            let write = |temporary: &Path| parquet::write(folder, temporary);
            replace::folder(to, parquet::known, write).map(Exported::all)
        }
        Format::Vtk => {
            let run = ShownRun::open(folder, frames)?;
            replace::folder(to, vtk::known, |temporary| vtk::write(&run, temporary))
        }
        Format::Gltf => {
            let scene = gltf::GltfFile::of(&ShownRun::open(folder, frames)?)?;
            let write = |file: &Path| {
                let mut file = BufWriter::new(File::create(file)?);
                scene.write(&mut file)?;
                file.flush()
            };
            atomically(to, write).map_err(failed)?;
            Ok(scene.exported)
        }
        Format::Svg => {
            let drawing = svg::AnimatedDrawing::of(&ShownRun::open(folder, frames)?)?;
            let write = |file: &Path| drawing.write(&mut File::create(file)?);
            atomically(to, write).map_err(failed)?;
            Ok(drawing.exported)
        }
    }
}
