//! The C functions, called as a tool calls them, against the runs of the program.
//!
//! Outputs have the bits of `sensors.csv`; states go back and to other instances bit for bit; each
//! call in each phase is allowed or refused by name.
#![allow(unsafe_code, reason = "the C interface is called")]
#![allow(clippy::unwrap_used)] // tests

#[path = "functions/unit.rs"]
mod unit;

#[path = "functions/bits.rs"]
mod bits;
#[path = "functions/lint.rs"]
mod lint;
#[path = "functions/phases.rs"]
mod phases;
#[path = "functions/random.rs"]
mod random;
#[path = "functions/states.rs"]
mod states;
#[path = "functions/steps.rs"]
mod steps;
