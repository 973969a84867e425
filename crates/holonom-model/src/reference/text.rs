//! A section for the terminal: a line for each key, its meaning below.

use std::fmt::Write;

use super::{KeyRow, Presence, ReferenceSection, ReferenceTable};

const WIDTH: usize = 100;

impl ReferenceSection {
    /// The section as plain text of at most 100 columns, examples excepted.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        for table in &self.tables {
            let title = if table.of.is_empty() { self.heading() } else { table.of.join(", ") };
            let _ = writeln!(out, "{title}");
            paragraph(&mut out, &table.about, 2);
            rows(&mut out, table);
            out.push('\n');
        }
        let _ = write!(out, "Example\n\n{}", self.example);
        out
    }
}

fn rows(out: &mut String, table: &ReferenceTable) {
    let alternatives = table.rows.iter().any(|row| row.kind.is_none());
    if !table.rows.is_empty() {
        out.push('\n');
    }
    for row in &table.rows {
        let indent = if alternatives && row.kind.is_some() { 6 } else { 2 };
        let _ = writeln!(out, "{:indent$}{}{}", "", row.name, annotation(row));
        paragraph(out, &row.about, indent + 4);
    }
}

fn annotation(row: &KeyRow) -> String {
    let Some(kind) = &row.kind else { return String::new() };
    match &row.presence {
        Presence::Required => format!(": {kind}, required"),
        Presence::Optional => format!(": {kind}, optional"),
        Presence::Default(value) => format!(": {kind}, default {value}"),
    }
}

/// Words broken into lines, indented.
fn paragraph(out: &mut String, words: &str, indent: usize) {
    let mut column = 0;
    for word in words.split_whitespace() {
        let length = word.chars().count();
        if column == 0 || column + 1 + length > WIDTH {
            let _ = write!(out, "{}{:indent$}{word}", if column == 0 { "" } else { "\n" }, "");
            column = indent + length;
        } else {
            let _ = write!(out, " {word}");
            column += 1 + length;
        }
    }
    if column > 0 {
        out.push('\n');
    }
}
