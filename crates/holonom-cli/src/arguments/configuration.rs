//! Arguments of `check` and `modes`, which look at one configuration of a model.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use holonom::modes::About;

use super::shared::ModelArguments;

#[derive(Args)]
pub(crate) struct CheckArguments {
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

#[derive(Args)]
pub(crate) struct ModesArguments {
    #[command(flatten)]
    pub(crate) model: ModelArguments,
    /// How many vibrations, softest first; where there are fewer, decays; unstable modes are added
    #[arg(short, long, value_name = "K", default_value_t = 10)]
    pub(crate) number: usize,
    /// About which configuration
    #[arg(long, value_enum, default_value_t = At::Start)]
    pub(crate) at: At,
    /// Follow the modes over N speeds of rotation from A to B, rad/s: the Campbell diagram
    #[arg(long, value_name = "A:B:N", value_parser = speeds, conflicts_with = "at")]
    pub(crate) speeds: Option<Speeds>,
    /// The lowest critical load factors and the shapes in which the system buckles, from the
    /// equilibrium at t = 0 or, with --at static, from that at the end: the loads of the path are
    /// scaled, constant ones kept; a factor of 1 is the loads at the end
    #[arg(long, conflicts_with = "speeds")]
    pub(crate) buckling: bool,
    /// Write modes.json, modes.csv, modes.html with the moving shapes, and pictures of them into
    /// this folder; with --speeds campbell.json, campbell.csv, campbell.svg and the page
    /// modes.html; with --buckling buckling.json, buckling.csv, buckling.html
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Replace files of an earlier call
    #[arg(long, requires = "output")]
    pub(crate) force: bool,
    /// Print the modes with their shapes as JSON on standard output
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
    /// The steady motion of the initial velocities, with wheels that roll and rotors that spin
    Motion,
}

impl From<At> for About {
    fn from(at: At) -> Self {
        match at {
            At::Start => Self::Start,
            At::Static => Self::Static,
            At::Rotation => Self::Rotation,
            At::Motion => Self::Motion,
        }
    }
}

/// Speeds of rotation, rad/s.
#[derive(Clone)]
pub(crate) struct Speeds(pub(crate) Vec<f64>);

fn speeds(text: &str) -> Result<Speeds, String> {
    let help = || "write FIRST:LAST:NUMBER in rad/s, such as 0:40:21".to_owned();
    let parts: Vec<&str> = text.split(':').collect();
    let [first, last, number_of] = parts.as_slice() else { return Err(help()) };
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    let (Some(first), Some(last)) = (number(first), number(last)) else { return Err(help()) };
    let count: u16 = number_of.trim().parse().map_err(|_| help())?;
    let apart = (last - first).abs() > 0.0;
    if !(2..=10_000).contains(&count) || !apart {
        return Err(
            "there are 2 to 10000 speeds, the first and the last of them different".to_owned()
        );
    }
    let at = |k: u16| first + (last - first) * f64::from(k) / f64::from(count - 1);
    Ok(Speeds((0..count).map(at).collect()))
}
