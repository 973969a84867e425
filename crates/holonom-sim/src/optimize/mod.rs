//! Optima of a model: the parameters, or the controls and the time, of least cost that meet the
//! conditions.
//!
//! | file | concept |
//! |---|---|
//! | `design` | parameters alone |
//! | `found`, `tables` | what an optimum is |

mod design;
mod found;
mod tables;
#[cfg(test)]
mod tests;

pub use found::{
    ConditionMet, ControlFound, Found, Judged, OptimizeFailure, OptimumReport, ParameterFound,
    Progress, Refinement, Replayed, StartFound, Status, Step,
};

use crate::design::refused;
use holonom_model::{Model, ModelText, Optimize, Override};

/// Finds an optimum of a model; `progress` sees each iteration, false stops.
///
/// # Errors
/// [`OptimizeFailure`]; how a search ended is a [`Status`].
pub fn optimize(
    text: &ModelText,
    overrides: &[Override],
    model: &Model,
    progress: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Found, OptimizeFailure> {
    let settings = model.optimize.clone().unwrap_or_else(Optimize::default);
    if model.controls.is_empty() && settings.parameters.is_empty() {
        let help =
            "add a [[control]], or [optimize] with parameters = { NAME = { min = …, max = … } }";
        return Err(refused("optimize", "a search in which nothing is free", help).into());
    }
    if model.controls.is_empty() {
        return design::design(text, overrides, model, &settings, progress);
    }
    let what = "a search for controls, for which this program has no method";
    let help = "build it with its feature: `cargo install holonom-cli --features optimize`";
    Err(refused("control", what, help).into())
}
