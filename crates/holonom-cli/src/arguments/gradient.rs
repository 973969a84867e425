//! Arguments of `gradient`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::shared::ModelArguments;

#[derive(Args)]
#[command(
    after_help = "The derivatives are those of the discrete motion, to rounding: one run and one sweep backward, whatever their \
                  number. Efforts of controls are zero."
)]
pub(crate) struct GradientArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// Of these [[objective]] alone, by name, or of the number of a sensor at the end, such as
    /// tip.z; of the sum of all objectives by default
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub(crate) of: Vec<String>,
    /// By what; by default by parameters, controls and initial
    #[arg(long, value_enum, value_name = "KIND,…", value_delimiter = ',')]
    pub(crate) by: Vec<By>,
    /// By these of [parameters] alone, by name, or by any number of the file, by its key, such as
    /// body.arm.mass; by all parameters by default
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub(crate) parameters: Vec<String>,
    /// Compare with central differences of runs in random directions
    #[arg(long)]
    pub(crate) check: bool,
    /// Write gradient.json into this folder
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Replace the file of an earlier call
    #[arg(long, requires = "output")]
    pub(crate) force: bool,
    /// Print the gradient as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Print warnings and errors alone
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// By what derivatives are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum By {
    /// [parameters] that are numbers
    Parameters,
    /// Values of [[control]]
    Controls,
    /// Initial coordinates and rates of joints
    Initial,
    /// The length of all steps, at a fixed number of them
    Step,
}
