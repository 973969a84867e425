//! Arguments of `plot`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

#[derive(Args)]
#[command(
    after_help = "Without --what and --list the plots and the report of each run are drawn again.\n\n  \
                  holonom plot top-out --what energy_error -o energy.pdf --style paper\n  \
                  holonom plot chain-out --what '*.z' -o heights.png\n  \
                  holonom plot pendulum-out --what rate:angle -o phases.svg\n  \
                  holonom plot coarse-out fine-out --what H --change -o comparison.svg\n  \
                  holonom plot chain-out --what '*.z,H' -o heights.csv"
)]
pub(crate) struct PlotArguments {
    /// Folders of runs; several are compared in one drawing
    #[arg(required = true, value_name = "DIR")]
    pub(crate) dirs: Vec<PathBuf>,
    /// Draw these columns: names of columns, groups or components, patterns with *, Y:X for Y over
    /// X
    #[arg(long, value_name = "Y[:X],…", requires = "output", conflicts_with = "list")]
    pub(crate) what: Option<String>,
    /// List the columns and groups that --what accepts, with units
    #[arg(long)]
    pub(crate) list: bool,
    /// Draw over this column instead of time
    #[arg(long, value_name = "X", requires = "what")]
    pub(crate) against: Option<String>,
    /// Draw changes since the first node
    #[arg(long, requires = "what")]
    pub(crate) change: bool,
    /// Style of the drawing
    #[arg(long, value_enum, default_value_t = PlotStyle::Report, requires = "what")]
    pub(crate) style: PlotStyle,
    /// Width and height of the drawing, mm
    #[arg(long, value_name = "WxH", value_parser = millimetres, requires = "what")]
    pub(crate) size: Option<(f64, f64)>,
    /// The file to write; its extension is the format: svg, pdf or png, or csv for a table of one
    /// run
    #[arg(short, long, value_name = "FILE", requires = "what")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long, requires = "what")]
    pub(crate) force: bool,
}

/// How a drawing looks.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PlotStyle {
    /// As on the page of a run
    Report,
    /// A figure of one column, 84 mm wide, legible without colours, type as Helvetica
    Paper,
    /// The same with type as Times
    PaperSerif,
}

fn millimetres(text: &str) -> Result<(f64, f64), String> {
    let help = || "write WIDTHxHEIGHT in mm, from 20 to 1000 each, such as 84x60".to_owned();
    let (width, height) = text.split_once('x').ok_or_else(help)?;
    let number = |text: &str| text.trim().parse().ok().filter(|v| (20.0..=1000.0).contains(v));
    number(width).zip(number(height)).ok_or_else(help)
}
