//! The text of a model: values with their places, expressions, included files, and what can be
//! wrong with it.

pub(crate) mod include;
pub(crate) mod key_path;
pub(crate) mod overrides;
pub(crate) mod parameters;
pub(crate) mod places;
pub(crate) mod problem;
pub(crate) mod read;
mod reworded;
pub(crate) mod sections;
pub(crate) mod source;
mod strict;
pub(crate) mod syntax;
pub(crate) mod tangents;
pub(crate) mod wishes;
