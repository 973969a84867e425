//! Studies of a model.
//!
//! | module | concept |
//! |---|---|
//! | [`mod@bench`] | what a step of a model costs, and its parts |
//! | [`compare`] | variational and energy–momentum schemes side by side |
//! | [`sweep`] | a model at many points: grids and samples of its values |
//! | [`certificate`] | verified properties of the schemes on a model, and a recommended step |
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod bench;
pub mod certificate;
mod clock;
pub mod compare;
mod equations;
pub mod sweep;
