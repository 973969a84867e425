//! Arguments of `view` and `export`, which read the results of a run.

use std::path::PathBuf;

use clap::Args;
use holonom::export::Format as ExportFormat;

#[derive(Args)]
pub(crate) struct ViewArguments {
    /// The folder of a run
    pub(crate) dir: PathBuf,
    /// Begin at this time, s, without playing
    #[arg(long, value_name = "SECONDS")]
    pub(crate) at: Option<f64>,
    /// Print the address of the page and open no browser
    #[arg(long)]
    pub(crate) print: bool,
}

#[derive(Args)]
pub(crate) struct ExportArguments {
    /// The folder of a run
    pub(crate) dir: PathBuf,
    /// The format: npz (NumPy), parquet (pandas), vtk (ParaView), gltf (Blender), svg (an animated
    /// drawing); --format alone lists them
    #[arg(long, num_args = 0..=1, default_value = "npz", default_missing_value = "", value_parser = export_format)]
    pub(crate) format: ExportFormat,
    /// The file to write, for parquet and vtk a folder; by default DIR.npz, DIR-parquet, DIR-vtk,
    /// DIR.glb or DIR.svg in the current folder
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Frames at most, evenly spread over the recorded nodes; by default 200 for vtk and svg, 600
    /// for gltf
    #[arg(long, value_name = "N", value_parser = frames)]
    pub(crate) frames: Option<usize>,
    /// Replace the file if it exists
    #[arg(long)]
    pub(crate) force: bool,
}

fn frames(text: &str) -> Result<usize, String> {
    let frames = text.parse().ok().filter(|frames| *frames >= 2);
    frames.ok_or_else(|| "write a whole number, 2 or more".to_owned())
}

fn export_format(text: &str) -> Result<ExportFormat, String> {
    let formats = ExportFormat::ALL;
    formats.into_iter().find(|format| format.name() == text).ok_or_else(|| {
        let list = formats.map(|format| format!("{} ({})", format.name(), format.about()));
        let list = list.join("; ");
        format!("the formats are: {list}; the folder of a run holds its tables as CSV already")
    })
}
