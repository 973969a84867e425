//! A section as a page of the guide.

use std::fmt::Write;

use super::{KeyRow, Presence, ReferenceSection, ReferenceTable};

impl ReferenceSection {
    /// The section as Markdown, its heading at the first level.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut out = format!("# `{}`\n\n", self.heading());
        for table in &self.tables {
            if !table.of.is_empty() {
                let names: Vec<String> = table.of.iter().map(|key| format!("`{key}`")).collect();
                let _ = writeln!(out, "## {}\n", names.join(", "));
            }
            if !table.about.is_empty() {
                let _ = writeln!(out, "{}\n", table.about);
            }
            rows(&mut out, table);
        }
        let _ = write!(out, "## Example\n\n```toml\n{}```\n", self.example);
        out
    }
}

fn rows(out: &mut String, table: &ReferenceTable) {
    let keys = table.rows.iter().any(|row| row.kind.is_some());
    let head = match (keys, table.rows.iter().all(|row| row.name.starts_with('"'))) {
        (true, _) => "| key | type | default | meaning |\n|---|---|---|---|",
        (false, true) => "| word | meaning |\n|---|---|",
        (false, false) => "| form | meaning |\n|---|---|",
    };
    let _ = writeln!(out, "{head}");
    for row in &table.rows {
        let about = row.about.replace('|', "\\|");
        let name = name(row);
        if keys {
            let (kind, presence) = (row.kind.as_deref().unwrap_or_default(), presence(row));
            let _ = writeln!(out, "| {name} | {kind} | {presence} | {about} |");
        } else {
            let _ = writeln!(out, "| {name} | {about} |");
        }
    }
    out.push('\n');
}

/// Keys and words as code, the type of a table in bold, forms of a value in words.
fn name(row: &KeyRow) -> String {
    match (&row.kind, row.name.contains('"')) {
        (None, false) => row.name.clone(),
        (None, true) if row.name.starts_with("type") => format!("**`{}`**", row.name),
        _ => format!("`{}`", row.name),
    }
}

fn presence(row: &KeyRow) -> String {
    match (&row.kind, &row.presence) {
        (None, _) => String::new(),
        (_, Presence::Required) => "required".to_owned(),
        (_, Presence::Optional) => "none".to_owned(),
        (_, Presence::Default(value)) => format!("`{value}`"),
    }
}
