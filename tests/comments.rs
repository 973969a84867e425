//! Comments are read in columns: no line of a comment is longer than code may be.

use std::path::Path;

/// As `max_width` of `rustfmt.toml`, which wraps code and leaves comments alone.
const WIDTH: usize = 100;

/// The longer lines that carry a comment, by number. Fenced blocks, which hold formulas, and rows
/// of tables are not wrapped.
fn long_comments(text: &str) -> Vec<usize> {
    let mut fenced = false;
    let mut long = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let doc = ["///", "//!"].iter().find_map(|mark| line.trim_start().strip_prefix(mark));
        if let Some(doc) = doc.map(str::trim_start) {
            let fence = doc.starts_with("```");
            fenced ^= fence;
            if fenced || fence || doc.starts_with('|') {
                continue;
            }
        } else {
            fenced = false;
        }
        if has_comment(line) && line.chars().count() > WIDTH {
            long.push(number);
        }
    }
    long
}

/// Whether a comment begins in this line: two strokes at its beginning or after a space, outside of
/// strings.
fn has_comment(line: &str) -> bool {
    let starts = line.match_indices("//").map(|(at, _)| &line[..at]);
    let quotes = |before: &str| {
        before.replace(r"\\", "").replace("\\\"", "").replace("'\"'", "").matches('"').count()
    };
    starts.into_iter().any(|before| {
        before.chars().next_back().is_none_or(char::is_whitespace) && quotes(before) % 2 == 0
    })
}

/// Adds `FILE:LINE` of each long comment in the Rust files of a folder of sources.
fn search(folder: &Path, found: &mut Vec<String>, files: &mut usize) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        if entry.file_type().unwrap().is_dir() {
            if !name.starts_with('.') && name != "target" {
                search(&path, found, files);
            }
        } else if name.ends_with(".rs") {
            *files += 1;
            let text = std::fs::read_to_string(&path).unwrap();
            found.extend(
                long_comments(&text).iter().map(|line| format!("{}:{line}", path.display())),
            );
        }
    }
}

#[test]
fn comments_are_wrapped() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let (mut found, mut files) = (Vec::new(), 0);
    search(root, &mut found, &mut files);
    println!("{files} files, {} comments beyond {WIDTH} columns", found.len());
    assert!(files > 500, "{files}");
    assert!(found.is_empty(), "longer than {WIDTH} characters:\n{}", found.join("\n"));
}

#[test]
fn only_long_comments_are_found() {
    let (short, long) = ("é".repeat(90), "é".repeat(100));
    let text = [
        format!("//! {long}"),
        format!("//! {short}"),
        format!("let a = 1; // {long}"),
        format!("let a = \"// {long}\";"),
        format!("let a = \"https://{long}\";"),
        format!("let a = \"\\\"\"; // {long}"),
        format!("    /// | {long} |"),
        "    /// ```text".to_owned(),
        format!("    /// {long}"),
        "    /// ```".to_owned(),
        format!("    /// {long}"),
    ];
    assert_eq!(long_comments(&text.join("\n")), [1, 3, 6, 11]);
}
