//! The tests that are too long for every day, as part of the full verification.

use crate::program::cargo;
use std::path::Path;

/// Tests with the outcome that `cargo test` printed.
pub(super) struct LongTests {
    pub(super) outcomes: Vec<(String, bool)>,
}

/// Runs the ignored tests; all of them are in the binary `systems`.
///
/// # Errors
/// When they cannot be built or run.
pub(super) fn run(root: &Path) -> Result<LongTests, String> {
    let output = cargo()
        .current_dir(root)
        .args(["test", "--release", "-p", "holonom", "--test", "systems", "--", "--ignored"])
        .output()
        .map_err(|e| format!("cargo test: {e}"))?;
    let outcomes = outcomes(&String::from_utf8_lossy(&output.stdout));
    if outcomes.is_empty() {
        let error = String::from_utf8_lossy(&output.stderr);
        return Err(format!("no ignored test ran: {}", error.lines().last().unwrap_or("")));
    }
    Ok(LongTests { outcomes })
}

/// The lines `test NAME ... ok` and `test NAME ... FAILED`.
fn outcomes(text: &str) -> Vec<(String, bool)> {
    let outcome = |line: &str| {
        let (name, outcome) = line.strip_prefix("test ")?.split_once(" ... ")?;
        matches!(outcome, "ok" | "FAILED").then(|| (name.to_owned(), outcome == "ok"))
    };
    text.lines().filter_map(outcome).collect()
}

impl LongTests {
    /// How many failed.
    pub(super) fn failed(&self) -> usize {
        self.outcomes.iter().filter(|outcome| !outcome.1).count()
    }

    /// A list for the page.
    pub(super) fn list(&self) -> String {
        let line = |(name, ok): &(String, bool)| {
            format!("- `{name}`: {}\n", if *ok { "passes" } else { "**FAIL**" })
        };
        self.outcomes.iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::outcomes;

    #[test]
    fn outcomes_are_read_off_the_lines() {
        let text = "\nrunning 2 tests\ntest a::b ... ok\ntest c ... FAILED\ntest d ... ignored\ntest result: ok";
        assert_eq!(outcomes(text), [("a::b".to_owned(), true), ("c".to_owned(), false)]);
    }
}
