//! Arguments of `identify`.

use std::path::PathBuf;

use clap::Args;

use super::run::Talk;
use super::shared::ModelArguments;

#[derive(Args)]
#[command(
    after_help = "The data are comma-separated values with a line of headings: `t` in s from the start of the run on, and the \
                  column of each [[measurement]]; an empty field was not measured. Unknown numbers are those of [identify]. Ctrl-C \
                  ends the method with its last iterate. Exit code 1: it has not converged, or the data do not see a combination."
)]
pub(crate) struct IdentifyArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// The measured values (CSV)
    pub(crate) data: PathBuf,
    /// Folder of the results; by default MODEL-estimate in the current directory
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the results of an earlier call
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) talk: Talk,
}
