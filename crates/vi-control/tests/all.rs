//! Tests of this crate, in one binary.
#![allow(clippy::unwrap_used)] // tests

#[path = "../../../tests/harness/control_case.rs"]
mod support;

mod beams;
mod chart_derivatives;
mod cost;
mod defects;
mod duality;
mod fits;
mod gradients;
mod optima;
mod program_derivatives;
mod refusals;
mod runs;
mod small_programs;
