//! From a model to a trajectory.
//!
//! ```text
//! Model → System → Simulation → Sample, Sample, … → RunFolder: trajectory.csv, summary.json, …
//! ```
//!
//! | module | concept |
//! |---|---|
//! | [`system`] | from a model to numbers |
//! | [`design`] | how the numbers change with parameters |
//! | [`dynamics`] | what acts, as both families of schemes receive it |
//! | [`simulation`] | the system of a model, and its run |
//! | [`gradient`] | derivatives of its objectives by parameters, controls, initial values |
//! | [`mod@optimize`] | optima: parameters, controls |
//! | [`identification`] | its unknown numbers from measurements |
//! | [`statics`] | its equilibria along the loads |
//! | [`modes`] | natural frequencies and shapes about a configuration |
//! | [`experiment`] | what can be run: a motion, or equilibria |
//! | [`RunState`] | the state of a run between two steps |
//! | [`sample`] | what a run delivers at a node |
//! | [`sensor`] | what its sensors measure there |
//! | `shown` | the same with its derivatives |
//! | [`output`] | the files of a run |
//!
//! | type | is |
//! |---|---|
//! | [`Simulation`](simulation::Simulation), [`Statics`](statics::Statics) | what runs: a motion, or equilibria |
//! | [`Sample`](sample::Sample), [`Summary`](output::Summary) | a recorded node; a run in numbers |
//! | [`RunState`], [`Recorder`](output::Recorder), [`Checkpoint`](output::Checkpoint) | a run between two steps: its state, its files, both in one file |
//! | `RowTable`, [`SensorColumn`](sensor::SensorColumn) | the files of rows and their columns, for all who write or read them |
//!
//! This crate writes files; it draws nothing and knows no terminal.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod assembly;
pub mod design;
pub mod digits;
mod event;
pub mod gradient;
pub mod identification;
pub mod modes;
pub mod optimize;
pub mod output;
mod random;
mod resolution;
pub mod response;
mod run;
pub mod sensor;
mod shown;
pub mod simulation;
mod start;
pub mod statics;
mod stepper;
pub mod system;

pub use assembly::{Counts, is_note};
pub use event::{EventJump, EventRecord};
pub use resolution::limits::Stiffness;
pub use resolution::rotation::FastestRotation;
pub use resolution::unstable_steps::UnstableSteps;
pub use resolution::{Fastest, Resolution};
pub use run::run_state::{NoState, RunState};
pub use run::{contacts, experiment, sample};
pub use system::beams::{BeamParts, Beams};
#[doc(inline)]
pub use system::dynamics;
