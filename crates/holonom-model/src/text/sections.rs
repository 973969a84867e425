//! The sections of a model file.

/// Sections that are one table.
pub(crate) const TABLES: [&str; 2] = ["model", "simulation"];
/// Sections that are lists of named components.
pub(crate) const LISTS: [&str; 14] = [
    "frame",
    "body",
    "beam",
    "particle",
    "bar",
    "joint",
    "constraint",
    "spring",
    "load",
    "law",
    "table",
    "signal",
    "sensor",
    "event",
];

/// Whether a text at this key path is an expression that is evaluated along the run.
pub(crate) fn is_formula(path: &str) -> bool {
    let mut parts = path.split('.');
    let (section, _, key) = (parts.next(), parts.next(), parts.next());
    key.is_some_and(|key| match section {
        Some("law") => FORMULAS.contains(&key),
        Some("signal") => match parts.next() {
            None => ["value", "rate"].contains(&key),
            Some(within) => OF_SIGNALS.contains(&within),
        },
        Some("event") => key == "when",
        _ => false,
    })
}

/// Keys of a law that are such expressions.
pub(crate) const FORMULAS: [&str; 4] = ["effort", "tension", "force", "torque"];
/// Keys within those of a signal that are such expressions.
pub(crate) const OF_SIGNALS: [&str; 2] = ["of", "feedforward"];
/// The section of parameters.
pub(crate) const PARAMETERS: &str = "parameters";
