//! Arguments of `optimize`.

use std::path::PathBuf;

use clap::Args;

use super::run::Talk;
use super::shared::ModelArguments;

#[derive(Args)]
#[command(
    after_help = "[optimize] of the model says what is free: parameters, or beside a [[control]] the time. [[objective]] and \
                  [[condition]] say what is wanted. The folder holds the run of the optimum, optimum.json and iterations.csv."
)]
pub(crate) struct OptimizeArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Folder of the results; by default MODEL-optimum in the current directory
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the results of an earlier call
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) talk: Talk,
}
