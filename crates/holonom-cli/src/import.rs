//! `holonom import`: a model file from a robot description.

use std::path::PathBuf;

use clap::Args;
use holonom::import::{Base, ImportError, Imported, JointValue, Options, import as translate};
use holonom::output::{OutputError, atomically};
use serde_json::{Value, json};

use crate::diagnostic;
use crate::failure::Failure;
use crate::{stderr, stdout};

#[derive(Args)]
#[command(
    after_help = "What has no counterpart in a model file is listed at the head of the file and on standard error. URDF: the root \
                        link is a part of the ground, unless --free-base is given."
)]
pub(crate) struct Import {
    /// The description: URDF (<robot>) or MJCF (<mujoco>)
    pub(crate) robot: PathBuf,
    /// The file to write; by default the name of the description with the extension toml, in the current directory
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// The root link of a URDF robot moves freely
    #[arg(long)]
    pub(crate) free_base: bool,
    /// Initial value of a joint, m or rad; may be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = joint_value)]
    pub(crate) joint: Vec<JointValue>,
    /// Density of URDF links that state no inertia, kg/m³: of their visual geometry
    #[arg(long, value_name = "RHO", value_parser = density)]
    pub(crate) density: Option<f64>,
    /// Time step, s; by default that of the description, or 1 ms
    #[arg(long, value_name = "H", allow_negative_numbers = true)]
    pub(crate) step: Option<f64>,
    /// End time, s
    #[arg(long, value_name = "T", default_value_t = 1.0, allow_negative_numbers = true)]
    pub(crate) end: f64,
    /// Replace the file if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Print what was and was not translated as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

fn density(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|rho| *rho > 0.0 && *rho <= 1e6)
        .ok_or_else(|| "write a positive density in kg/m³, such as 2700".to_owned())
}

fn joint_value(text: &str) -> Result<JointValue, String> {
    let stated = text.rsplit_once('=').and_then(|(joint, value)| {
        let value = value.trim().parse().ok().filter(|x: &f64| x.is_finite())?;
        Some(JointValue { joint: joint.trim().to_owned(), value })
    });
    stated.ok_or_else(|| "write NAME=VALUE, such as elbow=0.5".to_owned())
}

pub(crate) fn import(arguments: &Import) -> Result<(), Failure> {
    let file = arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.robot.file_stem().unwrap_or_else(|| "robot".as_ref());
        PathBuf::from(format!("{}.toml", stem.display()))
    });
    Failure::unless_vacant(&file, arguments.force)?;
    let options = Options {
        base: if arguments.free_base { Base::Free } else { Base::Fixed },
        values: arguments.joint.clone(),
        density: arguments.density,
        step: arguments.step,
        end: arguments.end,
        folder: file.parent().map(PathBuf::from),
    };
    let imported = match translate(&arguments.robot, &options) {
        Ok(imported) => imported,
        Err(error) => return Err(refused(error, arguments.json)?),
    };
    atomically(&file, |temporary| std::fs::write(temporary, &imported.text))
        .map_err(|source| OutputError::Io { path: file.clone(), source })?;
    if arguments.json {
        return stdout::json(&report(&imported, arguments, &file.display().to_string()));
    }
    let Imported { model, remarks, .. } = &imported;
    let (bodies, joints) = (model.bodies.len(), model.joints.len());
    let constraints = model.constraints.len();
    if !remarks.is_empty() {
        stderr::line("not translated, or in another form:");
        remarks.iter().for_each(|remark| stderr::line(&format!("  {remark}")));
    }
    stderr::line(&format!(
        "{}: bodies {bodies}, joints {joints}, constraints {constraints}",
        file.display()
    ));
    Ok(())
}

fn report(imported: &Imported, arguments: &Import, file: &str) -> Value {
    let Imported { model, remarks, .. } = imported;
    json!({
        "valid": true,
        "file": arguments.robot.display().to_string(),
        "output": file,
        "model": model.header.name,
        "bodies": model.bodies.len(),
        "joints": model.joints.len(),
        "constraints": model.constraints.len(),
        "remarks": remarks,
    })
}

/// With `json`, problems go to standard output too.
fn refused(error: ImportError, json: bool) -> Result<Failure, Failure> {
    if json {
        let report = match &error {
            ImportError::Invalid { path, text, problems } => {
                diagnostic::to_json(path, text, problems)
            }
            other => json!({
                "valid": false,
                "problems": [{ "message": other.to_string(), "line": null, "column": null }],
            }),
        };
        // The exit code must say that nothing was imported, whoever reads.
        match stdout::json(&report) {
            Ok(()) | Err(Failure::Closed) => {}
            Err(other) => return Err(other),
        }
    }
    Ok(Failure::Import(Box::new(error)))
}
