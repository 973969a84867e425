//! Optima of a model: the parameters, or the controls and the time, of least cost that meet the
//! conditions.
//!
//! | file | concept |
//! |---|---|
//! | `control`, `reader`, `searched`, `verdict` | controls, and the time: a search, what it is asked for, what it has found |
//! | `design`, `rows` | parameters alone: a search, what it counts |
//! | `beside` | parameters beside controls |
//! | `node` | times on nodes and within bounds |
//! | `found`, `tables` | what an optimum is |
//! | `halved` | conditions between nodes |
//! | `kept` | where a search ended, to go on from |

mod beside;
#[cfg(test)]
mod beside_tests;
mod control;
#[cfg(test)]
mod control_tests;
mod design;
mod found;
mod halved;
mod kept;
mod node;
mod reader;
mod rows;
mod searched;
#[cfg(test)]
mod sensor_tests;
mod tables;
#[cfg(test)]
mod tests;
mod verdict;

pub use found::{
    ConditionMet, ControlFound, FoundOptimum, Judged, OptimizeFailure, OptimumReport,
    ParameterFound, ProblemSize, Refinement, Replayed, SearchProgress, SearchStatus, SearchStep,
    SearchWatch, StartFound,
};

pub use kept::{KeptSearch, ProgramPoint, SearchEnd};
pub use vi_control::program::Iterate;

use crate::design::refused;
use holonom_model::{Model, ModelText, Override};
use vi_control::program::NlpSolver;

/// Finds an optimum of a model by the method that is compiled in: with the feature `pounce`
/// `vi_control::Pounce`, else none, which is enough for parameters. `from`: where an earlier search
/// of the same controls ended.
///
/// # Errors
/// [`OptimizeFailure`]; how a search ended is a [`SearchStatus`].
pub fn optimize_by_own_method(
    text: &ModelText,
    overrides: &[Override],
    model: &Model,
    from: Option<&ProgramPoint>,
    progress: &SearchWatch,
) -> Result<FoundOptimum, OptimizeFailure> {
    #[cfg(feature = "pounce")]
    {
        let settings = model.optimize.clone().unwrap_or_default();
        let mut method = vi_control::Pounce { max_iterations: settings.max_iterations };
        optimize((text, overrides, model), Some(&mut method), from, progress)
    }
    #[cfg(not(feature = "pounce"))]
    optimize((text, overrides, model), None, from, progress)
}

/// Finds an optimum of a model; `method`: what solves nonlinear programs, for controls; `from`:
/// where an earlier search of these ended.
///
/// # Errors
/// [`OptimizeFailure`]; how a search ended is a [`SearchStatus`].
pub fn optimize(
    (text, overrides, model): (&ModelText, &[Override], &Model),
    method: Option<&mut dyn NlpSolver>,
    from: Option<&ProgramPoint>,
    progress: &SearchWatch,
) -> Result<FoundOptimum, OptimizeFailure> {
    let settings = model.optimize.clone().unwrap_or_default();
    if model.controls.is_empty() && settings.parameters.is_empty() {
        let help =
            "add a [[control]], or [optimize] with parameters = { NAME = { min = …, max = … } }";
        return Err(refused("optimize", "a search in which nothing is free", help).into());
    }
    if model.controls.is_empty() {
        let watch = &mut |at: &SearchProgress| (progress.borrow_mut())(at);
        return design::design(text, overrides, model, &settings, watch);
    }
    if let Some(method) = method {
        let from = from.map(ProgramPoint::held);
        let method = (method, progress);
        if !settings.parameters.is_empty() {
            return beside::both((text, overrides, model), &settings, method, from.as_ref());
        }
        return control::control(model, &settings, method, from.as_ref());
    }
    let what = "a search for controls, for which this program has no method";
    let help = "build it with its feature: `cargo install --path crates/holonom-cli --features optimize`, \
                the Python package by `.ci/wheel --features optimize`; in Python name a method: \
                `optimize(model, method=holonom.ipopt.solve)`";
    Err(refused("control", what, help).into())
}
