//! Arguments of `compare`, `bench` and `verify`, which measure schemes on a model.

use std::path::PathBuf;

use clap::Args;
use holonom::model::Scheme;

use super::shared::{ModelArguments, scheme, steps};

#[derive(Args)]
pub(crate) struct CompareArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Folder of the results; by default MODEL-compare in the current directory
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Schemes to compare; all by default
    #[arg(long, value_name = "S,…", value_delimiter = ',', value_parser = scheme())]
    pub(crate) schemes: Vec<Scheme>,
    /// Time steps, s: the first is that of the table; by default that of the model and three
    /// halvings
    #[arg(long, value_name = "H,…", value_delimiter = ',', allow_negative_numbers = true)]
    pub(crate) step: Vec<f64>,
    /// End time, s; by default that of the model, but at most 2000 steps and fewer where these
    /// would take long
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub(crate) end: Option<f64>,
    /// Orders in error against time
    #[arg(long, value_name = "K,…", value_delimiter = ',', default_values = ["2", "4"])]
    pub(crate) order: Vec<u32>,
    /// CPU time that everything may take, s, about; what would take longer is left out
    #[arg(long, value_name = "SECONDS", value_parser = effort, default_value = "30")]
    pub(crate) effort: f64,
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
pub(crate) struct BenchArguments {
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
pub(crate) struct VerifyArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Folder of the certificate; by default MODEL-verify in the current directory
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Accuracy for the recommended step, relative to the largest coordinate
    #[arg(long, value_name = "E", default_value = "1e-6", value_parser = accuracy)]
    pub(crate) accuracy: f64,
    /// Print all tables and remarks, too; the page has them in any case
    #[arg(long)]
    pub(crate) tables: bool,
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

fn effort(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|seconds| *seconds > 0.0)
        .ok_or_else(|| "write a positive number of seconds, such as 30".to_owned())
}

fn accuracy(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|e| *e >= 1e-14 && *e < 1.0)
        .ok_or_else(|| "write a number from 1e-14 to 1, such as 1e-6".to_owned())
}
