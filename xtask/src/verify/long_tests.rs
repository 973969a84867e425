//! The tests that are too long for every day, as part of the full verification.

use std::path::Path;
use std::process::Command;

/// Tests with the outcome that `cargo test` printed.
pub(super) struct LongTests {
    pub(super) outcomes: Vec<(String, bool)>,
}

/// Names of the test files that hold an ignored test.
fn files(root: &Path) -> Result<Vec<String>, String> {
    let entries = std::fs::read_dir(root.join("tests")).map_err(|e| format!("tests: {e}"))?;
    let mut names = Vec::new();
    for path in entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|p| p.extension().is_some_and(|e| e == "rs"))
    {
        let text =
            std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        if text.lines().any(|line| line.trim_start().starts_with("#[ignore")) {
            names.extend(path.file_stem().map(|stem| stem.to_string_lossy().into_owned()));
        }
    }
    names.sort();
    Ok(names)
}

/// Runs all ignored tests of `tests/`.
///
/// # Errors
/// When they cannot be built or run.
pub(super) fn run(root: &Path) -> Result<LongTests, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .current_dir(root)
        .args(["test", "--release", "--workspace", "--no-fail-fast"])
        .args(files(root)?.iter().flat_map(|name| ["--test", name.as_str()]))
        .args(["--", "--ignored"])
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
