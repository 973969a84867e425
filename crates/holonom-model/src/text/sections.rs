//! The sections of a model file.

/// Sections that are one table.
pub(crate) const TABLES: [&str; 2] = ["model", "simulation"];
/// Sections that are lists of named components.
pub(crate) const LISTS: [&str; 10] =
    ["frame", "body", "beam", "particle", "bar", "joint", "constraint", "spring", "load", "sensor"];
/// The section of parameters.
pub(crate) const PARAMETERS: &str = "parameters";
