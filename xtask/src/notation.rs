//! Keeps the places in `NOTATION.md` up to date: each symbol and each equation with its file and
//! line.
//!
//! A row of a table ends with a cell of files, `` `node.rs` `` or ``
//! [`node.rs:57`](crates/…/node.rs#L57) ``. In a table with the column "in the code" the line is
//! that which declares the first identifier of that column; in the table of equations it is the
//! first line of code with the label of the equation in a comment, such as `// (28)` or `// [6.4]`.

use holonom_reliability::text_file;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The page with all places as they are now, and what has no place.
struct Renewed {
    page: String,
    missing: Vec<String>,
}

/// Renews the places in `NOTATION.md`; with `check` writes nothing.
///
/// # Errors
/// In words: a symbol or an equation that is not found; with `check` a place that has moved.
pub fn run(check: bool) -> Result<(), String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let path = root.join("NOTATION.md");
    let old = text_file::read(&path)?;
    let Renewed { page, missing } = renew(&root, &old)?;
    if !missing.is_empty() {
        return Err(format!("NOTATION.md names what is not there:\n{}", missing.join("\n")));
    }
    if !check {
        return text_file::write(&path, &page);
    }
    let moved: Vec<&str> =
        old.lines().zip(page.lines()).filter(|(a, b)| a != b).map(|(a, _)| a).collect();
    match moved.as_slice() {
        [] => Ok(()),
        rows => Err(format!("run `cargo xtask notation`; out of date:\n{}", rows.join("\n"))),
    }
}

fn renew(root: &Path, page: &str) -> Result<Renewed, String> {
    let mut sources = Vec::new();
    for crates in std::fs::read_dir(root.join("crates")).map_err(|e| e.to_string())?.flatten() {
        collect(&crates.path().join("src"), &mut sources);
    }
    sources.sort();
    let mut renewed = Renewed { page: String::new(), missing: Vec::new() };
    let (mut column, mut section) = (None, String::new());
    for line in page.lines() {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let row = line.starts_with('|') && cells.len() > 3;
        match row {
            false if line.starts_with("## ") => (column, section) = (None, line.to_owned()),
            true if column.is_none() => column = header(&cells),
            true if !cells[1].starts_with("---") => {
                let anchor = &anchors(cells[column.unwrap_or(1)]);
                let (last, files) = (cells[cells.len() - 2], &mut Vec::new());
                for file in named(last) {
                    match place(root, &sources, (&section, &file), anchor) {
                        Ok(found) => files.push(found),
                        Err(what) => {
                            renewed.missing.push(format!("{}: {file}{what}", cells[1]));
                        }
                    }
                }
                let head = line.trim_end().trim_end_matches('|').trim_end();
                let head = head.strip_suffix(last).unwrap_or(head);
                let _ = writeln!(renewed.page, "{head}{} |", files.join(", "));
                continue;
            }
            _ => {}
        }
        let _ = writeln!(renewed.page, "{line}");
    }
    Ok(renewed)
}

fn collect(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

/// The column that names what to look for; equations are in the first.
fn header(cells: &[&str]) -> Option<usize> {
    cells.iter().position(|cell| *cell == "in the code").or(Some(1))
}

/// What stands in backticks, the last segment of paths; or the label of an equation, in parentheses
/// or brackets.
fn anchors(cell: &str) -> Vec<String> {
    if cell.starts_with(['(', '[']) {
        let end = cell.find([')', ']']).map_or(cell.len(), |end| end + 1);
        return vec![cell[..end].to_owned()];
    }
    let code = cell.split('`').skip(1).step_by(2);
    let last = |path: &str| {
        let path = path.split(['(', '[', '<']).next().unwrap_or(path);
        path.rsplit("::").next().unwrap_or(path).to_owned()
    };
    code.map(last).collect()
}

/// The files of a cell, `interval.rs` or `pair/motion.rs`.
fn named(cell: &str) -> Vec<String> {
    let code = cell.split('`').skip(1).step_by(2);
    code.map(|name| name.split(':').next().unwrap_or(name).to_owned()).collect()
}

/// The file with this name that has an anchor, of the crate of the section if it has one, and the
/// line of the anchor.
///
/// # Errors
/// What comes after the name in a message: nothing where no file has an anchor, or the files among
/// which the name does not choose.
fn place(
    root: &Path,
    sources: &[PathBuf],
    (section, file): (&str, &str),
    anchors: &[String],
) -> Result<String, String> {
    let found = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).ok()?;
        let line = anchors.iter().find_map(|anchor| line_of(&text, anchor))?;
        Some((path.strip_prefix(root).ok()?.display().to_string(), line))
    };
    let of_crate = |(link, _): &&(String, usize)| {
        link.split('/').nth(1).is_some_and(|name| section.contains(&format!("`{name}`")))
    };
    let all: Vec<_> = sources.iter().filter(|p| p.ends_with(file)).filter_map(found).collect();
    let own: Vec<_> = all.iter().filter(of_crate).collect();
    match if own.is_empty() { all.iter().collect() } else { own }[..] {
        [(link, line)] => Ok(format!("[`{file}:{line}`]({link}#L{line})")),
        [] => Err(String::new()),
        ref several => {
            let links: Vec<&str> = several.iter().map(|(link, _)| &link[..]).collect();
            Err(format!(" stands for {}; state a folder", links.join(" and ")))
        }
    }
}

/// The line, from 1, that declares an identifier or has the label of an equation.
fn line_of(text: &str, anchor: &str) -> Option<usize> {
    let find = |test: &dyn Fn(&str) -> bool| text.lines().position(test).map(|k| k + 1);
    if anchor.starts_with(['(', '[']) {
        let code = |line: &str| {
            let (code, comment) = line.split_once("//").unwrap_or_default();
            !code.trim().is_empty() && comment.contains(anchor)
        };
        let comment = |line: &str| line.contains(anchor);
        return find(&code).or_else(|| find(&comment));
    }
    let keywords = ["fn", "struct", "enum", "trait", "type", "const", "mod"];
    let declares = |line: &str| {
        let line = line.trim_start();
        let words: Vec<&str> = line.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
        let item = words.windows(2).any(|w| keywords.contains(&w[0]) && w[1] == anchor);
        let field = line.trim_start_matches("pub ").trim_start_matches("pub(crate) ");
        let variant = |c| field.strip_prefix(anchor).is_some_and(|rest| rest.starts_with(c));
        !line.starts_with("//") && (item || variant(':') || variant(',') || variant('('))
    };
    find(&declares)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_and_renewed() {
        assert_eq!(anchors("`Interval::q0`, `q1`"), ["q0", "q1"]);
        assert_eq!(
            (anchors("(28)"), anchors("[6.4]")),
            (vec!["(28)".into()], vec!["[6.4]".into()])
        );
        assert_eq!(
            named("[`node.rs:57`](crates/vi-core/src/node.rs#L57), `pair/`"),
            ["node.rs", "pair/"]
        );
        let text = "//! (28) above\nfn step() {\n    r = 0; // (28)\n    pub lambda: f64,\n";
        assert_eq!(line_of(text, "(28)"), Some(3));
        assert_eq!((line_of(text, "step"), line_of(text, "lambda")), (Some(2), Some(4)));
        assert_eq!(line_of(text, "other"), None);
    }

    /// A name of two files chooses neither, unless one is of the crate of the section.
    #[test]
    fn a_name_of_two_files_is_refused() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let files = ["galerkin/linearization.rs", "linearization.rs"];
        let sources = files.map(|own| root.join("crates/vi-constraints/src/scheme").join(own));
        let find = |file| place(&root, &sources, ("", file), &["costates".to_owned()]);
        let error = find("linearization.rs").unwrap_err();
        assert!(error.contains(" and ") && error.contains("state a folder"), "{error}");
        let found = find("scheme/linearization.rs").unwrap();
        assert!(found.contains("src/scheme/linearization.rs#L"), "{found}");
        assert_eq!(find("other.rs").unwrap_err(), "");
    }

    #[test]
    fn notation_names_the_lines_of_today() {
        run(true).unwrap();
    }
}
