//! Studies of a model.
//!
//! | module | concept |
//! |---|---|
//! | [`compare`] | variational and energy–momentum schemes side by side |
//! | [`sweep`] | a model at many points: grids and samples of its values |
//! | [`certificate`] | verified properties of the schemes on a model, and a recommended step |
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod certificate;
pub mod compare;
pub mod sweep;
