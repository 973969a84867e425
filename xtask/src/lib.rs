//! Chores of the repository, as the program `cargo xtask` and the tests of the verifier use them.

pub mod compare;
pub mod figures;
pub mod fuzz;
pub mod interrupt;
pub mod notation;
pub mod program;
pub mod reliability;
pub mod roundoff;
mod scratch;
pub mod soak;
pub mod stability;
mod text_file;
pub mod verify;
