//! What can be wrong with a model, said so that it can be put right.

use std::fmt;
use std::ops::Range;

use serde::Serialize;

/// Problems that are listed at most.
pub const MAX_PROBLEMS: usize = 50;

/// One thing that is wrong in a model file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// What is wrong.
    pub message: String,
    /// Where, as a key path with components by name: `body.top.mass`. Empty: the file as a whole.
    pub key: String,
    /// Where, as bytes of the text; `None` when the value does not come from the text.
    #[serde(skip)]
    pub span: Option<Range<usize>>,
    /// What to write instead.
    pub help: Option<String>,
}

impl Problem {
    /// A problem at a key.
    pub fn new(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { message: message.into(), key: key.into(), span: None, help: None }
    }

    /// Adds what to write instead.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// With its key below another one.
    #[must_use]
    pub fn below(mut self, prefix: &str) -> Self {
        let dot = if self.key.is_empty() { "" } else { "." };
        self.key = format!("{prefix}{dot}{}", self.key);
        self
    }

    /// Adds where it stands in the text.
    #[must_use]
    pub fn at(mut self, span: Option<Range<usize>>) -> Self {
        self.span = span;
        self
    }
}

/// A problem at a key below that of a component, with what to write instead.
pub(crate) fn fault(key: &str, message: impl Into<String>, help: impl Into<String>) -> Problem {
    Problem::new(key, message).help(help)
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.key.is_empty() {
            return f.write_str(&self.message);
        }
        write!(f, "{}: {}", self.key, self.message)
    }
}

/// The level at which initial values violate a constraint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// `g(q_0) ≠ 0`; distances in m (angles in rad).
    Position,
    /// `G(q_0) v_0 ≠ 0`; m/s (rad/s).
    Velocity,
}

/// A bar or joint that the initial values do not satisfy.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inconsistency {
    /// The key of the bar or joint: `bar.rod`, `joint.hinge`, or of one of its values.
    pub key: String,
    /// Positions or velocities.
    pub level: Level,
    /// Violation of the constraint.
    pub distance: f64,
    /// Its unit.
    pub unit: &'static str,
    /// The numbers that disagree, in words; may be empty.
    pub detail: String,
    /// What would satisfy it, where that is known: `write …`.
    pub instead: Option<String>,
}

impl Inconsistency {
    /// The same as a [`Problem`] with its remedy.
    #[must_use]
    pub fn problem(&self) -> Problem {
        let (what, more) = match self.level {
            Level::Position => ("the initial configuration violates this constraint", ""),
            Level::Velocity => (
                "the initial velocities violate this constraint",
                "; stated rates of joints are then kept",
            ),
        };
        let instead = self.instead.as_deref().unwrap_or("correct the initial values");
        let unit = self.unit;
        let distance = match self.distance {
            d if (1e-3..1e6).contains(&d) => format!("{}", (d * 1e6).round() / 1e6),
            d => format!("{d:.3e}"),
        };
        let detail =
            if self.detail.is_empty() { String::new() } else { format!(": {}", self.detail) };
        Problem::new(self.key.clone(), format!("{what} by {distance} {unit}{detail}")).help(
            format!(
                "{instead}, or set `project_start = true` under [simulation] to project them onto the \
                 constraints{more}",
            ),
        )
    }
}

/// Why there is no model, or no system of it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The file cannot be read.
    #[error("cannot read the model: {reason}")]
    Unreadable {
        /// What the operating system says.
        reason: String,
    },
    /// The file is larger than [`crate::MAX_BYTES`].
    #[error("the model is larger than {} MB", limit / (1024 * 1024))]
    TooLarge {
        /// The greatest size accepted, bytes.
        limit: usize,
    },
    /// The file is not text.
    #[error("the model is not UTF-8 text: byte {offset} does not belong to a character")]
    NotUtf8 {
        /// The first byte that is no text.
        offset: usize,
    },
    /// The text is no valid model.
    #[error("the model has {} problem(s); the first: {}", .0.len(), .0.first().map_or_else(String::new, ToString::to_string))]
    Invalid(Vec<Problem>),
    /// What only shows when the numbers of the model meet; the problems know their keys.
    #[error("the model has {} problem(s); the first: {}", .0.len(), .0.first().map_or_else(String::new, ToString::to_string))]
    Assembly(Vec<Problem>),
    /// The initial values do not satisfy the constraints, and `project_start` is not set.
    #[error("the initial values are inconsistent: {}", .0.first().map_or_else(String::new, |i| i.problem().to_string()))]
    InconsistentStart(Vec<Inconsistency>),
    /// Some direction of motion has no mass: `PᵀMP` is singular.
    #[error("the mass matrix is singular: {detail}")]
    SingularMass {
        /// The key of the component concerned, such as `body.rod`; or empty.
        member: String,
        /// Which motion has no mass, and how to give it one.
        detail: String,
    },
    /// The model is valid, but this version cannot simulate it.
    #[error("{key}: not supported: {what}")]
    Unsupported {
        /// The key concerned.
        key: String,
        /// What is asked for.
        what: String,
        /// What to write instead.
        help: String,
    },
}

impl ModelError {
    /// These problems in the order of the text, one for each place.
    pub(crate) fn invalid(mut problems: Vec<Problem>) -> Self {
        let place = |p: &Problem| p.span.as_ref().map_or(usize::MAX, |s| s.start);
        problems.sort_by_key(place);
        problems.dedup_by(|b, a| a.span.is_some() && a.span == b.span);
        Self::Invalid(problems)
    }
}

/// The candidate nearest to `word`, if it is near enough to be meant.
#[must_use]
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let near = |c: &&str| edit_distance(word, c);
    let best = candidates.into_iter().min_by_key(near)?;
    (edit_distance(word, best) <= (word.chars().count() / 3).max(1)).then_some(best)
}

/// Levenshtein's distance, without regard to case.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.to_lowercase().chars().take(128).collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.to_lowercase().chars().take(128).enumerate() {
        let mut diagonal = i;
        row[0] = i + 1;
        for (j, &y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// The first few of a list of names.
#[must_use]
pub fn some(names: &[impl AsRef<str>]) -> String {
    let shown = names.iter().take(8).map(|n| format!("`{}`", n.as_ref()));
    let shown = shown.collect::<Vec<_>>().join(", ");
    if names.len() > 8 { format!("{shown}, … ({} in all)", names.len()) } else { shown }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_offered_only_if_it_is_near() {
        assert_eq!(nearest("mas", ["name", "mass", "position"]), Some("mass"));
        assert_eq!(nearest("Top", ["top", "bottom"]), Some("top"));
        assert_eq!(nearest("zebra", ["name", "mass"]), None);
        assert_eq!(nearest("mesh", ["name", "mass"]), None);
        assert_eq!(nearest("grvity", ["gravity"]), Some("gravity"));
        assert_eq!(nearest("x", []), None);
    }
}
