//! From a model to a trajectory.
//!
//! ```text
//! Model → System → Simulation → Sample, Sample, … → RunFolder: trajectory.csv, summary.json, …
//! ```
//!
//! | module | concept |
//! |---|---|
//! | [`system`] | from a model to numbers |
//! | [`dynamics`] | what acts, as both families of schemes receive it |
//! | [`simulation`] | the system of a model, and its run |
//! | [`statics`] | its equilibria along the loads |
//! | [`modes`] | natural frequencies and shapes about a configuration |
//! | [`experiment`] | what can be run: a motion, or equilibria |
//! | [`RunState`] | the state of a run between two steps |
//! | [`sample`] | what a run delivers at a node |
//! | [`sensor`] | what its sensors measure there |
//! | [`output`] | the files of a run |
//!
//! | type | is |
//! |---|---|
//! | [`Simulation`](simulation::Simulation), [`Statics`](statics::Statics) | what runs: a motion, or equilibria |
//! | [`Sample`](sample::Sample), [`Summary`](output::Summary) | a recorded node; a run in numbers |
//! | [`RunState`], [`Recorder`](output::Recorder), [`Checkpoint`](output::Checkpoint) | a run between two steps: its state, its files, both in one file |
//! | `RowTable`, [`Column`](sensor::Column) | the files of rows and their columns, for all who write or read them |
//!
//! This crate writes files; it draws nothing and knows no terminal.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod agreement;
mod assembly;
mod bar_loops;
mod beams;
pub mod digits;
mod divided_steps;
mod drive;
pub mod dynamics;
mod energies;
mod energy_watch;
pub mod experiment;
mod limits;
mod loops;
mod measures;
pub mod modes;
mod names;
mod outcome;
pub mod output;
mod plausibility;
mod resolution;
mod rotation;
mod rotation_stability;
mod rotor;
mod rough_start;
mod run_state;
pub mod sample;
pub mod sensor;
pub mod simulation;
mod start;
pub mod statics;
mod stepper;
pub mod system;
mod unstable_steps;

pub use assembly::{Counts, is_note};
pub use beams::{BeamParts, Beams};
pub use limits::Stiffness;
pub use resolution::{Fastest, Resolution};
pub use rotation::FastestRotation;
pub use run_state::RunState;
pub use unstable_steps::UnstableSteps;
