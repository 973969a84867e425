//! `holonom examples`: the shipped models.

use std::ffi::OsStr;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

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
    "trebuchet_sling",
    "clock",
    "suspension",
    "car_corner",
    "bearing_rotor",
    "motor",
    "quadruped",
    "quadruped_stands",
    "panda",
    "rolling_disc",
    "bicycle",
    "door",
    "slider_crank_stop",
    "four_bar_friction",
    "bouncing_balls",
    "newtons_cradle",
    "tippe_top",
    "rattleback",
    "falling_chain",
    "friction_pendulum",
    "optimum_pendulum",
    "optimum_cart_pole",
    "optimum_satellite",
    "optimum_four_bar",
    "optimum_six_bodies",
    "optimum_arm",
];

/// Files that shipped models name: they stand beside the model, under its name.
const FILES: &[(&str, &str)] = &[
    ("motor.csv", include_str!("../models/motor.csv")),
    ("friction_pendulum.csv", include_str!("../models/friction_pendulum.csv")),
];

pub(crate) fn examples(arguments: &ExamplesArguments) -> Result<(), Failure> {
    if let Some(folder) = &arguments.all {
        let io = |source| OutputError::Io { path: folder.clone(), source };
        std::fs::create_dir_all(folder).map_err(io)?;
        let models = MODELS.iter().map(|(name, text)| (folder.join(format!("{name}.toml")), *text));
        let files = FILES.iter().map(|(name, text)| (folder.join(name), *text));
        return write(&models.chain(files).collect::<Vec<_>>(), arguments.force);
    }
    let Some(name) = &arguments.name else { return list() };
    let Some((_, text)) = MODELS.iter().find(|m| m.0 == name) else { return Err(unknown(name)) };
    match &arguments.output {
        Some(file) => {
            let is_own = |f: &&(&str, &str)| Path::new(f.0).file_stem() == Some(OsStr::new(name));
            let beside = FILES.iter().filter(is_own).map(|f| (file.with_file_name(f.0), f.1));
            let model = std::iter::once((file.clone(), *text));
            write(&model.chain(beside).collect::<Vec<_>>(), arguments.force)
        }
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

/// Writes files; with `force` even over others, without it none where one of them is there.
fn write(files: &[(PathBuf, &str)], force: bool) -> Result<(), Failure> {
    if let Some((there, _)) = files.iter().find(|(file, _)| !force && file.exists()) {
        return Err(exists(there));
    }
    for (file, text) in files {
        let mut options = OpenOptions::new();
        options.write(true).create(true).truncate(true).create_new(!force);
        match options.open(file).and_then(|mut opened| opened.write_all(text.as_bytes())) {
            Ok(()) => stderr::line(&file.display().to_string()),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => return Err(exists(file)),
            Err(source) => return Err(OutputError::Io { path: file.clone(), source }.into()),
        }
    }
    Ok(())
}
