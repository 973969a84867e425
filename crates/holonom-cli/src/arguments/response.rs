//! Arguments of `response`.

use std::path::PathBuf;

use clap::Args;
use holonom::response::{AddedDamping, Band, ResponseInput};

use super::configuration::At;
use super::shared::ModelArguments;

#[derive(Args)]
#[command(
    after_help = "Amplitudes and phases are those of the sensors of the model. Loads that excite take no part in the state; \
                        their stated force and torque are amplitudes. With base motion, positions, velocities and accelerations \
                        are those in space."
)]
pub(crate) struct ResponseArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// What excites: load.NAME, base.x=AMPLITUDE (the ground moves, m; also y, z) or
    /// unbalance.BODY.z=U (the force U ω² that turns about an axis, kg·m); may be repeated
    #[arg(long, value_name = "INPUT", required = true)]
    pub(crate) input: Vec<ResponseInput>,
    /// N frequencies from A to B, Hz; resonances between them are added with their flanks
    #[arg(long, value_name = "A:B:N", value_parser = band, allow_negative_numbers = true)]
    pub(crate) band: Band,
    /// About which configuration
    #[arg(long, value_enum, default_value_t = At::Start)]
    pub(crate) at: At,
    /// Damping α M + β K beside that of the model, 1/s and s
    #[arg(long, value_name = "ALPHA:BETA", value_parser = rayleigh, allow_negative_numbers = true)]
    pub(crate) rayleigh: Option<[f64; 2]>,
    /// Damping ratios of the vibrations, slowest first, beside that of the model; the last one is
    /// that of all further ones
    #[arg(long, value_name = "Z,…", value_delimiter = ',', value_parser = ratio, allow_negative_numbers = true)]
    pub(crate) damping_ratio: Vec<f64>,
    /// Write response.json, response.csv, response.html and charts into this folder
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Replace files of an earlier call
    #[arg(long, requires = "output")]
    pub(crate) force: bool,
    /// Print the response as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let all: Option<Vec<f64>> = text
        .split(':')
        .map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite()))
        .collect();
    all?.try_into().ok()
}

fn band(text: &str) -> Result<Band, String> {
    let help = || "write FIRST:LAST:NUMBER in Hz, such as 1:50:200".to_owned();
    let [low, high, count] = numbers(text).ok_or_else(help)?;
    if count.fract() != 0.0 {
        return Err(help());
    }
    Band::new([low, high], count.max(0.0) as usize).map_err(str::to_owned)
}

fn rayleigh(text: &str) -> Result<[f64; 2], String> {
    let none = || [-1.0; 2]; // not two numbers
    let pair = numbers(text).unwrap_or_else(none);
    AddedDamping::new(pair, Vec::new()).map(|own| own.rayleigh).map_err(str::to_owned)
}

fn ratio(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().unwrap_or(f64::NAN);
    AddedDamping::new([0.0; 2], vec![number]).map(|_| number).map_err(str::to_owned)
}
