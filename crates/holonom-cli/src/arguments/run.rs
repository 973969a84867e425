//! Arguments of `run` and `resume`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use holonom::Override;
use holonom::model::Scheme;

use super::shared::{ModelArguments, scheme, steps};

/// Formats of the trajectory.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TrajectoryFormat {
    /// trajectory.csv
    Csv,
}

#[derive(Args)]
pub(crate) struct RunArguments {
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
    /// What is recorded: coordinates, or positions alone, in trajectory.csv; joints: their
    /// coordinates in sensors.csv
    #[arg(long, value_name = "WHAT", value_delimiter = ',', value_parser = ["coordinates", "positions", "joints", "none"])]
    pub(crate) columns: Option<Vec<String>>,
    /// Where a step is refused: end the run, or take that step in smaller parts
    #[arg(long, value_name = "A", value_parser = ["stop", "substep"])]
    pub(crate) on_failure: Option<String>,
    /// Formats of the trajectory
    #[arg(long, value_delimiter = ',', default_value = "csv")]
    pub(crate) format: Vec<TrajectoryFormat>,
    /// Write a checkpoint every K steps, from which `holonom resume DIR` continues
    ///
    /// SIGINT (Ctrl-C) and SIGTERM end a run after the step that they meet, with a checkpoint in
    /// any case.
    #[arg(long, value_name = "K", value_parser = steps)]
    pub(crate) checkpoint_every: Option<u64>,
    /// Replace the results of an earlier run
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) talk: Talk,
}

/// The list of a model file; `none` adds nothing to it.
fn listed(columns: &[String]) -> String {
    let columns = columns.iter().filter(|what| *what != "none");
    format!("{:?}", columns.collect::<Vec<_>>())
}

impl RunArguments {
    /// All replacements, the options before the keys, so that `--set` takes precedence.
    pub(crate) fn overrides(&self) -> Vec<Override> {
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
        let given = |(key, value)| Some(Override::new(format!("simulation.{key}"), value?));
        options.into_iter().filter_map(given).chain(self.model.set.iter().cloned()).collect()
    }
}

/// A number as TOML writes it.
fn number(value: f64) -> String {
    if value.is_nan() { "nan".to_owned() } else { format!("{value:?}") }
}

#[derive(Args)]
#[command(
    after_help = "The run continues with the step after its newest good checkpoint; rows that were written \
                        later are written again. All files become those of a run that was not interrupted."
)]
pub(crate) struct ResumeArguments {
    /// The folder of a run
    pub(crate) dir: PathBuf,
    /// Write a checkpoint every K steps; by default as before
    #[arg(long, value_name = "K", value_parser = steps)]
    pub(crate) checkpoint_every: Option<u64>,
    #[command(flatten)]
    pub(crate) talk: Talk,
}

/// What a verb prints that runs a model.
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
