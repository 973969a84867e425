//! The facade: from a model file to a trajectory and a report.
//!
//! ```text
//! model.toml → Model → Simulation → Sample, Sample, … → RunFolder: trajectory.csv, summary.json, …
//! ```
//!
//! | room | concept |
//! |---|---|
//! | [`model`] | the model file: types, checks, errors with places |
//! | [`simulation`] | the system of a model, and its run |
//! | [`sample`] | what a run delivers at a node |
//! | [`output`] | the files of a run |
//! | [`report`] | plots and the report page |
//! | [`run`] | all of it in one call |
//!
//! This crate reads and writes files; it knows no terminal.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod model;
pub mod output;
pub mod report;
pub mod run;
pub mod sample;
pub mod simulation;

pub use model::{Model, ModelError};
pub use output::{RunFolder, Summary};
pub use sample::{Member, MemberKind, Residuals, Sample};
pub use simulation::{AssemblyReport, RunFailure, RunOutcome, Simulation};
