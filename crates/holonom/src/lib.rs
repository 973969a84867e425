//! The facade: from a model file to a trajectory and a report.
//!
//! ```text
//! model.toml → Model → Simulation → Sample, Sample, … → RunFolder: trajectory.csv, summary.json, …
//! ```
//!
//! | room | concept |
//! |---|---|
//! | [`model`] | the model file: types, checks, errors with places |
//! | [`system`] | from a model to numbers |
//! | [`simulation`] | the system of a model, and its run |
//! | [`sample`] | what a run delivers at a node |
//! | [`output`] | the files of a run |
//! | [`report`] | plots and the report page |
//! | [`run`] | all of it in one call |
//!
//! This crate reads and writes files; it knows no terminal. A run in memory:
//!
//! ```
//! use holonom::{Model, Simulation};
//!
//! let text = r#"
//!     model = { name = "pendulum", dimension = 2, gravity = [0.0, -9.81] }
//!     particle = [{ name = "bob", mass = 1.0, position = [1.0, 0.0] }]
//!     bar = [{ name = "rod", from = "ground", to = "bob" }]
//!     simulation = { step = 0.01, end = 1.0 }
//! "#;
//! let model = Model::from_toml(text)?;
//! let mut simulation = Simulation::new(&model)?;
//! let mut heights = Vec::new();
//! let mut observe = |sample: &holonom::Sample| -> Result<(), std::convert::Infallible> {
//!     heights.push(sample.q[1]);
//!     Ok(())
//! };
//! simulation.run(&mut observe, &mut |_, _| {})?;
//! assert_eq!(heights.len(), 101);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod assembly;
pub mod model;
pub mod output;
pub mod report;
pub mod run;
pub mod sample;
pub mod simulation;
pub mod system;

pub use model::{Model, ModelError};
pub use output::{RunFolder, Summary};
pub use sample::{Member, MemberKind, Residuals, Sample};
pub use simulation::{AssemblyReport, RunFailure, RunOutcome, Simulation};
