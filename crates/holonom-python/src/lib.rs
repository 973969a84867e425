//! The compiled part of the Python package `holonom`.
//!
//! The package is a typed layer of Python over this module, `holonom._core`: models, runs into
//! arrays, one step after another, the other verbs as their JSON and their words.
//!
//! | file | concept |
//! |---|---|
//! | `errors` | exceptions, which are defined in Python |
//! | `acting`, `law` | what Python lets act on a run: inputs, laws, forces, paths, a controller |
//! | `model` | a valid model with the text that it was made of |
//! | `recording` | the nodes of a run, as arrays |
//! | `simulate` | a run from its start to its end, in memory or with files |
//! | `stepper` | one step after another, with inputs held over a step |
//! | `design` | gradients of objectives, unknown numbers from measurements, optima |
//! | `method` | methods for nonlinear programs that are functions of Python |
//! | `ensemble` | many steppers, a step of all in one call |
//! | `rollout` | members that run side by side in lanes |
//! | `fault` | what a function of Python raised within a step |
//! | `folder` | the tables of a folder |
//! | `points` | the folder of a sweep |
//! | `watch` | Ctrl-C and progress, while the interpreter is free |
//! | `verbs` | the other verbs of the program |
//!
//! The interpreter is released wherever no function of Python is called. `law` calls machine code
//! at an address, the only place that is `unsafe`.
#![deny(missing_docs)]

mod acting;
mod analyses;
mod design;
mod ensemble;
mod errors;
mod fault;
mod folder;
mod law;
mod method;
mod model;
mod points;
mod recording;
mod rollout;
mod simulate;
mod stepper;
mod verbs;
mod watch;

use pyo3::prelude::*;

/// The compiled part of the package `holonom`; use that.
#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    verbs::refuse(cfg!(panic = "abort"))?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<model::Model>()?;
    module.add_class::<stepper::Stepper>()?;
    module.add_class::<ensemble::Ensemble>()?;
    module.add_class::<acting::Acting>()?;
    module.add_class::<acting::BodyState>()?;
    module.add_class::<watch::Interruption>()?;
    module.add_class::<method::Program>()?;
    module.add_class::<points::SweepFolder>()?;
    module.add_function(wrap_pyfunction!(simulate::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(simulate::simulate_into, module)?)?;
    module.add_function(wrap_pyfunction!(simulate::resume, module)?)?;
    module.add_function(wrap_pyfunction!(rollout::rollout, module)?)?;
    module.add_function(wrap_pyfunction!(folder::read_table, module)?)?;
    module.add_function(wrap_pyfunction!(folder::units, module)?)?;
    module.add_function(wrap_pyfunction!(folder::summary, module)?)?;
    module.add_function(wrap_pyfunction!(folder::write_page, module)?)?;
    module.add_function(wrap_pyfunction!(folder::export, module)?)?;
    analyses::add(module)?;
    design::add(module)?;
    verbs::add(module)
}
