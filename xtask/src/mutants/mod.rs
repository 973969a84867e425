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
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

/// What became of a defect.
struct Judged<'a> {
    mutant: &'a Mutant,
    outcome: Outcome,
    seconds: f64,
}

impl Judged<'_> {
    fn is_found(&self) -> bool {
        matches!(self.outcome, Outcome::Fails | Outcome::Endless)
    }

    fn verdict(&self) -> &'static str {
        match self.outcome {
            Outcome::Fails => "found",
            Outcome::Endless => "found: does not end",
            Outcome::Passes => "**SURVIVED**",
            Outcome::DoesNotCompile => "**does not compile**",
            Outcome::Missing => "**no such test**",
        }
    }
}

/// Plants all defects, or the one `--only` of which a name is given; writes the page after all.
///
/// # Errors
/// Where the copy cannot be made, or a test fails without a defect.
pub fn run(options: &[&str]) -> Result<bool, String> {
    let only = match options {
        [] => None,
        ["--only", name] => Some(*name),
        _ => return Err("[--only NAME]".into()),
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let root = root.canonicalize().map_err(|error| error.to_string())?;
    let all = list::all(&root)?;
    let chosen = |mutant: &&Mutant| only.is_none_or(|name| mutant.name.contains(name));
    let mut mutants: Vec<&Mutant> = all.iter().filter(chosen).collect();
    if mutants.is_empty() {
        return Err(format!("no defect is named `{}`", only.unwrap_or_default()));
    }
    let copy = Copy::new(&root)?;
    sound(&copy, &mutants)?;
    // those of one file follow one another: what is put back is built with the next one
    mutants.sort_by_key(|mutant| (&mutant.test.package, &mutant.edits[0].file));
    let mut judged = Vec::new();
    for mutant in mutants {
        let begin = Instant::now();
        let before = copy.plant(&mutant.edits)?;
        let outcome = copy.run(&mutant.test);
        copy.restore(&before)?;
        let one = Judged { mutant, outcome: outcome?, seconds: begin.elapsed().as_secs_f64() };
        eprintln!("{:>6.0} s  {}: {}", one.seconds, mutant.name, one.verdict());
        judged.push(one);
    }
    let place = |one: &Judged<'_>| all.iter().position(|mutant| mutant.name == one.mutant.name);
    judged.sort_by_key(place);
    let text = page(&judged);
    match only {
        None => text_file::write(&root.join("docs/verification/mutants.md"), &text)?,
        Some(_) => print!("{text}"),
    }
    Ok(judged.iter().all(Judged::is_found))
}

/// All tests pass without a defect.
fn sound(copy: &Copy, mutants: &[&Mutant]) -> Result<(), String> {
    let mut tests: Vec<&Test> = mutants.iter().map(|mutant| &mutant.test).collect();
    tests.sort();
    tests.dedup();
    let mut failed = BTreeMap::new();
    for test in tests {
        let outcome = copy.run(test)?;
        eprintln!("without a defect: {} {}: {outcome:?}", test.package, test.name);
        if outcome != Outcome::Passes {
            failed.insert(&test.name, outcome);
        }
    }
    if failed.is_empty() { Ok(()) } else { Err(format!("without a defect: {failed:?}")) }
}

/// The table of the page.
fn page(judged: &[Judged<'_>]) -> String {
    let found = judged.iter().filter(|one| one.is_found()).count();
    let mut text = format!(
        "# Defects of the sources\n\nWritten by `cargo xtask mutants`, never edited by hand. Each of \
         these defects is planted alone in a copy of the workspace; the test that names it passes \
         without it and has to fail with it. {found} of {} are found.\n\n\
         | defect | equations | file | test | |\n|---|---|---|---|---|\n",
        judged.len()
    );
    for one in judged {
        let Mutant { name, source, edits, test } = one.mutant;
        let file = edits[0].file.trim_start_matches("crates/");
        let Test { package, binary, name: path } = test;
        let binary = if binary == "lib" { "" } else { binary };
        writeln!(
            text,
            "| {name} | {source} | `{file}` | `{package}` {binary} `{path}` | {} |",
            one.verdict()
        )
        .expect("a text grows");
    }
    text
}
