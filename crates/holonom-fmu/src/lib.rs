//! A model as a functional mock-up unit (FMI 2.0 and 3.0, co-simulation).
//!
//! ```text
//! model.toml ─► Interface ─► modelDescription.xml ─┐
//!     │             │                              ├─► model.fmu = description + resources + library
//!     └─────────────┼─► Resources ─────────────────┘
//!                   └─► Instance: initialization, steps with held inputs, outputs, states
//! ```
//! The unit holds the model as data and a library that is the same for all models. Exporter and
//! library compute the variables by one function, [`Interface::of`], so that both agree; the token
//! of the unit is the digest of what they are computed from.
//!
//! | file | concept |
//! |---|---|
//! | [`interface`] | the variables of a model: parameters, inputs, outputs |
//! | [`names`] | names by the convention of the standard |
//! | [`unit`](mod@unit) | units by the base units |
//! | [`description`] | `modelDescription.xml` |
//! | [`resources`] | what the unit holds of the model, and its token |
//! | [`library`] | platform and mark of a library |
//! | [`archive`] | the file `.fmu` |
//! | [`instance`] | the life of an instance: its phases, its values, its steps |
//! | `run` | the simulation of an instance with its inputs |
//!
//! The C functions are in `holonom-fmi`.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod archive;
pub mod description;
pub mod instance;
pub mod interface;
pub mod library;
pub mod names;
pub mod resources;
mod run;
pub mod unit;

pub use archive::Unit;
pub use description::Version;
pub use instance::{Instance, Phase, SavedState, Severity, Stepped, UnitRefusal};
pub use interface::{Causality, Interface, UnitRequest, Variable, VariableRole};
pub use resources::Resources;

/// The version that library and exporter have to share.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
/// The name of the library in a unit.
pub const MODEL_IDENTIFIER: &str = "holonom";
