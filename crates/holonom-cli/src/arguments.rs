//! The command line.

use std::num::NonZero;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use holonom::export::Format as ExportFormat;
use holonom::model::Scheme;
use holonom::sweep::{Sampling, Shard, Variation};

use crate::import::Import;
use crate::plot::Plot;

/// Variational integrators for constrained mechanical systems.
#[derive(Parser)]
#[command(name = "holonom", version, after_help = AFTER, disable_help_subcommand = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) verb: Verb,
}

const AFTER: &str = "Start with:\n  holonom examples pendulum -o pendulum.toml\n  holonom run \
                     pendulum.toml\n\nExit codes: 0 done, 1 the run failed, 2 usage, 3 the model \
                     is invalid, 130 or 143 interrupted by a signal.";

#[derive(Subcommand)]
pub(crate) enum Verb {
    /// Simulate a model; write trajectory, summary, plots and a report
    Run(Run),
    /// Continue a run that was interrupted or killed, from its last checkpoint
    Resume(Resume),
    /// Run a model at many points: a grid or samples of its values, in parallel
    Sweep(Sweep),
    /// Collect the points of a sweep into one table and a page
    Collect(Collect),
    /// Validate and assemble a model: degrees of freedom, redundant joints, initial errors
    Check(Check),
    /// Run all schemes on a model: conservation, cost, error against time
    Compare(Compare),
    /// What a step costs, and its parts: residual, matrix, solution, recording
    Bench(Bench),
    /// Natural frequencies and mode shapes about the initial configuration or an equilibrium
    Modes(Modes),
    /// Measure orders, energy, momentum, constraints and symplecticity on a model; recommend a step
    Verify(Verify),
    /// Show a finished run in the browser: the animated scene, charts, facts
    View(View),
    /// Write the results of a finished run for other programs
    Export(Export),
    /// Draw plots and report of a run again, or chosen columns of runs as SVG, PDF or PNG
    Plot(Plot),
    /// Translate a robot description (URDF, MJCF) into a model file
    Import(Import),
    /// Print the keys of a section of model files, or the JSON schema of all
    Schema(Schema),
    /// List the shipped models, or write them
    Examples(Examples),
    /// Print a completion script for a shell
    Completions {
        /// The shell
        shell: Shell,
    },
}

/// What `run` and `check` share: a model, and values of it to replace.
#[derive(Args)]
pub(crate) struct ModelArguments {
    /// The model file (TOML)
    pub(crate) model: PathBuf,
    /// Replace a value of the model, such as body.top.mass=2.5; may be repeated
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub(crate) set: Vec<(String, String)>,
}

fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() && !value.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("write KEY=VALUE, such as body.top.mass=2.5".to_owned()),
    }
}

/// Formats of the trajectory.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// trajectory.csv
    Csv,
}

/// A scheme by its name in model files.
fn scheme() -> impl TypedValueParser<Value = Scheme> {
    let all = Scheme::ALL.into_iter().chain([Scheme::Static]);
    PossibleValuesParser::new(all.clone().map(Scheme::name)).map(move |name| {
        all.clone().find(|scheme| scheme.name() == name).expect("it is one of the possible values")
    })
}

#[derive(Args)]
pub(crate) struct Run {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Folder of the results; by default MODEL-out in the current directory
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Time-stepping scheme
    #[arg(long, value_parser = scheme())]
    pub(crate) scheme: Option<Scheme>,
    /// Order of accuracy: 2, 4, 6 or 8; up to 16 with --method galerkin
    #[arg(long, value_name = "K", value_parser = ["2", "4", "6", "8", "10", "12", "14", "16"])]
    pub(crate) order: Option<String>,
    /// How orders above 2 are reached
    #[arg(long, value_name = "M", value_parser = ["composition", "galerkin"])]
    pub(crate) method: Option<String>,
    /// Time step, s
    #[arg(long, value_name = "H", allow_negative_numbers = true)]
    pub(crate) step: Option<f64>,
    /// End time, s
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub(crate) end: Option<f64>,
    /// Record every K-th step
    #[arg(long, value_name = "K")]
    pub(crate) every: Option<u64>,
    /// What is recorded: coordinates, or positions alone, in trajectory.csv; joints: their coordinates in sensors.csv
    #[arg(long, value_name = "WHAT", value_delimiter = ',', value_parser = ["coordinates", "positions", "joints", "none"])]
    pub(crate) columns: Option<Vec<String>>,
    /// Where a step is refused: end the run, or take that step in smaller parts
    #[arg(long, value_name = "A", value_parser = ["stop", "substep"])]
    pub(crate) on_failure: Option<String>,
    /// Formats of the trajectory
    #[arg(long, value_delimiter = ',', default_value = "csv")]
    pub(crate) format: Vec<Format>,
    /// Write a checkpoint every K steps, from which `holonom resume DIR` continues
    ///
    /// SIGINT (Ctrl-C) and SIGTERM end a run after the step that they meet, with a checkpoint in any case.
    #[arg(long, value_name = "K", value_parser = steps)]
    pub(crate) checkpoint_every: Option<u64>,
    /// Replace the results of an earlier run
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) talk: Talk,
}

/// What `run` and `resume` print.
#[derive(Args)]
pub(crate) struct Talk {
    /// Print the summary as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// No progress bar
    #[arg(long)]
    pub(crate) no_progress: bool,
    /// Print errors only
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

fn steps(text: &str) -> Result<u64, String> {
    let number: Option<u64> = text.parse().ok();
    number.filter(|k| *k > 0).ok_or_else(|| "write a number of steps, at least 1".to_owned())
}

#[derive(Args)]
#[command(
    after_help = "The run continues with the step after its newest good checkpoint; rows that were written \
                        later are written again. All files become those of a run that was not interrupted."
)]
pub(crate) struct Resume {
    /// The folder of a run
    pub(crate) dir: PathBuf,
    /// Write a checkpoint every K steps; by default as before
    #[arg(long, value_name = "K", value_parser = steps)]
    pub(crate) checkpoint_every: Option<u64>,
    #[command(flatten)]
    pub(crate) talk: Talk,
}

/// The list of a model file; `none` adds nothing to it.
fn listed(columns: &[String]) -> String {
    let columns = columns.iter().filter(|what| *what != "none");
    format!("{:?}", columns.collect::<Vec<_>>())
}

impl Run {
    /// All replacements, the options before the keys, so that `--set` takes precedence.
    pub(crate) fn overrides(&self) -> Vec<(String, String)> {
        let options = [
            ("scheme", self.scheme.map(|s| format!("{:?}", s.name()))),
            ("order", self.order.clone()),
            ("method", self.method.as_ref().map(|method| format!("{method:?}"))),
            ("step", self.step.map(number)),
            ("end", self.end.map(number)),
            ("every", self.every.map(|k| k.to_string())),
            ("columns", self.columns.as_ref().map(|what| listed(what))),
            ("on_failure", self.on_failure.as_ref().map(|action| format!("{action:?}"))),
        ];
        let given = options.into_iter().filter_map(|(k, v)| Some((format!("simulation.{k}"), v?)));
        given.chain(self.model.set.iter().cloned()).collect()
    }
}

#[derive(Args)]
#[command(
    after_help = "Each point is a run in a folder of its own. The same command continues a sweep that was stopped; the \
                        results do not depend on -j and --shard.\n\n  holonom sweep top.toml --vary body.top.mass=1:2:11\n  \
                        holonom sweep top.toml --vary body.top.mass=1:2 --sample sobol -n 64"
)]
pub(crate) struct Sweep {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Vary a value: N values from A to B, a list, or with --sample a range A:B; may be repeated
    #[arg(long, value_name = "KEY=A:B:N|KEY=V1,V2,…|KEY=A:B", required = true)]
    pub(crate) vary: Vec<Variation>,
    /// How points are chosen
    #[arg(long, value_name = "HOW", default_value = "grid", value_parser = sampling())]
    pub(crate) sample: Sampling,
    /// Number of samples
    #[arg(short = 'n', long = "points", value_name = "N")]
    pub(crate) points: Option<usize>,
    /// Seed of the samples
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub(crate) seed: u64,
    /// Threads; by default one for each core
    #[arg(short, long, value_name = "N")]
    pub(crate) jobs: Option<NonZero<usize>>,
    /// Only the i-th of n parts of the points: for several machines or jobs with one folder
    #[arg(long, value_name = "i/n", default_value = "1/1")]
    pub(crate) shard: Shard,
    /// Folder of the results; by default MODEL-sweep in the current directory
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Replace another sweep in the folder
    #[arg(long)]
    pub(crate) force: bool,
    /// No progress bar
    #[arg(long)]
    pub(crate) no_progress: bool,
    /// Print errors only
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// A way to choose points by its name.
fn sampling() -> impl TypedValueParser<Value = Sampling> {
    PossibleValuesParser::new(Sampling::ALL.map(Sampling::name)).map(|name| {
        let found = Sampling::ALL.into_iter().find(|sampling| sampling.name() == name);
        found.expect("it is one of the possible values")
    })
}

#[derive(Args)]
pub(crate) struct Collect {
    /// The folder of a sweep, finished or not
    pub(crate) dir: PathBuf,
    /// Print the table on standard output and write nothing
    #[arg(long)]
    pub(crate) print: bool,
}

#[derive(Args)]
pub(crate) struct Compare {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Folder of the results; by default MODEL-compare in the current directory
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Schemes to compare; all by default
    #[arg(long, value_name = "S,…", value_delimiter = ',', value_parser = scheme())]
    pub(crate) schemes: Vec<Scheme>,
    /// Time steps, s: the first is that of the table; by default that of the model and three halvings
    #[arg(long, value_name = "H,…", value_delimiter = ',', allow_negative_numbers = true)]
    pub(crate) step: Vec<f64>,
    /// End time, s; by default that of the model, but at most 2000 steps
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub(crate) end: Option<f64>,
    /// Orders in error against time
    #[arg(long, value_name = "K,…", value_delimiter = ',', default_values = ["2", "4", "6"])]
    pub(crate) order: Vec<u32>,
    /// Replace the results of an earlier comparison
    #[arg(long)]
    pub(crate) force: bool,
    /// Print the findings as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Print errors only
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

#[derive(Args)]
#[command(
    after_help = "Every number is the least of five rounds over the same motion. Parts of a step are called one by one \
                        at the solution of the last step; what is left of a step are initial guesses and momenta."
)]
pub(crate) struct Bench {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Steps in each round
    #[arg(long, value_name = "N", value_parser = steps, default_value = "200")]
    pub(crate) steps: u64,
    /// Schemes to measure; by default that of the model
    #[arg(long, value_name = "S,…", value_delimiter = ',', value_parser = scheme())]
    pub(crate) schemes: Vec<Scheme>,
    /// Order of accuracy; by default that of the model
    #[arg(long, value_name = "K", value_parser = ["2", "4", "6", "8", "10", "12", "14", "16"])]
    pub(crate) order: Option<String>,
    /// Print the times as JSON on standard output, in s
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Args)]
pub(crate) struct Check {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Write a page that shows the initial configuration in 3-D
    #[arg(long, value_name = "FILE.html")]
    pub(crate) page: Option<PathBuf>,
    /// Write a drawing of the initial configuration; its extension is the format: svg, pdf or png
    #[arg(long, value_name = "FILE")]
    pub(crate) picture: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
    /// Print the report as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

/// About which configuration modes are taken.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum At {
    /// The initial configuration, under the loads at t = 0
    Start,
    /// The equilibrium under the loads at the end of the simulation
    Static,
    /// The steady rotation of the initial velocities
    Rotation,
}

#[derive(Args)]
pub(crate) struct Modes {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// How many vibrations, softest first; modes without stiffness and unstable modes are added
    #[arg(short, long, value_name = "K", default_value_t = 10)]
    pub(crate) number: usize,
    /// About which configuration
    #[arg(long, value_enum, default_value_t = At::Start)]
    pub(crate) at: At,
    /// Follow the modes over speeds of rotation from A to B in N steps, rad/s: the Campbell diagram
    #[arg(long, value_name = "A:B:N", value_parser = speeds, conflicts_with = "at")]
    pub(crate) speeds: Option<Speeds>,
    /// Write modes.json, modes.csv, modes.html with the moving shapes, and pictures of them into this folder; with --speeds
    /// campbell.json, campbell.csv and campbell.svg
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Replace files of an earlier call
    #[arg(long, requires = "output")]
    pub(crate) force: bool,
    /// Print the modes with their shapes as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Args)]
pub(crate) struct Verify {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Folder of the certificate; by default MODEL-verify in the current directory
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Accuracy for the recommended step, relative to the largest coordinate
    #[arg(long, value_name = "E", default_value = "1e-6", value_parser = accuracy)]
    pub(crate) accuracy: f64,
    /// Replace an earlier certificate
    #[arg(long)]
    pub(crate) force: bool,
    /// Print the certificate as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Print errors only
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// Speeds of rotation, rad/s.
#[derive(Clone)]
pub(crate) struct Speeds(pub(crate) Vec<f64>);

fn speeds(text: &str) -> Result<Speeds, String> {
    let help = || "write FIRST:LAST:STEPS in rad/s, such as 0:40:20".to_owned();
    let parts: Vec<&str> = text.split(':').collect();
    let [first, last, steps] = parts.as_slice() else { return Err(help()) };
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let (Some(first), Some(last)) = (number(first), number(last)) else { return Err(help()) };
    let steps: u16 = steps.trim().parse().map_err(|_| help())?;
    let apart = (last - first).abs() > 0.0;
    if steps == 0 || steps > 10_000 || !apart {
        return Err("between two different speeds there are 1 to 10000 steps".to_owned());
    }
    let at = |k: u16| first + (last - first) * f64::from(k) / f64::from(steps);
    Ok(Speeds((0..=steps).map(at).collect()))
}

fn accuracy(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|e| *e >= 1e-14 && *e < 1.0)
        .ok_or_else(|| "write a number from 1e-14 to 1, such as 1e-6".to_owned())
}

#[derive(Args)]
pub(crate) struct View {
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
pub(crate) struct Export {
    /// The folder of a run
    pub(crate) dir: PathBuf,
    /// The format: npz (NumPy), parquet (pandas), vtk (ParaView), gltf (Blender), svg (an animated drawing);
    /// --format alone lists them
    #[arg(long, num_args = 0..=1, default_value = "npz", default_missing_value = "", value_parser = export_format)]
    pub(crate) format: ExportFormat,
    /// The file to write, for parquet and vtk a folder; by default DIR.npz, DIR-parquet, DIR-vtk, DIR.glb or DIR.svg in the current folder
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Frames at most, evenly spread over the recorded nodes; by default 200 for vtk and svg, 600 for gltf
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

#[derive(Args)]
pub(crate) struct Schema {
    /// A section, such as joint: its keys, units, defaults and an example; without it, the JSON schema of all
    pub(crate) section: Option<String>,
}

#[derive(Args)]
pub(crate) struct Examples {
    /// The model to write; without it, the list of all
    #[arg(conflicts_with = "all")]
    pub(crate) name: Option<String>,
    /// Write it to this file instead of standard output
    #[arg(short, long, value_name = "FILE", requires = "name")]
    pub(crate) output: Option<PathBuf>,
    /// Write all models into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) all: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
}

/// A number as TOML writes it.
fn number(value: f64) -> String {
    if value.is_nan() { "nan".to_owned() } else { format!("{value:?}") }
}
