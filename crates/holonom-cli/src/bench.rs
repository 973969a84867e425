//! `holonom bench`: what a step costs.

use holonom::Override;
use holonom::bench::{BenchRequest, bench as measured};
use holonom::model::Scheme;

use crate::arguments::BenchArguments;
use crate::failure::Failure;
use crate::input::ModelInput;
use crate::{stderr, stdout};

pub(crate) fn bench(arguments: &BenchArguments) -> Result<(), Failure> {
    let mut overrides = arguments.model.set.clone();
    if let Some(order) = &arguments.order {
        overrides.push(Override::new("simulation.order", order));
    }
    let input = ModelInput::new(&arguments.model, overrides, arguments.json);
    let model = input.read()?;
    let own = model.settings.scheme;
    if arguments.schemes.contains(&Scheme::Static)
        || (arguments.schemes.is_empty() && own == Scheme::Static)
    {
        let message = "`static` computes equilibria, no motion: it has no steps".into();
        return Err(Failure::Usage { message, help: "write --schemes nodal".into() });
    }
    let request = BenchRequest { schemes: arguments.schemes.clone(), steps: arguments.steps };
    let found = match measured(&model, &request) {
        Ok(found) => found,
        Err(error) => return Err(input.refused(error)?),
    };
    if arguments.json {
        return stdout::json(&serde_json::to_value(&found).unwrap_or_default());
    }
    stderr::print(&found.table());
    Ok(())
}
