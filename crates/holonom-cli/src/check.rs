//! `holonom check`: validate and assemble, simulate nothing.

use serde_json::json;

use crate::arguments::Check;
use crate::failure::Failure;
use crate::input::Input;
use crate::{human, stderr, stdout};

pub(crate) fn check(arguments: &Check) -> Result<(), Failure> {
    let overrides = arguments.model.set.clone();
    let (model, simulation) = Input::new(&arguments.model, overrides, arguments.json).assemble()?;
    let report = simulation.assembly();
    if arguments.json {
        return stdout::json(&json!({
            "valid": true,
            "file": arguments.model.model.display().to_string(),
            "model": model.header.name,
            "steps": model.settings.steps(),
            "assembly": report,
        }));
    }
    stderr::print(&human::assembly(&model, report));
    Ok(())
}
