//! Runs the commands of a page.
//!
//! - A block `toml` or `xml` below a line that ends with `` `NAME.toml`: `` is written to that
//!   file; a line that begins with `Add to` appends it. There are no other blocks `toml` or `xml`.
//! - A line `holonom …` of a block `sh` is run; `# exit code 3` at its end states how it ends.
//!   Other lines are not run.
//! - A block `text` below a block `sh` is what its commands print, without lines of measured times;
//!   a line `…` stands for any lines.
//! - Pictures below `pictures/` are files that the commands of their page write.

use std::fs;
use std::path::Path;

use super::page::{Block, Page};
use super::{links, writes};
use crate::program::command::{folder, holonom};

pub(super) struct Outcome {
    pub(super) commands: usize,
    pub(super) differences: Vec<String>,
}

pub(super) fn run(page: &mut Page) -> Outcome {
    let folder = folder("guide", &name(page));
    let mut outcome = Outcome { commands: 0, differences: Vec::new() };
    let mut printed = None;
    let mut shift = 0; // of lines, where outputs were replaced
    for mut block in page.blocks() {
        block.lines = shifted(block.lines.start, shift)..shifted(block.lines.end, shift);
        match block.language.as_str() {
            "toml" | "xml" => write_model(page, &block, &folder),
            "sh" => printed = Some(run_block(page, &block, &folder, &mut outcome)),
            "text" => {
                let none = || panic!("{}: an output without a command", page.path.display());
                let found = printed.take().unwrap_or_else(none);
                shift += compare(page, &block, &found, &mut outcome);
            }
            _ => printed = None,
        }
    }
    outcome
}

fn name(page: &Page) -> String {
    page.path.file_stem().unwrap().to_string_lossy().into_owned()
}

/// Pictures of a page that its commands have not made as they are shown; replaced where that is
/// asked for.
pub(super) fn pictures(page: &Page) -> Vec<String> {
    let made = Path::new(env!("CARGO_TARGET_TMPDIR")).join("guide").join(name(page));
    let mut stale = Vec::new();
    for link in links::of(page) {
        let Some(file) = link.target.strip_prefix("pictures/") else { continue };
        let shown = page.path.with_file_name("pictures").join(file);
        let made = fs::read(made.join(file)).unwrap_or_default();
        if writes() && !made.is_empty() {
            fs::create_dir_all(shown.parent().unwrap()).unwrap();
            fs::write(&shown, &made).unwrap();
        }
        if made.is_empty() || fs::read(&shown).unwrap_or_default() != made {
            stale.push(format!("{}: its commands do not make this picture", shown.display()));
        }
    }
    stale
}

fn shifted(line: usize, shift: isize) -> usize {
    line.checked_add_signed(shift).unwrap()
}

fn write_model(page: &Page, block: &Block, folder: &Path) {
    let place = format!("{}:{}", page.path.display(), block.lines.start);
    let label = block.label.trim_end();
    let file = label.strip_suffix("`:").and_then(|rest| rest.rsplit('`').next());
    let file = file.filter(|file| file.ends_with(&format!(".{}", block.language)));
    let file = file.unwrap_or_else(|| panic!("{place}: no file is named before the block"));
    let mut text = page.text(block.lines.clone());
    if label.starts_with("Add to") {
        let old = fs::read_to_string(folder.join(file));
        text = old.unwrap_or_else(|e| panic!("{place}: {file}: {e}")) + "\n" + &text;
    }
    fs::write(folder.join(file), text).unwrap();
}

/// Runs the lines of a block, and returns what they print.
fn run_block(page: &Page, block: &Block, folder: &Path, outcome: &mut Outcome) -> String {
    let mut printed = String::new();
    for number in block.lines.clone() {
        let line = &page.lines[number];
        let Some(rest) = line.strip_prefix("holonom ") else { continue };
        let (command, comment) = rest.split_once(" # ").unwrap_or((rest, ""));
        let code = comment.trim().strip_prefix("exit code ").unwrap_or("0");
        let arguments = arguments(command);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let output = holonom(folder, &arguments);
        let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        printed += &text.concat();
        outcome.commands += 1;
        if output.status.code() != code.parse().ok() {
            let place = format!("{}:{}", page.path.display(), number + 1);
            let status = output.status;
            outcome.differences.push(format!("{place}: {line}: {status}\n{}", text.concat()));
        }
    }
    printed
}

/// The words of a command; quotes hold words together.
fn arguments(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for c in command.trim().chars() {
        match (c, quote) {
            ('"' | '\'', None) => quote = Some(c),
            (_, Some(open)) if c == open => quote = None,
            (' ', None) => words.push(String::new()),
            _ => words.last_mut().unwrap().push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Compares an output with the page, or replaces it; by how many lines the page has grown.
fn compare(page: &mut Page, block: &Block, found: &str, outcome: &mut Outcome) -> isize {
    let shown = page.text(block.lines.clone());
    if matches(&comparable(&shown), &comparable(found)) {
        return 0;
    }
    let parts = shown.lines().any(|line| line.trim() == "…");
    if writes() && !parts {
        let lines = comparable(found);
        let grown = lines.len() as isize - block.lines.len() as isize;
        page.lines.splice(block.lines.clone(), lines);
        return grown;
    }
    let place = format!("{}:{}", page.path.display(), block.lines.start);
    outcome
        .differences
        .push(format!("{place}: the page shows\n{shown}the program prints\n{found}"));
    0
}

/// Lines without trailing blanks, and without those of measured times.
fn comparable(text: &str) -> Vec<String> {
    let timeless = text.trim_end().lines().filter(|line| !line.trim_start().starts_with("time "));
    timeless.map(|line| line.trim_end().to_owned()).collect()
}

/// Whether lines are those of a pattern, in which `…` stands for any number of them.
fn matches(pattern: &[String], lines: &[String]) -> bool {
    match pattern {
        [] => lines.is_empty(),
        [first, rest @ ..] if first.trim() == "…" => {
            (0..=lines.len()).any(|skipped| matches(rest, &lines[skipped..]))
        }
        [first, rest @ ..] => lines.first() == Some(first) && matches(rest, &lines[1..]),
    }
}

#[test]
fn a_difference_is_found() {
    let lines = |text: &str| comparable(text);
    assert!(matches(&lines("a\n…\nd"), &lines("a\nb\nc\nd\n")));
    assert!(matches(&lines("a"), &lines("a\n  time  4 s")));
    assert!(!matches(&lines("a\n…\nd"), &lines("a\nb")));
    assert!(!matches(&lines("a"), &lines("a\nb")));
    assert_eq!(arguments("run a.toml --set \"x = 1\""), ["run", "a.toml", "--set", "x = 1"]);
}
