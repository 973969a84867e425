//! `holonom import`: a model file from a robot description.

use std::path::PathBuf;

use holonom::import::{Base, ImportError, ImportOptions, Imported, import as translate};
use holonom::output::{OutputError, atomically};
use holonom::run::prepare;
use serde_json::{Value, json};

use crate::arguments::ImportArguments;
use crate::diagnostic;
use crate::failure::Failure;
use crate::{stderr, stdout};

pub(crate) fn import(arguments: &ImportArguments) -> Result<(), Failure> {
    let file = arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.robot.file_stem().unwrap_or_else(|| "robot".as_ref());
        PathBuf::from(format!("{}.toml", stem.display()))
    });
    Failure::unless_vacant(&file, arguments.force)?;
    let options = ImportOptions {
        base: if arguments.free_base { Base::Free } else { Base::Fixed },
        values: arguments.joint.clone(),
        density: arguments.density,
        repair_inertia: arguments.repair_inertia,
        close: arguments.close.clone(),
        armature: !arguments.no_armature,
        actuators: arguments.actuators,
        contacts: arguments.contacts,
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
    let warnings = prepare(&imported.model).map(|found| found.assembly().warnings.clone());
    let warnings = warnings.unwrap_or_default(); // what cannot be assembled is told by `check`
    if arguments.json {
        return stdout::json(&report(&imported, &warnings, arguments, &file.display().to_string()));
    }
    let Imported { model, remarks, .. } = &imported;
    let (bodies, joints) = (model.bodies.len(), model.joints.len());
    let constraints = model.constraints.len();
    if !remarks.is_empty() {
        stderr::line("not translated, or in another form:");
        remarks.iter().for_each(|remark| stderr::line(&format!("  {remark}")));
    }
    warnings.iter().for_each(|warning| stderr::line(&format!("warning: {warning}")));
    stderr::line(&format!(
        "{}: bodies {bodies}, joints {joints}, constraints {constraints}",
        file.display()
    ));
    Ok(())
}

fn report(
    imported: &Imported,
    warnings: &[String],
    arguments: &ImportArguments,
    file: &str,
) -> Value {
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
        "warnings": warnings,
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
