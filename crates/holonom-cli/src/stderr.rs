//! Standard error: messages for people; errors of writing them are ignored.

use std::borrow::Cow;
use std::io::Write;

use crate::captured::{self, Stream};

/// Writes words; control characters in them are written as escapes.
pub(crate) fn print(words: &str) {
    styled(&visible(words));
}

/// Writes a line.
pub(crate) fn line(words: &str) {
    print(&format!("{words}\n"));
}

/// Writes words as they are, with the colours that the program chose.
pub(crate) fn styled(words: &str) {
    if captured::take(Stream::Error, words.as_bytes()) {
        return;
    }
    let mut stderr = std::io::stderr().lock();
    let _ = stderr.write_all(words.as_bytes()).and_then(|()| stderr.flush());
}

/// The words with `\u{1b}` for a control character: names and titles of a file do not command the
/// terminal.
pub(crate) fn visible(words: &str) -> Cow<'_, str> {
    if !words.contains(commands) {
        return Cow::Borrowed(words);
    }
    let mut out = String::with_capacity(words.len() + 8);
    for c in words.chars() {
        if commands(c) { out.extend(c.escape_unicode()) } else { out.push(c) }
    }
    Cow::Owned(out)
}

/// The same in as many bytes as before, `?` for each: places in a text stay what they are.
pub(crate) fn visible_in_place(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if commands(c) { out.extend(std::iter::repeat_n('?', c.len_utf8())) } else { out.push(c) }
    }
    out
}

/// Characters that a terminal obeys instead of showing them: controls, and marks that reorder what
/// is shown.
fn commands(c: char) -> bool {
    let reorders = matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    reorders || (c.is_control() && !matches!(c, '\n' | '\t' | '\r'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_become_escapes() {
        assert_eq!(visible("α\tβ\n"), "α\tβ\n");
        assert_eq!(visible("a\u{1b}[2J\u{9b}\u{7f}"), "a\\u{1b}[2J\\u{9b}\\u{7f}");
        assert_eq!(visible("a\u{202e}b"), "a\\u{202e}b");
        assert_eq!(visible_in_place("a\u{1b}\u{9b}\u{202e}b"), "a??????b");
    }
}
