//! The sections of a model file.

/// Sections that are one table.
pub(crate) const TABLES: [&str; 4] = ["model", "simulation", "optimize", "identify"];
/// Sections that are lists of components.
pub(crate) const LISTS: [&str; 20] = [
    "frame",
    "body",
    "beam",
    "particle",
    "bar",
    "joint",
    "constraint",
    "contact",
    "spring",
    "bushing",
    "load",
    "law",
    "table",
    "signal",
    "sensor",
    "event",
    "control",
    "objective",
    "condition",
    "measurement",
];

/// Whether a text at this key path is an expression that is evaluated along the run.
pub(crate) fn is_formula(path: &str) -> bool {
    let mut parts = path.split('.');
    let (section, _, key) = (parts.next(), parts.next(), parts.next());
    section.zip(key).is_some_and(|(section, key)| match parts.next() {
        Some(within) if section == "signal" => OF_SIGNALS.contains(&within),
        Some(within) if key == MOTOR => OF_MOTORS.contains(&within) && parts.next().is_none(),
        Some(_) if section == "constraint" && key == "terms" => path.ends_with(".factor"),
        Some(_) if ["load", "constraint"].contains(&section) => false,
        _ => has_formulas(section, key),
    })
}

/// Whether the key of a section holds such expressions.
pub(crate) fn has_formulas(section: &str, key: &str) -> bool {
    match section {
        "law" => ["effort", "tension", "force", "torque"].contains(&key),
        "bushing" => ["stiffness", "damping", "force"].contains(&key),
        "signal" => ["value", "rate"].contains(&key),
        "event" => key == "when",
        "load" => key == "history",
        "constraint" => ["path", "value"].contains(&key),
        "sensor" => key == "value",
        _ => false,
    }
}

/// The key of the motors of joints.
pub(crate) const MOTOR: &str = "motor";
/// Keys within those of a motor that may be such expressions.
pub(crate) const OF_MOTORS: [&str; 2] = ["history", "path"];
/// Keys within those of a signal that are such expressions.
pub(crate) const OF_SIGNALS: [&str; 2] = ["of", "feedforward"];
/// The section of parameters.
pub(crate) const PARAMETERS: &str = "parameters";
