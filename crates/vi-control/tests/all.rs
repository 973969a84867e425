//! Tests of this crate, in one binary.
#![allow(clippy::unwrap_used)] // tests

#[cfg_attr(not(feature = "pounce"), allow(dead_code))] // optima run it
#[path = "../../../tests/harness/control_case.rs"]
mod control_case;
#[path = "../../../tests/harness/identification_case.rs"]
mod identification_case;

mod beams;
mod chart_derivatives;
mod costates;
mod defects;
mod designs;
mod duality;
mod fits;
mod galerkin;
mod galerkin_time;
mod gradients;
mod growth;
mod identifications;
mod moved_joints;
mod optima;
mod problems;
mod program_derivatives;
mod refusals;
mod runs;
mod small_programs;
