//! Chores of the repository, as the program `cargo xtask` and the tests of the verifier use them.

pub mod compare;
pub mod figures;
pub mod mutants;
pub mod notation;
pub mod program;
pub mod roundoff;
pub mod stability;
pub mod verify;
