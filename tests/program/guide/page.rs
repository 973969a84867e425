//! A page of the guide: its lines and its fenced blocks.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

pub(super) struct Page {
    pub(super) path: PathBuf,
    pub(super) lines: Vec<String>,
}

/// A fenced block.
#[derive(Clone)]
pub(super) struct Block {
    /// `toml`, `sh`, `text`, …
    pub(super) language: String,
    /// The line of text before it.
    pub(super) label: String,
    /// Its lines, without the fences.
    pub(super) lines: Range<usize>,
}

impl Page {
    pub(super) fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Self { path: path.to_owned(), lines: text.lines().map(str::to_owned).collect() }
    }

    pub(super) fn write(&self) {
        fs::write(&self.path, self.lines.join("\n") + "\n").unwrap();
    }

    pub(super) fn text(&self, lines: Range<usize>) -> String {
        self.lines[lines].iter().map(|line| format!("{line}\n")).collect()
    }

    pub(super) fn blocks(&self) -> Vec<Block> {
        let mut blocks = Vec::new();
        let mut open: Option<Block> = None;
        let mut label = String::new();
        for (number, line) in self.lines.iter().enumerate() {
            match (line.strip_prefix("```"), &mut open) {
                (Some(_), Some(_)) => {
                    let mut block = open.take().unwrap();
                    block.lines.end = number;
                    blocks.push(block);
                    label.clear();
                }
                (Some(language), None) => {
                    let lines = number + 1..number + 1;
                    let language = language.trim().to_owned();
                    open = Some(Block { language, label: label.clone(), lines });
                }
                (None, None) if !line.trim().is_empty() => label.clone_from(line),
                _ => {}
            }
        }
        assert!(open.is_none(), "{}: a block has no end", self.path.display());
        blocks
    }
}
