//! Sensitivities, optimal control and identification of multibody systems.
//!
//! | file | concept |
//! |---|---|
//! | [`gradient`] | all derivatives of the cost of a run by one sweep backward |
//! | [`sensitivities`] | tangents beside a run: derivatives of the motion along directions |
//! | [`growth`] | how much a change of a motion grows, by a neighbouring run |
//! | [`objective`], [`momentum`], [`terminal_rate`], [`node`] | the cost of a run as a sum of terms |
//! | [`controls`], [`sampling`] | efforts that are chosen for each step; what is sampled at nodes |
//! | [`checkpoints`], `tape` | which states of a run are kept for the sweep backward |
//! | [`transcription`] | the steps of a motion as a nonlinear program: problem, charts, derivatives |
//! | [`program`] | nonlinear programs and methods that solve them |
//! | [`kkt`] | whether a point is an optimum |
//! | [`identification`] | parameters of a mechanism from measurements of its motion |
//! | [`least_squares`] | parameters within bounds, their covariance, combinations that data do not see |
//! | [`constrained_least_squares`] | the same under conditions: designs |
//! | [`singular_values`] | what these are found by |
//! | [`optimum`] | refinement, charts that follow, the verdict |
//! | [`replay`] | an optimum as an ordinary run |
//! | [`priced`] | its conditions as terms of a cost: how it changes with parameters |
//! | `pounce` | a method, with the feature of this name |
#![cfg_attr(not(test), deny(clippy::disallowed_methods))] // equal bits on every machine
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![warn(missing_debug_implementations)]

mod backward;
pub mod checkpoints;
pub mod constrained_least_squares;
pub mod controls;
pub mod gradient;
pub mod growth;
pub mod identification;
pub mod kkt;
pub mod least_squares;
pub mod momentum;
pub mod node;
pub mod objective;
pub mod optimum;
#[cfg(feature = "pounce")]
pub mod pounce;
pub mod priced;
pub mod program;
mod reads;
pub mod replay;
pub mod sampling;
pub mod sensitivities;
pub mod singular_values;
mod tape;
pub mod terminal_rate;
pub mod transcription;

// What the interface of this crate speaks of, for those who depend on it alone.
pub use nalgebra;
pub use vi_constraints;
pub use vi_core;
pub use vi_multibody;
pub use vi_rigid;

pub use checkpoints::Checkpoints;
pub use controls::{ControlForce, Controls, JointControl, ParticleControl, WrenchControl};
pub use gradient::{Gradient, GradientError, Task};
pub use growth::Neighbour;
pub use kkt::Kkt;
pub use objective::{CostTerm, Objective};
#[cfg(feature = "pounce")]
pub use pounce::Pounce;
pub use program::{NlpSolver, Outcome, Program};
pub use sensitivities::{Direction, Sensitivities};
pub use transcription::Transcription;
