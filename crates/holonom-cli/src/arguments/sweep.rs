//! Arguments of `sweep` and `collect`.

use std::num::NonZero;
use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use holonom::sweep::{PointSampling, Shard, Variation};

use super::shared::ModelArguments;

#[derive(Args)]
#[command(
    after_help = "Each point is a run in a folder of its own. The same command continues a sweep that was stopped; the \
                        results do not depend on -j and --shard.\n\n  holonom sweep top.toml --vary body.top.mass=1:2:11\n  \
                        holonom sweep top.toml --vary body.top.mass=1:2 --sample sobol -n 64"
)]
pub(crate) struct SweepArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Vary a value: N values from A to B, a list, or with --sample a range A:B; may be repeated
    #[arg(long, value_name = "KEY=A:B:N|KEY=V1,V2,…|KEY=A:B", required = true)]
    pub(crate) vary: Vec<Variation>,
    /// How points are chosen
    #[arg(long, value_name = "HOW", default_value = "grid", value_parser = sampling())]
    pub(crate) sample: PointSampling,
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
fn sampling() -> impl TypedValueParser<Value = PointSampling> {
    PossibleValuesParser::new(PointSampling::ALL.map(PointSampling::name)).map(|name| {
        let found = PointSampling::ALL.into_iter().find(|sampling| sampling.name() == name);
        found.expect("it is one of the possible values")
    })
}

#[derive(Args)]
pub(crate) struct CollectArguments {
    /// The folder of a sweep, finished or not
    pub(crate) dir: PathBuf,
    /// Print the table on standard output and write nothing
    #[arg(long)]
    pub(crate) print: bool,
}
