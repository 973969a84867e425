//! Defects planted in the sources, one at a time, each with the test that names it:
//! `cargo xtask mutants`.
//!
//! The integrators that `cargo xtask verify` wraps in a defect cannot reach what stands within a
//! law, a sweep or a solver. Here the text of a copy of the workspace is changed, and one test is
//! run: it has to fail, and to pass before. The list is `xtask/mutants.toml`.

mod copy;
pub mod list;

use copy::{Copy, Outcome};
use holonom_reliability::text_file;
use list::{Mutant, Test};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// What became of a defect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Planted(Outcome),
    /// The test does not pass without it either.
    Unsound,
}

impl Verdict {
    fn is_found(self) -> bool {
        matches!(self, Self::Planted(Outcome::Fails | Outcome::Endless))
    }

    fn words(self) -> &'static str {
        match self {
            Self::Planted(Outcome::Fails) => FOUND,
            Self::Planted(Outcome::Endless) => "found: does not end",
            Self::Planted(Outcome::Passes) => "**SURVIVED**",
            Self::Planted(Outcome::DoesNotCompile) => "**does not compile**",
            Self::Planted(Outcome::Missing) => "**no such test**",
            Self::Unsound => "**fails without it**",
        }
    }
}

const FOUND: &str = "found";
const PAGE: &str = "docs/verification/mutants.md";

/// Plants all defects, or those whose names hold the word after `--only`; after each one its row of
/// the page is written, all others stay.
///
/// # Errors
/// Where the copy cannot be made, or the page not be written.
pub fn run(options: &[&str]) -> Result<bool, String> {
    let only = match options {
        [] => "",
        ["--only", name] => *name,
        _ => return Err("[--only NAME]".into()),
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let root = root.canonicalize().map_err(|error| error.to_string())?;
    let all = list::all(&root)?;
    let mut mutants: Vec<&Mutant> = all.iter().filter(|one| one.name.contains(only)).collect();
    if mutants.is_empty() {
        return Err(format!("no defect is named `{only}`"));
    }
    let copy = Copy::new(&root)?;
    // those of one file follow one another: what is put back is built with the next one
    mutants.sort_by_key(|mutant| (&mutant.test, &mutant.edits[0].file));
    let path = root.join(PAGE);
    let (mut found, mut sound) = (true, BTreeMap::new());
    for mutant in mutants {
        let begin = Instant::now();
        let passes = match sound.get(&mutant.test) {
            Some(passes) => *passes,
            None => copy.run(&mutant.test)? == Outcome::Passes,
        };
        sound.insert(&mutant.test, passes);
        let verdict = judged(&copy, mutant, passes)?;
        found &= verdict.is_found();
        let seconds = begin.elapsed().as_secs_f64();
        eprintln!("{seconds:>6.0} s  {}: {}", mutant.name, verdict.words());
        let known = text_file::read(&path).unwrap_or_default();
        text_file::write(&path, &page(&all, &known, (&mutant.name, verdict, copy.commit())))?;
    }
    Ok(found)
}

/// What becomes of a defect, where its test passes without it.
fn judged(copy: &Copy, mutant: &Mutant, sound: bool) -> Result<Verdict, String> {
    if !sound {
        return Ok(Verdict::Unsound);
    }
    let before = copy.plant(&mutant.edits)?;
    let outcome = copy.run(&mutant.test);
    copy.restore(&before)?;
    outcome.map(Verdict::Planted)
}

/// The page with a verdict and the commit it is of; other rows are those of the page that is known.
fn page(all: &[Mutant], known: &str, (name, verdict, commit): (&str, Verdict, &str)) -> String {
    let row = |mutant: &Mutant| {
        let Mutant { name: own, source, edits, test } = mutant;
        let file = edits[0].file.trim_start_matches("crates/");
        let Test { package, binary, name: path, .. } = test;
        let binary = if binary == "lib" { "" } else { binary };
        let head = format!("| {own} | {source} | `{file}` | `{package}` {binary} `{path}` |");
        if own == name {
            return format!("{head} {} | {commit} |", verdict.words());
        }
        let before = known.lines().find(|line| line.starts_with(&head));
        before.map_or_else(|| format!("{head} not run | |"), str::to_owned)
    };
    let rows: Vec<String> = all.iter().map(row).collect();
    let found = rows.iter().filter(|row| row.contains(&format!("| {FOUND}"))).count();
    format!(
        "# Defects of the sources\n\nWritten by `cargo xtask mutants`, never edited by hand. Each of \
         these defects is planted alone in a copy of the workspace; the test that names it passes \
         without it and has to fail with it. {found} of {} are found. The last column: the commit \
         in which it was planted.\n\n\
         | defect | equations | file | test | | commit |\n|---|---|---|---|---|---|\n{}\n",
        rows.len(),
        rows.join("\n")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mutant(name: &str) -> Mutant {
        let own = |text: &str| text.to_owned();
        let edit = list::Edit { file: own("crates/a/b.rs"), from: own("x"), to: own("y") };
        let (package, binary, features) = (own("a"), own("lib"), Vec::new());
        let test = Test { package, binary, name: own("tests::t"), features };
        Mutant { name: own(name), source: own("1"), edits: vec![edit], test }
    }

    #[test]
    fn a_verdict_changes_its_own_row_of_the_page() {
        let [first, second] = ["first", "second"].map(mutant);
        let all = [first, second];
        let found = Verdict::Planted(Outcome::Fails);
        let text = page(&all, "", ("first", found, "c1"));
        assert!(text.contains("1 of 2 are found"), "{text}");
        assert!(text.contains("| first | 1 | `a/b.rs` | `a`  `tests::t` | found | c1 |"), "{text}");
        assert!(text.contains("not run"), "{text}");
        let text = page(&all, &text, ("second", Verdict::Planted(Outcome::Passes), "c2"));
        assert!(text.contains("1 of 2") && text.contains("SURVIVED** | c2"), "{text}");
        assert!(text.contains("| found | c1 |") && !text.contains("not run"), "{text}");
        // what is now elsewhere has not been planted
        let mut all = all;
        all[0].edits[0].file = "crates/a/c.rs".into();
        let text = page(&all, &text, ("second", found, "c3"));
        assert!(text.contains("`a/c.rs` | `a`  `tests::t` | not run"), "{text}");
    }
}
