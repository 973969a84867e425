//! `holonom compare`: variational and energy–momentum schemes side by side.

use holonom::RunFolder;
use holonom::compare::{CompareError, Request, compare as compared, page, table};
use holonom::model::Scheme;

use crate::arguments::CompareArguments;
use crate::failure::Failure;
use crate::input::ModelInput;
use crate::reproduce::command;
use crate::run::keep_the_model;
use crate::{stderr, stdout};

/// Files of a comparison.
const FILES: [&str; 3] = ["compare.json", "compare.html", "model.toml"];

pub(crate) fn compare(arguments: &CompareArguments) -> Result<(), Failure> {
    let input = ModelInput::new(&arguments.model, arguments.model.set.clone(), arguments.json);
    let model = input.read()?;
    arguments.schemes.iter().try_for_each(|scheme| check(*scheme))?;
    let path = &arguments.model.model;
    let folder =
        arguments.output.clone().unwrap_or_else(|| RunFolder::default_for(path, "compare"));
    keep_the_model(path, &folder.join("model.toml"))?;
    RunFolder::vacant(&folder, &FILES, arguments.force)?;
    RunFolder::takes_meshes(&folder, &model.meshes)?;
    let request = Request {
        schemes: arguments.schemes.clone(),
        steps: arguments.step.clone(),
        end: arguments.end,
        orders: arguments.order.clone(),
        budget: Some(arguments.effort),
        ..Request::default()
    };
    let mut progress = |part: &str| {
        if !arguments.quiet {
            stderr::line(&format!("  {part}"));
        }
    };
    let comparison = match compared(&model, &request, &mut progress) {
        Ok(comparison) => comparison,
        Err(CompareError::Model(error)) => return Err(input.refused(error)?),
        Err(error) => {
            let help = "see `holonom compare --help`".into();
            return Err(Failure::Usage { message: error.to_string(), help });
        }
    };
    let folder = RunFolder::create_for(folder, &FILES, arguments.force)?;
    folder.write_model(&model)?;
    let json = serde_json::to_value(&comparison).unwrap_or_default();
    let files = [
        folder.write("compare.json", &format!("{json:#}\n"))?,
        folder.write("compare.html", &page::page(&comparison, &model, &command()))?,
        folder.path().join("model.toml"),
    ];
    if !arguments.quiet {
        stderr::print(&format!("\n{}\nwritten\n", table::text(&comparison)));
        files.iter().for_each(|file| stderr::line(&format!("  {}", file.display())));
    }
    if arguments.json { stdout::json(&json) } else { Ok(()) }
}

/// That a scheme can be compared.
fn check(scheme: Scheme) -> Result<(), Failure> {
    if scheme != Scheme::Static {
        return Ok(());
    }
    let message = "`static` computes equilibria, no motion: it cannot be compared".into();
    Err(Failure::Usage { message, help: "leave it out of --schemes".into() })
}
