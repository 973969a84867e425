//! Arguments of `export-fmu`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use holonom_fmu::Version;

use super::shared::ModelArguments;

#[derive(Args)]
#[command(
    after_help = "Outputs are the columns of the sensors; inputs are an effort on each joint with a motor and the signals \
                        that are numbers; parameters are the numbers of [parameters] and the step.\n\n  holonom export-fmu \
                        crane.toml --input hook --parameter body.hook.mass"
)]
pub(crate) struct UnitArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// The file to write; by default MODEL.fmu in the current folder
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// The version of the standard
    #[arg(long, value_name = "VERSION", default_value = "3", value_parser = version())]
    pub(crate) fmi: Version,
    /// A library of the unit, for more platforms than this one; may be repeated. By default the one
    /// beside the program
    #[arg(long, value_name = "FILE")]
    pub(crate) library: Vec<PathBuf>,
    /// The folder of a package that holds the library
    #[arg(skip)]
    pub(crate) package: Option<PathBuf>,
    /// One more input: a joint (arm, arm.1, arm.setpoint), a body (its force and torque; arm.force,
    /// arm.torque), a signal; may be repeated
    #[arg(long, value_name = "NAME")]
    pub(crate) input: Vec<String>,
    /// One more parameter: the key of a number, such as body.arm.mass; may be repeated
    #[arg(long, value_name = "KEY")]
    pub(crate) parameter: Vec<String>,
    /// Print what the unit has as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Replace the file if it exists
    #[arg(long)]
    pub(crate) force: bool,
}

fn version() -> impl TypedValueParser<Value = Version> {
    let known = PossibleValuesParser::new(["2", "3"]);
    known.map(|version| if version == "2" { Version::Fmi2 } else { Version::Fmi3 })
}
