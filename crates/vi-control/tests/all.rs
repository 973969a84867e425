//! Tests of this crate, in one binary.
#![allow(clippy::unwrap_used)] // tests

#[path = "../../../tests/harness/control_case.rs"]
mod support;

mod chart_derivatives;
mod fits;
mod optima;
mod program_derivatives;
mod small_programs;
