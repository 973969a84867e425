//! Model text that knows from which file each of its values comes.

use std::ops::Range;

/// A part of the merged text, and where it stands in a file.
#[derive(Clone, Debug)]
pub(super) struct TextPiece {
    pub(super) merged: Range<usize>,
    pub(super) file: usize,
    pub(super) place: Range<usize>,
}

/// Text with its pieces.
#[derive(Default)]
pub(super) struct Writer {
    pub(super) text: String,
    pub(super) pieces: Vec<TextPiece>,
}

impl Writer {
    /// Notes that the text since `start` comes from a place of a file.
    pub(super) fn piece(&mut self, start: usize, file: usize, place: Range<usize>) {
        self.pieces.push(TextPiece { merged: start..self.text.len(), file, place });
    }

    /// Adds a key.
    pub(super) fn key(&mut self, key: &str, file: usize, place: Range<usize>) {
        let start = self.text.len();
        self.text += &key_as_toml(key);
        self.piece(start, file, place);
        self.text += " = ";
    }

    /// Adds another text with its pieces.
    pub(super) fn append(&mut self, other: Self) {
        let base = self.text.len();
        self.text += &other.text;
        let moved = |piece: TextPiece| TextPiece {
            merged: piece.merged.start + base..piece.merged.end + base,
            ..piece
        };
        self.pieces.extend(other.pieces.into_iter().map(moved));
    }
}

/// A key as TOML writes it.
pub(super) fn key_as_toml(key: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    match !key.is_empty() && key.chars().all(bare) {
        true => key.to_owned(),
        false => quoted(key),
    }
}

/// A text as TOML writes it.
pub(crate) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out += "\\\"",
            '\\' => out += "\\\\",
            c if c.is_control() => out += &format!("\\U{:08X}", u32::from(c)),
            c => out.push(c),
        }
    }
    out + "\""
}
