//! `holonom examples`: the shipped models.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::Path;

use holonom::model::nearest;
use holonom::output::OutputError;

use crate::arguments::ExamplesArguments;
use crate::failure::Failure;
use crate::{stderr, stdout};

macro_rules! models {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../models/", $name, ".toml")))),*]
    };
}

/// Names and texts.
pub(crate) const MODELS: &[(&str, &str)] = models![
    "pendulum",
    "pendulum_free",
    "free_body",
    "heavy_top_fast",
    "heavy_top_steady",
    "four_particles",
    "simple_pendulum",
    "four_bar_windows",
    "four_bar_windows_40",
    "andrews_squeezer",
    "bricard",
    "flyball_governor",
    "slider_crank",
    "four_bar_loop",
    "six_hinge_cube",
    "six_hinge_line",
    "chain8",
    "heavy_top",
    "gyroscope",
    "hanging_chain",
    "scissor_mast",
    "strandbeest",
    "stewart_platform",
    "flying_beam",
    "roll_up",
    "bend_45",
    "nachbagauer",
    "princeton",
    "right_angle_frame",
    "elbow_cantilever",
    "rotating_strip",
    "flexible_multibody",
    "elastic_ring",
    "flexible_four_bar",
    "rotor",
    "flexible_slider_crank",
    "four_bar_steel",
    "satellite",
    "whirling_shaft",
    "soft_arm",
    "wind_turbine_blade",
    "guitar_string",
    "contact_wire",
    "mooring_line",
    "helicopter_blade",
    "crane_rope",
    "pid_arm",
    "swing_up",
    "trebuchet",
    "clock",
    "quadruped",
    "panda",
    "rolling_disc",
    "bicycle",
];

pub(crate) fn examples(arguments: &ExamplesArguments) -> Result<(), Failure> {
    if let Some(folder) = &arguments.all {
        let io = |source| OutputError::Io { path: folder.clone(), source };
        std::fs::create_dir_all(folder).map_err(io)?;
        let file = |name: &str| folder.join(format!("{name}.toml"));
        if let Some((name, _)) = MODELS.iter().find(|m| !arguments.force && file(m.0).exists()) {
            return Err(exists(&file(name)));
        }
        return MODELS.iter().try_for_each(|(name, text)| write(&file(name), text, true));
    }
    let Some(name) = &arguments.name else { return list() };
    let Some((_, text)) = MODELS.iter().find(|m| m.0 == name) else { return Err(unknown(name)) };
    match &arguments.output {
        Some(file) => write(file, text, arguments.force),
        None => stdout::bytes(text.as_bytes()),
    }
}

fn list() -> Result<(), Failure> {
    let width = MODELS.iter().map(|m| m.0.len()).max().unwrap_or(0);
    let line = |(name, text): &(&str, &str)| format!("{name:width$}  {}\n", description(text));
    stdout::bytes(MODELS.iter().map(line).collect::<String>().as_bytes())
}

fn description(text: &str) -> &str {
    let line = text.lines().find_map(|l| l.strip_prefix("description = "));
    line.unwrap_or_default().trim_matches('"')
}

fn unknown(name: &str) -> Failure {
    let names = || MODELS.iter().map(|m| m.0);
    let help = match nearest(name, names()) {
        Some(best) => format!("did you mean `{best}`?"),
        None => format!("there are: {}", names().collect::<Vec<_>>().join(", ")),
    };
    Failure::Usage { message: format!("there is no shipped model `{name}`"), help }
}

fn exists(file: &Path) -> Failure {
    let message = format!("{} exists", file.display());
    Failure::Usage { message, help: "add --force to replace it".into() }
}

/// Writes a file; with `force` even over another.
fn write(file: &Path, text: &str, force: bool) -> Result<(), Failure> {
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(true).create_new(!force);
    let written = options.open(file).and_then(|mut f| f.write_all(text.as_bytes()));
    match written {
        Ok(()) => {
            stderr::line(&file.display().to_string());
            Ok(())
        }
        Err(e) if e.kind() == ErrorKind::AlreadyExists => Err(exists(file)),
        Err(source) => Err(OutputError::Io { path: file.to_owned(), source }.into()),
    }
}
